//! Coordination over a switching network, (4.21).

use common::theory::monitor::Watched;
use common::theory::theorem_4_4::Coordination;
use common::theory::{Gains, PathFollowing, theorem_4_5};
use common::time::Time;

pub(super) use super::premises::moves_as_told;
use super::premises::{following, late_or_lost, too_rare};
use super::{Case, Guarantee};
use crate::results::TheoryRow;

/// Theorem 4.4 for targets that move as told.
pub(super) fn guarantee(case: &Case<'_>) -> Option<Guarantee> {
    if !(case.network.immediate && moves_as_told(case.mission)) || case.network.cut_off || !rare(case).is_empty() {
        return None;
    }
    let coordination = coordination(case)?;
    let factor = case.network.t_0().map(|t_0| coordination.overshoot(t_0));
    Some(Guarantee { rate: coordination.rate_of_agreement(), factor }).filter(|g| g.rate > 0.0)
}

fn coordination(case: &Case<'_>) -> Option<Coordination> {
    let gains = case.mission.gains("gain");
    Coordination::new(&case.network.graphs, &gains, case.network.alpha())
}

pub(super) fn rows(case: &Case<'_>) -> Vec<TheoryRow> {
    let (four, five) = match following(case.mission) {
        Ok(type_1 @ PathFollowing::TypeI { .. }) => return rows_of_type_1(case, type_1),
        _ => (theorem_4_4(case), theorem_4_5(case)),
    };
    // One of the two is enough: the one that covers the mission is shown, both if both do.
    match (four.holds, five.holds) {
        (Some(true), Some(true)) => vec![four, five],
        (_, Some(true)) => vec![five],
        _ => vec![four],
    }
}

/// Both theorems for targets with dynamics of their own (4.53): errors go into a ball that δ and other disturbances set.
fn rows_of_type_1(case: &Case<'_>, type_1: PathFollowing) -> Vec<TheoryRow> {
    let network = &case.network;
    let met = network.immediate && !network.cut_off && rare(case).is_empty();
    let PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } = type_1 else { return Vec::new() };
    let constants = format!("λ₁ = {lambda_1:.5} 1/s, ρ₁ = {rho_1:.5}, α₁ = {alpha_1:.2}{}", obstacles(case));
    let four = coordination(case).map(|coordination| coordination.verdict(type_1));
    let four = match four {
        Some(verdict) => TheoryRow {
            condition: format!("two-way links, no delay, no loss; {}", verdict.condition),
            value: format!("{}; {constants}", verdict.value),
            holds: Some(verdict.holds && met),
            predicted: verdict.norm_rate.filter(|_| met).map_or("–".into(), |rate| {
                format!("path following and coordination decay at ≥ {rate:.5} 1/s into a ball")
            }),
            guaranteed_rate: None,
            ..case.row(verdict)
        },
        None => TheoryRow {
            name: "Theorem 4.4 (type I)".into(),
            condition: "two-way links that connect the fleet at times".into(),
            value: format!("one-way links, or never connected; {constants}"),
            holds: Some(false),
            predicted: "–".into(),
            measured: case.fitted_rate(),
            ..TheoryRow::default()
        },
    };
    let five = Gains::new(&case.mission.gains("gain")).map(|gains| {
        let verdict =
            theorem_4_5::verdict(gains, network.planned.connected_in_mean(), dwell(case), two_way(case), type_1);
        TheoryRow {
            condition: format!("{}, no delay, no loss", verdict.condition),
            value: format!("{}; {constants}", verdict.value),
            holds: Some(verdict.holds && met),
            predicted: if verdict.holds && met { "agreement into a ball, no rate".into() } else { "–".into() },
            ..case.row(verdict)
        }
    });
    [four].into_iter().chain(five).collect()
}

fn dwell(case: &Case<'_>) -> common::time::Span {
    case.network.planned.dwell().unwrap_or(case.mission.end - Time::ZERO)
}

/// Whether no link is ever up in one direction alone.
fn two_way(case: &Case<'_>) -> bool {
    case.network.graphs.iter().all(common::graph::Graph::is_undirected)
}

/// The conditions on messages in periods that the plan does not meet.
fn rare(case: &Case<'_>) -> Vec<String> {
    let gains = case.mission.gains("gain");
    let watched = Watched::Agreement(gains, PathFollowing::TypeII { lambda_1: f64::INFINITY });
    too_rare(case.mission, &case.network, &watched)
}

/// What is in the way of both theorems.
fn obstacles(case: &Case<'_>) -> String {
    let mut obstacles = String::new();
    if let Some(premise) = late_or_lost(case.mission, common::time::Span::ZERO) {
        obstacles += &format!("; messages: {}", premise.found);
    }
    if let Err(premise) = following(case.mission) {
        obstacles += &format!("; the constants of Assumption 4.1 are not known: {}", premise.found);
    }
    if !two_way(case) {
        obstacles += "; one-way links, which the thesis leaves to the literature";
    }
    for rare in rare(case) {
        obstacles += &format!("; {rare}");
    }
    if case.network.cut_off {
        obstacles += "; only the graphs of the first 20000 changes were looked at";
    }
    obstacles
}

fn theorem_4_4(case: &Case<'_>) -> TheoryRow {
    let guarantee = guarantee(case);
    let lambda_m = coordination(case).map_or("unknown".to_string(), |c| format!("{:.5}", c.lambda_m));
    TheoryRow {
        name: "Theorem 4.4 (rate of the norm, erratum 4.4)".into(),
        condition: "two-way links, α < 1, no delay, no loss, short periods, targets that move as told (type II)".into(),
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
    let met = network.immediate && moves_as_told(mission) && two_way(case) && !network.cut_off && rare(case).is_empty();
    let mean = network.planned.connected_in_mean();
    let dwell = dwell(case);
    let proven = Gains::new(&mission.gains("gain"))
        .zip(mean)
        .filter(|_| met)
        .and_then(|(gains, mean)| theorem_4_5::agreement(gains, mean, dwell))
        .filter(|proven| proven.rate > 0.0);
    TheoryRow {
        name: "Theorem 4.5 (its printed rate is no bound; this one is proven, erratum 4.7)".into(),
        condition:
            "two-way links, connected in mean, no delay, no loss, short periods, targets that move as told (type II)"
                .into(),
        value: format!(
            "{}, dwell time {dwell}{}",
            mean.map_or("never connected in mean".to_string(), |mean| format!("T = {mean}")),
            obstacles(case)
        ),
        holds: Some(mean.is_some() && met),
        predicted: match proven {
            Some(proven) => format!("‖e‖ decays at ≥ {:.5} 1/s", proven.rate),
            None if mean.is_some() && met => "agreement, no rate".into(),
            None => "–".into(),
        },
        guaranteed_rate: proven.map(|proven| proven.rate),
        measured: case.fitted_rate(),
    }
}
