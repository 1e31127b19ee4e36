//! Fades that links share, in part: bursts and gaps by message number, as [`TwoStates`](super::TwoStates) has them on every link.
//!
//! A link draws its state anew in two ways: together with all other links, with probability a from message to message, and for
//! itself, with probability b. In between it keeps what it drew last. If both happen at once, what is drawn together counts. Then
//! a single link is the two-state chain with
//!
//! ```text
//! λ = (1 − a)(1 − b),   λ = 1 − 1/burst − 1/gap
//! ```
//!
//! whatever a is: share, bursts and gaps are as told. Two links are in the same state for sure if both drew theirs last in the same common
//! draw, and independent otherwise. Back from message m, that is a common draw before either drew for itself:
//!
//! ```text
//! ρ = a/(1 − (1 − a)(1 − b)²),   so   a² − (1 + ρ) a + ρ(1 − λ²) = 0
//! ```
//!
//! is the correlation of their losses. ρ = 0 gives a = 0, ρ = 1 gives b = 0. (Marshall and Olkin 1967 have common shocks like this in
//! continuous time.)

use super::two_states::{FURTHEST, RENEWS, STATE};
use crate::random::{LANES, Stream};

/// The fades of one link.
#[derive(Clone, Debug)]
pub struct SharedFades {
    /// a.
    together: f64,
    /// b.
    alone: f64,
    /// Long-run share of messages in a fade.
    share: f64,
    /// The stream of what is drawn together, the same for all links.
    common: Box<Stream>,
    /// The last answer: a message number and its state.
    last: Option<(u64, bool)>,
}

impl SharedFades {
    /// Fades of `burst` messages in the mean, with the share `share` of all messages in one, above 0 and below 1, and with correlation
    /// `correlation`, 0 to 1, between any two links; `burst` at least 1/(1 − `share`). `common` is the same stream for all links.
    pub fn new(share: f64, burst: f64, correlation: f64, common: Stream) -> SharedFades {
        let gap = burst * (1.0 - share) / share;
        let renewal = (1.0 / burst + 1.0 / gap).clamp(0.0, 1.0);
        let together = rate_together(renewal, correlation);
        let alone = if together < 1.0 { (1.0 - (1.0 - renewal) / (1.0 - together)).clamp(0.0, 1.0) } else { 0.0 };
        SharedFades { together, alone, share, common: Box::new(common), last: None }
    }

    /// The long-run share of messages in a fade.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Whether message `number` is in a fade; `drawn` are its own numbers of the link's stream.
    pub fn in_fade(&mut self, own: &mut Stream, number: u64, drawn: &[f64; LANES]) -> bool {
        let state = self.find(own, number, *drawn);
        self.last = Some((number, state));
        state
    }

    fn find(&mut self, own: &mut Stream, number: u64, mut drawn: [f64; LANES]) -> bool {
        let mut m = number;
        loop {
            if let Some((_, state)) = self.last.filter(|(asked, _)| *asked == m) {
                return state;
            }
            let common = self.common.units_at(m);
            if common[RENEWS] < self.together {
                return common[STATE] < self.share;
            }
            if drawn[RENEWS] < self.alone || m == 0 || number - m >= FURTHEST {
                return drawn[STATE] < self.share;
            }
            m -= 1;
            drawn = own.units_at(m);
        }
    }
}

