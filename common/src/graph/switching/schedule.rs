//! Links that follow a written schedule.

use super::instant;
use crate::time::{Span, Time};

/// A half-open interval \[from, to) during which links are up; empty if `to` is not later than `from`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UpInterval {
    /// When the links come up.
    pub from: Time,
    /// When they go down.
    pub to: Time,
    /// Which links; `None` for all of them.
    pub links: Option<Vec<usize>>,
}

/// Sorted disjoint intervals \[ns\] that do not touch.
type Calendar = Vec<(i64, i64)>;

/// The intervals of every link, and the instants at which any of them changes.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    /// The first calendar belongs to all links that no interval names; each named link has its own.
    calendars: Vec<Calendar>,
    calendar_of_link: Vec<usize>,
    changes: Vec<i64>,
    repeat: Option<i64>,
}

impl Schedule {
    /// `None` if it repeats with a period that is not positive.
    pub(super) fn new(links: usize, intervals: &[UpInterval], repeat: Option<Span>) -> Option<Schedule> {
        let repeat = repeat.map(Span::nanos);
        if repeat.is_some_and(|period| period <= 0) {
            return None;
        }
        let mut calendars = vec![calendar(intervals.iter().filter(|interval| interval.links.is_none()), repeat)];
        let mut calendar_of_link = vec![0; links];
        // The intervals of each named link, in one pass: a recorded run has many of them.
        let mut own: Vec<Vec<&UpInterval>> = vec![Vec::new(); links];
        for interval in intervals {
            for &link in interval.links.iter().flatten().filter(|link| **link < links) {
                own[link].push(interval);
            }
        }
        for (link, own) in own.into_iter().enumerate().filter(|(_, own)| !own.is_empty()) {
            let common = intervals.iter().filter(|interval| interval.links.is_none());
            calendar_of_link[link] = calendars.len();
            calendars.push(calendar(own.into_iter().chain(common), repeat));
        }
        let mut schedule = Schedule { calendars, calendar_of_link, changes: Vec::new(), repeat };
        schedule.changes = schedule.find_changes();
        Some(schedule)
    }

    /// Changes until it repeats, or until it never changes again.
    pub(super) fn changes_per_lap(&self) -> usize {
        self.changes.len()
    }

    pub(super) fn is_up(&self, link: usize, t: Time) -> bool {
        self.calendar_of_link.get(link).is_some_and(|&calendar| covers(&self.calendars[calendar], self.fold(t.nanos())))
    }

    pub(super) fn next_change_after(&self, t: Time) -> Option<Time> {
        let folded = self.fold(t.nanos());
        let start_of_lap = i128::from(t.nanos()) - i128::from(folded);
        let later_this_lap = self.changes.get(self.changes.partition_point(|&change| change <= folded));
        match (later_this_lap, self.repeat) {
            (Some(&change), _) => instant(start_of_lap + i128::from(change)),
            (None, Some(period)) => instant(start_of_lap + i128::from(period) + i128::from(*self.changes.first()?)),
            (None, None) => None,
        }
    }

    fn fold(&self, nanos: i64) -> i64 {
        self.repeat.map_or(nanos, |period| nanos.rem_euclid(period))
    }

    /// The ends of intervals that really change something: a repeated schedule may be up on both sides of its seam.
    fn find_changes(&self) -> Vec<i64> {
        let mut changes: Vec<i64> = Vec::new();
        for (index, calendar) in self.calendars.iter().enumerate() {
            if index == 0 && !self.calendar_of_link.contains(&0) {
                continue; // no link follows the common calendar
            }
            let is_change = |t: &i64| {
                let just_before = self.fold(t.saturating_sub(1));
                covers(calendar, *t) != covers(calendar, just_before)
            };
            changes.extend(calendar.iter().flat_map(|&(from, to)| [from, self.fold(to)]).filter(is_change));
        }
        changes.sort_unstable();
        changes.dedup();
        changes
    }
}

/// The union of intervals, folded into one period if there is one.
fn calendar<'a>(intervals: impl Iterator<Item = &'a UpInterval>, repeat: Option<i64>) -> Calendar {
    let mut pieces = Calendar::new();
    for interval in intervals {
        let (from, to) = (interval.from.nanos(), interval.to.nanos());
        if to <= from {
            continue;
        }
        match repeat {
            None => pieces.push((from, to)),
            Some(period) if to.saturating_sub(from) >= period => pieces.push((0, period)),
            Some(period) => {
                let start = from.rem_euclid(period);
                let beyond_seam = (to - from) - (period - start);
                pieces.push((start, period + beyond_seam.min(0)));
                if beyond_seam > 0 {
                    pieces.push((0, beyond_seam));
                }
            }
        }
    }
    pieces.sort_unstable();
    let mut merged = Calendar::new();
    for (from, to) in pieces {
        match merged.last_mut() {
            Some(last) if from <= last.1 => last.1 = last.1.max(to),
            _ => merged.push((from, to)),
        }
    }
    merged
}

fn covers(calendar: &Calendar, nanos: i64) -> bool {
    let candidate = calendar.partition_point(|&(from, _)| from <= nanos);
    candidate > 0 && nanos < calendar[candidate - 1].1
}
