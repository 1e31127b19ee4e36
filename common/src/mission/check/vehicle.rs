//! One vehicle: whether plant, path-following law, coordination law and path fit together.

use nalgebra::Vector3;

use super::super::fault::Collector;
use super::super::file::{FollowingChoice, MissionFile, ModelChoice, PathChoice, SegmentChoice, VehicleSection};
use super::super::{Start, VehiclePlan, build};
use crate::coordination::{DemandKind, FleetLaw};
use crate::path::Path;
use crate::path::closest::closest_parameter;

pub(super) fn check_vehicle(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    index: usize,
    law: Option<&dyn FleetLaw>,
    factor: f64,
    fastest: f64,
) -> Option<VehiclePlan> {
    let section = &file.vehicles[index];
    let key = format!("vehicles[{index}]");
    let start = &section.start;
    for (name, value) in [
        ("x_m", start.x_m),
        ("y_m", start.y_m),
        ("z_m", start.z_m),
        ("yaw_deg", start.yaw_deg),
        ("speed_mps", start.speed_mps),
    ] {
        faults.finite(&format!("{key}.start.{name}"), value, "");
    }
    faults.finite(&format!("{key}.pattern"), section.pattern, "units of xi");
    if let Some(xi) = start.xi {
        faults.finite(&format!("{key}.start.xi"), xi, "units of xi");
    }
    let model = section.model.clone().or_else(|| file.fleet.model.clone());
    let following = section.following.clone().or_else(|| file.fleet.following.clone());
    if model.is_none() {
        faults.fault(
            &key,
            "no model",
            "a model here or in [fleet]: kinematic_unicycle, dynamic_unicycle or underactuated_auv",
        );
    }
    if following.is_none() {
        let allowed = "a following law here or in [fleet]: line_of_sight, proposition31 or theorem47";
        faults.fault(&key, "no following", allowed);
    }
    let path = match build::path(&section.path) {
        Ok(path) => path,
        Err(reason) => {
            faults.fault(&format!("{key}.path.{}", path_name(&section.path)), reason, "");
            return None;
        }
    };
    let (model, following) = (model?, following?);
    if !check_fit(faults, &key, section, file, &model, &following, law, path.as_ref()) {
        return None;
    }
    let position = Vector3::new(start.x_m, start.y_m, start.z_m);
    let usable = position.iter().all(|x| x.is_finite());
    let xi = start.xi.or_else(|| usable.then(|| closest_parameter(path.as_ref(), position, true)))?;
    let start = Start { position: position.into(), yaw: start.yaw_deg.to_radians(), speed: start.speed_mps, xi };
    let plan = VehiclePlan { id: section.id.clone(), pattern: section.pattern, path, start, model, following };
    if let Err(reason) = build::craft(&plan, start, factor, fastest, law.map_or(DemandKind::Rate, |law| law.kind())) {
        faults.fault(&following_key(&key, section), reason, "");
        return None;
    }
    Some(plan)
}

/// Where the following law of a vehicle is written.
fn following_key(key: &str, section: &VehicleSection) -> String {
    if section.following.is_some() { format!("{key}.following") } else { "fleet.following".to_string() }
}

fn path_name(path: &PathChoice) -> &'static str {
    match path {
        PathChoice::Line(_) => "line",
        PathChoice::Circle(_) => "circle",
        PathChoice::Sinusoid(_) => "sinusoid",
        PathChoice::Chain(_) => "chain",
        PathChoice::Helix(_) => "helix",
    }
}

/// Whether model, following law, coordination law and path fit together; names both sides of every misfit.
#[expect(clippy::too_many_arguments, reason = "the sides of the fit")]
fn check_fit(
    faults: &mut Collector<'_>,
    key: &str,
    section: &VehicleSection,
    file: &MissionFile,
    model: &ModelChoice,
    following: &FollowingChoice,
    law: Option<&dyn FleetLaw>,
    path: &dyn Path,
) -> bool {
    let (fits, law_of_model) = match (model, following) {
        (ModelChoice::KinematicUnicycle, FollowingChoice::LineOfSight(_))
        | (ModelChoice::DynamicUnicycle(_), FollowingChoice::Proposition31(_))
        | (ModelChoice::UnderactuatedAuv(_), FollowingChoice::Theorem47(_)) => (true, ""),
        (ModelChoice::KinematicUnicycle, _) => (false, "line_of_sight with kinematic_unicycle"),
        (ModelChoice::DynamicUnicycle(_), _) => (false, "proposition31 with dynamic_unicycle"),
        (ModelChoice::UnderactuatedAuv(_), _) => (false, "theorem47 with underactuated_auv"),
    };
    if !fits {
        let found = format!("{} with {}", following_name(following), model_name(model));
        faults.fault(&following_key(key, section), found, law_of_model);
        return false;
    }
    let mut ok = true;
    let takes_acceleration = matches!(model, ModelChoice::DynamicUnicycle(_));
    if let Some(law) = law
        && law.kind() == DemandKind::Acceleration
        && !takes_acceleration
    {
        let found = format!(
            "{}, which gives an acceleration, for {}, whose {} takes a rate",
            build::law_name(&file.coordination.law),
            section.id,
            following_name(following)
        );
        faults.fault(
            "coordination.law",
            found,
            "introduction, switching, delayed or delayed_with_losses for this vehicle",
        );
        ok = false;
    }
    let path_key = format!("{key}.path.{}", path_name(&section.path));
    if let Some(at) = path.tangent_breaks().first() {
        let found = format!("a path whose direction jumps at xi = {at}");
        faults.fault(&path_key, found, format!("a path with a continuous tangent for {}", following_name(following)));
        ok = false;
    }
    if let (FollowingChoice::Theorem47(_), PathChoice::Chain(chain)) = (following, &section.path)
        && chain.segments.iter().any(|segment| matches!(segment, SegmentChoice::Arc(_)))
        && chain.segments.len() > 1
    {
        let allowed = "a path with a continuous curvature for theorem47: line, circle, sinusoid or helix";
        faults.fault(&path_key, "a chain, whose curvature jumps from piece to piece", allowed);
        ok = false;
    }
    if !matches!(model, ModelChoice::UnderactuatedAuv(_)) && !crate::path::shape::is_planar(path) {
        let found = format!("a path that leaves the plane for a {}", model_name(model));
        faults.fault(&path_key, found, "a line, circle, sinusoid or chain");
        ok = false;
    }
    ok
}

fn model_name(model: &ModelChoice) -> &'static str {
    match model {
        ModelChoice::KinematicUnicycle => "kinematic_unicycle",
        ModelChoice::DynamicUnicycle(_) => "dynamic_unicycle",
        ModelChoice::UnderactuatedAuv(_) => "underactuated_auv",
    }
}

fn following_name(following: &FollowingChoice) -> &'static str {
    match following {
        FollowingChoice::LineOfSight(_) => "line_of_sight",
        FollowingChoice::Proposition31(_) => "proposition31",
        FollowingChoice::Theorem47(_) => "theorem47",
    }
}
