//! A stepped run of real processes over Zenoh gives the same recording as `simulate`, bit for bit.

use std::path::Path;

use common::record::ClockRecord;
use cpf_tests::{Ground, PATIENCE, assert_same_file, in_repository, lasting_endpoint, mission_text, of_vehicle, with};

const FREE_PORT: &str = "tcp/127.0.0.1:0";
const ROUGH: &str = "tests/missions/rough-five.toml";
const EVERYTHING: &str = "tests/missions/everything-five.toml";

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
    assert!(recording.complete && !recording.exact.is_empty());
    // Of what depends on the clock there is nothing but notes: of garbage that vehicles heard, if bits were flipped.
    assert!(recording.clock.iter().all(|record| matches!(record, ClockRecord::Note(_))), "{:?}", recording.clock);
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

/// Every model of the network at once; those that exclude one another in a second mission.
#[test]
fn every_model_of_the_network_steps_as_it_simulates() {
    let ground = Ground::new();
    let slots = "slots = { slot_s = 0.1, guard_s = 0.03, order = [\"e\", \"a\", \"b\", \"c\", \"d\", \"a\"] }";
    let other = with(&mission_text(EVERYTHING), "backoff_s = 0.08", slots);
    let other = with(&other, "when_full = \"drop_old\"", "when_full = \"drop_new\"");
    let other = with(
        &other,
        "switching = { markov = { mean_up_s = 6.0, mean_down_s = 1.5 } }",
        "switching = { connected_in_mean = { window_s = 12.0, dwell_s = 0.3 } }",
    );
    let other = ground.file("other.toml", &other);
    simulate(&ground, &other, "other-simulated");
    step(&ground, &other, "other-stepped");
    assert_equal_runs(&ground, "other-simulated", "other-stepped");

    let mission = in_repository(EVERYTHING);
    simulate(&ground, &mission, "simulated");
    step(&ground, &mission, "stepped");
    assert_equal_runs(&ground, "simulated", "stepped");
    let messages = &ground.json("simulated/summary.json")["fleet"]["messages"];
    for fate in [
        "delivered",
        "lost",
        "out_of_range",
        "link_down",
        "queue_full",
        "half_duplex",
        "collision",
        "corrupt",
        "copied",
        "copy_dropped",
    ] {
        assert!(messages[fate].as_u64().is_some_and(|n| n > 0), "{fate} in {messages}");
    }
    assert_eq!(messages["balanced"], true);
}

/// A mission that is given the recorded network of a run has the same links at the same times.
#[test]
fn the_network_of_a_run_can_be_flown_again() {
    let ground = Ground::new();
    simulate(&ground, &in_repository(ROUGH), "first");
    ground.controlled(0, &["export", "first", "--format", "network"]);
    let section = std::fs::read_to_string(ground.path("first").join("network.toml")).expect("exported");
    let text = mission_text(ROUGH);
    let without = |text: &str, key: &str| {
        let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with(key)).collect();
        assert!(lines.len() + 1 == text.lines().count(), "{key} is one line of the mission");
        lines.join("\n")
    };
    let text = ["switching = ", "loss = ", "exceptions = "].iter().fold(text, |text, key| without(&text, key));
    let again = ground.file("again.toml", &with(&text, "[fleet]", &format!("{section}\n[fleet]")));
    simulate(&ground, &again, "again");
    ground.controlled(0, &["export", "first"]);
    ground.controlled(0, &["export", "again"]);
    assert_same_file(&ground.path("first").join("topology.csv"), &ground.path("again").join("topology.csv"));
    let links = |run: &str| ground.json(&format!("{run}/summary.json"))["links"].clone();
    for (first, again) in
        links("first").as_array().expect("links").iter().zip(links("again").as_array().expect("links"))
    {
        // b -> a had another delay; on the others every message that was lost on the way is lost again.
        if first["from"] != "b" || first["to"] != "a" {
            let dropped = |link: &serde_json::Value| {
                link["lost"].as_u64().unwrap_or(0) + link["queue_full"].as_u64().unwrap_or(0)
            };
            assert_eq!(dropped(first), dropped(again), "{first} beside {again}");
        }
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

/// The stepped clock is not the wall clock of the flight before.
#[test]
fn flights_in_steps_and_in_real_time_take_turns_on_one_fleet() {
    let ground = Ground::new();
    let text = mission_text("tests/missions/parallel-three.toml");
    let mission = ground.file("mission.toml", &with(&text, "duration_s = 3000.0", "duration_s = 100.0"));
    let (_emulator, endpoint) = ground.emulator(FREE_PORT);
    let _vehicles = ["a", "b", "c"].map(|id| ground.vehicle(id, &endpoint));
    simulate(&ground, &mission, "simulated");
    let run = ["run", "mission.toml", "--attach", &endpoint, "--out"];
    for turn in 1..=2 {
        let (real, stepped) = (format!("real-{turn}"), format!("stepped-{turn}"));
        ground.controlled(0, &[&run[..], &[&real, "--speed-up", "50"]].concat());
        ground.controlled(0, &[&run[..], &[&stepped, "--stepped"]].concat());
        assert_equal_runs(&ground, &stepped, "simulated");
    }
}
