//! The canonical order of rows.

use std::cmp::Ordering;

use common::record::{ClockRecord, Record, Row};

use super::topic::Topic;

/// Orders rows by mission time, then topic (speed, topology, states, messages,
/// warnings, then the clock topics), then vehicle or
/// link by name, then sequence number. Rows that compare equal keep the order in which they were recorded.
pub fn canonical_order(a: &Row, b: &Row) -> Ordering {
    key(a).cmp(&key(b))
}

/// [`canonical_order`] for rows that mission and seed determine.
pub fn canonical_order_of_records(a: &Record, b: &Record) -> Ordering {
    exact_key(a).cmp(&exact_key(b))
}

/// Time, topic, who it is about, and a number.
type Key<'a> = (i64, Topic, &'a str, &'a str, u64);

fn key(row: &Row) -> Key<'_> {
    let (first, second, number): (&str, &str, u64) = match row {
        Row::Exact(record) => return exact_key(record),
        Row::Clock(ClockRecord::Achieved(row)) => (&row.from, &row.to, row.seq),
        Row::Clock(ClockRecord::Ticks(row)) => (&row.vehicle, "", 0),
        Row::Clock(ClockRecord::Note(row)) => (&row.source, &row.text, 0),
        Row::Clock(ClockRecord::Overrun(row)) => (&row.vehicle, "", row.place as u64),
    };
    (row.t_ns(), Topic::of(row), first, second, number)
}

fn exact_key(record: &Record) -> Key<'_> {
    let (topic, first, second, number): (Topic, &str, &str, u64) = match record {
        Record::Speed(_) => (Topic::Speed, "", "", 0),
        Record::Topology(row) => (Topic::Topology, &row.from, &row.to, 0),
        Record::State(row) => (Topic::State, &row.vehicle, "", 0),
        Record::Message(row) => (Topic::Message, &row.from, &row.to, row.seq),
        Record::Warning(row) => (Topic::Warning, &row.source, &row.text, 0),
    };
    (record.t_ns(), topic, first, second, number)
}
