//! What the statements of chapter 4 take for granted besides the switching signal, and what a mission has instead.

use common::graph::Graph;
use common::mission::file::{Between, FollowingChoice, FollowingType, LawChoice};
use common::mission::{Link, Mission, SpeedProfile};
use common::network::Delay;
use common::record::Fate;
use common::theory::PathFollowing;
use common::theory::monitor::{self, Exchange, Premise, Seen, Tolerance, Watch, Watched};
use common::time::{Span, Time};

use super::network::Network;

/// Whose statement is looked for, and which premises are not so.
pub(super) struct Looked {
    /// What is watched.
    pub(super) watched: Watched,
    /// Premises that are not so.
    pub(super) broken: Vec<Premise>,
    /// The delay that the law was told.
    pub(super) told: Span,
}

/// What the monitor looks for; `None` if no statement about switching networks speaks of the mission's law.
pub(super) fn looked_for(mission: &Mission, network: &Network) -> Option<Looked> {
    let at_once = || late_or_lost(mission, Span::ZERO).into_iter().collect::<Vec<Premise>>();
    let (watched, mut broken, told) = match &mission.law_choice {
        LawChoice::Switching(_) => {
            let mut broken = at_once();
            let following = following(mission).unwrap_or_else(|premise| {
                broken.push(premise);
                PathFollowing::TypeII { lambda_1: f64::INFINITY }
            });
            (Watched::Agreement(mission.gains("gain"), following), broken, Span::ZERO)
        }
        LawChoice::AuxiliarySwitching(law) => {
            let mut broken = at_once();
            broken.extend(not_as_told(mission));
            (Watched::Dynamic(law.a1, law.a2), broken, Span::ZERO)
        }
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => {
            let told = Span::from_secs(law.delay_s);
            (Watched::Delayed, premises_of_late_news(mission, network, told), told)
        }
        _ => return None,
    };
    if network.cut_off {
        broken.push(Premise {
            asks: "graphs that are all known",
            found: format!("only those of the first {} changes were collected", super::network::MOST_CHANGES),
        });
    }
    Some(Looked { watched, broken, told })
}

/// How messages will fill the times in which links are up, by the plan.
pub(super) fn planned_exchange(mission: &Mission, network: &Network) -> Exchange {
    let period = mission.control_period * mission.message_ticks;
    let oldest = match (network.graphs.len() > 1, mission.validity) {
        (false, _) => period,
        (true, validity) => validity.map_or(mission.end - Time::ZERO, |validity| period.max(validity)),
    };
    Exchange {
        age: age(mission, oldest),
        shortest_up: network.shortest_up,
        unheard: (period.secs() / network.shortest_up.secs().max(1e-9)).min(1.0),
    }
}

/// The age of what is used, from that of what was heard: what is heard in a control period is used by the next one, and its output
/// held for one more.
pub(super) fn age(mission: &Mission, oldest: Span) -> Span {
    oldest + mission.control_period * 2
}

/// What messages in periods may cost at most: how fast a neighbour seems to fall behind, and what rounding leaves.
pub(super) fn tolerance(
    mission: &Mission,
    speed: &SpeedProfile,
    graphs: &[Graph],
    watch: &Watch,
    watched: &Watched,
) -> Tolerance {
    let fastest = speed.fastest();
    let drift = if mission.between == Between::Hold { fastest } else { 0.0 };
    let furthest = mission.vehicles.iter().map(|plan| plan.start.xi.abs()).fold(0.0, f64::max);
    let tolerance = watch.tolerance(watched, graphs, drift);
    let rounding = ROUNDING * (furthest + fastest * mission.end.secs());
    Tolerance { added: tolerance.added + rounding, ..tolerance }
}

/// What rounding leaves of errors, as a part of the way that is flown.
const ROUNDING: f64 = 1e-12;

