//! Random switching that is uniformly connected in mean with a given window T (Definition 4.4), and as good as never
//! connected at any instant: one link at a time.
//!
//! Time is cut into turns, and m of them make a cycle. In every cycle each of the m groups of a smallest set that connects
//! the fleet has one turn, in random order: it comes up as the turn begins, and is up for a random time, for a dwell at
//! least. Which smallest set it is, changes at random from cycle to cycle.
//!
//! *How long a turn is.* A window is longest without a connected union if it begins just as the first group of a cycle goes
//! down, after no more than its dwell, and if what it lacks comes up last in the next cycle: 2m − 1 turns less a dwell. By
//! then it contains all of that cycle, so the union is connected. With turns of (T + dwell)/(2m − 1) this longest
//! window is T itself: the signal is connected in mean with T, and with no T below it.

use super::super::Graph;
use super::instant;
use crate::random::Stream;
use crate::time::{Span, Time};

/// Sets of links that connect the fleet, to choose from.
const SETS: u64 = 8;

/// Random numbers that belong to one cycle; a set has fewer groups than a mission has vehicles.
const NUMBERS_PER_CYCLE: u64 = 256;

/// Groups of links that take turns at random.
#[derive(Clone, Debug)]
pub(super) struct InMean {
    /// Length of a turn \[ns\].
    turn: i64,
    /// Length of a cycle \[ns\].
    cycle: i64,
    dwell: i64,
    groups: Vec<Vec<usize>>,
    sets: Vec<Vec<usize>>,
    stream: Stream,
    /// The cycle that `turns` belongs to.
    number: i64,
    /// Of the cycle: when a group comes up and goes down \[ns\], in order.
    turns: Vec<(i64, i64, usize)>,
}

impl InMean {
    /// Groups of links among `n` vehicles, link l being the arc `arcs[l]` (receiver, sender).
    ///
    /// # Errors
    /// The shortest window that is possible with this dwell; `None` if not even all groups together connect the fleet.
    pub(super) fn new(
        n: usize,
        arcs: &[(usize, usize)],
        groups: Vec<Vec<usize>>,
        window: Span,
        dwell: Span,
        mut stream: Stream,
    ) -> Result<InMean, Option<Span>> {
        let connects = |set: &[usize]| {
            let links = set.iter().flat_map(|group| &groups[*group]);
            Graph::from_arcs(n, &links.map(|link| arcs[*link]).collect::<Vec<_>>()).can_agree()
        };
        if !connects(&(0..groups.len()).collect::<Vec<_>>()) {
            return Err(None);
        }
        let sets: Vec<Vec<usize>> = (0..SETS).map(|_| smallest_set(groups.len(), &mut stream, connects)).collect();
        let dwell = dwell.nanos().max(1);
        // All smallest sets are equally large: n − 1 groups join n vehicles, and fewer never do.
        let turns = sets.iter().map(Vec::len).max().unwrap_or(0) as i64;
        // In its turn each group is up and then down for one dwell at least.
        let shortest = dwell.saturating_mul(4 * turns - 3);
        if turns == 0 || window.nanos() < shortest {
            return Err(Some(Span::from_nanos(shortest)));
        }
        let turn = window.nanos().saturating_add(dwell) / (2 * turns - 1);
        let cycle = turn.saturating_mul(turns);
        Ok(InMean { turn, cycle, dwell, groups, sets, stream, number: -1, turns: Vec::new() })
    }

    /// Whose turns they are.
    pub(super) fn groups(&self) -> &[Vec<usize>] {
        &self.groups
    }

    pub(super) fn is_up(&mut self, link: usize, t: Time) -> bool {
        let within = self.enter(t);
        let turn = self.turns.iter().find(|(from, to, _)| (*from..*to).contains(&within));
        turn.is_some_and(|(_, _, group)| self.groups[*group].contains(&link))
    }

    pub(super) fn next_change_after(&mut self, t: Time) -> Option<Time> {
        let within = self.enter(t);
        let changes = self.turns.iter().flat_map(|(from, to, _)| [*from, *to]);
        // The first turn of a cycle begins with it.
        let next = changes.filter(|change| *change > within).min().unwrap_or(self.cycle);
        instant(i128::from(self.number) * i128::from(self.cycle) + i128::from(next))
    }

    /// Goes to the cycle of `t`; the time since its begin \[ns\].
    fn enter(&mut self, t: Time) -> i64 {
        let number = t.nanos().max(0) / self.cycle;
        if number != self.number {
            self.number = number;
            self.turns = self.plan(number);
        }
        t.nanos().max(0) % self.cycle
    }

    /// A cycle's turns: a function of its number alone.
    fn plan(&mut self, number: i64) -> Vec<(i64, i64, usize)> {
        let (stream, mut index) = (&mut self.stream, number as u64 * NUMBERS_PER_CYCLE);
        let mut unit = || {
            index += 1;
            stream.unit_at(index, 0)
        };
        let mut set = self.sets[(unit() * self.sets.len() as f64) as usize].clone();
        for last in (1..set.len()).rev() {
            set.swap(last, (unit() * (last + 1) as f64) as usize);
        }
        let length = self.turn;
        let turn = |(k, group): (i64, usize)| {
            let up = self.dwell + ((length - 2 * self.dwell) as f64 * unit()) as i64;
            (k * length, k * length + up, group)
        };
        (0..).zip(set).map(turn).collect()
    }
}

