//! How late a message arrives.

use super::Quantiles;
use crate::time::Span;

/// No message is under way for longer.
pub const LONGEST_DELAY: Span = Span::from_nanos(3_600_000_000_000);

/// Delay of a message from the end of its transmission to its arrival.
#[derive(Clone, Debug, PartialEq)]
pub enum Delay {
    /// The same for every message.
    Constant(Span),
    /// Uniform between two bounds.
    Uniform(Span, Span),
    /// Any distribution; values in seconds.
    Drawn(Quantiles),
    /// Distance over the speed of the signal, plus a constant for what modems take.
    Distance {
        /// Speed of the signal \[m/s\].
        speed: f64,
        /// Added to every delay.
        extra: Span,
    },
}

impl Default for Delay {
    /// None.
    fn default() -> Delay {
        Delay::Constant(Span::ZERO)
    }
}

impl Delay {
    /// Normal with this mean and standard deviation \[s\], cut off below `least` ≥ 0.
    pub fn normal(mean: f64, deviation: f64, least: f64) -> Delay {
        Delay::Drawn(Quantiles::normal(mean, deviation, least))
    }

    /// `least` ≥ 0 plus a gamma variable, with this mean > least and standard deviation in all \[s\].
    pub fn gamma(mean: f64, deviation: f64, least: f64) -> Delay {
        let beyond = mean - least;
        Delay::Drawn(Quantiles::gamma((beyond / deviation).powi(2), deviation * deviation / beyond, least))
    }

    /// The delay of a message with its own uniform number `u`, over this distance \[m\].
    pub fn of(&self, u: f64, distance: f64) -> Span {
        let delay = match self {
            Delay::Constant(delay) => *delay,
            Delay::Uniform(least, most) => {
                let spread = (most.nanos() - least.nanos()) as f64;
                Span::from_nanos(least.nanos() + (u * spread) as i64)
            }
            Delay::Drawn(quantiles) => Span::from_secs(quantiles.at(u)),
            // A distance that is not a number gives no delay, an endless one the longest.
            Delay::Distance { speed, extra } => Span::from_secs(distance.max(0.0) / speed) + *extra,
        };
        delay.clamp(Span::ZERO, LONGEST_DELAY)
    }

    /// The least it can be: no message ever arrives earlier.
    pub fn least(&self) -> Span {
        match self {
            Delay::Constant(delay) | Delay::Uniform(delay, _) | Delay::Distance { extra: delay, .. } => *delay,
            Delay::Drawn(quantiles) => Span::from_secs(quantiles.least()),
        }
        .clamp(Span::ZERO, LONGEST_DELAY)
    }

    /// The most it can be: no message ever arrives later. However far it is, no message is under way for longer than
    /// [`LONGEST_DELAY`].
    pub fn greatest(&self) -> Span {
        match self {
            Delay::Constant(delay) => *delay,
            // A uniform number is below one, and what is left of a nanosecond is cut off.
            Delay::Uniform(least, most) if least < most => Span::from_nanos(most.nanos() - 1),
            Delay::Uniform(_, most) => *most,
            Delay::Drawn(quantiles) => Span::from_secs(quantiles.at(1.0f64.next_down())),
            Delay::Distance { .. } => LONGEST_DELAY,
        }
        .clamp(Span::ZERO, LONGEST_DELAY)
    }

    /// The delay that every message has, if they all have the same.
    pub fn fixed(&self) -> Option<Span> {
        match self {
            Delay::Constant(delay) => Some(*delay),
            Delay::Uniform(least, most) => (least == most).then_some(*least),
            Delay::Drawn(_) | Delay::Distance { .. } => None,
        }
    }

