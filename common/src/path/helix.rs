//! The helix of section 4.6: vehicles in one vertical line, circling while they change depth.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// p(ξ) = (c₁ cos(2π ξ/T + φ), c₁ sin(2π ξ/T + φ), c₂ ξ + z₀).
#[derive(Clone, Debug, PartialEq)]
pub struct Helix {
    /// c₁.
    radius: f64,
    /// 2π/T.
    angle_rate: f64,
    /// φ.
    phase: f64,
    /// c₂.
    climb: f64,
    /// z₀.
    start_height: f64,
}

impl Helix {
    /// `radius` c₁ > 0 \[m\], `lap` T > 0 \[units of ξ per turn\], `phase` φ \[rad\], `climb` c₂ \[m per unit of ξ\],
    /// `start_height` z₀ \[m\].
    pub fn new(radius: f64, lap: f64, phase: f64, climb: f64, start_height: f64) -> Result<Helix, String> {
        positive("a helix' radius", radius)?;
        positive("a helix' lap", lap)?;
        finite("a helix' phase", phase)?;
        finite("a helix' climb", climb)?;
        finite("a helix' start height", start_height)?;
        Ok(Helix { radius, angle_rate: TAU / lap, phase, climb, start_height })
    }
}

impl Path for Helix {
    fn at(&self, xi: f64) -> PathPoint {
        let w = self.angle_rate;
        let (sin, cos) = (w * xi + self.phase).sin_cos();
        let outward = self.radius * Vector3::new(cos, sin, 0.0);
        let tangent = self.radius * Vector3::new(-sin, cos, 0.0);
        PathPoint {
            p: outward + Vector3::new(0.0, 0.0, self.climb * xi + self.start_height),
            d1: w * tangent + Vector3::new(0.0, 0.0, self.climb),
            d2: -w * w * outward,
            d3: -w * w * w * tangent,
        }
    }

    fn search_range(&self) -> (f64, f64) {
        (0.0, TAU / self.angle_rate)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

    use nalgebra::Vector3;

    use super::Helix;
    use crate::path::Path;
    use crate::path::check::assert_derivatives_agree;

    #[test]
    fn the_first_vehicle_of_section_4_6() {
        let helix = Helix::new(20.0, 400.0, -0.75 * PI, 0.05, -10.0).unwrap();
        let start = Vector3::new(-20.0 * FRAC_1_SQRT_2, -20.0 * FRAC_1_SQRT_2, -10.0);
        assert!((helix.at(0.0).p - start).norm() < 1e-13);
        assert!((helix.at(400.0).p - start - Vector3::new(0.0, 0.0, 20.0)).norm() < 1e-12);
        let r = ((20.0 * TAU / 400.0f64).powi(2) + 0.05f64.powi(2)).sqrt();
        assert!((helix.at(123.0).r() - r).abs() < 1e-14 && helix.at(123.0).dr_dxi().abs() < 1e-15);
        assert_derivatives_agree(&helix, 79.5);
    }

    #[test]
    fn a_helix_without_turns_is_refused() {
        assert!(Helix::new(20.0, 0.0, 0.0, 0.1, 0.0).is_err());
    }
}
