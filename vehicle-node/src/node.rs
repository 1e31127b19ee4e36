//! The life of a vehicle process as a pure machine: `Idle -> Armed -> Running -> Finished`, `Aborted` from anywhere.
//!
//! A node starts knowing only its own name. The mission reaches it through its line, with its digest; it refuses one
//! that it cannot fly, with the reason. It goes on flying when it loses its line, and when it comes back it says what
//! it is doing.

use std::collections::VecDeque;
use std::sync::Arc;

use common::machine::Machine;
use common::mission::{Mission, SharedMission, Start};
use common::record::{Row, StateRow};
use common::time::Time;
use common::wire::vehicle::{ClockPlan, FlightPlan, FromVehicle, LogPiece, Phase, SpeedCommand, ToVehicle};

use crate::flight::{Flight, FlightInput, FlightOutput};

/// The reason of a vehicle that was told to end its flight: it had none of its own.
pub const STOPPED: &str = "stopped";

/// What can happen to a vehicle process, beside the passing of time.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeInput {
    /// The line is up.
    Connected,
    /// The line is down.
    Lost,
    /// Something came on the mission plane.
    Message(ToVehicle),
    /// Bytes came from the air.
    Heard(Vec<u8>),
    /// The driver has started the clock.
    ClockStarted,
    /// The log is open; `last` is the last state that an earlier process of this vehicle recorded in this flight.
    LogOpened {
        /// That state, if there is one.
        last: Option<Box<StateRow>>,
    },
    /// The log could not be opened, and why.
    LogFailed(String),
    /// A piece of the log, as asked for.
    Log(LogPiece),
}

/// What a vehicle process wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeOutput {
    /// Say this on the mission plane.
    Send(FromVehicle),
    /// Put these bytes on the air.
    Transmit(Vec<u8>),
    /// Open a log for this mission and answer with [`NodeInput::LogOpened`].
    OpenLog {
        /// The mission.
        mission: SharedMission,
        /// Whether the flight begins: what an earlier flight of the same mission left is set aside.
        fresh: bool,
    },
    /// Everything is collected: a process that was started for one flight may end.
    Dismissed,
    /// Record this row.
    Record(Row),
    /// The flight is over: close the log.
    CloseLog,
    /// Follow this clock and answer with [`NodeInput::ClockStarted`].
    FollowClock(ClockPlan),
    /// Read a piece of the log and answer with [`NodeInput::Log`].
    ReadLog {
        /// Which mission's.
        digest: u64,
        /// Which of its files.
        file: u32,
        /// From which byte.
        offset: u64,
    },
    /// A line for people.
    Say(String),
}

/// A vehicle process as a pure machine.
pub struct VehicleNode {
    id: String,
    /// A mission that was checked already.
    checked: Option<Arc<Mission>>,
    phase: Phase,
    load: Option<Load>,
    outputs: VecDeque<NodeOutput>,
}

struct Load {
    mission: Arc<Mission>,
    me: usize,
    clock: Option<ClockPlan>,
    speeds: Vec<SpeedCommand>,
    flight: Option<Flight>,
}

impl VehicleNode {
    /// A vehicle called `id` that knows nothing yet.
    pub fn new(id: &str) -> VehicleNode {
        VehicleNode { id: id.to_string(), checked: None, phase: Phase::Idle, load: None, outputs: VecDeque::new() }
    }

    /// A vehicle that need not check this mission again: a fleet in one thread shares it.
    pub fn knowing(id: &str, mission: Arc<Mission>) -> VehicleNode {
        VehicleNode { checked: Some(mission), ..VehicleNode::new(id) }
    }

