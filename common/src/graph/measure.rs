//! What a network did: connectivity losses (Definition 4.3) and connectedness in mean (Definition 4.4), measured.
//!
//! "Connected" is what agreement needs, a globally reachable vertex; for two-way links that is connectedness.

use super::Graph;
use super::switching::Switching;
use crate::time::{Span, Time};

/// Measures a switching graph as it happens.
///
/// Feed it every change in order of time, as graphs or as a bare "connected or not" (not both), then move it to the end.
/// Each change costs O(1), plus at most one set union for every distinct union of graphs that cannot agree yet.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    start: Option<Time>,
    now: Time,
    starts_connected: bool,
    /// When connectedness was lost or regained, alternating.
    toggles: Vec<Time>,
    graph: Option<Graph>,
    last_change: Option<Time>,
    dwell: Option<Span>,
    union: UnionWindows,
}

impl Connectivity {
    /// Nothing seen yet.
    pub fn new() -> Connectivity {
        Connectivity::default()
    }

    /// A planned signal run from zero to `end`: link number l of the signal is the arc `arcs[l]` (receiver, sender)
    /// among `n` vehicles. `signal` must not have been asked yet; give a clone.
    ///
    /// # Panics
    /// As [`Graph::from_arcs`].
    pub fn planned(mut signal: Switching, n: usize, arcs: &[(usize, usize)], end: Time) -> Connectivity {
        let mut measured = Connectivity::new();
        let mut next = Some(Time::ZERO);
        while let Some(t) = next.filter(|&t| t <= end) {
            let mut graph = Graph::empty(n);
            for (link, &(receiver, sender)) in arcs.iter().enumerate() {
                // Several links may carry one arc: it exists while any of them is up.
                if signal.is_up(link, t) {
                    graph.set(receiver, sender, true);
                }
            }
            measured.graph(t, graph);
            next = signal.next_change_after(t);
        }
        measured.advance(end);
        measured
    }

    /// From `t` on, the network is this graph.
    pub fn graph(&mut self, t: Time, graph: Graph) {
        let t = t.max(self.start.map_or(t, |_| self.now));
        let connected = graph.can_agree();
        if let Some(start) = self.start {
            if self.graph.as_ref() == Some(&graph) {
                return self.advance(t);
            }
            if self.connected_now() != connected {
                self.toggles.push(t);
            }
            let held = t - self.last_change.unwrap_or(start);
            if self.last_change.is_some() {
                self.dwell = Some(self.dwell.map_or(held, |dwell| dwell.min(held)));
            }
            self.last_change = Some(t);
        } else {
            self.start = Some(t);
            self.starts_connected = connected;
        }
        self.now = t;
        self.union.change(t, &graph);
        self.graph = Some(graph);
    }

    /// From `t` on, the network is connected or not.
    pub fn connected(&mut self, t: Time, connected: bool) {
        self.graph(t, if connected { Graph::complete(2) } else { Graph::empty(2) });
    }

    /// Nothing has changed until `t`.
    pub fn advance(&mut self, t: Time) {
        self.now = self.now.max(t);
    }

    /// How long has been measured.
    pub fn length(&self) -> Span {
        self.start.map_or(Span::ZERO, |start| self.now - start)
    }

    /// T_p over the whole run (4.10): how long the network was not connected.
    #[doc(alias = "T_p")]
    pub fn loss_time(&self) -> Span {
        self.phases().filter(|(up, _)| !up).fold(Span::ZERO, |lost, (_, lasts)| lost + lasts)
    }

    /// The most time without connection in any window of this length within the run; in the whole run, if that is
    /// shorter.
    pub fn most_lost_in(&self, window: Span) -> Span {
        let Some(start) = self.start else { return Span::ZERO };
        let window = window.max(Span::ZERO);
        // A worst window can be moved until it begins where a phase begins, or ends where one ends.
        let bounds = || [start].into_iter().chain(self.toggles.iter().copied()).chain([self.now]);
        let first = self.now - window;
        let windows = bounds().map(|t| t.min(first)).chain(bounds().map(|t| t - window));
        let (mut lost_before, mut lost) = (Vec::with_capacity(self.toggles.len() + 1), Span::ZERO);
        for (up, lasts) in self.phases() {
            lost_before.push(lost);
            lost = lost + if up { Span::ZERO } else { lasts };
        }
        let lost_until = |t: Time| {
            let phase = self.toggles.partition_point(|&toggle| toggle <= t);
            let since = phase.checked_sub(1).map_or(start, |toggle| self.toggles[toggle]);
            let connected = self.starts_connected ^ (phase % 2 == 1);
            lost_before[phase] + if connected { Span::ZERO } else { t - since }
        };
        windows
            .map(|from| from.max(start))
            .map(|from| {
                let to = (from + window).min(self.now);
                Span::from_nanos(lost_until(to).nanos() - lost_until(from).nanos())
            })
            .max()
            .unwrap_or(Span::ZERO)
    }

