//! The figures and numbers of chapter 2, from the mission files.

use std::sync::Arc;

use bus::recording::Recording;
use common::mission::Mission;
use common::record::{Row, StateRow};
use cpf_tests::{assert_close, mission, mission_text, state_at, with};
use mission_control::facts::facts;
use mission_control::results::{Summary, TheoryRow, summarise};
use mission_control::simulate::simulate;
use mission_control::theory;

/// A mission of `missions/thesis` flown in this thread.
struct Flown {
    mission: Arc<Mission>,
    recording: Recording,
    summary: Summary,
}

impl Flown {
    fn file(name: &str) -> Flown {
        let mission = mission(&mission_text(&format!("missions/thesis/{name}.toml")));
        let mut recording = Recording { complete: true, seed: mission.seed, ..Recording::default() };
        let keep = |row| match row {
            Row::Exact(record) => recording.exact.push(record),
            Row::Clock(record) => recording.clock.push(record),
        };
        simulate(&mission, keep, |_| true).expect("the mission can be flown");
        let summary = summarise(&recording, &facts(&mission));
        assert!(summary.warnings.is_empty(), "{:?}", summary.warnings);
        Flown { mission, recording, summary }
    }

    fn at(&self, vehicle: usize, t_s: f64) -> StateRow {
        state_at(&self.recording.exact, &self.mission.vehicles[vehicle].id, t_s).clone()
    }

    fn last(&self, vehicle: usize) -> StateRow {
        self.at(vehicle, self.mission.end.secs())
    }

    /// Largest path-following error of a vehicle from an instant on.
    fn worst(&self, vehicle: usize, from_s: f64) -> f64 {
        let steps = ((self.mission.end.secs() - from_s) / 0.1) as u32;
        (0..=steps).map(|k| self.at(vehicle, from_s + 0.1 * f64::from(k)).e_norm_m).fold(0.0, f64::max)
    }

    fn theory(&self, of: &str) -> TheoryRow {
        let rows = theory::rows(&self.mission, Some(&self.summary));
        rows.iter().find(|row| row.name.contains(of)).unwrap_or_else(|| panic!("{of}: {rows:?}")).clone()
    }
}

#[test]
fn figure_2_4_the_turning_rate_is_learnt_with_and_without_the_heading() {
    for name in ["fig-2-4", "fig-2-4-full-state"] {
        let flown = Flown::file(name);
        for (vehicle, v) in [0.3, 0.4, 0.5].into_iter().enumerate() {
            let end = flown.last(vehicle);
            assert!(end.e_norm_m < 5e-3 && end.psi_e_rad.abs() < 5e-3, "{name}: {end:?}");
            assert_close((name, v), end.speed_mps, v, 1e-6);
        }
    }
}

#[test]
fn figure_2_6_the_state_transformation_is_not_disturbed_by_the_force() {
    let decoupling = Flown::file("fig-2-6-decoupling").worst(0, 40.0);
    let transformation = Flown::file("fig-2-6-state-transformation").worst(0, 40.0);
    assert!(decoupling > 0.01 && transformation < 0.05 * decoupling, "{decoupling} {transformation}");
}

#[test]
fn figure_2_11_the_sense_of_travel_decides_whether_the_robot_turns_round() {
    let (along, against) = (Flown::file("fig-2-11-ccw"), Flown::file("fig-2-11-cw"));
    for flown in [&along, &against] {
        let end = flown.last(0);
        assert!(end.e_norm_m < 1e-2 && end.psi_e_rad.abs() < 1e-2 && end.xi_rate > 0.09, "{end:?}");
    }
    assert!(along.worst(0, 0.0) < 0.5 && against.worst(0, 0.0) > 0.5, "pushed off the path before it turns");
}

#[test]
fn figures_2_12_to_2_14_four_robots_in_line_on_semicircles_and_lines() {
    let flown = Flown::file("fig-2-12");
    assert!(flown.summary.fleet.coordination.last < 1e-2, "{}", flown.summary.fleet.coordination.last);
    // Figure 2.13: the gateway's speed at the end of each leg.
    for (t, v) in [(60.0, 0.1), (82.0, 0.2), (120.0, 0.4), (155.0, 0.2)] {
        assert!((flown.at(0, t).speed_mps - v).abs() < 0.02, "{t}: {:?}", flown.at(0, t));
    }
    for vehicle in 0..4 {
        assert!(flown.worst(vehicle, 0.0) < 0.2 && flown.last(vehicle).e_norm_m < 1e-2);
    }
}

