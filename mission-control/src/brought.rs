//! Logs that are brought to a run by hand: those of a vehicle that was out of reach when the others' were collected, or all of a run
//! whose mission-control was killed far from its fleet.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use bus::recording::{Merged, Origin, RowReader, merge};
use common::mission::Mission;
use common::record::{Name, Record, Row};
use common::time::Time;
use common::wire::fleet::Pace;
use common::wire::vehicle::Phase;
use network_emulator::hub::HUB;

use crate::folder::{HostFacts, MISSION, RECORDING, host_of, load, recordings_in, write_host};
use crate::missing;

/// What a recording holds, as far as it matters to what is missing.
#[derive(Default)]
struct Holds {
    origin: Origin,
    /// The instants of the states of each vehicle \[ns\].
    states: BTreeMap<Name, HashSet<i64>>,
    /// Whether it holds what the network did; of a run, before anything was added: the network may have had several lives.
    network: bool,
}

impl Holds {
    fn of(path: &Path) -> Result<Holds, String> {
        let mut rows = RowReader::open(path).map_err(|error| error.to_string())?;
        let mut holds = Holds::default();
        for row in &mut rows {
            match row.map_err(|error| error.to_string())? {
                Row::Exact(Record::State(row)) => drop(holds.states.entry(row.vehicle).or_default().insert(row.t_ns)),
                Row::Exact(Record::Message(_) | Record::Topology(_)) => holds.network = true,
                _ => {}
            }
        }
        holds.origin = rows.origin().clone();
        Ok(holds)
    }

    fn take(&mut self, other: Holds) {
        self.origin.start_unix_ns = self.origin.start_unix_ns.or(other.origin.start_unix_ns);
        for (vehicle, instants) in other.states {
            self.states.entry(vehicle).or_default().extend(instants);
        }
    }

    /// Why a log is not to be added to what is held; nothing if it is.
    fn objection(&self, mission: &Mission, log: &Holds) -> Option<String> {
        let (ours, theirs) = (format!("{:016x}", mission.digest), log.origin.digest.as_str());
        if theirs != ours {
            let theirs = if theirs.is_empty() { "none" } else { theirs };
            return Some(format!("it is of another mission (digest {theirs}, and this run's is {ours})"));
        }
        let starts = self.origin.start_unix_ns.zip(log.origin.start_unix_ns);
        if starts.is_some_and(|(ours, theirs)| ours != theirs) {
            return Some("it is of another flight of this mission, which began at another time".to_string());
        }
        let known = |vehicle: &Name, at: &i64| self.states.get(vehicle).is_some_and(|states| states.contains(at));
        let instants = || log.states.iter().flat_map(|(vehicle, states)| states.iter().map(move |at| (vehicle, at)));
        let (new, old) = instants().fold((0, 0), |(new, old), (vehicle, at)| match known(vehicle, at) {
            true => (new, old + 1),
            false => (new + 1, old),
        });
        match (new, old, log.network) {
            (0, 0, false) => Some("there is nothing in it".to_string()),
            (0, 0, true) if !self.network => None,
            (0, ..) => Some("the run has what is in it".to_string()),
            (_, 0, _) => None,
            _ => Some(format!("the run has {old} of its states already, and {new} not: it may be of another flight")),
        }
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The logs of a mission in a folder as `--logs` of a vehicle names it, or below it; or this log.
fn found_in(place: &Path, digest: u64) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.to_path_buf()];
    }
    let of_mission = recordings_in(&place.join(format!("{digest:016x}")));
    if of_mission.is_empty() { recordings_in(place) } else { of_mission }
}

