//! A fully actuated marine vehicle in the plane that follows a virtual target with a commanded side-slip: Proposition 3.3.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::SVector;

use super::speed_loop::SpeedLoop;
use super::{Craft, Limits, Observation, REFUSED, SATURATED, SINGULAR, Warning, check_plane, limited};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::proposition_3_1::{Bend, Errors, Motion, Sense};
use crate::following::proposition_3_3::{Proposition33, WantedSlip};
use crate::path::{Path, PathPoint};
use crate::positive::{finite, positive};
use crate::time::Time;
use crate::vehicle::environment::Conditions;
use crate::vehicle::integrate::advance;
use crate::vehicle::marine::{Flow, Input, Parameters, State, model};

/// The total speed below which a vehicle has no side-slip of its own \[m/s\] (erratum 3.5).
pub const SLOWEST: f64 = 0.01;

/// β_d(t) = mean + amplitude sin(2π t/T).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideSlip {
    /// Mean \[rad\].
    pub mean: f64,
    /// Amplitude \[rad\].
    pub amplitude: f64,
    /// T \[s\], positive.
    pub period: f64,
}

impl SideSlip {
    /// None at all: the bow along the path.
    pub const NONE: SideSlip = SideSlip { mean: 0.0, amplitude: 0.0, period: 1.0 };

    /// The side-slip if it is one, otherwise what is wrong with it.
    pub fn checked(self) -> Result<SideSlip, String> {
        finite("the side-slip", self.mean)?;
        finite("the amplitude of the side-slip", self.amplitude)?;
        positive("the period of the side-slip", self.period)?;
        Ok(self)
    }

    fn at(&self, now: Time) -> WantedSlip {
        let w = TAU / self.period;
        let (sin, cos) = (w * now.secs()).sin_cos();
        let a = self.amplitude;
        WantedSlip { beta: self.mean + a * sin, beta_dot: a * w * cos, beta_ddot: -a * w * w * sin }
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
        let Held { input: Input { surge, sway, torque }, xi_rate, v_ref } = *self;
        [surge, sway, torque, xi_rate, v_ref].iter().all(|x| x.is_finite())
    }
}

/// v̇_t where the surge speed does not change and the sway force alone makes β̇: v̇_t = v_t β̇ tan β, from u̇ = 0 in
/// (3.25). Across the bow, where sway cannot turn the flow, it is less than that and bounded.
fn surge_held(v_t: f64, beta: f64, beta_dot: f64) -> f64 {
    let (sin, cos) = beta.sin_cos();
    v_t * beta_dot * sin * cos / (cos * cos).max(0.01)
}

/// A fully actuated marine vehicle under Proposition 3.3.
#[derive(Debug)]
pub struct MarineCraft {
    path: Arc<dyn Path>,
    law: Proposition33,
    speed_loop: SpeedLoop,
    side_slip: SideSlip,
    parameters: Parameters,
    state: State,
    xi: f64,
    target: PathPoint,
    sense: Sense,
    held: Held,
    limits: Limits,
    conditions: Conditions,
    saturated: u64,
    singular: u64,
    refused: u64,
}

impl MarineCraft {
    /// The vehicle in `state` with its virtual target at `xi`. The path must lie in a horizontal plane and have no
    /// corners.
    pub fn new(
        path: Arc<dyn Path>,
        law: Proposition33,
        speed_loop: SpeedLoop,
        side_slip: SideSlip,
        parameters: Parameters,
        state: State,
        xi: f64,
    ) -> Result<MarineCraft, String> {
        check_plane(&*path, "a marine vehicle")?;
        state.to_vector().iter().try_for_each(|&x| finite("the vehicle's state", x).map(drop))?;
        let target = path.at(finite("the vehicle's xi", xi)?);
        Ok(MarineCraft {
            path,
            law,
            speed_loop: speed_loop.checked()?,
            side_slip: side_slip.checked()?,
            parameters: parameters.checked()?,
            state,
            xi,
            target,
            sense: Sense::default(),
            held: Held::default(),
            limits: Limits::NONE,
            conditions: Conditions::default(),
            saturated: 0,
            singular: 0,
            refused: 0,
        })
    }

