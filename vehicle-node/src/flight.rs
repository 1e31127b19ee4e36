//! One flight of one vehicle: the pure machine that runs its control loop.

use std::collections::VecDeque;
use std::sync::Arc;

use common::coordination::{Own, VehicleLaw};
use common::craft::Craft;
use common::machine::Machine;
use common::mission::{Mission, SpeedProfile, Start};
use common::record::{ClockRecord, Name, NoteRow, Record, Row, StateRow, TicksRow};
use common::talk::speaker::Speaker;
use common::time::Time;
use common::vehicle::environment::{Conditions, Environment};
use common::wire::Garbage;
use common::wire::state::CoordinationState;
use common::wire::vehicle::SpeedCommand;

use crate::neighbours::Neighbours;

/// What can happen to a flying vehicle, beside the passing of time.
#[derive(Clone, Debug, PartialEq)]
pub enum FlightInput {
    /// Bytes came from the air.
    Heard(Vec<u8>),
    /// Another formation speed holds from an instant on.
    Speed(SpeedCommand),
}

/// What a flying vehicle wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum FlightOutput {
    /// Put these bytes on the air.
    Transmit(Vec<u8>),
    /// Record this row.
    Record(Row),
    /// The mission's time is over.
    Finished,
    /// The vehicle cannot go on.
    Failed(String),
}

/// Control periods between two rows about deadlines.
const TICKS_PER_REPORT: u64 = 200;

/// A vehicle whose law has had no answer for so many control periods in a row gives up.
const MOST_UNANSWERED: u64 = 100;

/// One flight of one vehicle.
pub struct Flight {
    mission: Arc<Mission>,
    me: usize,
    name: Name,
    craft: Box<dyn Craft>,
    /// What disturbs the vehicle, if anything does.
    environment: Option<Environment>,
    law: Box<dyn VehicleLaw>,
    neighbours: Neighbours,
    speaker: Speaker,
    speed: SpeedProfile,
    /// The next control period to run, and the last one run.
    next: i64,
    last: Option<i64>,
    /// Number of the next message, and of the next recorded state.
    next_message: i64,
    next_row: i64,
    over: bool,
    /// Commands without an answer so far, and how many of them the last ones were.
    refused: u64,
    unanswered: u64,
    /// Waits for the first neighbour to place its virtual target (a vehicle that comes back).
    rejoining: bool,
    /// Deadlines since the last report; only with a real clock.
    deadlines: Option<Deadlines>,
    /// Mission seconds per second of wall clock.
    speed_up: f64,
    outputs: VecDeque<FlightOutput>,
}

#[derive(Default)]
struct Deadlines {
    met: u64,
    missed: u64,
    worst_late_ns: i64,
}

impl Flight {
    /// A flight from the mission's start. With a real clock, of which `speed_up` is the mission seconds per second of
    /// wall clock, deadlines are watched.
    ///
    /// # Errors
    /// Why the vehicle cannot be built.
    pub fn new(mission: Arc<Mission>, me: usize, speed_up: Option<f64>) -> Result<Flight, String> {
        let start = mission.vehicles[me].start;
        Flight::from(mission, me, start, Time::ZERO, speed_up)
    }

    /// A flight that joins under way at `now`, at the place where the vehicle is.
    ///
    /// # Errors
    /// Why the vehicle cannot be built.
    pub fn rejoin(
        mission: Arc<Mission>,
        me: usize,
        start: Start,
        now: Time,
        speed_up: Option<f64>,
    ) -> Result<Flight, String> {
        let mut flight = Flight::from(mission, me, start, now, speed_up)?;
        flight.rejoining = true;
        Ok(flight)
    }

    fn from(
        mission: Arc<Mission>,
        me: usize,
        start: Start,
        now: Time,
        speed_up: Option<f64>,
    ) -> Result<Flight, String> {
        let period = mission.control_period.nanos();
        Ok(Flight {
            name: mission.vehicles[me].id.as_str().into(),
            craft: mission.craft(me, start)?,
            environment: mission.environment(me),
            law: mission.law.vehicle(me),
            neighbours: Neighbours::new(&mission, me),
            speaker: Speaker::new(&mission, me),
            speed: mission.speed.clone(),
            next: (now.nanos() + period - 1).div_euclid(period).max(0),
            last: None,
            next_message: 0,
            next_row: 0,
            over: false,
            refused: 0,
            unanswered: 0,
            rejoining: false,
            deadlines: speed_up.map(|_| Deadlines::default()),
            speed_up: speed_up.unwrap_or(1.0),
            outputs: VecDeque::new(),
            mission,
            me,
        })
    }

