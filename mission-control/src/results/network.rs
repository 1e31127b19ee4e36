//! When the links were up, and how connected that left the fleet.

use std::collections::BTreeMap;

use common::graph::{Graph, measure};
use common::record::{Fate, MessageRow, Record};
use common::time::{Span, Time};
use serde::Serialize;

use super::Facts;

/// The links over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Network {
    /// The end of the observation, which begins at zero.
    pub(super) end: Time,
    /// For each link, the instants at which it changed, in order, with whether it was up from then on.
    changes: BTreeMap<(String, String), Vec<(Time, bool)>>,
}

/// Connectivity over time, measured as the theory of chapter 4 wants it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Connectivity {
    /// α, the part of the time in which no vehicle could be heard, over however many hops, by all others.
    pub alpha: f64,
    /// The smallest T_0 \[s\] with which the losses are brief: time lost in \[τ, t\] ≤ α(t − τ) + (1 − α)T_0 (4.11);
    /// `None` if α = 1.
    pub t_0_s: Option<f64>,
    /// The smallest T \[s\] such that the union of the graph over every interval of length T is connected in that
    /// sense; `None` if the end of the run was reached without.
    pub t_s: Option<f64>,
    /// How long was measured \[s\].
    pub length_s: f64,
    /// The shortest time between two changes \[s\]; the whole time before the second.
    pub dwell_s: f64,
    /// The shortest time that a link was up before it went down \[s\]; the whole time, if none went down.
    pub shortest_up_s: f64,
    /// The greatest age, since it was sent, of what a vehicle used of a neighbour \[s\]; `None` if nothing was heard.
    pub oldest_news_s: Option<f64>,
    /// The part of its up time in which a link was up and its sender not a neighbour, for the link that is worst.
    pub unheard: f64,
}

/// When what was delivered on one link made its sender a neighbour, and how old it was at most.
#[derive(Debug, Default)]
struct Heard {
    times: Vec<(f64, f64)>,
    oldest: Option<f64>,
}

impl Heard {
    /// From (sent, arrived) in order of arrival \[s\]: a neighbour leaves after a silence of `validity` \[s\].
    fn of(messages: &[(f64, f64)], validity: f64, end: f64) -> Heard {
        let mut heard = Heard::default();
        // Of what was sent, the newest counts, whatever arrives after it.
        let mut newest = f64::NEG_INFINITY;
        for (index, (sent, arrived)) in messages.iter().enumerate() {
            newest = newest.max(*sent);
            let next = messages.get(index + 1).map_or(f64::INFINITY, |next| next.1);
            let until = next.min(arrived + validity).min(end);
            if until >= *arrived {
                heard.oldest = Some(heard.oldest.unwrap_or(0.0).max(until - newest));
            }
            match heard.times.last_mut() {
                Some(last) if *arrived <= last.1 => last.1 = last.1.max(until),
                _ => heard.times.push((*arrived, until)),
            }
        }
        heard
    }
}

impl Network {
    /// The links over \[0, `duration`\]. A link whose first change is to go down was up before, and a link of which
    /// nothing is said was up all the time.
    pub fn of(exact: &[Record], facts: &Facts) -> Network {
        let end = Time::from_secs(facts.duration_s);
        let mut changes: BTreeMap<(String, String), Vec<(Time, bool)>> = BTreeMap::new();
        for link in &facts.links {
            changes.entry(link.clone()).or_default();
        }
        for record in exact {
            if let Record::Topology(row) = record {
                let at = Time::from_nanos(row.t_ns).clamp(Time::ZERO, end);
                changes.entry((row.from.to_string(), row.to.to_string())).or_default().push((at, row.up));
            }
        }
        changes.values_mut().for_each(|changes| changes.sort_by_key(|(at, _)| *at));
        Network { end, changes }
    }

