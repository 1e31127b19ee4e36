//! The stepped clock: the fleet advances in lock step, as far at a time as causality allows.
//!
//! Nothing that is said at `S` is heard before `S + d`, where `d` is the least delay of any link. So once everything said
//! up to `done` is known, every vehicle can run to the next instant of speaking plus `d` without waiting for the others.
//! With the 5 s delay of section 4.6 that is a hundred control periods in one exchange.

use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::vehicle::SpeedCommand;

/// Most control periods in one grant: bounds the memory of an exchange.
pub(crate) const WINDOW: i64 = 256;

/// What one vehicle is allowed to run, and what it hears meanwhile.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Heard(pub(crate) Vec<(Time, Vec<u8>)>);

/// The conductor's books.
#[derive(Debug)]
pub(crate) struct Lockstep {
    period: Span,
    message_period: Span,
    least_delay: Span,
    end: Time,
    /// Most control periods in one grant.
    window: i64,
    /// Everything up to here has run; one period before zero at the start.
    done: Time,
    /// Everything up to here may run.
    granted: Option<Time>,
    /// Which vehicles have not reached it.
    waiting: Vec<bool>,
    /// What each vehicle hears in the coming grant.
    pub(crate) heard: Vec<Heard>,
    /// What was said since the last grant.
    sent: Vec<(Time, usize, Vec<u8>)>,
    /// Speeds to pass on with the next grant.
    pub(crate) speeds: Vec<SpeedCommand>,
}

impl Lockstep {
    pub(crate) fn new(mission: &Mission, window: i64) -> Lockstep {
        let n = mission.vehicles.len();
        Lockstep {
            period: mission.control_period,
            message_period: mission.control_period * mission.message_ticks,
            least_delay: mission.least_delay(),
            end: mission.end,
            window: window.max(1),
            done: Time::ZERO - mission.control_period,
            granted: None,
            waiting: vec![false; n],
            heard: vec![Heard::default(); n],
            sent: Vec::new(),
            speeds: Vec::new(),
        }
    }

    /// Everything up to here has run.
    pub(crate) fn done(&self) -> Time {
        self.done
    }

    /// How far the fleet can run from here.
    pub(crate) fn horizon(&self) -> Time {
        let next_word = (self.done.nanos().div_euclid(self.message_period.nanos()) + 1) * self.message_period.nanos();
        let safe = (next_word + self.least_delay.nanos()).div_euclid(self.period.nanos()) * self.period.nanos();
        let window = self.done + self.period * self.window;
        Time::from_nanos(safe).min(window).min(self.end)
    }

    /// The first instant that has not been granted yet: from here on a command can take effect.
    pub(crate) fn next_free(&self) -> Time {
        self.granted.unwrap_or(self.done) + self.period
    }

    /// Every vehicle may run up to `until`.
    pub(crate) fn grant(&mut self, until: Time) {
        self.granted = Some(until);
        self.waiting.fill(true);
    }

    /// A vehicle has run up to `until`; true when it was the last one. A repeated or unasked answer changes nothing.
    pub(crate) fn reached(&mut self, vehicle: usize, until: Time, sent: Vec<(Time, Vec<u8>)>) -> bool {
        if self.granted != Some(until) || !self.waiting[vehicle] {
            return false;
        }
        self.waiting[vehicle] = false;
        self.sent.extend(sent.into_iter().map(|(at, bytes)| (at, vehicle, bytes)));
        if self.waiting.contains(&true) {
            return false;
        }
        self.done = until;
        self.granted = None;
        true
    }

    /// What was said since the last grant: by instant, then by vehicle, then in the order in which it was said.
    pub(crate) fn take_sent(&mut self) -> Vec<(Time, usize, Vec<u8>)> {
        let mut sent = std::mem::take(&mut self.sent);
        sent.sort_by_key(|(at, vehicle, _)| (*at, *vehicle));
        sent
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn lockstep(period_ms: i64, message_ticks: i64, delay_ms: i64, window: i64) -> Lockstep {
        let ms = |n: i64| Span::from_nanos(n * 1_000_000);
        Lockstep {
            period: ms(period_ms),
            message_period: ms(period_ms * message_ticks),
            least_delay: ms(delay_ms),
            end: Time::from_secs(1e6),
            window,
            done: Time::ZERO - ms(period_ms),
            granted: None,
            waiting: vec![false; 2],
            heard: vec![Heard::default(); 2],
            sent: Vec::new(),
            speeds: Vec::new(),
        }
    }

    proptest! {
        /// Nothing that is still unsaid can be heard within the horizon, and the horizon always moves on.
        #[test]
        fn the_horizon_is_safe_and_moves(
            period in 1i64..200, ticks in 1i64..50, delay in 0i64..20_000, window in 1i64..500, done in -1i64..10_000,
        ) {
            let mut lockstep = lockstep(period, ticks, delay, window);
            lockstep.done = Time::ZERO + lockstep.period * done;
            let horizon = lockstep.horizon();
            prop_assert!(horizon > lockstep.done);
            prop_assert_eq!(horizon.nanos() % lockstep.period.nanos(), 0);
            // The next word is said at the first multiple of the message period after `done`. It arrives no earlier than
            // `delay` later, and is heard by control periods strictly after that.
            let next_word = (done.div_euclid(ticks) + 1) * ticks;
            let earliest_hearing = Time::ZERO + lockstep.period * next_word + lockstep.least_delay;
            prop_assert!(horizon <= earliest_hearing);
        }
    }

    #[test]
    fn five_seconds_of_delay_are_a_hundred_periods_in_one_grant() {
        let lockstep = lockstep(50, 2, 5_000, 256);
        assert_eq!(lockstep.horizon(), Time::from_secs(5.0));
    }

    #[test]
    fn the_last_answer_ends_the_grant_and_repeated_or_unasked_ones_change_nothing() {
        let mut lockstep = lockstep(50, 2, 0, 256);
        let until = lockstep.horizon();
        assert!(!lockstep.reached(0, until, vec![]), "nothing was granted");
        lockstep.grant(until);
        assert!(!lockstep.reached(0, until, vec![(until, vec![1])]));
        assert!(!lockstep.reached(0, until, vec![(until, vec![9])]), "said twice");
        assert!(!lockstep.reached(1, until + Span::from_nanos(1), vec![]), "of another grant");
        assert!(lockstep.reached(1, until, vec![(until, vec![2])]));
        assert_eq!(lockstep.take_sent(), vec![(until, 0, vec![1]), (until, 1, vec![2])]);
        assert_eq!(lockstep.done(), until);
    }
}
