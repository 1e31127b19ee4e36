//! One-way links, and one vehicle that is told v_L: Propositions 3.6 and 3.7, Remark 3.13.

use common::graph::Graph;
use common::mission::Mission;
use common::mission::file::{Laplacian, TrulyDecentralised};
use common::theory::Verdict;
use common::theory::linear_coordination::{Complex, Law};
use common::theory::proposition_3_6::{DirectedLaw, nonzero_spectrum};

use super::Case;
use crate::results::TheoryRow;

/// (3.72), and about a fixed pattern (3.86).
pub(super) fn rows(case: &Case<'_>, a: f64, b: f64) -> Vec<TheoryRow> {
    let verdict = DirectedLaw::OverC.verdict(&case.network.graph, false, a, b, case.network.is_fixed());
    vec![row(case, verdict)]
}

/// Solution II over one-way links, (3.83): (3.85) if all R_i are equal, else the eigenvalues of the closed loop.
pub(super) fn rows_of_solution_2(case: &Case<'_>, a: f64, b: f64) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let r = case.way.constant().unwrap_or_default();
    let equal = r.first().filter(|first| r.iter().all(|r| (r - *first).abs() <= 1e-9 * first.abs()));
    if let Some(r) = equal {
        return vec![row(case, DirectedLaw::TimesC(1.0 / r).verdict(graph, false, a, b, case.network.is_fixed()))];
    }
    let rate = Law::SolutionTwo { a, b }.rate(graph, r).filter(|rate| *rate > 0.0 && case.network.is_fixed());
    let verdict = Verdict {
        name: "Remark 3.13 for unequal R_i",
        condition: "network fixed, without delay and loss; all modes of (3.65) with (3.83) decay".into(),
        value: if rate.is_some() { "they do".into() } else { "not all do, or the network is not fixed".into() },
        holds: rate.is_some(),
        norm_rate: rate,
    };
    vec![row(case, verdict)]
}

/// (3.92), on the graph with the virtual leader.
pub(super) fn rows_of_a_told_vehicle(case: &Case<'_>, law: &TrulyDecentralised) -> Vec<TheoryRow> {
    let Some(graph) = with_leader(case.mission, &case.network.graph, law) else { return Vec::new() };
    let normalised = law.laplacian == Laplacian::Normalised;
    vec![row(case, DirectedLaw::Leader.verdict(&graph, normalised, law.a, law.b, case.network.is_fixed()))]
}

/// 𝒢_{n+1}: the graph with the virtual leader, whom the told vehicle hears.
pub(super) fn with_leader(mission: &Mission, graph: &Graph, law: &TrulyDecentralised) -> Option<Graph> {
    let n = graph.len();
    let told = mission.index_of(&law.told)?;
    let arcs: Vec<(usize, usize)> = graph.arcs().chain([(told, n)]).collect();
    Some(Graph::from_arcs(n + 1, &arcs))
}

/// The rate of (3.92) that acts so late: to first order a mode λ of λ² + aμλ + bμ = 0 is shifted by up to τ|λ|³/|2λ + aμ| \[1/s\].
pub(super) fn late_rate(case: &Case<'_>, law: &TrulyDecentralised, late: f64) -> Option<f64> {
    let graph = with_leader(case.mission, &case.network.graph, law)?;
    let spectrum = nonzero_spectrum(&graph, law.laplacian == Laplacian::Normalised)?;
    let of_mode = |mu: Complex<f64>| {
        DirectedLaw::Leader.roots(law.a, law.b, mu).map(|root| {
            let shift = late * root.norm().powi(3) / (root * 2.0 + mu * law.a).norm();
            -root.re - shift
        })
    };
    spectrum.into_iter().flat_map(of_mode).min_by(f64::total_cmp)
}

fn row(case: &Case<'_>, verdict: Verdict) -> TheoryRow {
    let (constant, equal) = (case.way.constant().is_some(), case.mission.has_equal_gains());
    let rate = verdict.norm_rate.filter(|_| constant && equal);
    let varying = match (constant, equal) {
        (false, _) => "; R_i varies along the paths",
        (true, false) => "; unequal gains, of which nothing is promised over one-way links",
        (true, true) => "",
    };
    TheoryRow {
        name: format!("Agreement ({})", verdict.name),
        condition: format!("constant R_i; {}; on the paths (d = 0)", verdict.condition),
        value: format!("{}{varying}", verdict.value),
        holds: Some(verdict.holds && constant && equal),
        predicted: rate.map_or("–".into(), |rate| format!("slowest mode {rate:.5} 1/s")),
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    }
}
