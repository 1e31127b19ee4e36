//! `gallery`: flies all missions of a folder, draws the figures that its `gallery.toml` asks for, and puts the numbers
//! expected of them beside those measured.
//!
//! | file | what it does |
//! |---|---|
//! | [`mod@file`] | the gallery file as written |
//! | `check` | whether everything it names exists and fits together |
//! | `quantity` | the quantities of a flight over time |
//! | `numbers` | expected numbers: taken from a flight, and judged |
//! | `picture`, `view` | the figures |
//! | `page` | `index.html` and `README.md` |

mod check;
pub mod file;
mod numbers;
mod page;
mod picture;
mod quantity;
mod view;

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::mission::{Mission, read};
use common::record::Record;

use self::check::Missions;
use self::file::GalleryFile;
use self::numbers::judge;
use self::page::Shown;
use self::picture::Subject;
use crate::batch::{Flight, fly, on_all_cores};
use crate::folder;

/// Name of the gallery file in a folder of missions.
pub const GALLERY: &str = "gallery.toml";

/// A gallery that can be made.
#[derive(Debug)]
pub struct Gallery {
    file: GalleryFile,
    missions: Missions,
    /// The folder as the user gave it, for the commands on the page.
    folder: String,
}

/// What came of a gallery.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Figures made.
    pub figures: usize,
    /// Expected numbers.
    pub expected: usize,
    /// What disagrees and what could not be made, a line each.
    pub faults: Vec<String>,
    /// Missions that are in no figure.
    pub unused: Vec<String>,
}

impl Gallery {
    /// Reads the missions of a folder and its gallery file.
    ///
    /// # Errors
    /// What cannot be read, or everything that is wrong with a file.
    pub fn read(folder: &Path) -> Result<Gallery, String> {
        let unreadable = |path: &Path, error: std::io::Error| format!("cannot read {}: {error}", path.display());
        let entries = fs::read_dir(folder).map_err(|error| unreadable(folder, error))?;
        let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.retain(|path| path.extension().is_some_and(|e| e == "toml") && !path.ends_with(GALLERY));
        paths.sort();
        let mut missions = BTreeMap::new();
        for path in paths {
            let mission = folder::load(&path)?;
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            if mission.name != stem {
                return Err(format!(
                    "{}: name: found {:?}; allowed: {stem:?}, as the file is called",
                    path.display(),
                    mission.name
                ));
            }
            missions.insert(stem, mission);
        }
        let path = folder.join(GALLERY);
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => format!(
                "{} has no {GALLERY}, which says what figures its missions make; allowed: a folder with one, such as missions/thesis. For \
                 figures of a changed mission copy that folder, change the mission there and make the gallery of the copy \
                 (docs/missions.md, \"A gallery of your own\")",
                folder.display()
            ),
            _ => unreadable(&path, error),
        })?;
        let check =
            |faults: &mut common::mission::Collector<'_>, file: &GalleryFile| check::check(faults, file, &missions);
        let file = read(&path.display().to_string(), &text, check).map_err(|faults| faults.to_string())?;
        Ok(Gallery { file, missions, folder: folder.display().to_string().trim_end_matches('/').to_owned() })
    }

    /// Number of missions.
    pub fn missions(&self) -> usize {
        self.missions.len()
    }

    /// Flies all missions on all cores and writes the page into a folder; `flown` is told of each mission that is over.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn make(&self, out: &Path, mut flown: impl FnMut(&str)) -> Result<Outcome, String> {
        fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
        // The longest first, so that no core is left with it in the end.
        let mut order: Vec<&Arc<Mission>> = self.missions.values().collect();
        let work =
            |mission: &Mission| mission.end.secs() / mission.control_period.secs() * mission.vehicles.len() as f64;
        order.sort_by(|a, b| work(b).total_cmp(&work(a)));
        let mut flights: BTreeMap<&str, Result<Flight, String>> = BTreeMap::new();
        on_all_cores(
            &order,
            |mission| fly_and_forget_messages(mission),
            |index, flight| {
                flown(&order[index].name);
                flights.insert(&order[index].name, flight);
                true
            },
        );
        let mut outcome = Outcome::default();
        let mut shown = Vec::new();
        for figure in &self.file.figures {
            let found: Result<Vec<&Flight>, String> = figure
                .missions
                .iter()
                .map(|name| match &flights[name.as_str()] {
                    Ok(flight) => Ok(flight),
                    Err(reason) => Err(format!("{name}: {reason}")),
                })
                .collect();
            let (verdicts, missing) = match found {
                Ok(flights) => {
                    let subject = Subject { figure, flights };
                    folder::write(&out.join(&figure.id).with_extension("svg"), picture::draw(&subject).as_bytes())?;
                    let of = |name: &Option<String>| {
                        let at = name.as_ref().and_then(|name| figure.missions.iter().position(|m| m == name));
                        subject.flights[at.unwrap_or(0)]
                    };
                    (figure.expect.iter().map(|e| judge(e, of(&e.mission))).collect(), None)
                }
                Err(reason) => (Vec::new(), Some(reason)),
            };
            shown.push(Shown { figure, verdicts, missing });
        }
        for shown in &shown {
            outcome.figures += usize::from(shown.missing.is_none());
            outcome.expected += shown.verdicts.len();
            outcome.faults.extend(shown.missing.iter().map(|reason| format!("{} not made: {reason}", shown.figure.id)));
            for (expectation, verdict) in shown.figure.expect.iter().zip(&shown.verdicts).filter(|(_, v)| !v.agrees) {
                let values: Vec<String> = verdict.measured.iter().map(|(_, value)| format!("{value:.6}")).collect();
                outcome.faults.push(format!(
                    "{} disagrees: {}: measured {}",
                    shown.figure.id,
                    expectation.what,
                    values.join(", ")
                ));
            }
        }
        let used = |name: &String| self.file.figures.iter().any(|figure| figure.missions.contains(name));
        outcome.unused = self.missions.keys().filter(|name| !used(name)).cloned().collect();
        folder::write(&out.join("index.html"), page::html(&self.file, &shown, &self.folder).as_bytes())?;
        folder::write(&out.join("README.md"), page::markdown(&self.file, &shown, &self.folder).as_bytes())?;
        Ok(outcome)
    }
}

