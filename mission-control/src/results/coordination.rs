//! How the fleet agreed, in numbers.

use serde::Serialize;

use super::Facts;
use super::series::{Coordination, is_early, steady_part};
use super::statistics::{ExponentialFit, FIT_PART, SETTLED_PART, largest, rms, settling_time, thinned};

/// A fleet counts as coordinated when its largest difference stays below this \[units of ξ\].
const COORDINATION_THRESHOLD: f64 = 1e-2;
/// Time series in the summary have at most about this many samples.
const SERIES_SAMPLES: usize = 600;

/// How the fleet agreed. x_i = ξ_i − h_i, the coordination state with the pattern removed. What was never measured is NaN, `null` in
/// JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoordinationSummary {
    /// Unit of all values.
    pub unit: String,
    /// max |x_i − x_j| at the first common instant.
    pub initial: f64,
    /// Its largest value.
    pub largest: f64,
    /// Its value at the end, or when the whole fleet was last recorded.
    pub last: f64,
    /// That instant \[s\]; `None` if the fleet never was.
    pub last_s: Option<f64>,
    /// Its root mean square in the steady part.
    pub steady_rms: f64,
    /// From when on it stayed below 2 % of its largest value \[s\].
    pub settled_s: Option<f64>,
    /// From when on it stayed below 0.01 \[s\].
    pub settled_absolute_s: Option<f64>,
    /// The exponential fitted to ‖(I − 11ᵀ/n)x‖.
    pub fit: Option<ExponentialFit>,
    /// The rate that theory guarantees for that norm \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// Whether the fitted rate is at least the guaranteed one, to two parts in a hundred and as far as a law that is held for a control
    /// period reaches it; `None` if one of them is not known, or
    /// vehicles were not on their paths while the error decayed.
    pub at_least_guaranteed: Option<bool>,
    /// The error over time.
    pub series: CoordinationSeries,
}

/// The coordination error over time, thinned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoordinationSeries {
    /// Instants \[s\].
    pub t_s: Vec<f64>,
    /// max |x_i − x_j|.
    pub largest: Vec<f64>,
    /// ‖(I − 11ᵀ/n)x‖.
    pub norm: Vec<f64>,
}

impl CoordinationSummary {
    /// The numbers of these coordination states, of which `fit` is the fitted decay.
    pub(super) fn of(coordination: &Coordination, facts: &Facts, fit: Option<ExponentialFit>) -> CoordinationSummary {
        let (t_s, spread, norm) = (&coordination.t_s, coordination.spread(), coordination.norm());
        let peak = largest(spread.iter().copied());
        let kept = thinned(t_s.len(), SERIES_SAMPLES);
        let pick = |values: &[f64]| kept.iter().map(|index| values[*index]).collect();
        let steady = steady_part(t_s, facts);
        let mut summary = CoordinationSummary {
            unit: facts.xi_unit.clone(),
            initial: spread.first().copied().unwrap_or(f64::NAN),
            largest: peak,
            last: spread.last().copied().unwrap_or(f64::NAN),
            last_s: t_s.last().copied(),
            steady_rms: rms(spread[steady..].iter().copied()),
            settled_s: settling_time(t_s, &spread, SETTLED_PART * peak),
            settled_absolute_s: settling_time(t_s, &spread, COORDINATION_THRESHOLD),
            fit,
            guaranteed_rate: None,
            at_least_guaranteed: None,
            series: CoordinationSeries { t_s: pick(t_s), largest: pick(&spread), norm: pick(&norm) },
        };
        summary.hold_against(facts.guaranteed_rate, facts.least_rate);
        summary
    }

    /// Takes this as the rate that theory guarantees, and this as what a flight can show of it, where that is less.
    pub(super) fn hold_against(&mut self, guaranteed_rate: Option<f64>, least_rate: Option<f64>) {
        self.guaranteed_rate = guaranteed_rate;
        let comparable = self.fit.filter(|fit| fit.on_paths).zip(guaranteed_rate);
        let least = |guaranteed: f64| least_rate.map_or(guaranteed, |least| least.min(guaranteed));
        self.at_least_guaranteed = comparable.map(|(fit, guaranteed)| fit.rate >= (1.0 - FIT_PART) * least(guaranteed));
    }

    /// ‖e‖ = ‖(I − 11ᵀ/n)x‖ at the instant of the last value.
    pub fn last_norm(&self) -> f64 {
        self.series.norm.last().copied().unwrap_or(f64::NAN)
    }

    /// The instant of the last value, if that is not the end of the run: a vehicle was away from then on.
    pub fn early(&self, duration_s: f64) -> Option<f64> {
        self.last_s.filter(|last_s| is_early(*last_s, duration_s))
    }
}
