//! What is wrong is said in one breath, with its place, and nothing is started.

use std::fs;
use std::net::TcpListener;
use std::process::Command;

use cpf_tests::{Ground, PATIENCE, lasting_endpoint, mission_text, program, with};

const MISSION: &str = "tests/missions/parallel-three.toml";
const ROUGH: &str = "tests/missions/rough-five.toml";

/// Line of a piece of text, from 1.
fn line_of(text: &str, piece: &str) -> usize {
    1 + text[..text.find(piece).unwrap_or_else(|| panic!("{piece} in the mission"))].matches('\n').count()
}

/// Flies a mission that cannot be flown and gives what is said.
fn refused(text: &str) -> String {
    let ground = Ground::new();
    ground.file("wrong.toml", text);
    let mut control = ground.control(&["run", "wrong.toml", "--listen", "tcp/127.0.0.1:0", "--out", "run"]);
    control.ends_with(2);
    assert!(!ground.path("run").exists() && !ground.path("runs").exists(), "nothing may be started");
    assert_eq!(control.stdout(), "");
    control.stderr()
}

/// Asserts that there is one fault, at the line of `piece`, with the key, what was found, and what is allowed.
fn assert_fault(text: &str, piece: &str, key: &str, found: &str, allowed: &str) {
    let said = refused(text);
    let place = format!("wrong.toml:{}: {key}: found {found}", line_of(text, piece));
    let [fault, count] = said.lines().collect::<Vec<_>>()[..] else { panic!("one fault and its count, not\n{said}") };
    assert!(fault.starts_with(&place), "expected {place}\n{said}");
    assert!(fault.contains("; allowed: ") && fault.contains(allowed), "expected allowed: {allowed}\n{said}");
    assert_eq!(count, "1 fault in wrong.toml; nothing was started");
}

#[test]
fn an_unknown_key_is_named_with_those_that_are_known() {
    let text = with(&mission_text(MISSION), "seed = 5", "sead = 5");
    assert_fault(&text, "sead", "sead", "", "seed");
}

#[test]
fn a_number_out_of_its_range_is_named_with_the_range() {
    let text = with(&mission_text(ROUGH), "probability = 0.3", "probability = 1.3");
    assert_fault(&text, "1.3", "network.loss.bernoulli.probability", "1.3", "0 to 1");
    let text = with(&mission_text(MISSION), "control_period_s = 0.05", "control_period_s = -1.0");
    assert_fault(&text, "-1.0", "clock.control_period_s", "-1", "0.0001 to 10 s");
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = nan");
    assert_fault(&text, "nan", "duration_s", "NaN", "above 0");
}

