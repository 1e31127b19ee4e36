//! `sweep`: flies a mission with every combination of some values, each several times with seeds of its own.
//!
//! | file | what it does |
//! |---|---|
//! | [`setting`] | what `--set` says |
//! | [`change`] | sets keys of a mission file |
//! | [`plan`] | cells, seeds, and the command that flies a run again |
//! | [`measure`] | the numbers kept of every run |
//! | [`store`] | `runs.csv`, appended to as runs are over |
//! | `parquet` | `runs.parquet` |
//! | [`cells`] | `cells.csv`: mean, median with its confidence, 5 to 95 % of every cell, and the command that flies it again |
//! | [`picture`] | curve, heat map, or several heat maps |
//! | `finding` | a sentence about what was found |
//! | `page` | `README.md` |
//! | [`study`] | several sweeps and a picture of them, from a file |

pub mod cells;
pub mod change;
mod finding;
pub mod measure;
mod page;
mod parquet;
pub mod picture;
pub mod plan;
pub mod setting;
pub mod store;
pub mod study;

use std::fmt;
use std::path::Path;

use self::cells::{CellStatistics, statistics};
use self::measure::MEASURES;
use self::plan::Plan;
use self::store::{FINISHED, Run, Store};
use crate::batch::{fly, on_all_cores};
use crate::folder::write;

/// What came of a sweep.
#[derive(Clone, Debug)]
pub struct Swept {
    /// The runs that are over, in the order of the plan.
    pub runs: Vec<Run>,
    /// Runs that were there already.
    pub found: usize,
    /// Whether every run is over.
    pub complete: bool,
    /// The statistics of all cells.
    pub cells: Vec<CellStatistics>,
}

/// Why a sweep did not come to its end.
#[derive(Debug)]
pub enum Broken {
    /// The folder holds what this sweep would not keep; the command is at fault.
    Refused(String),
    /// A file cannot be read or written.
    File(String),
}

impl Broken {
    /// What the program ends with.
    pub fn exit_code(&self) -> u8 {
        match self {
            Broken::Refused(_) => 2,
            Broken::File(_) => 4,
        }
    }
}

impl From<String> for Broken {
    fn from(reason: String) -> Broken {
        Broken::File(reason)
    }
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Broken::Refused(reason) | Broken::File(reason) => f.write_str(reason),
        }
    }
}

/// Flies the runs of a plan that a folder does not have yet, on all cores, and writes the tables. `over` is told of every
/// run that is over; once it returns false, no further run is begun.
///
/// # Errors
/// What cannot be read or written, or what the folder holds that the plan does not have: nothing that was flown is lost.
pub fn sweep(plan: &Plan, out: &Path, mut over: impl FnMut(usize, usize) -> bool) -> Result<Swept, Broken> {
    let (mut store, mut runs) = Store::open(out, plan)?;
    let found = runs.len();
    let total = plan.cells.len() * plan.repeats as usize;
    let mut missing = vec![true; total];
    let place = |cell: usize, repeat: u32| cell * plan.repeats as usize + repeat as usize;
    runs.iter().for_each(|run| missing[place(run.cell, run.repeat)] = false);
    // Repeat by repeat, so that an interrupted sweep has something of every cell.
    let jobs: Vec<(usize, u32)> = (0..plan.repeats)
        .flat_map(|repeat| (0..plan.cells.len()).map(move |cell| (cell, repeat)))
        .filter(|&(cell, repeat)| missing[place(cell, repeat)])
        .collect();
    let mut broken = None;
    if over(found, total) {
        on_all_cores(
            &jobs,
            |&(cell, repeat)| flown(plan, cell, repeat),
            |_, run| {
                broken = store.append(plan, &run).err();
                runs.push(run);
                broken.is_none() && over(runs.len(), total)
            },
        );
    }
    if let Some(reason) = broken {
        return Err(reason.into());
    }
    runs.sort_by_key(|run| place(run.cell, run.repeat));
    let complete = runs.len() == total;
    let cells = statistics(plan, &runs);
    if complete {
        store.rewrite(plan, &runs)?;
        parquet::write_parquet(&out.join("runs.parquet"), plan, &runs)?;
        write(&out.join("cells.csv"), cells::csv(plan, &cells).as_bytes())?;
    }
    Ok(Swept { runs, found, complete, cells })
}

