//! Lemma 1.1: a scalar error that decays only while the vehicles communicate.
//!
//! x' = −a(1 − p(t))x (1.7), with p = 1 during silence. If no window of length T is silent for more than αT, then
//!
//! ```text
//! |x(t)| ≤ b e^{−(1 − α)a(t − t_0)} |x(t_0)|,    b = e^{a(1 − α)T}
//! ```
//!
//! The print asks this of *all* windows of at least T, but the proof only cuts time into windows of T; and its own
//! example, one second of silence in three, has two in a window of four (erratum 1.1).

use super::Verdict;
use crate::graph::measure::Connectivity;
use crate::time::Span;

/// (1 − α)a: the rate at which |x| decays \[1/s\].
pub fn rate(a: f64, alpha: f64) -> f64 {
    (1.0 - alpha) * a
}

/// b e^{−(1 − α)a t}: the part of |x| that can be left after a time t.
pub fn bound(a: f64, alpha: f64, window: Span, t: Span) -> f64 {
    (rate(a, alpha) * (window.secs() - t.secs())).exp()
}

/// α of (1.6) for windows of length T: the largest part of one that was silent. Zero if T is not positive.
pub fn alpha(measured: &Connectivity, window: Span) -> f64 {
    let t = window.secs();
    if t > 0.0 { measured.most_lost_in(window).secs() / t } else { 0.0 }
}

/// What the lemma says of two vehicles that close in on each other at rate `a` \[1/s\] while connected, in a run
/// that was measured, with windows of length T.
pub fn verdict(a: f64, measured: &Connectivity, window: Span) -> Verdict {
    let alpha = alpha(measured, window);
    let holds = a > 0.0 && window > Span::ZERO && alpha < 1.0;
    Verdict {
        name: "Lemma 1.1",
        condition: format!("silent for a part α < 1 of every {window}, a > 0"),
        value: format!("α = {alpha:.4}, a = {a:.4} 1/s"),
        holds,
        norm_rate: holds.then(|| rate(a, alpha)),
    }
}

#[cfg(test)]
mod tests {
    use super::{alpha, bound, rate, verdict};
    use crate::graph::measure::Connectivity;
    use crate::graph::switching::Switching;
    use crate::random::Stream;
    use crate::time::{Span, Time};
    use proptest::prelude::*;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn run(signal: Switching, end: f64) -> Connectivity {
        Connectivity::planned(signal, 2, &[(0, 1), (1, 0)], Time::from_secs(end))
    }

    #[test]
    fn one_silent_second_in_three() {
        let run = run(Switching::periodic(2, s(3.0), s(0.0), s(2.0)), 60.0);
        let verdict = verdict(0.2, &run, s(3.0));
        assert!(verdict.holds && (alpha(&run, s(3.0)) - 1.0 / 3.0).abs() < 1e-9);
        assert!(verdict.norm_rate.is_some_and(|rate| (rate - 0.4 / 3.0).abs() < 1e-9));
        // Erratum 1.1: a longer window may be silent for a larger part.
        assert!((alpha(&run, s(4.0)) - 0.5).abs() < 1e-9);
        // The true solution meets the rate exactly over each period: x(3k) = e^{-0.4k} x(0).
        assert!((rate(0.2, 1.0 / 3.0) * 3.0 - 0.4).abs() < 1e-12);
        // So nothing decays faster than the bound, which stays above it by b = e^{0.4}, no more.
        for periods in 0..5 {
            let solution = (-0.4 * f64::from(periods)).exp();
            let promised = bound(0.2, 1.0 / 3.0, s(3.0), s(3.0 * f64::from(periods)));
            assert!((promised / solution - 0.4f64.exp()).abs() < 1e-12, "{periods}");
        }
        // A window may be all silence; and of none there is no part.
        assert_eq!((alpha(&run, s(0.5)), alpha(&run, Span::ZERO)), (1.0, 0.0));
    }

    #[test]
    fn endless_silence_promises_nothing() {
        let silent = run(Switching::periodic(2, s(3.0), s(0.0), s(0.0)), 60.0);
        let answer = verdict(1.0, &silent, s(3.0));
        assert_eq!((answer.holds, answer.norm_rate), (false, None));
        let always = run(Switching::always(2), 60.0);
        assert_eq!(verdict(1.0, &always, s(3.0)).norm_rate, Some(1.0));
        assert!(!verdict(1.0, &always, Span::ZERO).holds && !verdict(0.0, &always, s(3.0)).holds);
    }

    proptest! {
        #[test]
        fn the_solution_stays_below_the_bound(seed in any::<u64>(), a in 0.05..1.0f64, window in 1.0..10.0f64) {
            // |x| is e^{-a (time connected)}; windows that begin at zero.
            let signal = Switching::random(2, 0.5, s(2.0), s(0.2), Stream::new(seed, "p"));
            let alpha = alpha(&run(signal.clone(), 50.0), s(window));
            for end in 1..50 {
                let end = f64::from(end);
                let up = end - run(signal.clone(), end).loss_time().secs();
                prop_assert!((-a * up).exp() <= bound(a, alpha, s(window), s(end)) * (1.0 + 1e-9));
            }
        }
    }
}
