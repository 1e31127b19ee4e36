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

    #[test]
    fn lines_are_straight_and_curves_are_not() {
        assert!(is_straight(&Line::new(Vector3::new(1.0, 2.0, 3.0), 0.7, 0.3).unwrap()));
        assert!(!is_straight(&Circle::new(Vector3::zeros(), 1e3, Turn::Left, 0.0, 1.0).unwrap()));
        assert!(!is_straight(&Sinusoid::new(0.01, 0.0, 5.0, 0.0, 0.0).unwrap()));
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
    }
}
