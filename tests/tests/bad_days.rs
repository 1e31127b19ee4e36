//! Processes that die, freeze and come back while the fleet is under way, and commands given meanwhile. Mission time
//! passes ten times as fast as the wall's; flights whose length matters to nobody are ended by `stop`.

use std::fs;
use std::os::unix::process::CommandExt;
use std::process::Command;

use common::mission::digest;
use common::record::StateRow;
use cpf_tests::{
    Ground, PATIENCE, Process, lasting_endpoint, mission_text, of_vehicle, program, state_at, states, until, with,
};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use serde_json::Value;

const IDS: [&str; 3] = ["a", "b", "c"];
const MISSION: &str = "tests/missions/parallel-three.toml";

/// A fleet started by hand, under way.
struct Fleet {
    endpoint: String,
    emulator: Process,
    vehicles: Vec<Process>,
    control: Process,
    /// Where its logs are, below the ground.
    logs: String,
    /// Last, so that the folder outlives the processes.
    ground: Ground,
}

impl Fleet {
    /// A fleet that flies for so long \[s of mission time\].
    fn under_way(duration_s: f64) -> Fleet {
        let ground = Ground::new();
        let text = with(&mission_text(MISSION), "duration_s = 3000.0", &format!("duration_s = {duration_s:?}"));
        ground.file("mission.toml", &text);
        let (emulator, endpoint) = ground.emulator(&lasting_endpoint());
        let vehicles = IDS.iter().map(|id| ground.vehicle(id, &endpoint)).collect();
        let control = conduct(&ground, &endpoint, "run");
        let logs = format!("logs/{:016x}", digest(&text));
        let fleet = Fleet { endpoint, emulator, vehicles, control, logs, ground };
        fleet.status_until("the fleet is under way", |status| status["phase"] == "running" && now(status) > 15.0);
        fleet
    }

    fn status_until(&self, what: &str, is_such: impl Fn(&Value) -> bool) -> Value {
        self.ground.status_until(&self.endpoint, what, is_such)
    }

    /// Waits until the fleet has flown on for a while.
    fn flies_on(&self, seconds: f64) -> f64 {
        let from = now(&self.status_until("the fleet answers", |_| true));
        now(&self.status_until("the fleet flies on", |status| now(status) > from + seconds))
    }

    /// Ends the flight; the run folder is complete afterwards.
    fn stop(&mut self) {
        assert_eq!(self.ground.controlled(0, &["stop", "--attach", &self.endpoint]), "stopped\n");
        self.control.ends_with(1);
    }

    /// What the programs had to say, as the run folder keeps it.
    fn notes(&self, run: &str) -> String {
        let clock = self.ground.json(&format!("{run}/clock.json"));
        let notes = clock["notes"].as_array().expect("notes").iter();
        notes.map(|note| format!("{}: {}\n", note["source"], note["text"])).collect()
    }

    /// ξ_a − ξ_id at the end of the recording.
    fn apart_at_last(&self, run: &str, id: &str) -> f64 {
        cpf_tests::apart_at_last(&self.ground.recording(run).exact, "a", id)
    }
}

/// Mission-control for the fleet at an endpoint.
fn conduct(ground: &Ground, endpoint: &str, out: &str) -> Process {
    ground.control(&["run", "mission.toml", "--attach", endpoint, "--speed-up", "10", "--out", out])
}

/// A run that waits for the last of its vehicles.
struct Waiting {
    ground: Ground,
    endpoint: String,
    emulator: Process,
    vehicles: [Process; 2],
    control: Process,
}

impl Waiting {
    fn for_c() -> Waiting {
        let ground = Ground::new();
        ground.file("mission.toml", &mission_text(MISSION));
        let (emulator, endpoint) = ground.emulator(&lasting_endpoint());
        let vehicles = ["a", "b"].map(|id| ground.vehicle(id, &endpoint));
        let control = conduct(&ground, &endpoint, "run");
        until(PATIENCE, "it says whom it waits for", || control.stderr().contains("c (not connected)"));
        Waiting { ground, endpoint, emulator, vehicles, control }
    }
}