    /// The mission it flies.
    pub fn mission(&self) -> &Arc<Mission> {
        &self.mission
    }

    /// The instant of a control period.
    fn instant(&self, tick: i64) -> Time {
        Time::ZERO + self.mission.control_period * tick
    }

    /// Runs everything up to and including `until`, hearing each message at its instant: what the stepped clock does.
    /// Effects go to `perform` with the instant at which they happened.
    pub fn run_until(
        &mut self,
        until: Time,
        inputs: impl IntoIterator<Item = (Time, FlightInput)>,
        mut perform: impl FnMut(Time, FlightOutput),
    ) {
        let mut inputs = inputs.into_iter().peekable();
        while let Some(tick) = self.poll_timeout().filter(|tick| *tick <= until) {
            // A message that arrives at the instant of a control period is heard by the next one.
            while let Some((at, input)) = inputs.next_if(|(at, _)| *at < tick) {
                self.handle(at, Some(input));
            }
            self.handle(tick, None);
            while let Some(output) = self.poll_output() {
                perform(tick, output);
            }
        }
        for (at, input) in inputs {
            self.handle(at, Some(input));
        }
        while let Some(output) = self.poll_output() {
            perform(until, output);
        }
    }

    /// Runs the control period that is due at `now`, skipping those that were missed.
    fn tick(&mut self, now: Time) {
        let end = self.mission.end.nanos() / self.mission.control_period.nanos();
        let due = now.nanos().div_euclid(self.mission.control_period.nanos()).min(end);
        if due < self.next {
            return;
        }
        self.watch_deadline(now, due);
        let tick = due;
        if let Some(last) = self.last {
            for begun in last..tick {
                // The period that was run last is exposed already, one that was missed is not.
                if begun > last {
                    self.expose(begun);
                }
                let period = self.mission.control_period.secs();
                self.craft.advance(period, self.mission.substeps);
                self.law.advance(period);
            }
        }
        if !self.craft.is_sound() {
            self.fail(now, "the vehicle's state is no longer a number");
            return;
        }
        let t = self.instant(tick);
        self.control(t, tick);
        self.last = Some(tick);
        self.next = tick + 1;
        if tick >= end {
            self.finish(t);
        }
    }

    /// Exposes the vehicle to what disturbs it in a control period.
    fn expose(&mut self, tick: i64) {
        let now = self.instant(tick);
        let conditions = match &mut self.environment {
            Some(environment) => environment.conditions(now, tick as u64),
            None => Conditions { now, ..Conditions::default() },
        };
        self.craft.expose(&conditions);
    }

    /// One control period: disturbances, neighbours, coordination, path following, message, record.
    fn control(&mut self, t: Time, tick: i64) {
        self.expose(tick);
        let reference = self.speed.at(t);
        let pattern = self.mission.vehicles[self.me].pattern.at(t);
        if self.rejoining
            && let Some(xi) = self.neighbours.formation_xi(t, |scalar| self.law.neighbour_rate(reference, scalar))
        {
            self.craft.place_target(xi + pattern.h);
            self.rejoining = false;
            // What the law has gathered meanwhile was about another place.
            self.law = self.mission.law.vehicle(self.me);
        }
        let mut own = self.craft.own(reference);
        own.xi -= pattern.h;
        (own.h_dot, own.h_ddot) = (pattern.h_dot, pattern.h_ddot);
        let present = self.neighbours.present(t, |scalar| self.law.neighbour_rate(reference, scalar));
        let demand = self.law.demand(reference, &own, present);
        let heard = present.len() as u16;
        self.craft.command(reference, demand);
        if self.is_past_help() {
            self.fail(t, "its law has no answer any more");
            return;
        }

        // The number of a message follows from the time, so that it grows across a restart; a message that fell into
        // missed control periods is sent late rather than not at all.
        let number = tick / self.mission.message_ticks;
        if number >= self.next_message {
            self.next_message = number + 1;
            if self.speaker.wants(t, own.xi, reference.v_l) && !self.speak(t, number, &own, reference.v_l) {
                self.fail(t, "the coordination state is not a number");
                return;
            }
        }
        if tick / self.mission.record_ticks >= self.next_row || t >= self.mission.end {
            self.next_row = tick / self.mission.record_ticks + 1;
            let row = self.state_row(t, heard);
            if ![row.xi, row.xi_rate, row.v_ref, row.speed_mps, row.e_norm_m, row.psi_e_rad]
                .iter()
                .all(|x| x.is_finite())
            {
                self.fail(t, "the flight has diverged: its state is no longer a number");
                return;
            }
            self.outputs.push_back(FlightOutput::Record(Row::Exact(Record::State(row))));
        }
    }

