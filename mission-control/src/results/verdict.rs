//! The verdict at the head of the report: whether all is well, and what happened in a sentence or two.

use network_emulator::hub::ENDED;

use super::html::{escape, number, on_a_terminal};
use super::series::is_early;
use super::vehicle::PATH_THRESHOLD_M;
use super::{BELOW, Facts, Loss, Report, Summary, TheoryRow};

/// How closely a steady error must agree with its prediction to count as predicted.
const PREDICTED_PART: f64 = 0.1;

/// Whether all is well, and what happened.
pub(super) fn verdict(report: &Report<'_>) -> (bool, String) {
    let (good, sentences) = sentences(report);
    (good, sentences.join(" "))
}

/// The sentences of the verdict as a terminal shows them.
pub(super) fn headline(report: &Report<'_>) -> Vec<String> {
    sentences(report).1.iter().map(|sentence| on_a_terminal(sentence)).collect()
}

/// Whether all is well, and the sentences about it, as HTML.
fn sentences(report: &Report<'_>) -> (bool, Vec<String>) {
    let Report { facts, summary, .. } = report;
    let flown = summary.vehicles.iter().filter(|vehicle| vehicle.rows > 0).count();
    if flown == 0 {
        return (false, vec!["Nothing was recorded.".into()]);
    }
    let is_whole = summary.complete && summary.fleet.messages.balanced;
    let coordinated = (flown > 1).then(|| of_coordination(summary));
    let parts = [
        of_end(report),
        of_speeds(facts),
        of_losses(summary),
        of_those_that_gave_up(summary),
        coordinated,
        Some(of_paths(summary, facts, flown)),
        of_conditions(report.theory),
        of_rate(report.theory),
    ];
    let parts = || parts.iter().flatten();
    let sentences = parts().map(|(_, sentence)| sentence.clone()).collect();
    (is_whole && parts().all(|(good, _)| *good), sentences)
}

/// That the flight ended before its time, and why.
fn of_end(report: &Report<'_>) -> Option<(bool, String)> {
    let (flown_s, planned_s) = (report.summary.duration_s, report.facts.planned_s);
    if !is_early(flown_s, planned_s) {
        return None;
    }
    let why = report.clock.notes.iter().rev().find_map(|note| note.text.strip_prefix(ENDED));
    let why = why.map_or("The recording ends".to_owned(), |why| {
        let mut letters = why.chars();
        let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
        escape(&format!("{first}{}", letters.as_str()))
    });
    Some((false, format!("<strong>{why}</strong> at {} of {} s.", number(flown_s), number(planned_s))))
}

/// Formation speeds that were commanded under way: the numbers are of more than one.
fn of_speeds(facts: &Facts) -> Option<(bool, String)> {
    let (last_s, last) = facts.commanded.last()?;
    let often = match facts.commanded.len() {
        1 => String::new(),
        times => format!(", the last of {times} times"),
    };
    let (last, at) = (number(*last), number(*last_s));
    Some((true, format!("The formation speed v_L was changed under way to {last} /s at {at} s{often}.")))
}

/// Who was lost, when, and of whom the numbers are then.
fn of_losses(summary: &Summary) -> Option<(bool, String)> {
    let lost = &summary.fleet.lost;
    let one = |loss: &Loss| {
        let (id, since_s) = (escape(&loss.vehicle), loss.since_s().map(number));
        match (since_s, loss.recorded_until_s.map(number)) {
            (Some(at), Some(_)) => format!("<strong>{id} was lost at {at} s</strong>"),
            (Some(at), None) => format!("<strong>{id} was lost at {at} s</strong>, and there is no log of it"),
            (None, Some(at)) => format!("<strong>The log of {id} ends at {at} s</strong>"),
            (None, None) => format!("<strong>There is no log of {id}</strong>"),
        }
    };
    let sentences: Vec<String> = lost.iter().map(one).collect();
    let measured = summary.vehicles.iter().filter(|vehicle| vehicle.rows > 0);
    let others: Vec<String> = measured.map(|vehicle| escape(&vehicle.id)).collect();
    let of_the_others = match lost.iter().any(|loss| loss.recorded_until_s.is_none()) {
        true => format!(": the numbers are of {}", listed(&others)),
        false => String::new(),
    };
    (!lost.is_empty()).then(|| (false, format!("{}{of_the_others}.", sentences.join("; "))))
}

