//! A recorded network as a section of a mission file: what happened to one fleet can happen to another.

use std::collections::BTreeMap;
use std::fmt::Write;

use common::record::{Fate, Record};
use common::time::Span;

use super::export::seconds;

/// `[network.switching.trace]` with the times at which every link was up, and, if any link lost messages while it was up, one
/// `[[network.exceptions]]` with a trace of losses for every link. Links are in the order of their names.
pub fn network_section(exact: &[Record], message_period: Span) -> String {
    let mut text = String::from("# The links of a recorded run, for the section [network] of a mission file.\n");
    let ups = up_times(exact);
    text.push_str("\n[network.switching.trace]\nlinks = [\n");
    for ((from, to), intervals) in &ups {
        let intervals: Vec<String> =
            intervals.iter().map(|(begin, end)| format!("[{}, {}]", seconds(*begin), seconds(*end))).collect();
        let _ = writeln!(text, "  {{ from = \"{from}\", to = \"{to}\", up_s = [{}] }},", intervals.join(", "));
    }
    text.push_str("]\n");
    let runs = loss_runs(exact, message_period);
    let lossy = runs.values().any(|runs| runs.len() > 1);
    for ((from, to), runs) in runs.into_iter().filter(|_| lossy) {
        let runs: Vec<String> = runs.iter().map(u64::to_string).collect();
        let _ = write!(
            text,
            "\n[[network.exceptions]]\nfrom = \"{from}\"\nto = \"{to}\"\nloss = {{ trace = {{ runs = [{}] }} }}\n",
            runs.join(", ")
        );
    }
    text
}

type ByLink<'r, T> = BTreeMap<(&'r str, &'r str), T>;

/// Intervals in which links were up \[ns\]; one that is open at the end goes on beyond it.
fn up_times(exact: &[Record]) -> ByLink<'_, Vec<(i64, i64)>> {
    let end = exact.iter().map(Record::t_ns).max().unwrap_or(0).saturating_add(1_000_000_000);
    let mut intervals: ByLink<'_, Vec<(i64, i64)>> = BTreeMap::new();
    let mut since: ByLink<'_, Option<i64>> = BTreeMap::new();
    for record in exact {
        let Record::Topology(row) = record else { continue };
        let link = (&*row.from, &*row.to);
        let ups = intervals.entry(link).or_default();
        let open = since.entry(link).or_default();
        match (row.up, *open) {
            (true, None) => *open = Some(row.t_ns),
            (false, Some(begin)) => {
                ups.push((begin, row.t_ns));
                *open = None;
            }
            _ => {}
        }
    }
    for (link, begin) in since {
        intervals.entry(link).or_default().extend(begin.map(|begin| (begin, end)));
    }
    intervals
}

/// Lengths of runs of message periods, by turns: not lost, lost. Messages that the link's absence dropped count as not lost.
///
/// A mission decides about a message by the number of its period, so that is what is counted: a vehicle that speaks now
/// and then, or that came back, has fewer messages than periods. A period in which nothing was said goes on as the one before.
fn loss_runs(exact: &[Record], message_period: Span) -> ByLink<'_, Vec<u64>> {
    let mut lost: ByLink<'_, BTreeMap<u64, bool>> = BTreeMap::new();
    for record in exact {
        let Record::Message(row) = record else { continue };
        if row.fate.is_of_copy() {
            continue;
        }
        let absent = [Fate::LinkDown, Fate::ReceiverAbsent].contains(&row.fate);
        let dropped = Fate::DROPS.contains(&row.fate) && !absent;
        let period = row.sent_ns.max(0) / message_period.nanos().max(1);
        *lost.entry((&*row.from, &*row.to)).or_default().entry(period.unsigned_abs()).or_default() |= dropped;
    }
    let runs = |lost: BTreeMap<u64, bool>| {
        let mut runs = vec![0];
        let (mut now, mut next) = (false, 0);
        for (period, dropped) in lost {
            *runs.last_mut().expect("never empty") += period - next;
            if dropped != now {
                runs.push(0);
                now = dropped;
            }
            *runs.last_mut().expect("never empty") += 1;
            next = period + 1;
        }
        runs
    };
    lost.into_iter().map(|(link, lost)| (link, runs(lost))).collect()
}

#[cfg(test)]
mod tests {
    use common::record::{MessageRow, TopologyRow};

    use super::*;

    fn change(t_s: i64, to: &str, up: bool) -> Record {
        Record::Topology(TopologyRow { t_ns: t_s * 1_000_000_000, from: "a".into(), to: to.into(), up })
    }

    const PERIOD: Span = Span::from_nanos(100_000_000);

    /// Said in this message period, and taken by the emulator a moment later.
    fn message(period: i64, fate: Fate) -> Record {
        let (from, to) = ("a".into(), "b".into());
        let sent_ns = period * PERIOD.nanos() + 120_000;
        Record::Message(MessageRow { t_ns: 0, from, to, seq: 0, sent_ns, due_ns: 0, fate })
    }

    #[test]
    fn up_times_are_intervals_and_the_last_goes_on_beyond_the_end() {
        let rows = [change(0, "b", true), change(0, "c", false), change(2, "b", false), change(5, "c", true)];
        let text = network_section(&rows, PERIOD);
        assert!(text.contains("{ from = \"a\", to = \"b\", up_s = [[0.0, 2.0]] }"), "{text}");
        assert!(text.contains("{ from = \"a\", to = \"c\", up_s = [[5.0, 6.0]] }"), "{text}");
        assert!(!text.contains("exceptions"), "nothing was lost");
    }

    #[test]
    fn losses_become_runs_and_copies_do_not_count() {
        let fates = [Fate::Delivered, Fate::LinkDown, Fate::Lost, Fate::Collision, Fate::Delivered, Fate::Corrupt];
        let mut rows: Vec<Record> = (0..).zip(fates).map(|(period, fate)| message(period, fate)).collect();
        rows.push(message(0, Fate::Copied));
        assert_eq!(loss_runs(&rows, PERIOD)[&("a", "b")], [2, 2, 1, 1]);
        assert!(network_section(&rows, PERIOD).contains("loss = { trace = { runs = [2, 2, 1, 1] } }"));
    }

    #[test]
    fn who_speaks_now_and_then_is_lost_by_the_number_of_the_period() {
        let said =
            [(3, Fate::Lost), (7, Fate::Lost), (8, Fate::Delivered), (20, Fate::ReceiverAbsent), (21, Fate::Lost)];
        let rows = said.map(|(period, fate)| message(period, fate));
        assert_eq!(loss_runs(&rows, PERIOD)[&("a", "b")], [3, 5, 13, 1]);
    }
}
