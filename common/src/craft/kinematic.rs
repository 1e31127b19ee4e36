//! The vehicle of section 1.2: a kinematic unicycle on a straight line.
//!
//! Its coordination state is the parameter of its own projection on the line, not of a virtual target that it
//! follows: ẋ_i = v_i + d_i with d_i = v_i (cos ψ_i − 1), and d_i is not neglected here.

use std::sync::Arc;

use nalgebra::Vector2;

use super::{Craft, Limits, Observation, SATURATED, Warning};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::line_of_sight::LineOfSight;
use crate::following::proposition_3_1::Errors;
use crate::path::geometry::wrap_angle;
use crate::path::shape::is_straight;
use crate::path::{Path, PathPoint};
use crate::positive::finite;
use crate::vehicle::environment::Conditions;
use crate::vehicle::integrate::advance;
use crate::vehicle::kinematic_unicycle::{Input, model};

/// A kinematic unicycle that follows a straight line at sight and moves at the rate it is asked for.
///
/// It turns and moves as its instruments tell it: their errors make it miss the commanded heading and speed.
#[derive(Debug)]
pub struct KinematicCraft {
    path: Arc<dyn Path>,
    law: LineOfSight,
    /// The point of the line at its ξ = 0.
    origin: PathPoint,
    position: Vector2<f64>,
    /// What is commanded, and what is done.
    wanted: Input,
    held: Input,
    v_ref: f64,
    limits: Limits,
    conditions: Conditions,
    saturated: u64,
}

impl KinematicCraft {
    /// The craft at rest at (`x`, `y`) \[m\]. The path must be a straight line travelled evenly.
    pub fn new(path: Arc<dyn Path>, law: LineOfSight, x: f64, y: f64) -> Result<KinematicCraft, String> {
        if !is_straight(&*path) {
            return Err("a kinematic vehicle follows straight lines only".to_owned());
        }
        let origin = path.at(0.0);
        if origin.d1.z != 0.0 {
            return Err("a kinematic vehicle follows horizontal lines only".to_owned());
        }
        let position = Vector2::new(finite("the position", x)?, finite("the position", y)?);
        let held = Input { speed: 0.0, heading: origin.heading() };
        let (limits, conditions) = (Limits::NONE, Conditions::default());
        Ok(KinematicCraft {
            path,
            law,
            origin,
            position,
            wanted: held,
            held,
            v_ref: 0.0,
            limits,
            conditions,
            saturated: 0,
        })
    }

    /// The craft with an acceleration and a turning rate that it cannot exceed, which makes a state of its speed
    /// \[m/s\] and its heading \[rad\]: it starts with these. Force and torque are nothing that it knows of.
    pub fn limited(mut self, limits: Limits, speed: f64, heading: f64) -> KinematicCraft {
        self.limits = limits;
        if self.is_limited() {
            self.held = Input { speed, heading };
            self.wanted = self.held;
        }
        self
    }

    fn is_limited(&self) -> bool {
        self.limits.acceleration.is_finite() || self.limits.turn_rate.is_finite()
    }

    /// Where it is as far as it knows.
    fn measured(&self) -> Vector2<f64> {
        self.conditions.errors.map_or(self.position, |errors| self.position + errors.position.xy())
    }

    /// Does at once what can be done at once.
    fn settle(&mut self) {
        if !self.is_limited() {
            self.held = self.wanted;
        }
        if let Some(speed) = self.conditions.stuck_speed {
            self.held.speed = speed;
        }
    }

    /// Comes as close to what is commanded as the limits allow in `dt` seconds; the shorter way round.
    fn slew(&mut self, dt: f64) {
        let Limits { acceleration, turn_rate, .. } = self.limits;
        let turn = wrap_angle(self.wanted.heading - self.held.heading);
        self.held.heading += turn.clamp(-turn_rate * dt, turn_rate * dt);
        if self.conditions.stuck_speed.is_none() {
            self.held.speed += (self.wanted.speed - self.held.speed).clamp(-acceleration * dt, acceleration * dt);
        }
    }

    /// ξ of the projection of a position on the line: (p − p(0))ᵀ t / R.
    fn xi(&self, position: Vector2<f64>) -> f64 {
        (position - self.origin.p.xy()).dot(&self.origin.planar_tangent()) / self.origin.r()
    }

    /// ξ̇ = v cos ψ / R, which is (v + d)/R.
    fn xi_rate(&self) -> f64 {
        self.held.speed * (self.held.heading - self.origin.heading()).cos() / self.origin.r()
    }

