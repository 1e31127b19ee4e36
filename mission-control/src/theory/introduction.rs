//! Two vehicles on lines, (1.5).

use common::mission::file::LeaderIntegral;

use super::{Case, Guarantee};
use crate::results::TheoryRow;

/// Lemma 1.1 with e' = −(a_1(t) + a_2(t)) e, where a_i(t) is the gain while vehicle i hears the other.
pub(super) fn guarantee(case: &Case<'_>) -> Option<Guarantee> {
    let gains = case.mission.gains("gain");
    let heard = case.mission.links.iter().zip(&case.network.up);
    let rate = heard.map(|(link, up)| gains.get(link.to).map_or(0.0, |gain| gain * up)).sum::<f64>();
    (case.network.immediate && rate > 0.0).then_some(Guarantee { rate, factor: None })
}

pub(super) fn rows(case: &Case<'_>) -> Vec<TheoryRow> {
    let guarantee = guarantee(case);
    let gains = in_words(&case.mission.gains("gain"));
    let up: Vec<String> = case.network.up.iter().map(|up| format!("{up:.4}")).collect();
    vec![TheoryRow {
        name: "Rate of coordination (Lemma 1.1, erratum 1.1)".into(),
        condition: "heard at times, and nothing late or lost but by the switching".into(),
        value: format!(
            "links up for {} of the time, a = {gains} 1/s{}",
            up.join(" and "),
            if case.network.immediate { "" } else { "; messages are late or lost" }
        ),
        holds: Some(case.network.immediate && guarantee.is_some()),
        predicted: guarantee.map_or("–".into(), |g| format!("{:.5} 1/s on the paths", g.rate)),
        guaranteed_rate: guarantee.map(|g| g.rate),
        measured: case.fitted_rate(),
    }]
}

/// Gains in words: one number if they are all equal.
fn in_words(gains: &[f64]) -> String {
    let mut words: Vec<String> = gains.iter().map(|gain| format!("{gain:.4}")).collect();
    words.dedup();
    words.join(" and ")
}

/// The law after (1.5) in which one vehicle learns v_L: s² + 2a s + b.
pub(super) fn rows_of_a_leader(case: &Case<'_>, law: &LeaderIntegral) -> Vec<TheoryRow> {
    let rate = law.a - (law.a * law.a - law.b).max(0.0).sqrt();
    vec![TheoryRow {
        name: "One vehicle learns v_L (section 1.2, after (1.5))".into(),
        condition: "fixed two-way link, no delay, no loss, v_L constant".into(),
        value: if case.network.is_fixed() { "fixed".into() } else { "changes, delays or loses".into() },
        holds: Some(case.network.is_fixed() && case.network.graph.is_undirected()),
        guaranteed_rate: Some(rate).filter(|_| case.network.is_fixed() && case.network.graph.is_undirected()),
        predicted: format!("{rate:.5} 1/s on the paths"),
        measured: case.fitted_rate(),
    }]
}
