//! Known delay, when every link is late by something of its own: what holds beyond [`known_delay`](super::known_delay).
//!
//! The law is v_r = v_L − kΣ_j (γ_i(t − τ_ij) − γ_j(t − τ_ij)), the network fixed, two-way and connected, vehicles move as told.
//! γ = γ_0 1 with γ_0' = v_L is a solution whatever the τ_ij. L and its eigenvalues are those of the graph. Both results are this
//! project's own.
//!
//! # The same both ways: τ_ij = τ_ji, constant, none longer than τ
//!
//! **The fleet agrees at v_L if kλ_max τ < π/2, and its errors decay at σ* = kλ_2 cos(kλ_max τ e^(σ*τ)) at least in the end.**
//!
//! With L(s) = Σ_e e^(−sτ_e) b_e b_e' over the links e, b_e = 1 at one end and −1 at the other, the roots are those of
//! det(sI + kL(s)) = 0. L(s)1 = 0 and 1'L(s) = 0 for every s: s = 0 belongs to 1, the common motion, and all other vectors x are
//! orthogonal to 1. Let s = −σ + jω be one of their roots, |x| = 1, ω ≥ 0, and q_e = |b_e'x|², Σq_e = x*Lx between λ_2 and λ_max. Then
//! x*(sI + kL(s))x = 0 is
//!
//! ```text
//! σ = k Σ_e q_e e^(στ_e) cos ωτ_e,      ω = k Σ_e q_e e^(στ_e) sin ωτ_e ≤ kλ_max e^(max(σ,0)τ)
//! ```
//!
//! σ* > 0 exists, as its right side falls and begins at kλ_2 cos(kλ_max τ) > 0. Suppose σ < σ*. Then ωτ_e ≤ kλ_max τ e^(max(σ,0)τ) < π/2,
//! and no cosine is negative. If σ ≤ 0, the first sum is above 0 and so not σ. If σ > 0, it is at least
//! kλ_2 cos(kλ_max τ e^(στ)) ≥ σ* > σ. Neither can be. ∎
//!
//! With one τ for all links the bound is that of `known_delay`, and sharp; the rate is not.
//!
//! # Any ages: 0 ≤ τ_ij(t) ≤ τ_ij, changing as they like, and not the same both ways
//!
//! **The fleet agrees at v_L if k‖T‖ < 1, with T_ii = Σ_j τ_ij, T_ij = τ_ij over those that i hears, and the greatest singular value.**
//!
//! Let e be γ less its mean. For e' = −kL e + kΠw, with Π the projection along 1 and
//!
//! ```text
//! w_i = Σ_j ∫_{t − τ_ij(t)}^t (e_i' − e_j') ds,    so |w_i| ≤ Σ_j ∫_{t − τ_ij}^t (|e_i'| + |e_j'|) ds
//! ```
//!
//! as the mean drops out of every difference. An integral over a window of length τ_ij has L_2 gain τ_ij, so ‖w_i‖ ≤ Σ_j T_ij ‖e_j'‖, whence
//! ‖w‖ ≤ ‖T‖ ‖e'‖ in L_2. From w to e' the gain is at most k: along an eigenvector of L it is |jωk/(jω + kλ)| ≤ k. By the small gain
//! theorem k‖T‖ < 1 leaves e' and w in L_2, and e, which follows kΠw through a stable filter, goes to zero. Every γ_i' then goes to v_L. ∎
//!
//! Messages in periods are such ages: what is used grows older until the next word. The bound promises no rate.

use nalgebra::DMatrix;
use std::f64::consts::FRAC_PI_2;

use crate::graph::Graph;
use crate::graph::spectrum::symmetric_eigenvalues;
use crate::time::Span;

/// What one vehicle hears of another is at most so old.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Late {
    /// Who hears.
    pub to: usize,
    /// Who is heard.
    pub from: usize,
    /// τ_ij.
    pub oldest: Span,
}

/// Whether every link is as late both ways.
pub fn is_alike_both_ways(late: &[Late]) -> bool {
    late.iter()
        .all(|one| late.iter().any(|other| (other.to, other.from, other.oldest) == (one.from, one.to, one.oldest)))
}

