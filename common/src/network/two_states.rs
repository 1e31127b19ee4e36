//! A two-state Markov chain by message number: bursts and gaps (Gilbert 1960).
//!
//! From message to message the chain enters a burst with probability 1/gap and leaves it with 1/burst, so that bursts and
//! gaps last that many messages in the mean. Its transition matrix is
//!
//! ```text
//! P = λ I + (1 − λ) 1 π',   λ = 1 − 1/burst − 1/gap ≥ 0,   π = (share of bursts, share of gaps).
//! ```
//!
//! In words: with probability 1 − λ message m draws its state anew from π, else it has the state of message m − 1. So the
//! state at m is the one drawn at the last renewal at or before m: a function of seed, name and m alone, whichever
//! messages were asked about before. λ < 0 would be bursts shorter than those of independent losses.

use crate::random::{LANES, Stream};

/// Furthest back that a renewal is looked for; beyond it the state is taken from π.
pub(super) const FURTHEST: u64 = 100_000;

/// Lanes of the stream: whether the message renews the state, and to what.
pub(super) const RENEWS: usize = 6;
pub(super) const STATE: usize = 7;

/// Bursts and gaps over message numbers.
#[derive(Clone, Debug)]
pub struct TwoStates {
    /// 1 − λ.
    renewal: f64,
    /// Long-run share of bursts.
    share: f64,
    /// The last answer: a message number and its state.
    last: Option<(u64, bool)>,
}

impl TwoStates {
    /// Bursts of `burst` and gaps of `gap` messages in the mean, both at least 1, with 1/burst + 1/gap ≤ 1.
    pub fn new(burst: f64, gap: f64) -> TwoStates {
        let share = if gap.is_finite() { burst / (burst + gap) } else { 0.0 };
        TwoStates { renewal: (1.0 / burst + 1.0 / gap).clamp(0.0, 1.0), share, last: None }
    }

    /// The long-run share of messages in a burst.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Whether message `number` is in a burst; `drawn` are its own numbers of `stream`.
    pub fn in_burst(&mut self, stream: &mut Stream, number: u64, drawn: &[f64; LANES]) -> bool {
        let state = self.find(stream, number, drawn);
        self.last = Some((number, state));
        state
    }

    fn find(&self, stream: &mut Stream, number: u64, drawn: &[f64; LANES]) -> bool {
        let mut drawn = *drawn;
        let mut m = number;
        loop {
            if self.last.is_some_and(|(asked, _)| asked == m) {
                return self.last.is_some_and(|(_, state)| state);
            }
            if drawn[RENEWS] < self.renewal || m == 0 || number - m >= FURTHEST {
                return drawn[STATE] < self.share;
            }
            m -= 1;
            drawn = stream.units_at(m);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn states(chain: &mut TwoStates, seed: u64, numbers: impl Iterator<Item = u64>) -> Vec<bool> {
        let mut stream = Stream::new(seed, "fades");
        numbers
            .map(|number| {
                let drawn = stream.units_at(number);
                chain.in_burst(&mut stream, number, &drawn)
            })
            .collect()
    }

    /// Mean lengths of bursts and gaps, and how many bursts there were.
    fn mean_lengths(states: &[bool]) -> (f64, f64, f64) {
        let bursts = states.windows(2).filter(|pair| pair[1] && !pair[0]).count().max(1) as f64;
        let lost = states.iter().filter(|state| **state).count() as f64;
        (lost / bursts, (states.len() as f64 - lost) / bursts, bursts)
    }

    #[test]
    fn bursts_and_gaps_last_as_long_as_told_in_the_mean() {
        for (burst, gap) in [(4.0, 16.0), (1.5, 3.0), (20.0, 20.0)] {
            let (found_burst, found_gap, bursts) =
                mean_lengths(&states(&mut TwoStates::new(burst, gap), 3, 0..200_000));
            // Lengths are geometric: standard deviation √(mean (mean − 1)) each.
            for (found, mean) in [(found_burst, burst), (found_gap, gap)] {
                let bound = 5.0 * (mean * (mean - 1.0_f64)).sqrt() / bursts.sqrt();
                assert!((found - mean).abs() < bound, "{found} for {mean} ± {bound}");
            }
        }
    }

    #[test]
    fn with_independent_losses_it_is_bernoulli() {
        // Burst 1/(1 − p) and gap 1/p are those of independent losses; then λ = 0 and every message renews.
        let chain = TwoStates::new(4.0 / 3.0, 4.0);
        assert!((chain.renewal - 1.0).abs() < 1e-12 && (chain.share() - 0.25).abs() < 1e-12);
    }

    proptest! {
        /// The state belongs to the message, whatever was asked before.
        #[test]
        fn the_state_of_a_message_does_not_depend_on_what_was_asked(
            seed in any::<u64>(), burst in 1.0..30.0f64, more in 0.0..50.0f64, skips in prop::collection::vec(1u64..50, 1..40)
        ) {
            // A gap that keeps 1/burst + 1/gap at 1 or below.
            let gap = burst / (burst - 1.0).max(1e-3) + more;
            let all = states(&mut TwoStates::new(burst, gap), seed, 0..2000);
            let mut number = 0;
            let some: Vec<u64> = skips.iter().map(|skip| { number += skip; number }).collect();
            let found = states(&mut TwoStates::new(burst, gap), seed, some.iter().copied());
            for (number, state) in some.iter().zip(found) {
                prop_assert_eq!(state, all[*number as usize], "message {}", number);
            }
        }
    }

    #[test]
    fn a_jump_over_billions_of_messages_is_answered_at_once() {
        let mut chain = TwoStates::new(1e12, 1e12);
        assert_eq!(states(&mut chain, 1, [0, u64::from(u32::MAX)].into_iter()).len(), 2);
    }
}