    /// Part of the time without connection, in \[0, 1\]; zero before anything was measured.
    pub fn loss_fraction(&self) -> f64 {
        let length = self.length().secs();
        if length > 0.0 { self.loss_time().secs() / length } else { 0.0 }
    }

    /// The smallest T_0 with which the run has brief connectivity losses at rate α (4.11), erratum 4.21:
    ///
    /// ```text
    /// T_0 = sup over windows of (T_p(τ, t) − α(t − τ)) / (1 − α)
    /// ```
    ///
    /// To the nearest nanosecond. α is taken into \[0, 1\]; as α tends to one, T_0 tends to the longest outage.
    #[doc(alias = "T_0")]
    pub fn t_0(&self, alpha: f64) -> Span {
        let alpha = alpha.max(0.0);
        if alpha >= 1.0 {
            return self.longest_outage();
        }
        Span::from_nanos((self.worst_window(alpha).excess(alpha) / (1.0 - alpha)).round() as i64)
    }

    /// The smallest α with which the run has brief connectivity losses with upper bound `t_0` (4.11).
    ///
    /// Windows not longer than T_0 meet (4.11) with any α; for the others it asks α ≥ (T_p − T_0)/(dt − T_0). Found by
    /// Dinkelbach's iteration: the window that violates (4.11) most gives the next α, until none does.
    #[doc(alias = "α")]
    pub fn alpha(&self, t_0: Span) -> f64 {
        let t_0 = t_0.max(Span::ZERO).nanos() as f64;
        let mut alpha = 0.0;
        loop {
            let worst = self.worst_window(alpha);
            let needed = (worst.lost - t_0) / (worst.length - t_0);
            // Also ends on 0/0, and when rounding leaves no progress.
            if worst.excess(alpha) <= (1.0 - alpha) * t_0 || needed.is_nan() || needed <= alpha {
                return alpha;
            }
            alpha = needed;
        }
    }

    /// The longest time without connection, one that has not ended included; zero if there was none.
    pub fn longest_outage(&self) -> Span {
        self.phases().filter(|(up, _)| !up).map(|(_, lasts)| lasts).max().unwrap_or(Span::ZERO)
    }

    /// The shortest time without connection that has ended.
    pub fn shortest_outage(&self) -> Option<Span> {
        let ended = self.toggles.len();
        self.phases().take(ended).filter(|(up, _)| !up).map(|(_, lasts)| lasts).min()
    }

    /// Dwell time τ_D: the shortest time between two changes of the graph; `None` before the second.
    #[doc(alias = "τ_D")]
    pub fn dwell(&self) -> Option<Span> {
        self.dwell
    }

    /// The smallest T with which the run was uniformly connected in mean (Definition 4.4): the union graph over every
    /// \[t, t + T\] within the run can agree. `None` if not even the union over the whole run can (or nothing was seen).
    ///
    /// A run that ends while a union is still incomplete has a T of at least the time it has been so.
    pub fn connected_in_mean(&self) -> Option<Span> {
        match (self.start?, self.union.waiting_since()) {
            (_, None) => Some(self.union.longest),
            (start, Some(since)) if since == start => None,
            (_, Some(since)) => Some(self.union.longest.max(self.now - since)),
        }
    }

    fn connected_now(&self) -> bool {
        self.starts_connected ^ (self.toggles.len() % 2 == 1)
    }

    /// Times with and without connection, by turns: (connected, how long), the last one so far.
    fn phases(&self) -> impl Iterator<Item = (bool, Span)> + '_ {
        let starts = self.start.into_iter().chain(self.toggles.iter().copied());
        let ends = self.toggles.iter().copied().chain([self.now]);
        starts.zip(ends).enumerate().map(|(index, (from, to))| (self.starts_connected ^ (index % 2 == 1), to - from))
    }

    /// The window with the largest T_p − α dt, by a leaky bucket: a window that has lost less than α dt is dropped.
    fn worst_window(&self, alpha: f64) -> Window {
        let (mut window, mut worst) = (Window::default(), Window::default());
        for (up, lasts) in self.phases() {
            let lasts = lasts.nanos() as f64;
            window.length += lasts;
            if !up {
                window.lost += lasts;
            }
            if window.excess(alpha) > worst.excess(alpha) {
                worst = window;
            }
            if window.excess(alpha) <= 0.0 {
                window = Window::default();
            }
        }
        worst
    }
}