    /// The vehicle with forces and a torque that it cannot exceed.
    pub fn limited(mut self, limits: Limits) -> MarineCraft {
        self.limits = limits;
        self
    }

    /// Its state as its instruments tell it.
    fn measured(&self) -> State {
        let Some(errors) = self.conditions.errors else { return self.state };
        State {
            x: self.state.x + errors.position.x,
            y: self.state.y + errors.position.y,
            heading: self.state.heading + errors.heading,
            surge: self.state.surge + errors.velocity.x,
            sway: self.state.sway + errors.velocity.y,
            turn_rate: self.state.turn_rate + errors.spin.z,
        }
    }

    fn wanted(&self) -> WantedSlip {
        self.side_slip.at(self.conditions.now)
    }

    fn flow(&self, state: &State) -> Flow {
        Flow::of(state.surge, state.sway, self.wanted().beta, SLOWEST)
    }

    /// The errors of the flow frame: ψ_e = ψ_B + β − ψ_T (3.27).
    fn errors(&self, state: &State, flow: &Flow) -> Errors {
        Errors::of(&self.target, state.x, state.y, state.heading + flow.beta)
    }

    fn move_target(&mut self, xi: f64) {
        self.xi = xi;
        self.target = self.path.at(xi);
    }
}

impl Craft for MarineCraft {
    fn takes(&self) -> DemandKind {
        self.speed_loop.takes()
    }

    /// The engine keeps its stuck surge speed at once; the sway force still works.
    fn expose(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        if let Some(speed) = conditions.stuck_speed {
            self.state.surge = speed;
        }
    }

    /// With η = v_t − R v_L (3.38), or zero for a vehicle that takes a rate.
    fn own(&self, reference: SpeedReference) -> Own {
        let (r, state) = (self.target.r(), self.measured());
        let flow = self.flow(&state);
        let eta = self.speed_loop.eta(flow.v_t, r, reference);
        let xi_rate = self.law.target_speed(&self.errors(&state, &flow), flow.v_t) / r;
        let r_dot = self.target.dr_dxi() * xi_rate;
        Own { xi: self.xi, eta, r, v: flow.v_t, r_dot, ..Own::default() }
    }

    /// Where forces are at their limits or the surge speed is stuck, the law knows what becomes of v_t. What a sway force at
    /// its limit makes of β̇ it does not know: β̈ would depend on the ṙ that it is about to choose.
    fn command(&mut self, reference: SpeedReference, demand: Demand) {
        let (state, p) = (self.measured(), self.parameters);
        let flow = self.flow(&state);
        let Flow { v_t, beta, is_singular } = flow;
        let e = self.errors(&state, &flow);
        // ξ̇ = ṡ/R with (3.32)
        let xi_rate = self.law.target_speed(&e, v_t) / self.target.r();
        let Some(answer) = self.speed_loop.answer(demand, reference, &self.target, v_t, xi_rate) else {
            self.refused += 1;
            return;
        };
        let sense = self.law.sense(self.sense, v_t, answer.wanted);

        // τ_vt = v̇_t − f_vt, τ_β = β̇ − f_β
        let (slip, r) = (self.law.slip(beta, &self.wanted()), state.turn_rate);
        let is_stuck = self.conditions.stuck_speed.is_some();
        let v_dot = if is_stuck { surge_held(v_t, beta, slip.beta_dot) } else { answer.v_dot };
        let tau_beta = slip.beta_dot - p.f_beta(beta, r);
        let [surge, sway] = p.forces(v_t, beta, v_dot - p.f_vt(v_t, beta, r), tau_beta);
        let ((surge, cut), (sway, cut_too)) = (limited(surge, self.limits.force), limited(sway, self.limits.force));
        let v_dot = match (is_stuck, cut, cut_too) {
            (true, _, true) => beta.sin() * (sway - p.m_u * state.surge * r - p.d_v * state.sway) / p.m_v,
            (false, true, _) | (false, _, true) => {
                p.f_vt(v_t, beta, r) + beta.cos() / p.m_u * surge + beta.sin() / p.m_v * sway
            }
            _ => v_dot,
        };
        let steering = self.law.steer(&e, &Motion { v: v_t, v_dot, r, slip }, &Bend::of(&self.target), sense);
        // (3.31)
        let (torque, cut_torque) = limited(p.m_r * (steering.r_dot - p.f_r(v_t, beta, r)), self.limits.torque);
        let held = Held { input: Input { surge, sway, torque }, xi_rate, v_ref: answer.v_ref };
        if !(held.is_finite() && answer.v_dot.is_finite() && steering.r_dot.is_finite()) {
            self.refused += 1;
            return;
        }
        self.singular += u64::from(is_singular);
        self.saturated += u64::from(cut || cut_too || cut_torque);
        (self.sense, self.held) = (sense, held);
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        let is_stuck = self.conditions.stuck_speed.is_some();
        let held_surge = |t: f64, x: &SVector<f64, 6>, tau: &Input, p: &Parameters| {
            let mut rate = model(t, x, tau, p);
            if is_stuck {
                rate[3] = 0.0;
            }
            rate
        };
        let state = self.state.to_vector();
        self.state = State::from_vector(advance(held_surge, &state, &self.held.input, &self.parameters, dt, substeps));
        if let Some(drift) = self.conditions.drift(dt) {
            self.state.x += drift.x;
            self.state.y += drift.y;
        }
        self.move_target(self.xi + self.held.xi_rate * dt);
    }

