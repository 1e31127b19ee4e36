//! Vehicles with their path-following laws.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::file::{
    AuvModel, DerivativeChoice, FollowingChoice, FollowingType, ModelChoice, Proposition31 as PropFile,
    Theorem47 as TheoremFile,
};
use super::super::{Start, VehiclePlan};
use crate::coordination::DemandKind;
use crate::craft::auv::AuvCraft;
use crate::craft::kinematic::KinematicCraft;
use crate::craft::robot::{RobotCraft, SpeedLoop};
use crate::craft::trimming::TrimmingCraft;
use crate::craft::{Craft, Limits};
use crate::following::decoupling_2_14::Decoupling;
use crate::following::h2_figure_2_4::Disturbances;
use crate::following::line_of_sight::LineOfSight;
use crate::following::output_feedback_2_3::OutputFeedback;
use crate::following::proposition_3_1::{Approach, Gains as RobotGains, Proposition31};
use crate::following::state_transformation_2_19::StateTransformation;
use crate::following::theorem_4_7::{Gains as AuvGains, TargetMotion, Theorem47};
use crate::following::trimming::{Derivative, Placement, TrimmingLaw};
use crate::path::Path;
use crate::vehicle::auv::{Auv, AuvParameters, AuvState};
use crate::vehicle::dynamic_unicycle::{Parameters, State};
use crate::vehicle::sirene::sirene;

/// The vehicle of a plan, put at `start`. `nominal_factor` is v_L*/v_L, `fastest` the greatest formation speed.
pub(in crate::mission) fn craft(
    plan: &VehiclePlan,
    start: Start,
    nominal_factor: f64,
    fastest: f64,
    demand: DemandKind,
) -> Result<Box<dyn Craft>, String> {
    match (&plan.model, &plan.following) {
        (ModelChoice::KinematicUnicycle, FollowingChoice::LineOfSight(law)) => {
            let law = LineOfSight::new(law.distance_m)?;
            let [x, y, _] = start.position;
            let craft = KinematicCraft::new(plan.path.clone(), law, x, y)?;
            Ok(Box::new(craft.limited(plan.limits, start.speed, start.yaw)))
        }
        (ModelChoice::DynamicUnicycle(body), FollowingChoice::Proposition31(gains)) => {
            let parameters = Parameters { mass: body.mass_kg, inertia: body.inertia_kgm2 }.checked()?;
            let [x, y, _] = start.position;
            let state = State { x, y, heading: start.yaw, speed: start.speed, turn_rate: 0.0 };
            let law = Proposition31::new(robot_gains(gains))?;
            let speed_loop = match demand {
                DemandKind::Acceleration => SpeedLoop::Acceleration,
                DemandKind::Rate => SpeedLoop::Rate { k_0: gains.k_speed },
            };
            let craft = RobotCraft::new(plan.path.clone(), law, speed_loop, parameters, state, start.xi)?;
            Ok(Box::new(craft.limited(plan.limits)))
        }
        (
            ModelChoice::DynamicUnicycle(body),
            FollowingChoice::Decoupling(_)
            | FollowingChoice::OutputFeedback(_)
            | FollowingChoice::StateTransformation(_),
        ) => {
            let parameters = Parameters { mass: body.mass_kg, inertia: body.inertia_kgm2 }.checked()?;
            let [x, y, _] = start.position;
            let state = State { x, y, heading: start.yaw, speed: start.speed, turn_rate: 0.0 };
            let (law, k_0) = trimming_law(&plan.following, plan.path.at(start.xi).curvature())?;
            let speed_loop = match demand {
                DemandKind::Acceleration => SpeedLoop::Acceleration,
                DemandKind::Rate => SpeedLoop::Rate { k_0 },
            };
            let craft = TrimmingCraft::new(plan.path.clone(), law, speed_loop, parameters, state, start.xi)?;
            Ok(Box::new(craft.limited(plan.limits)))
        }
        (ModelChoice::UnderactuatedAuv(model), FollowingChoice::Theorem47(gains)) => {
            let auv = limited(auv(*model), &plan.limits)?;
            let motion = match gains.kind {
                FollowingType::I => TargetMotion::TypeI,
                FollowingType::II => TargetMotion::TypeII,
            };
            let chosen = auv_gains(gains);
            chosen.validate(&auv, fastest * nominal_factor, largest_stretch(plan.path.as_ref()))?;
            let law = Theorem47::new(chosen, auv)?;
            let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, start.yaw);
            let mut state = AuvState::at_rest(Vector3::from(start.position), attitude);
            state.velocity.x = start.speed;
            Ok(Box::new(AuvCraft::new(law, motion, nominal_factor, plan.path.clone(), state, start.xi)))
        }
        _ => Err("the following law does not fit the vehicle".to_string()),
    }
}

/// The law of chapter 2 of a choice, for a path that begins with this curvature, and the gain of its speed loop.
fn trimming_law(choice: &FollowingChoice, c_c: f64) -> Result<(Box<dyn TrimmingLaw>, f64), String> {
    let derivative = |choice: &DerivativeChoice| match choice {
        DerivativeChoice::Exact => Derivative::Exact,
        DerivativeChoice::Filtered(filter) => Derivative::Filtered { tau: filter.tau_s },
    };
    Ok(match choice {
        FollowingChoice::Decoupling(g) => {
            let placement = Placement::new(g.lambda_p, g.v_min_mps)?;
            (Box::new(Decoupling::new(placement, derivative(&g.derivative))?), g.k_speed)
        }
        FollowingChoice::OutputFeedback(g) => {
            let disturbances =
                Disturbances { heading: g.heading_disturbance, torque: g.torque_disturbance, noise: g.noise };
            let law = OutputFeedback::new(g.design_speed_mps, c_c, disturbances, derivative(&g.derivative))?;
            (Box::new(law), g.k_speed)
        }
        FollowingChoice::StateTransformation(g) => {
            (Box::new(StateTransformation::new(Placement::new(g.lambda_p, g.v_min_mps)?)), g.k_speed)
        }
        _ => return Err("the following law is none of chapter 2".to_string()),
    })
}

fn robot_gains(file: &PropFile) -> RobotGains {
    RobotGains {
        k_1: file.k1,
        k_3: file.k3,
        k_4: file.k4,
        approach: Approach::Arcsine { k_2: file.k2, epsilon_0: file.epsilon_m },
        ..RobotGains::default()
    }
}

/// The gains of Theorem 4.7 of a choice.
pub(in crate::mission) fn auv_gains(file: &TheoremFile) -> AuvGains {
    AuvGains { k_e: file.k_e, k_phi: file.k_phi, k_z: file.k_z, k_eta: file.k_eta, delta1: file.delta1_mps }
}

/// The rigid body of a choice.
pub(in crate::mission) fn auv(model: AuvModel) -> Auv {
    match model {
        AuvModel::Sirene => sirene(),
    }
}

/// The rigid body with the tighter of its own limits and these, which are in newtons.
fn limited(auv: Auv, limits: &Limits) -> Result<Auv, String> {
    let own = *auv.parameters();
    Auv::new(AuvParameters {
        thrust_limit: own.thrust_limit.min(limits.force / 1e3),
        torque_limit: own.torque_limit.min(limits.torque / 1e3),
        ..own
    })
}

/// The largest |p'| over the range in which a path is used.
fn largest_stretch(path: &dyn Path) -> f64 {
    let (from, to) = path.search_range();
    (0..=1000).map(|i| path.at(from + (to - from) * f64::from(i) / 1000.0).r()).fold(0.0, f64::max)
}