    /// Where it is in its life.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    fn send(&mut self, message: FromVehicle) {
        self.outputs.push_back(NodeOutput::Send(message));
    }

    fn say(&mut self, text: String) {
        self.outputs.push_back(NodeOutput::Say(text));
    }

    /// Says what this vehicle is doing: a hub that was restarted learns from it what it has forgotten.
    fn hello(&mut self) {
        let flight = self.load.as_ref().and_then(|load| {
            let clock = load.clock?;
            Some(FlightPlan { mission: load.mission.text.clone(), clock, speeds: load.speeds.clone() })
        });
        self.send(FromVehicle::Hello { phase: self.phase, flight });
    }

    fn message(&mut self, message: ToVehicle) {
        match message {
            ToVehicle::Arm { mission } => self.arm(&mission),
            ToVehicle::Start { digest, clock, speeds } => self.start(digest, clock, speeds),
            ToVehicle::Speed(command) => self.speed(command),
            ToVehicle::Stop => self.stop(),
            ToVehicle::Dismiss => self.outputs.push_back(NodeOutput::Dismissed),
            ToVehicle::Grant { until, heard, speeds } => self.grant(until, heard, speeds),
            ToVehicle::SendLog { digest, file, offset } => {
                self.outputs.push_back(NodeOutput::ReadLog { digest, file, offset });
            }
        }
    }

    fn arm(&mut self, text: &str) {
        let digest = common::mission::digest(text);
        if self.phase == Phase::Running && self.load.as_ref().is_some_and(|load| load.mission.digest == digest) {
            // A hub that has just come back did not know; this is no refusal.
            return self.hello();
        }
        if self.phase == Phase::Running {
            let flying = self.load.as_ref().map_or("another mission", |load| load.mission.name.as_str());
            let reason = format!("{} is flying {flying}", self.id);
            return self.send(FromVehicle::Refused { digest, reason });
        }
        match self.accept(text) {
            Ok(load) => {
                self.say(format!("armed for {}", load.mission.name));
                self.load = Some(load);
                self.phase = Phase::Armed;
                self.send(FromVehicle::Armed { digest });
            }
            Err(reason) => {
                self.say(format!("mission refused: {reason}"));
                self.send(FromVehicle::Refused { digest, reason });
            }
        }
    }

    /// Checks for itself that the mission can be flown: what was uploaded need not have been checked by anyone.
    fn accept(&self, text: &str) -> Result<Load, String> {
        let mission = match &self.checked {
            Some(checked) if checked.text == text => checked.clone(),
            _ => Arc::new(Mission::parse("the mission", text).map_err(|faults| faults.to_string())?),
        };
        let me = mission.index_of(&self.id).ok_or_else(|| {
            let ids: Vec<&str> = mission.vehicles.iter().map(|v| v.id.as_str()).collect();
            format!("mission {} is for {}, not for {}", mission.name, ids.join(", "), self.id)
        })?;
        mission.craft(me, mission.vehicles[me].start)?;
        Ok(Load { mission, me, clock: None, speeds: Vec::new(), flight: None })
    }

    fn start(&mut self, digest: u64, clock: ClockPlan, speeds: Vec<SpeedCommand>) {
        let Some(load) = self.load.as_mut().filter(|load| load.mission.digest == digest) else { return };
        if self.phase != Phase::Armed {
            return;
        }
        load.clock = Some(clock);
        load.speeds = speeds;
        // The stepped clock too: the driver may still follow the wall clock of the flight before.
        self.outputs.push_back(NodeOutput::FollowClock(clock));
    }

    fn open_log(&mut self, fresh: bool) {
        if let Some(load) = &self.load {
            let mission = SharedMission(load.mission.clone());
            self.outputs.push_back(NodeOutput::OpenLog { mission, fresh });
        }
    }

    /// Whether the flight began without this vehicle; a stepped one waits for all.
    fn is_late(&self, now: Time) -> bool {
        self.load.as_ref().is_some_and(|load| {
            let real = matches!(load.clock, Some(ClockPlan::Real { .. }));
            real && now > Time::ZERO + load.mission.control_period * load.mission.message_ticks
        })
    }

    /// The log is open: begin, or join the others where this vehicle should be by now.
    fn take_off(&mut self, now: Time, last: Option<&StateRow>) {
        let late = self.is_late(now);
        let Some(load) = self.load.as_mut().filter(|_| self.phase == Phase::Armed) else { return };
        let speed_up = match load.clock {
            Some(ClockPlan::Real { speed_up, .. }) => Some(speed_up),
            _ => None,
        };
        let flight = if late {
            let start = rejoin_at(&load.mission, load.me, &load.speeds, now, last);
            Flight::rejoin(load.mission.clone(), load.me, start, now, speed_up)
        } else {
            Flight::new(load.mission.clone(), load.me, speed_up)
        };
        match flight {
            Ok(mut flight) => {
                for command in &load.speeds {
                    flight.handle(now, Some(FlightInput::Speed(*command)));
                }
                load.flight = Some(flight);
                self.phase = Phase::Running;
                let name = load.mission.name.clone();
                self.say(if late { format!("joining {name} at {now}") } else { format!("flying {name}") });
            }
            Err(reason) => self.abort(reason),
        }
    }

    fn speed(&mut self, command: SpeedCommand) {
        if let Some(load) = self.load.as_mut().filter(|_| self.phase == Phase::Running) {
            // A hub tells all it knows to one that comes back: most of it is known here.
            if load.speeds.contains(&command) {
                return;
            }
            load.speeds.push(command);
            load.speeds.sort_by_key(|known| known.at);
            // Also those after it: a command replaces what was to hold from its instant on.
            let from_here = load.speeds.iter().filter(|known| known.at >= command.at);
            if let Some(flight) = &mut load.flight {
                from_here.for_each(|known| flight.handle(known.at, Some(FlightInput::Speed(*known))));
            }
        }
    }

    fn stop(&mut self) {
        if self.phase == Phase::Running {
            self.outputs.push_back(NodeOutput::CloseLog);
        }
        if matches!(self.phase, Phase::Running | Phase::Armed) {
            self.phase = Phase::Aborted;
            self.say(STOPPED.to_string());
            self.send(FromVehicle::Ended { phase: Phase::Aborted, reason: STOPPED.to_string() });
        }
    }

    fn abort(&mut self, reason: String) {
        self.phase = Phase::Aborted;
        self.say(format!("flight aborted: {reason}"));
        self.outputs.push_back(NodeOutput::CloseLog);
        self.send(FromVehicle::Ended { phase: Phase::Aborted, reason });
    }

    /// Stepped clock: runs every control period up to `until`, then says so.
    fn grant(&mut self, until: Time, heard: Vec<(Time, Vec<u8>)>, speeds: Vec<SpeedCommand>) {
        if self.phase == Phase::Aborted {
            // Who gave up does not keep the others waiting.
            return self.send(FromVehicle::Reached { until, sent: Vec::new() });
        }
        let Some(flight) = self.load.as_mut().and_then(|load| load.flight.as_mut()) else { return };
        if self.phase != Phase::Running {
            return;
        }
        for command in speeds {
            flight.handle(command.at, Some(FlightInput::Speed(command)));
        }
        let mut sent = Vec::new();
        let mut rest = Vec::new();
        let inputs = heard.into_iter().map(|(at, bytes)| (at, FlightInput::Heard(bytes)));
        flight.run_until(until, inputs, |at, output| match output {
            FlightOutput::Transmit(bytes) => sent.push((at, bytes)),
            other => rest.push(other),
        });
        for output in rest {
            if let FlightOutput::Record(row) = output {
                self.outputs.push_back(NodeOutput::Record(row));
            } else {
                self.outcome(output);
            }
        }
        self.send(FromVehicle::Reached { until, sent });
    }

    /// The flight has come to an end of some kind.
    fn outcome(&mut self, output: FlightOutput) {
        match output {
            FlightOutput::Finished => {
                self.phase = Phase::Finished;
                self.say("flight finished".to_string());
                self.outputs.push_back(NodeOutput::CloseLog);
                self.send(FromVehicle::Ended { phase: Phase::Finished, reason: String::new() });
            }
            FlightOutput::Failed(reason) => self.abort(reason),
            FlightOutput::Transmit(_) | FlightOutput::Record(_) => {}
        }
    }

    fn drain_flight(&mut self) {
        while let Some(output) = self.load.as_mut().and_then(|load| load.flight.as_mut()).and_then(Flight::poll_output)
        {
            match output {
                FlightOutput::Transmit(bytes) => self.outputs.push_back(NodeOutput::Transmit(bytes)),
                FlightOutput::Record(row) => self.outputs.push_back(NodeOutput::Record(row)),
                end => self.outcome(end),
            }
        }
    }
}

