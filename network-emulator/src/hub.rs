//! The hub: the emulator program as a pure machine. Lets participants in, loads the mission, starts the clock, carries
//! coordination states through the [`Emulator`], conducts the stepped clock, and relays the mission plane.
//!
//! The hub is the fleet's memory: a vehicle that comes back gets the mission and the clock from it, and so does a new
//! mission-control. A hub that was killed gets both back from the first vehicle that finds it again.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use common::machine::Machine;
use common::mission::{Mission, digest};
use common::record::{ClockRecord, Name, NoteRow, Record, Row, SpeedRow};
use common::time::{Span, Time};
use common::wire::fleet::{FleetStatus, FromFleet, Pace, ToFleet, VehicleStatus};
use common::wire::vehicle::{ClockPlan, FlightPlan, FromVehicle, LogPiece, Phase, SpeedCommand, ToVehicle};

use crate::emulator::{Channel, Emulator, Sent};
use crate::lockstep::{Lockstep, WINDOW};

/// Name under which mission-control joins when it conducts a flight and collects its logs.
pub const COLLECTOR: &str = "mission-control";
/// Name under which single commands (status, speed, stop) join.
pub const OPERATOR: &str = "operator";
/// Name of the hub as a source of logs and notes.
pub const HUB: &str = "network-emulator";

/// A speed commanded now holds from this much later, so that every vehicle has it in time \[s of wall clock\].
const SPEED_LEAD_S: f64 = 0.25;

/// What can happen to the hub, beside the passing of time.
#[derive(Clone, Debug, PartialEq)]
pub enum HubInput {
    /// A vehicle's line came up.
    Joined(String),
    /// A vehicle's line went down.
    Left(String),
    /// A vehicle said something on the mission plane.
    FromVehicle(String, FromVehicle),
    /// A vehicle put bytes on the air.
    State(Name, Vec<u8>),
    /// Mission-control, or an operator at another terminal, said something.
    FromControl {
        /// Who: the answer goes there.
        who: String,
        /// What.
        message: ToFleet,
    },
    /// The log could not be opened, and why.
    LogFailed(String),
    /// The driver has started the clock.
    ClockStarted(ClockPlan),
    /// A piece of the hub's own log, as asked for.
    Log(LogPiece),
}

/// What the hub wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum HubOutput {
    /// Say this to a vehicle on the mission plane.
    ToVehicle(String, ToVehicle),
    /// Hand these bytes to a vehicle on the coordination plane.
    Deliver(Name, Arc<[u8]>),
    /// Say this to mission-control, or to an operator.
    ToControl {
        /// To whom.
        who: String,
        /// What.
        message: FromFleet,
    },
    /// Open a log for this mission.
    OpenLog {
        /// The mission.
        mission: Opened,
        /// Whether the flight begins: what an earlier flight of the same mission left is set aside.
        fresh: bool,
    },
    /// Everything is collected: a process that was started for one flight may end.
    Dismissed,
    /// Record this row.
    Record(Row),
    /// The flight is over: close the log.
    CloseLog,
    /// Choose the clock's origin, start the clock, and answer with [`HubInput::ClockStarted`].
    StartClock(Pace),
    /// Follow this clock, which others started, and answer with [`HubInput::ClockStarted`].
    FollowClock(ClockPlan),
    /// Read a piece of the log and answer with [`HubInput::Log`].
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

/// A mission whose log is to be opened.
#[derive(Clone, Debug)]
pub struct Opened(pub Arc<Mission>);

impl PartialEq for Opened {
    fn eq(&self, other: &Self) -> bool {
        self.0.digest == other.0.digest
    }
}

/// The emulator program as a pure machine.
pub struct Hub {
    vehicles: BTreeMap<String, Known>,
    load: Option<Load>,
    /// Who asked for what is being answered.
    asker: Option<String>,
    /// Most control periods in one grant of the stepped clock.
    window: i64,
    outputs: VecDeque<HubOutput>,
}

#[derive(Clone, Debug)]
struct Known {
    connected: bool,
    phase: Phase,
    reason: String,
}

