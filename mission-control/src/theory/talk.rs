//! Known and estimated delays, and talk by event.

use common::mission::file::{Between, KnownDelay, LawChoice};
use common::mission::{Link, Mission};
use common::network::Delay;
use common::theory::{delay, event_triggered, known_delay};
use common::time::Span;

use super::Case;
use super::switching::moves_as_told;
use crate::results::TheoryRow;

/// The law that estimates v_L*.
pub(super) fn rows_of_estimating(case: &Case<'_>) -> Vec<TheoryRow> {
    let in_mean = case.network.planned.connected_in_mean().is_some();
    let one_delay = common_delay(case.mission).is_some();
    let value = format!(
        "{}, {}",
        if in_mean { "connected in mean" } else { "not connected in mean" },
        if one_delay { "one delay" } else { "delays that differ" }
    );
    vec![TheoryRow {
        name: "Agreement at an estimated v_L* (after Lemma 4.5)".into(),
        condition: "connected in mean, one constant delay, none lost but by the switching".into(),
        value,
        holds: Some(in_mean && one_delay && case.mission.loses_by_switching_only()),
        predicted: "v_L* is the only rest of the estimate".into(),
        measured: case.fitted_rate(),
        ..TheoryRow::default()
    }]
}

/// The law that compares what is of the same age.
pub(super) fn rows_of_known_delay(case: &Case<'_>, law: &KnownDelay) -> Vec<TheoryRow> {
    let Case { mission, network, .. } = case;
    // What was said lately is used until the next word: older by up to a message period and a control period.
    let held = mission.control_period * (mission.message_ticks + 1);
    let turn = greatest_delay(mission).and_then(|slowest| known_delay::turn(&network.graph, law.gain, slowest + held));
    let below = turn.is_some_and(|turn| turn < std::f64::consts::FRAC_PI_2);
    let one_delay = common_delay(mission).is_some();
    let fixed = network.graphs.len() == 1;
    let connected = network.graph.is_undirected() && network.graph.is_connected();
    let whole = mission.talk.is_none() && mission.loses_by_switching_only();
    let lacks = [
        (fixed, "the network changes"),
        (connected, "one-way links, or not connected"),
        (one_delay, "delays differ"),
        (whole, "messages are lost, or not said"),
        (below, "that is π/2 or more, or has no bound"),
    ];
    let lacks: String = lacks.iter().filter(|(met, _)| !met).map(|(_, lack)| format!("; {lack}")).collect();
    vec![TheoryRow {
        name: "Agreement with known delay".into(),
        condition: "fixed two-way connected network, one delay τ for all links, nothing lost, kλ_max τ < π/2 = 1.571"
            .into(),
        value: turn
            .map_or("kλ_max τ has no bound".into(), |turn| format!("kλ_max τ = {turn:.3} with the oldest news"))
            + &lacks,
        holds: Some(lacks.is_empty()),
        predicted: "agreement at v_L".into(),
        measured: case.fitted_rate(),
        ..TheoryRow::default()
    }]
}

/// What event-triggered talk costs at most.
pub(super) fn row_of_events(case: &Case<'_>) -> Option<TheoryRow> {
    let Case { mission, network, .. } = case;
    let trigger = mission.talk?;
    let LawChoice::Switching(law) = &mission.law_choice else { return None };
    // The bound is of equal gains.
    let gain = mission.has_equal_gains().then_some(law.gain);
    let used = mission.control_period * (mission.message_ticks + 1) + trigger.least_silence();
    let bound = greatest_delay(mission).zip(gain).and_then(|(slowest, gain)| {
        event_triggered::ultimate_bound(&network.graph, gain, trigger.floor(), (used + slowest).secs())
    });
    let heard = network.graphs.len() == 1 && mission.loses_by_switching_only();
    Some(TheoryRow {
        name: "Coordination error left by event-triggered talk".into(),
        condition: "fixed two-way network, nothing lost, advance, a small gain, targets that move as told (type II)"
            .into(),
        value: format!("threshold {} in the end", trigger.floor()),
        holds: Some(bound.is_some() && heard && mission.between == Between::Advance && moves_as_told(mission)),
        predicted: bound.map_or("no bound".into(), |b| format!("two vehicles at most {:.4} apart", 2f64.sqrt() * b)),
        measured: case.measured(|s| format!("{:.4} in the steady part", s.fleet.coordination.steady_rms)),
        ..TheoryRow::default()
    })
}

/// The delay that all messages on all links have, if they have.
pub(super) fn common_delay(mission: &Mission) -> Option<Span> {
    let first = mission.links.first()?.fixed_delay()?;
    mission.every_message_takes(first).then_some(first)
}

/// The greatest delay that a message can have, if there is one.
fn greatest_delay(mission: &Mission) -> Option<Span> {
    let of_link = |link: &Link| {
        link.layers.iter().try_fold(Span::ZERO, |sum, layer| match &layer.delay {
            Delay::Constant(delay) | Delay::Uniform(_, delay) => Some(sum + *delay),
            _ => None,
        })
    };
    if mission.medium.is_some() {
        return None;
    }
    mission.links.iter().try_fold(Span::ZERO, |greatest, link| Some(greatest.max(of_link(link)?)))
}

/// The speed at which the fleet will travel, as a part of v_L, if theory knows it.
pub fn speed_factor(mission: &Mission) -> Option<f64> {
    match &mission.law_choice {
        LawChoice::DelayedEstimating(law) => common_delay(mission).map(|tau| delay::steady_speed(1.0, law.gain, tau)),
        _ => Some(mission.nominal_factor()),
    }
}
