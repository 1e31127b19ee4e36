//! The theorem monitor over a fleet under way: the switching signal up to now, and where the vehicles said they are.

use common::coordination::disagreement;
use common::mission::Mission;
use common::record::Fate;
use common::theory::monitor::{self, Envelope, Margin, Premise, Seen};
use common::time::{Span, Time};
use common::wire::fleet::FleetStatus;
use common::wire::vehicle::{Phase, SpeedCommand};
use serde::Serialize;
use vehicle_node::node::STOPPED;

use super::network::Network;
use super::premises::{dropped, looked_for, planned_exchange, tolerance};
use super::watched::network_words;
use crate::console::{error_in_words, short};

/// Whoever was heard longer ago than this many message periods, and a second, has fallen silent.
const SILENT_PERIODS: i64 = 5;

/// What theory says so far.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoFar {
    /// Until when \[s\].
    pub until_s: f64,
    /// α, T_0, τ_D and T so far.
    pub alpha: f64,
    /// `None` if never connected.
    pub t_0_s: Option<f64>,
    /// The shortest time between two changes.
    pub dwell_s: f64,
    /// `None` if not connected in mean.
    pub t_s: Option<f64>,
    /// Every condition that was looked at.
    pub margins: Vec<Margin>,
    /// Premises that are not so.
    pub broken: Vec<Premise>,
    /// The statement that covers the fleet.
    pub covered_by: Option<&'static str>,
    /// What it promises, if it promises a rate.
    pub envelope: Option<Envelope>,
    /// ‖e‖ at the start, and now, from where the vehicles last said they are; `None` if one has said nothing.
    pub initial_error: f64,
    /// See there.
    pub error: Option<f64>,
    /// max |x_i − x_j| now, likewise.
    pub largest: Option<f64>,
    /// What the envelope allows now; `None` once v_L has changed.
    pub allowed: Option<f64>,
    /// All of this in words.
    pub verdict: String,
    #[serde(skip)]
    words: String,
}

impl std::fmt::Display for SoFar {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.words)
    }
}

/// What theory says of a fleet under way. The switching signal is that of the mission, which the emulator plays; `None` if there
/// is nothing to say yet.
pub fn so_far(mission: &Mission, status: &FleetStatus) -> Option<SoFar> {
    let mut flown = mission.clone();
    flown.end = status.now.min(mission.end);
    if flown.end <= Time::ZERO || mission.vehicles.len() < 2 {
        return None;
    }
    let network = Network::of(&flown);
    let planned = Seen::of(&network.planned)?;
    let missing: Vec<Premise> = missing(mission, status).into_iter().chain(dropped_so_far(mission, status)).collect();
    let norm = |states: Vec<f64>| disagreement::of_fleet(states.into_iter());
    let states = now(mission, status);
    let largest = states.as_ref().map(|states| largest_difference(states));
    let (initial_error, error) = (norm(at_start(mission)), states.map(norm));
    let errors_now = error.zip(largest);
    let Some(looked) = looked_for(&flown, &network) else {
        let names = "Theorems 4.4 and 4.5 and Lemma 4.7 do not speak of this law; the report says what does";
        let found: Vec<String> = missing.iter().map(ToString::to_string).collect();
        let verdict = if found.is_empty() { names.to_string() } else { format!("not covered: {}", found.join("; ")) };
        let watch =
            monitor::Watch { seen: planned, margins: Vec::new(), broken: missing, covered_by: None, envelope: None };
        return Some(said(&watch, flown.end, initial_error, errors_now, None, verdict));
    };
    let exchange = planned_exchange(&flown, &network);
    let seen = Seen { exchange: Some(exchange), ..planned };
    let broken = looked.broken.iter().cloned().chain(missing).collect();
    let watch = monitor::watch(&looked.watched, &network.graphs, seen, broken);
    let mut speed = flown.speed.clone();
    speed.command(SpeedCommand { at: flown.end, speed: status.speed });
    let tolerance = tolerance(mission, &speed, &network.graphs, &watch, &looked.watched);
    let t = flown.end.secs();
    // Between words, a vehicle is taken to go on at v_L: it strays by what coordination asks of it meanwhile.
    let mut errors = vec![(0.0, initial_error)];
    errors.extend(error.map(|error| (t, error)));
    // What the error was when v_L changed is not known here: the report judges what comes after.
    let changed = status.speed_since > Time::ZERO;
    let allowed =
        watch.envelope.as_ref().filter(|_| !changed).map(|envelope| tolerance.allowed(envelope, initial_error, t));
    let verdict = match (error, watch.judge(&errors, tolerance)) {
        (None, monitor::Judgement::Covered { statement, .. }) => {
            format!("covered by {statement}; not every vehicle has said where it is")
        }
        (_, judged) => match watch.envelope.filter(|_| changed && watch.covered_by.is_some()) {
            Some(Envelope { statement, .. }) => format!(
                "covered by {statement}; v_L changed at {:.2} s, and the report will judge the errors before and since",
                status.speed_since.secs()
            ),
            None => judged.to_string(),
        },
    };
    Some(said(&watch, flown.end, initial_error, errors_now, allowed, verdict))
}

