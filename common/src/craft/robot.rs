//! The wheeled robot of chapter 3: a dynamic unicycle that follows a virtual target by Proposition 3.1 or 3.2.

use std::sync::Arc;

use super::speed_loop::SpeedLoop;
use super::{Craft, Limits, Observation, REFUSED, SATURATED, Warning, check_plane, limited};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::proposition_3_1::{Bend, Errors, Gains, Motion, Proposition31, Sense, Steering};
use crate::following::proposition_3_2::Proposition32;
use crate::path::{Path, PathPoint};
use crate::positive::finite;
use crate::vehicle::dynamic_unicycle::{Input, Parameters, State, model};
use crate::vehicle::environment::Conditions;
use crate::vehicle::integrate::advance;

/// The path-following laws of wheeled robots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RobotLaw {
    /// Proposition 3.1.
    Proposition31(Proposition31),
    /// Proposition 3.2.
    Proposition32(Proposition32),
}

impl From<Proposition31> for RobotLaw {
    fn from(law: Proposition31) -> RobotLaw {
        RobotLaw::Proposition31(law)
    }
}

impl From<Proposition32> for RobotLaw {
    fn from(law: Proposition32) -> RobotLaw {
        RobotLaw::Proposition32(law)
    }
}

impl RobotLaw {
    fn gains(&self) -> &Gains {
        match self {
            RobotLaw::Proposition31(law) => law.gains(),
            RobotLaw::Proposition32(law) => law.gains(),
        }
    }

    fn target_speed(&self, e: &Errors, v: f64) -> f64 {
        match self {
            RobotLaw::Proposition31(law) => law.target_speed(e, v),
            RobotLaw::Proposition32(law) => law.target_speed(e, v),
        }
    }

    fn steer(&self, e: &Errors, motion: &Motion, bend: &Bend, sense: Sense) -> Steering {
        match self {
            RobotLaw::Proposition31(law) => law.steer(e, motion, bend, sense),
            RobotLaw::Proposition32(law) => law.steer(e, motion, bend, sense),
        }
    }
}

/// What is held between two evaluations of the law.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    input: Input,
    xi_rate: f64,
    v_ref: f64,
}

impl Held {
    fn is_finite(&self) -> bool {
        let Held { input: Input { force, torque }, xi_rate, v_ref } = *self;
        [force, torque, xi_rate, v_ref].iter().all(|x| x.is_finite())
    }
}

/// A wheeled robot under Proposition 3.1 or 3.2.
#[derive(Debug)]
pub struct RobotCraft {
    path: Arc<dyn Path>,
    law: RobotLaw,
    speed_loop: SpeedLoop,
    parameters: Parameters,
    state: State,
    /// Parameter of the virtual target, and the path there.
    xi: f64,
    target: PathPoint,
    sense: Sense,
    held: Held,
    limits: Limits,
    conditions: Conditions,
    saturated: u64,
    refused: u64,
}

impl RobotCraft {
    /// The robot in `state` with its virtual target at `xi`. The path must lie in a horizontal plane and have no
    /// corners; a robot without mass is refused.
    pub fn new(
        path: Arc<dyn Path>,
        law: impl Into<RobotLaw>,
        speed_loop: SpeedLoop,
        parameters: Parameters,
        state: State,
        xi: f64,
    ) -> Result<RobotCraft, String> {
        check_plane(&*path, "a wheeled robot")?;
        state.to_vector().iter().try_for_each(|&x| finite("the robot's state", x).map(drop))?;
        let (target, parameters) = (path.at(finite("the robot's xi", xi)?), parameters.checked()?);
        Ok(RobotCraft {
            path,
            law: law.into(),
            speed_loop: speed_loop.checked()?,
            parameters,
            state,
            xi,
            target,
            sense: Sense::default(),
            held: Held::default(),
            limits: Limits::NONE,
            conditions: Conditions::default(),
            saturated: 0,
            refused: 0,
        })
    }

    /// The robot with a force and a torque that it cannot exceed.
    pub fn limited(mut self, limits: Limits) -> RobotCraft {
        self.limits = limits;
        self
    }

    /// Its state as its instruments tell it.
    fn measured(&self) -> State {
        measured(&self.state, &self.conditions)
    }

    fn errors(&self, state: &State) -> Errors {
        Errors::of(&self.target, state.x, state.y, state.heading)
    }

    fn move_target(&mut self, xi: f64) {
        self.xi = xi;
        self.target = self.path.at(xi);
    }
}