#[test]
fn a_vehicle_that_is_there_twice_is_named() {
    let text = with(&mission_text(MISSION), "id = \"c\"", "id = \"b\"").replace("\"c\"", "\"b\"");
    let text = with(&text, r#"links = [["a", "b"], ["b", "b"], ["a", "b"]]"#, r#"links = [["a", "b"]]"#);
    let said = refused(&text);
    let second = text.rfind("id = \"b\"").map(|byte| 1 + text[..byte].matches('\n').count()).expect("twice");
    assert!(said.contains(&format!("wrong.toml:{second}: vehicles[2].id: found \"b\"")), "{said}");
    assert!(said.contains("allowed: a name that no other vehicle has"), "{said}");
}

#[test]
fn a_corner_is_no_path_for_proposition_3_1() {
    let text = mission_text("missions/thesis/fig-3-7.toml");
    let corner = "{ corner = { turn_deg = 30.0 } },\n  { arc = { radius_m = 4.0, sweep_deg = -90.0 } },";
    let text = with(&text, "{ arc = { radius_m = 4.0, sweep_deg = -90.0 } },", corner);
    let said = refused(&text);
    assert!(said.contains("vehicles[0].path.chain: found a path whose direction jumps at xi = 4.57"), "{said}");
    assert!(said.contains("allowed: a path with a continuous tangent for proposition31"), "{said}");
    assert!(said.ends_with("nothing was started\n") && said.lines().count() == 2, "{said}");
}

#[test]
fn a_law_that_does_not_fit_the_vehicle_is_named_with_both_sides() {
    let text = mission_text(MISSION);
    let text =
        with(&text, "following = { line_of_sight = { distance_m = 1.0 } }", "following = { proposition31 = {} }");
    let said = refused(&text);
    assert!(said.contains("proposition31") && said.contains("kinematic_unicycle"), "{said}");
    // A law that demands an acceleration, and a vehicle that takes a rate.
    let text = with(&mission_text(MISSION), "switching = { gain = 0.3 }", "solution1 = { a = 1.0 }");
    let said = refused(&text);
    assert!(said.contains("solution1") && said.contains("line_of_sight"), "{said}");
}

#[test]
fn a_graph_that_is_never_connected_is_refused() {
    let text = mission_text(MISSION);
    let text = with(&text, r#"links = [["a", "b"], ["b", "c"], ["a", "c"]]"#, r#"links = [["a", "b"]]"#);
    assert_fault(&text, "links = ", "network.links", "a graph that can never be connected", "globally reachable");
}

#[test]
fn all_faults_are_told_at_once_in_the_order_of_the_file() {
    let text = with(&mission_text(MISSION), "gain = 0.3", "gain = -0.3");
    let text = with(&text, "delay_s = 0.2", "delay_s = -5.0");
    let text = with(&text, "start_m = [0.0, 4.0]", "start_m = [0.0, 4.0], rate_m = 0.0");
    let text = with(&text, r#"["a", "c"]"#, r#"["a", "zoe"]"#);
    let said = refused(&text);
    let lines: Vec<usize> =
        said.lines().filter_map(|line| line.strip_prefix("wrong.toml:")?.split(':').next()?.parse().ok()).collect();
    let expected = ["-0.3", "zoe", "-5.0", "rate_m"].map(|piece| line_of(&text, piece));
    assert_eq!(lines, expected, "{said}");
    assert!(said.ends_with("4 faults in wrong.toml; nothing was started\n"), "{said}");
}

#[test]
fn a_file_that_is_no_toml_or_not_there_is_one_line() {
    assert!(refused("name = \n").starts_with("wrong.toml:1: "));
    let ground = Ground::new();
    let mut control = ground.control(&["check", "absent.toml"]);
    control.ends_with(2);
    assert!(control.stderr().starts_with("cannot read the mission file absent.toml: "), "{}", control.stderr());
}

// --- the fleet out of reach ----------------------------------------------------------------------------------------------

#[test]
fn a_port_in_use_is_exit_code_3() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let endpoint = format!("tcp/{}", taken.local_addr().expect("bound"));
    let ground = Ground::new();
    let mut command = Command::new(program("network-emulator"));
    let mut emulator = ground.start("network-emulator", command.args(["--listen", &endpoint]));
    emulator.ends_with(3);
    let said = emulator.stderr();
    assert!(said.contains(&endpoint) && said.contains("in use") && said.lines().count() == 1, "{said}");
    assert_eq!(emulator.stdout(), "");

    let mission = ground.file("mission.toml", &mission_text(MISSION));
    let mission = mission.to_str().expect("plain");
    let mut control = ground.control(&["run", mission, "--listen", &endpoint, "--out", "run"]);
    control.ends_with(3);
    let said = control.stderr();
    let last = said.lines().last().expect("a line");
    assert!(last.contains(&endpoint) && last.contains("in use") && !last.contains("ERROR"), "{said}");
    assert!(!ground.path("run").exists(), "nothing was flown");
}

#[test]
fn an_emulator_that_is_not_there_is_exit_code_3() {
    let ground = Ground::new();
    let nobody = lasting_endpoint();
    ground.file("mission.toml", &mission_text(MISSION));
    let mut node = Command::new(program("vehicle-node"));
    let node = node.args(["--id", "a", "--connect", &nobody, "--patience", "1"]);
    let run = ["run", "mission.toml", "--attach", &nobody, "--patience", "1", "--out", "run"];
    let status = ["status", "--attach", &nobody];
    for mut process in [ground.start("a", node), ground.control(&run), ground.control(&status)] {
        process.ends_with(3);
        let said = process.stderr();
        assert!(said.lines().last().is_some_and(|line| line.contains(&nobody)), "{said}");
    }
}

#[test]
fn a_vehicle_of_a_name_that_is_taken_is_exit_code_3() {
    let ground = Ground::new();
    let (_emulator, endpoint) = ground.emulator("tcp/127.0.0.1:0");
    let first = ground.vehicle("twin", &endpoint);
    cpf_tests::until(PATIENCE, "the first connects", || first.stderr().contains("connected"));
    let mut second = ground.vehicle("twin", &endpoint);
    second.ends_with(3);
    assert!(second.stderr().contains("twin is already connected"), "{}", second.stderr());
}

// --- no room, no folder --------------------------------------------------------------------------------------------------

#[test]
fn a_run_folder_that_cannot_be_made_is_exit_code_4() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text(MISSION));
    ground.file("a-file", "");
    for command in [&["simulate"][..], &["run", "--stepped", "--listen", "tcp/127.0.0.1:0"]] {
        let mut control = ground.control(&[command, &["mission.toml", "--out", "a-file/run"]].concat());
        control.ends_with(4);
        let said = control.stderr();
        assert!(said.lines().last().is_some_and(|line| line.contains("cannot make a-file/run")), "{said}");
    }
}

#[test]
fn a_run_folder_is_not_overwritten() {
    let ground = Ground::new();
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = 5.0");
    ground.file("mission.toml", &text);
    ground.controlled(0, &["simulate", "mission.toml", "--out", "run"]);
    let before = fs::read(ground.path("run/recording.mcap")).expect("recorded");
    let mut again = ground.control(&["simulate", "mission.toml", "--out", "run"]);
    again.ends_with(4);
    assert!(again.stderr().contains("run holds a run already"), "{}", again.stderr());
    assert_eq!(fs::read(ground.path("run/recording.mcap")).expect("still there"), before);
}

