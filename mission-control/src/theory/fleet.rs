//! What theory says of every mission: its graph, its losses, its speed, and what path following leaves.

use common::graph::spectrum;
use common::time::Span;

use super::Case;
use super::delayed::told_truly;
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

/// λ_2 and its kin, for two-way links; the eigenvalues of L for one-way ones.
pub(super) fn spectrum(case: &Case<'_>) -> Option<TheoryRow> {
    let graph = &case.network.graph;
    let ones = vec![1.0; graph.len()];
    let predicted = if graph.is_undirected() {
        let lambda_2 = spectrum::lambda_2(graph)?;
        let least = spectrum::lambda_2m(&case.network.graphs, &ones);
        format!(
            "λ₂ = {lambda_2:.4}; λ₂,ₘ = {} over {} graph{}",
            least.map_or("–".into(), |least| format!("{least:.4}")),
            case.network.graphs.len(),
            if case.network.graphs.len() == 1 { " that occurs" } else { "s that occur" }
        )
    } else {
        let all = spectrum::eigenvalues(&graph.laplacian())?;
        let words: Vec<String> = all
            .iter()
            .map(|mu| if mu.im == 0.0 { format!("{:.3}", mu.re) } else { format!("{:.3} {:+.3}j", mu.re, mu.im) })
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

pub(super) fn speed(case: &Case<'_>) -> TheoryRow {
    let mission = case.mission;
    let planned = mission.speed.at(mission.end).v_l;
    let v_l = case.summary.and_then(|s| s.fleet.formation_speed_at_the_end).unwrap_or(planned);
    let excited = mission.excited_speed_at(v_l);
    let (name, condition, value) = match mission.law_delay() {
        _ if excited.is_some() => {
            ("Fleet speed left by δ under (4.59) (erratum 4.14)", "α₂ at rest".to_string(), format!("v_L = {v_l:.4}"))
        }
        Some(tau) => (
            "Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)",
            format!("every message τ = {tau} s late"),
            format!("v_L = {v_l:.4}, v_L*/v_L = {:.4}", mission.nominal_factor()),
        ),
        None => ("Fleet speed v_L", "the vehicles agree".to_string(), format!("v_L = {v_l:.4}")),
    };
    TheoryRow {
        name: name.into(),
        condition,
        value,
        holds: mission.law_delay().map(|tau| told_truly(mission, tau)),
        predicted: excited
            .or_else(|| Some(speed_factor(mission)? * v_l))
            .map_or("–".into(), |speed| format!("{speed:.5} 1/s")),
        measured: case.measured(|s| format!("{:.5} 1/s", s.fleet.steady_speed)),
        ..TheoryRow::default()
    }
}

pub(super) fn bias(case: &Case<'_>) -> Option<TheoryRow> {
    let mission = case.mission;
    let first = (0..mission.vehicles.len()).find(|&i| mission.predicted_along_bias(i).is_some())?;
    let bias = mission.predicted_along_bias(first)?;
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, the matrix B keeps its rank".into(),
        value: "checked when the mission was read".into(),
        holds: Some(true),
        predicted: format!("{bias:.3} m"),
        measured: case.measured(|s| s.vehicles.get(first).map_or("–".into(), |v| format!("{:.3} m", v.along_mean_m))),
        ..TheoryRow::default()
    })
}
