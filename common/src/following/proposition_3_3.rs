//! Path following of a fully actuated marine vehicle with a side-slip that is commanded: Proposition 3.3.
//!
//! The flow frame takes the place of the body: ψ_e = ψ_F − ψ_T = ψ_B + β − ψ_T (3.27), and the total speed v_t that of
//! v. The printed φ is that of a robot; as ψ̇_e contains β̇ (3.26), φ must contain −β̇ (erratum 3.3):
//!
//! ```text
//! β̇ = β̇_d − k₀(β − β_d)                                        the side-slip comes to what is wanted
//! φ = c_c ṡ − β̇ + σ̇ − k₁(ψ_e − σ) − v_t y_e Δ                   (3.13), erratum 3.3
//! τ_r = m_r(−f_r + φ̇ − k₄(r − φ) − (ψ_e − σ))                    (3.31)
//! ṡ = v_t cos ψ_e + k₃ x_e                                       (3.32)
//! ```

use super::proposition_3_1::{Bend, Coupling, Errors, Gains, Motion, Sense, Slip, Steering, steering, target_speed};
use crate::positive::positive;

/// The side-slip that is wanted at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedSlip {
    /// β_d \[rad\].
    pub beta: f64,
    /// β̇_d \[rad/s\].
    pub beta_dot: f64,
    /// β̈_d \[rad/s²\].
    pub beta_ddot: f64,
}

/// The law of Proposition 3.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposition33 {
    gains: Gains,
    k_0: f64,
    coupling: Coupling,
}

impl Proposition33 {
    /// The law with the gains of Proposition 3.1 and `k_0`, the rate at which the side-slip comes to what is wanted
    /// \[1/s\], positive; or what is wrong with them.
    pub fn new(gains: Gains, k_0: f64) -> Result<Proposition33, String> {
        let k_0 = positive("the gain of the side-slip", k_0)?;
        Ok(Proposition33 { gains: gains.checked()?, k_0, coupling: Coupling::MeanCosine })
    }

    /// Its gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// The sense of travel that follows `previous` at total speed `v_t` when `v_desired` is wanted.
    pub fn sense(&self, previous: Sense, v_t: f64, v_desired: f64) -> Sense {
        self.gains.sense(previous, v_t, v_desired)
    }

    /// β̇ = β̇_d − k₀(β − β_d), and its derivative β̈ = β̈_d − k₀(β̇ − β̇_d): known, because τ_β is commanded so.
    pub fn slip(&self, beta: f64, wanted: &WantedSlip) -> Slip {
        let rate = -self.k_0 * (beta - wanted.beta);
        Slip { beta_dot: wanted.beta_dot + rate, beta_ddot: wanted.beta_ddot - self.k_0 * rate }
    }

    /// ṡ (3.32).
    pub fn target_speed(&self, e: &Errors, v_t: f64) -> f64 {
        target_speed(self.gains.k_3, e, v_t)
    }

