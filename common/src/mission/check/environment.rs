//! Disturbances and limits of one vehicle.

use nalgebra::Vector3;

use super::super::fault::Collector;
use super::super::file::{FailureChoice, LimitsSection, MissionFile, ModelChoice, NoiseSection};
use super::LONGEST;
use super::vehicle::model_name;
use crate::craft::Limits;
use crate::time::Time;
use crate::vehicle::environment::{Current, Disturbances, NoiseLevels, StuckSpeed, Tide};

/// Fastest water, and largest errors of instruments, in m/s, m, deg and deg/s: beyond it a number is a slip of the pen.
pub(super) const LARGEST: f64 = 1e4;

/// What disturbs a vehicle: its own keys, or the fleet's. Faults are noted at the key where they are written.
pub(super) fn check_disturbances(faults: &mut Collector<'_>, file: &MissionFile, index: usize) -> Disturbances {
    let own = &file.vehicles[index];
    let key = |is_own: bool, name: &str| {
        if is_own { format!("vehicles[{index}].{name}") } else { format!("fleet.{name}") }
    };
    let mut disturbances = Disturbances::default();
    if let Some(section) = own.current.or(file.fleet.current) {
        let key = key(own.current.is_some(), "current");
        vector(faults, &format!("{key}.velocity_mps"), section.velocity_mps);
        let tide = section.tide.map(|tide| {
            vector(faults, &format!("{key}.tide.amplitude_mps"), tide.amplitude_mps);
            let period_ok = tide.period_s > 0.0 && tide.period_s <= LONGEST;
            faults.number(&format!("{key}.tide.period_s"), tide.period_s, period_ok, "above 0 and at most 2592000 s");
            faults.finite(&format!("{key}.tide.phase_deg"), tide.phase_deg, "deg");
            let (amplitude, phase) = (Vector3::from(tide.amplitude_mps), tide.phase_deg.to_radians());
            Tide { amplitude, period: tide.period_s, phase }
        });
        disturbances.current = Some(Current { mean: section.velocity_mps.into(), tide });
    }
    if let Some(section) = own.noise.or(file.fleet.noise) {
        let NoiseSection { position_m, heading_deg, speed_mps, turn_rate_degps } = section;
        let key = key(own.noise.is_some(), "noise");
        for (name, level, unit) in [
            ("position_m", position_m, "m"),
            ("heading_deg", heading_deg, "deg"),
            ("speed_mps", speed_mps, "m/s"),
            ("turn_rate_degps", turn_rate_degps, "deg/s"),
        ] {
            let allowed = format!("0 to {LARGEST} {unit}");
            faults.number(&format!("{key}.{name}"), level, (0.0..=LARGEST).contains(&level), &allowed);
        }
        let (heading, turn_rate) = (heading_deg.to_radians(), turn_rate_degps.to_radians());
        disturbances.noise = Some(NoiseLevels { position: position_m, heading, speed: speed_mps, turn_rate });
    }
    if let Some(FailureChoice::SpeedStuck(stuck)) = own.failure.or(file.fleet.failure) {
        let key = format!("{}.speed_stuck", key(own.failure.is_some(), "failure"));
        let ok = stuck.speed_mps.abs() <= LARGEST;
        faults.number(&format!("{key}.speed_mps"), stuck.speed_mps, ok, &format!("{} to {LARGEST} m/s", -LARGEST));
        let ok = (0.0..=LONGEST).contains(&stuck.from_s);
        faults.number(&format!("{key}.from_s"), stuck.from_s, ok, "0 to 2592000 s");
        let to = stuck.to_s.unwrap_or(LONGEST + 1.0);
        if let Some(to) = stuck.to_s {
            let ok = to > stuck.from_s && to <= LONGEST;
            faults.number(&format!("{key}.to_s"), to, ok, "later than from_s; leave it out for ever");
        }
        let (from, to) =
            (Time::from_secs(stuck.from_s.clamp(0.0, LONGEST)), Time::from_secs(to.clamp(0.0, 2.0 * LONGEST)));
        disturbances.stuck = Some(StuckSpeed { speed: stuck.speed_mps, from, to });
    }
    disturbances
}

fn vector(faults: &mut Collector<'_>, key: &str, values: [f64; 3]) {
    for (i, value) in values.iter().enumerate() {
        let allowed = format!("{} to {LARGEST} m/s", -LARGEST);
        faults.number(&format!("{key}[{i}]"), *value, value.abs() <= LARGEST, &allowed);
    }
}

