//! The numbers of a flight: those of its summary by their path, and those of a quantity over time; and whether they are
//! what was expected.

use bus::recording::Recording;
use serde_json::Value;

use crate::batch::Flight;
use crate::results::{Facts, Summary, VehicleFacts, summarise};

use super::file::{Expectation, Take};
use super::quantity::{Series, value_at};

/// What became of an expectation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Verdict {
    /// The values measured, each with its vehicle if it is of one.
    pub(super) measured: Vec<(Option<String>, f64)>,
    /// Whether all of them are as expected.
    pub(super) agrees: bool,
}

/// Looks at a flight for what is expected of it.
pub(super) fn judge(expectation: &Expectation, flight: &Flight) -> Verdict {
    let measured = match (&expectation.number, expectation.series) {
        (Some(path), _) => of_summary(path, &flight.summary),
        (None, Some(quantity)) => Series::all(quantity, flight, flight.facts.symbol())
            .into_iter()
            .map(|series| {
                let value = of_series(expectation, &series.points);
                (series.vehicle.map(|index| flight.mission.vehicles[index].id.clone()), value)
            })
            .collect(),
        (None, None) => Vec::new(),
    };
    let wanted = |id: &Option<String>| match (id, &expectation.vehicles) {
        (Some(id), Some(wanted)) => wanted.contains(id),
        _ => true,
    };
    let measured: Vec<(Option<String>, f64)> = measured.into_iter().filter(|(id, _)| wanted(id)).collect();
    let agrees = !measured.is_empty() && measured.iter().all(|(_, value)| is_expected(expectation, *value));
    Verdict { measured, agrees }
}

/// NaN is never expected.
fn is_expected(expectation: &Expectation, value: f64) -> bool {
    let near = match (expectation.value, expectation.within) {
        (Some(expected), Some(within)) => (value - expected).abs() <= within,
        _ => true,
    };
    near && value.is_finite()
        && expectation.at_most.is_none_or(|most| value <= most)
        && expectation.at_least.is_none_or(|least| value >= least)
}

/// The path of a number of every vehicle begins with this.
const EACH: &str = "vehicle";

/// Whether there is such a number in a summary.
///
/// # Errors
/// What there is in its place.
pub(super) fn check_path(path: &str) -> Result<(), String> {
    let facts = Facts { vehicles: vec![VehicleFacts::default()], ..Facts::default() };
    let summary = serde_json::to_value(summarise(&Recording::default(), &facts)).unwrap_or_default();
    let mut here = &summary;
    for step in path.split('.') {
        let next = if step == EACH { summary["vehicles"].get(0) } else { here.get(step) };
        here = match (next, here.as_object()) {
            (Some(next), _) => next,
            // What an empty flight does not have cannot be looked into.
            (None, _) if here.is_null() => return Ok(()),
            (None, Some(map)) => {
                let of_each = std::ptr::eq(here, &summary).then_some(EACH);
                let names = map.iter().filter(|(_, value)| !value.is_string() && !value.is_array());
                return Err(of_each
                    .into_iter()
                    .chain(names.map(|(name, _)| name.as_str()))
                    .collect::<Vec<_>>()
                    .join(", "));
            }
            (None, None) => return Err(format!("nothing below a number: {step:?}")),
        };
    }
    if here.is_number() || here.is_null() { Ok(()) } else { Err("the path of a number".into()) }
}

/// The number at a path; those of every vehicle for a path that says so. A number that the flight does not have is NaN.
fn of_summary(path: &str, summary: &Summary) -> Vec<(Option<String>, f64)> {
    let root = serde_json::to_value(summary).unwrap_or_default();
    let look = |from: &Value, path: &str| {
        path.split('.').try_fold(from, |here, step| here.get(step)).and_then(Value::as_f64).unwrap_or(f64::NAN)
    };
    match path.strip_prefix(EACH).and_then(|rest| rest.strip_prefix('.')) {
        Some(rest) => root["vehicles"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|vehicle| (vehicle["id"].as_str().map(str::to_owned), look(vehicle, rest)))
            .collect(),
        None => vec![(None, look(&root, path))],
    }
}