/// A program whose files may not grow beyond so many KiB: what a full disk is to it.
fn cramped(name: &str, kib: u32, arguments: &[&str]) -> Command {
    let mut bash = Command::new("bash");
    let script = format!("trap '' XFSZ; ulimit -f {kib}; exec \"$@\"");
    bash.args(["-c", &script, "cramped"]).arg(program(name)).args(arguments);
    bash
}

#[test]
fn a_full_disk_is_exit_code_4() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text(MISSION));
    let mut command = cramped("mission-control", 32, &["simulate", "mission.toml", "--out", "run"]);
    let mut control = ground.start("mission-control", &mut command);
    control.ends_with(4);
    let said = control.stderr();
    assert!(said.lines().last().is_some_and(|line| line.contains("recording.mcap")), "{said}");
}

#[test]
fn a_run_whose_disk_is_full_is_exit_code_4() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text(MISSION));
    let arguments = ["run", "mission.toml", "--stepped", "--listen", "tcp/127.0.0.1:0", "--out", "run"];
    let mut control = ground.start("mission-control", &mut cramped("mission-control", 48, &arguments));
    control.ends_with(4);
    let said = control.stderr();
    assert!(said.lines().last().is_some_and(|line| line.contains("recording.mcap")), "{said}");
    assert!(!ground.path("run/recording.mcap").exists(), "whole or not at all");
}

/// The network goes on without the emulator's log; the run says that it lacks a part of it.
#[test]
fn an_emulator_whose_disk_is_full_goes_on_and_says_so() {
    let ground = Ground::new();
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = 1000.0");
    ground.file("mission.toml", &text);
    let mut command = cramped("network-emulator", 16, &["--listen", "tcp/127.0.0.1:0", "--logs", "logs"]);
    let mut emulator = ground.start("network-emulator", &mut command);
    let endpoint = cpf_tests::found(PATIENCE, "the emulator says where it listens", || {
        emulator.stdout().split_once('\n').map(|(line, _)| line.to_string())
    });
    let _vehicles = ["a", "b", "c"].map(|id| ground.vehicle(id, &endpoint));
    ground.controlled(0, &["run", "mission.toml", "--stepped", "--attach", &endpoint, "--out", "run"]);
    let summary = ground.json("run/summary.json");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("network-emulator-1.mcap ends in the middle"), "{warnings}");
    assert_eq!(summary["complete"], false);
    emulator.terminate();
    emulator.ends_with(4);
    let said = emulator.stderr();
    assert!(said.contains("recording has stopped") && said.contains("the network goes on without it"), "{said}");
}

#[test]
fn logs_that_cannot_be_kept_are_told_before_anything_is_flown() {
    let ground = Ground::new();
    let node = ["--id", "a", "--connect", "tcp/127.0.0.1:9", "--logs", "/proc/nope"];
    let emulator = ["--listen", "tcp/127.0.0.1:0", "--logs", "/proc/nope"];
    for (name, arguments) in [("vehicle-node", &node[..]), ("network-emulator", &emulator)] {
        let mut process = ground.start(name, Command::new(program(name)).args(arguments));
        process.ends_with(4);
        let said = process.stderr();
        assert!(said.lines().count() == 1 && said.contains("cannot keep logs in /proc/nope: "), "{said}");
        assert_eq!(process.stdout(), "");
    }
}

#[test]
fn a_name_that_no_vehicle_can_have_is_wrong_use() {
    let ground = Ground::new();
    let mut process = ground.start("vehicle", Command::new(program("vehicle-node")).args(["--id", "A_Z!"]));
    process.ends_with(2);
    assert!(process.stderr().contains("`A_Z!` cannot be an identity"), "{}", process.stderr());
}

#[test]
fn a_vehicle_whose_disk_is_full_flies_on_and_says_so() {
    let ground = Ground::new();
    let text = with(&mission_text(MISSION), "duration_s = 3000.0", "duration_s = 1000.0");
    ground.file("mission.toml", &text);
    let (_emulator, endpoint) = ground.emulator("tcp/127.0.0.1:0");
    let _others = ["a", "c"].map(|id| ground.vehicle(id, &endpoint));
    let mut command = cramped("vehicle-node", 16, &["--id", "b", "--connect", &endpoint, "--logs", "logs-b"]);
    let mut full = ground.start("b", &mut command);
    ground.controlled(1, &["run", "mission.toml", "--stepped", "--attach", &endpoint, "--out", "run"]);
    let warnings = ground.json("run/summary.json")["warnings"].to_string();
    assert!(warnings.contains("the states of b end at "), "{warnings}");
    full.terminate();
    full.ends_with(4);
    assert!(full.stderr().contains("recording has stopped"), "{}", full.stderr());
    // The others have all of theirs.
    let recording = ground.recording("run");
    for id in ["a", "c"] {
        assert_eq!(cpf_tests::states(&recording.exact, id).last().map(|row| row.t_ns), Some(1_000_000_000_000));
    }
}