/// A robot's state as its instruments tell it.
pub(super) fn measured(state: &State, conditions: &Conditions) -> State {
    let Some(errors) = conditions.errors else { return *state };
    State {
        x: state.x + errors.position.x,
        y: state.y + errors.position.y,
        heading: state.heading + errors.heading,
        speed: state.speed + errors.velocity.x,
        turn_rate: state.turn_rate + errors.spin.z,
    }
}

impl Craft for RobotCraft {
    fn takes(&self) -> DemandKind {
        self.speed_loop.takes()
    }

    /// The engine keeps its stuck speed at once (section 2.4: v_i = v₀).
    fn expose(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        if let Some(speed) = conditions.stuck_speed {
            self.state.speed = speed;
        }
    }

    /// With η = v − R v_L (3.38), or zero for a robot that takes a rate.
    fn own(&self, reference: SpeedReference) -> Own {
        let (r, state) = (self.target.r(), self.measured());
        let eta = self.speed_loop.eta(state.speed, r, reference);
        let xi_rate = self.law.target_speed(&self.errors(&state), state.speed) / r;
        let r_dot = self.target.dr_dxi() * xi_rate;
        Own { xi: self.xi, eta, r, v: state.speed, r_dot, ..Own::default() }
    }

    /// Where the force is at its limit or the speed is stuck, the law knows that it is.
    fn command(&mut self, reference: SpeedReference, demand: Demand) {
        let state = self.measured();
        let (v, e) = (state.speed, self.errors(&state));
        // ξ̇ = ṡ/R = (v cos ψ_e + k₃ x_e)/R (3.35)
        let xi_rate = self.law.target_speed(&e, v) / self.target.r();
        let Some(answer) = self.speed_loop.answer(demand, reference, &self.target, v, xi_rate) else {
            self.refused += 1;
            return;
        };
        let sense = self.law.gains().sense(self.sense, v, answer.wanted);
        let Parameters { mass, inertia } = self.parameters;
        let (force, cut) = limited(mass * answer.v_dot, self.limits.force);
        let v_dot = if cut { force / mass } else { answer.v_dot };
        // A speed that is stuck does not change, whatever is commanded; the vehicle knows of its failure.
        let v_dot = if self.conditions.stuck_speed.is_some() { 0.0 } else { v_dot };
        let motion = Motion { v, v_dot, r: state.turn_rate, ..Motion::default() };
        let steering = self.law.steer(&e, &motion, &Bend::of(&self.target), sense);
        let (torque, cut_too) = limited(inertia * steering.r_dot, self.limits.torque);
        let held = Held { input: Input { force, torque }, xi_rate, v_ref: answer.v_ref };
        if !(held.is_finite() && answer.v_dot.is_finite() && steering.r_dot.is_finite()) {
            self.refused += 1;
            return;
        }
        self.saturated += u64::from(cut || cut_too);
        (self.sense, self.held) = (sense, held);
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        let (state, mut input) = (self.state.to_vector(), self.held.input);
        if self.conditions.stuck_speed.is_some() {
            input.force = 0.0;
        }
        self.state = State::from_vector(advance(model, &state, &input, &self.parameters, dt, substeps));
        if let Some(drift) = self.conditions.drift(dt) {
            self.state.x += drift.x;
            self.state.y += drift.y;
        }
        self.move_target(self.xi + self.held.xi_rate * dt);
    }

    fn observe(&self) -> Observation {
        let e = self.errors(&self.state);
        Observation {
            xi: self.xi,
            xi_rate: self.held.xi_rate,
            v_ref: self.held.v_ref,
            position: [self.state.x, self.state.y, self.target.p.z],
            attitude: [self.state.heading, 0.0, 0.0],
            speed: self.state.speed,
            e_along: e.x_e,
            e_cross: e.y_e,
            e_norm: e.x_e.hypot(e.y_e),
            psi_e: e.psi_e,
        }
    }

    fn place_target(&mut self, xi: f64) {
        self.move_target(xi);
    }

    fn is_sound(&self) -> bool {
        self.xi.is_finite() && self.held.is_finite() && self.state.to_vector().iter().all(|x| x.is_finite())
    }

    fn refused(&self) -> u64 {
        self.refused
    }

