//! The emulator as a program: what it does for its machine. The only file of this crate that knows there is a network.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use bus::Plane;
use bus::clock::{AtMostEvery, late_ns};
use bus::console::{Parent, StopFlag};
use bus::drive::{Clock, Next, Port, Program, Rest, Shared, drive};
use bus::logs::Logs;
use bus::queue::{Bell, Events};
use bus::setup::Endpoint;
use bus::switchboard::{HubEvent, LineId, Messages, Switchboard, SwitchboardConfig};
use clap::Parser;
use common::record::{ClockRecord, Name, Overrun, OverrunRow, Row, Settled};
use common::time::Time;
use common::wire::fleet::{Pace, ToFleet};
use common::wire::vehicle::{ClockPlan, FromVehicle, Phase};
use common::wire::{self, Garbage, GarbageCount};

use crate::hub::{COLLECTOR, HUB, Hub, HubInput, HubOutput, OPERATOR};

/// From the command to start until mission time zero: long enough for every vehicle to hear of it.
const START_LEAD: Duration = Duration::from_millis(500);

/// How long a port that is in use is waited for.
const PORT_PATIENCE: Duration = Duration::from_secs(2);

/// So many messages within [`BURST`] are sent at once, each by itself. What more there is waits for [`GATHERING`], and travels in
/// bundles.
const SINGLE_SENDINGS: usize = 16;
/// See [`SINGLE_SENDINGS`].
const BURST: Duration = Duration::from_millis(1);
/// How long messages of a burst wait for others that go the same way.
const GATHERING: Duration = Duration::from_micros(200);

/// Between two rows about states that were dropped.
const OVERRUN_PERIOD: Duration = Duration::from_secs(1);

/// The only way from one vehicle to another: carries, delays and drops coordination states as the mission says.
///
/// Every vehicle and mission-control connects here; no broker is needed beside it. It prints the endpoint it listens on
/// as the first line of its output.
///
/// Exit codes: 0 ended as asked, 2 wrong use, 3 cannot listen, 4 no logs can be kept, or recording failed.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "network-emulator",
    version,
    after_help = "Example, one terminal each:\n  \
    network-emulator --listen tcp/127.0.0.1:7447\n  vehicle-node --id auv1\n  vehicle-node --id auv2\n  vehicle-node --id auv3\n  \
    mission-control run missions/auv-helix.toml --attach"
)]
pub struct Args {
    /// Where vehicles and mission-control connect; port 0 takes a free one
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/127.0.0.1:7447", env = "CPF_LISTEN")]
    pub listen: Endpoint,
    /// Folder for the emulator's logs; of earlier flights of a mission it keeps the newest five
    #[arg(long, value_name = "DIR", default_value = "logs", env = "CPF_LOGS")]
    pub logs: PathBuf,
    /// End when mission-control has collected the logs of a flight, or when nothing has been flown for ten minutes
    #[arg(long)]
    pub once: bool,
    /// End when standard input is closed, but not before a flight under way is over: what started this process is gone
    #[arg(long, hide = true)]
    pub end_with_stdin: bool,
}

/// Runs the program to its end.
pub fn run(args: Args) -> ExitCode {
    let logs = Logs::new(&args.logs, HUB);
    if let Err(reason) = logs.check() {
        tracing::error!("{reason}");
        return ExitCode::from(4);
    }
    let (switchboard, events) = match open(&args.listen) {
        Ok(open) => open,
        Err(error) => {
            tracing::error!("{error}");
            return ExitCode::from(3);
        }
    };
    let stop = StopFlag::on_signals();
    stop.arm();
    bus::tell!("{}", switchboard.endpoint());
    tracing::info!("network-emulator listens on {}", switchboard.endpoint());
    let port = HubPort {
        switchboard,
        logs,
        lines: HashMap::new(),
        ids: BTreeMap::new(),
        seats: Vec::new(),
        posted: Vec::new(),
        burst: Burst::default(),
        overruns: BTreeMap::new(),
        overrun_pace: AtMostEvery::new(OVERRUN_PERIOD),
        clock: Clock::Stopped,
        start_unix_ns: None,
        garbage: BTreeMap::new(),
        stop,
        once: args.once,
        parent: args.end_with_stdin.then(Parent::at_stdin),
        rest: Rest::default(),
        recording_failed: None,
    };
    let program = Arc::new(Shared::new(Program::new(Hub::new(), port, Clock::Stopped)));
    take_shortcut(&program, events.bell());
    let exit = drive(&program, &events);
    // Of the transport's threads, one may hold the program for a moment more.
    let mut program = program.hold();
    program.port.logs.close();
    program.port.switchboard.close();
    exit
}

