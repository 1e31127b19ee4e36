//! Path-following of an underactuated vehicle in space: Theorem 4.7, made to work.
//!
//! The theorem wants torques about all three axes; the vehicle of section 4.6 has none about x. The working law
//! (erratum 4.10) takes roll as measured and passive: its virtual controls are the thrust and the pitch and yaw
//! rates, the measured roll rate is fed forward, and δ = (δ₁, 0, 0). With the nominal rate v_n of the target,
//!
//! ```text
//! q = Rᵀ p'   q₂ = Rᵀ p''   e = Rᵀ(p − p_d)   φ = v − v_n q + k_e M⁻¹ e − δ
//! h₁ = −v_n M q₂ − k_e q    h₂ = f_v + k_e v + v_n h₁ − v̇_n M q
//! Γ = S(M q) − M S(q)       B_w = S(M δ) + v_n Γ
//! (u₁, ω₂d, ω₃d) = [e₁, B_w e₂, B_w e₃]⁻¹ (−h₂ − M⁻¹ e − k_φ φ − B_w e₁ ω₁)
//! τ = −f_ω + J d/dt(ω_d) − (B_w)ᵀ M φ − k_z z₂        (pitch and yaw), z₂ = ω − ω_d
//! ```
//!
//! With diagonal M the 3×3 matrix has, apart from its first column, one entry per row, so the solve is two divisions.
//! d/dt(ω_d) is exact and uses the actual rate of the target. Theorem 4.7 takes v_L as constant; the terms with v̇_n
//! keep the result exact while the formation speed ramps.

use nalgebra::Vector3;

use crate::path::PathPoint;
use crate::vehicle::attitude::vertical_in_body;
use crate::vehicle::auv::{Auv, AuvInput, AuvState};

/// The gains of the working law, in the units t, m, s, kN (erratum 4.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// k_e, position error to velocity \[t/s\], positive. Errors decay with k_e / m_ii.
    pub k_e: f64,
    /// k_φ, velocity error to force \[t/s\], positive. Velocity errors decay with k_φ / m_ii.
    #[doc(alias = "k_φ")]
    pub k_phi: f64,
    /// k_z, turning-rate error to torque \[kN m s\], positive.
    pub k_z: f64,
    /// k_η, decay of the target's own speed error in (4.53) \[1/s\], positive; only type I uses it.
    #[doc(alias = "k_η")]
    pub k_eta: f64,
    /// δ₁, the velocity towards which the velocity error is driven instead of zero \[m/s\]. Negative: a positive one
    /// drives the hull tail-first; its size is bounded from below by [`Gains::smallest_delta1`] (erratum 4.11).
    #[doc(alias = "δ")]
    pub delta1: f64,
}

impl Default for Gains {
    /// Known to work for a Sirene-like vehicle at the speeds of section 4.6.
    fn default() -> Gains {
        Gains { k_e: 0.5, k_phi: 1.0, k_z: 4.0, k_eta: 1.0, delta1: -0.3 }
    }
}

impl Gains {
    /// Erratum 4.11: |δ₁| must exceed |v_n| |p'| max(m_ii − m₁₁)/m₁₁, or the 3×3 matrix can lose rank.
    pub fn smallest_delta1(auv: &Auv, fastest_v_n: f64, largest_stretch: f64) -> f64 {
        let m = auv.parameters().mass;
        (fastest_v_n * largest_stretch).abs() * (m.y - m.x).abs().max((m.z - m.x).abs()) / m.x
    }

    /// Whether a vehicle can fly with these gains: `fastest_v_n` is the largest nominal rate of the target \[1/s\],
    /// `largest_stretch` the largest |p'| of its path \[m per unit of ξ\]. The error names every reason against it.
    pub fn validate(&self, auv: &Auv, fastest_v_n: f64, largest_stretch: f64) -> Result<(), String> {
        let mut reasons = self.faults();
        let smallest = Gains::smallest_delta1(auv, fastest_v_n, largest_stretch);
        if !smallest.is_finite() {
            reasons.push(format!("nominal rate {fastest_v_n} 1/s and |p'| = {largest_stretch} m must be finite"));
        } else if self.delta1.abs() <= smallest {
            reasons.push(format!(
                "|delta1| = {} m/s must exceed {smallest:.4} m/s, which is |v_n| |p'| (max m - m11)/m11: otherwise the \
                 thrust and turning rates that the law asks for can become unbounded",
                self.delta1.abs()
            ));
        }
        if reasons.is_empty() { Ok(()) } else { Err(reasons.join("; ")) }
    }

    /// What is wrong with the gains for any vehicle and speed.
    fn faults(&self) -> Vec<String> {
        let positive = [("k_e", self.k_e), ("k_phi", self.k_phi), ("k_z", self.k_z), ("k_eta", self.k_eta)];
        let mut faults: Vec<String> = positive
            .iter()
            .filter(|(_, gain)| !(*gain > 0.0 && gain.is_finite()))
            .map(|(name, gain)| format!("{name} must be positive, not {gain}"))
            .collect();
        if !(self.delta1 < 0.0 && self.delta1.is_finite()) {
            faults.push(format!("delta1 must be negative, not {} m/s: others drive the hull tail-first", self.delta1));
        }
        faults
    }

    /// Erratum 4.12: the steady error along the body's x-axis that δ leaves \[m\],
    /// e₁ = m₁₁ δ₁ / (k_e + 1/k_φ), when the target moves at the nominal rate.
    pub fn predicted_bias(&self, auv: &Auv) -> f64 {
        self.predicted_bias_at(auv, 0.0)
    }

