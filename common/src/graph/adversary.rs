//! The switching signals that brief connectivity losses admit, and how to search among them for one that hurts.
//!
//! Time is cut into slots of one dwell time. In each slot the network is one of a set of graphs made of the mission's
//! links: the connected ones with as few links as possible, which agree slowest, and those that are not connected. What
//! Definition 4.3 asks for is one number that is carried along: by how much the time lost so far exceeds the share α.

use std::collections::BTreeSet;

use super::Graph;
use super::switching::UpInterval;
use crate::random::Stream;
use crate::time::{Span, Time};

/// Groups of links up to which all their subsets are looked at; beyond it those that lack one or hold one group.
const MOST_GROUPS: usize = 10;

/// What a signal may do: Definition 4.3 with a dwell time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// α: asymptotic connectivity-loss rate, 0 to below 1.
    #[doc(alias = "α")]
    pub alpha: f64,
    /// T_0: connectivity-loss upper bound.
    #[doc(alias = "T_0")]
    pub t_0: Span,
    /// τ_D: least time between two changes.
    #[doc(alias = "τ_D")]
    pub dwell: Span,
}

/// A switching signal: which graph in which slot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal(Vec<usize>);

/// The signals that a network admits over a stretch of time.
#[derive(Clone, Debug)]
pub struct Signals {
    allowance: Allowance,
    slots: usize,
    end: Time,
    /// The links that are up, for each graph: first the connected graphs, then the others.
    graphs: Vec<Vec<usize>>,
    connected: usize,
    as_graphs: Vec<Graph>,
}

impl Signals {
    /// Signals over the links `arcs` (receiver, sender) among `n` vehicles until `end`. Both directions of a two-way link
    /// come and go together.
    ///
    /// # Errors
    /// What cannot be: numbers out of their range, or links that never connect the vehicles.
    pub fn new(n: usize, arcs: &[(usize, usize)], allowance: Allowance, end: Time) -> Result<Signals, String> {
        let Allowance { alpha, t_0, dwell } = allowance;
        if !(0.0..1.0).contains(&alpha) {
            return Err(format!("found alpha = {alpha}; allowed: 0 to below 1"));
        }
        if dwell <= Span::ZERO || t_0 < Span::ZERO {
            return Err(format!(
                "found T_0 = {t_0} and a dwell time of {dwell}; allowed: T_0 of 0 or more, a dwell above 0"
            ));
        }
        let slots = (end.nanos() + dwell.nanos() - 1) / dwell.nanos();
        if !(1..=1_000_000).contains(&slots) {
            return Err(format!("found {slots} dwell times in the mission; allowed: 1 to 1000000"));
        }
        let graph = |links: &[usize]| Graph::from_arcs(n, &links.iter().map(|&link| arcs[link]).collect::<Vec<_>>());
        let groups = groups(arcs);
        let (connected, apart): (Vec<_>, Vec<_>) =
            subsets(&groups).into_iter().partition(|links| graph(links).can_agree());
        let slowest: Vec<Vec<usize>> = connected
            .iter()
            .filter(|links| !connected.iter().any(|fewer| fewer.len() < links.len() && is_within(fewer, links)))
            .cloned()
            .collect();
        if slowest.is_empty() {
            return Err("the links of this mission never connect its vehicles".to_string());
        }
        let connected = slowest.len();
        let graphs: Vec<Vec<usize>> = slowest.into_iter().chain(apart).collect();
        let as_graphs = graphs.iter().map(|links| graph(links)).collect();
        Ok(Signals { allowance, slots: slots as usize, end, graphs, connected, as_graphs })
    }

    /// The graphs that signals are made of: what a bound over all of them has to hold for.
    pub fn graphs(&self) -> &[Graph] {
        &self.as_graphs
    }

