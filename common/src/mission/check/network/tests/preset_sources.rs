//! That the presets are what their sources give. The sources are named in the presets' files and in `docs/network.md`.

use super::mission;
use crate::network::{Delay, Loss, Medium, Range};
use crate::time::{Span, Time};
use crate::wire::state::CoordinationState;

fn range(preset: &str) -> Range {
    mission(&format!("preset = \"{preset}\"")).links[0].range.clone()
}

fn medium(preset: &str) -> Medium {
    mission(&format!("preset = \"{preset}\"")).medium.expect("of acoustic presets")
}

fn extra(preset: &str) -> Span {
    match mission(&format!("preset = \"{preset}\"")).links[0].layers[0].delay {
        Delay::Distance { extra, .. } => extra,
        ref other => panic!("{other:?}"),
    }
}

/// The bytes of a message that says only what every message says.
fn message() -> (CoordinationState, Vec<u8>) {
    let state = CoordinationState { mission: 1, sender: 2, seq: 3, made: Time::ZERO, xi: 4.0, scalar: None };
    (state, state.encode())
}

/// Value at x of a table (x, value) that is linear between its points and constant beyond its ends.
fn linear(table: &[(f64, f64)], x: f64) -> f64 {
    let after = table.partition_point(|(at, _)| *at < x);
    match (after.checked_sub(1).map(|before| table[before]), table.get(after)) {
        (None, _) => table[0].1,
        (Some((_, last)), None) => last,
        (Some((x_0, y_0)), Some((x_1, y_1))) => y_0 + (y_1 - y_0) * (x - x_0) / (x_1 - x_0),
    }
}

/// Signal over noise \[dB\] at r \[m\]: source level, noise density and band, spherical spreading, absorption \[dB/km\].
fn sonar_equation(level: f64, density: f64, band: f64, absorption: f64, r: f64) -> f64 {
    level - (density + 10.0 * band.log10()) - 20.0 * r.log10() - absorption * r / 1000.0
}

/// Absorption in sea water \[dB/km\] at a frequency \[kHz\] (Thorp 1967).
fn thorp(f: f64) -> f64 {
    0.11 * f * f / (1.0 + f * f) + 44.0 * f * f / (4100.0 + f * f) + 2.75e-4 * f * f + 0.003
}

/// Mean of f over a standard normal variable.
fn normal_mean(f: impl Fn(f64) -> f64) -> f64 {
    let nodes = (-500..=500).map(|i| f64::from(i) / 100.0).map(|z| ((-z * z / 2.0).exp(), f(z)));
    let (weight, sum) = nodes.fold((0.0, 0.0), |(weight, sum), (w, value)| (weight + w, sum + w * value));
    sum / weight
}

fn assert_follows(preset: &str, tolerance: f64, expected: impl Fn(f64) -> f64) {
    let Range::Curve(points) = range(preset) else { panic!("{preset} has no curve") };
    for (distance, probability) in points.iter().filter(|(distance, _)| *distance > 0.0) {
        let expected = expected(*distance);
        assert!(
            (probability - expected).abs() <= tolerance,
            "{preset} at {distance} m: {probability}, not {expected:.4}"
        );
    }
}

#[test]
fn the_long_curve_is_the_sonar_equation_with_the_frame_errors_of_ros_acomms() {
    let frame_error =
        [(-7.957, 1.0), (-7.604, 0.9367), (-7.234, 0.7267), (-6.845, 0.17), (-6.444, 0.02), (-6.012, 0.0)];
    assert!((thorp(25.0) - 6.1).abs() < 0.05);
    assert_follows("acoustic_long_range", 0.006, |r| {
        let snr = sonar_equation(185.0, 50.0, 5000.0, thorp(25.0), r);
        1.0 - normal_mean(|z| linear(&frame_error, snr + 3.0 * z))
    });
}

#[test]
fn the_guard_time_is_as_long_as_the_way_to_the_end_of_the_long_curve() {
    let Range::Curve(points) = range("acoustic_long_range") else { panic!("no curve") };
    let farthest = points.last().expect("points").0;
    let slot = 15.0;
    let guard = slot - medium("acoustic_long_range").slots.expect("by turns").usable().secs();
    assert!((guard - 5.0).abs() < 1e-9 && farthest / 1500.0 <= guard, "{farthest} m in {guard} s");
}

#[test]
fn the_short_curve_is_the_sonar_equation_with_the_packet_errors_of_the_nm3_simulator() {
    let packet_error = [
        (-2.0, 1.0),
        (-1.0, 0.8),
        (0.0, 0.4),
        (1.0, 0.23),
        (2.0, 0.09),
        (3.0, 0.03),
        (4.0, 0.01),
        (5.0, 0.003),
        (6.0, 0.001),
    ];
    // At 10 m of depth the simulator's transducer has its full level, to 0.02 dB.
    let snr = |r: f64| sonar_equation(168.0, 50.0, 8000.0, 6.0, r);
    assert_follows("acoustic_short_range", 0.02, |r| 1.0 - linear(&packet_error, snr(r)));
}

