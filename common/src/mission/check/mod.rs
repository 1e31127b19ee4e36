//! From the file as written to a mission that can be flown, or to everything that is wrong with it.

mod coordination;
mod environment;
mod network;
mod path;
mod talk;
mod time;
mod vehicle;

use std::collections::HashMap;

use self::coordination::{check_law, check_partners, check_told, check_weights};
use self::network::{check_links, check_medium, check_switching, with_preset};
use self::talk::check_talk;
use self::time::{check_formation, check_times};
use self::vehicle::check_vehicle;
use super::build;
use super::fault::{Collector, Faults};
use super::file::{MissionFile, VehicleSection};
use super::read::examine;
use super::{Mission, SpeedProfile, VehiclePlan, digest};
use crate::time::Span;

/// Most vehicles in a mission.
pub(super) const MOST_VEHICLES: usize = 256;

/// Longest mission \[s\]: thirty days.
pub(super) const LONGEST: f64 = 30.0 * 86_400.0;

/// Greatest formation speed \[units of ξ per s\].
pub const FASTEST_FORMATION: f64 = 1e6;

/// Farthest place from the origin \[m\]: a quarter of the way round the globe. Beyond it a number is a slip of the pen, and
/// squares and differences lose their digits.
pub(super) const FARTHEST: f64 = 1e7;

/// Greatest path parameter and place in the pattern \[units of ξ\].
pub(super) const LARGEST_XI: f64 = 1e9;

/// Greatest angle \[deg\].
pub(super) const LARGEST_ANGLE: f64 = 1e6;

pub(super) fn check(name: &str, text: &str) -> Result<Mission, Faults> {
    examine(name, text, |faults, file: MissionFile| assemble(faults, &file, text))
}

/// Everything that is checked beyond the shape; `None` only with a fault noted.
fn assemble(faults: &mut Collector<'_>, file: &MissionFile, text: &str) -> Option<Mission> {
    check_name(faults, "name", &file.name);
    let times = check_times(faults, file);
    let speed = check_formation(faults, file);
    let ids = check_ids(faults, &file.vehicles);
    let (law, law_choices) = check_law(faults, file, &ids).unzip();
    let talk = check_talk(faults, file, law.as_deref());
    let network = with_preset(&file.network);
    let links = check_links(faults, file, &network, &ids);
    check_weights(faults, file, &ids, links.as_deref().unwrap_or(&[]));
    check_told(faults, file, &ids, links.as_deref().unwrap_or(&[]));
    if let Some(links) = links.as_deref() {
        check_partners(faults, file, &ids, links);
    }
    let switching = check_switching(faults, file, &network, &ids, links.as_deref().unwrap_or(&[]));
    let medium = check_medium(faults, file, &network, &ids);
    let fastest = speed.as_ref().map_or(0.0, SpeedProfile::fastest);
    let factor = build::nominal_factor(&file.coordination.law);
    let vehicles: Vec<Option<VehiclePlan>> =
        (0..file.vehicles.len()).map(|i| check_vehicle(faults, file, i, law.as_deref(), factor, fastest)).collect();
    let (times, speed, law, links, switching) = (times?, speed?, law?, links?, switching?);
    let mission = Mission {
        digest: digest(text),
        text: text.to_string(),
        name: file.name.clone(),
        about: file.about.clone(),
        seed: file.seed,
        end: times.end,
        control_period: times.control_period,
        substeps: file.clock.substeps as usize,
        record_ticks: times.record_ticks,
        message_ticks: times.message_ticks,
        speed,
        law,
        law_choice: file.coordination.law.clone(),
        law_choices: law_choices?,
        validity: file.coordination.validity_s.map(Span::from_secs),
        between: file.coordination.between,
        talk,
        vehicles: vehicles.into_iter().collect::<Option<Vec<_>>>()?,
        links,
        switching,
        medium,
    };
    Some(mission)
}

fn is_name(text: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    !text.is_empty() && text.len() <= 32 && text.chars().all(plain)
}

pub(super) fn check_name(faults: &mut Collector<'_>, key: &str, text: &str) {
    if !is_name(text) {
        faults.fault(key, format!("{text:?}"), "1 to 32 of a-z, 0-9, - and _");
    }
}

