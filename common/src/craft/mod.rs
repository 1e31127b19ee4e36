//! A craft is a vehicle with its path, its virtual target and its path-following law: everything of one vehicle
//! that does not concern the others.
//!
//! | craft | plant | path-following law | takes | file |
//! |---|---|---|---|---|
//! | kinematic | kinematic unicycle | line of sight (1.4) | rate | [`kinematic`] |
//! | trimming robot | dynamic unicycle (2.1), (2.2) | chapter 2, against its own foot on the path | acceleration, or rate | [`trimming`] |
//! | robot | dynamic unicycle (3.12) | Proposition 3.1 or 3.2 | acceleration (3.39), or rate (4.21) | [`robot`] |
//! | marine | fully actuated vehicle (3.28) | Proposition 3.3 | acceleration (3.39), or rate (4.21) | [`marine`] |
//! | underactuated body in space | 6-DOF (4.44), (4.45) | Theorem 4.7 | rate | [`auv`] |
//!
//! How those that take either answer a demand is in [`speed_loop`].

pub mod auv;
pub mod kinematic;
pub mod marine;
pub mod robot;
pub mod speed_loop;
pub mod trimming;

use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::path::Path;
use crate::path::shape::is_planar;
use crate::vehicle::environment::Conditions;

/// What a craft tells for the record; angles in radians, lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Path parameter of the virtual target (pattern not removed).
    pub xi: f64,
    /// Its rate, as commanded for the coming period \[1/s\].
    pub xi_rate: f64,
    /// Reference rate v_r, or for crafts that take accelerations v_L \[1/s\].
    pub v_ref: f64,
    /// Position in the inertial frame \[m\].
    pub position: [f64; 3],
    /// Yaw, pitch and roll \[rad\] (Z-Y-X).
    pub attitude: [f64; 3],
    /// Forward speed \[m/s\].
    pub speed: f64,
    /// Path-following error along the path's tangent \[m\].
    pub e_along: f64,
    /// Path-following error across the path \[m\]: signed, positive to the left, for planar paths; the norm of the
    /// part normal to the tangent for paths in space.
    pub e_cross: f64,
    /// Norm of the path-following error \[m\].
    pub e_norm: f64,
    /// Heading error \[rad\]: the heading (of the body's x-axis) relative to the path's tangent.
    pub psi_e: f64,
}

/// Something that a flight should not hide: what, and in how many control periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What happened.
    pub what: &'static str,
    /// In how many control periods.
    pub count: u64,
}

/// An actuator was at its limit and gave less than the law asked for.
pub const SATURATED: &str = "an actuator was at its limit";
/// The law had no finite answer, or the demand was none: the command before was held.
pub const REFUSED: &str = "the law had no answer, the command before was held";
/// A divisor of the law was too close to zero and was limited.
pub const LIMITED: &str = "the law was close to singular, its divisors were limited";
/// The vehicle was too slow to have a side-slip of its own.
pub const SINGULAR: &str = "too slow to have a side-slip, the wanted one was taken for it";

/// An effort within ±`limit`, and whether that took something of it.
fn limited(effort: f64, limit: f64) -> (f64, bool) {
    if effort.abs() > limit { (limit.copysign(effort), true) } else { (effort, false) }
}

/// Refuses a path that leaves its horizontal plane or has a corner, for a vehicle that is called this.
fn check_plane(path: &dyn Path, who: &str) -> Result<(), String> {
    if !is_planar(path) {
        return Err(format!("{who} follows paths in a horizontal plane only"));
    }
    match path.tangent_breaks() {
        [corner, ..] => Err(format!("{who} cannot follow the corner of its path at xi = {corner}")),
        [] => Ok(()),
    }
}

/// The vehicle was at or beyond its path's centre of curvature, where the closest point is not unique.
pub const AT_CENTRE: &str = "at the path's centre of curvature, where the closest point jumps";

/// Most actuators have one: the largest effort that they give, either way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Force \[N\], of each direction that is driven; infinite for no limit.
    pub force: f64,
    /// Torque \[N m\], about each axis that is driven; infinite for no limit.
    pub torque: f64,
    /// Change of speed \[m/s²\] of a vehicle that is commanded a speed; infinite for no limit.
    pub acceleration: f64,
    /// Turning rate \[rad/s\] of a vehicle that is commanded a heading; infinite for no limit.
    pub turn_rate: f64,
}

impl Limits {
    /// No limits.
    pub const NONE: Limits =
        Limits { force: f64::INFINITY, torque: f64::INFINITY, acceleration: f64::INFINITY, turn_rate: f64::INFINITY };
}

impl Default for Limits {
    fn default() -> Limits {
        Limits::NONE
    }
}

/// A vehicle under its path-following law. The law is evaluated in [`command`](Craft::command) at each control
/// period and its output held while [`advance`](Craft::advance) integrates the plant with RK4.
///
/// [`own`](Craft::own) and [`command`](Craft::command) know what the vehicle measures; [`observe`](Craft::observe) tells
/// what is true.
pub trait Craft: Send {
    /// The kind of demand it takes.
    fn takes(&self) -> DemandKind;
    /// Exposes the vehicle to the conditions of the control period that begins, before [`own`](Craft::own); they hold
    /// until the next ones. A vehicle that is never exposed is in still water with perfect instruments.
    fn expose(&mut self, conditions: &Conditions);
    /// What its coordination law may know of it; `xi` without the pattern removed.
    fn own(&self, reference: SpeedReference) -> Own;
    /// Evaluates the path-following law and holds its output. A demand of the wrong kind is a programming error
    /// that the mission check excludes; it is ignored (the previous command is held).
    fn command(&mut self, reference: SpeedReference, demand: Demand);
    /// Integrates plant and virtual target over `dt` seconds in `substeps` RK4 steps.
    fn advance(&mut self, dt: f64, substeps: usize);
    /// What is recorded.
    fn observe(&self) -> Observation;
    /// Puts the virtual target at `xi` (rejoin after a restart).
    fn place_target(&mut self, xi: f64);
    /// True while every state is finite.
    fn is_sound(&self) -> bool;
    /// How many commands had no answer so far, and left the one before in force: the count of [`REFUSED`].
    fn refused(&self) -> u64 {
        0
    }
    /// What happened so far that a flight should not hide; counts of zero may be left out.
    fn warnings(&self) -> Vec<Warning> {
        Vec::new()
    }
}