/// Where a vehicle that comes back begins: its body where it was last recorded (or at the mission's start), its virtual
/// target where the formation should be by now.
fn rejoin_at(mission: &Mission, me: usize, speeds: &[SpeedCommand], now: Time, last: Option<&StateRow>) -> Start {
    let mut profile = mission.speed.clone();
    speeds.iter().for_each(|command| profile.command(*command));
    let travelled = |from: Time| mission.nominal_factor() * (profile.distance(now) - profile.distance(from));
    let start = mission.vehicles[me].start;
    match last {
        Some(row) => Start {
            position: [row.x_m, row.y_m, row.z_m],
            yaw: row.yaw_rad,
            speed: 0.0,
            xi: row.xi + travelled(Time::from_nanos(row.t_ns)),
        },
        None => Start { xi: start.xi + travelled(Time::ZERO), ..start },
    }
}

impl Machine for VehicleNode {
    type Input = NodeInput;
    type Output = NodeOutput;

    fn handle(&mut self, now: Time, input: Option<NodeInput>) {
        match input {
            Some(NodeInput::Connected) => self.hello(),
            Some(NodeInput::Lost) => {
                let stepped =
                    self.load.as_ref().is_some_and(|load| load.clock.is_some_and(|clock| clock == ClockPlan::Stepped));
                if self.phase == Phase::Running && stepped {
                    self.abort("lost the line in a stepped run".to_string());
                }
            }
            Some(NodeInput::Message(message)) => self.message(message),
            Some(NodeInput::ClockStarted) => {
                let fresh = !self.is_late(now);
                self.open_log(fresh);
            }
            Some(NodeInput::LogOpened { last }) => self.take_off(now, last.as_deref()),
            Some(NodeInput::LogFailed(reason)) => self.abort(reason),
            Some(NodeInput::Log(piece)) => self.send(FromVehicle::Log(piece)),
            Some(NodeInput::Heard(bytes)) => {
                if let Some(flight) = self.load.as_mut().and_then(|load| load.flight.as_mut()) {
                    flight.handle(now, Some(FlightInput::Heard(bytes)));
                }
            }
            None => {
                if let Some(flight) = self.load.as_mut().and_then(|load| load.flight.as_mut()) {
                    flight.handle(now, None);
                }
            }
        }
        if self.phase == Phase::Running {
            self.drain_flight();
        }
    }

