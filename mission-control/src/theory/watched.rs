//! The theorem monitor over a flight that is over.
//!
//! Laws of chapter 4 are held against Theorems 4.4 and 4.5, Lemma 4.7, or Lemmas 4.4 and 4.5, with the switching signal as
//! measured. Of the others, what their own statements say is repeated in the monitor's words.

use common::graph::Graph;
use common::mission::Mission;
use common::mission::file::LawChoice;
use common::record::Fate;
use common::theory::monitor::{
    self, Envelope, Exchange, Judgement, Margin, Premise, Seen, Stretch, Tolerance, Watch, Watched,
};
use common::time::{Span, Time};

use super::network::Network;
use super::premises::{Looked, age, dropped, looked_for, tolerance};
use super::{Case, Guarantee, guarantee_of, law_rows};
use crate::results::{Absence, Connectivity, FleetSummary, Summary, TheoryRow};

/// Asked of every fleet.
const PRESENT: &str = "every vehicle all the time";

/// After a flight: covered, not covered, or a defect; `None` for a fleet of one.
pub(super) fn row(case: &Case<'_>) -> Option<TheoryRow> {
    let summary = case.summary.filter(|_| case.mission.vehicles.len() > 1)?;
    let Some(looked) = looked_for(case.mission, &case.network) else { return Some(of_other_laws(case)) };
    let Some(seen) = summary.fleet.connectivity.as_ref().and_then(|measured| seen(case.mission, measured, &looked))
    else {
        return Some(nothing_seen());
    };
    let broken = looked.broken.iter().cloned().chain(missing(case)).collect();
    let watch = monitor::watch(&looked.watched, &case.network.graphs, seen, broken);
    let tolerance = tolerance(case.mission, &case.speed(), &case.network.graphs, &watch, &looked.watched);
    let (judged, stretches) = judge(case, summary, &watch, &looked.watched, tolerance, f64::INFINITY);
    let grown = match judged {
        Judgement::Covered { statement, closest: None } => grown(case, statement),
        _ => None,
    };
    Some(TheoryRow {
        value: format!("{}; {}", network_words(&watch), margins(&watch)),
        holds: Some(matches!(judged, Judgement::Covered { .. }) && grown.is_none()),
        predicted: promise(&watch, tolerance),
        guaranteed_rate: watch.envelope.as_ref().map(|envelope| envelope.rate),
        measured: match grown {
            Some(grown) => grown,
            None => format!("{judged}{stretches}{}", before_absence(case, &looked).unwrap_or_default()),
        },
        ..empty()
    })
}

/// What is guaranteed for the network as it was: the monitor's envelope, or what other laws' statements promise.
pub fn guarantee_of_flight(mission: &Mission, summary: &Summary) -> Option<Guarantee> {
    let case = Case::new(mission, Some(summary));
    let Some(looked) = looked_for(mission, &case.network) else {
        return guarantee_of(&case).filter(|_| missing(&case).is_empty());
    };
    let seen = seen(mission, summary.fleet.connectivity.as_ref()?, &looked)?;
    let broken = looked.broken.iter().cloned().chain(missing(&case)).collect();
    let envelope = monitor::watch(&looked.watched, &case.network.graphs, seen, broken).envelope?;
    Some(Guarantee { rate: envelope.rate, factor: Some(envelope.factor) }).filter(|guarantee| guarantee.rate > 0.0)
}

