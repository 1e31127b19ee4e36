//! The wheeled robot of chapter 2: a dynamic unicycle that follows the path against its own closest point.
//!
//! There is no virtual target: ξ is the parameter of the vehicle's foot on the path, continuous and never wrapped. Within a
//! tenth of the path's radius of curvature from its centre, (2.9) is limited, and at the centre the foot jumps to the
//! closest point within half a turn, with ξ; both are counted.

use std::sync::Arc;

use nalgebra::{SVector, Vector2};

use super::robot::measured;
use super::speed_loop::SpeedLoop;
use super::{AT_CENTRE, Craft, LIMITED, Limits, Observation, REFUSED, SATURATED, Warning, check_plane, limited};
use crate::coordination::{Demand, DemandKind, Own, SpeedReference};
use crate::following::proposition_3_1::Errors;
use crate::following::trimming::{Deviation, TrimmingLaw, Turning};
use crate::path::Path;
use crate::path::foot::Foot;
use crate::positive::finite;
use crate::vehicle::dynamic_unicycle::{Input, Parameters, State, model};
use crate::vehicle::environment::Conditions;
use crate::vehicle::integrate::advance;

/// A wheeled robot under a law of chapter 2.
#[derive(Debug)]
pub struct TrimmingCraft {
    path: Arc<dyn Path>,
    law: Box<dyn TrimmingLaw>,
    speed_loop: SpeedLoop,
    parameters: Parameters,
    state: State,
    /// The foot of where the vehicle is, and of where it believes to be.
    foot: Foot,
    believed: Foot,
    /// F \[N\], held; and N/I as the law has it.
    force: f64,
    turning: Turning,
    v_ref: f64,
    limits: Limits,
    conditions: Conditions,
    near_singular: u64,
    singular: u64,
    saturated: u64,
    refused: u64,
}

impl TrimmingCraft {
    /// The robot in `state` on the lap of its path that `xi` is on. The path must lie in a horizontal plane and have no
    /// corners; a robot without mass is refused.
    pub fn new(
        path: Arc<dyn Path>,
        law: Box<dyn TrimmingLaw>,
        speed_loop: SpeedLoop,
        parameters: Parameters,
        state: State,
        xi: f64,
    ) -> Result<TrimmingCraft, String> {
        check_plane(&*path, "a wheeled robot")?;
        state.to_vector().iter().try_for_each(|&x| finite("the robot's state", x).map(drop))?;
        let foot = Foot::locate(&*path, Vector2::new(state.x, state.y), finite("the robot's xi", xi)?);
        Ok(TrimmingCraft {
            path,
            law,
            speed_loop: speed_loop.checked()?,
            parameters: parameters.checked()?,
            state,
            foot,
            believed: foot,
            force: 0.0,
            turning: Turning::default(),
            v_ref: 0.0,
            limits: Limits::NONE,
            conditions: Conditions::default(),
            near_singular: 0,
            singular: 0,
            saturated: 0,
            refused: 0,
        })
    }

    /// The robot with a force and a torque that it cannot exceed.
    pub fn limited(mut self, limits: Limits) -> TrimmingCraft {
        self.limits = limits;
        self
    }

    /// Its state as its instruments tell it.
    fn measured(&self) -> State {
        measured(&self.state, &self.conditions)
    }

    /// The vehicle in `state` against `foot`.
    fn deviation(foot: &Foot, state: &State, v_dot: f64) -> Deviation {
        let e = Errors::of(&foot.point, state.x, state.y, state.heading);
        let c_c = foot.point.curvature();
        Deviation { d_e: e.y_e, psi_e: e.psi_e, c_c, v: state.speed, v_dot, r: state.turn_rate }
    }

    /// ξ̇ = ṡ/R, (2.10).
    fn xi_rate(foot: &Foot, state: &State) -> f64 {
        TrimmingCraft::deviation(foot, state, 0.0).s_dot() / foot.point.r()
    }
}

impl Craft for TrimmingCraft {
    fn takes(&self) -> DemandKind {
        self.speed_loop.takes()
    }

    /// The engine keeps its stuck speed at once (section 2.4: v_i = v₀).
    fn expose(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        if let Some(speed) = conditions.stuck_speed {
            self.state.speed = speed;
        }
        self.believed = if conditions.errors.is_some() {
            let state = self.measured();
            self.foot.follow(&*self.path, Vector2::new(state.x, state.y)).0
        } else {
            self.foot
        };
    }