fn flown(plan: &Plan, cell: usize, repeat: u32) -> Run {
    match plan.mission(cell, repeat).and_then(|mission| fly(&mission)) {
        Ok(flight) => {
            let number = |measure: &measure::Measure| (measure.of)(&flight.summary).filter(|value| value.is_finite());
            Run { cell, repeat, outcome: FINISHED.into(), numbers: MEASURES.iter().map(number).collect() }
        }
        Err(reason) => Run { cell, repeat, outcome: reason, numbers: vec![None; MEASURES.len()] },
    }
}

/// Writes the picture and the page of a complete sweep.
///
/// # Errors
/// What cannot be written.
pub fn show(plan: &Plan, swept: &Swept, measure: usize, command: &str, out: &Path) -> Result<(), String> {
    let picture = picture::picture(plan, &swept.cells, measure, "sweep");
    if let Some(svg) = &picture {
        write(&out.join("sweep.svg"), svg.as_bytes())?;
    }
    let page = page::page(plan, swept, measure, command, picture.is_some());
    write(&out.join("README.md"), page.as_bytes())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;
    use std::sync::Arc;

    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use common::mission::Mission;

    use super::setting::Setting;
    use super::store::RUNS;
    use super::*;

    fn plan(losses: &str, repeats: u32) -> Plan {
        let text =
            include_str!("../../../tests/missions/loss-delay.toml").replace("duration_s = 25.0", "duration_s = 5.0");
        let mission = Arc::new(Mission::parse("m.toml", &text).expect("sound"));
        let settings = vec![Setting::parse(losses).expect("a setting")];
        Plan::new("m.toml", mission, settings, repeats).expect("sound")
    }

    fn runs_csv(folder: &Path) -> String {
        fs::read_to_string(folder.join(RUNS)).expect("a table")
    }

    fn temporary() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("sweep");
        (folder, out)
    }

    #[test]
    fn every_cell_is_flown_with_every_seed_and_written_down() {
        let (_folder, out) = temporary();
        let plan = plan("network.loss=0,0.5", 3);
        let swept = sweep(&plan, &out, |_, _| true).expect("swept");
        assert!(swept.complete && swept.runs.len() == 6 && swept.found == 0);
        assert!(swept.runs.iter().all(|run| run.outcome == FINISHED), "{:?}", swept.runs);
        let table = runs_csv(&out);
        assert_eq!(table.lines().count(), 7);
        assert!(table.starts_with("network.loss.bernoulli.probability,repeat,seed,outcome,coordination_initial,"));
        let delivered = measure::index_of("delivered").expect("a measure");
        let median = |cell: usize| swept.cells[cell].spreads[delivered].expect("runs").median;
        assert!(median(1) < 0.8 * median(0), "{} and {}", median(0), median(1));
        let file = fs::File::open(out.join("runs.parquet")).expect("a table");
        let reader = SerializedFileReader::new(file).expect("Parquet");
        assert_eq!(reader.metadata().file_metadata().num_rows(), 6);
        let row = reader.get_row_iter(None).expect("rows").next().expect("a row").expect("a row").to_string();
        assert!(row.contains(&format!("seed: {}", plan.seed(0, 0))) && row.contains("outcome: \"finished\""), "{row}");
        show(&plan, &swept, delivered, "mission-control sweep", &out).expect("written");
        let page = fs::read_to_string(out.join("README.md")).expect("a page");
        assert!(page.contains("sweep.svg") && page.contains(&plan.replay(1, 0)), "{page}");
    }

    #[test]
    fn an_interrupted_sweep_goes_on_and_ends_as_one_that_was_not() {
        let (_folder, out) = temporary();
        let plan = plan("network.loss=0,0.5", 3);
        let first = sweep(&plan, &out, |over, _| over < 2).expect("swept");
        assert!(!first.complete && first.runs.len() >= 2, "{}", first.runs.len());
        // As if the program had been killed while it wrote the next line.
        let cut = format!("{}0.5,2,77,fini", runs_csv(&out));
        fs::write(out.join(RUNS), cut).expect("written");
        let second = sweep(&plan, &out, |_, _| true).expect("swept");
        assert!(second.complete && second.found == first.runs.len());
        let (_other, whole) = temporary();
        sweep(&plan, &whole, |_, _| true).expect("swept");
        assert_eq!(runs_csv(&out), runs_csv(&whole));
    }

    #[test]
    fn a_table_with_twins_and_garbled_numbers_is_made_whole() {
        let (_folder, out) = temporary();
        let plan = plan("network.loss=0,0.5", 2);
        sweep(&plan, &out, |_, _| true).expect("swept");
        let whole = runs_csv(&out);
        let lines: Vec<&str> = whole.lines().collect();
        let number = lines[1].rsplit(',').find(|field| field.contains('.')).expect("a number");
        for garbled in ["nan", "0.1x"] {
            // The first run has a number that is none, the second is there twice, and the third not at all.
            let broken = lines[1].replace(number, garbled);
            let table = [lines[0], &broken, lines[2], lines[2], lines[4], ""].join("\n");
            fs::write(out.join(RUNS), table).expect("written");
            let again = sweep(&plan, &out, |_, _| true).expect("swept");
            assert!(again.complete && again.found == 2, "{} found", again.found);
            assert_eq!(runs_csv(&out), whole);
        }
    }

    #[test]
    fn a_table_without_its_head_is_not_overwritten() {
        let (_folder, out) = temporary();
        let plan = plan("network.loss=0,0.5", 1);
        sweep(&plan, &out, |_, _| true).expect("swept");
        let table = runs_csv(&out);
        fs::remove_file(out.join("sweep.json")).expect("there");
        let refused = sweep(&plan, &out, |_, _| true).expect_err("whose is it?");
        assert!(refused.to_string().contains("runs.csv with 2 runs, and no sweep.json"), "{refused}");
        assert_eq!(runs_csv(&out), table);
    }

    #[test]
    fn a_sweep_that_is_enlarged_keeps_its_runs_and_another_is_not_mixed_in() {
        let (_folder, out) = temporary();
        sweep(&plan("network.loss=0,0.5", 2), &out, |_, _| true).expect("swept");
        let larger = sweep(&plan("network.loss=0,0.25,0.5", 2), &out, |_, _| true).expect("swept");
        assert_eq!((larger.found, larger.runs.len()), (4, 6));
        let broken = sweep(&plan("network.delay=0,1", 2), &out, |_, _| true).expect_err("refused");
        assert!(broken.to_string().contains("holds a sweep of another mission"), "{broken}");
        assert_eq!(broken.exit_code(), 2);
    }

    #[test]
    fn a_sweep_that_would_lose_runs_is_refused_and_they_stay() {
        let (_folder, out) = temporary();
        sweep(&plan("network.loss=0:0.5:0.25", 3), &out, |_, _| true).expect("swept");
        let before = runs_csv(&out);
        for (losses, repeats, lost, first) in [
            ("network.loss=0,0.5", 3, 3, "network.loss.bernoulli.probability=0.25 repeat 0"),
            ("network.loss=0:0.5:0.25", 2, 3, "network.loss.bernoulli.probability=0 repeat 2"),
            ("network.loss=0,0.1", 2, 7, "network.loss.bernoulli.probability=0 repeat 2"),
        ] {
            let broken = sweep(&plan(losses, repeats), &out, |_, _| true).expect_err("refused");
            let expected = format!("found 9 runs, of which this sweep does not have {lost} (the first: {first})");
            let reason = broken.to_string();
            assert!(reason.contains(&expected) && reason.contains("or a larger one"), "{expected} is not in {reason}");
            assert_eq!((broken.exit_code(), runs_csv(&out)), (2, before.clone()));
        }
        let larger = sweep(&plan("network.loss=0.5,0.25,0,0.75", 4), &out, |_, _| true).expect("swept");
        assert_eq!((larger.found, larger.runs.len()), (9, 16));
    }
}
