//! Event-triggered talk: how far from agreement a fleet can stay that speaks only when it must.
//!
//! Under (4.21), γ_i' = v_L − kΣ_{j∈N_i}(γ_i − γ^_j), where γ^_j = γ_j + ε_j is what the others believe of j. On two-way
//! links that do not change, and with Π = I − 11'/n, the errors γ~ = Πγ follow
//!
//! ```text
//! γ~' = −kLγ~ + kΠAε,    ‖γ~‖' ≤ −kλ_2‖γ~‖ + k‖ΠA‖√n·max|ε_j|
//! ```
//!
//! so ‖γ~‖ ends below g·max|ε_j| with g = √n‖ΠA‖/λ_2: the gain from belief to coordination. The gain k is not in it. For a
//! pair it is exact: γ_1 − γ_2 = δ can last for ever.
//!
//! The trigger keeps |ε_j| ≤ δ where it is looked at. A belief can be wrong by more for as long as `staleness` σ: from the
//! instant at which it went wrong until the others use the new message. That is the message period, the control period,
//! and the delay. Meanwhile it moves at |v_r − v_L| ≤ k(λ_max‖γ~‖ + d max|ε|), d the largest degree, so with
//! ‖γ~‖ ≤ g max|ε| in the end
//!
//! ```text
//! max|ε| ≤ δ + σk(λ_max g + d) max|ε|    =>    max|ε| ≤ δ/(1 − σk(λ_max g + d))
//! ```
//!
//! if the denominator is positive (a small gain). This is for beliefs that move at v_L, and for messages that arrive.
//!
//! When v_L changes by Δ, a belief that is a old is wrong by |Δ|a at once, until the others use what is said of it then: for σ,
//! while ‖γ~‖ comes nearer to what such beliefs would cost in the end, g|Δ|a/(1 − σk(λ_max g + d)), at most at the rate kλ_2. So it adds up to
//!
//! ```text
//! σkλ_2 g|Δ|a/(1 − σk(λ_max g + d))
//! ```
//!
//! to ‖γ~‖, of which e^{−kλ_2 t} is left after t. As the bound, this is of first order in σ.

use nalgebra::DMatrix;

use crate::graph::Graph;
use crate::graph::spectrum::{lambda_2, symmetric_eigenvalues};

/// g = √n‖ΠA‖/λ_2: how much a wrong belief can cost in the norm of the coordination errors. `None` for one-way links, or
/// a graph that is not connected.
pub fn gain(graph: &Graph) -> Option<f64> {
    let lambda_2 = lambda_2(graph).filter(|lambda_2| *lambda_2 > 1e-9)?;
    let n = graph.len();
    let pi = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
    let product = pi * graph.adjacency();
    let squares = symmetric_eigenvalues(&(product.transpose() * &product));
    Some((n as f64 * squares.last()?.max(0.0)).sqrt() / lambda_2)
}

/// σk(λ_max g + d): how much of a wrong belief comes back as another one while news of it are on their way; below 1 there is
/// a bound. `None` as [`gain`].
pub fn loop_gain(graph: &Graph, k: f64, staleness: f64) -> Option<f64> {
    let lambda_max = symmetric_eigenvalues(&graph.laplacian()).last().copied()?;
    let degree = (0..graph.len()).map(|i| graph.degree(i)).max()? as f64;
    Some(staleness * k * (lambda_max * gain(graph)? + degree))
}

/// The largest error of any belief in the end \[units of ξ\]; `None` if there is no bound: one-way links, a graph that is
/// not connected, or news too stale for this gain.
pub fn belief_error(graph: &Graph, k: f64, threshold: f64, staleness: f64) -> Option<f64> {
    let room = 1.0 - loop_gain(graph, k, staleness)?;
    (room > 0.0).then(|| threshold / room)
}

/// The bound of ‖γ~‖ in the end \[units of ξ\]; two vehicles are then apart by at most √2 times that.
pub fn ultimate_bound(graph: &Graph, k: f64, threshold: f64, staleness: f64) -> Option<f64> {
    Some(gain(graph)? * belief_error(graph, k, threshold, staleness)?)
}

