//! One vehicle: whether plant, path-following law, coordination law and path fit together.

use nalgebra::Vector3;

use super::super::fault::{Collector, plain};
use super::super::file::{
    FollowingChoice, FollowingType, LawChoice, MissionFile, ModelChoice, PathChoice, SegmentChoice, VehicleSection,
};
use super::super::{Pattern, PatternMotion, Start, VehiclePlan, build};
use super::environment::{LARGEST, check_disturbances, check_limits};
use super::path::check_path;
use super::{FARTHEST, LARGEST_ANGLE, LARGEST_XI};
use crate::coordination::{DemandKind, FleetLaw};
use crate::following::theorem_4_7::Gains;
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
    for (name, value, most, unit) in [
        ("x_m", start.x_m, FARTHEST, "m"),
        ("y_m", start.y_m, FARTHEST, "m"),
        ("z_m", start.z_m, FARTHEST, "m"),
        ("yaw_deg", start.yaw_deg, LARGEST_ANGLE, "deg"),
        ("speed_mps", start.speed_mps, LARGEST, "m/s"),
        ("xi", start.xi.unwrap_or(0.0), LARGEST_XI, "units of xi"),
    ] {
        faults.magnitude(&format!("{key}.start.{name}"), value, most, unit);
    }
    let pattern = check_pattern(faults, file, &key, section);
    let model = section.model.clone().or_else(|| file.fleet.model.clone());
    let following = section.following.clone().or_else(|| file.fleet.following.clone());
    if model.is_none() {
        faults.fault(
            &key,
            "no model",
            "a model here or in [fleet]: kinematic_unicycle, dynamic_unicycle, marine_vehicle or underactuated_auv",
        );
    }
    if following.is_none() {
        let allowed = "a following law here or in [fleet]: line_of_sight, decoupling, output_feedback, state_transformation, \
                       proposition31, proposition32, proposition33 or theorem47";
        faults.fault(&key, "no following", allowed);
    }
    let disturbances = check_disturbances(faults, file, index);
    let limits = model.as_ref().map(|model| check_limits(faults, file, index, model)).unwrap_or_default();
    let path_key = format!("{key}.path.{}", path_name(&section.path));
    let in_range = check_path(faults, &path_key, &section.path);
    let path = in_range.then(|| build::path(&section.path)).and_then(|built| {
        built
            .map_err(|reason| faults.fault(&path_key, reason, "numbers that make a path, as docs/missions.md says"))
            .ok()
    });
    let (model, following) = (model?, following?);
    if !check_fit(faults, &key, section, file, &model, &following, law, path.as_deref()) {
        return None;
    }
    let path = path?;
    let position = Vector3::new(start.x_m, start.y_m, start.z_m);
    let usable = position.iter().all(|x| x.is_finite());
    let xi = start.xi.or_else(|| usable.then(|| closest_parameter(path.as_ref(), position, true)))?;
    let start = Start { position: position.into(), yaw: start.yaw_deg.to_radians(), speed: start.speed_mps, xi };
    let plan = VehiclePlan { id: section.id.clone(), pattern, path, start, model, following, limits, disturbances };
    if !check_delta1(faults, &following_key(&key, section), &plan, factor, fastest) {
        return None;
    }
    if let Err(reason) = build::craft(&plan, start, factor, fastest, law.map_or(DemandKind::Rate, |law| law.kind())) {
        faults.fault(&following_key(&key, section), reason, "");
        return None;
    }
    Some(plan)
}

