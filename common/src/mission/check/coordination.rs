//! The coordination law.

use std::collections::HashMap;
use std::sync::Arc;

use super::super::Link;
use super::super::build;
use super::super::fault::Collector;
use super::super::file::{Between, LawChoice, MissionFile, OwnGains};
use super::resolve;
use crate::coordination::FleetLaw;
use crate::coordination::known_delay::MOST_REMEMBERED;
use crate::graph::Graph;

/// The law of the fleet, and the same as each vehicle has it.
pub(super) fn check_law(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
) -> Option<(Arc<dyn FleetLaw>, Vec<LawChoice>)> {
    let choice = &file.coordination.law;
    let (key, name) = ("coordination.law", build::law_name(choice));
    if let LawChoice::Introduction(_) | LawChoice::LeaderIntegral(_) = choice
        && file.vehicles.len() != 2
    {
        faults.fault(key, format!("{name} with {} vehicles", file.vehicles.len()), "two vehicles, as in (1.5)");
    }
    if file.coordination.between == Between::Align
        && !matches!(choice, LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_))
    {
        let allowed =
            "hold, advance or estimate; align needs a law that is told the delay (delayed, delayed_with_losses)";
        faults.fault("coordination.between", "align", allowed);
    }
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = choice {
        let ok = (0.0..=3600.0).contains(&law.delay_s);
        faults.number(&format!("{key}.{name}.delay_s"), law.delay_s, ok, "0 to 3600 s");
    }
    if let LawChoice::KnownDelay(law) = choice {
        let most = MOST_REMEMBERED as f64 * file.clock.control_period_s;
        let allowed = format!("above 0 and at most {MOST_REMEMBERED} control periods, {most} s");
        faults.number("coordination.law.known_delay.longest_s", law.longest_s, law.longest_s <= most, &allowed);
    }
    if !names_are_vehicles(faults, choice, ids) {
        return None;
    }
    let in_order: Vec<&str> = file.vehicles.iter().map(|vehicle| vehicle.id.as_str()).collect();
    // A delay out of range has been told under its own key, and must not hide the gain.
    let mut choice = choice.clone();
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = &mut choice
        && !(0.0..=3600.0).contains(&law.delay_s)
    {
        law.delay_s = 0.0;
    }
    let law = match build::law(&choice, &in_order) {
        Ok(law) => law,
        Err(reason) => {
            let gain = refused_gain(&choice, name, &reason).map_or(String::new(), |gain| format!(".{gain}"));
            faults.fault(&format!("{key}.{name}{gain}"), reason, "gains above 0");
            return None;
        }
    };
    if file.vehicles.iter().all(|vehicle| vehicle.gains.is_none()) {
        return Some((law, vec![choice.clone(); file.vehicles.len()]));
    }
    let choices = check_own_gains(faults, file)?;
    let law = build::diagonal(&choices, &in_order).map_err(|reason| faults.fault("vehicles", reason, "gains above 0"));
    Some((law.ok()?, choices))
}

/// The key of the gain that a law refuses, if its reason names one that is in the file: a_1 is `a1` there, and a gain that is the only
/// one `gain`.
fn refused_gain(choice: &LawChoice, name: &str, reason: &str) -> Option<String> {
    let symbol = reason.strip_prefix("the gain ")?.split(' ').next()?.replace('_', "");
    let law = toml::Value::try_from(choice).ok()?;
    let gains = law.get(name)?.as_table()?;
    [symbol.as_str(), "gain"].into_iter().find(|key| gains.contains_key(*key)).map(str::to_owned)
}

