//! What theory promises, and what it does not: each premise that a mission breaks is named, and takes the promise with it.

use cpf_tests::{mission, mission_text, with};
use mission_control::facts::facts;
use mission_control::results::{Summary, TheoryRow, summarise};
use mission_control::{simulate, theory};

fn thesis(name: &str) -> String {
    mission_text(&format!("missions/thesis/{name}.toml"))
}

fn row(text: &str, of: &str) -> TheoryRow {
    let rows = theory::rows(&mission(text), None);
    rows.iter().find(|row| row.name.contains(of)).unwrap_or_else(|| panic!("{of} is not in {rows:?}")).clone()
}

/// The row does not hold, says why, and promises nothing.
fn assert_broken(text: &str, of: &str, why: &str) {
    let row = row(text, of);
    assert_eq!((row.holds, row.guaranteed_rate, row.predicted.as_str()), (Some(false), None, "–"), "{row:?}");
    assert!(row.value.contains(why), "{why:?} in {row:?}");
}

fn fly(text: &str) -> (Vec<TheoryRow>, Summary) {
    let mission = mission(text);
    let mut recording =
        bus::recording::Recording { complete: true, seed: mission.seed, ..bus::recording::Recording::default() };
    let keep = |row| {
        if let common::record::Row::Exact(record) = row {
            recording.exact.push(record);
        }
    };
    simulate::simulate(&mission, keep, |_| true).expect("the mission can be flown");
    let summary = summarise(&recording, &facts(&mission));
    (theory::rows(&mission, Some(&summary)), summary)
}

#[test]
fn a_network_that_loses_takes_the_promise_of_chapter_2() {
    let lossy = |name| with(&thesis(name), "[network]", "[network]\nloss = { bernoulli = { probability = 0.3 } }");
    assert_broken(&lossy("fig-2-12"), "(2.35)", "changes, delays or loses");
    assert_broken(&lossy("fig-2-15-a"), "(2.42)", "changes, delays or loses");
    assert_broken(&lossy("fig-2-15-a"), "(2.43)", "changes, delays or loses");
    assert_broken(&lossy("neighbours-in-a-row"), "neighbours in a row", "changes, delays or loses");
    assert_broken(&lossy("leader-follower-failing-leader"), "(2.37)", "changes, delays or loses");
}

#[test]
fn paths_that_are_no_circles_and_lines_take_it_too() {
    let text = thesis("neighbours-in-a-row");
    let path = text.lines().find(|line| line.starts_with("path")).expect("a path");
    let text = with(&text, path, "path = { sinusoid = { amplitude_m = 0.2, wavelength_m = 20.0 } }");
    assert_broken(&text, "neighbours in a row", "no circles and lines");
}

#[test]
fn a_current_noise_or_a_failure_is_a_premise() {
    let text = thesis("solution-1");
    let first = "start = { x_m = 2.3, y_m = 0.2, yaw_deg = 90.0, speed_mps = 0.2 }";
    let with_line = |line: &str| with(&text, first, &format!("{first}\n{line}"));
    assert_eq!(row(&text, "Proposition 3.4").holds, Some(true));
    assert_broken(&with_line("current = { velocity_mps = [0.3, 0.0, 0.0] }"), "Proposition 3.4", "a current (r1)");
    assert_broken(&with_line("noise = { position_m = 0.01 }"), "Proposition 3.4", "noise (r1)");
    let stuck = with_line("failure = { speed_stuck = { speed_mps = 0.1, from_s = 20.0 } }");
    assert_broken(&stuck, "Proposition 3.4", "a failure (r1)");
    assert_eq!(row(&stuck, "Fleet speed").predicted, "–");
    // Limits: before the flight nobody knows; after it, what was.
    let tight = with_line("limits = { force_n = 0.02 }");
    assert!(row(&tight, "Proposition 3.4").value.contains("the flight will tell"));
    let (rows, _) = fly(&with(&tight, "duration_s = 200.0", "duration_s = 20.0"));
    let flown = rows.iter().find(|row| row.name.contains("Proposition 3.4")).expect("a row");
    assert!(flown.holds == Some(false) && flown.value.contains("an actuator was at its limit (r1)"), "{flown:?}");
}

