//! A straight line in the plane z = constant.

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// How far from its start a vehicle is looked for along a line \[m\].
const REACH: f64 = 10_000.0;

/// p(ξ) = p₀ + ρ ξ (cos ψ, sin ψ, 0); it has neither beginning nor end.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    start: Vector3<f64>,
    /// ρ (cos ψ, sin ψ, 0), the constant first derivative.
    d1: Vector3<f64>,
}

impl Line {
    /// The line that is at `start` \[m\] when ξ = 0 and runs in the direction `heading` \[rad\]; `rate` ρ > 0 is its
    /// length per unit of ξ \[m\].
    pub fn new(start: Vector3<f64>, heading: f64, rate: f64) -> Result<Line, String> {
        start.iter().try_for_each(|&x| finite("a line's start", x).map(drop))?;
        finite("a line's heading", heading)?;
        positive("a line's length per unit of xi", rate)?;
        Ok(Line { start, d1: rate * Vector3::new(heading.cos(), heading.sin(), 0.0) })
    }
}

impl Path for Line {
    fn at(&self, xi: f64) -> PathPoint {
        PathPoint { p: self.start + self.d1 * xi, d1: self.d1, d2: Vector3::zeros(), d3: Vector3::zeros() }
    }

    fn search_range(&self) -> (f64, f64) {
        let reach = REACH / self.d1.norm();
        (-reach, reach)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Vector3;

    use super::{Line, REACH};
    use crate::path::Path;
    use crate::path::check::assert_derivatives_agree;

    #[test]
    fn a_line_to_the_left_at_two_metres_per_unit() {
        let line = Line::new(Vector3::new(1.0, -1.0, 3.0), FRAC_PI_2, 2.0).unwrap();
        let point = line.at(1.5);
        assert!((point.p - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-15);
        assert_eq!((point.r(), point.curvature(), point.dr_dxi()), (2.0, 0.0, 0.0));
        assert_eq!(line.search_range(), (-0.5 * REACH, 0.5 * REACH), "metres, at two per unit");
        assert_derivatives_agree(&line, -4.0);
    }

    #[test]
    fn a_line_that_does_not_move_is_refused() {
        assert!(Line::new(Vector3::zeros(), 0.0, 0.0).is_err());
        assert!(Line::new(Vector3::zeros(), f64::NAN, 1.0).is_err());
        assert!(Line::new(Vector3::new(0.0, f64::INFINITY, 0.0), 0.0, 1.0).is_err());
    }
}