/// The conditions on messages in periods that the plan does not meet.
pub(super) fn too_rare(mission: &Mission, network: &Network, watched: &Watched) -> Vec<String> {
    let Some(seen) = Seen::of(&network.planned) else { return Vec::new() };
    let seen = Seen { exchange: Some(planned_exchange(mission, network)), ..seen };
    monitor::watch(watched, &network.graphs, seen, Vec::new()).too_rare()
}

/// What section 4.4 asks for besides connectedness in mean.
pub(super) fn premises_of_late_news(mission: &Mission, network: &Network, told: Span) -> Vec<Premise> {
    let mut broken: Vec<Premise> = late_or_lost(mission, told).into_iter().collect();
    broken.extend(not_as_told(mission));
    // (4.34) says nothing of a vehicle that hears nobody; (4.42) does.
    if matches!(mission.law_choice, LawChoice::Delayed(_)) && !network.leaves_nobody_alone() {
        let found = "at times a vehicle hears nobody".into();
        broken.push(Premise { asks: "a neighbour for every vehicle at all times, (4.34)", found });
    }
    broken
}

/// What is in the way of messages that all take `told` and are lost by the switching alone.
pub(super) fn late_or_lost(mission: &Mission, told: Span) -> Option<Premise> {
    let mut found: Vec<String> = late(mission, told).into_iter().chain(lost(mission)).collect();
    if mission.talk.is_some() {
        found.push("vehicles speak by event, not all the time".to_string());
    }
    let asks = if told > Span::ZERO {
        "messages that are all as late as the law was told, and lost by the switching alone"
    } else {
        "messages that arrive at once, and are lost by the switching alone"
    };
    (!found.is_empty()).then(|| Premise { asks, found: found.join(", ") })
}

/// How late messages are that do not all take `told`; what a shared medium adds is another matter.
fn late(mission: &Mission, told: Span) -> Option<String> {
    if mission.medium.is_some() || mission.every_message_takes(told) {
        return None;
    }
    let least = mission.links.iter().map(Link::least_delay).min()?;
    let greatest = mission.links.iter().map(Link::greatest_delay).max()?;
    let by_distance =
        mission.links.iter().any(|link| link.layers.iter().any(|layer| matches!(layer.delay, Delay::Distance { .. })));
    let constant = mission.links.iter().all(|link| link.fixed_delay().is_some());
    let found = match constant {
        true if least == greatest => format!("they take {}", in_full(least)),
        true => format!("they take {} to {}", in_full(least), in_full(greatest)),
        false if by_distance => format!("their delays vary with the distance, from {} on", in_full(least)),
        false => format!("their delays vary, {least} to {greatest}"),
    };
    if told <= Span::ZERO {
        return Some(found);
    }
    let mut off = vec![format!("told: {}", in_full(told))];
    if constant {
        let up_to = if least == greatest { "" } else { "up to " };
        off.extend((least < told).then(|| format!("{up_to}{} less", in_full(between(least, told)))));
        off.extend((told < greatest).then(|| format!("{up_to}{} more", in_full(between(told, greatest)))));
    }
    Some(format!("{found} ({})", off.join(", ")))
}

fn between(less: Span, more: Span) -> Span {
    Span::from_nanos(more.nanos() - less.nanos())
}

/// All the digits that it has, and three at least: spans that differ look different.
fn in_full(span: Span) -> String {
    const SECOND: i64 = 1_000_000_000;
    let beyond = format!("{:09}", span.nanos() % SECOND);
    let digits = beyond.trim_end_matches('0').len().max(3);
    format!("{}.{} s", span.nanos() / SECOND, &beyond[..digits])
}