#[test]
fn figure_2_15_a_stuck_robot_stays_a_twelfth_of_a_radian_off_unless_there_is_another_integrator() {
    let a = Flown::file("fig-2-15-a");
    let b = Flown::file("fig-2-15-b");
    assert_close("(2.43)", a.last(0).xi - a.last(1).xi, 1.0 / 12.0, 1e-3);
    assert!((a.last(0).xi - a.last(2).xi).abs() < 1e-4);
    assert!((b.last(0).xi - b.last(1).xi).abs() < 1e-4 && (b.last(0).xi - b.last(2).xi).abs() < 1e-4);
    for flown in [&a, &b] {
        for (vehicle, v) in [0.5 / 3.0, 0.25, 1.0 / 3.0].into_iter().enumerate() {
            assert_close(vehicle, flown.last(vehicle).speed_mps, v, 1e-4);
            assert!(flown.last(vehicle).e_norm_m < 1e-3);
        }
    }
    assert_eq!(a.theory("(2.43)").predicted, "-0.083333");
    // (2.35) speaks of a fleet without failures; (2.42) of this one, and all learn the speed of the stuck robot: 0.25/3.
    assert_eq!((a.theory("(2.35)").holds, a.theory("(2.35)").guaranteed_rate), (None, None));
    assert_close("fleet speed", a.summary.fleet.predicted_speed.expect("theory has a word on it"), 0.25 / 3.0, 1e-12);
    assert_eq!(b.theory("failed follower").holds, Some(true));
}

#[test]
fn section_2_4_followers_go_with_a_stuck_leader_and_do_not_mind_a_stuck_follower() {
    let leader = Flown::file("leader-follower-failing-leader");
    assert!(leader.summary.fleet.coordination.last < 1e-3, "{}", leader.summary.fleet.coordination.last);
    assert_close("r3", leader.last(2).speed_mps, 0.3, 1e-3);
    assert_close("fleet speed", leader.summary.fleet.predicted_speed.expect("theory has a word on it"), 0.075, 1e-12);
    // λ = −1 three times is no rate itself; with path following it is (2.37), and the flight keeps that.
    assert_eq!(leader.theory("(2.29)").guaranteed_rate, None);
    assert!(leader.theory("(2.29)").predicted.contains("every rate below 1.0"), "{:?}", leader.theory("(2.29)"));
    let coupled = leader.theory("(2.37)");
    assert!(coupled.guaranteed_rate.is_some_and(|rate| rate > 0.7) && !coupled.is_below(), "{coupled:?}");
    let follower = Flown::file("leader-follower-failing-follower");
    assert!((follower.last(0).xi - follower.last(2).xi).abs() < 1e-4);
    // 80 s of 0.05 m/s too little on 3 m.
    assert_close("r2", follower.last(0).xi - follower.last(1).xi, 80.0 * 0.05 / 3.0, 1e-2);
    assert_eq!(follower.theory("(2.37)").holds, Some(true));
    assert!(follower.theory("(2.37)").value.contains("said of the others than r2"));
    assert_eq!(follower.summary.fleet.predicted_speed, None);
}

#[test]
fn neighbours_in_a_row_agree_though_one_alone_is_told() {
    let flown = Flown::file("neighbours-in-a-row");
    assert!(flown.summary.fleet.coordination.last < 1e-3, "{}", flown.summary.fleet.coordination.last);
    assert_close("r3", flown.last(2).speed_mps, 0.4, 1e-3);
}

#[test]
fn links_that_a_law_needs_are_asked_for() {
    let text = mission_text("missions/thesis/fig-2-15-a.toml");
    let refused =
        |text: &str| Mission::parse("m.toml", text).err().map(|faults| faults.to_string()).unwrap_or_default();
    let row = with(&text, "[\"r1\", \"r3\"]", "[\"r2\", \"r3\"]");
    assert!(refused(&row).contains("no link from r1 to r3, under gateway"), "{}", refused(&row));
    let unknown = with(&text, "gateway = \"r1\"", "gateway = \"r9\"");
    assert!(refused(&unknown).contains("which is no vehicle"), "{}", refused(&unknown));
    let swings = with(&text, "c = 1.0", "c = 9.0");
    assert!(refused(&swings).contains("c must be below a b"), "{}", refused(&swings));
    let misfit = with(&text, "decoupling = { lambda_p = 2.0 }", "theorem47 = {}");
    assert!(refused(&misfit).contains("theorem47 with dynamic_unicycle"), "{}", refused(&misfit));
}
