//! The switching signals that brief connectivity losses admit, and how to search among them for one that hurts.
//!
//! A signal is a sequence of stretches, none shorter than the dwell time but those that the start and the end cut. In each
//! the network is one of a set of graphs made of the mission's links: the connected ones with as few links as possible,
//! which agree slowest, those that are not connected, and those of the mission's own signal. What Definition 4.3 asks for
//! is one number that is carried along: by how much the time lost so far exceeds the share α. Of a window in a reversed
//! signal it asks the same, so that signals can be built from either end.

mod change;

use std::collections::BTreeSet;

use super::Graph;
use super::measure::Connectivity;
use super::switching::{Switching, UpInterval};
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

impl Allowance {
    /// Parts of T_0, the longest first, down to the dwell time: what a longer dwell time admits, a shorter one admits too,
    /// and signals that change seldom are fewer and often hurt more.
    pub fn dwells(self) -> Vec<Span> {
        let longer = (1..4).map(|part| Span::from_nanos(self.t_0.nanos() / 3i64.pow(part)));
        longer.filter(|&longer| longer > self.dwell).chain([self.dwell]).collect()
    }
}

/// A switching signal: which graph for how long, from zero to the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal(Vec<Piece>);

/// A stretch of time with one graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Piece {
    graph: usize,
    /// \[ns\]
    lasts: i64,
}

