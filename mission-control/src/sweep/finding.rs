//! What a sweep or a study found, as a sentence made of its numbers.

use super::cells::CellStatistics;
use super::measure::MEASURES;
use super::page::{short, to_digits};
use super::plan::Plan;
use super::setting::{Setting, shown};

/// Between the errors that all sweeps reach, so many are compared.
const COMPARED: u32 = 9;

/// What each swept key does to the median, alone and together with the others; `None` where a value is missing, or with no
/// ratio to speak of.
pub(super) fn of_sweep(plan: &Plan, cells: &[CellStatistics], measure: usize) -> Option<String> {
    let swept = |index: &usize| plan.settings[*index].values.len() > 1;
    let keys: Vec<usize> = (0..plan.settings.len()).filter(swept).collect();
    // The cell in which the keys of a set have their last values, and all others their first.
    let corner = |last: &[usize]| {
        let place = |index: usize, setting: &Setting| if last.contains(&index) { setting.values.len() - 1 } else { 0 };
        plan.settings.iter().enumerate().fold(0, |cell, (index, s)| cell * s.values.len() + place(index, s))
    };
    let median =
        |last: &[usize]| Some(cells.get(corner(last))?.spreads[measure]?.median).filter(|median| *median > 0.0);
    let first = median(&[])?;
    let times = |last: &[usize]| Some(format!("{} times as much", to_digits(median(last)? / first, 3)));
    let span = |index: usize| {
        let Setting { key, values } = &plan.settings[index];
        format!("`{key}` = {}", values.last().map(shown).unwrap_or_default())
    };
    let alone = keys.iter().map(|key| Some(format!("{} with {}", times(&[*key])?, span(*key))));
    let mut parts: Vec<String> = alone.collect::<Option<_>>()?;
    if keys.len() > 1 {
        parts.push(format!("{} with {}", times(&keys)?, if keys.len() == 2 { "both" } else { "all of them" }));
    }
    let begin: Vec<String> = keys
        .iter()
        .map(|index| &plan.settings[*index])
        .map(|Setting { key, values }| format!("`{key}` = {}", values.first().map(shown).unwrap_or_default()))
        .collect();
    (!parts.is_empty()).then(|| {
        let about = MEASURES[measure].about;
        format!("Found ({about}): {} with {}; {}.", short(first), begin.join(" and "), parts.join(", "))
    })
}

/// How much more of a measure each sweep takes than the most sparing one, for the same value of another measure; `None` if
/// there is no value that all of them reach.
pub(super) fn against(sweeps: &[(&str, &[CellStatistics])], measure: usize, over: usize) -> Option<String> {
    let curves: Vec<Vec<(f64, f64)>> = sweeps.iter().map(|(_, cells)| points(cells, measure, over)).collect();
    let reach = |better: fn(f64, f64) -> f64, begin: f64| {
        curves.iter().map(move |curve| curve.iter().map(|point| point.1).fold(begin, better))
    };
    let low = reach(f64::min, f64::INFINITY).fold(0.0, f64::max);
    let high = reach(f64::max, 0.0).fold(f64::INFINITY, f64::min);
    if curves.len() < 2 || !(low > 0.0 && high.is_finite() && low < high) {
        return None;
    }
    let values = (0..COMPARED).map(|step| low * (high / low).powf(f64::from(step) / f64::from(COMPARED - 1)));
    let takes = |value: f64| curves.iter().map(|curve| first_at(curve, value)).collect::<Option<Vec<f64>>>();
    let all: Vec<(f64, Vec<f64>)> = values.filter_map(|value| Some((value, takes(value)?))).collect();
    let (value, middle) = all.get(all.len() / 2)?;
    let best = (0..middle.len()).min_by(|a, b| middle[*a].total_cmp(&middle[*b]))?;
    let (about, what) = (MEASURES[measure].about, MEASURES[over].about);
    let others = (0..sweeps.len()).filter(|index| *index != best).map(|index| {
        let ratios = || all.iter().map(|(_, takes)| takes[index] / takes[best]);
        let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
        format!(
            "{} takes {}, {} times as many (between {} and {}: {} to {} times)",
            sweeps[index].0,
            whole(middle[index]),
            to_digits(middle[index] / middle[best], 2),
            short(low),
            short(high),
            to_digits(least, 2),
            to_digits(most, 2)
        )
    });
    let others: Vec<String> = others.collect();
    let (best, taken) = (sweeps[best].0, whole(middle[best]));
    Some(format!("Found: for {} ({about}) {best} takes {taken} {what}; {}.", short(*value), others.join(", ")))
}

