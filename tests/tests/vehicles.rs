//! Vehicles, disturbances and paths, from mission files: what is followed, and what a disturbance leaves.

use bus::recording::Recording;
use common::record::{Record, Row};
use cpf_tests::{mission, mission_text, state_at, with};
use mission_control::facts::facts;
use mission_control::results::{Summary, summarise};
use mission_control::simulate::simulate;

/// What was recorded of a mission flown in this thread, and its numbers.
fn fly(text: &str) -> (Recording, Summary) {
    let mission = mission(text);
    let mut recording = Recording { complete: true, seed: mission.seed, ..Recording::default() };
    let keep = |row| match row {
        Row::Exact(record) => recording.exact.push(record),
        Row::Clock(record) => recording.clock.push(record),
    };
    simulate(&mission, keep, |_| true).expect("the mission can be flown");
    let summary = summarise(&recording, &facts(&mission));
    (recording, summary)
}

#[test]
fn proposition_3_2_brings_the_robots_to_their_circles_and_abreast() {
    let (_, summary) = fly(&mission_text("missions/thesis/prop-3-2.toml"));
    assert!(summary.fleet.path_error_final_m < 1e-2, "{}", summary.fleet.path_error_final_m);
    assert!(summary.fleet.coordination.last < 1e-3, "{}", summary.fleet.coordination.last);
    assert!((summary.fleet.steady_speed - 0.1).abs() < 1e-3);
}

