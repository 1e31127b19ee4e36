//! From the choices of the mission file to the laws, paths and vehicles they name: the one place where names and types
//! meet.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use super::file::{
    AuvModel, Direction, FollowingChoice, FollowingType, LawChoice, ModelChoice, PathChoice, Proposition31 as PropFile,
    SegmentChoice, Theorem47 as TheoremFile,
};
use super::{Start, VehiclePlan};
use crate::coordination::delayed_4_34::Delayed;
use crate::coordination::delayed_4_42::DelayedAlone;
use crate::coordination::introduction_1_5::Introduction;
use crate::coordination::solution_1_3_43::SolutionOne;
use crate::coordination::solution_2_3_44::SolutionTwo;
use crate::coordination::solution_3_3_45::SolutionThree;
use crate::coordination::switching_4_21::Switching;
use crate::coordination::{CoordinationLaw, DemandKind};
use crate::craft::Craft;
use crate::craft::auv::AuvCraft;
use crate::craft::kinematic::KinematicCraft;
use crate::craft::robot::{RobotCraft, SpeedLoop};
use crate::following::line_of_sight::LineOfSight;
use crate::following::proposition_3_1::{Approach, Gains as RobotGains, Proposition31};
use crate::following::theorem_4_7::{Gains as AuvGains, TargetMotion, Theorem47};
use crate::path::Path;
use crate::path::chain::{Chain, Segment};
use crate::path::circle::{Circle, Turn};
use crate::path::helix::Helix;
use crate::path::line::Line;
use crate::path::sinusoid::Sinusoid;
use crate::theory::delay::steady_speed;
use crate::time::Span;
use crate::vehicle::auv::{Auv, AuvState};
use crate::vehicle::dynamic_unicycle::{Parameters, State};
use crate::vehicle::sirene::sirene;

/// The coordination law of a choice.
pub(super) fn law(choice: &LawChoice) -> Result<Arc<dyn CoordinationLaw>, String> {
    Ok(match choice {
        LawChoice::Introduction(g) => Arc::new(Introduction::new(g.gain)?),
        LawChoice::Solution1(g) => Arc::new(SolutionOne::new(g.a)?),
        LawChoice::Solution2(g) => Arc::new(SolutionTwo::new(g.a, g.b)?),
        LawChoice::Solution3(g) => Arc::new(SolutionThree::new(g.a, g.b, g.x_m)?),
        LawChoice::Switching(g) => Arc::new(Switching::new(g.gain)?),
        LawChoice::Delayed(g) => Arc::new(Delayed::new(g.gain)?),
        LawChoice::DelayedWithLosses(g) => Arc::new(DelayedAlone::new(g.gain, g.delay_s)?),
    })
}

/// v_L* / v_L, as the law of a choice will make it.
pub(super) fn nominal_factor(choice: &LawChoice) -> f64 {
    match choice {
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => {
            steady_speed(1.0, law.gain, Span::from_secs(law.delay_s))
        }
        _ => 1.0,
    }
}

/// The name of a choice in the mission file.
pub(super) fn law_name(choice: &LawChoice) -> &'static str {
    match choice {
        LawChoice::Introduction(_) => "introduction",
        LawChoice::Solution1(_) => "solution1",
        LawChoice::Solution2(_) => "solution2",
        LawChoice::Solution3(_) => "solution3",
        LawChoice::Switching(_) => "switching",
        LawChoice::Delayed(_) => "delayed",
        LawChoice::DelayedWithLosses(_) => "delayed_with_losses",
    }
}

/// The path of a choice.
pub(super) fn path(choice: &PathChoice) -> Result<Arc<dyn Path>, String> {
    let plane = |xy: [f64; 2]| Vector3::new(xy[0], xy[1], 0.0);
    Ok(match choice {
        PathChoice::Line(l) => Arc::new(Line::new(plane(l.start_m), l.heading_deg.to_radians(), l.rate_m)?),
        PathChoice::Circle(c) => {
            let turn = match c.direction {
                Direction::Ccw => Turn::Left,
                Direction::Cw => Turn::Right,
            };
            Arc::new(Circle::new(plane(c.centre_m), c.radius_m, turn, c.start_deg.to_radians(), c.rate_rad)?)
        }
        PathChoice::Sinusoid(s) => {
            Arc::new(Sinusoid::new(s.amplitude_m, s.offset_m, s.wavelength_m, s.phase_deg.to_radians(), 0.0)?)
        }
        PathChoice::Chain(c) => {
            let segments = c.segments.iter().map(segment).collect::<Result<Vec<_>, String>>()?;
            Arc::new(Chain::new(plane(c.start_m), c.heading_deg.to_radians(), &segments)?)
        }
        PathChoice::Helix(h) => Arc::new(Helix::new(h.radius_m, h.lap, h.phase_deg.to_radians(), h.climb_m, h.z0_m)?),
    })
}

fn segment(choice: &SegmentChoice) -> Result<Segment, String> {
    let rate = |rate: f64| if rate > 0.0 { Ok(rate) } else { Err(format!("rate_m must be above 0, it is {rate}")) };
    Ok(match choice {
        SegmentChoice::Line(l) => Segment::Line { length: l.length_m, xi_length: l.length_m / rate(l.rate_m)? },
        SegmentChoice::Arc(a) => {
            let sweep = a.sweep_deg.to_radians();
            let rate = rate(a.rate_m.unwrap_or(a.radius_m))?;
            Segment::Arc { radius: a.radius_m, sweep, xi_length: a.radius_m * sweep.abs() / rate }
        }
        SegmentChoice::Corner(c) => Segment::Corner { angle: c.turn_deg.to_radians() },
    })
}

/// The vehicle of a plan, put at `start`. `nominal_factor` is v_L*/v_L, `fastest` the greatest formation speed.
pub(super) fn craft(
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
            Ok(Box::new(KinematicCraft::new(plan.path.clone(), law, x, y)?))
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
            Ok(Box::new(RobotCraft::new(plan.path.clone(), law, speed_loop, parameters, state, start.xi)?))
        }
        (ModelChoice::UnderactuatedAuv(model), FollowingChoice::Theorem47(gains)) => {
            let auv = auv(*model);
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
pub(super) fn auv_gains(file: &TheoremFile) -> AuvGains {
    AuvGains { k_e: file.k_e, k_phi: file.k_phi, k_z: file.k_z, k_eta: file.k_eta, delta1: file.delta1_mps }
}

/// The rigid body of a choice.
pub(super) fn auv(model: AuvModel) -> Auv {
    match model {
        AuvModel::Sirene => sirene(),
    }
}

/// The largest |p'| over the range in which a path is used.
fn largest_stretch(path: &dyn Path) -> f64 {
    let (from, to) = path.search_range();
    (0..=1000).map(|i| path.at(from + (to - from) * f64::from(i) / 1000.0).r()).fold(0.0, f64::max)
}