/// The law of each vehicle, with its own gains if it has some.
fn check_own_gains(faults: &mut Collector<'_>, file: &MissionFile) -> Option<Vec<LawChoice>> {
    let mut choices = vec![file.coordination.law.clone(); file.vehicles.len()];
    let name = build::law_name(&file.coordination.law);
    let mut sound = true;
    for (i, (vehicle, choice)) in file.vehicles.iter().zip(&mut choices).enumerate() {
        let Some(OwnGains { gain, a, b }) = vehicle.gains else { continue };
        let mut places = build::gains_by_vehicle(choice);
        for (own, value) in [("gain", gain), ("a", a), ("b", b)] {
            let Some(value) = value else { continue };
            let key = format!("vehicles[{i}].gains.{own}");
            if let Some((_, place)) = places.iter_mut().find(|(known, _)| *known == own) {
                **place = value;
                faults.positive(&key, value, "");
                sound &= value > 0.0;
            } else {
                let known: Vec<&str> = places.iter().map(|(known, _)| *known).collect();
                let allowed = what_may_differ(&known, &file.coordination.law);
                faults.fault(&key, format!("a gain of its own under {name}"), allowed);
                sound = false;
            }
        }
    }
    sound.then_some(choices)
}

fn what_may_differ(known: &[&str], law: &LawChoice) -> String {
    match (known, law) {
        ([], LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_) | LawChoice::DelayedEstimating(_)) => {
            "the same gain for every vehicle: with a delay, unequal ones leave an error (erratum 4.2)".into()
        }
        ([], _) => "the same gains for every vehicle under this law".into(),
        (known, _) => known.join(", "),
    }
}

/// Whether every vehicle that the law names is one.
fn names_are_vehicles(faults: &mut Collector<'_>, choice: &LawChoice, ids: &HashMap<String, usize>) -> bool {
    let key = format!("coordination.law.{}", build::law_name(choice));
    if let Some((part, id)) = build::told(choice)
        && !ids.contains_key(id)
    {
        let mut known: Vec<&str> = ids.keys().map(String::as_str).collect();
        known.sort_unstable();
        faults.fault(&format!("{key}.{part}"), format!("{id:?}, which is no vehicle"), known.join(", "));
        return false;
    }
    let LawChoice::Weighted(law) = choice else { return true };
    let mut all = true;
    for (i, weight) in law.weights.iter().enumerate() {
        let key = format!("{key}.weights[{i}]");
        all &= resolve(faults, &format!("{key}.link"), &weight.link, ids).is_some();
        all &= weight.weight > 0.0;
        faults.positive(&format!("{key}.weight"), weight.weight, "");
    }
    all
}

/// A weight belongs to a link, and a link has one weight for both directions.
pub(super) fn check_weights(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
    links: &[Link],
) {
    let LawChoice::Weighted(law) = &file.coordination.law else { return };
    let mut seen: Vec<(usize, usize)> = Vec::new();
    for (i, weight) in law.weights.iter().enumerate() {
        let key = format!("coordination.law.weighted.weights[{i}].link");
        let [Some(&a), Some(&b)] = [&weight.link[0], &weight.link[1]].map(|id| ids.get(id)) else { continue };
        let pair = (a.min(b), a.max(b));
        let named = format!("{} and {}", weight.link[0], weight.link[1]);
        if !links.iter().any(|link| (link.from.min(link.to), link.from.max(link.to)) == pair) {
            let found = format!("a weight between {named}, which have no link");
            faults.fault_of_links(&key, found, "a link of network.links or network.one_way");
        }
        if seen.contains(&pair) {
            faults.fault(&key, format!("a second weight between {named}"), "one weight for both directions of a link");
        }
        seen.push(pair);
    }
}

/// Under the laws of section 2.2 who talks with whom is part of the law: each link that it needs must be there.
pub(super) fn check_partners(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
    links: &[Link],
) {
    let n = file.vehicles.len();
    let hub = build::told(&file.coordination.law).and_then(|(_, id)| ids.get(id).copied());
    // (from, to) of every link that the law needs.
    let needed: Vec<(usize, usize)> = match (&file.coordination.law, hub) {
        (LawChoice::LeaderFollower(_), Some(hub)) => (0..n).filter(|&i| i != hub).map(|i| (hub, i)).collect(),
        (LawChoice::Gateway(_) | LawChoice::GatewayIntegral(_), Some(hub)) => {
            (0..n).filter(|&i| i != hub).flat_map(|i| [(hub, i), (i, hub)]).collect()
        }
        (LawChoice::Neighbours(_), _) => (1..n).flat_map(|i| [(i - 1, i), (i, i - 1)]).collect(),
        _ => return,
    };
    let name = build::law_name(&file.coordination.law);
    for (from, to) in needed {
        if !links.iter().any(|link| (link.from, link.to) == (from, to)) {
            let id = |i: usize| &file.vehicles[i].id;
            let found = format!("no link from {} to {}, under {name}", id(from), id(to));
            let allowed = match &file.coordination.law {
                LawChoice::LeaderFollower(_) => "a link from the leader to every other vehicle",
                LawChoice::Neighbours(_) => "links between vehicles that are next to one another in the file",
                _ => "links between the gateway and every other vehicle",
            };
            faults.fault_of_links("network.links", found, allowed);
        }
    }
}

