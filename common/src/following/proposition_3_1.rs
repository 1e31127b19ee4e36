//! Following a virtual target that moves along the path by a law of its own: Proposition 3.1, wheeled robots.
//!
//! Errors in the frame {T} of the virtual target (3.10), their kinematics (3.11), the law (3.13)-(3.15). The
//! derivative φ̇ in (3.14) is written out (Appendix 6.1, items 8 to 10, and erratum 3.8); it needs v̇ = F/m, which
//! is known because the force is commanded.
//!
//! What Propositions 3.2 and 3.3 have in common with it is [`steering`]: they differ in Δ and in the side-slip.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use crate::path::PathPoint;
use crate::path::geometry::wrap_angle;
use crate::positive::{not_negative, positive};

/// Position and heading relative to the frame {T} of the virtual target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Along the tangent \[m\], positive ahead of the target.
    pub x_e: f64,
    /// Across the path \[m\], positive to its left.
    pub y_e: f64,
    /// ψ_e = ψ_B − ψ_T \[rad\], within \[−π, π\].
    #[doc(alias = "ψ_e")]
    pub psi_e: f64,
}

impl Errors {
    /// (x_e, y_e) = R(ψ_T)ᵀ (q − p) (3.10), for a vehicle at `x`, `y` \[m\] with `heading` ψ_B \[rad\].
    pub fn of(target: &PathPoint, x: f64, y: f64, heading: f64) -> Errors {
        let tangent = target.planar_tangent();
        let offset = nalgebra::Vector2::new(x, y) - target.p.xy();
        Errors { x_e: tangent.dot(&offset), y_e: tangent.perp(&offset), psi_e: wrap_angle(heading - target.heading()) }
    }
}

/// The way a vehicle moves along its body axis: sign(v) without its jump at round-off (erratum 3.9).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sense {
    /// sign(v) = +1.
    #[default]
    Forward,
    /// sign(v) = −1.
    Backward,
}

impl Sense {
    /// +1 or −1.
    pub fn sign(self) -> f64 {
        match self {
            Sense::Forward => 1.0,
            Sense::Backward => -1.0,
        }
    }

    /// The sense after `speed` is seen: it changes only when the speed is beyond ±`threshold`.
    #[must_use]
    pub fn after(self, speed: f64, threshold: f64) -> Sense {
        if speed > threshold {
            Sense::Forward
        } else if speed < -threshold {
            Sense::Backward
        } else {
            self
        }
    }
}

/// Which speed decides on the [`Sense`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SenseOf {
    /// That of the vehicle, as printed in (3.13): V_p never increases while |v| is above the threshold.
    ActualSpeed,
    /// The desired one: calmer where transients carry v through zero, but while v opposes it the vehicle moves away.
    DesiredSpeed,
}

/// σ(y_e), the angle at which to approach the path, for sign(v) = +1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Approach {
    /// σ = −asin(k₂ y/(|y| + ε₀)) (3.13).
    Arcsine {
        /// k₂, the sine of the steepest approach; 0 < k₂ ≤ 1.
        k_2: f64,
        /// ε₀, the distance at which half of k₂ is reached \[m\], positive.
        epsilon_0: f64,
    },
    /// σ = −(2ψ_a/π) atan(y/ℓ) (Appendix 6.1, item 6; there ℓ = 1 m, erratum 3.8).
    Arctangent {
        /// ψ_a, the steepest approach \[rad\]; 0 < ψ_a ≤ π/2.
        psi_a: f64,
        /// ℓ, the distance at which half of ψ_a is reached \[m\], positive.
        length: f64,
    },
}

/// σ with its derivatives with respect to y_e.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sigma {
    value: f64,
    d1: f64,
    d2: f64,
}

impl Approach {
    fn checked(self) -> Result<Approach, String> {
        match self {
            Approach::Arcsine { k_2, epsilon_0 } => {
                positive("k_2", k_2)?;
                positive("epsilon_0", epsilon_0)?;
                if k_2 <= 1.0 { Ok(self) } else { Err(format!("k_2 must be at most 1, it is {k_2}")) }
            }
            Approach::Arctangent { psi_a, length } => {
                positive("psi_a", psi_a)?;
                positive("the length scale of the approach", length)?;
                if psi_a <= FRAC_PI_2 { Ok(self) } else { Err(format!("psi_a must be at most pi/2, it is {psi_a}")) }
            }
        }
    }