/// Asserts that a vehicle flew from the start to the end.
fn assert_flown(rows: &[&StateRow], end_s: f64) {
    let (first, last) = (rows[0].t_ns as f64 / 1e9, rows[rows.len() - 1].t_ns as f64 / 1e9);
    assert!(first < 5.0 && last == end_s, "{} flew from {first} to {last} s", rows[0].vehicle);
}

fn all_fly(status: &Value) -> bool {
    status["phase"] == "running" && IDS.iter().all(|id| is_flying(status, id))
}

fn now(status: &Value) -> f64 {
    status["now_s"].as_f64().expect("a time")
}

fn is_flying(status: &Value, id: &str) -> bool {
    let vehicle = of_vehicle(status, id);
    vehicle["connected"] == true && vehicle["phase"] == "running"
}

#[test]
fn a_vehicle_that_is_killed_rejoins_where_the_others_are() {
    let mut fleet = Fleet::under_way(3000.0);
    let file = fleet.ground.path(&format!("{}/b.mcap", fleet.logs));
    until(PATIENCE, "b has recorded something", || fs::metadata(&file).is_ok_and(|m| m.len() > 2000));
    fleet.vehicles[1].kill();
    let status = fleet.status_until("b is missed", |status| of_vehicle(status, "b")["connected"] == false);
    let killed_s = now(&status);
    assert!(is_flying(&status, "a") && is_flying(&status, "c"), "{status}");
    fleet.flies_on(10.0);
    let cut = bus::recording::read(&file).expect("what was recorded before the kill is readable");
    assert!(!cut.complete && !states(&cut.exact, "b").is_empty());

    fleet.vehicles[1] = fleet.ground.vehicle("b", &fleet.endpoint);
    let status = fleet.status_until("b is back", |status| is_flying(status, "b"));
    let back_s = now(&status);
    fleet.flies_on(20.0);
    fleet.stop();

    // Both lives are in the run folder, and nothing between.
    let recording = fleet.ground.recording("run");
    let lives = states(&recording.exact, "b");
    let instants: Vec<f64> = lives.iter().map(|row| row.t_ns as f64 / 1e9).collect();
    let (first, last) = (instants[0], instants[instants.len() - 1]);
    assert!(first < 5.0 && last > back_s, "{first} to {last}, back at {back_s}");
    let gap = instants.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    assert!(gap > 5.0, "killed at {killed_s} and back at {back_s}, but no gap longer than {gap}");
    // Back at the others' place soon: at v_L the fleet went further than this in the gap.
    let apart = fleet.apart_at_last("run", "b");
    assert!(apart.abs() < 0.5, "{apart}");
    // While it was away, what was sent to it was dropped as such, and its links count as down.
    let summary = fleet.ground.json("run/summary.json");
    let links = summary["links"].as_array().expect("links");
    for (from, to) in [("a", "b"), ("b", "a")] {
        let link = links.iter().find(|link| link["from"] == from && link["to"] == to).expect("a link");
        let absent = link["receiver_absent"].as_u64().expect("a count");
        assert!(if to == "b" { absent > 10 } else { absent == 0 }, "{link}");
        assert!(link["longest_outage_s"].as_f64() > Some(5.0) && link["balanced"] == true, "{link}");
    }
    assert!(summary["fleet"]["connectivity"]["alpha"].as_f64() > Some(0.0), "{summary}");
    let notes = fleet.notes("run");
    assert!(notes.contains("lost the line to b") && notes.contains("b joins the flight under way"), "{notes}");
}

