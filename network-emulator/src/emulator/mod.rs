//! The channel: decides for every message and every directed link whether it arrives, and when. A pure machine.
//!
//! Decisions about a message are functions of (seed, link, message number), of positions as the vehicles' own words tell
//! them, and of the planned switching signal, never of the order in which messages happen to come: two runs can be
//! compared message by message. Where messages disturb one another, on a shared medium, it is settled at instants of
//! mission time: links change first, then transmissions begin, by sender, then messages arrive.
//!
//! | file | decides |
//! |---|---|
//! | `wire.rs` | what one directed link does to a message |
//! | `sender.rs` | when a vehicle may speak, on a shared medium |
//! | `air.rs` | what overlaps at a receiver, on a shared medium |
//! | `books.rs` | what is written down about it |
//! | `parcel.rs` | in which order messages arrive that are due at the same instant |
//! | `agenda.rs` | which message arrives next |

mod agenda;
mod air;
mod books;
mod parcel;
mod sender;
#[cfg(test)]
mod tests;
mod wire;

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use common::graph::switching::Switching;
use common::machine::Machine;
use common::mission::{Link, Mission};
use common::network::{Medium, Whereabouts};
use common::random::Stream;
use common::record::{ClockRecord, Fate, Name, NoteRow, Record, Row, Settled, TopologyRow};
use common::time::{Span, Time};
use common::wire::state::CoordinationState;
use common::wire::{Garbage, GarbageCount};

use self::agenda::Agenda;
use self::air::{Air, Place};
use self::books::{settled, unsent};
use self::parcel::{Parcel, UnderWay};
use self::sender::Sender;
use self::wire::{Wire, flip};

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
        /// On a real clock, what is to be recorded of a delivery by who hands it over: how late that was is known then.
        settled: Option<Settled>,
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
    /// Which links the switching signal has up.
    up: Vec<bool>,
    /// Which vehicles can be reached: all of them, but in real time.
    present: Vec<bool>,
    /// Which links were last recorded as up: those of the signal whose two ends are present.
    recorded_up: Vec<bool>,
    next_change: Option<Time>,
    /// Whether what is caught up with happened while the emulator was not let run.
    asleep: bool,
    under_way: Agenda,
    /// Number of the newest message taken from each vehicle, to tell a repetition.
    newest: Vec<Option<u32>>,
    /// When each vehicle made its newest message, and the ξ in it.
    said: Vec<Option<(Time, f64)>>,
    /// How many messages were taken from each vehicle.
    taken: Vec<u64>,
    /// Where the vehicles are, if it matters.
    whereabouts: Option<Whereabouts>,
    /// On a shared medium: who waits to speak, and what is arriving at whom; empty without.
    senders: Vec<Sender>,
    /// Who speaks when; at the same instant by index.
    turns: BTreeSet<(Time, usize)>,
    airs: Vec<Air>,
    receptions: u64,
    garbage: Vec<GarbageCount>,
    /// With a real clock the achieved delay is recorded beside the commanded one: mission seconds per second of wall
    /// clock.
    watch_delays: Option<f64>,
    outputs: VecDeque<Channel>,
}

