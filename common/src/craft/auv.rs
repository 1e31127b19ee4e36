//! An underactuated vehicle in space under the law of Theorem 4.7, with its path and its virtual target.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{Craft, LIMITED, Observation, REFUSED, SATURATED, Warning};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::theorem_4_7::{TargetMotion, TargetRate, Theorem47};
use crate::path::{Path, PathPoint};
use crate::vehicle::attitude::{from_yaw_pitch_roll, wrap, yaw_pitch_roll};
use crate::vehicle::auv::{AuvInput, AuvState};
use crate::vehicle::environment::Conditions;

/// One vehicle of section 4.6.
#[derive(Debug)]
pub struct AuvCraft {
    law: Theorem47,
    motion: TargetMotion,
    nominal_factor: f64,
    path: Arc<dyn Path>,
    state: AuvState,
    gamma: f64,
    /// The path at `gamma`: evaluated once per control period, where the target stops.
    target: PathPoint,
    /// η of (4.53); zero under type II.
    eta: f64,
    held: Held,
    conditions: Conditions,
    limited: u64,
    saturated: u64,
    refused: u64,
}

/// The output of the law, held over a control period.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    input: AuvInput,
    rate: f64,
    v_ref: f64,
    alpha_2: f64,
}

impl AuvCraft {
    /// A vehicle in `state` whose virtual target starts at `gamma`.
    ///
    /// `nominal_factor` makes the nominal rate out of the formation speed, v_n = factor · v_L: 1, or 1/(1 + k τ)
    /// when a delay τ with the coordination gain k makes the fleet travel at v_L* (erratum 4.3).
    pub fn new(
        law: Theorem47,
        motion: TargetMotion,
        nominal_factor: f64,
        path: Arc<dyn Path>,
        state: AuvState,
        gamma: f64,
    ) -> AuvCraft {
        let target = path.at(gamma);
        let held = Held::default();
        AuvCraft {
            law,
            motion,
            nominal_factor,
            path,
            state,
            gamma,
            target,
            eta: 0.0,
            held,
            conditions: Conditions::default(),
            limited: 0,
            saturated: 0,
            refused: 0,
        }
    }
    /// The plant's state.
    pub fn state(&self) -> &AuvState {
        &self.state
    }
    /// The law with its gains and its plant.
    pub fn law(&self) -> &Theorem47 {
        &self.law
    }
    /// Control periods in which the law limited its divisors: |δ₁| is too small for the speed.
    pub fn limited(&self) -> u64 {
        self.limited
    }
    /// Control periods in which an actuator gave less than the law asked for.
    pub fn saturated(&self) -> u64 {
        self.saturated
    }
    /// Control periods in which the previous command was held because the law had no finite answer, or the demand
    /// was of the wrong kind or not finite.
    pub fn refused(&self) -> u64 {
        self.refused
    }
    /// Its state as its instruments tell it: the heading errs about the vertical.
    fn measured(&self) -> AuvState {
        let Some(errors) = self.conditions.errors else { return self.state };
        AuvState {
            position: self.state.position + errors.position,
            attitude: from_yaw_pitch_roll(errors.heading, 0.0, 0.0) * self.state.attitude,
            velocity: self.state.velocity + errors.velocity,
            spin: self.state.spin + errors.spin,
        }
    }
    /// p − p_d in the inertial frame.
    fn error(&self) -> Vector3<f64> {
        self.state.position - self.target.p
    }
}

