//! The vehicle of section 1.2: a kinematic unicycle on a straight line.
//!
//! Its coordination state is the parameter of its own projection on the line, not of a virtual target that it
//! follows: ẋ_i = v_i + d_i with d_i = v_i (cos ψ_i − 1), and d_i is not neglected here.

use std::sync::Arc;

use nalgebra::Vector2;

use super::{Craft, Observation};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::line_of_sight::LineOfSight;
use crate::following::proposition_3_1::Errors;
use crate::path::shape::is_straight;
use crate::path::{Path, PathPoint};
use crate::positive::finite;
use crate::vehicle::integrate::advance;
use crate::vehicle::kinematic_unicycle::{Input, model};

/// A kinematic unicycle that follows a straight line at sight and moves at the rate it is asked for.
#[derive(Debug)]
pub struct KinematicCraft {
    path: Arc<dyn Path>,
    law: LineOfSight,
    /// The point of the line at its ξ = 0.
    origin: PathPoint,
    position: Vector2<f64>,
    held: Input,
    v_ref: f64,
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
        Ok(KinematicCraft { path, law, origin, position, held, v_ref: 0.0 })
    }

    /// ξ of the projection on the line: (p − p(0))ᵀ t / R.
    fn xi(&self) -> f64 {
        (self.position - self.origin.p.xy()).dot(&self.origin.planar_tangent()) / self.origin.r()
    }

    /// ξ̇ = v cos ψ / R, which is (v + d)/R.
    fn xi_rate(&self) -> f64 {
        self.held.speed * (self.held.heading - self.origin.heading()).cos() / self.origin.r()
    }

    fn errors(&self) -> Errors {
        Errors::of(&self.path.at(self.xi()), self.position.x, self.position.y, self.held.heading)
    }
}

impl Craft for KinematicCraft {
    fn takes(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn own(&self, _: SpeedReference) -> Own {
        Own { xi: self.xi(), eta: 0.0, r: self.origin.r(), ..Own::default() }
    }

    /// v = R v_r, and the heading of (1.4).
    fn command(&mut self, _: SpeedReference, demand: Demand) {
        let Demand::Rate(v_r) = demand else { return };
        let speed = self.origin.r() * v_r;
        let heading = self.origin.heading() + self.law.heading(self.errors().y_e, speed);
        self.held = Input { speed, heading };
        self.v_ref = v_r;
    }

    fn advance(&mut self, dt: f64, substeps: usize) {
        self.position = advance(model, &self.position, &self.held, &(), dt, substeps);
    }

    fn observe(&self) -> Observation {
        let e = self.errors();
        Observation {
            xi: self.xi(),
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
    use crate::craft::Craft;
    use crate::following::line_of_sight::LineOfSight;
    use crate::path::circle::{Circle, Turn};
    use crate::path::line::Line;

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