/// A window of time and the connectivity loss time in it \[ns\].
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    length: f64,
    lost: f64,
}

impl Window {
    fn excess(self, alpha: f64) -> f64 {
        self.lost - alpha * self.length
    }
}

/// For every instant of change that still waits for it: the union of the graphs since then.
///
/// The unions shrink towards later starts. Equal ones will be complete together, so only the earliest is kept, and
/// there are never more of them than arcs.
#[derive(Clone, Debug, Default)]
struct UnionWindows {
    waiting: Vec<(Time, Graph)>,
    longest: Span,
}

impl UnionWindows {
    fn change(&mut self, t: Time, graph: &Graph) {
        for (_, union) in &mut self.waiting {
            *union = union.union(graph);
        }
        self.waiting.push((t, graph.clone()));
        // Earlier unions contain later ones: those that are complete come first, and the first waited longest.
        if let Some((since, _)) = self.waiting.first().filter(|(_, union)| union.can_agree()) {
            self.longest = self.longest.max(t - *since);
        }
        self.waiting.retain(|(_, union)| !union.can_agree());
        let mut earlier: Option<Graph> = None;
        self.waiting.retain(|(_, union)| {
            let new = earlier.as_ref() != Some(union);
            if new {
                earlier = Some(union.clone());
            }
            new
        });
    }

    fn waiting_since(&self) -> Option<Time> {
        self.waiting.first().map(|(since, _)| *since)
    }
}

#[cfg(test)]
mod tests {
    use super::Connectivity;
    use crate::graph::Graph;
    use crate::graph::switching::Switching;
    use crate::random::Stream;
    use crate::time::{Span, Time};
    use proptest::prelude::*;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn at(seconds: f64) -> Time {
        Time::from_secs(seconds)
    }
    /// The star of section 4.6: the first of three vehicles exchanges with both others.
    const STAR: [(usize, usize); 4] = [(0, 1), (1, 0), (0, 2), (2, 0)];

    #[test]
    fn example_4_1_loses_three_quarters_of_every_ten_seconds() {
        let signal = Switching::periodic(4, s(10.0), s(7.5), s(2.5));
        let run = Connectivity::planned(signal, 3, &STAR, at(300.0));
        assert_eq!((run.loss_time(), run.loss_fraction()), (s(225.0), 0.75));
        assert_eq!((run.t_0(0.75), run.t_0(0.9)), (s(7.5), s(7.5)));
        assert_eq!(run.alpha(s(7.5)), 0.75);
        assert_eq!(run.alpha(s(7.4)), 1.0, "an outage longer than T_0 is excused by no rate below one");
        assert_eq!((run.shortest_outage(), run.longest_outage()), (Some(s(7.5)), s(7.5)));
        assert_eq!((run.dwell(), run.connected_in_mean()), (Some(s(2.5)), Some(s(7.5))));
        // Below the true loss rate T_0 grows with the run (erratum 4.21): here to (225 - 0.7 * 297.5) / 0.3.
        assert_eq!(run.t_0(0.7), s(16.75 / 0.3));
    }

    #[test]
    fn links_that_take_turns_are_never_connected_but_are_in_mean() {
        let signal = Switching::one_at_a_time(4, vec![vec![0, 1], vec![2, 3]], s(10.0));
        let run = Connectivity::planned(signal, 3, &STAR, at(100.0));
        assert_eq!((run.loss_fraction(), run.longest_outage(), run.shortest_outage()), (1.0, s(100.0), None));
        assert_eq!((run.connected_in_mean(), run.dwell()), (Some(s(10.0)), Some(s(10.0))));
        assert_eq!(run.t_0(0.5), s(100.0));
    }