    /// The same when the target moves at another rate: `surplus` is (γ̇ − v_n)|p'| \[m/s\],
    /// e₁ = m₁₁ (δ₁ − surplus (1 + k_e/k_φ)) / (k_e + 1/k_φ), from e-dot = φ-dot = 0 on a straight path.
    pub fn predicted_bias_at(&self, auv: &Auv, surplus: f64) -> f64 {
        let Gains { k_e, k_phi, delta1, .. } = *self;
        auv.parameters().mass.x * (delta1 - surplus * (1.0 + k_e / k_phi)) / (k_e + 1.0 / k_phi)
    }

    /// α₂ in steady motion along a straight path whose |p'| is `stretch` \[m\], `surplus` being γ̇ − v_n \[1/s\], in which it is affine:
    /// −|p'|(e₁ + k_e m₁₁φ₁) with e₁ of [`Gains::predicted_bias_at`] and φ₁ = −(e₁/m₁₁ + k_e|p'| surplus)/k_φ.
    #[doc(alias = "α_2")]
    pub fn steady_alpha_2(&self, auv: &Auv, surplus: f64, stretch: f64) -> f64 {
        let Gains { k_e, k_phi, .. } = *self;
        let m = auv.parameters().mass.x;
        let e = self.predicted_bias_at(auv, surplus * stretch);
        let phi = -(e / m + surplus * k_e * stretch) / k_phi;
        -stretch * (e + phi * m * k_e)
    }

    /// The steady rate of the target under (4.53) \[1/s\]: α₂ does not vanish when δ ≠ 0, so type I travels slower
    /// than its reference (erratum 4.14). `stretch` is |p'|; a straight path is assumed.
    ///
    /// α₂ = a₀ + a₁ x is affine in x = γ̇ − v_n, and η = γ̇ − v_r = −α₂/k_η gives x.
    pub fn predicted_rate_type_1(&self, auv: &Auv, v_n: f64, v_r: f64, stretch: f64) -> f64 {
        let [a_0, at_one] = [0.0, 1.0].map(|x| self.steady_alpha_2(auv, x, stretch));
        let a_1 = at_one - a_0;
        v_n + (v_r - v_n - a_0 / self.k_eta) / (1.0 + a_1 / self.k_eta)
    }
}

/// How the virtual target moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetMotion {
    /// γ̇ = v_r + η with η̇ = −α₂ − k_η η, (4.53): the target waits for its vehicle.
    TypeI,
    /// γ̇ = v_r: the path-following error does not reach the coordination.
    TypeII,
}

/// The rate of the virtual target: what the law plans with and what happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetRate {
    /// v_n \[1/s\]: v_L, or v_L* when delays make the fleet travel at v_L* (erratum 4.3).
    pub nominal: f64,
    /// v̇_n \[1/s²\], taken as constant.
    pub nominal_dot: f64,
    /// γ̇ \[1/s\].
    #[doc(alias = "γ")]
    pub actual: f64,
}

/// The law's output with the errors it acts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Thrust and torques.
    pub input: AuvInput,
    /// α₂ of (4.46), by which the target's surplus rate acts on W₃.
    #[doc(alias = "α_2")]
    pub alpha_2: f64,
    /// e, the position error in body axes \[m\].
    pub e: Vector3<f64>,
    /// φ, the velocity error \[m/s\].
    #[doc(alias = "φ")]
    pub phi: Vector3<f64>,
    /// z₂, the errors of pitch and yaw rate \[rad/s\].
    pub z_2: [f64; 2],
    /// d/dt(ω_d), how fast the pitch and yaw rates that the law wants change \[rad/s²\].
    pub w_d_dot: [f64; 2],
    /// True if the matrix was too close to singular and its entries were limited, see [`Theorem47::evaluate`].
    pub limited: bool,
}

/// The path-following law of Theorem 4.7 for one vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Theorem47 {
    gains: Gains,
    auv: Auv,
    /// M δ, of which only the first component is not zero.
    m_delta: f64,
}

/// The smallest divisor of the 3×3 solve, as a part of its value m₁₁ |δ₁| at v_n = 0.
const SMALLEST_DIVISOR: f64 = 0.05;

impl Theorem47 {
    /// The law, or what is wrong with its gains at any speed; see [`Gains::validate`] for what depends on the speed.
    pub fn new(gains: Gains, auv: Auv) -> Result<Theorem47, String> {
        let faults = gains.faults();
        if !faults.is_empty() {
            return Err(faults.join("; "));
        }
        Ok(Theorem47 { gains, auv, m_delta: auv.parameters().mass.x * gains.delta1 })
    }
    /// Its gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }
    /// The vehicle it is made for.
    pub fn auv(&self) -> &Auv {
        &self.auv
    }

    /// The law of the module's head.
    ///
    /// The two divisors of the solve keep their sign while |δ₁| is above the bound of erratum 4.11. If it is not (or
    /// by less than 5 %, tail-first), they are held at 5 % of m₁₁ |δ₁| on their own side of zero: the law then turns
    /// to the same side as before, (4.51) no longer holds, and [`Evaluation::limited`] says so. A finite state, point
    /// and rate of ordinary size have a finite answer.
    pub fn evaluate(&self, state: &AuvState, target: &PathPoint, rate: TargetRate) -> Evaluation {
        self.evaluate_with(state, target, rate, 1.0)
    }