    /// With η = v − R v_L (3.38), or zero for a robot that takes a rate.
    fn own(&self, reference: SpeedReference) -> Own {
        let (state, point) = (self.measured(), &self.believed.point);
        let r = point.r();
        let eta = self.speed_loop.eta(state.speed, r, reference);
        let r_dot = point.dr_dxi() * TrimmingCraft::xi_rate(&self.believed, &state);
        Own { xi: self.believed.xi, eta, r, v: state.speed, r_dot, ..Own::default() }
    }

    /// Where the force is at its limit, the law knows that it is.
    fn command(&mut self, reference: SpeedReference, demand: Demand) {
        let (state, foot) = (self.measured(), self.believed);
        let xi_rate = TrimmingCraft::xi_rate(&foot, &state);
        let answer = self.speed_loop.answer(demand, reference, &foot.point, state.speed, xi_rate);
        let Some(answer) = answer.filter(|answer| answer.v_dot.is_finite()) else {
            self.refused += 1;
            return;
        };
        let mass = self.parameters.mass;
        let (force, cut) = limited(mass * answer.v_dot, self.limits.force);
        let v_dot = if cut { force / mass } else { answer.v_dot };
        (self.force, self.v_ref) = (force, answer.v_ref);
        // A speed that is stuck does not change, whatever is commanded; the vehicle knows of its failure.
        let v_dot = if self.conditions.stuck_speed.is_some() { 0.0 } else { v_dot };
        let seen = TrimmingCraft::deviation(&foot, &state, v_dot);
        self.near_singular += u64::from(seen.is_singular());
        self.saturated += u64::from(cut);
        self.law.see(&seen);
    }

    /// The turning acceleration goes evenly from where the law has it to where it brings it.
    fn advance(&mut self, dt: f64, substeps: usize) {
        self.turning = self.law.advance(dt);
        let inertia = self.parameters.inertia;
        let (from, cut) = limited(inertia * self.turning.from, self.limits.torque);
        let (to, cut_too) = limited(inertia * self.turning.to, self.limits.torque);
        self.saturated += u64::from(cut || cut_too);
        let force = if self.conditions.stuck_speed.is_some() { 0.0 } else { self.force };
        let ramp = |t: f64, x: &SVector<f64, 5>, &(): &(), parameters: &Parameters| {
            model(t, x, &Input { force, torque: from + (to - from) * (t / dt) }, parameters)
        };
        self.state = State::from_vector(advance(ramp, &self.state.to_vector(), &(), &self.parameters, dt, substeps));
        if let Some(drift) = self.conditions.drift(dt) {
            self.state.x += drift.x;
            self.state.y += drift.y;
        }
        let (foot, searched) = self.foot.follow(&*self.path, Vector2::new(self.state.x, self.state.y));
        (self.foot, self.believed) = (foot, foot);
        self.singular += u64::from(searched);
    }

    fn observe(&self) -> Observation {
        let e = Errors::of(&self.foot.point, self.state.x, self.state.y, self.state.heading);
        Observation {
            xi: self.foot.xi,
            xi_rate: TrimmingCraft::xi_rate(&self.foot, &self.state),
            v_ref: self.v_ref,
            position: [self.state.x, self.state.y, self.foot.point.p.z],
            attitude: [self.state.heading, 0.0, 0.0],
            speed: self.state.speed,
            // The foot is the projection: there is no error along the path but rounding.
            e_along: e.x_e,
            e_cross: e.y_e,
            e_norm: e.x_e.hypot(e.y_e),
            psi_e: e.psi_e,
        }
    }

    /// The foot is where it is: only the lap is taken from `xi`.
    fn place_target(&mut self, xi: f64) {
        if xi.is_finite() {
            self.foot = Foot::locate(&*self.path, Vector2::new(self.state.x, self.state.y), xi);
            self.believed = self.foot;
        }
    }

    fn is_sound(&self) -> bool {
        [self.foot.xi, self.force, self.turning.from, self.turning.to, self.v_ref].iter().all(|x| x.is_finite())
            && self.state.to_vector().iter().all(|x| x.is_finite())
    }

    fn refused(&self) -> u64 {
        self.refused
    }

    fn warnings(&self) -> Vec<Warning> {
        vec![
            Warning { what: LIMITED, count: self.near_singular },
            Warning { what: AT_CENTRE, count: self.singular },
            Warning { what: SATURATED, count: self.saturated },
            Warning { what: REFUSED, count: self.refused },
        ]
    }
}

#[cfg(test)]
#[path = "trimming_tests.rs"]
mod tests;
