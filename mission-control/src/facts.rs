//! What a mission tells the report beforehand: names, paths, and what theory predicts.

use common::mission::Mission;
use common::mission::file::{FollowingChoice, LawChoice, MissionFile, ModelChoice, PathChoice, SwitchingChoice};
use common::record::Record;
use common::time::Time;
use common::wire::vehicle::SpeedCommand;

use crate::results::{Facts, VehicleFacts, Way};
use crate::theory;

/// Points of a planned path in a figure.
const PATH_POINTS: u32 = 300;

/// The facts of a mission that is flown at the speeds of its file.
pub fn facts(mission: &Mission) -> Facts {
    facts_at(mission, mission.speed.at(mission.end).v_l)
}

/// The formation speed in force at an instant of a recorded flight. A command replaces what the file plans for later.
pub fn speed_in_force(mission: &Mission, exact: &[Record], t: Time) -> f64 {
    let rows = exact.iter().filter_map(|record| match record {
        Record::Speed(row) => Some(SpeedCommand { at: Time::from_nanos(row.t_ns), speed: row.speed }),
        _ => None,
    });
    mission.speed.as_recorded(&rows.collect::<Vec<_>>()).at(t).v_l
}

/// The formation speeds that were commanded in a recorded flight, in order of time: from when on \[s\], and what. Those that its file
/// plans are none.
pub fn commanded(mission: &Mission, exact: &[Record]) -> Vec<(f64, f64)> {
    let planned = mission.speed.steps();
    let rows = exact.iter().filter_map(|row| match row {
        Record::Speed(row) if !planned.iter().any(|step| (step.at.nanos(), step.speed) == (row.t_ns, row.speed)) => {
            Some((row.t_ns as f64 / 1e9, row.speed))
        }
        _ => None,
    });
    let mut commanded: Vec<(f64, f64)> = rows.collect();
    commanded.sort_by(|a, b| a.0.total_cmp(&b.0));
    commanded
}

/// The facts of a mission at whose end this formation speed was in force.
pub fn facts_at(mission: &Mission, v_l: f64) -> Facts {
    // The mission was made from this text, so it can be read again.
    let file: Option<MissionFile> = toml::from_str(&mission.text).ok();
    let name = |i: usize| mission.vehicles[i].id.clone();
    let guarantee = theory::guarantee(mission);
    let biases = theory::predicted_biases(mission, v_l);
    Facts {
        mission: mission.name.clone(),
        description: mission.about.clone(),
        vehicles: (0..mission.vehicles.len()).map(|i| vehicle(mission, file.as_ref(), i, biases[i])).collect(),
        links: mission.links.iter().map(|link| (name(link.from), name(link.to))).collect(),
        message_bytes: (0..mission.vehicles.len()).map(|i| bytes_on_air(mission, i)).max().unwrap_or(0),
        duration_s: mission.end.secs(),
        planned_s: mission.end.secs(),
        commanded: Vec::new(),
        control_period_s: mission.control_period.secs(),
        validity_s: mission.validity.map(|validity| validity.secs()),
        link_period_s: file.as_ref().and_then(period_of),
        guaranteed_rate: guarantee.map(|g| g.rate),
        least_rate: theory::least_rate(mission),
        guaranteed_factor: guarantee.and_then(|g| g.factor),
        formation_speed_at_the_end: Some(v_l),
        predicted_speed: theory::predicted_speed(mission, v_l),
        symbol: if is_chapter_4(mission) { "γ".to_string() } else { "ξ".to_string() },
        xi_unit: String::new(),
        spatial: mission.vehicles.iter().any(|v| matches!(v.model, ModelChoice::UnderactuatedAuv(_))),
        missing: Vec::new(),
        aborted: Vec::new(),
        graph: Some(theory::graph_facts(mission)),
    }
}

/// The period of the mission's switching network \[s\], if it has one.
pub(crate) fn link_period(mission: &Mission) -> Option<f64> {
    let file: MissionFile = toml::from_str(&mission.text).ok()?;
    period_of(&file).filter(|_| file.network.also.is_empty())
}

fn period_of(file: &MissionFile) -> Option<f64> {
    match &file.network.switching {
        SwitchingChoice::Periodic(periodic) => Some(periodic.period_s),
        SwitchingChoice::Intervals(intervals) => intervals.period_s,
        _ => None,
    }
}