impl Craft for AuvCraft {
    fn takes(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn expose(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        if let Some(speed) = conditions.stuck_speed {
            self.state.velocity.x = speed;
        }
    }

    /// With α_2 of the present state, which does not depend on the rate that is yet to be decided.
    fn own(&self, reference: SpeedReference) -> Own {
        let alpha_2 = self.law.alpha_2(&self.measured(), &self.target, self.nominal_factor * reference.v_l);
        Own { xi: self.gamma, eta: 0.0, r: self.target.d1.norm(), alpha_2, ..Own::default() }
    }

    fn command(&mut self, reference: SpeedReference, demand: Demand) {
        let Demand::Rate(v_r) = demand else {
            self.refused += 1;
            return;
        };
        let rate = TargetRate {
            nominal: self.nominal_factor * reference.v_l,
            nominal_dot: self.nominal_factor * reference.v_l_dot,
            actual: v_r + self.eta,
        };
        let answer = self.law.evaluate(&self.measured(), &self.target, rate);
        self.limited += u64::from(answer.limited);
        if answer.input.is_finite() && answer.alpha_2.is_finite() {
            let input = self.law.auv().saturate(&answer.input);
            self.saturated += u64::from(input != answer.input);
            self.held = Held { input, rate: rate.actual, v_ref: v_r, alpha_2: answer.alpha_2 };
        } else {
            self.refused += 1;
        }
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        let substeps = substeps.max(1);
        let h = dt / substeps as f64;
        for _ in 0..substeps {
            self.state = self.law.auv().step(&self.state, &self.held.input, h);
            if let Some(speed) = self.conditions.stuck_speed {
                self.state.velocity.x = speed;
            }
        }
        if let Some(drift) = self.conditions.drift(dt) {
            self.state.position += drift;
        }
        self.gamma += self.held.rate * dt;
        self.target = self.path.at(self.gamma);
        if self.motion == TargetMotion::TypeI {
            self.eta = eta_after(self.eta, self.held.alpha_2, self.law.gains().k_eta, dt);
        }
    }

    fn observe(&self) -> Observation {
        let error = self.error();
        let tangent = self.target.d1.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let e_along = error.dot(&tangent);
        let attitude = yaw_pitch_roll(&self.state.attitude);
        Observation {
            xi: self.gamma,
            xi_rate: self.held.rate,
            v_ref: self.held.v_ref,
            position: self.state.position.into(),
            attitude,
            speed: self.state.velocity.norm(),
            e_along,
            e_cross: (error - tangent * e_along).norm(),
            e_norm: error.norm(),
            psi_e: wrap(attitude[0] - tangent.y.atan2(tangent.x)),
        }
    }

    fn place_target(&mut self, xi: f64) {
        self.gamma = xi;
        self.target = self.path.at(xi);
        self.eta = 0.0;
    }

    fn is_sound(&self) -> bool {
        self.state.is_finite() && self.gamma.is_finite() && self.eta.is_finite()
    }

    fn refused(&self) -> u64 {
        self.refused
    }

    fn warnings(&self) -> Vec<Warning> {
        [(LIMITED, self.limited), (SATURATED, self.saturated), (REFUSED, self.refused)]
            .map(|(what, count)| Warning { what, count })
            .to_vec()
    }
}

/// (4.53): η̇ = −α₂ − k_η η, solved over `dt` for a held α₂.
fn eta_after(eta: f64, alpha_2: f64, k_eta: f64, dt: f64) -> f64 {
    let part = -(-k_eta * dt).exp_m1();
    eta + part * (-alpha_2 / k_eta - eta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::following::theorem_4_7::Gains;
    use crate::following::theorem_4_7::tests::Helix;
    use crate::path::line::Line;
    use crate::vehicle::attitude::from_yaw_pitch_roll;
    use crate::vehicle::environment::InstrumentErrors;
    use crate::vehicle::sirene::sirene;
    use nalgebra::UnitQuaternion;

    const PERIOD: f64 = 0.05;

    /// z₀, initial position and closest γ of the vehicles of section 4.6 (erratum 4.23).
    const FLEET: [(f64, [f64; 3], f64); 3] =
        [(-10.0, [5.0, -10.0, -5.0], 79.517), (-5.0, [5.0, -15.0, 0.0], 70.483), (0.0, [5.0, -20.0, 5.0], 65.596)];

    fn law() -> Theorem47 {
        Theorem47::new(Gains::default(), sirene()).expect("the default gains are valid")
    }

    fn craft(vehicle: usize, motion: TargetMotion, nominal_factor: f64) -> AuvCraft {
        let (z_0, position, gamma) = FLEET[vehicle];
        let state = AuvState::at_rest(position.into(), UnitQuaternion::identity());
        AuvCraft::new(law(), motion, nominal_factor, Arc::new(Helix::section_4_6(z_0)), state, gamma)
    }

    fn fly(craft: &mut AuvCraft, v_l: f64, v_r: f64, seconds: f64) {
        let reference = SpeedReference { v_l, v_l_dot: 0.0 };
        for _ in 0..(seconds / PERIOD).round() as usize {
            craft.command(reference, Demand::Rate(v_r));
            craft.advance(PERIOD, 1);
        }
    }

    #[test]
    fn the_fleet_of_section_4_6_settles_at_the_predicted_bias() {
        // (factor, v_r): the fleet's delayed speed with and without v_L* as the nominal rate, and no delay.
        for (factor, v_r) in [(2.0 / 3.0, 1.0 / 3.0), (1.0, 1.0 / 3.0), (1.0, 0.5)] {
            for vehicle in 0..3 {
                let mut craft = craft(vehicle, TargetMotion::TypeII, factor);
                fly(&mut craft, 0.5, v_r, 800.0);
                let surplus = (v_r - 0.5 * factor) * Helix::stretch();
                let bias = craft.law().gains().predicted_bias_at(craft.law().auv(), surplus);
                let seen = craft.observe();
                assert!((seen.e_norm / bias.abs() - 1.0).abs() < 0.02, "{vehicle} {factor} {v_r}: {seen:?}, {bias}");
                assert!(seen.e_along < 0.0 && seen.e_cross < 0.1 && seen.psi_e.abs() < 0.2, "{seen:?}");
                assert!(seen.attitude[2].abs() < 0.05, "upright: {seen:?}");
                assert!((seen.speed / (v_r * Helix::stretch()) - 1.0).abs() < 0.01);
                assert!(craft.is_sound() && craft.limited() == 0 && craft.refused() == 0);
                assert_eq!(craft.saturated(), 0);
            }
        }
    }

    #[test]
    fn a_target_of_type_1_waits_for_its_vehicle() {
        let mut craft = craft(0, TargetMotion::TypeI, 1.0);
        fly(&mut craft, 0.5, 0.5, 800.0);
        let rate = craft.observe().xi_rate;
        assert!((rate - 0.3897).abs() < 1e-3, "{rate}");
        let predicted = craft.law().gains().predicted_rate_type_1(craft.law().auv(), 0.5, 0.5, Helix::stretch());
        assert!((rate - predicted).abs() < 1e-3, "{rate} {predicted}");
    }

    #[test]
    fn the_error_stays_below_the_bound_of_the_theorem() {
        // With γ̇ = v_n, (4.51) gives d√W₃/dt ≤ −λ √W₃ + |δ|/√2 with λ the smallest of k_e/m, k_φ/m, k_z/J.
        let mut craft = craft(2, TargetMotion::TypeII, 1.0);
        let root = |craft: &AuvCraft| {
            let rate = TargetRate { nominal: 0.5, nominal_dot: 0.0, actual: 0.5 };
            craft.law.lyapunov(&craft.law.evaluate(&craft.state, &craft.target, rate)).sqrt()
        };
        let (start, lambda) = (root(&craft), 0.5 / 7.6);
        let ball = 0.3 / 2f64.sqrt() / lambda;
        for second in 1..200 {
            fly(&mut craft, 0.5, 0.5, 1.0);
            let bound = ball + (start - ball) * (-lambda * f64::from(second)).exp();
            // Holding the command over 50 ms costs a little.
            assert!(root(&craft) < 1.01 * bound, "{second} s: {} {bound}", root(&craft));
        }
    }

    #[test]
    fn the_world_may_be_turned_and_shifted() {
        let (turn, shift) = (2.1, Vector3::new(30.0, -7.0, 12.0));
        let turned = from_yaw_pitch_roll(turn, 0.0, 0.0);
        let start = AuvState::at_rest(Vector3::new(5.0, -10.0, -5.0), from_yaw_pitch_roll(0.3, 0.1, 0.2));
        let moved = AuvState { position: turned * start.position + shift, attitude: turned * start.attitude, ..start };
        let make = |state, turn, shift| {
            AuvCraft::new(law(), TargetMotion::TypeI, 1.0, Arc::new(Helix { turn, shift }), state, 80.0)
        };
        let (mut here, mut there) = (make(start, 0.0, Vector3::zeros()), make(moved, turn, shift));
        fly(&mut here, 0.5, 0.5, 30.0);
        fly(&mut there, 0.5, 0.5, 30.0);
        assert!((there.state.position - (turned * here.state.position + shift)).norm() < 1e-9);
        let (a, b) = (here.observe(), there.observe());
        assert!((a.xi - b.xi).abs() < 1e-9 && (a.e_along - b.e_along).abs() < 1e-9);
        assert!((a.e_cross - b.e_cross).abs() < 1e-9 && (a.psi_e - b.psi_e).abs() < 1e-9);
    }

    #[test]
    fn nothing_but_numbers_comes_out_even_beyond_the_bound_of_delta() {
        // Four times faster than δ allows, tail towards the goal, and then a demand that is no number.
        let mut craft = craft(0, TargetMotion::TypeII, 1.0);
        craft.state.attitude = from_yaw_pitch_roll(-2.5, 0.0, 0.0);
        for _ in 0..400 {
            fly(&mut craft, 6.0, 6.0, PERIOD);
            assert!(craft.is_sound());
        }
        assert!(craft.limited() > 0 && craft.saturated() > 0);
        let refused = craft.refused();
        fly(&mut craft, 0.5, f64::NAN, 1.0);
        craft.command(SpeedReference::default(), Demand::Acceleration(1.0));
        assert_eq!((craft.refused(), Craft::refused(&craft)), (refused + 21, refused + 21));
        let counts: Vec<u64> = craft.warnings().iter().map(|warning| warning.count).collect();
        assert_eq!(counts, [craft.limited(), craft.saturated(), craft.refused()]);
        assert!(craft.is_sound());
    }

    #[test]
    fn a_current_along_a_line_acts_as_a_target_that_is_slower_by_as_much() {
        // ė gains c where a surplus rate of the target takes (γ̇ − v_n)|p'|; on a line nothing else changes.
        for current in [-0.05, 0.05] {
            let line = Line::new(Vector3::zeros(), 0.0, 1.0).expect("a line");
            let state = AuvState::at_rest(Vector3::new(0.0, 1.0, 0.0), UnitQuaternion::identity());
            let mut craft = AuvCraft::new(law(), TargetMotion::TypeII, 1.0, Arc::new(line), state, 0.0);
            let conditions = Conditions { current: Some(Vector3::new(current, 0.0, 0.0)), ..Conditions::default() };
            craft.expose(&conditions);
            fly(&mut craft, 0.15, 0.15, 400.0);
            let bias = craft.law().gains().predicted_bias_at(craft.law().auv(), -current);
            let seen = craft.observe();
            assert!((seen.e_along - bias).abs() < 1e-3 && seen.e_cross < 1e-3, "{current}: {seen:?}, {bias}");
            assert!((seen.speed - (0.15 - current)).abs() < 1e-4, "through the water");
        }
    }

    #[test]
    fn a_stuck_speed_holds_and_errors_do_not_reach_the_record() {
        let mut craft = craft(0, TargetMotion::TypeII, 1.0);
        let (velocity, spin) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.4, 0.5, 0.6));
        let errors = InstrumentErrors { heading: 0.5, position: Vector3::x(), velocity, spin };
        craft.expose(&Conditions { errors: Some(errors), stuck_speed: Some(0.4), ..Conditions::default() });
        let (seen, measured) = (craft.observe(), craft.measured());
        assert_eq!((seen.position[0], seen.attitude[0]), (5.0, 0.0));
        assert!((yaw_pitch_roll(&measured.attitude)[0] - 0.5).abs() < 1e-15 && measured.position.x == 6.0);
        assert_eq!((measured.velocity, measured.spin), (Vector3::new(0.5, 0.2, 0.3), spin));
        // A heading errs about the vertical, whatever the attitude: pitch and roll are as they were.
        craft.state.attitude = from_yaw_pitch_roll(0.25, 0.3, -0.2);
        let [yaw, pitch, roll] = yaw_pitch_roll(&craft.measured().attitude);
        assert!((yaw - 0.75).abs() < 1e-12 && (pitch - 0.3).abs() < 1e-12 && (roll + 0.2).abs() < 1e-12);
        craft.state.attitude = UnitQuaternion::identity();
        fly(&mut craft, 0.5, 0.5, 5.0);
        assert_eq!(craft.state.velocity.x, 0.4);
        assert!(craft.warnings().iter().all(|warning| warning.count == 0), "{:?}", craft.warnings());
    }

