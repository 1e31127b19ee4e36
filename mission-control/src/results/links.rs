//! What became of the messages of each link.

use std::collections::{BTreeMap, BTreeSet};

use common::record::{Fate, MessageRow, Record};
use serde::Serialize;

use super::Facts;
use super::network::Network;
use super::statistics::{quantile, sorted};

/// How many messages there were, and what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MessageCounts {
    /// Messages that the emulator took, times the links that they were sent on.
    pub sent: u64,
    /// Handed to the receiver.
    pub delivered: u64,
    /// Lost by the loss model.
    pub lost: u64,
    /// Dropped because the link was down.
    pub link_down: u64,
    /// Dropped because a queue was full.
    pub queue_full: u64,
    /// Dropped because the receiver was too far away.
    pub out_of_range: u64,
    /// Dropped because the receiver was speaking itself.
    pub half_duplex: u64,
    /// Dropped because another message arrived at the same time.
    pub collision: u64,
    /// Handed over with a flipped bit, and dropped by the receiver.
    pub corrupt: u64,
    /// Dropped because there was no process of the receiver.
    pub receiver_absent: u64,
    /// Under way when the mission ended.
    pub in_flight: u64,
    /// Second copies handed to the receiver; they do not count as sent.
    pub copied: u64,
    /// Second copies that did not get there.
    pub copy_dropped: u64,
    /// Second copies under way when the mission ended.
    pub copy_in_flight: u64,
}

impl MessageCounts {
    /// So many were sent, and so many met each fate.
    fn new(sent: u64, met: impl Fn(Fate) -> u64) -> MessageCounts {
        MessageCounts {
            sent,
            delivered: met(Fate::Delivered),
            lost: met(Fate::Lost),
            link_down: met(Fate::LinkDown),
            queue_full: met(Fate::QueueFull),
            out_of_range: met(Fate::OutOfRange),
            half_duplex: met(Fate::HalfDuplex),
            collision: met(Fate::Collision),
            corrupt: met(Fate::Corrupt),
            receiver_absent: met(Fate::ReceiverAbsent),
            in_flight: met(Fate::InFlight),
            copied: met(Fate::Copied),
            copy_dropped: met(Fate::CopyDropped),
            copy_in_flight: met(Fate::CopyInFlight),
        }
    }

    /// How many met this fate.
    pub fn met(&self, fate: Fate) -> u64 {
        match fate {
            Fate::Delivered => self.delivered,
            Fate::Lost => self.lost,
            Fate::LinkDown => self.link_down,
            Fate::QueueFull => self.queue_full,
            Fate::OutOfRange => self.out_of_range,
            Fate::HalfDuplex => self.half_duplex,
            Fate::Collision => self.collision,
            Fate::Corrupt => self.corrupt,
            Fate::ReceiverAbsent => self.receiver_absent,
            Fate::InFlight => self.in_flight,
            Fate::Copied => self.copied,
            Fate::CopyDropped => self.copy_dropped,
            Fate::CopyInFlight => self.copy_in_flight,
        }
    }

    /// Those of all links together.
    pub(super) fn over(links: &[LinkSummary]) -> MessageCounts {
        let sent = links.iter().map(|link| link.messages.sent).sum();
        MessageCounts::new(sent, |fate| links.iter().map(|link| link.messages.met(fate)).sum())
    }

    /// Whether each that was sent was delivered, dropped for one cause, or is under way.
    fn is_accounted(&self) -> bool {
        let dropped: u64 = Fate::DROPS.iter().map(|cause| self.met(*cause)).sum();
        self.sent == self.delivered + dropped + self.in_flight
    }
}

/// The messages of one directed link.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LinkSummary {
    /// The sender.
    pub from: String,
    /// The receiver.
    pub to: String,
    /// What became of its messages.
    #[serde(flatten)]
    pub messages: MessageCounts,
    /// Sequence numbers between the first and the last of a sender's life that have no row.
    pub missing: u64,
    /// Messages with more than one row.
    pub repeated: u64,
    /// Whether every message has one fate: sent = delivered + dropped + in flight, none missing, none repeated.
    pub balanced: bool,
    /// Size of what was delivered, without copies \[bytes\].
    pub delivered_bytes: u64,
    /// Commanded delay of what was delivered \[s\].
    pub delay: Option<Spread>,
    /// Part of the time that the link was up.
    pub up_fraction: f64,
    /// The longest time that it was down \[s\].
    pub longest_outage_s: f64,
}

/// Median, 99th percentile and maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the values are at or below this.
    pub median: f64,
    /// 99 % of the values are at or below this.
    pub p99: f64,
    /// The largest value.
    pub max: f64,
}