fn said(
    watch: &monitor::Watch,
    until: Time,
    initial_error: f64,
    errors_now: Option<(f64, f64)>,
    allowed: Option<f64>,
    verdict: String,
) -> SoFar {
    let mut words = format!("network so far, as planned: {}", network_words(watch));
    for margin in &watch.margins {
        words += &format!("\n{}", margin.in_words());
    }
    if let Some((error, largest)) = errors_now {
        let allowed = allowed.map_or(String::new(), |allowed| format!(", at most {} allowed", short(allowed)));
        let (now, before) = (error_in_words(error, largest), short(initial_error));
        words += &format!("\ncoordination error now: {now}; ‖e‖ was {before} at the start{allowed}");
    }
    words += &format!("\n{verdict}");
    let Seen { alpha, t_0, dwell, mean, .. } = watch.seen;
    SoFar {
        until_s: until.secs(),
        alpha,
        t_0_s: t_0.map(Span::secs),
        dwell_s: dwell.secs(),
        t_s: mean.map(Span::secs),
        margins: watch.margins.clone(),
        broken: watch.broken.clone(),
        covered_by: watch.covered_by,
        envelope: watch.envelope,
        initial_error,
        error: errors_now.map(|(error, _)| error),
        largest: errors_now.map(|(_, largest)| largest),
        allowed,
        verdict,
        words,
    }
}

/// The premise that a vehicle which is not there does not meet.
fn missing(mission: &Mission, status: &FleetStatus) -> Option<Premise> {
    let silent = (mission.control_period * (mission.message_ticks * SILENT_PERIODS)).max(Span::from_secs(1.0));
    let found: Vec<String> = mission
        .vehicles
        .iter()
        .filter_map(|plan| {
            let of = status.vehicles.iter().find(|vehicle| vehicle.id == plan.id);
            let last = of.and_then(|of| of.said).map(|(made, _)| made);
            let since = last.map_or(String::new(), |made| format!(" since {:.1} s", made.secs()));
            match of {
                Some(of) if of.phase == Phase::Aborted && of.reason == STOPPED => {
                    Some(format!("{} was stopped", plan.id))
                }
                Some(of) if of.phase == Phase::Aborted => Some(format!("{} gave up{}", plan.id, because(&of.reason))),
                Some(of) if !of.connected => Some(format!("{} is not connected, silent{since}", plan.id)),
                None => Some(format!("{} is not connected", plan.id)),
                Some(_) if mission.talk.is_none() && last.is_some_and(|made| status.now - made > silent) => {
                    Some(format!("{} is silent{since}", plan.id))
                }
                Some(_) => None,
            }
        })
        .collect();
    (!found.is_empty()).then(|| Premise { asks: "every vehicle all the time", found: found.join(", ") })
}

/// The premise that messages which the network dropped so far, and not for links that were down, do not meet.
fn dropped_so_far(mission: &Mission, status: &FleetStatus) -> Option<Premise> {
    let met =
        |fate| Fate::DROPS.iter().zip(status.drops).find(|(cause, _)| **cause == fate).map_or(0, |(_, count)| count);
    dropped(mission, status.messages[0], met)
}

fn largest_difference(states: &[f64]) -> f64 {
    let (least, most) = states.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    most - least
}

fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {reason}") }
}

fn at_start(mission: &Mission) -> Vec<f64> {
    mission.vehicles.iter().map(|plan| plan.start.xi - plan.pattern.at(Time::ZERO).h).collect()
}