impl Emulator {
    /// The network of a mission at its start.
    pub fn new(mission: Arc<Mission>, watch_delays: Option<f64>) -> Emulator {
        let n = mission.vehicles.len();
        let mut out = vec![Vec::new(); n];
        for (index, link) in mission.links.iter().enumerate() {
            out[link.from].push(index);
        }
        let sender = |(index, vehicle): (usize, &common::mission::VehiclePlan)| {
            Sender::new(index, Stream::new(mission.seed, &format!("medium/{}", vehicle.id)))
        };
        let places = mission.vehicles.iter().map(|v| (v.path.clone(), v.pattern, v.start.xi));
        let shared = mission.medium.is_some();
        let mut emulator = Emulator {
            names: mission.vehicles.iter().map(|vehicle| Name::from(vehicle.id.as_str())).collect(),
            links: mission.links.iter().map(|link| Wire::new(link, mission.seed)).collect(),
            out,
            switching: mission.switching.clone(),
            up: vec![false; mission.links.len()],
            present: vec![true; n],
            recorded_up: vec![false; mission.links.len()],
            next_change: Some(Time::ZERO),
            asleep: false,
            under_way: Agenda::default(),
            newest: vec![None; n],
            said: vec![None; n],
            taken: vec![0; n],
            whereabouts: mission.links.iter().any(Link::needs_distance).then(|| Whereabouts::new(places)),
            senders: if shared { mission.vehicles.iter().enumerate().map(sender).collect() } else { Vec::new() },
            turns: BTreeSet::new(),
            airs: (0..if shared { n } else { 0 }).map(|_| Air::default()).collect(),
            receptions: 0,
            garbage: vec![GarbageCount::default(); n],
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

    /// Nothing passed from `gone` on until the present, `back`: every link was down, and is now as planned, if its two ends are
    /// present.
    pub fn was_away(&mut self, gone: Time, back: Time) {
        for index in 0..self.links.len() {
            self.record_topology(gone, index, false);
        }
        self.recorded_up.fill(false);
        self.record_links(back, false);
    }

    /// The emulator itself was not let run from `gone` until the present, `back`: what was to arrive meanwhile found every link
    /// down, and what is said from now on finds them as planned.
    pub fn slept(&mut self, gone: Time, back: Time) {
        self.asleep = true;
        self.catch_up(back, back);
        self.asleep = false;
        self.was_away(gone, back);
    }

    /// In real time a vehicle's process comes and goes: while there is none, nobody hears what is sent to it, and its links
    /// are down. What is under way from it still arrives.
    pub fn presence(&mut self, now: Time, vehicle: usize, present: bool) {
        if self.present.get(vehicle).is_none_or(|before| *before == present) {
            return;
        }
        self.catch_up(now, now);
        self.present[vehicle] = present;
        // Who used the vehicle's name while it was gone must not silence it by a number that it reaches late or never.
        self.newest[vehicle] = None;
        self.record_links(now, false);
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
        if self.newest[sent.from].is_some_and(|newest| newest >= state.seq) {
            return Err(Garbage::Stale);
        }
        self.newest[sent.from] = Some(state.seq);
        self.said[sent.from] = Some((state.made, state.xi)).filter(|(_, xi)| xi.is_finite());
        if let Some(whereabouts) = &mut self.whereabouts {
            whereabouts.said(sent.from, now, state.made, state.xi);
        }
        let bytes = Arc::clone(&sent.bytes);
        let parcel = Parcel { from: sent.from, seq: state.seq, number: self.taken[sent.from], sent: now, bytes };
        self.taken[sent.from] += 1;
        for slot in 0..self.out[sent.from].len() {
            let link = self.out[sent.from][slot];
            self.links[link].ledger.take();
            if self.mission.medium.is_none() {
                self.transmit(&parcel, link, now, Span::ZERO);
            }
        }
        if self.mission.medium.is_some()
            && let Some(dropped) = self.replan(sent.from, |sender, medium| sender.take(medium, parcel))
        {
            for slot in 0..self.out[sent.from].len() {
                let message = unsent(now, &dropped, self.out[sent.from][slot]);
                self.settle(now, &message, Fate::QueueFull);
            }
        }
        Ok(())
    }

    /// A vehicle's turn has come to speak.
    fn speak(&mut self, t: Time, vehicle: usize) {
        let Some(parcel) = self.replan(vehicle, |sender, medium| sender.speak(medium)) else { return };
        let Some(medium) = &self.mission.medium else { return };
        let airtime = medium.airtime(parcel.bytes.len());
        self.airs[vehicle].speak(medium, t, t + airtime);
        for slot in 0..self.out[vehicle].len() {
            self.transmit(&parcel, self.out[vehicle][slot], t, airtime);
        }
    }

    /// Has a sender do something that may change when it speaks next.
    fn replan<T>(&mut self, vehicle: usize, act: impl FnOnce(&mut Sender, &Medium) -> Option<T>) -> Option<T> {
        let medium = self.mission.medium.as_ref()?;
        let sender = &mut self.senders[vehicle];
        if let Some(before) = sender.next() {
            self.turns.remove(&(before, vehicle));
        }
        let done = act(sender, medium);
        if let Some(next) = sender.next() {
            self.turns.insert((next, vehicle));
        }
        done
    }

    /// A message leaves its sender on one link: dropped at once, or under way.
    fn transmit(&mut self, parcel: &Parcel, link: usize, start: Time, airtime: Span) {
        let wire = &mut self.links[link];
        let distance = match &self.whereabouts {
            Some(whereabouts) if wire.needs_distance => whereabouts.distance(wire.from, wire.to, start),
            _ => 0.0,
        };
        let bits = 8 * parcel.bytes.len();
        let verdict = wire.decide(parcel.seq, bits, (start, airtime), distance);
        let (due, corrupt) = (verdict.due, verdict.flipped.is_some());
        let copy_due = verdict.copy;
        let mut message =
            UnderWay { due, parcel: parcel.clone(), link, copy: false, copy_due, corrupt, reception: None };
        if let Some(cause) = verdict.dropped {
            return self.settle(start, &message, cause);
        }
        if let Some(bit) = verdict.flipped {
            message.parcel.bytes = flip(&parcel.bytes, bit);
        }
        if copy_due.is_some() {
            wire.ledger.copy();
        }
        if let Some(medium) = &self.mission.medium {
            let place = Place { begin: due - airtime, key: self.receptions };
            self.airs[wire.to].enter(medium, place, wire.from, due);
            message.reception = Some(place);
            self.receptions += 1;
        }
        self.under_way.push(message);
    }

    /// A message has come to the end of its way: it is received if the link is up at that instant (p(t) gates reception,
    /// erratum 4.22), its receiver is there, and nothing spoilt it meanwhile. A copy is made of what arrives: what does not
    /// has none.
    fn arrive(&mut self, now: Time, message: UnderWay) {
        let to = self.links[message.link].to;
        let spoilt = message.reception.and_then(|place| self.airs[to].leave(place));
        let arrived = if message.corrupt { Fate::Corrupt } else { Fate::Delivered };
        let fate = match (self.up[message.link] && !self.asleep, self.present[to]) {
            (false, _) => Fate::LinkDown,
            (true, false) => Fate::ReceiverAbsent,
            (true, true) => spoilt.unwrap_or(arrived),
        };
        let handed_over = fate == arrived;
        let fate = match (message.copy, handed_over) {
            (false, _) => fate,
            (true, true) => Fate::Copied,
            (true, false) => Fate::CopyDropped,
        };
        self.links[message.link].ledger.settle(fate);
        let late_ns = self
            .watch_delays
            .filter(|_| fate == Fate::Delivered)
            .map(|speed_up| ((now - message.due).nanos() as f64 / speed_up) as i64);
        let (due, copy) = (message.due, message.copy());
        let mut settled = Some(settled(due, &message, fate, late_ns));
        if late_ns.is_none() {
            self.outputs.extend(settled.take().map(Channel::Settled));
        }
        if handed_over {
            self.outputs.push_back(Channel::Deliver { to, due, bytes: message.parcel.bytes, settled });
        }
        match copy {
            Some(copy) if handed_over => self.under_way.push(copy),
            Some(copy) => self.settle(due, &copy, Fate::CopyDropped),
            None => {}
        }
    }

    /// The switching signal changes at `t`: record the links that come or go.
    fn change(&mut self, t: Time, record: bool) {
        for index in 0..self.links.len() {
            self.up[index] = self.switching.is_up(index, t);
        }
        if record {
            self.record_links(t, t == Time::ZERO);
        } else {
            self.recorded_up.clone_from(&self.up);
        }
        self.next_change = self.switching.next_change_after(t).filter(|change| *change <= self.mission.end);
    }

    /// Records which links came or went, or how all of them are.
    fn record_links(&mut self, t: Time, all: bool) {
        for index in 0..self.links.len() {
            let link = &self.links[index];
            let up = self.up[index] && self.present[link.from] && self.present[link.to];
            if all || up != self.recorded_up[index] {
                self.record_topology(t, index, up);
            }
            self.recorded_up[index] = up;
        }
    }

    fn record_topology(&mut self, t: Time, link: usize, up: bool) {
        let name = |vehicle: usize| self.names[vehicle].clone();
        let (from, to) = (name(self.links[link].from), name(self.links[link].to));
        let row = TopologyRow { t_ns: t.nanos().max(0), from, to, up };
        self.outputs.push_back(Channel::Record(Row::Exact(Record::Topology(row))));
    }

    /// Changes, transmissions and arrivals up to an instant, in the order of their instants. At the same instant the link
    /// changes first, so that an interval of up time contains its begin and not its end.
    fn catch_up(&mut self, now: Time, until: Time) {
        while let Some(next) = self.poll_timeout().filter(|next| *next <= until) {
            if self.next_change.is_some_and(|change| change <= next) {
                self.change(next, !self.asleep);
            } else if let Some((start, vehicle)) = self.next_speaker().filter(|(start, _)| *start <= next) {
                self.speak(start, vehicle);
            } else if let Some(message) = self.under_way.pop() {
                self.arrive(now, message);
            }
        }
    }

    /// Who speaks next, and when; the first of those who speak at the same instant.
    fn next_speaker(&self) -> Option<(Time, usize)> {
        self.turns.first().copied()
    }
}

impl Machine for Emulator {
    type Input = Sent;
    type Output = Channel;

    fn handle(&mut self, now: Time, input: Option<Sent>) {
        match input {
            Some(sent) => {
                if self.mission.medium.is_some() {
                    // Who was to speak before this word was said has spoken, however late that is looked at.
                    self.catch_up(now, now - Span::from_nanos(1));
                }
                if let Err(kind) = self.take(now, &sent)
                    && self.garbage[sent.from].count(kind)
                {
                    let id = &self.mission.vehicles[sent.from].id;
                    let text = format!("first message ignored from {id} that is {}", kind.as_str());
                    let row = NoteRow { t_ns: now.nanos(), source: "network-emulator".into(), text, count: 1 };
                    self.outputs.push_back(Channel::Record(Row::Clock(ClockRecord::Note(row))));
                }
            }
            None => self.catch_up(now, now),
        }
    }

    fn poll_output(&mut self) -> Option<Channel> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        let arrival = self.under_way.due();
        let speech = self.next_speaker().map(|(start, _)| start);
        [self.next_change, speech, arrival].into_iter().flatten().min()
    }
}