    /// Whether it depends on where the vehicles are.
    pub fn needs_distance(&self) -> bool {
        matches!(self, Delay::Distance { .. })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::random::Stream;

    fn sample(delay: &Delay, n: u64) -> Vec<f64> {
        let mut stream = Stream::new(11, "delay");
        (0..n).map(|number| delay.of(stream.unit_at(number, 1), 0.0).secs()).collect()
    }

    /// Mean and standard deviation.
    fn moments(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
    }

    #[test]
    fn each_distribution_has_the_mean_and_the_deviation_it_was_given() {
        let n = 40_000;
        for (delay, mean, deviation) in [
            (Delay::Constant(Span::from_secs(2.0)), 2.0, 0.0),
            (Delay::Uniform(Span::from_secs(1.0), Span::from_secs(3.0)), 2.0, 1.0 / 3f64.sqrt()),
            (Delay::normal(2.0, 0.3, 0.0), 2.0, 0.3),
            (Delay::gamma(2.0, 0.8, 0.5), 2.0, 0.8),
        ] {
            let (found_mean, found_deviation) = moments(&sample(&delay, n));
            // Five standard deviations of the mean of n draws; the deviation's own is below 1.5/√n of it for these.
            let root = (n as f64).sqrt();
            assert!((found_mean - mean).abs() <= 5.0 * deviation / root + 1e-9, "{delay:?}: mean {found_mean}");
            assert!(
                (found_deviation - deviation).abs() <= 7.5 * deviation / root + 1e-9,
                "deviation {found_deviation}"
            );
        }
    }

    /// Φ(z), by its series about zero.
    fn normal_share(z: f64) -> f64 {
        let (mut term, mut sum) = (z, z);
        for k in 1..200 {
            term *= z * z / f64::from(2 * k + 1);
            sum += term;
        }
        0.5 + sum * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
    }

    /// The share below x of a gamma distribution of shape 4: the wait for the fourth of events at a mean distance of 1.
    fn fourth_share(x: f64) -> f64 {
        1.0 - (-x).exp() * (1.0 + x + x * x / 2.0 + x * x * x / 6.0)
    }

    #[test]
    fn each_distribution_is_the_one_it_is_called_by() {
        let n = 40_000;
        let uniform = |x: f64| (x - 1.0) / 2.0;
        let normal = |x: f64| normal_share((x - 2.0) / 0.3);
        // Shape ((mean - min)/deviation)^2 = 4 and scale deviation^2/(mean - min) = 3/8.
        let gamma = |x: f64| fourth_share((x - 0.5) / 0.375);
        let cases: [(Delay, &dyn Fn(f64) -> f64); 3] = [
            (Delay::Uniform(Span::from_secs(1.0), Span::from_secs(3.0)), &uniform),
            (Delay::normal(2.0, 0.3, 0.0), &normal),
            (Delay::gamma(2.0, 0.75, 0.5), &gamma),
        ];
        for (delay, share_below) in cases {
            let mut delays = sample(&delay, n);
            delays.sort_by(f64::total_cmp);
            let apart = |(i, x): (usize, &f64)| (share_below(*x) - (i as f64 + 0.5) / n as f64).abs();
            let apart = delays.iter().enumerate().map(apart).fold(0.0, f64::max);
            // Kolmogorov: beyond 2.23 over the root of n with a probability of 1e-4.
            assert!(apart * (n as f64).sqrt() < 2.23, "{delay:?}: {apart}");
        }
    }

    #[test]
    fn sound_takes_two_seconds_for_three_kilometres() {
        let delay = Delay::Distance { speed: 1500.0, extra: Span::from_secs(0.1) };
        assert_eq!(delay.of(0.3, 3000.0), Span::from_secs(2.1));
        assert_eq!((delay.least(), delay.needs_distance()), (Span::from_secs(0.1), true));
        assert_eq!(delay.of(0.3, f64::INFINITY), LONGEST_DELAY);
        assert_eq!(delay.of(0.3, f64::NAN), Span::from_secs(0.1));
    }

    #[test]
    fn the_greatest_delay_is_one_that_occurs() {
        let last = 1.0f64.next_down();
        let uniform = Delay::Uniform(Span::from_secs(1.0), Span::from_secs(5.0));
        for delay in [uniform, Delay::Constant(Span::from_secs(2.0)), Delay::gamma(2.0, 0.8, 0.5)] {
            assert!(delay.of(last, 0.0) == delay.greatest(), "{}", delay.greatest());
        }
        let same = Delay::Uniform(Span::from_secs(3.0), Span::from_secs(3.0));
        assert_eq!((same.greatest(), same.of(last, 0.0)), (Span::from_secs(3.0), Span::from_secs(3.0)));
    }

    proptest! {
        /// What the stepped clock relies on.
        #[test]
        fn nothing_arrives_before_the_least_delay_or_after_the_greatest(
            u in prop_oneof![0.0..1.0f64, Just(1.0f64.next_down())], mean in 0.0..100.0f64, deviation in 1e-6..100.0f64, least in 0.0..50.0f64,
            distance in prop_oneof![0.0..1e9f64, Just(f64::NAN), Just(f64::INFINITY)],
        ) {
            for delay in [
                Delay::normal(mean, deviation, least),
                Delay::gamma(least + mean + 1e-3, deviation, least),
                Delay::Uniform(Span::from_secs(least), Span::from_secs(least + mean)),
                Delay::Distance { speed: 1500.0, extra: Span::from_secs(least) },
            ] {
                let span = delay.of(u, distance);
                prop_assert!(span >= delay.least(), "{:?} < {:?} of {:?}", span, delay.least(), delay);
                prop_assert!(span <= delay.greatest(), "{:?} > {:?} of {:?}", span, delay.greatest(), delay);
                prop_assert!(delay.greatest() <= LONGEST_DELAY);
            }
        }
    }
}