#[test]
fn a_log_that_begins_in_mid_flight_is_told() {
    let mut fleet = Fleet::under_way(3000.0);
    fleet.vehicles[1].kill();
    fleet.status_until("b is missed", |status| of_vehicle(status, "b")["connected"] == false);
    // Its next life does not know where the one before kept its log.
    let elsewhere = ["--id", "b", "--connect", &fleet.endpoint, "--logs", "elsewhere"];
    fleet.vehicles[1] = fleet.ground.start("b", Command::new(program("vehicle-node")).args(elsewhere));
    fleet.status_until("b is back", |status| is_flying(status, "b"));
    fleet.flies_on(5.0);
    fleet.stop();
    let facts = fs::read_to_string(fleet.ground.path("run/host.json")).expect("written");
    assert!(facts.contains("the log of b begins at") && !facts.contains("the log of a begins at"), "{facts}");
}

#[test]
fn a_fleet_flies_on_without_its_emulator_and_takes_it_back() {
    let mut fleet = Fleet::under_way(250.0);
    fleet.emulator.kill();
    for vehicle in &fleet.vehicles {
        until(PATIENCE, "the vehicle misses the emulator", || vehicle.stderr().contains("lost the network-emulator"));
    }
    let (emulator, endpoint) = fleet.ground.emulator(&fleet.endpoint);
    assert_eq!(endpoint, fleet.endpoint);
    fleet.emulator = emulator;
    let status = fleet.status_until("everyone is back", |status| {
        status["phase"] == "running" && IDS.iter().all(|id| is_flying(status, id))
    });
    assert!(now(&status) > 15.0 && now(&status) < 250.0, "{status}");
    fleet.control.ends_with(0);
    let recording = fleet.ground.recording("run");
    for id in IDS {
        let rows = states(&recording.exact, id);
        assert_flown(&rows, 250.0);
        assert!(fleet.apart_at_last("run", id).abs() < 0.1);
    }
    let notes = fleet.notes("run");
    assert!(notes.contains("the emulator came back at"), "{notes}");
    // While it was away nobody heard anybody: every link was down, which is measured as such.
    let summary = fleet.ground.json("run/summary.json");
    assert!(summary["fleet"]["connectivity"]["alpha"].as_f64() > Some(0.0), "{}", summary["fleet"]["connectivity"]);
    for link in summary["links"].as_array().expect("links") {
        assert!(link["up_fraction"].as_f64() < Some(1.0) && link["longest_outage_s"].as_f64() > Some(0.5), "{link}");
    }
    // Its first life was cut off: that is told, and harms no vehicle.
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("network-emulator-1.mcap ends in the middle"), "{warnings}");
    assert_eq!(summary["complete"], false);
    let report = fs::read_to_string(fleet.ground.path("run/report.html")).expect("a report");
    assert!(report.contains("the emulator came back at"), "the report tells of it");
}

#[test]
fn a_fleet_finishes_without_mission_control_and_another_one_collects() {
    let mut fleet = Fleet::under_way(200.0);
    fleet.control.kill();
    let status = fleet.status_until("the fleet answers", |_| true);
    assert!(IDS.iter().all(|id| is_flying(&status, id)), "{status}");
    fleet.control = conduct(&fleet.ground, &fleet.endpoint, "second");
    fleet.control.ends_with(0);
    let recording = fleet.ground.recording("second");
    for id in IDS {
        let rows = states(&recording.exact, id);
        assert_flown(&rows, 200.0);
        assert!(fleet.apart_at_last("second", id).abs() < 0.1);
    }
    let summary = fleet.ground.json("second/summary.json");
    assert_eq!(summary["complete"], true);
    assert_eq!(summary["fleet"]["messages"]["balanced"], true);
}

