//! The flight itself: its clock, its channel, and the conducting of stepped runs.

use common::machine::Machine;
use common::mission::SharedMission;
use common::record::{Record, Row, SpeedRow};
use common::time::Time;
use common::wire::vehicle::{ClockPlan, Phase, SpeedCommand, ToVehicle};

use super::{ASLEEP, ASLEEP_S, Hub, HubOutput, LATEST_BEGIN_S};
use crate::emulator::{Channel, Emulator, Sent};
use crate::lockstep::Lockstep;

impl Hub {
    pub(super) fn clock_started(&mut self, now: Time, clock: ClockPlan) {
        let Some(load) = &mut self.load else { return };
        let speed_up = match clock {
            ClockPlan::Real { speed_up, .. } => Some(speed_up),
            ClockPlan::Stepped => None,
        };
        if load.adopted && now.secs() < -LATEST_BEGIN_S * speed_up.unwrap_or(1.0) {
            self.load = None;
            self.take_seats();
            return self.say("a vehicle tells of a flight that has not begun: ignored".into());
        }
        self.flown = true;
        let real = speed_up.is_some();
        load.phase = Phase::Running;
        load.clock = Some(clock);
        load.awake = now;
        load.emulator = Emulator::new(load.mission.clone(), speed_up);
        let absent = (0..load.seats.len()).filter(|vehicle| {
            !self.vehicles.get(&load.mission.vehicles[*vehicle].id).is_some_and(|known| known.connected)
        });
        let absent: Vec<usize> = if real { absent.collect() } else { Vec::new() };
        load.lockstep = (!real).then(|| Lockstep::new(&load.mission, self.window));
        let (mission, fresh) = (SharedMission(load.mission.clone()), !load.adopted);
        self.outputs.push_back(HubOutput::OpenLog { mission, fresh });
        if load.adopted {
            load.counted_from = now.min(load.mission.end);
            load.emulator.skip_to(now);
            absent.into_iter().for_each(|vehicle| load.emulator.presence(now, vehicle, false));
            while load.emulator.poll_output().is_some() {}
            return;
        }
        absent.into_iter().for_each(|vehicle| load.emulator.presence(now, vehicle, false));
        load.speeds.clear();
        let digest = load.mission.digest;
        let name = load.mission.name.clone();
        let planned = load.mission.speed.steps().to_vec();
        self.record_speeds(&planned);
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

    /// A flight was taken up: what the hub knows of it is recorded again, for what it recorded last before it was killed
    /// never got to the disk; merging takes twins for one. Nothing went from vehicle to vehicle meanwhile.
    pub(super) fn log_opened(&mut self, now: Time, last: Option<Time>) {
        let Some(load) = self.load.as_mut().filter(|load| load.adopted && load.phase == Phase::Running) else { return };
        let back = now.min(load.mission.end);
        let gone = last.unwrap_or(Time::ZERO).min(back);
        load.emulator.skip_to(back);
        while load.emulator.poll_output().is_some() {}
        load.emulator.was_away(gone, back);
        let known = [load.mission.speed.steps(), &load.speeds[..]].concat();
        self.record_speeds(&known);
        self.drain_emulator();
        self.note(now, &format!("the emulator came back at {now}; every link was down from {gone} on"));
    }

    /// A hub that was not let run (its process was stopped, or its machine too busy) finds that out here: nothing went from
    /// vehicle to vehicle meanwhile, and the record must not say otherwise.
    pub(super) fn look_at_the_clock(&mut self, now: Time) {
        let Some((load, speed_up)) = self.load.as_mut().and_then(|load| load.speed_up().map(|s| (load, s))) else {
            return;
        };
        let before = load.awake;
        load.awake = before.max(now);
        let (gone, back) = (before.max(Time::ZERO), now.min(load.mission.end));
        if (now - before).secs() <= ASLEEP_S * speed_up || back <= gone {
            return;
        }
        load.emulator.slept(gone, back);
        self.drain_emulator();
        let text = format!("{ASLEEP} from {gone} to {back}; every link was down meanwhile");
        self.note(back, &text);
        self.say(text);
    }

    pub(super) fn record_speeds(&mut self, commands: &[SpeedCommand]) {
        for command in commands {
            let row = SpeedRow { t_ns: command.at.nanos(), speed: command.speed };
            self.outputs.push_back(HubOutput::Record(Row::Exact(Record::Speed(row))));
        }
    }

    /// Stepped clock: lets the fleet run as far as causality allows.
    pub(super) fn grant(&mut self) {
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

    pub(super) fn reached(&mut self, id: &str, until: Time, sent: Vec<(Time, Vec<u8>)>) {
        let Some(load) = self.load.as_mut().filter(|load| load.phase == Phase::Running) else { return };
        let (Some(index), Some(lockstep)) = (load.mission.index_of(id), &mut load.lockstep) else { return };
        if !lockstep.reached(index, until, sent) {
            return;
        }
        load.now = until;
        for (at, from, bytes) in lockstep.take_sent() {
            load.emulator.handle(at, Some(Sent { from, bytes: bytes.into() }));
        }
        let is_out = |id: &&str| self.vehicles.get(*id).is_some_and(|known| known.phase == Phase::Aborted);
        if let Some(id) = load.mission.vehicles.iter().map(|vehicle| vehicle.id.as_str()).find(is_out) {
            let why = format!("{id} aborted a stepped run, which needs every vehicle");
            return self.stop(until, &why);
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

    pub(super) fn finish(&mut self, now: Time) {
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
    pub(super) fn drain_emulator(&mut self) {
        let Some(load) = &mut self.load else { return };
        while let Some(output) = load.emulator.poll_output() {
            match output {
                Channel::Record(row) => self.outputs.push_back(HubOutput::Record(row)),
                Channel::Settled(settled) => self.outputs.push_back(HubOutput::Settled(settled)),
                Channel::Deliver { to, due, bytes, settled } => match (&mut load.lockstep, load.seats[to]) {
                    (Some(lockstep), _) => lockstep.heard[to].0.push((due, bytes.to_vec())),
                    (None, Some(seat)) => self.outputs.push_back(HubOutput::Deliver { seat, bytes, settled }),
                    // Who never joined is absent, and was dropped as such.
                    (None, None) => self.outputs.extend(settled.map(HubOutput::Settled)),
                },
            }
        }
    }
}