/// In which ways messages can be lost but by the switching.
pub(super) fn lost(mission: &Mission) -> Vec<String> {
    if mission.medium.is_some() {
        return vec!["vehicles share a medium, which delays and drops them".to_string()];
    }
    let mut found = Vec::new();
    if mission.links.iter().any(Link::loses) {
        let share = |link: &Link| {
            1.0 - link
                .layers
                .iter()
                .map(|layer| 1.0 - layer.loss.as_ref().map_or(0.0, |loss| loss.mean()))
                .product::<f64>()
        };
        let most = mission.links.iter().map(share).fold(0.0, f64::max);
        found.push(match most > 0.0 {
            true => format!("{:.4} of them are lost while links are up", most),
            false => "range or flipped bits take some while links are up".to_string(),
        });
    }
    if let Some(link) = mission.links.iter().find(|link| mission.can_fill(link)) {
        let (places, most) = (link.queue, mission.most_under_way(link));
        let (from, to) = (&mission.vehicles[link.from].id, &mission.vehicles[link.to].id);
        found.push(format!(
            "up to {most} of them are under way together from {from} to {to}, where queue = {places} drops those beyond {places}"
        ));
    }
    found
}

/// The premise that messages which were dropped for another reason than a link that was down do not meet, whatever the plan:
/// on a real clock messages may come in a bunch. So many were sent and so many met each fate; nothing under laws that hear nobody.
pub(super) fn dropped(mission: &Mission, sent: u64, met: impl Fn(Fate) -> u64) -> Option<Premise> {
    if matches!(mission.law_choice, LawChoice::Alone(_) | LawChoice::SquareWave(_)) {
        return None;
    }
    let others = Fate::DROPS.into_iter().filter(|cause| *cause != Fate::LinkDown);
    let causes: Vec<(Fate, u64)> = others.map(|cause| (cause, met(cause))).filter(|(_, count)| *count > 0).collect();
    let all: u64 = causes.iter().map(|(_, count)| count).sum();
    let word = |cause: &Fate| cause.as_str().replace('_', " ");
    let words = match &causes[..] {
        [] => return None,
        [(cause, _)] => word(cause),
        several => {
            several.iter().map(|(cause, count)| format!("{} {count}", word(cause))).collect::<Vec<_>>().join(", ")
        }
    };
    let found = format!("{all} of {sent} messages were dropped for other reasons: {words}");
    Some(Premise { asks: "messages that are lost by the switching alone", found })
}

/// Whether the virtual targets move at exactly the rate the law asks for (path following of type II, η = 0).
pub(super) fn moves_as_told(mission: &Mission) -> bool {
    not_as_told(mission).is_none()
}

/// Whether what happens to the hulls does not reach the targets: they move as told, and α_2 is not fed back (4.59).
pub(super) fn minds_no_hull(mission: &Mission) -> bool {
    moves_as_told(mission) && !matches!(mission.law_choice, LawChoice::Auxiliary(_))
}

/// The premise of type II, if a target does not move at exactly the rate the law asks for.
pub(super) fn not_as_told(mission: &Mission) -> Option<Premise> {
    let asks = "targets that move as told (type II)";
    mission.vehicles.iter().find_map(|plan| match &plan.following {
        FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::II => None,
        FollowingChoice::Theorem47(_) => {
            Some(Premise { asks, found: format!("that of {} has dynamics of its own (type I, (4.53))", plan.id) })
        }
        _ => Some(Premise { asks, found: format!("{} follows its path by another law", plan.id) }),
    })
}

/// The fleet's path following as Theorems 4.4 and 4.5 see it.
pub(super) fn following(mission: &Mission) -> Result<PathFollowing, Premise> {
    if moves_as_told(mission) {
        return Ok(PathFollowing::TypeII { lambda_1: f64::INFINITY });
    }
    // The constants of the fleet are the worst of any vehicle (4.25).
    let mut worst: Option<(f64, f64, f64)> = None;
    for index in 0..mission.vehicles.len() {
        let Some(PathFollowing::TypeI { lambda_1, rho_1, alpha_1 }) = mission.path_following_of_type_1(index) else {
            return Err(Premise {
                asks: "path following with known constants of Assumption 4.1 (Theorem 4.7)",
                found: format!("{} follows its path by another law", mission.vehicles[index].id),
            });
        };
        let known = worst.unwrap_or((lambda_1, rho_1, alpha_1));
        worst = Some((known.0.min(lambda_1), known.1.max(rho_1), known.2.min(alpha_1)));
    }
    let (lambda_1, rho_1, alpha_1) = worst.unwrap_or((1.0, 0.0, 1.0));
    Ok(PathFollowing::TypeI { lambda_1, rho_1, alpha_1 })
}