#[test]
fn proposition_3_3_brings_marine_vehicles_to_their_circles_whatever_their_side_slip() {
    let (recording, summary) = fly(&mission_text("missions/thesis/prop-3-3.toml"));
    assert!(summary.fleet.path_error_final_m < 1e-2, "{}", summary.fleet.path_error_final_m);
    assert!(summary.fleet.coordination.last < 1e-3, "{}", summary.fleet.coordination.last);
    // The bow of the second is 20 degrees to the right of its way: a steady side-slip to the left.
    let row = state_at(&recording.exact, "m2", 120.0);
    let along = row.y_m.atan2(row.x_m) + std::f64::consts::FRAC_PI_2;
    let off = (along - row.yaw_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    assert!((off.to_degrees() - 20.0).abs() < 0.5, "{}", off.to_degrees());
    // It starts from rest, where no side-slip can be commanded: counted, and told.
    assert!(summary.warnings.iter().any(|warning| warning.starts_with("m2: too slow")), "{:?}", summary.warnings);
}

#[test]
fn the_approach_of_appendix_6_1_and_the_sense_of_the_wanted_speed_are_the_missions_choice() {
    let robots = mission_text("missions/thesis/prop-3-2.toml");
    let marine = mission_text("missions/thesis/prop-3-3.toml");
    let flat = "approach = { arctangent = { psi_a_deg = 40.0 } }";
    for (text, id, old, new) in [
        (&robots, "r1", "proposition32 = {}", format!("proposition32 = {{ {flat} }}")),
        (&robots, "r1", "proposition32 = {}", format!("proposition31 = {{ {flat}, sense_of = \"desired_speed\" }}")),
        (&marine, "m2", "slip_deg = 20.0", format!("slip_deg = 20.0, {flat}")),
    ] {
        let (recording, summary) = fly(&with(text, old, &new));
        assert!(summary.fleet.path_error_final_m < 1e-2, "{new}: {}", summary.fleet.path_error_final_m);
        assert!(summary.fleet.coordination.last < 1e-3, "{new}: {}", summary.fleet.coordination.last);
        let (printed, _) = fly(text);
        let [at, other] = [&recording, &printed].map(|run| state_at(&run.exact, id, 2.0).psi_e_rad);
        assert!((at - other).abs() > 1e-3, "{new}: the approach is another one");
    }
    // Going backwards at the start, by the wanted speed it counts as going forward: it swings further out.
    let backwards = with(&robots, "yaw_deg = 90.0, speed_mps = 0.2", "yaw_deg = 90.0, speed_mps = -0.4");
    let desired = with(&backwards, "proposition32 = {}", "proposition32 = { sense_of = \"desired_speed\" }");
    let [actual, desired] = [backwards, desired].map(|text| {
        let (recording, summary) = fly(&text);
        assert!(summary.fleet.path_error_final_m < 1e-2, "{}", summary.fleet.path_error_final_m);
        state_at(&recording.exact, "r1", 1.0).yaw_rad
    });
    assert!((actual - desired).abs() > 1e-3, "{actual} {desired}");
}

#[test]
fn a_robot_whose_speed_is_stuck_keeps_to_its_circle() {
    let stuck =
        "\nfailure = { speed_stuck = { speed_mps = 0.25, from_s = 20.0, to_s = 60.0 } }\n\n[[vehicles]]\nid = \"r2\"";
    let text = with(&mission_text("missions/thesis/solution-1.toml"), "\n[[vehicles]]\nid = \"r2\"", stuck);
    let (recording, _) = fly(&text);
    for t_s in 15..60 {
        let row = state_at(&recording.exact, "r1", f64::from(t_s));
        assert!(row.e_cross_m.abs() < 0.02, "{t_s} s: {} m", row.e_cross_m);
    }
    assert_eq!(state_at(&recording.exact, "r1", 40.0).speed_mps, 0.25);
}

#[test]
fn a_survey_along_geojson_lanes_is_flown_abreast() {
    let (recording, summary) = fly(&mission_text("missions/waypoints.toml"));
    assert!(summary.fleet.coordination.last < 0.05, "{}", summary.fleet.coordination.last);
    for vehicle in &summary.vehicles {
        // δ leaves 0.94 m along the path at v_n; the bends add a little.
        assert!((vehicle.along_mean_m + 0.94).abs() < 0.1, "{}: {}", vehicle.id, vehicle.along_mean_m);
        assert!(vehicle.cross_rms_m < 0.2, "{}: {}", vehicle.id, vehicle.cross_rms_m);
        assert!((state_at(&recording.exact, &vehicle.id, 480.0).z_m + 5.0).abs() < 0.1);
    }
}

#[test]
fn a_current_a_noise_and_a_weak_engine_reach_the_result() {
    let text = mission_text("missions/thesis/fig-1-9.toml");
    // The lines run along x: (2/π) atan(y/Δ) v = c, thus a distance of Δ tan(π c/(2v)) remains.
    let current = with(&text, "[fleet]\n", "[fleet]\ncurrent = { velocity_mps = [0.0, 0.05, 0.0] }\n");
    let (_, summary) = fly(&current);
    let expected = (std::f64::consts::PI * 0.05 / (2.0 * 0.5)).tan();
    for vehicle in &summary.vehicles {
        assert!((vehicle.cross_rms_m / expected - 1.0).abs() < 0.05, "{} {expected}", vehicle.cross_rms_m);
    }
    let noisy =
        with(&text, "[fleet]\n", "[fleet]\nnoise = { position_m = 0.05 }\nlimits = { turn_rate_degps = 2.0 }\n");
    let ((once, summary), (again, _)) = (fly(&noisy), fly(&noisy));
    assert_eq!(once.exact, again.exact, "noise is a function of the seed");
    assert!(summary.vehicles.iter().all(|vehicle| vehicle.cross_rms_m < 0.2));
    assert!(summary.warnings.iter().any(|warning| warning.contains("at its limit")), "{:?}", summary.warnings);
}

#[test]
fn a_robot_that_is_stuck_holds_up_the_fleet_and_is_caught_up_when_it_is_well_again() {
    let stuck = "id = \"r2\"\nfailure = { speed_stuck = { speed_mps = 0.05, from_s = 30.0, to_s = 45.0 } }\n";
    let text = with(&mission_text("missions/thesis/prop-3-2.toml"), "id = \"r2\"\n", stuck);
    let (recording, summary) = fly(&text);
    assert_eq!(state_at(&recording.exact, "r2", 40.0).speed_mps, 0.05);
    let apart = |t| state_at(&recording.exact, "r1", t).xi - state_at(&recording.exact, "r2", t).xi;
    assert!(apart(44.0) > 10.0 * apart(29.0).abs() && summary.fleet.coordination.last < 0.02, "{}", apart(44.0));
}

#[test]
fn an_auv_may_have_a_parameter_table_of_its_own() {
    let text = with(&mission_text("missions/auv-helix.toml"), "duration_s = 800.0", "duration_s = 5.0");
    // The table of the Sirene-like vehicle, written out: the same flight.
    let table = "{ underactuated_auv = { parameters = { mass_t = [4.7, 7.6, 6.4], inertia_tm2 = [2.2, 7.5, 7.7], \
                 linear_drag = [0.15, 0.45, 0.36], quadratic_drag = [1.45, 4.4, 3.6], \
                 linear_spin_drag = [0.5, 0.8, 0.9], quadratic_spin_drag = [1.0, 7.2, 8.8], \
                 weight_kn = 39.24, centre_of_buoyancy_m = [0.0, 0.0, -0.36] } } }";
    let written = with(&text, "{ underactuated_auv = \"sirene\" }", table);
    let states = |text: &str| -> Vec<Record> {
        fly(text).0.exact.into_iter().filter(|record| matches!(record, Record::State(_))).collect()
    };
    assert_eq!(states(&text), states(&written));
}
