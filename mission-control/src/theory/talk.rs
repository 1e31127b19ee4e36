//! Known and estimated delays, and talk by event.

use std::f64::consts::FRAC_PI_2;

use common::graph::Graph;
use common::mission::file::{Between, DelayedEstimating, KnownDelay, LawChoice, ModelChoice};
use common::mission::{Link, Mission, VehiclePlan};
use common::network::Delay;
use common::theory::known_delay_by_link::{self, Late};
use common::theory::{delay, event_triggered, known_delay};
use common::time::{Span, Time};

use super::late_news::is_4_34;
use super::premises::lost;
use super::switching::moves_as_told;
use super::{Case, delayed};
use crate::results::TheoryRow;

/// The law that estimates v_L*. While somebody is alone, no theorem speaks of it: docs/talking.md has an estimate of what T must be, and
/// fleets that keep to all other premises and do not agree. Where nobody ever is, it is (4.34), and Lemma 4.4 holds.
pub(super) fn rows_of_estimating(case: &Case<'_>, law: &DelayedEstimating) -> Vec<TheoryRow> {
    let tau = common_delay(case.mission);
    if let Some(tau) = tau.filter(|_| is_4_34(case)) {
        let row = delayed::row(case, law.gain, tau);
        let value =
            format!("nobody is ever alone, so that the estimate is not used and the law is (4.34); {}", row.value);
        return vec![TheoryRow { value, ..row }];
    }
    let least = |tau: Span| (1.0 + law.gain * tau.secs()) / law.gain;
    let value = match tau {
        Some(tau) => {
            format!("T = {} s, and vehicles alike want T ≥ (1 + kτ)/k = {} s", law.time_constant_s, least(tau))
        }
        None => "delays differ, of which nothing is known".into(),
    };
    vec![TheoryRow {
        name: "Agreement at an estimated v_L*".into(),
        condition:
            "a theorem about vehicles that are alone with an estimate; there is none, docs/talking.md has an estimate"
                .into(),
        value,
        holds: Some(false),
        predicted: "–".into(),
        measured: case.fitted_rate(),
        ..TheoryRow::default()
    }]
}

/// The law that compares what is of the same age.
pub(super) fn rows_of_known_delay(case: &Case<'_>, law: &KnownDelay) -> Vec<TheoryRow> {
    let Case { mission, network, .. } = case;
    let late = oldest_news(mission);
    let statement = late.as_deref().map(|late| of_delays(mission, &network.graph, law.gain, late));
    let connected = network.graph.is_undirected() && network.graph.is_connected();
    let lost = lost_in_words(mission);
    let lacks = [
        (network.graphs.len() == 1, "the network changes"),
        (connected, "one-way links, or not connected"),
        (lost.is_empty(), &lost),
        (mission.talk.is_none(), "vehicles speak by event, not all the time"),
        (late.is_some(), "a delay has no bound"),
        (
            late.iter().flatten().all(|link| link.oldest.secs() <= law.longest_s),
            "news older than longest_s do not count",
        ),
        (
            mission.validity.is_none_or(|validity| longest_pause(mission) <= validity),
            "validity_s is shorter than pauses between messages",
        ),
        (statement.as_ref().is_none_or(|statement| statement.value < statement.limit), "that is too much"),
        (goes_as_told(case), NOT_AS_TOLD),
    ];
    let lacks: String = lacks.iter().filter(|(met, _)| !met).map(|(_, lack)| format!("; {lack}")).collect();
    let holds = lacks.is_empty();
    let rate = statement.as_ref().and_then(|statement| statement.rate).filter(|_| holds);
    let value = statement.as_ref().map_or("–".into(), |statement| {
        format!("{}: {} = {:.3} with the oldest news", statement.delays, statement.quantity, statement.value)
    });
    let asked = statement.as_ref().map_or("a bound on every delay".into(), |statement| {
        format!("{} < {}", statement.quantity, statement.limit_in_words)
    });
    vec![TheoryRow {
        name: "Agreement with known delay".into(),
        condition: format!(
            "fixed two-way connected network, nothing lost, {asked}, type II or a kinematic vehicle along its line"
        ),
        value: value + &lacks,
        holds: Some(holds),
        predicted: match rate {
            _ if !holds => "–".into(),
            Some(rate) => format!("agreement at v_L; ‖e‖ decays at {rate:.5} 1/s at least in the end"),
            None => "agreement at v_L".into(),
        },
        guaranteed_rate: rate,
        measured: case.fitted_rate(),
    }]
}

