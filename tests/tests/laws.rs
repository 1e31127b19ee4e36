//! The coordination laws of sections 1.2, 3.3 and 4.5.2, from their mission files: what converges, to what, and how fast.

use std::sync::Arc;

use bus::recording::Recording;
use common::graph::Graph;
use common::mission::Mission;
use common::record::Row;
use common::theory::theorem_4_4::Coordination;
use common::time::Time;
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
        Flown::from(&mission_text(&format!("missions/thesis/{name}.toml")))
    }

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

    /// max |x_i − x_j| at the end, with the pattern removed.
    fn disagreement(&self) -> f64 {
        self.summary.fleet.coordination.last
    }

    /// ξ_i − ξ_j, the pattern not removed.
    fn apart(&self, i: usize, j: usize, t_s: f64) -> f64 {
        self.xi(i, t_s) - self.xi(j, t_s)
    }

    fn xi(&self, index: usize, t_s: f64) -> f64 {
        state_at(&self.recording.exact, &self.mission.vehicles[index].id, t_s).xi
    }

    /// ξ̇_i at an instant.
    fn rate(&self, index: usize, t_s: f64) -> f64 {
        state_at(&self.recording.exact, &self.mission.vehicles[index].id, t_s).xi_rate
    }

    fn end(&self) -> f64 {
        self.mission.end.secs()
    }

    /// Agreed within `tolerance`, on the paths within `path_m`, at the speed `v_l`.
    fn assert_arrived(&self, tolerance: f64, path_m: f64, v_l: f64) {
        assert!(self.disagreement() < tolerance, "{}", self.disagreement());
        for vehicle in &self.summary.vehicles {
            assert!(vehicle.path_error_final_m < path_m, "{}: {} m", vehicle.id, vehicle.path_error_final_m);
            assert_close(&vehicle.id, vehicle.steady_speed, v_l, 2e-3);
        }
    }

    /// What theory says of it.
    fn theory(&self, of: &str) -> TheoryRow {
        let rows = theory::rows(&self.mission, Some(&self.summary));
        let row = rows.iter().find(|row| row.name.contains(of));
        row.unwrap_or_else(|| panic!("{of} is not in {rows:?}")).clone()
    }

    /// The fitted rate of coordination.
    fn fitted(&self) -> f64 {
        self.summary.fleet.coordination.fit.as_ref().expect("there is a rate").rate
    }

    /// Whether the messages hold one more scalar beside ξ: those of solution II hold ξ alone.
    fn says_a_scalar(&self) -> bool {
        let least = mission(&mission_text("missions/thesis/solution-2.toml")).message_bytes(0);
        assert_eq!(self.mission.law.says(0).is_some(), self.mission.message_bytes(0) > least);
        assert!(self.mission.message_bytes(0) <= least + 8, "{} bytes", self.mission.message_bytes(0));
        self.mission.message_bytes(0) > least
    }
}

#[test]
fn a_vehicle_learns_the_formation_speed_of_the_other() {
    let flown = Flown::file("eq-1-5-leader-integral");
    flown.assert_arrived(1e-4, 1e-4, 0.5);
    assert!(!flown.says_a_scalar());
    assert_eq!(flown.theory("learns v_L").holds, Some(true));
    // At the start the learner knows nothing: it goes by the distance alone.
    assert_eq!(flown.rate(1, 0.0), 0.0);
    // Another leader does as well.
    let text = mission_text("missions/thesis/eq-1-5-leader-integral.toml");
    Flown::from(&with(&text, "leader = \"v1\"", "leader = \"v2\"")).assert_arrived(1e-4, 1e-4, 0.5);
}

#[test]
fn solutions_1_and_2_and_weights_bring_the_same_fleet_together() {
    for (name, scalar) in [("solution-1", true), ("solution-2", false), ("eq-3-62-weighted", false)] {
        let flown = Flown::file(name);
        flown.assert_arrived(1e-3, 1e-3, 0.1);
        assert_eq!(flown.says_a_scalar(), scalar, "{name}");
        assert_eq!(flown.theory("Proposition 3.4").holds, Some(true), "{name}");
    }
}

/// A mission with these gains for its vehicles, in their order; those that are left over have none of their own.
fn with_gains(path: &str, gains: &[&str]) -> String {
    let text = mission_text(path);
    let (head, vehicles) = text.split_once("[[vehicles]]\n").expect("vehicles");
    let tables = vehicles.split("[[vehicles]]\n").enumerate();
    let with_own = tables.map(|(i, table)| match gains.get(i) {
        Some(own) => format!("[[vehicles]]\ngains = {own}\n{table}"),
        None => format!("[[vehicles]]\n{table}"),
    });
    format!("{head}{}", with_own.collect::<String>())
}

