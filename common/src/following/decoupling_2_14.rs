//! The decoupling algorithm with full state: section 2.1.1, (2.14) to (2.16), by the D-methodology of Figure 2.2.
//!
//! The integrator stands behind the gains and the errors are differentiated in front of them, so that no value at
//! trimming occurs: neither r^c nor the speed need be told, they are learnt.

use super::trimming::{Derivative, Deviation, LowPass, Placement, TrimmingLaw, Turning};

/// The decoupling algorithm.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoupling {
    placement: Placement,
    /// Behind the filters: r, d_e, ψ_e.
    filters: Option<[LowPass; 3]>,
    /// N/I, the law's state \[rad/s²\].
    turning: f64,
    seen: Deviation,
}

impl Decoupling {
    /// The law at rest, N = 0.
    pub fn new(placement: Placement, derivative: Derivative) -> Result<Decoupling, String> {
        let filters = match derivative {
            Derivative::Exact => None,
            Derivative::Filtered { tau } => Some([LowPass::new(tau)?; 3]),
        };
        Ok(Decoupling { placement, filters, turning: 0.0, seen: Deviation::default() })
    }

    /// Ṅ/I = −k_1 ṙ − k_2 ḋ_e − k_3 ψ̇_e − k_4 d_e \[rad/s³\]: (2.14) differentiated (erratum 2.5), with ṙ = N/I and the
    /// others from (2.9).
    pub fn rate(&self, turning: f64, seen: &Deviation) -> f64 {
        let k = self.placement.gains(seen.c_c, seen.v);
        -k.k_1 * turning - k.k_2 * seen.d_e_dot() - k.k_3 * seen.psi_e_dot() - k.k_4 * seen.d_e
    }
}

impl TrimmingLaw for Decoupling {
    fn see(&mut self, seen: &Deviation) {
        self.seen = *seen;
    }

    fn advance(&mut self, dt: f64) -> Turning {
        let (from, seen) = (self.turning, self.seen);
        let k = self.placement.gains(seen.c_c, seen.v);
        self.turning = match &mut self.filters {
            // The loop through k_1 is closed over ṙ = N/I itself and solved exactly, so that no period is too long for it.
            None => {
                let decay = -(-k.k_1 * dt).exp_m1();
                from + decay / k.k_1 * self.rate(from, &seen)
            }
            Some([r, d_e, psi_e]) => {
                let rise = -k.k_1 * r.rise(seen.r, dt)
                    - k.k_2 * d_e.rise(seen.d_e, dt)
                    - k.k_3 * psi_e.rise_of_angle(seen.psi_e, dt);
                from + rise - k.k_4 * seen.d_e * dt
            }
        };
        Turning { from, to: self.turning }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix4, Vector4};
    use proptest::prelude::*;

    use super::Decoupling;
    use crate::following::trimming::{Derivative, Deviation, Placement, TrimmingLaw};

    fn law(lambda_p: f64) -> Decoupling {
        Decoupling::new(Placement::new(lambda_p, 0.05).unwrap(), Derivative::Exact).unwrap()
    }

    #[test]
    fn what_is_held_is_solved_exactly() {
        // Two periods are one of twice the length, and a long one ends at rest: N/I = −(k_2 ḋ_e + k_3 ψ̇_e + k_4 d_e)/k_1.
        let seen = Deviation { r: 0.3, d_e: 0.2, psi_e: -0.1, c_c: 0.5, v: 0.4, v_dot: 0.0 };
        let after = |periods: &[f64]| {
            let mut law = law(1.5);
            law.see(&seen);
            periods.iter().fold(0.0, |_, &dt| law.advance(dt).to)
        };
        assert!((after(&[0.1, 0.1]) - after(&[0.2])).abs() < 1e-12 && (after(&[0.2]) - after(&[0.1])).abs() > 0.01);
        assert!(law(1.5).rate(after(&[100.0]), &seen).abs() < 1e-9);
    }

    /// The closed loop (2.9) with the law, at constant v: rates of (r, d_e, ψ_e, N/I).
    fn closed_loop(law: &Decoupling, x: &Vector4<f64>, c_c: f64, v: f64) -> Vector4<f64> {
        let seen = Deviation { r: x[0], d_e: x[1], psi_e: x[2], c_c, v, v_dot: 0.0 };
        Vector4::new(x[3], seen.d_e_dot(), seen.psi_e_dot(), law.rate(x[3], &seen))
    }

