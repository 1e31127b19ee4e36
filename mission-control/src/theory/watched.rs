//! The theorem monitor over a flight that is over.
//!
//! Laws of chapter 4 are held against Theorems 4.4 and 4.5, Lemma 4.7, or Lemmas 4.4 and 4.5, with the switching signal as
//! measured. Of the others, what their own statements say is repeated in the monitor's words.

use common::graph::Graph;
use common::mission::Mission;
use common::theory::monitor::{self, Envelope, Exchange, Judgement, Premise, Seen, Tolerance, Watch, Watched};
use common::time::Span;

use super::network::Network;
use super::premises::{Looked, age, looked_for, tolerance};
use super::{Case, Guarantee, guarantee_of, law_rows};
use crate::results::{Absence, Connectivity, Summary, TheoryRow};

/// Asked of every fleet.
const PRESENT: &str = "every vehicle all the time";

/// After a flight: covered, not covered, or a defect; `None` for a fleet of one.
pub(super) fn row(case: &Case<'_>) -> Option<TheoryRow> {
    let summary = case.summary.filter(|_| case.mission.vehicles.len() > 1)?;
    let absences = &summary.fleet.absences;
    let Some(looked) = looked_for(case.mission, &case.network) else { return Some(of_other_laws(case, absences)) };
    let Some(seen) = summary.fleet.connectivity.as_ref().and_then(|measured| seen(case.mission, measured, &looked))
    else {
        return Some(nothing_seen());
    };
    let broken = looked.broken.iter().cloned().chain(absent(absences)).collect();
    let watch = monitor::watch(&looked.watched, &case.network.graphs, seen, broken);
    let tolerance = tolerance(case.mission, &case.network.graphs, &watch, &looked.watched);
    let judged = watch.judge(&errors(summary, f64::INFINITY), tolerance);
    Some(TheoryRow {
        value: format!("{}; {}", network_words(&watch), margins(&watch)),
        holds: Some(matches!(judged, Judgement::Covered { .. })),
        predicted: promise(&watch, tolerance),
        guaranteed_rate: watch.envelope.as_ref().map(|envelope| envelope.rate),
        measured: format!("{judged}{}", before_absence(case, &looked).unwrap_or_default()),
        ..empty()
    })
}

/// What is guaranteed for the network as it was: the monitor's envelope, or what other laws' statements promise.
pub fn guarantee_of_flight(mission: &Mission, summary: &Summary) -> Option<Guarantee> {
    let case = Case::new(mission, Some(summary));
    let Some(looked) = looked_for(mission, &case.network) else { return guarantee_of(&case) };
    let seen = seen(mission, summary.fleet.connectivity.as_ref()?, &looked)?;
    let broken = looked.broken.iter().cloned().chain(absent(&summary.fleet.absences)).collect();
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
    // No link is up for a shorter time than the dwell time.
    let period = mission.control_period * mission.message_ticks;
    let exchange = Exchange {
        age: age(mission, mission.validity.map_or(length, |validity| period.max(validity))),
        shortest_up: dwell,
        unheard: (period.secs() / dwell.secs().max(1e-9)).min(1.0),
    };
    let seen = Seen { length, alpha, t_0: Some(t_0), dwell, mean: None, exchange: Some(exchange) };
    let watch = monitor::watch(&looked.watched, graphs, seen, looked.broken);
    let tolerance = tolerance(mission, graphs, &watch, &looked.watched);
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

/// What can be said of the flight before the first vehicle fell silent.
fn before_absence(case: &Case<'_>, looked: &Looked) -> Option<String> {
    let summary = case.summary?;
    let first = summary.fleet.absences.first()?;
    let seen = seen(case.mission, summary.fleet.connectivity_before.as_ref()?, looked)?;
    let watch = monitor::watch(&looked.watched, &case.network.graphs, seen, looked.broken.clone());
    let tolerance = tolerance(case.mission, &case.network.graphs, &watch, &looked.watched);
    let judged = watch.judge(&errors(summary, first.from_s), tolerance);
    Some(format!("; judged until {:.1} s alone: {judged}", first.from_s))
}

/// A law that no statement about switching networks speaks of.
fn of_other_laws(case: &Case<'_>, absences: &[Absence]) -> TheoryRow {
    let rows = law_rows(case);
    let spoken: Vec<&TheoryRow> = rows.iter().filter(|row| row.holds.is_some()).collect();
    let absent = absent(absences);
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
    let (holds, measured) = match (spoken.is_empty(), failing.is_empty()) {
        (true, true) => (None, "not covered: no statement speaks of a law without coordination".to_string()),
        (_, false) => (Some(false), format!("not covered: {}", failing.join("; "))),
        (false, true) => (Some(true), format!("covered by {names}, without an envelope")),
    };
    let value = case.summary.and_then(|summary| summary.fleet.connectivity.as_ref()).map_or("–".into(), measured_words);
    TheoryRow {
        value: match names.is_empty() {
            true => value,
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
pub(super) fn margins(watch: &Watch) -> String {
    let words = watch.margins.iter().map(|margin| {
        format!("{}: {} = {:.4}, limit {:.4}", margin.statement, margin.quantity, margin.value, margin.limit)
    });
    words.collect::<Vec<_>>().join("; ")
}