impl Spread {
    /// The spread of some values; `None` if there are none.
    pub(super) fn of(values: &[f64]) -> Option<Spread> {
        let ascending = sorted(values);
        let max = *ascending.last()?;
        Some(Spread { median: quantile(&ascending, 0.5)?, p99: quantile(&ascending, 0.99)?, max })
    }
}

/// Every directed link's messages and up times: the links of the mission first, then others that have rows.
pub(super) fn links(exact: &[Record], facts: &Facts, network: &Network) -> Vec<LinkSummary> {
    let mut messages: BTreeMap<(&str, &str), Vec<&MessageRow>> = BTreeMap::new();
    for record in exact {
        if let Record::Message(row) = record {
            messages.entry((&row.from, &row.to)).or_default().push(row);
        }
    }
    let named: Vec<(&str, &str)> = facts.links.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
    let known: BTreeSet<(&str, &str)> = named.iter().copied().collect();
    let others = messages.keys().copied().filter(|link| !known.contains(link)).collect::<Vec<_>>();
    let all = named.into_iter().chain(others);
    all.map(|(from, to)| {
        let rows = messages.get(&(from, to)).map_or(&[][..], Vec::as_slice);
        let summary = ledger(rows, facts.bytes_of(from));
        let down = network.down_times(from, to);
        let duration = network.end.secs();
        let down_s: f64 = down.iter().map(|(from, to)| to - from).sum();
        LinkSummary {
            from: from.to_owned(),
            to: to.to_owned(),
            up_fraction: if duration > 0.0 { 1.0 - down_s / duration } else { 1.0 },
            longest_outage_s: down.iter().map(|(from, to)| to - from).fold(0.0, f64::max),
            ..summary
        }
    })
    .collect()
}

fn ledger(rows: &[&MessageRow], message_bytes: u64) -> LinkSummary {
    let mut fates: BTreeMap<Fate, u64> = BTreeMap::new();
    rows.iter().for_each(|row| *fates.entry(row.fate).or_default() += 1);
    // Copies were sent by nobody: they have no part in the ledger of what was sent.
    let sent = rows.iter().filter(|row| !row.fate.is_of_copy());
    let mut in_order: Vec<(i64, u64)> = sent.map(|row| (row.sent_ns, row.seq)).collect();
    in_order.sort_unstable();
    let (mut missing, mut repeated) = (0, 0);
    for pair in in_order.windows(2) {
        if pair[0] == pair[1] {
            repeated += 1;
        } else if pair[1].1 > pair[0].1 {
            // A number that does not rise begins a new life of the sender.
            missing += pair[1].1 - pair[0].1 - 1;
        }
    }
    let delays =
        rows.iter().filter(|row| row.fate == Fate::Delivered).map(|row| (row.due_ns - row.sent_ns) as f64 / 1e9);
    let met = |fate: Fate| fates.get(&fate).copied().unwrap_or(0);
    let messages = MessageCounts::new(in_order.len() as u64 - repeated, met);
    LinkSummary {
        messages,
        missing,
        repeated,
        balanced: messages.is_accounted() && missing == 0 && repeated == 0,
        delivered_bytes: messages.delivered * message_bytes,
        delay: Spread::of(&delays.collect::<Vec<_>>()),
        ..LinkSummary::default()
    }
}

/// What one vehicle said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Said {
    /// Number of transmissions: a message to several receivers goes on the air once, and one that found no place in its sender's
    /// queue, or still waited there at the end, never.
    pub(super) transmissions: u64,
    /// When the network last took a message of it \[s\].
    pub(super) last_s: Option<f64>,
}

/// What each vehicle said, by its name.
pub(super) fn said(exact: &[Record]) -> BTreeMap<&str, Said> {
    let rows = || {
        exact.iter().filter_map(|record| match record {
            Record::Message(row) => Some(row),
            _ => None,
        })
    };
    let mut sent: Vec<(&str, i64, u64)> =
        rows().filter(|row| was_on_air(row)).map(|row| (&*row.from, row.sent_ns, row.seq)).collect();
    sent.sort_unstable();
    sent.dedup();
    let mut by_sender: BTreeMap<&str, Said> = BTreeMap::new();
    sent.iter().for_each(|(from, ..)| by_sender.entry(*from).or_default().transmissions += 1);
    for row in rows() {
        let last_s = &mut by_sender.entry(&*row.from).or_default().last_s;
        *last_s = Some(last_s.unwrap_or(0.0).max(row.sent_ns as f64 / 1e9));
    }
    by_sender
}

