//! Who hears whom over which distance.

use std::sync::Arc;

/// Whether a message gets there, over distance.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Range {
    /// At any distance.
    #[default]
    Unlimited,
    /// Up to and including this distance \[m\].
    Disc(f64),
    /// With a probability that is linear between points (distance \[m\], probability), constant before the first; none
    /// beyond the last.
    Curve(Arc<[(f64, f64)]>),
}

impl Range {
    /// Probability that a message gets there over this distance \[m\]; none over a distance that is not a number.
    pub fn success(&self, distance: f64) -> f64 {
        match self {
            Range::Unlimited => 1.0,
            Range::Disc(radius) => f64::from(u8::from(distance <= *radius)),
            Range::Curve(points) => {
                let after = points.partition_point(|(at, _)| *at < distance);
                match (after.checked_sub(1).map(|before| points[before]), points.get(after)) {
                    _ if distance.is_nan() => 0.0,
                    (_, None) => 0.0,
                    (None, Some((_, probability))) => *probability,
                    (Some((d_0, p_0)), Some((d_1, p_1))) => p_0 + (p_1 - p_0) * (distance - d_0) / (d_1 - d_0),
                }
            }
        }
    }

    /// Whether it makes any difference how far apart the vehicles are.
    pub fn is_limited(&self) -> bool {
        *self != Range::Unlimited
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Range;
    use crate::random::Stream;

    #[test]
    fn a_disc_has_an_edge() {
        let disc = Range::Disc(100.0);
        assert_eq!([0.0, 100.0, 100.001, f64::INFINITY, f64::NAN].map(|d| disc.success(d)), [1.0, 1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_curve_is_linear_between_its_points_and_ends_with_the_last() {
        let curve = Range::Curve([(100.0, 1.0), (300.0, 0.5), (400.0, 0.1)].into());
        for (distance, probability) in
            [(0.0, 1.0), (100.0, 1.0), (200.0, 0.75), (300.0, 0.5), (350.0, 0.3), (400.0, 0.1)]
        {
            assert!((curve.success(distance) - probability).abs() < 1e-12, "at {distance} m");
        }
        assert_eq!([400.1, f64::INFINITY, f64::NAN].map(|d| curve.success(d)), [0.0; 3]);
    }

    #[test]
    fn messages_get_through_at_the_rate_of_the_curve() {
        let curve = Range::Curve([(0.0, 1.0), (1000.0, 0.0)].into());
        let (mut stream, n) = (Stream::new(2, "range"), 20_000_u32);
        let heard = (0..n).filter(|_| stream.unit() < curve.success(300.0)).count() as f64 / f64::from(n);
        assert!((heard - 0.7).abs() < 5.0 * (0.7f64 * 0.3 / f64::from(n)).sqrt(), "{heard}");
    }

    proptest! {
        #[test]
        fn it_is_always_a_probability(distance in any::<f64>(), p in 0.0..=1.0f64, q in 0.0..=1.0f64) {
            let success = Range::Curve([(10.0, p), (20.0, q)].into()).success(distance);
            prop_assert!((0.0..=1.0).contains(&success));
        }
    }
}
