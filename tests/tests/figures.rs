//! The figures and numbers of the thesis, from the mission files: what converges, to what, and how fast.

use std::path::Path;
use std::sync::Arc;

use bus::recording::Recording;
use common::mission::Mission;
use common::record::Row;
use common::time::Time;
use cpf_tests::{assert_close, mission, mission_text, state_at, with};
use mission_control::facts::facts;
use mission_control::results::{Summary, VehicleSummary, summarise};
use mission_control::simulate::simulate;

/// A mission flown in this thread.
struct Flown {
    mission: Arc<Mission>,
    recording: Recording,
    summary: Summary,
}

impl Flown {
    fn from(text: &str) -> Flown {
        let mission = mission(text);
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

    fn file(path: &str) -> Flown {
        Flown::from(&mission_text(path))
    }

    /// max |x_i − x_j| at the end.
    fn disagreement(&self) -> f64 {
        self.summary.fleet.coordination.last
    }

    fn each(&self, property: impl Fn(&VehicleSummary)) {
        self.summary.vehicles.iter().for_each(property);
    }

    /// x_1 − x_2 at an instant.
    fn apart(&self, t_s: f64) -> f64 {
        let xi = |index: usize| {
            let plan = &self.mission.vehicles[index];
            state_at(&self.recording.exact, &plan.id, t_s).xi - plan.pattern.at(Time::from_secs(t_s)).h
        };
        xi(0) - xi(1)
    }
}

#[test]
fn figure_1_9_two_vehicles_on_lines_come_abreast() {
    let flown = Flown::file("missions/thesis/fig-1-9.toml");
    assert!(flown.disagreement() < 1e-4, "{}", flown.disagreement());
    flown.each(|vehicle| {
        assert!(vehicle.path_error_final_m < 1e-4, "{}: {} m", vehicle.id, vehicle.path_error_final_m);
        assert_close(&vehicle.id, vehicle.steady_speed, 0.5, 1e-3);
        assert_close(&vehicle.id, vehicle.steady_speed_mps, 0.5, 1e-3);
    });
}

#[test]
fn figure_1_10_a_network_that_is_never_connected_loses_a_factor_e_to_minus_0_4_in_every_period() {
    let flown = Flown::file("missions/thesis/fig-1-10.toml");
    // Per 3 s one second of v1 alone and one of v2 alone listening, each at the gain 0.2 1/s (erratum 1.4). Until the
    // vehicles are on their lines, their progress along them is slower than commanded.
    let on_path = flown.summary.fleet.on_path_s.expect("they come to their paths");
    let first = (on_path / 3.0).ceil() as i32 + 1;
    let start = flown.apart(f64::from(first) * 3.0);
    assert!(start.abs() > 1e-3, "{start}");
    for k in 1..=6 {
        let found = flown.apart(f64::from(first + k) * 3.0) / start;
        assert_close((first, k), found, (-0.4 * f64::from(k)).exp(), 0.01 * f64::from(k));
    }
    // Between, in the third second of a period, nobody hears anybody and the distance stands.
    let period = f64::from(first) * 3.0;
    assert_close("silence", flown.apart(period + 3.0), flown.apart(period + 2.1), 5e-3);
}

#[test]
fn figure_3_7_three_robots_keep_abreast_on_lines_and_arcs() {
    let flown = Flown::file("missions/thesis/fig-3-7.toml");
    assert!(flown.disagreement() < 1e-2, "{}", flown.disagreement());
    flown.each(|vehicle| {
        assert!(vehicle.path_error_final_m < 1e-2, "{}: {} m", vehicle.id, vehicle.path_error_final_m);
        assert!(vehicle.heading_rms_rad < 1e-2, "{}: {} rad", vehicle.id, vehicle.heading_rms_rad);
        assert_close(&vehicle.id, vehicle.steady_speed, 0.1, 5e-3);
    });
}

#[test]
fn figure_3_9_a_sinusoid_and_a_line_agree_on_x() {
    let flown = Flown::file("missions/thesis/fig-3-9.toml");
    assert!(flown.disagreement() < 1e-2, "{}", flown.disagreement());
    flown.each(|vehicle| {
        assert!(vehicle.path_error_final_m < 2e-2, "{}: {} m", vehicle.id, vehicle.path_error_final_m);
        assert_close(&vehicle.id, vehicle.steady_speed, 0.1, 2e-2);
    });
    // On the sinusoid the robot has further to go than on the line for the same x.
    let [sinusoid, line] = &flown.summary.vehicles[..] else { panic!("two robots") };
    assert!(sinusoid.steady_speed_mps > 2.0 * line.steady_speed_mps);
}

#[test]
fn figures_4_2_and_4_3_three_vehicles_line_up_with_late_news_and_few_of_it() {
    let flown = Flown::file("missions/thesis/fig-4-2.toml");
    assert_lined_up(&flown);
    let star = 0.5 / (1.0 + 0.1 * 5.0);
    assert_close("v_L/(1 + kτ)", flown.summary.fleet.steady_speed, star, 1e-3);
    // With the last value held, news are older than the delay that the law allows for: the fleet is somewhat slower, never
    // faster.
    let text = mission_text("missions/thesis/fig-4-2.toml");
    let held = Flown::from(&with(&text, "between = \"align\"", "between = \"hold\""));
    assert_lined_up(&held);
    let speed = held.summary.fleet.steady_speed;
    assert!(speed < (1.0 - 1e-3) * star && speed > 0.8 * star, "{speed} and {star}");
}

#[test]
fn the_auv_mission_travels_at_the_speed_that_theory_promises() {
    let flown = Flown::file("missions/auv-helix.toml");
    assert_lined_up(&flown);
    assert_close("v_L/(1 + kτ)", flown.summary.fleet.steady_speed, 0.5 / (1.0 + 0.1 * 5.0), 1e-3);
    assert_eq!(flown.summary.fleet.predicted_speed, Some(0.5 / (1.0 + 0.1 * 5.0)));
    flown.each(|vehicle| {
        let bias = vehicle.predicted_along_bias_m.expect("theory has a word on it");
        assert_close(&vehicle.id, vehicle.along_mean_m, bias, 0.02);
    });
    let connectivity = flown.summary.fleet.connectivity.as_ref().expect("measured");
    assert_close("α", connectivity.alpha, 0.75, 1e-2);
}

fn assert_lined_up(flown: &Flown) {
    assert!(flown.disagreement() < 1e-6, "{}", flown.disagreement());
    let initial = flown.summary.fleet.coordination.initial;
    assert!(initial > 1.0, "{initial}");
    flown.each(|vehicle| assert_close(&vehicle.id, vehicle.steady_speed, flown.summary.fleet.steady_speed, 1e-6));
    let rows = |t_s| flown.mission.vehicles.iter().map(move |v| state_at(&flown.recording.exact, &v.id, t_s));
    // On a vertical line: the same x and y, 5 m apart.
    let end: Vec<[f64; 3]> = rows(flown.mission.end.secs()).map(|row| [row.x_m, row.y_m, row.z_m]).collect();
    for pair in end.windows(2) {
        for (axis, apart) in [(0, 0.0), (1, 0.0), (2, 5.0)] {
            assert!((pair[1][axis] - pair[0][axis] - apart).abs() < 1e-3, "axis {axis} of {end:?}");
        }
    }
}

// --- how the network costs coordination ----------------------------------------------------------------------------------

const LOSSES: [f64; 4] = [0.0, 0.3, 0.6, 0.9];
const DELAYS: [f64; 3] = [0.0, 1.0, 5.0];

/// The coordination error that is left while the fleet still comes together, for each loss and delay.
fn table() -> String {
    let mut table = String::from("# max |x_i - x_j| after 25 s; rows: loss probability, columns: delay [s]\n loss");
    DELAYS.iter().for_each(|delay| table += &format!(" {delay:>9}"));
    table.push('\n');
    for loss in LOSSES {
        table += &format!("{loss:>5}");
        for delay in DELAYS {
            let text = mission_text("tests/missions/loss-delay.toml");
            let text = with(&text, "probability = 0.0", &format!("probability = {loss:?}"));
            let text = with(&text, "constant = { delay_s = 0.0 }", &format!("constant = {{ delay_s = {delay:?} }}"));
            let flown = Flown::from(&text);
            table += &format!(" {:>9.2e}", flown.disagreement());
        }
        table.push('\n');
    }
    table
}

#[test]
fn loss_and_delay_cost_as_much_coordination_as_they_did() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("snapshots/loss_delay.txt");
    let found = table();
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        std::fs::write(&path, &found).expect("the snapshot can be written");
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    let differences: Vec<String> = expected
        .lines()
        .zip(found.lines())
        .filter(|(expected, found)| expected != found)
        .map(|(expected, found)| format!("- {expected}\n+ {found}"))
        .collect();
    assert!(
        found == expected,
        "{} (-) and this run (+) differ; UPDATE_SNAPSHOTS=1 accepts:\n{}\n\nall of this run:\n{found}",
        path.display(),
        differences.join("\n")
    );
}
