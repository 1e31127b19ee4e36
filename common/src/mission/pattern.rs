//! The place of a vehicle in the formation over time (section 3.3.3).

use std::f64::consts::TAU;

use crate::time::Time;

/// h_i(t): a constant, and a sinusoid if the pattern moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pattern {
    /// Its mean \[units of ξ\].
    pub constant: f64,
    /// What moves about it.
    pub motion: Option<PatternMotion>,
}

/// amplitude · sin(2π t/period + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternMotion {
    /// Amplitude \[units of ξ\].
    pub amplitude: f64,
    /// Period \[s\], positive.
    pub period: f64,
    /// Phase at the mission's start \[rad\].
    pub phase: f64,
}

/// h_i and its derivatives at an instant, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatternPoint {
    /// h \[units of ξ\].
    pub h: f64,
    /// h' \[units of ξ per s\].
    pub h_dot: f64,
    /// h'' \[units of ξ per s²\].
    pub h_ddot: f64,
}

impl Pattern {
    /// A place that never changes.
    pub fn constant(h: f64) -> Pattern {
        Pattern { constant: h, motion: None }
    }

    /// The place at an instant.
    pub fn at(&self, t: Time) -> PatternPoint {
        let Some(PatternMotion { amplitude, period, phase }) = self.motion else {
            return PatternPoint { h: self.constant, ..PatternPoint::default() };
        };
        let omega = TAU / period;
        let (sin, cos) = (omega * t.secs() + phase).sin_cos();
        PatternPoint {
            h: self.constant + amplitude * sin,
            h_dot: amplitude * omega * cos,
            h_ddot: -amplitude * omega * omega * sin,
        }
    }

    /// Whether nothing has to be removed from ξ.
    pub fn is_zero(&self) -> bool {
        self.constant == 0.0 && self.motion.is_none()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_constant_is_the_number_itself() {
        let point = Pattern::constant(-0.25).at(Time::from_secs(1e6));
        assert_eq!(point, PatternPoint { h: -0.25, h_dot: 0.0, h_ddot: 0.0 });
        assert!(Pattern::default().is_zero() && !Pattern::constant(0.1).is_zero());
    }

    proptest! {
        #[test]
        fn the_derivatives_are_those_of_h(
            t in 1.0..1e4f64, amplitude in -2.0..2.0f64, period in 1.0..100.0f64, phase in -7.0..7.0f64,
        ) {
            let pattern = Pattern { constant: 0.5, motion: Some(PatternMotion { amplitude, period, phase }) };
            let at = |t: f64| pattern.at(Time::from_secs(t));
            let (before, now, after) = (at(t - 1e-3), at(t), at(t + 1e-3));
            let omega = TAU / period;
            let scale = 1e-6 * amplitude.abs() * (1.0 + omega.powi(3)) + 1e-8;
            prop_assert!(((after.h - before.h) / 2e-3 - now.h_dot).abs() < scale);
            prop_assert!(((after.h_dot - before.h_dot) / 2e-3 - now.h_ddot).abs() < scale * (1.0 + omega));
            prop_assert!((at(t + period).h - now.h).abs() < 1e-6 * (1.0 + amplitude.abs()));
        }
    }
}