struct Load {
    mission: Arc<Mission>,
    phase: Phase,
    clock: Option<ClockPlan>,
    emulator: Emulator,
    lockstep: Option<Lockstep>,
    /// Speeds commanded under way.
    speeds: Vec<SpeedCommand>,
    /// Taken over from a vehicle after the hub lost its memory.
    adopted: bool,
    /// Its logs are where they belong.
    collected: bool,
    now: Time,
}

impl Default for Hub {
    fn default() -> Self {
        Hub::new()
    }
}

impl Hub {
    /// A hub that knows nothing yet.
    pub fn new() -> Hub {
        Hub::with_window(WINDOW)
    }

    /// A hub whose stepped clock grants at most this many control periods at once. What is flown does not depend on it.
    pub fn with_window(window: i64) -> Hub {
        Hub { vehicles: BTreeMap::new(), load: None, asker: None, window, outputs: VecDeque::new() }
    }

    /// Where the fleet is in its life.
    pub fn phase(&self) -> Phase {
        self.load.as_ref().map_or(Phase::Idle, |load| load.phase)
    }

    /// Mission time up to which a stepped run is complete.
    pub fn mission_time(&self) -> Time {
        self.load.as_ref().map_or(Time::ZERO, |load| load.now)
    }

    /// Sent, delivered, dropped and in flight over all links.
    pub fn totals(&self) -> [u64; 4] {
        self.load.as_ref().map_or([0; 4], |load| load.emulator.totals())
    }

    fn say(&mut self, text: String) {
        self.outputs.push_back(HubOutput::Say(text));
    }

    fn tell_vehicle(&mut self, id: &str, message: ToVehicle) {
        self.outputs.push_back(HubOutput::ToVehicle(id.to_string(), message));
    }

    /// Answers whoever asked, if anyone did.
    fn answer(&mut self, message: FromFleet) {
        if let Some(who) = self.asker.clone() {
            self.outputs.push_back(HubOutput::ToControl { who, message });
        }
    }

    fn refuse(&mut self, reason: String) {
        self.answer(FromFleet::Refused { reason });
    }

    /// Ids of the mission's vehicles that are connected, in the mission's order.
    fn connected(&self) -> Vec<String> {
        let Some(load) = &self.load else { return Vec::new() };
        let is_up = |id: &str| self.vehicles.get(id).is_some_and(|known| known.connected);
        load.mission.vehicles.iter().map(|v| v.id.clone()).filter(|id| is_up(id)).collect()
    }

    fn tell_fleet(&mut self, message: &ToVehicle) {
        for id in self.connected() {
            self.tell_vehicle(&id, message.clone());
        }
    }

    // --- mission-control -------------------------------------------------------------------------------------------

    fn hear_control(&mut self, now: Time, message: ToFleet) {
        match message {
            ToFleet::Status => self.status(now),
            ToFleet::Upload { mission } => self.upload(now, &mission),
            ToFleet::Start { pace } => self.start(pace),
            ToFleet::Speed { speed } => self.speed(now, speed),
            ToFleet::Stop => self.stop(now, "stopped by mission-control"),
            ToFleet::Dismiss => {
                let ids: Vec<String> =
                    self.vehicles.iter().filter(|(_, k)| k.connected).map(|(id, _)| id.clone()).collect();
                for id in ids {
                    self.tell_vehicle(&id, ToVehicle::Dismiss);
                }
                if let Some(load) = &mut self.load {
                    load.collected = true;
                }
                self.outputs.push_back(HubOutput::Dismissed);
            }
            ToFleet::SendLog { who, digest, file, offset } if who == HUB => {
                self.outputs.push_back(HubOutput::ReadLog { digest, file, offset });
            }
            ToFleet::SendLog { who, digest, file, offset } => {
                if self.vehicles.get(&who).is_some_and(|known| known.connected) {
                    self.tell_vehicle(&who, ToVehicle::SendLog { digest, file, offset });
                } else {
                    self.refuse(format!("{who} is not connected, so its log cannot be had now"));
                }
            }
        }
    }

