//! The wall clock.
//!
//! All processes of a fleet share one start instant in UNIX time. Each reads the system's clock once, when its
//! [`RealClock`] is made, and then only the monotonic clock: a step of the system's clock in mid-mission moves nobody.

use std::num::NonZeroU64;
use std::time::{Duration, Instant, SystemTime};

use common::time::Time;

/// Mission time on the wall clock, optionally faster.
#[derive(Clone, Copy, Debug)]
pub struct RealClock {
    anchor: Instant,
    /// Wall nanoseconds from the mission's start to the anchor; negative if the mission starts later.
    wall_at_anchor: i128,
    /// Mission nanoseconds per wall nanosecond.
    speed_up: f64,
}

impl RealClock {
    /// Mission time zero is at `start`, and mission time passes `speed_up` times as fast as the wall's (1 is real time).
    ///
    /// A speed-up that is not a positive finite number is taken as 1: mission files are checked before they get here.
    pub fn new(start: SystemTime, speed_up: f64) -> RealClock {
        let (anchor, system) = simultaneous_readings();
        let wall_at_anchor = match system.duration_since(start) {
            Ok(past) => past.as_nanos() as i128,
            Err(future) => -(future.duration().as_nanos() as i128),
        };
        let speed_up = if speed_up.is_finite() && speed_up > 0.0 { speed_up } else { 1.0 };
        RealClock { anchor, wall_at_anchor, speed_up }
    }

    /// Mission time at this moment.
    pub fn now(&self) -> Time {
        self.time_at(Instant::now())
    }

    /// Mission time at a moment of this process, such as a packet's arrival.
    pub fn time_at(&self, instant: Instant) -> Time {
        let wall = self.wall_at_anchor
            + match instant.checked_duration_since(self.anchor) {
                Some(after) => after.as_nanos() as i128,
                None => -(self.anchor.duration_since(instant).as_nanos() as i128),
            };
        let mission = if self.speed_up == 1.0 { wall } else { (wall as f64 * self.speed_up).floor() as i128 };
        Time::from_nanos(mission.clamp(i64::MIN.into(), i64::MAX.into()) as i64)
    }

    /// The first moment at which [`time_at`](Self::time_at) is `time` or later; `None` for a time so far away that it
    /// means never. A moment from before the machine was switched on is given as the clock's making: long past.
    pub fn instant_of(&self, time: Time) -> Option<Instant> {
        let mission = time.nanos();
        let wall = match self.speed_up {
            1.0 => i128::from(mission),
            speed_up => (mission as f64 / speed_up).ceil() as i128,
        };
        let offset = wall - self.wall_at_anchor;
        let length = u64::try_from(offset.unsigned_abs()).ok().map(Duration::from_nanos);
        if offset < 0 {
            return Some(length.and_then(|length| self.anchor.checked_sub(length)).unwrap_or(self.anchor));
        }
        // One nanosecond more where floating point rounded to the early side: a wake-up may not find itself early.
        let mut instant = self.anchor.checked_add(length?).filter(|_| time != Time::MAX)?;
        while self.time_at(instant) < time {
            instant = instant.checked_add(rounding_step(mission))?;
        }
        Some(instant)
    }
}

/// The system's clock \[ns of the UNIX epoch\].
pub(crate) fn unix_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// How much later than `due` this moment is \[ns\]; negative if it is earlier.
pub fn late_ns(at: Instant, due: Instant) -> i64 {
    let nanos = |length: Duration| i64::try_from(length.as_nanos()).unwrap_or(i64::MAX);
    match at.checked_duration_since(due) {
        Some(late) => nanos(late),
        None => -nanos(due.saturating_duration_since(at)),
    }
}

/// The spacing of floating-point numbers near this many nanoseconds, at least one.
fn rounding_step(nanos: i64) -> Duration {
    Duration::from_nanos((nanos.unsigned_abs() >> 52).max(1))
}

