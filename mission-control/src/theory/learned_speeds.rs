//! Sections 2.2 to 2.4: vehicles that learn their speeds from a leader, a gateway or the vehicles beside them.

use common::mission::file::{FollowingChoice, LawChoice, LeaderFollower, NeighboursInARow};
use common::mission::{Mission, VehiclePlan};
use common::theory::gateway_2_35::Gateway;
use common::theory::polynomial::abscissa;
use common::theory::{Verdict, decoupling_2_37};

use super::Case;
use crate::results::TheoryRow;

/// (2.29): each follower has the roots of s³ + as² + bs + c. With path following by the decoupling method, (2.37).
pub(super) fn rows_of_a_leader(case: &Case<'_>, law: &LeaderFollower) -> Vec<TheoryRow> {
    let slowest = abscissa(&[1.0, law.a, law.b, law.c]).filter(|re| *re < 0.0);
    let alone = Verdict {
        name: "followers (2.29)",
        condition: "circles or lines; ab > c".into(),
        value: format!("{} > {}", law.a * law.b, law.c),
        holds: law.a * law.b > law.c,
        norm_rate: slowest.map(|re| -re),
    };
    let mut rows = vec![row(case, alone)];
    let followers = case.mission.vehicles.iter().filter(|plan| plan.id != law.leader);
    // The one that turns fastest is the one closest to the border.
    let turning = followers.filter_map(|plan| Some((lambda_p(plan)?, turning(case.mission, plan))));
    if let Some((lambda_p, turning)) = turning.max_by(|(_, one), (_, two)| one.total_cmp(two)) {
        rows.push(row(case, decoupling_2_37::verdict(lambda_p, law.a1, [law.a, law.b, law.c], turning)));
    }
    rows
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
    let mut rows = vec![row(case, fleet.verdict(false))];
    let at_the_end = |plan: &VehiclePlan| plan.disturbances.stuck.filter(|stuck| stuck.to >= mission.end);
    let stuck: Vec<(usize, f64)> =
        mission.vehicles.iter().enumerate().filter_map(|(i, plan)| Some((i, at_the_end(plan)?.speed))).collect();
    if let (&[(failed, speed)], Some(hub)) = (&stuck[..], mission.index_of(gateway))
        && failed != hub
    {
        rows.push(row(case, fleet.verdict(true)));
        let r = |i: usize| mission.vehicles[i].path.at(mission.vehicles[i].start.xi).r();
        let v_1 = r(hub) * mission.speed.at(mission.end).v_l;
        rows.push(TheoryRow {
            name: "Error of the stuck vehicle against the gateway (2.43)".into(),
            condition: "circles or lines; its speed stuck to the end".into(),
            holds: Some(true),
            predicted: format!("{:.6}", fleet.steady_error(speed, r(failed), v_1, r(hub))),
            measured: case.measured(|s| format!("{:.6} (largest difference)", s.fleet.coordination.last)),
        });
    }
    rows
}

/// Neighbours in a row: result vii of docs/errata.md.
pub(super) fn rows_of_a_row(case: &Case<'_>, law: &NeighboursInARow) -> Vec<TheoryRow> {
    let verdict = Verdict {
        name: "neighbours in a row, proven here",
        condition: "circles or lines; ab > c, any b_0 > 0".into(),
        value: format!("{} > {}", law.a * law.b, law.c),
        holds: law.a * law.b > law.c,
        norm_rate: None,
    };
    vec![row(case, verdict)]
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
    }]
}

fn row(case: &Case<'_>, verdict: Verdict) -> TheoryRow {
    TheoryRow {
        name: format!("Agreement ({})", verdict.name),
        condition: format!("fixed network, no delay, no loss; {}: {}", verdict.condition, verdict.value),
        holds: Some(verdict.holds && case.network.is_fixed()),
        predicted: verdict.norm_rate.map_or("agreement".into(), |rate| format!("slowest mode {rate:.5} 1/s")),
        measured: case.fitted_rate(),
    }
}

/// λ_p of the decoupling method.
fn lambda_p(plan: &VehiclePlan) -> Option<f64> {
    match &plan.following {
        FollowingChoice::Decoupling(gains) => Some(gains.lambda_p),
        _ => None,
    }
}

/// v/R of (2.37): how fast the vehicle turns where it starts, at v_L \[rad/s\].
fn turning(mission: &Mission, plan: &VehiclePlan) -> f64 {
    let point = plan.path.at(plan.start.xi);
    point.curvature().abs() * point.r() * mission.speed.fastest()
}