/// What is known of delays like a mission's.
struct OfDelays {
    delays: &'static str,
    quantity: &'static str,
    value: f64,
    limit: f64,
    limit_in_words: &'static str,
    rate: Option<f64>,
}

/// One delay, delays alike both ways, or any: the sharpest statement that speaks of them.
fn of_delays(mission: &Mission, graph: &Graph, gain: f64, late: &[Late]) -> OfDelays {
    let oldest = late.iter().map(|link| link.oldest).max().unwrap_or(Span::ZERO);
    let turn = OfDelays {
        delays: "one delay",
        quantity: "kλ_max τ",
        value: known_delay::turn(graph, gain, oldest).unwrap_or(f64::INFINITY),
        limit: FRAC_PI_2,
        limit_in_words: "π/2",
        rate: None,
    };
    let constant = mission.links.iter().all(|link| link.fixed_delay().is_some());
    match common_delay(mission) {
        // What is used is between τ and that much older; each mode is fastest at one age, and slowest at one of the ends.
        Some(youngest) => {
            let of = |age| known_delay::agreement_rate(graph, gain, age);
            OfDelays { rate: of(youngest).zip(of(oldest)).map(|(one, other)| one.min(other)), ..turn }
        }
        None if constant && known_delay_by_link::is_alike_both_ways(late) => OfDelays {
            delays: "delays alike both ways",
            rate: known_delay_by_link::rate_at_least(graph, gain, oldest),
            ..turn
        },
        None => OfDelays {
            delays: "delays of any kind",
            quantity: "k‖T‖",
            value: known_delay_by_link::loop_gain(graph.len(), gain, late),
            limit: 1.0,
            limit_in_words: "1",
            rate: None,
        },
    }
}

/// How old what is used of a neighbour can become on every link, if there is a bound: what was said lately is used until the next word, so it
/// grows older by up to a message period and a control period.
fn oldest_news(mission: &Mission) -> Option<Vec<Late>> {
    let held = mission.control_period * (mission.message_ticks + 1);
    let of =
        |link: &Link| Some(Late { to: link.to, from: link.from, oldest: greatest_delay_of(mission, link)? + held });
    mission.links.iter().map(of).collect()
}

const NOT_AS_TOLD: &str = "a vehicle does not move just as told";

/// Whether every ξ moves at just the rate that the law asks for: targets of type II, or kinematic vehicles that start on their lines, where
/// they stay, undisturbed and without limits that would hold them back.
fn goes_as_told(case: &Case<'_>) -> bool {
    let along = |(index, plan): (usize, &VehiclePlan)| {
        let limits = plan.limits;
        matches!(plan.model, ModelChoice::KinematicUnicycle)
            && case.mission.starts_along_its_path(index)
            && limits.acceleration.is_infinite()
            && limits.turn_rate.is_infinite()
    };
    moves_as_told(case.mission) || (case.disturbances.is_empty() && case.mission.vehicles.iter().enumerate().all(along))
}

