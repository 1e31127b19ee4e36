//! The canonical order of rows.

use std::cmp::Ordering;

use common::record::{ClockRecord, Record, Row};

use super::topic::{Topic, time_of};

/// Orders rows by mission time, then topic (speed, topology, states, messages, then the clock topics), then vehicle or
/// link by name, then sequence number. Rows that compare equal keep the order in which they were recorded.
pub fn canonical_order(a: &Row, b: &Row) -> Ordering {
    time_of(a).cmp(&time_of(b)).then_with(|| Topic::of(a).cmp(&Topic::of(b))).then_with(|| place(a).cmp(&place(b)))
}

/// Who a row is about: first name, second name, number.
fn place(row: &Row) -> (&str, &str, u64) {
    match row {
        Row::Exact(Record::Speed(_)) => ("", "", 0),
        Row::Exact(Record::Topology(row)) => (&row.from, &row.to, 0),
        Row::Exact(Record::State(row)) => (&row.vehicle, "", 0),
        Row::Exact(Record::Message(row)) => (&row.from, &row.to, row.seq),
        Row::Clock(ClockRecord::Achieved(row)) => (&row.from, &row.to, row.seq),
        Row::Clock(ClockRecord::Ticks(row)) => (&row.vehicle, "", 0),
        Row::Clock(ClockRecord::Note(row)) => (&row.source, &row.text, 0),
    }
}