    fn status(&mut self, now: Time) {
        let mut vehicles: Vec<VehicleStatus> = Vec::new();
        let status = |id: &str, known: Option<&Known>| VehicleStatus {
            id: id.to_string(),
            connected: known.is_some_and(|k| k.connected),
            phase: known.map_or(Phase::Idle, |k| k.phase),
            reason: known.map_or(String::new(), |k| k.reason.clone()),
        };
        let mission = self.load.as_ref().map(|load| load.mission.clone());
        if let Some(mission) = &mission {
            vehicles.extend(mission.vehicles.iter().map(|v| status(&v.id, self.vehicles.get(&v.id))));
        }
        for (id, known) in &self.vehicles {
            if known.connected && mission.as_ref().is_none_or(|m| m.index_of(id).is_none()) {
                vehicles.push(status(id, Some(known)));
            }
        }
        let load = self.load.as_ref();
        let now = match load {
            Some(load) if load.phase == Phase::Running && load.lockstep.is_none() => now.min(load.mission.end),
            Some(load) => load.now,
            None => Time::ZERO,
        };
        let speed = load.map_or(0.0, |load| {
            let mut profile = load.mission.speed.clone();
            load.speeds.iter().for_each(|command| profile.command(*command));
            profile.at(now).v_l
        });
        let status = FleetStatus {
            phase: self.phase(),
            mission: load.map_or(String::new(), |load| load.mission.text.clone()),
            now,
            end: load.map_or(Time::ZERO, |load| load.mission.end),
            speed,
            vehicles,
            collected: load.is_some_and(|load| load.collected),
            messages: self.totals(),
        };
        self.answer(FromFleet::Status(status));
    }

    fn upload(&mut self, now: Time, text: &str) {
        if let Some(load) = self.load.as_ref().filter(|load| load.phase == Phase::Running) {
            if load.mission.text != text {
                let name = load.mission.name.clone();
                self.refuse(format!("the fleet is flying {name}; stop it first (mission-control stop)"));
            } else {
                self.status(now);
            }
            return;
        }
        match Mission::parse("the uploaded mission", text) {
            Err(faults) => self.refuse(faults.to_string()),
            Ok(mission) => {
                self.say(format!("mission {} loaded for {} vehicles", mission.name, mission.vehicles.len()));
                self.load(Arc::new(mission), false);
                for id in self.connected() {
                    self.arm(&id);
                }
                self.status(now);
            }
        }
    }

    fn load(&mut self, mission: Arc<Mission>, adopted: bool) {
        for vehicle in &mission.vehicles {
            if let Some(known) = self.vehicles.get_mut(&vehicle.id) {
                known.phase = Phase::Idle;
                known.reason.clear();
            }
        }
        self.load = Some(Load {
            emulator: Emulator::new(mission.clone(), None),
            mission,
            phase: Phase::Armed,
            clock: None,
            lockstep: None,
            speeds: Vec::new(),
            adopted,
            collected: false,
            now: Time::ZERO,
        });
    }

    fn arm(&mut self, id: &str) {
        if let Some(load) = &self.load {
            let mission = load.mission.text.clone();
            self.tell_vehicle(id, ToVehicle::Arm { mission });
        }
    }

    fn start(&mut self, pace: Pace) {
        let Some(load) = &self.load else { return self.refuse("no mission is loaded".into()) };
        if load.phase == Phase::Running {
            return self.refuse(format!("{} is already under way", load.mission.name));
        }
        let missing: Vec<&str> = load
            .mission
            .vehicles
            .iter()
            .map(|v| v.id.as_str())
            .filter(|id| !self.vehicles.get(*id).is_some_and(|k| k.connected && k.phase == Phase::Armed))
            .collect();
        if !missing.is_empty() {
            return self.refuse(format!("not every vehicle is armed: waiting for {}", missing.join(", ")));
        }
        self.outputs.push_back(HubOutput::StartClock(pace));
    }

