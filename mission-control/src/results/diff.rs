//! Where two runs part.

use std::cmp::Ordering;
use std::fmt;

use bus::recording::{Recording, canonical_order_of_records, topic_of};
use common::record::{Record, Row};
use serde_json::{Map, Value};

/// What the comparison of two runs found.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// All rows that mission and seed determine are the same, bit for bit.
    Equal {
        /// How many.
        rows: usize,
    },
    /// The first row in which they part.
    Differ {
        /// Its topic.
        topic: String,
        /// Its mission time \[ns\].
        t_ns: i64,
        /// The field, with what the row is about.
        what: String,
        /// The value in the first run.
        left: String,
        /// The value in the second run.
        right: String,
    },
    /// The first row that only one of them has.
    Missing {
        /// Its topic.
        topic: String,
        /// Its mission time \[ns\].
        t_ns: i64,
        /// What the row is about.
        what: String,
        /// The run that has it not.
        from: Side,
    },
}

/// What is to be said of two runs, and whether they are equal to their ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// In words.
    pub text: String,
    /// Whether both are whole, and the same.
    pub equal: bool,
}

/// Compares two runs that may be cut off: what one of them does not reach is no difference, but no equality either.
pub fn compare(left: &Recording, right: &Recording, names: [&str; 2]) -> Comparison {
    let ends = [left, right].map(|recording| (!recording.complete).then(|| reach(recording)));
    let Some(until) = ends.iter().flatten().min().copied() else {
        let outcome = diff(left, right);
        return Comparison { text: outcome.to_string(), equal: matches!(outcome, Outcome::Equal { .. }) };
    };
    // The instant at which a recording ends may not be whole.
    let begun = |recording: &Recording| Recording {
        exact: recording.exact.iter().filter(|row| row.t_ns() < until).cloned().collect(),
        ..Recording::default()
    };
    let cut = ends
        .iter()
        .zip(names)
        .filter_map(|(end, name)| Some(format!("{name} is cut off at {} s", super::export::seconds((*end)?))));
    let cut: Vec<String> = cut.collect();
    let text = match diff(&begun(left), &begun(right)) {
        Outcome::Equal { rows } => format!("equal as far as both go ({rows} rows); {}", cut.join(", ")),
        outcome => format!("{outcome}; {}", cut.join(", ")),
    };
    Comparison { text, equal: false }
}

/// The instant of the last row.
fn reach(recording: &Recording) -> i64 {
    recording.exact.iter().map(Record::t_ns).max().unwrap_or(0)
}

/// One of two runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The first.
    Left,
    /// The second.
    Right,
}

/// Compares the rows that mission and seed determine, in canonical order; what depends on the clock is ignored.
pub fn diff(left: &Recording, right: &Recording) -> Outcome {
    let (left, right) = (ordered(&left.exact), ordered(&right.exact));
    let (mut a, mut b) = (left.iter().copied(), right.iter().copied());
    let (mut next_a, mut next_b) = (a.next(), b.next());
    loop {
        let order = match (next_a, next_b) {
            (None, None) => return Outcome::Equal { rows: left.len() },
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(a), Some(b)) => canonical_order_of_records(a, b),
        };
        match (order, next_a, next_b) {
            (Ordering::Less, Some(row), _) => return missing(row, Side::Right),
            (Ordering::Greater, _, Some(row)) => return missing(row, Side::Left),
            (_, Some(row_a), Some(row_b)) => {
                if let Some(outcome) = parting(row_a, row_b) {
                    return outcome;
                }
            }
            _ => {}
        }
        (next_a, next_b) = (a.next(), b.next());
    }
}

/// In what the missions themselves differ, in words; empty for runs of the same mission file and seed.
pub fn origins_differ(left: &Recording, right: &Recording) -> Vec<String> {
    let mut differences = Vec::new();
    if left.digest != right.digest {
        differences.push(format!("mission digest: {} and {}", left.digest, right.digest));
    }
    if left.seed != right.seed {
        differences.push(format!("seed: {} and {}", left.seed, right.seed));
    }
    differences
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |t_ns: &i64| super::export::seconds(*t_ns);
        match self {
            Outcome::Equal { rows } => write!(f, "equal ({rows} rows)"),
            Outcome::Differ { topic, t_ns, what, left, right } => {
                write!(f, "differ at {} s in {topic}: {what} is {left} and {right}", seconds(t_ns))
            }
            Outcome::Missing { topic, t_ns, what, from } => {
                let which = if *from == Side::Left { "first" } else { "second" };
                write!(f, "differ at {} s in {topic}: {what} is missing from the {which} run", seconds(t_ns))
            }
        }
    }
}

fn ordered(exact: &[Record]) -> Vec<&Record> {
    let mut rows: Vec<&Record> = exact.iter().collect();
    rows.sort_by(|a, b| canonical_order_of_records(a, b));
    rows
}

fn missing(row: &Record, from: Side) -> Outcome {
    Outcome::Missing { topic: topic(row), t_ns: row.t_ns(), what: about(row), from }
}

fn topic(row: &Record) -> String {
    topic_of(&Row::Exact(row.clone())).into_owned()
}

/// The first field in which two rows about the same thing part.
fn parting(a: &Record, b: &Record) -> Option<Outcome> {
    // Equality of numbers would let -0.0 pass for 0.0; their text does not.
    if a == b && !has_zero(a) {
        return None;
    }
    let (fields_a, fields_b) = (fields(a), fields(b));
    let (name, left) =
        fields_a.iter().find(|(name, value)| fields_b.get(*name).is_none_or(|b| text(b) != text(value)))?;
    Some(Outcome::Differ {
        topic: topic(a),
        t_ns: a.t_ns(),
        what: format!("{name} of {}", about(a)),
        left: text(left),
        right: fields_b.get(name).map(text).unwrap_or_default(),
    })
}