/// What a change of v_L adds to ‖γ~‖ at most, of which beliefs are wrong by `wrong` for as long as `staleness`; `None` as [`belief_error`].
pub fn added_by_a_change(graph: &Graph, k: f64, wrong: f64, staleness: f64) -> Option<f64> {
    Some(staleness * k * lambda_2(graph)? * ultimate_bound(graph, k, wrong, staleness)?)
}

/// e^{−kλ_2 t}: what is left of ‖γ~‖ after this time, beside what wrong beliefs cost.
pub fn left_after(graph: &Graph, k: f64, t: f64) -> Option<f64> {
    Some((-k * lambda_2(graph)? * t).exp())
}

/// ln(1/part)/(kλ_2): after which time this part of ‖γ~‖ is left.
pub fn time_until(graph: &Graph, k: f64, part: f64) -> Option<f64> {
    Some(-part.ln() / (k * lambda_2(graph)?))
}

#[cfg(test)]
mod tests {
    use super::{added_by_a_change, belief_error, gain, left_after, loop_gain, time_until, ultimate_bound};
    use crate::graph::Graph;
    use proptest::prelude::*;

    const V_L: f64 = 0.5;

    fn pair() -> Graph {
        Graph::from_edges(2, &[(0, 1)])
    }

    #[test]
    fn closed_forms() {
        // A pair: ‖γ~‖ = |γ_1 − γ_2|/√2 ends below δ/√2.
        assert!((gain(&pair()).expect("connected") - 0.5f64.sqrt()).abs() < 1e-12);
        // A complete graph: ΠA = −Π, λ_2 = n.
        for n in 2..8 {
            assert!((gain(&Graph::complete(n)).expect("connected") - (n as f64).sqrt().recip()).abs() < 1e-9);
        }
        // A star of three: ΠA has rank one, with ‖ΠA‖ = √2; λ_2 = 1, λ_max = 3, the centre has two neighbours.
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        assert!((gain(&star).expect("connected") - 6f64.sqrt()).abs() < 1e-9);
        let room = 1.0 - 0.2 * 0.1 * (3.0 * 6f64.sqrt() + 2.0);
        let error = belief_error(&star, 0.1, 0.5, 0.2).expect("bounded");
        assert!((error - 0.5 / room).abs() < 1e-9, "{error}");
        let bound = ultimate_bound(&star, 0.1, 0.5, 0.2).expect("bounded");
        assert!((bound - 6f64.sqrt() * 0.5 / room).abs() < 1e-9, "{bound}");
        assert!(
            (belief_error(&pair(), 0.1, 1.0, 1.0).expect("bounded") - 1.0 / (1.0 - 0.1 * (2f64.sqrt() + 1.0))).abs()
                < 1e-9
        );
    }

    #[test]
    fn what_a_change_of_v_l_adds_by_hand() {
        // A pair: λ_2 = 2, g = 1/√2, λ_max g + d = √2 + 1.
        let room = 1.0 - 0.5 * 0.1 * (2f64.sqrt() + 1.0);
        let by_hand = 0.5 * 0.1 * 2.0 * 0.5f64.sqrt() * 3.0 / room;
        assert!((added_by_a_change(&pair(), 0.1, 3.0, 0.5).expect("bounded") - by_hand).abs() < 1e-12);
        assert!((left_after(&pair(), 0.1, 5.0).expect("connected") - (-1f64).exp()).abs() < 1e-12);
        assert!((time_until(&pair(), 0.1, (-1f64).exp()).expect("connected") - 5.0).abs() < 1e-9);
        assert_eq!(added_by_a_change(&pair(), 1.0, 3.0, 10.0), None, "too stale");
    }

    #[test]
    fn without_a_bound_there_is_none() {
        assert_eq!(gain(&Graph::from_arcs(2, &[(0, 1)])), None);
        assert_eq!(gain(&Graph::empty(3)), None);
        assert_eq!(ultimate_bound(&pair(), 1.0, 0.1, 10.0), None, "too stale");
        // A pair: λ_max g = √2, d = 1.
        assert!((loop_gain(&pair(), 1.0, 10.0).expect("connected") - 10.0 * (2f64.sqrt() + 1.0)).abs() < 1e-9);
    }

