//! What theory says of every mission: its graph, its losses, its speed, and what path following leaves.

use common::graph::spectrum;
use common::time::Span;

use super::Case;
use super::delayed::told_truly;
use crate::results::TheoryRow;

pub(super) fn graph(case: &Case<'_>) -> TheoryRow {
    let graph = &case.network.graph;
    let undirected = graph.is_undirected();
    let lambda_2 = if undirected { spectrum::lambda_2(graph) } else { None };
    TheoryRow {
        name: "Graph of all links (section 3.1)".into(),
        condition: if undirected { "connected".into() } else { "has a globally reachable vertex".into() },
        holds: Some(graph.can_agree()),
        predicted: lambda_2.map_or_else(|| "agreement is possible".into(), |l| format!("λ₂ = {l:.4}")),
        measured: "–".into(),
    }
}

pub(super) fn losses(case: &Case<'_>) -> TheoryRow {
    let t_0 = |t_0: Option<f64>| t_0.map_or("unbounded".to_string(), |t_0| format!("{t_0:.3} s"));
    let alpha = case.network.alpha();
    TheoryRow {
        name: "Brief connectivity losses (Definition 4.3)".into(),
        condition: format!("α = {alpha:.4} < 1"),
        holds: Some(alpha < 1.0),
        predicted: format!("α = {alpha:.4}, T₀ = {}", t_0(case.network.t_0().map(Span::secs))),
        measured: case.measured(|s| {
            let connectivity = s.fleet.connectivity.as_ref();
            connectivity.map_or("–".into(), |c| format!("α = {:.4}, T₀ = {}", c.alpha, t_0(c.t_0_s)))
        }),
    }
}

pub(super) fn connected_in_mean(case: &Case<'_>) -> TheoryRow {
    let window = case.network.planned.connected_in_mean();
    TheoryRow {
        name: "Uniformly connected in mean (Definition 4.4)".into(),
        condition: "every window of some length T connects all".into(),
        holds: Some(window.is_some()),
        predicted: window.map_or_else(|| "–".into(), |t| format!("T = {:.3} s", t.secs())),
        measured: "–".into(),
    }
}

pub(super) fn speed(case: &Case<'_>) -> TheoryRow {
    let mission = case.mission;
    let v_l = mission.speed.at(mission.end).v_l;
    let excited = mission.excited_speed();
    let (name, condition) = match mission.law_delay() {
        _ if excited.is_some() => ("Fleet speed left by δ under (4.59) (erratum 4.14)", "α₂ at rest".to_string()),
        Some(tau) => ("Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)", format!("every message τ = {tau} s late")),
        None => ("Fleet speed v_L", "the vehicles agree".to_string()),
    };
    TheoryRow {
        name: name.into(),
        condition,
        holds: mission.law_delay().map(|tau| told_truly(mission, tau)),
        predicted: format!("{:.5} 1/s", excited.unwrap_or(mission.nominal_factor() * v_l)),
        measured: case.measured(|s| format!("{:.5} 1/s", s.fleet.steady_speed)),
    }
}

pub(super) fn bias(case: &Case<'_>) -> Option<TheoryRow> {
    let mission = case.mission;
    let first = (0..mission.vehicles.len()).find(|&i| mission.predicted_along_bias(i).is_some())?;
    let bias = mission.predicted_along_bias(first)?;
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, the matrix B keeps its rank".into(),
        holds: Some(true),
        predicted: format!("{bias:.3} m"),
        measured: case.measured(|s| s.vehicles.get(first).map_or("–".into(), |v| format!("{:.3} m", v.along_mean_m))),
    })
}