fn check_ids(faults: &mut Collector<'_>, vehicles: &[VehicleSection]) -> HashMap<String, usize> {
    let mut ids = HashMap::new();
    if vehicles.is_empty() || vehicles.len() > MOST_VEHICLES {
        faults.fault("vehicles", format!("{} vehicles", vehicles.len()), format!("1 to {MOST_VEHICLES}"));
    }
    for (i, vehicle) in vehicles.iter().enumerate() {
        let key = format!("vehicles[{i}].id");
        check_name(faults, &key, &vehicle.id);
        if ["mission-control", "network-emulator", "operator"].contains(&vehicle.id.as_str()) {
            faults.fault(&key, format!("{:?}", vehicle.id), "a name that is not one of the programs'");
        }
        if let Some(first) = ids.insert(vehicle.id.clone(), i) {
            let found = format!("{:?}, which is vehicles[{first}] too", vehicle.id);
            faults.fault(&key, found, "a name that no other vehicle has");
            faults.links_in_doubt = true;
        }
    }
    ids
}

pub(super) fn resolve(
    faults: &mut Collector<'_>,
    key: &str,
    pair: &[String; 2],
    ids: &HashMap<String, usize>,
) -> Option<(usize, usize)> {
    let mut one = |id: &String| {
        let index = ids.get(id).copied();
        if index.is_none() {
            let mut known: Vec<&str> = ids.keys().map(String::as_str).collect();
            known.sort_unstable();
            faults.fault(key, format!("{id:?}, which is no vehicle"), known.join(", "));
        }
        index
    };
    let (a, b) = (one(&pair[0]), one(&pair[1]));
    let (a, b) = (a?, b?);
    if a == b {
        faults.fault(key, format!("a link from {} to itself", pair[0]), "two different vehicles");
        return None;
    }
    Some((a, b))
}

#[cfg(test)]
mod tests {
    use super::super::Mission;

    const HELIX: &str = include_str!("../../../../missions/auv-helix.toml");
    const FIG_3_7: &str = include_str!("../../../../missions/thesis/fig-3-7.toml");

    /// What the check says of a mission file, one fault a line.
    fn faults(text: &str) -> Vec<String> {
        Mission::parse("m.toml", text)
            .err()
            .map_or(Vec::new(), |faults| faults.to_string().lines().map(str::to_string).collect())
    }

    /// What it says of the flagship with one thing replaced.
    fn faults_with(old: &str, new: &str) -> Vec<String> {
        assert!(HELIX.contains(old), "{old:?} is not in the mission");
        faults(&HELIX.replacen(old, new, 1))
    }

    #[test]
    fn every_mission_of_the_project_can_be_flown() {
        for (name, text) in [
            ("auv-helix", HELIX),
            ("fig-1-9", include_str!("../../../../missions/thesis/fig-1-9.toml")),
            ("fig-1-10", include_str!("../../../../missions/thesis/fig-1-10.toml")),
            ("fig-3-7", FIG_3_7),
            ("prop-3-2", include_str!("../../../../missions/thesis/prop-3-2.toml")),
            ("prop-3-3", include_str!("../../../../missions/thesis/prop-3-3.toml")),
            ("waypoints", include_str!("../../../../missions/waypoints.toml")),
            ("fig-3-9", include_str!("../../../../missions/thesis/fig-3-9.toml")),
            ("fig-4-2", include_str!("../../../../missions/thesis/fig-4-2.toml")),
            ("event-triggered", include_str!("../../../../missions/talk/event-triggered.toml")),
            ("bounded", include_str!("../../../../missions/talk/bounded.toml")),
            ("naive", include_str!("../../../../missions/talk/naive.toml")),
            ("known-delay", include_str!("../../../../missions/talk/known-delay.toml")),
            ("estimated-speed", include_str!("../../../../missions/talk/estimated-speed.toml")),
        ] {
            let mission = Mission::parse(name, text).unwrap_or_else(|faults| panic!("{faults}"));
            assert_eq!(mission.name, name);
        }
    }

    #[test]
    fn the_initial_target_is_the_closest_point_in_the_plane() {
        // Erratum 4.23.
        let mission = Mission::parse("m.toml", HELIX).expect("sound");
        for (vehicle, gamma) in mission.vehicles.iter().zip([79.517, 70.483, 65.596]) {
            assert!((vehicle.start.xi - gamma).abs() < 1e-3, "{} starts at {}", vehicle.id, vehicle.start.xi);
        }
    }

    #[test]
    fn the_digest_is_of_the_text() {
        let parse = |text: &str| Mission::parse("m.toml", text).expect("sound").digest;
        assert_eq!(parse(HELIX), parse(HELIX));
        assert_ne!(parse(HELIX), parse(&HELIX.replace("seed = 1", "seed = 2")));
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_what_is_allowed() {
        let found = faults_with("z0_m = -5.0", "z0 = -5.0");
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("m.toml:38: vehicles[1].path.helix.z0: found an unknown key; allowed: "),
            "{}",
            found[0]
        );
        assert!(found[0].contains("z0_m"));
    }

