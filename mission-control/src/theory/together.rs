//! Path following and coordination together: conditions i and ii of Propositions 3.1 to 3.3, and Table 3.1.

use common::mission::file::{FollowingChoice, LawChoice};

use super::Case;
use super::surroundings::undisturbed;
use crate::results::TheoryRow;

/// Path following of chapter 3 alone: conditions i and ii say that the speed must not die out.
///
/// Their speed is what coordination asks for, so a statement must say that the vehicles agree: else speeds may swing or grow, or die out
/// although v_L does not.
pub(super) fn path_following(case: &Case<'_>, statements: &[TheoryRow]) -> Option<TheoryRow> {
    let mission = case.mission;
    mission.vehicles.iter().any(|plan| chapter_3(&plan.following)).then_some(())?;
    let v_l = mission.speed.at(mission.end).v_l;
    let since = mission.speed.steps().iter().rev().take_while(|step| step.speed == 0.0).last();
    let coordinated = speeds_settle(case, statements);
    let mut value = match since {
        Some(step) => format!("v_L = 0 from {} s on: vehicles may stop beside their paths", step.at.secs().max(0.0)),
        None => format!("v_L = {v_l:.4}"),
    };
    if !coordinated {
        value += "; no statement holds that makes the vehicles agree, and their speeds may do anything";
    }
    let holds = v_l != 0.0 && coordinated;
    let row = TheoryRow {
        name: "Path following (Propositions 3.1 to 3.3, conditions i and ii)".into(),
        condition: "speeds stay bounded and do not tend to zero: the vehicles agree, v_L ≠ 0 in the end".into(),
        value,
        holds: Some(holds),
        predicted: if holds { "path-following errors vanish".into() } else { "–".into() },
        measured: case.measured(|s| format!("{:.3e} m off the paths at the end", s.fleet.path_error_final_m)),
        ..TheoryRow::default()
    };
    Some(undisturbed(case, row))
}

/// Whether speeds tend to v_L: nothing but v_L is asked for, or the vehicles agree.
fn speeds_settle(case: &Case<'_>, statements: &[TheoryRow]) -> bool {
    let alone = matches!(case.mission.law_choice, LawChoice::Alone(_)) || case.mission.vehicles.len() == 1;
    let says = |holds: bool| statements.iter().any(|row| row.holds == Some(holds));
    alone || (says(true) && !says(false))
}

/// Table 3.1: which following law goes with which coordination law.
///
/// The table leaves linear laws with Proposition 3.3 open. Proposition 3.4 alone still speaks of such a fleet: on the paths (d = 0) it
/// agrees. What is open is whether all errors vanish from everywhere (docs/errata.md, 3.23).
pub(super) fn table_3_1(case: &Case<'_>, statements: &[TheoryRow]) -> Option<TheoryRow> {
    let mission = case.mission;
    mission.vehicles.iter().all(|plan| chapter_3(&plan.following)).then_some(())?;
    let (kind, saturated) = match &mission.law_choice {
        LawChoice::Solution3(_) | LawChoice::MovingPattern(_) => ("a law with sat(.)", true),
        LawChoice::Solution1(_) | LawChoice::Solution2(_) | LawChoice::Weighted(_) | LawChoice::Directed(_) => {
            ("a linear law", false)
        }
        _ => return None,
    };
    let marine = mission.vehicles.iter().any(|plan| matches!(plan.following, FollowingChoice::Proposition33(_)));
    let statement = match (saturated, marine) {
        (true, _) => "Proposition 3.8",
        (false, false) => "Proposition 3.9",
        (false, true) => "×, nothing",
    };
    let covered = saturated || !marine;
    let agree = statements.iter().all(|row| row.holds != Some(false));
    let moves = mission.speed.at(mission.end).v_l != 0.0;
    let holds = covered && agree && moves;
    let mut value =
        format!("{kind} with {}: {statement}", if marine { "Proposition 3.3" } else { "Proposition 3.1 or 3.2" });
    if !agree {
        value += "; the statement about agreement does not hold";
    }
    if !moves {
        value += "; v_L = 0";
    }
    let row = TheoryRow {
        name: "Path following and coordination together (Table 3.1, Propositions 3.8 and 3.9)".into(),
        condition: "a pair that the table covers, agreement on the paths, v_L ≠ 0".into(),
        value,
        holds: Some(holds),
        predicted: if holds { "all errors vanish, from every start".into() } else { "–".into() },
        measured: case.measured(|s| {
            format!(
                "{:.3e} m off the paths, {:.3e} apart at the end",
                s.fleet.path_error_final_m, s.fleet.coordination.last
            )
        }),
        ..TheoryRow::default()
    };
    Some(undisturbed(case, row))
}

fn chapter_3(following: &FollowingChoice) -> bool {
    use FollowingChoice::{Proposition31, Proposition32, Proposition33};
    matches!(following, Proposition31(_) | Proposition32(_) | Proposition33(_))
}