    /// Whether the last command before the law fell silent has been held for too long.
    fn is_past_help(&mut self) -> bool {
        let refused = self.craft.refused();
        self.unanswered = if refused > self.refused { self.unanswered + 1 } else { 0 };
        self.refused = refused;
        self.unanswered >= MOST_UNANSWERED
    }

    /// Puts the coordination state on the air; false if it is not a number.
    fn speak(&mut self, t: Time, number: i64, own: &Own, v_l: f64) -> bool {
        let state = CoordinationState {
            mission: self.mission.digest,
            sender: self.me as u16,
            seq: number as u32,
            made: t,
            xi: own.xi,
            scalar: self.law.says(own),
        };
        let sound = state.xi.is_finite() && state.scalar.is_none_or(f64::is_finite);
        if sound {
            let word = self.speaker.say(state, v_l);
            self.outputs.push_back(FlightOutput::Transmit(word.encode()));
        }
        sound
    }

    fn state_row(&self, t: Time, neighbours: u16) -> StateRow {
        let o = self.craft.observe();
        StateRow {
            t_ns: t.nanos(),
            vehicle: self.name.clone(),
            xi: o.xi,
            xi_rate: o.xi_rate,
            v_ref: o.v_ref,
            x_m: o.position[0],
            y_m: o.position[1],
            z_m: o.position[2],
            yaw_rad: o.attitude[0],
            pitch_rad: o.attitude[1],
            roll_rad: o.attitude[2],
            speed_mps: o.speed,
            e_along_m: o.e_along,
            e_cross_m: o.e_cross,
            e_norm_m: o.e_norm,
            psi_e_rad: o.psi_e,
            neighbours,
        }
    }

    fn watch_deadline(&mut self, now: Time, due: i64) {
        let late_ns = ((now - self.instant(due)).nanos() as f64 / self.speed_up) as i64;
        let next = self.next;
        let Some(deadlines) = &mut self.deadlines else { return };
        deadlines.met += 1;
        deadlines.missed += (due - next).max(0) as u64;
        deadlines.worst_late_ns = deadlines.worst_late_ns.max(late_ns);
        if deadlines.met + deadlines.missed >= TICKS_PER_REPORT {
            self.report_deadlines(now);
        }
    }

    fn report_deadlines(&mut self, now: Time) {
        if let Some(deadlines) = self.deadlines.replace(Deadlines::default()) {
            let row = TicksRow {
                t_ns: now.nanos(),
                vehicle: self.name.clone(),
                met: deadlines.met,
                missed: deadlines.missed,
                worst_late_ns: deadlines.worst_late_ns,
            };
            self.outputs.push_back(FlightOutput::Record(Row::Clock(ClockRecord::Ticks(row))));
        }
    }

    fn note(&mut self, now: Time, text: String, count: u64) {
        let source = self.mission.vehicles[self.me].id.clone();
        let row = NoteRow { t_ns: now.nanos(), source, text, count };
        self.outputs.push_back(FlightOutput::Record(Row::Clock(ClockRecord::Note(row))));
    }

    /// What the vehicle warns of follows from the mission, as its states do.
    fn warn(&mut self, now: Time) {
        let source = &self.mission.vehicles[self.me].id;
        for warning in self.craft.warnings().iter().filter(|warning| warning.count > 0) {
            let (source, text) = (source.clone(), warning.what.to_string());
            let row = NoteRow { t_ns: now.nanos(), source, text, count: warning.count };
            self.outputs.push_back(FlightOutput::Record(Row::Exact(Record::Warning(row))));
        }
    }