#[test]
fn the_formation_speed_changes_under_way_and_stop_ends_the_flight() {
    let mut fleet = Fleet::under_way(3000.0);
    let said = fleet.ground.controlled(0, &["speed", "0.8", "--attach", &fleet.endpoint]);
    assert!(said.starts_with("formation speed 0.8 from "), "{said}");
    fleet.status_until("the speed is taken", |status| status["speed"] == 0.8);
    fleet.flies_on(40.0);
    fleet.stop();
    let status = fleet.status_until("all have stopped", |status| status["phase"] == "aborted");
    assert!(IDS.iter().all(|id| of_vehicle(&status, id)["phase"] == "aborted"), "{status}");
    let summary = fleet.ground.json("run/summary.json");
    assert_eq!(summary["fleet"]["formation_speed"], 0.8);
    let recording = fleet.ground.recording("run");
    for id in IDS {
        let rows = states(&recording.exact, id);
        let end = rows[rows.len() - 1];
        let before = state_at(&recording.exact, id, end.t_ns as f64 / 1e9 - 5.0);
        let speed = (end.xi - before.xi) / ((end.t_ns - before.t_ns) as f64 / 1e9);
        assert!((speed - 0.8).abs() < 0.05, "{id} flies at {speed}");
    }
    // Nothing is under way any more.
    for command in [&["speed", "0.5"][..], &["stop"]] {
        let mut refused = fleet.ground.control(&[command, &["--attach", &fleet.endpoint]].concat());
        refused.ends_with(1);
        assert!(refused.stderr().starts_with("no flight is under way"), "{}", refused.stderr());
    }
}

#[test]
fn a_speed_command_outlives_the_emulator_that_took_it() {
    let mut fleet = Fleet::under_way(3000.0);
    fleet.ground.controlled(0, &["speed", "0.8", "--attach", &fleet.endpoint]);
    fleet.emulator.kill();
    let (emulator, _) = fleet.ground.emulator(&fleet.endpoint);
    fleet.emulator = emulator;
    let everyone = |status: &Value| status["phase"] == "running" && IDS.iter().all(|id| is_flying(status, id));
    let status = fleet.status_until("everyone is back", everyone);
    fleet.status_until("the speed is in force", |later| now(later) > now(&status) + 20.0 && later["speed"] == 0.8);
    fleet.stop();
    let recording = fleet.ground.recording("run");
    let speeds: Vec<f64> = recording
        .exact
        .iter()
        .filter_map(|record| match record {
            common::record::Record::Speed(row) => Some(row.speed),
            _ => None,
        })
        .collect();
    assert_eq!(speeds, [0.5, 0.8], "each is there, and once");
    let summary = &fleet.ground.json("run/summary.json")["fleet"];
    assert_eq!(summary["formation_speed_at_the_end"], 0.8);
    // Theory speaks of the speed that was commanded, not of the file's.
    assert_eq!(summary["predicted_speed"], 0.8);
}

#[test]
fn a_flight_that_ended_unwatched_is_collected_and_called_so() {
    let mut fleet = Fleet::under_way(3000.0);
    fleet.control.terminate();
    fleet.control.ends_with(0);
    assert!(fleet.control.stderr().contains("the fleet flies on"), "{}", fleet.control.stderr());
    fleet.ground.controlled(0, &["stop", "--attach", &fleet.endpoint]);
    let run = ["run", "mission.toml", "--attach", &fleet.endpoint, "--stepped", "--out", "second"];
    let mut second = fleet.ground.control(&run);
    second.ends_with(1);
    let said = second.stderr();
    assert!(said.contains("ended while nobody watched; run again to fly"), "{said}");
    assert_eq!(fleet.ground.json("second/host.json")["how"], "mission-control run --attach --speed-up 10");
}

#[test]
fn a_flight_that_is_stopped_while_it_waits_for_a_vehicle_ends() {
    let Waiting { ground, endpoint, emulator: _emulator, mut control, vehicles: _vehicles } = Waiting::for_c();
    // Another one of its kind waits behind it for a while, and says so.
    let mut queued = conduct(&ground, &endpoint, "queued");
    queued.ends_with(3);
    let said = queued.stderr();
    assert!(said.contains("queued for its place") && said.contains("another run conducts it"), "{said}");
    ground.status_until(&endpoint, "both are armed", |status| {
        ["a", "b"].iter().all(|id| of_vehicle(status, id)["phase"] == "armed")
    });
    ground.controlled(0, &["stop", "--attach", &endpoint]);
    control.ends_with(1);
    assert!(control.stderr().contains("stopped before the start"), "{}", control.stderr());
    // Of a flight that was not there is nothing to collect: the next one is flown.
    let _c = ground.vehicle("c", &endpoint);
    let mut next = conduct(&ground, &endpoint, "next");
    ground.status_until(&endpoint, "they fly", all_fly);
    ground.controlled(0, &["stop", "--attach", &endpoint]);
    next.ends_with(1);
    assert!(ground.path("next/report.html").exists());
}

