//! Links, delay, loss and switching.

use std::collections::HashMap;

use super::super::fault::Collector;
use super::super::file::{DelayChoice, LossChoice, MissionFile, SwitchingChoice};
use super::super::{Delay, Link};
use super::{LONGEST, MOST_VEHICLES, resolve};
use crate::graph::Graph;
use crate::graph::switching::{Switching, UpInterval};
use crate::random::Stream;
use crate::time::{Span, Time};

/// Shortest time in which links come and go \[s\], and how often they may in a mission.
const SHORTEST_SWITCHING: f64 = 1e-3;

const MOST_SWITCHINGS: f64 = 200_000.0;

/// The directed links, both directions of a two-way link side by side.
pub(super) fn check_links(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
) -> Option<Vec<Link>> {
    let network = &file.network;
    let delay = check_delay(faults, "network.delay", &network.delay);
    let loss = check_loss(faults, "network.loss", &network.loss);
    if !(1..=1_000_000).contains(&network.queue) {
        faults.fault("network.queue", network.queue, "1 to 1000000 messages");
    }
    let mut links: Vec<Link> = Vec::new();
    let pairs = network.links.iter().enumerate().map(|(i, pair)| (format!("network.links[{i}]"), pair, true));
    let one_way = network.one_way.iter().enumerate().map(|(i, pair)| (format!("network.one_way[{i}]"), pair, false));
    for (key, pair, both_ways) in pairs.chain(one_way) {
        let Some((a, b)) = resolve(faults, &key, pair, ids) else { continue };
        for (from, to) in [(a, b), (b, a)].into_iter().take(if both_ways { 2 } else { 1 }) {
            if links.iter().any(|link| (link.from, link.to) == (from, to)) {
                faults.fault(&key, format!("a second link from {} to {}", pair[0], pair[1]), "each link once");
            } else {
                links.push(Link { from, to, delay, loss });
            }
        }
    }
    for (i, exception) in network.exceptions.iter().enumerate() {
        let key = format!("network.exceptions[{i}]");
        let pair = [exception.from.clone(), exception.to.clone()];
        let Some((from, to)) = resolve(faults, &key, &pair, ids) else { continue };
        let Some(link) = links.iter_mut().find(|link| (link.from, link.to) == (from, to)) else {
            let found = format!("{} -> {}, which is not a link", pair[0], pair[1]);
            faults.fault(&key, found, "a link of network.links or network.one_way");
            continue;
        };
        if let Some(delay) = &exception.delay {
            link.delay = check_delay(faults, &format!("{key}.delay"), delay);
        }
        if let Some(loss) = &exception.loss {
            link.loss = check_loss(faults, &format!("{key}.loss"), loss);
        }
    }
    let n = file.vehicles.len();
    let arcs: Vec<(usize, usize)> = links.iter().map(|link| (link.to, link.from)).collect();
    if (2..=MOST_VEHICLES).contains(&n) && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links by which at least one vehicle's word can reach every other (a globally reachable vertex)";
        faults.fault("network.links", "a graph that can never be connected", allowed);
    }
    Some(links)
}

fn check_delay(faults: &mut Collector<'_>, key: &str, delay: &DelayChoice) -> Delay {
    let within = |value: f64| (0.0..=3600.0).contains(&value);
    match delay {
        DelayChoice::None => Delay::Constant(Span::ZERO),
        DelayChoice::Constant(c) => {
            faults.number(&format!("{key}.constant.delay_s"), c.delay_s, within(c.delay_s), "0 to 3600 s");
            Delay::Constant(Span::from_secs(c.delay_s))
        }
        DelayChoice::Jittered(j) => {
            faults.number(&format!("{key}.jittered.min_s"), j.min_s, within(j.min_s), "0 to 3600 s");
            let ok = within(j.max_s) && j.max_s >= j.min_s;
            faults.number(&format!("{key}.jittered.max_s"), j.max_s, ok, "min_s to 3600 s");
            Delay::Uniform(Span::from_secs(j.min_s), Span::from_secs(j.max_s))
        }
    }
}

fn check_loss(faults: &mut Collector<'_>, key: &str, loss: &LossChoice) -> f64 {
    match loss {
        LossChoice::None => 0.0,
        LossChoice::Bernoulli(b) => {
            let ok = (0.0..=1.0).contains(&b.probability);
            faults.number(&format!("{key}.bernoulli.probability"), b.probability, ok, "a probability, 0 to 1");
            b.probability
        }
    }
}