    #[test]
    fn errors_are_seen_in_the_frame_of_the_path() {
        // At γ = 150 the phase of the helix is zero: the point is (20, 0, 7.5) and the path runs along +y, climbing.
        let path = Helix::section_4_6(0.0);
        let gamma = 150.0;
        let point = path.at(gamma);
        let tangent = point.d1.normalize();
        let outward = Vector3::x();
        let state = AuvState::at_rest(point.p - tangent * 2.0 + outward * 1.5, from_yaw_pitch_roll(2.0, 0.0, 0.0));
        let craft = AuvCraft::new(law(), TargetMotion::TypeII, 1.0, Arc::new(path), state, gamma);
        let seen = craft.observe();
        assert!((seen.e_along + 2.0).abs() < 1e-12 && (seen.e_cross - 1.5).abs() < 1e-12);
        assert!((seen.e_norm - 2.5).abs() < 1e-12);
        assert!((seen.psi_e - (2.0 - std::f64::consts::FRAC_PI_2)).abs() < 1e-12);
    }

    #[test]
    fn the_target_moves_at_the_held_rate_and_can_be_placed() {
        let mut craft = craft(1, TargetMotion::TypeI, 1.0);
        craft.command(SpeedReference { v_l: 0.5, v_l_dot: 0.0 }, Demand::Rate(0.4));
        craft.advance(0.5, 4);
        assert!((craft.observe().xi - (70.483 + 0.2)).abs() < 1e-12);
        // The same in one step but for rounding and the method; none counts as one.
        let [none, one, four] = [0, 1, 4].map(|substeps| {
            let mut other = self::craft(1, TargetMotion::TypeI, 1.0);
            other.command(SpeedReference { v_l: 0.5, v_l_dot: 0.0 }, Demand::Rate(0.4));
            other.advance(0.1, substeps);
            other.state.position
        });
        assert!(none == one && one != four && (one - four).norm() < 1e-3, "{one} {four}");
        assert!(craft.eta != 0.0);
        craft.place_target(12.0);
        assert_eq!((craft.observe().xi, craft.eta), (12.0, 0.0));
        assert!((craft.own(SpeedReference::default()).r - Helix::stretch()).abs() < 1e-12);
    }

