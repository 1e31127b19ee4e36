//! The channel: decides for every message and every directed link whether it arrives, and when. A pure machine.
//!
//! Decisions about a message are functions of (seed, link, sequence number) and of the planned switching signal, never
//! of the order in which messages happen to come: two runs can be compared message by message.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::Arc;

use common::graph::switching::Switching;
use common::machine::Machine;
use common::mission::{Delay, Mission};
use common::random::Stream;
use common::record::{ClockRecord, Fate, Name, NoteRow, Record, Row, Settled, TopologyRow};
use common::time::{Span, Time};
use common::wire::state::CoordinationState;
use common::wire::{Garbage, GarbageCount};

use crate::ledger::Ledger;

/// A vehicle put bytes on the air.
#[derive(Clone, Debug, PartialEq)]
pub struct Sent {
    /// Index of the vehicle whose line they came from.
    pub from: usize,
    /// The bytes.
    pub bytes: Arc<[u8]>,
}

/// What the channel wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum Channel {
    /// Hand these bytes to that vehicle.
    Deliver {
        /// Index of the receiver.
        to: usize,
        /// When they were due.
        due: Time,
        /// The bytes.
        bytes: Arc<[u8]>,
    },
    /// Record this row.
    Record(Row),
    /// Record what became of a message.
    Settled(Settled),
}

/// The emulated network of one mission.
pub struct Emulator {
    mission: Arc<Mission>,
    /// The vehicles' names, for the rows.
    names: Vec<Name>,
    links: Vec<Wire>,
    /// Indices into `links`, by sender.
    out: Vec<Vec<usize>>,
    switching: Switching,
    up: Vec<bool>,
    next_change: Option<Time>,
    under_way: BinaryHeap<Reverse<UnderWay>>,
    /// Orders messages that are due at the same instant.
    counter: u64,
    garbage: Vec<GarbageCount>,
    /// With a real clock the achieved delay is recorded beside the commanded one: mission seconds per second of wall
    /// clock.
    watch_delays: Option<f64>,
    outputs: VecDeque<Channel>,
}

struct Wire {
    from: usize,
    to: usize,
    delay: Delay,
    loss: f64,
    /// Two numbers per message: lane 0 decides the loss, lane 1 the delay.
    stream: Stream,
    ledger: Ledger,
    /// When each message that takes a place in the queue leaves it. Kept apart from the ledger: a stepped run settles
    /// arrivals ahead of what is sent before them, and must find the same queue as a run in real time.
    places: BinaryHeap<Reverse<Time>>,
    /// Sequence number of the newest message taken, to tell a repetition.
    newest: Option<u32>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct UnderWay {
    due: Time,
    order: u64,
    link: usize,
    /// Number of the message on its link, from 0.
    number: u64,
    sent: Time,
    bytes: Arc<[u8]>,
}

impl Ord for UnderWay {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.due, self.order).cmp(&(other.due, other.order))
    }
}

impl PartialOrd for UnderWay {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Emulator {
    /// The network of a mission at its start.
    pub fn new(mission: Arc<Mission>, watch_delays: Option<f64>) -> Emulator {
        let id = |i: usize| &mission.vehicles[i].id;
        let mut out = vec![Vec::new(); mission.vehicles.len()];
        let mut links = Vec::with_capacity(mission.links.len());
        for (index, link) in mission.links.iter().enumerate() {
            out[link.from].push(index);
            links.push(Wire {
                from: link.from,
                to: link.to,
                delay: link.delay,
                loss: link.loss,
                stream: Stream::new(mission.seed, &format!("link/{}->{}", id(link.from), id(link.to))),
                ledger: Ledger::default(),
                places: BinaryHeap::new(),
                newest: None,
            });
        }
        let switching = mission.switching.clone();
        let mut emulator = Emulator {
            names: mission.vehicles.iter().map(|vehicle| Name::from(vehicle.id.as_str())).collect(),
            up: vec![false; links.len()],
            garbage: vec![GarbageCount::default(); mission.vehicles.len()],
            links,
            out,
            switching,
            next_change: Some(Time::ZERO),
            under_way: BinaryHeap::new(),
            counter: 0,
            watch_delays,
            outputs: VecDeque::new(),
            mission,
        };
        emulator.change(Time::ZERO, true);
        emulator
    }

