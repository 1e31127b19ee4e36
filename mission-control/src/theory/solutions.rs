//! Solutions I to III of section 3.3: fixed networks, paths whose R_i may vary.

use common::mission::Mission;
use common::theory::linear_coordination::Law;
use common::theory::proposition_3_4::{self, PathRates};
use common::theory::proposition_3_6::DirectedLaw;
use common::theory::proposition_3_8;

use super::Case;
use crate::results::TheoryRow;

/// Places along the way at which R_i is looked at.
const PLACES: u32 = 400;

/// R_i of every vehicle at places along the way of this mission \[m per unit of ξ\].
pub(super) fn path_rates(mission: &Mission) -> Vec<Vec<f64>> {
    let start = mission.vehicles.iter().map(|vehicle| vehicle.start.xi - vehicle.pattern).fold(f64::INFINITY, f64::min);
    let way = mission.speed.distance(mission.end);
    (0..=PLACES)
        .map(|place| start + way * f64::from(place) / f64::from(PLACES))
        .map(|xi| mission.vehicles.iter().map(|vehicle| vehicle.path.at(xi + vehicle.pattern).r()).collect())
        .collect()
}

/// What is known of them in the words of Proposition 3.4.
pub(super) fn summary_of(places: &[Vec<f64>]) -> PathRates {
    let first = &places[0];
    let constant = places.iter().all(|r| r.iter().zip(first).all(|(r, first)| (r - first).abs() <= 1e-9 * first));
    if constant {
        PathRates::Constant(first.clone())
    } else {
        PathRates::AtMost(places.iter().flatten().copied().fold(0.0, f64::max))
    }
}

pub(super) fn rows(case: &Case<'_>, law: Law) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let places = path_rates(case.mission);
    let paths = summary_of(&places);
    let fixed = case.network.is_fixed();
    let mut rows = Vec::new();
    let directed = match (law, &paths) {
        // One-way links are covered by Remark 3.13 if all R_i are the same number.
        (Law::SolutionTwo { a, b }, PathRates::Constant(r)) if !graph.is_undirected() => r
            .iter()
            .all(|r| (r - r_1(&paths)).abs() <= 1e-9 * r)
            .then(|| (DirectedLaw::TimesC(1.0 / r_1(&paths)), a, b)),
        _ => None,
    };
    rows.push(match directed {
        Some((directed, a, b)) => case.row(directed.verdict(graph, false, a, b, fixed)),
        None => case.row(proposition_3_4::verdict(law, graph, &paths, fixed)),
    });
    if let Law::SolutionThree { a, .. } = law {
        let bounded = proposition_3_8::verdict(graph, &vec![a; graph.len()], &places);
        rows.push(TheoryRow {
            predicted: if bounded.holds { "speeds stay bounded, paths are reached".into() } else { "–".into() },
            measured: case.measured(|s| format!("{:.3e} m off the paths at the end", s.fleet.path_error_final_m)),
            ..case.row(bounded)
        });
    }
    rows
}

fn r_1(paths: &PathRates) -> f64 {
    match paths {
        PathRates::Constant(r) => r[0],
        PathRates::AtMost(r) => *r,
    }
}
