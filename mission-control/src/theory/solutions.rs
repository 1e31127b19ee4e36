//! Solutions I to III of section 3.4.

use super::Case;
use crate::results::TheoryRow;

/// The row of this proposition, which promises so much.
pub(super) fn rows(case: &Case<'_>, proposition: &str, promise: &str) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    vec![TheoryRow {
        name: format!("Agreement (Proposition {proposition})"),
        condition: "fixed two-way connected network, no delay, no loss".into(),
        holds: Some(case.network.is_fixed() && graph.is_undirected() && graph.is_connected()),
        predicted: promise.into(),
        measured: case.fitted_rate(),
    }]
}