    #[test]
    fn for_a_pair_the_gain_is_attained() {
        // Each believes the other where it is not, by δ towards itself: γ_1 − γ_2 = δ stays.
        let (k, delta, dt) = (0.3, 0.2, 0.01);
        let mut gamma = [5.0, 0.0];
        for _ in 0..20_000 {
            let believed = [gamma[0] - delta, gamma[1] + delta];
            let rate = [V_L - k * (gamma[0] - believed[1]), V_L - k * (gamma[1] - believed[0])];
            gamma = [gamma[0] + dt * rate[0], gamma[1] + dt * rate[1]];
        }
        let norm = (gamma[0] - gamma[1]) / 2f64.sqrt();
        assert!((norm - gain(&pair()).expect("connected") * delta).abs() < 1e-6, "{norm}");
    }

    /// Euler steps of a fleet that speaks by event; looks at the trigger every `every` steps, and a message is used `late`
    /// steps later. The largest ‖γ~‖ of the last quarter, and how many messages were said.
    fn fly(
        graph: &Graph,
        k: f64,
        threshold: f64,
        start: &[f64],
        (dt, every, late): (f64, usize, usize),
    ) -> (f64, usize) {
        const STEPS: usize = 6000;
        let n = graph.len();
        let mut gamma = start.to_vec();
        // What was said: when, and what; the last entry is the newest. All begin by saying where they are.
        let mut said: Vec<Vec<(usize, f64)>> = start.iter().map(|xi| vec![(0, *xi)]).collect();
        let mut largest = 0.0f64;
        let believed = |words: &[(usize, f64)], step: usize| {
            let (made, xi) =
                words.iter().rev().find(|(made, _)| made + late <= step).or(words.first()).copied().expect("said");
            xi + V_L * dt * (step - made) as f64
        };
        for step in 0..STEPS {
            for i in 0..n {
                let (made, xi) = said[i][said[i].len() - 1];
                if step % every == 0 && (gamma[i] - xi - V_L * dt * (step - made) as f64).abs() > threshold {
                    said[i].push((step, gamma[i]));
                }
            }
            let beliefs: Vec<f64> = said.iter().map(|words| believed(words, step)).collect();
            let rate = |i: usize| V_L - k * graph.neighbours(i).map(|j| gamma[i] - beliefs[j]).sum::<f64>();
            gamma = (0..n).map(|i| gamma[i] + dt * rate(i)).collect();
            if step > STEPS / 4 * 3 {
                let mean = gamma.iter().sum::<f64>() / n as f64;
                largest = largest.max(gamma.iter().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt());
            }
        }
        (largest, said.iter().map(Vec::len).sum())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]
        #[test]
        fn a_fleet_that_speaks_by_event_ends_within_the_bound(
            edges in prop::collection::vec((0usize..5, 0usize..5), 4..12),
            k in 0.05..0.4f64,
            threshold in 0.01..0.5f64,
            start in prop::collection::vec(-5.0..5.0f64, 5),
            every in 1usize..4,
            late in 0usize..5,
        ) {
            let edges: Vec<(usize, usize)> = edges.into_iter().filter(|(a, b)| a != b).collect();
            let graph = Graph::from_edges(5, &edges);
            let dt = 0.02;
            // Looked at every `every` steps, used `late` steps later, and held for one.
            let staleness = dt * (every + late + 1) as f64;
            let Some(bound) = ultimate_bound(&graph, k, threshold, staleness) else { return Ok(()) };
            // Long enough for the start to be forgotten.
            prop_assume!(crate::graph::spectrum::lambda_2(&graph).is_some_and(|l| k * l * 90.0 > 10.0));
            let (largest, said) = fly(&graph, k, threshold, &start, (dt, every, late));
            prop_assert!(largest <= bound + 1e-3, "{} {}", largest, bound);
            prop_assert!(said < 5 * 6000 / every / 2, "{} said", said);
        }
    }
}