    fn poll_output(&mut self) -> Option<NodeOutput> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        let load = self.load.as_ref().filter(|_| self.phase == Phase::Running)?;
        match load.clock {
            Some(ClockPlan::Real { .. }) => load.flight.as_ref().and_then(Flight::poll_timeout),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");

    fn outputs(node: &mut VehicleNode) -> Vec<NodeOutput> {
        std::iter::from_fn(|| node.poll_output()).collect()
    }

    /// Arms a vehicle and starts it by this clock, of which it is `now` when the driver has it.
    fn started(node: &mut VehicleNode, clock: ClockPlan, now: Time) -> Vec<NodeOutput> {
        let digest = common::mission::digest(HELIX);
        let arm = ToVehicle::Arm { mission: HELIX.to_string() };
        for message in [arm, ToVehicle::Start { digest, clock, speeds: Vec::new() }] {
            node.handle(now, Some(NodeInput::Message(message)));
        }
        let followed = outputs(node);
        assert!(followed.contains(&NodeOutput::FollowClock(clock)), "{followed:?}");
        node.handle(now, Some(NodeInput::ClockStarted));
        outputs(node)
    }

    fn opens_afresh(outputs: &[NodeOutput]) -> bool {
        outputs.iter().any(|output| matches!(output, NodeOutput::OpenLog { fresh: true, .. }))
    }

    #[test]
    fn a_stepped_flight_after_a_real_one_begins_at_its_begin() {
        let mut node = VehicleNode::new("auv1");
        let real = ClockPlan::Real { epoch_unix_ns: 0, speed_up: 400.0 };
        assert!(opens_afresh(&started(&mut node, real, Time::ZERO)));
        node.handle(Time::ZERO, Some(NodeInput::LogOpened { last: None }));
        node.handle(Time::from_secs(800.0), None);
        assert_eq!(node.phase(), Phase::Finished);
        outputs(&mut node);
        // Whatever the time of the driver is: a stepped flight begins at zero, for all.
        let long_after = Time::from_secs(994.6);
        assert!(opens_afresh(&started(&mut node, ClockPlan::Stepped, long_after)));
        node.handle(long_after, Some(NodeInput::LogOpened { last: None }));
        let said = outputs(&mut node);
        assert!(
            said.iter().any(|output| matches!(output, NodeOutput::Say(text) if text == "flying auv-helix")),
            "{said:?}"
        );
        let until = Time::from_secs(1.0);
        node.handle(long_after, Some(NodeInput::Message(ToVehicle::Grant { until, heard: vec![], speeds: vec![] })));
        let first = outputs(&mut node).into_iter().find_map(|output| match output {
            NodeOutput::Record(Row::Exact(common::record::Record::State(row))) => Some(row.t_ns),
            _ => None,
        });
        assert_eq!(first, Some(0));
    }

    #[test]
    fn a_speed_that_is_told_twice_is_known_once() {
        let mut node = VehicleNode::new("auv1");
        started(&mut node, ClockPlan::Real { epoch_unix_ns: 0, speed_up: 1.0 }, Time::ZERO);
        node.handle(Time::ZERO, Some(NodeInput::LogOpened { last: None }));
        let command = SpeedCommand { at: Time::from_secs(1.0), speed: 0.2 };
        for _ in 0..2 {
            node.handle(Time::ZERO, Some(NodeInput::Message(ToVehicle::Speed(command))));
        }
        outputs(&mut node);
        node.handle(Time::ZERO, Some(NodeInput::Connected));
        let said = outputs(&mut node);
        let [NodeOutput::Send(FromVehicle::Hello { flight: Some(flight), .. })] = &said[..] else { panic!("{said:?}") };
        assert_eq!(flight.speeds, vec![command]);
    }
}