    fn speed(&mut self, now: Time, speed: f64) {
        if !speed.is_finite() {
            return self.refuse(format!("found a formation speed of {speed}; allowed: a finite number"));
        }
        let Some(load) = self.load.as_mut().filter(|load| load.phase == Phase::Running) else {
            return self.refuse("no flight is under way, so there is no speed to change".into());
        };
        if let Err(reason) = load.mission.fits_speed(speed) {
            return self.refuse(format!("a formation speed of {speed} cannot be flown: {reason}"));
        }
        let at = match (&load.lockstep, load.clock) {
            (Some(lockstep), _) => lockstep.next_free(),
            (None, Some(ClockPlan::Real { speed_up, .. })) => now + Span::from_secs(SPEED_LEAD_S * speed_up),
            _ => now,
        };
        let command = SpeedCommand { at, speed };
        load.speeds.push(command);
        let row = SpeedRow { t_ns: at.nanos(), speed };
        self.outputs.push_back(HubOutput::Record(Row::Exact(Record::Speed(row))));
        match &mut load.lockstep {
            Some(lockstep) => lockstep.speeds.push(command),
            None => self.tell_fleet(&ToVehicle::Speed(command)),
        }
        self.answer(FromFleet::SpeedTaken { at, speed });
    }

    fn stop(&mut self, now: Time, why: &str) {
        let Some(load) = self.load.as_mut().filter(|load| matches!(load.phase, Phase::Running | Phase::Armed)) else {
            return self.refuse("no flight is under way, so there is nothing to stop".into());
        };
        let now = if load.lockstep.is_some() { load.lockstep.as_ref().map_or(now, |l| l.done()) } else { now };
        let was_running = load.phase == Phase::Running;
        load.phase = Phase::Aborted;
        load.now = now;
        if was_running {
            load.emulator.finish(now);
            self.drain_emulator();
            self.note(now, why);
            self.outputs.push_back(HubOutput::CloseLog);
        }
        self.tell_fleet(&ToVehicle::Stop);
        self.say(format!("flight ended: {why}"));
        self.status(now);
    }

    /// A piece of a log goes to mission-control, the only one who collects.
    fn collected(&mut self, from: &str, piece: LogPiece) {
        let message = FromFleet::Log { who: from.to_string(), piece };
        self.outputs.push_back(HubOutput::ToControl { who: COLLECTOR.to_string(), message });
    }

    fn note(&mut self, now: Time, text: &str) {
        let row = NoteRow { t_ns: now.nanos().max(0), source: HUB.into(), text: text.into(), count: 1 };
        self.outputs.push_back(HubOutput::Record(Row::Clock(ClockRecord::Note(row))));
    }

    // --- vehicles --------------------------------------------------------------------------------------------------

    fn joined(&mut self, id: String) {
        self.vehicles.entry(id).and_modify(|known| known.connected = true).or_insert(Known {
            connected: true,
            phase: Phase::Idle,
            reason: String::new(),
        });
    }

    fn left(&mut self, now: Time, id: &str) {
        if let Some(known) = self.vehicles.get_mut(id) {
            known.connected = false;
        }
        let Some(load) = &self.load else { return };
        if load.mission.index_of(id).is_none() || load.phase != Phase::Running {
            return;
        }
        if load.lockstep.is_some() {
            self.stop(now, &format!("{id} left a stepped run, which needs every vehicle"));
        } else {
            self.note(now, &format!("lost the line to {id}"));
        }
    }

    fn hear_vehicle(&mut self, now: Time, id: &str, message: FromVehicle) {
        match message {
            FromVehicle::Hello { phase, flight } => self.hello(id, phase, flight),
            FromVehicle::Armed { digest } => {
                if self.set_phase(id, digest, Phase::Armed, String::new()) {
                    self.join_flight(now, id);
                }
            }
            FromVehicle::Refused { digest, reason } => {
                self.say(format!("{id} refuses the mission: {reason}"));
                self.set_phase(id, digest, Phase::Idle, reason);
            }
            FromVehicle::Reached { until, sent } => self.reached(id, until, sent),
            FromVehicle::Ended { phase, reason } => {
                if let Some(known) = self.vehicles.get_mut(id) {
                    known.phase = phase;
                    known.reason = reason;
                }
                if phase == Phase::Aborted
                    && self.load.as_ref().is_some_and(|l| l.phase == Phase::Running && l.lockstep.is_some())
                {
                    self.stop(now, &format!("{id} aborted a stepped run, which needs every vehicle"));
                }
            }
            FromVehicle::Log(piece) => {
                self.collected(id, piece);
            }
        }
    }

