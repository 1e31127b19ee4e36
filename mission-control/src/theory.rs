//! Theory beside measurement: the conditions of the theorems that speak about a mission, and what they promise.

use common::graph::measure::Connectivity;
use common::graph::spectrum;
use common::mission::Mission;
use common::mission::file::{LawChoice, ModelChoice};

use crate::results::{Summary, TheoryRow};

/// A guaranteed decay of the coordination error: ‖e(t)‖ ≤ factor · exp(−rate t) ‖e(0)‖.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarantee {
    /// Rate of the norm \[1/s\].
    pub rate: f64,
    /// Factor, where it is known.
    pub factor: Option<f64>,
}

/// The planned switching signal of a mission, measured from start to end.
pub fn planned(mission: &Mission) -> Connectivity {
    let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
    Connectivity::planned(mission.switching.clone(), mission.vehicles.len(), &arcs, mission.end)
}

/// The share of time without connection that the planned signal approaches, and the T_0 that goes with it \[s\].
fn losses(mission: &Mission) -> (f64, f64) {
    let planned = planned(mission);
    let alpha = planned.loss_fraction();
    (alpha, if alpha < 1.0 { planned.t_0(alpha).secs() } else { f64::INFINITY })
}

/// What Theorem 4.4 guarantees for this mission, if it speaks about it: (4.21) on undirected links without delay, with
/// targets that move as they are told (type II).
pub fn guarantee(mission: &Mission) -> Option<Guarantee> {
    let LawChoice::Switching(law) = &mission.law_choice else { return None };
    let graph = mission.graph();
    let immediate =
        mission.links.iter().all(|link| link.delay == common::mission::Delay::Constant(common::time::Span::ZERO));
    let lossless = mission.links.iter().all(|link| link.loss == 0.0);
    if !graph.is_undirected() || !immediate || !lossless || !moves_as_told(mission) {
        return None;
    }
    let (alpha, t_0) = losses(mission);
    let lambda_m = spectrum::lambda_2(&graph)?;
    if alpha >= 1.0 {
        return None;
    }
    let rate = (1.0 - alpha) * law.gain * lambda_m;
    Some(Guarantee { rate, factor: Some((rate * t_0).exp()) })
}

/// Whether the virtual targets move at exactly the rate the law asks for (path following of type II).
fn moves_as_told(mission: &Mission) -> bool {
    mission.vehicles.iter().all(|vehicle| match &vehicle.following {
        common::mission::file::FollowingChoice::Theorem47(gains) => {
            gains.kind == common::mission::file::FollowingType::II
        }
        _ => false,
    })
}

/// Conditions and predictions before a flight, for `check`; with the measured values after it.
pub fn rows(mission: &Mission, summary: Option<&Summary>) -> Vec<TheoryRow> {
    let mut rows = vec![graph_row(mission)];
    rows.extend(losses_row(mission, summary));
    rows.push(mean_row(mission));
    rows.extend(rate_row(mission, summary));
    rows.push(speed_row(mission, summary));
    rows.extend(bias_row(mission, summary));
    rows
}

fn measured(summary: Option<&Summary>, value: impl Fn(&Summary) -> String) -> String {
    summary.map_or_else(|| "–".to_string(), value)
}

fn graph_row(mission: &Mission) -> TheoryRow {
    let graph = mission.graph();
    let lambda_2 = if graph.is_undirected() { spectrum::lambda_2(&graph) } else { None };
    TheoryRow {
        name: "Graph of all links (section 3.1)".into(),
        condition: if graph.is_undirected() { "connected".into() } else { "has a globally reachable vertex".into() },
        holds: Some(graph.can_agree()),
        predicted: lambda_2.map_or_else(|| "agreement".into(), |l| format!("λ₂ = {l:.4}")),
        measured: "–".into(),
    }
}

fn losses_row(mission: &Mission, summary: Option<&Summary>) -> Option<TheoryRow> {
    let (alpha, t_0) = losses(mission);
    Some(TheoryRow {
        name: "Brief connectivity losses (Definition 4.3)".into(),
        condition: format!("α = {alpha:.4} < 1"),
        holds: Some(alpha < 1.0),
        predicted: format!("α = {alpha:.4}, T₀ = {t_0:.3} s"),
        measured: measured(summary, |s| {
            s.fleet.connectivity.as_ref().map_or("–".into(), |c| {
                let t_0 = c.t_0_s.map_or("unbounded".into(), |t_0| format!("{t_0:.3} s"));
                format!("α = {:.4}, T₀ = {t_0}", c.alpha)
            })
        }),
    })
}

fn mean_row(mission: &Mission) -> TheoryRow {
    let window = planned(mission).connected_in_mean();
    let condition = match &mission.law_choice {
        LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_) => "uniformly connected in mean (Lemmas 4.4 and 4.5)",
        _ => "uniformly connected in mean (Theorem 4.5)",
    };
    TheoryRow {
        name: "Connected in mean (Definition 4.4)".into(),
        condition: condition.into(),
        holds: Some(window.is_some()),
        predicted: window
            .map_or_else(|| "no agreement guaranteed".into(), |t| format!("agreement; T = {:.3} s", t.secs())),
        measured: "–".into(),
    }
}

fn rate_row(mission: &Mission, summary: Option<&Summary>) -> Option<TheoryRow> {
    let guarantee = guarantee(mission)?;
    let holds = summary.and_then(|s| s.fleet.coordination.fit.as_ref()).map(|fit| fit.rate >= guarantee.rate * 0.999);
    Some(TheoryRow {
        name: "Rate of coordination (Theorem 4.4, type II; rate of the norm)".into(),
        condition: "undirected links, no delay, α < 1".into(),
        holds: holds.or(Some(true)),
        predicted: format!("≥ {:.5} 1/s", guarantee.rate),
        measured: measured(summary, |s| {
            s.fleet.coordination.fit.as_ref().map_or("–".into(), |fit| format!("{:.5} 1/s", fit.rate))
        }),
    })
}

fn speed_row(mission: &Mission, summary: Option<&Summary>) -> TheoryRow {
    let v_l = mission.speed.at(mission.end).v_l;
    let (name, condition) = match mission.law_delay() {
        Some(tau) => ("Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)", format!("every message τ = {tau} s late")),
        None => ("Fleet speed v_L", "the vehicles agree".to_string()),
    };
    TheoryRow {
        name: name.into(),
        condition,
        holds: mission.law_delay().map(|tau| mission.links.iter().all(|link| told_truly(link.delay, tau))),
        predicted: format!("{:.5} 1/s", mission.nominal_factor() * v_l),
        measured: measured(summary, |s| format!("{:.5} 1/s", s.fleet.steady_speed)),
    }
}

/// Whether the law was told the delay that the link has.
fn told_truly(delay: common::mission::Delay, tau: f64) -> bool {
    delay == common::mission::Delay::Constant(common::time::Span::from_secs(tau))
}

fn bias_row(mission: &Mission, summary: Option<&Summary>) -> Option<TheoryRow> {
    let first = mission.vehicles.iter().position(|v| matches!(v.model, ModelChoice::UnderactuatedAuv(_)))?;
    let bias = mission.predicted_along_bias(first)?;
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, the matrix B keeps its rank".into(),
        holds: Some(true),
        predicted: format!("{bias:.3} m"),
        measured: measured(summary, |s| {
            s.vehicles.get(first).map_or("–".into(), |v| format!("{:.3} m", v.along_mean_m))
        }),
    })
}