/// What theory promises a mission on every switching signal over these graphs with this α, T_0 and dwell time, `length` long.
///
/// With it, what messages in periods may cost.
///
/// # Errors
/// Why it promises no envelope.
pub fn envelope_over(
    mission: &Mission,
    graphs: &[Graph],
    (alpha, t_0, dwell): (f64, Span, Span),
    length: Span,
) -> Result<(Envelope, Tolerance), String> {
    let network = Network::of(mission);
    let looked = looked_for(mission, &network).ok_or_else(|| {
        "Theorem 4.4 and Lemma 4.7, which bound errors for such signals, do not speak of this law".to_string()
    })?;
    if looked.watched == Watched::Delayed {
        return Err("Lemmas 4.4 and 4.5, which speak of this law, promise agreement without a rate".to_string());
    }
    if let Some((at, _)) = mission.speed.changes(mission.end).first() {
        return Err(format!(
            "v_L changes under way, first at {at}, and for as long as news from before a change are used, the bound does not hold"
        ));
    }
    // No link is up for a shorter time than the dwell time.
    let period = mission.control_period * mission.message_ticks;
    let exchange = Exchange {
        age: age(mission, mission.validity.map_or(length, |validity| period.max(validity))),
        shortest_up: dwell,
        unheard: (period.secs() / dwell.secs().max(1e-9)).min(1.0),
    };
    // By (4.11) an outage of length l has l ≤ αl + (1 − α)T_0, so none is longer than T_0, and every window of that length sees the fleet
    // connected: Definition 4.4 with T = T_0.
    let seen = Seen { length, alpha, t_0: Some(t_0), dwell, mean: Some(t_0), exchange: Some(exchange) };
    let watch = monitor::watch(&looked.watched, graphs, seen, looked.broken);
    let tolerance = tolerance(mission, &mission.speed, graphs, &watch, &looked.watched);
    let envelope = watch.envelope.ok_or_else(|| watch.judge(&[], Tolerance::default()).to_string())?;
    Ok((envelope, tolerance))
}

/// A delay that the law was told is not age.
fn not_told(oldest_s: f64, told: Span) -> Span {
    Span::from_secs((oldest_s - told.secs()).max(0.0))
}

fn seen(mission: &Mission, measured: &Connectivity, looked: &Looked) -> Option<Seen> {
    let length = Span::from_secs(measured.length_s);
    (length > Span::ZERO).then(|| Seen {
        length,
        alpha: measured.alpha,
        t_0: measured.t_0_s.map(Span::from_secs),
        dwell: Span::from_secs(measured.dwell_s),
        mean: measured.t_s.map(Span::from_secs),
        exchange: Some(Exchange {
            // Where nothing was heard, nothing is old; the unheard part says it.
            age: age(mission, not_told(measured.oldest_news_s.unwrap_or(0.0), looked.told))
                .max(mission.control_period * mission.message_ticks),
            shortest_up: Span::from_secs(measured.shortest_up_s),
            unheard: measured.unheard,
        }),
    })
}

/// Judges a flight until then \[s\], stretch by stretch where v_L changed, and says so.
fn judge(
    case: &Case<'_>,
    summary: &Summary,
    watch: &Watch,
    watched: &Watched,
    tolerance: Tolerance,
    until_s: f64,
) -> (Judgement, String) {
    let errors = errors(summary, until_s);
    let end_s = errors.last().map_or(0.0, |(t, _)| *t);
    let changes = case.speed().changes(Time::from_secs(end_s));
    let changes: Vec<f64> = changes.iter().map(|(at, _)| at.secs()).collect();
    let (judged, left) = watch.judge_between(watched, &errors, &changes, tolerance);
    let words = match (&judged, watch.envelope, changes.last()) {
        (Judgement::NotCovered { .. }, ..) | (_, None, _) | (.., None) => String::new(),
        (.., Some(last)) => stretches_in_words(changes.len(), *last, &left, watched, tolerance),
    };
    (judged, words)
}

/// From when on the errors are judged anew, and which are not judged.
fn stretches_in_words(changes: usize, last: f64, left: &[Stretch], watched: &Watched, tolerance: Tolerance) -> String {
    let times = if changes == 1 { "once".to_string() } else { format!("{changes} times") };
    let changed = format!("v_L changed {times}, last at {last:.2} s");
    if !watched.begins_anew() {
        return format!(
            "; {changed}: judged until the first change alone, for what states the law had then is not known"
        );
    }
    let anew = format!("; {changed}: judged anew from {:.3} s after each change on", tolerance.late);
    let from: Vec<String> =
        left.iter().filter_map(|stretch| stretch.since).map(|since| format!("{since:.2} s")).collect();
    match from.is_empty() {
        true => anew,
        false => format!("{anew}, and too briefly constant to be judged from {} on", from.join(", ")),
    }
}

