//! What theory says of every mission: its graph, its losses, its speed, and what path following leaves.

use common::mission::Mission;
use common::mission::file::{FollowingChoice, FollowingType, LawChoice};
use common::time::Span;

use super::Case;
use super::delayed::told_truly;
use super::graph::graph_facts;
use super::learned_speeds::stuck_at_the_end;
use super::surroundings::Disturbances;
use super::switching::moves_as_told;
use super::talk::speed_factor;
use crate::results::TheoryRow;

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
    let disturbed = Disturbances::of(mission, None);
    match travels(mission) {
        Travel::Nowhere => None,
        Travel::With(_, rate) if moves_as_told(mission) || disturbed.only_failures() => Some(rate),
        Travel::Told if moves_as_told(mission) || disturbed.is_empty() => {
            let told = || (!has_type_1(mission)).then(|| Some(speed_factor(mission)? * v_l)).flatten();
            mission.excited_speed_at(v_l).or_else(told)
        }
        _ => None,
    }
}

/// Whether a target has dynamics of its own, (4.53), which δ slows down (erratum 4.14).
fn has_type_1(mission: &Mission) -> bool {
    let of = |choice: &FollowingChoice| matches!(choice, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::I);
    mission.vehicles.iter().any(|plan| of(&plan.following))
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
        _ if moves_as_told(mission) => Travel::Told,
        _ => Travel::Nowhere,
    }
}

pub(super) fn speed(case: &Case<'_>) -> TheoryRow {
    let mission = case.mission;
    let planned = mission.speed.at(mission.end).v_l;
    let v_l = case.summary.and_then(|s| s.fleet.formation_speed_at_the_end).unwrap_or(planned);
    let slowed = has_type_1(mission) && mission.excited_speed_at(v_l).is_none();
    let (name, condition, value) = match (mission.law_delay(), travels(mission)) {
        (_, Travel::Nowhere) => {
            let why = if stuck_at_the_end(mission).is_empty() { "no coordination" } else { "a failure (see above)" };
            ("Fleet speed", "the vehicles agree".to_string(), why.to_string())
        }
        (_, Travel::With(failed, _)) => (
            "Fleet speed of a stuck vehicle, v/R (2.41), (2.43)",
            "one vehicle stuck to the end, whose speed the others learn".to_string(),
            format!("{} is stuck", mission.vehicles[failed].id),
        ),
        _ if mission.excited_speed_at(v_l).is_some() => {
            ("Fleet speed left by δ under (4.59) (erratum 4.14)", "α₂ at rest".to_string(), format!("v_L = {v_l:.4}"))
        }
        (Some(tau), _) => (
            "Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)",
            format!("every message τ = {tau} s late"),
            format!("v_L = {v_l:.4}, v_L*/v_L = {:.4}", mission.nominal_factor()),
        ),
        (None, _) => ("Fleet speed v_L", "the vehicles agree".to_string(), format!("v_L = {v_l:.4}")),
    };
    TheoryRow {
        name: name.into(),
        condition,
        value: if slowed { format!("{value}; type I, whose targets δ slows down (erratum 4.14)") } else { value },
        holds: mission.law_delay().map(|tau| told_truly(mission, tau) && !slowed),
        predicted: predicted_speed(mission, v_l).map_or("–".into(), |speed| format!("{speed:.5} 1/s")),
        measured: case.measured(|s| format!("{:.5} 1/s", s.fleet.steady_speed)),
        ..TheoryRow::default()
    }
}

pub(super) fn bias(case: &Case<'_>) -> Option<TheoryRow> {
    let mission = case.mission;
    let first = (0..mission.vehicles.len()).find(|&i| mission.predicted_along_bias(i).is_some())?;
    let bias = mission.predicted_along_bias(first)?;
    let margins = (0..mission.vehicles.len()).filter_map(|i| mission.rank_margin(i));
    let tightest = margins.min_by(|(a, b), (c, d)| (a - b).total_cmp(&(c - d)));
    // At another rate than v_n it is another one (docs/errata.md, result iv).
    let nominal = !has_type_1(mission) && mission.excited_speed().is_none();
    let holds = nominal && case.disturbances.is_empty() && tightest.is_some_and(|(size, least)| size > least);
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, |δ₁| > |v_n| |p'| max|m_ii − m₁₁|/m₁₁, so that the matrix B keeps its rank; targets that go at v_n; undisturbed"
            .into(),
        value: format!(
            "{}{}{}",
            tightest.map_or("–".into(), |(size, least)| format!("|δ₁| = {size} > {least:.4} m/s")),
            if nominal { "" } else { "; α₂ keeps targets at another rate (erratum 4.14)" },
            if case.disturbances.is_empty() { "" } else { "; disturbed" }
        ),
        holds: Some(holds),
        predicted: if holds { format!("{bias:.3} m") } else { "–".into() },
        measured: case.measured(|s| s.vehicles.get(first).map_or("–".into(), |v| format!("{:.3} m", v.along_mean_m))),
        ..TheoryRow::default()
    })
}
