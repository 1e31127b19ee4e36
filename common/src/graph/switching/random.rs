//! Random losses that never exceed brief connectivity losses (Definition 4.3).
//!
//! Let E(t) be the largest T_p(τ, t) − α(t − τ) over all windows that end at t. It is a leaky bucket: it fills at rate
//! 1 − α while links are down, drains at rate α while they are up, and is never below zero (the empty window). So
//!
//! ```text
//! T_p(τ, t) ≤ α(t − τ) + (1 − α)T_0 for every window     iff     E(t) ≤ (1 − α)T_0 always,     (4.11)
//! ```
//!
//! and a loss may begin with E in the bucket only if it ends within T_0 − E/(1 − α). As long as the bucket is never
//! drained beyond empty, E(t) = E(0) + T_p(0, t) − αt stays bounded, and then T_p(0, t)/t tends to α exactly. Both durations
//! are therefore drawn uniformly between what dwell allows and what the bucket allows.
//!
//! The bucket is an integer, with α rounded down to a multiple of 2⁻³²: a smaller α with the same T_0 is a stricter
//! (4.11), hence nothing is lost to rounding.

use super::instant;
use crate::random::Stream;
use crate::time::{Span, Time};

/// One, as a fixed-point fraction.
const ONE: i128 = 1 << 32;

/// Shortest dwell \[ns\]; bounds the work per second of signal.
const SHORTEST_DWELL: i128 = 1_000_000;

/// All links together, up and down by turns.
#[derive(Clone, Debug)]
pub(super) struct RandomLosses {
    /// α in units of 1/[`ONE`], strictly between 0 and [`ONE`].
    alpha: i128,
    t_0: i128,
    dwell: i128,
    stream: Stream,
    up: bool,
    /// When the present state ends \[ns\].
    until: i128,
    /// E at that instant \[ns / [`ONE`]\].
    excess: i128,
}

impl RandomLosses {
    /// `None` if no loss is possible: a rate of zero (or not a number), or a T_0 shorter than the dwell.
    pub(super) fn new(alpha: f64, t_0: Span, dwell: Span, stream: Stream) -> Option<RandomLosses> {
        // The cast takes NaN to zero and saturates.
        let alpha = ((alpha * ONE as f64) as i128).clamp(0, ONE - 1);
        let t_0 = i128::from(t_0.nanos());
        let dwell = i128::from(dwell.nanos()).max(SHORTEST_DWELL);
        if alpha == 0 || t_0 < dwell {
            return None;
        }
        let mut losses = RandomLosses { alpha, t_0, dwell, stream, up: true, until: 0, excess: 0 };
        // Begin as if in the midst of things: something already in the bucket, and down as often as not up.
        losses.excess = losses.draw(0, (ONE - alpha) * (t_0 - dwell));
        losses.up = losses.stream.chance(alpha as f64 / ONE as f64);
        losses.turn();
        Some(losses)
    }

    pub(super) fn is_up(&mut self, t: Time) -> bool {
        self.advance(t);
        self.up
    }

    pub(super) fn next_change_after(&mut self, t: Time) -> Option<Time> {
        self.advance(t);
        instant(self.until)
    }

    fn advance(&mut self, t: Time) {
        while self.until <= i128::from(t.nanos()) {
            self.turn();
        }
    }

    /// Changes state at `until` and draws how long the new state lasts.
    fn turn(&mut self) {
        self.up = !self.up;
        if self.up {
            // At least until another loss of one dwell fits; at most until the bucket is empty.
            let fits = (self.excess - (ONE - self.alpha) * (self.t_0 - self.dwell)).max(0);
            let shortest = divide_up(fits, self.alpha).max(self.dwell);
            let lasts = self.draw(shortest, self.excess / self.alpha);
            self.until += lasts;
            self.excess = (self.excess - self.alpha * lasts).max(0);
        } else {
            // Preferably long enough that the next recovery, at least one dwell long, does not find the bucket empty.
            let longest = self.t_0 - divide_up(self.excess, ONE - self.alpha);
            let fills = (self.alpha * self.dwell - self.excess).max(0);
            let shortest = divide_up(fills, ONE - self.alpha).max(self.dwell).min(longest);
            let lasts = self.draw(shortest, longest);
            self.until += lasts;
            self.excess += (ONE - self.alpha) * lasts;
        }
    }

