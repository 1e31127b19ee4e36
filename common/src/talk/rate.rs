//! The rate at which another vehicle moves, from what it said last.

use crate::time::Time;

/// Messages that are kept.
const KEPT: usize = 8;
/// A vehicle is taken to move at most at this multiple of the formation speed, and never backwards.
const FASTEST: f64 = 2.0;

/// The last few of one vehicle's messages.
///
/// Only the instants at which messages were *made* count, so that it does not matter how late and how irregularly they
/// arrive. The estimate is the median of the slopes between successive messages: a single jump, of a vehicle that
/// rejoined for instance, does not show.
#[derive(Clone, Copy, Debug, Default)]
pub struct RateEstimate {
    /// Slopes between successive messages \[units of ξ per s\], the oldest overwritten first.
    slopes: [f64; KEPT],
    count: usize,
    next: usize,
    newest: Option<(Time, f64)>,
}

impl RateEstimate {
    /// Takes a message made at `made` that said `xi`; messages that are not newer than the last one change nothing.
    pub fn hear(&mut self, made: Time, xi: f64) {
        if let Some((before, xi_before)) = self.newest {
            if made <= before {
                return;
            }
            self.slopes[self.next] = (xi - xi_before) / (made - before).secs();
            self.next = (self.next + 1) % KEPT;
            self.count = (self.count + 1).min(KEPT);
        }
        self.newest = Some((made, xi));
    }

    /// The estimate \[units of ξ per s\], between 0 and 2 v_L; v_L if there are fewer than two messages.
    pub fn rate(&self, v_l: f64) -> f64 {
        let mut slopes = self.slopes;
        let known = &mut slopes[..self.count];
        known.sort_unstable_by(f64::total_cmp);
        let median = match self.count {
            0 => return v_l,
            odd if odd % 2 == 1 => known[odd / 2],
            even => 0.5 * (known[even / 2 - 1] + known[even / 2]),
        };
        let most = FASTEST * v_l;
        if median.is_finite() { median.clamp(most.min(0.0), most.max(0.0)) } else { v_l }
    }
}

#[cfg(test)]
mod tests {
    use super::RateEstimate;
    use crate::time::Time;
    use proptest::prelude::*;

    fn heard(messages: impl IntoIterator<Item = (f64, f64)>) -> RateEstimate {
        let mut estimate = RateEstimate::default();
        messages.into_iter().for_each(|(made, xi)| estimate.hear(Time::from_secs(made), xi));
        estimate
    }

    #[test]
    fn who_said_less_than_two_things_moves_at_v_l() {
        assert_eq!(heard([]).rate(0.5), 0.5);
        assert_eq!(heard([(3.0, 7.0)]).rate(0.5), 0.5);
        assert_eq!(heard([(3.0, 7.0), (3.0, 9.0), (2.0, 1.0)]).rate(0.5), 0.5, "not newer");
    }

    #[test]
    fn one_jump_does_not_show() {
        let jump = |t: f64| if t < 3.5 { 0.3 * t } else { 0.3 * t + 40.0 };
        let estimate = heard((0..7).map(|n| (f64::from(n), jump(f64::from(n)))));
        assert!((estimate.rate(0.5) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn nobody_runs_away_or_back() {
        assert_eq!(heard([(0.0, 0.0), (1.0, 9.0)]).rate(0.5), 1.0);
        assert_eq!(heard([(0.0, 0.0), (1.0, -9.0)]).rate(0.5), 0.0);
        assert_eq!(heard([(0.0, 0.0), (1.0, -9.0)]).rate(-0.5), -1.0, "where the fleet goes backwards");
        assert_eq!(heard([(0.0, -1e308), (1e-9, 1e308)]).rate(0.5), 0.5, "no number");
    }

    proptest! {
        #[test]
        fn a_steady_vehicle_is_known_exactly_however_irregularly_it_speaks(
            rate in 0.0..1.0f64, gaps in proptest::collection::vec(0.01..20.0f64, 2..30),
        ) {
            let mut t = 0.0;
            let estimate = heard(gaps.iter().map(|gap| { t += gap; (t, 3.0 + rate * t) }));
            prop_assert!((estimate.rate(0.5) - rate).abs() < 1e-6);
        }
    }
}