    /// Its Jacobian at trimming, r^c = c_c v, by central differences.
    fn linearised(lambda_p: f64, c_c: f64, v: f64) -> Matrix4<f64> {
        let law = law(lambda_p);
        let trim = Vector4::new(c_c * v, 0.0, 0.0, 0.0);
        assert!(closed_loop(&law, &trim, c_c, v).norm() < 1e-15, "trimming needs no value that is not measured");
        let h = 1e-5;
        let column = |i: usize| {
            let step = h * Vector4::ith(i, 1.0);
            (closed_loop(&law, &(trim + step), c_c, v) - closed_loop(&law, &(trim - step), c_c, v)) / (2.0 * h)
        };
        Matrix4::from_columns(&[column(0), column(1), column(2), column(3)])
    }

    #[test]
    fn the_printed_order_of_k_2_and_k_3_does_not_place_the_eigenvalues() {
        // (2.15) as printed has k₂ where k₃ belongs (erratum 2.1): its own gains do not make it (s + λ_p)⁴.
        let (lambda, c_c, v) = (1.0f64, 0.5, 0.4);
        let k = Placement::new(lambda, 0.05).unwrap().gains(c_c, v);
        let corrected = [k.k_1, k.k_3 + (c_c * v).powi(2), v * (k.k_2 + k.k_1 * c_c * c_c * v), k.k_4 * v];
        let printed = [k.k_1, k.k_2 + (c_c * v).powi(2), v * (k.k_3 + k.k_1 * c_c * c_c * v), k.k_4 * v];
        let wanted = [4.0, 6.0, 4.0, 1.0];
        assert!(corrected.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{corrected:?}");
        assert!((printed[1] - wanted[1]).abs() > 1.0);
    }

    #[test]
    fn to_the_left_of_the_path_it_turns_right() {
        let (left, inward) = (
            Deviation { d_e: 0.1, v: 0.4, ..Deviation::default() },
            Deviation { psi_e: 0.1, v: 0.4, ..Deviation::default() },
        );
        for seen in [left, inward] {
            assert!(law(1.0).rate(0.0, &seen) < 0.0);
        }
    }

    #[test]
    fn a_filter_that_is_fast_gives_what_the_exact_derivative_gives() {
        // d_e(t) = sin t/10 and so on, seen every millisecond.
        let placement = Placement::new(1.0, 0.05).unwrap();
        let mut filtered = Decoupling::new(placement, Derivative::Filtered { tau: 2e-3 }).unwrap();
        let (v, c_c, dt) = (0.4, 0.5, 1e-3);
        let k = placement.gains(c_c, v);
        for step in 0..3000 {
            let t: f64 = dt * f64::from(step);
            let (d_e, psi_e, r) = (0.1 * t.sin(), 0.2 * (1.0 - t.cos()), 0.3 * t.sin());
            filtered.see(&Deviation { d_e, psi_e, r, c_c, v, v_dot: 0.0 });
            let to = filtered.advance(dt).to;
            let exact = -k.k_1 * r - k.k_2 * d_e - k.k_3 * psi_e - k.k_4 * 0.1 * (1.0 - t.cos());
            assert!((to - exact).abs() < 0.05 * (1.0 + exact.abs()), "{t}: {to} {exact}");
        }
    }

    proptest! {
        /// All four eigenvalues at −λ_p, whatever curvature and speed: the linearisation has (s + λ_p)⁴.
        #[test]
        fn the_eigenvalues_are_where_2_16_puts_them(lambda_p in 0.3..3.0f64, c_c in -1.0..1.0f64, v in 0.06..1.0f64) {
            let a = linearised(lambda_p, c_c, v);
            // A defective eigenvalue is known to the fourth root of the rounding only: compare the polynomials, by
            // their values at points around the origin.
            for s in [0.0, 0.5, 1.0, -3.0 * lambda_p, 2.0 * lambda_p] {
                let found = (Matrix4::identity() * s - a).determinant();
                let wanted = (s + lambda_p).powi(4);
                prop_assert!((found - wanted).abs() < 1e-5 * (1.0 + wanted + lambda_p.powi(4)), "{s}: {found} {wanted}");
            }
        }

        #[test]
        fn it_never_gives_anything_but_numbers(d_e in -1e3..1e3f64, psi_e in -3.2..3.2f64, c_c in -10.0..10.0f64,
                                               v in -5.0..5.0f64, r in -10.0..10.0f64, filtered: bool) {
            let derivative = if filtered { Derivative::Filtered { tau: 0.05 } } else { Derivative::Exact };
            let mut law = Decoupling::new(Placement::new(2.0, 0.05).unwrap(), derivative).unwrap();
            for _ in 0..3 {
                law.see(&Deviation { d_e, psi_e, c_c, v, v_dot: 0.0, r });
                prop_assert!(law.advance(0.05).to.is_finite());
            }
        }
    }
}
