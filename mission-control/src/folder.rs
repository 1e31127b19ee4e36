//! The run folder: where a flight's files go, and how they come about.

use std::fs;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use bus::recording::{Recording, merge, read};
use common::mission::Mission;
use common::record::Record;
use common::time::Time;
use serde::{Deserialize, Serialize};

use crate::brought::of_one_flight;
use crate::facts::{commanded, facts_at, speed_in_force};
use crate::missing::damage;
use crate::results::{Account, ClockSummary, Summary, Theory, write_run_folder};
use crate::theory;

/// Names of the files in a run folder.
pub const RECORDING: &str = "recording.mcap";
/// What depends on the host and the time of day.
const HOST: &str = "host.json";
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
        format!("{faults}\n{n} fault{} in {}", if n == 1 { "" } else { "s" }, path.display())
    })
}

/// A folder for a new run: `wanted`, or `runs/<mission>-<time>`.
///
/// # Errors
/// Where it cannot be made, and why.
pub fn make(wanted: Option<&Path>, mission: &Mission) -> Result<PathBuf, String> {
    let Some(folder) = wanted.map(Path::to_path_buf) else {
        let folder = make_free(&format!("runs/{}-{}", mission.name, utc_stamp(SystemTime::now())))?;
        write(&folder.join(MISSION), mission.text.as_bytes())?;
        return Ok(folder);
    };
    if folder.join(RECORDING).exists() {
        return Err(format!("{} holds a run already; give another folder with --out", folder.display()));
    }
    // What a run that never began left behind may be replaced.
    let is_in_use = has_logs(&folder) || !folder.join("logs").is_dir();
    let copy = folder.join(MISSION);
    if is_in_use && fs::read(&copy).is_ok_and(|there| there != mission.text.as_bytes()) {
        return Err(format!(
            "{} is another mission and is not overwritten; give another folder with --out",
            copy.display()
        ));
    }
    fs::create_dir_all(&folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
    write(&copy, mission.text.as_bytes())?;
    Ok(folder)
}

/// Makes a folder of this name, or of the next one that nobody has: two runs may begin in the same second.
fn make_free(stem: &str) -> Result<PathBuf, String> {
    let failed = |path: &Path, error: std::io::Error| format!("cannot make {}: {error}", path.display());
    let within = Path::new(stem).parent().unwrap_or(Path::new("."));
    fs::create_dir_all(within).map_err(|error| failed(within, error))?;
    let mut path = PathBuf::from(stem);
    let mut number = 1;
    loop {
        match fs::create_dir(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                number += 1;
                path = PathBuf::from(format!("{stem}-{number}"));
            }
            made => return made.map(|()| path.clone()).map_err(|error| failed(&path, error)),
        }
    }
}

/// Writes a file, or says which one could not be written and why.
///
/// # Errors
/// The file and the reason.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(path, bytes).map_err(|error| format!("cannot write {}: {error}", path.display()))
}

/// What a run was flown with: what depends on the host and the time of day, apart from what the seed determines.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct HostFacts {
    /// `simulate`, `run --stepped`, `run`, ...
    pub how: String,
    /// The command, as it was given.
    pub command: Vec<String>,
    /// Mission seconds per second of wall clock; `None` for as fast as it goes.
    pub speed_up: Option<f64>,
    /// Version of mission-control.
    pub version: String,
    /// Version of the compiler that made it.
    pub rustc: String,
    /// Version of the middleware.
    pub zenoh: String,
    /// The host's name.
    pub host: String,
    /// The operating system and its release.
    pub os: String,
    /// The processor.
    pub cpu: String,
    /// How many of it there are for this process.
    pub cores: usize,
    /// When the folder was written, UTC.
    pub written: String,
    /// Seconds of wall clock the flight took.
    pub wall_s: f64,
    /// What is missing, and why.
    #[serde(default)]
    pub missing: Vec<String>,
    /// Vehicles that gave up, and why.
    #[serde(default)]
    pub aborted: Vec<String>,
    /// Whether it was merged without the mission-control that flew it: what was still being recorded then came later.
    #[serde(default)]
    pub salvaged: bool,
    /// Logs that were brought to it afterwards.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added: Vec<String>,
}

