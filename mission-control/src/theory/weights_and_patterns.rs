//! Solution II with weighted links, and solution III about a pattern that moves.

use super::Case;
use super::directed::constant_r;
use crate::results::TheoryRow;

/// (3.62): Remark 3.10 speaks of constant C.
pub(super) fn rows_of_weights(case: &Case<'_>) -> Vec<TheoryRow> {
    let constant = constant_r(case.mission).is_some();
    let name = "Agreement with weighted links (Proposition 3.4, Remark 3.10)";
    vec![row(case, name, "constant R_i; ", constant, "exponential agreement")]
}

/// (3.70): the proof of Proposition 3.5 in μ and ξ − h.
pub(super) fn rows_of_a_pattern(case: &Case<'_>) -> Vec<TheoryRow> {
    vec![row(case, "Agreement about a moving pattern (section 3.3.3, Proposition 3.5)", "", true, "agreement")]
}

fn row(case: &Case<'_>, name: &str, more: &str, met: bool, promise: &str) -> TheoryRow {
    let (graph, fixed) = (&case.network.graph, case.network.is_fixed());
    let holds = met && fixed && graph.is_undirected() && graph.is_connected();
    TheoryRow {
        name: name.into(),
        condition: format!("{more}fixed two-way connected network, no delay, no loss"),
        value: format!(
            "{}, {}, {}{}",
            if graph.is_undirected() { "two-way" } else { "one-way links" },
            if graph.is_connected() { "connected" } else { "not connected" },
            if fixed { "fixed" } else { "changes, delays or loses" },
            if met { "" } else { ", R_i varies" }
        ),
        holds: Some(holds),
        predicted: if holds { promise.into() } else { "–".into() },
        measured: case.fitted_rate(),
        ..TheoryRow::default()
    }
}