    #[test]
    fn each_fault_names_its_key() {
        for (old, new, key) in [
            ("duration_s = 800.0", "duration_s = -1", "duration_s"),
            ("duration_s = 800.0", "duration_s = \"long\"", "duration_s"),
            ("control_period_s = 0.05", "control_period_s = 0.0", "clock.control_period_s"),
            ("message_period_s = 0.1", "message_period_s = 0.07", "coordination.message_period_s"),
            ("validity_s = 0.3", "validity_s = 0.01", "coordination.validity_s"),
            ("gain = 0.1", "gain = -0.1", "coordination.law.delayed_with_losses"),
            ("between = \"align\"", "between = \"guess\"", "coordination.between"),
            ("up_for_s = 2.5", "up_for_s = 20.0", "network.switching.periodic.up_for_s"),
            (
                "delay = { constant = { delay_s = 5.0 } }",
                "loss = { bernoulli = { probability = 1.5 } }",
                "network.loss.bernoulli.probability",
            ),
            ("id = \"auv2\"", "id = \"auv1\"", "vehicles[1].id"),
            ("id = \"auv2\"", "id = \"AUV 2\"", "vehicles[1].id"),
            ("[\"auv2\", \"auv3\"]", "[\"auv2\", \"auv9\"]", "network.links[1]"),
            (", [\"auv2\", \"auv3\"]", "", "network.links"),
            ("kind = \"II\"", "delta1_mps = 0.3", "fleet.following"),
            ("{ underactuated_auv = \"sirene\" }", "\"kinematic_unicycle\"", "fleet.following"),
            ("delayed_with_losses = { gain = 0.1, delay_s = 5.0 }", "solution1 = { a = 1.0 }", "coordination.law"),
            ("speed = 0.5", "", "formation"),
            ("start = { x_m = 5.0, y_m = -10.0, z_m = -5.0 }", "", "vehicles[0]"),
        ] {
            let found = faults_with(old, new);
            assert!(found.iter().any(|line| line.contains(&format!(": {key}"))), "{new:?}: {found:?}");
        }
    }

    #[test]
    fn a_delta_too_small_is_told_with_its_key_its_vehicle_and_both_ways_out() {
        let found = faults_with("speed = 0.5", "speed = 5.0");
        let fault = found.iter().find(|fault| fault.contains("auv1")).unwrap_or_else(|| panic!("{found:?}"));
        for part in
            ["fleet.following.theorem47.delta1_mps: found -0.3 m/s for auv1", "v_L = 5 /s", "delta1_mps below -0."]
        {
            assert!(fault.contains(part), "{fault}");
        }
        // What is proposed is allowed.
        let after =
            |text: &str| fault.split(text).nth(1).and_then(|rest| rest.split([',', ' ']).next()).expect("there");
        let slower = format!("speed = {}", after("formation speed below "));
        assert_eq!(faults_with("speed = 0.5", &slower), Vec::<String>::new());
        let more = format!("kind = \"II\", delta1_mps = {}1", after("delta1_mps below "));
        let faster = HELIX.replacen("speed = 0.5", "speed = 5.0", 1).replacen("kind = \"II\"", &more, 1);
        assert_eq!(faults(&faster), Vec::<String>::new());
    }

    #[test]
    fn event_triggers_that_make_no_sense_are_refused() {
        let text = include_str!("../../../../missions/talk/event-triggered.toml");
        for (old, new, key) in [
            ("threshold = 0.02", "threshold = 0.0", "coordination.talk.event_triggered"),
            ("jitter = 0.5", "jitter = 1.0", "coordination.talk.event_triggered"),
            ("patience_s = 1.5", "patience_s = -1.5", "coordination.talk.event_triggered.patience_s"),
            ("most_silence_s = 30.0", "most_silence = 30.0", "coordination.talk.event_triggered.most_silence"),
            ("between =", "validity_s = 30.0\nbetween =", "coordination.validity_s"),
            ("switching = { gain = 0.1 }", "solution1 = { a = 1.0 }", "coordination.talk"),
            (
                "switching = { gain = 0.1 }",
                "known_delay = { gain = 0.1, longest_s = 1e6 }",
                "coordination.law.known_delay",
            ),
        ] {
            let found = faults(&text.replacen(old, new, 1));
            assert!(found.iter().any(|line| line.contains(&format!(": {key}"))), "{new:?}: {found:?}");
        }
        let found = faults(&text.replace("most_silence_s = 30.0", "").replace("patience_s = 1.5", ""));
        assert!(found.iter().any(|line| line.contains("silent for ever")), "{found:?}");
    }