#[test]
fn a_speed_that_steps_or_ends_is_named() {
    let steps = "profile = [{ from_s = 0.0, speed = 0.5 }, { from_s = 60.0, speed = 0.3 }]";
    let text = with(&thesis("eq-1-5-leader-integral"), "speed = 0.5", steps);
    let leader = row(&text, "learns v_L");
    assert!(leader.condition.contains("v_L constant") && leader.value.contains("the last time at 60 s"), "{leader:?}");
    assert!(row(&thesis("truly-decentralised"), "Proposition 3.7").value.contains("the last time at 150 s"));
    let stops = "profile = [{ from_s = 0.0, speed = 0.1 }, { from_s = 60.0, speed = 0.0 }]";
    let text = with(&thesis("solution-1"), "speed = 0.1\n", &format!("{stops}\n"));
    let following = row(&text, "conditions i and ii");
    assert!(following.holds == Some(false) && following.value.contains("v_L = 0 from 60 s on"), "{following:?}");
    assert_eq!(row(&text, "Table 3.1").holds, Some(false));
}

#[test]
fn one_contact_and_silence_after_is_no_lemma_1_1() {
    let fleet = with(
        &thesis("fig-1-9"),
        "[network]",
        "[network]\nswitching = { intervals = { up = [{ from_s = 0.0, to_s = 5.0 }] } }",
    );
    let lemma = row(&fleet, "Lemma 1.1");
    assert!(lemma.holds == Some(false) && lemma.guaranteed_rate.is_none(), "{lemma:?}");
    assert!(lemma.value.contains("α = 1.0000") && lemma.value.contains("T = 10"), "{lemma:?}");
    let periodic = row(&thesis("fig-1-10"), "Lemma 1.1");
    assert!(periodic.guaranteed_rate.is_some_and(|rate| (rate - 0.4 / 3.0).abs() < 1e-9), "{periodic:?}");
    assert!(periodic.value.contains("α = 0.3333") && periodic.value.contains("T = 3"), "{periodic:?}");
}

#[test]
fn no_mission_of_the_thesis_is_below_what_is_guaranteed() {
    // Those whose rates say most: joints of paths, one-way links, steps of the speed, weights, several equal roots.
    for name in ["fig-3-7", "fig-3-9", "fig-3-10", "eq-3-62-weighted", "truly-decentralised", "prop-3-2", "fig-1-9"] {
        let (rows, summary) = fly(&thesis(name));
        let below: Vec<_> = rows.iter().filter(|row| row.is_below()).collect();
        assert!(below.is_empty(), "{name}: {below:?}");
        assert_ne!(summary.fleet.coordination.at_least_guaranteed, Some(false), "{name}");
    }
}

#[test]
fn where_paths_have_joints_no_rate_is_promised() {
    let jumping = row(&thesis("fig-3-7"), "Proposition 3.5");
    assert!(jumping.holds == Some(true) && jumping.guaranteed_rate.is_none(), "{jumping:?}");
    assert!(jumping.value.contains("erratum 3.18") && jumping.condition.contains("d = 0"), "{jumping:?}");
    assert!(row(&thesis("fig-3-9"), "Proposition 3.4").guaranteed_rate.is_some(), "R varies without a jump");
}

#[test]
fn table_3_1_says_which_laws_go_together() {
    for (name, holds, words) in [
        ("solution-1", true, "Proposition 3.9"),
        ("fig-3-10", true, "Proposition 3.9"),
        ("fig-3-7", true, "Proposition 3.8"),
        ("eq-3-70-pattern", true, "Proposition 3.8"),
        ("prop-3-3", false, "×"),
    ] {
        let row = row(&thesis(name), "Table 3.1");
        assert!(row.holds == Some(holds) && row.value.contains(words), "{name}: {row:?}");
    }
    // With sat(.) the table covers the marine vehicles too.
    let saturated =
        with(&thesis("prop-3-3"), "{ solution1 = { a = 1.0 } }", "{ solution3 = { a = 1.0, b = 0.25, x_m = 1.0 } }");
    assert_eq!(row(&saturated, "Table 3.1").holds, Some(true));
}

#[test]
fn speeds_and_values_are_those_of_the_mission() {
    assert_eq!(row(&thesis("fig-2-4"), "Fleet speed").predicted, "–");
    assert_eq!(row(&thesis("fig-2-15-b"), "Fleet speed").predicted, "0.08333 1/s");
    let bias = row(&thesis("fig-4-2"), "Along-path bias");
    assert!(bias.value.contains("|δ₁| = 0.3 > 0.0654"), "{bias:?}");
    for name in ["eq-3-62-weighted", "eq-3-70-pattern"] {
        assert!(row(&thesis(name), "Agreement").guaranteed_rate.is_some(), "{name}");
    }
    // Theorem 4.5 covers a fleet that is never connected, and nothing is missing then.
    let losses = row(&thesis("ucm-one-link-at-a-time"), "Brief connectivity losses");
    assert!(losses.holds.is_none() && losses.value.contains("Theorem 4.5"), "{losses:?}");
}