/// Who gave up, and why.
fn of_those_that_gave_up(summary: &Summary) -> Option<(bool, String)> {
    let aborted: Vec<String> = summary.fleet.aborted.iter().map(|text| escape(text)).collect();
    (!aborted.is_empty()).then(|| (false, format!("<strong>{}</strong>.", aborted.join("; "))))
}

/// a, b and c.
fn listed(names: &[String]) -> String {
    match names {
        [] => "nobody".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Whether the fleet came together and stayed so to the end.
fn of_coordination(summary: &Summary) -> (bool, String) {
    let coordination = &summary.fleet.coordination;
    let early = coordination.early(summary.duration_s);
    let (initial, last) = (number(coordination.initial), number(coordination.last));
    // An error that was never measured is none that is small.
    let (settled, range) = match (coordination.last_s, early) {
        (None, _) => (None, "the vehicles were never recorded together".to_owned()),
        (Some(_), early) => {
            let settled = coordination.settled_s.or(coordination.settled_absolute_s);
            let when = early.map_or(String::new(), |at| format!(" at {} s, when all were last recorded", number(at)));
            (settled, format!("the largest coordination error went from {initial} to {last}{when}"))
        }
    };
    let sentence = match settled {
        Some(at) => format!("<strong>Coordinated after {} s</strong>: {range}.", number(at)),
        None => format!("<strong>Not coordinated at the end</strong>: {range}."),
    };
    (settled.is_some() && early.is_none(), sentence)
}

/// Whether every vehicle that flew came to its path, or to the distance from it at which its law leaves it.
fn of_paths(summary: &Summary, facts: &Facts, flown: usize) -> (bool, String) {
    let fleet = &summary.fleet;
    if let Some(at) = fleet.on_path_s {
        let each = if flown > 1 { "Every vehicle" } else { "The vehicle" };
        let within = number(PATH_THRESHOLD_M);
        return (true, format!("{each} stayed within {within} m of its path from {} s on.", number(at)));
    }
    // A steady error that theory predicts is no surprise: the design vector δ of Theorem 4.7 leaves one.
    let biases = facts.vehicles.iter().filter_map(|vehicle| vehicle.predicted_along_bias_m.map(f64::abs));
    let bias = biases.max_by(f64::total_cmp);
    let as_predicted = bias.filter(|bias| (fleet.path_error_final_m - bias).abs() <= PREDICTED_PART * bias);
    let by_design =
        as_predicted.map_or(String::new(), |bias| format!(", of the {} m that the law leaves by design", number(bias)));
    let end = number(fleet.path_error_final_m);
    (as_predicted.is_some(), format!("The largest path-following error at the end was {end} m{by_design}."))
}

/// Statements whose premises are not met, if any: that is no failure of the fleet, but nothing is promised then.
fn of_conditions(theory: &[TheoryRow]) -> Option<(bool, String)> {
    let failed = theory.iter().filter(|row| row.holds == Some(false)).count();
    let (noun, verb) = if failed == 1 { ("statement", "does") } else { ("statements", "do") };
    (failed > 0).then(|| (false, format!("{failed} {noun} of the theory {verb} not cover this flight.")))
}

/// A guaranteed rate that was not reached, if one was not.
fn of_rate(theory: &[TheoryRow]) -> Option<(bool, String)> {
    theory.iter().any(TheoryRow::is_below).then(|| (false, format!("The coordination error decayed {BELOW}.")))
}
