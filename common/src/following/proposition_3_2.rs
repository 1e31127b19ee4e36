//! The second solution for wheeled robots, Proposition 3.2: that of Proposition 3.1 with Δ ≡ 0.
//!
//! Without Δ the heading comes to the approach angle by itself, whatever the distance does: V₁ of (3.23) decays at
//! 2 min(k₁, k₄) (k₄ and not the printed k₂, erratum 3.10), and the distance follows as in a cascade.

use super::proposition_3_1::{Bend, Coupling, Errors, Gains, Motion, Sense, Steering, steering, target_speed};

/// The law of Proposition 3.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposition32 {
    gains: Gains,
}

impl Proposition32 {
    /// The law with these gains, or what is wrong with them.
    pub fn new(gains: Gains) -> Result<Proposition32, String> {
        Ok(Proposition32 { gains: gains.checked()? })
    }

    /// Its gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// ṡ = v cos ψ_e + k₃ x_e (3.17).
    pub fn target_speed(&self, e: &Errors, v: f64) -> f64 {
        target_speed(self.gains.k_3, e, v)
    }

    /// (3.16): (3.13) with Δ ≡ 0.
    pub fn steer(&self, e: &Errors, motion: &Motion, bend: &Bend, sense: Sense) -> Steering {
        steering(&self.gains, Coupling::None, e, motion, bend, sense)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;
    use proptest::prelude::*;

    use super::*;
    use crate::following::proposition_3_1::{Approach, Proposition31};
    use crate::path::Path;
    use crate::path::sinusoid::Sinusoid;
    use crate::vehicle::integrate::rk4_step;

    fn gains() -> Gains {
        let approach = Approach::Arcsine { k_2: 0.8, epsilon_0: 0.2 };
        Gains { k_1: 1.3, k_3: 0.7, k_4: 2.1, approach, ..Gains::default() }
    }

    fn law() -> Proposition32 {
        Proposition32::new(gains()).unwrap()
    }

    /// State (x, y, ψ, v, r, ξ) of the loop closed continuously on a sinusoid, with m = I = 1 and a constant force.
    type State = SVector<f64, 6>;

    fn path() -> Sinusoid {
        Sinusoid::new(0.5, 1.0, 4.0, 0.3, 0.0).unwrap()
    }

    fn errors(x: &State) -> Errors {
        Errors::of(&path().at(x[5]), x[0], x[1], x[2])
    }

    fn answer(x: &State, force: f64) -> Steering {
        let motion = Motion { v: x[3], v_dot: force, r: x[4], ..Motion::default() };
        law().steer(&errors(x), &motion, &Bend::of(&path().at(x[5])), Sense::Forward.after(x[3], 0.0))
    }

    fn flow(x: &State, force: f64) -> State {
        let steering = answer(x, force);
        let xi_dot = steering.s_dot / path().at(x[5]).r();
        State::from([x[3] * x[2].cos(), x[3] * x[2].sin(), x[4], force, steering.r_dot, xi_dot])
    }

    /// The two squares of V₁ (3.23).
    fn squares(x: &State, force: f64) -> [f64; 2] {
        let steering = answer(x, force);
        [(errors(x).psi_e - steering.sigma).powi(2), (x[4] - steering.phi).powi(2)]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// V̇₁ = −k₁(ψ_e − σ)² − k₄(r − φ)² along the closed loop: a wrong term anywhere in φ̇ breaks it.
        #[test]
        fn v_1_falls_as_below_3_23_with_k_4(
            xi in -2.0..2.0f64, x_e in -0.8..0.8f64, y_e in 0.05..0.8f64, psi_e in -2.5..2.5f64,
            v in 0.1..1.0f64, r in -1.0..1.0f64, force in -0.5..0.5f64,
        ) {
            let target = path().at(xi);
            let t = target.planar_tangent();
            let p = target.p.xy() + t * x_e + nalgebra::Vector2::new(-t.y, t.x) * y_e;
            let x = State::from([p.x, p.y, target.heading() + psi_e, v, r, xi]);
            let (along, h) = (flow(&x, force), 2e-4);
            let v_1 = |n: f64| 0.5 * squares(&(x + n * h * along), force).iter().sum::<f64>();
            let measured = (8.0 * (v_1(1.0) - v_1(-1.0)) - (v_1(2.0) - v_1(-2.0))) / (12.0 * h);
            let [heading, rate] = squares(&x, force);
            let exact = -1.3 * heading - 2.1 * rate;
            prop_assert!((measured - exact).abs() < 1e-6 * (1.0 + exact.abs()), "{measured} {exact}");
        }
    }

    #[test]
    fn the_robot_comes_to_its_path_and_v_1_decays_at_least_at_twice_the_smaller_gain() {
        let mut x = State::from([-0.3, 2.4, 2.0, 0.4, 0.0, 0.0]);
        let start = squares(&x, 0.0).iter().sum::<f64>();
        for step in 1..=4000 {
            x = rk4_step(|_, x, _: &(), _: &()| flow(x, 0.0), 0.0, &x, &(), &(), 0.01);
            let bound = start * (-2.0 * 1.3 * 0.01 * f64::from(step)).exp();
            assert!(squares(&x, 0.0).iter().sum::<f64>() <= bound * (1.0 + 1e-6) + 1e-12, "after {step} steps");
        }
        let e = errors(&x);
        assert!(e.x_e.abs() + e.y_e.abs() + e.psi_e.abs() < 1e-3, "{e:?}");
    }

    #[test]
    fn it_differs_from_proposition_3_1_off_the_path_only() {
        let one = Proposition31::new(gains()).unwrap();
        let (motion, bend) = (Motion { v: 0.5, r: 0.1, ..Motion::default() }, Bend { c_c: 0.2, dc_ds: 0.1 });
        let on = Errors { x_e: 0.3, y_e: 0.0, psi_e: 0.0 };
        assert_eq!(
            one.steer(&on, &motion, &bend, Sense::Forward).phi,
            law().steer(&on, &motion, &bend, Sense::Forward).phi
        );
        // At the heading of the approach φ of (3.13) has −v y_e cos σ more (erratum 3.2).
        let sigma = -(0.4f64).asin();
        let off = Errors { x_e: 0.0, y_e: 0.2, psi_e: sigma };
        let [a, b] =
            [one.steer(&off, &motion, &bend, Sense::Forward), law().steer(&off, &motion, &bend, Sense::Forward)];
        assert!((a.phi - b.phi + 0.5 * 0.2 * sigma.cos()).abs() < 1e-15);
    }

    #[test]
    fn the_target_goes_along_with_the_vehicle_and_waits_for_it() {
        // ṡ = v cos ψ_e + k₃x_e with k₃ = 0.7.
        let e = Errors { x_e: 0.3, y_e: 9.0, psi_e: 1.1 };
        assert!((law().target_speed(&e, 0.5) - (0.5 * 1.1f64.cos() + 0.21)).abs() < 1e-15);
        assert_eq!(
            law().target_speed(&e, 0.5),
            law().steer(&e, &Motion { v: 0.5, ..Motion::default() }, &Bend::of(&path().at(0.0)), Sense::Forward).s_dot
        );
    }
}