    #[test]
    fn a_corner_is_refused_for_a_law_that_needs_a_smooth_path() {
        let text = FIG_3_7.replacen("{ line = { length_m = 3.0 } },", "{ corner = { turn_deg = 30.0 } },", 1);
        let found = faults(&text);
        assert!(
            found.iter().any(|line| line.contains("whose direction jumps") && line.contains("proposition31")),
            "{found:?}"
        );
    }

    #[test]
    fn a_law_that_does_not_fit_names_both_sides() {
        let found = faults_with("{ theorem47 = { kind = \"II\" } }", "{ proposition31 = {} }");
        assert!(found.iter().any(|l| l.contains("proposition31 with underactuated_auv")), "{found:?}");
    }

    #[test]
    fn laws_of_other_vehicles_and_waypoints_that_are_no_path_are_refused() {
        let marine = include_str!("../../../../missions/thesis/prop-3-3.toml");
        let lanes = include_str!("../../../../missions/waypoints.toml");
        for (text, old, new, expected) in [
            (marine, "{ marine_vehicle = {} }", "{ dynamic_unicycle = {} }", "proposition33 with dynamic_unicycle"),
            (
                marine,
                "{ proposition33 = { slip_deg = 20.0 } }",
                "{ proposition31 = {} }",
                "proposition31 with marine_vehicle",
            ),
            (marine, "slip_deg = 20.0", "k_slip = 0.0", "vehicles[1].following: found the gain of the side-slip"),
            (
                marine,
                "{ marine_vehicle = {} }",
                "{ marine_vehicle = { mass_v_kg = 0.0 } }",
                "found m_v must be positive",
            ),
            (FIG_3_7, "{ proposition31 = {} }", "{ proposition33 = {} }", "allowed: proposition31, proposition32"),
            (HELIX, "gain = 0.1,", "gain = -0.1,", "coordination.law.delayed_with_losses.gain: found the gain k must"),
            (FIG_3_7, "b = 0.25,", "b = 0.0,", "coordination.law.solution3.b: found the gain b must be positive"),
            (
                FIG_3_7,
                "x_m = 1.0 } }   #",
                "x_m = 0.0 } }   #",
                "coordination.law.solution3: found the saturation x_m must",
            ),
            (lanes, "xi = [0, 31,", "xi = [0, 0,", "vehicles[0].path.geojson: found the step of xi after waypoint 0"),
            (lanes, "xi = [0, 31,", "rate_m = 1.0\nxi = [0, 31,", "both rate_m and xi"),
            (lanes, "latitude_deg = 38.689", "latitude_deg = 138.0", "longitude first"),
            (lanes, "\"LineString\"", "\"Point\"", "vehicles[0].path.geojson: found not GeoJSON"),
            (
                lanes,
                "{ underactuated_auv = \"sirene\" }",
                "{ dynamic_unicycle = {} }",
                "theorem47 with dynamic_unicycle",
            ),
        ] {
            assert!(text.contains(old), "{old}");
            let found = faults(&text.replacen(old, new, 1));
            assert!(found.iter().any(|line| line.contains(expected)), "{new}: {found:?}");
        }
    }

    #[test]
    fn several_faults_are_reported_together_in_the_order_of_the_file() {
        let text = HELIX
            .replace("duration_s = 800.0", "duration_s = 0")
            .replace("up_for_s = 2.5", "up_for_s = -1")
            .replace("id = \"auv3\"", "id = \"auv1\"")
            .replace(
                "climb_m = 0.05, phase_deg = -135.0, z0_m = 0.0",
                "climb = 0.05, phase_deg = -135.0, z0_m = 0.0, climb_m = 0.05",
            );
        let found = faults(&text);
        for key in ["duration_s", "up_for_s", "vehicles[2].id", "vehicles[2].path.helix.climb"] {
            assert!(found.iter().any(|line| line.contains(key)), "{key}: {found:?}");
        }
        let lines: Vec<usize> = found.iter().filter_map(|l| l.split(':').nth(1)?.parse().ok()).collect();
        assert!(lines.is_sorted(), "{found:?}");
    }