    /// `gamma_sign` is +1; the tests show with −1 that the printed Γ does not do (erratum 4.9).
    #[inline(always)]
    fn evaluate_with(&self, state: &AuvState, target: &PathPoint, rate: TargetRate, gamma_sign: f64) -> Evaluation {
        let Gains { k_e, k_phi, k_z, .. } = self.gains;
        let TargetRate { nominal: v_n, nominal_dot: v_n_dot, actual: gamma_dot } = rate;
        let c = self.auv.parameters();
        let (m, inverse_m) = (c.mass, self.auv.inverse_mass());
        let (v, w) = (&state.velocity, &state.spin);

        // The path and the error in body axes.
        let rotation = state.attitude.to_rotation_matrix();
        let to_body = |x: &Vector3<f64>| rotation.matrix().tr_mul(x);
        let q = to_body(&target.d1);
        let q_2 = to_body(&target.d2);
        let q_3 = to_body(&target.d3);
        let e = to_body(&(state.position - target.p));
        let vertical = vertical_in_body(&state.attitude);

        // Steps 1 and 2: velocity error and the terms of its rate.
        let m_q = m.component_mul(&q);
        let m_q_2 = m.component_mul(&q_2);
        let f_v = self.auv.force(v, &vertical);
        let f_w = self.auv.torque(v, w, &vertical);
        let mut phi = v - q * v_n + inverse_m.component_mul(&e) * k_e;
        phi.x -= self.gains.delta1;
        let m_phi = m.component_mul(&phi);
        let h_1 = -(m_q_2 * v_n + q * k_e);
        let h_2 = f_v + v * k_e + h_1 * v_n - m_q * v_n_dot;
        let alpha_2 = alpha_2(&e, &q, &m_phi, &h_1);

        // B_w = S(M δ) + v_n Γ, entry by entry; Γ of erratum 4.9.
        let [yx, zx, zy] = [m.y - m.x, m.z - m.x, m.z - m.y];
        let g = gamma_sign * v_n;
        let b_1 = Vector3::new(0.0, g * zy * q.z, g * zy * q.y);
        let b_2 = Vector3::new(-g * zx * q.z, 0.0, self.m_delta - g * zx * q.x);
        let b_3 = Vector3::new(g * yx * q.y, -self.m_delta + g * yx * q.x, 0.0);

        // The solve: the last row gives ω₂d, the middle one ω₃d, the first one u₁.
        let smallest = SMALLEST_DIVISOR * self.m_delta.abs();
        let pitch = Divisor::limited(b_2.z, -smallest);
        let yaw = Divisor::limited(b_3.y, smallest);
        let wanted = -(h_2 + inverse_m.component_mul(&e) + phi * k_phi + b_1 * w.x);
        let w_2d = wanted.z * pitch.inverse;
        let w_3d = wanted.y * yaw.inverse;
        let thrust = wanted.x - b_2.x * w_2d - b_3.x * w_3d;

        // Their rates, with the model's v̇ and ω̇₁ and the actual γ̇.
        let v_dot = self.auv.acceleration(v, w, &f_v, thrust);
        let w_1_dot = f_w.x * self.auv.inverse_inertia().x;
        let q_dot = q.cross(w) + q_2 * gamma_dot;
        let q_2_dot = q_2.cross(w) + q_3 * gamma_dot;
        let e_dot = e.cross(w) + v - q * gamma_dot;
        let phi_dot = v_dot - q_dot * v_n - q * v_n_dot + inverse_m.component_mul(&e_dot) * k_e;
        let h_1_dot = -(m.component_mul(&q_2_dot) * v_n + m_q_2 * v_n_dot + q_dot * k_e);
        let f_v_dot = self.auv.force_rate(v, &v_dot, &vertical.cross(w));
        let h_2_dot = f_v_dot + v_dot * k_e + h_1 * v_n_dot + h_1_dot * v_n - m.component_mul(&q_dot) * v_n_dot;
        let g_q_dot = (q_dot * v_n + q * v_n_dot) * gamma_sign;
        let b_1_dot = Vector3::new(0.0, zy * g_q_dot.z, zy * g_q_dot.y);
        let wanted_dot = -(h_2_dot + inverse_m.component_mul(&e_dot) + phi_dot * k_phi + b_1_dot * w.x + b_1 * w_1_dot);
        let w_2d_dot = pitch.quotient_rate(w_2d, wanted_dot.z, -zx * g_q_dot.x);
        let w_3d_dot = yaw.quotient_rate(w_3d, wanted_dot.y, yx * g_q_dot.x);

        // Step 3: (4.50) about y and z.
        let z_2 = [w.y - w_2d, w.z - w_3d];
        let input = AuvInput {
            thrust,
            pitch_torque: -f_w.y + c.inertia.y * w_2d_dot - b_2.dot(&m_phi) - k_z * z_2[0],
            yaw_torque: -f_w.z + c.inertia.z * w_3d_dot - b_3.dot(&m_phi) - k_z * z_2[1],
        };
        Evaluation { input, alpha_2, e, phi, z_2, w_d_dot: [w_2d_dot, w_3d_dot], limited: pitch.limited || yaw.limited }
    }

    /// α₂ of (4.46) alone, as [`Theorem47::evaluate`] gives it: it needs the target's nominal rate `v_n` \[1/s\], not the
    /// actual one, so that coordination can use it to decide that.
    #[doc(alias = "α_2")]
    pub fn alpha_2(&self, state: &AuvState, target: &PathPoint, v_n: f64) -> f64 {
        let k_e = self.gains.k_e;
        let m = self.auv.parameters().mass;
        let rotation = state.attitude.to_rotation_matrix();
        let to_body = |x: &Vector3<f64>| rotation.matrix().tr_mul(x);
        let (q, q_2) = (to_body(&target.d1), to_body(&target.d2));
        let e = to_body(&(state.position - target.p));
        let mut phi = state.velocity - q * v_n + self.auv.inverse_mass().component_mul(&e) * k_e;
        phi.x -= self.gains.delta1;
        let h_1 = -(m.component_mul(&q_2) * v_n + q * k_e);
        alpha_2(&e, &q, &m.component_mul(&phi), &h_1)
    }