impl HostFacts {
    /// Facts of now.
    pub fn now(how: &str, speed_up: Option<f64>, wall_s: f64, missing: Vec<String>, aborted: Vec<String>) -> HostFacts {
        HostFacts {
            how: how.to_string(),
            command: std::env::args().collect(),
            speed_up,
            version: env!("CARGO_PKG_VERSION").to_string(),
            rustc: env!("CPF_RUSTC").to_string(),
            zenoh: env!("CPF_ZENOH").to_string(),
            host: bus::console::host_name(),
            os: bus::console::system(),
            cpu: cpu(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            written: utc_stamp(SystemTime::now()),
            wall_s,
            missing,
            aborted,
            salvaged: false,
            added: Vec::new(),
        }
    }
}

/// The processor's name, as Linux tells it; its architecture where it does not.
fn cpu() -> String {
    let told = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = told.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_string(), |(_, name)| name.trim().to_string())
}

/// Writes summary, figures and report of the recording in a run folder.
///
/// # Errors
/// Which file is to blame, and why.
pub fn finish(folder: &Path, host: &HostFacts) -> Result<(Summary, ClockSummary), String> {
    write_host(folder, host)?;
    report(folder)
}

pub(crate) fn host_of(folder: &Path) -> Option<HostFacts> {
    serde_json::from_slice(&fs::read(folder.join(HOST)).ok()?).ok()
}

pub(crate) fn write_host(folder: &Path, host: &HostFacts) -> Result<(), String> {
    let json = serde_json::to_vec_pretty(host).map_err(|error| error.to_string())?;
    write(&folder.join(HOST), &json)
}

/// Writes summary, figures and report of the recording in a run folder, again if need be.
///
/// # Errors
/// Which file is to blame, and why.
pub fn report(folder: &Path) -> Result<(Summary, ClockSummary), String> {
    let recording = recording(folder)?;
    let mission = Mission::parse(MISSION, &recording.mission_toml).map_err(|faults| faults.to_string())?;
    // A flight that was ended early is measured over what was flown.
    let flown = recording.exact.iter().filter(|row| matches!(row, Record::State(_))).map(Record::t_ns).max();
    let end = flown.map_or(mission.end, |t_ns| Time::from_nanos(t_ns).min(mission.end));
    let mut facts = facts_at(&mission, speed_in_force(&mission, &recording.exact, end));
    facts.duration_s = end.secs();
    facts.commanded = commanded(&mission, &recording.exact);
    // A recording by itself has no host facts beside it.
    let host = host_of(folder);
    let reproduce = reproduce(folder, &mission, &recording, host.as_ref());
    let made = |host: &HostFacts| format!("Made by {} on {}, {} UTC.", host.how, host.host, host.written);
    let mut notes: Vec<String> = host.iter().map(made).collect();
    let added = host.iter().filter(|host| !host.added.is_empty());
    notes.extend(added.map(|host| format!("Logs added afterwards: {}.", host.added.join(", "))));
    (facts.missing, facts.aborted) = host.map_or_else(Default::default, |host| (host.missing, host.aborted));
    let account = Account { notes, reproduce };
    let theory = |summary: &Summary| Theory {
        rows: theory::rows(&mission, Some(summary)),
        envelope: theory::guarantee_of_flight(&mission, summary).map(|guarantee| (guarantee.rate, guarantee.factor)),
        lost_its_rate: theory::lost_its_rate(&mission, summary),
    };
    write_run_folder(folder, &recording, &facts, theory, &account)
        .map_err(|error| format!("cannot write the report: {error}"))
}

