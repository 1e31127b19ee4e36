//! Commands about a mission file: `check`, `waypoints`, `schema`.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use common::mission::Mission;
use common::path::geodesy::Place;

use super::{End, Ended};
use crate::results::TheoryRow;
use crate::results::html::told;
use crate::{folder, theory, waypoints};

/// A mission that shall be flown.
pub(super) fn load(path: &Path) -> Result<Arc<Mission>, End> {
    folder::load(path).map_err(|reason| End(2, format!("{reason}; nothing was started")))
}

pub(super) fn check(path: &Path, json: bool, graph: bool, figures: Option<&Path>) -> Ended {
    let mission = folder::load(path).map_err(|reason| End(2, reason))?;
    let rows = theory::rows(&mission, None);
    if json {
        let rows: Vec<_> = rows
            .iter()
            .map(|row| {
                serde_json::json!({
                    "name": row.name, "condition": row.condition, "value": row.value, "holds": row.holds,
                    "predicted": row.predicted, "guaranteed_rate": row.guaranteed_rate,
                })
            })
            .collect();
        let digest = format!("{:016x}", mission.digest);
        let graph = theory::graph_facts(&mission);
        let all = serde_json::json!({"mission": mission.name, "digest": digest, "theory": rows, "graph": graph});
        bus::tell!("{all:#}");
    } else {
        bus::tell!(
            "{}: {} vehicles, {} directed links, {}",
            mission.name,
            mission.vehicles.len(),
            mission.links.len(),
            mission.end
        );
        print_theory(&rows);
        if graph {
            bus::tell!("  Graph (sections 3.1 and 4.2)");
            for line in theory::graph_facts(&mission).lines() {
                bus::tell!("      {line}");
            }
        }
    }
    if let Some(folder) = figures {
        draw(&mission, folder).map_err(|error| End(4, format!("cannot draw in {}: {error}", folder.display())))?;
    }
    warn(&mission, &rows);
    Ok(ExitCode::SUCCESS)
}

fn draw(mission: &Mission, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for figure in theory::figures(mission) {
        let path = folder.join(figure.name).with_extension("svg");
        fs::write(&path, &figure.svg)?;
        bus::remark!("{}: {}", path.display(), figure.caption);
    }
    Ok(())
}

/// A mission that violates a condition flies, with a warning that names it.
pub(super) fn warn(mission: &Mission, rows: &[TheoryRow]) {
    for text in mission.advice() {
        bus::remark!("warning: {text}");
    }
    for row in rows.iter().filter(|row| row.holds == Some(false)) {
        let here = if row.value.is_empty() { String::new() } else { format!("; here: {}", row.value) };
        bus::remark!("warning: not covered by theory: {}: needs {}{here}", row.name, row.condition);
    }
}

pub(super) fn print_theory(rows: &[TheoryRow]) {
    for row in rows {
        // Of the premises: whether theory speaks for the mission, not whether what was measured is good.
        let covered = match row.holds {
            Some(true) => "  [covered]",
            Some(false) => "  [not covered]",
            None => "",
        };
        bus::tell!("  {}{covered}", row.name);
        let lines = [
            ("needs", &row.condition),
            ("here", &row.value),
            ("predicts", &row.predicted),
            ("measured", &row.measured),
        ];
        for (label, text) in lines {
            let text = told(text);
            if !text.is_empty() && text != "–" {
                bus::tell!("      {label:<9} {text}");
            }
        }
    }
}

/// Longest GeoJSON file (bytes); of a longer one the begin is read, which is no GeoJSON.
const LONGEST_GEOJSON: u64 = 64 << 20;

/// The text of a file, but not more of it than that.
fn read_bounded(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let file = File::open(path)?;
    file.take(LONGEST_GEOJSON).read_to_string(&mut text)?;
    Ok(text)
}

pub(super) fn waypoints(file: &Path, origin: Option<Place>) -> Ended {
    let text = read_bounded(file).map_err(|error| End(2, format!("cannot read {}: {error}", file.display())))?;
    let section =
        waypoints::section(&text, origin).map_err(|reason| End(2, format!("{}: {reason}", file.display())))?;
    bus::tell!("{}", section.trim_end());
    Ok(ExitCode::SUCCESS)
}

pub(super) fn schema() -> Ended {
    bus::tell!("{:#}", common::mission::schema());
    Ok(ExitCode::SUCCESS)
}