#[test]
fn all_graphs_that_a_signal_can_take_are_looked_at_not_only_those_of_the_seed() {
    let markov = "[network]\nswitching = { markov = { mean_up_s = 1000.0, mean_down_s = 1000.0 } }";
    let fleet = mission(&with(&thesis("solution-1"), "[network]", markov));
    let facts = theory::graph_facts(&fleet);
    assert!(facts.taken.graphs > 2 && facts.taken.complete && facts.taken.connected == 1, "{:?}", facts.taken);
    let text = facts.lines().join("\n");
    for words in ["degrees", "adjacency A", "Laplacian", "incidence M", "Y² of L", "F₁", "F₂", "L₁₁", "λ₂"]
    {
        assert!(text.contains(words), "{words} in {text}");
    }
    let json = serde_json::to_value(&facts).expect("serialises");
    assert_eq!(json["degrees"], serde_json::json!([2, 1, 1]));
    assert_eq!(json["laplacian"][0], serde_json::json!([2.0, -1.0, -1.0]));
}

#[test]
fn the_picture_of_the_eigenvalues_has_the_border_of_the_mission() {
    let caption = |name: &str| {
        let figures = theory::figures(&mission(&thesis(name)));
        figures.iter().find(|figure| figure.name == "eigenvalues").expect("a picture").caption.clone()
    };
    let ring = caption("fig-3-10");
    assert!(ring.contains("(3.73)") && ring.contains("a²/b = 4.0000") && ring.contains("0.5000"), "{ring}");
    let told = caption("truly-decentralised");
    assert!(told.contains("(3.93)") && told.contains("virtual leader") && told.contains("0.1396"), "{told}");
    assert!(caption("eq-3-83").contains("(3.85)"));
}

/// eq-4-59 on parallel lines, along which all start; `of` is added to the vehicle in the middle.
fn on_lines(of: &str) -> String {
    let text = thesis("eq-4-59");
    let head = text.split("[[vehicles]]").next().expect("a head").to_string();
    // At the rate at which they go, not at v_L, which α₂ keeps them from: else 2e-4 are left.
    let head = with(&head, "between = \"advance\"", "between = \"estimate\"");
    let vehicle = |i: usize, x: f64| {
        let y = 10.0 * i as f64;
        format!(
            "[[vehicles]]\nid = \"auv{}\"\npath = {{ line = {{ start_m = [0.0, {y}], rate_m = 0.5 }} }}\n\
             start = {{ x_m = {x}, y_m = {y}, speed_mps = 0.1 }}\n{}\n",
            i + 1,
            if i == 1 { of } else { "" }
        )
    };
    format!("{head}{}{}{}", vehicle(0, 0.0), vehicle(1, 3.0), vehicle(2, -4.0))
}

const TO_ZERO: &str = "equal vehicles on straight lines";
const OWN_DELTA: &str = "following = { theorem47 = { kind = \"II\", delta1_mps = -0.4 } }";

/// Every vehicle ends where theory says, to `within` metres; the least of what it says.
fn assert_biases(summary: &Summary, within: f64) -> f64 {
    let mut least = f64::INFINITY;
    for vehicle in &summary.vehicles {
        let predicted = vehicle.predicted_along_bias_m.unwrap_or_else(|| panic!("no word on {}", vehicle.id));
        let error = vehicle.along_mean_m - predicted;
        assert!(error.abs() < within, "{}: {} and not {predicted}", vehicle.id, vehicle.along_mean_m);
        least = least.min(predicted);
    }
    least
}