fn has_zero(row: &Record) -> bool {
    match row {
        Record::State(s) => s.measures().contains(&0.0),
        Record::Speed(row) => row.speed == 0.0,
        _ => false,
    }
}

fn fields(row: &Record) -> Map<String, Value> {
    let value = match row {
        Record::State(row) => serde_json::to_value(row),
        Record::Message(row) => serde_json::to_value(row),
        Record::Topology(row) => serde_json::to_value(row),
        Record::Speed(row) => serde_json::to_value(row),
        Record::Warning(row) => serde_json::to_value(row),
    };
    match value {
        Ok(Value::Object(fields)) => fields,
        _ => Map::new(),
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn about(row: &Record) -> String {
    match row {
        Record::State(row) => format!("the state of {}", row.vehicle),
        Record::Message(row) => format!("message {} {} → {}", row.seq, row.from, row.to),
        Record::Topology(row) => format!("link {} → {}", row.from, row.to),
        Record::Speed(_) => "the formation speed".into(),
        Record::Warning(row) => format!("a warning of {}", row.source),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::fleet;
    use common::record::{Fate, StateRow};

    /// The fleet, and the fleet with its 101st state (of v2, at 3.3 s) changed.
    fn pair(change: impl FnOnce(&mut StateRow)) -> (Recording, Recording) {
        let (left, mut right) = (fleet(true), fleet(true));
        let mut states = right.exact.iter_mut().filter_map(|record| match record {
            Record::State(row) => Some(row),
            _ => None,
        });
        change(states.nth(100).expect("a state"));
        drop(states);
        (left, right)
    }

    #[test]
    fn a_run_equals_itself_whatever_the_clock_did_and_the_order_was() {
        let (left, mut right) = (fleet(true), fleet(true));
        right.clock.clear();
        right.exact.reverse();
        assert_eq!(diff(&left, &right), Outcome::Equal { rows: left.exact.len() });
        assert_eq!(origins_differ(&left, &right), [""; 0]);
    }

    #[test]
    fn the_first_difference_is_named_with_both_values() {
        let (left, mut right) = pair(|row| row.speed_mps = 0.123);
        let Some(Record::Message(last)) = right.exact.last_mut() else { panic!("a message") };
        last.fate = Fate::QueueFull;
        let outcome = diff(&left, &right);
        let text = outcome.to_string();
        assert!(text.starts_with("differ at 3.3 s in /vehicles/v2/state: speed_mps of the state of v2 is "), "{text}");
        assert!(text.ends_with(" and 0.123"), "{text}");
    }

    #[test]
    fn one_bit_is_a_difference() {
        let (left, right) = pair(|row| row.x_m = f64::from_bits(row.x_m.to_bits() ^ 1));
        assert!(matches!(diff(&left, &right), Outcome::Differ { what, .. } if what == "x_m of the state of v2"));
        let (left, right) = pair(|row| row.roll_rad = -0.0);
        let Outcome::Differ { left, right, .. } = diff(&left, &right) else { panic!("differ") };
        assert_eq!((left.as_str(), right.as_str()), ("0.0", "-0.0"));
    }

    #[test]
    fn a_missing_row_is_named_with_its_side() {
        let (left, mut right) = (fleet(true), fleet(true));
        right.exact.retain(|record| !matches!(record, Record::Message(row) if row.seq == 3 && *row.from == *"v3"));
        assert_eq!(
            diff(&left, &right).to_string(),
            "differ at 6.5 s in /network/messages: message 3 v3 → v2 is missing from the second run"
        );
        assert!(matches!(diff(&right, &left), Outcome::Missing { from: Side::Left, .. }));
        right.exact.clear();
        assert!(matches!(diff(&left, &right), Outcome::Missing { from: Side::Right, t_ns: 0, .. }));
    }

    #[test]
    fn a_run_that_is_cut_off_is_compared_as_far_as_it_goes() {
        let (left, mut right) = (fleet(true), fleet(true));
        right.exact.retain(|row| row.t_ns() <= 4_000_000_000);
        right.complete = false;
        let comparison = compare(&left, &right, ["A", "B"]);
        assert!(!comparison.equal);
        assert!(comparison.text.starts_with("equal as far as both go ("), "{}", comparison.text);
        assert!(comparison.text.ends_with(" rows); B is cut off at 4.0 s"), "{}", comparison.text);

        // A difference before the cut is one; the run that is cut off is named all the same.
        let Some(Record::State(row)) = right.exact.iter_mut().find(|row| matches!(row, Record::State(_))) else {
            panic!("a state")
        };
        row.speed_mps = 0.123;
        let comparison = compare(&right, &left, ["A", "B"]);
        assert!(comparison.text.starts_with("differ at ") && comparison.text.ends_with("; A is cut off at 4.0 s"));

        let whole = compare(&left, &left, ["A", "B"]);
        assert!(whole.equal && whole.text == format!("equal ({} rows)", left.exact.len()), "{}", whole.text);
    }

    #[test]
    fn other_seeds_are_told() {
        let (left, mut right) = (fleet(true), fleet(true));
        right.seed = 43;
        assert_eq!(origins_differ(&left, &right), ["seed: 42 and 43"]);
    }
}
