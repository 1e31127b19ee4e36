//! Settling times, the fitted exponential rate, and other numbers of a time series.

use serde::Serialize;

/// A fitted rate is good to this part: ripples and sampled laws cost that much.
pub const FIT_PART: f64 = 0.02;

/// Settling, without an absolute threshold, means to stay below this part of the largest value.
pub(super) const SETTLED_PART: f64 = 0.02;

/// An exponential decay fitted to the norm of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExponentialFit {
    /// The rate λ of exp(−λt) \[1/s\].
    pub rate: f64,
    /// Start of the part of the series that was fitted \[s\].
    pub from_s: f64,
    /// Its end \[s\].
    pub to_s: f64,
    /// Natural logarithm of how much the series fell in that part.
    pub decay_nats: f64,
    /// Median absolute deviation of the logarithm from the line: 0 for a pure exponential.
    pub scatter_nats: f64,
    /// Whether vehicles were on their paths in that part, as statements about rates ask (d = 0): what path following did
    /// to the error was small against its decay.
    pub on_paths: bool,
}

/// The first instant from which on `values` stay at or below `threshold`; `None` if the last one is above, or there
/// is none.
pub fn settling_time(times: &[f64], values: &[f64], threshold: f64) -> Option<f64> {
    let outside = |value: &f64| value.is_nan() || value.abs() > threshold;
    let next = values.iter().rposition(outside).map_or(0, |last| last + 1);
    times.get(next).copied()
}

/// Fits exp(−λt) to a series of norms (non-negative, in order of time); `None` if it does not fall by a factor 3.
///
/// The part that is fitted begins when the series has come down to half of its peak (the transient is over), and ends
/// when it has come down for good to three times its floor. The floor is what 90 % of the last tenth of the run stay
/// below; there is none if the series still falls in the end, by 70 % of its mean slope or more. With a `period`
/// (of the switching network, whose outages make the decay a staircase) the part is cut to whole periods. The slope
/// of the logarithm is the median of the slopes between all pairs of about 200 evenly spaced samples (Theil and Sen),
/// which steps, ripples and outliers move little.
pub fn fit_exponential(times: &[f64], norms: &[f64], period: Option<f64>) -> Option<ExponentialFit> {
    const SAMPLES: usize = 200;
    let count = times.len().min(norms.len());
    let (times, norms) = (&times[..count], &norms[..count]);
    let peak = (0..count).max_by(|a, b| norms[*a].total_cmp(&norms[*b]))?;
    let begin = (peak..count).find(|index| norms[*index] <= norms[peak] / 2.0)?;
    let tenth = |number: usize| sorted(&norms[count * (number - 1) / 10..count * number / 10]);
    let (ninth, last) = (quantile(&tenth(9), 0.5)?, quantile(&tenth(10), 0.5)?);
    let tenths = 9.5 - 10.0 * begin as f64 / count as f64;
    let still_falling = (ninth / last).ln() >= 0.7 * (norms[begin] / last).ln() / tenths.max(0.5);
    let floor = if still_falling { 0.0 } else { quantile(&tenth(10), 0.9)? };
    let settled = settling_time(times, norms, 3.0 * floor).unwrap_or(f64::INFINITY);
    let from_s = times[begin];
    let mut to_s = times[count - 1].min(settled);
    if let Some(period) = period.filter(|period| *period > 0.0 && to_s - from_s >= *period) {
        to_s = from_s + ((to_s - from_s) / period).floor() * period;
    }
    let mut samples = Vec::with_capacity(SAMPLES + 1);
    for step in 0..=SAMPLES {
        let wanted = from_s + (to_s - from_s) * step as f64 / SAMPLES as f64;
        let index = times.partition_point(|time| *time < wanted - 1e-9).min(count - 1);
        let sample = (times[index], norms[index].ln());
        if sample.1.is_finite() && samples.last() != Some(&sample) {
            samples.push(sample);
        }
    }
    let (first, last) = (*samples.first()?, *samples.last()?);
    let decay_nats = first.1 - last.1;
    if samples.len() < 8 || decay_nats < 3.0_f64.ln() {
        return None;
    }
    let mut slopes = Vec::with_capacity(samples.len() * samples.len() / 2);
    for (index, a) in samples.iter().enumerate() {
        slopes.extend(samples[index + 1..].iter().filter(|b| b.0 > a.0).map(|b| (b.1 - a.1) / (b.0 - a.0)));
    }
    let slope = quantile(&sorted(&slopes), 0.5)?;
    let intercept = quantile(&sorted(&samples.iter().map(|(t, y)| y - slope * t).collect::<Vec<_>>()), 0.5)?;
    let residuals: Vec<f64> = samples.iter().map(|(t, y)| (y - slope * t - intercept).abs()).collect();
    let scatter_nats = quantile(&sorted(&residuals), 0.5)?;
    Some(ExponentialFit { rate: -slope, from_s: first.0, to_s: last.0, decay_nats, scatter_nats, on_paths: true })
}