/// Where one vehicle alone is told v_L, its word must reach every other.
pub(super) fn check_told(faults: &mut Collector<'_>, file: &MissionFile, ids: &HashMap<String, usize>, links: &[Link]) {
    let Some((part, id)) = build::told(&file.coordination.law) else { return };
    let Some(&told) = ids.get(id) else { return };
    let arcs: Vec<(usize, usize)> = links.iter().map(|link| (link.to, link.from)).collect();
    if Graph::from_arcs(file.vehicles.len(), &arcs).globally_reachable().contains(&told) {
        return;
    }
    let name = build::law_name(&file.coordination.law);
    let found = format!("{id}, whose word does not reach every vehicle over the links of the network");
    let allowed = format!("for {name}, a vehicle that every other hears, directly or through others");
    faults.fault_of_links(&format!("coordination.law.{name}.{part}"), found, allowed);
}

#[cfg(test)]
mod tests {
    use super::super::super::Mission;
    use super::super::super::file::LawChoice;

    const LEADER: &str = include_str!("../../../../missions/thesis/eq-1-5-leader-integral.toml");
    const WEIGHTED: &str = include_str!("../../../../missions/thesis/eq-3-62-weighted.toml");
    const PATTERN: &str = include_str!("../../../../missions/thesis/eq-3-70-pattern.toml");
    const TOLD: &str = include_str!("../../../../missions/thesis/truly-decentralised.toml");
    const AUXILIARY: &str = include_str!("../../../../missions/thesis/eq-4-59.toml");

    fn faults_with(text: &str, old: &str, new: &str) -> Vec<String> {
        assert!(text.contains(old), "{old:?} is not in the mission");
        let faults = Mission::parse("m.toml", &text.replacen(old, new, 1)).err();
        faults.map_or(Vec::new(), |faults| faults.to_string().lines().map(str::to_string).collect())
    }

    #[test]
    fn the_missions_of_the_newer_laws_can_be_flown() {
        for (text, says) in [
            (LEADER, false),
            (WEIGHTED, false),
            (PATTERN, true),
            (include_str!("../../../../missions/thesis/fig-3-10.toml"), false),
            (include_str!("../../../../missions/thesis/eq-3-83.toml"), false),
            (include_str!("../../../../missions/thesis/eq-3-86.toml"), false),
            (TOLD, true),
            (AUXILIARY, false),
            (include_str!("../../../../missions/thesis/eq-4-62-example-4-1.toml"), false),
        ] {
            let mission = Mission::parse("m.toml", text).unwrap_or_else(|faults| panic!("{faults}"));
            assert_eq!(mission.law.says(0).is_some(), says, "{}", mission.name);
        }
        assert!(Mission::parse("m", WEIGHTED).is_ok_and(|m| matches!(m.law_choice, LawChoice::Weighted(_))));
    }

