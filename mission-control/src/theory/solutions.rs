//! Solutions I to III of section 3.3: fixed networks, paths whose R_i may vary.

use common::mission::{Mission, VehiclePlan};
use common::theory::linear_coordination::Law;
use common::theory::proposition_3_4::{self, PathRates};
use common::theory::proposition_3_8;
use common::time::Time;

use super::Case;
use crate::results::TheoryRow;

/// Places along the way at which R_i is looked at.
const PLACES: u32 = 400;

/// R_i of every vehicle while the fleet goes its way in formation \[m per unit of ξ\], at instants of the mission.
pub(super) fn path_rates(mission: &Mission) -> Vec<Vec<f64>> {
    let behind = |vehicle: &VehiclePlan| vehicle.start.xi - vehicle.pattern.at(Time::ZERO).h;
    let start = mission.vehicles.iter().map(behind).fold(f64::INFINITY, f64::min);
    let instant = |place: u32| Time::from_secs(mission.end.secs() * f64::from(place) / f64::from(PLACES));
    (0..=PLACES)
        .map(instant)
        .map(|t| {
            let xi = start + mission.speed.distance(t);
            mission.vehicles.iter().map(|vehicle| vehicle.path.at(xi + vehicle.pattern.at(t).h).r()).collect()
        })
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
    let mut verdict = proposition_3_4::verdict(law, graph, &summary_of(&places), case.network.is_fixed());
    if !case.mission.has_equal_gains() {
        // The propositions hold for every A and B, the rate is of equal gains.
        verdict.norm_rate = None;
        verdict.value += ", unequal gains";
    }
    let mut rows = vec![case.row(verdict)];
    if let Law::SolutionThree { .. } = law {
        let bounded = proposition_3_8::verdict(graph, &case.mission.gains("a"), &places);
        rows.push(TheoryRow {
            predicted: if bounded.holds { "speeds stay bounded, paths are reached".into() } else { "–".into() },
            measured: case.measured(|s| format!("{:.3e} m off the paths at the end", s.fleet.path_error_final_m)),
            ..case.row(bounded)
        });
    }
    rows
}