/// The signals that a network admits over a stretch of time.
#[derive(Clone, Debug)]
pub struct Signals {
    allowance: Allowance,
    n: usize,
    arcs: Vec<(usize, usize)>,
    end: Time,
    /// The links that are up, for each graph: first the connected graphs that are chosen from, then the others, and then
    /// those that only the mission's own signal has.
    graphs: Vec<Vec<usize>>,
    connected: usize,
    chosen: usize,
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
        let chosen = graphs.len();
        Ok(Signals { allowance, n, arcs: arcs.to_vec(), end, graphs, connected, chosen, as_graphs })
    }

    /// The graphs that signals are made of: what a bound over all of them has to hold for.
    pub fn graphs(&self) -> &[Graph] {
        &self.as_graphs
    }

    /// What a signal may do.
    pub fn allowance(&self) -> Allowance {
        self.allowance
    }

    /// The same with another dwell time, one above zero. What a longer one admits, a shorter one admits too.
    pub fn with_dwell(&self, dwell: Span) -> Signals {
        Signals { allowance: Allowance { dwell, ..self.allowance }, ..self.clone() }
    }

    /// A signal that is given, over the same links, if it is admitted. It must not have been asked yet; give a clone.
    pub fn given(&mut self, mut signal: Switching) -> Option<Signal> {
        let measured = Connectivity::planned(signal.clone(), self.n, &self.arcs, self.end);
        if !self.allows(&measured) {
            return None;
        }
        let (mut pieces, mut t) = (Vec::new(), Time::ZERO);
        while t < self.end {
            let links: Vec<usize> = (0..self.arcs.len()).filter(|&link| signal.is_up(link, t)).collect();
            let next = signal.next_change_after(t).map_or(self.end, |next| next.min(self.end));
            pieces.push(Piece { graph: self.graph_of(links), lasts: (next - t).nanos() });
            t = next;
        }
        Some(Signal(joined(pieces)))
    }

    /// Whether this signal is admitted, as its connectivity is measured.
    pub fn admits(&self, signal: &Signal) -> bool {
        let switching = Switching::intervals(self.arcs.len(), self.intervals(signal), None);
        self.allows(&Connectivity::planned(switching, self.n, &self.arcs, self.end))
    }

    fn allows(&self, measured: &Connectivity) -> bool {
        let Allowance { alpha, t_0, dwell } = self.allowance;
        // T_0 is measured to the nearest nanosecond.
        measured.t_0(alpha) <= t_0 + Span::from_nanos(1) && measured.dwell().is_none_or(|least| least >= dwell)
    }

    fn graph_of(&mut self, links: Vec<usize>) -> usize {
        self.graphs.iter().position(|known| *known == links).unwrap_or_else(|| {
            let arcs: Vec<_> = links.iter().map(|&link| self.arcs[link]).collect();
            self.as_graphs.push(Graph::from_arcs(self.n, &arcs));
            self.graphs.push(links);
            self.graphs.len() - 1
        })
    }

    /// Periodic extremes over each of the connected graphs: losses of T_0, and of parts of it, as often as allowed, from
    /// the start, from the end, from a loss at the start to one at the end, and from half a loss on.
    pub fn periodic_starts(&self) -> impl Iterator<Item = Signal> + '_ {
        let (t_0, dwell) = (self.allowance.t_0.nanos(), self.allowance.dwell.nanos());
        let losses = (0..PARTS).map(move |part| t_0 >> part).filter(move |&down| down >= dwell);
        let periodic =
            losses.flat_map(|down| (0..self.connected).map(move |weak| (down, weak))).flat_map(move |(down, weak)| {
                let up = self.recovery(down);
                let (shorter_losses, longer_stays) = self.fitted(down, up);
                let early = self.turns(down, up, weak);
                let mut half = early.clone();
                half[0].lasts = (down / 2).max(dwell);
                [
                    self.settled(early.clone(), weak, false),
                    self.settled_backwards(early.into_iter().rev().collect(), weak, false),
                    self.settled(self.turns(shorter_losses.0, shorter_losses.1, weak), weak, false),
                    self.settled(self.turns(longer_stays.0, longer_stays.1, weak), weak, false),
                    self.settled(half, weak, false),
                ]
            });
        // No loss is short enough.
        let none = (t_0 < dwell).then(|| (0..self.connected).map(|weak| self.settled(Vec::new(), weak, false)));
        periodic.chain(none.into_iter().flatten())
    }

    /// Losses and stays by turns, beyond the end; an even number of them, a loss first.
    fn turns(&self, down: i64, up: i64, weak: usize) -> Vec<Piece> {
        let turn = [Piece { graph: self.nothing(), lasts: down }, Piece { graph: weak, lasts: up }];
        let turns = (self.end.nanos() / (down + up).max(1)) as usize + 2;
        turn.iter().copied().cycle().take(2 * turns).collect()
    }

    /// Losses and stays (down, up) that begin and end with a whole loss: with shorter losses, and with longer stays.
    fn fitted(&self, down: i64, up: i64) -> ((i64, i64), (i64, i64)) {
        let (end, turn) = (self.end.nanos(), down + up);
        // n losses and n − 1 stays.
        let most = (end + up) / turn;
        let longer = if most > 1 { (end - most * down + most - 2) / (most - 1) } else { up };
        let more = (end + up + turn - 1) / turn;
        let share = end as f64 / (more * down + (more - 1) * up).max(1) as f64;
        let shorter = ((down as f64 * share).floor() as i64).max(1);
        ((shorter, self.recovery(shorter)), (down, longer))
    }

    /// Random losses such as a mission can ask for, of this number: with the dwell time, and with longer ones by turns.
    pub fn random_start(&self, number: usize, seed: u64) -> Signal {
        let Allowance { alpha, t_0, .. } = self.allowance;
        let dwells = self.allowance.dwells();
        let dwell = dwells[number % dwells.len()];
        let mut stream = Stream::new(seed, &format!("adversary/graph/{number}"));
        let mut losses =
            Switching::random(1, alpha, t_0, dwell, Stream::new(seed, &format!("adversary/random/{number}")));
        let (mut pieces, mut t) = (Vec::new(), Time::ZERO);
        while t < self.end {
            let graph = if losses.is_up(0, t) { stream.below(self.connected) } else { self.nothing() };
            let next = losses.next_change_after(t).map_or(self.end, |next| next.min(self.end));
            pieces.push(Piece { graph, lasts: (next - t).nanos() });
            t = next;
        }
        Signal(joined(pieces))
    }

    /// The graph without any link.
    fn nothing(&self) -> usize {
        self.connected
    }

    fn agrees(&self, graph: usize) -> bool {
        self.as_graphs[graph].can_agree()
    }

    /// How long after a loss of `down` it may happen again for ever, not less than the dwell time \[ns\].
    fn recovery(&self, down: i64) -> i64 {
        let alpha = self.allowance.alpha;
        let longest = 2 * self.end.nanos() + 1;
        let lasts = if alpha > 0.0 { ((1.0 / alpha - 1.0) * down as f64).ceil() as i64 } else { longest };
        lasts.clamp(0, longest).max(self.allowance.dwell.nanos())
    }

    /// The stretches in their order, made to be admitted. A loss that is too long is cut, or comes only once it fits, and
    /// the connected graph `weak` fills the time. No stretch but the first is shorter than the dwell time.
    fn settled(&self, pieces: Vec<Piece>, weak: usize, cut: bool) -> Signal {
        let Allowance { alpha, t_0, dwell } = self.allowance;
        let (t_0, dwell) = (t_0.nanos(), dwell.nanos());
        let mut settling = Settling { signals: self, pieces: Vec::new(), excess: 0.0, left: self.end.nanos() };
        for Piece { graph, lasts } in joined(pieces) {
            let first = settling.pieces.is_empty();
            let lasts = if first { lasts } else { lasts.max(dwell) };
            let room = ((self.most_excess() - settling.excess) / (1.0 - alpha)).floor() as i64;
            if self.agrees(graph) || lasts <= room {
                settling.push(graph, lasts);
            } else if cut && room >= dwell {
                settling.push(graph, room);
                settling.push(weak, (lasts - room).max(dwell));
            } else if t_0 < dwell || alpha <= 0.0 {
                settling.push(weak, lasts.max(dwell));
            } else {
                let loss = lasts.min(t_0);
                let spare = self.most_excess() - (1.0 - alpha) * loss as f64;
                let wait = ((settling.excess - spare.max(0.0)) / alpha).ceil().max(0.0) as i64;
                match settling.pieces.last().map(|last| last.graph) {
                    _ if wait == 0 => {}
                    Some(stay) if self.agrees(stay) => settling.push(stay, wait),
                    _ => settling.push(weak, wait.max(dwell)),
                }
                settling.push(graph, loss);
            }
        }
        let left = settling.left;
        match settling.pieces.last().map(|last| last.graph) {
            Some(stay) if self.agrees(stay) => settling.push(stay, left),
            _ => settling.push(weak, left),
        }
        Signal(settling.pieces)
    }

    /// The same from the end: what is left over goes to the start.
    fn settled_backwards(&self, mut pieces: Vec<Piece>, weak: usize, cut: bool) -> Signal {
        pieces.reverse();
        let Signal(mut pieces) = self.settled(pieces, weak, cut);
        pieces.reverse();
        Signal(pieces)
    }

    /// (1 − α) T_0 \[ns\]: what T_p − α(t − τ) may reach in any window (4.11).
    fn most_excess(&self) -> f64 {
        (1.0 - self.allowance.alpha) * self.allowance.t_0.nanos() as f64
    }

    /// The largest T_p − α(t − τ) \[ns\] of a window that ends with this piece, given that of the piece before.
    fn excess_after(&self, excess: f64, piece: &Piece) -> f64 {
        let (lasts, alpha) = (piece.lasts as f64, self.allowance.alpha);
        if self.agrees(piece.graph) { (excess - alpha * lasts).max(0.0) } else { excess + (1.0 - alpha) * lasts }
    }

    fn excess_over<'a>(&self, pieces: impl Iterator<Item = &'a Piece>) -> f64 {
        pieces.fold(0.0, |excess, piece| self.excess_after(excess, piece))
    }

    /// The signal as intervals in which links are up. The last stretch is no shorter than the dwell time, even if the end
    /// cuts it.
    pub fn intervals(&self, signal: &Signal) -> Vec<UpInterval> {
        let (mut intervals, mut from) = (Vec::new(), Time::ZERO);
        for &Piece { graph, lasts } in &signal.0 {
            let to = from + Span::from_nanos(lasts);
            let links = &self.graphs[graph];
            if !links.is_empty() {
                let until = if to < self.end { to } else { to.max(from + self.allowance.dwell) };
                intervals.push(UpInterval { from, to: until, links: Some(links.clone()) });
            }
            from = to;
        }
        intervals
    }
}