    fn sigma(&self, y: f64, sense: Sense) -> Sigma {
        let forward = match *self {
            Approach::Arcsine { k_2, epsilon_0 } => {
                // With D = |y| + ε₀, a = |y|/D, b = ε₀/D and sin σ = −w:
                //   w = k₂ a sgn y,  w' = k₂ b/D,  w'' = −2 k₂ b sgn y/D²,
                //   cos²σ = 1 − w² = (1 − k₂²) a² + b (1 + a), which no rounding makes zero.
                let d = y.abs() + epsilon_0;
                let (a, b) = (y.abs() / d, epsilon_0 / d);
                let side = if y == 0.0 { 0.0 } else { y.signum() };
                let (w, w_1, w_2) = (k_2 * a * side, k_2 * b / d, -2.0 * k_2 * b * side / (d * d));
                let cos = ((1.0 - k_2 * k_2) * a * a + b * (1.0 + a)).sqrt();
                Sigma { value: -w.asin(), d1: -w_1 / cos, d2: -(w_2 + w * (w_1 / cos).powi(2)) / cos }
            }
            Approach::Arctangent { psi_a, length } => {
                // σ' = −(2ψ_a/π)/ℓ / (1 + Y²),  σ'' = (2ψ_a/π)/ℓ² · 2Y/(1 + Y²)²,  Y = y/ℓ
                let (scale, y) = (FRAC_2_PI * psi_a, y / length);
                let d1 = -scale / length / (1.0 + y * y);
                Sigma { value: -scale * y.atan(), d1, d2: -2.0 * y * d1 / length / (1.0 + y * y) }
            }
        };
        let sign = sense.sign();
        Sigma { value: sign * forward.value, d1: sign * forward.d1, d2: sign * forward.d2 }
    }
}

/// The gains of Proposition 3.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// k₁, rate at which the heading comes to the approach angle \[1/s\], positive.
    pub k_1: f64,
    /// k₃, rate at which the virtual target comes to the vehicle \[1/s\], positive.
    pub k_3: f64,
    /// k₄, rate at which the turning rate comes to φ \[1/s\], positive.
    pub k_4: f64,
    /// The approach angle.
    pub approach: Approach,
    /// Which speed decides on sign(v).
    pub sense_of: SenseOf,
    /// The speed within which sign(v) is not changed \[m/s\], zero or positive; a few millimetres per second.
    pub sense_threshold: f64,
}

impl Default for Gains {
    /// Gains for a robot of the size of those in section 3.4, at some tenths of a metre per second.
    fn default() -> Gains {
        Gains {
            k_1: 1.0,
            k_3: 1.0,
            k_4: 2.0,
            approach: Approach::Arcsine { k_2: 0.8, epsilon_0: 0.2 },
            sense_of: SenseOf::ActualSpeed,
            sense_threshold: 5e-3,
        }
    }
}

impl Gains {
    /// The gains, or what is wrong with them.
    pub fn checked(self) -> Result<Gains, String> {
        positive("k_1", self.k_1)?;
        positive("k_3", self.k_3)?;
        positive("k_4", self.k_4)?;
        not_negative("the threshold of the sense of travel", self.sense_threshold)?;
        self.approach.checked()?;
        Ok(self)
    }

    /// The sense of travel that follows `previous` at speed `v` when `v_desired` is wanted.
    pub fn sense(&self, previous: Sense, v: f64, v_desired: f64) -> Sense {
        let speed = match self.sense_of {
            SenseOf::ActualSpeed => v,
            SenseOf::DesiredSpeed => v_desired,
        };
        previous.after(speed, self.sense_threshold)
    }
}

/// How the vehicle moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// v \[m/s\].
    pub v: f64,
    /// v̇ = F/m \[m/s²\], from the commanded force.
    pub v_dot: f64,
    /// r \[rad/s\].
    pub r: f64,
    /// The side-slip's motion; none for a wheeled robot.
    pub slip: Slip,
}

/// How the side-slip β moves, in (3.26) and erratum 3.3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slip {
    /// β̇ \[rad/s\].
    pub beta_dot: f64,
    /// β̈ \[rad/s²\].
    pub beta_ddot: f64,
}