    fn finish(&mut self, now: Time) {
        self.over = true;
        self.warn(now);
        if self.deadlines.is_some() {
            self.report_deadlines(now);
            for kind in Garbage::ALL {
                let count = self.neighbours.garbage.of(kind);
                if count > 0 {
                    self.note(now, format!("ignored messages: {}", kind.as_str()), count);
                }
            }
        }
        self.outputs.push_back(FlightOutput::Finished);
    }

    fn fail(&mut self, now: Time, reason: &str) {
        self.over = true;
        self.warn(now);
        let text = format!("{reason}, at {now}");
        self.note(now, format!("the flight was aborted: {text}"), 1);
        self.outputs.push_back(FlightOutput::Failed(text));
    }
}

impl Machine for Flight {
    type Input = FlightInput;
    type Output = FlightOutput;

    fn handle(&mut self, now: Time, input: Option<FlightInput>) {
        match input {
            _ if self.over => {}
            None => self.tick(now),
            Some(FlightInput::Heard(bytes)) => {
                match self.neighbours.hear(now, &bytes) {
                    Ok(word) => self.speaker.hear(&word),
                    // Old news is normal (duplicates, overtaking); anything else deserves one line.
                    Err(Garbage::Stale) => {}
                    Err(kind) if self.neighbours.garbage.of(kind) == 1 => {
                        self.note(now, format!("first message ignored that is {}", kind.as_str()), 1);
                    }
                    Err(_) => {}
                }
            }
            Some(FlightInput::Speed(command)) => self.speed.command(command),
        }
    }

    fn poll_output(&mut self) -> Option<FlightOutput> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        (!self.over).then(|| self.instant(self.next))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use common::wire::state::seal;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");

    fn mission() -> Arc<Mission> {
        Arc::new(Mission::parse("m.toml", HELIX).unwrap_or_else(|faults| panic!("{faults}")))
    }

    fn outputs(flight: &mut Flight) -> Vec<FlightOutput> {
        std::iter::from_fn(|| flight.poll_output()).collect()
    }

    fn transmitted(outputs: &[FlightOutput]) -> Vec<CoordinationState> {
        let state = |output: &FlightOutput| match output {
            FlightOutput::Transmit(bytes) => CoordinationState::decode(bytes).ok(),
            _ => None,
        };
        outputs.iter().filter_map(state).collect()
    }

    #[test]
    fn nothing_but_the_coordination_state_leaves_the_vehicle() {
        let mut flight = Flight::new(mission(), 0, None).expect("flies");
        flight.handle(Time::ZERO, None);
        let outputs = outputs(&mut flight);
        let [said] = transmitted(&outputs)[..] else { panic!("one message at the start, not {outputs:?}") };
        assert_eq!((said.sender, said.seq, said.made, said.scalar), (0, 0, Time::ZERO, None));
        assert!((said.xi - 79.517).abs() < 1e-3);
    }

    #[test]
    fn it_speaks_at_the_message_period_and_numbers_follow_from_the_time() {
        let mut flight = Flight::new(mission(), 0, None).expect("flies");
        let mut said = Vec::new();
        flight.run_until(Time::from_secs(1.0), [], |_, output| said.extend(transmitted(&[output])));
        let numbers: Vec<u32> = said.iter().map(|state| state.seq).collect();
        assert_eq!(numbers, (0..=10).collect::<Vec<_>>());
        assert!(said.iter().all(|state| state.made == Time::from_secs(0.1 * f64::from(state.seq))));
    }

    #[test]
    fn missed_periods_are_skipped_and_counted_and_the_message_is_sent_late() {
        let mut flight = Flight::new(mission(), 0, Some(1.0)).expect("flies");
        flight.handle(Time::ZERO, None);
        outputs(&mut flight);
        // Frozen until 0.532 s: the period of 0.5 s runs, those of 0.05 to 0.45 s are missed.
        flight.handle(Time::from_secs(0.532), None);
        assert_eq!(transmitted(&outputs(&mut flight)).len(), 1);
        assert_eq!(flight.poll_timeout(), Some(Time::from_secs(0.55)));
        let deadlines = flight.deadlines.as_ref().expect("watched");
        assert_eq!((deadlines.met, deadlines.missed, deadlines.worst_late_ns), (2, 9, 32_000_000));
    }