#[test]
fn an_emulator_that_is_killed_before_the_start_gets_the_mission_again() {
    let Waiting { ground, endpoint, mut emulator, mut control, vehicles: _vehicles } = Waiting::for_c();
    emulator.kill();
    let (_emulator, _) = ground.emulator(&endpoint);
    let _c = ground.vehicle("c", &endpoint);
    ground.status_until(&endpoint, "they fly", all_fly);
    ground.controlled(0, &["stop", "--attach", &endpoint]);
    control.ends_with(1);
    assert!(ground.path("run/report.html").exists());
}

#[test]
fn a_run_that_is_left_before_its_start_says_so_and_leaves_nothing() {
    let Waiting { ground, emulator: _emulator, mut control, vehicles: _vehicles, .. } = Waiting::for_c();
    control.terminate();
    control.ends_with(1);
    let said = control.stderr();
    assert!(said.contains("interrupted before the start") && !said.contains("flies on"), "{said}");
    assert!(!ground.path("run").exists());
}

/// Robots that diverge within a second or two at a formation speed that none of them can fly.
const WILD: &str = "missions/thesis/fig-3-7.toml";

/// Three robots on one path that are asked for more than any of them can do, whoever else flies.
fn wild() -> String {
    let text = with(&mission_text(WILD), "[formation]\nspeed = 0.1", "[formation]\nspeed = 1e6");
    let (fleet, vehicles) = text.split_once("[[vehicles]]").expect("there are vehicles");
    let first = vehicles.split("[[vehicles]]").next().expect("there is one");
    let all =
        ["r1", "r2", "r3"].map(|id| format!("[[vehicles]]{}", with(first, "id = \"r1\"", &format!("id = \"{id}\""))));
    format!("{fleet}{}", all.concat())
}

#[test]
fn a_flight_in_which_every_vehicle_gives_up_ends_and_says_why() {
    let ground = Ground::new();
    ground.file("wild.toml", &wild());
    let real = ["run", "wild.toml", "--speed-up", "1", "--listen", "tcp/127.0.0.1:0", "--out", "real"];
    let stepped = ["run", "wild.toml", "--stepped", "--listen", "tcp/127.0.0.1:0", "--out", "stepped"];
    let simulated = ["simulate", "wild.toml", "--out", "simulated"];
    // One that gives up ends a flight in lock step.
    for (arguments, out, least) in [(&real[..], "real", 3), (&stepped, "stepped", 1), (&simulated, "simulated", 1)] {
        let mut control = ground.control(arguments);
        control.ends_with(1);
        let (said, summary) = (control.stderr(), ground.json(&format!("{out}/summary.json")));
        assert!(summary["duration_s"].as_f64() < Some(20.0), "it did not fly on without vehicles: {summary}");
        let reasons: Vec<&str> = said.lines().filter(|line| line.contains(" aborted: ")).collect();
        assert!(reasons.len() >= least, "{said}");
        for reason in reasons.iter().filter_map(|line| line.strip_prefix("warning: ")) {
            assert!(summary["warnings"].to_string().contains(reason), "{reason}: {}", summary["warnings"]);
        }
    }
    for file in ["summary.json", "recording.mcap"] {
        cpf_tests::assert_same_file(&ground.path("stepped").join(file), &ground.path("simulated").join(file));
    }
    // Making the report again forgets nothing of it.
    let before = ground.json("real/summary.json");
    ground.controlled(0, &["report", "real"]);
    assert_eq!(ground.json("real/summary.json"), before);
}

