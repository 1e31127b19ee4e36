//! What the statements of chapter 4 take for granted besides the switching signal, and what a mission has instead.

use common::graph::Graph;
use common::mission::file::{Between, FollowingChoice, FollowingType, LawChoice};
use common::mission::{Mission, SpeedProfile};
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
    let mut found = Vec::new();
    if mission.medium.is_some() {
        found.push("vehicles share a medium, which delays and drops them".to_string());
    } else if !mission.every_message_takes(told) {
        let delays: Option<Vec<Span>> = mission.links.iter().map(common::mission::Link::fixed_delay).collect();
        found.push(match delays.map(|delays| (delays.iter().min().copied(), delays.iter().max().copied())) {
            Some((Some(least), Some(most))) if least == most => format!("they take {least}"),
            Some((Some(least), Some(most))) => format!("they take {least} to {most}"),
            _ => "their delays vary".to_string(),
        });
    }
    if mission.links.iter().any(common::mission::Link::loses) {
        let share = |link: &common::mission::Link| {
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