    /// When a link was down, as intervals (from, to) \[s\].
    pub fn down_times(&self, from: &str, to: &str) -> Vec<(f64, f64)> {
        let changes = self.changes.get(&(from.to_owned(), to.to_owned())).map_or(&[][..], Vec::as_slice);
        let mut since = changes.first().filter(|first| first.1).map(|_| 0.0);
        let mut down = Vec::new();
        for (at, up) in changes {
            match (since, up) {
                (Some(start), true) => {
                    down.push((start, at.secs()));
                    since = None;
                }
                (None, false) => since = Some(at.secs()),
                _ => {}
            }
        }
        down.extend(since.map(|start| (start, self.end.secs())));
        down.retain(|(from, to)| to > from);
        down
    }

    /// When a link was up, as intervals (from, to) \[s\].
    pub fn up_times(&self, from: &str, to: &str) -> Vec<(f64, f64)> {
        complement(&self.down_times(from, to), 0.0, self.end.secs())
    }

    /// When every link was down, as intervals \[s\].
    pub fn blackouts(&self) -> Vec<(f64, f64)> {
        let mut common: Option<Vec<(f64, f64)>> = None;
        for (from, to) in self.changes.keys() {
            let down = self.down_times(from, to);
            common = Some(match common {
                None => down,
                Some(common) => intersection(&common, &down),
            });
        }
        common.unwrap_or_default()
    }

    /// The measured connectivity; `None` for fewer than two vehicles or no time.
    pub fn connectivity(&self, facts: &Facts) -> Option<Connectivity> {
        let measured = self.measured(facts);
        let length = measured.length();
        if facts.vehicles.len() < 2 || length <= Span::ZERO {
            return None;
        }
        let alpha = measured.loss_fraction();
        Some(Connectivity {
            alpha,
            t_0_s: (alpha < 1.0).then(|| measured.t_0(alpha).secs()),
            t_s: measured.connected_in_mean().map(Span::secs),
            length_s: length.secs(),
            dwell_s: measured.dwell().unwrap_or(length).secs(),
            shortest_up_s: length.secs(),
            oldest_news_s: None,
            unheard: 0.0,
        })
    }

    /// The graph of who hears whom, measured over the run.
    fn measured(&self, facts: &Facts) -> measure::Connectivity {
        let numbers = facts.vehicles.iter().zip(0..).map(|(vehicle, number)| (vehicle.id.as_str(), number));
        let numbers: BTreeMap<&str, usize> = numbers.collect();
        let mut graph = Graph::empty(facts.vehicles.len());
        let mut events: Vec<(Time, usize, usize, bool)> = Vec::new();
        for ((from, to), changes) in &self.changes {
            let (Some(&sender), Some(&receiver)) = (numbers.get(from.as_str()), numbers.get(to.as_str())) else {
                continue;
            };
            graph.set(receiver, sender, changes.first().is_none_or(|(_, up)| !up));
            events.extend(changes.iter().map(|(at, up)| (*at, receiver, sender, *up)));
        }
        events.sort_by_key(|(at, ..)| *at);
        // What changes at the begin was so from the begin, and what changes at the end was never seen.
        let begun = events.partition_point(|(at, ..)| *at <= Time::ZERO);
        let over = events.partition_point(|(at, ..)| *at < self.end).max(begun);
        let mut measured = measure::Connectivity::new();
        for at_once in std::iter::once(&events[..begun]).chain(events[begun..over].chunk_by(|a, b| a.0 == b.0)) {
            for (_, receiver, sender, up) in at_once {
                graph.set(*receiver, *sender, *up);
            }
            measured.graph(at_once.first().map_or(Time::ZERO, |(at, ..)| *at), graph.clone());
        }
        measured.advance(self.end);
        measured
    }

    /// The same network, looked at until then \[s\].
    pub fn until(&self, end_s: f64) -> Network {
        let end = Time::from_secs(end_s).min(self.end);
        let kept = |changes: &Vec<(Time, bool)>| changes.iter().copied().filter(|(at, _)| *at < end).collect();
        let changes = self.changes.iter().map(|(link, changes)| (link.clone(), kept(changes))).collect();
        Network { end, changes }
    }

