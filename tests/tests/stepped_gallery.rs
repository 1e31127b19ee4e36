//! Every mission of the thesis' gallery, every mission about talking and the survey of a harbour: real processes in step
//! record what `simulate` records, bit for bit. Also with currents, noise, limits and failures.

use std::path::{Path, PathBuf};

use cpf_tests::{Ground, assert_same_file, in_repository, mission_text, with};

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// Simulates a mission, steps it as processes, and compares what they record.
fn assert_steps_as_it_simulates(ground: &Ground, mission: &Path, name: &str) {
    let (simulated, stepped) = (format!("{name}-simulated"), format!("{name}-stepped"));
    ground.controlled(0, &["simulate", text(mission), "--out", &simulated]);
    ground.controlled(0, &["run", text(mission), "--stepped", "--listen", "tcp/127.0.0.1:0", "--out", &stepped]);
    for file in ["recording.mcap", "summary.json"] {
        assert_same_file(&ground.path(&simulated).join(file), &ground.path(&stepped).join(file));
    }
}

/// The missions in a folder, in the order of their names.
fn missions(folder: &str) -> Vec<PathBuf> {
    let is_mission = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "toml") && path.file_name().is_some_and(|name| name != "gallery.toml")
    };
    let entries = std::fs::read_dir(in_repository(folder)).expect("the folder");
    let mut missions: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).filter(is_mission).collect();
    missions.sort();
    missions
}

fn assert_all_step(missions: &[PathBuf]) {
    let ground = Ground::new();
    for mission in missions {
        let name = mission.file_stem().and_then(|stem| stem.to_str()).expect("a plain name");
        assert_steps_as_it_simulates(&ground, mission, name);
    }
}

// In four parts, to use all cores.

#[test]
fn the_gallery_steps_as_it_simulates_equations() {
    let all = missions("missions/thesis");
    assert!(all.len() >= 30, "{} missions", all.len());
    let split = all.partition_point(|path| path.file_name().is_some_and(|name| name < "fig-2-2"));
    assert_all_step(&all[..split]);
}

#[test]
fn the_gallery_steps_as_it_simulates_figures() {
    let all = missions("missions/thesis");
    let from = all.partition_point(|path| path.file_name().is_some_and(|name| name < "fig-2-2"));
    let to = all.partition_point(|path| path.file_name().is_some_and(|name| name < "g"));
    assert_all_step(&all[from..to]);
}

#[test]
fn the_gallery_steps_as_it_simulates_laws() {
    let all = missions("missions/thesis");
    let from = all.partition_point(|path| path.file_name().is_some_and(|name| name < "g"));
    assert_all_step(&all[from..]);
}

#[test]
fn talk_and_the_survey_step_as_they_simulate() {
    let mut all = missions("missions/talk");
    all.push(in_repository("missions/waypoints.toml"));
    assert_all_step(&all);
}

#[test]
fn disturbed_vehicles_step_as_they_simulate() {
    let ground = Ground::new();
    let disturbed = with(
        &mission_text("missions/thesis/prop-3-3.toml"),
        "[fleet]\n",
        "[fleet]\nnoise = { position_m = 0.05, heading_deg = 0.5, speed_mps = 0.01, turn_rate_degps = 0.1 }\n\
         current = { velocity_mps = [0.05, -0.02, 0.0] }\n\
         failure = { speed_stuck = { speed_mps = 0.4, from_s = 5.0, to_s = 10.0 } }\n",
    );
    let mission = ground.file("disturbed.toml", &disturbed);
    assert_steps_as_it_simulates(&ground, &mission, "disturbed");
}
