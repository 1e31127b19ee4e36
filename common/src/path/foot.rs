//! The foot of a vehicle on its path: the closest point, seen from above, followed as the vehicle moves.
//!
//! Its parameter is continuous and never wrapped: on a circle it counts the laps. Where the closest point is near the
//! last one, Newton's method finds it to the last digits. It may not be: beyond the path's centre of curvature the foot
//! jumps, to the closest point within half a turn.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};

use super::closest::refine;
use super::{Path, PathPoint};

/// Least 1 − d c_c at which the foot is followed, d to the left: (2.9) and (2.10) hold only where it is positive, that is, on
/// the vehicle's side of the path's centre of curvature.
pub const LEAST_NEARNESS: f64 = 0.1;

/// Samples of a search within half a turn to either side.
const SAMPLES: i32 = 64;
/// Samples of a search over the whole path, to either side.
const MANY_SAMPLES: i32 = 2000;
/// Newton steps; four are many.
const STEPS: usize = 20;
/// A step so short, in metres and relative to where the vehicle is, is the last: the next one would be rounding.
const CONVERGED: f64 = 1e-13;
/// A distance must be this much smaller, relatively, to be preferred to one that is nearer along the path.
const CLOSER: f64 = 1e-9;

/// The foot, and the path there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Its parameter.
    pub xi: f64,
    /// The path there.
    pub point: PathPoint,
}

impl Foot {
    /// The closest point of all the path; of those that are equally close, such as one per lap of a circle, the one
    /// nearest to `near`.
    pub fn locate(path: &dyn Path, position: Vector2<f64>, near: f64) -> Foot {
        let (from, to) = path.search_range();
        Foot::search(path, position, near, to - from, MANY_SAMPLES)
    }

    /// The foot when the vehicle has come to `position`, and whether it had to be searched for because the vehicle is at
    /// or beyond the centre of curvature.
    pub fn follow(&self, path: &dyn Path, position: Vector2<f64>) -> (Foot, bool) {
        let mut foot = *self;
        for _ in 0..STEPS {
            let offset = position - foot.point.p.xy();
            let tangent = foot.point.planar_tangent();
            let (along, across) = (tangent.dot(&offset), tangent.perp(&offset));
            let (r, c_c) = (foot.point.r(), foot.point.curvature());
            // d/ds of the distance along the tangent is −(1 − d c_c).
            let nearness = 1.0 - across * c_c;
            if nearness < LEAST_NEARNESS || nearness.is_nan() || r <= 0.0 {
                break;
            }
            // Not more than a radian at a time, beyond which the circle bends back.
            let reach = 1.0 / c_c.abs();
            let step = (along / nearness).clamp(-reach, reach) / r;
            let xi = foot.xi + step;
            if !xi.is_finite() {
                break;
            }
            foot = Foot { xi, point: path.at(xi) };
            if step.abs() * r <= CONVERGED * (1.0 + position.norm()) {
                return (foot, false);
            }
        }
        let half_a_turn = PI / (self.point.curvature().abs() * self.point.r());
        if half_a_turn.is_finite() && position.iter().all(|x| x.is_finite()) {
            (Foot::search(path, position, self.xi, half_a_turn, SAMPLES), true)
        } else {
            (foot, true)
        }
    }

