//! The theorem monitor over a mission: a flight that is over, or one so far.

use common::mission::Mission;
use common::mission::file::LawChoice;
use common::theory::monitor::{self, Judgement, Seen, Watch, Watched};
use common::time::{Span, Time};

use super::Case;
use super::network::Network;
use super::switching::moves_as_told;
use crate::results::{Summary, TheoryRow};

/// What the monitor watches in this mission; `None` if it has no statement about its law, or if a premise that is
/// not about the switching is missing (other rows say so).
fn watched(mission: &Mission, network: &Network) -> Option<Watched> {
    match &mission.law_choice {
        LawChoice::Switching(_) if network.immediate && moves_as_told(mission) => {
            Some(Watched::Agreement(mission.gains("gain")))
        }
        LawChoice::AuxiliarySwitching(law) if network.immediate && moves_as_told(mission) => {
            Some(Watched::Dynamic(law.a1, law.a2))
        }
        LawChoice::DelayedWithLosses(_) => Some(Watched::Delayed),
        LawChoice::Delayed(_) if network.leaves_nobody_alone() => Some(Watched::Delayed),
        _ => None,
    }
}

/// What sampling may add to the errors: neighbours are heard up to a message period and two control periods late, and a
/// fleet at v_L has moved on by then.
fn tolerance(mission: &Mission, summary: &Summary) -> f64 {
    let period = mission.control_period.secs();
    let late = period * (mission.message_ticks as f64 + 2.0);
    let n = mission.vehicles.len() as f64;
    n * late * mission.speed.fastest() + 0.01 * summary.fleet.coordination.initial
}

/// After a flight: covered, not covered, or a defect.
pub(super) fn row(case: &Case<'_>) -> Option<TheoryRow> {
    let summary = case.summary?;
    let network = &case.network;
    let watched = watched(case.mission, network)?;
    let measured = summary.fleet.connectivity.as_ref()?;
    let planned = Seen::of(&network.planned)?;
    let length = Span::from_secs(summary.duration_s);
    let seen = Seen {
        length,
        alpha: measured.alpha,
        t_0: measured.t_0_s.map(Span::from_secs),
        dwell: planned.dwell,
        mean: measured.t_s.map(Span::from_secs),
    };
    let watch = monitor::watch(&watched, &network.graphs, seen);
    let series = &summary.fleet.coordination.series;
    let errors: Vec<(f64, f64)> = series.t_s.iter().copied().zip(series.norm.iter().copied()).collect();
    let judged = watch.judge(&errors, tolerance(case.mission, summary));
    Some(TheoryRow {
        name: "Theorem monitor: the network as measured, the error over time".into(),
        condition: "a statement covers the fleet, and its errors stay within what it promises".into(),
        value: margins(&watch),
        holds: Some(matches!(judged, Judgement::Covered { .. })),
        predicted: watch.envelope.as_ref().map_or("–".into(), |envelope| {
            format!("‖e(t)‖ ≤ {:.3} e^(−{:.5} t) ‖e(0)‖ ({})", envelope.factor, envelope.rate, envelope.statement)
        }),
        guaranteed_rate: watch.envelope.as_ref().map(|envelope| envelope.rate),
        measured: judged.to_string(),
    })
}

fn margins(watch: &Watch) -> String {
    let words = watch.margins.iter().map(|margin| {
        format!("{}: {} = {:.4}, limit {:.4}", margin.statement, margin.quantity, margin.value, margin.limit)
    });
    words.collect::<Vec<_>>().join("; ")
}

/// For a fleet under way, the switching signal up to `now`: what theory says so far. The signal is that of the mission,
/// which the emulator plays; `None` if there is nothing to say yet, or no statement about the mission's law.
pub fn so_far(mission: &Mission, now: Time) -> Option<String> {
    let mut flown = mission.clone();
    flown.end = now.min(mission.end);
    if flown.end <= Time::ZERO || mission.vehicles.len() < 2 {
        return None;
    }
    let network = Network::of(&flown);
    let seen = Seen::of(&network.planned)?;
    let t_0 = seen.t_0.map_or("unbounded".to_string(), |t_0| t_0.to_string());
    let mean = seen.mean.map_or("not connected in mean".to_string(), |mean| format!("T = {mean}"));
    let network_words = format!("network so far: α = {:.4}, T₀ = {t_0}, {mean}", seen.alpha);
    let Some(watched) = watched(&flown, &network) else { return Some(network_words) };
    let watch = monitor::watch(&watched, &network.graphs, seen);
    Some(match (&watch.covered_by, &watch.envelope) {
        (Some(_), Some(envelope)) => format!(
            "{network_words}; covered by {}: errors are at most {:.3e} of those at the start",
            envelope.statement,
            envelope.at(flown.end.secs())
        ),
        (Some(statement), None) => format!("{network_words}; covered by {statement}"),
        (None, _) => format!("{network_words}; {}", watch.judge(&[], 0.0)),
    })
}