#[test]
fn equal_vehicles_on_lines_agree_at_the_rate_of_theorem_4_8_whatever_delta() {
    let (rows, summary) = fly(&on_lines(""));
    let row = rows.iter().find(|row| row.name.contains(TO_ZERO)).expect("on lines");
    let guaranteed = row.guaranteed_rate.expect("all premises are met");
    let fit = summary.fleet.coordination.fit.expect("it decays");
    assert!((fit.rate / guaranteed - 1.0).abs() < 0.01, "{} {guaranteed}", fit.rate);
    assert!(!row.is_below() && summary.fleet.coordination.at_least_guaranteed == Some(true), "{row:?}");
    assert!(summary.fleet.coordination.last < 1e-8, "{}", summary.fleet.coordination.last);
    // Without α₂ it would be 0.06145; the bound from everywhere is below.
    assert!((0.05..0.0595).contains(&guaranteed), "{guaranteed}");
    let ball = rows.iter().find(|row| row.name.contains("into a ball")).expect("of every mission");
    assert!(ball.holds == Some(true) && ball.guaranteed_rate.is_none() && !ball.is_below(), "{ball:?}");
    assert!(ball.measured.contains("% of the bound"), "{ball:?}");
}

#[test]
fn a_premise_less_is_no_rate_under_4_59() {
    let no_rate = |text: &str, why: &str| {
        let row = row(text, TO_ZERO);
        assert!(row.guaranteed_rate.is_none() && row.predicted == "–" && row.value.contains(why), "{why:?} in {row:?}");
    };
    no_rate(&with(&on_lines(""), "y_m = 10, ", "y_m = 10.5, "), "on their lines");
    no_rate(&with(&on_lines(""), "y_m = 10, ", "y_m = 10, yaw_deg = 5.0, "), "on their lines");
    no_rate(&on_lines(OWN_DELTA), "differ");
    let late = with(&on_lines(""), "[network]", "[network]\ndelay = { constant = { delay_s = 1.0 } }");
    no_rate(&late, "changes, delays or loses");
    assert_broken(&late, "into a ball", "changes, delays or loses");
    // α₂ tells coordination what happens to the hulls.
    let current = on_lines("current = { velocity_mps = [0.05, 0.0, 0.0] }");
    assert_broken(&current, "into a ball", "disturbed by a current (auv2)");
    no_rate(&current, "disturbed by a current (auv2)");
    assert_eq!(row(&current, "Fleet speed").predicted, "–");
}

#[test]
fn targets_that_alpha_2_slows_leave_the_bias_of_their_rate() {
    // (4.59), as flown in the gallery: −0.927 m, where the nominal rate would leave −0.940 m.
    let (rows, summary) = fly(&thesis("eq-4-59"));
    let least = assert_biases(&summary, 2e-3);
    assert!((least + 0.9265).abs() < 2e-4, "{least}");
    let bias = rows.iter().find(|row| row.name.contains("Along-path bias")).expect("δ leaves one");
    assert!(bias.holds == Some(true) && bias.predicted == "-0.927 m" && bias.measured == "-0.927 m", "{bias:?}");
    // Type I, (4.53): 0.390 in place of 0.5, and −0.775 m.
    let type_1 = with(&thesis("eq-4-59"), "{ auxiliary = { a1 = 10.0, a2 = 16.0 } }", "{ switching = { gain = 0.1 } }");
    let type_1 = with(&with(&type_1, "kind = \"II\"", "kind = \"I\""), "duration_s = 400.0", "duration_s = 800.0");
    let (_, summary) = fly(&type_1);
    let least = assert_biases(&summary, 3e-3);
    let speed = summary.fleet.predicted_speed.expect("theory has a word on it");
    assert!((least + 0.7753).abs() < 1e-3 && (speed - 0.3898).abs() < 1e-4, "{least} {speed}");
    assert!((summary.fleet.steady_speed / speed - 1.0).abs() < 2e-3, "{} {speed}", summary.fleet.steady_speed);
}

#[test]
fn late_news_and_targets_that_alpha_2_slows_together() {
    // (4.42) with type I on a network that does not fail: v_r = v_L − kτγ̇, so that v_n = v_L* is not reached either.
    let text = with(&thesis("fig-4-2"), "kind = \"II\"", "kind = \"I\"");
    let failing = row(&text, "Along-path bias");
    assert!(failing.holds == Some(false) && failing.value.contains("the network changes"), "{failing:?}");
    let switching = text.lines().find(|line| line.starts_with("switching")).expect("it fails");
    let (_, summary) = fly(&with(&text, switching, ""));
    let least = assert_biases(&summary, 3e-3);
    assert!((least + 0.820).abs() < 1e-3, "{least}");
    assert!((summary.fleet.steady_speed - summary.fleet.predicted_speed.expect("known")).abs() < 1e-3);
    // Type II with an estimate of v_L*: hulls plan with v_L, targets go at v_L*.
    let estimating = with(&with(&text, switching, ""), "kind = \"I\"", "kind = \"II\"");
    let law = "{ delayed_with_losses = { gain = 0.1, delay_s = 5.0 } }";
    let estimating = with(&estimating, law, "{ delayed_estimating = { gain = 0.1, time_constant_s = 100.0 } }");
    let (_, summary) = fly(&with(&estimating, "between = \"align\"", "between = \"hold\""));
    assert!((assert_biases(&summary, 5e-3) + 0.691).abs() < 1e-3);
}