/// Whether δ_1 of Theorem 4.7 is large enough for the fastest motion along the path (erratum 4.11). Says which vehicle it is, and both
/// ways out: another δ_1, or a slower formation.
fn check_delta1(
    faults: &mut Collector<'_>,
    following_key: &str,
    plan: &VehiclePlan,
    factor: f64,
    fastest: f64,
) -> bool {
    let (ModelChoice::UnderactuatedAuv(model), FollowingChoice::Theorem47(gains)) = (&plan.model, &plan.following)
    else {
        return true;
    };
    // What is wrong with the vehicle itself, or with the sign, is told where it is built.
    let Ok(auv) = build::auv(model) else { return true };
    let (xi, stretch) = build::stretched_most(plan.path.as_ref());
    let least = Gains::smallest_delta1(&auv, fastest * factor, stretch);
    if !least.is_finite() || gains.delta1_mps >= 0.0 || gains.delta1_mps.abs() > least {
        return true;
    }
    // Rounded outwards, so that what is proposed is allowed.
    let below = (least * 1e3).ceil() / 1e3;
    let slower = (fastest * gains.delta1_mps.abs() / least * 1e3).floor() / 1e3;
    let found = format!(
        "{} m/s for {}, too little at v_L = {} /s where |p'| of its path is {stretch:.3} m (xi = {xi:.1}): thrust and turning rates \
         could become unbounded",
        plain(gains.delta1_mps),
        plan.id,
        plain(fastest)
    );
    let allowed = format!(
        "delta1_mps below -{below:.3}, which is v_n |p'| (max m_ii - m_11)/m_11, or a formation speed below {slower:.3} /s"
    );
    faults.fault(&format!("{following_key}.theorem47.delta1_mps"), found, allowed);
    false
}

/// The vehicle's place in the pattern.
fn check_pattern(faults: &mut Collector<'_>, file: &MissionFile, key: &str, section: &VehicleSection) -> Pattern {
    faults.magnitude(&format!("{key}.pattern"), section.pattern, LARGEST_XI, "units of xi");
    let Some(motion) = section.pattern_motion else { return Pattern::constant(section.pattern) };
    let key = format!("{key}.pattern_motion");
    faults.magnitude(&format!("{key}.amplitude"), motion.amplitude, LARGEST_XI, "units of xi");
    let ok = (1e-3..=1e9).contains(&motion.period_s);
    faults.number(&format!("{key}.period_s"), motion.period_s, ok, "0.001 to 1000000000 s");
    faults.magnitude(&format!("{key}.phase_deg"), motion.phase_deg, LARGEST_ANGLE, "deg");
    if !matches!(file.coordination.law, LawChoice::MovingPattern(_)) {
        let found = format!("a pattern that moves, under {}", build::law_name(&file.coordination.law));
        faults.fault(&key, found, "a constant pattern for this law, or the law moving_pattern (3.70)");
    }
    let phase = motion.phase_deg.to_radians();
    let motion = PatternMotion { amplitude: motion.amplitude, period: motion.period_s, phase };
    Pattern { constant: section.pattern, motion: Some(motion) }
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
        PathChoice::Spline(_) => "spline",
        PathChoice::Geojson(_) => "geojson",
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
    path: Option<&dyn Path>,
) -> bool {
    let (fits, law_of_model) = match (model, following) {
        (ModelChoice::KinematicUnicycle, FollowingChoice::LineOfSight(_))
        | (
            ModelChoice::DynamicUnicycle(_),
            FollowingChoice::Proposition31(_)
            | FollowingChoice::Proposition32(_)
            | FollowingChoice::Decoupling(_)
            | FollowingChoice::OutputFeedback(_)
            | FollowingChoice::StateTransformation(_),
        )
        | (ModelChoice::MarineVehicle(_), FollowingChoice::Proposition33(_))
        | (ModelChoice::UnderactuatedAuv(_), FollowingChoice::Theorem47(_)) => (true, ""),
        (ModelChoice::KinematicUnicycle, _) => (false, "line_of_sight with kinematic_unicycle"),
        (ModelChoice::DynamicUnicycle(_), _) => (
            false,
            "proposition31, proposition32, decoupling, output_feedback or state_transformation with dynamic_unicycle",
        ),
        (ModelChoice::MarineVehicle(_), _) => (false, "proposition33 with marine_vehicle"),
        (ModelChoice::UnderactuatedAuv(_), _) => (false, "theorem47 with underactuated_auv"),
    };
    if !fits {
        let found = format!("{} with {}", following_name(following), model_name(model));
        faults.fault(&following_key(key, section), found, law_of_model);
        return false;
    }
    let mut ok = true;
    let takes_acceleration = matches!(model, ModelChoice::DynamicUnicycle(_) | ModelChoice::MarineVehicle(_));
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
            "introduction, leader_integral, switching, delayed, delayed_with_losses, auxiliary or auxiliary_switching for \
             this vehicle",
        );
        ok = false;
    }
    ok &= check_auxiliary(faults, section, file, key, following);
    let path_key = format!("{key}.path.{}", path_name(&section.path));
    if let Some(at) = path.and_then(|path| path.tangent_breaks().first().copied()) {
        let found = format!("a path whose direction jumps at xi = {at}");
        faults.fault(&path_key, found, format!("a path with a continuous tangent for {}", following_name(following)));
        ok = false;
    }
    if let (FollowingChoice::Theorem47(_), PathChoice::Chain(chain)) = (following, &section.path)
        && chain.segments.iter().any(|segment| matches!(segment, SegmentChoice::Arc(_)))
        && chain.segments.len() > 1
    {
        let allowed =
            "a path with a continuous curvature for theorem47: line, circle, sinusoid, helix, spline or geojson";
        faults.fault(&path_key, "a chain, whose curvature jumps from piece to piece", allowed);
        ok = false;
    }
    if !matches!(model, ModelChoice::UnderactuatedAuv(_))
        && path.is_some_and(|path| !crate::path::shape::is_planar(path))
    {
        let found = format!("a path that leaves the plane for a {}", model_name(model));
        faults.fault(&path_key, found, "a line, circle, sinusoid or chain, or waypoints of one height");
        ok = false;
    }
    ok
}

