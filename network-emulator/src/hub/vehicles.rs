//! What the vehicles say to the hub, and their comings and goings.

use std::collections::BTreeSet;
use std::sync::Arc;

use common::mission::{Mission, digest};
use common::time::Time;
use common::wire::vehicle::{ClockPlan, FlightPlan, FromVehicle, Phase, SpeedCommand, ToVehicle};

use super::{Hub, HubOutput, Known, Load, MOST_SPEEDS};

/// Why a vehicle ended a stepped run that comes back from it without having told.
const LINE_LOST: &str = "it lost the line to the network-emulator in a stepped run";

impl Hub {
    pub(super) fn joined(&mut self, now: Time, id: String, seat: usize) {
        let known = self.vehicles.entry(id.clone()).or_insert(Known {
            connected: true,
            seat,
            phase: Phase::Idle,
            reason: String::new(),
            doubted: false,
        });
        (known.connected, known.seat) = (true, seat);
        self.take_seats();
        self.presence(now, &id, true);
    }

    /// In real time the channel knows who can be reached.
    fn presence(&mut self, now: Time, id: &str, present: bool) {
        let Some(load) = self.load.as_mut().filter(|l| l.phase == Phase::Running && l.lockstep.is_none()) else {
            return;
        };
        if let Some(vehicle) = load.mission.index_of(id) {
            load.emulator.presence(now.min(load.mission.end), vehicle, present);
            self.drain_emulator();
        }
    }

    /// Notes which vehicle of the mission has which seat: a message must find its way without a look at names.
    pub(super) fn take_seats(&mut self) {
        self.aboard.clear();
        let Some(load) = &mut self.load else { return };
        let seat_of = |id: &str| self.vehicles.get(id).map(|known| known.seat);
        load.seats = load.mission.vehicles.iter().map(|vehicle| seat_of(&vehicle.id)).collect();
        self.aboard.resize(load.seats.iter().flatten().max().map_or(0, |most| most + 1), None);
        for (vehicle, seat) in load.seats.iter().enumerate() {
            if let Some(seat) = seat {
                self.aboard[*seat] = Some(vehicle);
            }
        }
    }

