//! Auxiliary state: Theorems 4.8 and 4.9.

use common::mission::file::Auxiliary;
use common::theory::lemma_4_6::Dynamic;

use super::switching::moves_as_told;
use super::{Case, Guarantee};
use crate::results::TheoryRow;

fn dynamic(case: &Case<'_>, law: &Auxiliary) -> Option<Dynamic> {
    Dynamic::new(law.a1, law.a2, &case.network.graphs)
}

/// Lemma 4.7 with the best solution of (4.65): z starts at zero, so that the norm of x_c starts as that of θ.
pub(super) fn guarantee(case: &Case<'_>, law: &Auxiliary) -> Option<Guarantee> {
    if !case.network.immediate || !moves_as_told(case.mission) {
        return None;
    }
    let (alpha, best) = (case.network.alpha(), dynamic(case, law)?.best(case.network.alpha())?);
    let factor = case.network.t_0().map(|t_0| best.overshoot(alpha, t_0));
    Some(Guarantee { rate: 0.5 * best.rate_of_v(alpha), factor }).filter(|guarantee| guarantee.rate > 0.0)
}

/// (4.59)–(4.61): Theorem 4.8.
pub(super) fn rows_fixed(case: &Case<'_>, law: &Auxiliary) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let rate = dynamic(case, law).and_then(|dynamic| dynamic.rate_on(graph));
    vec![TheoryRow {
        name: "Agreement into a ball set by δ (Theorem 4.8)".into(),
        condition: "fixed two-way connected network, no delay, no loss".into(),
        holds: Some(case.network.is_fixed() && graph.is_undirected() && graph.is_connected()),
        predicted: rate.map_or("–".into(), |rate| format!("slowest mode {rate:.5} 1/s where α₂ = 0")),
        measured: case.fitted_rate(),
    }]
}

/// (4.62): Theorem 4.9.
pub(super) fn rows_switching(case: &Case<'_>, law: &Auxiliary) -> Vec<TheoryRow> {
    let verdict = dynamic(case, law).map(|dynamic| dynamic.verdict(case.network.alpha()));
    let asked = "two-way links, all that is said is heard at once";
    let guaranteed = guarantee(case, law);
    vec![TheoryRow {
        name: verdict.as_ref().map_or("Lemma 4.7 (Theorem 4.9)".into(), |verdict| verdict.name.into()),
        condition: verdict.as_ref().map_or_else(|| asked.into(), |v| format!("{asked}; {}: {}", v.condition, v.value)),
        holds: Some(guaranteed.is_some()),
        predicted: guaranteed.map_or("–".into(), |g| format!("≥ {:.5} 1/s", g.rate)),
        measured: case.fitted_rate(),
    }]
}
