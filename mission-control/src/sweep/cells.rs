//! Statistics of every cell over its repeats.

use super::measure::MEASURES;
use super::plan::Plan;
use super::setting::shown;
use super::store::{FINISHED, Run};
use crate::results::statistics::{mean, quantile, sorted};

/// A measure over the repeats of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// Half of the runs are below.
    pub median: f64,
    /// Between these the median of ever so many runs is, with a confidence of 95 % or more; `None` with fewer than six runs.
    pub sure: Option<(f64, f64)>,
    /// One run in twenty is below.
    pub low: f64,
    /// One run in twenty is above.
    pub high: f64,
}

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub struct CellStatistics {
    /// Runs that are over.
    pub runs: usize,
    /// Of these, flown to their end.
    pub finished: usize,
    /// For every measure, its spread over the runs that have it.
    pub spreads: Vec<Option<Spread>>,
}

/// The column with the commands.
pub const REPLAY: &str = "replay";

/// The statistics of all cells, in the order of the plan.
pub fn statistics(plan: &Plan, runs: &[Run]) -> Vec<CellStatistics> {
    let mut of_cell: Vec<Vec<&Run>> = vec![Vec::new(); plan.cells.len()];
    runs.iter().for_each(|run| of_cell[run.cell].push(run));
    let spread = |runs: &[&Run], measure: usize| {
        let values: Vec<f64> = runs.iter().filter_map(|run| run.numbers.get(measure).copied().flatten()).collect();
        let ascending = sorted(&values);
        Some(Spread {
            median: quantile(&ascending, 0.5)?,
            sure: sure_of_median(&ascending),
            low: quantile(&ascending, 0.05)?,
            high: quantile(&ascending, 0.95)?,
            mean: mean(values),
        })
    };
    let cell = |runs: &Vec<&Run>| CellStatistics {
        runs: runs.len(),
        finished: runs.iter().filter(|run| run.outcome == FINISHED).count(),
        spreads: (0..MEASURES.len()).map(|measure| spread(runs, measure)).collect(),
    };
    of_cell.iter().map(cell).collect()
}

/// The confidence interval of the median from ranks, which assumes nothing about how the runs are spread: the k-th of n
/// values and the k-th from above, k the largest with 2 P(B ≤ k − 1) ≤ 5 %, B binomial with n and ½.
fn sure_of_median(ascending: &[f64]) -> Option<(f64, f64)> {
    let count = ascending.len() as f64;
    // ln P(B = i), from one i to the next; the power itself would be 0 for a thousand runs.
    let mut term = -count * std::f64::consts::LN_2;
    let (mut below, mut rank) = (0.0, 0);
    while rank < ascending.len() {
        below += term.exp();
        if 2.0 * below > 0.05 {
            break;
        }
        rank += 1;
        term += ((count - rank as f64 + 1.0) / rank as f64).ln();
    }
    let at = rank.checked_sub(1)?;
    Some((*ascending.get(at)?, *ascending.get(ascending.len() - rank)?))
}

/// What the columns of every measure are called.
const PARTS: [&str; 6] = ["mean", "median", "median_from", "median_to", "q05", "q95"];

/// The statistics as CSV: the values of the cell, six columns for every measure, and the command that flies the first run of
/// the cell again.
pub fn csv(plan: &Plan, cells: &[CellStatistics]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let keys = plan.settings.iter().map(|setting| setting.key.clone());
    let of_measures = MEASURES.iter().flat_map(|m| PARTS.map(|part| format!("{}_{part}", m.name)));
    let header = keys.chain(["runs", "finished"].map(String::from)).chain(of_measures);
    let _ = writer.write_record(header.chain([REPLAY.to_string()]));
    for (index, (planned, cell)) in plan.cells.iter().zip(cells).enumerate() {
        let values = planned.values.iter().map(shown);
        let counts = [cell.runs.to_string(), cell.finished.to_string()];
        let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        let numbers = cell.spreads.iter().flat_map(|spread| {
            let (from, to) = spread.and_then(|s| s.sure).unzip();
            let part = |of: fn(&Spread) -> f64| spread.as_ref().map(of);
            [part(|s| s.mean), part(|s| s.median), from, to, part(|s| s.low), part(|s| s.high)].map(text)
        });
        let _ = writer.write_record(values.chain(counts).chain(numbers).chain([plan.replay(index, 0)]));
    }
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use common::mission::Mission;

    use super::*;
    use crate::sweep::setting::Setting;

    #[test]
    fn a_cell_is_summed_up_over_its_repeats() {
        let text = include_str!("../../../missions/thesis/fig-1-9.toml");
        let mission = Arc::new(Mission::parse("m", text).expect("sound"));
        let settings = vec![Setting::parse("network.loss=0,0.5").expect("a setting")];
        let plan = Plan::new("m", mission, settings, 20).expect("sound");
        let run = |repeat: u32| Run {
            cell: 1,
            repeat,
            outcome: if repeat == 0 { "aborted".into() } else { FINISHED.into() },
            numbers: vec![(repeat > 0).then(|| f64::from(repeat)); MEASURES.len()],
        };
        let runs: Vec<Run> = (0..20).map(run).collect();
        let cells = statistics(&plan, &runs);
        assert_eq!((cells[0].runs, cells[0].spreads[0]), (0, None));
        assert_eq!((cells[1].runs, cells[1].finished), (20, 19));
        // Of 19 values the fifth from either end: 2 P(B ≤ 4) = 2·5036/2¹⁹ = 1.9 %, with the sixth it would be 6.4 %.
        let spread = Spread { mean: 10.0, median: 10.0, sure: Some((5.0, 15.0)), low: 1.0, high: 19.0 };
        assert_eq!(cells[1].spreads[0], Some(spread));
        let csv = csv(&plan, &cells);
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(
            lines[0].starts_with("network.loss.bernoulli.probability,runs,finished,coordination_initial_mean,"),
            "{csv}"
        );
        assert!(lines[1].starts_with("0,0,0,,,"), "{csv}");
        assert!(lines[2].starts_with("0.5,20,19,10,10,5,15,1,19,"), "{csv}");
        for (cell, line) in lines[1..].iter().enumerate() {
            assert!(line.ends_with(&format!(",{}", plan.replay(cell, 0))), "{line}");
        }
    }

    #[test]
    fn a_median_is_sure_between_ranks_that_a_fair_coin_gives() {
        let first = |count: u32| (1..=count).map(f64::from).collect::<Vec<f64>>();
        // From tables of the sign test at 5 %.
        for (count, rank) in [(6, 1), (8, 1), (9, 2), (20, 6), (50, 18), (100, 40)] {
            let expected = (f64::from(rank), f64::from(count + 1 - rank));
            assert_eq!(sure_of_median(&first(count)), Some(expected), "{count}");
        }
        assert_eq!((sure_of_median(&first(5)), sure_of_median(&[])), (None, None));
        let (from, to) = sure_of_median(&first(100_000)).expect("many");
        // About n/2 ± 0.98 √n.
        assert!((from - 49_690.0).abs() < 3.0 && (to - 50_311.0).abs() < 3.0, "{from} {to}");
    }
}
