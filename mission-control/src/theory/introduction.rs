//! Two vehicles on lines, (1.5).

use common::graph::Graph;
use common::graph::measure::Connectivity;
use common::mission::file::LeaderIntegral;
use common::theory::Verdict;
use common::theory::lemma_1_1;
use common::theory::polynomial::slowest;
use common::time::{Span, Time};

use super::{Case, Guarantee};
use crate::facts::link_period;
use crate::results::TheoryRow;

/// Windows of a signal without a period are this part of the flight.
const PART: f64 = 0.25;

/// Lemma 1.1, on the lines: there is no factor, as the way to the lines disturbs.
pub(super) fn guarantee(case: &Case<'_>) -> Option<Guarantee> {
    let verdict = lemma(case).0;
    verdict.norm_rate.filter(|_| holds(case, &verdict)).map(|rate| Guarantee { rate, factor: None })
}

fn holds(case: &Case<'_>, verdict: &Verdict) -> bool {
    verdict.holds && case.network.immediate && case.disturbances.is_empty()
}

/// The lemma with e' = −(a_1(t) + a_2(t)) e, where a_i(t) is the gain while vehicle i hears the other: its a is the least such
/// sum that is not zero. And the length T of its windows.
fn lemma(case: &Case<'_>) -> (Verdict, Span) {
    let mission = case.mission;
    let flight = mission.end - Time::ZERO;
    // In a flight shorter than two periods the lemma would not look at more than one window.
    let period = link_period(mission).map(Span::from_secs).filter(|period| period.secs() <= 0.5 * flight.secs());
    let window = period.unwrap_or_else(|| Span::from_secs(PART * flight.secs()));
    let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
    let signal = mission.switching.clone();
    let gains = mission.gains("gain");
    let heard = |graph: &Graph| graph.arcs().filter_map(|(receiver, _)| gains.get(receiver)).sum::<f64>();
    let a = case.network.graphs.iter().map(heard).filter(|sum| *sum > 0.0).min_by(f64::total_cmp).unwrap_or(0.0);
    let planned = Connectivity::planned(signal, mission.vehicles.len(), &arcs, mission.end);
    (lemma_1_1::verdict(a, &planned, window), window)
}

pub(super) fn rows(case: &Case<'_>) -> Vec<TheoryRow> {
    let (verdict, window) = lemma(case);
    let holds = holds(case, &verdict);
    let rate = verdict.norm_rate.filter(|_| holds);
    let up: Vec<String> = case.network.up.iter().map(|up| format!("{up:.4}")).collect();
    vec![TheoryRow {
        name: "Rate of coordination (Lemma 1.1, erratum 1.1)".into(),
        condition: format!("{}; nothing late or lost but by the switching; on the lines", verdict.condition),
        value: format!(
            "{} over T = {window}, links up for {} of the time{}",
            verdict.value,
            up.join(" and "),
            if case.network.immediate { "" } else { "; the network delays or loses messages" }
        ),
        holds: Some(holds),
        predicted: rate.map_or("–".into(), |rate| format!("{rate:.5} 1/s on the paths")),
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    }]
}

/// The law after (1.5) in which one vehicle learns v_L: s² + 2a s + b.
pub(super) fn rows_of_a_leader(case: &Case<'_>, law: &LeaderIntegral) -> Vec<TheoryRow> {
    let (fixed, two_way) = (case.network.is_fixed(), case.network.graph.is_undirected());
    let mode = slowest(&[1.0, 2.0 * law.a, law.b]).filter(|(rate, _)| *rate > 0.0 && fixed && two_way);
    vec![TheoryRow {
        name: "One vehicle learns v_L (section 1.2, after (1.5))".into(),
        condition: "fixed two-way link, no delay, no loss; on the lines".into(),
        value: format!(
            "{}, {}",
            if two_way { "two-way" } else { "one-way link" },
            if fixed { "fixed" } else { "the network changes, delays or loses" }
        ),
        holds: Some(mode.is_some()),
        guaranteed_rate: mode.filter(|(_, times)| *times == 1).map(|(rate, _)| rate),
        predicted: mode.map_or("–".into(), |mode| format!("{} on the paths", super::mode_words(mode))),
        measured: case.fitted_rate(),
    }]
}