#[cfg(test)]
mod tests {
    use bus::recording::Recording;
    use common::record::Record;

    use super::*;
    use crate::facts::facts;
    use crate::results::{Summary, TheoryRow, summarise};
    use crate::theory::testing::{changed as mission, flown};
    use crate::theory::{lost_its_rate, rows};

    const KNOWN_DELAY: &str = include_str!("../../../missions/talk/known-delay.toml");
    const BOUNDED: &str = include_str!("../../../missions/talk/bounded.toml");
    const HELIX: &str = include_str!("../../../missions/auv-helix.toml");

    fn summary(mission: &Mission, recording: &Recording) -> Summary {
        summarise(recording, &facts(mission))
    }

    fn row(mission: &Mission, summary: Option<&Summary>, name: &str) -> TheoryRow {
        let rows = rows(mission, summary);
        rows.iter().find(|row| row.name.contains(name)).unwrap_or_else(|| panic!("{name} in {rows:?}")).clone()
    }

    /// With so many places nothing is dropped and the statement holds; with one less, neither.
    fn assert_places_needed(text: &str, changes: &[(&str, &str)], places: usize, names: &[&str]) {
        for (places, enough) in [(places, true), (places - 1, false)] {
            let queue = format!("[network]\nqueue = {places}");
            let changes: Vec<_> = changes.iter().copied().chain([("[network]", queue.as_str())]).collect();
            let mission = mission(text, &changes);
            let summary = summary(&mission, &flown(&mission));
            assert_eq!(summary.fleet.messages.counts.queue_full == 0, enough, "{places} places");
            for name in names {
                let (planned, measured) = (row(&mission, None, name), row(&mission, Some(&summary), name));
                assert_eq!((planned.holds, measured.holds), (Some(enough), Some(enough)), "{planned:?} {measured:?}");
                let said = planned.value.contains("under way together") && planned.value.contains("queue = ");
                assert!(enough || said, "{planned:?}");
            }
        }
    }

    #[test]
    fn statements_hold_where_queues_have_just_places_enough() {
        let short = ("duration_s = 800.0", "duration_s = 60.0");
        assert_places_needed(HELIX, &[short], 51, &["Fleet speed", "Lemmas 4.4 and 4.5"]);
    }

    #[test]
    fn a_known_delay_asks_for_places_too() {
        let planned = mission(KNOWN_DELAY, &[]);
        let needed = planned.links.iter().map(|link| planned.most_under_way(link)).max().expect("links") as usize;
        assert!(needed > 1);
        assert_places_needed(KNOWN_DELAY, &[], needed, &["Agreement with known delay"]);
    }

    #[test]
    fn the_bound_of_talk_by_event_asks_for_places_too() {
        let late = |queue: &str| format!("[network]\ndelay = {{ constant = {{ delay_s = 0.3 }} }}\nqueue = {queue}");
        let period = mission(BOUNDED, &[]).message_period().secs();
        let needed = (0.3 / period + 1e-9) as usize + 1;
        for (queue, holds) in [(needed, true), (needed - 1, false)] {
            let mission = mission(BOUNDED, &[("[network]", &late(&queue.to_string()))]);
            let row = row(&mission, None, "event-triggered talk");
            assert_eq!(row.holds, Some(holds), "{row:?}");
            assert!(holds || row.value.contains("messages are lost: up to"), "{row:?}");
        }
    }

