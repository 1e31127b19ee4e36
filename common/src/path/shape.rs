//! What a law may ask of a path as a whole before it accepts it.

use super::Path;

/// Points at which a path is examined.
const SAMPLES: u32 = 1000;
/// Departures smaller than this, relative to the lengths compared, are rounding.
const TOLERANCE: f64 = 1e-9;

/// The parameters at which a path is examined: evenly over its search range.
fn samples(path: &dyn Path) -> impl Iterator<Item = f64> {
    let (from, to) = path.search_range();
    (0..=SAMPLES).map(move |sample| from + (to - from) * f64::from(sample) / f64::from(SAMPLES))
}

/// Whether the path stays in one horizontal plane, as a wheeled robot must.
pub fn is_planar(path: &dyn Path) -> bool {
    samples(path).map(|xi| path.at(xi)).all(|point| point.d1.z.abs() <= TOLERANCE * point.r())
}

/// Whether the path is one straight line travelled evenly, so that ξ is an affine function of the distance along it.
pub fn is_straight(path: &dyn Path) -> bool {
    let (from, _) = path.search_range();
    let first = path.at(from);
    path.tangent_breaks().is_empty()
        && samples(path).all(|xi| {
            let point = path.at(xi);
            let expected = first.p + (xi - from) * first.d1;
            let length = first.r() * (xi - from);
            (point.d1 - first.d1).norm() <= TOLERANCE * first.r()
                && (point.p - expected).norm() <= TOLERANCE * (length + first.p.norm())
        })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::{is_planar, is_straight};
    use crate::path::chain::{Chain, Segment};
    use crate::path::circle::{Circle, Turn};
    use crate::path::helix::Helix;
    use crate::path::line::Line;
    use crate::path::sinusoid::Sinusoid;
    use crate::path::{Path, PathPoint};

    #[test]
    fn lines_are_straight_and_curves_are_not() {
        assert!(is_straight(&Line::new(Vector3::new(1.0, 2.0, 3.0), 0.7, 0.3).unwrap()));
        assert!(!is_straight(&Circle::new(Vector3::zeros(), 1e3, Turn::Left, 0.0, 1.0).unwrap()));
        assert!(!is_straight(&Sinusoid::new(0.01, 0.0, 5.0, 0.0, 0.0).unwrap()));
        // Far from the origin rounding is larger, and no curve.
        let far = Line::new(Vector3::new(4.3e8, -8.7e8, 0.0), 0.7, 0.3).unwrap();
        assert!(is_straight(&far));
    }

    #[test]
    fn a_chain_of_lines_is_straight_if_it_is_travelled_evenly() {
        let line = |xi_length| Segment::Line { length: 3.0, xi_length };
        let chain = |segments: &[Segment]| Chain::new(Vector3::zeros(), 0.1, segments).unwrap();
        assert!(is_straight(&chain(&[line(1.0), line(1.0)])));
        assert!(!is_straight(&chain(&[line(1.0), line(2.0)])));
        assert!(!is_straight(&chain(&[line(1.0), Segment::Corner { angle: 1.0 }, line(1.0)])));
    }

    #[test]
    fn a_helix_leaves_the_plane() {
        assert!(!is_planar(&Helix::new(20.0, 400.0, 0.0, 0.05, 0.0).unwrap()));
        assert!(is_planar(&Circle::new(Vector3::z(), 2.0, Turn::Right, 0.0, 1.0).unwrap()));
        // Down as well as up, and however little for its length.
        assert!(!is_planar(&Helix::new(20.0, 400.0, 0.0, -0.05, 0.0).unwrap()));
    }

    /// Along the x-axis at `rate`, and half way on beside it by `aside` or up by `rise` per unit of ξ.
    #[derive(Debug)]
    struct Broken {
        rate: f64,
        aside: f64,
        rise: f64,
    }

    impl Path for Broken {
        fn at(&self, xi: f64) -> PathPoint {
            let [aside, rise] = if xi > 0.0 { [self.aside, self.rise] } else { [0.0; 2] };
            let (d1, still) = (Vector3::new(self.rate, 0.0, rise), Vector3::zeros());
            PathPoint { p: Vector3::new(self.rate * xi, aside, 0.0), d1, d2: still, d3: still }
        }
        fn search_range(&self) -> (f64, f64) {
            (-10.0, 10.0)
        }
    }

    #[test]
    fn every_part_counts_and_against_the_length_of_all() {
        let of = |rate, aside, rise| Broken { rate, aside, rise };
        assert!(is_planar(&of(1.0, 0.0, 0.0)) && is_straight(&of(1.0, 0.0, 0.0)));
        assert!(!is_planar(&of(1.0, 0.0, 1e-3)) && !is_planar(&of(1.0, 0.0, -1e-3)));
        assert!(!is_straight(&of(1.0, 0.0, 1e-3)) && !is_straight(&of(1.0, 0.1, 0.0)), "beside it is another line");
        // A hundred-millionth of a metre per kilometre is rounding, and per metre is not.
        assert!(is_planar(&of(1e3, 0.0, 1e-8)) && !is_planar(&of(1.0, 0.0, 1e-8)));
        assert!(
            is_straight(&of(1e3, 1e-7, 1e-8)) && !is_straight(&of(1.0, 1e-7, 0.0)) && !is_straight(&of(1.0, 0.0, 1e-8))
        );
    }
}
