//! The stepped clock: the fleet advances in lock step, as far at a time as causality allows.
//!
//! Nothing that is said at `S` is heard before `S + d`, where `d` is the least delay of any link. So once everything said
//! up to `done` is known, every vehicle can run to the next instant of speaking plus `d` without waiting for the others.
//! With the 5 s delay of section 4.6 that is a hundred control periods in one exchange.

use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::vehicle::SpeedCommand;

/// Most control periods in one grant: bounds the memory of an exchange.
const WINDOW_TICKS: i64 = 256;

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
    pub(crate) fn new(mission: &Mission) -> Lockstep {
        let n = mission.vehicles.len();
        Lockstep {
            period: mission.control_period,
            message_period: mission.control_period * mission.message_ticks,
            least_delay: mission.least_delay(),
            end: mission.end,
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
        let window = self.done + self.period * WINDOW_TICKS;
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