    /// The closest point within `reach` of `near`, the nearest of equally close ones.
    fn search(path: &dyn Path, position: Vector2<f64>, near: f64, reach: f64, samples: i32) -> Foot {
        let distance = |xi: f64| (path.at(xi).p.xy() - position).norm();
        let cell = reach / f64::from(samples);
        let mut best = (distance(near), near);
        for sample in 1..=samples {
            for side in [1.0, -1.0] {
                let xi = near + side * f64::from(sample) * cell;
                let found = distance(xi);
                if found < best.0 - CLOSER * (1.0 + best.0) {
                    best = (found, xi);
                }
            }
        }
        let position = Vector3::new(position.x, position.y, 0.0);
        let xi = refine(path, position, Vector3::new(1.0, 1.0, 0.0), best.1, cell);
        Foot { xi, point: path.at(xi) }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::{Vector2, Vector3};
    use proptest::prelude::*;

    use super::Foot;
    use crate::path::Path;
    use crate::path::chain::{Chain, Segment};
    use crate::path::circle::{Circle, Turn};
    use crate::path::line::Line;

    fn circle(turn: Turn) -> Circle {
        Circle::new(Vector3::zeros(), 2.0, turn, 0.0, 1.0).unwrap()
    }

    #[test]
    fn laps_are_counted_in_either_direction() {
        for turn in [Turn::Left, Turn::Right] {
            let path = circle(turn);
            let mut foot = Foot::locate(&path, Vector2::new(2.5, 0.0), 0.0);
            for step in 1..=1000 {
                let angle = turn.sign() * 0.02 * f64::from(step);
                let (next, searched) = foot.follow(&path, 2.5 * Vector2::new(angle.cos(), angle.sin()));
                assert!(!searched && (next.xi - 0.02 * f64::from(step)).abs() < 1e-12, "{step}: {}", next.xi);
                foot = next;
            }
        }
    }

    #[test]
    fn a_given_parameter_says_which_lap() {
        let position = 3.0 * Vector2::new(1f64.cos(), 1f64.sin());
        for lap in [-2.0, 0.0, 5.0] {
            let foot = Foot::locate(&circle(Turn::Left), position, lap * TAU);
            assert!((foot.xi - lap * TAU - 1.0).abs() < 1e-12, "{lap}: {}", foot.xi);
        }
    }

    #[test]
    fn beyond_the_centre_the_foot_jumps_half_a_turn() {
        let path = circle(Turn::Left);
        let foot = Foot::locate(&path, Vector2::new(0.3, 0.0), 0.0);
        assert_eq!(foot.xi, 0.0);
        let (beyond, searched) = foot.follow(&path, Vector2::new(-0.3, 0.0));
        assert!(searched && (beyond.xi.abs() - PI).abs() < 1e-9, "{}", beyond.xi);
        let (centre, searched) = foot.follow(&path, Vector2::zeros());
        assert!(searched && centre.xi.is_finite());
        let (nowhere, searched) = foot.follow(&path, Vector2::repeat(f64::NAN));
        assert!(searched && nowhere.xi.is_finite());
    }

    #[test]
    fn rounding_is_not_taken_for_a_singular_place() {
        // Far from the origin, and slow: coordinates have many digits in front of the point.
        let centre = Vector3::new(4321.987, -8765.4321, 0.0);
        let path = Circle::new(centre, 3.0, Turn::Left, 0.7, 0.9).unwrap();
        let mut foot = Foot::locate(&path, centre.xy() + Vector2::new(3.1, 0.0), 0.0);
        for step in 0..20_000 {
            let angle = 0.0123 * f64::from(step);
            let position = centre.xy() + 3.1 * Vector2::new(angle.cos(), angle.sin());
            let (next, searched) = foot.follow(&path, position);
            assert!(!searched && (next.xi - foot.xi).abs() < 0.02, "{step}");
            foot = next;
        }
    }

    #[test]
    fn joints_of_a_chain_are_passed_though_r_jumps() {
        let path = Chain::new(
            Vector3::zeros(),
            0.3,
            &[
                Segment::Line { length: 2.0, xi_length: 0.5 },
                Segment::Arc { radius: 1.5, sweep: 2.0, xi_length: 2.0 },
                Segment::Arc { radius: 1.0, sweep: -1.0, xi_length: 3.0 },
                Segment::Line { length: 3.0, xi_length: 3.0 },
            ],
        )
        .unwrap();
        let mut foot = Foot::locate(&path, path.at(-0.2).p.xy(), 0.0);
        for step in 0..900 {
            let xi = -0.2 + 0.01 * f64::from(step);
            let point = path.at(xi);
            let normal = Vector2::new(-point.planar_tangent().y, point.planar_tangent().x);
            let (next, searched) = foot.follow(&path, point.p.xy() + 0.2 * (5.0 * xi).sin() * normal);
            assert!(!searched && (next.xi - xi).abs() < 1e-12, "{xi}: {}", next.xi);
            foot = next;
        }
    }

    proptest! {
        #[test]
        fn on_a_line_one_step_is_enough(x in -1e3..1e3f64, y in -50.0..50.0f64, heading in 0.0..TAU, rate in 0.1..10.0f64) {
            let path = Line::new(Vector3::new(1.0, -2.0, 0.0), heading, rate).unwrap();
            let (foot, searched) = Foot { xi: 0.0, point: path.at(0.0) }.follow(&path, Vector2::new(x, y));
            let exact = (Vector2::new(x, y) - Vector2::new(1.0, -2.0)).dot(&path.at(0.0).planar_tangent()) / rate;
            prop_assert!(!searched && (foot.xi - exact).abs() < 1e-12 * (1.0 + exact.abs()));
        }

        #[test]
        fn on_a_circle_it_is_the_angle(angle in -1.4..1.4f64, radius in 0.25..20.0f64, right: bool) {
            let turn = if right { Turn::Right } else { Turn::Left };
            let path = circle(turn);
            let position = radius * Vector2::new(angle.cos(), angle.sin());
            let (foot, searched) = Foot { xi: 0.0, point: path.at(0.0) }.follow(&path, position);
            // Seen from where it was, the vehicle may already be beyond the centre of curvature: then it is searched.
            prop_assert!((foot.xi - turn.sign() * angle).abs() < if searched { 1e-7 } else { 1e-12 }, "{}", foot.xi);
        }
    }

    #[test]
    fn it_is_searched_for_over_all_of_the_path_and_half_a_turn_either_way() {
        // From anywhere along a line of ten kilometres either way, from one end to the other.
        let line = Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        for x in [-900.0, -1.0, 1.0, 900.0] {
            assert!((Foot::locate(&line, Vector2::new(x, 5.0), 0.0).xi - x).abs() < 1e-9, "{x}");
        }
        assert!((Foot::locate(&line, Vector2::new(9000.0, 5.0), -9000.0).xi - 9000.0).abs() < 1e-9);
        // Beyond the centre, to either side, at half a radian per unit of ξ.
        for radius in [1.0, 4.0] {
            for turn in [Turn::Left, Turn::Right] {
                let path = Circle::new(Vector3::zeros(), radius, turn, 0.0, 0.5).unwrap();
                let start = Foot::locate(&path, Vector2::new(0.9 * radius, 0.0), 0.0);
                for angle in [-2.5f64, -1.8, 1.8, 2.5] {
                    let position = 0.7 * radius * Vector2::new(angle.cos(), angle.sin());
                    let (foot, _) = start.follow(&path, position);
                    assert!(
                        (foot.point.p.xy() / radius - position / (0.7 * radius)).norm() < 1e-6,
                        "{radius} {angle}: {}",
                        foot.xi
                    );
                }
            }
        }
    }
}