/// What the actuators of a vehicle give at most; a limit of what its model does not have is refused.
pub(super) fn check_limits(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    index: usize,
    model: &ModelChoice,
) -> Limits {
    let own = &file.vehicles[index];
    let Some(section) = own.limits.or(file.fleet.limits) else { return Limits::NONE };
    let key = if own.limits.is_some() { format!("vehicles[{index}].limits") } else { "fleet.limits".to_string() };
    let LimitsSection { force_n, torque_nm, acceleration_mps2, turn_rate_degps } = section;
    let kinematic = matches!(model, ModelChoice::KinematicUnicycle);
    let allowed = if kinematic { "acceleration_mps2 and turn_rate_degps" } else { "force_n and torque_nm" };
    let mut limit = |name: &str, value: Option<f64>, is_of_model: bool, unit: &str| {
        let Some(value) = value else { return f64::INFINITY };
        if !is_of_model {
            faults.fault(&format!("{key}.{name}"), format!("{name} for a {}", model_name(model)), allowed);
        }
        faults.positive(&format!("{key}.{name}"), value, unit);
        value
    };
    Limits {
        force: limit("force_n", force_n, !kinematic, "N"),
        torque: limit("torque_nm", torque_nm, !kinematic, "N m"),
        acceleration: limit("acceleration_mps2", acceleration_mps2, kinematic, "m/s²"),
        turn_rate: limit("turn_rate_degps", turn_rate_degps, kinematic, "deg/s").to_radians(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::Mission;
    use crate::time::Time;

    const HELIX: &str = include_str!("../../../../missions/auv-helix.toml");
    const LINES: &str = include_str!("../../../../missions/thesis/fig-1-9.toml");

    fn fleet(text: &str, keys: &str) -> Result<Mission, String> {
        let with = text.replacen("[fleet]\n", &format!("[fleet]\n{keys}\n"), 1);
        assert_ne!(with, text, "the mission has a section [fleet]");
        Mission::parse("m.toml", &with).map_err(|faults| faults.to_string())
    }

    #[test]
    fn without_keys_nothing_disturbs() {
        let mission = fleet(HELIX, "").expect("sound");
        assert!((0..3).all(|vehicle| mission.environment(vehicle).is_none()));
    }

    #[test]
    fn a_vehicle_takes_what_it_says_itself_and_the_rest_from_the_fleet() {
        let keys = "current = { velocity_mps = [0.1, 0.0, 0.0] }\nfailure = { speed_stuck = { speed_mps = 0.1 } }";
        let text = HELIX.replacen(
            "id = \"auv2\"\n",
            "id = \"auv2\"\ncurrent = { velocity_mps = [0.0, 0.2, 0.0] }\nnoise = { position_m = 0.5 }\n",
            1,
        );
        let mission = fleet(&text, keys).expect("sound");
        let at = |vehicle, t| {
            let mut environment = mission.environment(vehicle).expect("disturbed");
            environment.conditions(Time::from_secs(t), 1)
        };
        assert_eq!((at(0, 0.0).current.expect("flows").x, at(0, 0.0).errors), (0.1, None));
        assert_eq!(at(1, 0.0).current.expect("flows").y, 0.2);
        assert!(at(1, 0.0).errors.expect("noise").position.norm() > 0.0);
        // Without an end the failure lasts.
        assert_eq!([at(0, 0.0).stuck_speed, at(2, 2e6).stuck_speed], [Some(0.1), Some(0.1)]);
    }

    #[test]
    fn what_is_out_of_range_is_refused_with_its_key() {
        for (keys, expected) in [
            ("current = { velocity_mps = [0.1, inf, 0.0] }", "fleet.current.velocity_mps[1]"),
            (
                "current = { velocity_mps = [0, 0, 0], tide = { amplitude_mps = [0, 0, 0], period_s = 0 } }",
                "fleet.current.tide.period_s",
            ),
            ("noise = { heading_deg = -1.0 }", "fleet.noise.heading_deg"),
            ("noise = { heading = 1.0 }", "fleet.noise.heading"),
            (
                "failure = { speed_stuck = { speed_mps = 0.1, from_s = 5.0, to_s = 5.0 } }",
                "fleet.failure.speed_stuck.to_s",
            ),
            ("failure = { speed_stuck = { speed_mps = nan } }", "fleet.failure.speed_stuck.speed_mps"),
            ("limits = { force_n = 0.0 }", "fleet.limits.force_n"),
            (
                "limits = { turn_rate_degps = 9.0 }",
                "fleet.limits.turn_rate_degps: found turn_rate_degps for a underactuated_auv",
            ),
        ] {
            let faults = fleet(HELIX, keys).expect_err(keys);
            assert!(faults.contains(expected), "{keys}: {faults}");
        }
        let faults = fleet(LINES, "limits = { force_n = 1.0, turn_rate_degps = 9.0 }").expect_err("no force");
        assert!(faults.contains("allowed: acceleration_mps2 and turn_rate_degps"), "{faults}");
        assert!(fleet(LINES, "limits = { acceleration_mps2 = 1.0, turn_rate_degps = 9.0 }").is_ok());
    }
}