    /// Brings a network that begins under way to the present without recording what it missed.
    pub fn skip_to(&mut self, now: Time) {
        while let Some(change) = self.next_change.filter(|change| *change <= now) {
            self.change(change, false);
        }
    }

    /// The ledger of each directed link, in the order of the mission's links.
    pub fn ledgers(&self) -> impl Iterator<Item = &Ledger> {
        self.links.iter().map(|link| &link.ledger)
    }

    /// Sent, delivered, dropped, in flight, over all links.
    pub fn totals(&self) -> [u64; 4] {
        self.ledgers().fold([0; 4], |[s, d, x, f], l| [s + l.sent, d + l.delivered, x + l.dropped(), f + l.in_flight])
    }

    /// Garbage counted per vehicle.
    pub fn garbage(&self) -> &[GarbageCount] {
        &self.garbage
    }

    /// Closes the books: what is under way is recorded as such.
    pub fn finish(&mut self, now: Time) {
        for Reverse(message) in std::mem::take(&mut self.under_way).into_sorted_vec().into_iter().rev() {
            self.record_message(now, &message, Fate::InFlight);
        }
        for (vehicle, garbage) in self.garbage.iter().enumerate() {
            if garbage.total() > 0 {
                let text = format!("messages ignored that came from {}", self.mission.vehicles[vehicle].id);
                let source = "network-emulator".to_string();
                let row = NoteRow { t_ns: now.nanos(), source, text, count: garbage.total() };
                self.outputs.push_back(Channel::Record(Row::Clock(ClockRecord::Note(row))));
            }
        }
    }

    /// Takes a message from a vehicle: one decision per directed link.
    fn take(&mut self, now: Time, sent: &Sent) -> Result<(), Garbage> {
        let state = CoordinationState::decode(&sent.bytes)?;
        if state.mission != self.mission.digest {
            return Err(Garbage::WrongMission);
        }
        if state.sender as usize != sent.from {
            return Err(Garbage::Forged);
        }
        let bytes = Arc::clone(&sent.bytes);
        for slot in 0..self.out[sent.from].len() {
            let index = self.out[sent.from][slot];
            let link = &mut self.links[index];
            if link.newest.is_some_and(|newest| newest >= state.seq) {
                return Err(Garbage::Stale);
            }
            link.newest = Some(state.seq);
            let number = link.ledger.sent;
            link.ledger.take();
            let due = now + Self::delay(link, state.seq);
            // What is due at this very instant is still there: the network takes what was sent before it delivers.
            while link.places.peek().is_some_and(|Reverse(due)| *due < now) {
                link.places.pop();
            }
            let order = self.counter;
            self.counter += 1;
            let message = UnderWay { due, order, link: index, number, sent: now, bytes: bytes.clone() };
            if link.loss > 0.0 && link.stream.unit_at(u64::from(state.seq), 0) < link.loss {
                self.settle(now, &message, Fate::Lost);
            } else if link.places.len() >= self.mission.queue {
                self.settle(now, &message, Fate::QueueFull);
            } else {
                link.places.push(Reverse(due));
                self.under_way.push(Reverse(message));
            }
        }
        Ok(())
    }

    fn delay(link: &mut Wire, seq: u32) -> Span {
        match link.delay {
            Delay::Constant(delay) => delay,
            Delay::Uniform(least, most) => {
                let spread = (most.nanos() - least.nanos()) as f64;
                Span::from_nanos(least.nanos() + (link.stream.unit_at(u64::from(seq), 1) * spread) as i64)
            }
        }
    }

    fn settle(&mut self, t: Time, message: &UnderWay, fate: Fate) {
        self.links[message.link].ledger.settle(fate);
        self.record_message(t, message, fate);
    }

    fn record_message(&mut self, t: Time, message: &UnderWay, fate: Fate) {
        self.record_settled(t, message, fate, None);
    }

    fn record_settled(&mut self, t: Time, message: &UnderWay, fate: Fate, late_ns: Option<i64>) {
        self.outputs.push_back(Channel::Settled(Settled {
            t_ns: t.nanos(),
            link: message.link,
            seq: message.number,
            sent_ns: message.sent.nanos(),
            due_ns: message.due.nanos(),
            fate,
            late_ns,
        }));
    }

