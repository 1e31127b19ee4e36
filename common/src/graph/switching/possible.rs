//! What a switching signal can do, by its kind: which links can be up together, whatever the seed.

use super::{Part, Signal, Switching};
use crate::time::Time;

/// Sets of links that can be up together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Possible {
    /// Each set once, as one flag for each link.
    pub states: Vec<Vec<bool>>,
    /// Whether these are all; if not, there were too many to list.
    pub complete: bool,
}

impl Possible {
    fn of(states: impl IntoIterator<Item = Vec<bool>>, most: usize) -> Possible {
        let mut possible = Possible { states: Vec::new(), complete: true };
        for state in states {
            if possible.states.contains(&state) {
                continue;
            }
            if possible.states.len() >= most {
                possible.complete = false;
                break;
            }
            possible.states.push(state);
        }
        possible
    }
}

impl Switching {
    /// The sets of links that can be up together, at most so many. Of signals that are joined, all combinations of what each
    /// can do: the same clock may exclude some of them.
    pub fn possible(&self, most: usize) -> Possible {
        let links = self.links;
        let only = |group: &[usize]| (0..links).map(|link| group.contains(&link)).collect::<Vec<_>>();
        let alternatives = |groups: &[Vec<usize>]| groups.iter().map(|group| only(group)).collect::<Vec<_>>();
        match &self.signal {
            Signal::Always => Possible::of([vec![true; links]], most),
            Signal::Periodic(_) => Possible::of(self.taken_until_it_repeats(2), most),
            Signal::Schedule(schedule) => Possible::of(self.taken_until_it_repeats(schedule.changes_per_lap()), most),
            Signal::Random(_) => Possible::of([vec![true; links], vec![false; links]], most),
            Signal::RoundRobin(turns) if turns.groups().is_empty() => Possible::of([vec![false; links]], most),
            Signal::RoundRobin(turns) => Possible::of(alternatives(turns.groups()), most),
            Signal::InMean(turns) => {
                Possible::of(alternatives(turns.groups()).into_iter().chain([vec![false; links]]), most)
            }
            Signal::Markov(walks) => {
                let walk_of = walks.walk_of_link();
                let count = walk_of.iter().flatten().max().map_or(0, |last| last + 1);
                // All up comes first, so that it is there however many are cut off; beyond 63 walks none is told apart.
                let subsets = (0..1u64 << count.min(63)).rev();
                let state = |subset: u64| {
                    walk_of.iter().map(|walk| walk.is_some_and(|walk| walk >= 63 || subset >> walk & 1 == 1)).collect()
                };
                let found = Possible::of(subsets.map(state), most);
                Possible { complete: found.complete && count < 63, ..found }
            }
            Signal::All(parts) => self.joined(parts, most),
        }
    }

    fn joined(&self, parts: &[Part], most: usize) -> Possible {
        let everything = Possible { states: vec![vec![true; self.links]], complete: true };
        parts.iter().fold(everything, |so_far, part| {
            let own = part.signal.possible(most);
            let counts = |link: usize| part.counts.as_ref().is_none_or(|counts| counts[link]);
            let up = |state: &[bool], link: usize| state.get(link).copied().unwrap_or(false);
            let both = so_far.states.iter().flat_map(|before| {
                own.states.iter().map(move |state| {
                    before
                        .iter()
                        .enumerate()
                        .map(|(link, &before)| before && (!counts(link) || up(state, link)))
                        .collect()
                })
            });
            let found = Possible::of(both, most);
            Possible { complete: found.complete && so_far.complete && own.complete, ..found }
        })
    }

