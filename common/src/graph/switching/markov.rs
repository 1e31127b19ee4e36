//! Links that come and go at random, without memory: up and down for exponential times.

use super::instant;
use crate::random::Stream;
use crate::time::{Span, Time};

/// Shortest time in a state \[ns\]; bounds the work per second of signal.
const SHORTEST: i128 = 1_000_000;

/// Groups of links; each group is a walk of its own.
#[derive(Clone, Debug)]
pub(super) struct Markov {
    walks: Vec<Walk>,
    walk_of_link: Vec<Option<usize>>,
}

#[derive(Clone, Debug)]
struct Walk {
    stream: Stream,
    /// Mean time down and up \[ns\].
    means: [f64; 2],
    up: bool,
    until: i128,
}

impl Markov {
    /// One walk per group, with a stream of its own. Means below a millisecond are taken as that.
    pub(super) fn new(links: usize, groups: Vec<(Vec<usize>, Stream)>, mean_up: Span, mean_down: Span) -> Markov {
        let mut walk_of_link = vec![None; links];
        let mut walks = Vec::with_capacity(groups.len());
        let means = [mean_down, mean_up].map(|mean| (mean.nanos() as f64).max(SHORTEST as f64));
        for (index, (group, stream)) in groups.into_iter().enumerate() {
            for link in group.into_iter().filter(|link| *link < links) {
                walk_of_link[link] = Some(index);
            }
            let mut walk = Walk { stream, means, up: false, until: 0 };
            // Begins as if it had gone on for ever: up with its share of the time, and what is left has no memory.
            walk.up = !walk.stream.chance(means[1] / (means[0] + means[1]));
            walk.turn();
            walks.push(walk);
        }
        Markov { walks, walk_of_link }
    }

    /// Which walk each link follows; none, if it is never up.
    pub(super) fn walk_of_link(&self) -> &[Option<usize>] {
        &self.walk_of_link
    }

    pub(super) fn is_up(&mut self, link: usize, t: Time) -> bool {
        self.walk_of_link[link].is_some_and(|walk| {
            let walk = &mut self.walks[walk];
            walk.advance(t);
            walk.up
        })
    }

    pub(super) fn next_change_after(&mut self, t: Time) -> Option<Time> {
        let next = |walk: &mut Walk| {
            walk.advance(t);
            walk.until
        };
        self.walks.iter_mut().map(next).min().and_then(instant)
    }
}

impl Walk {
    fn advance(&mut self, t: Time) {
        while self.until <= i128::from(t.nanos()) {
            self.turn();
        }
    }

    /// Changes state at `until` and draws how long the new state lasts: the shortest time, and exponential beyond it.
    fn turn(&mut self) {
        self.up = !self.up;
        let beyond = self.means[usize::from(self.up)] - SHORTEST as f64;
        self.until += SHORTEST + (-beyond * (1.0 - self.stream.unit()).ln()) as i128;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How long one link was up and down, by turns \[s\].
    fn durations(mean_up: f64, mean_down: f64, end: f64) -> [Vec<f64>; 2] {
        let groups = vec![(vec![0], Stream::new(3, "walk"))];
        let mut markov = Markov::new(1, groups, Span::from_secs(mean_up), Span::from_secs(mean_down));
        let (mut t, mut durations) = (Time::ZERO, [Vec::new(), Vec::new()]);
        while t < Time::from_secs(end) {
            let up = markov.is_up(0, t);
            let next = markov.next_change_after(t).expect("it goes on for ever");
            durations[usize::from(up)].push((next - t).secs());
            t = next;
        }
        durations
    }

    #[test]
    fn times_up_and_down_are_exponential_with_their_means() {
        let [down, up] = durations(4.0, 1.5, 100_000.0);
        for (times, mean) in [(down, 1.5), (up, 4.0)] {
            let n = times.len() as f64;
            let found = times.iter().sum::<f64>() / n;
            // Exponential: the standard deviation is the mean.
            assert!((found - mean).abs() < 5.0 * mean / n.sqrt(), "{found} for {mean}");
            let beyond = times.iter().filter(|time| **time > 2.0 * mean).count() as f64 / n;
            let share = (-2.0_f64).exp();
            assert!(
                (beyond - share).abs() < 5.0 * (share * (1.0 - share) / n).sqrt() + 1e-3,
                "{beyond} beyond two means"
            );
        }
    }

    #[test]
    fn it_begins_as_if_it_had_gone_on_for_ever() {
        let (n, share) = (4000, 4.0 / 5.5);
        let groups = (0..n).map(|link| (vec![link], Stream::new(3, &link.to_string()))).collect();
        let mut markov = Markov::new(n, groups, Span::from_secs(4.0), Span::from_secs(1.5));
        let up = (0..n).filter(|link| markov.is_up(*link, Time::ZERO)).count() as f64 / n as f64;
        assert!((up - share).abs() < 5.0 * (share * (1.0 - share) / n as f64).sqrt(), "{up} for {share}");
    }

    #[test]
    fn the_shortest_time_is_part_of_the_mean_and_no_mean_is_shorter() {
        let [down, up] = durations(0.005, 0.003, 60.0);
        for (times, mean) in [(down, 0.005 - 0.002), (up, 0.005)] {
            let found = times.iter().sum::<f64>() / times.len() as f64;
            // What is beyond the shortest millisecond is exponential.
            assert!(
                (found - mean).abs() < 5.0 * (mean - 0.001) / (times.len() as f64).sqrt() + 1e-6,
                "{found} for {mean}"
            );
            assert!(times.iter().all(|time| *time >= 0.001 - 1e-9));
        }
        assert!(durations(0.0, 1e-4, 1.0).concat().iter().all(|time| (time - 0.001).abs() < 1e-6));
    }

    #[test]
    fn the_next_change_is_the_first_of_any_walk() {
        let groups = vec![(vec![0], Stream::new(3, "a")), (vec![1], Stream::new(3, "b"))];
        let mut markov = Markov::new(2, groups, Span::from_secs(1.0), Span::from_secs(1.0));
        let mut t = Time::ZERO;
        for _ in 0..200 {
            let state = |markov: &mut Markov, t| [markov.is_up(0, t), markov.is_up(1, t)];
            let next = markov.clone().next_change_after(t).expect("it goes on for ever");
            let before = state(&mut markov, t);
            assert_eq!(state(&mut markov, next - Span::from_nanos(1)), before);
            assert_ne!(state(&mut markov, next), before);
            t = next;
        }
    }

    #[test]
    fn groups_walk_on_their_own() {
        let groups = vec![(vec![0, 1], Stream::new(3, "a")), (vec![2], Stream::new(3, "b"))];
        let mut markov = Markov::new(4, groups, Span::from_secs(1.0), Span::from_secs(1.0));
        let n = 4000;
        let (mut together, mut apart) = (0, 0);
        for i in 0..n {
            let t = Time::from_secs(5.0 * f64::from(i));
            together += i32::from(markov.is_up(0, t) == markov.is_up(1, t));
            apart += i32::from(markov.is_up(0, t) == markov.is_up(2, t));
            assert!(!markov.is_up(3, t), "in no group");
        }
        assert_eq!(together, n);
        assert!((f64::from(apart) / f64::from(n) - 0.5).abs() < 5.0 * 0.5 / f64::from(n).sqrt(), "{apart} of {n}");
    }
}