fn errors(summary: &Summary, until_s: f64) -> Vec<(f64, f64)> {
    let series = &summary.fleet.coordination.series;
    series.t_s.iter().copied().zip(series.norm.iter().copied()).filter(|(t, _)| *t <= until_s).collect()
}

/// The premise that vehicles which were silent at times do not meet.
fn absent(absences: &[Absence]) -> Option<Premise> {
    let words = |absence: &Absence| {
        format!("{} is silent from {:.1} s to {:.1} s", absence.vehicle, absence.from_s, absence.to_s)
    };
    let first = absences.first()?;
    let more = if absences.len() > 1 { format!(" ({} more times)", absences.len() - 1) } else { String::new() };
    Some(Premise { asks: PRESENT, found: format!("{}{more}", words(first)) })
}

/// The premises that vehicles which were silent at times, or gave up, do not meet.
fn not_there(fleet: &FleetSummary) -> Vec<Premise> {
    let gone = fleet.aborted.join(", ");
    let gave_up = (!gone.is_empty()).then_some(Premise { asks: PRESENT, found: gone });
    let without = unrecorded(fleet).join(", ");
    let found = format!("there is no log of {without}");
    let unrecorded = (!without.is_empty()).then_some(Premise { asks: PRESENT, found });
    absent(&fleet.absences).into_iter().chain(unrecorded).chain(gave_up).collect()
}

/// The premises of every statement that the flight did not meet: every vehicle all the time, and every word that was said.
fn missing(case: &Case<'_>) -> Vec<Premise> {
    let away = case.summary.map(|summary| not_there(&summary.fleet)).unwrap_or_default();
    away.into_iter().chain(case.dropped.clone()).collect()
}

/// The row of a statement about the whole fleet: it does not cover a flight in which a vehicle was away, or in which messages were
/// dropped that the plan does not know to be.
pub(super) fn with_everyone(case: &Case<'_>, row: TheoryRow) -> TheoryRow {
    let missing = missing(case);
    if missing.is_empty() || row.holds != Some(true) {
        return row;
    }
    let found: Vec<String> = missing.into_iter().map(|premise| premise.found).collect();
    TheoryRow { value: format!("{}; {}", row.value, found.join("; ")), holds: Some(false), ..row }
}

/// Vehicles without a log: what is measured of the fleet's error is that of the others.
fn unrecorded(fleet: &FleetSummary) -> Vec<&str> {
    let without = fleet.lost.iter().filter(|loss| loss.recorded_until_s.is_none());
    without.map(|loss| loss.vehicle.as_str()).collect()
}

/// Agreement is promised without an envelope, and yet the fleet ended far beyond where it began: further apart than ten times the start
/// and all the way that it had to go.
fn grown(case: &Case<'_>, statement: &str) -> Option<String> {
    let norm = &case.summary?.fleet.coordination.series.norm;
    let (first, last) = (*norm.first()?, *norm.last()?);
    let way = case.speed().fastest() * case.mission.end.secs();
    (!last.is_finite() || last > FAR * first + way).then(|| {
        format!("a defect: covered by {statement}, and yet the error at the end is {last:.3e}, from {first:.3e} at the start")
    })
}

/// How many times as far apart as at the start is far.
const FAR: f64 = 10.0;