    fn warnings(&self) -> Vec<Warning> {
        vec![Warning { what: SATURATED, count: self.saturated }, Warning { what: REFUSED, count: self.refused }]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};
    use std::sync::Arc;

    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::RobotCraft;
    use crate::coordination::solution_1_3_43::SolutionOne;
    use crate::coordination::solution_2_3_44::SolutionTwo;
    use crate::coordination::solution_3_3_45::SolutionThree;
    use crate::coordination::switching_4_21::Switching;
    use crate::coordination::{CoordinationLaw, Demand, DemandKind, Neighbour, SpeedReference};
    use crate::craft::speed_loop::SpeedLoop;
    use crate::craft::{Craft, Limits, REFUSED, Warning};
    use crate::following::proposition_3_1::{Approach, Bend, Gains, Motion, Proposition31};
    use crate::path::chain::{Chain, Segment};
    use crate::path::circle::{Circle, Turn};
    use crate::path::closest::closest_parameter;
    use crate::path::helix::Helix;
    use crate::path::line::Line;
    use crate::path::sinusoid::Sinusoid;
    use crate::path::{Path, PathPoint};
    use crate::vehicle::dynamic_unicycle::{Parameters, State};
    use crate::vehicle::environment::{Conditions, InstrumentErrors};

    const REFERENCE: SpeedReference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
    const PARAMETERS: Parameters = Parameters { mass: 5.0, inertia: 0.4 };

    fn robot_with(
        path: impl Path + 'static,
        speed_loop: SpeedLoop,
        gains: Gains,
        x: f64,
        y: f64,
        heading: f64,
    ) -> RobotCraft {
        let xi = closest_parameter(&path, Vector3::new(x, y, 0.0), true);
        let state = State { x, y, heading, ..State::default() };
        let law = Proposition31::new(gains).unwrap();
        RobotCraft::new(Arc::new(path), law, speed_loop, PARAMETERS, state, xi).unwrap()
    }

    fn robot(path: impl Path + 'static, x: f64, y: f64, heading: f64) -> RobotCraft {
        robot_with(path, SpeedLoop::Acceleration, Gains::default(), x, y, heading)
    }

    /// The fleet `seconds` later, without delay; everybody's values are those at the start of the period.
    fn run<const N: usize>(
        mut fleet: [RobotCraft; N],
        law: &dyn CoordinationLaw,
        hears: [&[usize]; N],
        seconds: f64,
        period: f64,
    ) -> [RobotCraft; N] {
        for _ in 0..(seconds / period).round() as usize {
            let own = fleet.each_ref().map(|craft| craft.own(REFERENCE));
            for (i, craft) in fleet.iter_mut().enumerate() {
                let heard: Vec<_> = hears[i]
                    .iter()
                    .map(|&j| Neighbour { xi: own[j].xi, scalar: own[j].eta / own[j].r, ..Neighbour::default() })
                    .collect();
                craft.command(REFERENCE, law.demand(REFERENCE, &own[i], &heard));
                craft.advance(period, 2);
                assert!(craft.is_sound());
            }
        }
        fleet
    }

    fn alone(craft: RobotCraft, seconds: f64) -> RobotCraft {
        let [craft] = run([craft], &SolutionTwo::new(1.0, 1.0).unwrap(), [&[]], seconds, 0.02);
        craft
    }

    #[test]
    fn a_line_is_followed_at_v_l() {
        let gains = Gains { approach: Approach::Arctangent { psi_a: FRAC_PI_2, length: 0.5 }, ..Gains::default() };
        for gains in [Gains::default(), gains] {
            let line = Line::new(Vector3::new(0.0, 1.0, 0.0), 0.3, 2.0).unwrap();
            let craft = alone(robot_with(line, SpeedLoop::Acceleration, gains, 0.0, 0.0, -0.5), 150.0);
            let seen = craft.observe();
            assert!(seen.e_norm < 1e-4 && seen.psi_e.abs() < 1e-4, "{seen:?}");
            assert!((seen.speed - 0.2).abs() < 1e-9 && (seen.xi_rate - 0.1).abs() < 1e-6);
        }
    }

    #[test]
    fn a_circle_is_followed_alike_in_either_sense() {
        let circle = |turn| Circle::new(Vector3::zeros(), 2.0, turn, 0.0, 1.0).unwrap();
        let mut left = robot(circle(Turn::Left), 2.7, -0.4, 1.0);
        let mut right = robot(circle(Turn::Right), 2.7, 0.4, -1.0);
        for _ in 0..60 {
            (left, right) = (alone(left, 1.0), alone(right, 1.0));
            let (one, two) = (left.observe(), right.observe());
            assert!((one.e_cross + two.e_cross).abs() < 1e-9 && (one.psi_e + two.psi_e).abs() < 1e-9);
            assert!((one.e_along - two.e_along).abs() < 1e-9 && (one.xi - two.xi).abs() < 1e-9);
        }
        let seen = alone(left, 60.0).observe();
        assert!(seen.e_norm < 1e-3 && (seen.speed - 0.2).abs() < 1e-9, "{seen:?}");
    }