#[test]
fn a_vehicle_that_was_frozen_comes_back_into_line() {
    let mut fleet = Fleet::under_way(3000.0);
    fleet.vehicles[2].freeze();
    // The emulator holds it for dead after two seconds of silence.
    let status = fleet.status_until("c is missed", |status| of_vehicle(status, "c")["connected"] == false);
    assert!(is_flying(&status, "a") && is_flying(&status, "b"), "{status}");
    fleet.flies_on(10.0);
    fleet.vehicles[2].thaw();
    fleet.status_until("c is back", |status| is_flying(status, "c"));
    fleet.flies_on(30.0);
    fleet.stop();
    let apart = fleet.apart_at_last("run", "c");
    assert!(apart.abs() < 0.5, "{apart}");
    let missed = fleet.ground.json("run/clock.json")["deadlines"]
        .as_array()
        .and_then(|all| all.iter().find(|one| one["vehicle"] == "c")?["missed"].as_u64());
    assert!(missed.is_some_and(|missed| missed >= 200), "two seconds at 50 ms, ten times as fast: {missed:?}");
}

/// What the plan says was up while nothing was carried is no measurement of the network.
#[test]
fn an_emulator_that_was_frozen_records_that_every_link_was_down() {
    let mut fleet = Fleet::under_way(3000.0);
    fleet.emulator.freeze();
    for vehicle in &fleet.vehicles {
        until(PATIENCE, "the vehicle misses the emulator", || vehicle.stderr().contains("lost the network-emulator"));
    }
    fleet.emulator.thaw();
    fleet.status_until("everyone is back", all_fly);
    fleet.flies_on(20.0);
    fleet.stop();
    let summary = fleet.ground.json("run/summary.json");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("the emulator was not let run from"), "{warnings}");
    assert!(summary["fleet"]["connectivity"]["alpha"].as_f64() > Some(0.0), "{}", summary["fleet"]["connectivity"]);
    for link in summary["links"].as_array().expect("links") {
        assert!(link["longest_outage_s"].as_f64() > Some(10.0), "more than a second, ten times as fast: {link}");
    }
}

/// A run that starts its own processes, in a group of its own as under a terminal, once every vehicle records.
fn own_flight(ground: &Ground) -> Process {
    own_flight_of(ground, &mission_text(MISSION))
}

fn own_flight_of(ground: &Ground, text: &str) -> Process {
    ground.file("mission.toml", text);
    let mut command = Command::new(program("mission-control"));
    let arguments = ["run", "mission.toml", "--speed-up", "10", "--listen", "tcp/127.0.0.1:0", "--out", "run"];
    let control = ground.start("mission-control", command.args(arguments).process_group(0));
    let logs = ground.path(&format!("run/logs/{:016x}", digest(text)));
    for id in IDS {
        let log = logs.join(format!("{id}.mcap"));
        until(PATIENCE, "every vehicle records", || fs::metadata(&log).is_ok_and(|m| m.len() > 2000));
    }
    control
}

fn assert_reported(ground: &Ground) {
    let recording = ground.recording("run");
    assert!(IDS.iter().all(|id| !states(&recording.exact, id).is_empty()));
    assert!(ground.path("run/report.html").exists());
}

#[test]
fn the_terminals_interrupt_ends_an_own_flight_with_its_report() {
    let ground = Ground::new();
    let mut control = own_flight(&ground);
    let group = Pid::from_raw(control.id() as i32).expect("a process");
    kill_process_group(group, Signal::INT).expect("the group exists");
    control.ends_with(1);
    assert_reported(&ground);
}

/// The process of an own flight that was started with this word.
fn own(control: &Process, word: &str) -> Option<Pid> {
    let id = control.id();
    let children = fs::read_to_string(format!("/proc/{id}/task/{id}/children")).expect("Linux");
    let is_meant = |pid: &&str| {
        fs::read_to_string(format!("/proc/{pid}/cmdline")).is_ok_and(|words| words.split('\0').any(|one| one == word))
    };
    let meant = children.split_whitespace().find(is_meant)?;
    Pid::from_raw(meant.parse().expect("a number"))
}