    #[test]
    fn a_vehicle_that_never_hears_is_noticed() {
        let mut run = Connectivity::new();
        for k in 0..1000 {
            run.graph(at(f64::from(k)), Graph::from_edges(4, &[(0, 1 + k as usize % 2)]));
        }
        assert_eq!(run.connected_in_mean(), None);
        assert!(run.union.waiting.len() <= 2, "memory stays bounded");
        run.graph(at(1000.0), Graph::from_edges(4, &[(0, 3)]));
        assert_eq!(run.connected_in_mean(), Some(s(1000.0)));
        run.advance(at(2500.0));
        assert_eq!(run.connected_in_mean(), Some(s(1501.0)), "the third has not been heard since 999 s");
    }

    #[test]
    fn an_outage_at_the_end_counts_but_is_not_the_shortest() {
        let mut run = Connectivity::new();
        run.connected(at(0.0), true);
        run.connected(at(5.0), false);
        run.connected(at(7.0), true);
        run.connected(at(7.5), true);
        run.connected(at(9.0), false);
        run.advance(at(10.0));
        assert_eq!((run.loss_time(), run.length()), (s(3.0), s(10.0)));
        assert_eq!((run.shortest_outage(), run.longest_outage()), (Some(s(2.0)), s(2.0)));
        assert_eq!((run.dwell(), run.connected_in_mean()), (Some(s(2.0)), Some(s(2.0))));
        // α is taken into [0, 1], T_0 is not negative.
        assert_eq!((run.t_0(1.0), run.t_0(1.5)), (s(2.0), s(2.0)));
        assert_eq!((run.t_0(-0.5), run.alpha(s(-1.0))), (run.t_0(0.0), run.alpha(Span::ZERO)));
        assert_eq!((run.most_lost_in(s(-1.0)), run.most_lost_in(s(99.0))), (Span::ZERO, s(3.0)));
        run.advance(at(12.0));
        assert_eq!((run.longest_outage(), run.connected_in_mean()), (s(3.0), Some(s(3.0))));
    }

    #[test]
    fn the_shortest_outage_is_the_shortest_of_those_that_ended() {
        let mut run = Connectivity::new();
        for (second, connected) in
            [(0.0, false), (3.0, true), (4.0, false), (4.5, true), (6.0, false), (8.0, true), (9.0, false)]
        {
            run.connected(at(second), connected);
        }
        run.advance(at(9.25));
        assert_eq!((run.shortest_outage(), run.longest_outage()), (Some(s(0.5)), s(3.0)));
        assert_eq!(run.dwell(), Some(s(0.5)), "of all times between two changes, not the last");
    }

    #[test]
    fn who_is_joined_but_has_no_common_source_is_not_connected() {
        // 1 hears 0 and 2, who hear nobody, until 0 hears 2: then all hear 2.
        let (two_sources, link) = (Graph::from_arcs(3, &[(1, 0), (1, 2)]), Graph::from_arcs(3, &[(0, 2)]));
        let mut run = Connectivity::new();
        run.graph(at(0.0), two_sources.clone());
        run.graph(at(3.0), two_sources.union(&link));
        run.graph(at(4.0), two_sources.clone());
        run.advance(at(6.0));
        assert_eq!((run.loss_time(), run.longest_outage()), (s(5.0), s(3.0)));
        assert_eq!(run.connected_in_mean(), Some(s(3.0)));
        let mut never = Connectivity::new();
        never.graph(at(0.0), two_sources.clone());
        never.graph(at(1.0), Graph::from_arcs(3, &[(1, 0)]));
        never.graph(at(2.0), two_sources);
        never.advance(at(9.0));
        assert_eq!(never.connected_in_mean(), None);
    }

    #[test]
    fn before_anything_is_seen_nothing_is_claimed() {
        let run = Connectivity::new();
        assert_eq!((run.length(), run.loss_fraction(), run.longest_outage()), (Span::ZERO, 0.0, Span::ZERO));
        assert_eq!((run.connected_in_mean(), run.shortest_outage(), run.dwell()), (None, None, None));
        assert_eq!(
            (run.t_0(0.5), run.t_0(f64::NAN), run.t_0(2.0), run.alpha(Span::ZERO)),
            (Span::ZERO, Span::ZERO, Span::ZERO, 0.0)
        );
    }