/// What makes a run again: the mission as flown, and the speeds that were commanded under way, which are not in it.
fn reproduce(folder: &Path, mission: &Mission, recording: &Recording, host: Option<&HostFacts>) -> Vec<String> {
    let mut lines = vec![format!("mission-control simulate {}", folder.join(MISSION).display())];
    if let Some((host, words)) = host.and_then(|host| Some((host, of_run(&host.command)?))) {
        let numbers = match host.speed_up {
            None => "# The same numbers, in one thread:",
            Some(_) => {
                "# The same mission and seed without the clock, in one thread (what the machine did to the run is not in it):"
            }
        };
        lines.insert(0, numbers.to_owned());
        let out = words.iter().any(|word| word.starts_with("--out"));
        let elsewhere = if out { ", with another folder behind --out" } else { "" };
        lines.push(format!("# The run itself, from where it was flown{elsewhere}:"));
        lines.push(format!("mission-control {}", words.join(" ")));
    }
    let planned = mission.speed.steps();
    let commanded = commanded(mission, &recording.exact);
    let Some((first, _)) = commanded.first().copied() else { return lines };
    // A command replaces what the profile says from then on.
    let before = planned.iter().map(|step| (step.at.secs().max(0.0), step.speed)).filter(|(at, _)| *at < first);
    let steps: Vec<String> =
        before.chain(commanded).map(|(at, speed)| format!("{{ from_s = {at:?}, speed = {speed:?} }}")).collect();
    lines.push(
        "# The formation speed was changed under way. To have the same, put in place of [formation]:".to_string(),
    );
    lines.push("[formation]".to_string());
    lines.push(format!("profile = [{}]", steps.join(", ")));
    lines
}

/// The words behind the program's name as a shell takes them, if the command was `run`.
fn of_run(command: &[String]) -> Option<Vec<String>> {
    let words: Vec<String> = command.iter().skip(1).cloned().map(quoted).collect();
    (words.first()? == "run").then_some(words)
}

/// A word of a command as a shell takes it.
pub(crate) fn quoted(word: String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-=+:,/".contains(c);
    if word.chars().all(plain) && !word.is_empty() { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

/// The logs of a fleet of its own below a run folder, of the mission that the folder holds.
pub fn logs(folder: &Path, digest: u64) -> Vec<PathBuf> {
    recordings_in(&folder.join("logs").join(format!("{digest:016x}")))
}

/// Whether there are logs of any mission below a run folder.
fn has_logs(folder: &Path) -> bool {
    let entries = fs::read_dir(folder.join("logs")).into_iter().flatten().flatten();
    entries.into_iter().any(|entry| !recordings_in(&entry.path()).is_empty())
}

/// The recordings in a folder, in the order of their names.
pub fn recordings_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == "mcap")).collect();
    files.sort();
    files
}

/// Merges what the processes of a run recorded, if nobody did: mission-control was killed before. Also again, if some still
/// recorded the last time. Gives what is to be told of it; `None` if there is a whole recording, or nothing to make it of.
///
/// # Errors
/// Which file is to blame, and why.
pub fn salvage(folder: &Path) -> Result<Option<Vec<String>>, String> {
    let is_part = host_of(folder).is_some_and(|host| host.salvaged && !host.missing.is_empty());
    if (folder.join(RECORDING).exists() && !is_part) || !folder.join(MISSION).exists() {
        return Ok(None);
    }
    let mission = load(&folder.join(MISSION))?;
    let (logs, left_out) = of_one_flight(logs(folder, mission.digest));
    if logs.is_empty() {
        return Ok(None);
    }
    let merged = merge(&logs, folder.join(RECORDING)).map_err(|error| error.to_string())?;
    let how = format!("mission-control, from {} logs of a run that it did not end,", logs.len());
    let missing: Vec<String> = left_out.into_iter().chain(damage(&merged)).collect();
    let mut notes = vec![format!("Merged from {} logs after the run: mission-control did not end it.", logs.len())];
    notes.extend(missing.iter().map(|text| format!("Missing: {text}")));
    let host = HostFacts { salvaged: true, ..HostFacts::now(&how, None, 0.0, missing, Vec::new()) };
    write_host(folder, &host)?;
    Ok(Some(notes))
}

/// Whether a run's folder is still to be made. One that was there is somebody's, and not removed again.
pub fn is_new(wanted: Option<&Path>) -> bool {
    wanted.is_none_or(|folder| !folder.exists())
}

