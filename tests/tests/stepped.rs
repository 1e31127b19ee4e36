//! A stepped run of real processes over Zenoh gives the same recording as `simulate`, bit for bit.

use std::path::Path;

use cpf_tests::{Ground, PATIENCE, assert_same_file, in_repository, lasting_endpoint, mission_text, of_vehicle, with};

const FREE_PORT: &str = "tcp/127.0.0.1:0";
const ROUGH: &str = "tests/missions/rough-five.toml";

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

fn simulate(ground: &Ground, mission: &Path, out: &str) {
    ground.controlled(0, &["simulate", text(mission), "--out", out]);
}

fn step(ground: &Ground, mission: &Path, out: &str) {
    ground.controlled(0, &["run", text(mission), "--stepped", "--listen", FREE_PORT, "--out", out]);
}

/// The files that mission and seed determine, bit by bit, and what `diff` says of the two runs.
fn assert_equal_runs(ground: &Ground, a: &str, b: &str) {
    for file in ["mission.toml", "recording.mcap", "summary.json"] {
        assert_same_file(&ground.path(a).join(file), &ground.path(b).join(file));
    }
    let said = ground.controlled(0, &["diff", a, b]);
    assert!(said.starts_with("equal ("), "{said}");
    let recording = ground.recording(a);
    assert!(recording.complete && !recording.exact.is_empty() && recording.clock.is_empty());
}

#[test]
fn the_auv_mission_steps_as_it_simulates() {
    let ground = Ground::new();
    let mission = in_repository("missions/auv-helix.toml");
    simulate(&ground, &mission, "simulated");
    step(&ground, &mission, "stepped");
    assert_equal_runs(&ground, "simulated", "stepped");
}

#[test]
fn two_vehicles_that_speak_in_every_period_step_as_they_simulate() {
    let ground = Ground::new();
    let mission = in_repository("missions/thesis/fig-1-10.toml");
    simulate(&ground, &mission, "simulated");
    step(&ground, &mission, "stepped");
    assert_equal_runs(&ground, "simulated", "stepped");
}

#[test]
fn five_vehicles_on_a_rough_network_step_as_they_simulate() {
    let ground = Ground::new();
    let mission = in_repository(ROUGH);
    simulate(&ground, &mission, "simulated");
    step(&ground, &mission, "stepped");
    assert_equal_runs(&ground, "simulated", "stepped");
    let messages = &ground.json("simulated/summary.json")["fleet"]["messages"];
    for cause in ["delivered", "lost", "link_down", "queue_full"] {
        assert!(messages[cause].as_u64().is_some_and(|n| n > 0), "{cause} in {messages}");
    }
}

#[test]
fn vehicles_that_speak_by_event_step_as_they_simulate() {
    let ground = Ground::new();
    let mission = in_repository("missions/talk/event-triggered.toml");
    simulate(&ground, &mission, "simulated");
    step(&ground, &mission, "stepped");
    assert_equal_runs(&ground, "simulated", "stepped");
}

#[test]
fn the_same_seed_repeats_a_run_and_another_does_not() {
    let ground = Ground::new();
    let mission = in_repository(ROUGH);
    let other = ground.file("other.toml", &with(&mission_text(ROUGH), "seed = 7", "seed = 8"));
    simulate(&ground, &mission, "first");
    simulate(&ground, &mission, "again");
    simulate(&ground, &other, "other");
    assert_equal_runs(&ground, "first", "again");
    let said = ground.controlled(1, &["diff", "first", "other"]);
    assert!(said.starts_with("differ at ") && said.contains(" s in ") && said.lines().count() == 1, "{said}");
}

/// Vehicles first and in no order, then the emulator, then mission-control, which collects the logs over the network; the
/// same processes fly a second mission, and the first one again.
#[test]
fn a_fleet_started_by_hand_flies_three_flights() {
    let ground = Ground::new();
    let endpoint = lasting_endpoint();
    let ids = ["d", "a", "e", "c", "b"];
    let mut vehicles = ids.map(|id| ground.vehicle(id, &endpoint));
    let (mut emulator, said) = ground.emulator(&endpoint);
    assert_eq!(said, endpoint);

    let rough = in_repository(ROUGH);
    let gentle = with(&mission_text(ROUGH), "probability = 0.3", "probability = 0.0");
    let gentle = ground.file("gentle.toml", &with(&gentle, "name = \"rough-five\"", "name = \"gentle-five\""));
    for (mission, out) in [(rough.as_path(), "rough"), (&gentle, "gentle"), (&rough, "rough-again")] {
        ground.controlled(0, &["run", text(mission), "--stepped", "--attach", &endpoint, "--out", out]);
        let simulated = format!("{out}-simulated");
        simulate(&ground, mission, &simulated);
        assert_equal_runs(&ground, out, &simulated);
    }
    let status = ground.status(&endpoint).expect("the fleet is still there");
    assert_eq!(status["phase"], "finished");
    for (id, vehicle) in ids.iter().zip(&mut vehicles) {
        assert_eq!(of_vehicle(&status, id)["phase"], "finished");
        assert!(vehicle.is_running());
    }
    for mut process in vehicles {
        process.terminate();
        process.ends_with(0);
    }
    emulator.terminate();
    assert!(emulator.ends(PATIENCE).success());
}