    /// Takes a vehicle's word for its phase if it speaks of the loaded mission.
    fn set_phase(&mut self, id: &str, digest: u64, phase: Phase, reason: String) -> bool {
        if self.load.as_ref().is_none_or(|load| load.mission.digest != digest) {
            return false;
        }
        let Some(known) = self.vehicles.get_mut(id) else { return false };
        known.phase = phase;
        known.reason = reason;
        true
    }

    fn hello(&mut self, id: &str, phase: Phase, flight: Option<FlightPlan>) {
        let same = |load: &Load, flight: &FlightPlan| load.mission.digest == digest(&flight.mission);
        if let Some(known) = self.vehicles.get_mut(id) {
            known.phase = phase;
        }
        match (&self.load, flight) {
            (None, Some(flight)) => self.adopt(id, phase, flight),
            (Some(load), Some(flight)) if same(load, &flight) && phase != Phase::Armed => {
                // It has flown on alone; tell it what it missed.
                for command in load.speeds.clone() {
                    self.tell_vehicle(id, ToVehicle::Speed(command));
                }
            }
            (Some(load), _) if load.mission.index_of(id).is_some() => self.arm(id),
            _ => {}
        }
    }

    /// After a restart: the vehicles know what the hub has forgotten.
    fn adopt(&mut self, id: &str, phase: Phase, flight: FlightPlan) {
        let Ok(mission) = Mission::parse("a vehicle's mission", &flight.mission) else { return };
        if mission.index_of(id).is_none() {
            return;
        }
        self.load(Arc::new(mission), true);
        if let Some(known) = self.vehicles.get_mut(id) {
            known.phase = phase;
        }
        let Some(load) = &mut self.load else { return };
        load.speeds = flight.speeds;
        match (phase, flight.clock) {
            (Phase::Running, ClockPlan::Real { .. }) => {
                let name = load.mission.name.clone();
                self.outputs.push_back(HubOutput::FollowClock(flight.clock));
                self.say(format!("{id} is flying {name}: carrying on"));
            }
            (phase, _) => {
                load.phase = phase;
                load.now = load.mission.end;
            }
        }
        let others: Vec<String> = self.connected().into_iter().filter(|other| other != id).collect();
        for other in others {
            self.arm(&other);
        }
    }

    /// A vehicle was armed: if the fleet is under way, it joins.
    fn join_flight(&mut self, now: Time, id: &str) {
        let Some(load) = self.load.as_ref().filter(|load| load.phase == Phase::Running) else { return };
        if load.lockstep.is_some() {
            return;
        }
        if let Some(clock) = load.clock {
            let (digest, speeds) = (load.mission.digest, load.speeds.clone());
            self.tell_vehicle(id, ToVehicle::Start { digest, clock, speeds });
            if let Some(known) = self.vehicles.get_mut(id) {
                known.phase = Phase::Running;
            }
            self.note(now, &format!("{id} joins the flight under way"));
        }
    }

    // --- the clock -------------------------------------------------------------------------------------------------

    fn clock_started(&mut self, now: Time, clock: ClockPlan) {
        let Some(load) = &mut self.load else { return };
        let speed_up = match clock {
            ClockPlan::Real { speed_up, .. } => Some(speed_up),
            ClockPlan::Stepped => None,
        };
        let real = speed_up.is_some();
        load.phase = Phase::Running;
        load.clock = Some(clock);
        load.emulator = Emulator::new(load.mission.clone(), speed_up);
        load.lockstep = (!real).then(|| Lockstep::new(&load.mission, self.window));
        let (mission, fresh) = (Opened(load.mission.clone()), !load.adopted);
        self.outputs.push_back(HubOutput::OpenLog { mission, fresh });
        if load.adopted {
            load.emulator.skip_to(now);
            while load.emulator.poll_output().is_some() {}
            let text = format!("the emulator came back at {now}");
            return self.note(now, &text);
        }
        load.speeds.clear();
        let digest = load.mission.digest;
        for step in load.mission.speed.steps() {
            let row = SpeedRow { t_ns: step.at.nanos(), speed: step.speed };
            self.outputs.push_back(HubOutput::Record(Row::Exact(Record::Speed(row))));
        }
        let name = load.mission.name.clone();
        for known in self.vehicles.values_mut().filter(|known| known.phase == Phase::Armed) {
            known.phase = Phase::Running;
        }
        self.tell_fleet(&ToVehicle::Start { digest, clock, speeds: Vec::new() });
        self.drain_emulator();
        self.say(format!("{name} is under way"));
        if !real {
            self.grant();
        }
    }

