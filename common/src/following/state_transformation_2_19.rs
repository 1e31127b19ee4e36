//! The state transformation: section 2.1.2, (2.17) to (2.19).
//!
//! η = r − c_c v is zero at trimming whatever the speed, so changes of speed do not disturb path following. The price: v
//! and F must be known.

use super::trimming::{Deviation, Placement, TrimmingLaw, Turning};

/// The law (2.19).
#[derive(Clone, Debug, PartialEq)]
pub struct StateTransformation {
    placement: Placement,
    /// z = ∫ d_e dt \[m s\] (2.13).
    z: f64,
    seen: Deviation,
}

impl StateTransformation {
    /// The law with nothing integrated yet.
    pub fn new(placement: Placement) -> StateTransformation {
        StateTransformation { placement, z: 0.0, seen: Deviation::default() }
    }

    /// N/I = u_e + c_c v̇ with u_e = −k_1 η − k_2 d_e − k_3 ψ_e − k_4 z (2.19) \[rad/s²\].
    pub fn turning(&self, z: f64, seen: &Deviation) -> f64 {
        let k = self.placement.gains(seen.c_c, seen.v);
        let u_e = -k.k_1 * seen.eta() - k.k_2 * seen.d_e - k.k_3 * seen.psi_e - k.k_4 * z;
        u_e + seen.c_c * seen.v_dot
    }
}

impl TrimmingLaw for StateTransformation {
    fn see(&mut self, seen: &Deviation) {
        self.seen = *seen;
    }

    fn advance(&mut self, dt: f64) -> Turning {
        let held = self.turning(self.z, &self.seen);
        self.z += self.seen.d_e * dt;
        Turning { from: held, to: held }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    use super::StateTransformation;
    use crate::following::trimming::{Deviation, Placement, TrimmingLaw};

    type Vector5 = SVector<f64, 5>;

    /// The closed loop with v̇ = −a (v − v^c): rates of (v, r, d_e, ψ_e, z).
    fn closed_loop(law: &StateTransformation, x: &Vector5, c_c: f64, v_c: f64, a: f64) -> Vector5 {
        let v_dot = -a * (x[0] - v_c);
        let seen = Deviation { v: x[0], v_dot, r: x[1], d_e: x[2], psi_e: x[3], c_c };
        Vector5::from([v_dot, law.turning(x[4], &seen), seen.d_e_dot(), seen.psi_e_dot(), seen.d_e])
    }

    proptest! {
        /// (2.39) for one vehicle: (s + a)(s + λ_p)⁴, with the speed not decoupled by assumption but by the law.
        #[test]
        fn the_eigenvalues_are_those_of_speed_and_path_taken_apart(lambda_p in 0.3..3.0f64, c_c in -1.0..1.0f64,
                                                                   v in 0.06..1.0f64, a in 0.2..3.0f64) {
            let law = StateTransformation::new(Placement::new(lambda_p, 0.05).unwrap());
            let trim = Vector5::from([v, c_c * v, 0.0, 0.0, 0.0]);
            let h = 1e-5;
            let jacobian = SMatrix::<f64, 5, 5>::from_fn(|row, column| {
                let step = h * Vector5::ith(column, 1.0);
                let (after, before) = (trim + step, trim - step);
                (closed_loop(&law, &after, c_c, v, a) - closed_loop(&law, &before, c_c, v, a))[row] / (2.0 * h)
            });
            for s in [0.0, 0.5, 1.0, -3.0 * lambda_p, 2.0 * lambda_p] {
                let found = (SMatrix::<f64, 5, 5>::identity() * s - jacobian).determinant();
                let wanted = (s + a) * (s + lambda_p).powi(4);
                prop_assert!((found - wanted).abs() < 1e-4 * (1.0 + wanted.abs() + lambda_p.powi(5)), "{s}: {found} {wanted}");
            }
        }

        /// On the path, whatever the force: the heading keeps to the tangent, ψ̈_e = 0.
        #[test]
        fn a_force_does_not_disturb_a_vehicle_on_its_path(c_c in -1.0..1.0f64, v in 0.0..1.0f64, v_dot in -2.0..2.0f64) {
            let law = StateTransformation::new(Placement::new(1.0, 0.05).unwrap());
            let seen = Deviation { c_c, v, v_dot, r: c_c * v, ..Deviation::default() };
            // d/dt (r − c_c v) = N/I − c_c v̇
            prop_assert_eq!(law.turning(0.0, &seen) - c_c * v_dot, 0.0);
        }
    }

    #[test]
    fn the_integral_grows_with_the_distance() {
        let mut law = StateTransformation::new(Placement::new(1.0, 0.05).unwrap());
        law.see(&Deviation { d_e: 0.2, v: 0.5, ..Deviation::default() });
        let first = law.advance(0.1);
        let second = law.advance(0.1);
        assert_eq!(first.from, first.to);
        // k₄ z = 1/0.5 · 0.02
        assert!((second.from - first.from + 0.04).abs() < 1e-12);
    }
}
