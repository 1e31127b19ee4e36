//! The coordination law.

use std::collections::HashMap;
use std::sync::Arc;

use super::super::Link;
use super::super::build;
use super::super::fault::Collector;
use super::super::file::{Between, LawChoice, MissionFile};
use super::resolve;
use crate::coordination::FleetLaw;
use crate::graph::Graph;

pub(super) fn check_law(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
) -> Option<Arc<dyn FleetLaw>> {
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
        let allowed = "hold or advance; align needs a law that is told the delay (delayed, delayed_with_losses)";
        faults.fault("coordination.between", "align", allowed);
    }
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = choice {
        let ok = (0.0..=3600.0).contains(&law.delay_s);
        faults.number(&format!("{key}.{name}.delay_s"), law.delay_s, ok, "0 to 3600 s");
    }
    if !names_are_vehicles(faults, choice, ids) {
        return None;
    }
    let in_order: Vec<&str> = file.vehicles.iter().map(|vehicle| vehicle.id.as_str()).collect();
    match build::law(choice, &in_order) {
        Ok(law) => Some(law),
        Err(reason) => {
            faults.fault(&format!("{key}.{name}"), reason, "gains above 0");
            None
        }
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
            faults.fault(&key, found, "a link of network.links or network.one_way");
        }
        if seen.contains(&pair) {
            faults.fault(&key, format!("a second weight between {named}"), "one weight for both directions of a link");
        }
        seen.push(pair);
    }
}

/// Where one vehicle alone is told v_L, its word must reach every other.
pub(super) fn check_told(faults: &mut Collector<'_>, file: &MissionFile, ids: &HashMap<String, usize>, links: &[Link]) {
    let Some((part, id)) = build::told(&file.coordination.law) else { return };
    let Some(&told) = ids.get(id) else { return };
    let arcs: Vec<(usize, usize)> = links.iter().map(|link| (link.to, link.from)).collect();
    if file.vehicles.len() > Graph::MAX_VERTICES
        || Graph::from_arcs(file.vehicles.len(), &arcs).globally_reachable().contains(&told)
    {
        return;
    }
    let name = build::law_name(&file.coordination.law);
    let found = format!("{id}, whose word does not reach every vehicle over the links of the network");
    let allowed = format!("for {name}, a vehicle that every other hears, directly or through others");
    faults.fault(&format!("coordination.law.{name}.{part}"), found, allowed);
}