    /// Stepped clock: lets the fleet run as far as causality allows.
    fn grant(&mut self) {
        let Some(load) = &mut self.load else { return };
        let Some(lockstep) = &mut load.lockstep else { return };
        let until = lockstep.horizon();
        // What arrives strictly before `until` is heard within the grant.
        while let Some(at) = load.emulator.poll_timeout().filter(|at| *at < until) {
            load.emulator.handle(at, None);
        }
        lockstep.grant(until);
        self.drain_emulator();
        let Some(load) = &mut self.load else { return };
        let Some(lockstep) = &mut load.lockstep else { return };
        let speeds = std::mem::take(&mut lockstep.speeds);
        for (index, vehicle) in load.mission.vehicles.iter().enumerate() {
            let heard = std::mem::take(&mut lockstep.heard[index]).0;
            let message = ToVehicle::Grant { until, heard, speeds: speeds.clone() };
            self.outputs.push_back(HubOutput::ToVehicle(vehicle.id.clone(), message));
        }
    }

    fn reached(&mut self, id: &str, until: Time, sent: Vec<(Time, Vec<u8>)>) {
        let Some(load) = self.load.as_mut().filter(|load| load.phase == Phase::Running) else { return };
        let (Some(index), Some(lockstep)) = (load.mission.index_of(id), &mut load.lockstep) else { return };
        if !lockstep.reached(index, until, sent) {
            return;
        }
        load.now = until;
        for (at, from, bytes) in lockstep.take_sent() {
            load.emulator.handle(at, Some(Sent { from, bytes }));
        }
        if until < load.mission.end {
            self.grant();
        } else {
            while let Some(at) = load.emulator.poll_timeout().filter(|at| *at <= until) {
                load.emulator.handle(at, None);
            }
            self.finish(until);
        }
    }

    fn finish(&mut self, now: Time) {
        let Some(load) = &mut self.load else { return };
        load.emulator.finish(now);
        load.phase = Phase::Finished;
        load.now = load.mission.end;
        let name = load.mission.name.clone();
        self.drain_emulator();
        self.outputs.push_back(HubOutput::CloseLog);
        self.say(format!("{name} is over"));
    }

    /// Carries out what the channel decided.
    fn drain_emulator(&mut self) {
        let Some(load) = &mut self.load else { return };
        while let Some(output) = load.emulator.poll_output() {
            match output {
                Channel::Record(row) => self.outputs.push_back(HubOutput::Record(row)),
                Channel::Deliver { to, due, bytes } => match &mut load.lockstep {
                    Some(lockstep) => lockstep.heard[to].0.push((due, bytes.to_vec())),
                    None => {
                        let id = load.emulator.name(to).clone();
                        self.outputs.push_back(HubOutput::Deliver(id, bytes));
                    }
                },
            }
        }
    }
}

impl Machine for Hub {
    type Input = HubInput;
    type Output = HubOutput;