    /// A random run of connected and unconnected times \[s\].
    fn a_run() -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(0.1..5.0f64, 1..30)
    }
    fn measure(durations: &[f64]) -> Connectivity {
        let mut run = Connectivity::new();
        let mut t = Time::ZERO;
        for (index, &lasts) in durations.iter().enumerate() {
            run.connected(t, index % 2 == 1);
            t += s(lasts);
        }
        run.advance(t);
        run
    }

    proptest! {
        #[test]
        fn t_0_is_the_supremum_over_all_windows(durations in a_run(), alpha in 0.0..0.95f64) {
            // By brute force over the windows between changes, which dominate all others.
            let mut sup = 0.0f64;
            for first in 0..durations.len() {
                let (mut lost, mut length) = (0.0, 0.0);
                for (index, lasts) in durations.iter().enumerate().skip(first) {
                    lost += if index % 2 == 1 { 0.0 } else { *lasts };
                    length += lasts;
                    sup = sup.max(lost - alpha * length);
                }
            }
            let measured = measure(&durations).t_0(alpha).secs();
            prop_assert!((measured - sup / (1.0 - alpha)).abs() < 1e-6, "{} {}", measured, sup);
        }

        #[test]
        fn no_sliding_window_loses_more_than_the_worst(durations in a_run(), length in 0.1..20.0f64) {
            let run = measure(&durations);
            let worst = run.most_lost_in(s(length)).secs();
            let end = run.length().secs();
            let length = length.min(end);
            let lost_in = |from: f64| {
                let mut begins = 0.0;
                let overlaps = durations.iter().enumerate().map(|(index, lasts)| {
                    let overlap = (begins + lasts).min(from + length) - f64::max(begins, from);
                    begins += lasts;
                    if index % 2 == 1 { 0.0 } else { overlap.max(0.0) }
                });
                overlaps.sum::<f64>()
            };
            let slid = (0..=200).map(|step| lost_in((end - length) * f64::from(step) / 200.0)).fold(0.0, f64::max);
            prop_assert!(slid <= worst + 1e-6, "{} {}", slid, worst);
            // On so fine a grid the worst window is missed by at most one step.
            prop_assert!(worst <= slid + (end - length) / 200.0 + 1e-6);
        }

        #[test]
        fn alpha_is_the_smallest_that_t_0_allows(durations in a_run(), t_0 in 0.0..20.0f64) {
            let run = measure(&durations);
            let alpha = run.alpha(s(t_0));
            prop_assert!((0.0..=1.0).contains(&alpha));
            if alpha < 0.999 {
                prop_assert!(run.t_0(alpha).secs() <= t_0 + 1e-6);
            }
            if alpha > 0.01 {
                prop_assert!(run.t_0(alpha - 0.005).secs() > t_0);
            }
        }

        #[test]
        fn a_random_signal_keeps_the_promise_it_was_made_with(
            alpha in 0.05..0.95f64, t_0 in 0.5..10.0f64, dwell in 0.01..0.5f64, seed in any::<u64>()
        ) {
            let signal = Switching::random(4, alpha, s(t_0), s(dwell), Stream::new(seed, "signal"));
            let run = Connectivity::planned(signal, 3, &STAR, at(100.0 * t_0));
            prop_assert!(run.t_0(alpha) <= s(t_0) + Span::from_nanos(2));
            prop_assert!(run.alpha(s(t_0)) <= alpha + 1e-9);
            prop_assert!(run.dwell().is_none_or(|measured| measured >= s(dwell)));
            prop_assert!(run.connected_in_mean().is_some_and(|mean| mean <= s(t_0)));
        }

        #[test]
        fn connectedness_in_mean_is_found_by_sliding_a_window(picks in prop::collection::vec(0usize..6, 1..25)) {
            // Graphs on four vertices with one edge each, one second each; windows over whole seconds suffice.
            const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            let graphs: Vec<Graph> = picks.iter().map(|&pick| Graph::from_edges(4, &[EDGES[pick]])).collect();
            let mut run = Connectivity::new();
            for (second, graph) in graphs.iter().enumerate() {
                run.graph(at(second as f64), graph.clone());
            }
            let end = graphs.len();
            run.advance(at(end as f64));
            // A window [t, t + length] from a whole second holds length + 1 graphs.
            let complete = |graphs: &[Graph]| graphs.iter().fold(Graph::empty(4), |union, graph| union.union(graph)).can_agree();
            let brute = (0..end).find(|&length| graphs.windows(length + 1).all(complete));
            let measured = run.connected_in_mean().map(|mean| mean.secs());
            match brute {
                None => prop_assert_eq!(measured, None),
                Some(length) => prop_assert!(measured.is_some_and(|mean| mean == length as f64), "{:?} {}", measured, length),
            }
        }
    }
}
