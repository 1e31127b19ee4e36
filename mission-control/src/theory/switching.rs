//! Coordination over a switching network, (4.21).

use common::mission::Mission;
use common::mission::file::{FollowingChoice, FollowingType, GainOnly};
use common::theory::theorem_4_4::Coordination;
use common::theory::{Gains, theorem_4_5};
use common::time::Time;

use super::{Case, Guarantee};
use crate::results::TheoryRow;

/// Theorem 4.4 for targets that move as told.
pub(super) fn guarantee(case: &Case<'_>, law: &GainOnly) -> Option<Guarantee> {
    if !(case.network.immediate && moves_as_told(case.mission)) {
        return None;
    }
    let gains = vec![law.gain; case.mission.vehicles.len()];
    let coordination = Coordination::new(&case.network.graphs, &gains, case.network.alpha())?;
    let factor = case.network.t_0().map(|t_0| coordination.overshoot(t_0));
    Some(Guarantee { rate: coordination.rate_of_agreement(), factor }).filter(|g| g.rate > 0.0)
}

/// Whether the virtual targets move at exactly the rate the law asks for (path following of type II, η = 0).
pub(super) fn moves_as_told(mission: &Mission) -> bool {
    mission
        .vehicles
        .iter()
        .all(|v| matches!(&v.following, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::II))
}

pub(super) fn rows(case: &Case<'_>, law: &GainOnly) -> Vec<TheoryRow> {
    let Case { mission, network, .. } = case;
    let immediate = network.immediate && moves_as_told(mission);
    let speaks = |condition: &str| format!("{condition}; no delay, no loss, targets that move as told (type II)");
    let guarantee = guarantee(case, law);
    let two_way = network.graph.is_undirected();
    let four = TheoryRow {
        name: "Rate of coordination (Theorem 4.4; rate of the norm)".into(),
        condition: speaks("two-way links, α < 1"),
        holds: Some(guarantee.is_some()),
        predicted: guarantee.map_or("–".into(), |g| format!("≥ {:.5} 1/s", g.rate)),
        measured: case.fitted_rate(),
    };
    let in_mean = network.planned.connected_in_mean();
    let dwell = network.planned.dwell().unwrap_or(mission.end - Time::ZERO);
    let proven = Gains::new(&vec![law.gain; mission.vehicles.len()])
        .zip(in_mean)
        .filter(|_| two_way && immediate)
        .and_then(|(gains, mean)| theorem_4_5::agreement(gains, mean, dwell));
    let five = TheoryRow {
        name: "Agreement (Theorem 4.5; the printed rate is no bound, this one is proven)".into(),
        condition: speaks("connected in mean"),
        holds: Some(in_mean.is_some() && immediate),
        predicted: proven.map_or("agreement, no rate".into(), |p| format!("≥ {:.5} 1/s", p.rate)),
        measured: case.fitted_rate(),
    };
    // One of the two is enough: the one that covers the mission is shown, both if both do.
    match (four.holds, five.holds) {
        (Some(true), Some(true)) => vec![four, five],
        (Some(true), _) => vec![four],
        (_, Some(true)) => vec![five],
        _ => vec![four],
    }
}