    fn handle(&mut self, now: Time, input: Option<HubInput>) {
        match input {
            Some(HubInput::Joined(id)) => self.joined(id),
            Some(HubInput::Left(id)) => self.left(now, &id),
            Some(HubInput::FromVehicle(id, message)) => self.hear_vehicle(now, &id, message),
            Some(HubInput::FromControl { who, message }) => {
                self.asker = Some(who);
                self.hear_control(now, message);
                self.asker = None;
            }
            Some(HubInput::LogFailed(reason)) => self.stop(now, &reason),
            Some(HubInput::ClockStarted(clock)) => self.clock_started(now, clock),
            Some(HubInput::Log(piece)) => {
                self.collected(HUB, piece);
            }
            Some(HubInput::State(id, bytes)) => {
                if let Some(load) = self.load.as_mut().filter(|l| l.phase == Phase::Running && l.lockstep.is_none())
                    && let Some(from) = load.mission.index_of(&id)
                {
                    load.emulator.handle(now, Some(Sent { from, bytes }));
                    self.drain_emulator();
                }
            }
            None => {
                if let Some(load) = self.load.as_mut().filter(|l| l.phase == Phase::Running && l.lockstep.is_none()) {
                    load.now = now;
                    load.emulator.handle(now.min(load.mission.end), None);
                    let over = now >= load.mission.end;
                    self.drain_emulator();
                    if over {
                        self.finish(now);
                    }
                }
            }
        }
    }

