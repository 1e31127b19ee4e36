//! What is refused, and what presets become.

mod preset_sources;

use super::super::super::Mission;
use super::super::super::file::Preset;
use crate::network::Medium;
use crate::random::Stream;
use crate::time::{Span, Time};

const HELIX: &str = include_str!("../../../../../missions/auv-helix.toml");

/// The flagship with another network.
fn with_network(network: &str) -> String {
    let (begin, end) = (HELIX.find("delay = { constant").expect("there"), HELIX.find("[fleet]").expect("there"));
    format!("{}{network}\n{}", &HELIX[..begin], &HELIX[end..])
}

fn faults(network: &str) -> Vec<String> {
    let parsed = Mission::parse("m.toml", &with_network(network));
    parsed.err().map_or(Vec::new(), |faults| faults.to_string().lines().map(str::to_string).collect())
}

fn mission(network: &str) -> Mission {
    Mission::parse("m.toml", &with_network(network)).unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn each_fault_names_its_key_what_was_found_and_what_is_allowed() {
    for (network, key, found, allowed) in [
        ("loss = { bernoulli = { probability = 1.1 } }", "loss.bernoulli.probability", "1.1", "0 to 1"),
        ("duplicate_probability = -0.1", "duplicate_probability", "-0.1", "0 to 1"),
        ("corrupt_probability = 2.0", "corrupt_probability", "2", "0 to 1"),
        ("delay = { constant = { delay_s = -1.0 } }", "delay.constant.delay_s", "-1", "0 to 3600 s"),
        ("delay = { normal = { mean_s = 1.0, deviation_s = 0.0 } }", "delay.normal.deviation_s", "0", "above 0"),
        ("delay = { normal = { mean_s = 1.0, deviation_s = 1.0, min_s = -1.0 } }", "delay.normal.min_s", "-1", "0 to"),
        (
            "delay = { gamma = { mean_s = 1.0, deviation_s = 1.0, min_s = 2.0 } }",
            "delay.gamma.mean_s",
            "1",
            "above min_s",
        ),
        ("delay = { gamma = { mean_s = 1.0, deviation_s = 100.0 } }", "delay.gamma.deviation_s", "100", "10 times"),
        (
            "delay = { normal = { mean_s = 1.0, deviation_s = 0.01, min_s = 3000.0 } }",
            "delay.normal.mean_s",
            "1",
            "min_s to 3600 s",
        ),
        (
            "delay = { normal = { mean_s = 600.0, deviation_s = 601.0 } }",
            "delay.normal.deviation_s",
            "601",
            "at most 600: mean_s + 5 deviation_s",
        ),
        (
            "delay = { gamma = { mean_s = 600.0, deviation_s = 3600.0 } }",
            "delay.gamma.deviation_s",
            "3600",
            "at most 600: mean_s + 5 deviation_s",
        ),
        ("delay = { distance = { speed_mps = 0.0 } }", "delay.distance.speed_mps", "0", "1 to 3e8 m/s"),
        (
            "loss = { gilbert_elliott = { mean_burst = 0.5, mean_gap = 5.0 } }",
            "loss.gilbert_elliott.mean_burst",
            "0.5",
            "1 to",
        ),
        (
            "loss = { gilbert_elliott = { mean_burst = 2.0, mean_gap = 1.5 } }",
            "loss.gilbert_elliott.mean_gap",
            "1.5",
            "2 to",
        ),
        (
            "loss = { gilbert_elliott = { mean_burst = 1.0, mean_gap = 5.0 } }",
            "loss.gilbert_elliott.mean_gap",
            "5",
            "bernoulli",
        ),
        (
            "loss = { shared_fades = { probability = 1.0, mean_burst = 2.0 } }",
            "loss.shared_fades.probability",
            "1",
            "below 1",
        ),
        (
            "loss = { shared_fades = { probability = 0.9, mean_burst = 2.0 } }",
            "loss.shared_fades.mean_burst",
            "2",
            "10",
        ),
        ("loss = { trace = { runs = [] } }", "loss.trace.runs", "found 0 messages", "1 to 1000000"),
        ("range = { disc = { radius_m = 0.0 } }", "range.disc.radius_m", "0", "above 0"),
        ("range = { curve = { points = [[5.0, 1.0], [5.0, 0.5]] } }", "range.curve.points[1]", "5", "greater"),
        ("range = { curve = { points = [[5.0, 1.5]] } }", "range.curve.points[0]", "1.5", "0 to 1"),
        (
            "switching = { random = { alpha = 1.0, t_0_s = 1.0, dwell_s = 0.1 } }",
            "switching.random.alpha",
            "1",
            "below 1",
        ),
        (
            "switching = { markov = { mean_up_s = 0.0, mean_down_s = 1.0 } }",
            "switching.markov.mean_up_s",
            "0",
            "30 days",
        ),
        (
            "switching = { connected_in_mean = { window_s = 4.9, dwell_s = 1.0 } }",
            "switching.connected_in_mean.window_s",
            "4.9 s",
            "at least 5 s",
        ),
        (
            "switching = { trace = { links = [] } }",
            "switching.trace.links",
            "nothing about link/auv1->auv2",
            "every directed link",
        ),
        ("medium = { rate_bps = 0.0 }", "medium.rate_bps", "0", "1 to 1e12"),
        ("medium = { rate_bps = 80.0, packet_bytes = 16 }", "medium.packet_bytes", "16", "17 to 65535 bytes: a modem"),
        (
            "exceptions = [{ from = \"auv1\", to = \"auv2\", queue = 0 }]",
            "exceptions[0].queue",
            "0",
            "1 to 1000000 messages",
        ),
        ("medium = { rate_bps = 80.0, queue = 0 }", "medium.queue", "0", "1 to 10000"),
        ("medium = { rate_bps = 80.0, duty_cycle = 1.5 }", "medium.duty_cycle", "1.5", "a share of the time"),
        (
            "medium = { rate_bps = 80.0, slots = { slot_s = 4.0, guard_s = 1.0 } }",
            "medium.slots.slot_s",
            "4 s, less 1 s of guard",
            "the airtime",
        ),
        (
            "medium = { rate_bps = 80.0, slots = { slot_s = 9.0, guard_s = 9.0 } }",
            "medium.slots.guard_s",
            "9",
            "below slot_s",
        ),
        (
            "medium = { rate_bps = 1e6, slots = { slot_s = 4.0, guard_s = 1.0, order = [\"auv1\", \"auv3\"] } }",
            "medium.slots.order",
            "no slot for auv2",
            "at least once",
        ),
        ("also = [{ links = [[\"auv1\", \"auv2\"]] }]", "also[0]", "no model", "delay, loss or switching"),
        (
            "also = [{ links = [[\"auv1\", \"auv3\"]], loss = { bernoulli = { probability = 0.1 } } }]",
            "also[0].links",
            "not a link",
            "network.links",
        ),
        (
            "also = [{ links = [[\"auv1\", \"auv2\"], [\"auv1\", \"auv2\"]], loss = { bernoulli = { probability = 0.1 } } }]",
            "also[0].links[1]",
            "auv1 -> auv2 a second time",
            "each link once",
        ),
        (
            "also = [{ links = [], loss = { bernoulli = { probability = 0.1 } } }]",
            "also[0].links",
            "no links",
            "all of them",
        ),
        (
            "exceptions = [{ from = \"auv1\", to = \"auv2\", queue = 1 }, { from = \"auv1\", to = \"auv2\", queue = 2 }]",
            "exceptions[1]",
            "a second exception for auv1 -> auv2",
            "each link once",
        ),
        ("exceptions = [{ from = \"auv1\", to = \"auv2\" }]", "exceptions[0]", "without a model", "delay, loss"),
        (
            "switching = { random = { alpha = 0.7, t_0_s = 2.0, dwell_s = 1.0 } }",
            "switching.random.alpha",
            "0.7",
            "0 to 0.6666666666666666",
        ),
        (
            "switching = { intervals = { up = [{ from_s = 800.0, to_s = 900.0 }] } }",
            "switching.intervals",
            "a graph that can never be connected",
            "links that come up",
        ),
        ("preset = \"telepathy\"", "preset", "telepathy", "perfect"),
    ] {
        let said = faults(network);
        let fits = |line: &String| {
            line.contains(&format!(": network.{key}: found ")) && line.contains(found) && line.contains(allowed)
        };
        assert!(said.iter().any(fits), "{network}: {said:?}");
    }
}

#[test]
fn every_preset_is_a_network_that_can_be_flown() {
    for preset in ["perfect", "acoustic_long_range", "acoustic_short_range", "radio_over_the_horizon", "wifi_harbour"] {
        let mission = mission(&format!("preset = \"{preset}\""));
        assert_eq!(mission.medium.is_some(), preset.starts_with("acoustic"), "{preset}");
        assert_eq!(mission.every_message_takes(Span::ZERO), preset == "perfect", "{preset}");
    }
    for preset in [Preset::Perfect, Preset::WifiHarbour] {
        assert!(super::preset(preset).links.is_empty());
    }
}

#[test]
fn a_mission_overrides_its_preset() {
    let mission = mission("preset = \"acoustic_long_range\"\ndelay = { constant = { delay_s = 2.0 } }");
    assert_eq!(mission.links[0].fixed_delay(), Some(Span::from_secs(2.0)));
    let medium = mission.medium.expect("the preset's");
    assert_eq!(medium.airtime(39), Span::from_secs(2.2), "17 bytes at 80 bit/s after 0.5 s");
    assert!(mission.links[0].range.is_limited() && mission.links[0].in_order);
}

#[test]
fn keys_of_a_medium_are_laid_over_those_of_the_preset() {
    let preset = mission("preset = \"acoustic_long_range\"").medium.expect("the preset's");
    let medium = mission("preset = \"acoustic_long_range\"\nmedium = { packet_bytes = 32 }").medium.expect("laid over");
    assert_eq!(medium.airtime(39), Span::from_secs(3.7), "32 bytes at 80 bit/s after 0.5 s");
    assert_eq!(Medium { packet: preset.packet, ..medium }, preset);
    let all = "preset = \"acoustic_short_range\"\nmedium = { rate_bps = 80.0, preamble_s = 0.0, queue = 2, when_full = \"drop_new\", \
               backoff_s = 0.0, half_duplex = false, collisions = false, duty_cycle = 0.5 }";
    let alone = all.replace("preset = \"acoustic_short_range\"\n", "");
    assert_eq!(mission(all).medium, mission(&alone).medium);
}

#[test]
fn a_rate_is_required_where_no_preset_has_it() {
    for network in ["medium = { packet_bytes = 32, queue = 0 }", "preset = \"wifi_harbour\"\nmedium = { queue = 0 }"] {
        let said = faults(network);
        let line = HELIX[..HELIX.find("delay = { constant").expect("there")].lines().count() + network.lines().count();
        let expected = format!("m.toml:{line}: network.medium: found no rate_bps; allowed: a number: bits ");
        assert!(said.iter().any(|fault| fault.starts_with(&expected)), "{expected} is not in {said:?}");
        assert!(said.iter().any(|fault| fault.contains("network.medium.queue: found 0;")), "{said:?}");
    }
}

#[test]
fn the_least_delay_is_of_all_layers_and_none_on_a_shared_medium() {
    let layers = "delay = { normal = { mean_s = 2.0, deviation_s = 1.0, min_s = 0.5 } }\n\
                  also = [{ delay = { constant = { delay_s = 0.25 } } }]";
    assert_eq!(mission(layers).least_delay(), Span::from_secs(0.75));
    assert_eq!(mission(&format!("{layers}\nmedium = {{ rate_bps = 80.0 }}")).least_delay(), Span::ZERO);
}

#[test]
fn a_queue_can_be_full_if_more_than_its_places_can_be_under_way() {
    let full = |network: &str, queue: usize| {
        let mission = mission(&format!("{network}\nqueue = {queue}"));
        assert_eq!(mission.loses_by_switching_only(), !mission.can_fill(&mission.links[0]), "{network}");
        mission.can_fill(&mission.links[0])
    };
    // Every 0.1 s. What is due at the very instant at which another is sent still has its place.
    for (network, needed) in [
        ("delay = { constant = { delay_s = 0.0 } }", 1),
        ("delay = { constant = { delay_s = 0.099999999 } }", 1),
        ("delay = { constant = { delay_s = 0.1 } }", 2),
        ("delay = { constant = { delay_s = 5.0 } }", 51),
        ("delay = { constant = { delay_s = 4.9 } }\nalso = [{ delay = { constant = { delay_s = 0.1 } } }]", 51),
        // Up to 0.5 s, and never just that.
        ("delay = { jittered = { min_s = 0.1, max_s = 0.5 } }", 5),
        ("delay = { jittered = { min_s = 0.1, max_s = 0.5 } }\norder = \"in_order\"", 5),
        // The farthest takes an hour, and the mission is over after 800 s.
        ("delay = { distance = { speed_mps = 1500.0 } }", 8001),
    ] {
        assert!(!full(network, needed), "{needed} places will do for {network}");
        assert!(needed == 1 || full(network, needed - 1), "{needed} places are needed for {network}");
    }
    let normal = "delay = { normal = { mean_s = 2.0, deviation_s = 0.5 } }";
    assert!(full(normal, 20) && !full(normal, 100), "nine deviations are the most that is drawn");
}

#[test]
fn the_shortest_silence_is_the_first_message_period_after_it() {
    let pause = |least: &str| {
        let talk = format!(
            "message_period_s = 0.1\ntalk = {{ event_triggered = {{ threshold = 0.1, most_silence_s = 9.0{least} }} }}\n"
        );
        let text =
            HELIX.replacen("message_period_s = 0.1\n", &talk, 1).replace("validity_s = 0.3", "validity_s = 10.0");
        Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}")).shortest_pause().secs()
    };
    assert_eq!(pause(""), 0.1);
    for (least, first) in [(0.05, 0.1), (0.1, 0.1), (0.11, 0.2), (2.0, 2.0), (2.01, 2.1)] {
        assert!((pause(&format!(", least_silence_s = {least}")) - first).abs() < 1e-9, "{least}");
    }
}

