//! What a mission tells the report beforehand: names, paths, and what theory predicts.

use common::mission::Mission;
use common::mission::file::{LawChoice, MissionFile, ModelChoice, PathChoice, SwitchingChoice};

use crate::results::{Facts, VehicleFacts};
use crate::theory;

/// Points of a planned path in a figure.
const PATH_POINTS: u32 = 300;

/// The facts of a mission.
pub fn facts(mission: &Mission) -> Facts {
    // The mission was made from this text, so it can be read again.
    let file: Option<MissionFile> = toml::from_str(&mission.text).ok();
    let name = |i: usize| mission.vehicles[i].id.clone();
    let guarantee = theory::guarantee(mission);
    Facts {
        mission: mission.name.clone(),
        description: mission.about.clone(),
        vehicles: (0..mission.vehicles.len()).map(|i| vehicle(mission, file.as_ref(), i)).collect(),
        links: mission.links.iter().map(|link| (name(link.from), name(link.to))).collect(),
        message_bytes: (0..mission.vehicles.len()).map(|i| bytes_on_air(mission, i)).max().unwrap_or(0),
        duration_s: mission.end.secs(),
        control_period_s: mission.control_period.secs(),
        link_period_s: file.as_ref().and_then(|file| match &file.network.switching {
            SwitchingChoice::Periodic(periodic) => Some(periodic.period_s),
            SwitchingChoice::Intervals(intervals) => intervals.period_s,
            _ => None,
        }),
        guaranteed_rate: guarantee.map(|g| g.rate),
        guaranteed_factor: guarantee.and_then(|g| g.factor),
        predicted_speed: mission
            .excited_speed()
            .or_else(|| Some(theory::speed_factor(mission)? * mission.speed.at(mission.end).v_l)),
        predicted_along_bias_m: mission.predicted_along_bias(0),
        symbol: if is_chapter_4(mission) { "γ".to_string() } else { "ξ".to_string() },
        xi_unit: String::new(),
        spatial: mission.vehicles.iter().any(|v| matches!(v.model, ModelChoice::UnderactuatedAuv(_))),
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

fn vehicle(mission: &Mission, file: Option<&MissionFile>, index: usize) -> VehicleFacts {
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
    VehicleFacts {
        id: plan.id.clone(),
        pattern: plan.pattern,
        path: path.to_string(),
        planned,
        message_bytes: Some(bytes_on_air(mission, index)),
    }
}

/// Size of a message as the medium packs it, or its own.
fn bytes_on_air(mission: &Mission, vehicle: usize) -> u64 {
    let packed = mission.medium.as_ref().and_then(|medium| medium.packet);
    packed.unwrap_or_else(|| mission.message_bytes(vehicle)) as u64
}