    /// (4.49): W₃ = ½ eᵀe + ½ φᵀM²φ + ½ z₂ᵀJz₂.
    #[doc(alias = "W_3")]
    pub fn lyapunov(&self, at: &Evaluation) -> f64 {
        let c = self.auv.parameters();
        let m_phi = c.mass.component_mul(&at.phi);
        let turning = c.inertia.y * at.z_2[0] * at.z_2[0] + c.inertia.z * at.z_2[1] * at.z_2[1];
        0.5 * (at.e.norm_squared() + m_phi.norm_squared() + turning)
    }

    /// (4.51): Ẇ₃ = −k_e eᵀM⁻¹e + eᵀδ − k_φ φᵀMφ − k_z z₂ᵀz₂ + α₂ (γ̇ − v_n), as its five terms.
    pub fn lyapunov_rate_terms(&self, at: &Evaluation, rate: TargetRate) -> [f64; 5] {
        let Gains { k_e, k_phi, k_z, delta1, .. } = self.gains;
        [
            -k_e * self.auv.inverse_mass().component_mul(&at.e).dot(&at.e),
            at.e.x * delta1,
            -k_phi * self.auv.parameters().mass.component_mul(&at.phi).dot(&at.phi),
            -k_z * (at.z_2[0] * at.z_2[0] + at.z_2[1] * at.z_2[1]),
            at.alpha_2 * (rate.actual - rate.nominal),
        ]
    }
}

/// (4.46): α₂ = α₁ + φᵀM h₁, with α₁ = −eᵀRᵀp'.
#[doc(alias = "α_2")]
fn alpha_2(e: &Vector3<f64>, q: &Vector3<f64>, m_phi: &Vector3<f64>, h_1: &Vector3<f64>) -> f64 {
    m_phi.dot(h_1) - e.dot(q)
}

/// A divisor kept away from zero on its own side.
struct Divisor {
    inverse: f64,
    limited: bool,
}

impl Divisor {
    /// `value`, or `bound` if it is not beyond it; the sign of `bound` tells the side.
    fn limited(value: f64, bound: f64) -> Divisor {
        let inside = value * bound.signum() >= bound.abs();
        Divisor { inverse: (if inside { value } else { bound }).recip(), limited: !inside }
    }
    /// The rate of `quotient` = a/d from ȧ and ḋ; a limited divisor does not move.
    fn quotient_rate(&self, quotient: f64, a_dot: f64, d_dot: f64) -> f64 {
        (a_dot - if self.limited { 0.0 } else { quotient * d_dot }) * self.inverse
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::coordination::auxiliary_4_59::Auxiliary;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
    use crate::path::Path;
    use crate::random::Stream;
    use crate::vehicle::attitude::{from_yaw_pitch_roll, quaternion_rate, to_inertial};
    use crate::vehicle::auv::AuvParameters;
    use crate::vehicle::sirene::sirene;
    use nalgebra::{Quaternion, SVector, UnitQuaternion};
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_4, TAU};

