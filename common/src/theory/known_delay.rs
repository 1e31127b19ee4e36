//! Known delay: what late news cost a fleet that compares them with its own past.
//!
//! Under v_r = v_L − kΣ(γ_i(t − τ) − γ_j(t − τ)) with one τ for all links, γ = γ_0 1 with γ_0' = v_L is a solution whatever τ. On
//! two-way links L is symmetric, and its eigenvectors take γ' = v_L 1 − kLγ(t − τ) apart into
//!
//! ```text
//! x' = −a x(t − τ),    s + a e^(−sτ) = 0,    a = kλ,  λ an eigenvalue of L other than 0
//! ```
//!
//! (a pair: λ = 2). All roots are to the left iff aτ < π/2: with s = jω, |ω| = a and ωτ = π/2. The fleet agrees iff
//! kλ_max τ < π/2. A delay that varies, the same for all links, is harmless as long as kλ_max τ stays below 3/2 (Yorke).
//! Delays that differ from link to link: [`known_delay_by_link`](super::known_delay_by_link).

use std::f64::consts::{E, FRAC_PI_2, PI};

use crate::graph::Graph;
use crate::graph::spectrum::symmetric_eigenvalues;
use crate::time::Span;

/// kλ_max τ, which decides: agreement iff it is below π/2. `None` for one-way links.
pub fn turn(graph: &Graph, k: f64, tau: Span) -> Option<f64> {
    Some(k * eigenvalues(graph)?.last()? * tau.secs())
}

/// The delay up to which the fleet agrees \[s\]: π/(2kλ_max). `None` for one-way links.
pub fn longest_delay(graph: &Graph, k: f64) -> Option<f64> {
    Some(FRAC_PI_2 / (k * eigenvalues(graph)?.last()?))
}

/// The rate at which the coordination errors decay in the end \[1/s\], negative if they grow: the slowest of the modes.
/// `None` for one-way links or fewer than two vehicles.
pub fn agreement_rate(graph: &Graph, k: f64, tau: Span) -> Option<f64> {
    let modes = eigenvalues(graph)?;
    modes[1..].iter().map(|lambda| decay(k * lambda.max(0.0), tau.secs())).reduce(f64::min)
}

/// −Re s of the rightmost root of s + a e^(−sτ) = 0, for a ≥ 0 and τ ≥ 0 \[1/s\].
///
/// Below aτ = 1/e it is real: with w = −sτ, w e^(−w) = aτ. Above, s = (−θ cot θ ± jθ)/τ with θ in (0, π), where
/// aτ = θ/sin θ · e^(−θ cot θ) rises with θ.
pub fn decay(a: f64, tau: f64) -> f64 {
    let turn = a * tau;
    if turn <= f64::EPSILON {
        return a;
    }
    if turn * E <= 1.0 {
        return solve(0.0, 1.0, |w| w * (-w).exp() < turn) / tau;
    }
    let cot = |theta: f64| theta.cos() / theta.sin();
    let theta = solve(0.0, PI, |theta| theta / theta.sin() * (-theta * cot(theta)).exp() < turn);
    theta * cot(theta) / tau
}

/// Where `below` changes from true to false between two bounds.
fn solve(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if below(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn eigenvalues(graph: &Graph) -> Option<Vec<f64>> {
    let eigenvalues = graph.is_undirected().then(|| symmetric_eigenvalues(&graph.laplacian()))?;
    (eigenvalues.len() > 1).then_some(eigenvalues)
}

#[cfg(test)]
mod tests {
    use super::{agreement_rate, decay, longest_delay, turn};
    use crate::graph::Graph;
    use crate::time::Span;
    use proptest::prelude::*;
    use std::f64::consts::{E, FRAC_PI_2};

    #[test]
    fn closed_forms() {
        assert_eq!(decay(0.3, 0.0), 0.3, "without delay");
        assert!((decay(1.0 / E, 1.0) - 1.0).abs() < 1e-6, "the fastest there is: a double root at −1/τ");
        assert!(decay(FRAC_PI_2, 1.0).abs() < 1e-12, "the border");
        // θ = π/4: s = −π/4 ± jπ/4 at τ = 1.
        let quarter = FRAC_PI_2 / 2.0;
        let a = quarter * 2f64.sqrt() * (-quarter).exp();
        assert!((decay(a, 1.0) - quarter).abs() < 1e-12);
    }

    #[test]
    fn a_pair_and_a_star() {
        let pair = Graph::from_edges(2, &[(0, 1)]);
        assert!((longest_delay(&pair, 0.1).expect("two-way") - FRAC_PI_2 / 0.2).abs() < 1e-12);
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let tau = Span::from_secs(2.0);
        assert!((turn(&star, 0.1, tau).expect("two-way") - 0.6).abs() < 1e-12);
        let slowest = agreement_rate(&star, 0.1, tau).expect("two-way");
        assert!((slowest - decay(0.1, 2.0).min(decay(0.3, 2.0))).abs() < 1e-12);
        assert_eq!(agreement_rate(&Graph::from_arcs(2, &[(0, 1)]), 0.1, tau), None);
        assert_eq!(agreement_rate(&Graph::empty(1), 0.1, tau), None);
        assert_eq!(turn(&Graph::empty(1), 0.1, tau), None);
        assert_eq!(agreement_rate(&Graph::empty(2), 0.1, tau), Some(0.0), "nobody agrees");
    }

    proptest! {
        #[test]
        fn it_is_a_root_and_its_sign_is_that_of_the_bound(a in 0.01..5.0f64, tau in 0.01..5.0f64) {
            let rate = decay(a, tau);
            prop_assert!((rate > 0.0) == (a * tau < FRAC_PI_2) || (a * tau - FRAC_PI_2).abs() < 1e-9);
            // With s = −rate + jω: ω² = a² e^(2 rate τ) − rate², and rate = a e^(rate τ) cos ωτ.
            let pull = a * (rate * tau).exp();
            let omega = (pull * pull - rate * rate).max(0.0).sqrt();
            prop_assert!((rate - pull * (omega * tau).cos()).abs() < 1e-4 * (1.0 + pull), "{} {}", rate, omega);
        }

        /// Euler steps of x' = −a x(t − τ), from x = 1.
        #[test]
        fn inside_the_bound_it_decays_and_outside_it_grows(part in 0.05..2.0f64) {
            // At the bound nothing tells growth from decay. Near the double root at aτ = 1/e the two slowest roots are
            // alike, or their oscillation is longer than what is looked at.
            prop_assume!(!(0.93..1.07).contains(&part) && !(0.19..0.34).contains(&part));
            const LATE: usize = 400;
            let (tau, dt) = (1.0, 1.0 / LATE as f64);
            let a = part * FRAC_PI_2 / tau;
            let mut x = vec![1.0f64; LATE + 1];
            for _ in 0..60 * LATE {
                x.push(x[x.len() - 1] - dt * a * x[x.len() - 1 - LATE]);
            }
            let size = |from: usize| x[from * LATE..(from + 5) * LATE].iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let found = (size(20) / size(50)).ln() / 30.0;
            prop_assert_eq!(found > 0.0, part < 1.0);
            prop_assert!((found - decay(a, tau)).abs() < 0.03 * (1.0 + decay(a, tau).abs()), "{} {}", found, decay(a, tau));
        }
    }
}