#[test]
fn unequal_vehicles_stay_as_far_apart_as_alpha_2_tells() {
    let (rows, summary) = fly(&on_lines(OWN_DELTA));
    let least = assert_biases(&summary, 2e-3);
    assert!(least < -1.2, "{least}");
    let apart = rows.iter().find(|row| row.name.contains("unequal vehicles leave")).expect("α₂ differs");
    assert_eq!(apart.holds, Some(true));
    let predicted: f64 = apart.predicted.split(' ').next().and_then(|word| word.parse().ok()).expect("a number");
    let last = summary.fleet.coordination.last;
    assert!(predicted > 0.01 && (last / predicted - 1.0).abs() < 0.02, "{last} {predicted}");
    // The theorem still holds, so that nothing is missing.
    let excused = rows.iter().find(|row| row.name.contains(TO_ZERO)).expect("on lines");
    assert_eq!((excused.holds, excused.guaranteed_rate), (None, None));
}

#[test]
fn where_the_path_stretches_no_steady_rate_is_told() {
    let sinusoid = "path = { sinusoid = { amplitude_m = 0.5, wavelength_m = 40.0 } }";
    let text = thesis("eq-4-59");
    let helix = text.lines().find(|line| line.starts_with("path")).expect("a helix").to_string();
    let text = with(&with(&text, &helix, sinusoid), "speed = 0.5", "speed = 0.2");
    let bias = row(&text, "Along-path bias");
    assert!(bias.holds == Some(false) && bias.value.contains("|p'| changes on the way"), "{bias:?}");
    assert_eq!(row(&text, "Fleet speed").predicted, "–");
    // Targets that go at v_n do not mind.
    let text = with(&text, "{ auxiliary =", "{ auxiliary_switching =");
    assert_eq!(row(&text, "Along-path bias").predicted, "-0.940 m");
}

#[test]
fn no_theorem_speaks_of_an_estimate_that_is_used() {
    const NAME: &str = "estimated v_L*";
    let text = mission_text("missions/talk/estimated-speed.toml");
    assert_broken(&text, NAME, "T ≥ (1 + kτ)/k = 15 s");
    // docs/talking.md: in short windows and with a small T the fleet swings, at another speed.
    let swings = with(&text, "gain = 0.1, time_constant_s = 10.0", "gain = 0.2, time_constant_s = 2.0");
    let swings = with(&swings, "delay_s = 5.0", "delay_s = 20.0");
    let windows = &swings
        [swings.find("[network.switching.intervals]").expect("intervals")..swings.find("[fleet]").expect("a fleet")];
    let swings = with(
        &swings,
        windows,
        "[network.switching]\nperiodic = { period_s = 30.0, up_from_s = 25.0, up_for_s = 5.0 }\n\n",
    );
    let (rows, summary) = fly(&swings);
    assert!(summary.fleet.coordination.steady_rms > 1.0 && summary.fleet.steady_speed > 0.12, "{:?}", summary.fleet);
    assert_eq!(summary.fleet.predicted_speed, None);
    let of = |name: &str| rows.iter().find(|row| row.name.contains(name)).expect(name);
    assert!(of("Theorem monitor").measured.starts_with("not covered: no theorem speaks of this law"), "{rows:?}");
    assert!(of("Fleet speed").holds == Some(false) && of("Fleet speed").predicted == "–", "{rows:?}");
    // Where nobody is ever alone it is (4.34).
    let law = "{ delayed_with_losses = { gain = 0.1, delay_s = 5.0 } }";
    let helix = mission_text("missions/auv-helix.toml");
    let helix = with(&helix, law, "{ delayed_estimating = { gain = 0.1 } }");
    let helix = with(&helix, "between = \"align\"", "between = \"hold\"");
    assert_broken(&helix, NAME, "T = 10 s");
    let switching = helix.lines().find(|line| line.starts_with("switching")).expect("it fails").to_string();
    let always = with(&helix, &switching, "");
    assert!(row(&always, "Lemmas 4.4 and 4.5").guaranteed_rate.is_some());
    assert_eq!(row(&always, "Fleet speed v_L*").predicted, "0.33333 1/s");
}

