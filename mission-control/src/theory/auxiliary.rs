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
    let fixed = case.network.is_fixed();
    vec![TheoryRow {
        name: "Agreement into a ball set by δ (Theorem 4.8)".into(),
        condition: "fixed two-way connected network, no delay, no loss".into(),
        value: format!(
            "{}, {}",
            if rate.is_some() { "two-way, connected" } else { "one-way links, or not connected" },
            if fixed { "fixed" } else { "changes, delays or loses" }
        ),
        holds: Some(fixed && graph.is_undirected() && graph.is_connected()),
        // α₂ does not vanish while δ ≠ 0: what decays is the distance from where it leads, so that no rate is guaranteed for e.
        predicted: rate
            .filter(|_| fixed)
            .map_or("–".into(), |rate| format!("slowest mode {rate:.5} 1/s, down to the ball that α₂ leaves")),
        guaranteed_rate: None,
        measured: case.fitted_rate(),
    }]
}

/// (4.62): Theorem 4.9.
pub(super) fn rows_switching(case: &Case<'_>, law: &Auxiliary) -> Vec<TheoryRow> {
    let guaranteed = guarantee(case, law);
    let Some(dynamic) = dynamic(case, law) else {
        return vec![TheoryRow {
            name: "Lemma 4.7 (Theorem 4.9)".into(),
            condition: "two-way links that connect the fleet at times".into(),
            value: "one-way links, or never connected".into(),
            holds: Some(false),
            predicted: "–".into(),
            measured: case.fitted_rate(),
            ..TheoryRow::default()
        }];
    };
    let row = case.row(dynamic.verdict(case.network.alpha()));
    let obstacle = match (case.network.immediate, moves_as_told(case.mission)) {
        (true, true) => "",
        (false, _) => "; messages are late or lost",
        (true, false) => "; targets do not move just as told",
    };
    let printed = dynamic.printed();
    let closed_form = TheoryRow {
        name: "Lemma 4.6 with the X of (4.66) (errata 4.19, 4.20)".into(),
        condition: "that X satisfies (4.65)".into(),
        value: format!("λ_c = {:.4}, λ_d = {:.4}", printed.lambda_c, printed.lambda_d),
        holds: None,
        predicted: if dynamic.printed_holds() {
            format!("bears α < {:.4}", printed.alpha_limit())
        } else {
            "nothing: it does not satisfy (4.65) with these gains".into()
        },
        measured: "–".into(),
        ..TheoryRow::default()
    };
    vec![
        TheoryRow {
            condition: format!("two-way links, all that is said is heard at once; {}", row.condition),
            value: format!("{}{obstacle}", row.value),
            holds: Some(guaranteed.is_some()),
            predicted: guaranteed.map_or("–".into(), |g| format!("‖e‖ decays at ≥ {:.5} 1/s", g.rate)),
            guaranteed_rate: guaranteed.map(|g| g.rate),
            ..row
        },
        closed_form,
    ]
}