    /// The measured connectivity with what was heard: how messages filled the times in which links were up.
    pub fn connectivity_heard(&self, exact: &[Record], facts: &Facts) -> Option<Connectivity> {
        let mut connectivity = self.connectivity(facts)?;
        let end_s = self.end.secs();
        let mut messages: BTreeMap<(&str, &str), Vec<(f64, f64)>> = BTreeMap::new();
        let handed_over = |row: &&MessageRow| matches!(row.fate, Fate::Delivered | Fate::Copied);
        let rows = exact.iter().filter_map(|record| match record {
            Record::Message(row) => Some(row),
            _ => None,
        });
        for row in rows.filter(handed_over).filter(|row| row.due_ns < self.end.nanos()) {
            let times = (row.sent_ns as f64 / 1e9, row.due_ns as f64 / 1e9);
            messages.entry((&row.from, &row.to)).or_default().push(times);
        }
        let validity = facts.validity_s.unwrap_or(f64::INFINITY);
        for (from, to) in &facts.links {
            let down = self.down_times(from, to);
            let up = complement(&down, 0.0, end_s);
            let ended = up.iter().filter(|(_, until)| *until < end_s).map(|(from, until)| until - from);
            connectivity.shortest_up_s = ended.fold(connectivity.shortest_up_s, f64::min);
            let mut own = messages.remove(&(from.as_str(), to.as_str())).unwrap_or_default();
            own.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
            let heard = Heard::of(&own, validity, end_s);
            let lasts = |times: &[(f64, f64)]| times.iter().map(|(from, to)| to - from).sum::<f64>();
            let up_s = lasts(&up);
            if up_s > 0.0 {
                let unheard = 1.0 - lasts(&intersection(&up, &heard.times)) / up_s;
                connectivity.unheard = connectivity.unheard.max(unheard.clamp(0.0, 1.0));
            }
            if let Some(oldest) = heard.oldest {
                connectivity.oldest_news_s = Some(connectivity.oldest_news_s.unwrap_or(0.0).max(oldest));
            }
        }
        Some(connectivity)
    }
}

/// What intervals leave of a time.
fn complement(intervals: &[(f64, f64)], start: f64, end: f64) -> Vec<(f64, f64)> {
    let ends = intervals.iter().map(|interval| interval.1);
    let begins = intervals.iter().map(|interval| interval.0);
    let left = [start].into_iter().chain(ends).zip(begins.chain([end]));
    left.filter(|(from, to)| to > from).collect()
}

