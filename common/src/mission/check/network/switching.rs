//! Links that come and go.

use std::collections::HashMap;

use super::super::super::Link;
use super::super::super::fault::Collector;
use super::super::super::file::{
    InMeanSwitching, IntervalSwitching, MarkovSwitching, MissionFile, NetworkSection, SwitchingChoice, SwitchingTrace,
    Together,
};
use super::{LONGEST, MOST_VEHICLES, Places, link_of, links_of, pairs, places};
use crate::graph::Graph;
use crate::graph::switching::{Switching, UpInterval};
use crate::random::Stream;
use crate::time::{Span, Time};

/// Shortest time in which links come and go \[s\], and how often they may in a mission.
const SHORTEST_SWITCHING: f64 = 1e-3;

const MOST_SWITCHINGS: f64 = 200_000.0;

/// What a signal needs to know of its mission.
struct Scope<'a> {
    ids: &'a HashMap<String, usize>,
    links: &'a [Link],
    places: &'a Places,
    vehicles: usize,
    duration: f64,
    seed: u64,
    /// Name of its stream.
    stream: String,
}

/// The network's switching signal, and those of `[[network.also]]` on top of it.
pub(in super::super) fn check_switching(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    network: &NetworkSection,
    ids: &HashMap<String, usize>,
    links: &[Link],
) -> Option<Switching> {
    let (vehicles, duration, seed) = (file.vehicles.len(), file.duration_s, file.seed);
    let places = &places(links);
    let mut scope = Scope { ids, links, places, vehicles, duration, seed, stream: "switching".to_string() };
    let mut whole = check(faults, "network.switching", &network.switching, &scope, None);
    for (i, further) in network.also.iter().enumerate() {
        let key = format!("network.also[{i}]");
        let Some(choice) = &further.switching else { continue };
        let only = links_of(faults, &format!("{key}.links"), further.links.as_deref(), ids, places);
        scope.stream = format!("switching/also[{i}]");
        let signal = check(faults, &format!("{key}.switching"), choice, &scope, only.as_deref());
        whole = whole.zip(signal).map(|(whole, signal)| whole.and(signal, only.as_deref()));
    }
    whole
}

/// One signal, over all links or some; `None` only with a fault noted.
fn check(
    faults: &mut Collector<'_>,
    key: &str,
    choice: &SwitchingChoice,
    scope: &Scope<'_>,
    only: Option<&[usize]>,
) -> Option<Switching> {
    let n = scope.links.len();
    match choice {
        SwitchingChoice::Always => Some(Switching::always(n)),
        SwitchingChoice::Periodic(p) => {
            let key = format!("{key}.periodic");
            check_period(faults, &format!("{key}.period_s"), p.period_s, scope.duration);
            let from_ok = p.up_from_s >= 0.0 && p.up_from_s < p.period_s;
            faults.number(&format!("{key}.up_from_s"), p.up_from_s, from_ok, "0 to below period_s");
            let for_ok = p.up_for_s > 0.0 && p.up_for_s <= p.period_s;
            faults.number(&format!("{key}.up_for_s"), p.up_for_s, for_ok, "above 0 and at most period_s");
            let span = Span::from_secs;
            Some(Switching::periodic(n, span(p.period_s), span(p.up_from_s), span(p.up_for_s)))
        }
        SwitchingChoice::Intervals(choice) => check_intervals(faults, &format!("{key}.intervals"), choice, scope, only),
        SwitchingChoice::Random(r) => {
            let key = format!("{key}.random");
            let allowed = "0 to below 1: the share of time without connection that Definition 4.3 allows";
            faults.number(&format!("{key}.alpha"), r.alpha, (0.0..1.0).contains(&r.alpha), allowed);
            faults.positive(&format!("{key}.t_0_s"), r.t_0_s, "s");
            check_period(faults, &format!("{key}.dwell_s"), r.dwell_s, scope.duration);
            let ok = r.dwell_s > 0.0 && r.dwell_s <= r.t_0_s;
            faults.number(&format!("{key}.dwell_s"), r.dwell_s, ok, "above 0 and at most t_0_s");
            let most = most_lost(r.t_0_s, r.dwell_s);
            if ok && (0.0..1.0).contains(&r.alpha) {
                let allowed =
                    format!("0 to {most} with this t_0_s and dwell_s: no loss is longer, and no recovery shorter");
                faults.number(&format!("{key}.alpha"), r.alpha, r.alpha <= most + 1e-9, &allowed);
            }
            let stream = Stream::new(scope.seed, &scope.stream);
            Some(Switching::random(n, r.alpha, Span::from_secs(r.t_0_s), Span::from_secs(r.dwell_s), stream))
        }
        SwitchingChoice::OneAtATime(o) => {
            check_period(faults, &format!("{key}.one_at_a_time.dwell_s"), o.dwell_s, scope.duration);
            let groups = pairs(scope.links).into_iter().filter(|group| counts(only, group));
            Some(Switching::one_at_a_time(n, groups.collect(), Span::from_secs(o.dwell_s)))
        }
        SwitchingChoice::Markov(m) => Some(check_markov(faults, &format!("{key}.markov"), m, scope, only)),
        SwitchingChoice::ConnectedInMean(m) => {
            check_in_mean(faults, &format!("{key}.connected_in_mean"), m, scope, only)
        }
        SwitchingChoice::Trace(trace) => check_trace(faults, &format!("{key}.trace"), trace, scope, only),
    }
}

