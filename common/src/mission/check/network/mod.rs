//! Links, delay, loss, range, medium and switching.

mod delay;
mod loss;
mod medium;
mod range;
mod switching;

use std::collections::{HashMap, HashSet};

use super::super::fault::Collector;
use super::super::file::{MissionFile, NetworkSection, OrderChoice, Preset};
use super::super::{Layer, Link};
use super::{LONGEST, MOST_VEHICLES, resolve};
use crate::graph::Graph;
use crate::network::Loss;

pub(super) use medium::check_medium;
pub(super) use switching::check_switching;

/// The network as the preset has it, where the mission does not say otherwise.
pub(super) fn with_preset(network: &NetworkSection) -> NetworkSection {
    let mut network = network.clone();
    let Some(preset) = network.preset.map(preset) else { return network };
    network.delay = network.delay.or(preset.delay);
    network.order = network.order.or(preset.order);
    network.loss = network.loss.or(preset.loss);
    network.range = network.range.or(preset.range);
    network.duplicate_probability = network.duplicate_probability.or(preset.duplicate_probability);
    network.corrupt_probability = network.corrupt_probability.or(preset.corrupt_probability);
    network.medium = match (network.medium, preset.medium) {
        (Some(said), Some(known)) => Some(said.over(known)),
        (said, known) => said.or(known),
    };
    network
}

fn preset(preset: Preset) -> NetworkSection {
    let text = match preset {
        Preset::Perfect => include_str!("../../presets/perfect.toml"),
        Preset::AcousticLongRange => include_str!("../../presets/acoustic_long_range.toml"),
        Preset::AcousticShortRange => include_str!("../../presets/acoustic_short_range.toml"),
        Preset::RadioOverTheHorizon => include_str!("../../presets/radio_over_the_horizon.toml"),
        Preset::WifiHarbour => include_str!("../../presets/wifi_harbour.toml"),
    };
    toml::from_str(text).expect("a part of the program, and tested")
}

/// The directed links, both directions of a two-way link side by side.
pub(super) fn check_links(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    network: &NetworkSection,
    ids: &HashMap<String, usize>,
) -> Option<Vec<Link>> {
    let key = "network";
    let delay = delay::check(faults, &format!("{key}.delay"), &network.delay.clone().unwrap_or_default());
    let range = range::check(faults, &format!("{key}.range"), &network.range.clone().unwrap_or_default());
    let loss = network.loss.clone().unwrap_or_default();
    let duplicate = probability(faults, "network.duplicate_probability", network.duplicate_probability);
    let corrupt = probability(faults, "network.corrupt_probability", network.corrupt_probability);
    let in_order = network.order == Some(OrderChoice::InOrder);
    let queue = check_queue(faults, "network.queue", network.queue);
    let lossy = loss::check(faults, "network.loss", &loss, (file.seed, loss::FADES));
    let mut links: Vec<Link> = Vec::new();
    // A complete graph of 256 vehicles has 65,280 links: none may be looked for among all others.
    let mut known: HashSet<(usize, usize)> = HashSet::new();
    let pairs = network.links.iter().enumerate().map(|(i, pair)| (format!("network.links[{i}]"), pair, true));
    let one_way = network.one_way.iter().enumerate().map(|(i, pair)| (format!("network.one_way[{i}]"), pair, false));
    for (key, pair, both_ways) in pairs.chain(one_way) {
        let Some((a, b)) = resolve(faults, &key, pair, ids) else {
            faults.links_in_doubt = true;
            continue;
        };
        for (from, to) in [(a, b), (b, a)].into_iter().take(if both_ways { 2 } else { 1 }) {
            if !known.insert((from, to)) {
                faults.fault(&key, format!("a second link from {} to {}", pair[0], pair[1]), "each link once");
            } else {
                let id = |i: usize| &file.vehicles[i].id;
                let stream = format!("link/{}->{}", id(from), id(to));
                let layers = vec![Layer { stream, delay: delay.clone(), loss: lossy.clone() }];
                links.push(Link { from, to, layers, range: range.clone(), duplicate, corrupt, in_order, queue });
            }
        }
    }
    check_exceptions(faults, file, network, ids, &mut links);
    check_further(faults, file, network, ids, &mut links);
    let n = file.vehicles.len();
    let arcs: Vec<(usize, usize)> = links.iter().map(|link| (link.to, link.from)).collect();
    if (2..=MOST_VEHICLES).contains(&n) && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links by which at least one vehicle's word can reach every other (a globally reachable vertex)";
        faults.fault_of_links("network.links", "a graph that can never be connected", allowed);
    }
    Some(links)
}

