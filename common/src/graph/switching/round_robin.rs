//! Groups of links that take turns.

use super::instant;
use crate::time::{Span, Time};

/// Group k is up during turns k, k + q, k + 2q, … of q groups.
#[derive(Clone, Debug)]
pub(super) struct RoundRobin {
    groups: Vec<Vec<usize>>,
    dwell: i128,
}

impl RoundRobin {
    /// `None` if the dwell is not positive.
    pub(super) fn new(mut groups: Vec<Vec<usize>>, dwell: Span) -> Option<RoundRobin> {
        for group in &mut groups {
            group.sort_unstable();
            group.dedup();
        }
        let dwell = i128::from(dwell.nanos());
        (dwell > 0).then_some(RoundRobin { groups, dwell })
    }

    /// Whose turns they are.
    pub(super) fn groups(&self) -> &[Vec<usize>] {
        &self.groups
    }

    pub(super) fn is_up(&self, link: usize, t: Time) -> bool {
        self.group(self.turn(t)).is_some_and(|group| group.binary_search(&link).is_ok())
    }

    pub(super) fn next_change_after(&self, t: Time) -> Option<Time> {
        let now = self.turn(t);
        let different = (1..self.groups.len() as i128).find(|&later| self.group(now + later) != self.group(now))?;
        instant((now + different) * self.dwell)
    }

    fn turn(&self, t: Time) -> i128 {
        i128::from(t.nanos()).div_euclid(self.dwell)
    }

    fn group(&self, turn: i128) -> Option<&Vec<usize>> {
        self.groups.get(turn.checked_rem_euclid(self.groups.len() as i128)? as usize)
    }
}
