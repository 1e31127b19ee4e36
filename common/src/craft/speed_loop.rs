//! What a vehicle that is driven by a force makes of what coordination commands.

use crate::coordination::{Demand, DemandKind, SpeedReference};
use crate::path::PathPoint;
use crate::positive::positive;

/// What coordination commands: the mission's choice of law decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpeedLoop {
    /// The derivative of the speed-tracking error, (3.39): laws of chapter 3.
    Acceleration,
    /// The rate v_r of the virtual target, (4.21): the robot's speed is driven to R v_r.
    Rate {
        /// k₀, rate at which the speed comes to R v_r \[1/s\], positive; well above the gain of coordination.
        k_0: f64,
    },
}

impl SpeedLoop {
    /// The loop of a vehicle whose coordination law demands this, with the gain that it has if it is asked for a rate.
    pub fn of(demand: DemandKind, k_0: f64) -> SpeedLoop {
        match demand {
            DemandKind::Acceleration => SpeedLoop::Acceleration,
            DemandKind::Rate => SpeedLoop::Rate { k_0 },
        }
    }

    /// The loop if its gain is one, otherwise what is wrong with it.
    pub(super) fn checked(self) -> Result<SpeedLoop, String> {
        if let SpeedLoop::Rate { k_0 } = self {
            positive("the gain k_0", k_0)?;
        }
        Ok(self)
    }

    /// The speed-tracking error η = v − R v_L (3.38), or zero for a vehicle that takes a rate.
    pub(super) fn eta(self, v: f64, r: f64, reference: SpeedReference) -> f64 {
        match self {
            SpeedLoop::Acceleration => v - r * reference.v_l,
            SpeedLoop::Rate { .. } => 0.0,
        }
    }

    /// The kind of demand that it answers.
    pub fn takes(self) -> DemandKind {
        match self {
            SpeedLoop::Acceleration => DemandKind::Acceleration,
            SpeedLoop::Rate { .. } => DemandKind::Rate,
        }
    }

    /// The forward acceleration F/m that `demand` asks for, the speed that is wanted, and the rate that is recorded;
    /// nothing if the demand is of the other kind.
    pub(super) fn answer(
        self,
        demand: Demand,
        reference: SpeedReference,
        target: &PathPoint,
        v: f64,
        xi_rate: f64,
    ) -> Option<Answer> {
        let (r, r_dot) = (target.r(), target.dr_dxi() * xi_rate);
        let SpeedReference { v_l, v_l_dot } = reference;
        match (self, demand) {
            // F/m = u + R'(ξ) ξ̇ v_L + R v̇_L with the actual ξ̇ (3.39), erratum 3.7.
            (SpeedLoop::Acceleration, Demand::Acceleration(u)) => {
                Some(Answer { v_dot: u + r_dot * v_l + r * v_l_dot, wanted: r * v_l, v_ref: v_l })
            }
            // The sense of travel of a robot that may not be told v_L is its own.
            (SpeedLoop::Acceleration, Demand::Forward(v_dot)) => Some(Answer { v_dot, wanted: v, v_ref: v_l }),
            // F/m = d/dt(R v_r) − k₀ (v − R v_r); the derivative of v_r itself is not known and left out.
            (SpeedLoop::Rate { k_0 }, Demand::Rate(v_r)) => {
                Some(Answer { v_dot: r_dot * v_r - k_0 * (v - r * v_r), wanted: r * v_r, v_ref: v_r })
            }
            _ => None,
        }
    }
}

/// See [`SpeedLoop::answer`].
pub(super) struct Answer {
    pub(super) v_dot: f64,
    pub(super) wanted: f64,
    pub(super) v_ref: f64,
}