/// Adds to a run what it lacks of the logs at a place, and merges its recording again. Gives what is to be told of it.
///
/// # Errors
/// Why nothing was added: the file, and what is wrong with it.
pub(crate) fn add(run: &Path, place: &Path) -> Result<Vec<String>, String> {
    if !run.join(MISSION).exists() {
        return Err(format!("--logs: found with {}, which is no run folder: it has no {MISSION}", run.display()));
    }
    let mission = load(&run.join(MISSION))?;
    let digest = mission.digest;
    let recording = run.join(RECORDING);
    let mut held = if recording.exists() { Holds::of(&recording)? } else { Holds::default() };
    let mut logs = found_in(place, digest);
    if logs.is_empty() {
        let place = place.display();
        return Err(format!(
            "--logs: found no recording in {place} or {place}/{digest:016x}; allowed: the folder that vehicle-node --logs names, or a log"
        ));
    }
    // The network's first: of several flights its newest is meant, if the run does not say.
    logs.sort_by_key(|path| !name(path).starts_with(HUB));
    let (mut taken, mut notes, mut vehicles) = (Vec::new(), Vec::new(), Vec::new());
    for path in logs {
        let log = Holds::of(&path)?;
        match held.objection(&mission, &log) {
            Some(why) => notes.push(format!("{} is left out: {why}", path.display())),
            None => {
                vehicles.extend(log.states.keys().cloned());
                held.take(log);
                taken.push(path);
            }
        }
    }
    if taken.is_empty() {
        return Err(format!("nothing was added to {}:\n{}", run.display(), notes.join("\n")));
    }
    let inputs: Vec<PathBuf> = recording.exists().then(|| recording.clone()).into_iter().chain(taken.clone()).collect();
    let merged = merge(&inputs, &recording).map_err(|error| error.to_string())?;
    let names: Vec<String> = taken.iter().map(|path| name(path)).collect();
    notes.insert(0, format!("added to {}: {}", run.display(), names.join(", ")));
    write_host(run, &told(host_of(run), &mission, &merged, &vehicles, names))?;
    Ok(notes)
}

/// What is told of a run after logs with states of these vehicles were added to it.
fn told(
    before: Option<HostFacts>,
    mission: &Mission,
    merged: &Merged,
    vehicles: &[Name],
    names: Vec<String>,
) -> HostFacts {
    let mut host = before.unwrap_or_else(|| {
        let how = "mission-control, from logs that were brought to a run that it did not end,";
        let everyone = mission.vehicles.iter().map(|vehicle| format!("log of {}: not brought yet", vehicle.id));
        HostFacts::now(how, None, 0.0, everyone.collect(), Vec::new())
    });
    let is_of = |text: &String, id: &Name| missing::is_about_states_of(text, id);
    host.missing.retain(|text| !vehicles.iter().any(|id| is_of(text, id)));
    host.missing.extend(missing::damage(merged));
    let grace = mission.control_period * mission.record_ticks;
    let flown = merged.spans.values().any(|(_, end)| Time::from_nanos(*end) + grace >= mission.end);
    let phase = if flown { Phase::Finished } else { Phase::Aborted };
    let pace = host.speed_up.map_or(Pace::Stepped, |speed_up| Pace::Real { speed_up });
    let of_added = |id: &str| vehicles.iter().any(|added| **added == *id);
    let untold = |id: &str| !missing::gave_up(&host.aborted, id);
    let cut_short = missing::cut_short(mission, phase, merged).into_iter();
    let cut_short: Vec<String> = cut_short.filter(|(id, _)| of_added(id) && untold(id)).map(|(_, text)| text).collect();
    host.missing.extend(cut_short);
    if host.speed_up.is_some() {
        let late = missing::late_beginnings(mission, pace, merged).into_iter();
        host.missing.extend(late.filter(|text| vehicles.iter().any(|id| is_of(text, id))));
    }
    host.added.extend(names);
    // What was added is not among the logs below the run folder: it must not be merged without it.
    host.salvaged = false;
    host
}

