//! The numbers of a run that depend on the wall clock and the machine: `clock.json`.

use std::collections::BTreeMap;

use bus::recording::Recording;
use common::record::{ClockRecord, Overrun};
use serde::Serialize;

use super::deliveries::{DeliverySummary, LinkDeliveries, deliveries};
use super::punctuality::{ClockVerdict, verdict};

/// Everything that depends on the wall clock and the machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClockSummary {
    /// Version of this layout.
    pub format: u32,
    /// Lateness of the deliveries: achieved minus commanded delay.
    pub deliveries: Option<DeliverySummary>,
    /// The same by directed link, for those that delivered something.
    pub links: Vec<LinkDeliveries>,
    /// Deadlines of the control loops.
    pub deadlines: Vec<DeadlineSummary>,
    /// Messages that no model of the network dropped, but a program or session that did not keep up.
    pub overruns: Vec<OverrunSummary>,
    /// Whether the machine kept time; `None` without a real clock.
    pub verdict: Option<ClockVerdict>,
    /// What the programs had to say.
    pub notes: Vec<NoteSummary>,
}

/// Messages dropped for want of time or room.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverrunSummary {
    /// Whose messages, or on the way to whom.
    pub vehicle: String,
    /// Where.
    pub place: Overrun,
    /// How many; the oldest.
    pub count: u64,
}

/// Deadlines of one vehicle's control loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeadlineSummary {
    /// The vehicle.
    pub vehicle: String,
    /// Deadlines met.
    pub met: u64,
    /// Deadlines missed.
    pub missed: u64,
    /// Largest lateness of one that was met \[s\].
    pub worst_late_s: f64,
}

/// A line for people.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NoteSummary {
    /// When, in mission time \[s\].
    pub t_s: f64,
    /// Who says it.
    pub source: String,
    /// What.
    pub text: String,
    /// How often.
    pub count: u64,
}

/// The numbers of a run that depend on the wall clock.
pub fn summarise_clock(recording: &Recording) -> ClockSummary {
    let mut overruns: BTreeMap<(&str, Overrun), u64> = BTreeMap::new();
    let (deliveries, links) = deliveries(&recording.clock);
    let mut summary = ClockSummary { format: 1, deliveries, links, ..ClockSummary::default() };
    for record in &recording.clock {
        match record {
            ClockRecord::Achieved(_) => {}
            ClockRecord::Ticks(row) => {
                let worst_late_s = row.worst_late_ns as f64 / 1e9;
                match summary.deadlines.iter_mut().find(|deadlines| *deadlines.vehicle == *row.vehicle) {
                    Some(deadlines) => {
                        deadlines.met += row.met;
                        deadlines.missed += row.missed;
                        deadlines.worst_late_s = deadlines.worst_late_s.max(worst_late_s);
                    }
                    None => summary.deadlines.push(DeadlineSummary {
                        vehicle: row.vehicle.to_string(),
                        met: row.met,
                        missed: row.missed,
                        worst_late_s,
                    }),
                }
            }
            ClockRecord::Overrun(row) => *overruns.entry((row.vehicle.as_ref(), row.place)).or_default() += row.count,
            ClockRecord::Note(row) => summary.notes.push(NoteSummary {
                t_s: row.t_ns as f64 / 1e9,
                source: row.source.clone(),
                text: row.text.clone(),
                count: row.count,
            }),
        }
    }
    summary.deadlines.sort_by(|a, b| a.vehicle.cmp(&b.vehicle));
    let overrun = |((vehicle, place), count): ((&str, Overrun), u64)| {
        let vehicle = vehicle.to_owned();
        OverrunSummary { vehicle, place, count }
    };
    summary.overruns = overruns.into_iter().map(overrun).collect();
    summary.verdict = verdict(&summary);
    summary
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::summarise;
    use crate::results::testing::{facts, fleet};

    #[test]
    fn the_clock_stays_out_of_the_summary() {
        let (with_clock, mut without) = (fleet(true), fleet(true));
        without.clock.clear();
        assert_eq!(summarise(&with_clock, &facts(true)), summarise(&without, &facts(true)));
        let clock = summarise_clock(&with_clock);
        let late = clock.deliveries.expect("deliveries").late_s;
        assert_eq!((late.median, late.max), (60e-6, 2e-3));
        assert_eq!(clock.deadlines.iter().map(|deadlines| deadlines.missed).sum::<u64>(), 6);
        assert_eq!(clock.notes.len(), 1);
        assert!(clock.verdict.is_some_and(|verdict| !verdict.kept_time));
        assert_eq!(summarise_clock(&without), ClockSummary { format: 1, ..ClockSummary::default() });
    }
}