/// The greatest share of time that losses of at most T_0 take with a dwell time between them: T_0/(T_0 + dwell).
fn most_lost(t_0_s: f64, dwell_s: f64) -> f64 {
    t_0_s / (t_0_s + dwell_s)
}

/// Whether a group has a link that the signal counts for.
fn counts(only: Option<&[usize]>, group: &[usize]) -> bool {
    only.is_none_or(|only| group.iter().any(|link| only.contains(link)))
}

fn check_intervals(
    faults: &mut Collector<'_>,
    key: &str,
    choice: &IntervalSwitching,
    scope: &Scope<'_>,
    only: Option<&[usize]>,
) -> Option<Switching> {
    if let Some(period) = choice.period_s {
        check_period(faults, &format!("{key}.period_s"), period, scope.duration);
    }
    let mut up = Vec::new();
    for (i, interval) in choice.up.iter().enumerate() {
        let key = format!("{key}.up[{i}]");
        check_interval(faults, &format!("{key}.from_s"), &format!("{key}.to_s"), interval.from_s, interval.to_s);
        let links = links_of(faults, &format!("{key}.links"), interval.links.as_deref(), scope.ids, scope.places);
        up.push(UpInterval { from: Time::from_secs(interval.from_s), to: Time::from_secs(interval.to_s), links });
    }
    if choice.up.is_empty() {
        let allowed = "at least one interval, else the graph can never be connected";
        faults.fault(&format!("{key}.up"), "no intervals", allowed);
    }
    if only.is_none() {
        check_union(faults, scope, (&up, choice.period_s.is_some()), key);
    }
    Some(Switching::intervals(scope.links.len(), up, choice.period_s.map(Span::from_secs)))
}

fn check_interval(faults: &mut Collector<'_>, from_key: &str, to_key: &str, from: f64, to: f64) {
    faults.number(from_key, from, from >= 0.0, "0 s or later");
    faults.number(to_key, to, to > from, "later than from_s");
}

fn check_markov(
    faults: &mut Collector<'_>,
    key: &str,
    choice: &MarkovSwitching,
    scope: &Scope<'_>,
    only: Option<&[usize]>,
) -> Switching {
    let groups: Vec<Vec<usize>> = match choice.together {
        Together::All => vec![(0..scope.links.len()).collect()],
        Together::Pairs => pairs(scope.links),
        Together::None => (0..scope.links.len()).map(|link| vec![link]).collect(),
    };
    let groups: Vec<Vec<usize>> = groups.into_iter().filter(|group| counts(only, group)).collect();
    // Each group makes changes of its own.
    let duration = scope.duration * groups.len().max(1) as f64;
    check_period(faults, &format!("{key}.mean_up_s"), choice.mean_up_s, duration);
    check_period(faults, &format!("{key}.mean_down_s"), choice.mean_down_s, duration);
    let stream = |group: &Vec<usize>| match choice.together {
        Together::All => Stream::new(scope.seed, &scope.stream),
        _ => Stream::new(scope.seed, &format!("{}/{}", scope.stream, scope.links[group[0]].layers[0].stream)),
    };
    let groups = groups.into_iter().filter(|group| !group.is_empty()).map(|group| {
        let stream = stream(&group);
        (group, stream)
    });
    let (up, down) = (Span::from_secs(choice.mean_up_s), Span::from_secs(choice.mean_down_s));
    Switching::markov(scope.links.len(), groups.collect(), up, down)
}

