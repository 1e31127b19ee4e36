//! Switching signals p(t) of section 4.2.1: which directed links work when.
//!
//! A signal is a function of time; asking it in order lets the random one forget what is past. All arithmetic is on
//! integer nanoseconds, so that two programs with the same mission agree on every instant.

mod in_mean;
mod markov;
mod periodic;
mod possible;
mod random;
mod round_robin;
mod schedule;

use crate::random::Stream;
use crate::time::{Span, Time};
use in_mean::InMean;
use markov::Markov;
use periodic::Periodic;
pub use possible::Possible;
use random::RandomLosses;
use round_robin::RoundRobin;
use schedule::Schedule;
pub use schedule::UpInterval;

/// A switching signal over a number of directed links, numbered from zero.
///
/// Arguments are expected to have been checked. Silly ones are met mildly: a period, dwell or repetition that is not
/// positive gives a network that is always up, and links that do not exist are never up.
#[derive(Clone, Debug)]
pub struct Switching {
    links: usize,
    signal: Signal,
}

#[derive(Clone, Debug)]
enum Signal {
    Always,
    Periodic(Periodic),
    Schedule(Schedule),
    Random(Box<RandomLosses>),
    RoundRobin(RoundRobin),
    Markov(Markov),
    InMean(Box<InMean>),
    All(Vec<Part>),
}

/// A signal that counts for these links only; for all of them if there is no list.
#[derive(Clone, Debug)]
struct Part {
    signal: Switching,
    counts: Option<Vec<bool>>,
}

impl Switching {
    /// Every link is up forever.
    pub fn always(links: usize) -> Switching {
        Switching { links, signal: Signal::Always }
    }

    /// All links together, up on \[up_from, up_from + up_for) modulo `period`, which may wrap around.
    pub fn periodic(links: usize, period: Span, up_from: Span, up_for: Span) -> Switching {
        Switching { links, signal: Periodic::new(period, up_from, up_for).map_or(Signal::Always, Signal::Periodic) }
    }

    /// A link is up while any interval that covers it is running; with `repeat` the intervals recur, modulo it.
    pub fn intervals(links: usize, intervals: Vec<UpInterval>, repeat: Option<Span>) -> Switching {
        let signal = Schedule::new(links, &intervals, repeat).map_or(Signal::Always, Signal::Schedule);
        Switching { links, signal }
    }

    /// All links together, lost at random but never beyond brief connectivity losses (Definition 4.3) with loss rate
    /// `alpha` ∈ \[0, 1) and upper bound `t_0`; no change follows another sooner than `dwell`.
    ///
    /// Losses last up to `t_0` and the long-run loss rate is `alpha`, unless `dwell` is too long for that: a loss of
    /// `dwell` must fit in `t_0` (or there are none), and the recovery after a loss of `t_0`, (1/alpha − 1) `t_0`
    /// long, should not be shorter than `dwell` (or losses are rarer than `alpha`). A dwell below 1 ms is taken as
    /// 1 ms. A rate of one or more means never up.
    pub fn random(links: usize, alpha: f64, t_0: Span, dwell: Span, stream: Stream) -> Switching {
        if alpha >= 1.0 {
            return Switching { links: 0, signal: Signal::Always };
        }
        let losses = RandomLosses::new(alpha, t_0, dwell, stream);
        Switching { links, signal: losses.map_or(Signal::Always, |losses| Signal::Random(Box::new(losses))) }
    }

    /// Groups of links take turns of `dwell` each, in order, for ever; without groups nothing is ever up.
    pub fn one_at_a_time(links: usize, groups: Vec<Vec<usize>>, dwell: Span) -> Switching {
        Switching { links, signal: RoundRobin::new(groups, dwell).map_or(Signal::Always, Signal::RoundRobin) }
    }

    /// Groups of links, each with a stream of its own, are up and down for exponential times with these means.
    pub fn markov(links: usize, groups: Vec<(Vec<usize>, Stream)>, mean_up: Span, mean_down: Span) -> Switching {
        Switching { links, signal: Signal::Markov(Markov::new(links, groups, mean_up, mean_down)) }
    }