    #[test]
    fn what_was_dropped_breaks_what_the_plan_promises() {
        for (text, changes, name) in [
            (HELIX, vec![("duration_s = 800.0", "duration_s = 60.0")], "Fleet speed"),
            (KNOWN_DELAY, vec![], "Agreement with known delay"),
            (BOUNDED, vec![], "event-triggered talk"),
        ] {
            let mission = mission(text, &changes);
            let mut recording = flown(&mission);
            let before = summary(&mission, &recording);
            assert_eq!(row(&mission, Some(&before), name).holds, Some(true));
            // Of talk by event the monitor knows no statement.
            let watched = row(&mission, Some(&before), "Theorem monitor").measured;
            assert!(text == BOUNDED || watched.starts_with("covered"), "{watched}");
            assert!(!lost_its_rate(&mission, &before));
            // As on a real clock, where messages come in a bunch.
            let sent = before.fleet.messages.counts.sent;
            let delivered = recording.exact.iter_mut().filter_map(|record| match record {
                Record::Message(row) if row.fate == Fate::Delivered => Some(row),
                _ => None,
            });
            delivered.take(7).for_each(|row| row.fate = Fate::QueueFull);
            let after = summary(&mission, &recording);
            let words = format!("7 of {sent} messages were dropped for other reasons: queue full");
            let (statement, monitor) =
                (row(&mission, Some(&after), name), row(&mission, Some(&after), "Theorem monitor"));
            assert!(statement.holds == Some(false) && statement.value.contains(&words), "{statement:?}");
            assert_eq!(statement.predicted, "–");
            assert!(monitor.measured.starts_with("not covered: ") && monitor.measured.contains(&words), "{monitor:?}");
            assert_eq!(crate::theory::guarantee_of_flight(&mission, &after), None);
            // Neighbours that are advanced at v_L, or of known age, leave the rate of the fleet as it is.
            assert_eq!(lost_its_rate(&mission, &after), text == HELIX);
        }
    }

    #[test]
    fn each_cause_has_its_number_and_links_that_are_down_are_none() {
        let mission = mission(HELIX, &[]);
        let found = |met: &[(Fate, u64)]| {
            let met = |fate| met.iter().find(|(cause, _)| *cause == fate).map_or(0, |(_, count)| *count);
            dropped(&mission, 99, met).map(|premise| premise.found)
        };
        assert_eq!(found(&[(Fate::LinkDown, 50), (Fate::Delivered, 40), (Fate::InFlight, 9)]), None);
        assert_eq!(
            found(&[(Fate::LinkDown, 50), (Fate::QueueFull, 8), (Fate::Collision, 3)]).as_deref(),
            Some("11 of 99 messages were dropped for other reasons: queue full 8, collision 3")
        );
    }

    #[test]
    fn delays_that_differ_look_different() {
        let words = |delay: &str, told: f64| {
            let mission = mission(HELIX, &[("delay = { constant = { delay_s = 5.0 } }", delay)]);
            late_or_lost(&mission, Span::from_secs(told)).expect("not as told").found
        };
        let constant = |delay: &str| format!("delay = {{ constant = {{ delay_s = {delay} }} }}");
        assert_eq!(words(&constant("1e-6"), 0.0), "they take 0.000001 s");
        assert_eq!(words(&constant("5.0"), 4.0), "they take 5.000 s (told: 4.000 s, 1.000 s more)");
        assert_eq!(words(&constant("4.9999"), 5.0), "they take 4.9999 s (told: 5.000 s, 0.0001 s less)");
        let one_link = "exceptions = [{ from = \"auv1\", to = \"auv2\", delay = { constant = { delay_s = 3.0 } } }]";
        assert_eq!(
            words(&format!("{}\n{one_link}", constant("6.0")), 5.0),
            "they take 3.000 s to 6.000 s (told: 5.000 s, up to 2.000 s less, up to 1.000 s more)"
        );
        assert_eq!(
            words("delay = { jittered = { min_s = 1.0, max_s = 2.0 } }", 5.0),
            "their delays vary, 1.000 s to 2.000 s (told: 5.000 s)"
        );
    }
}
