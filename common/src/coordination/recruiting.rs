//! What the laws of section 2.2 share: vehicles that learn their speeds from positions along the paths, by the
//! D-methodology.
//!
//! With S_i = Σ (ξ_i − ξ_j) over those that the law has vehicle i mind,
//!
//! ```text
//! F_i = −z_i − R_i b S_i
//! ż_i = a v̇_i + R_i c S_i + R_i d E_i        and + b_0 (v_i − R_i v_L) for the one vehicle that is told v_L
//! ```
//!
//! where E_i integrates S_i, in the laws that have it. Nothing is differentiated: ζ_i = z_i − a v_i has the derivative
//! of z_i without its first term. z_i is zero at the start, so that a vehicle keeps the speed with which it starts.
//!
//! Whom it does not hear a vehicle leaves out of S_i. If it hears nobody, ζ_i holds what was learnt, and the speed goes
//! to −ζ_i/a (that of the told vehicle to R_i v_L).

use super::disagreement::c;
use super::{Demand, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// a, b, c, the same for all vehicles: s³ + a s² + b s + c has the modes of a follower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// On the speed \[1/s\], positive.
    pub a: f64,
    /// On the distance along the paths \[1/s²\], positive.
    pub b: f64,
    /// On its integral \[1/s³\], positive, less than ab.
    pub c: f64,
}

impl Gains {
    /// The gains if the modes of a follower decay, otherwise what is wrong with them.
    pub(super) fn checked(self) -> Result<Gains, String> {
        let Gains { a, b, c } = self;
        positive("the gain a", a)?;
        positive("the gain b", b)?;
        positive("the gain c", c)?;
        if a * b > c { Ok(self) } else { Err(format!("c must be below a b = {}, it is {c}", a * b)) }
    }
}

/// The states of one vehicle.
#[derive(Clone, Debug)]
pub(super) struct Recruit {
    gains: Gains,
    /// d \[1/s⁴\], zero in laws without the extra integrator.
    d: f64,
    /// b_0 \[1/s²\] of the vehicle that is told v_L.
    b_0: Option<f64>,
    /// ζ \[m/s²\]; none before the first control period.
    zeta: Option<f64>,
    /// ζ̇ but for R d E, held.
    zeta_dot: f64,
    /// R, S and v/R as last seen.
    r: f64,
    ahead: f64,
    rate: f64,
    /// E \[units of ξ · s\].
    integral: f64,
}

impl Recruit {
    pub(super) fn new(gains: Gains, b_0: Option<f64>, d: f64) -> Recruit {
        Recruit { gains, d, b_0, zeta: None, zeta_dot: 0.0, r: 0.0, ahead: 0.0, rate: 0.0, integral: 0.0 }
    }

    /// The demand when the vehicle is `ahead` = S of those it minds.
    pub(super) fn demand(&mut self, reference: SpeedReference, own: &Own, ahead: f64) -> Demand {
        let Gains { a, b, c: c_gain } = self.gains;
        let zeta = *self.zeta.get_or_insert(-a * own.v);
        let z = a * own.v + zeta;
        let told = self.b_0.map_or(0.0, |b_0| b_0 * (own.v - own.r * reference.v_l));
        self.zeta_dot = told + own.r * c_gain * ahead;
        (self.r, self.ahead, self.rate) = (own.r, ahead, c(own) * own.v);
        Demand::Forward(-z - own.r * b * ahead)
    }

    /// Moves ζ and E over `dt` seconds with S held.
    pub(super) fn advance(&mut self, dt: f64) {
        let between = self.integral + 0.5 * self.ahead * dt;
        self.move_zeta(dt, between);
        self.integral += self.ahead * dt;
    }

    /// Moves ζ over `dt` seconds with E as others have it.
    pub(super) fn advance_with(&mut self, dt: f64, integral: f64) {
        self.move_zeta(dt, integral);
    }

    fn move_zeta(&mut self, dt: f64, integral: f64) {
        if let Some(zeta) = &mut self.zeta {
            *zeta += dt * (self.zeta_dot + self.r * self.d * integral);
        }
    }

    /// E \[units of ξ · s\].
    pub(super) fn integral(&self) -> f64 {
        self.integral
    }

    /// v/R as last seen: the rate at which a vehicle that is not told v_L takes its neighbours to move.
    pub(super) fn rate(&self) -> f64 {
        self.rate
    }
}

/// S over those of the neighbours that `minds` lets pass, and that are numbers.
pub(super) fn ahead_of(own: &Own, neighbours: &[Neighbour], minds: impl Fn(usize) -> bool) -> f64 {
    neighbours.iter().filter(|j| minds(j.vehicle) && j.xi.is_finite()).map(|j| own.xi - j.xi).sum()
}
