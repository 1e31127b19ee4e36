//! The runs of a sweep on disk: each is appended as it is over, so that an interrupted sweep goes on where it was.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Broken;
use super::measure::MEASURES;
use super::plan::Plan;
use super::setting::shown;
use crate::folder::write;

/// What became of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Index of its cell.
    pub cell: usize,
    /// Which repeat of the cell it is, from 0.
    pub repeat: u32,
    /// `finished`, or why it was not flown to its end.
    pub outcome: String,
    /// The measures, in their order; `None` where the run does not have one.
    pub numbers: Vec<Option<f64>>,
}

/// The outcome of a run that was flown to its end.
pub const FINISHED: &str = "finished";

/// Name of the table of all runs.
pub const RUNS: &str = "runs.csv";
const HEAD: &str = "sweep.json";

/// What the runs in a folder have in common; runs of another sweep are not mixed in.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    version: String,
    mission: String,
    digest: String,
    keys: Vec<String>,
}

/// The table of runs, open for more.
#[derive(Debug)]
pub struct Store {
    file: File,
    path: PathBuf,
}

impl Store {
    /// Opens the table in a folder, with the runs of the plan that are there already.
    ///
    /// # Errors
    /// What cannot be read or written, or that the folder holds another sweep, or runs that the plan does not have. Then it
    /// is left as it is.
    pub fn open(folder: &Path, plan: &Plan) -> Result<(Store, Vec<Run>), Broken> {
        fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
        let head = Head {
            version: env!("CARGO_PKG_VERSION").into(),
            mission: plan.mission.name.clone(),
            digest: format!("{:016x}", plan.mission.digest),
            keys: plan.settings.iter().map(|setting| setting.key.clone()).collect(),
        };
        let path = folder.join(RUNS);
        let failed = |error: std::io::Error| format!("cannot open {}: {error}", path.display());
        let runs = match fs::read_to_string(folder.join(HEAD)) {
            Ok(text) => {
                let found: Head = serde_json::from_str(&text).map_err(|error| format!("{HEAD}: {error}"))?;
                if found != head {
                    let reason = "of another mission, other keys or another version; give another folder with --out";
                    return Err(Broken::Refused(format!("{} holds a sweep {reason}", folder.display())));
                }
                let text = fs::read_to_string(&path).map_err(failed)?;
                // A run that was cut off while it was written is flown again.
                let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
                let held = read(whole, plan).map_err(|reason| format!("{}: {reason}", path.display()))?;
                if let Some(first) = held.others.first() {
                    return Err(Broken::Refused(held.refusal(folder, first)));
                }
                if whole.len() < text.len() {
                    OpenOptions::new()
                        .write(true)
                        .open(&path)
                        .and_then(|f| f.set_len(whole.len() as u64))
                        .map_err(failed)?;
                }
                held.runs
            }
            Err(error) => {
                if error.kind() != ErrorKind::NotFound {
                    return Err(format!("cannot read {}: {error}", folder.join(HEAD).display()).into());
                }
                let rows = fs::read_to_string(&path).map_or(0, |text| text.lines().skip(1).count());
                if rows > 0 {
                    let found =
                        format!("{} with {rows} runs, and no {HEAD} that says of which mission", path.display());
                    return Err(Broken::Refused(format!("found {found}; allowed: another folder with --out")));
                }
                write(&path, line(&columns(plan)).as_bytes())?;
                write(&folder.join(HEAD), &serde_json::to_vec_pretty(&head).unwrap_or_default())?;
                Vec::new()
            }
        };
        let file = OpenOptions::new().append(true).open(&path).map_err(failed)?;
        Ok((Store { file, path }, runs))
    }

    /// Adds a run.
    ///
    /// # Errors
    /// Why it cannot be written.
    pub fn append(&mut self, plan: &Plan, run: &Run) -> Result<(), String> {
        // One write, so that a line is there as a whole or is the last.
        let written = self.file.write_all(line(&fields(plan, run)).as_bytes());
        written.map_err(|error| format!("cannot write {}: {error}", self.path.display()))
    }