#[test]
fn a_trace_says_when_links_are_up() {
    let link = |from: &str, to: &str, up: &str| format!("{{ from = \"{from}\", to = \"{to}\", up_s = {up} }}");
    let links = [
        link("auv1", "auv2", "[[0.0, 2.0], [3.0, 4.5]]"),
        link("auv2", "auv1", "[]"),
        link("auv2", "auv3", "[[1.0, 800.0]]"),
        link("auv3", "auv2", "[]"),
    ];
    let mut signal = mission(&format!("switching = {{ trace = {{ links = [{}] }} }}", links.join(", "))).switching;
    let up = [0.0, 1.0, 2.0, 3.0, 4.5].map(|t| (0..4).map(|l| signal.is_up(l, Time::from_secs(t))).collect::<Vec<_>>());
    assert_eq!(up[0], [true, false, false, false]);
    assert_eq!(up[1], [true, false, true, false]);
    assert_eq!(up[2], [false, false, true, false]);
    assert_eq!(up[3], [true, false, true, false]);
    assert_eq!(up[4], [false, false, true, false]);
}

#[test]
fn the_greatest_share_of_losses_and_every_smaller_one_can_be_asked_for() {
    for alpha in [0.0, 0.5, 2.0 / 3.0] {
        mission(&format!("switching = {{ random = {{ alpha = {alpha:?}, t_0_s = 2.0, dwell_s = 1.0 }} }}"));
    }
}

