//! Whether the machine kept time: what a run on a real clock is worth.

use std::fmt::Write as _;

use serde::Serialize;

use super::ClockSummary;

/// Half of the deliveries are to be no later than this \[s\].
const MEDIAN_S: f64 = 50e-6;
/// 99 % of the deliveries are to be no later than this \[s\].
const P99_S: f64 = 1e-3;
/// Part of the control loops' deadlines that may be missed.
const MISSED_PART: f64 = 1e-3;

/// What to do about it.
const REMEDY: &str = "; a lower --speed-up or a quieter machine helps, and --stepped does not depend on the clock";

/// The judgement on a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClockVerdict {
    /// Whether deliveries and deadlines were as punctual as aimed at, and nothing was dropped for want of time.
    pub kept_time: bool,
    /// In words.
    pub text: String,
}

/// The judgement on these numbers; `None` if there are none.
pub(super) fn verdict(clock: &ClockSummary) -> Option<ClockVerdict> {
    let (met, missed) = clock.deadlines.iter().fold((0, 0), |(met, missed), d| (met + d.met, missed + d.missed));
    let dropped: u64 = clock.overruns.iter().map(|overrun| overrun.count).sum();
    if clock.deliveries.is_none() && met + missed == 0 && dropped == 0 {
        return None;
    }
    let mut kept_time = true;
    let mut parts = Vec::new();
    if let Some(deliveries) = &clock.deliveries {
        for (name, late, most) in [("p50", deliveries.late_s.median, MEDIAN_S), ("p99", deliveries.late_s.p99, P99_S)] {
            let within = late <= most;
            kept_time &= within;
            let of = if parts.is_empty() { "lateness of deliveries " } else { "" };
            let mut part = format!("{of}{name} {}", duration(late));
            if !within {
                let _ = write!(part, " > {}", duration(most));
            }
            parts.push(part);
        }
        // Nothing may be handed over before its time, by however little.
        let never_early = deliveries.early == 0 && deliveries.least_late_s >= 0.0;
        kept_time &= never_early;
        parts.push(if never_early {
            "never early".to_owned()
        } else {
            format!("{} early, by up to {}", deliveries.early, duration(-deliveries.least_late_s))
        });
    }
    if met + missed > 0 {
        let within = missed as f64 <= MISSED_PART * (met + missed) as f64;
        kept_time &= within;
        let beyond = if within { String::new() } else { format!(" > {} %", MISSED_PART * 100.0) };
        parts.push(format!("{missed} of {} deadlines missed{beyond}", met + missed));
    }
    if dropped > 0 {
        kept_time = false;
        parts.push(format!("{dropped} messages dropped for want of time"));
    }
    let judgement = if kept_time { "the machine kept time" } else { "disturbed by the machine" };
    let remedy = if kept_time { "" } else { REMEDY };
    Some(ClockVerdict { kept_time, text: format!("{judgement}: {}{remedy}", parts.join(", ")) })
}

fn duration(seconds: f64) -> String {
    if seconds.abs() < 1e-3 { format!("{:.0} µs", seconds * 1e6) } else { format!("{:.2} ms", seconds * 1e3) }
}

#[cfg(test)]
mod tests {
    use super::super::{DeadlineSummary, DeliverySummary, OverrunSummary, Spread};
    use super::*;
    use common::record::Overrun;

    fn clock(median: f64, p99: f64, missed: u64) -> ClockSummary {
        let spread = |median, p99| Spread { median, p99, max: 1.0 };
        let (commanded_s, late_s) = (spread(5.0, 5.0), spread(median, p99));
        let deliveries = DeliverySummary { count: 9, early: 0, commanded_s, late_s, least_late_s: 0.0 };
        let deadlines = DeadlineSummary { vehicle: "a".into(), met: 1000 - missed, missed, worst_late_s: 0.0 };
        ClockSummary { deliveries: Some(deliveries), deadlines: vec![deadlines], ..ClockSummary::default() }
    }

    fn text(clock: &ClockSummary) -> (bool, String) {
        verdict(clock).map(|verdict| (verdict.kept_time, verdict.text)).expect("there are numbers")
    }

    #[test]
    fn each_aim_that_is_missed_is_named() {
        assert_eq!(
            text(&clock(24e-6, 0.2e-3, 1)),
            (true, "the machine kept time: lateness of deliveries p50 24 µs, p99 200 µs, never early, 1 of 1000 deadlines missed".into())
        );
        for (clock, fault) in [
            (clock(0.84e-3, 0.9e-3, 0), "p50 840 µs > 50 µs"),
            (clock(24e-6, 3.2e-3, 0), "p99 3.20 ms > 1.00 ms"),
            (clock(24e-6, 0.9e-3, 2), "2 of 1000 deadlines missed > 0.1 %"),
        ] {
            let (kept, said) = text(&clock);
            assert!(!kept && said.starts_with("disturbed") && said.contains(fault), "{said}");
            assert!(said.contains("lateness of deliveries p50") && said.ends_with(REMEDY), "{said}");
        }
    }

    #[test]
    fn one_delivery_before_its_time_is_one_too_many() {
        let mut clock = clock(24e-6, 0.2e-3, 0);
        assert!(text(&clock).1.contains("never early"));
        let deliveries = clock.deliveries.as_mut().expect("given above");
        (deliveries.early, deliveries.least_late_s) = (2, -3e-6);
        let (kept, said) = text(&clock);
        assert!(!kept && said.contains("2 early, by up to 3 µs") && !said.contains("never"), "{said}");
    }

    #[test]
    fn what_was_dropped_for_want_of_time_disturbs_and_without_a_clock_there_is_no_verdict() {
        let mut clock = clock(24e-6, 0.2e-3, 0);
        let (vehicle, place) = ("a".into(), Overrun::ToReceiver);
        clock.overruns.push(OverrunSummary { vehicle, place, count: 7 });
        let (kept, said) = text(&clock);
        assert!(!kept && said.contains("7 messages dropped"), "{said}");
        assert_eq!(verdict(&ClockSummary::default()), None);
    }
}