    #[test]
    fn the_body_moves_on_through_missed_periods() {
        let mut whole = Flight::new(mission(), 0, None).expect("flies");
        let mut frozen = Flight::new(mission(), 0, None).expect("flies");
        whole.run_until(Time::from_secs(0.05), [], |_, _| {});
        frozen.run_until(Time::from_secs(0.05), [], |_, _| {});
        frozen.handle(Time::from_secs(0.25), None);
        // The output of the law is held for four periods, so the target has moved on at the same rate.
        let rate = whole.craft.observe().xi_rate;
        let moved = frozen.craft.observe().xi - whole.craft.observe().xi;
        assert!((moved - 4.0 * 0.05 * rate).abs() < 1e-9, "{moved}");
    }

    fn mission_with(keys: &str) -> Arc<Mission> {
        let text = HELIX.replacen("[fleet]\n", &format!("[fleet]\n{keys}\n"), 1);
        Arc::new(Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}")))
    }

    #[test]
    fn missed_periods_have_their_own_conditions() {
        // The speed is stuck during missed periods only, and the vehicle is carried by the water all the time.
        let keys = "failure = { speed_stuck = { speed_mps = 0.4, from_s = 0.1, to_s = 0.2 } }\n\
                    current = { velocity_mps = [0.0, 0.0, 1.0] }";
        let mut flight = Flight::new(mission_with(keys), 0, Some(1.0)).expect("flies");
        flight.handle(Time::ZERO, None);
        flight.handle(Time::from_secs(0.25), None);
        let seen = flight.craft.observe();
        assert!((seen.position[2] - (-5.0 + 0.25)).abs() < 0.01, "{seen:?}");
        assert!((seen.speed - 0.4).abs() < 0.1, "{seen:?}");
    }

    #[test]
    fn the_laws_see_noise_and_the_record_does_not() {
        let rows = |keys: &str| {
            let mut flight = Flight::new(mission_with(keys), 0, None).expect("flies");
            let mut rows = Vec::new();
            flight.run_until(Time::from_secs(0.5), [], |_, output| {
                if let FlightOutput::Record(Row::Exact(Record::State(row))) = output {
                    rows.push(row);
                }
            });
            rows
        };
        let (quiet, noisy) = (rows(""), rows("noise = { position_m = 0.5, turn_rate_degps = 1.0 }"));
        assert_eq!((quiet[0].x_m, quiet[0].e_norm_m), (noisy[0].x_m, noisy[0].e_norm_m));
        assert_ne!(quiet[1].x_m, noisy[1].x_m);
        assert_eq!(noisy, rows("noise = { position_m = 0.5, turn_rate_degps = 1.0 }"), "seeded");
    }

    #[test]
    fn what_a_vehicle_warns_of_is_an_exact_row_at_the_end() {
        let text = HELIX.replacen("duration_s = 800.0", "duration_s = 2.0", 1).replacen(
            "[fleet]\n",
            "[fleet]\nlimits = { force_n = 1.0 }\n",
            1,
        );
        let mission = Arc::new(Mission::parse("m.toml", &text).expect("sound"));
        let mut flight = Flight::new(mission, 0, None).expect("flies");
        let mut warnings = Vec::new();
        flight.run_until(Time::from_secs(5.0), [], |at, output| {
            if let FlightOutput::Record(Row::Exact(Record::Warning(row))) = output {
                warnings.push((at, row));
            }
        });
        let [(at, row)] = &warnings[..] else { panic!("one warning, not {warnings:?}") };
        assert_eq!((at.secs(), row.t_ns, &*row.source), (2.0, 2_000_000_000, "auv1"));
        assert!(row.text.contains("at its limit") && row.count > 30, "{row:?}");
    }

    #[test]
    fn a_vehicle_whose_law_has_no_answer_any_more_gives_up() {
        let text = include_str!("../../missions/thesis/fig-3-7.toml").replacen("speed = 0.1\n", "speed = 1e6\n", 1);
        let mission = Arc::new(Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}")));
        let failures: Vec<(f64, String)> = (0..3)
            .filter_map(|me| {
                let mut flight = Flight::new(mission.clone(), me, None).expect("flies");
                let mut failed = None;
                flight.run_until(mission.end, [], |at, output| {
                    if let FlightOutput::Failed(reason) = output {
                        failed = Some((at.secs(), reason));
                    }
                });
                failed
            })
            .collect();
        // A state that is no number may come first.
        assert!(failures.len() == 3 && failures.iter().all(|(at, _)| *at < 5.0), "{failures:?}");
        assert!(failures.iter().any(|(_, reason)| reason.contains("no answer any more")), "{failures:?}");
    }