/// What can be said of the flight before the first vehicle fell silent.
fn before_absence(case: &Case<'_>, looked: &Looked) -> Option<String> {
    let summary = case.summary?;
    let first = summary.fleet.absences.first().filter(|_| unrecorded(&summary.fleet).is_empty())?;
    let seen = seen(case.mission, summary.fleet.connectivity_before.as_ref()?, looked)?;
    // What had nobody to receive it was dropped later. Of other drops it is not known when they were.
    let counts = summary.fleet.messages.counts;
    let before = |fate| if fate == Fate::ReceiverAbsent { 0 } else { counts.met(fate) };
    let broken = looked.broken.iter().cloned().chain(dropped(case.mission, counts.sent, before)).collect();
    let watch = monitor::watch(&looked.watched, &case.network.graphs, seen, broken);
    let tolerance = tolerance(case.mission, &case.speed(), &case.network.graphs, &watch, &looked.watched);
    let (judged, stretches) = judge(case, summary, &watch, &looked.watched, tolerance, first.from_s);
    Some(format!("; judged until {:.1} s alone: {judged}{stretches}", first.from_s))
}

/// A law that no statement about switching networks speaks of.
fn of_other_laws(case: &Case<'_>) -> TheoryRow {
    let rows = law_rows(case);
    let spoken: Vec<&TheoryRow> = rows.iter().filter(|row| row.holds.is_some()).collect();
    let absent = missing(case);
    let values: Vec<&str> = spoken.iter().map(|row| row.value.as_str()).collect();
    let names = spoken.iter().map(|row| row.name.as_str()).collect::<Vec<_>>().join("; ");
    let failing: Vec<String> = absent
        .iter()
        .map(ToString::to_string)
        .chain(
            spoken
                .iter()
                .filter(|row| row.holds == Some(false))
                .map(|row| format!("{} asks for {}, and here: {}", row.name, row.condition, or_nothing(&row.value))),
        )
        .collect();
    let all_hold = spoken.iter().all(|row| row.holds == Some(true)) && absent.is_empty();
    let grown = grown(case, &names).filter(|_| all_hold && !spoken.is_empty());
    let unspoken = matches!(case.mission.law_choice, LawChoice::DelayedEstimating(_)) && !all_hold && absent.is_empty();
    let (holds, measured) = match (spoken.is_empty(), failing.is_empty()) {
        _ if grown.is_some() => (Some(false), grown.unwrap_or_default()),
        _ if unspoken => (Some(false), format!("not covered: no theorem speaks of this law; {}", values.join("; "))),
        (true, true) => (None, "not covered: no statement speaks of a law without coordination".to_string()),
        (_, false) => (Some(false), format!("not covered: {}", failing.join("; "))),
        (false, true) => (Some(true), format!("covered by {names}, without an envelope")),
    };
    let value = case.summary.and_then(|summary| summary.fleet.connectivity.as_ref()).map_or("–".into(), measured_words);
    TheoryRow {
        value: match names.is_empty() {
            true => value,
            _ if unspoken => value,
            false => format!("{value}; Theorems 4.4 and 4.5 do not speak of this law, but this does: {names}"),
        },
        holds,
        guaranteed_rate: None,
        measured,
        ..empty()
    }
}

fn or_nothing(value: &str) -> &str {
    if value.is_empty() { "nothing known" } else { value }
}

fn nothing_seen() -> TheoryRow {
    TheoryRow { holds: Some(false), measured: "not covered: nothing was recorded".into(), ..empty() }
}

fn empty() -> TheoryRow {
    TheoryRow {
        name: "Theorem monitor: the network as measured, the error over time".into(),
        condition: "a statement covers the fleet, and its errors stay within what it promises".into(),
        predicted: "–".into(),
        ..TheoryRow::default()
    }
}

fn promise(watch: &Watch, tolerance: Tolerance) -> String {
    watch.envelope.as_ref().map_or("–".into(), |envelope| {
        let rate = envelope.rate * (1.0 - tolerance.slower);
        let added = if tolerance.added > 0.0 { format!(" and {:.3} more", tolerance.added) } else { String::new() };
        format!(
            "‖e(t)‖ ≤ {:.3} e^(−{:.5} t) ‖e(0)‖ ({}); as messages come in periods, {rate:.5} 1/s from {} on{added} will do",
            envelope.factor, envelope.rate, envelope.statement, Span::from_secs(tolerance.late)
        )
    })
}

