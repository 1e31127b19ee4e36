//! What follows from the derivatives of a path: R, heading and curvature.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::PathPoint;

impl PathPoint {
    /// R(ξ) = ds/dξ = ‖p'‖ \[m per unit of ξ\].
    pub fn r(&self) -> f64 {
        self.d1.norm()
    }

    /// dR/dξ = p'ᵀ p'' / R.
    pub fn dr_dxi(&self) -> f64 {
        ratio(self.d1.dot(&self.d2), self.r())
    }

    /// ψ_T = atan2(y', x'): the direction of the tangent in the plane \[rad\].
    #[doc(alias = "ψ_T")]
    pub fn heading(&self) -> f64 {
        self.d1.y.atan2(self.d1.x)
    }

    /// The unit tangent in the plane, (cos ψ_T, sin ψ_T); (1, 0) where a path is vertical.
    pub fn planar_tangent(&self) -> Vector2<f64> {
        self.d1.xy().try_normalize(0.0).unwrap_or(Vector2::x())
    }

    /// c_c = (x' y'' − y' x'') / ‖(x', y')‖³: curvature in the plane, positive for a turn to the left \[1/m\].
    /// Zero where a path is vertical.
    #[doc(alias = "c_c")]
    pub fn curvature(&self) -> f64 {
        ratio(self.d1.xy().perp(&self.d2.xy()), self.d1.xy().norm().powi(3))
    }

    /// dc_c/ds = ((x' y''' − y' x''') − 3 c_c ‖p'‖ (x' x'' + y' y'')) / ‖p'‖⁴, with p' in the plane \[1/m²\].
    pub fn dcurvature_ds(&self) -> f64 {
        let (d1, d2, d3) = (self.d1.xy(), self.d2.xy(), self.d3.xy());
        let norm = d1.norm();
        ratio(d1.perp(&d3) - 3.0 * self.curvature() * norm * d1.dot(&d2), norm.powi(4))
    }
}

/// An angle brought to \[−π, π\] by whole turns; small angles are returned unchanged to the last bit.
pub fn wrap_angle(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// A quotient that is zero where the tangent vanishes: no path of this module has such a point.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { numerator / denominator } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::wrap_angle;
    use crate::path::sinusoid::Sinusoid;
    use crate::path::{Path, PathPoint};

    /// y = x³ at x: curvature y''/(1 + y'²)^{3/2} in closed form.
    fn cubic(x: f64) -> PathPoint {
        PathPoint {
            p: Vector3::new(x, x.powi(3), 0.0),
            d1: Vector3::new(1.0, 3.0 * x * x, 0.0),
            d2: Vector3::new(0.0, 6.0 * x, 0.0),
            d3: Vector3::new(0.0, 6.0, 0.0),
        }
    }

    #[test]
    fn curvature_of_the_cubic_parabola() {
        let expected = 3.0 / (1.0 + 9.0 / 16.0f64).powf(1.5);
        assert!((cubic(0.5).curvature() - expected).abs() < 1e-14);
        assert!(cubic(-0.5).curvature() < 0.0, "a turn to the right is negative");
    }

    #[test]
    fn derivatives_of_r_and_curvature_agree_with_differences() {
        let path = Sinusoid::new(0.3, 1.0, 2.0, 0.4, 0.0).unwrap();
        let h = 1e-5;
        for step in 0..40 {
            let xi = -1.0 + 0.05 * f64::from(step);
            let (before, here, after) = (path.at(xi - h), path.at(xi), path.at(xi + h));
            let dr = (after.r() - before.r()) / (2.0 * h);
            let dc = (after.curvature() - before.curvature()) / (2.0 * h) / here.r();
            assert!((here.dr_dxi() - dr).abs() < 1e-6 * (1.0 + dr.abs()));
            assert!((here.dcurvature_ds() - dc).abs() < 1e-6 * (1.0 + dc.abs()), "{xi}");
        }
    }

    #[test]
    fn a_vertical_tangent_gives_numbers() {
        let up = PathPoint { p: Vector3::zeros(), d1: Vector3::z(), d2: Vector3::x(), d3: Vector3::y() };
        assert_eq!((up.curvature(), up.dcurvature_ds(), up.planar_tangent().norm()), (0.0, 0.0, 1.0));
    }

    proptest! {
        #[test]
        fn wrapping_keeps_the_direction(angle in -1e3..1e3f64) {
            let wrapped = wrap_angle(angle);
            prop_assert!(wrapped.abs() <= PI);
            prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-12 && (wrapped.cos() - angle.cos()).abs() < 1e-12);
        }

        #[test]
        fn curvature_does_not_depend_on_the_frame_or_on_the_parameter(turn in 0.0..TAU, rate in 0.1..10.0f64) {
            let point = cubic(0.7);
            let rotation = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
            let seen = PathPoint {
                p: rotation * point.p,
                d1: rotation * point.d1 * rate,
                d2: rotation * point.d2 * rate.powi(2),
                d3: rotation * point.d3 * rate.powi(3),
            };
            prop_assert!((seen.curvature() - point.curvature()).abs() < 1e-12);
            prop_assert!((seen.dcurvature_ds() - point.dcurvature_ds()).abs() < 1e-11);
            prop_assert!((seen.r() - rate * point.r()).abs() < 1e-12 * seen.r());
        }
    }
}