    #[test]
    fn a_message_at_the_instant_of_a_period_is_heard_by_the_next_one() {
        let mission = mission();
        let state =
            CoordinationState { mission: mission.digest, sender: 1, seq: 0, made: Time::ZERO, xi: 0.0, scalar: None };
        let heard_at = |at: f64| {
            let mut flight = Flight::new(mission.clone(), 0, None).expect("flies");
            let inputs = [(Time::from_secs(at), FlightInput::Heard(state.encode()))];
            let mut rows = Vec::new();
            flight.run_until(Time::from_secs(0.5), inputs, |_, output| rows.push(output));
            let counts: Vec<u16> = rows
                .iter()
                .filter_map(|output| match output {
                    FlightOutput::Record(Row::Exact(Record::State(row))) => Some(row.neighbours),
                    _ => None,
                })
                .collect();
            counts
        };
        // States are recorded at 0 s and 0.5 s.
        assert_eq!(heard_at(0.5), vec![0, 0], "at the very instant");
        assert_eq!(heard_at(0.499), vec![0, 1], "just before");
    }

    #[test]
    fn a_vehicle_that_comes_back_takes_its_target_from_the_first_neighbour_it_hears() {
        let mission = mission();
        let now = Time::from_secs(100.0);
        let start = Start { xi: 5.0, ..mission.vehicles[0].start };
        let mut flight = Flight::rejoin(mission.clone(), 0, start, now, Some(1.0)).expect("flies");
        assert_eq!(flight.poll_timeout(), Some(now));
        let state = CoordinationState {
            mission: mission.digest,
            sender: 1,
            seq: 950,
            made: Time::from_secs(95.0),
            xi: 110.0,
            scalar: None,
        };
        flight.handle(now, Some(FlightInput::Heard(state.encode())));
        flight.handle(now, None);
        // 5 s old, at v_L* = 1/3.
        assert!((flight.craft.observe().xi - (110.0 + 5.0 / 3.0)).abs() < 1e-9);
    }

    #[test]
    fn a_flight_ends_at_its_end_and_says_so_once() {
        let mission = Arc::new(
            Mission::parse("m.toml", &HELIX.replace("duration_s = 800.0", "duration_s = 1.0")).expect("sound"),
        );
        let mut flight = Flight::new(mission, 0, None).expect("flies");
        let mut ends = 0;
        flight.run_until(Time::from_secs(5.0), [], |at, output| {
            if output == FlightOutput::Finished {
                assert_eq!(at, Time::from_secs(1.0));
                ends += 1;
            }
        });
        assert_eq!((ends, flight.poll_timeout()), (1, None));
    }

    #[test]
    fn garbage_from_the_air_never_stops_a_flight() {
        use proptest::prelude::*;
        let mission = mission();
        let bytes = proptest::collection::vec(any::<u8>(), 0..120);
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        runner
            .run(&(bytes, any::<bool>()), |(mut bytes, framed)| {
                if framed {
                    bytes.splice(0..0, *b"CX\x01\x00");
                    seal(&mut bytes);
                }
                let mut flight = Flight::new(mission.clone(), 0, None).expect("flies");
                flight.handle(Time::ZERO, Some(FlightInput::Heard(bytes)));
                flight.handle(Time::ZERO, None);
                prop_assert!(flight.poll_timeout().is_some());
                Ok(())
            })
            .expect("no garbage stops it");
    }

