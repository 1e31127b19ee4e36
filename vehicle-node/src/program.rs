//! The vehicle as a program: what it does for its machine. The only file of this crate that knows there is a network.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use bus::clock::AtMostEvery;
use bus::console::{Parent, StopFlag};
use bus::drive::{Clock, Next, Port, Program, Rest, Shared, drive};
use bus::line::{Line, LineConfig, LineEvent};
use bus::logs::Logs;
use bus::setup::Endpoint;
use bus::{Plane, Refusal};
use clap::Parser;
use common::record::{ClockRecord, Name, Overrun, OverrunRow, Row};
use common::wire::vehicle::{Phase, ToVehicle};
use common::wire::{self, GarbageCount};

use crate::node::{NodeInput, NodeOutput, VehicleNode};

/// Between two rows about messages that were dropped.
const OVERRUN_PERIOD: Duration = Duration::from_secs(1);

/// Why a vehicle that was started for one run ends without being asked to.
const PARENT_GONE: &str = "mission-control is gone; ended";

/// One vehicle of a fleet: simulates its body, follows its path, and coordinates with the others by sending nothing but
/// its coordination state.
///
/// It starts knowing only its name. It waits for the network-emulator, gets its mission from mission-control through it,
/// flies, keeps its log, and waits for the next mission. It goes on flying when the network or mission-control is lost.
///
/// Exit codes: 0 ended as asked, 2 wrong use, 3 no way to the network-emulator, 4 no logs can be kept, or recording failed.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "vehicle-node",
    version,
    after_help = "Example, one terminal each:\n  \
    network-emulator\n  vehicle-node --id auv1\n  vehicle-node --id auv2\n  vehicle-node --id auv3\n  \
    mission-control run missions/auv-helix.toml --attach"
)]
pub struct Args {
    /// The vehicle's name in the mission file (default: the host's name)
    #[arg(long, env = "CPF_ID")]
    pub id: Option<String>,
    /// The network-emulator to connect to
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/127.0.0.1:7447", env = "CPF_CONNECT")]
    pub connect: Endpoint,
    /// Folder for the logs of this vehicle; of earlier flights of a mission it keeps the newest five
    #[arg(long, value_name = "DIR", default_value = "logs", env = "CPF_LOGS")]
    pub logs: PathBuf,
    /// Give up when the network-emulator has not been found for this long (s) (default: never)
    #[arg(long, value_name = "SECONDS", value_parser = bus::console::patience)]
    pub patience: Option<Duration>,
    /// End when mission-control has collected the log of a flight, or when nothing has been flown for ten minutes
    #[arg(long)]
    pub once: bool,
    /// End when standard input is closed, but not before a flight under way is over: what started this process is gone
    #[arg(long, hide = true)]
    pub end_with_stdin: bool,
}

/// Runs the program to its end.
pub fn run(args: Args) -> ExitCode {
    let id = args.id.unwrap_or_else(bus::console::host_name);
    let stop = StopFlag::on_signals();
    if let Err(refusal) = bus::check_id(&id) {
        tracing::error!("--id: {refusal}");
        return ExitCode::from(2);
    }
    let logs = Logs::new(&args.logs, &id);
    if let Err(reason) = logs.check() {
        tracing::error!("{id}: {reason}");
        return ExitCode::from(4);
    }
    let mut config = LineConfig::new(args.connect, id.as_str());
    config.patience = args.patience;
    let parent = args.end_with_stdin.then(Parent::at_stdin);
    let mut in_vain = || parent.as_ref().filter(|parent| parent.is_gone()).map(|_| PARENT_GONE.to_string());
    let (line, events) = match Line::connect_unless(config, &mut in_vain) {
        Ok(line) => line,
        Err(bus::Error::InVain(why)) => {
            tracing::info!("{id}: {why}");
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            tracing::error!("{id}: {error}");
            return ExitCode::from(3);
        }
    };
    stop.arm();
    let node = VehicleNode::new(&id);
    let port = VehiclePort {
        logs,
        id,
        line,
        stop,
        once: args.once,
        parent,
        rest: Rest::default(),
        garbage: GarbageCount::default(),
        overruns: [0; 2],
        overrun_pace: AtMostEvery::new(OVERRUN_PERIOD),
        clock: Clock::Stopped,
        start_unix_ns: None,
        refused: None,
        recording_failed: false,
    };
    let program = Shared::new(Program::new(node, port, Clock::Stopped));
    let exit = drive(&program, &events);
    let mut port = program.into_port();
    port.logs.close();
    port.line.close();
    exit
}

struct VehiclePort {
    id: String,
    line: Line,
    logs: Logs,
    stop: StopFlag,
    once: bool,
    /// Who started this process for itself.
    parent: Option<Parent>,
    rest: Rest,
    garbage: GarbageCount,
    /// How many messages were recorded as dropped: before this program looked at them, and on their way out.
    overruns: [u64; 2],
    overrun_pace: AtMostEvery,
    /// The program's clock.
    clock: Clock,
    /// When mission time is zero, if it passes with the wall clock.
    start_unix_ns: Option<i64>,
    refused: Option<Refusal>,
    recording_failed: bool,
}

impl VehiclePort {
    fn exit_code(&self) -> ExitCode {
        if self.recording_failed { ExitCode::from(4) } else { ExitCode::SUCCESS }
    }

