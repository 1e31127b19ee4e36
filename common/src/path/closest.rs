//! The point of a path closest to a vehicle: where its virtual target starts unless the mission says otherwise
//! (section 4.6, erratum 4.23).

use nalgebra::Vector3;

use super::Path;

/// Points at which the search range is sampled: ten per wavelength of the longest sinusoid that is searched.
const SAMPLES: u32 = 2000;
/// More than bisection needs to exhaust the digits of a double.
const REFINEMENTS: usize = 80;

/// The ξ that minimises ‖p(ξ) − position‖, or with `planar` the distance seen from above.
///
/// The search range is sampled, and the best sample refined within its two neighbours (the answer may therefore lie
/// one sample outside of the range: on a closed path, just before its start). Of equally close points, such as all of
/// a circle seen from its centre, the first counts.
pub fn closest_parameter(path: &dyn Path, position: Vector3<f64>, planar: bool) -> f64 {
    let weight = Vector3::new(1.0, 1.0, if planar { 0.0 } else { 1.0 });
    let distance = |xi: f64| (path.at(xi).p - position).component_mul(&weight).norm_squared();
    let (from, to) = path.search_range();
    let cell = (to - from) / f64::from(SAMPLES);
    let mut best = (f64::INFINITY, from);
    for sample in 0..=SAMPLES {
        let xi = from + f64::from(sample) * cell;
        let found = distance(xi);
        if found < best.0 {
            best = (found, xi);
        }
    }

    refine(path, position, weight, best.1, cell)
}

/// The minimum of the distance within `cell` of `xi`, where it has one: Newton's method, with bisection where it would
/// leave the bracket.
pub(super) fn refine(path: &dyn Path, position: Vector3<f64>, weight: Vector3<f64>, xi: f64, cell: f64) -> f64 {
    // f(ξ) = ½‖p − position‖², f' = (p − position)ᵀ p', f'' = p'ᵀp' + (p − position)ᵀ p''.
    let slopes = |xi: f64| {
        let point = path.at(xi);
        let away = (point.p - position).component_mul(&weight);
        let d1 = point.d1.component_mul(&weight);
        (away.dot(&d1), d1.norm_squared() + away.dot(&point.d2))
    };
    let (mut low, mut high, mut xi) = (xi - cell, xi + cell, xi);
    for _ in 0..REFINEMENTS {
        let (slope, bend) = slopes(xi);
        if slope > 0.0 {
            high = xi
        } else {
            low = xi
        }
        let newton = xi - slope / bend;
        let next = if bend > 0.0 && low <= newton && newton <= high { newton } else { 0.5 * (low + high) };
        if next == xi || slope == 0.0 {
            break;
        }
        xi = next;
    }
    xi
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::closest_parameter;
    use crate::path::chain::{Chain, Segment};
    use crate::path::circle::{Circle, Turn};
    use crate::path::helix::Helix;
    use crate::path::line::Line;
    use crate::path::sinusoid::Sinusoid;
    use crate::path::{Path, PathPoint};

    #[test]
    fn the_initial_parameters_of_section_4_6() {
        for (z_0, y, expected) in [(-10.0, -10.0, 79.517), (-5.0, -15.0, 70.483), (0.0, -20.0, 65.596)] {
            let helix = Helix::new(20.0, 400.0, -0.75 * PI, 0.05, z_0).unwrap();
            let xi = closest_parameter(&helix, Vector3::new(5.0, y, z_0 + 5.0), true);
            assert!((xi - expected).abs() < 5e-4, "{xi} for {expected}");
        }
    }

    #[test]
    fn in_space_the_distance_in_depth_counts() {
        let helix = Helix::new(1.0, 1.0, 0.0, 100.0, 0.0).unwrap();
        let position = Vector3::new(2.0, 0.0, 40.0);
        assert!(closest_parameter(&helix, position, true).abs() < 1e-9);
        assert!((closest_parameter(&helix, position, false) - 0.4).abs() < 0.02);
        // Seen from above to the last digits, however steeply it climbs; ξ is in laps.
        let aside = closest_parameter(&helix, Vector3::new(2.0, 0.5, 40.0), true);
        assert!((helix.at(aside).p.y.atan2(helix.at(aside).p.x) - 0.25f64.atan()).abs() < 1e-9, "{aside}");
    }

    #[test]
    fn just_before_the_start_of_a_lap() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        let angle = -1e-4f64;
        let xi = closest_parameter(&circle, Vector3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 0.0), true);
        assert!((circle.at(xi).p - circle.at(angle).p).norm() < 1e-12, "{xi}");
    }

    #[test]
    fn the_centre_of_a_circle_is_close_to_its_start() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        assert!(closest_parameter(&circle, Vector3::zeros(), true).is_finite());
    }

    #[test]
    fn a_corner_can_be_the_closest_point() {
        let line = Segment::Line { length: 1.0, xi_length: 1.0 };
        let corner = Segment::Corner { angle: 0.5 * PI };
        let path = Chain::new(Vector3::zeros(), 0.0, &[line, corner, line]).unwrap();
        let xi = closest_parameter(&path, Vector3::new(1.5, -0.5, 0.0), true);
        assert!((xi - 1.0).abs() < 1e-9, "{xi}");
    }

    #[test]
    fn a_position_that_is_no_number_gives_a_number() {
        let line = Line::new(Vector3::zeros(), 0.0, 1.0).unwrap();
        assert!(closest_parameter(&line, Vector3::repeat(f64::NAN), true).is_finite());
    }

    /// No sample of the range is closer than what is found.
    fn nothing_is_closer(path: &dyn Path, position: Vector3<f64>) -> Result<(), TestCaseError> {
        let found = path.at(closest_parameter(path, position, false));
        let distance = |point: PathPoint| (point.p - position).norm();
        let (from, to) = path.search_range();
        for sample in 0..997 {
            let other = path.at(from + (to - from) * f64::from(sample) / 997.0);
            prop_assert!(distance(found) <= distance(other) + 1e-9);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn on_a_line_it_is_the_projection(x in -500.0..500.0f64, y in -50.0..50.0f64, heading in 0.0..TAU) {
            let line = Line::new(Vector3::new(3.0, -2.0, 0.0), heading, 2.0).unwrap();
            let along = (x - 3.0) * heading.cos() + (y + 2.0) * heading.sin();
            let xi = closest_parameter(&line, Vector3::new(x, y, 0.0), true);
            prop_assert!((xi - 0.5 * along).abs() < 1e-9);
        }

        #[test]
        fn no_sample_is_closer(x in -20.0..20.0f64, y in -5.0..5.0f64) {
            let position = Vector3::new(x, y, 0.0);
            nothing_is_closer(&Sinusoid::new(1.0, 1.0, 1.0, 0.0, 0.0).unwrap(), position)?;
            nothing_is_closer(&Helix::new(5.0, 40.0, 0.0, 0.01, 0.0).unwrap(), position)?;
        }
    }
}