/// ξ_i − h_i now, from where the vehicles last said they are, advanced at the fleet's speed.
fn now(mission: &Mission, status: &FleetStatus) -> Option<Vec<f64>> {
    let speed = status.speed * mission.nominal_factor();
    let of = |plan: &common::mission::VehiclePlan| {
        let (made, xi) = status.vehicles.iter().find(|vehicle| vehicle.id == plan.id)?.said?;
        Some(xi + speed * (status.now - made).secs() - plan.pattern.at(status.now).h)
    };
    mission.vehicles.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use common::wire::fleet::VehicleStatus;

    use super::*;

    const BRIEF_LOSSES: &str = include_str!("../../../missions/brief-losses.toml");

    fn at(t: f64, xi: [f64; 3], connected: [bool; 3]) -> (Mission, FleetStatus) {
        let mission = Mission::parse("m.toml", BRIEF_LOSSES).unwrap_or_else(|faults| panic!("{faults}"));
        let now = Time::from_secs(t);
        let vehicles = mission.vehicles.iter().zip(xi).zip(connected).map(|((plan, xi), connected)| VehicleStatus {
            id: plan.id.clone(),
            connected,
            phase: Phase::Running,
            reason: String::new(),
            said: Some((now, xi)),
        });
        let status = FleetStatus {
            phase: Phase::Running,
            mission: BRIEF_LOSSES.into(),
            now,
            end: mission.end,
            speed: 0.5,
            speed_since: Time::ZERO,
            vehicles: vehicles.collect(),
            collected: false,
            messages: [0; 4],
            drops: [0; 8],
            counted_from: Time::ZERO,
            pace: None,
        };
        (mission, status)
    }

    #[test]
    fn a_fleet_under_way_is_inside_or_outside_its_envelope() {
        let (mission, near) = at(60.0, [30.0, 30.1, 30.2], [true; 3]);
        let so_far = so_far(&mission, &near).expect("time has passed");
        assert!(so_far.verdict.starts_with("covered by Theorem 4.4"), "{}", so_far.verdict);
        assert!((so_far.error.expect("all spoke") - 0.02f64.sqrt()).abs() < 1e-9);
        assert!(
            so_far.to_string().contains("coordination error now: ‖e‖ = 0.1414, max |x_i − x_j| = 0.2;"),
            "{so_far}"
        );
        assert!(
            so_far.to_string().contains("network so far, as planned: α = ")
                && so_far.to_string().contains("less than 0.625 s will do")
        );
        assert!(so_far.to_string().contains("dwell time 2.500 s") && so_far.margins.len() >= 5, "{so_far}");
        let (mission, far) = at(60.0, [10.0, 30.0, 90.0], [true; 3]);
        let so_far = super::so_far(&mission, &far).expect("time has passed");
        assert!(so_far.verdict.starts_with("a defect"), "{}", so_far.verdict);
    }

    #[test]
    fn what_was_dropped_is_a_broken_premise() {
        let (mission, mut status) = at(60.0, [30.0, 30.1, 30.2], [true; 3]);
        status.messages = [981, 40, 932, 9];
        let drops = |full: u64| {
            Fate::DROPS.map(|cause| match cause {
                Fate::QueueFull => full,
                Fate::LinkDown => 50,
                _ => 0,
            })
        };
        status.drops = drops(0);
        assert_eq!(so_far(&mission, &status).and_then(|so_far| so_far.covered_by), Some("Theorem 4.4"));
        status.drops = drops(882);
        let dropped = so_far(&mission, &status).expect("time has passed");
        let words = "882 of 981 messages were dropped for other reasons: queue full";
        assert!(dropped.covered_by.is_none() && dropped.verdict.contains(words), "{dropped}");
        assert!(dropped.broken.iter().any(|premise| premise.found == words), "{dropped:?}");
    }

    #[test]
    fn after_a_change_of_v_l_the_errors_are_left_to_the_report() {
        let (mission, far) = at(60.0, [10.0, 30.0, 90.0], [true; 3]);
        let changed = FleetStatus { speed: 0.9, speed_since: Time::from_secs(59.5), ..far };
        let said = so_far(&mission, &changed).expect("time has passed");
        assert!(said.verdict.starts_with("covered by Theorem 4.4; v_L changed at 59.50 s"), "{}", said.verdict);
        assert_eq!((said.allowed, said.to_string().contains("allowed\n")), (None, false), "{said}");
        // What does not cover the fleet is said as ever.
        let mut changed = changed;
        changed.vehicles[2].connected = false;
        let said = so_far(&mission, &changed).expect("time has passed");
        assert!(said.verdict.contains("auv3 is not connected"), "{}", said.verdict);
    }

    #[test]
    fn whoever_is_not_there_is_a_broken_premise() {
        let (mission, status) = at(60.0, [30.0, 30.1, 30.2], [true, true, false]);
        let gone = so_far(&mission, &status).expect("time has passed");
        assert!(gone.covered_by.is_none() && gone.verdict.contains("auv3 is not connected"), "{}", gone.verdict);
        let (mission, mut status) = at(60.0, [30.0, 30.1, 30.2], [true; 3]);
        status.vehicles[0].phase = Phase::Aborted;
        status.vehicles[0].reason = "it has diverged".into();
        let gave_up = so_far(&mission, &status).expect("time has passed");
        assert!(gave_up.covered_by.is_none() && gave_up.verdict.contains("auv1 gave up: it has diverged"), "{gave_up}");
        status.vehicles[0].reason = STOPPED.into();
        let stopped = so_far(&mission, &status).expect("time has passed").verdict;
        assert!(stopped.contains("auv1 was stopped") && !stopped.contains("gave up"), "{stopped}");
        status.vehicles[0].phase = Phase::Running;
        status.vehicles[1].said = Some((Time::from_secs(50.0), 25.0));
        let silent = so_far(&mission, &status).expect("time has passed");
        assert!(silent.verdict.contains("auv2 is silent since 50.0 s"), "{}", silent.verdict);
        status.vehicles[1].said = None;
        let unknown = so_far(&mission, &status).expect("time has passed");
        assert!(unknown.error.is_none() && unknown.verdict.contains("not every vehicle"), "{}", unknown.verdict);
        assert_eq!(so_far(&mission, &FleetStatus { now: Time::ZERO, ..status }), None);
    }
}