    fn errors(&self, position: Vector2<f64>) -> Errors {
        Errors::of(&self.path.at(self.xi(position)), position.x, position.y, self.held.heading)
    }
}

impl Craft for KinematicCraft {
    fn takes(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn expose(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        self.settle();
    }

    fn own(&self, _: SpeedReference) -> Own {
        Own { xi: self.xi(self.measured()), eta: 0.0, r: self.origin.r(), ..Own::default() }
    }

    /// v = R v_r, and the heading of (1.4).
    fn command(&mut self, _: SpeedReference, demand: Demand) {
        let Demand::Rate(v_r) = demand else { return };
        let speed = self.origin.r() * v_r;
        let heading = self.origin.heading() + self.law.heading(self.errors(self.measured()).y_e, speed);
        self.wanted = match self.conditions.errors {
            Some(errors) => Input { speed: speed - errors.velocity.x, heading: heading - errors.heading },
            None => Input { speed, heading },
        };
        self.v_ref = v_r;
        self.settle();
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        if self.is_limited() {
            let steps = substeps.max(1);
            for _ in 0..steps {
                self.slew(dt / steps as f64);
                self.position = advance(model, &self.position, &self.held, &(), dt / steps as f64, 1);
            }
            let missed = self.conditions.stuck_speed.is_none() && self.held.speed != self.wanted.speed;
            self.saturated += u64::from(missed || wrap_angle(self.wanted.heading - self.held.heading) != 0.0);
        } else {
            self.position = advance(model, &self.position, &self.held, &(), dt, substeps);
        }
        if let Some(drift) = self.conditions.drift(dt) {
            self.position += drift.xy();
        }
    }

    fn observe(&self) -> Observation {
        let e = self.errors(self.position);
        Observation {
            xi: self.xi(self.position),
            xi_rate: self.xi_rate(),
            v_ref: self.v_ref,
            position: [self.position.x, self.position.y, self.origin.p.z],
            attitude: [self.held.heading, 0.0, 0.0],
            speed: self.held.speed,
            // The target is the projection: there is no error along the line but rounding.
            e_along: 0.0,
            e_cross: e.y_e,
            e_norm: e.y_e.abs(),
            psi_e: e.psi_e,
        }
    }

    /// Nothing to do: the target is the vehicle's own projection, wherever that is.
    fn place_target(&mut self, _xi: f64) {}

    fn is_sound(&self) -> bool {
        self.position.iter().all(|x| x.is_finite()) && self.held.speed.is_finite() && self.held.heading.is_finite()
    }

    fn warnings(&self) -> Vec<Warning> {
        vec![Warning { what: SATURATED, count: self.saturated }]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::KinematicCraft;
    use crate::coordination::introduction_1_5::Introduction;
    use crate::coordination::{CoordinationLaw, Demand, Neighbour, SpeedReference};
    use crate::craft::{Craft, Limits};
    use crate::following::line_of_sight::LineOfSight;
    use crate::path::circle::{Circle, Turn};
    use crate::path::line::Line;
    use crate::path::spline::Spline;
    use crate::vehicle::environment::{Conditions, InstrumentErrors};

    const REFERENCE: SpeedReference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };

    fn craft(line: Line, x: f64, y: f64) -> KinematicCraft {
        KinematicCraft::new(Arc::new(line), LineOfSight::new(1.0).unwrap(), x, y).unwrap()
    }

    /// Figure 1.9: v_L = 0.5, a = 0.2, lines at y = ±2.
    fn figure_1_9(starts: [[f64; 2]; 2], seconds: f64, hears: impl Fn(usize, f64) -> bool) -> [KinematicCraft; 2] {
        let line = |y| Line::new(Vector3::new(0.0, y, 0.0), 0.0, 1.0).unwrap();
        let [one, two] = starts;
        let mut fleet = [craft(line(2.0), one[0], one[1]), craft(line(-2.0), two[0], two[1])];
        let law = Introduction::new(0.2).unwrap();
        for step in 0..(seconds / 0.02).round() as usize {
            let t = 0.02 * step as f64;
            let own = [fleet[0].own(REFERENCE), fleet[1].own(REFERENCE)];
            for i in 0..2 {
                let other = [Neighbour { xi: own[1 - i].xi, scalar: 0.0, ..Neighbour::default() }];
                let heard = if hears(i, t) { &other[..] } else { &[] };
                fleet[i].command(REFERENCE, law.demand(REFERENCE, &own[i], heard));
                fleet[i].advance(0.02, 1);
            }
        }
        fleet
    }

    #[test]
    fn figure_1_9_converges() {
        let fleet = figure_1_9([[0.0, 0.0], [1.5, -0.5]], 40.0, |_, _| true);
        let [one, two] = fleet.map(|craft| craft.observe());
        assert!((one.xi - two.xi).abs() < 1e-5);
        assert!(one.e_cross.abs() < 1e-3 && two.e_cross.abs() < 1e-3);
        assert!((one.speed - 0.5).abs() < 1e-4 && (one.xi_rate - 0.5).abs() < 1e-4);
    }

    #[test]
    fn figure_1_10_decays_at_two_thirds_of_the_gain() {
        // On their lines, so that d = 0: each hears for one second of three (erratum 1.4).
        let hears = |i: usize, t: f64| (t % 3.0) as usize == i;
        let fleet = figure_1_9([[1.0, 2.0], [0.0, -2.0]], 30.0, hears);
        let [one, two] = fleet.map(|craft| craft.observe());
        let rate = -(one.xi - two.xi).ln() / 30.0;
        assert!((rate - 0.2 * 2.0 / 3.0).abs() < 5e-4, "{rate}");
    }

    #[test]
    fn off_the_line_the_projection_is_slower_than_the_vehicle() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.0, 2.0).unwrap(), 0.0, 1.0);
        craft.command(REFERENCE, Demand::Rate(0.5));
        // v = R v_r; at the line-of-sight distance sin ψ = −½, thus ξ̇ = v cos ψ/R.
        let seen = craft.observe();
        assert!((seen.speed - 1.0).abs() < 1e-15 && (seen.xi_rate - 0.5 * 0.75f64.sqrt()).abs() < 1e-15);
        craft.advance(0.1, 3);
        assert!((craft.observe().xi - 0.05 * 0.75f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn backwards_it_also_comes_to_the_line() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.7, 1.0).unwrap(), 0.0, 1.0);
        for _ in 0..2000 {
            craft.command(REFERENCE, Demand::Rate(-0.5));
            craft.advance(0.02, 1);
        }
        let seen = craft.observe();
        assert!(seen.e_cross.abs() < 1e-3 && seen.xi < -10.0, "{seen:?}");
    }

    #[test]
    fn limits_are_of_the_rates_at_which_speed_and_heading_change() {
        // From rest along a line at 0.3 rad, wanting 1 m/s and a quarter turn at most: 0.5 m/s² and 0.2 rad/s, either way.
        let of = |limits, y: f64| {
            let line = Line::new(Vector3::zeros(), 0.3, 2.0).unwrap();
            let (sin, cos) = 0.3f64.sin_cos();
            let mut craft = craft(line, -y * sin, y * cos).limited(limits, 0.0, 0.3);
            craft.command(REFERENCE, Demand::Rate(0.5));
            let before = craft.observe();
            craft.advance(0.4, 4);
            let after = craft.observe();
            (after.speed - before.speed, after.attitude[0] - before.attitude[0], craft.warnings()[0].count)
        };
        let none = Limits::NONE;
        for side in [3.0, -3.0] {
            let (faster, turned, late) = of(Limits { acceleration: 0.5, turn_rate: 0.2, ..none }, side);
            assert!((faster - 0.2).abs() < 1e-12 && (turned + 0.08 * side.signum()).abs() < 1e-12 && late == 1);
        }
        // One limit is enough to be limited, and it does not bind the other.
        let (faster, turned, late) = of(Limits { turn_rate: 0.2, ..none }, 3.0);
        assert!((faster - 1.0).abs() < 1e-12 && (turned + 0.08).abs() < 1e-12 && late == 1, "{faster} {turned}");
        let (faster, turned, late) = of(Limits { acceleration: 0.5, ..none }, 3.0);
        assert!((faster - 0.2).abs() < 1e-12 && turned < -0.5 && late == 1, "{faster} {turned}");
        assert_eq!(of(Limits { acceleration: 99.0, turn_rate: 99.0, ..none }, 3.0).2, 0, "what is reached is not late");
    }

    #[test]
    fn braking_is_limited_as_well_and_the_way_is_that_of_the_substeps() {
        // From 1 m/s along the line at rest: 0.9 m/s after 0.2 s, by steps of 0.05 s at 0.975, 0.95, 0.925 and 0.9 m/s.
        let line = Line::new(Vector3::zeros(), 0.3, 2.0).unwrap();
        let mut craft = craft(line, 0.0, 0.0).limited(Limits { acceleration: 0.5, ..Limits::NONE }, 1.0, 0.3);
        craft.command(REFERENCE, Demand::Rate(0.0));
        craft.advance(0.2, 4);
        let seen = craft.observe();
        assert!((seen.speed - 0.9).abs() < 1e-12 && (seen.xi - 0.05 * 3.75 / 2.0).abs() < 1e-12, "{seen:?}");
        assert!((seen.xi_rate - 0.45).abs() < 1e-12 && seen.attitude == [0.3, 0.0, 0.0], "{seen:?}");
        // No substeps count as one, in which it brakes before it moves.
        craft.advance(0.2, 0);
        assert!((craft.observe().xi - seen.xi - 0.2 * 0.8 / 2.0).abs() < 1e-12);
        // Stuck, a speed that is not the wanted one is nobody's fault.
        craft.expose(&Conditions { stuck_speed: Some(0.8), ..Conditions::default() });
        craft.advance(0.2, 1);
        assert_eq!(craft.warnings()[0].count, 2);
    }

    #[test]
    fn errors_are_made_up_for_as_far_as_they_are_seen() {
        // A speed that is told 0.1 too fast is driven 0.1 too slow; to the right of the line the distance is no less.
        let mut craft = craft(Line::new(Vector3::zeros(), 0.3, 2.0).unwrap(), 0.3, -0.5);
        let errors = InstrumentErrors { velocity: Vector3::new(0.1, 9.0, 9.0), ..InstrumentErrors::default() };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        craft.command(REFERENCE, Demand::Rate(0.5));
        let seen = craft.observe();
        assert!((seen.speed - 0.9).abs() < 1e-12 && seen.e_cross < 0.0 && seen.e_norm == -seen.e_cross, "{seen:?}");
        assert!((seen.xi_rate - 0.45 * (seen.attitude[0] - 0.3).cos()).abs() < 1e-12 && seen.e_along == 0.0);
    }

    #[test]
    fn what_is_seen_of_it_is_where_it_is() {
        let line = Line::new(Vector3::new(0.0, 0.0, -3.0), 0.0, 2.0).unwrap();
        assert_eq!(craft(line, 1.0, 0.5).observe().position, [1.0, 0.5, -3.0]);
        let climbing = Spline::by_length(vec![Vector3::zeros(), Vector3::new(3.0, 0.0, 1.0)], 1.0).unwrap();
        let refused = KinematicCraft::new(Arc::new(climbing), LineOfSight::new(1.0).unwrap(), 0.0, 0.0);
        assert!(refused.unwrap_err().contains("horizontal"));
    }

    #[test]
    fn a_state_that_is_no_number_is_told_of() {
        let sound = || craft(Line::new(Vector3::zeros(), 0.0, 2.0).unwrap(), 0.0, 1.0);
        let mut stuck = sound();
        stuck.expose(&Conditions { stuck_speed: Some(f64::NAN), ..Conditions::default() });
        let mut lost = sound();
        lost.position.y = f64::NAN;
        let mut turned = sound();
        turned.held.heading = f64::INFINITY;
        assert!(sound().is_sound() && !stuck.is_sound() && !lost.is_sound() && !turned.is_sound());
    }

    fn exposed(craft: &mut KinematicCraft, conditions: Conditions, periods: usize) {
        for _ in 0..periods {
            craft.expose(&conditions);
            craft.command(REFERENCE, Demand::Rate(0.5));
            craft.advance(0.02, 1);
        }
    }

    #[test]
    fn a_current_across_the_line_leaves_the_distance_at_which_the_approach_holds_against_it() {
        // v sin ψ + c = 0 with (1.4): y = Δ tan(π c/(2 v)).
        let mut craft = craft(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 0.0, -1.0);
        let conditions = Conditions { current: Some(Vector3::new(0.1, 0.2, 0.0)), ..Conditions::default() };
        exposed(&mut craft, conditions, 5000);
        let (seen, expected) = (craft.observe(), (PI * 0.2).tan());
        assert!((seen.e_cross - expected).abs() < 1e-9, "{seen:?}");
        // Along the line it goes with the water, over the ground.
        let before = seen.xi;
        exposed(&mut craft, conditions, 50);
        assert!((craft.observe().xi - before - (0.5 * 0.84f64.sqrt() + 0.1)).abs() < 1e-9);
        assert_eq!(craft.observe().speed, 0.5);
    }

    #[test]
    fn a_stuck_vehicle_moves_at_its_own_speed_until_the_failure_is_over() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 0.0, 0.0);
        exposed(&mut craft, Conditions { stuck_speed: Some(0.3), ..Conditions::default() }, 50);
        assert!((craft.observe().xi - 0.3).abs() < 1e-12 && craft.observe().speed == 0.3);
        exposed(&mut craft, Conditions::default(), 50);
        assert!((craft.observe().xi - 0.8).abs() < 1e-12);
    }

    #[test]
    fn errors_of_the_instruments_reach_the_law_and_not_the_record() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.0, 2.0).unwrap(), 1.0, 0.5);
        let before = craft.observe();
        let errors = InstrumentErrors { position: Vector3::new(0.4, 0.5, 0.0), heading: 0.1, ..Default::default() };
        craft.expose(&Conditions { errors: Some(errors), ..Conditions::default() });
        assert_eq!(craft.observe(), before);
        assert!((craft.own(REFERENCE).xi - 0.7).abs() < 1e-15);
        craft.command(REFERENCE, Demand::Rate(0.5));
        // It thinks that it is at y = 1 m, where the approach is at 30 degrees, and that its compass is right.
        assert!((craft.observe().psi_e - (-PI / 6.0 - 0.1)).abs() < 1e-15);
    }

    #[test]
    fn limits_make_the_heading_and_the_speed_take_their_time() {
        let line = || Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        let limits = Limits { acceleration: 0.1, turn_rate: 0.5, ..Limits::NONE };
        let mut slow = craft(line(), 0.0, 0.0).limited(limits, 0.0, PI - 0.1);
        exposed(&mut slow, Conditions::default(), 50);
        // A second later, the shorter way round: to the right.
        let seen = slow.observe();
        assert!((seen.speed - 0.1).abs() < 1e-12 && (seen.attitude[0] - (PI - 0.6)).abs() < 1e-12, "{seen:?}");
        assert_eq!(slow.warnings()[0].count, 50);
        exposed(&mut slow, Conditions::default(), 6000);
        assert!(slow.observe().e_cross.abs() < 1e-3 && (slow.observe().speed - 0.5).abs() < 1e-12);
        assert!(slow.warnings()[0].count < 1000);
        // Limits that are never met change nothing.
        let wide = Limits { acceleration: 1e9, turn_rate: 1e9, ..Limits::NONE };
        let (mut one, mut two) = (craft(line(), 0.0, 1.0), craft(line(), 0.0, 1.0).limited(wide, 0.0, 0.0));
        exposed(&mut one, Conditions::default(), 50);
        exposed(&mut two, Conditions::default(), 50);
        assert!((one.observe().e_cross - two.observe().e_cross).abs() < 1e-12 && two.warnings()[0].count == 0);
    }

    #[test]
    fn an_acceleration_is_ignored() {
        let mut craft = craft(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 0.0, 1.0);
        craft.command(REFERENCE, Demand::Rate(0.5));
        let before = craft.observe();
        craft.command(REFERENCE, Demand::Acceleration(3.0));
        assert_eq!(craft.observe(), before);
    }

    #[test]
    fn curves_are_refused() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        assert!(KinematicCraft::new(Arc::new(circle), LineOfSight::new(1.0).unwrap(), 0.0, 0.0).is_err());
        let line = Arc::new(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap());
        assert!(KinematicCraft::new(line, LineOfSight::new(1.0).unwrap(), f64::NAN, 0.0).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn turning_and_moving_the_world_changes_nothing(turn in -PI..PI, east in -50.0..50.0f64, north in -50.0..50.0f64) {
            let mut here = craft(Line::new(Vector3::zeros(), 0.0, 1.0).unwrap(), 1.0, 2.0);
            let (sin, cos) = turn.sin_cos();
            let line = Line::new(Vector3::new(east, north, 0.0), turn, 1.0).unwrap();
            let mut there = craft(line, east + cos - 2.0 * sin, north + sin + 2.0 * cos);
            for _ in 0..100 {
                for craft in [&mut here, &mut there] {
                    craft.command(REFERENCE, Demand::Rate(0.5));
                    craft.advance(0.05, 1);
                }
            }
            let (one, two) = (here.observe(), there.observe());
            prop_assert!((one.xi - two.xi).abs() < 1e-9 && (one.e_cross - two.e_cross).abs() < 1e-9);
            prop_assert!((one.psi_e - two.psi_e).abs() < 1e-9);
        }
    }
}