/// Neither a rate of the fleet nor a bias is told, and why.
fn assert_no_steady_motion(text: &str, why: &str) {
    assert_broken(text, "Fleet speed", why);
    assert_broken(text, "Along-path bias", why);
    let mission = mission(text);
    assert_eq!(theory::predicted_speed(&mission, 0.5), None);
    assert!(theory::predicted_biases(&mission, 0.5).iter().all(Option::is_none));
}

#[test]
fn late_news_under_a_law_that_is_told_no_delay_leave_no_prediction() {
    let late = |text: &str, between: &str| {
        let text = with(text, "[network]", "[network]\ndelay = { constant = { delay_s = 2.0 } }");
        with(&text, "between = \"advance\"", &format!("between = \"{between}\""))
    };
    let brief = mission_text("missions/brief-losses.toml");
    assert_eq!(row(&brief, "Along-path bias").predicted, "-0.940 m");
    assert_no_steady_motion(&late(&brief, "hold"), "they take 2.000 s");
    assert_no_steady_motion(&late(&thesis("eq-4-62-example-4-1"), "hold"), "they take 2.000 s");
    assert_no_steady_motion(&late(&thesis("eq-4-62-example-4-1"), "advance"), "not as late as the law takes them");
    // A fleet that goes at v_L is where it was, advanced at v_L: this one may be late.
    let advanced = late(&with(&brief, "duration_s = 120.0", "duration_s = 400.0"), "advance");
    assert_eq!(row(&advanced, "Fleet speed").predicted, "0.50000 1/s, if they agree");
    let (_, summary) = fly(&advanced);
    assert!((summary.fleet.steady_speed - 0.5).abs() < 1e-4, "{}", summary.fleet.steady_speed);
    assert!((assert_biases(&summary, 2e-3) + 0.940).abs() < 1e-3);
    // What is held is old when it is said rarely.
    let rarely = with(&brief, "message_period_s = 0.1", "message_period_s = 2.0");
    let rarely =
        with(&with(&rarely, "validity_s = 0.3", "validity_s = 5.0"), "between = \"advance\"", "between = \"hold\"");
    assert_no_steady_motion(&rarely, "held for 2.000 s");
}

#[test]
fn v_l_star_asks_for_what_its_lemma_asks() {
    let helix = mission_text("missions/auv-helix.toml");
    assert_eq!(row(&helix, "Fleet speed v_L*").predicted, "0.33333 1/s");
    // (4.34): a vehicle that is alone goes at v_L.
    assert_no_steady_motion(&with(&helix, "delayed_with_losses", "delayed"), "hears nobody");
    let lossy = with(&helix, "[network]", "[network]\nloss = { bernoulli = { probability = 0.9 } }");
    assert_no_steady_motion(&lossy, "0.9000 of them are lost");
}

#[test]
fn a_fleet_that_goes_back_along_its_paths_is_ahead_of_its_targets() {
    let back = |text: &str| with(text, "speed = 0.5", "speed = -0.5");
    // The hulls turn round, and δ₁ is along them.
    let (_, summary) = fly(&back(&with(&mission_text("missions/auv-helix.toml"), "800.0", "400.0")));
    assert!((assert_biases(&summary, 2e-3) - 0.940).abs() < 1e-3);
    // α₂ is the same and slows the targets as much.
    let (_, summary) = fly(&back(&thesis("eq-4-59")));
    assert!((assert_biases(&summary, 3e-3) - 0.9265).abs() < 1e-3);
    assert!(summary.fleet.predicted_speed.is_some_and(|speed| speed < -0.49), "{:?}", summary.fleet.predicted_speed);
    let still = with(&mission_text("missions/auv-helix.toml"), "speed = 0.5", "speed = 0.0");
    assert_broken(&still, "Along-path bias", "may point anywhere");
}