    pub(super) fn left(&mut self, now: Time, id: &str) {
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
            self.presence(now, id, false);
            self.note(now, &format!("lost the line to {id}"));
        }
    }

    pub(super) fn hear_vehicle(&mut self, now: Time, id: &str, message: FromVehicle) {
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
                    known.reason.clone_from(&reason);
                }
                if phase == Phase::Aborted {
                    self.aborted(now, id, &reason);
                }
            }
            FromVehicle::Log(piece) => {
                self.collected(id, piece);
            }
        }
    }

    /// A vehicle cannot go on: the others do if time is real, until none is left. In lock step all run what was granted first,
    /// lest it depend on their haste who is heard of ([`Hub::reached`]).
    fn aborted(&mut self, now: Time, id: &str, reason: &str) {
        let Some(load) = self.load.as_ref().filter(|load| load.phase == Phase::Running) else { return };
        if load.mission.index_of(id).is_none() {
            return;
        }
        if load.lockstep.is_some() {
            return;
        }
        let is_out = |id: &str| self.vehicles.get(id).is_some_and(|known| known.phase == Phase::Aborted);
        let nobody_flies = load.mission.vehicles.iter().all(|vehicle| is_out(&vehicle.id));
        self.note(now, &format!("{id} aborted: {reason}"));
        if nobody_flies {
            self.stop(now, "no vehicle flies any more");
        }
    }

    /// Takes a vehicle's word for its phase if it speaks of the loaded mission.
    pub(super) fn set_phase(&mut self, id: &str, digest: u64, phase: Phase, reason: String) -> bool {
        if self.load.as_ref().is_none_or(|load| load.mission.digest != digest) {
            return false;
        }
        let Some(known) = self.vehicles.get_mut(id) else { return false };
        known.phase = phase;
        known.reason = reason;
        true
    }

    pub(super) fn hello(&mut self, id: &str, phase: Phase, flight: Option<FlightPlan>) {
        let same = |load: &Load, flight: &FlightPlan| load.mission.digest == digest(&flight.mission);
        let stopped = self.load.as_ref().is_some_and(|load| load.phase == Phase::Aborted && load.lockstep.is_some());
        if let Some(known) = self.vehicles.get_mut(id) {
            known.phase = phase;
            // Its line went down, and with that its last word was lost.
            if stopped && phase == Phase::Aborted && known.reason.is_empty() {
                known.reason = LINE_LOST.to_string();
            }
        }
        match (&self.load, flight) {
            (None, Some(flight)) => self.adopt(id, phase, flight),
            // Mission-control came to a hub without memory before this vehicle did.
            (Some(load), Some(flight))
                if !self.flown && phase == Phase::Running && load.phase == Phase::Armed && same(load, &flight) =>
            {
                self.adopt(id, phase, flight);
            }
            (Some(load), Some(flight)) if phase == Phase::Running && self.flown && is_another(load, &flight) => {
                let arms = matches!(load.phase, Phase::Armed | Phase::Running) && load.mission.index_of(id).is_some();
                self.say(format!("{id} is still in a flight that is over: stopped"));
                self.tell_vehicle(id, ToVehicle::Stop);
                if arms {
                    self.arm(id);
                }
            }
            (Some(load), Some(flight))
                if same(load, &flight) && phase != Phase::Armed && load.mission.index_of(id).is_some() =>
            {
                // It has flown on alone; tell it what it missed.
                if load.clock == Some(flight.clock) {
                    self.learn(id, &flight.speeds);
                }
                for command in self.load.as_ref().map_or(Vec::new(), |load| load.speeds.clone()) {
                    self.tell_vehicle(id, ToVehicle::Speed(command));
                }
            }
            (Some(load), _) if load.mission.index_of(id).is_some() => self.arm(id),
            _ => {}
        }
    }

    /// Speeds that a vehicle knows of and a hub that was killed since does not, nor perhaps the other vehicles.
    fn learn(&mut self, id: &str, speeds: &[SpeedCommand]) {
        let Some(load) = self.load.as_mut().filter(|load| load.phase == Phase::Running) else { return };
        let of = |command: &SpeedCommand| (command.at, command.speed.to_bits());
        let mut known: BTreeSet<(Time, u64)> = load.speeds.iter().map(of).collect();
        let is_news = |command: &&SpeedCommand| known.insert(of(command));
        let news: Vec<SpeedCommand> = speeds.iter().take(MOST_SPEEDS + 1).filter(is_news).copied().collect();
        if news.is_empty() {
            return;
        }
        if load.speeds.len() + news.len() > MOST_SPEEDS || !are_credible(&load.mission, &news) {
            return self.doubt(id);
        }
        load.speeds.extend(&news);
        load.speeds.sort_by_key(|command| command.at);
        news.iter().for_each(|command| self.tell_fleet(&ToVehicle::Speed(*command)));
        self.record_speeds(&news);
    }

    /// What a vehicle tells of its flight cannot be: said once.
    fn doubt(&mut self, id: &str) {
        if let Some(known) = self.vehicles.get_mut(id)
            && !std::mem::replace(&mut known.doubted, true)
        {
            self.say(format!("{id} tells of a flight that nobody can have started or commanded: ignored"));
        }
    }

    /// After a restart: the vehicles know what the hub has forgotten.
    pub(super) fn adopt(&mut self, id: &str, phase: Phase, flight: FlightPlan) {
        let Ok(mission) = Mission::parse("a vehicle's mission", &flight.mission) else { return };
        if mission.index_of(id).is_none() {
            return;
        }
        let credible = flight.speeds.len() <= MOST_SPEEDS && are_credible(&mission, &flight.speeds);
        if !(credible && flight.clock.is_sound()) {
            return self.doubt(id);
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
                // A stepped run does not outlive its hub.
                load.phase = if phase == Phase::Running { Phase::Aborted } else { phase };
                load.now = load.mission.end;
                load.counted_from = load.mission.end;
            }
        }
        let others: Vec<String> = self.connected().into_iter().filter(|other| other != id).collect();
        for other in others {
            self.arm(&other);
        }
    }

    /// A vehicle was armed: if the fleet is under way, it joins.
    pub(super) fn join_flight(&mut self, now: Time, id: &str) {
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
}

/// Whether somebody can have commanded these speeds in this mission.
fn are_credible(mission: &Mission, speeds: &[SpeedCommand]) -> bool {
    let fastest = speeds.iter().map(|command| command.speed.abs()).max_by(f64::total_cmp);
    fastest.is_none_or(|fastest| fastest.is_finite() && mission.fits_speed(fastest).is_ok())
}

/// Whether a vehicle under way is in another flight than the fleet: it missed that its own was ended.
fn is_another(load: &Load, flight: &FlightPlan) -> bool {
    match load.phase {
        Phase::Running | Phase::Finished => {
            load.clock != Some(flight.clock) || load.mission.digest != digest(&flight.mission)
        }
        Phase::Idle | Phase::Armed | Phase::Aborted => true,
    }
}