fn measured_words(measured: &Connectivity) -> String {
    let t_0 = measured.t_0_s.map_or("unbounded".to_string(), |t_0| format!("{t_0:.3} s"));
    let mean = measured.t_s.map_or("not connected in mean".to_string(), |t| format!("T = {t:.3} s"));
    format!("α = {:.4}, T₀ = {t_0}, dwell time {:.3} s, {mean}", measured.alpha, measured.dwell_s)
}

/// The network as seen.
pub(super) fn network_words(watch: &Watch) -> String {
    let Seen { alpha, t_0, dwell, mean, .. } = watch.seen;
    let t_0 = t_0.map_or("unbounded".to_string(), |t_0| format!("{:.3} s", t_0.secs()));
    let mean = mean.map_or("not connected in mean".to_string(), |mean| format!("T = {:.3} s", mean.secs()));
    format!("α = {alpha:.4}, T₀ = {t_0}, dwell time {:.3} s, {mean}", dwell.secs())
}

/// Every condition with its value and its limit.
fn margins(watch: &Watch) -> String {
    watch.margins.iter().map(Margin::in_words).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use bus::recording::Recording;
    use common::record::Record;

    use super::*;
    use crate::facts::facts;
    use crate::results::summarise;
    use crate::theory::testing::{changed, flown};

    const BRIEF_LOSSES: &str = include_str!("../../../missions/brief-losses.toml");
    const HELIX: &str = include_str!("../../../missions/auv-helix.toml");
    const ONE_LINK: &str = include_str!("../../../missions/thesis/ucm-one-link-at-a-time.toml");

    fn judged(mission: &Mission, recording: &Recording) -> (TheoryRow, Option<Guarantee>) {
        let summary = summarise(recording, &facts(mission));
        let row = row(&Case::new(mission, Some(&summary))).expect("several vehicles");
        (row, guarantee_of_flight(mission, &summary))
    }

    fn verdict(text: &str, changes: &[(&str, &str)]) -> String {
        let mission = changed(text, changes);
        let (row, _) = judged(&mission, &flown(&mission));
        assert_eq!(row.holds, Some(row.measured.starts_with("covered")), "{row:?}");
        row.measured
    }

    #[test]
    fn what_is_covered_is_said_to_be_and_its_envelope_is_that_of_the_measured_network() {
        let mission = changed(BRIEF_LOSSES, &[]);
        let (row, guarantee) = judged(&mission, &flown(&mission));
        assert!(row.measured.starts_with("covered by Theorem 4.4; the error reached"), "{row:?}");
        assert!(guarantee.is_some_and(|g| (g.rate - 0.025).abs() < 1e-9), "{guarantee:?}");
        let mission = changed(ONE_LINK, &[("duration_s = 400.0", "duration_s = 100.0")]);
        let (row, guarantee) = judged(&mission, &flown(&mission));
        assert!(row.measured.starts_with("covered by Theorem 4.5; the error reached"), "{row:?}");
        assert!(guarantee.is_some_and(|g| g.rate > 0.004 && g.factor.is_some_and(|factor| factor > 1.0)));
    }

    /// Long enough for little to be left of the start when v_L steps.
    const A_STEP: [(&str, &str); 2] = [
        ("\nspeed = 0.5\n", "\nprofile = [{ from_s = 0.0, speed = 0.5 }, { from_s = 200.03, speed = 0.9 }]\n"),
        ("duration_s = 120.0", "duration_s = 300.0"),
    ];

    #[test]
    fn a_step_of_v_l_after_a_long_decay_is_no_defect() {
        let always = ("switching = { periodic = { period_s = 10.0, up_from_s = 7.5, up_for_s = 2.5 } }", "");
        for changes in [vec![A_STEP[0], A_STEP[1]], vec![A_STEP[0], A_STEP[1], always]] {
            let verdict = verdict(BRIEF_LOSSES, &changes);
            assert!(verdict.starts_with("covered by Theorem 4.4; the error reached"), "{verdict}");
            assert!(verdict.contains("v_L changed once, last at 200.03 s: judged anew from 0."), "{verdict}");
        }
    }

    #[test]
    fn a_violation_before_a_step_or_after_it_is_a_defect_still() {
        let mission = changed(BRIEF_LOSSES, &A_STEP);
        let recording = flown(&mission);
        // One vehicle is far ahead for a while, which the others do nothing about.
        for (from_s, to_s) in [(150.0, 160.0), (250.0, 260.0)] {
            let mut pushed = recording.clone();
            for record in &mut pushed.exact {
                if let Record::State(row) = record
                    && &*row.vehicle == "auv1"
                    && (from_s..to_s).contains(&(row.t_ns as f64 / 1e9))
                {
                    row.xi += 50.0;
                }
            }
            let (row, _) = judged(&mission, &pushed);
            let at = format!("and yet the error at {from_s:.2} s");
            assert!(row.holds == Some(false) && row.measured.contains(&at), "{}", row.measured);
        }
    }

    #[test]
    fn a_step_that_is_commanded_is_one_too() {
        let mission = changed(BRIEF_LOSSES, &A_STEP);
        let recording = flown(&mission);
        // The same flight, whose mission did not plan the step.
        let unplanned = changed(BRIEF_LOSSES, &A_STEP[1..]);
        let (row, _) = judged(&unplanned, &recording);
        assert!(row.holds == Some(true) && row.measured.contains("last at 200.03 s"), "{}", row.measured);
    }

    #[test]
    fn the_premise_that_fails_is_named() {
        let short = ("duration_s = 800.0", "duration_s = 60.0");
        let delay = (
            "delay = { constant = { delay_s = 5.0 } }",
            "delay = { constant = { delay_s = 1.0 } }\nloss = { bernoulli = { probability = 0.5 } }",
        );
        let type_1 = ("kind = \"II\"", "kind = \"I\"");
        for (text, changes, words) in [
            (HELIX, vec![short, delay], "they take 1.000 s (told: 5.000 s, 4.000 s less), 0.5000 of them are lost"),
            (HELIX, vec![short, type_1], "auv1 has dynamics of its own (type I, (4.53))"),
            (BRIEF_LOSSES, vec![type_1], "Theorem 4.4 (type I): ρ₁/(α₁λ₁) must be below 0.1111"),
            (
                BRIEF_LOSSES,
                vec![("links = [[\"auv1\", \"auv2\"],", "one_way = [[\"auv1\", \"auv2\"]]\nlinks = [")],
                "one-way links occur",
            ),
            (
                BRIEF_LOSSES,
                vec![("message_period_s = 0.1", "message_period_s = 5.0"), ("validity_s = 0.3", "validity_s = 10.0")],
                "unheard part of a link's up time must be below 0.2500, and it is 1.0000",
            ),
            (
                BRIEF_LOSSES,
                vec![
                    ("message_period_s = 0.1", "message_period_s = 2.5"),
                    ("validity_s = 0.3", "validity_s = 5.0"),
                    ("up_from_s = 7.5, up_for_s = 2.5", "up_from_s = 0.2, up_for_s = 2.0"),
                ],
                "age of news [s] must be below 0.5000",
            ),
        ] {
            let verdict = verdict(text, &changes);
            assert!(verdict.starts_with("not covered: ") && verdict.contains(words), "{words}: {verdict}");
        }
    }

    #[test]
    fn a_silent_vehicle_ends_what_is_covered() {
        let mission = changed(BRIEF_LOSSES, &[]);
        let mut recording = flown(&mission);
        let gone =
            |row: &Record| matches!(row, Record::State(row) if &*row.vehicle == "auv3" && row.t_ns > 57_000_000_000);
        recording.exact.retain(|row| !gone(row));
        let (row, guarantee) = judged(&mission, &recording);
        assert!(row.measured.contains("auv3 is silent from 57.0 s to 120.0 s"), "{}", row.measured);
        assert!(row.measured.contains("judged until 57.0 s alone: covered by Theorem 4.4"), "{}", row.measured);
        assert_eq!((row.holds, guarantee), (Some(false), None));
        let summary = summarise(&recording, &facts(&mission));
        let rows = crate::theory::rows(&mission, Some(&summary));
        let of_law = rows.iter().find(|row| row.name.starts_with("Theorem 4.4")).expect("a row");
        assert!(of_law.holds == Some(false) && of_law.value.contains("auv3 is silent from 57.0 s"), "{of_law:?}");
        assert!(of_law.guaranteed_rate.is_none() && of_law.predicted == "–", "{of_law:?}");
    }

    #[test]
    fn nothing_is_measured_of_a_vehicle_without_a_log() {
        let mission = changed(BRIEF_LOSSES, &[]);
        let mut recording = flown(&mission);
        let gone = |record: &Record| match record {
            Record::State(row) => &*row.vehicle == "auv3",
            Record::Message(row) => &*row.from == "auv3" && row.sent_ns > 57_000_000_000,
            _ => false,
        };
        recording.exact.retain(|record| !gone(record));
        let (row, guarantee) = judged(&mission, &recording);
        assert!(row.measured.contains("auv3 is silent from 57.0 s to 120.0 s"), "{}", row.measured);
        assert!(row.measured.contains("there is no log of auv3"), "{}", row.measured);
        // What is known of the error until then is that of the two others.
        assert!(!row.measured.contains("judged until"), "{}", row.measured);
        assert_eq!((row.holds, guarantee), (Some(false), None));
        let summary = summarise(&recording, &facts(&mission));
        let rows = crate::theory::rows(&mission, Some(&summary));
        let of_law = rows.iter().find(|row| row.name.starts_with("Theorem 4.4")).expect("a row");
        assert!(of_law.holds == Some(false) && of_law.value.contains("auv3 is silent from 57.0 s"), "{of_law:?}");
        assert!(of_law.guaranteed_rate.is_none() && of_law.predicted == "–", "{of_law:?}");
        let summary = summarise(&recording, &facts(&mission));
        let rows = super::super::rows(&mission, Some(&summary));
        let bias = rows.iter().find(|row| row.name.starts_with("Along-path bias")).expect("it has δ");
        assert!(!bias.measured.contains("auv3") && !bias.measured.contains("0.000"), "{}", bias.measured);
        // Of nothing at all, nothing is measured.
        let summary = summarise(&Recording::default(), &facts(&mission));
        for row in super::super::rows(&mission, Some(&summary)) {
            assert!(!row.measured.contains("0.000") && !row.measured.contains("NaN"), "{row:?}");
        }
    }

    #[test]
    fn every_mission_with_several_vehicles_has_a_verdict() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
        let mut count = 0;
        for folder in ["", "thesis", "talk"] {
            for entry in std::fs::read_dir(root.join(folder)).expect("lists") {
                let path = entry.expect("an entry").path();
                let text = std::fs::read_to_string(&path).unwrap_or_default();
                let Ok(mission) = Mission::parse("m.toml", &text) else { continue };
                if mission.vehicles.len() > 1 {
                    let (row, _) = judged(&mission, &Recording::default());
                    assert!(row.measured.starts_with("not covered: "), "{}: {row:?}", path.display());
                    count += 1;
                }
            }
        }
        assert!(count > 25, "{count}");
    }

    #[test]
    fn laws_of_other_chapters_are_spoken_of_by_their_own_propositions() {
        const SOLUTION: &str = include_str!("../../../missions/thesis/solution-1.toml");
        let verdict = verdict(SOLUTION, &[]);
        assert_eq!(verdict, "covered by Proposition 3.4 (solution I), without an envelope");
    }
}