/// Lets the transport's threads decide about states as they arrive: waking the loop for each would cost more than all the
/// rest. What comes while the program is busy, or behind others that wait, is left to the loop.
fn take_shortcut(program: &Arc<Shared<HubPort>>, bell: Bell<HubEvent>) {
    let weak: Weak<Shared<HubPort>> = Arc::downgrade(program);
    let take = move |line: LineId, at: Instant, messages: &mut Messages<'_>| {
        let Some(shared) = weak.upgrade() else { return };
        let Some(mut program) = shared.try_hold() else { return };
        // Under the lock: the loop takes from the queue under it, too.
        if bell.is_crowded() || program.port.seats.get(line.index()) != Some(&Some(line)) {
            return;
        }
        let states = std::iter::from_fn(|| if shared.is_wanted() { None } else { messages.next() });
        let awaited = program.at_once(at, states.map(|bytes| HubInput::State(line.index(), bytes.into())));
        if program.port.send_at_once(at) || awaited {
            bell.ring();
        }
    };
    program.hold().port.switchboard.set_shortcut(Box::new(take));
}

/// A delivery that is to be recorded when it is handed over, and when it was due.
type Posted = (Settled, Option<Instant>);

/// How much was sent of late.
#[derive(Clone, Copy, Debug, Default)]
struct Burst {
    begun: Option<Instant>,
    sendings: usize,
    /// When what was gathered is sent; the loop knows of it.
    send_at: Option<Instant>,
}

/// Opens the switchboard. A port in use may belong to a process that was killed a moment ago.
fn open(listen: &Endpoint) -> bus::Result<(Switchboard, Events<HubEvent>)> {
    let patience = Rest::default();
    loop {
        match Switchboard::open(SwitchboardConfig::new(listen.clone())) {
            Err(bus::Error::PortInUse(_)) if patience.lasted() < PORT_PATIENCE => Rest::pause(PORT_PATIENCE / 20),
            other => return other,
        }
    }
}

struct HubPort {
    switchboard: Switchboard,
    logs: Logs,
    lines: HashMap<Name, LineId>,
    ids: BTreeMap<LineId, Name>,
    /// The lines of vehicles, by number.
    seats: Vec<Option<LineId>>,
    /// What waits to be handed over, by the number of the line.
    posted: Vec<Vec<Posted>>,
    burst: Burst,
    /// How many states were recorded as dropped, by line and place.
    overruns: BTreeMap<(LineId, Overrun), u64>,
    overrun_pace: AtMostEvery,
    /// The program's clock.
    clock: Clock,
    /// When mission time is zero, if it passes with the wall clock.
    start_unix_ns: Option<i64>,
    /// Garbage on the mission plane, by participant; participants are bounded by the switchboard.
    garbage: BTreeMap<LineId, GarbageCount>,
    stop: StopFlag,
    once: bool,
    /// Who started this process for itself.
    parent: Option<Parent>,
    rest: Rest,
    /// Why recording failed; the flight is stopped at the next opportunity.
    recording_failed: Option<String>,
}

/// The messages of a line were handed to its session: records them, with how late that was. Had one been early, its record
/// would say so.
fn settle(posted: &mut [Vec<Posted>], line: usize, at: Instant, mut record: impl FnMut(&Settled)) {
    for (mut settled, due) in posted.get_mut(line).into_iter().flat_map(|posted| posted.drain(..)) {
        if let Some(due) = due {
            settled.late_ns = Some(late_ns(at, due));
        }
        record(&settled);
    }
}

fn is_control(id: &str) -> bool {
    id == COLLECTOR || id == OPERATOR
}

impl HubPort {
    fn send(&self, id: &str, bytes: &[u8]) {
        if let Some(line) = self.lines.get(id)
            && let Err(error) = self.switchboard.send(*line, Plane::Mission, bytes)
        {
            tracing::debug!("not sent to {id}: {error}");
        }
    }

    /// Sends what the machine has just delivered, or leaves it to the loop if there is much of it; true if the loop must be
    /// told.
    fn send_at_once(&mut self, at: Instant) -> bool {
        if self.burst.send_at.is_some() {
            return false;
        }
        let burst = &mut self.burst;
        if burst.begun.is_none_or(|begun| at.saturating_duration_since(begun) > BURST) {
            (burst.begun, burst.sendings) = (Some(at), 0);
        }
        if burst.sendings < SINGLE_SENDINGS {
            self.burst.sendings += self.hand_over();
            return false;
        }
        if self.switchboard.is_flushed() {
            return false;
        }
        burst.send_at = Some(at + GATHERING);
        true
    }