    fn thesis(name: &str) -> String {
        let path = format!("{}/../missions/thesis/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).expect("a mission")
    }

    #[test]
    fn each_law_puts_on_the_air_what_it_declares_and_no_more() {
        // Under the gateway's law with the extra integrator the first vehicle, the gateway, sends ξ alone.
        for (name, scalar, of_the_first) in [
            ("fig-2-15-a", false, false),
            ("fig-2-15-b", true, false),
            ("eq-1-5-leader-integral", false, false),
            ("solution-1", true, true),
            ("solution-2", false, false),
            ("fig-3-7", true, true),
            ("eq-3-62-weighted", false, false),
            ("eq-3-70-pattern", true, true),
            ("fig-3-10", false, false),
            ("eq-3-83", false, false),
            ("eq-3-86", false, false),
            ("truly-decentralised", true, true),
            ("ucm-one-link-at-a-time", false, false),
            ("fig-4-2", false, false),
            ("eq-4-59", false, false),
            ("eq-4-62-example-4-1", false, false),
        ] {
            let mission = Arc::new(Mission::parse(name, &thesis(name)).unwrap_or_else(|faults| panic!("{faults}")));
            for me in 0..mission.vehicles.len() {
                let mut flight = Flight::new(mission.clone(), me, None).expect("flies");
                flight.handle(Time::ZERO, None);
                let sent: Vec<Vec<u8>> = outputs(&mut flight)
                    .into_iter()
                    .filter_map(|output| match output {
                        FlightOutput::Transmit(bytes) => Some(bytes),
                        _ => None,
                    })
                    .collect();
                let [bytes] = &sent[..] else { panic!("{name}: {} messages", sent.len()) };
                let declared = if me == 0 { of_the_first } else { scalar };
                assert_eq!(bytes.len(), mission.message_bytes(me), "{name}");
                assert_eq!(mission.law.says(me).is_some(), declared, "{name}");
                assert_eq!(CoordinationState::decode(bytes).expect("sound").scalar.is_some(), declared, "{name}");
            }
        }
    }

    #[test]
    fn who_is_not_told_the_formation_speed_flies_the_same_whatever_it_is() {
        // One vehicle with what it hears, at two formation speeds: what it says must be the same number by number.
        let said = |name: &str, me: usize, heard: usize, replace: [&str; 2]| {
            let text = thesis(name);
            assert!(text.contains(replace[0]), "{name}");
            let mission = Mission::parse(name, &text.replacen(replace[0], replace[1], 1));
            let mission = Arc::new(mission.unwrap_or_else(|faults| panic!("{faults}")));
            let mut flight = Flight::new(mission.clone(), me, None).expect("flies");
            let words = (0..400u32).map(|seq| {
                let made = Time::from_secs(0.02 * f64::from(seq));
                let xi = 0.3 + 0.002 * f64::from(seq);
                let scalar = mission.law.says(heard).map(|_| 0.1);
                let state = CoordinationState { mission: mission.digest, sender: heard as u16, seq, made, xi, scalar };
                (made + mission.control_period, FlightInput::Heard(state.encode()))
            });
            let mut said = Vec::new();
            flight.run_until(Time::from_secs(8.0), words, |_, output| said.extend(transmitted(&[output])));
            said.iter().map(|state| (state.xi, state.scalar)).collect::<Vec<_>>()
        };
        let speeds = ["from_s = 0.0, speed = 0.1", "from_s = 0.0, speed = 0.4"];
        let of = |me, heard| speeds.map(|speed| said("truly-decentralised", me, heard, [speeds[0], speed]));
        let ([slow, fast], [told_slow, told_fast]) = (of(1, 2), of(0, 1));
        assert!(slow.len() == 401 && slow == fast && told_slow != told_fast);
        let speeds = ["\nspeed = 0.5", "\nspeed = 0.2"];
        let of = |me, heard| speeds.map(|speed| said("eq-1-5-leader-integral", me, heard, [speeds[0], speed]));
        let ([slow, fast], [told_slow, told_fast]) = (of(1, 0), of(0, 1));
        assert!(slow.len() == 401 && slow == fast && told_slow != told_fast);
    }

    #[test]
    fn a_pattern_that_moves_is_off_the_air() {
        // h_2(0) = 0.5 sin 120°: the message holds ξ − h, the record ξ.
        let mission = Arc::new(Mission::parse("m", &thesis("eq-3-70-pattern")).expect("sound"));
        let mut flight = Flight::new(mission.clone(), 1, None).expect("flies");
        flight.handle(Time::ZERO, None);
        let outputs = outputs(&mut flight);
        let h = 0.5 * 120f64.to_radians().sin();
        let [said] = transmitted(&outputs)[..] else { panic!("one message") };
        assert!((said.xi - (mission.vehicles[1].start.xi - h)).abs() < 1e-12);
        let recorded = outputs.iter().find_map(|output| match output {
            FlightOutput::Record(Row::Exact(Record::State(row))) => Some(row.xi),
            _ => None,
        });
        assert_eq!(recorded, Some(mission.vehicles[1].start.xi));
    }
}
