//! Clock, duration and formation speed.

use super::super::SpeedProfile;
use super::super::fault::{Collector, plain};
use super::super::file::{MissionFile, SpeedStep};
use super::{FASTEST_FORMATION, LONGEST};
use crate::time::{Span, Time};
use crate::wire::vehicle::SpeedCommand;

/// How time is cut into steps, in whole control periods.
pub(super) struct Times {
    pub(super) end: Time,
    pub(super) control_period: Span,
    pub(super) record_ticks: i64,
    pub(super) message_ticks: i64,
}

pub(super) fn check_times(faults: &mut Collector<'_>, file: &MissionFile) -> Option<Times> {
    let period = file.clock.control_period_s;
    let period_ok = period.is_finite() && (1e-4..=10.0).contains(&period);
    faults.number("clock.control_period_s", period, period_ok, "0.0001 to 10 s");
    let duration_ok = file.duration_s > 0.0 && file.duration_s <= LONGEST;
    faults.number("duration_s", file.duration_s, duration_ok, "above 0 and at most 30 days (2592000 s)");
    if !(1..=1000).contains(&file.clock.substeps) {
        faults.fault("clock.substeps", file.clock.substeps, "1 to 1000");
    }
    if let Some(validity) = file.coordination.validity_s {
        let key = "coordination.validity_s";
        let least = file.coordination.message_period_s;
        let allowed = format!("at least the message period, {least} s; leave it out for ever");
        faults.number(key, validity, validity >= least && validity <= LONGEST, &allowed);
    }
    if !period_ok {
        return None;
    }
    let control_period = Span::from_secs(period);
    let ticks_in = |span: f64| (Span::from_secs(span).nanos() as f64 / control_period.nanos() as f64).round() as i64;
    let mut multiple = |key: &str, span: f64| {
        let ticks = if span.is_finite() && span > 0.0 && span <= LONGEST { ticks_in(span) } else { 0 };
        let exact = ticks >= 1 && (control_period * ticks).nanos() == Span::from_secs(span).nanos();
        if !exact {
            faults.fault(key, format!("{} s", plain(span)), format!("a multiple of the control period, {period} s"));
        }
        ticks.max(1)
    };
    let record_ticks = multiple("clock.record_period_s", file.clock.record_period_s);
    let message_ticks = multiple("coordination.message_period_s", file.coordination.message_period_s);
    if !duration_ok {
        return None;
    }
    let end = Time::ZERO + control_period * ticks_in(file.duration_s).max(1);
    if ticks_in(file.duration_s) > i64::from(u32::MAX) {
        let allowed = format!("at most {} control periods", u32::MAX);
        faults.fault("duration_s", format!("{} s", file.duration_s), allowed);
    }
    Some(Times { end, control_period, record_ticks, message_ticks })
}

pub(super) fn check_formation(faults: &mut Collector<'_>, file: &MissionFile) -> Option<SpeedProfile> {
    match (&file.formation.speed, &file.formation.profile) {
        (Some(speed), None) => {
            faults.number(
                "formation.speed",
                *speed,
                speed.abs() <= FASTEST_FORMATION,
                "-1000000 to 1000000 units of xi per s",
            );
            Some(SpeedProfile::new(vec![SpeedCommand { at: Time::ZERO, speed: *speed }]))
        }
        (None, Some(steps)) => {
            let mut before = f64::NEG_INFINITY;
            for (i, step) in steps.iter().enumerate() {
                let key = format!("formation.profile[{i}]");
                let ok = step.speed.abs() <= FASTEST_FORMATION;
                faults.number(&format!("{key}.speed"), step.speed, ok, "-1000000 to 1000000 units of xi per s");
                let ok = if i == 0 { step.from_s == 0.0 } else { step.from_s > before && step.from_s <= LONGEST };
                let allowed = if i == 0 { "0 for the first step" } else { "later than the step before" };
                faults.number(&format!("{key}.from_s"), step.from_s, ok, allowed);
                before = step.from_s;
            }
            if steps.is_empty() {
                faults.fault("formation.profile", "no steps", "at least one step, the first from 0 s");
            }
            let command = |step: &SpeedStep| SpeedCommand { at: Time::from_secs(step.from_s), speed: step.speed };
            Some(SpeedProfile::new(steps.iter().map(command).collect()))
        }
        (Some(_), Some(_)) => {
            faults.fault("formation", "both speed and profile", "one of them");
            None
        }
        (None, None) => {
            faults.fault("formation", "neither speed nor profile", "one of them");
            None
        }
    }
}