/// Removes a new folder of a run that never began, if nothing was recorded in it: the mission's copy and empty folders go,
/// and what a process said stays.
pub fn discard(folder: &Path) {
    let mission = folder.join(MISSION);
    let logs = folder.join("logs");
    let said = |path: &Path| fs::metadata(path).is_ok_and(|file| file.is_dir() || file.len() > 0);
    let silent = fs::read_dir(&logs).is_ok_and(|entries| entries.flatten().all(|entry| !said(&entry.path())));
    if silent {
        for entry in fs::read_dir(&logs).into_iter().flatten().flatten() {
            let _ = fs::remove_file(entry.path());
        }
    }
    let _ = fs::remove_dir(&logs);
    let others = fs::read_dir(folder).map_or(1, |entries| entries.flatten().filter(|e| e.path() != mission).count());
    if others == 0 {
        let _ = fs::remove_file(&mission);
        let _ = fs::remove_dir(folder);
    }
}

/// Reads the recording of a run folder, or a recording by itself.
///
/// # Errors
/// Which file, and why.
pub fn recording(run: &Path) -> Result<Recording, String> {
    let path = if run.is_dir() { run.join(RECORDING) } else { run.to_path_buf() };
    if !path.exists() {
        let (place, name) = (path.display(), run.display());
        return Err(match (run.join(MISSION).exists(), has_logs(run)) {
            (_, true) => format!("no recording at {place}; `mission-control report {name}` makes it of the logs"),
            (true, false) if run.join("logs").is_dir() => {
                format!("no recording at {place}, and no logs to make it of: this flight was over before it began")
            }
            (true, false) => format!(
                "no recording at {place}: this run was attached to a fleet and did not come to its end; if it flew, its logs are with \
                 the fleet. Run the same mission with --attach again: that joins a flight under way and collects one that is over; \
                 or bring the logs here: mission-control report {name} --logs LOGS"
            ),
            (false, false) => format!("no recording at {place}; give a run folder or an .mcap file"),
        });
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

    use common::record::SpeedRow;

    use super::*;

    #[test]
    fn a_speed_commanded_under_way_is_part_of_what_makes_a_run_again() {
        let text = include_str!("../../missions/auv-helix.toml");
        let mission = Mission::parse("m", text).expect("sound");
        let row = |t_s: i64, speed| Record::Speed(SpeedRow { t_ns: t_s * 1_000_000_000, speed });
        let recording = |rows| Recording { exact: rows, ..Recording::default() };
        let folder = Path::new("run");
        let told = reproduce(folder, &mission, &recording(vec![row(0, 0.5)]), None);
        assert_eq!(told, ["mission-control simulate run/mission.toml"]);
        let told = reproduce(folder, &mission, &recording(vec![row(0, 0.5), row(20, 0.4), row(60, 0.3)]), None);
        let profile =
            "profile = [{ from_s = 0.0, speed = 0.5 }, { from_s = 20.0, speed = 0.4 }, { from_s = 60.0, speed = 0.3 }]";
        assert_eq!(told.last().map(String::as_str), Some(profile));
        let with = text.replace("speed = 0.5", profile);
        assert!(Mission::parse("m", &with).is_ok(), "what is told is a section of a mission");
    }

    #[test]
    fn a_run_on_the_clock_is_told_apart_from_its_simulation() {
        let mission = Mission::parse("m", include_str!("../../missions/auv-helix.toml")).expect("sound");
        let told = |words: &[&str], speed_up| {
            let command = words.iter().map(|word| (*word).to_owned()).collect();
            let host = HostFacts { command, ..HostFacts::now("", speed_up, 1.0, Vec::new(), Vec::new()) };
            reproduce(Path::new("x"), &mission, &Recording::default(), Some(&host))
        };
        let simulate = "mission-control simulate x/mission.toml";
        let run = told(&["target/mission-control", "run", "my m.toml", "--speed-up", "20", "--out", "x"], Some(20.0));
        assert!(run[0].contains("without the clock") && run[1] == simulate, "{run:?}");
        assert!(run[2].contains("another folder behind --out"), "{run:?}");
        assert_eq!(run[3], "mission-control run 'my m.toml' --speed-up 20 --out x");
        let stepped = told(&["mission-control", "run", "m.toml", "--stepped"], None);
        assert!(
            stepped[0].contains("same numbers") && stepped[3] == "mission-control run m.toml --stepped",
            "{stepped:?}"
        );
        assert_eq!(told(&["mission-control", "simulate", "m.toml"], None), [simulate]);
    }

    #[test]
    fn a_run_without_a_recording_says_where_it_may_come_from() {
        let ground = tempfile::tempdir().expect("a folder");
        let run = ground.path().join("run");
        let mission = Mission::parse("m", include_str!("../../missions/auv-helix.toml")).expect("sound");
        let told = || recording(&run).expect_err("nothing there");
        assert!(told().ends_with("give a run folder or an .mcap file"), "{}", told());
        make(Some(&run), &mission).expect("makes");
        let attached = told();
        assert!(attached.contains("was attached to a fleet") && attached.contains("with --attach again"), "{attached}");
        assert!(attached.ends_with(&format!("report {} --logs LOGS", run.display())), "{attached}");
        // What is said is so: the same command with the same folder is let in.
        assert_eq!(make(Some(&run), &mission), Ok(run.clone()));
        let logs = run.join("logs/0");
        fs::create_dir_all(&logs).expect("makes");
        assert!(told().contains("was over before it began"), "{}", told());
        fs::write(logs.join("auv1.mcap"), "").expect("writes");
        assert!(told().contains("makes it of the logs"), "{}", told());
    }

    #[test]
    fn a_folder_in_which_nothing_happened_is_removed_and_what_was_said_is_kept() {
        let ground = tempfile::tempdir().expect("a folder");
        let folder = ground.path().join("run");
        let mission = Mission::parse("m", include_str!("../../missions/auv-helix.toml")).expect("sound");
        let prepare = |said: &str| {
            make(Some(&folder), &mission).expect("makes");
            fs::create_dir_all(folder.join("logs")).expect("makes");
            fs::write(folder.join("logs/network-emulator.log"), said).expect("writes");
        };
        prepare("");
        discard(&folder);
        assert!(!folder.exists());
        prepare("no such device");
        discard(&folder);
        assert!(folder.join("logs/network-emulator.log").exists() && folder.join(MISSION).exists());
    }

    #[test]
    fn a_mission_that_is_there_is_not_overwritten_by_another() {
        let ground = tempfile::tempdir().expect("a folder");
        let text = include_str!("../../missions/auv-helix.toml");
        let copy = ground.path().join(MISSION);
        let make = |text: &str| make(Some(ground.path()), &Mission::parse("m", text).expect("sound"));
        let other = text.replace("seed = 1", "seed = 2");
        make(text).expect("makes");
        make(text).expect("it is the same");
        let refused = make(&other).expect_err("it is another's");
        assert!(refused.contains("is another mission and is not overwritten"), "{refused}");
        assert_eq!(fs::read_to_string(&copy).expect("there"), text);
        // A run that never began leaves what its processes said; one that began also leaves their logs.
        fs::create_dir_all(ground.path().join("logs/0123")).expect("makes");
        make(&other).expect("nothing was recorded");
        fs::write(ground.path().join("logs/0123/auv1.mcap"), "").expect("writes");
        make(text).expect_err("`report` needs it to find the logs");
    }

    #[test]
    fn runs_that_begin_in_the_same_second_have_folders_of_their_own() {
        let ground = tempfile::tempdir().expect("a folder");
        let stem = ground.path().join("runs/helix-2026-01-31-120000").display().to_string();
        let mut made: Vec<PathBuf> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(|| make_free(&stem).expect("makes"))).collect();
            threads.into_iter().map(|thread| thread.join().expect("ends")).collect()
        });
        made.sort();
        made.dedup();
        assert_eq!(made.len(), 8);
        assert!(made.iter().all(|folder| folder.is_dir()) && made[0] == Path::new(&stem), "{made:?}");
    }

    #[test]
    fn the_stamp_is_the_civil_date() {
        let at = |seconds| utc_stamp(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01-000000");
        assert_eq!(at(951_782_400), "2000-02-29-000000");
        assert_eq!(at(1_767_225_599), "2025-12-31-235959");
    }
}