/// What is taken of a series; NaN if it has nothing there.
fn of_series(expectation: &Expectation, points: &[(f64, f64)]) -> f64 {
    if let Some(at) = expectation.at_s {
        return value_at(points, at).unwrap_or(f64::NAN);
    }
    let from = expectation.from_s.unwrap_or(f64::NEG_INFINITY) - 1e-9;
    let to = expectation.to_s.unwrap_or(f64::INFINITY) + 1e-9;
    let chosen: Vec<(f64, f64)> = points.iter().copied().filter(|point| (from..=to).contains(&point.0)).collect();
    let (Some(first), Some(last)) = (chosen.first(), chosen.last()) else { return f64::NAN };
    let count = chosen.len() as f64;
    let over = |begin: f64, fold: fn(f64, f64) -> f64| chosen.iter().map(|point| point.1).fold(begin, fold);
    match expectation.take.unwrap_or(Take::Last) {
        Take::Last => last.1,
        Take::Mean => over(0.0, |sum, value| sum + value) / count,
        Take::Rms => (over(0.0, |sum, value| sum + value * value) / count).sqrt(),
        Take::Least => over(f64::INFINITY, f64::min),
        Take::Greatest => over(f64::NEG_INFINITY, f64::max),
        Take::Magnitude => over(0.0, |greatest, value| greatest.max(value.abs())),
        Take::Swing => over(f64::NEG_INFINITY, f64::max) - over(f64::INFINITY, f64::min),
        Take::Rate => (first.1 / last.1).ln() / (last.0 - first.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(take: Take, points: &[(f64, f64)]) -> f64 {
        let expectation =
            Expectation { take: Some(take), from_s: Some(1.0), to_s: Some(3.0), ..Expectation::default() };
        of_series(&expectation, points)
    }

    #[test]
    fn what_is_taken_is_of_the_time_looked_at() {
        let points: Vec<(f64, f64)> =
            [9.0, 4.0, -2.0, 1.0, 9.0].into_iter().enumerate().map(|(t, value)| (t as f64, value)).collect();
        let expected = [
            (Take::Last, 1.0),
            (Take::Mean, 1.0),
            (Take::Rms, 7.0_f64.sqrt()),
            (Take::Least, -2.0),
            (Take::Greatest, 4.0),
            (Take::Magnitude, 4.0),
            (Take::Swing, 6.0),
            (Take::Rate, 4.0_f64.ln() / 2.0),
        ];
        for (take, value) in expected {
            assert!((taken(take, &points) - value).abs() < 1e-12, "{take:?}: {}", taken(take, &points));
        }
        assert!(taken(Take::Mean, &points[..1]).is_nan());
    }

    #[test]
    fn a_number_is_expected_within_its_bounds_and_nan_never() {
        let near = Expectation { value: Some(1.0), within: Some(0.1), ..Expectation::default() };
        let between = Expectation { at_least: Some(0.0), at_most: Some(2.0), ..Expectation::default() };
        for (expectation, value, expected) in [
            (&near, 1.09, true),
            (&near, 0.89, false),
            (&near, f64::NAN, false),
            (&between, 2.0, true),
            (&between, -0.1, false),
            (&between, f64::NAN, false),
        ] {
            assert_eq!(is_expected(expectation, value), expected, "{value}");
        }
    }

    #[test]
    fn only_numbers_of_a_summary_can_be_expected() {
        for path in ["fleet.steady_speed", "fleet.coordination.fit.rate", "vehicle.along_mean_m", "fleet.on_path_s"] {
            assert_eq!(check_path(path), Ok(()), "{path}");
        }
        assert!(check_path("fleet.speed").is_err_and(|reason| reason.contains("steady_speed")));
        assert!(check_path("vehicle.speed").is_err_and(|reason| reason.contains("steady_speed_mps")));
        assert!(check_path("flet").is_err_and(|reason| reason.contains("fleet") && reason.contains("vehicle")));
        assert!(check_path("fleet").is_err());
        assert!(check_path("mission").is_err());
    }
}
