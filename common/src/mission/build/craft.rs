//! Vehicles with their path-following laws.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::file::{
    ApproachChoice, ArctangentApproach, AuvModel, DerivativeChoice, DynamicUnicycle, FollowingChoice, FollowingType,
    MarineVehicle, ModelChoice, Proposition31 as PropFile, Proposition33 as Prop33File, SenseChoice,
    Theorem47 as TheoremFile,
};
use super::super::{Start, VehiclePlan};
use crate::coordination::DemandKind;
use crate::craft::auv::AuvCraft;
use crate::craft::kinematic::KinematicCraft;
use crate::craft::marine::{MarineCraft, SideSlip};
use crate::craft::robot::{RobotCraft, RobotLaw};
use crate::craft::speed_loop::SpeedLoop;
use crate::craft::trimming::TrimmingCraft;
use crate::craft::{Craft, Limits};
use crate::following::decoupling_2_14::Decoupling;
use crate::following::h2_figure_2_4::Disturbances;
use crate::following::line_of_sight::LineOfSight;
use crate::following::output_feedback_2_3::OutputFeedback;
use crate::following::proposition_3_1::{Approach, Gains as RobotGains, Proposition31, SenseOf};
use crate::following::proposition_3_2::Proposition32;
use crate::following::proposition_3_3::Proposition33;
use crate::following::state_transformation_2_19::StateTransformation;
use crate::following::theorem_4_7::{Gains as AuvGains, TargetMotion, Theorem47};
use crate::following::trimming::{Derivative, Placement, TrimmingLaw};
use crate::path::Path;
use crate::vehicle::auv::{Auv, AuvParameters, AuvState};
use crate::vehicle::dynamic_unicycle::{Parameters, State};
use crate::vehicle::marine;
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
            let law = Proposition31::new(robot_gains(gains))?;
            robot(plan, start, body, law.into(), demand, gains.k_speed)
        }
        (ModelChoice::DynamicUnicycle(body), FollowingChoice::Proposition32(gains)) => {
            let law = Proposition32::new(robot_gains(gains))?;
            robot(plan, start, body, law.into(), demand, gains.k_speed)
        }
        (ModelChoice::MarineVehicle(body), FollowingChoice::Proposition33(gains)) => {
            let [x, y, _] = start.position;
            let state = marine::State { x, y, heading: start.yaw, surge: start.speed, ..marine::State::default() };
            let law = Proposition33::new(marine_gains(gains), gains.k_slip)?;
            let side_slip = SideSlip {
                mean: gains.slip_deg.to_radians(),
                amplitude: gains.slip_amplitude_deg.to_radians(),
                period: gains.slip_period_s,
            };
            let speed_loop = SpeedLoop::of(demand, gains.k_speed);
            let parameters = marine_parameters(body);
            let craft = MarineCraft::new(plan.path.clone(), law, speed_loop, side_slip, parameters, state, start.xi)?;
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
            let speed_loop = SpeedLoop::of(demand, k_0);
            let craft = TrimmingCraft::new(plan.path.clone(), law, speed_loop, parameters, state, start.xi)?;
            Ok(Box::new(craft.limited(plan.limits)))
        }
        (ModelChoice::UnderactuatedAuv(model), FollowingChoice::Theorem47(gains)) => {
            let auv = limited(auv(model)?, &plan.limits)?;
            let motion = match gains.kind {
                FollowingType::I => TargetMotion::TypeI,
                FollowingType::II => TargetMotion::TypeII,
            };
            let chosen = auv_gains(gains);
            chosen.validate(&auv, fastest * nominal_factor, largest_stretch(plan.path.as_ref()))?;
            let law = Theorem47::new(chosen, auv)?;
            Ok(Box::new(AuvCraft::new(law, motion, nominal_factor, plan.path.clone(), auv_state(&start), start.xi)))
        }
        _ => Err("the following law does not fit the vehicle".to_string()),
    }
}

/// The state in which an underactuated vehicle starts: level, without turning.
pub(in crate::mission) fn auv_state(start: &Start) -> AuvState {
    let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, start.yaw);
    let mut state = AuvState::at_rest(Vector3::from(start.position), attitude);
    state.velocity.x = start.speed;
    state
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