    /// Uniform on \[low, high\]; `low` if that is empty.
    fn draw(&mut self, low: i128, high: i128) -> i128 {
        let width = (high - low).max(0);
        low + ((width as f64 * self.stream.unit()) as i128).min(width)
    }
}

/// ⌈a/b⌉ for a ≥ 0, b > 0.
fn divide_up(a: i128, b: i128) -> i128 {
    (a + b - 1) / b
}

#[cfg(test)]
mod tests {
    use super::RandomLosses;
    use crate::random::Stream;
    use crate::time::{Span, Time};
    use proptest::prelude::*;

    /// Durations of the signal up to `end`, as (up, seconds), the last one cut off.
    fn phases(losses: &mut RandomLosses, end: f64) -> Vec<(bool, f64)> {
        let (mut t, end) = (Time::ZERO, Time::from_secs(end));
        let mut phases = Vec::new();
        while t < end {
            let up = losses.is_up(t);
            let next = losses.next_change_after(t).map_or(end, |next| next.min(end));
            phases.push((up, (next - t).secs()));
            t = next;
        }
        phases
    }

    fn loss_rate(phases: &[(bool, f64)]) -> f64 {
        let lost: f64 = phases.iter().filter(|(up, _)| !up).map(|(_, lasts)| lasts).sum();
        lost / phases.iter().map(|(_, lasts)| lasts).sum::<f64>()
    }

    #[test]
    fn the_loss_rate_is_alpha_and_losses_last_up_to_t_0() {
        for alpha in [0.1, 0.5, 0.75, 0.9] {
            let mut losses =
                RandomLosses::new(alpha, Span::from_secs(7.5), Span::from_secs(0.5), Stream::new(5, "loss"))
                    .expect("losses are possible");
            let phases = phases(&mut losses, 20_000.0);
            // E is bounded by (1 - alpha) T_0, so the rate is off by at most that over the length of the run.
            assert!((loss_rate(&phases) - alpha).abs() <= 7.5 / 20_000.0, "{alpha}: {}", loss_rate(&phases));
            let longest = phases.iter().filter(|(up, _)| !up).map(|(_, lasts)| *lasts).fold(0.0, f64::max);
            assert!(longest > 0.8 * 7.5 && longest <= 7.5, "{alpha}: {longest}");
        }
    }

    #[test]
    fn another_seed_is_another_signal_and_a_clone_replays() {
        let make = |seed| RandomLosses::new(0.5, Span::from_secs(3.0), Span::from_secs(0.1), Stream::new(seed, "p"));
        let [one, two] = [1, 2].map(|seed| make(seed).expect("losses are possible"));
        let play = |losses: &RandomLosses| phases(&mut losses.clone(), 100.0);
        assert_eq!(play(&one), play(&one));
        assert_ne!(play(&one), play(&two));
    }

    proptest! {
        #[test]
        fn no_window_ever_loses_more_than_definition_4_3_allows(
            alpha in 0.001..0.999f64, t_0 in 0.001..20.0f64, dwell in 0.0..2.0f64, seed in any::<u64>()
        ) {
            let Some(mut losses) =
                RandomLosses::new(alpha, Span::from_secs(t_0), Span::from_secs(dwell), Stream::new(seed, "p"))
            else {
                prop_assert!(t_0 < dwell + 1e-9 || t_0 < 0.001 + 1e-9);
                return Ok(());
            };
            let phases = phases(&mut losses, 100.0 * t_0);
            // Every window that begins or ends inside a phase is dominated by one that begins and ends at changes.
            let recent = &phases[phases.len().saturating_sub(60)..];
            for first in 0..recent.len() {
                let (mut lost, mut total) = (0.0, 0.0);
                for (up, lasts) in &recent[first..] {
                    lost += if *up { 0.0 } else { *lasts };
                    total += lasts;
                    prop_assert!(lost <= alpha * total + (1.0 - alpha) * t_0 + 1e-9 * t_0);
                }
            }
            let whole = &phases[..phases.len() - 1];
            prop_assert!(whole.iter().all(|(_, lasts)| *lasts >= dwell.max(0.001) - 1e-9));
        }
    }
}
