//! Sections 2.2 to 2.4: vehicles that learn their speeds from a leader, a gateway or the vehicles beside them.

use common::graph::Graph;
use common::mission::file::{FollowingChoice, LawChoice, LeaderFollower, NeighboursInARow};
use common::mission::{Mission, VehiclePlan};
use common::theory::gateway_2_35::Gateway;
use common::theory::polynomial::slowest;
use common::theory::{Verdict, decoupling_2_37, neighbours};

use super::surroundings::{turning, undisturbed, undisturbed_but_for_failures};
use super::{Case, mode_words};
use crate::results::TheoryRow;

/// (2.29): each follower has the roots of s³ + as² + bs + c. With path following by the decoupling method, (2.37).
pub(super) fn rows_of_a_leader(case: &Case<'_>, law: &LeaderFollower) -> Vec<TheoryRow> {
    let mode = slowest(&[1.0, law.a, law.b, law.c]).filter(|(rate, _)| *rate > 0.0);
    let leads = |id: &str| id == law.leader;
    let followers = || case.mission.vehicles.iter().enumerate().filter(|(_, plan)| !leads(&plan.id));
    // The one that turns fastest is the one closest to the border.
    let turning = followers().filter_map(|(index, plan)| Some((lambda_p(plan)?, turning(case.mission, index))));
    let coupled = turning.max_by(|(_, one), (_, two)| one.total_cmp(two));
    let alone = Verdict {
        name: "followers (2.29)",
        condition: "who follows hears the leader; ab > c".into(),
        value: format!(
            "{} > {}{}",
            law.a * law.b,
            law.c,
            if hear(case, &law.leader) { "" } else { "; not everybody hears the leader" }
        ),
        holds: law.a * law.b > law.c && hear(case, &law.leader),
        norm_rate: mode.map(|(rate, _)| rate),
    };
    // In line with a leader that is stuck, at its speed (2.41): the followers do not know that it failed. And nobody minds a follower.
    let fails = |plan: &VehiclePlan| plan.disturbances.stuck.is_some_and(|stuck| stuck.from < case.mission.end);
    let to_the_end =
        stuck_at_the_end(case.mission).into_iter().any(|(index, _)| leads(case.mission.vehicles[index].id.as_str()));
    let steady = to_the_end || !case.mission.vehicles.iter().any(|plan| leads(&plan.id) && fails(plan));
    let stuck: Vec<&str> =
        followers().map(|(_, plan)| plan).filter(|plan| fails(plan)).map(|plan| plan.id.as_str()).collect();
    let said = |row: TheoryRow| match stuck.is_empty() {
        true => row,
        false => TheoryRow {
            value: format!("{}; said of the others than {}", row.value, stuck.join(", ")),
            guaranteed_rate: None,
            ..row
        },
    };
    let mut alone = row(case, alone, steady);
    if let Some(mode) = mode.filter(|(_, times)| *times > 1).filter(|_| alone.guaranteed_rate.is_some()) {
        alone = TheoryRow { predicted: mode_words(mode), guaranteed_rate: None, ..alone };
    }
    let mut rows = vec![said(alone_of(case, alone))];
    if let Some((lambda_p, turning)) = coupled {
        let mut verdict = decoupling_2_37::verdict(lambda_p, law.a1, [law.a, law.b, law.c], turning);
        verdict.holds &= hear(case, &law.leader);
        rows.push(said(row(case, verdict, steady)));
    }
    rows
}

/// The row of a statement about coordination alone: where path following reckons with the speed of a vehicle that turns, as the
/// decoupling method does, speed and path disturb one another (2.36), and the modes are near these but not these.
fn alone_of(case: &Case<'_>, row: TheoryRow) -> TheoryRow {
    let reckons = |plan: &VehiclePlan| {
        matches!(plan.following, FollowingChoice::Decoupling(_) | FollowingChoice::OutputFeedback(_))
    };
    let turns = |index: usize| turning(case.mission, index) > 1e-9;
    let coupled = case.mission.vehicles.iter().enumerate().any(|(index, plan)| reckons(plan) && turns(index));
    if coupled && row.holds == Some(true) && row.predicted.contains("1/s") {
        let predicted = format!("{} of coordination alone; path following shifts it (2.36)", row.predicted);
        return TheoryRow { predicted, guaranteed_rate: None, ..row };
    }
    row
}

/// Whether every vehicle but this one hears it.
fn hear(case: &Case<'_>, id: &str) -> bool {
    let graph = &case.network.graph;
    case.mission.index_of(id).is_some_and(|one| (0..graph.len()).all(|i| i == one || graph.hears(i, one)))
}

/// Who is stuck to the end, and at which speed.
pub(super) fn stuck_at_the_end(mission: &Mission) -> Vec<(usize, f64)> {
    let at_the_end = |plan: &VehiclePlan| plan.disturbances.stuck.filter(|stuck| stuck.to >= mission.end);
    mission.vehicles.iter().enumerate().filter_map(|(i, plan)| Some((i, at_the_end(plan)?.speed))).collect()
}