/// What event-triggered talk costs at most.
pub(super) fn row_of_events(case: &Case<'_>) -> Option<TheoryRow> {
    let Case { mission, network, .. } = case;
    let trigger = mission.talk?;
    let LawChoice::Switching(law) = &mission.law_choice else { return None };
    // The bound is of equal gains.
    let gain = mission.has_equal_gains().then_some(law.gain);
    let used = mission.control_period * (mission.message_ticks + 1) + trigger.least_silence();
    let oldest = greatest_delay(mission).map(|slowest| (used + slowest).secs());
    let of_beliefs = oldest.zip(gain);
    let bound = of_beliefs
        .and_then(|(oldest, gain)| event_triggered::ultimate_bound(&network.graph, gain, trigger.floor(), oldest));
    let loop_gain =
        of_beliefs.and_then(|(oldest, gain)| Some((oldest, event_triggered::loop_gain(&network.graph, gain, oldest)?)));
    let lost = lost_in_words(mission);
    let premises = [
        (network.graphs.len() == 1, "the network changes"),
        (lost.is_empty(), lost.as_str()),
        (mission.between == Between::Advance, "beliefs do not move on at v_L"),
        (goes_as_told(case), NOT_AS_TOLD),
    ];
    let premises = premises.iter().filter(|(met, _)| !met).map(|(_, lack)| (*lack).to_string());
    let of_bound = [
        one_way_links(&network.graph),
        (network.graph.is_undirected() && !network.graph.is_connected()).then(|| "not connected: λ_2 = 0".into()),
        gain.is_none().then(|| unequal_gains(mission)),
        oldest.is_none().then(|| "delays have no bound".into()),
        loop_gain.filter(|(_, share)| *share >= 1.0).map(|(oldest, share)| {
            format!(
                "a gain too large for news that are σ = {oldest:.3} s old: σk(λ_max g + d) = {share:.3}, not below 1"
            )
        }),
        of_beliefs.zip(bound).and_then(|(news, bound)| changed_too_late(case, news, bound)),
    ];
    let lacks: String = premises.chain(of_bound.into_iter().flatten()).map(|lack| format!("; {lack}")).collect();
    Some(TheoryRow {
        name: "Coordination error left by event-triggered talk".into(),
        condition: "fixed two-way connected network, bounded delays, nothing lost, advance, equal gains with σk(λ_max g + d) < 1, \
                    v_L constant for long enough before the end, type II or a kinematic vehicle along its line"
            .into(),
        value: format!("threshold {} in the end{lacks}", trigger.floor()),
        holds: Some(lacks.is_empty()),
        predicted: bound
            .filter(|_| lacks.is_empty())
            .map_or("–".into(), |b| format!("two vehicles at most {:.4} apart in the end", 2f64.sqrt() * b)),
        measured: case.measured(|s| format!("{:.4} in the steady part", s.fleet.coordination.steady_rms)),
        ..TheoryRow::default()
    })
}

/// How messages can be lost, if they can.
fn lost_in_words(mission: &Mission) -> String {
    match lost(mission) {
        ways if ways.is_empty() => String::new(),
        ways => format!("messages are lost: {}", ways.join(", ")),
    }
}

/// What changes of v_L have left at the end counts as forgotten below this part of the bound.
const FORGOTTEN: f64 = 0.01;

/// That v_L changed too shortly before the end, and by how much; news are up to `oldest` old \[s\] when they are used.
fn changed_too_late(case: &Case<'_>, (oldest, gain): (f64, f64), bound: f64) -> Option<String> {
    let (graph, silence) = (&case.network.graph, case.mission.talk?.most_silence());
    let end = case.summary.map_or(case.mission.end, |summary| Time::from_secs(summary.duration_s));
    let changes = case.speed().changes(end);
    let (last, _) = changes.last()?;
    let left = changes.iter().map(|(at, by)| {
        // Nothing is believed that was said before the start, or longer ago than anyone is silent.
        let age = silence.map_or(at.secs(), |silence| silence.secs().min(at.secs())) + oldest;
        let added = event_triggered::added_by_a_change(graph, gain, by.abs() * age, oldest)?;
        Some(added * event_triggered::left_after(graph, gain, ((end - *at).secs() - oldest).max(0.0))?)
    });
    let part = FORGOTTEN * bound / left.sum::<Option<f64>>()?;
    (part < 1.0).then_some(())?;
    let missing = event_triggered::time_until(graph, gain, part)?;
    Some(format!(
        "v_L changes {:.3} s before the end, at {last}, which is {missing:.3} s too late for what that leaves to be forgotten",
        (end - *last).secs()
    ))
}