#[test]
fn vehicles_with_gains_of_their_own_agree_as_theory_says() {
    // (4.21) with K = diag(0.3, 0.1, 0.1): Theorem 4.4 has k_m and λ_m of this K.
    let flown = Flown::from(&with_gains("missions/brief-losses.toml", &["{ gain = 0.3 }"]));
    let row = flown.theory("Theorem 4.4");
    let up = Graph::from_edges(3, &[(0, 1), (1, 2)]);
    let promised = Coordination::new(&[up, Graph::empty(3)], &[0.3, 0.1, 0.1], 0.75).expect("a promise");
    let (rate, fitted) = (row.guaranteed_rate.expect("a rate"), flown.fitted());
    assert!(row.holds == Some(true) && (rate - promised.rate_of_agreement()).abs() < 1e-12, "{row:?}");
    let equal = Flown::from(&mission_text("missions/brief-losses.toml"));
    assert!(fitted > rate && fitted > 1.2 * equal.fitted(), "{fitted} {rate} {}", equal.fitted());
    assert_eq!(flown.theory("Theorem monitor").holds, Some(true));
    // (1.5): the rate is a_1 + a_2.
    let flown = Flown::from(&with_gains("missions/thesis/fig-1-9.toml", &["{ gain = 0.1 }"]));
    let equal = Flown::from(&mission_text("missions/thesis/fig-1-9.toml"));
    let [rate, of_equal] = [&flown, &equal].map(|run| run.theory("Lemma 1.1").guaranteed_rate.expect("a rate"));
    assert!((rate - 0.1 - 0.5 * of_equal).abs() < 1e-12, "{rate} {of_equal}");
    // Propositions 3.4 and 3.5 with unequal A and B: agreement, and no rate.
    for (name, own) in [("solution-1", "{ a = 1.6 }"), ("solution-2", "{ a = 1.5, b = 2.0 }")] {
        let flown = Flown::from(&with_gains(&format!("missions/thesis/{name}.toml"), &[own]));
        flown.assert_arrived(1e-3, 1e-3, 0.1);
        let row = flown.theory("Proposition 3.4");
        assert_eq!((row.holds, row.guaranteed_rate), (Some(true), None), "{row:?}");
    }
    // Over one-way links nothing is promised for them.
    let flown = Flown::from(&with_gains("missions/thesis/eq-3-83.toml", &["{ a = 2.5 }"]));
    assert_eq!(flown.theory("Agreement (").holds, Some(false));
}

#[test]
fn a_pattern_that_moves_is_kept() {
    let flown = Flown::file("eq-3-70-pattern");
    assert!(flown.says_a_scalar());
    assert!(flown.disagreement() < 5e-3, "{}", flown.disagreement());
    // ξ_1 − ξ_2 follows h_1 − h_2, which goes through 0.87 to either side.
    let mut largest: f64 = 0.0;
    for step in 0..=320 {
        let t_s = 168.0 + 0.1 * f64::from(step);
        let h = |index: usize| flown.mission.vehicles[index].pattern.at(Time::from_secs(t_s)).h;
        let wanted = h(0) - h(1);
        assert!((flown.apart(0, 1, t_s) - wanted).abs() < 5e-3, "{t_s}: {} {wanted}", flown.apart(0, 1, t_s));
        largest = largest.max(wanted.abs());
    }
    assert!(largest > 0.8, "{largest}");
    flown.summary.vehicles.iter().for_each(|vehicle| assert_close(&vehicle.id, vehicle.steady_speed, 0.2, 5e-3));
}

#[test]
fn figure_3_8_three_robots_keep_a_triangle_on_lines_and_arcs() {
    let flown = Flown::file("fig-3-8");
    assert!(flown.disagreement() < 1e-2, "{}", flown.disagreement());
    assert_close("ξ_12", flown.apart(0, 1, flown.end()), -0.75, 1e-2);
    assert!(flown.apart(0, 2, flown.end()).abs() < 1e-2, "ξ_13 = {}", flown.apart(0, 2, flown.end()));
    for vehicle in &flown.summary.vehicles {
        assert!(vehicle.path_error_final_m < 1e-2, "{}: {} m", vehicle.id, vehicle.path_error_final_m);
        assert_close(&vehicle.id, vehicle.steady_speed, 0.1, 5e-3);
    }
}

#[test]
fn figure_3_10_three_robots_in_a_ring_of_one_way_links_come_in_line() {
    let flown = Flown::file("fig-3-10");
    flown.assert_arrived(1e-4, 1e-3, 0.1);
    assert!(!flown.says_a_scalar());
    // a²/b = 4 against 0.5 (erratum 3.13).
    let row = flown.theory("Proposition 3.6");
    assert_eq!(row.holds, Some(true));
    assert!(row.condition.contains("> 0.50000 (3.73)") && row.value.contains("a²/b = 4"), "{row:?}");
    // On the outer circle the robot goes twice as fast as on the inner one.
    let [inner, _, outer] = &flown.summary.vehicles[..] else { panic!("three robots") };
    assert_close("speeds", outer.steady_speed_mps / inner.steady_speed_mps, 2.0, 1e-3);
}