    /// Figure 3.9: one robot weaves, the other drives beside it along y = −1.
    fn figure_3_9(wavelength: f64, seconds: f64, period: f64) -> [RobotCraft; 2] {
        let weaving = robot(Sinusoid::new(1.0, 1.0, wavelength, 0.0, 0.0).unwrap(), -0.2, 0.5, 0.5);
        let straight = robot(Line::new(Vector3::new(0.0, -1.0, 0.0), 0.0, 1.0).unwrap(), 0.2, -1.3, 0.0);
        run([weaving, straight], &SolutionOne::new(1.0).unwrap(), [&[1], &[0]], seconds, period)
    }

    #[test]
    fn figure_3_9_keeps_the_robots_side_by_side() {
        let [weaving, straight] = figure_3_9(1.0, 60.0, 0.02).map(|craft| craft.observe());
        // Curvatures up to 39.5 per metre under a held control leave about a centimetre (erratum 3.19).
        assert!((weaving.xi - straight.xi).abs() < 2e-3, "{} {}", weaving.xi, straight.xi);
        assert!(weaving.e_norm < 0.03 && straight.e_norm < 1e-3, "{weaving:?} {straight:?}");
    }

    #[test]
    fn what_a_held_control_leaves_on_the_sinusoid_shrinks_with_the_period() {
        let worst = |period: f64| {
            let mut fleet = figure_3_9(1.0, 40.0, period);
            let mut worst = 0f64;
            for _ in 0..100 {
                fleet = run(fleet, &SolutionOne::new(1.0).unwrap(), [&[1], &[0]], 0.2, period);
                worst = worst.max(fleet[0].observe().e_cross.abs());
            }
            worst
        };
        let (coarse, fine) = (worst(0.02), worst(0.005));
        assert!(fine < 0.5 * coarse && coarse < 0.05, "{coarse} {fine}");
    }

    #[test]
    fn figure_3_7_stays_in_line_through_arcs_and_lines() {
        let path = |radii: [f64; 2]| {
            let arc = |radius, sweep: f64| Segment::Arc { radius, sweep, xi_length: sweep.abs() };
            let line = Segment::Line { length: 3.0, xi_length: 3.0 };
            let segments = [arc(radii[0], FRAC_PI_2), line, arc(radii[1], -FRAC_PI_2), line];
            Chain::new(Vector3::new(0.0, -radii[0], 0.0), 0.0, &segments).unwrap()
        };
        let fleet = [
            robot(path([2.0, 4.0]), 0.0, -2.2, 0.0),
            robot(path([3.0, 3.0]), 0.4, -2.8, 0.0),
            robot(path([4.0, 2.0]), 0.0, -3.9, 0.0),
        ];
        let law = SolutionThree::new(1.0, 0.25, 1.0).unwrap();
        // At each joint η jumps with R and coordination is disturbed anew (erratum 3.18).
        let seen = run(fleet, &law, [&[1, 2], &[0], &[0]], 140.0, 0.02).map(|craft| craft.observe());
        for craft in seen {
            assert!((craft.xi - seen[0].xi).abs() < 1e-3 && craft.e_norm < 1e-2, "{craft:?}");
        }
        assert!(seen[0].xi > PI + 3.0, "the last line is reached");
    }

    #[test]
    fn who_is_far_ahead_backs_up_along_its_path_unless_the_saturation_forbids_it() {
        // Erratum 3.17: nothing keeps v_i above zero.
        let slowest = |law: &dyn CoordinationLaw| {
            let line = |y| Line::new(Vector3::new(0.0, y, 0.0), 0.0, 1.0).unwrap();
            let mut fleet = [robot(line(0.0), 4.0, 0.3, 0.0), robot(line(1.0), 0.0, 0.7, 0.0)];
            for craft in &mut fleet {
                craft.state.speed = 0.1;
            }
            let mut slowest = f64::INFINITY;
            for _ in 0..1500 {
                fleet = run(fleet, law, [&[1], &[0]], 0.2, 0.02);
                slowest = slowest.min(fleet[0].observe().speed);
            }
            let [one, two] = fleet.map(|craft| craft.observe());
            assert!((one.xi - two.xi).abs() < 1e-2 && (one.speed - 0.1).abs() < 1e-2, "{one:?} {two:?}");
            assert!(one.e_norm < 1e-3 && one.psi_e.abs() < 1e-3, "{one:?}");
            slowest
        };
        let backwards = slowest(&SolutionTwo::new(1.0, 0.3).unwrap());
        assert!(backwards < -0.3, "{backwards}");
        // b x_m/a = 0.05 < v_L
        let forwards = slowest(&SolutionThree::new(1.0, 0.25, 0.2).unwrap());
        assert!(forwards > 0.0, "{forwards}");
    }