#[test]
fn path_following_asks_for_speeds_that_coordination_keeps_in_bounds() {
    const NAME: &str = "Path following (Propositions 3.1 to 3.3";
    assert_eq!(row(&thesis("fig-3-10"), NAME).holds, Some(true));
    let slack = with(&thesis("fig-3-10"), "a = 2.0", "a = 0.5");
    assert_broken(&slack, NAME, "no statement holds");
    assert_eq!(row(&slack, "Fleet speed").predicted, "0.10000 1/s, if they agree");
    let late = |text: &str| with(text, "[network]", "[network]\ndelay = { constant = { delay_s = 1.0 } }");
    assert_broken(&late(&thesis("truly-decentralised")), NAME, "no statement holds");
    assert_eq!(row(&thesis("fig-3-7"), "Proposition 3.8").holds, Some(true));
    assert_broken(&late(&thesis("fig-3-7")), "Proposition 3.8", "changes, delays or loses");
    // Whoever is alone has nobody to agree with.
    assert_eq!(row(&thesis("prop-3-2"), NAME).holds, Some(true));
}

#[test]
fn a_vehicle_that_gave_up_ends_what_is_covered() {
    let text = with(&thesis("fig-2-12"), " a = 3.0", " a = 120.0");
    let flown = mission(&text);
    let mut recording = bus::recording::Recording { complete: true, ..bus::recording::Recording::default() };
    let keep = |row| {
        if let common::record::Row::Exact(record) = row {
            recording.exact.push(record);
        }
    };
    let outcome = simulate::simulate(&flown, keep, |_| true).expect("it can be tried");
    assert!(outcome.aborted[0].starts_with("r1 aborted"), "{:?}", outcome.aborted);
    let monitor = |aborted: Vec<String>| {
        let everyone = aborted.is_empty();
        let facts = mission_control::results::Facts { aborted, duration_s: outcome.now.secs(), ..facts(&flown) };
        let rows = theory::rows(&flown, Some(&summarise(&recording, &facts)));
        let of_law = rows.iter().find(|row| row.name.contains("(2.35)")).expect("a row");
        assert_eq!(of_law.holds, Some(everyone), "{of_law:?}");
        rows.into_iter().find(|row| row.name.contains("Theorem monitor")).expect("a verdict")
    };
    let gone = monitor(outcome.aborted.clone());
    assert!(gone.holds == Some(false) && gone.measured.contains("r1 aborted: "), "{gone:?}");
    // Were that not known: the error is beyond all that coordination could leave.
    let grown = monitor(Vec::new());
    assert!(grown.holds == Some(false) && grown.measured.starts_with("a defect: covered by"), "{grown:?}");
}

#[test]
fn what_does_not_hold_promises_nothing() {
    let missions =
        ["missions/talk/naive.toml", "missions/talk/event-triggered.toml", "missions/talk/estimated-speed.toml"];
    let gain = with(&mission_text("missions/talk/known-delay.toml"), "gain = 0.05", "gain = 9.0");
    for text in missions.map(mission_text).into_iter().chain([gain]) {
        for row in theory::rows(&mission(&text), None).iter().filter(|row| row.holds == Some(false)) {
            assert!(row.predicted == "–" && row.guaranteed_rate.is_none(), "{row:?}");
        }
    }
}

#[test]
fn the_rate_of_a_known_delay_stands_beside_the_flight() {
    let text = mission_text("missions/talk/known-delay.toml");
    let from = text.find("exceptions").expect("delays that differ");
    let to = text.find("[fleet]").expect("a fleet");
    let text = with(&text, &text[from..to], "\n");
    let (rows, summary) = fly(&text);
    let row = rows.iter().find(|row| row.name.contains("known delay")).expect("a row");
    let guaranteed = row.guaranteed_rate.expect("one delay on all links");
    // The slower mode, a = 0.05 and τ = 5 s: between w e^(−w) = 0.25, w = 0.3574, and what is used at 5.15 s.
    assert!((guaranteed - 0.3574 / 5.0).abs() < 1e-4, "{guaranteed}");
    let fit = summary.fleet.coordination.fit.expect("it decays");
    assert!((fit.rate / guaranteed - 1.0).abs() < 0.05 && fit.rate > 0.0, "{} {guaranteed}", fit.rate);
    assert!(row.predicted.contains("in the end") && summary.fleet.coordination.guaranteed_rate == Some(guaranteed));
    // A vehicle that may not move as told takes it.
    let slow = with(&text, "y_m = 2.0 }", "y_m = 2.0 }\nlimits = { acceleration_mps2 = 0.01 }");
    assert_broken(&slow, "known delay", "does not move just as told");
    assert_broken(&with(&text, "y_m = 4.0 }", "y_m = 4.5 }"), "known delay", "does not move just as told");
}