/// The path at the virtual target, as far as the law needs it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// c_c \[1/m\].
    pub c_c: f64,
    /// dc_c/ds \[1/m²\].
    pub dc_ds: f64,
}

impl Bend {
    /// That of a point of a path.
    pub fn of(target: &PathPoint) -> Bend {
        Bend { c_c: target.curvature(), dc_ds: target.dcurvature_ds() }
    }
}

/// What the law asks, with the quantities of its proof.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// N/I, the turning acceleration (3.14) \[rad/s²\].
    pub r_dot: f64,
    /// ṡ, the speed of the virtual target along the path (3.15) \[m/s\].
    pub s_dot: f64,
    /// σ, the approach angle \[rad\].
    pub sigma: f64,
    /// φ, the turning rate at which the heading comes to σ \[rad/s\].
    pub phi: f64,
}

/// The law of Proposition 3.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposition31 {
    gains: Gains,
}

impl Proposition31 {
    /// The law with these gains, or what is wrong with them.
    pub fn new(gains: Gains) -> Result<Proposition31, String> {
        Ok(Proposition31 { gains: gains.checked()? })
    }

    /// The sense of travel that follows `previous` at speed `v` when `v_desired` is wanted.
    pub fn sense(&self, previous: Sense, v: f64, v_desired: f64) -> Sense {
        self.gains.sense(previous, v, v_desired)
    }

    /// ṡ = v cos ψ_e + k₃ x_e (3.15).
    pub fn target_speed(&self, e: &Errors, v: f64) -> f64 {
        target_speed(self.gains.k_3, e, v)
    }

    /// (3.13) to (3.15).
    pub fn steer(&self, e: &Errors, motion: &Motion, bend: &Bend, sense: Sense) -> Steering {
        steering(&self.gains, Coupling::MeanCosine, e, motion, bend, sense)
    }

    /// Its gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }
}

/// Δ of φ, by which the heading counters y_e in V_p.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// (3.13), with erratum 3.2.
    MeanCosine,
    /// Δ ≡ 0, Proposition 3.2.
    None,
}

/// ṡ = v cos ψ_e + k₃ x_e (3.15), (3.17), (3.32).
pub fn target_speed(k_3: f64, e: &Errors, v: f64) -> f64 {
    v * e.psi_e.cos() + k_3 * e.x_e
}

/// What the three propositions of section 3.2 have in common: (3.13) with its derivative, and the turning
/// acceleration φ̇ − k₄(r − φ) − (ψ_e − σ). With a side-slip, v is the total speed, ψ_e that of the flow frame, and φ
/// contains −β̇ (erratum 3.3).
#[inline]
pub fn steering(gains: &Gains, coupling: Coupling, e: &Errors, motion: &Motion, bend: &Bend, sense: Sense) -> Steering {
    let Gains { k_1, k_3, k_4, .. } = *gains;
    let Errors { x_e, y_e, psi_e } = *e;
    let Motion { v, v_dot, r, slip: Slip { beta_dot, beta_ddot } } = *motion;
    let Bend { c_c, dc_ds } = *bend;
    let (sin, cos) = psi_e.sin_cos();

    // (3.15)
    let s_dot = target_speed(k_3, e, v);
    // (3.11), (3.26)
    let x_e_dot = (y_e * c_c - 1.0) * s_dot + v * cos;
    let y_e_dot = -x_e * c_c * s_dot + v * sin;
    let psi_e_dot = r - c_c * s_dot + beta_dot;
    // Appendix 6.1, items 8 and 9
    let s_ddot = v_dot * cos - v * sin * psi_e_dot + k_3 * x_e_dot;
    let y_e_ddot =
        -x_e_dot * c_c * s_dot - x_e * dc_ds * s_dot.powi(2) - x_e * c_c * s_ddot + v_dot * sin + v * cos * psi_e_dot;
    // Items 6, 7 and 10
    let sigma = gains.approach.sigma(y_e, sense);
    let sigma_dot = sigma.d1 * y_e_dot;
    let sigma_ddot = sigma.d2 * y_e_dot.powi(2) + sigma.d1 * y_e_ddot;
    let sigma = sigma.value;
    let (delta, delta_dot) = match coupling {
        Coupling::MeanCosine => {
            let slope = MeanCosine::between(psi_e, sigma);
            (slope.value, slope.rate(psi_e_dot, sigma_dot))
        }
        Coupling::None => (0.0, 0.0),
    };

    // (3.13), erratum 3.3
    let phi = c_c * s_dot - beta_dot + sigma_dot - k_1 * (psi_e - sigma) - v * y_e * delta;
    // Its derivative, erratum 3.8
    let phi_dot = dc_ds * s_dot.powi(2) + c_c * s_ddot - beta_ddot + sigma_ddot
        - k_1 * (psi_e_dot - sigma_dot)
        - (v_dot * y_e * delta + v * y_e_dot * delta + v * y_e * delta_dot);
    // (3.14)
    let r_dot = phi_dot - k_4 * (r - phi) - (psi_e - sigma);
    Steering { r_dot, s_dot, sigma, phi }
}

