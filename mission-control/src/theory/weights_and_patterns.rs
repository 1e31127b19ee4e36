//! Solution II with weighted links, and solution III about a pattern that moves.

use common::mission::file::{LinkWeight, Solution3, Weighted};
use common::theory::linear_coordination::{Late, Law};
use common::theory::proposition_3_4::{PathRates, rate_for_varying_paths};

use super::Case;
use super::solutions::{bounded_speeds, slowest};
use crate::results::TheoryRow;

/// (3.62): Remark 3.10 speaks of constant C; the eigenvalues of its closed loop are the exact rate.
pub(super) fn rows_of_weights(case: &Case<'_>, law: &Weighted) -> Vec<TheoryRow> {
    let name = "Agreement with weighted links (Proposition 3.4, Remark 3.10)";
    let rate = rate(case, law, Late::default());
    vec![row(case, name, "constant R_i; ", case.way.constant().is_some(), rate)]
}

/// The rate of (3.62) where R_i is constant, if the law acts so late \[1/s\].
pub(super) fn rate(case: &Case<'_>, law: &Weighted, late: Late) -> Option<f64> {
    let ends = |entry: &LinkWeight| entry.link.each_ref().map(|id| case.mission.index_of(id));
    let weight = |i: usize, j: usize| {
        let named = law.weights.iter().find(|entry| [[Some(i), Some(j)], [Some(j), Some(i)]].contains(&ends(entry)));
        named.map_or(1.0, |entry| entry.weight)
    };
    let graph = &case.network.graph;
    let linear = Law::SolutionTwo { a: law.a, b: law.b };
    slowest(&linear.late_eigenvalues(graph, &graph.weighted_laplacian(weight), case.way.constant()?, late)?)
}

/// (3.70): the proof of Proposition 3.5 in μ and ξ − h, which obey the closed loop of solution III.
pub(super) fn rows_of_a_pattern(case: &Case<'_>, law: &Solution3) -> Vec<TheoryRow> {
    let (graph, linear) = (&case.network.graph, Law::SolutionThree { a: law.a, b: law.b });
    let rate = match case.way.rates() {
        PathRates::Constant(r) => linear.rate(graph, &r),
        PathRates::AtMost(r) => rate_for_varying_paths(linear, graph, 1.0 / r),
        PathRates::Jumping => None,
    };
    let name = "Agreement about a moving pattern (section 3.3.3, Proposition 3.5; the rate once nothing is saturated)";
    vec![row(case, name, "", true, rate), bounded_speeds(case)]
}

fn row(case: &Case<'_>, name: &str, more: &str, met: bool, rate: Option<f64>) -> TheoryRow {
    let (graph, fixed) = (&case.network.graph, case.network.is_fixed());
    let holds = met && fixed && graph.is_undirected() && graph.is_connected();
    // The propositions hold for every A and B, the rate is of equal gains.
    let equal = case.mission.has_equal_gains();
    let rate = rate.filter(|_| holds && equal);
    TheoryRow {
        name: name.into(),
        condition: format!("{more}fixed two-way connected network, no delay, no loss; on the paths (d = 0)"),
        value: format!(
            "{}, {}, {}{}{}",
            if graph.is_undirected() { "two-way" } else { "one-way links" },
            if graph.is_connected() { "connected" } else { "not connected" },
            if fixed { "fixed" } else { "changes, delays or loses" },
            if met { "" } else { ", R_i varies" },
            if equal { "" } else { ", unequal gains" }
        ),
        holds: Some(holds),
        predicted: match rate {
            Some(rate) => format!("‖e‖ decays at ≥ {rate:.5} 1/s"),
            None if holds => "agreement, no rate".into(),
            None => "–".into(),
        },
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    }
}
