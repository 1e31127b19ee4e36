//! The files of a run folder that are made from its recording.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::Path;

use bus::recording::Recording;
use serde::Serialize;

use super::verdict::headline;
use super::{ClockSummary, Facts, GraphFacts, Report, Summary, TheoryRow, figures, report, summarise, summarise_clock};

/// What the caller has to tell in the report besides numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Account {
    /// Warnings of the mission check, how the run was made, and the like.
    pub notes: Vec<String>,
    /// Commands that make the run again.
    pub reproduce: Vec<String>,
}

/// What theory says of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Theory {
    /// Beside measurement.
    pub rows: Vec<TheoryRow>,
    /// Rate \[1/s\] and, where it is known, factor of the envelope that it guarantees, with the network as measured.
    pub envelope: Option<(f64, Option<f64>)>,
    /// Whether messages were dropped in the flight without which the fleet's rate is not as predicted.
    pub lost_its_rate: bool,
}

/// Writes `summary.json`, `theory.json`, `clock.json`, `figures/*.svg` and `report.html` into a run folder. Each file appears whole
/// or not at all, and replaces an earlier one, so that a report can be made again at any time. `theory` is asked for
/// its table once the measured numbers are known. A failure names the file.
pub fn write_run_folder(
    directory: impl AsRef<Path>,
    recording: &Recording,
    facts: &Facts,
    theory: impl FnOnce(&Summary) -> Theory,
    account: &Account,
) -> io::Result<(Summary, ClockSummary)> {
    let directory = directory.as_ref();
    let (mut summary, clock) = (summarise(recording, facts), summarise_clock(recording));
    let Theory { rows: theory, envelope, lost_its_rate } = theory(&summary);
    summary.fleet.predicted_speed = summary.fleet.predicted_speed.filter(|_| !lost_its_rate);
    // What is drawn and compared is what is guaranteed for the network as it was, not as it was planned.
    let facts = &Facts {
        guaranteed_rate: envelope.map(|envelope| envelope.0),
        guaranteed_factor: envelope.and_then(|envelope| envelope.1),
        ..facts.clone()
    };
    summary.fleet.coordination.hold_against(facts.guaranteed_rate, facts.least_rate);
    let figures = figures(recording, facts);
    let told = Report {
        facts,
        summary: &summary,
        clock: &clock,
        figures: &figures,
        theory: &theory,
        notes: &account.notes,
        reproduce: &account.reproduce,
        mission_toml: &recording.mission_toml,
    };
    let (page, headline) = (report(&told), headline(&told));
    let drawings = directory.join("figures");
    fs::create_dir_all(&drawings).map_err(|cause| named(&drawings, &cause))?;
    for figure in &figures {
        write(&drawings.join(figure.name).with_extension("svg"), figure.svg.as_bytes())?;
    }
    write(&directory.join("summary.json"), &json(&summary)?)?;
    let theory = TheoryFile { theory: &theory, graph: facts.graph.as_ref() };
    write(&directory.join("theory.json"), &json(&theory)?)?;
    write(&directory.join("clock.json"), &json(&clock)?)?;
    write(&directory.join("report.html"), page.as_bytes())?;
    summary.headline = headline;
    Ok((summary, clock))
}

/// `theory.json`: as `check --json` has it.
#[derive(Serialize)]
struct TheoryFile<'a> {
    theory: &'a [TheoryRow],
    graph: Option<&'a GraphFacts>,
}

fn json(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut text = serde_json::to_vec_pretty(value)?;
    text.push(b'\n');
    Ok(text)
}

/// Writes a file beside its place and moves it there.
fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut name: OsString = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let temporary = path.with_file_name(name);
    let written = fs::write(&temporary, content).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|cause| {
        // What is left of a failed attempt only takes the room that may be short.
        let _ = fs::remove_file(&temporary);
        named(path, &cause)
    })
}