    #[test]
    fn each_misfit_is_named_with_both_sides() {
        for (text, old, new, key, part) in [
            (LEADER, "leader = \"v1\"", "leader = \"v7\"", "coordination.law.leader_integral.leader", "v1, v2"),
            (LEADER, "b = 0.04", "b = -0.04", "coordination.law.leader_integral", "gain b"),
            (
                LEADER,
                "links = [[\"v1\", \"v2\"]]",
                "one_way = [[\"v2\", \"v1\"]]",
                "leader_integral.leader",
                "does not reach",
            ),
            (LEADER, "between = \"advance\"", "between = \"align\"", "coordination.between", "told the delay"),
            (WEIGHTED, "weight = 0.5", "weight = 0.0", "weights[1].weight", "above 0"),
            (WEIGHTED, "link = [\"r1\", \"r3\"]", "link = [\"r2\", \"r3\"]", "weights[1].link", "no link"),
            (WEIGHTED, "link = [\"r1\", \"r3\"]", "link = [\"r2\", \"r1\"]", "weights[1].link", "second weight"),
            (WEIGHTED, "link = [\"r1\", \"r3\"]", "link = [\"r1\", \"r9\"]", "weights[1].link", "r9"),
            (PATTERN, "moving_pattern", "solution3", "vehicles[0].pattern_motion", "under solution3"),
            (PATTERN, "period_s = 31.41592653589793", "period_s = 0.0", "vehicles[0].pattern_motion.period_s", "0.001"),
            (TOLD, "told = \"r1\"", "told = \"nobody\"", "truly_decentralised.told", "r1, r2, r3"),
            (TOLD, "[\"r1\", \"r3\"]]", "[\"r2\", \"r3\"]]", "truly_decentralised.told", "does not reach"),
            (AUXILIARY, "kind = \"II\"", "kind = \"I\"", "fleet.following", "kind I"),
            (AUXILIARY, "a1 = 10.0", "a1 = 0.0", "coordination.law.auxiliary", "gain a_1"),
            (
                LEADER,
                "{ leader_integral = { leader = \"v1\", a = 0.2, b = 0.04 } }",
                "{ auxiliary = { a1 = 1.0, a2 = 1.6 } }",
                "coordination.law",
                "auxiliary, which needs the alpha_2 of theorem47",
            ),
        ] {
            let found = faults_with(text, old, new);
            assert!(found.iter().any(|line| line.contains(key) && line.contains(part)), "{new:?}: {found:?}");
        }
    }

    #[test]
    fn a_vehicle_may_have_gains_of_its_own_where_the_law_bears_it() {
        let switching = include_str!("../../../../missions/thesis/ucm-one-link-at-a-time.toml");
        let late = include_str!("../../../../missions/auv-helix.toml");
        let second =
            |text: &str, gains: &str| text.replacen("\n[[vehicles]]\n", &format!("\n[[vehicles]]\n{gains}\n"), 1);
        let mission = Mission::parse("m", &second(switching, "gains = { gain = 0.7 }")).expect("sound");
        let gains = mission.gains("gain");
        assert!(gains[0] == 0.7 && gains[1] != 0.7 && !mission.has_equal_gains() && mission.gains("a").is_empty());
        let mission = Mission::parse("m", &second(WEIGHTED, "gains = { a = 3.0 }")).expect("sound");
        assert_eq!(mission.gains("a")[..2], [3.0, 1.0]);
        assert!(mission.gains("b").iter().all(|b| *b == mission.gains("b")[0]) && !mission.has_equal_gains());
        assert!(Mission::parse("m", WEIGHTED).is_ok_and(|mission| mission.has_equal_gains()));
        for (text, gains, key, part) in [
            (switching, "gains = { a = 0.7 }", "vehicles[0].gains.a", "under switching; allowed: gain"),
            (switching, "gains = { gain = 0.0 }", "vehicles[0].gains.gain", "above 0"),
            (switching, "gains = { k = 1.0 }", "vehicles[0].gains.k", "unknown key"),
            (WEIGHTED, "gains = { b = nan }", "vehicles[0].gains.b", "above 0"),
            (late, "gains = { gain = 0.2 }", "vehicles[0].gains.gain", "erratum 4.2"),
            (TOLD, "gains = { a = 2.0 }", "vehicles[0].gains.a", "same gains for every vehicle"),
        ] {
            let faults = Mission::parse("m", &second(text, gains)).expect_err("refused").to_string();
            assert!(faults.contains(key) && faults.contains(part), "{gains}: {faults}");
        }
    }

    #[test]
    fn any_vehicle_that_takes_a_rate_can_have_an_auxiliary_state() {
        let law = "{ leader_integral = { leader = \"v1\", a = 0.2, b = 0.04 } }";
        assert_eq!(faults_with(LEADER, law, "{ auxiliary_switching = { a1 = 1.0, a2 = 1.6 } }"), Vec::<String>::new());
    }
}