    /// Signals to begin with: lost as early, as late, and as evenly as allowed, over each of the connected graphs.
    pub fn starts(&self) -> Vec<Signal> {
        let nothing = self.connected;
        (0..self.connected)
            .flat_map(|weak| {
                let early = self.repaired(vec![nothing; self.slots], weak);
                let late = early.0.iter().rev().copied().collect();
                let mut even = vec![weak; self.slots];
                let mut debt = 0.0;
                for slot in &mut even {
                    debt += self.allowance.alpha;
                    if debt >= 1.0 {
                        debt -= 1.0;
                        *slot = nothing;
                    }
                }
                [early, self.repaired(late, weak), self.repaired(even, weak)]
            })
            .collect()
    }

    /// A signal that differs from `signal` in some stretch of time, and is admitted.
    pub fn changed(&self, signal: &Signal, stream: &mut Stream) -> Signal {
        let mut slots = signal.0.clone();
        let longest = 1 + stream.below(self.slots.div_ceil(4).max(1));
        let length = 1 + stream.below(longest);
        let from = stream.below(self.slots + 1 - length.min(self.slots));
        let to = (from + length).min(self.slots);
        match stream.below(3) {
            0 => slots[from..to].fill(stream.below(self.graphs.len())),
            1 => slots[from..to].reverse(),
            _ => {
                let by = 1 + stream.below(self.slots);
                let other: Vec<usize> = (from..to).map(|slot| signal.0[(slot + by) % self.slots]).collect();
                slots[from..to].copy_from_slice(&other);
            }
        }
        self.repaired(slots, stream.below(self.connected))
    }

    /// Puts the connected graph `weak` wherever another loss would exceed the allowance.
    fn repaired(&self, mut slots: Vec<usize>, weak: usize) -> Signal {
        let mut excess = 0.0;
        for (slot, graph) in slots.iter_mut().enumerate() {
            let after = self.excess_after(excess, *graph, slot);
            excess = if after > self.most_excess() {
                *graph = weak;
                self.excess_after(excess, weak, slot)
            } else {
                after
            };
        }
        Signal(slots)
    }

    /// (1 − α) T_0: what T_p − α(t − τ) may reach in any window (4.11).
    fn most_excess(&self) -> f64 {
        // A nanosecond of grace for rounding.
        (1.0 - self.allowance.alpha) * self.allowance.t_0.secs() + 1e-9
    }

    /// The largest T_p − α(t − τ) of a window that ends with this slot, given that of the slot before.
    fn excess_after(&self, excess: f64, graph: usize, slot: usize) -> f64 {
        let (from, to) = self.bounds(slot);
        let (lasts, alpha) = ((to - from).secs(), self.allowance.alpha);
        if graph < self.connected { (excess - alpha * lasts).max(0.0) } else { excess + (1.0 - alpha) * lasts }
    }

    fn bounds(&self, slot: usize) -> (Time, Time) {
        let at = |slot: usize| (Time::ZERO + self.allowance.dwell * slot as i64).min(self.end);
        (at(slot), at(slot + 1))
    }

    /// The signal as intervals in which links are up. The last slot is whole, even if the end cuts it.
    pub fn intervals(&self, signal: &Signal) -> Vec<UpInterval> {
        let mut intervals: Vec<UpInterval> = Vec::new();
        for (slot, &graph) in signal.0.iter().enumerate() {
            let from = self.bounds(slot).0;
            let to = from + self.allowance.dwell;
            let links = &self.graphs[graph];
            match intervals.last_mut() {
                Some(last) if last.to == from && last.links.as_ref() == Some(links) => last.to = to,
                _ if links.is_empty() => {}
                _ => intervals.push(UpInterval { from, to, links: Some(links.clone()) }),
            }
        }
        intervals
    }
}

/// Links that come and go together: both directions of a two-way link.
fn groups(arcs: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (link, &(to, from)) in arcs.iter().enumerate() {
        match groups.iter_mut().find(|group| group.iter().any(|&other| arcs[other] == (from, to))) {
            Some(group) => group.push(link),
            None => groups.push(vec![link]),
        }
    }
    groups
}

