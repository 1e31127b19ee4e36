//! The run folder: where a flight's files go, and how they come about.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use bus::recording::{Recording, read};
use common::mission::Mission;
use common::record::Record;
use serde::Serialize;

use crate::facts::facts;
use crate::results::{Account, ClockSummary, Summary, write_run_folder};
use crate::theory;

/// Names of the files in a run folder.
pub const RECORDING: &str = "recording.mcap";
/// The mission file as flown.
pub const MISSION: &str = "mission.toml";

/// Longest mission file (bytes).
pub(crate) const MISSION_BYTES: u64 = 1 << 20;

/// Reads and checks a mission file.
///
/// # Errors
/// Why it cannot be read, or everything that is wrong with it.
pub fn load(path: &Path) -> Result<Arc<Mission>, String> {
    let unreadable = |error: std::io::Error| format!("cannot read the mission file {}: {error}", path.display());
    let mut text = String::new();
    let file = fs::File::open(path).map_err(unreadable)?;
    file.take(MISSION_BYTES + 1).read_to_string(&mut text).map_err(unreadable)?;
    if text.len() as u64 > MISSION_BYTES {
        return Err(format!("the mission file {} is too long; allowed: {MISSION_BYTES} bytes", path.display()));
    }
    Mission::parse(&path.display().to_string(), &text).map(Arc::new).map_err(|faults| {
        let n = faults.list.len();
        format!("{faults}\n{n} fault{} in {}; nothing was started", if n == 1 { "" } else { "s" }, path.display())
    })
}

/// A folder for a new run: `wanted`, or `runs/<mission>-<time>`.
///
/// # Errors
/// Where it cannot be made, and why.
pub fn make(wanted: Option<&Path>, mission: &Mission) -> Result<PathBuf, String> {
    let folder = wanted.map_or_else(|| free_name(mission), Path::to_path_buf);
    if folder.join(RECORDING).exists() {
        return Err(format!("{} holds a run already; give another folder with --out", folder.display()));
    }
    fs::create_dir_all(&folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
    write(&folder.join(MISSION), mission.text.as_bytes())?;
    Ok(folder)
}

fn free_name(mission: &Mission) -> PathBuf {
    let stem = format!("runs/{}-{}", mission.name, utc_stamp(SystemTime::now()));
    (1..)
        .map(|i| PathBuf::from(if i == 1 { stem.clone() } else { format!("{stem}-{i}") }))
        .find(|path| !path.exists())
        .unwrap_or_else(|| PathBuf::from(&stem))
}

/// Writes a file, or says which one could not be written and why.
///
/// # Errors
/// The file and the reason.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(path, bytes).map_err(|error| format!("cannot write {}: {error}", path.display()))
}

/// What a run was flown with: what depends on the host and the time of day, apart from what the seed determines.
#[derive(Clone, Debug, Serialize)]
pub struct HostFacts {
    /// `simulate`, `run --stepped`, `run`, ...
    pub how: String,
    /// Version of mission-control.
    pub version: &'static str,
    /// The host's name.
    pub host: String,
    /// When the folder was written, UTC.
    pub written: String,
    /// Seconds of wall clock the flight took.
    pub wall_s: f64,
    /// What is missing, and why.
    pub missing: Vec<String>,
}

impl HostFacts {
    /// Facts of now.
    pub fn now(how: &str, wall_s: f64, missing: Vec<String>) -> HostFacts {
        HostFacts {
            how: how.to_string(),
            version: env!("CARGO_PKG_VERSION"),
            host: bus::console::host_name(),
            written: utc_stamp(SystemTime::now()),
            wall_s,
            missing,
        }
    }
}

/// Writes summary, figures and report of the recording in a run folder.
///
/// # Errors
/// Which file is to blame, and why.
pub fn finish(folder: &Path, host: &HostFacts) -> Result<(Summary, ClockSummary), String> {
    let json = serde_json::to_vec_pretty(host).map_err(|error| error.to_string())?;
    write(&folder.join("host.json"), &json)?;
    let mut notes = vec![format!("Made by {} on {}, {} UTC.", host.how, host.host, host.written)];
    notes.extend(host.missing.iter().map(|text| format!("Missing: {text}")));
    report(folder, notes)
}

/// Writes summary, figures and report of the recording in a run folder, again if need be.
///
/// # Errors
/// Which file is to blame, and why.
pub fn report(folder: &Path, notes: Vec<String>) -> Result<(Summary, ClockSummary), String> {
    let recording = recording(folder)?;
    let mission = Mission::parse(MISSION, &recording.mission_toml).map_err(|faults| faults.to_string())?;
    let mut facts = facts(&mission);
    // A flight that was ended early is measured over what was flown.
    let flown = recording.exact.iter().filter(|row| matches!(row, Record::State(_))).map(Record::t_ns).max();
    facts.duration_s = flown.map_or(facts.duration_s, |t| (t as f64 / 1e9).min(facts.duration_s));
    let reproduce = vec![format!("mission-control simulate {}", folder.join(MISSION).display())];
    let account = Account { notes, reproduce };
    write_run_folder(folder, &recording, &facts, |summary| theory::rows(&mission, Some(summary)), &account)
        .map_err(|error| format!("cannot write the report: {error}"))
}

/// Reads the recording of a run folder, or a recording by itself.
///
/// # Errors
/// Which file, and why.
pub fn recording(run: &Path) -> Result<Recording, String> {
    let path = if run.is_dir() { run.join(RECORDING) } else { run.to_path_buf() };
    if !path.exists() {
        return Err(format!("no recording at {}; give a run folder or an .mcap file", path.display()));
    }
    let recording = read(&path).map_err(|error| error.to_string())?;
    if recording.mission_toml.is_empty() {
        return Err(format!("{} is damaged or no recording of a flight: it names no mission", path.display()));
    }
    if !recording.complete {
        bus::remark!("warning: {} is cut off or damaged; what is whole of it is used", path.display());
    }
    Ok(recording)
}

/// `2026-01-31-235959`, in UTC.
fn utc_stamp(now: SystemTime) -> String {
    let seconds = now.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs() as i64;
    let (days, rest) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    // Civil date from days since 1970 in the proleptic Gregorian calendar; years begin in March.
    let shifted = days + 719_468;
    let era = shifted.div_euclid(146_097);
    let day_of_era = shifted.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}-{:02}{:02}{:02}", rest / 3600, rest / 60 % 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_stamp_is_the_civil_date() {
        let at = |seconds| utc_stamp(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01-000000");
        assert_eq!(at(951_782_400), "2000-02-29-000000");
        assert_eq!(at(1_767_225_599), "2025-12-31-235959");
    }
}