/// What never left its sender has no instant at which it was to arrive: it stands as due when that was decided.
fn was_on_air(row: &MessageRow) -> bool {
    !([Fate::QueueFull, Fate::InFlight].contains(&row.fate) && row.due_ns == row.t_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::network::tests::{change, facts, message};

    fn link_1_2(rows: &[Record]) -> LinkSummary {
        let facts = facts(&[("1", "2")]);
        links(rows, &facts, &Network::of(rows, &facts)).remove(0)
    }

    #[test]
    fn every_message_has_one_fate() {
        let fates = [Fate::Delivered, Fate::Lost, Fate::LinkDown, Fate::QueueFull, Fate::InFlight, Fate::Delivered];
        let rows: Vec<Record> = (0..).zip(fates).map(|(seq, fate)| message(seq, seq as i64, fate)).collect();
        let link = link_1_2(&rows);
        assert!(link.balanced);
        assert_eq!((link.messages.sent, link.messages.delivered, link.delivered_bytes), (6, 2, 20));
        assert_eq!(link.delay, Some(Spread { median: 5.0, p99: 5.0, max: 5.0 }));
        assert_eq!(said(&rows).values().map(|said| said.transmissions).sum::<u64>(), 6);
    }

    #[test]
    fn each_cause_is_counted_and_copies_were_sent_by_nobody() {
        let mut rows: Vec<Record> =
            Fate::DROPS.into_iter().zip(0..).map(|(fate, seq)| message(seq, seq as i64, fate)).collect();
        for fate in [Fate::Copied, Fate::CopyDropped, Fate::CopyInFlight] {
            rows.push(message(3, 3, fate));
        }
        let link = link_1_2(&rows);
        let counts = link.messages;
        assert_eq!(Fate::ALL.map(|fate| counts.met(fate)), [0, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1]);
        assert_eq!((counts.sent, link.repeated, link.balanced), (8, 0, true));
        assert_eq!(MessageCounts::over(&[link.clone(), link]).half_duplex, 2);
    }

    #[test]
    fn what_never_left_its_sender_was_not_on_the_air() {
        let row = |seq: u64, to: &str, fate, waits: i64| {
            let (t_ns, sent_ns) = (seq as i64 + 5, seq as i64);
            let (from, to) = ("1".into(), to.into());
            Record::Message(MessageRow { t_ns, from, to, seq, sent_ns, due_ns: t_ns + waits, fate })
        };
        let rows = [
            row(0, "2", Fate::Delivered, 0),
            // No place at the sender, on either link; then one that was sent and found no place on one link.
            row(1, "2", Fate::QueueFull, 0),
            row(1, "3", Fate::QueueFull, 0),
            row(2, "2", Fate::QueueFull, 9),
            row(2, "3", Fate::Lost, 9),
            // Under way, and still waiting, at the end.
            row(3, "2", Fate::InFlight, 9),
            row(4, "2", Fate::InFlight, 0),
        ];
        assert_eq!(said(&rows).get("1").map(|said| said.transmissions), Some(3));
    }

    #[test]
    fn a_message_without_a_fate_or_with_two_unbalances_the_ledger() {
        let gap = link_1_2(&[message(0, 0, Fate::Delivered), message(2, 2, Fate::Delivered)]);
        assert_eq!((gap.missing, gap.balanced), (1, false));
        let twice = link_1_2(&[message(0, 0, Fate::Delivered), message(0, 0, Fate::Lost)]);
        assert_eq!((twice.repeated, twice.messages.sent, twice.balanced), (1, 1, false));
        let second_life = link_1_2(&[message(7, 0, Fate::Delivered), message(0, 5, Fate::Delivered)]);
        assert!(second_life.balanced);
    }

    #[test]
    fn links_that_only_the_recording_knows_are_listed_too() {
        let facts = facts(&[("2", "1")]);
        let rows = [message(0, 0, Fate::Delivered)];
        let links = links(&rows, &facts, &Network::of(&rows, &facts));
        let names: Vec<_> = links.iter().map(|link| (link.from.as_str(), link.messages.sent)).collect();
        assert_eq!(names, [("2", 0), ("1", 1)]);
    }

    #[test]
    fn up_times_are_measured() {
        let rows = [change(0, "1", "2", false), change(25, "1", "2", true), change(90, "1", "2", false)];
        let link = link_1_2(&rows);
        assert!((link.up_fraction - 0.65).abs() < 1e-12);
        assert_eq!(link.longest_outage_s, 25.0);
        // The first thing said of a link is that it comes up: it was down before.
        assert_eq!(link_1_2(&[change(40, "1", "2", true)]).longest_outage_s, 40.0);
        assert_eq!(link_1_2(&[]).up_fraction, 1.0);
    }
}