    fn send(&self, plane: Plane, bytes: &[u8]) {
        // While the line is down there is nobody to tell; the flight goes on, and the line says when it is back.
        if let Err(error) = self.line.send(plane, bytes) {
            tracing::debug!("{}: not sent: {error}", self.id);
        }
    }
}

impl VehiclePort {
    /// Records how many messages were dropped for want of time or room since it was last done.
    fn record_overruns(&mut self, record: bool) {
        let counts = self.line.counts();
        let t_ns = self.clock.now().nanos().max(0);
        let places = [(Overrun::AtReceiver, counts.state_dropped), (Overrun::AtSender, counts.state_unsent)];
        for ((place, so_far), before) in places.into_iter().zip(&mut self.overruns) {
            let count = so_far - std::mem::replace(before, so_far).min(so_far);
            if record && count > 0 {
                let vehicle = Name::from(self.id.as_str());
                self.logs.write(Row::Clock(ClockRecord::Overrun(OverrunRow { t_ns, vehicle, place, count })));
            }
        }
        self.overrun_pace.happened();
    }
}

impl Port for VehiclePort {
    type Machine = VehicleNode;
    type Event = LineEvent;
    type Exit = ExitCode;

    fn translate(&mut self, event: LineEvent) -> Option<(Option<Instant>, NodeInput)> {
        match event {
            LineEvent::Connected => {
                tracing::info!("{}: connected", self.id);
                Some((None, NodeInput::Connected))
            }
            LineEvent::Lost => {
                tracing::warn!("{}: lost the network-emulator; looking for it", self.id);
                Some((None, NodeInput::Lost))
            }
            LineEvent::Refused(refusal) => {
                self.refused = Some(refusal);
                None
            }
            LineEvent::Packet { plane: Plane::State, at, bytes } => Some((Some(at), NodeInput::Heard(bytes))),
            LineEvent::Packet { plane: Plane::Mission, bytes, .. } => match wire::decode::<ToVehicle>(&bytes) {
                Ok(message) => Some((None, NodeInput::Message(message))),
                Err(kind) => {
                    if self.garbage.count(kind) {
                        tracing::warn!("{}: ignored a message on the mission plane: {}", self.id, kind.as_str());
                    }
                    None
                }
            },
        }
    }

    fn perform(&mut self, output: NodeOutput, clock: &mut Clock) -> Next<Self> {
        match output {
            NodeOutput::Send(message) => self.send(Plane::Mission, &wire::encode(&message)),
            NodeOutput::Transmit(bytes) => self.send(Plane::State, &bytes),
            NodeOutput::Record(row) => self.logs.write(row),
            NodeOutput::CloseLog => {
                self.record_overruns(true);
                self.logs.close();
            }
            NodeOutput::Say(text) => tracing::info!("{}: {text}", self.id),
            NodeOutput::FollowClock(plan) => {
                *clock = Clock::follow(plan);
                self.clock = *clock;
                self.start_unix_ns = plan.start_unix_ns();
                return Next::Feed(NodeInput::ClockStarted);
            }
            NodeOutput::OpenLog { mission, fresh } => {
                // What was dropped before is not of this flight.
                self.record_overruns(false);
                return Next::Feed(match self.logs.open(&mission.0, self.start_unix_ns, fresh) {
                    Ok(earlier) => NodeInput::LogOpened { last: earlier.last_state.map(Box::new) },
                    Err(reason) => {
                        tracing::error!("{}: {reason}", self.id);
                        self.recording_failed = true;
                        NodeInput::LogFailed(reason)
                    }
                });
            }
            NodeOutput::ReadLog { digest, file, offset } => {
                return Next::Feed(NodeInput::Log(self.logs.piece(digest, file, offset)));
            }
            NodeOutput::Dismissed if self.once => return Next::Exit(self.exit_code()),
            NodeOutput::Dismissed => {}
        }
        Next::Go
    }

    fn tend(&mut self, node: &VehicleNode) -> Next<Self> {
        if let Some(failure) = self.logs.tend() {
            // A vehicle under way is worth more than its log.
            let on = if node.phase() == Phase::Running { "; the flight goes on without it" } else { "" };
            tracing::error!("{}: {failure}{on}", self.id);
            self.recording_failed = true;
        }
        if self.overrun_pace.is_due() && node.phase() == Phase::Running {
            self.record_overruns(true);
        }
        if let Some(refusal) = self.refused.take() {
            tracing::error!("{}: {refusal}", self.id);
            return Next::Exit(ExitCode::from(3));
        }
        if self.once && self.rest.is_over(node.phase() == Phase::Running) {
            tracing::warn!("{}: nothing to fly for ten minutes; ended", self.id);
            return Next::Exit(self.exit_code());
        }
        if self.parent.as_ref().is_some_and(Parent::is_gone) && node.phase() != Phase::Running {
            tracing::info!("{}: {PARENT_GONE}", self.id);
            return Next::Exit(self.exit_code());
        }
        if self.stop.is_raised() {
            tracing::info!("{}: ended by signal", self.id);
            return Next::Exit(self.exit_code());
        }
        Next::Go
    }

    fn closed(&mut self) -> ExitCode {
        tracing::error!("{}: the line is closed", self.id);
        ExitCode::from(3)
    }
}
