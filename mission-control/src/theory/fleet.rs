//! What theory says of every mission: its graph, its losses, its speed, and what path following leaves.

use common::mission::Mission;
use common::mission::file::LawChoice;
use common::time::Span;

use super::Case;
use super::graph::graph_facts;
use super::late_news::as_the_law_takes_them;
use super::learned_speeds::stuck_at_the_end;
use super::premises::minds_no_hull;
use super::steady_motion::{is_excited, motion};
use super::talk::speed_factor;
use crate::results::{Summary, TheoryRow};

pub(super) fn graph(case: &Case<'_>) -> TheoryRow {
    let graph = &case.network.graph;
    let undirected = graph.is_undirected();
    let heard: Vec<&str> =
        graph.globally_reachable().into_iter().map(|vehicle| case.mission.vehicles[vehicle].id.as_str()).collect();
    TheoryRow {
        name: "Graph of all links (section 3.1, Lemma 3.9)".into(),
        condition: if undirected { "connected".into() } else { "has a globally reachable vertex".into() },
        value: match (undirected, heard.len()) {
            (true, n) if n == graph.len() => "two-way links, connected".into(),
            (true, _) => "two-way links, not connected".into(),
            (false, 0) => "one-way links, nobody is heard by all".into(),
            (false, _) => format!("one-way links, heard by all: {}", heard.join(", ")),
        },
        holds: Some(graph.can_agree()),
        predicted: if graph.can_agree() { "agreement is possible".into() } else { "–".into() },
        measured: "–".into(),
        ..TheoryRow::default()
    }
}

/// λ_2 and its kin, for two-way links; the eigenvalues of L for one-way ones. Over all graphs that the signal can take, not only
/// those of this seed.
pub(super) fn spectrum(case: &Case<'_>) -> Option<TheoryRow> {
    let facts = graph_facts(case.mission);
    let taken = &facts.taken;
    let predicted = if facts.two_way {
        let number = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.4}"));
        format!(
            "λ₂ = {}; λ₂,ₘ = {}, λₘ = {} over {} that the signal can take, {} of them connected",
            number(facts.lambda_2),
            number(taken.lambda_2m),
            number(taken.lambda_m),
            taken.words(),
            taken.connected
        )
    } else {
        let words: Vec<String> = facts
            .eigenvalues
            .iter()
            .map(|[re, im]| if *im == 0.0 { format!("{re:.3}") } else { format!("{re:.3} {im:+.3}j") })
            .collect();
        format!("σ(L) = {{{}}}", words.join(", "))
    };
    Some(TheoryRow {
        name: "Eigenvalues of the Laplacian (Lemma 3.9; Lemma 4.1, property 8)".into(),
        condition: "–".into(),
        predicted,
        measured: "–".into(),
        ..TheoryRow::default()
    })
}

/// A row about the network alone asks for nothing where a statement about the law is met without it.
pub(super) fn excused(row: TheoryRow, statements: &[TheoryRow]) -> TheoryRow {
    let covers = statements.iter().find(|statement| statement.holds == Some(true));
    match covers.filter(|_| row.holds == Some(false)) {
        Some(covers) => TheoryRow {
            value: format!("{}; not needed: {} covers the mission", row.value, covers.name),
            holds: None,
            ..row
        },
        None => row,
    }
}

pub(super) fn losses(case: &Case<'_>) -> TheoryRow {
    let t_0 = |t_0: Option<f64>| t_0.map_or("unbounded".to_string(), |t_0| format!("{t_0:.3} s"));
    let alpha = case.network.alpha();
    TheoryRow {
        name: "Brief connectivity losses (Definition 4.3)".into(),
        condition: "α < 1".into(),
        value: format!("α = {alpha:.4}"),
        holds: Some(alpha < 1.0),
        predicted: format!("α = {alpha:.4}, T₀ = {}", t_0(case.network.t_0().map(Span::secs))),
        measured: case.measured(|s| {
            let connectivity = s.fleet.connectivity.as_ref();
            connectivity.map_or("–".into(), |c| format!("α = {:.4}, T₀ = {}", c.alpha, t_0(c.t_0_s)))
        }),
        ..TheoryRow::default()
    }
}

pub(super) fn connected_in_mean(case: &Case<'_>) -> TheoryRow {
    let window = case.network.planned.connected_in_mean();
    let words = |t: Option<f64>| t.map_or_else(|| "–".into(), |t| format!("T = {t:.3} s"));
    TheoryRow {
        name: "Uniformly connected in mean (Definition 4.4)".into(),
        condition: "every window of some length T connects all".into(),
        value: window.map_or("no window does".into(), |t| words(Some(t.secs()))),
        holds: Some(window.is_some()),
        predicted: words(window.map(Span::secs)),
        measured: case.measured(|s| words(s.fleet.connectivity.as_ref().and_then(|c| c.t_s))),
        ..TheoryRow::default()
    }
}

/// The rate at which theory says the fleet travels in the end \[units of ξ per s\]; `None` where it says nothing: without
/// coordination, where vehicles cannot agree, or disturbed.
pub fn predicted_speed(mission: &Mission, v_l: f64) -> Option<f64> {
    rate_in_the_end(&Case::new(mission, None), v_l).ok()
}

/// Whether messages were dropped in the flight without which the fleet's rate is not as it was predicted.
pub fn lost_its_rate(mission: &Mission, summary: &Summary) -> bool {
    Case::new(mission, Some(summary)).dropped.is_some_and(|dropped| {
        let case = Case { dropped: Some(dropped), ..Case::new(mission, None) };
        rate_in_the_end(&case, v_l_at_the_end(&case)).is_err()
    })
}