    #[test]
    fn the_speed_error_of_type_1_follows_its_equation() {
        // (4.53) against many small Euler steps.
        let (mut eta, steps) = (0.2, 200_000);
        for _ in 0..steps {
            eta += (-0.7 - 1.3 * eta) * (2.0 / f64::from(steps));
        }
        assert!((eta_after(0.2, 0.7, 1.3, 2.0) - eta).abs() < 1e-5);
        assert!((eta_after(0.2, 0.7, 1.3, 100.0) + 0.7 / 1.3).abs() < 1e-12);
    }

    #[test]
    fn coordination_is_told_the_alpha_2_of_the_nominal_rate() {
        // v_n is the nominal factor times v_L, for the law as for what is fed back to coordination; and its slope v̇_n likewise.
        let mut craft = craft(0, TargetMotion::TypeII, 2.0 / 3.0);
        fly(&mut craft, 0.6, 0.4, 20.0);
        let expected = craft.law.alpha_2(&craft.state, &craft.target, 0.4);
        let own = craft.own(SpeedReference { v_l: 0.6, v_l_dot: 0.0 });
        assert!((own.alpha_2 - expected).abs() < 1e-12 && (own.eta, own.xi) == (0.0, craft.gamma));
        assert!(
            (craft.law.alpha_2(&craft.state, &craft.target, 0.6) - expected).abs() > 1e-6,
            "else nothing is tested"
        );
        craft.command(SpeedReference { v_l: 0.6, v_l_dot: 0.03 }, Demand::Rate(0.4));
        let rate = TargetRate { nominal: 0.4, nominal_dot: 0.02, actual: 0.4 };
        let wanted = craft.law.evaluate(&craft.state, &craft.target, rate).input;
        let found = craft.held.input;
        let difference = [
            found.thrust - wanted.thrust,
            found.pitch_torque - wanted.pitch_torque,
            found.yaw_torque - wanted.yaw_torque,
        ];
        assert!(difference.iter().all(|x| x.abs() < 1e-9), "{difference:?}");
    }

    #[test]
    fn a_state_that_is_no_number_is_told_of() {
        let sound = || craft(0, TargetMotion::TypeI, 1.0);
        let mut nowhere = sound();
        nowhere.place_target(f64::NAN);
        let mut stuck = sound();
        stuck.expose(&Conditions { stuck_speed: Some(f64::NAN), ..Conditions::default() });
        let mut late = sound();
        late.eta = f64::INFINITY;
        assert!(sound().is_sound() && !nowhere.is_sound() && !stuck.is_sound() && !late.is_sound());
    }
}
