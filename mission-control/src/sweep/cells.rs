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
    /// One in twenty is below.
    pub low: f64,
    /// One in twenty is above.
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

/// The statistics of all cells, in the order of the plan.
pub fn statistics(plan: &Plan, runs: &[Run]) -> Vec<CellStatistics> {
    let mut of_cell: Vec<Vec<&Run>> = vec![Vec::new(); plan.cells.len()];
    runs.iter().for_each(|run| of_cell[run.cell].push(run));
    let spread = |runs: &[&Run], measure: usize| {
        let values: Vec<f64> = runs.iter().filter_map(|run| run.numbers.get(measure).copied().flatten()).collect();
        let ascending = sorted(&values);
        Some(Spread {
            median: quantile(&ascending, 0.5)?,
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

/// The statistics as CSV: the values of the cell, then four columns for every measure.
pub fn csv(plan: &Plan, cells: &[CellStatistics]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let keys = plan.settings.iter().map(|setting| setting.key.clone());
    let of_measures =
        MEASURES.iter().flat_map(|m| ["mean", "median", "q05", "q95"].map(|part| format!("{}_{part}", m.name)));
    let header = keys.chain(["runs", "finished"].map(String::from)).chain(of_measures);
    let _ = writer.write_record(header);
    for (planned, cell) in plan.cells.iter().zip(cells) {
        let values = planned.values.iter().map(shown);
        let counts = [cell.runs.to_string(), cell.finished.to_string()];
        let numbers = cell.spreads.iter().flat_map(|spread| match spread {
            Some(s) => [s.mean, s.median, s.low, s.high].map(|value| value.to_string()),
            None => [const { String::new() }; 4],
        });
        let _ = writer.write_record(values.chain(counts).chain(numbers));
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
        assert_eq!(cells[1].spreads[0], Some(Spread { mean: 10.0, median: 10.0, low: 1.0, high: 19.0 }));
        let csv = csv(&plan, &cells);
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(
            lines[0].starts_with("network.loss.bernoulli.probability,runs,finished,coordination_initial_mean,"),
            "{csv}"
        );
        assert!(lines[1].starts_with("0,0,0,,,"), "{csv}");
        assert!(lines[2].starts_with("0.5,20,19,10,10,1,19,"), "{csv}");
    }
}