/// The predicted rate, or why there is none.
pub(super) fn rate_in_the_end(case: &Case<'_>, v_l: f64) -> Result<f64, String> {
    let (mission, disturbed) = (case.mission, &case.disturbances);
    match travels(mission) {
        Travel::Nowhere => Err("nothing makes the vehicles agree".into()),
        Travel::With(_, rate) if minds_no_hull(mission) || disturbed.only_failures() => {
            as_the_law_takes_them(case).map(|()| rate)
        }
        Travel::Told if minds_no_hull(mission) || disturbed.is_empty() => match is_excited(mission) {
            true => Ok(motion(case, v_l)?.rate),
            false => {
                as_the_law_takes_them(case)?;
                speed_factor(mission).map(|factor| factor * v_l).ok_or_else(|| "delays differ".into())
            }
        },
        _ => Err("disturbed".into()),
    }
}

/// v_L in force at the end.
pub(super) fn v_l_at_the_end(case: &Case<'_>) -> f64 {
    let planned = case.mission.speed.at(case.mission.end).v_l;
    case.summary.and_then(|s| s.fleet.formation_speed_at_the_end).unwrap_or(planned)
}

/// What sets the fleet's speed in the end.
enum Travel {
    /// v_L.
    Told,
    /// A vehicle that is stuck, at this rate.
    With(usize, f64),
    /// Nothing that theory speaks of.
    Nowhere,
}

fn travels(mission: &Mission) -> Travel {
    let leads = |id: &str, failed| mission.index_of(id) == Some(failed);
    let stuck = stuck_at_the_end(mission);
    let follow = |&(failed, speed): &(usize, f64)| {
        let plan = &mission.vehicles[failed];
        Travel::With(failed, speed / plan.path.at(plan.start.xi).r())
    };
    match (&mission.law_choice, &stuck[..]) {
        (LawChoice::Alone(_) | LawChoice::SquareWave(_), _) => Travel::Nowhere,
        (_, []) => Travel::Told,
        // All others learn the speed of one that cannot learn theirs (2.41), (2.43).
        (LawChoice::LeaderFollower(law), [one]) if leads(&law.leader, one.0) => follow(one),
        (LawChoice::Gateway(_) | LawChoice::GatewayIntegral(_), [one]) => follow(one),
        _ if minds_no_hull(mission) => Travel::Told,
        _ => Travel::Nowhere,
    }
}

/// The rate of the fleet in the end; who is not known to agree goes at it if they do.
pub(super) fn speed(case: &Case<'_>, statements: &[TheoryRow]) -> TheoryRow {
    let mission = case.mission;
    let v_l = v_l_at_the_end(case);
    let excited = is_excited(mission);
    let why_not = excited.then(|| motion(case, v_l).err()).flatten();
    let known = rate_in_the_end(case, v_l);
    let late = as_the_law_takes_them(case).err();
    let slowed = matches!(
        mission.law_choice,
        LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_) | LawChoice::DelayedEstimating(_)
    );
    let holds = match travels(mission) {
        Travel::Nowhere => None,
        _ if excited => Some(why_not.is_none() && case.disturbances.is_empty()),
        _ if slowed => Some(known.is_ok()),
        _ => late.is_some().then_some(false),
    };
    let agree = mission.vehicles.len() < 2 || statements.iter().any(|row| row.holds == Some(true));
    let late = late.map_or(String::new(), |why| format!("; not predicted: {why}"));
    let (name, condition, value) = match (mission.law_delay(), travels(mission)) {
        (_, Travel::Nowhere) => {
            let why = if stuck_at_the_end(mission).is_empty() { "no coordination" } else { "a failure (see above)" };
            ("Fleet speed", "the vehicles agree".to_string(), why.to_string())
        }
        (_, Travel::With(failed, _)) => (
            "Fleet speed of a stuck vehicle, v/R (2.41), (2.43)",
            "one vehicle stuck to the end, whose speed the others learn".to_string(),
            format!("{} is stuck{late}", mission.vehicles[failed].id),
        ),
        _ if excited => {
            let name = match mission.law_choice {
                LawChoice::Auxiliary(_) => "Fleet speed left by δ under (4.59) (erratum 4.14, result v)",
                _ => "Fleet speed left by δ, type I (4.53) (erratum 4.14, result v)",
            };
            let why = why_not.as_ref().map_or(String::new(), |why| format!("; not predicted: {why}"));
            (name, "α₂ at rest: |p'| constant, v_L constant, undisturbed".to_string(), format!("v_L = {v_l:.4}{why}"))
        }
        (Some(tau), _) => (
            "Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)",
            match mission.law_choice {
                LawChoice::Delayed(_) => {
                    format!("every message τ = {tau} s late and none lost, everybody always hears someone")
                }
                _ => format!("every message τ = {tau} s late and none lost but by the switching"),
            },
            format!("v_L = {v_l:.4}, v_L*/v_L = {:.4}{late}", mission.nominal_factor()),
        ),
        (None, _) if slowed => (
            "Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)",
            "every message τ late and none lost, everybody always hears someone".to_string(),
            format!("v_L = {v_l:.4}{late}"),
        ),
        (None, _) => (
            "Fleet speed v_L",
            "the vehicles agree, and hear one another in time".to_string(),
            format!("v_L = {v_l:.4}{late}"),
        ),
    };
    TheoryRow {
        name: name.into(),
        condition,
        value,
        holds,
        predicted: known
            .ok()
            .filter(|_| !excited || holds == Some(true))
            .map_or("–".into(), |speed| format!("{speed:.5} 1/s{}", if agree { "" } else { ", if they agree" })),
        measured: case.measured(|s| format!("{:.5} 1/s", s.fleet.steady_speed)),
        ..TheoryRow::default()
    }
}