fn check_in_mean(
    faults: &mut Collector<'_>,
    key: &str,
    choice: &InMeanSwitching,
    scope: &Scope<'_>,
    only: Option<&[usize]>,
) -> Option<Switching> {
    check_period(faults, &format!("{key}.dwell_s"), choice.dwell_s, scope.duration);
    faults.number(
        &format!("{key}.window_s"),
        choice.window_s,
        choice.window_s <= LONGEST,
        "at most 30 days (2592000 s)",
    );
    if only.is_some() {
        faults.fault(key, "a window for some links only", "no links: all of them together are connected in mean");
    }
    let arcs: Vec<(usize, usize)> = scope.links.iter().map(|link| (link.to, link.from)).collect();
    let numbers = choice.dwell_s.is_finite() && choice.window_s.is_finite();
    if !numbers || !(2..=MOST_VEHICLES).contains(&scope.vehicles) {
        return Some(Switching::always(arcs.len()));
    }
    let (window, dwell) = (Span::from_secs(choice.window_s), Span::from_secs(choice.dwell_s));
    let stream = Stream::new(scope.seed, &scope.stream);
    match Switching::in_mean(scope.vehicles, &arcs, pairs(scope.links), window, dwell, stream) {
        Ok(signal) => Some(signal),
        Err(Some(shortest)) => {
            let allowed =
                format!("at least {} s: four dwells for each link that is needed, less three", shortest.secs());
            faults.fault_of_links(&format!("{key}.window_s"), format!("{} s", choice.window_s), allowed);
            Some(Switching::always(arcs.len()))
        }
        // The links are at fault, and are told so by their own check.
        Err(None) => Some(Switching::always(arcs.len())),
    }
}

fn check_trace(
    faults: &mut Collector<'_>,
    key: &str,
    trace: &SwitchingTrace,
    scope: &Scope<'_>,
    only: Option<&[usize]>,
) -> Option<Switching> {
    let mut told = vec![false; scope.links.len()];
    let mut up = Vec::new();
    for (i, link) in trace.links.iter().enumerate() {
        let key = format!("{key}.links[{i}]");
        let pair = [link.from.clone(), link.to.clone()];
        let Some(index) = link_of(faults, &key, &pair, scope.ids, scope.places) else { continue };
        if std::mem::replace(&mut told[index], true) {
            faults.fault(&key, format!("{} -> {} a second time", pair[0], pair[1]), "each link once");
        }
        for (k, [from, to]) in link.up_s.iter().enumerate() {
            let key = format!("{key}.up_s[{k}]");
            check_interval(faults, &key, &key, *from, *to);
            let links = Some(vec![index]);
            up.push(UpInterval { from: Time::from_secs(*from), to: Time::from_secs(*to), links });
        }
    }
    for (index, link) in scope.links.iter().enumerate() {
        if !told[index] && only.is_none_or(|only| only.contains(&index)) {
            let found = format!("nothing about {}", link.layers[0].stream);
            faults.fault_of_links(
                &format!("{key}.links"),
                found,
                "every directed link, with up_s = [] if it was never up",
            );
        }
    }
    if only.is_none() {
        check_union(faults, scope, (&up, false), key);
    }
    Some(Switching::intervals(scope.links.len(), up, None))
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

/// Links that are up at some time of the mission must be enough for everyone's word to reach everyone.
fn check_union(faults: &mut Collector<'_>, scope: &Scope<'_>, (up, periodic): (&[UpInterval], bool), key: &str) {
    let up = || up.iter().filter(|interval| periodic || interval.from.secs() < scope.duration);
    let mut ever = vec![up().any(|interval| interval.links.is_none()); scope.links.len()];
    up().filter_map(|interval| interval.links.as_ref()).flatten().for_each(|link| ever[*link] = true);
    let arcs: Vec<(usize, usize)> =
        scope.links.iter().zip(ever).filter(|(_, ever)| *ever).map(|(link, _)| (link.to, link.from)).collect();
    let n = scope.vehicles;
    if (2..=MOST_VEHICLES).contains(&n) && !scope.links.is_empty() && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links that come up by which at least one vehicle's word can reach every other";
        faults.fault_of_links(key, "a graph that can never be connected", allowed);
    }
}