/// Medians of a sweep: of one measure, and of another; in the order of the first.
fn points(cells: &[CellStatistics], measure: usize, over: usize) -> Vec<(f64, f64)> {
    let point = |cell: &CellStatistics| Some((cell.spreads[over]?.median, cell.spreads[measure]?.median));
    let mut points: Vec<(f64, f64)> = cells.iter().filter_map(point).filter(|p| p.0 > 0.0 && p.1 > 0.0).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// Where a curve first comes down to a value, on logarithmic axes straight from point to point.
fn first_at(curve: &[(f64, f64)], value: f64) -> Option<f64> {
    let near = |a: f64, b: f64| a <= b * (1.0 + 1e-9);
    let at = curve.iter().position(|point| near(point.1, value))?;
    let (after, Some(before)) = (curve[at], at.checked_sub(1).map(|before| curve[before])) else {
        return Some(curve[at].0);
    };
    let part = (value / before.1).ln() / (after.1 / before.1).ln();
    Some(before.0 * (after.0 / before.0).powf(part.clamp(0.0, 1.0)))
}

fn whole(value: f64) -> String {
    format!("{value:.0}")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use common::mission::Mission;

    use super::*;
    use crate::sweep::cells::Spread;
    use crate::sweep::measure::index_of;

    fn cell(values: &[(usize, f64)]) -> CellStatistics {
        let mut spreads = vec![None; MEASURES.len()];
        for (measure, median) in values {
            let (mean, median, low, high) = (*median, *median, *median, *median);
            spreads[*measure] = Some(Spread { mean, median, sure: None, low, high });
        }
        CellStatistics { runs: 1, finished: 1, spreads }
    }

    #[test]
    fn a_sweep_tells_what_each_key_does_alone_and_together() {
        let text = include_str!("../../../tests/missions/loss-delay.toml");
        let mission = Arc::new(Mission::parse("m.toml", text).expect("sound"));
        let sets = ["network.loss=0,0.5", "coordination.validity_s=9", "network.delay=0,1,2"];
        let settings = sets.iter().map(|text| Setting::parse(text).expect("a setting")).collect();
        let plan = Plan::new("m.toml", mission, settings, 1).expect("sound");
        let cells: Vec<CellStatistics> = [2.0, 3.0, 4.0, 5.0, 6.0, 12.0].map(|value| cell(&[(0, value)])).into();
        let found = of_sweep(&plan, &cells, 0).expect("a finding");
        for part in [
            "Found (coordination error at the start): 2.000 with `network.loss.bernoulli.probability` = 0",
            "2.50 times as much with `network.loss.bernoulli.probability` = 0.5",
            "2.00 times as much with `network.delay.constant.delay_s` = 2",
            "6.00 times as much with both",
        ] {
            assert!(found.contains(part), "{found}");
        }
        assert_eq!(of_sweep(&plan, &cells, 1), None);
    }

    #[test]
    fn two_sweeps_are_compared_at_equal_errors() {
        let (error, bytes) = (0, index_of("bytes_on_air").expect("a measure"));
        // Error = 1000/bytes and 250/bytes: a quarter of the bytes at every error.
        let sweep = |product: f64, all: &[f64]| -> Vec<CellStatistics> {
            all.iter().map(|taken| cell(&[(error, product / taken), (bytes, *taken)])).collect()
        };
        let (often, seldom) = (sweep(1000.0, &[1e3, 1e4, 1e5]), sweep(250.0, &[2e4, 200.0, 2e3]));
        let found = against(&[("often", &often), ("seldom", &seldom)], error, bytes).expect("a finding");
        let expected = "Found: for 0.1118 (coordination error at the start) seldom takes 2236 bytes on the air; often takes 8944, \
                        4.0 times as many (between 0.01250 and 1.000: 4.0 to 4.0 times).";
        assert_eq!(found, expected);
        let apart = sweep(1.0, &[1e3]);
        assert_eq!(against(&[("often", &often), ("apart", &apart)], error, bytes), None);
    }
}