    /// One group of links at a time, at random, such that the union graph over every window of length `window` is
    /// connected (Definition 4.4); link l is the arc `arcs[l]` (receiver, sender) among `n` vehicles. No change follows
    /// another sooner than `dwell`.
    ///
    /// # Errors
    /// The shortest window that is possible with this dwell; `None` if the links can never connect the fleet.
    ///
    /// # Panics
    /// As [`super::Graph::from_arcs`].
    pub fn in_mean(
        n: usize,
        arcs: &[(usize, usize)],
        groups: Vec<Vec<usize>>,
        window: Span,
        dwell: Span,
        stream: Stream,
    ) -> Result<Switching, Option<Span>> {
        let in_mean = InMean::new(n, arcs, groups, window, dwell, stream)?;
        Ok(Switching { links: arcs.len(), signal: Signal::InMean(Box::new(in_mean)) })
    }

    /// This signal and another one: a link is up while both have it up. The other one counts for the links of the list
    /// only, if there is one.
    pub fn and(self, other: Switching, only: Option<&[usize]>) -> Switching {
        let links = self.links;
        let counts = only.map(|only| {
            let mut counts = vec![false; links];
            only.iter().filter(|link| **link < links).for_each(|link| counts[*link] = true);
            counts
        });
        let part = Part { signal: other, counts };
        let parts = match self.signal {
            Signal::All(mut parts) => {
                parts.push(part);
                parts
            }
            _ => vec![Part { signal: self, counts: None }, part],
        };
        Switching { links, signal: Signal::All(parts) }
    }

    /// Whether this link is up at `t`. Ask in nondecreasing time; a clone made at the start replays from zero.
    pub fn is_up(&mut self, link: usize, t: Time) -> bool {
        link < self.links
            && match &mut self.signal {
                Signal::Always => true,
                Signal::Periodic(periodic) => periodic.is_up(t),
                Signal::Schedule(schedule) => schedule.is_up(link, t),
                Signal::Random(losses) => losses.is_up(t),
                Signal::RoundRobin(turns) => turns.is_up(link, t),
                Signal::Markov(walks) => walks.is_up(link, t),
                Signal::InMean(turns) => turns.is_up(link, t),
                Signal::All(parts) => parts
                    .iter_mut()
                    .all(|part| part.counts.as_ref().is_some_and(|counts| !counts[link]) || part.signal.is_up(link, t)),
            }
    }

    /// The first instant strictly later than `t` at which some link changes; `None` if none ever does again. Of signals
    /// that are joined, the first change of any.
    /// Ask in nondecreasing time.
    pub fn next_change_after(&mut self, t: Time) -> Option<Time> {
        if self.links == 0 {
            return None;
        }
        match &mut self.signal {
            Signal::Always => None,
            Signal::Periodic(periodic) => periodic.next_change_after(t),
            Signal::Schedule(schedule) => schedule.next_change_after(t),
            Signal::Random(losses) => losses.next_change_after(t),
            Signal::RoundRobin(turns) => turns.next_change_after(t),
            Signal::Markov(walks) => walks.next_change_after(t),
            Signal::InMean(turns) => turns.next_change_after(t),
            Signal::All(parts) => parts.iter_mut().filter_map(|part| part.signal.next_change_after(t)).min(),
        }
    }
}

