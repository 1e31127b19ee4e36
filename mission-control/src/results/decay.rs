//! The decay of a fleet's coordination error: from when on it is looked at, and at which rate it went.
//!
//! Summary, report and figures all ask here, so that they say the same.

use common::record::{Record, SpeedRow};

use super::Facts;
use super::html::number;
use super::series::{Coordination, speeds};
use super::statistics::{ExponentialFit, fit_coordination};

/// The decay of the norm of the coordination error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decay {
    /// When the formation speed changed for the last time under way, 0 if it never did \[s\]. A vehicle that is not told the speed
    /// errs anew with each change: what is promised is promised from the last one on.
    pub from_s: f64,
    /// The exponential that was fitted from then on, if the norm decayed.
    pub fit: Option<ExponentialFit>,
}

impl Decay {
    /// The decay in a recording with these coordination states.
    pub(super) fn of(coordination: &Coordination, exact: &[Record], facts: &Facts) -> Decay {
        let from_s = last_change(&speeds(exact), facts.duration_s);
        let disturbance = coordination.disturbance.as_deref();
        let fit = fit_coordination(&coordination.t_s, &coordination.norm(), disturbance, from_s, facts.link_period_s);
        Decay { from_s, fit }
    }
}

/// In which part of the run a fit was made.
pub(super) fn fitted_where(fit: &ExponentialFit) -> String {
    format!("fitted from {} s to {} s", number(fit.from_s), number(fit.to_s))
}

/// When the formation speed changed for the last time under way \[s\]; zero if it never did.
fn last_change(speeds: &[&SpeedRow], end_s: f64) -> f64 {
    let changes = speeds.windows(2).filter(|pair| pair[0].speed != pair[1].speed);
    changes.map(|pair| pair[1].t_ns as f64 / 1e9).filter(|t_s| *t_s < end_s).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_change_under_way_counts() {
        let row = |t_s: i64, speed| SpeedRow { t_ns: t_s * 1_000_000_000, speed };
        let rows = [row(0, 0.1), row(150, 0.15), row(200, 0.15), row(400, 0.3)];
        let last = |end_s| last_change(&rows.iter().collect::<Vec<_>>(), end_s);
        // The same speed again is no change, and one at the end changes nothing any more.
        assert_eq!((last(400.0), last(401.0)), (150.0, 400.0));
        assert_eq!(last_change(&[&rows[0]], 400.0), 0.0);
    }
}
