//! Commands about what was recorded: `report`, `export`, `diff`, `recover`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::ValueEnum;
use common::mission::Mission;

use super::{End, Ended};
use crate::results::{compare, export_csv, network_section};
use crate::{brought, folder};

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Format {
    /// vehicles.csv, links.csv and topology.csv
    Csv,
    /// network.toml: when links were up and what they lost, as a section of a mission file
    Network,
}

pub(super) fn report(run: &Path, logs: Option<&Path>) -> Ended {
    let salvaged = folder::salvage(run).map_err(|error| End(4, error))?.unwrap_or_default();
    let added = logs.map(|logs| brought::add(run, logs)).transpose().map_err(|error| End(4, error))?;
    for text in salvaged.into_iter().chain(added.unwrap_or_default()) {
        bus::remark!("{text}");
    }
    folder::report(run).map_err(|error| End(4, error))?;
    bus::tell!("report: {}", run.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}

pub(super) fn export(run: &Path, format: Format, out: Option<PathBuf>) -> Ended {
    let recording = folder::recording(run).map_err(|error| End(4, error))?;
    let beside = if run.is_dir() { run } else { run.parent().unwrap_or(Path::new(".")) };
    let out = out.unwrap_or_else(|| beside.to_path_buf());
    let failed = |error: std::io::Error| End(4, format!("cannot export to {}: {error}", out.display()));
    std::fs::create_dir_all(&out).map_err(failed)?;
    match format {
        Format::Csv => {
            export_csv(&recording.exact, &out).map_err(failed)?;
            bus::tell!("{} rows to {}/{{vehicles,links,topology}}.csv", recording.exact.len(), out.display());
        }
        Format::Network => {
            let path = out.join("network.toml");
            let mission = Mission::parse(folder::MISSION, &recording.mission_toml)
                .map_err(|faults| End(4, faults.to_string()))?;
            let section = network_section(&recording.exact, mission.message_period());
            std::fs::write(&path, section).map_err(failed)?;
            bus::tell!("the network of {} rows to {}", recording.exact.len(), path.display());
        }
    }
    Ok(ExitCode::SUCCESS)
}

pub(super) fn diff(a: &Path, b: &Path) -> Ended {
    let left = folder::recording(a).map_err(|error| End(4, error))?;
    let right = folder::recording(b).map_err(|error| End(4, error))?;
    let [name_a, name_b] = [a, b].map(|path| path.display().to_string());
    let outcome = compare(&left, &right, [&name_a, &name_b]);
    bus::tell!("{}", outcome.text);
    Ok(if outcome.equal { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

pub(super) fn recover(path: &Path, out: Option<PathBuf>) -> Ended {
    if path.is_dir() {
        return recover_run(path, out);
    }
    let out = out.unwrap_or_else(|| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        path.with_file_name(format!("{stem}-recovered.mcap"))
    });
    // What is there may be all that is left: it is never overwritten.
    if out.exists() {
        let text = "is there already and is not overwritten: move it away, or say --out FILE with another name";
        return Err(End(4, format!("{} {text}", out.display())));
    }
    let recovered = bus::recording::recover(path, &out).map_err(|error| End(4, error.to_string()))?;
    if recovered.rows == 0 {
        return Err(End(4, format!("{} holds no row that could be saved", path.display())));
    }
    if let Some(damage) = &recovered.damage {
        bus::remark!("warning: {} is damaged, and what is damaged is left out: {damage}", path.display());
    }
    bus::tell!("{} rows to {}", recovered.rows, out.display());
    Ok(ExitCode::SUCCESS)
}

/// Makes the recording of a run whose mission-control was killed, of the logs of its processes.
fn recover_run(run: &Path, out: Option<PathBuf>) -> Ended {
    let name = run.display();
    if !run.join(folder::MISSION).exists() {
        let text =
            format!("{name} is no run folder: it has no {}; allowed: a run folder, or one recording", folder::MISSION);
        return Err(End(4, text));
    }
    if out.is_some() {
        let text = format!(
            "--out: found with {name}, a run folder, whose recording is made in it; allowed: with one recording"
        );
        return Err(End(2, text));
    }
    let recording = run.join(folder::RECORDING);
    match folder::salvage(run).map_err(|error| End(4, error))? {
        Some(notes) => {
            for text in &notes {
                bus::remark!("{text}");
            }
            bus::tell!("merged to {}; next: mission-control report {}", recording.display(), run.display());
            Ok(ExitCode::SUCCESS)
        }
        None if recording.exists() => {
            bus::tell!("{} is there already", recording.display());
            Ok(ExitCode::SUCCESS)
        }
        None => Err(End(4, format!("{} holds no logs of a run of its own that could be merged", run.display()))),
    }
}