/// Sorts out logs that an earlier flight of the same mission left: the flight is that of the network's newest log, or of the newest
/// at all. Gives what is left, and what is to be told of the rest.
pub(crate) fn of_one_flight(logs: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<String>) {
    let start = |path: &PathBuf| RowReader::open(path).ok().and_then(|rows| rows.origin().start_unix_ns);
    let starts: Vec<Option<i64>> = logs.iter().map(start).collect();
    let of_network = || logs.iter().zip(&starts).filter(|(path, _)| name(path).starts_with(HUB));
    let flight = match of_network().count() {
        0 => starts.iter().copied().max().flatten(),
        _ => of_network().map(|(_, start)| *start).max().flatten(),
    };
    let is_other = |start: Option<i64>| start.is_some() && start != flight;
    let left_out = |path: &PathBuf| format!("{} is of another flight of the mission, and left out", name(path));
    let told =
        logs.iter().zip(&starts).filter(|(_, start)| is_other(**start)).map(|(path, _)| left_out(path)).collect();
    let kept = logs.iter().zip(&starts).filter(|(_, start)| !is_other(**start)).map(|(path, _)| path.clone()).collect();
    (kept, told)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use bus::recording::{Recorder, read};
    use common::record::{Fate, MessageRow};

    use super::*;
    use crate::folder::{finish, report};
    use crate::results::testing::state_row;

    /// A run of half a minute, of which the log of auv3 was never collected.
    struct Ground {
        folder: tempfile::TempDir,
        run: PathBuf,
        mission: Mission,
    }

    const START: Option<i64> = Some(1_700_000_000_000_000_000);
    const LOST: &str = "log of auv3: not connected when the flight was over";

    impl Ground {
        fn new() -> Ground {
            let text = include_str!("../../missions/auv-helix.toml");
            let text = text.replace("duration_s = 800.0", "duration_s = 30.0");
            let mission = Mission::parse("m", &text).unwrap_or_else(|faults| panic!("{faults}"));
            let folder = tempfile::tempdir().expect("a folder");
            let run = folder.path().join("run");
            fs::create_dir_all(&run).expect("makes");
            fs::write(run.join(MISSION), &mission.text).expect("writes");
            Ground { folder, run, mission }
        }

        /// A log with states at these seconds.
        fn log(&self, path: &str, vehicle: &str, seconds: std::ops::Range<i64>, start: Option<i64>) -> PathBuf {
            let path = self.folder.path().join(path);
            fs::create_dir_all(path.parent().expect("below")).expect("makes");
            let mut recorder = Recorder::create(&path, &bus::logs::origin(&self.mission, start)).expect("starts");
            for t_s in seconds {
                let state = Record::State(state_row(t_s * 1_000_000_000, vehicle, t_s as f64));
                recorder.write(&Row::Exact(state)).expect("writes");
            }
            recorder.finish().expect("ends");
            path
        }

        fn network(&self, path: &str, start: Option<i64>) -> PathBuf {
            let path = self.folder.path().join(path);
            let mut recorder = Recorder::create(&path, &bus::logs::origin(&self.mission, start)).expect("starts");
            for t_s in 0..20 {
                let (from, to, t_ns) = ("auv3".into(), "auv2".into(), t_s * 1_000_000_000);
                let (sent_ns, due_ns, fate) = (t_ns, t_ns, Fate::Delivered);
                let row = MessageRow { t_ns, from, to, seq: t_s as u64, sent_ns, due_ns, fate };
                recorder.write(&Row::Exact(Record::Message(row))).expect("writes");
            }
            recorder.finish().expect("ends");
            path
        }

        /// The run as it was collected.
        fn collected(self) -> Ground {
            let logs = [
                self.log("a.mcap", "auv1", 0..31, START),
                self.log("b.mcap", "auv2", 0..31, START),
                self.network("n.mcap", START),
            ];
            merge(&logs, self.run.join(RECORDING)).expect("merges");
            let missing = vec![LOST.to_string(), "there are no states of auv3".to_string(), "else".to_string()];
            let host = HostFacts::now("mission-control run --attach", Some(1.0), 30.0, missing, Vec::new());
            finish(&self.run, &host).expect("reports");
            self
        }

        fn place(&self, path: &str) -> PathBuf {
            self.folder.path().join(path)
        }

        fn page(&self) -> String {
            fs::read_to_string(self.run.join("report.html")).expect("a report")
        }
    }

    #[test]
    fn a_log_that_a_run_lacks_is_added_and_the_run_knows_it() {
        let ground = Ground::new().collected();
        assert!(ground.page().contains("auv3 was lost at 19 s</strong>, and there is no log of it"));
        let hash = format!("{:016x}", ground.mission.digest);
        ground.log(&format!("lg/{hash}/auv3.mcap"), "auv3", 0..20, START);
        let notes = add(&ground.run, &ground.place("lg")).expect("adds");
        assert_eq!(notes, [format!("added to {}: auv3.mcap", ground.run.display())]);
        let (summary, _) = report(&ground.run).expect("reports");
        assert_eq!((summary.vehicles[2].rows, summary.vehicles[2].last_s), (20, Some(19.0)));
        let host = host_of(&ground.run).expect("facts");
        assert_eq!(host.missing, ["else", "the states of auv3 end at 19.000 s, before the flight did"]);
        let page = ground.page();
        assert!(page.contains("Logs added afterwards: auv3.mcap."), "{page}");
        assert!(page.contains("<strong>auv3 was lost at 19 s</strong>.") && !page.contains("no log of"), "{page}");
        // Twice is once.
        let again = add(&ground.run, &ground.place("lg")).expect_err("nothing new");
        assert!(again.contains("auv3.mcap is left out: the run has what is in it"), "{again}");
    }

    #[test]
    fn what_is_of_another_mission_or_flight_is_refused_with_the_reason() {
        let ground = Ground::new().collected();
        let before = fs::read(ground.run.join(RECORDING)).expect("recorded");
        let later = ground.log("other/auv3.mcap", "auv3", 0..31, START.map(|start| start + 1));
        let refused = |place: &Path| add(&ground.run, place).expect_err("refused");
        assert!(refused(&later).contains("it is of another flight of this mission"));
        let mut foreign = Ground::new();
        foreign.mission = Mission::parse("m", &foreign.mission.text.replace("seed = ", "seed = 9")).expect("sound");
        let log = foreign.log("auv3.mcap", "auv3", 0..31, START);
        assert!(refused(&log).contains("it is of another mission (digest "), "{}", refused(&log));
        assert!(refused(&ground.place("nowhere")).contains("allowed: the folder that vehicle-node --logs names"));
        let part = ground.log("part/auv1.mcap", "auv1", 20..40, None);
        assert!(refused(&part).contains("the run has 11 of its states already, and 9 not"), "{}", refused(&part));
        assert!(add(&ground.place("other"), &later).expect_err("no run").contains("which is no run folder"));
        assert_eq!(fs::read(ground.run.join(RECORDING)).expect("still there"), before);
    }

    #[test]
    fn a_run_without_a_recording_is_made_of_what_is_brought() {
        let ground = Ground::new();
        for id in ["auv1", "auv2", "auv3"] {
            ground.log(&format!("lg/{id}.mcap"), id, 0..31, START);
        }
        // The network had two lives.
        for path in ["lg/network-emulator.mcap", "lg/network-emulator-2.mcap"] {
            ground.network(path, START);
        }
        // Of an earlier flight, in which it was not.
        ground.log("lg/auv3-2.mcap", "auv3", 40..50, START.map(|start| start - 1));
        let notes = add(&ground.run, &ground.place("lg")).expect("adds");
        assert!(notes.len() == 2 && notes[1].contains("auv3-2.mcap is left out"), "{notes:?}");
        assert!(notes[0].contains("network-emulator-2.mcap, network-emulator.mcap"), "{notes:?}");
        let (summary, _) = report(&ground.run).expect("reports");
        assert!(summary.vehicles.iter().all(|vehicle| vehicle.rows == 31) && summary.complete, "{summary:?}");
        assert_eq!(read(ground.run.join(RECORDING)).expect("merged").start_unix_ns, START);
    }

    #[test]
    fn what_an_earlier_flight_left_is_sorted_out() {
        let ground = Ground::new();
        let old = ground.log("auv3.mcap", "auv3", 0..31, START.map(|start| start - 1));
        let new = ground.log("auv3-2.mcap", "auv3", 10..31, START);
        let network = ground.network("network-emulator.mcap", START);
        let (kept, told) = of_one_flight(vec![old.clone(), new.clone(), network.clone()]);
        assert_eq!(kept, [new.clone(), network]);
        assert_eq!(told, ["auv3.mcap is of another flight of the mission, and left out"]);
        let silent = ground.log("silent.mcap", "auv1", 0..31, None);
        assert_eq!(of_one_flight(vec![old, new.clone(), silent.clone()]).0, [new, silent]);
    }
}