/// A set of groups of which none can be left out, found by leaving out in random order.
fn smallest_set(groups: usize, stream: &mut Stream, connects: impl Fn(&[usize]) -> bool) -> Vec<usize> {
    let mut order: Vec<usize> = (0..groups).collect();
    for last in (1..groups).rev() {
        order.swap(last, stream.below(last + 1));
    }
    let enough = (1..groups).find(|count| connects(&order[..*count])).unwrap_or(groups);
    order.truncate(enough);
    let mut index = 0;
    while index < order.len() {
        let group = order.remove(index);
        if !connects(&order) {
            order.insert(index, group);
            index += 1;
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::super::measure::Connectivity;
    use super::super::Switching;
    use super::*;

    /// A ring of two-way links with a diagonal, and the arcs of each pair as a group.
    fn ring(n: usize) -> (Vec<(usize, usize)>, Vec<Vec<usize>>) {
        let pairs = (0..n).map(|i| (i, (i + 1) % n)).chain([(0, n / 2)]).filter(|(a, b)| a != b);
        let arcs: Vec<(usize, usize)> = pairs.flat_map(|(a, b)| [(a, b), (b, a)]).collect();
        let groups = (0..arcs.len() / 2).map(|pair| vec![2 * pair, 2 * pair + 1]).collect();
        (arcs, groups)
    }

    proptest! {
        #[test]
        fn every_window_connects_the_fleet_and_no_instant_does(
            n in 3usize..8, seed in any::<u64>(), dwell in 0.05..0.5f64, factor in 1.0..5.0f64
        ) {
            let (arcs, groups) = ring(n);
            let window = Span::from_secs((4 * n - 7) as f64 * dwell * factor + 1e-6);
            let signal = Switching::in_mean(n, &arcs, groups, window, Span::from_secs(dwell), Stream::new(seed, "p"));
            let measured = Connectivity::planned(signal.expect("possible"), n, &arcs, Time::ZERO + window * 20);
            let found = measured.connected_in_mean().expect("connected in mean");
            prop_assert!(found <= window, "{found} > {window}");
            // A run of twenty windows comes near the window that was asked for, but never connects at once.
            prop_assert!(found.secs() > 0.5 * window.secs(), "{found} of {window}");
            prop_assert!((measured.loss_fraction() - 1.0).abs() < 1e-12);
            prop_assert!(measured.dwell().is_some_and(|held| held.secs() >= dwell - 1e-9));
        }
    }

    #[test]
    fn a_long_run_comes_within_a_twentieth_of_the_window_and_never_beyond() {
        for (n, window, dwell) in [(2, 10.0, 1.0), (3, 12.0, 0.3), (3, 20.0, 1.0), (5, 40.0, 1.0), (5, 40.0, 3.0)] {
            let window = Span::from_secs(window);
            for seed in 0..20 {
                let (arcs, groups) = ring(n);
                let stream = Stream::new(seed, "switching");
                let signal = Switching::in_mean(n, &arcs, groups, window, Span::from_secs(dwell), stream);
                let run = Connectivity::planned(signal.expect("possible"), n, &arcs, Time::ZERO + window * 200);
                let share = run.connected_in_mean().expect("connected in mean").secs() / window.secs();
                assert!((0.95..=1.0).contains(&share), "{n} vehicles, {window}, seed {seed}: {share} of the window");
            }
        }
    }

    /// The least that a group can be up is all that two vehicles hear; then it is down for the whole window.
    #[test]
    fn a_window_as_short_as_the_dwell_allows_is_reached_to_the_nanosecond() {
        for n in 2..6 {
            let (arcs, groups) = ring(n);
            let window = Span::from_secs((4 * n - 7) as f64);
            let signal = Switching::in_mean(n, &arcs, groups, window, Span::from_secs(1.0), Stream::new(1, "p"));
            let run = Connectivity::planned(signal.expect("possible"), n, &arcs, Time::ZERO + window * 200);
            assert_eq!(run.connected_in_mean(), Some(window), "{n} vehicles");
        }
    }

    #[test]
    fn a_window_too_short_for_the_dwell_is_refused_with_the_shortest() {
        let (arcs, groups) = ring(4);
        let make = |window: f64, groups: Vec<Vec<usize>>| {
            let (window, dwell) = (Span::from_secs(window), Span::from_secs(1.0));
            Switching::in_mean(4, &arcs, groups, window, dwell, Stream::new(1, "p")).err()
        };
        assert_eq!(make(8.9, groups.clone()), Some(Some(Span::from_secs(9.0))));
        assert_eq!(make(9.0, groups.clone()), None);
        assert_eq!(make(100.0, groups[..1].to_vec()), Some(None), "two of four vehicles");
    }

    #[test]
    fn one_way_links_reach_from_one_vehicle_to_all() {
        let arcs = [(1, 0), (2, 1), (0, 2), (2, 0)];
        let groups = (0..4).map(|link| vec![link]).collect();
        let window = Span::from_secs(10.0);
        let signal = Switching::in_mean(3, &arcs, groups, window, Span::from_secs(0.5), Stream::new(1, "p"));
        let measured = Connectivity::planned(signal.expect("possible"), 3, &arcs, Time::from_secs(300.0));
        assert!(measured.connected_in_mean().is_some_and(|found| found <= window));
    }
}