/// Periodic losses last T_0, half of it, and so on: so many lengths.
const PARTS: usize = 5;

/// A signal on the way from the start to the end.
struct Settling<'a> {
    signals: &'a Signals,
    pieces: Vec<Piece>,
    excess: f64,
    left: i64,
}

impl Settling<'_> {
    fn push(&mut self, graph: usize, lasts: i64) {
        let piece = Piece { graph, lasts: lasts.min(self.left) };
        if piece.lasts <= 0 {
            return;
        }
        self.left -= piece.lasts;
        self.excess = self.signals.excess_after(self.excess, &piece);
        append(&mut self.pieces, piece);
    }
}

/// Without stretches of no length, and those that follow one another with one graph as one.
fn joined(pieces: Vec<Piece>) -> Vec<Piece> {
    let mut joined = Vec::with_capacity(pieces.len());
    pieces.into_iter().filter(|piece| piece.lasts > 0).for_each(|piece| append(&mut joined, piece));
    joined
}

fn append(pieces: &mut Vec<Piece>, piece: Piece) {
    match pieces.last_mut() {
        Some(last) if last.graph == piece.graph => last.lasts += piece.lasts,
        _ => pieces.push(piece),
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
        let early = &signals.periodic_starts().next().expect("a start");
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
        let until = |end: f64| Signals::new(3, &STAR, allowance(0.5, 1.0, 1.0), Time::from_secs(end));
        assert!(until(0.0).is_err() && until(1_000_001.0).is_err());
        assert!(until(0.5).is_ok() && until(1_000_000.0).is_ok());
        // No loss is as short as the dwell time: always up.
        let never = signals(&STAR, allowance(0.5, 0.5, 1.0), 10.0);
        let starts: Vec<_> = never.periodic_starts().collect();
        assert_eq!(measured(&never, &STAR, &starts[0], 10.0).loss_time(), Span::ZERO);
        assert_eq!(starts.len(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn every_signal_is_admitted(alpha in 0.0..0.95f64, t_0 in 0.0..20.0f64, dwell in 0.5..5.0f64, seed: u64) {
            let signals = signals(&TRIANGLE, allowance(alpha, t_0, dwell), 100.0);
            let mut stream = Stream::new(seed, "adversary");
            let random = (0..4).map(|number| signals.random_start(number, seed));
            for start in signals.periodic_starts().chain(random) {
                let mut signal = start;
                for _ in 0..6 {
                    let measured = measured(&signals, &TRIANGLE, &signal, 100.0);
                    prop_assert!(measured.t_0(alpha) <= signals.allowance.t_0 + Span::from_nanos(1), "(4.11)");
                    prop_assert!(measured.dwell().is_none_or(|least| least >= signals.allowance.dwell));
                    prop_assert!(signals.admits(&signal) && measured.length() == Span::from_secs(100.0));
                    signal = signals.changed(&signal, &mut stream);
                }
            }
        }
    }

    #[test]
    fn a_given_signal_is_taken_as_it_is_or_not_at_all() {
        // Example 4.1 with all links of a triangle, more than agreement needs.
        let periodic = Switching::periodic(6, Span::from_secs(10.0), Span::from_secs(7.5), Span::from_secs(2.5));
        let mut strict = signals(&TRIANGLE, allowance(0.75, 7.0, 2.5), 100.0);
        assert_eq!(strict.given(periodic.clone()), None, "T_0");
        let mut slow = signals(&TRIANGLE, allowance(0.75, 7.5, 2.6), 100.0);
        assert_eq!(slow.given(periodic.clone()), None, "dwell time");
        let mut signals = signals(&TRIANGLE, allowance(0.75, 7.5, 2.5), 100.0);
        let graphs = signals.graphs().len();
        let given = signals.given(periodic.clone()).expect("admitted");
        assert_eq!(signals.graphs().len(), graphs + 1, "a bound has to hold for the whole triangle, too");
        let again = Switching::intervals(6, signals.intervals(&given), None);
        for t in [0.0, 7.4, 7.5, 9.9, 10.0, 97.5, 99.9].map(Time::from_secs) {
            assert_eq!(
                (0..6).map(|l| again.clone().is_up(l, t)).collect::<Vec<_>>(),
                [periodic.clone().is_up(0, t); 6]
            );
        }
    }

    #[test]
    fn losses_are_lengthened_to_what_is_allowed() {
        // 40 % are lost at first, in outages of 4 s. Where to lengthen is drawn, so that not all 75 % are reached.
        let mut signals = signals(&STAR, allowance(0.75, 7.5, 0.3), 400.0);
        let periodic = Switching::periodic(4, Span::from_secs(10.0), Span::from_secs(4.0), Span::from_secs(6.0));
        let mild = signals.given(periodic).expect("admitted");
        let mut stream = Stream::new(1, "tight");
        let tight = (0..100).fold(mild, |signal, _| signals.tightened(signal, &mut stream));
        let measured = measured(&signals, &STAR, &tight, 400.0);
        assert!(signals.admits(&tight) && measured.loss_fraction() > 0.65, "{}", measured.loss_fraction());
        assert!(measured.t_0(0.75) > Span::from_secs(7.49), "{}", measured.t_0(0.75));
    }

    #[test]
    fn periodic_losses_come_from_the_end_too() {
        let signals = signals(&STAR, allowance(0.75, 7.5, 2.5), 98.0);
        let late = &signals.periodic_starts().nth(1).expect("a start");
        let last = signals.intervals(late).last().expect("some stay").to;
        assert_eq!(last, Time::from_secs(98.0 - 7.5));
        assert!(signals.admits(late));
    }

    #[test]
    fn losses_at_the_start_and_the_end_fit_in_more_than_whole_periods() {
        // 120 s are twelve periods of 10 s, the last with a stay; from loss to loss 12 of 7.5 s or 13 shorter ones fit.
        let signals = signals(&STAR, allowance(0.75, 7.5, 2.0), 120.0);
        let starts: Vec<_> = signals.periodic_starts().take(4).collect();
        let stays = [0, 2, 3].map(|start: usize| signals.intervals(&starts[start]));
        assert_eq!(stays.each_ref().map(Vec::len), [12, 12, 11]);
        let lost = [0, 2, 3].map(|start: usize| measured(&signals, &STAR, &starts[start], 120.0).loss_time().secs());
        let loss = 120.0 / (13.0 + 12.0 / 3.0);
        assert!((lost[0] - 90.0).abs() < 1e-6 && (lost[2] - 90.0).abs() < 1e-6, "{lost:?}");
        assert!((lost[1] - 13.0 * loss).abs() < 1e-6, "{lost:?}");
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