/// An instant from wide arithmetic; `None` beyond the end of time.
fn instant(nanos: i128) -> Option<Time> {
    i64::try_from(nanos).ok().map(Time::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::{Switching, UpInterval};
    use crate::random::Stream;
    use crate::time::{Span, Time};

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn at(seconds: f64) -> Time {
        Time::from_secs(seconds)
    }
    fn changes(signal: &Switching, end: f64) -> Vec<f64> {
        let mut signal = signal.clone();
        let mut t = Time::from_nanos(-1);
        std::iter::from_fn(|| {
            t = signal.next_change_after(t).filter(|&t| t < at(end))?;
            Some(t.secs())
        })
        .collect()
    }

    #[test]
    fn example_4_1_is_up_a_quarter_of_the_time() {
        let mut signal = Switching::periodic(6, s(10.0), s(7.5), s(2.5));
        let answers = [0.0, 7.4, 7.5, 9.999_999_999, 10.0, 17.5].map(|t| signal.is_up(5, at(t)));
        assert_eq!(answers, [false, false, true, true, false, true]);
        assert_eq!(changes(&signal, 30.0), [0.0, 7.5, 10.0, 17.5, 20.0, 27.5]);
        assert!(!signal.is_up(6, at(17.6)), "a link that does not exist");
    }

    #[test]
    fn a_window_may_wrap_around_the_period() {
        let mut signal = Switching::periodic(1, s(10.0), s(9.0), s(3.0));
        let answers = [0.0, 1.9, 2.0, 8.9, 9.0].map(|t| signal.is_up(0, at(t)));
        assert_eq!(answers, [true, true, false, false, true]);
        assert_eq!(changes(&signal, 20.0), [2.0, 9.0, 12.0, 19.0]);
    }

    #[test]
    fn intervals_overlap_and_name_links() {
        let interval = |from, to, links| UpInterval { from: at(from), to: at(to), links };
        let list = vec![
            interval(1.0, 3.0, None),
            interval(2.0, 5.0, Some(vec![0])),
            interval(5.0, 6.0, Some(vec![0, 9])),
            interval(8.0, 8.0, None),
            interval(9.0, 7.0, None),
        ];
        let mut signal = Switching::intervals(2, list, None);
        assert_eq!(changes(&signal, 1e6), [1.0, 3.0, 6.0]);
        assert_eq!(
            [0.5, 1.0, 3.0, 5.0, 6.0, 8.0].map(|t| signal.is_up(0, at(t))),
            [false, true, true, true, false, false]
        );
        assert_eq!([1.0, 2.9, 3.0].map(|t| signal.is_up(1, at(t))), [true, true, false]);
    }

    #[test]
    fn repeated_intervals_join_across_the_seam() {
        let interval = |from, to| UpInterval { from: at(from), to: at(to), links: None };
        let mut signal = Switching::intervals(1, vec![interval(8.0, 10.0), interval(0.0, 2.0)], Some(s(10.0)));
        assert_eq!(changes(&signal, 25.0), [2.0, 8.0, 12.0, 18.0, 22.0]);
        assert_eq!([0.0, 2.0, 9.9, 10.0, 12.0].map(|t| signal.is_up(0, at(t))), [true, false, true, true, false]);
        // The same, written as one interval that crosses the seam.
        assert_eq!(
            changes(&Switching::intervals(1, vec![interval(8.0, 12.0)], Some(s(10.0))), 25.0),
            [2.0, 8.0, 12.0, 18.0, 22.0]
        );
        let mut whole = Switching::intervals(1, vec![interval(3.0, 14.0)], Some(s(10.0)));
        assert!(whole.is_up(0, at(0.0)) && whole.next_change_after(at(0.0)).is_none());
    }

    #[test]
    fn links_take_turns() {
        let mut signal = Switching::one_at_a_time(4, vec![vec![0, 1], vec![2, 3]], s(10.0));
        assert_eq!([0.0, 9.9, 10.0, 20.0].map(|t| signal.is_up(1, at(t))), [true, true, false, true]);
        let mut signal = signal.clone();
        assert_eq!([0.0, 10.0, 19.9].map(|t| signal.is_up(2, at(t))), [false, true, true]);
        assert_eq!(signal.next_change_after(at(10.0)), Some(at(20.0)));
        let mut same = Switching::one_at_a_time(2, vec![vec![1, 0], vec![0, 1]], s(1.0));
        assert_eq!(same.next_change_after(Time::ZERO), None, "turns that do not differ change nothing");
    }

    #[test]
    fn joined_signals_are_up_while_all_are() {
        let interval = |from, to| UpInterval { from: at(from), to: at(to), links: None };
        let signal = Switching::periodic(2, s(10.0), s(0.0), s(5.0))
            .and(Switching::intervals(2, vec![interval(2.0, 13.0)], None), Some(&[1]))
            .and(Switching::intervals(2, vec![interval(0.0, 100.0)], None), None);
        let at_instants = |link| [0.0, 2.0, 4.9, 5.0, 12.0, 13.0].map(|t| signal.clone().is_up(link, at(t)));
        assert_eq!(at_instants(0), [true, true, true, false, true, true]);
        assert_eq!(at_instants(1), [false, true, true, false, true, false]);
        assert_eq!(changes(&signal, 16.0), [0.0, 2.0, 5.0, 10.0, 13.0, 15.0]);
    }

    #[test]
    fn silly_arguments_neither_panic_nor_hang() {
        let stream = || Stream::new(1, "silly");
        let zero = Span::ZERO;
        let always = [
            Switching::periodic(1, zero, s(1.0), s(1.0)),
            Switching::periodic(1, s(-3.0), s(1.0), s(1.0)),
            Switching::periodic(1, s(3.0), s(1.0), s(3.0)),
            Switching::intervals(1, vec![], Some(zero)),
            Switching::random(1, 0.0, s(1.0), s(0.1), stream()),
            Switching::random(1, f64::NAN, s(1.0), s(0.1), stream()),
            Switching::random(1, 0.5, zero, zero, stream()),
            Switching::random(1, 0.5, s(1.0), s(2.0), stream()),
            Switching::one_at_a_time(1, vec![vec![0]], zero),
            Switching::one_at_a_time(1, vec![vec![0]], s(1.0)),
        ];
        let never = [
            Switching::always(0),
            Switching::periodic(1, s(3.0), s(1.0), zero),
            Switching::intervals(1, vec![], None),
            Switching::intervals(1, vec![], Some(s(1.0))),
            Switching::random(1, 1.0, s(1.0), s(0.1), stream()),
            Switching::one_at_a_time(1, vec![], s(1.0)),
            Switching::one_at_a_time(1, vec![vec![], vec![7]], s(1.0)),
        ];
        for (signals, up) in [(&always[..], true), (&never[..], false)] {
            for signal in signals {
                let mut signal = signal.clone();
                let answers = [0.0, 0.5, 1.0, 1e5].map(|t| signal.is_up(0, at(t)));
                assert_eq!(answers, [up; 4], "{signal:?}");
            }
        }
        let mut wild = Switching::periodic(1, Span::from_nanos(i64::MAX), Span::from_nanos(i64::MIN), s(1.0));
        for t in [Time::from_nanos(i64::MIN), Time::ZERO, Time::MAX] {
            assert!(wild.next_change_after(t).is_none_or(|next| next > t));
        }
        let mut rapid = Switching::random(1, 0.5, s(0.002), zero, stream());
        let next = rapid.next_change_after(at(10.0)).expect("it goes on for ever");
        assert!(next > at(10.0) && next < at(10.1));
    }

    #[test]
    fn changes_are_exactly_where_the_answers_change() {
        let interval = |from, to, links| UpInterval { from: at(from), to: at(to), links };
        let signals = [
            Switching::periodic(3, s(0.7), s(0.6), s(0.2)),
            Switching::intervals(
                3,
                vec![interval(0.1, 0.3, None), interval(0.2, 1.4, Some(vec![2])), interval(0.9, 1.05, Some(vec![0]))],
                Some(s(1.0)),
            ),
            Switching::one_at_a_time(3, vec![vec![0], vec![0, 1], vec![2], vec![2]], s(0.25)),
            Switching::random(3, 0.4, s(0.5), s(0.05), Stream::new(3, "p")),
            Switching::in_mean(
                3,
                &[(0, 1), (1, 2), (2, 0)],
                vec![vec![0], vec![1], vec![2]],
                s(2.0),
                s(0.1),
                Stream::new(3, "p"),
            )
            .expect("possible"),
        ];
        for signal in signals {
            // On a grid of 10 ms: what the answers say, beside what was announced.
            let (mut probe, mut announcer) = (signal.clone(), signal.clone());
            let mut next = announcer.next_change_after(Time::ZERO);
            let mut before = [0, 1, 2].map(|link| probe.is_up(link, Time::ZERO));
            for step in 1..1000 {
                let t = at(f64::from(step) * 0.01);
                let now = [0, 1, 2].map(|link| probe.is_up(link, t));
                let mut announced = false;
                while next.is_some_and(|change| change <= t) {
                    announced = true;
                    next = announcer.next_change_after(next.unwrap_or(t));
                }
                assert_eq!(now != before, announced, "{signal:?} at {t}");
                before = now;
            }
        }
    }
}