fn robot(
    plan: &VehiclePlan,
    start: Start,
    body: &DynamicUnicycle,
    law: RobotLaw,
    demand: DemandKind,
    k_speed: f64,
) -> Result<Box<dyn Craft>, String> {
    let parameters = Parameters { mass: body.mass_kg, inertia: body.inertia_kgm2 }.checked()?;
    let [x, y, _] = start.position;
    let state = State { x, y, heading: start.yaw, speed: start.speed, turn_rate: 0.0 };
    let craft = RobotCraft::new(plan.path.clone(), law, SpeedLoop::of(demand, k_speed), parameters, state, start.xi)?;
    Ok(Box::new(craft.limited(plan.limits)))
}

fn marine_gains(file: &Prop33File) -> RobotGains {
    RobotGains {
        k_1: file.k1,
        k_3: file.k3,
        k_4: file.k4,
        approach: approach(file.approach, file.k2, file.epsilon_m),
        sense_of: sense_of(file.sense_of),
        ..RobotGains::default()
    }
}

fn approach(choice: ApproachChoice, k_2: f64, epsilon_0: f64) -> Approach {
    match choice {
        ApproachChoice::Arcsine => Approach::Arcsine { k_2, epsilon_0 },
        ApproachChoice::Arctangent(ArctangentApproach { psi_a_deg, length_m }) => {
            Approach::Arctangent { psi_a: psi_a_deg.to_radians(), length: length_m }
        }
    }
}

fn sense_of(choice: SenseChoice) -> SenseOf {
    match choice {
        SenseChoice::ActualSpeed => SenseOf::ActualSpeed,
        SenseChoice::DesiredSpeed => SenseOf::DesiredSpeed,
    }
}

fn marine_parameters(file: &MarineVehicle) -> marine::Parameters {
    marine::Parameters {
        m_u: file.mass_u_kg,
        m_v: file.mass_v_kg,
        m_r: file.inertia_kgm2,
        d_u: file.drag_u_kgps,
        d_v: file.drag_v_kgps,
        d_r: file.drag_r_kgm2ps,
    }
}

fn robot_gains(file: &PropFile) -> RobotGains {
    RobotGains {
        k_1: file.k1,
        k_3: file.k3,
        k_4: file.k4,
        approach: approach(file.approach, file.k2, file.epsilon_m),
        sense_of: sense_of(file.sense_of),
        ..RobotGains::default()
    }
}

/// The gains of Theorem 4.7 of a choice.
pub(in crate::mission) fn auv_gains(file: &TheoremFile) -> AuvGains {
    AuvGains { k_e: file.k_e, k_phi: file.k_phi, k_z: file.k_z, k_eta: file.k_eta, delta1: file.delta1_mps }
}

/// The rigid body of a choice.
pub(in crate::mission) fn auv(model: &AuvModel) -> Result<Auv, String> {
    match model {
        AuvModel::Sirene => Ok(sirene()),
        AuvModel::Parameters(table) => {
            let limits = *sirene().parameters();
            Auv::new(AuvParameters {
                mass: table.mass_t.into(),
                inertia: table.inertia_tm2.into(),
                linear_drag: table.linear_drag.into(),
                quadratic_drag: table.quadratic_drag.into(),
                linear_spin_drag: table.linear_spin_drag.into(),
                quadratic_spin_drag: table.quadratic_spin_drag.into(),
                weight: table.weight_kn,
                buoyancy: table.buoyancy_kn.unwrap_or(table.weight_kn),
                centre_of_buoyancy: table.centre_of_buoyancy_m.into(),
                ..limits
            })
        }
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
pub(in crate::mission) fn largest_stretch(path: &dyn Path) -> f64 {
    stretched_most(path).1
}

/// Where |p'| of a path is largest, and how large it is there.
pub(in crate::mission) fn stretched_most(path: &dyn Path) -> (f64, f64) {
    let (from, to) = path.search_range();
    (0..=1000)
        .map(|i| from + (to - from) * f64::from(i) / 1000.0)
        .map(|xi| (xi, path.at(xi).r()))
        .fold((from, 0.0), |most, here| if here.1 > most.1 { here } else { most })
}