    #[test]
    fn a_rate_is_followed_by_the_speed() {
        let speed_loop = SpeedLoop::Rate { k_0: 2.0 };
        let circle = |radius| Circle::new(Vector3::zeros(), radius, Turn::Left, 0.0, 1.0).unwrap();
        let fleet = [
            robot_with(circle(2.0), speed_loop, Gains::default(), 2.1, 0.0, FRAC_PI_2),
            robot_with(circle(3.0), speed_loop, Gains::default(), 3.0, 0.5, FRAC_PI_2),
        ];
        let fleet = run(fleet, &Switching::new(0.2).unwrap(), [&[1], &[0]], 80.0, 0.02);
        let [one, two] = fleet.map(|craft| craft.observe());
        assert!((one.xi - two.xi).abs() < 1e-4 && (one.v_ref - 0.1).abs() < 1e-4, "{one:?} {two:?}");
        assert!((one.speed - 0.2).abs() < 1e-4 && (two.speed - 0.3).abs() < 1e-4);
    }

    #[test]
    fn the_speed_follows_r_along_the_path() {
        // v − R v_r decays as exp(−k₀ t) although R changes all the time; the held force leaves a part in a thousand.
        let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
        let mut craft = robot_with(path, SpeedLoop::Rate { k_0: 2.0 }, Gains::default(), 0.0, 0.0, 0.66);
        let mut worst = 0f64;
        for step in 0..6000 {
            craft.command(REFERENCE, Demand::Rate(0.2));
            craft.advance(0.005, 1);
            if step > 2000 {
                worst = worst.max((craft.observe().speed - 0.2 * craft.target.r()).abs());
            }
        }
        assert!(worst < 2e-4, "{worst}");
    }

