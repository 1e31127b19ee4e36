//! Mission time: integer nanoseconds since the mission's start.
//!
//! Floating-point seconds compared for equality lose messages, so every instant that is stored, sent or
//! compared is an integer. Seconds as `f64` appear only inside equations.

use std::fmt;
use std::ops::{Add, AddAssign, Mul, Sub};

use bincode::{Decode, Encode};
use serde::{Deserialize, Serialize};

/// An instant of mission time \[ns since the start\]; negative before the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Time(i64);

/// A length of mission time \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Span(i64);

const NANOS: f64 = 1e9;

impl Time {
    /// The start of the mission.
    pub const ZERO: Time = Time(0);
    /// Later than anything that happens.
    pub const MAX: Time = Time(i64::MAX);

    /// An instant from nanoseconds since the start.
    pub const fn from_nanos(nanos: i64) -> Time {
        Time(nanos)
    }
    /// An instant from seconds since the start, rounded to the nearest nanosecond.
    pub fn from_secs(seconds: f64) -> Time {
        Time((seconds * NANOS).round() as i64)
    }
    /// Nanoseconds since the start.
    pub const fn nanos(self) -> i64 {
        self.0
    }
    /// Seconds since the start.
    pub fn secs(self) -> f64 {
        self.0 as f64 / NANOS
    }
}

impl Span {
    /// No time at all.
    pub const ZERO: Span = Span(0);

    /// A span from nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Span {
        Span(nanos)
    }
    /// A span from seconds, rounded to the nearest nanosecond.
    pub fn from_secs(seconds: f64) -> Span {
        Span((seconds * NANOS).round() as i64)
    }
    /// Nanoseconds.
    pub const fn nanos(self) -> i64 {
        self.0
    }
    /// Seconds.
    pub fn secs(self) -> f64 {
        self.0 as f64 / NANOS
    }
}

impl Add<Span> for Time {
    type Output = Time;
    fn add(self, span: Span) -> Time {
        Time(self.0.saturating_add(span.0))
    }
}
impl AddAssign<Span> for Time {
    fn add_assign(&mut self, span: Span) {
        *self = *self + span;
    }
}
impl Sub<Span> for Time {
    type Output = Time;
    fn sub(self, span: Span) -> Time {
        Time(self.0.saturating_sub(span.0))
    }
}
impl Sub for Time {
    type Output = Span;
    fn sub(self, earlier: Time) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }
}
impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0.saturating_add(other.0))
    }
}
impl Mul<i64> for Span {
    type Output = Span;
    fn mul(self, times: i64) -> Span {
        Span(self.0.saturating_mul(times))
    }
}
impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.secs())
    }
}
impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.secs())
    }
}
