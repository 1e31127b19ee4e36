//! A circle in the plane z = constant.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// The sense in which a circle is travelled, seen with the y-axis to the left of the x-axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Counter-clockwise: the curvature is +1/radius.
    Left,
    /// Clockwise: the curvature is −1/radius.
    Right,
}

impl Turn {
    /// +1 for a turn to the left, −1 for a turn to the right.
    pub fn sign(self) -> f64 {
        match self {
            Turn::Left => 1.0,
            Turn::Right => -1.0,
        }
    }
}

/// p(ξ) = c + a (cos θ, sin θ, 0) with θ = θ₀ ± ρ ξ.
///
/// With ρ = 1 the parameter is the angle travelled and R is the radius, so that vehicles on nested circles stay
/// abreast when their parameters agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    centre: Vector3<f64>,
    radius: f64,
    start_angle: f64,
    /// dθ/dξ = ±ρ.
    angle_rate: f64,
}

impl Circle {
    /// The circle around `centre` \[m\] with `radius` \[m\], at `start_angle` \[rad\] when ξ = 0; `rate` ρ > 0 is
    /// the angle travelled per unit of ξ \[rad\].
    pub fn new(centre: Vector3<f64>, radius: f64, turn: Turn, start_angle: f64, rate: f64) -> Result<Circle, String> {
        centre.iter().try_for_each(|&x| finite("a circle's centre", x).map(drop))?;
        finite("a circle's start angle", start_angle)?;
        positive("a circle's radius", radius)?;
        positive("a circle's angle per unit of xi", rate)?;
        Ok(Circle { centre, radius, start_angle, angle_rate: turn.sign() * rate })
    }
}

impl Path for Circle {
    fn at(&self, xi: f64) -> PathPoint {
        let (sin, cos) = (self.start_angle + self.angle_rate * xi).sin_cos();
        let outward = self.radius * Vector3::new(cos, sin, 0.0);
        let tangent = self.radius * Vector3::new(-sin, cos, 0.0);
        let w = self.angle_rate;
        PathPoint { p: self.centre + outward, d1: w * tangent, d2: -w * w * outward, d3: -w * w * w * tangent }
    }

    fn search_range(&self) -> (f64, f64) {
        (0.0, TAU / self.angle_rate.abs())
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use nalgebra::Vector3;

    use super::{Circle, Turn};
    use crate::following::proposition_3_1::Errors;
    use crate::path::Path;
    use crate::path::check::assert_derivatives_agree;
    use crate::path::closest::closest_parameter;
    use crate::path::line::Line;

    #[test]
    fn the_parameter_is_the_angle_and_r_the_radius() {
        let circle = Circle::new(Vector3::new(1.0, 2.0, 0.0), 3.0, Turn::Left, 0.0, 1.0).unwrap();
        let quarter = circle.at(FRAC_PI_2);
        assert!((quarter.p - Vector3::new(1.0, 5.0, 0.0)).norm() < 1e-15);
        assert!((quarter.r() - 3.0).abs() < 1e-15);
        assert!((quarter.curvature() - 1.0 / 3.0).abs() < 1e-15 && quarter.dcurvature_ds().abs() < 1e-15);
        assert_derivatives_agree(&circle, 0.7);
    }

    #[test]
    fn clockwise_is_the_mirror_image() {
        let left = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 0.5).unwrap();
        let right = Circle::new(Vector3::zeros(), 2.0, Turn::Right, 0.0, 0.5).unwrap();
        let mirrored = right.at(1.3).p.component_mul(&Vector3::new(1.0, -1.0, 1.0));
        assert!((mirrored - left.at(1.3).p).norm() < 1e-15);
        assert!((right.at(1.3).curvature() + 0.5).abs() < 1e-15);
        assert_derivatives_agree(&right, 1.3);
    }

    /// Section 2.5.1 and Figures 2.9 to 2.11, erratum 2.6: the normal is to the left of the motion, and d_e is positive there.
    #[test]
    fn the_distance_is_positive_to_the_left_whichever_way_round() {
        let centre = Vector3::new(1.0, -2.0, 0.0);
        let distance = |path: &dyn Path, x: f64, y: f64| {
            let xi = closest_parameter(path, Vector3::new(x, y, 0.0), true);
            Errors::of(&path.at(xi), x, y, 0.0).y_e
        };
        for (turn, c) in [(Turn::Left, 1.0), (Turn::Right, -1.0)] {
            let circle = Circle::new(centre, 3.0, turn, 0.4, 1.0).unwrap();
            assert!((circle.at(0.3).curvature() - c / 3.0).abs() < 1e-15);
            for (rho, angle) in [(2.5, 0.1f64), (3.5, 2.0), (4.2, -2.5)] {
                let d_e = distance(&circle, centre.x + rho * angle.cos(), centre.y + rho * angle.sin());
                assert!((d_e - c * (3.0 - rho)).abs() < 1e-9, "{turn:?} {rho}: {d_e}");
            }
        }
        let up = Line::new(Vector3::new(2.0, 0.0, 0.0), FRAC_PI_2, 1.0).unwrap();
        assert!((distance(&up, 1.3, 5.0) - 0.7).abs() < 1e-12, "d_e = x_0 - x");
    }

    #[test]
    fn the_search_range_is_one_lap() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Right, 0.3, 0.25).unwrap();
        let (from, to) = circle.search_range();
        assert!((circle.at(from).p - circle.at(to).p).norm() < 1e-14 && (to - from - 4.0 * TAU).abs() < 1e-12);
    }

    #[test]
    fn a_circle_without_radius_is_refused() {
        assert!(Circle::new(Vector3::zeros(), 0.0, Turn::Left, 0.0, 1.0).is_err());
    }
}