    fn poll_output(&mut self) -> Option<HubOutput> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        let load = self.load.as_ref().filter(|l| l.phase == Phase::Running && l.lockstep.is_none())?;
        Some(load.emulator.poll_timeout().map_or(load.mission.end, |at| at.min(load.mission.end)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");
    const IDS: [&str; 3] = ["auv1", "auv2", "auv3"];

    fn epoch() -> ClockPlan {
        ClockPlan::Real { epoch_unix_ns: 0, speed_up: 1.0 }
    }

    fn outputs(hub: &mut Hub) -> Vec<HubOutput> {
        std::iter::from_fn(|| hub.poll_output()).collect()
    }

    fn ask(hub: &mut Hub, at: Time, message: ToFleet) -> Vec<HubOutput> {
        hub.handle(at, Some(HubInput::FromControl { who: COLLECTOR.into(), message }));
        outputs(hub)
    }

    fn refusal(outputs: &[HubOutput]) -> Option<&str> {
        outputs.iter().find_map(|output| match output {
            HubOutput::ToControl { message: FromFleet::Refused { reason }, .. } => Some(reason.as_str()),
            _ => None,
        })
    }

    fn told<'o>(outputs: &'o [HubOutput], id: &str) -> Vec<&'o ToVehicle> {
        let to = |output: &'o HubOutput| match output {
            HubOutput::ToVehicle(to, message) if to == id => Some(message),
            _ => None,
        };
        outputs.iter().filter_map(to).collect()
    }

    fn join(hub: &mut Hub, id: &str, phase: Phase, flight: Option<FlightPlan>) -> Vec<HubOutput> {
        hub.handle(Time::ZERO, Some(HubInput::Joined(id.into())));
        hub.handle(Time::ZERO, Some(HubInput::FromVehicle(id.into(), FromVehicle::Hello { phase, flight })));
        outputs(hub)
    }

    fn arm(hub: &mut Hub, at: Time, id: &str) -> Vec<HubOutput> {
        let message = FromVehicle::Armed { digest: digest(HELIX) };
        hub.handle(at, Some(HubInput::FromVehicle(id.into(), message)));
        outputs(hub)
    }

    /// A fleet of three that flies the flagship.
    fn flying(pace: Pace, clock: ClockPlan) -> Hub {
        let mut hub = Hub::new();
        IDS.iter().for_each(|id| drop(join(&mut hub, id, Phase::Idle, None)));
        ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
        IDS.iter().for_each(|id| drop(arm(&mut hub, Time::ZERO, id)));
        let started = ask(&mut hub, Time::ZERO, ToFleet::Start { pace });
        assert!(started.contains(&HubOutput::StartClock(pace)), "{started:?}");
        hub.handle(Time::ZERO, Some(HubInput::ClockStarted(clock)));
        hub
    }

    #[test]
    fn nothing_starts_before_every_vehicle_is_armed() {
        let mut hub = Hub::new();
        assert!(refusal(&ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Stepped })).is_some(), "no mission");
        join(&mut hub, "auv1", Phase::Idle, None);
        let uploaded = ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
        assert!(matches!(told(&uploaded, "auv1")[..], [ToVehicle::Arm { .. }]));
        arm(&mut hub, Time::ZERO, "auv1");
        let started = ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Stepped });
        assert!(refusal(&started).is_some_and(|r| r.contains("auv2, auv3")), "{started:?}");
        // Who comes later is armed on arrival.
        assert!(matches!(told(&join(&mut hub, "auv2", Phase::Idle, None), "auv2")[..], [ToVehicle::Arm { .. }]));
    }

    #[test]
    fn a_wrong_mission_is_refused_with_its_faults() {
        let mut hub = Hub::new();
        let answer = ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: "name = 3".into() });
        assert!(refusal(&answer).is_some_and(|reason| reason.contains("name")), "{answer:?}");
        assert_eq!(hub.phase(), Phase::Idle);
    }

    #[test]
    fn another_mission_waits_until_the_flight_is_over() {
        let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
        outputs(&mut hub);
        let other = HELIX.replace("seed = 1", "seed = 2");
        assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Upload { mission: other.clone() })).is_some());
        ask(&mut hub, Time::from_secs(1.0), ToFleet::Stop);
        assert_eq!(hub.phase(), Phase::Aborted);
        assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Upload { mission: other })).is_none());
    }

    #[test]
    fn a_vehicle_that_comes_back_gets_mission_clock_and_speeds() {
        let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
        ask(&mut hub, Time::from_secs(5.0), ToFleet::Speed { speed: 0.2 });
        hub.handle(Time::from_secs(6.0), Some(HubInput::Left("auv2".into())));
        outputs(&mut hub);
        assert!(matches!(told(&join(&mut hub, "auv2", Phase::Idle, None), "auv2")[..], [ToVehicle::Arm { .. }]));
        let armed = arm(&mut hub, Time::from_secs(9.0), "auv2");
        let [ToVehicle::Start { clock, speeds, .. }] = told(&armed, "auv2")[..] else { panic!("{armed:?}") };
        assert_eq!((*clock, speeds.len(), speeds[0].speed), (epoch(), 1, 0.2));
    }

    #[test]
    fn a_hub_that_lost_its_memory_gets_it_back_from_a_vehicle() {
        let mut hub = Hub::new();
        let plan = FlightPlan { mission: HELIX.into(), clock: epoch(), speeds: vec![] };
        let heard = join(&mut hub, "auv3", Phase::Running, Some(plan));
        assert!(heard.contains(&HubOutput::FollowClock(epoch())), "{heard:?}");
        hub.handle(Time::from_secs(123.0), Some(HubInput::ClockStarted(epoch())));
        assert_eq!(hub.phase(), Phase::Running);
        let outputs = outputs(&mut hub);
        assert!(outputs.iter().any(|o| matches!(o, HubOutput::OpenLog { fresh: false, .. })), "{outputs:?}");
        assert!(told(&outputs, "auv3").is_empty(), "it is not started again");
    }

    #[test]
    fn a_stepped_run_needs_every_vehicle() {
        let mut hub = flying(Pace::Stepped, ClockPlan::Stepped);
        hub.handle(Time::ZERO, Some(HubInput::Left("auv1".into())));
        assert_eq!(hub.phase(), Phase::Aborted);
        assert!(told(&outputs(&mut hub), "auv2").contains(&&ToVehicle::Stop));
    }

    #[test]
    fn a_real_flight_goes_on_without_one() {
        let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
        hub.handle(Time::from_secs(1.0), Some(HubInput::Left("auv1".into())));
        assert_eq!(hub.phase(), Phase::Running);
    }

    #[test]
    fn the_answer_goes_to_who_asked() {
        let mut hub = Hub::new();
        hub.handle(Time::ZERO, Some(HubInput::FromControl { who: OPERATOR.into(), message: ToFleet::Status }));
        let answered = outputs(&mut hub);
        assert!(matches!(&answered[..], [HubOutput::ToControl { who, .. }] if who == OPERATOR), "{answered:?}");
    }

    #[test]
    fn a_speed_that_is_no_number_is_refused() {
        let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
        outputs(&mut hub);
        for speed in [f64::NAN, f64::INFINITY] {
            assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Speed { speed })).is_some());
        }
    }
}