fn check_exceptions(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    network: &NetworkSection,
    ids: &HashMap<String, usize>,
    links: &mut [Link],
) {
    let places = places(links);
    let mut told = HashSet::new();
    for (i, exception) in network.exceptions.iter().enumerate() {
        let key = format!("network.exceptions[{i}]");
        let pair = [exception.from.clone(), exception.to.clone()];
        let Some(link) = link_of(faults, &key, &pair, ids, &places) else { continue };
        if !told.insert(link) {
            faults.fault(&key, format!("a second exception for {} -> {}", pair[0], pair[1]), "each link once");
        }
        if exception.says_nothing() {
            let allowed = "delay, loss, range, duplicate_probability, corrupt_probability, order or queue";
            faults.fault(&key, "an exception without a model", allowed);
        }
        let link = &mut links[link];
        if let Some(delay) = &exception.delay {
            link.layers[0].delay = delay::check(faults, &format!("{key}.delay"), delay);
        }
        if let Some(loss) = &exception.loss {
            link.layers[0].loss = loss::check(faults, &format!("{key}.loss"), loss, (file.seed, loss::FADES));
        }
        if let Some(range) = &exception.range {
            link.range = range::check(faults, &format!("{key}.range"), range);
        }
        if exception.duplicate_probability.is_some() {
            let key = format!("{key}.duplicate_probability");
            link.duplicate = probability(faults, &key, exception.duplicate_probability);
        }
        if exception.corrupt_probability.is_some() {
            link.corrupt = probability(faults, &format!("{key}.corrupt_probability"), exception.corrupt_probability);
        }
        if let Some(order) = exception.order {
            link.in_order = order == OrderChoice::InOrder;
        }
        if let Some(queue) = exception.queue {
            link.queue = check_queue(faults, &format!("{key}.queue"), queue);
        }
    }
}

/// Delays and losses of `[[network.also]]`; its switching signals are the switching's business.
fn check_further(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    network: &NetworkSection,
    ids: &HashMap<String, usize>,
    links: &mut [Link],
) {
    let places = places(links);
    for (i, further) in network.also.iter().enumerate() {
        let key = format!("network.also[{i}]");
        if further.delay.is_none() && further.loss.is_none() && further.switching.is_none() {
            faults.fault(&key, "no model", "delay, loss or switching");
        }
        let delay = further.delay.as_ref().map(|delay| delay::check(faults, &format!("{key}.delay"), delay));
        let fades = format!("{}/also[{i}]", loss::FADES);
        let loss: Option<Loss> = further
            .loss
            .as_ref()
            .and_then(|loss| loss::check(faults, &format!("{key}.loss"), loss, (file.seed, &fades)));
        let key = format!("{key}.links");
        let chosen = links_of(faults, &key, further.links.as_deref(), ids, &places);
        check_chosen(faults, &key, further.links.as_deref());
        if delay.is_none() && loss.is_none() {
            continue;
        }
        for index in chosen.unwrap_or_else(|| (0..links.len()).collect()) {
            let stream = format!("{}/also[{i}]", links[index].layers[0].stream);
            let layer = Layer { stream, delay: delay.clone().unwrap_or_default(), loss: loss.clone() };
            links[index].layers.push(layer);
        }
    }
}

/// Links that a further model is for: some, and none of them twice, which would pass every message through it twice.
fn check_chosen(faults: &mut Collector<'_>, key: &str, chosen: Option<&[[String; 2]]>) {
    let Some(chosen) = chosen else { return };
    if chosen.is_empty() {
        faults.fault(key, "no links", "some links, or no such key for all of them");
    }
    let mut told = HashSet::new();
    for (i, pair) in chosen.iter().enumerate() {
        if !told.insert(pair) {
            faults.fault(&format!("{key}[{i}]"), format!("{} -> {} a second time", pair[0], pair[1]), "each link once");
        }
    }
}

fn check_queue(faults: &mut Collector<'_>, key: &str, queue: u32) -> usize {
    if !(1..=1_000_000).contains(&queue) {
        faults.fault(key, queue, "1 to 1000000 messages");
    }
    queue as usize
}

fn probability(faults: &mut Collector<'_>, key: &str, value: Option<f64>) -> f64 {
    let value = value.unwrap_or(0.0);
    faults.number(key, value, (0.0..=1.0).contains(&value), "a probability, 0 to 1");
    value
}

/// The index of a directed link.
fn link_of(
    faults: &mut Collector<'_>,
    key: &str,
    pair: &[String; 2],
    ids: &HashMap<String, usize>,
    places: &Places,
) -> Option<usize> {
    let (from, to) = resolve(faults, key, pair, ids)?;
    let index = places.get(&(from, to)).copied();
    if index.is_none() {
        let found = format!("{} -> {}, which is not a link", pair[0], pair[1]);
        faults.fault_of_links(key, found, "a link of network.links or network.one_way");
    }
    index
}

/// The indices of some directed links; `None` for all.
fn links_of(
    faults: &mut Collector<'_>,
    key: &str,
    pairs: Option<&[[String; 2]]>,
    ids: &HashMap<String, usize>,
    places: &Places,
) -> Option<Vec<usize>> {
    pairs.map(|pairs| pairs.iter().filter_map(|pair| link_of(faults, key, pair, ids, places)).collect())
}

/// The index of each directed link (from, to).
type Places = HashMap<(usize, usize), usize>;

fn places(links: &[Link]) -> Places {
    links.iter().enumerate().map(|(index, link)| ((link.from, link.to), index)).collect()
}

/// Groups of both directions of a link.
fn pairs(links: &[Link]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of: HashMap<(usize, usize), usize> = HashMap::new();
    for (index, link) in links.iter().enumerate() {
        let ends = (link.from.min(link.to), link.from.max(link.to));
        let group = *group_of.entry(ends).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(index);
    }
    groups
}

#[cfg(test)]
mod tests;