    #[test]
    fn what_cannot_be_read_hides_nothing_else() {
        let text = HELIX
            .replace("duration_s = 800.0", "duration_s = -3")
            .replace("seed = 1", "seed = -1")
            .replace("speed = 0.5", "speed = \"fast\"")
            .replace("gain = 0.1, delay_s = 5.0", "gain = 0.1, delay_s = -1.0")
            .replace("validity_s = 0.3", "validity_s = 0.01")
            .replace("id = \"auv3\"", "id = \"auv1\"")
            .replacen("radius_m = 20.0", "radius_m = -20.0", 1)
            .replacen("lap = 400.0", "laps = 400.0", 1)
            .replace("x_m = 5.0, y_m = -20.0, z_m = 5.0", "x_m = true, y_m = -20.0, z_m = 1e99");
        let found = faults(&text);
        for expected in [
            "m.toml:6: seed: found -1; allowed: an integer from 0 to 9223372036854775807: Seed of every random stream",
            "formation.speed: found a string; allowed: a number: Formation speed v_L",
            "duration_s: found -3; ",
            "delayed_with_losses.delay_s: found -1; allowed: 0 to 3600 s",
            "coordination.validity_s: found 0.01; ",
            "vehicles[2].id: found \"auv1\", which is vehicles[0] too",
            "vehicles[0].path.helix.radius_m: found -20; ",
            "vehicles[0].path.helix.laps: found an unknown key; ",
            "vehicles[0].path.helix: found no lap; allowed: a number: One lap",
            "vehicles[2].start.x_m: found a boolean; allowed: a number: East (m)",
            "vehicles[2].start.z_m: found 1e99; ",
        ] {
            assert!(found.iter().any(|line| line.contains(expected)), "{expected}: {found:#?}");
        }
        // A link to auv3, which is auv1 now; all else would be a consequence of a stand-in.
        assert_eq!(found.len(), 12, "{found:#?}");
        assert!(!found.iter().any(|line| line.contains("stand-in")), "{found:#?}");
    }

    #[test]
    fn a_fault_that_only_follows_from_another_is_not_told() {
        for (old, new, key) in [
            ("[\"auv2\", \"auv3\"]", "[\"auv2\", \"auv9\"]", "network.links[1]: found \"auv9\", which is no vehicle"),
            ("id = \"auv2\"", "id = 2", "vehicles[1].id: found an integer; "),
            ("control_period_s = 0.05", "control_period_s = \"x\"", "clock.control_period_s: found a string; "),
            ("period_s = 10.0", "period_s = []", "network.switching.periodic.period_s: found an array; "),
            ("law = { delayed_with_losses", "law = { delayed_with_loses", "coordination.law.delayed_with_loses: "),
            ("{ underactuated_auv = \"sirene\" }", "\"submarine\"", "fleet.model: found \"submarine\"; "),
            ("start = { x_m = 5.0, y_m = -10.0, z_m = -5.0 }", "", "vehicles[0]: found no start; "),
            ("[[\"auv1\", \"auv2\"], ", "[[\"auv1\"], ", "network.links[0]: found 1 value; allowed: 2 values"),
            ("path = { helix = ", "path = { spiral = ", "vehicles[0].path.spiral: found \"spiral\"; allowed: chain, "),
            ("duration_s = 800.0", "duration_s = 1e999", "duration_s: found 1e999; allowed: a number: "),
            ("seed = 1", "seed = 99999999999999999999999999", "seed: found a number of 26 digits; "),
        ] {
            let found = faults_with(old, new);
            assert!(found.len() == 1 && found[0].contains(key), "{new}: {found:#?}");
        }
    }

    #[test]
    fn what_is_made_up_is_not_blamed() {
        let begin = HELIX.find("[[vehicles]]").expect("vehicles");
        for vehicles in ["", "vehicles = 3\n"] {
            let text = format!("{vehicles}{}", &HELIX[..begin].replace("gain = 0.1", "gain = 0.0"));
            let found = faults(&text);
            let expected = if vehicles.is_empty() { "found no vehicles; " } else { "vehicles: found an integer; " };
            assert!(found.iter().any(|line| line.contains(expected)), "{found:#?}");
            assert!(found.iter().any(|line| line.contains("delayed_with_losses.gain: found ")), "{found:#?}");
            assert_eq!(found.len(), 2, "{found:#?}");
        }
    }

    #[test]
    fn what_is_no_toml_is_refused_with_its_line() {
        let found = faults("name = \"x\"\nseed = = 3\n");
        assert!(found[0].starts_with("m.toml:2:"), "{found:?}");
    }
}