    /// A message has come to the end of its delay: it is received if the link is up at that instant (p(t) gates
    /// reception, erratum 4.22).
    fn arrive(&mut self, now: Time, message: UnderWay) {
        if !self.up[message.link] {
            self.settle(message.due, &message, Fate::LinkDown);
            return;
        }
        self.links[message.link].ledger.settle(Fate::Delivered);
        let late_ns = self.watch_delays.map(|speed_up| ((now - message.due).nanos() as f64 / speed_up) as i64);
        self.record_settled(message.due, &message, Fate::Delivered, late_ns);
        let link = &self.links[message.link];
        self.outputs.push_back(Channel::Deliver { to: link.to, due: message.due, bytes: message.bytes });
    }

    /// The switching signal changes at `t`: record the links that come or go.
    fn change(&mut self, t: Time, record: bool) {
        for index in 0..self.links.len() {
            let up = self.switching.is_up(index, t);
            let first = t == Time::ZERO;
            if record && (first || up != self.up[index]) {
                let row = TopologyRow {
                    t_ns: t.nanos(),
                    from: self.names[self.links[index].from].clone(),
                    to: self.names[self.links[index].to].clone(),
                    up,
                };
                self.outputs.push_back(Channel::Record(Row::Exact(Record::Topology(row))));
            }
            self.up[index] = up;
        }
        self.next_change = self.switching.next_change_after(t).filter(|change| *change <= self.mission.end);
    }
}

impl Machine for Emulator {
    type Input = Sent;
    type Output = Channel;

    fn handle(&mut self, now: Time, input: Option<Sent>) {
        match input {
            Some(sent) => {
                if let Err(kind) = self.take(now, &sent)
                    && self.garbage[sent.from].count(kind)
                {
                    let id = &self.mission.vehicles[sent.from].id;
                    let text = format!("first message ignored from {id} that is {}", kind.as_str());
                    let row = NoteRow { t_ns: now.nanos(), source: "network-emulator".into(), text, count: 1 };
                    self.outputs.push_back(Channel::Record(Row::Clock(ClockRecord::Note(row))));
                }
            }
            None => {
                // Changes and arrivals in the order of their instants; at the same instant the link changes first, so
                // that an interval of up time contains its begin and not its end.
                while let Some(next) = self.poll_timeout().filter(|next| *next <= now) {
                    if self.next_change.is_some_and(|change| change <= next) {
                        self.change(next, true);
                    } else if let Some(Reverse(message)) = self.under_way.pop() {
                        self.arrive(now, message);
                    }
                }
            }
        }
    }