fn is_chapter_4(mission: &Mission) -> bool {
    matches!(
        mission.law_choice,
        LawChoice::Switching(_)
            | LawChoice::Delayed(_)
            | LawChoice::DelayedWithLosses(_)
            | LawChoice::Auxiliary(_)
            | LawChoice::AuxiliarySwitching(_)
            | LawChoice::DelayedEstimating(_)
            | LawChoice::KnownDelay(_)
    )
}

fn vehicle(mission: &Mission, file: Option<&MissionFile>, index: usize, bias: Option<f64>) -> VehicleFacts {
    let plan = &mission.vehicles[index];
    let travelled = mission.nominal_factor() * mission.speed.distance(mission.end);
    let (from, to) = (plan.start.xi.min(plan.start.xi + travelled), plan.start.xi.max(plan.start.xi + travelled));
    let planned = (0..=PATH_POINTS)
        .map(|i| plan.path.at(from + (to - from) * f64::from(i) / f64::from(PATH_POINTS)).p.into())
        .collect();
    let path = file.and_then(|file| file.vehicles.get(index)).map_or("", |section| match section.path {
        PathChoice::Line(_) => "line",
        PathChoice::Circle(_) => "circle",
        PathChoice::Sinusoid(_) => "sinusoid",
        PathChoice::Chain(_) => "lines and arcs",
        PathChoice::Helix(_) => "helix",
        PathChoice::Spline(_) => "spline",
        PathChoice::Geojson(_) => "waypoints",
    });
    // A target of Theorem 4.7 moves just as coordination tells it; all others move with their vehicles.
    let goes_along = !matches!(plan.following, FollowingChoice::Theorem47(_));
    VehicleFacts {
        way: Way(goes_along.then(|| plan.path.clone())),
        id: plan.id.clone(),
        pattern: plan.pattern,
        path: path.to_string(),
        planned,
        message_bytes: Some(bytes_on_air(mission, index)),
        predicted_along_bias_m: bias,
    }
}

/// Size of a message as the medium packs it, or its own.
fn bytes_on_air(mission: &Mission, vehicle: usize) -> u64 {
    let packed = mission.medium.as_ref().and_then(|medium| medium.packet);
    packed.unwrap_or_else(|| mission.message_bytes(vehicle)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use common::record::SpeedRow;

    #[test]
    fn a_command_is_in_force_until_the_end_and_theory_speaks_of_it() {
        let text = include_str!("../../missions/auv-helix.toml");
        let mission = Mission::parse("m.toml", text).unwrap_or_else(|faults| panic!("{faults}"));
        let row = |t_s: f64, speed| Record::Speed(SpeedRow { t_ns: Time::from_secs(t_s).nanos(), speed });
        let rows = [row(0.0, 0.5), row(700.0, 0.4), row(300.0, 0.2)];
        assert_eq!(speed_in_force(&mission, &rows, Time::from_secs(299.0)), 0.5);
        assert_eq!(speed_in_force(&mission, &rows, mission.end), 0.4);
        // v_L* = v_L/(1 + kτ) with kτ = 1/2.
        let predicted = facts_at(&mission, 0.4).predicted_speed.expect("theory has a word on it");
        assert!((predicted - 0.4 / 1.5).abs() < 1e-12, "{predicted}");
        assert_eq!(facts(&mission).formation_speed_at_the_end, Some(0.5));
    }

    #[test]
    fn a_command_replaces_what_the_file_plans_for_later() {
        let text = include_str!("../../missions/auv-helix.toml");
        let mut mission = Mission::parse("m.toml", text).unwrap_or_else(|faults| panic!("{faults}"));
        let step = |at_s, speed| SpeedCommand { at: Time::from_secs(at_s), speed };
        mission.speed = common::mission::SpeedProfile::new(vec![step(0.0, 0.5), step(500.0, 0.3)]);
        let row = |t_s: f64, speed| Record::Speed(SpeedRow { t_ns: Time::from_secs(t_s).nanos(), speed });
        let rows = [row(0.0, 0.5), row(500.0, 0.3)];
        assert_eq!(speed_in_force(&mission, &rows, mission.end), 0.3);
        let rows = [row(0.0, 0.5), row(500.0, 0.3), row(100.0, 0.1)];
        assert_eq!(speed_in_force(&mission, &rows, mission.end), 0.1);
    }
}
