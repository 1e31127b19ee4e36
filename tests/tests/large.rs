//! Large fleets: what can be written in a mission file can be checked and flown.

use bus::recording::Recording;
use common::mission::Mission;
use common::record::Row;
use cpf_tests::mission;
use mission_control::facts::facts;
use mission_control::results::summarise;
use mission_control::simulate::simulate;
use mission_control::theory;

/// `n` vehicles abreast with these links, which fly for half a second and speak at 10 Hz.
fn fleet(n: usize, links: impl Iterator<Item = (usize, usize)>) -> String {
    let links: Vec<String> = links.map(|(a, b)| format!("[\"v{a}\", \"v{b}\"]")).collect();
    let mut text = format!(
        "name = \"large\"\nduration_s = 0.5\n[formation]\nspeed = 0.5\n[coordination]\n\
         law = {{ switching = {{ gain = 0.001 }} }}\nmessage_period_s = 0.1\n[network]\nlinks = [{}]\n\
         [fleet]\nmodel = \"kinematic_unicycle\"\nfollowing = {{ line_of_sight = {{ distance_m = 1.0 }} }}\n",
        links.join(", ")
    );
    for i in 0..n {
        text += &format!(
            "[[vehicles]]\nid = \"v{i}\"\npath = {{ line = {{ start_m = [0.0, {i}.0] }} }}\nstart = {{ x_m = 0.0, y_m = {i}.0 }}\n"
        );
    }
    text
}

fn complete(n: usize) -> String {
    fleet(n, (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))))
}

fn assert_flies(text: &str, vehicles: usize, links: usize) {
    let mission = mission(text);
    assert_eq!((mission.vehicles.len(), mission.links.len()), (vehicles, links));
    assert!(theory::rows(&mission, None).iter().any(|row| row.value.contains("two-way links, connected")));
    let mut recording = Recording { complete: true, seed: mission.seed, ..Recording::default() };
    let keep = |row| {
        if let Row::Exact(record) = row {
            recording.exact.push(record);
        }
    };
    simulate(&mission, keep, |_| true).expect("it can be flown");
    let summary = summarise(&recording, &facts(&mission));
    assert_eq!(summary.warnings, Vec::<String>::new());
    let totals = summary.fleet.messages;
    // Said at 0, 0.1, ..., 0.5 s; without delay, what is said at the end has arrived.
    assert_eq!(
        (totals.counts.sent, totals.counts.delivered, totals.balanced),
        (6 * links as u64, 6 * links as u64, true)
    );
    assert!(summary.fleet.connectivity.is_some_and(|connectivity| connectivity.alpha == 0.0));
}

#[test]
fn a_fleet_of_one_more_than_a_machine_word_has_bits_can_be_flown() {
    assert_flies(&fleet(65, (0..65).map(|i| (i, (i + 1) % 65))), 65, 130);
}

#[test]
fn two_hundred_vehicles_that_all_hear_one_another_can_be_flown() {
    assert_flies(&complete(200), 200, 200 * 199);
}

#[test]
fn the_largest_fleet_can_be_flown_and_one_more_vehicle_is_refused() {
    assert_flies(&fleet(256, (0..256).map(|i| (i, (i + 1) % 256))), 256, 512);
    let refused = Mission::parse("m.toml", &fleet(257, (0..257).map(|i| (i, (i + 1) % 257)))).expect_err("too large");
    assert!(refused.to_string().contains("257 vehicles"), "{refused}");
}