/// Kill -9 for it.
fn kill_own(control: &Process, word: &str) {
    kill_process(own(control, word).expect("it runs"), Signal::KILL).expect("it is there");
}

/// It may come before mission-control has found its own emulator.
#[test]
fn an_interrupt_before_the_start_of_an_own_flight_is_heard() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text(MISSION));
    let mut control = ground.control(&["run", "mission.toml", "--listen", "tcp/127.0.0.1:0", "--out", "run"]);
    until(PATIENCE, "the processes are started", || control.stderr().contains("listens on"));
    kill_process(Pid::from_raw(control.id() as i32).expect("a process"), Signal::INT).expect("it is there");
    control.ends_with(1);
    assert!(control.stderr().contains("interrupted before the start"), "{}", control.stderr());
}

#[test]
fn an_own_emulator_that_dies_before_the_start_is_exit_code_3() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text(MISSION));
    let mut control = ground.control(&["run", "mission.toml", "--listen", "tcp/127.0.0.1:0", "--out", "run"]);
    // A vehicle that is frozen is not armed: the flight does not start.
    let c = cpf_tests::found(PATIENCE, "the last vehicle is started", || own(&control, "c"));
    kill_process(c, Signal::STOP).expect("it is there");
    until(PATIENCE, "contact", || control.stderr().contains("contact: "));
    kill_own(&control, "network-emulator");
    control.ends_with(3);
    let said = control.stderr();
    assert!(said.contains("network-emulator has ended") && said.contains("before the flight"), "{said}");
}

#[test]
fn an_own_flight_ends_with_its_report_when_its_emulator_dies() {
    let ground = Ground::new();
    let mut control = own_flight(&ground);
    kill_own(&control, "network-emulator");
    control.ends_with(1);
    assert_reported(&ground);
}

/// Nobody starts it again: the others fly to the end, and the run says what it lacks.
#[test]
fn an_own_flight_that_loses_a_vehicle_is_flown_to_its_end_and_says_so() {
    let ground = Ground::new();
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = 120.0");
    let mut control = own_flight_of(&ground, &text);
    kill_own(&control, "b");
    control.ends_with(1);
    let said = control.stderr();
    assert!(said.contains("; b is lost") && !said.contains("waiting for b"), "{said}");
    assert_reported(&ground);
    let recording = ground.recording("run");
    for id in ["a", "c"] {
        assert_eq!(states(&recording.exact, id).last().map(|row| row.t_ns), Some(120_000_000_000));
    }
    let summary = ground.json("run/summary.json");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("the states of b end at ") && warnings.contains("b has ended"), "{warnings}");
    assert_eq!(summary["complete"], false);
}

/// Nobody collects them, but they finish what they fly, and do not outlive it.
#[test]
fn own_processes_end_after_the_flight_when_mission_control_is_killed() {
    let ground = Ground::new();
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = 40.0");
    let mut control = own_flight_of(&ground, &text);
    let id = control.id();
    let children = fs::read_to_string(format!("/proc/{id}/task/{id}/children")).expect("Linux");
    let children: Vec<u32> = children.split_whitespace().map(|pid| pid.parse().expect("a number")).collect();
    assert_eq!(children.len(), 4);
    control.kill();
    let lives = |pid: &u32| fs::read_to_string(format!("/proc/{pid}/cmdline")).is_ok_and(|words| !words.is_empty());
    until(PATIENCE, "own processes end", || !children.iter().any(lives));
    for id in IDS {
        let log = ground.path(&format!("run/logs/{:016x}/{id}.mcap", digest(&text)));
        let recording = bus::recording::read(log).expect("it is there");
        let last = states(&recording.exact, id).last().expect("it recorded").t_ns;
        assert!(recording.complete && last == 40_000_000_000, "{id} flew until {last} ns");
    }
}