/// (4.59) needs α_2 of Theorem 4.7, and both laws with an auxiliary state set the whole rate of the target.
fn check_auxiliary(
    faults: &mut Collector<'_>,
    section: &VehicleSection,
    file: &MissionFile,
    key: &str,
    following: &FollowingChoice,
) -> bool {
    let law = build::law_name(&file.coordination.law);
    let (needs_alpha_2, is_auxiliary) = match file.coordination.law {
        LawChoice::Auxiliary(_) => (true, true),
        LawChoice::AuxiliarySwitching(_) => (false, true),
        _ => (false, false),
    };
    match following {
        FollowingChoice::Theorem47(gains) if is_auxiliary && gains.kind == FollowingType::I => {
            let found = format!("theorem47 of kind I, whose target has a surplus rate of its own, under {law}");
            faults.fault(
                &following_key(key, section),
                found,
                "kind = \"II\" for this law, which gives the surplus rate",
            );
            false
        }
        FollowingChoice::Theorem47(_) => true,
        other if needs_alpha_2 => {
            let found = format!(
                "{law}, which needs the alpha_2 of theorem47, for {} with {}",
                section.id,
                following_name(other)
            );
            faults.fault("coordination.law", found, "auxiliary_switching (4.62) for this vehicle, which does without");
            false
        }
        _ => true,
    }
}

pub(super) fn model_name(model: &ModelChoice) -> &'static str {
    match model {
        ModelChoice::KinematicUnicycle => "kinematic_unicycle",
        ModelChoice::DynamicUnicycle(_) => "dynamic_unicycle",
        ModelChoice::MarineVehicle(_) => "marine_vehicle",
        ModelChoice::UnderactuatedAuv(_) => "underactuated_auv",
    }
}

fn following_name(following: &FollowingChoice) -> &'static str {
    match following {
        FollowingChoice::LineOfSight(_) => "line_of_sight",
        FollowingChoice::Decoupling(_) => "decoupling",
        FollowingChoice::OutputFeedback(_) => "output_feedback",
        FollowingChoice::StateTransformation(_) => "state_transformation",
        FollowingChoice::Proposition31(_) => "proposition31",
        FollowingChoice::Proposition32(_) => "proposition32",
        FollowingChoice::Proposition33(_) => "proposition33",
        FollowingChoice::Theorem47(_) => "theorem47",
    }
}
