//! All links together, up for a part of every period.

use super::instant;
use crate::time::{Span, Time};

/// Up on \[up_from, up_from + up_for) modulo a positive period \[ns\].
#[derive(Clone, Debug)]
pub(super) struct Periodic {
    period: i128,
    up_from: i128,
    up_for: i128,
}

impl Periodic {
    /// `None` if the period is not positive.
    pub(super) fn new(period: Span, up_from: Span, up_for: Span) -> Option<Periodic> {
        let [period, up_from, up_for] = [period, up_from, up_for].map(|span| i128::from(span.nanos()));
        (period > 0).then(|| Periodic { period, up_from, up_for: up_for.clamp(0, period) })
    }

    pub(super) fn is_up(&self, t: Time) -> bool {
        self.since_up(t) < self.up_for
    }

    pub(super) fn next_change_after(&self, t: Time) -> Option<Time> {
        if self.up_for == 0 || self.up_for == self.period {
            return None;
        }
        let since_up = self.since_up(t);
        let change = if since_up < self.up_for { self.up_for } else { self.period };
        instant(i128::from(t.nanos()) + change - since_up)
    }

    /// Time since the links last came up \[ns\], in \[0, period).
    fn since_up(&self, t: Time) -> i128 {
        (i128::from(t.nanos()) - self.up_from).rem_euclid(self.period)
    }
}