    fn poll_output(&mut self) -> Option<Channel> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        let arrival = self.under_way.peek().map(|Reverse(message)| message.due);
        match (self.next_change, arrival) {
            (Some(change), Some(arrival)) => Some(change.min(arrival)),
            (change, arrival) => change.or(arrival),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A mission of three vehicles on lines whose network is given.
    fn mission(network: &str) -> Arc<Mission> {
        let vehicle = |i: usize| {
            format!(
                "[[vehicles]]\nid = \"v{i}\"\npath = {{ line = {{ start_m = [0.0, {i}.0] }} }}\nstart = {{ x_m = 0.0, y_m = {i}.0 }}\n"
            )
        };
        let text = format!(
            "name = \"t\"\nseed = 5\nduration_s = 100.0\n[formation]\nspeed = 0.5\n\
             [coordination]\nlaw = {{ switching = {{ gain = 0.1 }} }}\n\
             [network]\nlinks = [[\"v1\", \"v2\"], [\"v2\", \"v3\"]]\n{network}\n\
             [fleet]\nmodel = \"kinematic_unicycle\"\nfollowing = {{ line_of_sight = {{ distance_m = 1.0 }} }}\n{}{}{}",
            vehicle(1),
            vehicle(2),
            vehicle(3)
        );
        Arc::new(Mission::parse("t.toml", &text).unwrap_or_else(|faults| panic!("{faults}")))
    }

    fn state(mission: &Mission, sender: u16, seq: u32) -> Arc<[u8]> {
        CoordinationState { mission: mission.digest, sender, seq, made: Time::ZERO, xi: 1.0, scalar: None }
            .encode()
            .into()
    }

    fn seconds(t: f64) -> Time {
        Time::from_secs(t)
    }

    fn drain(emulator: &mut Emulator) -> Vec<Channel> {
        std::iter::from_fn(|| emulator.poll_output()).collect()
    }

    /// Who got something, and when it was due.
    fn deliveries(outputs: &[Channel]) -> Vec<(usize, Time)> {
        let delivery = |output: &Channel| match output {
            Channel::Deliver { to, due, .. } => Some((*to, *due)),
            Channel::Record(_) | Channel::Settled(_) => None,
        };
        outputs.iter().filter_map(delivery).collect()
    }

    #[test]
    fn a_message_reaches_the_neighbours_after_the_delay_and_nobody_else() {
        let mission = mission("delay = { constant = { delay_s = 2.0 } }");
        let mut emulator = Emulator::new(mission.clone(), None);
        emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
        emulator.handle(seconds(2.999), None);
        assert_eq!(deliveries(&drain(&mut emulator)), vec![], "never early");
        emulator.handle(seconds(3.0), None);
        assert_eq!(deliveries(&drain(&mut emulator)), vec![(1, seconds(3.0))]);
    }

    #[test]
    fn the_switching_signal_gates_reception_and_not_transmission() {
        // Up in [7.5, 10) of every 10 s, 5 s of delay: what is said at 3 s is heard at 8 s, what is said at 8 s is not.
        let mission = mission(
            "delay = { constant = { delay_s = 5.0 } }\nswitching = { periodic = { period_s = 10.0, up_from_s = 7.5, up_for_s = 2.5 } }",
        );
        let mut emulator = Emulator::new(mission.clone(), None);
        emulator.handle(seconds(3.0), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
        emulator.handle(seconds(8.0), Some(Sent { from: 0, bytes: state(&mission, 0, 1) }));
        emulator.handle(seconds(20.0), None);
        assert_eq!(deliveries(&drain(&mut emulator)), vec![(1, seconds(8.0))]);
        let ledger = emulator.ledgers().next().copied().expect("a link");
        assert_eq!((ledger.sent, ledger.delivered, ledger.link_down), (2, 1, 1));
    }

    #[test]
    fn an_interval_of_up_time_contains_its_begin_and_not_its_end() {
        let mission = mission("switching = { periodic = { period_s = 10.0, up_from_s = 0.0, up_for_s = 2.0 } }");
        for (t, heard) in [(0.0, 1), (1.999, 1), (2.0, 0), (9.999, 0), (10.0, 1)] {
            let mut emulator = Emulator::new(mission.clone(), None);
            emulator.handle(seconds(t), Some(Sent { from: 0, bytes: state(&mission, 0, 0) }));
            emulator.handle(seconds(t), None);
            assert_eq!(deliveries(&drain(&mut emulator)).len(), heard, "at {t} s");
        }
    }

    #[test]
    fn bernoulli_losses_come_at_their_probability() {
        let mission = mission("loss = { bernoulli = { probability = 0.3 } }");
        let mut emulator = Emulator::new(mission.clone(), None);
        let n = 20_000;
        for seq in 0..n {
            emulator.handle(seconds(f64::from(seq) * 1e-3), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
            emulator.handle(seconds(f64::from(seq) * 1e-3), None);
            drain(&mut emulator);
        }
        let lost = emulator.ledgers().next().map_or(0, |ledger| ledger.lost) as f64 / f64::from(n);
        // Five standard deviations of the mean of n draws.
        assert!((lost - 0.3).abs() < 5.0 * (0.3f64 * 0.7 / f64::from(n)).sqrt(), "{lost}");
    }

    #[test]
    fn what_is_decided_about_a_message_does_not_depend_on_the_others() {
        let mission = mission(
            "loss = { bernoulli = { probability = 0.5 } }\ndelay = { jittered = { min_s = 0.1, max_s = 3.0 } }",
        );
        let fates = |order: &[(usize, u32)]| {
            let mut emulator = Emulator::new(mission.clone(), None);
            for (from, seq) in order {
                emulator.handle(seconds(1.0), Some(Sent { from: *from, bytes: state(&mission, *from as u16, *seq) }));
            }
            emulator.handle(seconds(50.0), None);
            let mut deliveries = deliveries(&drain(&mut emulator));
            deliveries.sort();
            deliveries
        };
        let alternating: Vec<(usize, u32)> = (0..40).flat_map(|seq| [(0, seq), (1, seq), (2, seq)]).collect();
        let one_by_one: Vec<(usize, u32)> = (0..3).rev().flat_map(|from| (0..40).map(move |seq| (from, seq))).collect();
        assert_eq!(fates(&alternating), fates(&one_by_one));
    }

    #[test]
    fn garbage_is_counted_and_changes_no_ledger() {
        let mission = mission("");
        let mut emulator = Emulator::new(mission.clone(), None);
        let good = state(&mission, 0, 7);
        let mut other = CoordinationState::decode(&good).expect("sound");
        other.mission ^= 1;
        for (from, bytes, kind) in [
            (0, b"nonsense".to_vec(), Garbage::Foreign),
            (0, good[..20].to_vec(), Garbage::Malformed),
            (0, vec![b'C'; 5000], Garbage::Oversized),
            (0, other.encode(), Garbage::WrongMission),
            (1, good.clone(), Garbage::Forged),
        ] {
            emulator.handle(seconds(1.0), Some(Sent { from, bytes }));
            assert_eq!(emulator.garbage()[from].of(kind), 1, "{kind:?}");
        }
        assert!(emulator.ledgers().all(|ledger| ledger.sent == 0));
        emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: good.clone() }));
        emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: good }));
        assert_eq!(emulator.garbage()[0].of(Garbage::Stale), 1, "said twice");
        assert_eq!(emulator.totals()[0], 1);
    }

    #[test]
    fn a_full_queue_drops_new_messages_with_a_count() {
        let mission = mission("queue = 3\ndelay = { constant = { delay_s = 50.0 } }");
        let mut emulator = Emulator::new(mission.clone(), None);
        for seq in 0..10 {
            emulator.handle(seconds(1.0), Some(Sent { from: 0, bytes: state(&mission, 0, seq) }));
        }
        let ledger = emulator.ledgers().next().copied().expect("a link");
        assert_eq!((ledger.sent, ledger.queue_full, ledger.in_flight), (10, 7, 3));
    }

    proptest! {
        /// Whatever happens, every ledger balances, nothing is early, and nothing overtakes its instant.
        #[test]
        fn ledgers_balance_at_every_instant(
            steps in proptest::collection::vec((0usize..4, 0u32..500), 1..200),
            loss in 0.0f64..1.0,
            most in 0.0f64..5.0,
        ) {
            let mission = mission(&format!(
                "queue = 20\nloss = {{ bernoulli = {{ probability = {loss} }} }}\n\
                 delay = {{ jittered = {{ min_s = 0.0, max_s = {most} }} }}\n\
                 switching = {{ random = {{ alpha = 0.5, t_0_s = 2.0, dwell_s = 0.5 }} }}"
            ));
            let mut emulator = Emulator::new(mission.clone(), None);
            let mut now = Time::ZERO;
            let mut seq = [0; 3];
            for (who, wait_ms) in steps {
                now += Span::from_nanos(i64::from(wait_ms) * 1_000_000);
                if who < 3 {
                    emulator.handle(now, Some(Sent { from: who, bytes: state(&mission, who as u16, seq[who]) }));
                    seq[who] += 1;
                } else {
                    emulator.handle(now, None);
                }
                let outputs = drain(&mut emulator);
                prop_assert!(deliveries(&outputs).iter().all(|(_, due)| *due <= now));
                prop_assert!(deliveries(&outputs).is_sorted_by_key(|(_, due)| *due));
                prop_assert!(emulator.ledgers().all(Ledger::balances));
            }
            emulator.finish(now);
            let in_flight: u64 = emulator.ledgers().map(|ledger| ledger.in_flight).sum();
            let told = drain(&mut emulator)
                .iter()
                .filter(|o| matches!(o, Channel::Settled(settled) if settled.fate == Fate::InFlight))
                .count() as u64;
            prop_assert_eq!(in_flight, told);
        }
    }
}