/// a for 1 − λ and ρ: the smaller root, in a form that loses no digits.
fn rate_together(renewal: f64, rho: f64) -> f64 {
    let product = rho * renewal * (2.0 - renewal);
    let root = ((1.0 + rho).powi(2) - 4.0 * product).max(0.0).sqrt();
    (2.0 * product / (1.0 + rho + root)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn fades(share: f64, burst: f64, correlation: f64) -> SharedFades {
        SharedFades::new(share, burst, correlation, Stream::new(9, "fades"))
    }

    fn states(mut fades: SharedFades, link: &str, numbers: impl Iterator<Item = u64>) -> Vec<bool> {
        let mut stream = Stream::new(9, link);
        numbers
            .map(|number| {
                let drawn = stream.units_at(number);
                fades.in_fade(&mut stream, number, &drawn)
            })
            .collect()
    }

    #[test]
    fn rates_at_points() {
        for renewal in [0.01, 0.3, 1.0] {
            assert_eq!(rate_together(renewal, 0.0), 0.0, "nothing is shared");
            assert!((rate_together(renewal, 1.0) - renewal).abs() < 1e-12, "all is");
        }
        // Independent losses, λ = 0: one in ρ of them is drawn together.
        let plain = fades(0.2, 1.25, 0.3);
        assert!((plain.together - 0.3).abs() < 1e-12 && (plain.alone - 1.0).abs() < 1e-12, "{plain:?}");
    }

    #[test]
    fn share_and_fades_are_as_told_whatever_is_shared() {
        let (n, share, burst) = (400_000, 0.3, 10.0);
        for correlation in [0.0, 0.3, 0.7, 1.0] {
            let lost = states(fades(share, burst, correlation), "a", 0..n);
            let bursts = lost.windows(2).filter(|pair| pair[1] && !pair[0]).count() as f64;
            let all = lost.iter().filter(|lost| **lost).count() as f64;
            // Lengths are geometric: standard deviation √(mean (mean − 1)). Bursts make n messages worth n/(2 burst) independent ones.
            let of_length = 5.0 * (burst * (burst - 1.0)).sqrt() / bursts.sqrt();
            let of_share = 5.0 * (share * (1.0 - share) * 2.0 * burst / n as f64).sqrt();
            assert!((all / bursts - burst).abs() < of_length, "{} ± {of_length} at {correlation}", all / bursts);
            assert!((all / n as f64 - share).abs() < of_share, "{} ± {of_share} at {correlation}", all / n as f64);
        }
    }

    #[test]
    fn two_links_are_as_correlated_as_told() {
        let (n, share, burst) = (400_000, 0.3, 3.0);
        // With z = (x − p)/√(pq), the estimate is the mean of products z_a z_b: each has a variance of at most E z⁴ = 1/pq − 3,
        // and k messages apart they are correlated by at most λ^k.
        let variance: f64 = share * (1.0 - share);
        let lambda = 1.0 - 1.0 / (burst * (1.0 - share));
        let bound = 5.0 * ((1.0 / variance - 3.0) * (1.0 + lambda) / (1.0 - lambda) / n as f64).sqrt();
        for correlation in [0.0, 0.25, 0.5, 0.9, 1.0] {
            let z = |link| {
                let lost = states(fades(share, burst, correlation), link, 0..n);
                lost.into_iter().map(|lost| (f64::from(u8::from(lost)) - share) / variance.sqrt()).collect::<Vec<_>>()
            };
            let found = z("a").iter().zip(z("b")).map(|(a, b)| a * b).sum::<f64>() / n as f64;
            assert!((found - correlation).abs() < bound, "{found} for {correlation} ± {bound}");
        }
    }

    proptest! {
        #[test]
        fn the_rates_give_the_chain_and_the_correlation(share in 0.01..0.99f64, more in 0.0..50.0f64, rho in 0.0..=1.0f64) {
            let burst = 1.0 / (1.0 - share) + more;
            let fades = fades(share, burst, rho);
            let (a, b) = (fades.together, fades.alone);
            let renewal = 1.0 / burst + share / (burst * (1.0 - share));
            prop_assert!((1.0 - (1.0 - a) * (1.0 - b) - renewal).abs() < 1e-9);
            prop_assert!((a - rho * (1.0 - (1.0 - a) * (1.0 - b).powi(2))).abs() < 1e-9);
        }

        /// The state belongs to the message, whatever was asked before.
        #[test]
        fn the_state_of_a_message_does_not_depend_on_what_was_asked(
            share in 0.1..0.9f64, more in 0.0..30.0f64, rho in 0.0..=1.0f64, skips in prop::collection::vec(1u64..50, 1..40)
        ) {
            let fades = fades(share, 1.0 / (1.0 - share) + more, rho);
            let all = states(fades.clone(), "a", 0..2000);
            let mut number = 0;
            let some: Vec<u64> = skips.iter().map(|skip| { number += skip; number }).collect();
            for (number, state) in some.iter().zip(states(fades, "a", some.iter().copied())) {
                prop_assert_eq!(state, all[*number as usize], "message {}", number);
            }
        }
    }

    #[test]
    fn a_jump_over_billions_of_messages_is_answered_at_once() {
        assert_eq!(states(fades(0.5, 1e6, 0.5), "a", [0, u64::from(u32::MAX)].into_iter()).len(), 2);
    }
}