fn named(path: &Path, cause: &io::Error) -> io::Error {
    io::Error::new(cause.kind(), format!("{}: {cause}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{facts, fleet};
    use super::*;

    fn theory(summary: &Summary) -> Theory {
        let fitted = summary.fleet.coordination.fit.map_or(0.0, |fit| fit.rate);
        let rows = vec![
            TheoryRow {
                name: "Theorem 4.3".into(),
                condition: "brief connectivity losses: α = 0.75 < 1".into(),
                holds: Some(true),
                predicted: "rate ≥ 0.012 /s".into(),
                measured: format!("{fitted:.4} /s"),
                ..TheoryRow::default()
            },
            TheoryRow {
                name: "Formation speed".into(),
                condition: "delays are equal on all links, and the graph is balanced".into(),
                holds: None,
                predicted: "0.5 /s".into(),
                measured: format!("{:.4} /s", summary.fleet.steady_speed),
                ..TheoryRow::default()
            },
        ];
        Theory { rows, envelope: Some((0.012, Some(1.3))), lost_its_rate: false }
    }

    fn write_fleet(directory: &Path, spatial: bool) -> Summary {
        let account = Account {
            notes: vec!["simulated".into()],
            reproduce: vec!["mission-control simulate mission.toml --seed 42".into()],
        };
        write_run_folder(directory, &fleet(spatial), &facts(spatial), theory, &account).expect("writes").0
    }

    fn files(directory: &Path) -> Vec<(OsString, Vec<u8>)> {
        let mut files: Vec<_> = fs::read_dir(directory)
            .expect("lists")
            .map(|entry| entry.expect("an entry"))
            .filter(|entry| entry.path().is_file())
            .map(|entry| (entry.file_name(), fs::read(entry.path()).expect("reads")))
            .collect();
        files.sort();
        files
    }

    #[test]
    fn the_folder_is_written_and_can_be_written_again() {
        let directory = tempfile::tempdir().expect("directory");
        write_fleet(directory.path(), true);
        let first = files(directory.path());
        let names: Vec<_> = first.iter().map(|(name, _)| name.to_string_lossy().into_owned()).collect();
        assert_eq!(names, ["clock.json", "report.html", "summary.json", "theory.json"]);
        assert_eq!(files(&directory.path().join("figures")).len(), 4);
        write_fleet(directory.path(), true);
        assert!(files(directory.path()) == first, "the same recording gives the same files");
    }

    #[test]
    fn the_envelope_of_the_measured_network_is_drawn_and_compared() {
        let directory = tempfile::tempdir().expect("directory");
        let write = |envelope| {
            let said = |_: &Summary| Theory { envelope, ..Theory::default() };
            let (facts, account) = (facts(true), Account::default());
            let (summary, _) =
                write_run_folder(directory.path(), &fleet(true), &facts, said, &account).expect("writes");
            let drawn = fs::read_to_string(directory.path().join("figures/rate.svg")).expect("reads");
            (summary.fleet.coordination.at_least_guaranteed, drawn.contains("guaranteed: 0.02 /s"))
        };
        assert_eq!(write(Some((0.02, Some(2.0)))), (Some(true), true));
        assert_eq!(write(Some((0.03, None))).0, Some(false));
        // The plan promises something (the facts do), the network as it was does not.
        assert_eq!(write(None), (None, false));
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_named() {
        let outcome = write_run_folder("/proc/nowhere", &fleet(true), &facts(true), theory, &Account::default());
        let error = outcome.expect_err("refused").to_string();
        assert!(error.contains("/proc/nowhere"), "{error}");
    }

    #[test]
    #[ignore = "writes pictures for people to look at into the folder for temporary files"]
    fn pictures() {
        for (name, spatial) in [("planar", false), ("spatial", true)] {
            let directory = std::env::temp_dir().join("cpf-pictures").join(name);
            fs::create_dir_all(&directory).expect("creates");
            write_fleet(&directory, spatial);
        }
    }
}
