//! One-way links, and one vehicle that is told v_L: Propositions 3.6 and 3.7, Remark 3.13.

use common::graph::Graph;
use common::mission::Mission;
use common::mission::file::{Laplacian, TrulyDecentralised};
use common::theory::Verdict;
use common::theory::linear_coordination::Law;
use common::theory::proposition_3_6::DirectedLaw;

use super::Case;
use crate::results::TheoryRow;

/// Points at which R_i is looked at along the stretch of path that is to be flown.
const POINTS: u32 = 200;

/// (3.72), and about a fixed pattern (3.86).
pub(super) fn rows(case: &Case<'_>, a: f64, b: f64) -> Vec<TheoryRow> {
    let verdict = DirectedLaw::OverC.verdict(&case.network.graph, false, a, b, case.network.is_fixed());
    vec![row(case, verdict)]
}

/// Solution II over one-way links, (3.83): (3.85) if all R_i are equal, else the eigenvalues of the closed loop.
pub(super) fn rows_of_solution_2(case: &Case<'_>, a: f64, b: f64) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let r = constant_r(case.mission).unwrap_or_default();
    let equal = r.first().filter(|first| r.iter().all(|r| (r - *first).abs() <= 1e-9 * first.abs()));
    if let Some(r) = equal {
        return vec![row(case, DirectedLaw::TimesC(1.0 / r).verdict(graph, false, a, b, case.network.is_fixed()))];
    }
    let rate = Law::SolutionTwo { a, b }.rate(graph, &r).filter(|rate| *rate > 0.0 && case.network.is_fixed());
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
    let graph = &case.network.graph;
    let n = graph.len();
    let Some(told) = case.mission.index_of(&law.told) else { return Vec::new() };
    let arcs: Vec<(usize, usize)> = graph.arcs().chain([(told, n)]).collect();
    let normalised = law.laplacian == Laplacian::Normalised;
    let with_leader = Graph::from_arcs(n + 1, &arcs);
    vec![row(case, DirectedLaw::Leader.verdict(&with_leader, normalised, law.a, law.b, case.network.is_fixed()))]
}

fn row(case: &Case<'_>, verdict: Verdict) -> TheoryRow {
    let constant = constant_r(case.mission).is_some();
    let rate = verdict.norm_rate.filter(|_| constant);
    let varying = if constant { "" } else { "; R_i varies along the paths" };
    TheoryRow {
        name: format!("Agreement ({})", verdict.name),
        condition: format!("constant R_i; {}", verdict.condition),
        value: format!("{}{varying}", verdict.value),
        holds: Some(verdict.holds && constant),
        predicted: rate.map_or("–".into(), |rate| format!("slowest mode {rate:.5} 1/s")),
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    }
}

/// R_i of every vehicle, if none changes along the path that is to be flown.
pub(super) fn constant_r(mission: &Mission) -> Option<Vec<f64>> {
    let way = mission.speed.distance(mission.end);
    let of = |vehicle: &common::mission::VehiclePlan| {
        let at = |i: u32| vehicle.path.at(vehicle.start.xi + way * f64::from(i) / f64::from(POINTS)).r();
        let first = at(0);
        (1..=POINTS).all(|i| (at(i) - first).abs() <= 1e-9 * first).then_some(first)
    };
    mission.vehicles.iter().map(of).collect()
}