/// The monotonic and the system's clock at one moment: the tightest of a few tries.
fn simultaneous_readings() -> (Instant, SystemTime) {
    let reading = || {
        let before = Instant::now();
        let system = SystemTime::now();
        let width = before.elapsed();
        (width, before + width / 2, system)
    };
    let first = reading();
    let (_, instant, system) =
        (0..7).map(|_| reading()).fold(first, |best, next| if next.0 < best.0 { next } else { best });
    (instant, system)
}

/// Lets the calling thread be woken to the nanosecond it asked for; the system otherwise groups wake-ups by 50 µs.
///
/// A refusal costs those 50 µs and nothing else, so it is only logged.
pub fn sharpen_this_thread() {
    if let Err(error) = rustix::thread::set_current_timer_slack(NonZeroU64::new(1)) {
        tracing::debug!("the timer slack stays as it is: {error}");
    }
}

/// Lets something happen, but not more often than once in a period of wall clock.
#[derive(Clone, Copy, Debug)]
pub struct AtMostEvery {
    period: Duration,
    last: Option<Instant>,
}

impl AtMostEvery {
    /// Nothing has happened yet.
    pub fn new(period: Duration) -> AtMostEvery {
        AtMostEvery { period, last: None }
    }

    /// Whether it is time again.
    pub fn is_due(&self) -> bool {
        self.last.is_none_or(|last| last.elapsed() >= self.period)
    }

    /// It happens now.
    pub fn happened(&mut self) {
        self.last = Some(Instant::now());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn mission_time_starts_at_the_shared_start_and_runs_at_its_speed() {
        let start = SystemTime::now() - Duration::from_secs(100);
        let real = RealClock::new(start, 1.0);
        let fast = RealClock::new(start, 10.0);
        let seconds = (real.now().secs(), fast.now().secs());
        assert!((100.0..160.0).contains(&seconds.0), "{seconds:?}");
        assert!((1000.0..1600.0).contains(&seconds.1), "{seconds:?}");
        let later = RealClock::new(SystemTime::now() + Duration::from_secs(100), 1.0);
        assert!(later.now() < Time::ZERO);
    }

    #[test]
    fn two_processes_agree_on_mission_time() {
        let start = SystemTime::now();
        let (one, other) = (RealClock::new(start, 4.0), RealClock::new(start, 4.0));
        let instant = Instant::now();
        let apart = (one.time_at(instant) - other.time_at(instant)).nanos().abs();
        assert!(apart < 40_000_000, "{apart} ns of mission time");
    }

    #[test]
    fn never_is_never_and_long_ago_is_past() {
        for speed_up in [1.0, 0.001, 1000.0] {
            let clock = RealClock::new(SystemTime::now(), speed_up);
            assert_eq!(clock.instant_of(Time::MAX), None);
            let past = clock.instant_of(Time::from_nanos(i64::MIN + 1)).expect("the past has an instant");
            assert!(past <= Instant::now());
        }
    }

    #[test]
    fn lateness_is_negative_before_and_positive_after() {
        let (due, a_little) = (Instant::now(), Duration::from_nanos(7));
        assert_eq!([due + a_little, due, due - a_little].map(|at| late_ns(at, due)), [7, 0, -7]);
    }

    proptest! {
        #[test]
        fn the_instant_of_a_time_is_not_before_it_and_hardly_after(
            nanos in -1_000_000_000_000i64..1_000_000_000_000_000, speed_up in prop_oneof![Just(1.0), 0.01f64..1000.0]
        ) {
            // The clock is anchored early enough for every time above to have an instant.
            let clock = RealClock::new(SystemTime::now() + Duration::from_secs(200_000), speed_up);
            let time = Time::from_nanos(nanos);
            let instant = clock.instant_of(time).expect("within reach");
            let back = clock.time_at(instant);
            prop_assert!(back >= time);
            // One wall nanosecond is speed_up mission nanoseconds.
            prop_assert!((back - time).nanos() as f64 <= 2.0 * speed_up + 2.0, "{} ns", (back - time).nanos());
        }
    }
}
