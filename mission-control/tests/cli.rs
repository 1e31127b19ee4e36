//! The command line of mission-control. That this file exists makes `cargo test` build the program itself.

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mission-control")).args(arguments).output().expect("the program starts")
}

#[test]
fn help_and_version_are_told() {
    let help = run(&["--help"]);
    assert!(help.status.success());
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(text.contains("Usage: mission-control") && text.contains("Exit codes"), "{text}");
    let version = run(&["--version"]);
    assert_eq!(String::from_utf8_lossy(&version.stdout), format!("mission-control {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_wrong_option_is_exit_code_2_and_no_panic() {
    let wrong = run(&["--no-such-option"]);
    assert_eq!(wrong.status.code(), Some(2));
    let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(text.contains("--no-such-option") && !text.contains("panicked"), "{text}");
}

#[test]
fn a_search_of_no_flights_is_exit_code_2() {
    let options = ["--alpha", "0.5", "--t0", "5", "--dwell", "2.5", "--flights", "0"];
    let wrong = run(&[&["worst", "../missions/auv-helix.toml"][..], &options].concat());
    let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert_eq!(wrong.status.code(), Some(2), "{text}");
    assert!(text.contains("--flights") && text.contains("allowed: a whole number from 1"), "{text}");
}

/// A robot that starts where a circle's points are all equally near is counted a warning in its first control periods.
#[test]
fn counted_warnings_of_a_flight_are_told_and_stay_out_of_the_json() {
    let text = include_str!("../../missions/thesis/fig-2-11-ccw.toml");
    let at_the_centre = text.replace("duration_s = 150.0", "duration_s = 2.0").replace("x_m = 2.0,", "x_m = 0.0,");
    let folder = tempfile::tempdir().expect("a folder");
    let mission = folder.path().join("centre.toml");
    std::fs::write(&mission, at_the_centre).expect("written");
    let mission = mission.display().to_string();
    for (name, json) in [("plain", &[][..]), ("piped", &["--json"])] {
        let out = folder.path().join(name).display().to_string();
        let flown = run(&[&["simulate", &mission, "--out", &out], json].concat());
        let told = String::from_utf8_lossy(&flown.stderr).into_owned();
        assert!(told.contains("warning: r1: ") && told.contains(" control periods."), "{told}");
        let numbers = String::from_utf8_lossy(&flown.stdout).into_owned();
        assert!(!numbers.contains("warning: "), "{numbers}");
        if !json.is_empty() {
            let summary: serde_json::Value = serde_json::from_str(&numbers).expect("JSON alone");
            assert!(summary["warnings"][0].as_str().is_some_and(|text| told.contains(text)), "{summary}");
        }
    }
}

/// The command of the documentation as it is, but for the mission: 600 short flights.
#[test]
fn a_sweep_over_loss_and_a_gain_needs_no_whole_keys() {
    let text = include_str!("../../tests/missions/loss-delay.toml").replace("duration_s = 25.0", "duration_s = 0.5");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("loss-delay.toml"), text).expect("written");
    let command = "sweep loss-delay.toml --set network.loss=0:0.9:0.1 --set coordination.gain=0.05,0.1,0.2 --repeat 20";
    let swept = Command::new(env!("CARGO_BIN_EXE_mission-control"))
        .args(command.split(' '))
        .current_dir(folder.path())
        .output()
        .expect("the program starts");
    let told = String::from_utf8_lossy(&swept.stderr).into_owned();
    assert!(swept.status.success(), "{told}");
    let file = |name: &str| {
        std::fs::read_to_string(folder.path().join("runs/sweep-loss-delay").join(name)).expect("a file of the sweep")
    };
    assert_eq!(file("runs.csv").lines().count(), 1 + 10 * 3 * 20);
    assert!(file("README.md").contains(&format!("mission-control {command}")), "{}", file("README.md"));
    assert!(file("sweep.svg").contains("coordination.law.switching.gain"));
    // The command of a cell flies it again, to the numbers of its first run.
    let cells = file("cells.csv");
    assert_eq!(cells.lines().count(), 1 + 10 * 3);
    let replay = cells.lines().nth(17).and_then(|line| line.rsplit(',').next()).expect("a command");
    assert!(replay.starts_with("mission-control simulate loss-delay.toml --set "), "{replay}");
    let arguments: Vec<&str> = replay.split(' ').skip(1).chain(["--json"]).collect();
    let again = Command::new(env!("CARGO_BIN_EXE_mission-control"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("the program starts");
    let summary: serde_json::Value = serde_json::from_slice(&again.stdout).expect("JSON");
    let error = summary["fleet"]["coordination"]["last"].as_f64().expect("a number");
    let first = file("runs.csv").lines().nth(1 + 16 * 20).map(str::to_owned).expect("a run");
    assert!(first.split(',').any(|field| field.parse() == Ok(error)), "{error} in {first}");
}

#[test]
fn a_patience_that_is_none_is_exit_code_2_and_no_panic() {
    for patience in ["nan", "inf", "-1", "1e300", "soon"] {
        let flag = format!("--patience={patience}");
        let wrong = run(&[&["run", "m.toml", "--attach"][..], &[&flag]].concat());
        let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
        assert_eq!(wrong.status.code(), Some(2), "{text}");
        assert!(text.contains("allowed: 0 to 1e9 s") && !text.contains("panicked"), "{text}");
    }
}

#[test]
fn a_speed_up_that_nobody_can_fly_is_exit_code_2() {
    let mission = concat!(env!("CARGO_MANIFEST_DIR"), "/../missions/auv-helix.toml");
    for speed_up in ["nan", "0", "1e-308", "1001"] {
        let wrong = run(&["run", mission, "--speed-up", speed_up]);
        let text = String::from_utf8_lossy(&wrong.stderr).into_owned();
        assert_eq!(wrong.status.code(), Some(2), "{text}");
        assert!(text.contains("allowed: 0.001 to 1000"), "{text}");
    }
}