    /// The speed is v_t, and ψ_e that of the flow frame.
    fn observe(&self) -> Observation {
        let flow = self.flow(&self.state);
        let e = self.errors(&self.state, &flow);
        Observation {
            xi: self.xi,
            xi_rate: self.held.xi_rate,
            v_ref: self.held.v_ref,
            position: [self.state.x, self.state.y, self.target.p.z],
            attitude: [self.state.heading, 0.0, 0.0],
            speed: flow.v_t,
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
        let counts = [(SATURATED, self.saturated), (SINGULAR, self.singular), (REFUSED, self.refused)];
        counts.map(|(what, count)| Warning { what, count }).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;
    use crate::following::proposition_3_1::Gains;
    use crate::path::circle::{Circle, Turn};
    use crate::path::helix::Helix;
    use crate::path::line::Line;
    use crate::path::sinusoid::Sinusoid;
    use crate::vehicle::environment::InstrumentErrors;

    const REFERENCE: SpeedReference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
    const PARAMETERS: Parameters =
        Parameters { m_u: 500.0, m_v: 1000.0, m_r: 700.0, d_u: 100.0, d_v: 300.0, d_r: 400.0 };
    const WEAVING: SideSlip = SideSlip { mean: 0.2, amplitude: 0.3, period: 31.4 };

    fn craft(path: impl Path + 'static, side_slip: SideSlip, state: State) -> MarineCraft {
        let law = Proposition33::new(Gains::default(), 1.0).unwrap();
        MarineCraft::new(Arc::new(path), law, SpeedLoop::Rate { k_0: 1.0 }, side_slip, PARAMETERS, state, 0.0).unwrap()
    }

    fn circle(turn: Turn) -> Circle {
        Circle::new(Vector3::zeros(), 5.0, turn, 0.0, 1.0).unwrap()
    }

    /// Exposed to still water, at periods of 20 ms from time zero.
    fn fly(craft: &mut MarineCraft, periods: std::ops::Range<usize>) {
        for period in periods {
            let now = Time::from_secs(0.02 * period as f64);
            craft.expose(&Conditions { now, ..craft.conditions });
            craft.command(REFERENCE, Demand::Rate(0.1));
            craft.advance(0.02, 2);
            assert!(craft.is_sound());
        }
    }

    #[test]
    fn it_follows_a_circle_with_the_side_slip_that_is_wanted() {
        let start = State { x: 5.5, y: -0.5, heading: 1.0, surge: 0.3, ..State::default() };
        let mut craft = craft(circle(Turn::Left), WEAVING, start);
        fly(&mut craft, 0..6000);
        let (seen, flow) = (craft.observe(), craft.flow(&craft.state));
        assert!(seen.e_norm < 2e-3 && seen.psi_e.abs() < 5e-3, "{seen:?}");
        assert!((seen.speed - 0.5).abs() < 1e-3 && (flow.beta - craft.wanted().beta).abs() < 2e-3, "{flow:?}");
        assert!(craft.warnings().iter().all(|warning| warning.count == 0));
    }

    #[test]
    fn from_rest_the_side_slip_is_the_wanted_one_and_that_is_counted() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.3, 1.0).unwrap(), WEAVING, State::default());
        fly(&mut craft, 0..4000);
        assert!(craft.observe().e_norm < 1e-3, "{:?}", craft.observe());
        assert!((1..100).contains(&craft.warnings()[1].count), "{:?}", craft.warnings());
    }

    #[test]
    fn the_mirror_image_does_the_mirror_image() {
        let slip = |sign: f64| SideSlip { mean: sign * 0.2, amplitude: sign * 0.3, ..WEAVING };
        let start = |sign: f64| State { x: 5.5, y: sign * -0.5, heading: sign, surge: 0.3, ..State::default() };
        let mut left = craft(circle(Turn::Left), slip(1.0), start(1.0));
        let mut right = craft(circle(Turn::Right), slip(-1.0), start(-1.0));
        for chunk in 0..10 {
            fly(&mut left, chunk * 100..chunk * 100 + 100);
            fly(&mut right, chunk * 100..chunk * 100 + 100);
            let (one, two) = (left.observe(), right.observe());
            assert!((one.e_cross + two.e_cross).abs() < 1e-9 && (one.psi_e + two.psi_e).abs() < 1e-9);
            assert!((one.xi - two.xi).abs() < 1e-9 && (one.speed - two.speed).abs() < 1e-9);
        }
    }

    #[test]
    fn it_takes_accelerations_and_eta_is_of_the_total_speed() {
        let law = Proposition33::new(Gains::default(), 1.0).unwrap();
        let state = State { surge: 0.3, sway: 0.4, ..State::default() };
        let line = Arc::new(Line::new(Vector3::zeros(), 0.0, 2.0).unwrap());
        let mut craft =
            MarineCraft::new(line, law, SpeedLoop::Acceleration, SideSlip::NONE, PARAMETERS, state, 0.0).unwrap();
        assert_eq!(craft.takes(), DemandKind::Acceleration);
        let eta = craft.own(REFERENCE).eta;
        assert!((eta - 0.3).abs() < 1e-15);
        craft.command(REFERENCE, Demand::Acceleration(0.2));
        craft.advance(1e-5, 1);
        assert!(((craft.own(REFERENCE).eta - eta) / 1e-5 - 0.2).abs() < 1e-4);
    }

    #[test]
    fn limits_disturbances_and_paths_in_space() {
        let line = || Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        let mut weak =
            craft(line(), SideSlip::NONE, State::default()).limited(Limits { force: 1.0, torque: 1.0, ..Limits::NONE });
        fly(&mut weak, 0..50);
        assert!(weak.warnings()[0].count > 0 && weak.observe().speed < 0.01);
        // One effort at its limit is enough to be counted, whichever.
        for (force, torque) in [(f64::INFINITY, 1.0), (10.0, f64::INFINITY)] {
            let start = State { x: 5.0, surge: 0.4, sway: 0.1, heading: FRAC_PI_2, ..State::default() };
            let mut weak = craft(circle(Turn::Left), WEAVING, start).limited(Limits { force, torque, ..Limits::NONE });
            // What is wanted is the speed it has, so that the surge force is small and the sway force is not.
            weak.command(REFERENCE, Demand::Rate(start.surge.hypot(start.sway) / 5.0));
            assert_eq!(weak.warnings()[0].count, 1, "{:?}", weak.held.input);
        }
        let mut adrift = craft(line(), SideSlip::NONE, State::default());
        let errors = InstrumentErrors { position: Vector3::y(), ..InstrumentErrors::default() };
        adrift.conditions = Conditions {
            current: Some(Vector3::new(-3.0, 1.0, 0.0)),
            errors: Some(errors),
            stuck_speed: Some(0.2),
            ..adrift.conditions
        };
        fly(&mut adrift, 0..1);
        let seen = adrift.observe();
        assert!((seen.e_cross - 0.02).abs() < 1e-6 && adrift.state.surge == 0.2, "{seen:?}");
        assert!((seen.position[0] - (0.2 - 3.0) * 0.02).abs() < 1e-6, "{seen:?}");
        assert_eq!(seen.attitude, [adrift.state.heading, 0.0, 0.0]);
        assert!(adrift.held.input.torque < 0.0, "it thinks that it is to the left");
        let law = Proposition33::new(Gains::default(), 1.0).unwrap();
        let helix = Arc::new(Helix::new(5.0, 9.0, 0.0, 0.1, 0.0).unwrap());
        let refused =
            MarineCraft::new(helix, law, SpeedLoop::Acceleration, SideSlip::NONE, PARAMETERS, State::default(), 0.0);
        assert!(refused.unwrap_err().contains("plane"));
    }

    /// V_p of (3.18) in the flow frame, for a surge speed that is stuck.
    fn v_p(craft: &MarineCraft) -> f64 {
        let (flow, r) = (craft.flow(&craft.state), craft.state.turn_rate);
        let e = craft.errors(&craft.state, &flow);
        let slip = craft.law.slip(flow.beta, &craft.wanted());
        let motion = Motion { v: flow.v_t, v_dot: surge_held(flow.v_t, flow.beta, slip.beta_dot), r, slip };
        let steering = craft.law.steer(&e, &motion, &Bend::of(&craft.target), craft.sense);
        0.5 * (e.x_e.powi(2) + e.y_e.powi(2) + (e.psi_e - steering.sigma).powi(2) + (r - steering.phi).powi(2))
    }

    /// One period of `dt` with the surge stuck at 0.4 m/s and `rate` commanded.
    fn stuck(craft: &mut MarineCraft, step: usize, dt: f64, rate: f64) {
        let now = Time::from_secs(dt * step as f64);
        craft.expose(&Conditions { now, stuck_speed: Some(0.4), ..craft.conditions });
        craft.command(REFERENCE, Demand::Rate(rate));
        craft.advance(dt, 1);
        assert!(craft.is_sound() && craft.state.surge == 0.4);
    }

    #[test]
    fn a_vehicle_whose_surge_is_stuck_stays_on_its_path_whatever_is_commanded() {
        for (rate, side_slip) in [(-0.3, SideSlip::NONE), (0.1, WEAVING), (0.4, WEAVING)] {
            let mut craft = craft(circle(Turn::Left), side_slip, State { x: 5.0, surge: 0.4, ..State::default() });
            let wanted = craft.wanted();
            craft.state.sway = 0.4 * wanted.beta.tan();
            craft.state.heading = FRAC_PI_2 - wanted.beta;
            craft.state.turn_rate = 0.4 / wanted.beta.cos() / 5.0 - wanted.beta_dot;
            for step in 0..15_000 {
                stuck(&mut craft, step, 0.002, rate);
                let (seen, flow) = (craft.observe(), craft.flow(&craft.state));
                assert!(seen.e_cross.abs() < 1e-4, "{rate} {step}: {seen:?}");
                assert!((flow.beta - craft.wanted().beta).abs() < 1e-3, "{rate} {step}: {flow:?}");
            }
        }
    }

    #[test]
    fn v_p_falls_while_the_surge_is_stuck() {
        let start = State { x: 5.6, y: -0.5, heading: 1.0, surge: 0.4, ..State::default() };
        let mut craft = craft(circle(Turn::Left), WEAVING, start);
        let (start, mut before) = (v_p(&craft), f64::INFINITY);
        for step in 0..20_000 {
            stuck(&mut craft, step, 0.001, 0.1 + 0.2 * (0.003 * step as f64).sin());
            let now = v_p(&craft);
            assert!(now < before + 1e-9, "{step}: {before} {now}");
            before = now;
        }
        assert!(before < 1e-3 * start, "{start} {before}");
    }

    #[test]
    fn v_t_moves_as_the_law_is_told_where_the_surge_is_stuck_and_the_sway_force_is_limited() {
        for force in [f64::INFINITY, 40.0] {
            let state = State { surge: 0.4, sway: 0.1, turn_rate: 0.1, ..State::default() };
            let mut craft = craft(circle(Turn::Left), WEAVING, state).limited(Limits { force, ..Limits::NONE });
            craft.expose(&Conditions { stuck_speed: Some(0.4), ..Conditions::default() });
            let before = craft.flow(&craft.state);
            craft.command(REFERENCE, Demand::Rate(0.1));
            assert_eq!(craft.held.input.sway.abs() == 40.0, force == 40.0);
            craft.advance(1e-6, 1);
            let after = craft.flow(&craft.state);
            let [v_dot, beta_dot] = [(after.v_t - before.v_t) / 1e-6, (after.beta - before.beta) / 1e-6];
            assert!((v_dot - before.v_t * before.beta.tan() * beta_dot).abs() < 1e-6, "u does not change");
            let slip = craft.law.slip(before.beta, &craft.wanted());
            assert_eq!((beta_dot - slip.beta_dot).abs() < 1e-5, force > 40.0, "{beta_dot} {slip:?}");
        }
        // Across the bow nothing is singular.
        for beta in [0.5 * PI, 1.5, -1.6] {
            assert!(surge_held(0.5, beta, 0.1).abs() < 0.5, "{beta}");
        }
    }

    #[test]
    fn the_law_steers_with_what_limited_forces_make_of_v_t() {
        // Neither, the surge force, or both cut; or the surge stuck and the sway force cut.
        for (force, stuck_speed, cut) in [
            (f64::INFINITY, None, [false, false]),
            (30.0, None, [true, false]),
            (10.0, None, [true, true]),
            (10.0, Some(0.4), [true, true]),
        ] {
            let state = State { x: 5.2, y: 0.3, heading: 1.2, surge: 0.4, sway: 0.1, turn_rate: 0.1 };
            let mut craft = craft(circle(Turn::Left), WEAVING, state).limited(Limits { force, ..Limits::NONE });
            craft.expose(&Conditions { stuck_speed, ..Conditions::default() });
            craft.command(REFERENCE, Demand::Rate(0.05));
            let input = craft.held.input;
            assert_eq!([input.surge.abs() == force, input.sway.abs() == force], cut, "{input:?}");
            // v̇_t by the equations of motion.
            let held = |t: f64, x: &SVector<f64, 6>, tau: &Input, p: &Parameters| {
                let mut rate = model(t, x, tau, p);
                rate[3] = if stuck_speed.is_some() { 0.0 } else { rate[3] };
                rate
            };
            let v_t = |dt: f64| {
                craft.flow(&State::from_vector(advance(held, &state.to_vector(), &input, &PARAMETERS, dt, 1))).v_t
            };
            let v_dot = (v_t(1e-5) - v_t(-1e-5)) / 2e-5;
            let (flow, r) = (craft.flow(&state), state.turn_rate);
            let slip = craft.law.slip(flow.beta, &craft.wanted());
            let motion = Motion { v: flow.v_t, v_dot, r, slip };
            let e = craft.errors(&state, &flow);
            let steered = |motion: &Motion| {
                let steering = craft.law.steer(&e, motion, &Bend::of(&craft.target), craft.sense);
                PARAMETERS.m_r * (steering.r_dot - PARAMETERS.f_r(flow.v_t, flow.beta, r))
            };
            assert!(
                (input.torque - steered(&motion)).abs() < 1e-5 * input.torque.abs(),
                "{force} {input:?} {}",
                steered(&motion)
            );
            let other = Motion { v_dot: v_dot + 0.01, ..motion };
            assert!((input.torque - steered(&other)).abs() > 1e-3 * input.torque.abs(), "else nothing is tested");
        }
    }

    #[test]
    fn what_is_measured_is_the_state_with_every_error() {
        let state = State { x: 1.0, y: 2.0, heading: 0.3, surge: 0.4, sway: 0.2, turn_rate: 0.5 };
        let mut craft = craft(circle(Turn::Left), WEAVING, state);
        let errors = InstrumentErrors {
            position: Vector3::new(0.125, 0.25, 9.0),
            heading: 0.0625,
            velocity: Vector3::new(0.5, 0.375, 9.0),
            spin: Vector3::new(9.0, 9.0, 0.75),
        };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        let wanted = State { x: 1.125, y: 2.25, heading: 0.3625, surge: 0.9, sway: 0.575, turn_rate: 1.25 };
        assert!((craft.measured().to_vector() - wanted.to_vector()).norm() < 1e-15);
    }

    #[test]
    fn what_is_seen_of_it_is_where_it_is() {
        let line = Line::new(Vector3::new(0.0, 0.0, -3.0), 0.0, 2.0).unwrap();
        let state = State { x: 1.0, y: 0.5, heading: 0.25, surge: 0.3, sway: 0.4, turn_rate: 0.0 };
        let mut craft = craft(line, WEAVING, state);
        craft.place_target(2.0);
        let seen = craft.observe();
        assert_eq!((seen.position, seen.attitude), ([1.0, 0.5, -3.0], [0.25, 0.0, 0.0]));
        assert_eq!((seen.e_along, seen.e_cross, seen.e_norm), (-3.0, 0.5, 3f64.hypot(0.5)));
        // The flow comes from where it goes.
        assert!((seen.speed - 0.5).abs() < 1e-15 && (seen.psi_e - 0.25 - 0.4f64.atan2(0.3)).abs() < 1e-15, "{seen:?}");
    }

    #[test]
    fn own_rate_of_r_is_that_of_the_target() {
        let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
        let mut craft = craft(path, WEAVING, State { x: 0.3, y: 0.1, heading: 0.5, surge: 0.4, ..State::default() });
        craft.place_target(0.3);
        let own = craft.own(REFERENCE);
        craft.command(REFERENCE, Demand::Rate(0.1));
        craft.advance(1e-6, 1);
        assert!(((craft.target.r() - own.r) / 1e-6 - own.r_dot).abs() < 1e-5 && own.r_dot.abs() > 0.05, "{own:?}");
    }

    #[test]
    fn a_state_that_is_no_number_is_told_of() {
        let sound = || craft(circle(Turn::Left), WEAVING, State { x: 5.0, ..State::default() });
        let mut nowhere = sound();
        nowhere.place_target(f64::NAN);
        let mut stuck = sound();
        stuck.expose(&Conditions { stuck_speed: Some(f64::NAN), ..Conditions::default() });
        let mut held = sound();
        held.held.input.sway = f64::NAN;
        assert!(sound().is_sound() && !nowhere.is_sound() && !stuck.is_sound() && !held.is_sound());
    }

    #[test]
    fn what_is_no_number_is_refused_and_counted() {
        let mut craft = craft(circle(Turn::Left), WEAVING, State { x: 5.0, surge: 0.4, ..State::default() });
        craft.command(REFERENCE, Demand::Rate(0.1));
        let held = craft.held.input;
        for demand in [Demand::Rate(f64::NAN), Demand::Rate(1e308), Demand::Acceleration(0.0)] {
            craft.command(REFERENCE, demand);
            assert!(craft.held.input == held && craft.is_sound(), "{demand:?}");
        }
        let errors = InstrumentErrors { spin: Vector3::repeat(f64::NAN), ..InstrumentErrors::default() };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        craft.command(REFERENCE, Demand::Rate(0.1));
        assert!(craft.held.input == held && craft.is_sound());
        assert_eq!(craft.warnings()[2], Warning { what: REFUSED, count: 4 });
        assert_eq!(craft.refused(), 4);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn turning_and_moving_the_world_changes_nothing(turn in -3.0..3.0f64, east in -9.0..9.0f64) {
            let (sin, cos) = turn.sin_cos();
            let make = |x: f64, y: f64, heading: f64, centre: Vector3<f64>, angle: f64| {
                let path = Circle::new(centre, 5.0, Turn::Left, angle, 1.0).unwrap();
                let mut craft = craft(path, WEAVING, State { x, y, heading, surge: 0.3, ..State::default() });
                fly(&mut craft, 0..500);
                craft.observe()
            };
            let here = make(5.5, 1.0, 1.0, Vector3::zeros(), 0.0);
            let there = make(east + 5.5 * cos - sin, 5.5 * sin + cos, 1.0 + turn, Vector3::new(east, 0.0, 0.0), turn);
            prop_assert!((here.e_cross - there.e_cross).abs() < 1e-9 && (here.xi - there.xi).abs() < 1e-9);
            prop_assert!((here.psi_e - there.psi_e).abs() < 1e-9 && (here.speed - there.speed).abs() < 1e-12);
        }
    }
}
