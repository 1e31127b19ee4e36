//! A study: several sweeps that answer one question, from a file.

use std::fmt::Write as _;
use std::path::Path;

use common::mission::{Collector, read};
use schemars::JsonSchema;
use serde::Deserialize;

use super::measure::{MEASURES, index_of};
use super::plan::Plan;
use super::setting::Setting;
use super::{Broken, Swept, finding, page, picture, sweep};
use crate::folder::{load, write};

/// A study as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct StudyFile {
    /// The question, as a title.
    pub title: String,
    /// What is asked and what is found, in a few sentences.
    #[serde(default)]
    pub about: String,
    /// The measure that answers it; a column of the table of runs.
    pub measure: String,
    /// The measure that it is drawn over; without one, every sweep has a picture over its own keys.
    pub over: Option<String>,
    /// The sweeps.
    pub sweeps: Vec<SweepSection>,
}

/// A sweep of a study.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct SweepSection {
    /// Its name, in legends and as a folder: lower-case letters, digits and dashes.
    pub id: String,
    /// The mission file, beside the study.
    pub mission: String,
    /// What is set, as on the command line.
    pub set: Vec<String>,
    /// Runs of each cell.
    #[serde(default = "one")]
    pub repeat: u32,
    /// Whether every cell meets the same random numbers, as `sweep --paired`.
    #[serde(default)]
    pub paired: bool,
}

fn one() -> u32 {
    1
}

/// A study that can be flown.
#[derive(Debug)]
pub struct Study {
    file: StudyFile,
    plans: Vec<Plan>,
    measure: usize,
    over: Option<usize>,
}

impl Study {
    /// Reads a study, its missions, and checks every cell of every sweep.
    ///
    /// # Errors
    /// What cannot be read or flown, and why.
    pub fn read(path: &Path) -> Result<Study, String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        let is_mission = |table: toml::Table| table.contains_key("vehicles") && !table.contains_key("sweeps");
        if text.parse().is_ok_and(is_mission) {
            return Err(format!(
                "{}: found a mission file; allowed: a study file, such as missions/studies/loss-delay.toml, which names its mission. To fly a \
                 mission with many values: mission-control sweep",
                path.display()
            ));
        }
        let file: StudyFile = read(&path.display().to_string(), &text, check).map_err(|faults| faults.to_string())?;
        let beside = path.parent().unwrap_or(Path::new("."));
        let plan = |section: &SweepSection| {
            let mission = beside.join(&section.mission);
            let settings = section.set.iter().map(|text| Setting::parse(text)).collect::<Result<_, _>>()?;
            Plan::new(&mission.display().to_string(), load(&mission)?, settings, section.repeat)
                .map(|plan| plan.paired(section.paired))
                .map_err(|reason| format!("{}: {reason}", section.id))
        };
        let plans = file.sweeps.iter().map(plan).collect::<Result<_, String>>()?;
        let measure = index_of(&file.measure)?;
        let over = file.over.as_deref().map(index_of).transpose()?;
        Ok(Study { file, plans, measure, over })
    }

    /// Number of runs of all sweeps.
    pub fn runs(&self) -> usize {
        self.plans.iter().map(|plan| plan.cells.len() * plan.repeats as usize).sum()
    }

    /// Flies all sweeps into folders below `out` and writes the page. `over` is told how many runs are over, and of how many;
    /// once it returns false, no further run is begun. Whether all runs are over is returned.
    ///
    /// # Errors
    /// What cannot be read or written, or what the folder holds that the study does not have.
    pub fn make(&self, out: &Path, command: &str, mut over: impl FnMut(usize, usize) -> bool) -> Result<bool, Broken> {
        let total = self.runs();
        let mut before = 0;
        let mut all: Vec<Swept> = Vec::new();
        for (section, plan) in self.file.sweeps.iter().zip(&self.plans) {
            let swept = sweep(plan, &out.join(&section.id), |reached, _| over(before + reached, total))?;
            if !swept.complete {
                return Ok(false);
            }
            before += swept.runs.len();
            all.push(swept);
        }
        let mut page = format!("# {}\n\n{}\n\n", self.file.title, self.file.about);
        if let Some(over) = self.over {
            let ids = self.file.sweeps.iter().map(|section| section.id.as_str());
            let sweeps: Vec<_> = ids.zip(all.iter().map(|swept| swept.cells.as_slice())).collect();
            if let Some(found) = finding::against(&sweeps, self.measure, over) {
                let _ = writeln!(page, "**{found}**\n");
            }
            if let Some(svg) = picture::against(&sweeps, self.measure, over, "study") {
                write(&out.join("study.svg"), svg.as_bytes())?;
                let _ =
                    writeln!(page, "![{} over {}](study.svg)\n", MEASURES[self.measure].about, MEASURES[over].about);
            }
        }
        for ((section, plan), swept) in self.file.sweeps.iter().zip(&self.plans).zip(&all) {
            let _ = writeln!(page, "## {}\n", section.id);
            if let Some(found) = finding::of_sweep(plan, &swept.cells, self.measure) {
                let _ = writeln!(page, "**{found}**\n");
            }
            let name = format!("{}.svg", section.id);
            let svg = picture::picture(plan, &swept.cells, self.measure, &section.id);
            if let Some(svg) = &svg {
                write(&out.join(&name), svg.as_bytes())?;
            }
            page::table(&mut page, plan, swept, self.measure, svg.is_some().then_some(name.as_str()));
            page::how(&mut page, plan, command);
            page.push('\n');
        }
        write(&out.join("README.md"), page.trim_end().as_bytes())?;
        Ok(true)
    }
}