/// Fits the decay of a coordination error from `from_s` on, which is when the formation speed changed for the last time.
///
/// `disturbance` is ‖d‖, how fast path following drives the error (3.36). The part that is fitted is the longest in which it is
/// below [`FIT_PART`] of the decay itself: an error that only follows the way to the paths has no rate of its own. Without
/// such a part all is fitted, and the answer says that vehicles were not on their paths.
pub fn fit_coordination(
    times: &[f64],
    norms: &[f64],
    disturbance: Option<&[f64]>,
    from_s: f64,
    period: Option<f64>,
) -> Option<ExponentialFit> {
    let begin = times.partition_point(|time| *time < from_s - 1e-9);
    let (times, norms) = (times.get(begin..)?, norms.get(begin..)?);
    let all = fit_exponential(times, norms, period);
    let Some(d) = disturbance.and_then(|d| d.get(begin..)) else { return all };
    let all = all?;
    // Both as they are bounded from each instant on, so that a zero on the way is no calm.
    let [errors, d] = [norms, d].map(from_then_on);
    let calm = |index: usize| d[index] <= FIT_PART * all.rate * errors[index];
    let count = errors.len().min(d.len());
    let (mut longest, mut since) = (0..0, None);
    for index in 0..=count {
        match (index < count && calm(index), since) {
            (true, None) => since = Some(index),
            (false, Some(start)) => {
                since = None;
                if index - start > longest.len() {
                    longest = start..index;
                }
            }
            _ => {}
        }
    }
    // Modes that swing need more than one of their waves.
    let long = |fit: &ExponentialFit| fit.decay_nats >= 2.0;
    let calm = fit_exponential(&times[longest.clone()], &norms[longest], period).filter(long);
    Some(calm.unwrap_or(ExponentialFit { on_paths: false, ..all }))
}

/// At each index, the largest value from there on.
fn from_then_on(values: &[f64]) -> Vec<f64> {
    let mut largest = values.to_vec();
    for index in (1..largest.len()).rev() {
        largest[index - 1] = largest[index - 1].max(largest[index]);
    }
    largest
}

/// Indices of about `samples` evenly spaced entries of `count`, first and last included.
pub(super) fn thinned(count: usize, samples: usize) -> Vec<usize> {
    if count <= samples {
        return (0..count).collect();
    }
    (0..samples).map(|step| step * (count - 1) / (samples - 1)).collect()
}

/// Where the last fifth of a series begins, rounded to whole periods of the network if it has some.
pub(crate) fn steady_from(end_s: f64, start_s: f64, period: Option<f64>) -> f64 {
    let fifth = (end_s - start_s) / 5.0;
    let length = match period {
        Some(period) if period > 0.0 && period <= (end_s - start_s) / 2.0 => (fifth / period).floor().max(1.0) * period,
        _ => fifth,
    };
    end_s - length
}

/// The values in ascending order.
pub(crate) fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// The value below which a part `q` of ascending values lies (nearest rank); `None` if there are none.
pub(crate) fn quantile(ascending: &[f64], q: f64) -> Option<f64> {
    let rank = (q * ascending.len() as f64).ceil() as usize;
    ascending.get(rank.saturating_sub(1).min(ascending.len().saturating_sub(1))).copied()
}

/// Root of the mean square; NaN if there are no values, for no number is made of nothing.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    mean(values.into_iter().map(|value| value * value)).sqrt()
}

/// The mean; NaN if there are no values.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0_u64), |(sum, count), value| (sum + value, count + 1));
    sum / count as f64
}

