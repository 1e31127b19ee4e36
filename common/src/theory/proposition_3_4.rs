//! Propositions 3.4 and 3.5: two-way networks that do not change, paths whose R_i may.
//!
//! The text promises exponential agreement without a rate. Where R_i is constant, the eigenvalues of
//! [`linear_coordination`](super::linear_coordination) are the exact rate. Where it varies (C = diag(1/R_i) ≥ c_1), the
//! Lyapunov functions of the proofs give one for solutions I and III, which is proven here.
//!
//! # The rate
//!
//! V = ½|θ|² + ½|z|² with |θ|² = ξ'Lξ, and z = η + Lξ (I) or z = η + A⁻¹Lξ (III). The proofs find
//!
//! ```text
//! V' = −η'Cη − z'Az  (I),     V' = −η'ACη − z'B sat(z)  (III),     η = z − κNθ,   N = M_1Y,   κ = 1 or 1/a
//! ```
//!
//! so −V' ≥ c|z − κNθ|² + d|z|² with c = c_1, d = a (I), or c = ac_1, d = b while nothing is saturated (III). N'N has the
//! eigenvalues λ ≠ 0 of L, so in the coordinates of N's singular vectors this form falls into blocks
//!
//! ```text
//! [ cκ²λ     −cκ√λ ]
//! [ −cκ√λ    c + d ]
//! ```
//!
//! (and c + d for the part of z that no θ drives). The least eigenvalue r of all of them gives −V' ≥ 2rV: norms of (θ, z)
//! decay at r, for every way in which R_i varies while it is differentiable. ∎
//!
//! η = v − R v_L follows η' = u only where R is differentiable. Where R jumps, v does not, so η jumps by (R₋ − R₊)v_L
//! (erratum 3.18) and V may jump up: on a chain of lines and arcs the rate holds from one joint to the next, and nothing is
//! promised over all of the way. The propositions then promise agreement after the last joint.
//!
//! For solution III this holds from when 2V ≤ x_m² on, as V never grows and |z_i| ≤ √(2V).

use super::Verdict;
use super::linear_coordination::Law;
use crate::graph::Graph;
use crate::graph::spectrum::symmetric_eigenvalues;

/// What is known of R_i along the paths \[m per unit of ξ\].
#[derive(Clone, Debug, PartialEq)]
pub enum PathRates {
    /// R_i, constant.
    Constant(Vec<f64>),
    /// The largest of all R_i anywhere, each of them differentiable along the way; c_1 = 1/R.
    AtMost(f64),
    /// Some R_i jumps on the way: η jumps there, and no rate holds over all of it.
    Jumping,
}

/// r above: a rate \[1/s\] that holds however R_i varies, for solutions I and III (unsaturated); `None` for the other
/// laws, for graphs that are not connected and two-way, and for what is not positive.
pub fn rate_for_varying_paths(law: Law, graph: &Graph, c_1: f64) -> Option<f64> {
    let (c, d, kappa) = match law {
        Law::SolutionOne { a } => (c_1, a, 1.0),
        Law::SolutionThree { a, b } => (a * c_1, b, 1.0 / a),
        Law::SolutionTwo { .. } | Law::Directed { .. } => return None,
    };
    let positive = [c, d, kappa].iter().all(|&value| value > 0.0 && value.is_finite());
    if !positive || !graph.is_undirected() || !graph.is_connected() || graph.len() < 2 {
        return None;
    }
    let least = |lambda: f64| {
        let (upper, lower) = (c * kappa * kappa * lambda, c + d);
        let half = 0.5 * (upper + lower);
        // The product of the block's two eigenvalues is its determinant: dividing by the larger one loses no digits.
        upper * d / (half + (half * half - upper * d).max(0.0).sqrt())
    };
    symmetric_eigenvalues(&graph.laplacian()).iter().skip(1).map(|&lambda| least(lambda)).min_by(f64::total_cmp)
}