    /// ṙ that (3.31) asks for, with ψ_e in `e` that of the flow frame and `motion` with the total speed and
    /// [`slip`](Proposition33::slip).
    pub fn steer(&self, e: &Errors, motion: &Motion, bend: &Bend, sense: Sense) -> Steering {
        steering(&self.gains, self.coupling, e, motion, bend, sense)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;
    use proptest::prelude::*;

    use super::*;
    use crate::path::Path;
    use crate::path::sinusoid::Sinusoid;
    use crate::vehicle::integrate::rk4_step;

    const K_0: f64 = 0.9;

    fn law() -> Proposition33 {
        Proposition33::new(Gains { k_1: 1.3, k_3: 0.7, k_4: 2.1, ..Gains::default() }, K_0).unwrap()
    }

    /// β_d = 0.3 sin 0.2 t, as in erratum 3.3.
    fn wanted(t: f64) -> WantedSlip {
        let (sin, cos) = (0.2 * t).sin_cos();
        WantedSlip { beta: 0.3 * sin, beta_dot: 0.06 * cos, beta_ddot: -0.012 * sin }
    }

    /// (x, y, ψ_B, v_t, r, ξ, β, t): the loop in the flow frame, with v̇_t = 0 and β̇, ṙ as commanded.
    type State = SVector<f64, 8>;

    struct Loop {
        path: Sinusoid,
        /// As printed, φ does not know of the side-slip.
        printed: bool,
    }

    impl Loop {
        fn errors(&self, x: &State) -> Errors {
            Errors::of(&self.path.at(x[5]), x[0], x[1], x[2] + x[6])
        }
        fn steering(&self, x: &State) -> Steering {
            let slip = if self.printed { Slip::default() } else { law().slip(x[6], &wanted(x[7])) };
            let motion = Motion { v: x[3], v_dot: 0.0, r: x[4], slip };
            law().steer(&self.errors(x), &motion, &Bend::of(&self.path.at(x[5])), Sense::Forward)
        }
        fn flow(&self, x: &State) -> State {
            let (steering, slip) = (self.steering(x), law().slip(x[6], &wanted(x[7])));
            let (sin, cos) = (x[2] + x[6]).sin_cos();
            let xi_dot = steering.s_dot / self.path.at(x[5]).r();
            State::from([x[3] * cos, x[3] * sin, x[4], 0.0, steering.r_dot, xi_dot, slip.beta_dot, 1.0])
        }
        fn v_p(&self, x: &State) -> f64 {
            let (e, steering) = (self.errors(x), self.steering(x));
            0.5 * (e.x_e.powi(2) + e.y_e.powi(2) + (e.psi_e - steering.sigma).powi(2) + (x[4] - steering.phi).powi(2))
        }
        fn run(&self, mut x: State, seconds: f64) -> (State, f64) {
            let (steps, mut worst) = ((seconds / 0.01) as usize, 0f64);
            for step in 0..steps {
                x = rk4_step(|_, x, _: &(), _: &()| self.flow(x), 0.0, &x, &(), &(), 0.01);
                if step > steps / 2 {
                    worst = worst.max(self.errors(&x).y_e.abs());
                }
            }
            (x, worst)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// (3.19) holds for the marine vehicle too, with v_t, once φ knows β̇ and φ̇ knows β̈.
        #[test]
        fn v_p_decreases_at_the_rate_of_3_19(
            xi in -2.0..2.0f64, x_e in -0.8..0.8f64, y_e in 0.05..0.8f64, psi_e in -2.5..2.5f64,
            v in 0.1..1.0f64, r in -1.0..1.0f64, beta in -0.5..0.5f64, t in 0.0..30.0f64,
        ) {
            let closed = Loop { path: Sinusoid::new(0.5, 1.0, 4.0, 0.3, 0.0).unwrap(), printed: false };
            let target = closed.path.at(xi);
            let tangent = target.planar_tangent();
            let p = target.p.xy() + tangent * x_e + nalgebra::Vector2::new(-tangent.y, tangent.x) * y_e;
            let x = State::from([p.x, p.y, target.heading() + psi_e - beta, v, r, xi, beta, t]);
            let (along, h) = (closed.flow(&x), 2e-4);
            let v_p = |n: f64| closed.v_p(&(x + n * h * along));
            let measured = (8.0 * (v_p(1.0) - v_p(-1.0)) - (v_p(2.0) - v_p(-2.0))) / (12.0 * h);
            let (e, steering) = (closed.errors(&x), closed.steering(&x));
            let exact = -0.7 * e.x_e.powi(2) - 1.3 * (e.psi_e - steering.sigma).powi(2)
                + v * e.y_e * steering.sigma.sin() - 2.1 * (r - steering.phi).powi(2);
            prop_assert!((measured - exact).abs() < 1e-6 * (1.0 + exact.abs()), "{measured} {exact}");
        }
    }

    #[test]
    fn as_printed_centimetres_remain_for_ever_and_corrected_nothing_does() {
        // A line (a sinusoid of no amplitude): only the side-slip moves.
        let path = || Sinusoid::new(0.0, 0.0, 1.0, 0.0, 0.0).unwrap();
        let start = State::from([0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
        let (_, printed) = Loop { path: path(), printed: true }.run(start, 400.0);
        let (_, corrected) = Loop { path: path(), printed: false }.run(start, 400.0);
        // With the gains of this test 2.1 cm.
        assert!((printed - 0.0206).abs() < 1e-3 && corrected < 1e-9, "{printed} {corrected}");
    }

    #[test]
    fn without_side_slip_it_is_proposition_3_1() {
        let robot = crate::following::proposition_3_1::Proposition31::new(*law().gains()).unwrap();
        let e = Errors { x_e: 0.2, y_e: -0.4, psi_e: 0.3 };
        let (motion, bend) =
            (Motion { v: 0.4, v_dot: 0.1, r: 0.2, ..Motion::default() }, Bend { c_c: 0.3, dc_ds: -0.1 });
        assert_eq!(law().steer(&e, &motion, &bend, Sense::Forward), robot.steer(&e, &motion, &bend, Sense::Forward));
        assert!(Proposition33::new(*law().gains(), 0.0).is_err());
    }

    #[test]
    fn the_side_slip_comes_exponentially_to_what_is_wanted() {
        let slip = law().slip(0.5, &WantedSlip { beta: 0.2, ..WantedSlip::default() });
        assert!((slip.beta_dot + K_0 * 0.3).abs() < 1e-15 && (slip.beta_ddot - K_0 * K_0 * 0.3).abs() < 1e-15);
        // What is wanted is followed without error.
        let on = law().slip(wanted(3.0).beta, &wanted(3.0));
        assert_eq!((on.beta_dot, on.beta_ddot), (wanted(3.0).beta_dot, wanted(3.0).beta_ddot));
    }

    #[test]
    fn the_target_goes_along_with_the_flow_and_waits_for_it() {
        // ṡ = v_t cos ψ_e + k₃x_e with k₃ = 0.7.
        let e = Errors { x_e: 0.3, y_e: 9.0, psi_e: 1.1 };
        assert!((law().target_speed(&e, 0.5) - (0.5 * 1.1f64.cos() + 0.21)).abs() < 1e-15);
    }
}