fn check(faults: &mut Collector<'_>, file: &StudyFile) {
    if let Err(reason) = index_of(&file.measure) {
        faults.fault("measure", "no measure", reason);
    }
    if let Some(Err(reason)) = file.over.as_deref().map(index_of) {
        faults.fault("over", "no measure", reason);
    }
    if file.sweeps.is_empty() {
        faults.fault("sweeps", "none", "at least one sweep");
    }
    for (i, sweep) in file.sweeps.iter().enumerate() {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let key = format!("sweeps[{i}].id");
        if sweep.id.is_empty() || !sweep.id.chars().all(plain) {
            faults.fault(&key, format!("{:?}", sweep.id), "lower-case letters, digits and dashes");
        }
        if file.sweeps[..i].iter().any(|other| other.id == sweep.id) {
            faults.fault(&key, format!("{:?} again", sweep.id), "a name that no other sweep has");
        }
        for (j, text) in sweep.set.iter().enumerate() {
            if let Err(reason) = Setting::parse(text) {
                faults.fault(&format!("sweeps[{i}].set[{j}]"), reason, "");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_studies_of_the_project_can_be_flown() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/studies");
        let mut count = 0;
        for entry in std::fs::read_dir(&folder).expect("studies") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|extension| extension == "toml") {
                Study::read(&path).unwrap_or_else(|reason| panic!("{reason}"));
                count += 1;
            }
        }
        assert!(count > 0);
    }

    #[test]
    fn a_mission_file_is_told_to_be_one() {
        let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/auv-helix.toml");
        let found = Study::read(&mission).expect_err("no study");
        assert!(found.contains("found a mission file; allowed: a study file") && found.lines().count() == 1, "{found}");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let text = "title = 't'\nmeasure = 'speeed'\n[[sweeps]]\nid = 'A'\nmission = 'm.toml'\nset = ['x']\n";
        let found = read("s.toml", text, check).expect_err("refused").to_string();
        for expected in [
            "s.toml:2: measure: found no measure; allowed: found \"speeed\"",
            "s.toml:4: sweeps[0].id: ",
            "s.toml:6: sweeps[0].set[0]: ",
        ] {
            assert!(found.contains(expected), "{found}");
        }
    }
}
