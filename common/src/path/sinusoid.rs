//! The sinusoid of Figure 3.9: vehicles side by side along x, one of them weaving.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// How many wavelengths to either side of ξ = 0 a vehicle is looked for.
const REACH: f64 = 100.0;

/// x = ξ, y = y₀ + a sin(2π ξ/λ + φ), z = z₀: the parameter is the x-coordinate itself and R changes along the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Sinusoid {
    amplitude: f64,
    offset: f64,
    /// 2π/λ.
    wave_number: f64,
    phase: f64,
    z: f64,
}

impl Sinusoid {
    /// Amplitude a, offset y₀, wavelength λ > 0 and height z₀ in metres, phase φ in radians.
    pub fn new(amplitude: f64, offset: f64, wavelength: f64, phase: f64, z: f64) -> Result<Sinusoid, String> {
        finite("a sinusoid's amplitude", amplitude)?;
        finite("a sinusoid's offset", offset)?;
        positive("a sinusoid's wavelength", wavelength)?;
        finite("a sinusoid's phase", phase)?;
        finite("a sinusoid's height", z)?;
        Ok(Sinusoid { amplitude, offset, wave_number: TAU / wavelength, phase, z })
    }
}

impl Path for Sinusoid {
    fn at(&self, xi: f64) -> PathPoint {
        let k = self.wave_number;
        let (sin, cos) = (k * xi + self.phase).sin_cos();
        let a = self.amplitude;
        PathPoint {
            p: Vector3::new(xi, self.offset + a * sin, self.z),
            d1: Vector3::new(1.0, a * k * cos, 0.0),
            d2: Vector3::new(0.0, -a * k * k * sin, 0.0),
            d3: Vector3::new(0.0, -a * k * k * k * cos, 0.0),
        }
    }

    fn search_range(&self) -> (f64, f64) {
        let reach = REACH * TAU / self.wave_number;
        (-reach, reach)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{REACH, Sinusoid};
    use crate::path::Path;
    use crate::path::check::assert_derivatives_agree;

    #[test]
    fn figure_3_9_has_the_printed_r_and_a_curvature_of_39_5_per_metre() {
        let path = Sinusoid::new(1.0, 1.0, 1.0, 0.0, 0.0).unwrap();
        for x in [0.0, 0.1, 0.37, -2.2] {
            // R₁ = √(1 + (2π/λ)² cos²(2π x/λ)), section 3.4.1.
            let r = (1.0 + (TAU * (TAU * x).cos()).powi(2)).sqrt();
            assert!((path.at(x).r() - r).abs() < 1e-12);
            assert_derivatives_agree(&path, x);
        }
        let crest = path.at(0.25);
        assert!((crest.p.y - 2.0).abs() < 1e-15 && (crest.curvature() + TAU * TAU).abs() < 1e-12);
        // A quarter of a wave ahead, the crest is at zero; and a search goes over a hundred waves either way.
        let ahead = Sinusoid::new(1.0, 1.0, 3.0, 0.25 * TAU, 0.0).unwrap();
        assert!((ahead.at(0.0).p.y - 2.0).abs() < 1e-15 && ahead.at(0.1).p.y < 2.0 && ahead.at(0.75).p.y < 1.0 + 1e-12);
        assert_derivatives_agree(&ahead, 0.3);
        assert!(
            (ahead.search_range().1 - REACH * 3.0).abs() < 1e-9 && ahead.search_range().0 == -ahead.search_range().1
        );
    }

    #[test]
    fn a_wave_without_length_is_refused() {
        assert!(Sinusoid::new(1.0, 0.0, 0.0, 0.0, 0.0).is_err());
    }
}