/// How many links go one way only, if any does.
fn one_way_links(graph: &Graph) -> Option<String> {
    let all = graph.arcs().count();
    let alone = graph.arcs().filter(|&(receiver, sender)| !graph.hears(sender, receiver)).count();
    (alone > 0).then(|| format!("{alone} of {all} directed links without the other direction"))
}

fn unequal_gains(mission: &Mission) -> String {
    let gains = mission.gains("gain");
    let (least, most) = gains.iter().fold((f64::INFINITY, 0.0f64), |(a, b), gain| (a.min(*gain), b.max(*gain)));
    format!("unequal gains, {least} to {most}")
}

/// The delay that all messages on all links have, if they have.
pub(super) fn common_delay(mission: &Mission) -> Option<Span> {
    let first = mission.links.first()?.fixed_delay()?;
    mission.every_message_takes(first).then_some(first)
}

/// The longest time between two arrivals on a link, of delays that have a bound.
fn longest_pause(mission: &Mission) -> Span {
    let spread = |delay: &Delay| match delay {
        Delay::Uniform(least, greatest) => Span::from_nanos(greatest.nanos() - least.nanos()),
        _ => Span::ZERO,
    };
    let of_link = |link: &Link| link.layers.iter().fold(Span::ZERO, |sum, layer| sum + spread(&layer.delay));
    mission.control_period * mission.message_ticks + mission.links.iter().map(of_link).max().unwrap_or(Span::ZERO)
}

/// The greatest delay that a message can have, if there is one.
fn greatest_delay(mission: &Mission) -> Option<Span> {
    mission.links.iter().try_fold(Span::ZERO, |greatest, link| Some(greatest.max(greatest_delay_of(mission, link)?)))
}

/// The same on one link.
fn greatest_delay_of(mission: &Mission, link: &Link) -> Option<Span> {
    if mission.medium.is_some() {
        return None;
    }
    link.layers.iter().try_fold(Span::ZERO, |sum, layer| match &layer.delay {
        Delay::Constant(delay) | Delay::Uniform(_, delay) => Some(sum + *delay),
        _ => None,
    })
}

/// The speed at which the fleet will travel, as a part of v_L, if theory knows it.
pub fn speed_factor(mission: &Mission) -> Option<f64> {
    match &mission.law_choice {
        LawChoice::DelayedEstimating(law) => common_delay(mission).map(|tau| delay::steady_speed(1.0, law.gain, tau)),
        _ => Some(mission.nominal_factor()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDED: &str = include_str!("../../../missions/talk/bounded.toml");

    /// The row of a flight whose speed goes up to `speed` at this time.
    fn row(at_s: f64, speed: f64) -> TheoryRow {
        let step = format!("\nprofile = [{{ from_s = 0.0, speed = 0.5 }}, {{ from_s = {at_s}, speed = {speed} }}]\n");
        let text = BOUNDED.replacen("\nspeed = 0.5\n", &step, 1);
        let mission = Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}"));
        row_of_events(&Case::new(&mission, None)).expect("it speaks by event")
    }

    #[test]
    fn a_change_of_v_l_shortly_before_the_end_is_not_covered_by_the_bound_of_talk_by_event() {
        let late = row(119.0, 5.0);
        assert_eq!((late.holds, late.predicted.as_str()), (Some(false), "–"), "{late:?}");
        assert!(late.value.contains("v_L changes 1.000 s before the end, at 119.000 s, which is 9"), "{}", late.value);
        let early = row(20.0, 0.6);
        assert!(early.holds == Some(true) && early.predicted.contains("0.2015"), "{early:?}");
        // The same speed again is no change.
        assert_eq!(row(119.0, 0.5).holds, Some(true));
    }
}