/// What the propositions say of a fleet on a fixed network (`fixed`: it never changes, and delays and loses nothing).
pub fn verdict(law: Law, graph: &Graph, paths: &PathRates, fixed: bool) -> Verdict {
    let name = match law {
        Law::SolutionOne { .. } => "Proposition 3.4 (solution I)",
        Law::SolutionTwo { .. } => "Proposition 3.4 (solution II)",
        Law::SolutionThree { .. } => "Proposition 3.5 (solution III; the rate once nothing is saturated)",
        Law::Directed { .. } => "Proposition 3.6",
    };
    let two_way = graph.is_undirected();
    let connected = graph.is_connected();
    let holds = fixed && two_way && connected;
    let rate = match paths {
        PathRates::Constant(r) => law.rate(graph, r),
        PathRates::AtMost(r) => rate_for_varying_paths(law, graph, 1.0 / r),
        PathRates::Jumping => None,
    };
    let ways = match paths {
        PathRates::Constant(_) => "",
        PathRates::AtMost(_) => ", R_i varies",
        PathRates::Jumping => ", R_i jumps at joints of the paths, and η with it (erratum 3.18): no rate over them",
    };
    let words = |yes: bool, word: &'static str, no: &'static str| if yes { word } else { no };
    Verdict {
        name,
        condition: "two-way connected network that does not change, delays or loses nothing; on the paths (d = 0)"
            .to_owned(),
        value: format!(
            "{}, {}, {}{ways}",
            words(two_way, "two-way", "one-way links"),
            words(connected, "connected", "not connected"),
            words(fixed, "fixed", "changes, delays or loses")
        ),
        holds,
        norm_rate: rate.filter(|_| holds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::linear_coordination::tests::{connected_graph, flow};
    use nalgebra::DVector;
    use proptest::prelude::*;

    #[test]
    fn a_pair_by_hand() {
        // c = 1, a = 1, λ = 2: [2 −√2; −√2 2], least eigenvalue 2 − √2: the exact rate is the same here.
        let rate = rate_for_varying_paths(Law::SolutionOne { a: 1.0 }, &Graph::complete(2), 1.0).expect("connected");
        assert!((rate - (2.0 - 2f64.sqrt())).abs() < 1e-12, "{rate}");
        // Three, all two-way, λ = 3: [3 −√3; −√3 2].
        let rate = rate_for_varying_paths(Law::SolutionOne { a: 1.0 }, &Graph::complete(3), 1.0).expect("connected");
        assert!((rate - (5.0 - 13f64.sqrt()) / 2.0).abs() < 1e-12, "{rate}");
        let one_way = Graph::from_arcs(2, &[(0, 1)]);
        assert_eq!(rate_for_varying_paths(Law::SolutionOne { a: 1.0 }, &one_way, 1.0), None);
        assert_eq!(rate_for_varying_paths(Law::SolutionTwo { a: 1.0, b: 1.0 }, &Graph::complete(2), 1.0), None);
        assert_eq!(rate_for_varying_paths(Law::SolutionOne { a: 1.0 }, &Graph::empty(2), 1.0), None, "apart");
        for (a, b, c_1) in [
            (0.0, 1.0, 1.0),
            (-1.0, 1.0, 1.0),
            (1.0, 0.0, 1.0),
            (1.0, -1.0, 1.0),
            (1.0, 1.0, 0.0),
            (1.0, 1.0, f64::INFINITY),
        ] {
            let law = Law::SolutionThree { a, b };
            assert_eq!(rate_for_varying_paths(law, &Graph::complete(2), c_1), None, "{a} {b} {c_1}");
        }
    }

    #[test]
    fn verdicts_name_what_fails() {
        let law = Law::SolutionOne { a: 1.0 };
        let constant = PathRates::Constant(vec![1.0, 2.0]);
        let good = verdict(law, &Graph::complete(2), &constant, true);
        assert!(good.holds && good.norm_rate.is_some_and(|rate| rate > 0.0));
        let losing = verdict(law, &Graph::complete(2), &constant, false);
        assert!(!losing.holds && losing.norm_rate.is_none() && losing.value.contains("loses"));
        let apart = verdict(law, &Graph::empty(2), &constant, true);
        assert!(!apart.holds && apart.value.contains("not connected"));
        let varying = verdict(law, &Graph::complete(2), &PathRates::AtMost(4.0), true).norm_rate;
        assert_eq!(varying, rate_for_varying_paths(law, &Graph::complete(2), 0.25), "c_1 = 1/R");
        let one_way = verdict(law, &Graph::from_arcs(2, &[(0, 1)]), &constant, true);
        assert!(!one_way.holds && one_way.norm_rate.is_none() && one_way.value.contains("one-way"));
        let jumping = verdict(law, &Graph::complete(2), &PathRates::Jumping, true);
        assert!(jumping.holds && jumping.norm_rate.is_none() && jumping.value.contains("erratum 3.18"));
        assert!(good.condition.contains("d = 0"));
    }

    #[test]
    fn where_r_jumps_eta_jumps_and_the_rate_does_not_hold() {
        // Two vehicles in agreement, v_L = 1, until the R of one of them falls from 2 to 1: v stays, η = v − R v_L does not.
        let (law, pair) = (Law::SolutionOne { a: 1.0 }, Graph::complete(2));
        let (l, rate) = (pair.laplacian(), rate_for_varying_paths(law, &pair, 0.5).expect("connected"));
        let v = |state: &DVector<f64>| {
            let (eta, xi) = (state.rows(0, 2).into_owned(), state.rows(2, 2).into_owned());
            (xi.dot(&(&l * &xi)).max(0.0) + (eta + &l * &xi).norm_squared()).sqrt()
        };
        let start = DVector::from_vec(vec![0.1, 0.0, 0.0, 0.0]);
        let mut state = flow(law, &pair, &[2.0, 2.0], 1.0) * &start;
        assert!(v(&state) <= v(&start) * (-rate).exp());
        state[0] += 2.0 - 1.0;
        assert!(v(&state) > v(&start), "the promise of one second does not survive the joint");
    }

    proptest! {
        #[test]
        fn no_way_of_varying_is_slower_than_the_proven_rate(
            graph in connected_graph(), a in 0.1..3.0f64, b in 0.1..3.0f64, solution_three in any::<bool>(),
            phases in prop::collection::vec((prop::collection::vec(0.2..2.0f64, 6), 0.05..1.0f64), 1..8),
        ) {
            let n = graph.len();
            let (law, kappa) = match solution_three {
                true => (Law::SolutionThree { a, b }, 1.0 / a),
                false => (Law::SolutionOne { a }, 1.0),
            };
            let rate = rate_for_varying_paths(law, &graph, 1.0 / 2.0).expect("connected");
            let l = graph.laplacian();
            let norm = |state: &DVector<f64>| {
                let (eta, xi) = (state.rows(0, n).into_owned(), state.rows(n, n).into_owned());
                let z = eta + &l * &xi * kappa;
                (xi.dot(&(&l * &xi)).max(0.0) + z.norm_squared()).sqrt()
            };
            let mut state = DVector::from_fn(2 * n, |i, _| ((i * 7 + 3) % 5) as f64 - 2.0);
            let start = norm(&state);
            let mut t = 0.0;
            for (r, lasts) in &phases {
                state = flow(law, &graph, &r[..n], *lasts) * state;
                t += lasts;
                prop_assert!(norm(&state) <= start * (-rate * t).exp() * (1.0 + 1e-9), "at {}", t);
            }
        }
    }
}