    /// Sends what was posted, and records how late it was at that moment; how many messages.
    fn hand_over(&mut self) -> usize {
        let (posted, logs) = (&mut self.posted, &mut self.logs);
        self.switchboard.flush(|line, at| settle(posted, line.index(), at, |settled| logs.settled(settled)))
    }

    /// Records how many states were dropped for want of time or room since it was last done, by line and place.
    fn record_overruns(&mut self, record: bool) {
        let t_ns = self.clock.now().nanos().max(0);
        for line in self.seats.iter().flatten() {
            let (Some(counts), Some(vehicle)) = (self.switchboard.counts(*line), self.ids.get(line)) else { continue };
            for (place, so_far) in
                [(Overrun::BeforeEmulator, counts.state_dropped), (Overrun::ToReceiver, counts.state_unsent)]
            {
                let before = self.overruns.insert((*line, place), so_far).unwrap_or(0);
                if record && so_far > before {
                    let row = OverrunRow { t_ns, vehicle: vehicle.clone(), place, count: so_far - before };
                    self.logs.write(Row::Clock(ClockRecord::Overrun(row)));
                }
            }
        }
        self.overrun_pace.happened();
    }

    fn ignore(&mut self, line: LineId, kind: Garbage) {
        if self.garbage.entry(line).or_default().count(kind) {
            let id = self.ids.get(&line).map_or("?", |id| &**id);
            tracing::warn!("ignored a message of {id} on the mission plane: {}", kind.as_str());
        }
    }

    fn exit_code(&self) -> ExitCode {
        if self.recording_failed.is_some() { ExitCode::from(4) } else { ExitCode::SUCCESS }
    }
}

impl Port for HubPort {
    type Machine = Hub;
    type Event = HubEvent;
    type Exit = ExitCode;

    /// The delays that it emulates are a promise.
    const PUNCTUAL: bool = true;

    fn translate(&mut self, event: HubEvent) -> Option<(Option<Instant>, HubInput)> {
        match event {
            HubEvent::Joined { line, id } => {
                let name = Name::from(id.as_str());
                self.lines.insert(name.clone(), line);
                self.ids.insert(line, name);
                if is_control(&id) {
                    return None;
                }
                tracing::info!("{id} joined");
                let seat = line.index();
                self.seats.resize(self.seats.len().max(seat + 1), None);
                self.seats[seat] = Some(line);
                Some((None, HubInput::Joined { id, seat }))
            }
            HubEvent::Left { line } => {
                let id = self.ids.get(&line)?.clone();
                if is_control(&id) {
                    return None;
                }
                tracing::warn!("{id} left");
                Some((None, HubInput::Left(id.to_string())))
            }
            HubEvent::Packet { line, plane: Plane::State, at, bytes } => {
                let seat = self.seats.get(line.index())?.is_some().then_some(line.index())?;
                Some((Some(at), HubInput::State(seat, bytes.into())))
            }
            HubEvent::Packet { line, plane: Plane::Mission, bytes, .. } => {
                let id = self.ids.get(&line)?.clone();
                let input = if is_control(&id) {
                    wire::decode::<ToFleet>(&bytes)
                        .map(|message| HubInput::FromControl { who: id.to_string(), message })
                } else {
                    wire::decode::<FromVehicle>(&bytes).map(|message| HubInput::FromVehicle(id.to_string(), message))
                };
                match input {
                    Ok(input) => Some((None, input)),
                    Err(kind) => {
                        self.ignore(line, kind);
                        None
                    }
                }
            }
        }
    }