/// Pictures need no messages, and messages are most of what a flight records.
fn fly_and_forget_messages(mission: &Arc<Mission>) -> Result<Flight, String> {
    let mut flight = fly(mission)?;
    flight.recording.exact.retain(|record| !matches!(record, Record::Message(_)));
    flight.recording.exact.shrink_to_fit();
    Ok(flight)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = include_str!("../../../missions/thesis/fig-1-9.toml");

    const SMALL: &str = r#"title = "Two vehicles"
[[figures]]
id = "lines"
title = "Speeds & places"
source = "Figure 1.9"
says = "They come <abreast>."
missions = ["fig-1-9"]
panels = [
  { title = "Speeds", over_time = "speed", levels = [0.5] },
  { title = "From above", plane = "xy", vehicles_at_s = [0.0, 5.0] },
]
expect = [
  { what = "speed", number = "vehicle.steady_speed_mps", value = 0.5, within = 1e-3, unit = "m/s" },
  { what = "distance", series = "coordination_error", at_s = 40.0, at_least = -1e-4, at_most = 1e-4, unit = "m" },
]
"#;

    fn folder(gallery: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("fig-1-9.toml"), MISSION).expect("written");
        fs::write(folder.path().join(GALLERY), gallery).expect("written");
        folder
    }

    fn fault(old: &str, new: &str) -> String {
        assert!(SMALL.contains(old), "{old:?} is not in the gallery");
        let folder = folder(&SMALL.replacen(old, new, 1));
        let reason = Gallery::read(folder.path()).expect_err("refused");
        reason.lines().map(|line| line.rsplit('/').next().unwrap_or(line)).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn the_gallery_of_the_thesis_fits_its_missions() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/thesis");
        Gallery::read(&folder).unwrap_or_else(|reason| panic!("{reason}"));
    }

    #[test]
    fn a_page_shows_each_figure_with_the_numbers_expected_and_measured() {
        let folder = folder(SMALL);
        let out = folder.path().join("page");
        let outcome = Gallery::read(folder.path()).expect("sound").make(&out, |_| {}).expect("made");
        assert_eq!(outcome, Outcome { figures: 1, expected: 2, ..Outcome::default() });
        let page = fs::read_to_string(out.join("index.html")).expect("a page");
        for text in [
            "2 of 2 expected numbers agree",
            "src=\"lines.svg\"",
            "Speeds &amp; places",
            "&lt;abreast&gt;",
            "0.5 ± 0.001 m/s",
        ] {
            assert!(page.contains(text), "{text}");
        }
        let markdown = fs::read_to_string(out.join("README.md")).expect("a page");
        assert!(markdown.contains("![Speeds &amp; places](lines.svg)"), "{markdown}");
        let picture = fs::read_to_string(out.join("lines.svg")).expect("a picture");
        assert!(picture.len() < 60_000, "{}", picture.len());
        for text in ["(a) Speeds", "(b) From above", "x [m]", "speed [m/s]"] {
            assert!(picture.contains(text), "{text}");
        }
    }

    #[test]
    fn a_number_that_disagrees_is_told_and_the_page_says_so() {
        let folder = folder(&SMALL.replace("value = 0.5, within", "value = 0.6, within"));
        let out = folder.path().join("page");
        let outcome = Gallery::read(folder.path()).expect("sound").make(&out, |_| {}).expect("made");
        assert_eq!(outcome.faults.len(), 1);
        assert!(outcome.faults[0].starts_with("lines disagrees: speed: measured 0.5"), "{}", outcome.faults[0]);
        let page = fs::read_to_string(out.join("index.html")).expect("a page");
        assert!(page.contains("<strong>disagrees</strong>") && page.contains("1 of 2 expected numbers agree"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line_and_what_is_allowed() {
        for (old, new, expected) in [
            ("says =", "sayz =", "gallery.toml:6: figures[0].sayz: found an unknown key; allowed: "),
            (
                "over_time = \"speed\"",
                "over_time = \"sped\"",
                "gallery.toml:9: figures[0].panels[0].over_time: found \"sped\"; allowed: ",
            ),
            (
                "plane = \"xy\", vehicles",
                "vehicles",
                "gallery.toml:10: figures[0].panels[1]: found neither plane nor over_time",
            ),
            (
                "missions = [\"fig-1-9\"]",
                "missions = [\"fig-1-8\"]",
                "gallery.toml:7: figures[0].missions[0]: found \"fig-1-8\", which is no mission here; allowed: fig-1-9",
            ),
            (
                "vehicle.steady_speed_mps",
                "vehicle.speed",
                "gallery.toml:13: figures[0].expect[0].number: found \"vehicle.speed\"; allowed: ",
            ),
            (", within = 1e-3", "", "gallery.toml:13: figures[0].expect[0]: found an incomplete bound"),
            (
                "at_s = 40.0,",
                "at_s = 40.0, vehicles = [\"v9\"],",
                "gallery.toml:14: figures[0].expect[1].vehicles[0]: found \"v9\", which is no vehicle of fig-1-9; allowed: v1, v2",
            ),
        ] {
            let found = fault(old, new);
            assert!(found.lines().any(|line| line.starts_with(expected)), "{found}");
        }
    }

    #[test]
    fn a_folder_without_a_gallery_file_is_told_what_one_needs() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("fig-1-9.toml"), MISSION).expect("written");
        let found = Gallery::read(folder.path()).expect_err("refused");
        assert!(found.contains("has no gallery.toml") && found.contains("such as missions/thesis"), "{found}");
    }

    #[test]
    fn a_mission_is_called_as_its_file() {
        let folder = folder(SMALL);
        fs::write(folder.path().join("other.toml"), MISSION).expect("written");
        let reason = Gallery::read(folder.path()).expect_err("refused");
        assert!(reason.contains("other.toml: name: found \"fig-1-9\"; allowed: \"other\""), "{reason}");
    }
}