#[test]
fn delays_of_their_own_on_every_link_are_covered() {
    const NAME: &str = "known delay";
    let text = mission_text("missions/talk/known-delay.toml");
    let row_of = |rows: Vec<TheoryRow>| rows.into_iter().find(|row| row.name.contains(NAME)).expect("a row");
    // As shipped: not the same both ways, and one varies.
    let (rows, summary) = fly(&text);
    let row = row_of(rows);
    assert!(row.holds == Some(true) && row.predicted == "agreement at v_L", "{row:?}");
    assert!(row.value.contains("delays of any kind: k‖T‖ = 0."), "{row:?}");
    assert!(summary.fleet.coordination.last < 1e-3 && (summary.fleet.steady_speed - 0.5).abs() < 1e-4);
    // Constant, and the same both ways: a rate.
    let from = text.find("exceptions").expect("delays that differ");
    let to = text.find("[fleet]").expect("a fleet");
    let two = "exceptions = [\n  { from = \"b\", to = \"a\", delay = { constant = { delay_s = 2.0 } } },\n  \
               { from = \"a\", to = \"b\", delay = { constant = { delay_s = 2.0 } } },\n]\n\n";
    let alike = with(&text, &text[from..to], two);
    let (rows, summary) = fly(&alike);
    let row = row_of(rows);
    let guaranteed = row.guaranteed_rate.expect("a rate");
    let fit = summary.fleet.coordination.fit.expect("it decays");
    assert!(row.value.contains("delays alike both ways: kλ_max τ = 0.772"), "{row:?}");
    assert!(guaranteed > 0.02 && fit.rate > guaranteed, "{} {guaranteed}", fit.rate);
    // Where the premises end.
    assert_broken(&with(&text, "gain = 0.05", "gain = 0.09"), NAME, "k‖T‖ = 1.1");
    assert_broken(&with(&text, "longest_s = 20.0", "longest_s = 5.1"), NAME, "do not count");
    assert_broken(&with(&text, "message_period_s = 0.1", "message_period_s = 0.1\nvalidity_s = 2.0"), NAME, "pauses");
    let normal = with(&text, "jittered = { min_s = 1.0, max_s = 4.0 }", "normal = { mean_s = 2.0, deviation_s = 0.2 }");
    assert_broken(&normal, NAME, "a delay has no bound");
}

#[test]
fn the_bound_of_talk_by_event_holds_for_kinematic_vehicles_along_their_lines() {
    const NAME: &str = "event-triggered talk";
    let text = mission_text("missions/talk/bounded.toml");
    let (rows, summary) = fly(&text);
    let row = rows.iter().find(|row| row.name.contains(NAME)).expect("a row");
    let most: f64 = row.predicted.split(' ').find_map(|word| word.parse().ok()).expect("a number");
    assert!(row.holds == Some(true) && summary.fleet.coordination.last < most, "{row:?}");
    // g = √6 for three in a row, threshold 0.05, news 0.15 s old: docs/talking.md.
    assert!((most - 0.2015).abs() < 1e-4, "{row:?}");
    assert_broken(&with(&text, "between = \"advance\"", "between = \"hold\""), NAME, "do not move on at v_L");
    assert_broken(&with(&text, "x_m = 4.0, y_m = 0.0 }", "x_m = 4.0, y_m = 0.5 }"), NAME, "does not move just as told");
    let lossy = with(&text, "[network]", "[network]\nloss = { bernoulli = { probability = 0.1 } }");
    assert_broken(&lossy, NAME, "messages are lost");
    // Three in a row: λ_max g + d = 3√6 + 2, news 0.15 s old as above.
    let eager = with(&text, "gain = 0.1", "gain = 1.0");
    assert_broken(
        &eager,
        NAME,
        "a gain too large for news that are σ = 0.150 s old: σk(λ_max g + d) = 1.402, not below 1",
    );
    let one_way =
        with(&text, "links = [[\"a\", \"b\"], [\"b\", \"c\"]]", "links = [[\"a\", \"b\"]]\none_way = [[\"b\", \"c\"]]");
    assert_broken(&one_way, NAME, "; 1 of 3 directed links without the other direction");
    let own = with(&text, "id = \"c\"", "id = \"c\"\ngains = { gain = 0.2 }");
    assert_broken(&own, NAME, "; unequal gains, 0.1 to 0.2");
    let slow = with(&text, "[network]", "[network]\ndelay = { gamma = { mean_s = 0.2, deviation_s = 0.1 } }");
    assert_broken(&slow, NAME, "; delays have no bound");
}