    fn perform(&mut self, output: HubOutput, clock: &mut Clock) -> Next<Self> {
        match output {
            HubOutput::ToVehicle(id, message) => self.send(&id, &wire::encode(&message)),
            HubOutput::Deliver { seat, bytes, settled } => match self.seats.get(seat) {
                Some(Some(line)) => {
                    if let Some(settled) = settled {
                        self.posted.resize_with(self.posted.len().max(line.index() + 1), Vec::new);
                        let due = clock.instant_of(Time::from_nanos(settled.due_ns));
                        self.posted[line.index()].push((settled, due));
                    }
                    if let Some(at) = self.switchboard.post(*line, &bytes) {
                        settle(&mut self.posted, line.index(), at, |settled| self.logs.settled(settled));
                    }
                }
                _ => settled.iter().for_each(|settled| self.logs.settled(settled)),
            },
            HubOutput::ToControl { who, message } => self.send(&who, &wire::encode(&message)),
            HubOutput::Record(row) => self.logs.write(row),
            HubOutput::Settled(settled) => self.logs.settled(&settled),
            HubOutput::CloseLog => {
                self.hand_over();
                self.record_overruns(true);
                self.logs.close();
            }
            HubOutput::Say(text) => tracing::info!("{text}"),
            HubOutput::OpenLog { mission, fresh } => {
                // What was dropped before is not of this flight.
                self.record_overruns(false);
                return Next::Feed(match self.logs.open(&mission.0, self.start_unix_ns, fresh) {
                    Ok(earlier) => HubInput::LogOpened { last: earlier.until },
                    Err(reason) => {
                        tracing::error!("{reason}");
                        self.recording_failed = Some(reason.clone());
                        HubInput::LogFailed(reason)
                    }
                });
            }
            HubOutput::StartClock(pace) => {
                let plan = match pace {
                    Pace::Stepped => ClockPlan::Stepped,
                    Pace::Real { speed_up } => Clock::plan(START_LEAD, speed_up),
                };
                *clock = Clock::follow(plan);
                self.clock = *clock;
                self.start_unix_ns = plan.start_unix_ns();
                return Next::Feed(HubInput::ClockStarted(plan));
            }
            HubOutput::FollowClock(plan) => {
                *clock = Clock::follow(plan);
                self.clock = *clock;
                self.start_unix_ns = plan.start_unix_ns();
                return Next::Feed(HubInput::ClockStarted(plan));
            }
            HubOutput::ReadLog { digest, file, offset } => {
                return Next::Feed(HubInput::Log(self.logs.piece(digest, file, offset)));
            }
            HubOutput::Dismissed if self.once => return Next::Exit(self.exit_code()),
            HubOutput::Dismissed => {}
        }
        Next::Go
    }

    fn flush(&mut self, now: Instant) -> Option<Instant> {
        match self.burst.send_at {
            Some(at) if at > now => {}
            Some(_) => {
                // It goes on while there is much to send.
                let goes_on = self.hand_over() >= SINGLE_SENDINGS / 2;
                self.burst = Burst { begun: Some(now), sendings: 0, send_at: goes_on.then_some(now + GATHERING) };
            }
            None => {
                self.send_at_once(now);
            }
        }
        self.burst.send_at
    }

    fn tend(&mut self, hub: &Hub) -> Next<Self> {
        if self.overrun_pace.is_due() && hub.phase() == Phase::Running {
            self.record_overruns(true);
        }
        if let Some(failure) = self.logs.tend() {
            tracing::error!("{failure}; the network goes on without it");
            self.recording_failed = Some(failure);
        }
        if self.once && self.rest.is_over(hub.phase() == Phase::Running) {
            tracing::warn!("nothing to fly for ten minutes; ended");
            return Next::Exit(self.exit_code());
        }
        if self.parent.as_ref().is_some_and(Parent::is_gone) && hub.phase() != Phase::Running {
            tracing::info!("mission-control is gone; ended");
            return Next::Exit(self.exit_code());
        }
        if self.stop.is_raised() {
            tracing::info!("ended by signal");
            return Next::Exit(self.exit_code());
        }
        Next::Go
    }

    fn closed(&mut self) -> ExitCode {
        tracing::error!("the switchboard is closed");
        ExitCode::from(3)
    }
}

#[cfg(test)]
mod tests {
    use common::record::Fate;

    use super::*;

    #[test]
    #[allow(clippy::disallowed_methods, reason = "lateness is a difference of moments")]
    fn a_hand_over_before_its_time_is_recorded_as_early() {
        let (at, a_little) = (Instant::now(), Duration::from_micros(3));
        let settled = |seq| {
            let (fate, late_ns) = (Fate::Delivered, Some(0));
            Settled { t_ns: 5, link: 0, seq, sent_ns: 0, due_ns: 5, fate, late_ns }
        };
        let due = [at + a_little, at, at - a_little].map(Some);
        let mut posted = vec![Vec::new(), (0..).map(settled).zip(due).collect()];
        let mut late = Vec::new();
        settle(&mut posted, 1, at, |settled| late.push((settled.seq, settled.late_ns)));
        assert_eq!(late, [(0, Some(-3000)), (1, Some(0)), (2, Some(3000))]);
        assert_eq!(posted[1], []);
    }
}