    /// The states from zero through so many changes.
    fn taken_until_it_repeats(&self, changes: usize) -> Vec<Vec<bool>> {
        let mut signal = self.clone();
        let (mut t, mut taken) = (Time::ZERO, Vec::new());
        for _ in 0..=changes {
            taken.push((0..self.links).map(|link| signal.is_up(link, t)).collect());
            match signal.next_change_after(t) {
                Some(next) => t = next,
                None => break,
            }
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Switching, UpInterval};
    use crate::random::Stream;
    use crate::time::{Span, Time};

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn sets(signal: &Switching) -> Vec<String> {
        let possible = signal.possible(100);
        assert!(possible.complete);
        let word = |state: &Vec<bool>| state.iter().map(|up| if *up { '1' } else { '0' }).collect();
        let mut words: Vec<String> = possible.states.iter().map(word).collect();
        words.sort();
        words
    }

    #[test]
    fn each_kind_can_do_what_its_kind_can_do() {
        assert_eq!(sets(&Switching::always(2)), ["11"]);
        assert_eq!(sets(&Switching::periodic(2, s(10.0), s(7.5), s(2.5))), ["00", "11"]);
        assert_eq!(sets(&Switching::periodic(2, s(10.0), s(0.0), s(10.0))), ["11"]);
        assert_eq!(sets(&Switching::random(2, 0.5, s(1.0), s(0.1), Stream::new(1, "p"))), ["00", "11"]);
        assert_eq!(sets(&Switching::one_at_a_time(3, vec![vec![0, 1], vec![2]], s(1.0))), ["001", "110"]);
        let walks = vec![(vec![0, 1], Stream::new(1, "a")), (vec![2], Stream::new(1, "b"))];
        assert_eq!(sets(&Switching::markov(4, walks, s(1.0), s(1.0))), ["0000", "0010", "1100", "1110"]);
        let at = Time::from_secs;
        let up = |from, to, link| UpInterval { from: at(from), to: at(to), links: Some(vec![link]) };
        let intervals = vec![up(0.0, 2.0, 0), up(1.0, 3.0, 1)];
        assert_eq!(sets(&Switching::intervals(2, intervals, Some(s(5.0)))), ["00", "01", "10", "11"]);
        let arcs = [(0, 1), (1, 0), (1, 2), (2, 1)];
        let groups = vec![vec![0, 1], vec![2, 3]];
        let in_mean = Switching::in_mean(3, &arcs, groups, s(10.0), s(0.5), Stream::new(1, "m")).expect("fits");
        assert_eq!(sets(&in_mean), ["0000", "0011", "1100"]);
    }

    #[test]
    fn joined_signals_combine_and_too_many_are_cut_off() {
        let half = Switching::periodic(2, s(2.0), s(0.0), s(1.0));
        let joined = Switching::one_at_a_time(2, vec![vec![0], vec![1]], s(3.0)).and(half, Some(&[0]));
        assert_eq!(sets(&joined), ["00", "01", "10"]);
        let walks = (0..10).map(|link| (vec![link], Stream::new(1, "w"))).collect();
        let many = Switching::markov(10, walks, s(1.0), s(1.0)).possible(100);
        assert_eq!((many.states.len(), many.complete), (100, false));
        assert!(many.states[0].iter().all(|up| *up), "all up is never cut off");
        let walks = (0..70).map(|link| (vec![link], Stream::new(1, "w"))).collect();
        let very_many = Switching::markov(70, walks, s(1.0), s(1.0)).possible(5);
        assert_eq!((very_many.states.len(), very_many.complete), (5, false));
        assert!(very_many.states[0].iter().all(|up| *up), "not of more walks than are told apart either");
    }

    #[test]
    fn joined_signals_are_all_there_only_if_no_part_was_cut_off() {
        let walks = |links: std::ops::Range<usize>| {
            let walks = links.map(|link| (vec![link], Stream::new(1, "w"))).collect();
            Switching::markov(8, walks, s(1.0), s(1.0))
        };
        let always = || Switching::always(8);
        let complete = |signal: Switching| signal.possible(100).complete;
        // Up to 16 of one and 16 of the other are listed, of both together there are 256.
        assert!(complete(always().and(walks(0..4), Some(&[0, 1, 2, 3]))));
        let both = || always().and(walks(0..4), Some(&[0, 1, 2, 3])).and(walks(4..8), Some(&[4, 5, 6, 7]));
        assert!(!complete(both()) && !complete(both().and(always(), None)));
        assert!(!complete(walks(0..8).and(always(), None)) && !complete(always().and(walks(0..8), None)));
        // What was cut off of a part may be missing though no combination was.
        assert!(!complete(walks(0..8).and(Switching::periodic(8, s(2.0), s(0.0), s(0.0)), None)));
    }

    #[test]
    fn what_a_signal_does_is_among_what_it_can_do() {
        let walks = (0..3).map(|link| (vec![link], Stream::new(4, &link.to_string()))).collect();
        for signal in [
            Switching::markov(3, walks, s(1.0), s(2.0)),
            Switching::one_at_a_time(3, vec![vec![0], vec![1, 2]], s(1.0)),
            Switching::random(3, 0.4, s(2.0), s(0.2), Stream::new(7, "p")),
        ] {
            let (possible, mut signal, mut t) = (signal.possible(100), signal.clone(), Time::ZERO);
            for _ in 0..200 {
                let state: Vec<bool> = (0..3).map(|link| signal.is_up(link, t)).collect();
                assert!(possible.states.contains(&state), "{state:?}");
                t = signal.next_change_after(t).expect("it goes on");
            }
        }
    }
}