/// (2.35), (2.42) and (2.43).
pub(super) fn rows_of_a_gateway(
    case: &Case<'_>,
    gateway: &str,
    a: f64,
    distance: Vec<f64>,
    b_0: f64,
) -> Vec<TheoryRow> {
    let mission = case.mission;
    let fleet = Gateway { a, distance, b_0, n: mission.vehicles.len() };
    let star = |failed| {
        let mut verdict = fleet.verdict(failed);
        if !star(case, gateway) {
            verdict.value.push_str("; not everybody talks with the gateway");
            verdict.holds = false;
        }
        verdict
    };
    let stuck = stuck_at_the_end(mission);
    let mut nominal = alone_of(case, row(case, star(false), false));
    let mut rows = Vec::new();
    if let (&[(failed, speed)], Some(hub)) = (&stuck[..], mission.index_of(gateway))
        && failed != hub
    {
        let with_failure = alone_of(case, row(case, star(true), true));
        let r = |i: usize| mission.vehicles[i].path.at(mission.vehicles[i].start.xi).r();
        let v_1 = r(hub) * mission.speed.at(mission.end).v_l;
        let predicted = format!("{:.6}", fleet.steady_error(speed, r(failed), v_1, r(hub)));
        let covered = with_failure.holds == Some(true);
        let error = TheoryRow {
            name: "Error of the stuck vehicle against the gateway (2.43)".into(),
            condition: format!("{}; its speed stuck to the end", with_failure.condition),
            value: with_failure.value.clone(),
            holds: with_failure.holds,
            predicted: if covered { predicted } else { "–".into() },
            measured: case.measured(|s| format!("{:.6} (largest difference)", s.fleet.coordination.last)),
            ..TheoryRow::default()
        };
        if covered && nominal.holds == Some(false) {
            // Said of a fleet without failures; the next two rows speak of this one.
            nominal.holds = None;
            nominal.value.push_str("; (2.42) speaks of that");
        }
        rows.extend([with_failure, error]);
    }
    rows.insert(0, nominal);
    rows
}

/// Whether everybody talks with the gateway, both ways.
fn star(case: &Case<'_>, gateway: &str) -> bool {
    let graph = &case.network.graph;
    case.mission
        .index_of(gateway)
        .is_some_and(|hub| (0..graph.len()).all(|i| i == hub || (graph.hears(i, hub) && graph.hears(hub, i))))
}

/// Neighbours in a row: result x of docs/errata.md.
pub(super) fn rows_of_a_row(case: &Case<'_>, law: &NeighboursInARow) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let n = graph.len();
    // The law minds the one before and the one after, whoever else is heard.
    let beside: Vec<(usize, usize)> = graph.arcs().filter(|(i, j)| i.abs_diff(*j) == 1).collect();
    let told = case.mission.index_of(&law.told).unwrap_or(n);
    let rate = neighbours::rate(&Graph::from_arcs(n, &beside), told, [law.a, law.b, law.c], law.b0);
    let verdict = Verdict {
        name: "neighbours in a row, proven here",
        condition: "who is beside whom hears one another; ab > c, any b_0 > 0".into(),
        value: format!(
            "{} > {}{}",
            law.a * law.b,
            law.c,
            if rate.is_some() { "" } else { "; some do not hear who is beside them" }
        ),
        holds: law.a * law.b > law.c && rate.is_some(),
        norm_rate: rate.filter(|rate| *rate > 0.0),
    };
    vec![alone_of(case, row(case, verdict, false))]
}

/// Laws without coordination.
pub(super) fn rows_of_nothing(case: &Case<'_>, law: &LawChoice) -> Vec<TheoryRow> {
    let what = if matches!(law, LawChoice::Alone(_)) { "(2.30) for everybody" } else { "a prescribed force" };
    vec![TheoryRow {
        name: format!("No coordination: {what}"),
        condition: "none".into(),
        holds: None,
        predicted: "–".into(),
        measured: case.fitted_rate(),
        ..TheoryRow::default()
    }]
}

/// With what all of chapter 2 asks for; `about_failures` if the statement is about the failure that there is.
fn row(case: &Case<'_>, verdict: Verdict, about_failures: bool) -> TheoryRow {
    let (fixed, trimmed) = (case.network.is_fixed(), case.way.trimmed);
    let holds = verdict.holds && fixed && trimmed;
    let rate = verdict.norm_rate.filter(|_| holds);
    let row = TheoryRow {
        name: format!("Agreement ({})", verdict.name),
        condition: format!(
            "fixed network, no delay, no loss; circles or lines, close to the paths; {}",
            verdict.condition
        ),
        value: format!(
            "{}{}{}",
            verdict.value,
            if fixed { "" } else { "; the network changes, delays or loses" },
            if trimmed { "" } else { "; paths that are no circles and lines: R_i or the curvature varies" }
        ),
        holds: Some(holds),
        predicted: match rate {
            Some(rate) => format!("slowest mode {rate:.5} 1/s"),
            None if holds => "agreement".into(),
            None => "–".into(),
        },
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    };
    if about_failures { undisturbed_but_for_failures(case, row) } else { undisturbed(case, row) }
}

/// λ_p of the decoupling method.
fn lambda_p(plan: &VehiclePlan) -> Option<f64> {
    match &plan.following {
        FollowingChoice::Decoupling(gains) => Some(gains.lambda_p),
        _ => None,
    }
}