/// Which of the first messages each link loses.
fn lost(network: &str, messages: u64) -> Vec<Vec<bool>> {
    let mission = mission(network);
    let of_link = |link: &crate::mission::Link| {
        let mut layers: Vec<_> = link
            .layers
            .iter()
            .filter_map(|layer| Some((Stream::new(mission.seed, &layer.stream), layer.loss.clone()?)))
            .collect();
        let mut loses = |number: u64| {
            layers.iter_mut().fold(false, |lost, (stream, loss)| {
                let drawn = stream.units_at(number);
                lost | loss.loses(stream, number, &drawn)
            })
        };
        (0..messages).map(&mut loses).collect()
    };
    mission.links.iter().map(of_link).collect()
}

/// Fades of one model are shared by its links, and by no other model's.
#[test]
fn fades_of_different_models_are_independent() {
    const N: u64 = 40_000;
    let fades = "loss = { shared_fades = { probability = 0.3, mean_burst = 2.0, correlation = 1.0 } }";
    let share = |lost: &[bool]| lost.iter().filter(|lost| **lost).count() as f64 / N as f64;
    // Bursts of two make the messages worth a quarter as many independent ones.
    let bound = |p: f64| 5.0 * (p * (1.0 - p) * 4.0 / N as f64).sqrt();
    let stacked = lost(&format!("{fades}\nalso = [{{ {fades} }}]"), N);
    let expected = 1.0 - 0.7 * 0.7;
    assert!((share(&stacked[0]) - expected).abs() < bound(expected), "{}", share(&stacked[0]));
    let group = |a: &str, b: &str| format!("{{ links = [[\"{a}\", \"{b}\"]], {fades} }}");
    let groups = lost(&format!("also = [{}, {}]", group("auv1", "auv2"), group("auv2", "auv3")), N);
    let both: Vec<bool> = groups[0].iter().zip(&groups[2]).map(|(a, b)| *a && *b).collect();
    assert!((share(&groups[0]) - 0.3).abs() < bound(0.3) && (share(&groups[2]) - 0.3).abs() < bound(0.3));
    assert!((share(&both) - 0.09).abs() < bound(0.09), "{}", share(&both));
}

#[test]
fn signals_on_top_count_for_their_links_only() {
    let off = "intervals = { up = [{ from_s = 10.0, to_s = 20.0 }] }";
    let network = format!("also = [{{ links = [[\"auv1\", \"auv2\"]], switching = {{ {off} }} }}]");
    let mut signal = mission(&network).switching;
    let up: Vec<bool> = (0..4).map(|link| signal.is_up(link, Time::ZERO)).collect();
    assert_eq!(up, [false, true, true, true]);
}