    #[test]
    fn a_fleet_that_is_told_to_go_back_goes_back_along_the_path() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        let speed_loop = SpeedLoop::Rate { k_0: 2.0 };
        let mut craft = robot_with(circle, speed_loop, Gains::default(), 2.4, 0.3, FRAC_PI_2);
        for _ in 0..3000 {
            craft.command(REFERENCE, Demand::Rate(-0.2));
            craft.advance(0.02, 1);
        }
        let seen = craft.observe();
        assert!(seen.e_norm < 1e-3 && seen.xi < -8.0 && (seen.speed + 0.4).abs() < 1e-6, "{seen:?}");
    }

    #[test]
    fn the_force_of_3_39_makes_eta_dot_equal_u() {
        // With R changing along the path and v_L changing in time.
        let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
        let start = path.at(0.3);
        let mut craft = robot(path.clone(), start.p.x, start.p.y, start.heading());
        craft.state.speed = 0.4;
        let dt = 1e-5;
        let at = |t: f64| SpeedReference { v_l: 0.1 + 0.05 * t, v_l_dot: 0.05 };
        let before = craft.own(at(0.0)).eta;
        craft.command(at(0.0), Demand::Acceleration(0.3));
        craft.advance(dt, 1);
        let eta_dot = (craft.own(at(dt)).eta - before) / dt;
        assert!((eta_dot - 0.3).abs() < 1e-4, "{eta_dot}");
        assert!(path.at(0.3).dr_dxi().abs() > 0.05, "else nothing is tested");
    }

    #[test]
    fn the_answers_of_the_speed_loop_by_hand() {
        // R = 2 and R' = 0.6·0.8/2 = 0.24, at ξ̇ = 0.5: Ṙ = 0.12.
        let target = PathPoint {
            p: Vector3::zeros(),
            d1: Vector3::new(1.6, 1.2, 0.0),
            d2: Vector3::new(0.3, 0.0, 0.0),
            d3: Vector3::zeros(),
        };
        assert!((target.r() - 2.0).abs() < 1e-15 && (target.dr_dxi() - 0.24).abs() < 1e-15);
        let reference = SpeedReference { v_l: 0.1, v_l_dot: 0.05 };
        let of = |speed_loop: SpeedLoop, demand| {
            speed_loop
                .answer(demand, reference, &target, 0.7, 0.5)
                .map(|answer| [answer.v_dot, answer.wanted, answer.v_ref])
        };
        let close = |found: Option<[f64; 3]>, by_hand: [f64; 3]| {
            found.is_some_and(|found| found.iter().zip(by_hand).all(|(a, b)| (a - b).abs() < 1e-15))
        };
        let acceleration = SpeedLoop::Acceleration;
        assert!(close(of(acceleration, Demand::Acceleration(0.3)), [0.3 + 0.12 * 0.1 + 2.0 * 0.05, 0.2, 0.1]));
        assert!(close(of(acceleration, Demand::Forward(0.3)), [0.3, 0.7, 0.1]));
        let rate = SpeedLoop::Rate { k_0: 1.5 };
        assert!(close(of(rate, Demand::Rate(0.3)), [0.12 * 0.3 - 1.5 * (0.7 - 0.6), 0.6, 0.3]));
        assert!(of(acceleration, Demand::Rate(0.3)).is_none() && of(rate, Demand::Forward(0.3)).is_none());
    }

    #[test]
    fn own_rate_of_r_is_that_of_the_target() {
        let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
        let mut craft = robot(path, 0.3, 0.1, 0.5);
        craft.state.speed = 0.4;
        let own = craft.own(REFERENCE);
        craft.command(REFERENCE, Demand::Acceleration(0.0));
        craft.advance(1e-6, 1);
        assert!(((craft.target.r() - own.r) / 1e-6 - own.r_dot).abs() < 1e-5 && own.r_dot.abs() > 0.05, "{own:?}");
    }

    #[test]
    fn what_is_measured_is_the_state_with_every_error() {
        let mut craft = robot(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 1.0, 2.0, 0.3);
        (craft.state.speed, craft.state.turn_rate) = (0.4, 0.5);
        let errors = InstrumentErrors {
            position: Vector3::new(0.125, 0.25, 9.0),
            heading: 0.0625,
            velocity: Vector3::new(0.5, 9.0, 9.0),
            spin: Vector3::new(9.0, 9.0, 0.75),
        };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        let wanted = State { x: 1.125, y: 2.25, heading: 0.3625, speed: 0.9, turn_rate: 1.25 };
        assert!((craft.measured().to_vector() - wanted.to_vector()).norm() < 1e-15);
    }

    #[test]
    fn a_state_that_is_no_number_is_told_of() {
        let sound = || robot(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 0.0, 0.0, 0.0);
        let mut nowhere = sound();
        nowhere.place_target(f64::NAN);
        let mut stuck = sound();
        stuck.expose(&Conditions { stuck_speed: Some(f64::NAN), ..Conditions::default() });
        let mut held = sound();
        held.held.xi_rate = f64::INFINITY;
        assert!(sound().is_sound() && !nowhere.is_sound() && !stuck.is_sound() && !held.is_sound());
    }

    #[test]
    fn mass_and_inertia_scale_the_efforts_and_change_no_motion() {
        let circle = || Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        let mut heavy = robot(circle(), 2.3, 0.0, 1.0);
        let mut unit = robot(circle(), 2.3, 0.0, 1.0);
        unit.parameters = Parameters { mass: 1.0, inertia: 1.0 };
        for _ in 0..100 {
            for craft in [&mut heavy, &mut unit] {
                craft.command(REFERENCE, Demand::Acceleration(0.01));
                craft.advance(0.02, 1);
            }
        }
        assert!((heavy.held.input.force - 5.0 * unit.held.input.force).abs() < 1e-9);
        assert!((heavy.held.input.torque - 0.4 * unit.held.input.torque).abs() < 1e-9);
        assert!((heavy.observe().e_cross - unit.observe().e_cross).abs() < 1e-12);
    }

    #[test]
    fn a_force_at_its_limit_is_known_to_the_law_and_counted() {
        let line = Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        let limits = Limits { force: 0.5, torque: 0.01, ..Limits::NONE };
        let mut craft = robot(line, 0.0, 0.0, 0.0).limited(limits);
        for _ in 0..50 {
            craft.command(REFERENCE, Demand::Forward(-3.0));
            craft.advance(0.02, 1);
        }
        // F/m = −0.1 m/s² for a second.
        assert!((craft.observe().speed + 0.1).abs() < 1e-12);
        assert_eq!((craft.warnings()[0].count, craft.held.input.force), (50, -0.5));
        craft.state.heading = 1.0;
        craft.command(REFERENCE, Demand::Forward(0.0));
        assert_eq!((craft.held.input.force, craft.held.input.torque), (0.0, -0.01));
        assert_eq!((craft.warnings()[0].count, craft.refused()), (51, 0), "a torque counts as well");
        // What the force makes of the speed is what the law reckons with: it steers as if no more had been asked for.
        craft.limits.torque = f64::INFINITY;
        craft.state.speed = 0.4;
        craft.command(REFERENCE, Demand::Forward(-3.0));
        let cut = craft.held.input.torque;
        craft.command(REFERENCE, Demand::Forward(-0.1));
        assert!((cut - craft.held.input.torque).abs() < 1e-12 && cut != 0.0, "{cut} {}", craft.held.input.torque);
        craft.command(REFERENCE, Demand::Forward(0.0));
        assert!((cut - craft.held.input.torque).abs() > 1e-3, "else nothing is tested");
    }

    #[test]
    fn a_robot_is_carried_along_and_stuck_and_mistaken() {
        let mut craft = robot(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 0.0, 0.0, 0.0);
        let errors = InstrumentErrors {
            position: Vector3::new(0.0, 0.5, 0.0),
            velocity: Vector3::new(0.05, 0.0, 0.0),
            ..InstrumentErrors::default()
        };
        let (current, stuck_speed) = (Some(Vector3::new(0.5, -0.3, 0.0)), Some(0.25));
        craft.expose(&Conditions { current, errors: Some(errors), stuck_speed, ..Conditions::default() });
        // The laws see v = 0.3 and a vehicle at the left; the record does not.
        assert!((craft.own(REFERENCE).eta - 0.2).abs() < 1e-15);
        assert_eq!((craft.observe().speed, craft.observe().e_cross), (0.25, 0.0));
        craft.command(REFERENCE, Demand::Acceleration(1.0));
        assert!(craft.held.input.torque < 0.0, "it turns right");
        craft.advance(0.02, 1);
        let seen = craft.observe();
        assert!((seen.e_cross + 0.006).abs() < 1e-6 && seen.speed == 0.25, "{seen:?}");
        assert!((seen.position[0] - 0.75 * 0.02).abs() < 1e-6 && seen.attitude == [craft.state.heading, 0.0, 0.0]);
    }

    /// V_p of (3.18), with what the law knows of v̇ where the speed is stuck.
    fn v_p(craft: &RobotCraft) -> f64 {
        let State { speed: v, turn_rate: r, .. } = craft.state;
        let e = craft.errors(&craft.state);
        let motion = Motion { v, r, ..Motion::default() };
        let steering = craft.law.steer(&e, &motion, &Bend::of(&craft.target), craft.sense);
        0.5 * (e.x_e.powi(2) + e.y_e.powi(2) + (e.psi_e - steering.sigma).powi(2) + (r - steering.phi).powi(2))
    }

    #[test]
    fn a_robot_whose_speed_is_stuck_stays_on_its_path_whatever_is_commanded() {
        let stuck = Conditions { stuck_speed: Some(0.25), ..Conditions::default() };
        for demand in [-0.8, 0.0, 0.5] {
            let mut craft =
                robot(Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap(), 2.0, 0.0, FRAC_PI_2);
            (craft.state.speed, craft.state.turn_rate) = (0.25, 0.125);
            for _ in 0..2000 {
                craft.expose(&stuck);
                craft.command(REFERENCE, Demand::Acceleration(demand));
                craft.advance(0.02, 2);
                let seen = craft.observe();
                assert!(seen.e_cross.abs() < 1e-9 && seen.speed == 0.25, "{demand}: {seen:?}");
            }
        }
    }

    #[test]
    fn v_p_falls_while_the_speed_is_stuck() {
        let stuck = Conditions { stuck_speed: Some(0.25), ..Conditions::default() };
        let mut craft = robot(Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap(), 0.1, 0.6, 0.2);
        craft.expose(&stuck);
        let (start, mut before) = (v_p(&craft), f64::INFINITY);
        for step in 0..10_000 {
            craft.expose(&stuck);
            craft.command(REFERENCE, Demand::Acceleration(0.4 * (0.01 * f64::from(step)).sin()));
            let now = v_p(&craft);
            assert!(now < before + 1e-9, "{step}: {before} {now}");
            before = now;
            craft.advance(0.002, 1);
        }
        assert!(before < 1e-3 * start, "{start} {before}");
    }

    #[test]
    fn what_is_no_number_is_refused_and_counted() {
        let line = || Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        let mut craft = robot(line(), 0.0, 0.5, 0.0);
        craft.command(REFERENCE, Demand::Acceleration(0.2));
        let held = (craft.held.input, craft.sense);
        // The last one's force is beyond the numbers; one is of the other kind.
        for demand in
            [Demand::Acceleration(f64::NAN), Demand::Forward(f64::INFINITY), Demand::Rate(1.0), Demand::Forward(1e308)]
        {
            craft.command(REFERENCE, demand);
            assert!((craft.held.input, craft.sense) == held && craft.is_sound(), "{demand:?}");
        }
        craft.command(SpeedReference { v_l: f64::NAN, v_l_dot: 0.0 }, Demand::Acceleration(0.1));
        let errors = InstrumentErrors { heading: f64::NAN, ..InstrumentErrors::default() };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        craft.command(REFERENCE, Demand::Acceleration(0.1));
        assert!((craft.held.input, craft.sense) == held && craft.is_sound());
        assert_eq!(craft.warnings()[1], Warning { what: REFUSED, count: 6 });
        assert_eq!(craft.refused(), 6);
    }

    #[test]
    fn a_demand_of_the_other_kind_is_ignored() {
        let line = || Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        let mut craft = robot(line(), 0.0, 0.5, 0.0);
        assert_eq!(craft.takes(), DemandKind::Acceleration);
        craft.command(REFERENCE, Demand::Acceleration(0.2));
        let held = craft.held.input;
        craft.command(REFERENCE, Demand::Rate(3.0));
        assert_eq!(craft.held.input, held);
        let craft = robot_with(line(), SpeedLoop::Rate { k_0: 1.0 }, Gains::default(), 0.0, 0.5, 0.0);
        assert_eq!((craft.takes(), craft.own(REFERENCE).eta), (DemandKind::Rate, 0.0));
    }

    #[test]
    fn what_is_seen_of_it_is_where_it_is() {
        let mut craft = robot(Line::new(Vector3::new(0.0, 0.0, -3.0), 0.0, 2.0).unwrap(), 1.0, 0.5, 0.25);
        craft.place_target(2.0);
        let seen = craft.observe();
        assert_eq!((seen.position, seen.attitude, seen.psi_e), ([1.0, 0.5, -3.0], [0.25, 0.0, 0.0], 0.25));
        assert_eq!((seen.e_along, seen.e_cross, seen.e_norm), (-3.0, 0.5, 3f64.hypot(0.5)));
    }

    #[test]
    fn the_target_can_be_placed() {
        let mut craft = robot(Line::new(Vector3::zeros(), 0.0, 2.0).unwrap(), 1.0, 0.5, 0.0);
        craft.place_target(3.0);
        let seen = craft.observe();
        assert!((seen.xi, seen.e_along) == (3.0, -5.0) && (seen.e_cross - 0.5).abs() < 1e-15);
    }

    #[test]
    fn paths_that_a_robot_cannot_follow_are_refused() {
        let refusal = |path: Arc<dyn Path>| {
            let law = Proposition31::new(Gains::default()).unwrap();
            RobotCraft::new(path, law, SpeedLoop::Acceleration, PARAMETERS, State::default(), 0.0).unwrap_err()
        };
        assert!(refusal(Arc::new(Helix::new(2.0, 10.0, 0.0, 0.1, 0.0).unwrap())).contains("plane"));
        let line = Segment::Line { length: 1.0, xi_length: 1.0 };
        let corner = Chain::new(Vector3::zeros(), 0.0, &[line, Segment::Corner { angle: 1.0 }, line]).unwrap();
        assert!(refusal(Arc::new(corner)).contains("xi = 1"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn turning_and_moving_the_world_changes_nothing(turn in -PI..PI, east in -9.0..9.0f64, north in -9.0..9.0f64) {
            let circle = |x, y, angle| Circle::new(Vector3::new(x, y, 0.0), 2.0, Turn::Left, angle, 1.0).unwrap();
            let (sin, cos) = turn.sin_cos();
            let here = alone(robot(circle(0.0, 0.0, 0.0), 2.5, 1.0, 0.4), 10.0).observe();
            let (x, y) = (east + 2.5 * cos - sin, north + 2.5 * sin + cos);
            let there = alone(robot(circle(east, north, turn), x, y, 0.4 + turn), 10.0).observe();
            prop_assert!((here.e_cross - there.e_cross).abs() < 1e-8 && (here.psi_e - there.psi_e).abs() < 1e-8);
            prop_assert!((here.xi - there.xi).abs() < 1e-8 && (here.speed - there.speed).abs() < 1e-12);
        }
    }
}