/// Δ = (sin a − sin b)/(a − b) of (3.13), the mean of the cosine between b and a, written so that it is smooth at
/// a = b: Δ = cos((a + b)/2) sinc((a − b)/2). Its limit there is cos b, not the printed 1 (erratum 3.2).
#[derive(Clone, Copy, Debug)]
struct MeanCosine {
    value: f64,
    /// ∂Δ/∂a.
    da: f64,
    /// ∂Δ/∂b.
    db: f64,
}

impl MeanCosine {
    fn between(a: f64, b: f64) -> MeanCosine {
        let (sin, cos) = (0.5 * (a + b)).sin_cos();
        let (sinc, sinc_1) = sinc(0.5 * (a - b));
        let (mean, difference) = (-0.5 * sin * sinc, 0.5 * cos * sinc_1);
        MeanCosine { value: cos * sinc, da: mean + difference, db: mean - difference }
    }

    fn rate(&self, a_dot: f64, b_dot: f64) -> f64 {
        self.da * a_dot + self.db * b_dot
    }
}

/// sin x/x and its derivative (x cos x − sin x)/x², by their series where these cancel.
fn sinc(x: f64) -> (f64, f64) {
    let square = x * x;
    if square < 1e-4 {
        (1.0 - square / 6.0 * (1.0 - square / 20.0), -x / 3.0 * (1.0 - square / 10.0 * (1.0 - square / 28.0)))
    } else {
        (x.sin() / x, (x * x.cos() - x.sin()) / square)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::{SVector, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::path::Path;
    use crate::path::circle::{Circle, Turn};
    use crate::path::line::Line;
    use crate::path::sinusoid::Sinusoid;
    use crate::vehicle::integrate::rk4_step;

    const ARCSINE: Approach = Approach::Arcsine { k_2: 0.8, epsilon_0: 0.2 };
    const ARCTANGENT: Approach = Approach::Arctangent { psi_a: 1.2, length: 0.5 };

    fn law(approach: Approach) -> Proposition31 {
        Proposition31::new(Gains { k_1: 1.3, k_3: 0.7, k_4: 2.1, approach, ..Gains::default() }).unwrap()
    }

    /// The loop of Proposition 3.1 closed continuously, with m = I = 1: state (x, y, ψ, v, r, ξ), a constant force.
    struct Loop<'a> {
        law: Proposition31,
        path: &'a dyn Path,
        force: f64,
    }

    type State = SVector<f64, 6>;

    impl Loop<'_> {
        fn errors(&self, state: &State) -> Errors {
            Errors::of(&self.path.at(state[5]), state[0], state[1], state[2])
        }

        fn steering(&self, state: &State) -> Steering {
            let motion = Motion { v: state[3], v_dot: self.force, r: state[4], ..Motion::default() };
            let sense = Sense::Forward.after(state[3], 0.0);
            self.law.steer(&self.errors(state), &motion, &Bend::of(&self.path.at(state[5])), sense)
        }

        fn derivative(&self, state: &State) -> State {
            let steering = self.steering(state);
            let [_, _, psi, v, r, xi] = (*state).into();
            let xi_dot = steering.s_dot / self.path.at(xi).r();
            State::from([v * psi.cos(), v * psi.sin(), r, self.force, steering.r_dot, xi_dot])
        }

        /// V_p of (3.18).
        fn v_p(&self, state: &State) -> f64 {
            let (e, steering) = (self.errors(state), self.steering(state));
            let heading = e.psi_e - steering.sigma;
            let rate = state[4] - steering.phi;
            0.5 * (e.x_e * e.x_e + e.y_e * e.y_e + heading * heading + rate * rate)
        }

        /// Its rate (3.19), with v y_e sin σ for the third term: with (3.13) that is −k₂|v| y_e²/(|y_e| + ε₀).
        fn v_p_dot(&self, state: &State) -> f64 {
            let (e, steering) = (self.errors(state), self.steering(state));
            let Gains { k_1, k_3, k_4, .. } = self.law.gains;
            -k_3 * e.x_e.powi(2) - k_1 * (e.psi_e - steering.sigma).powi(2) + state[3] * e.y_e * steering.sigma.sin()
                - k_4 * (state[4] - steering.phi).powi(2)
        }

        fn step(&self, state: &State, dt: f64) -> State {
            rk4_step(|_, x, _: &(), _: &()| self.derivative(x), 0.0, state, &(), &(), dt)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// (3.19) is an identity along the closed loop: a wrong term anywhere in φ̇ breaks it.
        #[test]
        fn v_p_decreases_at_the_rate_of_3_19(
            xi in -2.0..2.0f64, x_e in -0.8..0.8f64, y_e in 0.05..0.8f64, left: bool, psi_e in -2.5..2.5f64,
            v in 0.1..1.0f64, forward: bool, r in -1.0..1.0f64, force in -0.5..0.5f64, arcsine: bool,
        ) {
            let path = Sinusoid::new(0.5, 1.0, 4.0, 0.3, 0.0).unwrap();
            let closed = Loop { law: law(if arcsine { ARCSINE } else { ARCTANGENT }), path: &path, force };
            let target = path.at(xi);
            let (t, y_e) = (target.planar_tangent(), if left { y_e } else { -y_e });
            let v = if forward { v } else { -v };
            let state = State::from([
                target.p.x + t.x * x_e - t.y * y_e,
                target.p.y + t.y * x_e + t.x * y_e,
                target.heading() + psi_e,
                v,
                r,
                xi,
            ]);
            prop_assert!((closed.errors(&state).y_e - y_e).abs() < 1e-12);
            // The derivative of V_p in the direction of the vector field, by a difference of fourth order.
            let (along, h) = (closed.derivative(&state), 2e-4);
            let v_p = |steps: f64| closed.v_p(&(state + steps * h * along));
            let difference = (8.0 * (v_p(1.0) - v_p(-1.0)) - (v_p(2.0) - v_p(-2.0))) / (12.0 * h);
            let exact = closed.v_p_dot(&state);
            prop_assert!((difference - exact).abs() < 1e-6 * (1.0 + exact.abs()), "{difference} {exact}");
        }
    }

    #[test]
    fn the_third_term_of_3_19_is_the_printed_one() {
        for (y, v) in [(0.3, 0.5), (-0.3, 0.5), (0.3, -0.5), (-2.0, -0.5)] {
            let sigma = ARCSINE.sigma(y, Sense::Forward.after(v, 0.0)).value;
            let printed = -0.8 * v.abs() * y * y / (y.abs() + 0.2);
            assert!((v * y * sigma.sin() - printed).abs() < 1e-15);
        }
    }

    #[test]
    fn v_p_falls_by_the_integral_of_its_rate() {
        let path = Sinusoid::new(0.5, 0.0, 4.0, 0.0, 0.0).unwrap();
        let closed = Loop { law: law(ARCSINE), path: &path, force: 0.01 };
        let mut state = State::from([-0.3, 0.9, 0.4, 0.3, 0.0, 0.0]);
        let (start, dt, mut integral) = (closed.v_p(&state), 1e-3, 0.0);
        for _ in 0..2000 {
            let (middle, end) = (closed.step(&state, 0.5 * dt), closed.step(&state, dt));
            // Simpson's rule.
            let rates = closed.v_p_dot(&state) + 4.0 * closed.v_p_dot(&middle) + closed.v_p_dot(&end);
            integral += dt / 6.0 * rates;
            state = end;
        }
        let fall = closed.v_p(&state) - start;
        assert!(fall < -0.3 && (fall - integral).abs() < 1e-6, "{fall} {integral}");
    }

    #[test]
    fn on_the_path_it_turns_with_the_path() {
        let circle = Circle::new(Vector3::zeros(), 4.0, Turn::Right, 0.0, 1.0).unwrap();
        let bend = Bend::of(&circle.at(0.3));
        let motion = Motion { v: 2.0, r: -0.5, ..Motion::default() };
        let steering = law(ARCSINE).steer(&Errors::default(), &motion, &bend, Sense::Forward);
        assert!((steering.phi + 0.5).abs() < 1e-15 && steering.r_dot.abs() < 1e-14 && steering.s_dot == 2.0);
        // φ̇ = c_c v̇: accelerating in a bend takes a turning acceleration.
        let faster = law(ARCSINE).steer(&Errors::default(), &Motion { v_dot: 1.0, ..motion }, &bend, Sense::Forward);
        assert!((faster.r_dot + 0.25).abs() < 1e-14);
    }

    #[test]
    fn delta_tends_to_the_cosine() {
        // Erratum 3.2: cos 0.7 = 0.765, not 1.
        assert!((MeanCosine::between(0.7, 0.7).value - 0.7f64.cos()).abs() < 1e-16);
        let near = MeanCosine::between(0.7 + 1e-6, 0.7).value;
        assert!((near - 0.7f64.cos()).abs() < 1e-6);
    }

    #[test]
    fn delta_and_its_derivatives_are_those_of_the_quotient() {
        for (a, b) in [(0.9, -0.4), (2.0, 1.9), (-1.0, 1.3), (0.31, 0.3), (0.3195, 0.3)] {
            let quotient = |a: f64, b: f64| (a.sin() - b.sin()) / (a - b);
            let slope = MeanCosine::between(a, b);
            assert!((slope.value - quotient(a, b)).abs() < 1e-13);
            // From Δ(a − b) = sin a − sin b.
            assert!((slope.da - (a.cos() - slope.value) / (a - b)).abs() < 1e-10);
            assert!((slope.db - (slope.value - b.cos()) / (a - b)).abs() < 1e-10);
        }
    }

    #[test]
    fn the_approach_points_to_the_path_and_its_derivatives_are_exact() {
        for approach in [ARCSINE, ARCTANGENT, Approach::Arcsine { k_2: 1.0, epsilon_0: 0.1 }] {
            for sense in [Sense::Forward, Sense::Backward] {
                for y in [-3.0, -0.2, 0.01, 0.4, 10.0] {
                    let (h, here) = (1e-5, approach.sigma(y, sense));
                    let (before, after) = (approach.sigma(y - h, sense), approach.sigma(y + h, sense));
                    assert!(here.value * y * sense.sign() < 0.0, "a vehicle on the left turns right");
                    assert!((here.d1 - (after.value - before.value) / (2.0 * h)).abs() < 1e-5 * here.d1.abs());
                    assert!((here.d2 - (after.d1 - before.d1) / (2.0 * h)).abs() < 1e-5 * (1.0 + here.d2.abs()));
                }
            }
        }
        // Half of the steepest approach at the length scale: (3.13) and item 6 of Appendix 6.1.
        assert!((ARCSINE.sigma(0.2, Sense::Forward).value + 0.4f64.asin()).abs() < 1e-15);
        assert!((ARCTANGENT.sigma(0.5, Sense::Forward).value + 0.6).abs() < 1e-15);
    }

    #[test]
    fn far_away_with_the_steepest_gain_nothing_is_singular() {
        let approach = Approach::Arcsine { k_2: 1.0, epsilon_0: 1e-3 };
        for y in [0.0, 1e-300, 1e6, 1e12, -1e100] {
            let sigma = approach.sigma(y, Sense::Forward);
            assert!(sigma.value.abs() <= FRAC_PI_2 && sigma.d1.is_finite() && sigma.d2.is_finite(), "{y}: {sigma:?}");
        }
    }

    #[test]
    fn both_approaches_converge_from_either_side_and_in_either_sense() {
        let path = Line::new(Vector3::zeros(), 0.4, 1.0).unwrap();
        for approach in [ARCSINE, ARCTANGENT] {
            for (y, v) in [(1.0, 0.5), (-1.0, 0.5), (1.0, -0.5), (-1.0, -0.5)] {
                let closed = Loop { law: law(approach), path: &path, force: 0.0 };
                let mut state = State::from([0.0, y, 0.0, v, 0.0, 0.0]);
                for _ in 0..3000 {
                    state = closed.step(&state, 0.02);
                }
                let e = closed.errors(&state);
                assert!(e.x_e.abs() + e.y_e.abs() + e.psi_e.abs() < 1e-3, "{approach:?} {y} {v}: {e:?}");
                assert!(state[5] * v > 0.0, "the virtual target moves with the vehicle");
            }
        }
    }

    #[test]
    fn the_decay_is_bounded_as_in_3_20() {
        let path = Circle::new(Vector3::zeros(), 3.0, Turn::Left, 0.0, 1.0).unwrap();
        let closed = Loop { law: law(ARCSINE), path: &path, force: 0.0 };
        let mut state = State::from([3.6, -0.5, 1.0, 0.4, 0.0, 0.0]);
        let start = closed.v_p(&state);
        // c ≥ |y_e| from V_p ≤ ½c²; then (3.20).
        let c = (2.0 * start).sqrt();
        let rate = 2.0 * (0.8 / (c + 0.2) * 0.4f64).min(0.7);
        for step in 1..=1000 {
            state = closed.step(&state, 0.02);
            let bound = start * (-rate * 0.02 * f64::from(step)).exp();
            assert!(closed.v_p(&state) <= bound * (1.0 + 1e-9) + 1e-12, "after {step} steps");
        }
    }

    #[test]
    fn round_off_at_rest_does_not_turn_the_vehicle_around() {
        let sense = Sense::Forward;
        assert_eq!(sense.after(-1e-17, 5e-3), Sense::Forward);
        assert_eq!(sense.after(-0.01, 5e-3), Sense::Backward);
        assert_eq!(sense.after(-0.01, 5e-3).after(1e-3, 5e-3), Sense::Backward);
        assert_eq!(Sense::Backward.after(0.0, 0.0), Sense::Backward);
    }

    #[test]
    fn the_desired_speed_may_decide_on_the_sense() {
        let desired = Proposition31::new(Gains { sense_of: SenseOf::DesiredSpeed, ..Gains::default() }).unwrap();
        assert_eq!(desired.sense(Sense::Forward, -0.3, 0.2), Sense::Forward);
        assert_eq!(law(ARCSINE).sense(Sense::Forward, -0.3, 0.2), Sense::Backward);
    }

    #[test]
    fn gains_out_of_range_are_refused() {
        let with = |approach| Proposition31::new(Gains { approach, ..Gains::default() });
        assert!(with(Approach::Arcsine { k_2: 1.01, epsilon_0: 0.1 }).is_err());
        assert!(with(Approach::Arcsine { k_2: 0.5, epsilon_0: 0.0 }).is_err());
        assert!(with(Approach::Arctangent { psi_a: PI, length: 1.0 }).is_err());
        assert!(with(Approach::Arcsine { k_2: 1.0, epsilon_0: 0.1 }).is_ok());
        assert!(Proposition31::new(Gains { k_1: 0.0, ..Gains::default() }).is_err());
        assert!(Proposition31::new(Gains { k_3: 0.0, ..Gains::default() }).is_err());
        assert!(Proposition31::new(Gains { k_4: -1.0, ..Gains::default() }).is_err());
    }

    #[test]
    fn the_target_goes_along_with_the_vehicle_and_waits_for_it() {
        // ṡ = v cos ψ_e + k₃x_e with k₃ = 0.7.
        let e = Errors { x_e: 0.3, y_e: 9.0, psi_e: 1.1 };
        let one = law(Approach::Arcsine { k_2: 0.8, epsilon_0: 0.2 });
        assert!((one.target_speed(&e, 0.5) - (0.5 * 1.1f64.cos() + 0.21)).abs() < 1e-15);
    }

    #[test]
    fn a_threshold_of_the_sense_is_not_negative() {
        assert!(Proposition31::new(Gains { sense_threshold: -1.0, ..Gains::default() }).is_err());
    }

    #[test]
    fn errors_are_those_of_the_moving_frame() {
        let circle = Circle::new(Vector3::zeros(), 2.0, Turn::Left, 0.0, 1.0).unwrap();
        // At (2, 0) the tangent is +y and the left side is towards the centre.
        let e = Errors::of(&circle.at(0.0), 1.5, 0.3, FRAC_PI_2 + 0.1 + 4.0 * PI);
        assert!((e.x_e - 0.3).abs() < 1e-15 && (e.y_e - 0.5).abs() < 1e-15 && (e.psi_e - 0.1).abs() < 1e-14);
    }
}