#[test]
fn below_the_condition_the_ring_of_figure_3_10_does_not_agree() {
    // a²/b = 0.25 < 0.5.
    let text = mission_text("missions/thesis/fig-3-10.toml");
    let text = with(&text, "{ a = 2.0, b = 1.0 }", "{ a = 0.5, b = 1.0 }");
    let flown = Flown::from(&with(&text, "duration_s = 120.0", "duration_s = 60.0"));
    assert_eq!(flown.theory("Proposition 3.6").holds, Some(false));
    assert!(flown.disagreement() > 0.5, "{}", flown.disagreement());
}

#[test]
fn solution_2_over_one_way_links_agrees_where_its_own_condition_holds() {
    let flown = Flown::file("eq-3-83");
    flown.assert_arrived(1e-4, 1e-3, 0.1);
    let row = flown.theory("Remark 3.13");
    assert_eq!(row.holds, Some(true));
    assert!(row.condition.contains("> 0.12500 (3.85)"), "{}", row.condition);
}

#[test]
fn a_triangle_over_one_way_links() {
    let flown = Flown::file("eq-3-86");
    flown.assert_arrived(1e-4, 1e-3, 0.1);
    assert_close("ξ_12", flown.apart(0, 1, flown.end()), -0.75, 1e-3);
    assert!(flown.apart(0, 2, flown.end()).abs() < 1e-3);
}

#[test]
fn a_fleet_of_which_one_is_told_the_speed_follows_its_changes() {
    let flown = Flown::file("truly-decentralised");
    assert!(flown.says_a_scalar());
    flown.assert_arrived(1e-3, 1e-3, 0.15);
    for index in 0..3 {
        assert_close((index, "before"), flown.rate(index, 149.0), 0.1, 5e-3);
        assert_close((index, "after"), flown.rate(index, 299.0), 0.15, 5e-3);
    }
    let row = flown.theory("Proposition 3.7");
    assert_eq!(row.holds, Some(true));
    assert!(row.condition.contains("> 0.13956 (3.93)"), "{}", row.condition);
}

#[test]
fn one_link_at_a_time_averages_two_vehicles_at_a_time() {
    let flown = Flown::file("ucm-one-link-at-a-time");
    let last = flown.summary.vehicles.iter().map(|vehicle| vehicle.steady_speed);
    last.for_each(|speed| assert_close("v_L", speed, 0.5, 1e-3));
    // A link that is up for 10 s shrinks the difference of its two vehicles by q = exp(−2k·10) and keeps their mean: over a
    // period of 20 s the errors (γ_12, γ_23) are multiplied by a matrix with the eigenvalues μ of
    // μ² − (2q + (1 − q)²/4) μ + q² = 0. A link that goes down is noticed two or three periods late.
    let q = (-0.2f64 * 20.0).exp();
    let half = q + (1.0 - q).powi(2) / 8.0;
    let expected = (half + (half * half - q * q).sqrt()).ln() / -20.0;
    let rate = (flown.apart(0, 2, 40.0) / flown.apart(0, 2, 160.0)).abs().ln() / 120.0;
    assert_close("rate", rate, expected, 0.03);
    assert_eq!(flown.theory("Theorem 4.5").holds, Some(true));
}

#[test]
fn an_auxiliary_state_takes_up_what_coordination_does_to_path_following() {
    let flown = Flown::file("eq-4-59");
    assert!(!flown.says_a_scalar() && flown.disagreement() < 1e-3, "{}", flown.disagreement());
    // Erratum 4.14: α_2 does not vanish, and the fleet travels at 0.491 instead of 0.5.
    let predicted = flown.summary.fleet.predicted_speed.expect("theory has a word on it");
    assert_close("erratum 4.14", predicted, 0.491, 1e-3);
    for vehicle in &flown.summary.vehicles {
        assert_close(&vehicle.id, vehicle.steady_speed, predicted, 1e-3);
    }
    let row = flown.theory("Theorem 4.8");
    assert!(row.holds == Some(true) && row.predicted.contains("at ≥ 0.04598 1/s into a ball"), "{row:?}");
}

#[test]
fn example_4_1_bears_three_quarters_of_losses() {
    let flown = Flown::file("eq-4-62-example-4-1");
    assert!(!flown.says_a_scalar() && flown.disagreement() < 1e-3, "{}", flown.disagreement());
    // No bias without α_2 (erratum 4.14).
    flown.summary.vehicles.iter().for_each(|vehicle| assert_close(&vehicle.id, vehicle.steady_speed, 0.5, 1e-3));
    let row = flown.theory("Theorem 4.9");
    assert_eq!(row.holds, Some(true), "{row:?}");
    let guaranteed = facts(&flown.mission).guaranteed_rate.expect("there is a guarantee");
    assert!(guaranteed > 0.05 && flown.fitted() >= guaranteed, "{} {guaranteed}", flown.fitted());
}