    /// The path of section 4.6, turned about the vertical by `turn` and shifted.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct Helix {
        pub(crate) turn: f64,
        pub(crate) shift: Vector3<f64>,
    }

    impl Helix {
        /// (20 cos, 20 sin, 0.05 γ + z₀) with the period 400 and the phase −3π/4.
        pub(crate) fn section_4_6(z_0: f64) -> Helix {
            Helix { turn: 0.0, shift: Vector3::new(0.0, 0.0, z_0) }
        }
        /// |p'|, the same everywhere.
        pub(crate) fn stretch() -> f64 {
            (20.0 * TAU / 400.0f64).hypot(0.05)
        }
    }

    impl Path for Helix {
        fn at(&self, xi: f64) -> PathPoint {
            let k = TAU / 400.0;
            let (s, c) = (k * xi - 3.0 * FRAC_PI_4 + self.turn).sin_cos();
            PathPoint {
                p: Vector3::new(20.0 * c, 20.0 * s, 0.05 * xi) + self.shift,
                d1: Vector3::new(-20.0 * k * s, 20.0 * k * c, 0.05),
                d2: Vector3::new(-20.0 * k * k * c, -20.0 * k * k * s, 0.0),
                d3: Vector3::new(20.0 * k * k * k * s, -20.0 * k * k * k * c, 0.0),
            }
        }
        fn search_range(&self) -> (f64, f64) {
            (0.0, 400.0)
        }
    }

    fn law() -> Theorem47 {
        Theorem47::new(Gains::default(), sirene()).expect("the default gains are valid")
    }

    /// The closed loop in continuous time: p, quaternion (x y z w), v, ω, γ, η, v_n.
    type Loop = SVector<f64, 16>;

    struct ClosedLoop {
        law: Theorem47,
        motion: TargetMotion,
        v_r: f64,
        v_n_dot: f64,
        gamma_sign: f64,
    }

    impl ClosedLoop {
        fn evaluate(&self, x: &Loop) -> (AuvState, TargetRate, Evaluation) {
            let state = AuvState {
                position: x.fixed_rows::<3>(0).into(),
                attitude: UnitQuaternion::new_unchecked(Quaternion::new(x[6], x[3], x[4], x[5])),
                velocity: x.fixed_rows::<3>(7).into(),
                spin: x.fixed_rows::<3>(10).into(),
            };
            let rate = TargetRate { nominal: x[15], nominal_dot: self.v_n_dot, actual: self.v_r + x[14] };
            let target = Helix::section_4_6(-10.0).at(x[13]);
            (state, rate, self.law.evaluate_with(&state, &target, rate, self.gamma_sign))
        }
        fn flow(&self, x: &Loop) -> Loop {
            let (s, rate, at) = self.evaluate(x);
            let auv = self.law.auv();
            let up = vertical_in_body(&s.attitude);
            let q_dot = quaternion_rate(&s.attitude, &s.spin);
            let v_dot = auv.acceleration(&s.velocity, &s.spin, &auv.force(&s.velocity, &up), at.input.thrust);
            let w_dot = auv.spin_rate(&auv.torque(&s.velocity, &s.spin, &up), &at.input);
            let mut dot = Loop::zeros();
            dot.fixed_rows_mut::<3>(0).copy_from(&to_inertial(&s.attitude, &s.velocity));
            dot.fixed_rows_mut::<4>(3).copy_from(&q_dot.coords);
            dot.fixed_rows_mut::<3>(7).copy_from(&v_dot);
            dot.fixed_rows_mut::<3>(10).copy_from(&w_dot);
            dot[13] = rate.actual;
            dot[14] = match self.motion {
                TargetMotion::TypeI => -at.alpha_2 - self.law.gains().k_eta * x[14],
                TargetMotion::TypeII => 0.0,
            };
            dot[15] = self.v_n_dot;
            dot
        }
        fn step(&self, x: &Loop, h: f64) -> Loop {
            let k1 = self.flow(x);
            let k2 = self.flow(&(x + k1 * (0.5 * h)));
            let k3 = self.flow(&(x + k2 * (0.5 * h)));
            let k4 = self.flow(&(x + k3 * h));
            x + (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (h / 6.0)
        }
        /// The time derivative of `f` along the loop, by the central difference of fourth order.
        fn derivative(&self, x: &Loop, f: impl Fn(&Loop) -> f64) -> f64 {
            let h = 2e-4;
            let (ahead, back) = (self.step(x, h), self.step(x, -h));
            let (far, far_back) = (self.step(&ahead, h), self.step(&back, -h));
            (8.0 * (f(&ahead) - f(&back)) - (f(&far) - f(&far_back))) / (12.0 * h)
        }
        /// Ẇ₃ of the loop against (4.51), relative to the sizes of its terms.
        fn identity_residual(&self, x: &Loop) -> f64 {
            let measured = self.derivative(x, |x| self.law.lyapunov(&self.evaluate(x).2));
            let (_, rate, at) = self.evaluate(x);
            let terms = self.law.lyapunov_rate_terms(&at, rate);
            (measured - terms.iter().sum::<f64>()).abs() / terms.iter().map(|t| t.abs()).sum::<f64>()
        }
    }

    /// Anywhere around the path, upright or not, with a ramping formation speed and an own rate.
    fn random_loop(random: &mut Stream, motion: TargetMotion, gamma_sign: f64) -> (ClosedLoop, Loop) {
        let gamma = random.uniform(0.0, 400.0);
        let position = Helix::section_4_6(-10.0).at(gamma).p + Vector3::from_fn(|_, _| random.uniform(-5.0, 5.0));
        let mut angle = |limit: f64| random.uniform(-limit, limit);
        let attitude = from_yaw_pitch_roll(angle(3.0), angle(1.3), angle(1.5));
        let mut x = Loop::zeros();
        x.fixed_rows_mut::<3>(0).copy_from(&position);
        x.fixed_rows_mut::<4>(3).copy_from(&attitude.coords);
        for i in 7..13 {
            x[i] = random.uniform(-0.8, 0.8);
        }
        (x[13], x[14], x[15]) = (gamma, random.uniform(-0.3, 0.3), random.uniform(0.1, 0.6));
        let (v_r, v_n_dot) = (random.uniform(0.2, 0.7), random.uniform(-0.1, 0.1));
        // Not neutrally buoyant either: the identity does not need it.
        let parameters = AuvParameters {
            weight: 39.0,
            centre_of_buoyancy: Vector3::new(0.05, -0.04, -0.36),
            ..*sirene().parameters()
        };
        let auv = Auv::new(parameters).expect("valid");
        // No gain is one, nor like another: each must be where it belongs.
        let gains = Gains { k_e: 0.6, k_phi: 1.7, k_z: 3.0, k_eta: 0.8, delta1: -0.3 };
        let law = Theorem47::new(gains, auv).expect("valid");
        (ClosedLoop { law, motion, v_r, v_n_dot, gamma_sign }, x)
    }

    #[test]
    fn the_lyapunov_function_falls_as_the_theorem_says() {
        let mut random = Stream::new(47, "identity");
        for case in 0..200 {
            let motion = if case % 2 == 0 { TargetMotion::TypeI } else { TargetMotion::TypeII };
            let (closed, x) = random_loop(&mut random, motion, 1.0);
            let residual = closed.identity_residual(&x);
            assert!(residual < 1e-6, "case {case}: {residual:e}");
        }
    }

    #[test]
    fn the_printed_gamma_does_not_satisfy_it() {
        let mut random = Stream::new(49, "printed");
        let mut residuals: Vec<f64> = (0..50)
            .map(|_| {
                let (closed, x) = random_loop(&mut random, TargetMotion::TypeII, -1.0);
                closed.identity_residual(&x)
            })
            .collect();
        residuals.sort_by(f64::total_cmp);
        assert!(residuals[5] > 1e-4 && residuals[25] > 1e-2, "{residuals:?}");
    }

    #[test]
    fn the_rates_of_the_wanted_turning_rates_are_exact() {
        let mut random = Stream::new(48, "wanted rates");
        let mut limited = 0;
        for case in 0..100 {
            let (closed, mut x) = random_loop(&mut random, TargetMotion::TypeI, 1.0);
            // Every other one far beyond the bound of δ, where a divisor is held.
            x[15] *= if case % 2 == 0 { 1.0 } else { 20.0 };
            let at = closed.evaluate(&x).2;
            limited += u32::from(at.limited);
            let exact = at.w_d_dot;
            for axis in 0..2 {
                let wanted = |x: &Loop| x[11 + axis] - closed.evaluate(x).2.z_2[axis];
                let measured = closed.derivative(&x, wanted);
                let scale = 1.0 + exact[axis].abs();
                assert!((measured - exact[axis]).abs() < 1e-6 * scale, "case {case}: {measured} {}", exact[axis]);
            }
        }
        assert!((10..90).contains(&limited), "{limited}");
    }

    #[test]
    fn the_closed_form_solve_is_the_matrix_solve() {
        let mut random = Stream::new(46, "solve");
        for _ in 0..50 {
            let (closed, x) = random_loop(&mut random, TargetMotion::TypeII, 1.0);
            let (state, rate, at) = closed.evaluate(&x);
            let (auv, gains) = (closed.law.auv(), closed.law.gains());
            let m = nalgebra::Matrix3::from_diagonal(&auv.parameters().mass);
            let point = Helix::section_4_6(-10.0).at(x[13]);
            let body = state.attitude.inverse();
            let q = body * point.d1;
            let delta = Vector3::new(gains.delta1, 0.0, 0.0);
            let gamma = (m * q).cross_matrix() - m * q.cross_matrix();
            let b_w = (m * delta).cross_matrix() + gamma * rate.nominal;
            let h_1 = -(m * (body * point.d2) * rate.nominal + q * gains.k_e);
            let f_v = auv.force(&state.velocity, &vertical_in_body(&state.attitude));
            let h_2 = f_v + state.velocity * gains.k_e + h_1 * rate.nominal - m * q * rate.nominal_dot;
            let inverse = m.try_inverse().expect("positive");
            let right = -h_2 - inverse * at.e - at.phi * gains.k_phi - b_w.column(0) * state.spin.x;
            let matrix = nalgebra::Matrix3::from_columns(&[Vector3::x(), b_w.column(1).into(), b_w.column(2).into()]);
            let solved = matrix.lu().solve(&right).expect("regular");
            let wanted = Vector3::new(at.input.thrust, state.spin.y - at.z_2[0], state.spin.z - at.z_2[1]);
            assert!((solved - wanted).norm() < 1e-12 * (1.0 + solved.norm()));
        }
    }

    #[test]
    fn alpha_2_alone_is_that_of_the_law_whatever_the_actual_rate() {
        let mut random = Stream::new(50, "alpha_2");
        for case in 0..50 {
            let (closed, x) = random_loop(&mut random, TargetMotion::TypeII, 1.0);
            let (state, rate, at) = closed.evaluate(&x);
            let alone = closed.law.alpha_2(&state, &Helix::section_4_6(-10.0).at(x[13]), rate.nominal);
            assert!((alone - at.alpha_2).abs() <= 1e-12 * (1.0 + alone.abs()), "case {case}: {alone} {}", at.alpha_2);
        }
    }

    #[test]
    fn coordination_and_path_following_share_a_lyapunov_function_that_falls() {
        // V_c = ½θᵀθ + ½zᵀz + ΣW₃ with θᵀθ = γᵀLγ, under (4.59) and (4.60), where η and z go on as the law says:
        // V̇_c = −ηᵀA₁η − zᵀA₂z − Σ(k_e eᵀM⁻¹e − eᵀδ + k_φ φᵀMφ + k_z z₂ᵀz₂), erratum 4.15.
        let (a_1, a_2, v_l) = (3.0, 5.0, 0.4);
        let law = Auxiliary::fixed(a_1, a_2).expect("positive");
        let star: [&[usize]; 3] = [&[1], &[0, 2], &[1]];
        let mut random = Stream::new(415, "V_c");
        for case in 0..40 {
            let fleet: Vec<(ClosedLoop, Loop)> = (0..3)
                .map(|_| {
                    let (mut closed, mut x) = random_loop(&mut random, TargetMotion::TypeII, 1.0);
                    (closed.v_r, closed.v_n_dot, x[15]) = (v_l, 0.0, v_l);
                    x[13] = random.uniform(70.0, 80.0);
                    let there = Helix::section_4_6(-10.0).at(x[13]).p;
                    x.fixed_rows_mut::<3>(0).copy_from(&(there + Vector3::from_fn(|_, _| random.uniform(-3.0, 3.0))));
                    (closed, x)
                })
                .collect();
            let (mut measured, mut expected) = (0.0, 0.0);
            for (i, (closed, x)) in fleet.iter().enumerate() {
                let (state, ..) = closed.evaluate(x);
                let point = Helix::section_4_6(-10.0).at(x[13]);
                let alpha_2 = closed.law.alpha_2(&state, &point, v_l);
                let heard = star[i].iter().map(|&j| Neighbour { xi: fleet[j].1[13], ..Neighbour::default() });
                let heard: Vec<Neighbour> = heard.collect();
                let own = Own { xi: x[13], alpha_2, ..Own::default() };
                let mut one = law.vehicle(i);
                // Something in z, and then z itself: what it asks for when nothing drives it.
                let rate_of = |one: &mut dyn VehicleLaw, own: &Own, heard: &[Neighbour]| match one.demand(
                    SpeedReference::default(),
                    own,
                    heard,
                ) {
                    Demand::Rate(rate) => rate,
                    other => panic!("{other:?}"),
                };
                let z_of = |one: &mut dyn VehicleLaw| rate_of(one, &Own::default(), &[]);
                rate_of(one.as_mut(), &Own { xi: random.uniform(-9.0, 9.0), ..own }, &heard);
                one.advance(0.5);
                let z = z_of(one.as_mut());
                let eta = rate_of(one.as_mut(), &own, &heard);
                one.advance(1e-7);
                let z_dot = (z_of(one.as_mut()) - z) / 1e-7;
                let l_gamma: f64 = heard.iter().map(|j| x[13] - j.xi).sum();
                let mut x = *x;
                x[14] = eta;
                measured += closed.derivative(&x, |x| closed.law.lyapunov(&closed.evaluate(x).2));
                measured += l_gamma * (v_l + eta) + z * z_dot;
                let (_, rate, at) = closed.evaluate(&x);
                expected += -a_1 * eta * eta - a_2 * z * z;
                expected += closed.law.lyapunov_rate_terms(&at, rate)[..4].iter().sum::<f64>();
            }
            let scale = 1.0 + expected.abs();
            assert!((measured - expected).abs() < 1e-5 * scale, "case {case}: {measured} {expected}");
        }
    }

    #[test]
    fn the_predictions_are_those_of_the_errata() {
        let (gains, auv, stretch) = (Gains::default(), sirene(), Helix::stretch());
        // At v_n = γ̇, and at v_n = 0.5, γ̇ = 1/3 (erratum 4.3).
        assert!((gains.predicted_bias(&auv) + 0.940).abs() < 5e-4);
        assert!((gains.predicted_bias_at(&auv, (1.0 / 3.0 - 0.5) * stretch) + 0.691).abs() < 5e-4);
        assert!((gains.predicted_rate_type_1(&auv, 0.5, 0.5, stretch) - 0.3897).abs() < 2e-4);
        // Erratum 4.11: 0.065 m/s at v_L* and 0.098 m/s at v_L.
        assert!((Gains::smallest_delta1(&auv, 1.0 / 3.0, stretch) - 0.065).abs() < 5e-4);
        assert!((Gains::smallest_delta1(&auv, 0.5, stretch) - 0.098).abs() < 5e-4);
    }

    #[test]
    fn what_is_predicted_is_where_the_law_rests() {
        // Errata 4.12 and 4.14 on a straight level path: there the body neither gains nor loses speed, and neither does the
        // target under (4.53).
        let gains = Gains { k_e: 0.6, k_phi: 1.7, k_z: 3.0, k_eta: 0.8, delta1: -0.3 };
        let (auv, stretch, v_n, v_r) = (sirene(), 0.7, 0.5, 0.45);
        let law = Theorem47::new(gains, auv).expect("valid");
        let still = Vector3::zeros();
        let point = PathPoint { p: still, d1: Vector3::new(stretch, 0.0, 0.0), d2: still, d3: still };
        let rest = |rate: f64| {
            let state = AuvState {
                velocity: Vector3::new(rate * stretch, 0.0, 0.0),
                ..AuvState::at_rest(
                    Vector3::new(gains.predicted_bias_at(&auv, (rate - v_n) * stretch), 0.0, 0.0),
                    UnitQuaternion::identity(),
                )
            };
            let at = law.evaluate(&state, &point, TargetRate { nominal: v_n, nominal_dot: 0.0, actual: rate });
            let force = auv.force(&state.velocity, &vertical_in_body(&state.attitude));
            (auv.acceleration(&state.velocity, &state.spin, &force, at.input.thrust).x, at.alpha_2)
        };
        for rate in [v_n, 0.3, 0.62] {
            assert!(rest(rate).0.abs() < 1e-12, "{rate}: {:?}", rest(rate));
        }
        assert_eq!(gains.predicted_bias(&auv), gains.predicted_bias_at(&auv, 0.0));
        let rate = gains.predicted_rate_type_1(&auv, v_n, v_r, stretch);
        let (_, alpha_2) = rest(rate);
        assert!((-alpha_2 - gains.k_eta * (rate - v_r)).abs() < 1e-12 && (rate - v_r).abs() > 1e-3, "{rate} {alpha_2}");
    }

    #[test]
    fn erratum_4_11_the_bound_of_delta_1_and_where_the_solve_is_limited() {
        let of_mass = |y: f64, z: f64| {
            let parameters = AuvParameters { mass: Vector3::new(4.0, y, z), ..*sirene().parameters() };
            Auv::new(parameters).expect("positive")
        };
        // Whichever axis differs most from the x-axis, to either side.
        for (y, z) in [(7.0, 5.0), (5.0, 7.0), (1.0, 5.0), (5.0, 1.0)] {
            let smallest = Gains::smallest_delta1(&of_mass(y, z), -0.5, 0.8);
            assert!((smallest - 0.5 * 0.8 * 3.0 / 4.0).abs() < 1e-15, "{y} {z}: {smallest}");
        }
        // Tail-first, q = −|p'|: the divisors are −m₁₁|δ₁| + v_n(m₃₃ − m₁₁)|p'| and m₁₁|δ₁| − v_n(m₂₂ − m₁₁)|p'|, each limited
        // where less than 5 % of m₁₁|δ₁| is left, and never where its masses are equal.
        let still = Vector3::zeros();
        let point = PathPoint { p: still, d1: Vector3::new(-0.8, 0.0, 0.0), d2: still, d3: still };
        let state = AuvState::at_rest(still, UnitQuaternion::identity());
        for (y, z) in [(7.0, 4.0), (4.0, 7.0)] {
            let law = Theorem47::new(Gains::default(), of_mass(y, z)).expect("valid");
            let limited = |left: f64| {
                let nominal = (1.0 - left) * 4.0 * 0.3 / (3.0 * 0.8);
                law.evaluate(&state, &point, TargetRate { nominal, nominal_dot: 0.0, actual: nominal }).limited
            };
            assert!(!limited(0.055) && limited(0.045) && limited(-0.5), "{y} {z}");
        }
        let equal = Theorem47::new(Gains::default(), of_mass(4.0, 4.0)).expect("valid");
        let fast = TargetRate { nominal: 9.0, nominal_dot: 0.0, actual: 9.0 };
        assert!(!equal.evaluate(&state, &point, fast).limited);
    }

    #[test]
    fn unsuitable_gains_are_refused_with_the_reason() {
        let (auv, stretch) = (sirene(), Helix::stretch());
        let reason = |gains: Gains| gains.validate(&auv, 0.5, stretch).expect_err("must be refused");
        assert!(Gains::default().validate(&auv, 0.5, stretch).is_ok());
        assert!(reason(Gains { delta1: 0.3, ..Gains::default() }).contains("tail-first"));
        assert!(reason(Gains { delta1: -0.09, ..Gains::default() }).contains("must exceed 0.098"));
        assert!(reason(Gains { delta1: f64::NEG_INFINITY, ..Gains::default() }).contains("tail-first"));
        assert!(reason(Gains { k_z: f64::INFINITY, ..Gains::default() }).contains("k_z must be positive"));
        assert!(
            reason(Gains { k_z: 0.0, k_e: f64::NAN, ..Gains::default() })
                .contains("k_e must be positive, not NaN; k_z")
        );
        assert!(Gains::default().validate(&auv, f64::INFINITY, stretch).is_err());
        assert!(Theorem47::new(Gains { delta1: 0.3, ..Gains::default() }, auv).is_err());
    }

    proptest! {
        #[test]
        fn a_vehicle_that_lags_is_pushed_and_one_that_leads_is_not(lag in 0.5..20.0f64) {
            // On the path, aligned, at the path's speed, but behind or ahead of the target.
            let point = Helix::section_4_6(0.0).at(30.0);
            let tangent = point.d1.normalize();
            let attitude = from_yaw_pitch_roll(tangent.y.atan2(tangent.x), -tangent.z.asin(), 0.0);
            let thrust = |along: f64| {
                let state = AuvState {
                    velocity: Vector3::new(0.3, 0.0, 0.0),
                    ..AuvState::at_rest(point.p + tangent * along, attitude)
                };
                let rate = TargetRate { nominal: 0.5, nominal_dot: 0.0, actual: 0.5 };
                law().evaluate(&state, &point, rate).input.thrust
            };
            prop_assert!(thrust(-lag) > thrust(0.0) && thrust(lag) < thrust(0.0));
        }

        #[test]
        fn the_answer_is_finite_and_limited_only_beyond_the_bound(
            p in prop::array::uniform3(-1e3..1e3f64), angles in prop::array::uniform3(-3.1..3.1f64),
            v in prop::array::uniform3(-5.0..5.0f64), w in prop::array::uniform3(-5.0..5.0f64),
            xi in -1e4..1e4f64, v_n in -4.0..4.0f64, actual in -4.0..4.0f64,
        ) {
            let state = AuvState {
                position: p.into(),
                attitude: from_yaw_pitch_roll(angles[0], angles[1], angles[2]),
                velocity: v.into(),
                spin: w.into(),
            };
            let rate = TargetRate { nominal: v_n, nominal_dot: 0.1, actual };
            let at = law().evaluate(&state, &Helix::section_4_6(0.0).at(xi), rate);
            prop_assert!(at.input.is_finite() && at.alpha_2.is_finite());
            let margin = 0.3 * (1.0 - SMALLEST_DIVISOR);
            if Gains::smallest_delta1(&sirene(), v_n, Helix::stretch()) < margin {
                prop_assert!(!at.limited);
            }
        }

        #[test]
        fn the_law_sees_only_the_relative_geometry(
            turn in -3.0..3.0f64, shift in prop::array::uniform3(-50.0..50.0f64), yaw in -3.0..3.0f64,
        ) {
            let (turned, shift) = (from_yaw_pitch_roll(turn, 0.0, 0.0), Vector3::from(shift));
            let here = AuvState {
                velocity: Vector3::new(0.3, -0.1, 0.2),
                spin: Vector3::new(0.1, 0.2, -0.3),
                ..AuvState::at_rest(Vector3::new(-10.0, -12.0, 3.0), from_yaw_pitch_roll(yaw, 0.3, -0.2))
            };
            let there =
                AuvState { position: turned * here.position + shift, attitude: turned * here.attitude, ..here };
            let rate = TargetRate { nominal: 0.5, nominal_dot: 0.02, actual: 0.4 };
            let of = |state, turn, shift| law().evaluate(state, &Helix { turn, shift }.at(7.0), rate).input;
            let (a, b) = (of(&here, 0.0, Vector3::zeros()), of(&there, turn, shift));
            prop_assert!((a.thrust - b.thrust).abs() < 1e-11);
            prop_assert!((a.pitch_torque - b.pitch_torque).abs() < 1e-11);
            prop_assert!((a.yaw_torque - b.yaw_torque).abs() < 1e-11);
        }
    }
}
