//! What mission-control asks of the hub.

use std::sync::Arc;

use common::mission::{FASTEST_FORMATION, Mission};
use common::record::{ClockRecord, Fate, NoteRow, Row};
use common::time::{Span, Time};
use common::wire::fleet::{FleetStatus, FromFleet, Pace, ToFleet, VehicleStatus};
use common::wire::vehicle::{ClockPlan, LogPiece, Phase, SpeedCommand, ToVehicle};

use super::{COLLECTOR, ENDED, HUB, Hub, HubOutput, Known, Load, MOST_SPEEDS, SPEED_LEAD_S};
use crate::emulator::Emulator;

impl Hub {
    pub(super) fn hear_control(&mut self, now: Time, message: ToFleet) {
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

    pub(super) fn status(&mut self, now: Time) {
        let mut vehicles: Vec<VehicleStatus> = Vec::new();
        let status = |id: &str, known: Option<&Known>| VehicleStatus {
            id: id.to_string(),
            connected: known.is_some_and(|k| k.connected),
            phase: known.map_or(Phase::Idle, |k| k.phase),
            reason: known.map_or(String::new(), |k| k.reason.clone()),
            said: None,
        };
        let mission = self.load.as_ref().map(|load| load.mission.clone());
        if let Some(mission) = &mission {
            let said = |index: usize| self.load.as_ref().and_then(|load| load.emulator.said(index));
            let of =
                |(index, id): (usize, &str)| VehicleStatus { said: said(index), ..status(id, self.vehicles.get(id)) };
            vehicles.extend(mission.vehicles.iter().map(|v| v.id.as_str()).enumerate().map(of));
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
        let (speed, speed_since) = load.map_or((0.0, Time::ZERO), |load| {
            let mut profile = load.mission.speed.clone();
            load.speeds.iter().for_each(|command| profile.command(*command));
            (profile.at(now).v_l, profile.last_change(now))
        });
        let status = FleetStatus {
            phase: self.phase(),
            mission: load.map_or(String::new(), |load| load.mission.text.clone()),
            now,
            end: load.map_or(Time::ZERO, |load| load.mission.end),
            speed,
            speed_since,
            vehicles,
            collected: load.is_some_and(|load| load.collected),
            pace: load.and_then(|load| load.clock).map(|clock| match clock {
                ClockPlan::Real { speed_up, .. } => Pace::Real { speed_up },
                ClockPlan::Stepped => Pace::Stepped,
            }),
            messages: self.totals(),
            drops: load.map_or([0; Fate::DROPS.len()], |load| load.emulator.drops()),
            counted_from: load.map_or(Time::ZERO, |load| load.counted_from),
        };
        self.answer(FromFleet::Status(status));
    }

    pub(super) fn upload(&mut self, now: Time, text: &str) {
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

    pub(super) fn load(&mut self, mission: Arc<Mission>, adopted: bool) {
        for vehicle in &mission.vehicles {
            if let Some(known) = self.vehicles.get_mut(&vehicle.id) {
                known.phase = Phase::Idle;
                known.reason.clear();
            }
        }
        self.load = Some(Load {
            emulator: Emulator::new(mission.clone(), None),
            seats: Vec::new(),
            mission,
            phase: Phase::Armed,
            clock: None,
            lockstep: None,
            speeds: Vec::new(),
            adopted,
            collected: false,
            counted_from: Time::ZERO,
            awake: Time::ZERO,
            now: Time::ZERO,
        });
        self.take_seats();
    }

    pub(super) fn arm(&mut self, id: &str) {
        if let Some(load) = &self.load {
            let mission = load.mission.text.clone();
            self.tell_vehicle(id, ToVehicle::Arm { mission });
        }
    }

    pub(super) fn start(&mut self, pace: Pace) {
        if let Pace::Real { speed_up } = pace
            && !ClockPlan::SPEED_UPS.contains(&speed_up)
        {
            return self.refuse(format!("found a speed-up of {speed_up}; allowed: 0.001 to 1000"));
        }
        let Some(load) = &self.load else { return self.refuse("no mission is loaded".into()) };
        if load.phase == Phase::Running {
            return self.refuse(format!("{} is already under way", load.mission.name));
        }
        if load.phase != Phase::Armed {
            return self.refuse(format!("{} is over; load it again to fly it again", load.mission.name));
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

    pub(super) fn speed(&mut self, now: Time, speed: f64) {
        if speed.is_nan() || speed.abs() > FASTEST_FORMATION {
            let allowed = "-1000000 to 1000000 units of xi per s, as in a mission file";
            return self.refuse(format!("found a formation speed of {speed:?}; allowed: {allowed}"));
        }
        let Some(load) = self.load.as_mut().filter(|load| load.phase == Phase::Running) else {
            return self.refuse("no flight is under way, so there is no speed to change".into());
        };
        if load.speeds.len() >= MOST_SPEEDS {
            return self.refuse(format!("{MOST_SPEEDS} speeds were commanded in this flight; allowed: no more"));
        }
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
        match &mut load.lockstep {
            Some(lockstep) => lockstep.speeds.push(command),
            None => self.tell_fleet(&ToVehicle::Speed(command)),
        }
        self.record_speeds(&[command]);
        self.answer(FromFleet::SpeedTaken { at, speed });
    }

    pub(super) fn stop(&mut self, now: Time, why: &str) {
        let Some(load) = self.load.as_mut().filter(|load| matches!(load.phase, Phase::Running | Phase::Armed)) else {
            return self.refuse("no flight is under way, so there is nothing to stop".into());
        };
        let was_running = load.phase == Phase::Running;
        // Before the start, the driver's clock is still that of the flight before.
        let now = if was_running { load.lockstep.as_ref().map_or(now, |l| l.done()) } else { load.now };
        load.phase = Phase::Aborted;
        load.now = now;
        // Of a flight that was not there is nothing to collect.
        load.collected = !was_running;
        if was_running {
            load.emulator.finish(now);
            self.drain_emulator();
            self.note(now, &format!("{ENDED}{why}"));
            self.outputs.push_back(HubOutput::CloseLog);
        }
        self.tell_fleet(&ToVehicle::Stop);
        self.say(format!("{ENDED}{why}"));
        self.status(now);
    }

    /// A piece of a log goes to mission-control, the only one who collects.
    pub(super) fn collected(&mut self, from: &str, piece: LogPiece) {
        let message = FromFleet::Log { who: from.to_string(), piece };
        self.outputs.push_back(HubOutput::ToControl { who: COLLECTOR.to_string(), message });
    }

    pub(super) fn note(&mut self, now: Time, text: &str) {
        let row = NoteRow { t_ns: now.nanos().max(0), source: HUB.into(), text: text.into(), count: 1 };
        self.outputs.push_back(HubOutput::Record(Row::Clock(ClockRecord::Note(row))));
    }
}
