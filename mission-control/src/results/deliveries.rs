//! How late deliveries on a real clock were: over all, by link, and each by itself.

use std::collections::{BTreeMap, HashMap};

use common::record::{AchievedRow, ClockRecord, Fate, MessageRow};
use serde::Serialize;

use super::links::Spread;

/// Lateness of deliveries.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeliverySummary {
    /// Number of deliveries.
    pub count: u64,
    /// How many of them were handed over before their time.
    pub early: u64,
    /// Commanded delay \[s\].
    pub commanded_s: Spread,
    /// Achieved minus commanded \[s of wall clock\].
    pub late_s: Spread,
    /// The least of that; negative if a delivery was early \[s of wall clock\].
    pub least_late_s: f64,
}

impl DeliverySummary {
    /// Of some rows; `None` if there are none.
    fn of(rows: &[&AchievedRow]) -> Option<DeliverySummary> {
        let seconds =
            |nanos: fn(&AchievedRow) -> i64| -> Vec<f64> { rows.iter().map(|row| nanos(row) as f64 / 1e9).collect() };
        let late = seconds(|row| row.late_ns);
        Some(DeliverySummary {
            count: rows.len() as u64,
            early: rows.iter().filter(|row| row.late_ns < 0).count() as u64,
            commanded_s: Spread::of(&seconds(|row| row.commanded_ns))?,
            late_s: Spread::of(&late)?,
            least_late_s: late.into_iter().min_by(f64::total_cmp)?,
        })
    }
}

/// Lateness of the deliveries on one directed link.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LinkDeliveries {
    /// The sender.
    pub from: String,
    /// The receiver.
    pub to: String,
    /// Of what was delivered on it.
    #[serde(flatten)]
    pub deliveries: DeliverySummary,
}

/// Over all links, and by link; nothing without a real clock.
pub(super) fn deliveries(clock: &[ClockRecord]) -> (Option<DeliverySummary>, Vec<LinkDeliveries>) {
    let all: Vec<&AchievedRow> = achieved(clock).collect();
    let mut by_link: BTreeMap<(&str, &str), Vec<&AchievedRow>> = BTreeMap::new();
    for row in &all {
        by_link.entry((&row.from, &row.to)).or_default().push(row);
    }
    let of_link = |((from, to), rows): ((&str, &str), Vec<&AchievedRow>)| {
        let deliveries = DeliverySummary::of(&rows)?;
        Some(LinkDeliveries { from: from.to_owned(), to: to.to_owned(), deliveries })
    };
    (DeliverySummary::of(&all), by_link.into_iter().filter_map(of_link).collect())
}

fn achieved(clock: &[ClockRecord]) -> impl Iterator<Item = &AchievedRow> {
    clock.iter().filter_map(|record| match record {
        ClockRecord::Achieved(row) => Some(row),
        _ => None,
    })
}

/// The lateness of each delivery, found by its message.
pub(super) struct Lateness<'a>(HashMap<(&'a str, &'a str, u64, i64), i64>);

impl<'a> Lateness<'a> {
    pub(super) fn of(clock: &'a [ClockRecord]) -> Lateness<'a> {
        // The number alone begins anew with an emulator that takes up a flight; the instant tells its lives apart.
        Lateness(achieved(clock).map(|row| ((&*row.from, &*row.to, row.seq, row.t_ns), row.late_ns)).collect())
    }

    /// How much later than due it was handed over \[ns of wall clock\], if it was delivered on a real clock.
    pub(super) fn late_ns(&self, message: &MessageRow) -> Option<i64> {
        // A copy has the number of its original, and may be due with it.
        let delivered = (message.fate == Fate::Delivered).then_some(message)?;
        self.0.get(&(&*delivered.from, &*delivered.to, delivered.seq, delivered.t_ns)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(to: &str, seq: u64, late_ns: i64) -> ClockRecord {
        let (from, to) = ("a".into(), to.into());
        ClockRecord::Achieved(AchievedRow { t_ns: 7, from, to, seq, commanded_ns: 2_000_000_000, late_ns })
    }

    #[test]
    fn an_early_delivery_shows_as_negative_over_all_and_on_its_link() {
        let clock = [row("c", 0, 40_000), row("b", 0, 30_000), row("b", 1, -2_000), row("b", 2, 90_000)];
        let (all, links) = deliveries(&clock);
        let all = all.expect("four deliveries");
        assert_eq!((all.count, all.early, all.least_late_s, all.late_s.max), (4, 1, -2e-6, 90e-6));
        let told: Vec<_> = links.iter().map(|l| (&*l.to, l.deliveries.early, l.deliveries.least_late_s)).collect();
        assert_eq!(told, [("b", 1, -2e-6), ("c", 0, 40e-6)]);
        assert_eq!(links[0].deliveries.commanded_s, Spread { median: 2.0, p99: 2.0, max: 2.0 });
        let json = serde_json::to_value(&links[0]).expect("JSON");
        assert_eq!((&json["from"], &json["least_late_s"]), (&"a".into(), &(-2e-6).into()));
        assert_eq!(deliveries(&[]), (None, Vec::new()));
    }

    #[test]
    fn a_message_finds_its_own_lateness_and_its_copy_none() {
        let clock = [row("b", 3, -5)];
        let late = Lateness::of(&clock);
        let message = |seq, t_ns, fate| {
            let (from, to) = ("a".into(), "b".into());
            MessageRow { t_ns, from, to, seq, sent_ns: 0, due_ns: t_ns, fate }
        };
        assert_eq!(late.late_ns(&message(3, 7, Fate::Delivered)), Some(-5));
        for other in [(3, 7, Fate::Copied), (2, 7, Fate::Delivered), (3, 8, Fate::Delivered)] {
            assert_eq!(late.late_ns(&message(other.0, other.1, other.2)), None);
        }
    }
}