#[test]
fn sixty_four_bytes_of_a_nanomodem_go_at_the_throughput_of_its_data_sheet() {
    let medium = medium("acoustic_short_range");
    let airtime = |bytes: usize| medium.airtime(bytes).secs();
    for bytes in [14, 39, 64] {
        assert!((airtime(bytes) - (0.105 + (bytes as f64 + 16.0) * 0.0125)).abs() < 1e-9, "{bytes} bytes");
    }
    assert!((8.0 * 64.0 / airtime(64) - 463.0).abs() < 0.5);
}

#[test]
fn seventeen_bytes_are_a_message_without_what_both_ends_know() {
    let (state, bytes) = message();
    let known = size_of_val(b"CX")
        + size_of_val(&crate::wire::PROTOCOL)
        + size_of_val(&state.mission)
        + size_of_val(&state.made.nanos())
        + size_of::<u8>();
    // A Micro-Modem networks up to 16 units.
    let sender = size_of::<u8>();
    let packed = bytes.len() - known - (size_of_val(&state.sender) - sender);
    let checksum = size_of_val(&crc32fast::hash(&bytes));
    assert_eq!(packed, sender + size_of_val(&state.seq) + size_of_val(&state.xi) + checksum);
    assert_eq!(medium("acoustic_long_range").packet, Some(packed));
    assert!(packed <= 32, "a frame of the Micro-Modem");
}

#[test]
fn three_nanomodems_offer_the_load_at_which_a_channel_without_turns_carries_most() {
    let carried = |offered: f64| offered * (-2.0 * offered).exp();
    let loads = (1..200).map(|percent| f64::from(percent) / 100.0);
    let most = loads.max_by(|a, b| carried(*a).total_cmp(&carried(*b))).expect("loads");
    let medium = medium("acoustic_short_range");
    let (vehicles, airtime, wait) = (3.0, medium.airtime(message().1.len()).secs(), medium.backoff.secs());
    let offered = vehicles * airtime / wait;
    assert!((offered - most).abs() < 1e-6, "{offered}, not {most}");
    assert!(((1.0 - airtime / wait).powi(2) - 0.69).abs() < 0.005, "two that speak at once miss one another");
}

#[test]
fn radios_lose_one_by_one_what_their_sources_counted() {
    let lost = |preset: &str| match mission(&format!("preset = \"{preset}\"")).links[0].layers[0].loss {
        Some(Loss::Bernoulli(probability)) => probability,
        ref other => panic!("{preset}: {other:?}"),
    };
    assert!((lost("radio_over_the_horizon") - 0.01).abs() < 1e-12);
    let wifi = lost("wifi_harbour");
    assert!((wifi - 0.014).abs() < 1e-12);
    // In the 180 000 messages that were counted there was no run of five, and with these there would be none either.
    assert!(180_000.0 * wifi.powi(5) < 0.001);
}

#[test]
fn a_modem_takes_what_its_serial_line_takes() {
    let line = |characters: usize, baud: f64| 10.0 * characters as f64 / baud;
    let hex = |bytes: usize| "0".repeat(2 * bytes);
    let (into, out) = (format!("$CCTXD,1,2,0,{}*00\r\n", hex(17)), format!("$CARXD,1,2,0,1,{}*00\r\n", hex(17)));
    assert_eq!((into.len(), out.len()), (52, 54));
    assert!((extra("acoustic_long_range").secs() - line(into.len() + out.len(), 19_200.0)).abs() < 5e-4);
    let (into, out) = ("$B39".len() + 39, "#B00139\r\n".len() + 39);
    assert_eq!((into, out), (43, 48));
    assert!((extra("acoustic_short_range").secs() - line(into + out, 9600.0)).abs() < 5e-4);
}

#[test]
fn the_wifi_curve_is_two_rays_and_rayleigh_fading_at_the_sensitivity_that_the_standard_demands() {
    let (power_dbm, sensitivity_dbm, height) = (20.0, -82.0, 2f64);
    let reach = 10f64.powf((power_dbm - sensitivity_dbm + 40.0 * height.log10()) / 40.0);
    assert!((reach - 710.0).abs() < 1.0, "{reach}");
    // At 2.412 GHz; nearer, the two rays do not fall with r⁴, but hardly anything is lost there anyway.
    let from = 4.0 * height * height / (299_792_458.0 / 2.412e9);
    assert!((from - 129.0).abs() < 0.5 && (-(from / reach).powi(4)).exp() > 0.998, "{from}");
    assert_follows("wifi_harbour", 0.006, |r| (-(r / reach).powi(4)).exp());
}