    /// Writes all runs anew, in the order of the plan.
    ///
    /// # Errors
    /// Why they cannot be written.
    pub fn rewrite(self, plan: &Plan, runs: &[Run]) -> Result<(), String> {
        let lines = runs.iter().map(|run| line(&fields(plan, run)));
        let text: String = std::iter::once(line(&columns(plan))).chain(lines).collect();
        let beside = self.path.with_extension("csv.part");
        write(&beside, text.as_bytes())?;
        fs::rename(&beside, &self.path).map_err(|error| format!("cannot write {}: {error}", self.path.display()))
    }
}

/// The columns of the table.
pub fn columns(plan: &Plan) -> Vec<String> {
    let keys = plan.settings.iter().map(|setting| setting.key.clone());
    let own = ["repeat", "seed", "outcome"].map(String::from);
    keys.chain(own).chain(MEASURES.iter().map(|measure| measure.name.to_string())).collect()
}

fn fields(plan: &Plan, run: &Run) -> Vec<String> {
    let values = plan.cells[run.cell].values.iter().map(shown);
    let own = [run.repeat.to_string(), plan.seed(run.cell, run.repeat).to_string(), run.outcome.clone()];
    let number = |value: &Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    values.chain(own).chain(run.numbers.iter().map(number)).collect()
}

fn line(fields: &[String]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let written = writer.write_record(fields).map_err(|error| error.to_string());
    let bytes = written.and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    String::from_utf8(bytes.unwrap_or_default()).unwrap_or_default()
}

/// What a table holds.
struct Held {
    /// The runs of the plan.
    runs: Vec<Run>,
    /// Other runs, of a sweep that was larger or had other values: which, in words.
    others: Vec<String>,
}

impl Held {
    /// Why a plan that lacks runs is not flown into their folder.
    fn refusal(&self, folder: &Path, first: &str) -> String {
        let (others, all) = (self.others.len(), self.others.len() + self.runs.len());
        format!(
            "{}: found {all} runs, of which this sweep does not have {others} (the first: {first}), so that they would be lost; \
             allowed: the same sweep here, or a larger one with all values and repeats of the runs that are here; or another \
             folder with --out",
            folder.display()
        )
    }
}

/// The runs of a table, each once: two sweeps at a time may have flown the same. Those with a number that cannot be read are left out and
/// flown again.
fn read(text: &str, plan: &Plan) -> Result<Held, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let expected = columns(plan);
    let header = reader.headers().map_err(|error| error.to_string())?;
    if header.iter().ne(expected.iter().map(String::as_str)) {
        return Err(format!(
            "found the columns {}; allowed: {}",
            header.iter().collect::<Vec<_>>().join(","),
            expected.join(",")
        ));
    }
    let keys = plan.settings.len();
    let cells: HashMap<Vec<String>, usize> =
        plan.cells.iter().enumerate().map(|(index, cell)| (cell.values.iter().map(shown).collect(), index)).collect();
    let number = |field: &str| match field {
        "" => Some(None),
        _ => field.parse::<f64>().ok().filter(|value| value.is_finite()).map(Some),
    };
    let mut there = HashSet::new();
    let mut held = Held { runs: Vec::new(), others: Vec::new() };
    for row in reader.records() {
        let row: Vec<String> = row.map_err(|error| error.to_string())?.iter().map(String::from).collect();
        let planned = cells
            .get(&row[..keys])
            .zip(row[keys].parse::<u32>().ok())
            .filter(|(cell, repeat)| *repeat < plan.repeats && row[keys + 1] == plan.seed(**cell, *repeat).to_string());
        let Some((&cell, repeat)) = planned else {
            let values = plan.settings.iter().zip(&row).map(|(setting, value)| format!("{}={value}", setting.key));
            let values: Vec<String> = values.collect();
            held.others.push(format!("{} repeat {}", values.join(" "), row[keys]));
            continue;
        };
        let numbers: Option<Vec<Option<f64>>> = row[keys + 3..].iter().map(|field| number(field)).collect();
        let Some(numbers) = numbers.filter(|_| there.insert((cell, repeat))) else { continue };
        held.runs.push(Run { cell, repeat, outcome: row[keys + 2].clone(), numbers });
    }
    Ok(held)
}