pub(super) fn check_switching(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
    links: &[Link],
) -> Option<Switching> {
    let n = links.len();
    let key = "network.switching";
    match &file.network.switching {
        SwitchingChoice::Always => Some(Switching::always(n)),
        SwitchingChoice::Periodic(p) => {
            let key = format!("{key}.periodic");
            check_period(faults, &format!("{key}.period_s"), p.period_s, file.duration_s);
            let from_ok = p.up_from_s >= 0.0 && p.up_from_s < p.period_s;
            faults.number(&format!("{key}.up_from_s"), p.up_from_s, from_ok, "0 to below period_s");
            let for_ok = p.up_for_s > 0.0 && p.up_for_s <= p.period_s;
            faults.number(&format!("{key}.up_for_s"), p.up_for_s, for_ok, "above 0 and at most period_s");
            let span = Span::from_secs;
            Some(Switching::periodic(n, span(p.period_s), span(p.up_from_s), span(p.up_for_s)))
        }
        SwitchingChoice::Intervals(choice) => {
            let key = format!("{key}.intervals");
            if let Some(period) = choice.period_s {
                check_period(faults, &format!("{key}.period_s"), period, file.duration_s);
            }
            let mut up = Vec::new();
            for (i, interval) in choice.up.iter().enumerate() {
                let key = format!("{key}.up[{i}]");
                faults.number(&format!("{key}.from_s"), interval.from_s, interval.from_s >= 0.0, "0 s or later");
                faults.number(
                    &format!("{key}.to_s"),
                    interval.to_s,
                    interval.to_s > interval.from_s,
                    "later than from_s",
                );
                let chosen = interval.links.as_ref().map(|pairs| {
                    let index = |pair: &[String; 2]| {
                        let (from, to) = resolve(faults, &format!("{key}.links"), pair, ids)?;
                        let index = links.iter().position(|link| (link.from, link.to) == (from, to));
                        if index.is_none() {
                            let found = format!("{} -> {}, which is not a link", pair[0], pair[1]);
                            faults.fault(&format!("{key}.links"), found, "a link of network.links or network.one_way");
                        }
                        index
                    };
                    pairs.iter().filter_map(index).collect()
                });
                let (from, to) = (Time::from_secs(interval.from_s), Time::from_secs(interval.to_s));
                up.push(UpInterval { from, to, links: chosen });
            }
            if choice.up.is_empty() {
                let allowed = "at least one interval, else the graph can never be connected";
                faults.fault(&format!("{key}.up"), "no intervals", allowed);
            }
            check_union(faults, file.vehicles.len(), links, &up, &key);
            Some(Switching::intervals(n, up, choice.period_s.map(Span::from_secs)))
        }
        SwitchingChoice::Random(r) => {
            let key = format!("{key}.random");
            let allowed = "0 to below 1: the share of time without connection that Definition 4.3 allows";
            faults.number(&format!("{key}.alpha"), r.alpha, (0.0..1.0).contains(&r.alpha), allowed);
            faults.positive(&format!("{key}.t_0_s"), r.t_0_s, "s");
            check_period(faults, &format!("{key}.dwell_s"), r.dwell_s, file.duration_s);
            let ok = r.dwell_s > 0.0 && r.dwell_s <= r.t_0_s;
            faults.number(&format!("{key}.dwell_s"), r.dwell_s, ok, "above 0 and at most t_0_s");
            let stream = Stream::new(file.seed, "switching");
            Some(Switching::random(n, r.alpha, Span::from_secs(r.t_0_s), Span::from_secs(r.dwell_s), stream))
        }
        SwitchingChoice::OneAtATime(o) => {
            check_period(faults, &format!("{key}.one_at_a_time.dwell_s"), o.dwell_s, file.duration_s);
            let mut groups: Vec<Vec<usize>> = Vec::new();
            for (index, link) in links.iter().enumerate() {
                let back = links[..index].iter().position(|other| (other.from, other.to) == (link.to, link.from));
                match back.and_then(|back| groups.iter_mut().find(|group| group.contains(&back))) {
                    Some(group) => group.push(index),
                    None => groups.push(vec![index]),
                }
            }
            Some(Switching::one_at_a_time(n, groups, Span::from_secs(o.dwell_s)))
        }
    }
}

/// A time in which links come and go: long enough that a mission is not made of changes alone.
fn check_period(faults: &mut Collector<'_>, key: &str, value: f64, duration: f64) {
    let least = SHORTEST_SWITCHING.max(duration.min(LONGEST) / MOST_SWITCHINGS);
    faults.number(
        key,
        value,
        value >= least && value <= LONGEST,
        &format!("{least} s to 30 days in a mission this long"),
    );
}

/// Links that are up at some time must be enough for everyone's word to reach everyone.
fn check_union(faults: &mut Collector<'_>, n: usize, links: &[Link], up: &[UpInterval], key: &str) {
    let ever = |index: usize| up.iter().any(|i| i.links.as_ref().is_none_or(|links| links.contains(&index)));
    let arcs: Vec<(usize, usize)> =
        links.iter().enumerate().filter(|(i, _)| ever(*i)).map(|(_, link)| (link.to, link.from)).collect();
    if (2..=MOST_VEHICLES).contains(&n) && !links.is_empty() && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links that come up by which at least one vehicle's word can reach every other";
        faults.fault(key, "a graph that can never be connected", allowed);
    }
}