/// Sets of links, each sorted, the empty one first: all unions of groups if they are few, else those that lack at most
/// one group or hold at most one.
fn subsets(groups: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let union = |chosen: &dyn Fn(usize) -> bool| -> Vec<usize> {
        let links: BTreeSet<usize> = groups
            .iter()
            .enumerate()
            .filter(|(g, _)| chosen(*g))
            .flat_map(|(_, links)| links.iter().copied())
            .collect();
        links.into_iter().collect()
    };
    let mut sets: Vec<Vec<usize>> = if groups.len() <= MOST_GROUPS {
        (0u32..1 << groups.len()).map(|set| union(&|g| set >> g & 1 == 1)).collect()
    } else {
        let one = (0..groups.len()).map(|only| union(&|g| g == only));
        let all_but_one = (0..groups.len()).map(|lacking| union(&|g| g != lacking));
        [union(&|_| false), union(&|_| true)].into_iter().chain(one).chain(all_but_one).collect()
    };
    sets.sort();
    sets.dedup();
    sets
}

fn is_within(few: &[usize], many: &[usize]) -> bool {
    few.iter().all(|link| many.binary_search(link).is_ok())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Allowance, Signals};
    use crate::graph::measure::Connectivity;
    use crate::graph::switching::Switching;
    use crate::random::Stream;
    use crate::time::{Span, Time};

    /// 1–2 and 1–3, two-way.
    const STAR: [(usize, usize); 4] = [(1, 0), (0, 1), (2, 0), (0, 2)];
    const TRIANGLE: [(usize, usize); 6] = [(1, 0), (0, 1), (2, 0), (0, 2), (1, 2), (2, 1)];

    fn allowance(alpha: f64, t_0: f64, dwell: f64) -> Allowance {
        Allowance { alpha, t_0: Span::from_secs(t_0), dwell: Span::from_secs(dwell) }
    }

    fn signals(arcs: &[(usize, usize)], allowance: Allowance, end: f64) -> Signals {
        Signals::new(3, arcs, allowance, Time::from_secs(end)).expect("admitted")
    }

    fn measured(signals: &Signals, arcs: &[(usize, usize)], signal: &super::Signal, end: f64) -> Connectivity {
        let switching = Switching::intervals(arcs.len(), signals.intervals(signal), None);
        Connectivity::planned(switching, 3, arcs, Time::from_secs(end))
    }

    #[test]
    fn connected_graphs_have_no_link_too_many() {
        // A star is connected only whole; of a triangle any two of its three links are enough.
        let connected = |arcs: &[(usize, usize)]| {
            let signals = signals(arcs, allowance(0.5, 10.0, 1.0), 100.0);
            let graphs = signals.graphs();
            (graphs.iter().filter(|graph| graph.can_agree()).count(), graphs.len())
        };
        assert_eq!(connected(&STAR), (1, 1 + 3));
        assert_eq!(connected(&TRIANGLE), (3, 3 + 4));
    }

    #[test]
    fn the_earliest_losses_begin_with_t_0_of_silence() {
        // Nothing for T_0 = 7.5 s at once, and 75 % of the time in the end.
        let signals = signals(&STAR, allowance(0.75, 7.5, 2.5), 400.0);
        let early = &signals.starts()[0];
        let first = signals.intervals(early)[0].from;
        assert_eq!(first, Time::from_secs(7.5));
        let measured = measured(&signals, &STAR, early, 400.0);
        assert!((measured.loss_fraction() - 0.75).abs() < 0.01, "{}", measured.loss_fraction());
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let new = |alpha, t_0, dwell| Signals::new(3, &STAR, allowance(alpha, t_0, dwell), Time::from_secs(10.0));
        assert!(new(1.0, 1.0, 1.0).unwrap_err().contains("alpha"));
        assert!(new(0.5, 1.0, 0.0).is_err() && new(0.5, -1.0, 1.0).is_err() && new(f64::NAN, 1.0, 1.0).is_err());
        let apart = Signals::new(3, &STAR[..2], allowance(0.5, 1.0, 1.0), Time::from_secs(10.0));
        assert!(apart.unwrap_err().contains("never connect"));
        let two_sources = Signals::new(3, &[(1, 0), (1, 2)], allowance(0.5, 1.0, 1.0), Time::from_secs(10.0));
        assert!(two_sources.unwrap_err().contains("never connect"), "joined is not enough");
        // A mission has at least one dwell time, and the last one may be cut.
        let slots = |end: f64| {
            Signals::new(3, &STAR, allowance(0.5, 1.0, 1.0), Time::from_secs(end))
                .map(|found| found.starts()[0].0.len())
        };
        assert!(slots(0.0).is_err() && slots(1_000_001.0).is_err());
        assert_eq!((slots(0.5), slots(1.0), slots(1.5)), (Ok(1), Ok(1), Ok(2)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn every_signal_is_admitted(alpha in 0.0..0.95f64, t_0 in 0.0..20.0f64, dwell in 0.5..5.0f64, seed: u64) {
            let signals = signals(&TRIANGLE, allowance(alpha, t_0, dwell), 100.0);
            let mut stream = Stream::new(seed, "adversary");
            for start in signals.starts() {
                let changed = (0..5).fold(start.clone(), |signal, _| signals.changed(&signal, &mut stream));
                for signal in [start, changed] {
                    let measured = measured(&signals, &TRIANGLE, &signal, 100.0);
                    // (4.11), to within what adding up slots rounds.
                    prop_assert!(measured.t_0(alpha).secs() <= t_0 + 1e-6, "{} {t_0}", measured.t_0(alpha));
                    prop_assert!(measured.dwell().is_none_or(|d| d.secs() >= dwell - 1e-6));
                }
            }
        }
    }

    #[test]
    fn losses_can_be_spread_evenly() {
        // A quarter of the time, every fourth slot.
        let signals = signals(&STAR, allowance(0.25, 10.0, 1.0), 100.0);
        let even = measured(&signals, &STAR, &signals.starts()[2], 100.0);
        assert_eq!((even.loss_time(), even.longest_outage()), (Span::from_secs(25.0), Span::from_secs(1.0)));
        assert_eq!(even.most_lost_in(Span::from_secs(4.0)), Span::from_secs(1.0));
    }

    #[test]
    fn what_is_connected_with_fewer_links_counts_only_if_they_are_among_them() {
        // 1–2 and 2–3 two-way, and 3 hears 1: each two of the three connect them, and none of these within another.
        let arcs = [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0)];
        let signals = signals(&arcs, allowance(0.5, 10.0, 1.0), 100.0);
        let sizes: Vec<usize> =
            signals.graphs().iter().filter(|graph| graph.can_agree()).map(|g| g.arcs().count()).collect();
        assert_eq!(sizes.iter().sum::<usize>(), 4 + 3 + 3, "{sizes:?}");
    }

    #[test]
    fn of_few_links_all_sets_are_looked_at_and_of_many_those_next_to_all_and_none() {
        // A row is connected only whole.
        let of = |n: usize| {
            let arcs: Vec<(usize, usize)> = (1..n).flat_map(|i| [(i, i - 1), (i - 1, i)]).collect();
            let signals = Signals::new(n, &arcs, allowance(0.5, 10.0, 1.0), Time::from_secs(9.0)).expect("admitted");
            let mut links: Vec<usize> = signals.graphs()[1..].iter().map(|graph| graph.arcs().count() / 2).collect();
            links.sort();
            (signals.graphs()[0].arcs().count() / 2, links)
        };
        let (whole, others) = of(11);
        assert_eq!((whole, others.len()), (10, (1 << 10) - 1));
        let (whole, others) = of(12);
        assert_eq!((whole, others), (11, [vec![0], vec![1; 11], vec![10; 11]].concat()));
    }
}
