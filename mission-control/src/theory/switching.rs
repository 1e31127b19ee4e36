//! Coordination over a switching network, (4.21).

use common::mission::Mission;
use common::mission::file::{FollowingChoice, FollowingType};
use common::theory::theorem_4_4::Coordination;
use common::theory::{Gains, theorem_4_5};
use common::time::Time;

use super::{Case, Guarantee};
use crate::results::TheoryRow;

/// Theorem 4.4 for targets that move as told.
pub(super) fn guarantee(case: &Case<'_>) -> Option<Guarantee> {
    if !(case.network.immediate && moves_as_told(case.mission)) {
        return None;
    }
    let coordination = coordination(case)?;
    let factor = case.network.t_0().map(|t_0| coordination.overshoot(t_0));
    Some(Guarantee { rate: coordination.rate_of_agreement(), factor }).filter(|g| g.rate > 0.0)
}

fn coordination(case: &Case<'_>) -> Option<Coordination> {
    Coordination::new(&case.network.graphs, &case.mission.gains("gain"), case.network.alpha())
}

/// Whether the virtual targets move at exactly the rate the law asks for (path following of type II, η = 0).
pub(super) fn moves_as_told(mission: &Mission) -> bool {
    mission
        .vehicles
        .iter()
        .all(|v| matches!(&v.following, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::II))
}

pub(super) fn rows(case: &Case<'_>) -> Vec<TheoryRow> {
    let (four, five) = (theorem_4_4(case), theorem_4_5(case));
    // One of the two is enough: the one that covers the mission is shown, both if both do.
    match (four.holds, five.holds) {
        (Some(true), Some(true)) => vec![four, five],
        (_, Some(true)) => vec![five],
        _ => vec![four],
    }
}

/// What is in the way of both theorems.
fn obstacles(case: &Case<'_>) -> String {
    let mut obstacles = String::new();
    if !case.network.immediate {
        obstacles += "; messages are late or lost";
    }
    if !moves_as_told(case.mission) {
        obstacles += "; targets do not move just as told (type I or a law of chapter 3), and the constants of \
                      Assumption 4.1 are not known for them";
    }
    obstacles
}

fn theorem_4_4(case: &Case<'_>) -> TheoryRow {
    let guarantee = guarantee(case);
    let lambda_m = coordination(case).map_or("unknown".to_string(), |c| format!("{:.5}", c.lambda_m));
    TheoryRow {
        name: "Theorem 4.4 (rate of the norm, erratum 4.4)".into(),
        condition: "two-way links, α < 1, no delay, no loss, targets that move as told (type II)".into(),
        value: format!(
            "α = {:.4}, k_m = {:.4} 1/s, λ_m = {lambda_m}{}",
            case.network.alpha(),
            case.mission.gains("gain").into_iter().fold(f64::INFINITY, f64::min),
            obstacles(case)
        ),
        holds: Some(guarantee.is_some()),
        predicted: guarantee.map_or("–".into(), |g| format!("‖e‖ decays at ≥ {:.5} 1/s", g.rate)),
        guaranteed_rate: guarantee.map(|g| g.rate),
        measured: case.fitted_rate(),
    }
}

fn theorem_4_5(case: &Case<'_>) -> TheoryRow {
    let Case { mission, network, .. } = case;
    let immediate = network.immediate && moves_as_told(mission);
    let mean = network.planned.connected_in_mean();
    let dwell = network.planned.dwell().unwrap_or(mission.end - Time::ZERO);
    let proven = Gains::new(&mission.gains("gain"))
        .zip(mean)
        .filter(|_| network.graph.is_undirected() && immediate)
        .and_then(|(gains, mean)| theorem_4_5::agreement(gains, mean, dwell))
        .filter(|proven| proven.rate > 0.0);
    TheoryRow {
        name: "Theorem 4.5 (its printed rate is no bound; this one is proven, erratum 4.7)".into(),
        condition: "connected in mean, no delay, no loss, targets that move as told (type II)".into(),
        value: format!(
            "{}, dwell time {dwell}{}",
            mean.map_or("never connected in mean".to_string(), |mean| format!("T = {mean}")),
            obstacles(case)
        ),
        holds: Some(mean.is_some() && immediate),
        predicted: match proven {
            Some(proven) => format!("‖e‖ decays at ≥ {:.5} 1/s", proven.rate),
            None if mean.is_some() && immediate => "agreement, no rate".into(),
            None => "–".into(),
        },
        guaranteed_rate: proven.map(|proven| proven.rate),
        measured: case.fitted_rate(),
    }
}