/// σ*: the rate at which errors decay at least in the end \[1/s\], if links are late alike both ways, by `longest` at most.
/// `None` for a network that is one-way or not connected, and where kλ_max τ is π/2 or more.
pub fn rate_at_least(graph: &Graph, k: f64, longest: Span) -> Option<f64> {
    if !graph.is_undirected() || !graph.is_connected() {
        return None;
    }
    let eigenvalues = symmetric_eigenvalues(&graph.laplacian());
    let (lambda_2, lambda_max, tau) = (*eigenvalues.get(1)?, *eigenvalues.last()?, longest.secs());
    let promised = |sigma: f64| {
        let turn = k * lambda_max * tau * (sigma * tau).exp();
        if turn < FRAC_PI_2 { k * lambda_2 * turn.cos() } else { 0.0 }
    };
    let (mut low, mut high) = (0.0, promised(0.0));
    if high <= 0.0 {
        return None;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle < promised(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// k‖T‖, which must be below 1 for ages that change as they like, among `n` vehicles.
pub fn loop_gain(n: usize, k: f64, late: &[Late]) -> f64 {
    let mut t = DMatrix::zeros(n, n);
    for Late { to, from, oldest } in late {
        t[(*to, *to)] += oldest.secs();
        t[(*to, *from)] += oldest.secs();
    }
    let squares = symmetric_eigenvalues(&(t.transpose() * &t));
    k * squares.last().copied().unwrap_or(0.0).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::theory::known_delay;

    const STAR: [(usize, usize); 2] = [(0, 1), (0, 2)];

    fn both_ways(edges: &[(usize, usize)], seconds: &[f64]) -> Vec<Late> {
        let pairs = edges.iter().zip(seconds);
        pairs
            .flat_map(|(&(a, b), &tau)| {
                let oldest = Span::from_secs(tau);
                [Late { to: a, from: b, oldest }, Late { to: b, from: a, oldest }]
            })
            .collect()
    }

    /// Largest difference of two γ over the last tenth of `seconds`, from (1, 0, 0, …), by Euler steps of `dt`; `age` \[s\] of a
    /// link at an instant.
    fn left(n: usize, k: f64, links: &[Late], seconds: f64, dt: f64, age: impl Fn(usize, f64) -> f64) -> f64 {
        let mut past = vec![(0..n).map(|i| f64::from(u8::from(i == 0))).collect::<Vec<f64>>()];
        let steps = (seconds / dt) as usize;
        let mut most = 0.0f64;
        for step in 0..steps {
            let mut next = past[step].clone();
            for (number, link) in links.iter().enumerate() {
                let back = (age(number, step as f64 * dt) / dt).round() as usize;
                let then = &past[step.saturating_sub(back)];
                next[link.to] -= dt * k * (then[link.to] - then[link.from]);
            }
            if step * 10 > steps * 9 {
                let greatest = next.iter().copied().fold(f64::MIN, f64::max);
                most = most.max(greatest - next.iter().copied().fold(f64::MAX, f64::min));
            }
            past.push(next);
        }
        most
    }

    #[test]
    fn closed_forms() {
        let star = Graph::from_edges(3, &STAR);
        // Without delay it is the rate of agreement itself.
        assert!((rate_at_least(&star, 0.1, Span::ZERO).expect("connected") - 0.1).abs() < 1e-12);
        // λ_max = 3: the bound is at π/0.6 s.
        let border = FRAC_PI_2 / 0.3;
        assert_eq!(rate_at_least(&star, 0.1, Span::from_secs(border + 1e-6)), None);
        assert!(rate_at_least(&star, 0.1, Span::from_secs(border - 1e-3)).is_some_and(|rate| rate > 0.0));
        assert_eq!(rate_at_least(&Graph::from_arcs(2, &[(0, 1)]), 0.1, Span::ZERO), None);
        assert_eq!(rate_at_least(&Graph::empty(2), 0.1, Span::ZERO), None);
        // A pair with τ both ways: T = τ(1 1; 1 1), with the singular value 2τ. With τ one way only, T = (τ τ; 0 0) and √2 τ.
        let pair = both_ways(&[(0, 1)], &[3.0]);
        assert!((loop_gain(2, 0.1, &pair) - 0.6).abs() < 1e-12 && is_alike_both_ways(&pair));
        let one = [Late { oldest: Span::ZERO, ..pair[1] }, pair[0]];
        assert!((loop_gain(2, 0.1, &one) - 0.3 * 2f64.sqrt()).abs() < 1e-12 && !is_alike_both_ways(&one));
        assert_eq!(loop_gain(3, 0.1, &[]), 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// With one delay the modes are known, and none is slower.
        #[test]
        fn no_mode_is_slower_than_promised(k in 0.01..1.0f64, part in 0.0..0.999f64, n in 2usize..7) {
            let ring: Vec<(usize, usize)> = (1..n).map(|i| (i - 1, i)).collect();
            let graph = Graph::from_edges(n, &ring);
            let tau = Span::from_secs(part * known_delay::longest_delay(&graph, k).expect("two-way"));
            let promised = rate_at_least(&graph, k, tau).expect("below the bound");
            let known = known_delay::agreement_rate(&graph, k, tau).expect("two-way");
            prop_assert!(promised > 0.0 && promised <= known * (1.0 + 1e-9) + 1e-12, "{} {}", promised, known);
        }

        /// Links late by something of their own, the same both ways: errors are gone when the promised rate says so.
        #[test]
        fn late_alike_both_ways_the_fleet_agrees_as_fast_as_promised(
            part in 0.1..0.9f64, shares in prop::collection::vec(0.0..=1.0f64, 3), extra in any::<bool>()
        ) {
            let edges = [(0, 1), (0, 2), (1, 2)];
            let edges = if extra { &edges[..] } else { &edges[..2] };
            let graph = Graph::from_edges(3, edges);
            let (k, dt) = (1.0, 0.002);
            let longest = part * known_delay::longest_delay(&graph, k).expect("two-way");
            let late = both_ways(edges, &shares.iter().map(|share| share * longest).collect::<Vec<_>>());
            let rate = rate_at_least(&graph, k, Span::from_secs(longest)).expect("below the bound");
            let seconds = (12.0 / rate).min(400.0);
            let ages: Vec<f64> = late.iter().map(|link| link.oldest.secs()).collect();
            let end = left(3, k, &late, seconds, dt, |number, _| ages[number]);
            // A factor of 30 for the start; Euler steps cost a part of the rate.
            prop_assert!(end < 30.0 * (-0.9 * rate * 0.9 * seconds).exp(), "{} after {} s at {}", end, seconds, rate);
        }

        /// Ages of saw teeth, each link with its own period and length, not the same both ways.
        #[test]
        fn whatever_ages_do_below_the_bound_the_fleet_agrees(
            part in 0.3..0.98f64, shares in prop::collection::vec(0.0..=1.0f64, 6), periods in prop::collection::vec(0.2..5.0f64, 6)
        ) {
            let mut late = both_ways(&[(0, 1), (0, 2), (1, 2)], &[1.0, 1.0, 1.0]);
            for (link, share) in late.iter_mut().zip(&shares) {
                link.oldest = Span::from_secs(0.05 + share);
            }
            let k = part / loop_gain(3, 1.0, &late);
            let age = |number: usize, t: f64| late[number].oldest.secs() * (t / periods[number]).fract();
            let end = left(3, k, &late, 60.0 / k.min(1.0), 0.01, age);
            prop_assert!(end < 1e-3, "{} with k = {}", end, k);
        }
    }

    #[test]
    fn beyond_the_bounds_a_fleet_may_part() {
        let star = both_ways(&STAR, &[1.0, 1.0]);
        let k = 1.1 * FRAC_PI_2 / 3.0;
        assert!(
            loop_gain(3, k, &star) > 1.0 && rate_at_least(&Graph::from_edges(3, &STAR), k, star[0].oldest).is_none()
        );
        assert!(left(3, k, &star, 200.0, 0.005, |_, _| 1.0) > 10.0);
    }
}