/// The largest value; NaN if there are no values.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NAN, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(value: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..4000).map(|step| f64::from(step) * 0.05).collect();
        let values = times.iter().map(|time| value(*time)).collect();
        (times, values)
    }

    fn fitted(period: Option<f64>, value: impl Fn(f64) -> f64) -> f64 {
        let (times, values) = series(value);
        fit_exponential(&times, &values, period).expect("decays").rate
    }

    #[test]
    fn the_rate_of_a_pure_exponential_is_found() {
        assert!((fitted(None, |t| 3.0 * (-0.07 * t).exp()) - 0.07).abs() < 1e-9);
    }

    #[test]
    fn a_floor_does_not_flatten_the_rate() {
        let rate = fitted(None, |t| 3.0 * (-0.2 * t).exp() + 1e-4 * (1.0 + (7.0 * t).sin()));
        assert!((rate - 0.2).abs() < 0.004, "{rate}");
    }

    #[test]
    fn a_floor_that_is_reached_late_does_not_count() {
        let (times, values) = series(|t| 10.0 * (-0.05 * t).exp() + 1e-3 * (1.5 + (0.9 * t).sin()));
        let fit = fit_exponential(&times, &values, None).expect("decays");
        assert!((fit.rate - 0.05).abs() < 0.001 && fit.to_s < 150.0, "{fit:?}");
    }

    #[test]
    fn a_slow_decay_is_used_to_its_end() {
        let (times, values) = series(|t| (-0.012 * t).exp());
        let fit = fit_exponential(&times, &values, None).expect("decays");
        assert!((fit.rate - 0.012).abs() < 1e-9 && fit.to_s > 199.0, "{fit:?}");
    }

    #[test]
    fn a_transient_does_not_count() {
        // The critically damped answer of a double integrator: rises first, then decays at 0.1.
        let rate = fitted(None, |t| (1.0 + t) * (-0.3 * t).exp() + 0.2 * (-0.1 * t).exp());
        assert!((rate - 0.1).abs() < 0.01, "{rate}");
    }

    #[test]
    fn only_the_part_on_the_paths_counts() {
        // e' = −0.4e + d with d = e^(−t): at first the error follows d, later it decays at its own rate.
        let d = |t: f64| (-t).exp();
        let e = |t: f64| (1.2 * (-0.4 * t).exp() - d(t)) / 0.6;
        let (times, norms) = series(|t| e(t).max(1e-12));
        let disturbance: Vec<f64> = times.iter().map(|t| d(*t)).collect();
        let fit = fit_coordination(&times, &norms, Some(&disturbance), 0.0, None).expect("decays");
        assert!(fit.on_paths && fit.from_s > 4.0 && (fit.rate - 0.4).abs() < 0.004, "{fit:?}");
        // A d that lasts longer than the error leaves it no rate of its own.
        let (times, norms) = series(|t| (-0.1 * t).exp());
        let lasting: Vec<f64> = times.iter().map(|t| 0.3 * (-0.1 * t).exp()).collect();
        let fit = fit_coordination(&times, &norms, Some(&lasting), 0.0, None).expect("decays");
        assert!(!fit.on_paths && (fit.rate - 0.1).abs() < 1e-6, "{fit:?}");
        assert!(fit_coordination(&times, &norms, None, 0.0, None).is_some_and(|fit| fit.on_paths));
    }

    #[test]
    fn what_was_before_the_last_change_of_speed_does_not_count() {
        let (times, norms) = series(|t| if t < 50.0 { (-0.5 * t).exp() } else { (-0.1 * (t - 50.0)).exp() });
        let fit = fit_coordination(&times, &norms, None, 50.0, None).expect("decays");
        assert!((fit.rate - 0.1).abs() < 1e-6 && fit.from_s >= 50.0, "{fit:?}");
        assert_eq!(fit_coordination(&times, &norms, None, 1e9, None), None);
    }

    #[test]
    fn outages_make_a_staircase_of_the_mean_rate() {
        // Decay at 0.2 during the first quarter of every 10 s, nothing in the rest: Lemma 1.1 gives (1 − 0.75)·0.2.
        let connected = |t: f64| (t / 10.0).floor() * 2.5 + (t % 10.0).min(2.5);
        let rate = fitted(Some(10.0), |t| (-0.2 * connected(t)).exp());
        assert!((rate - 0.05).abs() < 0.002, "{rate}");
    }

    #[test]
    fn outliers_move_the_rate_little() {
        let rate = fitted(None, |t| (-0.05 * t).exp() * if (t * 20.0) as u64 % 17 == 3 { 5.0 } else { 1.0 });
        assert!((rate - 0.05).abs() < 0.003, "{rate}");
    }

    #[test]
    fn what_does_not_decay_has_no_rate() {
        for value in [|_| 1.0, |t: f64| 1.0 + 0.1 * t.sin(), |t: f64| (0.01 * t).exp(), |_| 0.0] {
            let (times, values) = series(value);
            assert_eq!(fit_exponential(&times, &values, None), None);
        }
        assert_eq!(fit_exponential(&[], &[], Some(1.0)), None);
    }

    #[test]
    fn settling_means_to_stay() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(settling_time(&times, &[9.0, 0.1, 2.0, 0.1, -0.1], 0.5), Some(3.0));
        assert_eq!(settling_time(&times, &[0.1; 5], 0.5), Some(0.0));
        assert_eq!(settling_time(&times, &[0.1, 0.1, 0.1, 0.1, 2.0], 0.5), None);
        assert_eq!(settling_time(&times, &[0.1, 0.1, 0.1, 0.1, f64::NAN], 0.5), None);
    }

    #[test]
    fn the_steady_part_holds_whole_periods() {
        assert_eq!(steady_from(100.0, 0.0, None), 80.0);
        assert_eq!(steady_from(100.0, 0.0, Some(7.0)), 86.0);
        assert_eq!(steady_from(100.0, 0.0, Some(30.0)), 70.0);
        assert_eq!(steady_from(100.0, 0.0, Some(80.0)), 80.0);
    }

    #[test]
    fn quantiles_are_values_that_occurred() {
        let values = sorted(&[4.0, 1.0, 3.0, 2.0]);
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(|q| quantile(&values, q)), [Some(1.0), Some(2.0), Some(4.0), Some(4.0)]);
        assert_eq!(quantile(&[], 0.5), None);
    }
}
