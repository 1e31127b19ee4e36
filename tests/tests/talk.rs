//! When vehicles speak and what they believe between messages: the missions of `missions/talk`.

use std::sync::Arc;

use bus::recording::Recording;
use common::mission::Mission;
use common::record::{Record, Row};
use cpf_tests::{assert_close, mission, mission_text, with};
use mission_control::facts::facts;
use mission_control::results::{Summary, network_section, summarise};
use mission_control::simulate::simulate;

fn fly(text: &str) -> Summary {
    let mission: Arc<Mission> = mission(text);
    let mut recording = Recording { complete: true, seed: mission.seed, ..Recording::default() };
    let keep = |row| {
        if let Row::Exact(record) = row {
            recording.exact.push(record);
        }
    };
    simulate(&mission, keep, |_| true).expect("the mission can be flown");
    let summary = summarise(&recording, &facts(&mission));
    assert!(summary.warnings.is_empty(), "{:?}", summary.warnings);
    summary
}

fn apart(summary: &Summary) -> f64 {
    summary.fleet.coordination.last
}

fn said(summary: &Summary) -> u64 {
    summary.vehicles.iter().map(|vehicle| vehicle.messages_said).sum()
}

const NAIVE: &str = "missions/talk/naive.toml";

#[test]
fn few_messages_that_are_acknowledged_do_for_many_even_if_most_are_lost() {
    let text = mission_text("missions/talk/event-triggered.toml");
    let flown = fly(&text);
    assert!(apart(&flown) < 0.1, "{}", apart(&flown));
    // In every message period it would be 2001 each.
    assert!(said(&flown) * 5 < 4 * 2001, "{} said", said(&flown));
    // Those in the middle acknowledge two neighbours, those at the ends one.
    for (vehicle, bytes) in flown.vehicles.iter().zip([43, 47, 47, 43]) {
        assert_eq!(vehicle.bytes_on_air, vehicle.messages_said * bytes, "{}", vehicle.id);
    }
    let all: u64 = flown.vehicles.iter().map(|vehicle| vehicle.bytes_on_air).sum();
    assert_eq!(flown.fleet.messages.bytes_on_air, all);
}

#[test]
fn who_takes_what_was_said_for_heard_is_silent_for_ever() {
    let flown = fly(&mission_text(NAIVE));
    assert_eq!(said(&flown), 3, "each spoke once, into the void");
    assert_close("never closer", apart(&flown), 7.0, 1e-6);
}

#[test]
fn who_waits_for_an_acknowledgement_agrees() {
    let flown = fly(&with(&mission_text(NAIVE), "threshold = 0.05", "threshold = 0.05\npatience_s = 1.0"));
    assert!(apart(&flown) < 0.2, "{}", apart(&flown));
    assert!(said(&flown) < 3 * 1201 / 4, "{} said", said(&flown));
}

/// The naive fleet with links that are up for 2.5 s of every 10 s, and a heartbeat.
fn with_heartbeat(heartbeat: &str) -> Summary {
    let text = with(&mission_text(NAIVE), "most_silence_s = 3600.0", heartbeat);
    let outages = "switching = { periodic = { period_s = 10.0, up_from_s = 7.5, up_for_s = 2.5 } }";
    fly(&with(&text, "switching = { intervals = { up = [{ from_s = 5.0, to_s = 120.0 }] } }", outages))
}

#[test]
fn a_heartbeat_in_step_with_the_outages_is_never_heard_and_one_with_jitter_is() {
    let in_step = with_heartbeat("most_silence_s = 10.0");
    assert_eq!(in_step.fleet.messages.counts.delivered, 0);
    assert_close("never closer", apart(&in_step), 7.0, 1e-6);
    let jittered = with_heartbeat("most_silence_s = 10.0\njitter = 0.5");
    assert!(jittered.fleet.messages.counts.delivered > 0 && apart(&jittered) < 3.0, "{}", apart(&jittered));
}

#[test]
fn with_known_delays_the_fleet_travels_at_v_l() {
    let text = mission_text("missions/talk/known-delay.toml");
    let known = fly(&text);
    assert!(apart(&known) < 1e-3, "{}", apart(&known));
    assert_close("v_L", known.fleet.steady_speed, 0.5, 1e-4);
    // Told the present only, the law is slower, and its vehicles settle apart.
    let law = "known_delay = { gain = 0.05, longest_s = 20.0 }";
    let unknown = fly(&with(&text, law, "switching = { gain = 0.05 }"));
    assert!(unknown.fleet.steady_speed < 0.45 && apart(&unknown) > 0.1, "{}", apart(&unknown));
}

#[test]
fn a_fleet_that_is_not_told_the_delay_finds_its_speed() {
    let text = mission_text("missions/talk/estimated-speed.toml");
    let law = "delayed_estimating = { gain = 0.1, time_constant_s = 10.0 }";
    let estimated = fly(&text);
    let told = fly(&with(&text, law, "delayed_with_losses = { gain = 0.1, delay_s = 5.0 }"));
    let not_told = fly(&with(&text, law, "delayed = { gain = 0.1, delay_s = 0.0 }"));
    let steady = |summary: &Summary| summary.fleet.coordination.steady_rms;
    // Held between messages, news are up to a message period older than the delay; the told one does not know that.
    assert_close("v_L*", estimated.fleet.steady_speed, 0.5 / 1.5, 1e-2);
    assert!(steady(&estimated) < 0.05 && steady(&told) < 0.05, "{} {}", steady(&estimated), steady(&told));
    assert!(steady(&not_told) > 1.0, "{}", steady(&not_told));
    // No theorem says so, and none is laid beside it.
    assert_eq!(estimated.fleet.predicted_speed, None);
}

#[test]
fn neighbours_may_be_taken_to_move_as_they_last_did() {
    // While all are late and slower than v_L, the rate of the last messages is the better guess.
    let text = mission_text("missions/talk/naive.toml");
    let text = with(&text, "threshold = 0.05", "threshold = 0.05\npatience_s = 1.0");
    let estimate = fly(&with(&text, "between = \"advance\"", "between = \"estimate\""));
    assert!(apart(&estimate) < 0.2, "{}", apart(&estimate));
}

/// A message: from, to, its number, and its fate.
type Message = (String, String, u64, String);

/// What became of every message, and all rows.
fn fates(text: &str) -> (Vec<Message>, Vec<Record>) {
    let mut exact = Vec::new();
    let keep = |row| {
        if let Row::Exact(record) = row {
            exact.push(record);
        }
    };
    simulate(&mission(text), keep, |_| true).expect("the mission can be flown");
    let of = |record: &Record| match record {
        Record::Message(row) => {
            Some((row.from.to_string(), row.to.to_string(), row.seq, row.fate.as_str().to_string()))
        }
        _ => None,
    };
    (exact.iter().filter_map(of).collect(), exact)
}

#[test]
fn the_losses_of_a_recorded_run_happen_again_message_by_message() {
    let text = mission_text("missions/talk/event-triggered.toml");
    let (flown, exact) = fates(&text);
    assert!(flown.iter().filter(|(.., fate)| fate == "lost").count() > 100, "two in three are lost");
    let section = network_section(&exact, mission(&text).message_period());
    let pasted = with(&text, "loss = { bernoulli = { probability = 0.667 } }\n", &format!("{section}\n"));
    let (again, _) = fates(&pasted);
    assert_eq!(flown.len(), again.len());
    let parted = flown.iter().zip(&again).find(|(one, other)| one != other);
    assert_eq!(parted, None, "the first message with another fate");
}