/// What two lists of intervals have in common.
fn intersection(a: &[(f64, f64)], b: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let (mut i, mut j, mut common) = (0, 0, Vec::new());
    while let (Some(x), Some(y)) = (a.get(i), b.get(j)) {
        let (from, to) = (x.0.max(y.0), x.1.min(y.1));
        if to > from {
            common.push((from, to));
        }
        if x.1 < y.1 { i += 1 } else { j += 1 }
    }
    common
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::results::VehicleFacts;
    use common::record::TopologyRow;

    pub(in crate::results) fn facts(links: &[(&str, &str)]) -> Facts {
        let vehicle = |id: &str| VehicleFacts { id: id.into(), ..VehicleFacts::default() };
        Facts {
            vehicles: ["1", "2", "3"].map(vehicle).to_vec(),
            links: links.iter().map(|(from, to)| ((*from).into(), (*to).into())).collect(),
            message_bytes: 10,
            duration_s: 100.0,
            ..Facts::default()
        }
    }

    pub(in crate::results) fn change(t_s: i64, from: &str, to: &str, up: bool) -> Record {
        Record::Topology(TopologyRow { t_ns: t_s * 1_000_000_000, from: from.into(), to: to.into(), up })
    }

    pub(in crate::results) fn message(seq: u64, sent_ns: i64, fate: Fate) -> Record {
        let (from, to) = ("1".into(), "2".into());
        Record::Message(MessageRow { t_ns: sent_ns + 5, from, to, seq, sent_ns, due_ns: sent_ns + 5_000_000_000, fate })
    }

    /// Example 4.1: both links fail during 7.5 s of every 10 s.
    #[test]
    fn periodic_losses_have_the_connectivity_of_the_example() {
        let links = [("1", "2"), ("2", "1"), ("2", "3"), ("3", "2")];
        let mut rows = Vec::new();
        for (from, to) in links {
            for period in 0..10 {
                let at = |t_ns: i64, up| {
                    Record::Topology(TopologyRow { t_ns: t_ns * 1_000_000, from: from.into(), to: to.into(), up })
                };
                rows.extend([at(period * 10_000, true), at(period * 10_000 + 2_500, false)]);
            }
        }
        let facts = facts(&links);
        let network = Network::of(&rows, &facts);
        let connectivity = network.connectivity(&facts).expect("three vehicles");
        assert!((connectivity.alpha - 0.75).abs() < 1e-12);
        assert!((connectivity.t_0_s.expect("connected at times") - 7.5).abs() < 1e-9);
        assert!((connectivity.t_s.expect("connected") - 7.5).abs() < 1e-9);
        assert_eq!(network.blackouts().len(), 10);
    }

    #[test]
    fn links_that_are_never_up_together_connect_in_their_union() {
        let links = [("1", "2"), ("2", "3")];
        let mut rows = Vec::new();
        for turn in 0..10 {
            let at = turn * 10;
            rows.extend([change(at, "1", "2", true), change(at, "2", "3", false)]);
            rows.extend([change(at + 4, "1", "2", false), change(at + 4, "2", "3", true)]);
        }
        let facts = facts(&links);
        let connectivity = Network::of(&rows, &facts).connectivity(&facts).expect("three vehicles");
        assert_eq!((connectivity.alpha, connectivity.t_s), (1.0, Some(6.0)));
        assert!(Network::of(&rows, &facts).blackouts().is_empty());
    }

    #[test]
    fn one_direction_is_enough_for_a_leader() {
        let alpha = |links: &[(&str, &str)]| {
            let facts = facts(links);
            Network::of(&[], &facts).connectivity(&facts).expect("three vehicles").alpha
        };
        assert_eq!(alpha(&[("1", "2"), ("2", "3")]), 0.0);
        assert_eq!(alpha(&[("1", "2"), ("3", "2")]), 1.0, "nobody hears both ends");
    }

    #[test]
    fn what_was_heard_is_measured() {
        // Up from 10 s to 12 s and from 20 s to 24 s, and words at 11 s, 20 s and 22 s that count for a second and a half.
        let ms = |at: f64| (at * 1e9) as i64;
        let mut rows: Vec<Record> = [(10, true), (12, false), (20, true), (24, false)]
            .into_iter()
            .map(|(at, up)| change(at, "1", "2", up))
            .collect();
        for (seq, at, fate) in [(0, 9.0, Fate::LinkDown), (1, 11.0, Fate::Delivered), (2, 20.0, Fate::Delivered)] {
            rows.push(message(seq, ms(at) - 5_000_000_000, fate));
        }
        rows.push(message(3, ms(22.0) - 5_000_000_000, Fate::Delivered));
        let mut facts = facts(&[("1", "2")]);
        facts.validity_s = Some(1.5);
        let network = Network::of(&rows, &facts);
        let measured = network.connectivity_heard(&rows, &facts).expect("three vehicles");
        assert_eq!((measured.shortest_up_s, measured.oldest_news_s), (2.0, Some(6.5)));
        // 1 s, 1.5 s and 1.5 s of 6 s were heard.
        assert!((measured.unheard - 2.0 / 6.0).abs() < 1e-12, "{}", measured.unheard);
        assert_eq!((measured.dwell_s, measured.length_s), (2.0, 100.0));
        // Whoever never leaves is used until the end, however old the news.
        facts.validity_s = None;
        let measured = network.connectivity_heard(&rows, &facts).expect("three vehicles");
        assert_eq!(measured.oldest_news_s, Some(100.0 - 17.0));
        let early = network.until(11.5).connectivity_heard(&rows, &facts).expect("three vehicles");
        assert_eq!((early.length_s, early.shortest_up_s), (11.5, 11.5));
    }
}
