//! Sections 2.2.1, 2.2.2 and 2.4: leader and followers, and a gateway that everybody talks with.
//!
//! In w_i = v_i/R_i the radii cancel. Every vehicle has the gain a; followers add P(s)/s^m of their distance from the
//! gateway, with P = bs + c (m = 2), or bs² + cs + d (m = 3) with the extra integrator of section 2.5.3. Then
//! w_i = (P/q)w_1 with q = s^m(s + a) + P, and the gateway's own equation gives, for n vehicles,
//!
//! ```text
//! q^{n−2} ( s(s + a)(q + (n − 1)P) + b_0 q )                                     all is well (2.35)
//! q^{n−3} ( s^m(s + a)q + b_0 s^{m−1}q + P(q + (n − 2)s^m(s + a)) )      one follower's speed is stuck (2.42)
//! ```
//!
//! Both need the gateway's sums with the sign of (2.32); with that of (2.33) as printed, the second is unstable for the
//! thesis' own gains (erratum 2.2).

//!
//! # The extra integrator and a stuck follower
//!
//! With P = bs² + cs + d, F = s³(s + a) and ρ + 1/ρ = n, ρ ≤ 1, the polynomial of the stuck fleet is
//! (F + ρP)(F + P/ρ) + b_0 s²(F + P), so its roots are those of
//!
//! ```text
//! 1 + b_0 H(s) = 0,    H = s² ( ρ/(1 + ρ) /(F + ρP) + 1/(1 + ρ) /(F + P/ρ) )
//! ```
//!
//! If d < ρ(ab − c)c/a², there is a κ with a²d/c ≤ κ ≤ ρ(ab − c). M = as + a² + κ/s has a real part of at least a² where
//! Re s ≥ 0, and on s = jω, x = ω², the real part of M s²/(F + μP) has the sign of
//!
//! ```text
//! a (μ(ab − c) − κ) x + μ (κc − a²d)
//! ```
//!
//! which is not negative for μ = ρ and μ = 1/ρ, whose F + μP are stable. So M + b_0 M H has no root there, for any b_0 > 0. ∎
//! For b_0 → 0 the roots are those of F + ρP and F + P/ρ: with a larger d some b_0 are too small. A stable q (ρ = 1) is enough
//! for two vehicles alone.

use super::Verdict;
use super::polynomial::{abscissa, add, is_hurwitz, multiply, product, scale};

/// A gateway and its followers, all with the same gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Gateway {
    /// a \[1/s\]: gain on a vehicle's own speed.
    pub a: f64,
    /// \[b, c\], or \[b, c, d\] with the extra integrator: gains on the distance and its integrals \[1/s², 1/s³, 1/s⁴\].
    pub distance: Vec<f64>,
    /// b_0 \[1/s²\]: the gateway's gain on the integral of its speed error.
    pub b_0: f64,
    /// n: how many vehicles, the gateway included; at least two.
    pub n: usize,
}

impl Gateway {
    /// s^m(s + a).
    fn free(&self) -> Vec<f64> {
        multiply(&self.power(self.distance.len()), &[1.0, self.a])
    }

    /// s^power.
    fn power(&self, power: usize) -> Vec<f64> {
        std::iter::once(1.0).chain(std::iter::repeat_n(0.0, power)).collect()
    }

    /// q = s^m(s + a) + P: a follower alone, λ³ + aλ² + bλ + c for m = 2. Also each follower of a leader (2.29).
    pub fn follower(&self) -> Vec<f64> {
        add(&self.free(), &self.distance)
    }

    /// Characteristic polynomial of the whole (2.35), for n vehicles.
    pub fn nominal(&self) -> Vec<f64> {
        self.with_followers(self.gateway(), self.n.saturating_sub(2))
    }

    /// Characteristic polynomial while the speed of one follower is stuck (2.42).
    pub fn with_failure(&self) -> Vec<f64> {
        self.with_followers(self.gateway_of_a_failure(), self.n.saturating_sub(3))
    }

    /// The factor of (2.35) that belongs to the gateway; the other factors are q, once for each follower but one.
    fn gateway(&self) -> Vec<f64> {
        let q = self.follower();
        let others = scale(self.n as f64 - 1.0, &self.distance);
        add(&product(&[&[1.0, self.a, 0.0], &add(&q, &others)]), &scale(self.b_0, &q))
    }

    /// The same of (2.42), where one q less is left.
    fn gateway_of_a_failure(&self) -> Vec<f64> {
        let (q, free) = (self.follower(), self.free());
        if self.n <= 2 {
            // Nobody is left to follow, and q cancels.
            let speed = self.power(self.distance.len().saturating_sub(1));
            return add(&q, &scale(self.b_0, &speed));
        }
        let speed = multiply(&self.power(self.distance.len().saturating_sub(1)), &scale(self.b_0, &q));
        let seen = add(&q, &scale(self.n as f64 - 2.0, &free));
        add(&add(&multiply(&free, &q), &speed), &multiply(&self.distance, &seen))
    }

    /// The different factors: roots of high multiplicity are found badly from the product.
    fn factors(&self, failed: bool) -> Vec<Vec<f64>> {
        let (gateway, alone) = if failed { (self.gateway_of_a_failure(), 3) } else { (self.gateway(), 2) };
        let mut factors = vec![gateway];
        if self.n > alone {
            factors.push(self.follower());
        }
        factors
    }

    fn with_followers(&self, gateway: Vec<f64>, count: usize) -> Vec<f64> {
        let q = self.follower();
        (0..count).fold(gateway, |whole, _| multiply(&whole, &q))
    }

    /// The d below which the fleet with the extra integrator bears a stuck follower, whatever b_0 is:
    /// ρ(ab − c)c/a² \[1/s⁴\], with ρ + 1/ρ = n, ρ ≤ 1 (result xi of docs/errata.md); `None` without the integrator.
    pub fn greatest_d(&self) -> Option<f64> {
        let &[b, c, _] = self.distance.as_slice() else { return None };
        // ρ = (n − √(n² − 4))/2 without its cancellation.
        let n = (self.n as f64).max(2.0);
        let rho = 2.0 / (n + (n * n - 4.0).sqrt());
        Some(rho * (self.a * b - c) * c / (self.a * self.a))
    }

    /// s̄_21 → (b_0/c)(v_0/R_2 − v_1/R_1): the steady error of a vehicle whose speed is stuck at v_0 (2.43); none with
    /// the extra integrator.
    pub fn steady_error(&self, stuck: f64, r_2: f64, v_1: f64, r_1: f64) -> f64 {
        match self.distance.as_slice() {
            [_, c] => self.b_0 / c * (stuck / r_2 - v_1 / r_1),
            _ => 0.0,
        }
    }

    /// What section 2.2.2 says of this fleet; `failed` if the speed of one follower is stuck.
    ///
    /// A stable q makes (2.35) stable for every positive b_0 if the same gain a is used, as the text says.
    pub fn verdict(&self, failed: bool) -> Verdict {
        let factors = self.factors(failed);
        let holds = factors.iter().all(|factor| is_hurwitz(factor));
        let slowest = factors.iter().map(|factor| abscissa(factor)).try_fold(f64::NEG_INFINITY, |a, b| Some(a.max(b?)));
        let (name, condition) = if failed {
            ("Gateway with a failed follower (2.42)", "all roots of (2.42) in the left half-plane")
        } else {
            ("Gateway (2.35)", "all roots of (2.35) in the left half-plane")
        };
        Verdict {
            name,
            condition: condition.to_owned(),
            value: slowest.map_or("–".to_owned(), |re| format!("largest real part {re:.4}")),
            holds,
            norm_rate: slowest.filter(|_| holds).map(|re| -re),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::spectrum::eigenvalues;
    use nalgebra::{Complex, DMatrix};
    use proptest::prelude::*;

    /// Section 2.5.3 with λ = 1.
    fn section_2_5_3(extra: bool) -> Gateway {
        let (a, distance) = if extra { (4.0, vec![6.0, 4.0, 1.0]) } else { (3.0, vec![3.0, 1.0]) };
        Gateway { a, distance, b_0: 5.0, n: 3 }
    }

    /// (2.32) with states w_i, s̄_1i and its integrals, e_v; `sign` multiplies the gateway's sums of integrals; the
    /// speed of vehicle 2 is held if it failed.
    fn matrix(fleet: &Gateway, sign: f64, failed: bool) -> DMatrix<f64> {
        let (n, m) = (fleet.n, fleet.distance.len());
        let size = n + m * (n - 1) + 1;
        let state = |i: usize, level: usize| n + (i - 1) * m + level;
        let mut matrix = DMatrix::zeros(size, size);
        for i in 0..n {
            matrix[(i, i)] = -fleet.a;
        }
        matrix[(0, size - 1)] = -fleet.b_0;
        matrix[(size - 1, 0)] = 1.0;
        for i in 1..n {
            for (level, gain) in fleet.distance.iter().enumerate() {
                matrix[(0, state(i, level))] = -gain * if level == 0 { 1.0 } else { sign };
                matrix[(i, state(i, level))] = *gain;
                if level > 0 {
                    matrix[(state(i, level), state(i, level - 1))] = 1.0;
                }
            }
            matrix[(state(i, 0), 0)] = 1.0;
            matrix[(state(i, 0), i)] = -1.0;
        }
        if failed { matrix.remove_row(1).remove_column(1) } else { matrix }
    }

    fn abscissa_of(matrix: &DMatrix<f64>) -> f64 {
        // The integral of a stuck vehicle's distance and that of the gateway's speed error differ by a constant: without
        // it, one eigenvalue of the stuck fleet is zero and says nothing.
        let found = eigenvalues(matrix).expect("it settles");
        found.iter().filter(|e| e.norm() > 1e-6).map(|e| e.re).max_by(f64::total_cmp).expect("some are not zero")
    }

    #[test]
    fn erratum_2_2_signs() {
        for (extra, nominal, failed, printed_nominal, printed_failed) in
            [(false, -0.335, -0.138, -0.129, 0.1218), (true, f64::NAN, -0.207, f64::NAN, 0.485)]
        {
            let fleet = section_2_5_3(extra);
            let close = |found: f64, known: f64| known.is_nan() || (found - known).abs() < 1e-3;
            let slowest = |polynomial: &[f64]| abscissa(polynomial).expect("a polynomial");
            assert!(close(slowest(&fleet.nominal()), nominal), "{}", slowest(&fleet.nominal()));
            assert!(close(slowest(&fleet.with_failure()), failed), "{}", slowest(&fleet.with_failure()));
            assert!(close(abscissa_of(&matrix(&fleet, -1.0, false)), printed_nominal));
            assert!(close(abscissa_of(&matrix(&fleet, -1.0, true)), printed_failed), "as printed it is unstable");
        }
    }

    #[test]
    fn who_is_stuck_is_no_follower_more() {
        // (2.35) has q for all followers but one, (2.42) for all but two.
        for (n, nominal, failed) in [(2, 1, 1), (3, 2, 1), (4, 2, 2)] {
            let fleet = Gateway { n, ..section_2_5_3(false) };
            assert_eq!((fleet.factors(false).len(), fleet.factors(true).len()), (nominal, failed), "{n}");
        }
        let [alive, stuck] = [false, true].map(|failed| section_2_5_3(false).verdict(failed).name);
        assert!(stuck.contains("failed") && !alive.contains("failed"));
    }

    #[test]
    fn section_2_5_3_leaves_0_083_rad() {
        let error = section_2_5_3(false).steady_error(0.25, 3.0, 0.2, 2.0);
        assert!((error + 0.083_333).abs() < 1e-6, "{error}");
        assert!((error.abs().to_degrees() - 4.7746).abs() < 1e-4, "erratum 2.11");
        assert_eq!(section_2_5_3(true).steady_error(0.25, 3.0, 0.2, 2.0), 0.0);
    }

    #[test]
    fn equation_2_35_for_three() {
        // (λ³ + aλ² + bλ + c)(λ(λ + a)(λ³ + aλ² + 3bλ + 3c) + b_0(λ³ + aλ² + bλ + c))
        let fleet = Gateway { a: 2.0, distance: vec![0.7, 0.3], b_0: 1.5, n: 3 };
        let q = [1.0, 2.0, 0.7, 0.3];
        let inner = add(&product(&[&[1.0, 2.0, 0.0], &[1.0, 2.0, 2.1, 0.9]]), &scale(1.5, &q));
        let expected = multiply(&q, &inner);
        assert!(fleet.nominal().iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_gains_of_section_2_5_3_bear_a_stuck_follower_among_five_vehicles_and_not_among_six() {
        let fleet = |n, b_0| Gateway { b_0, n, ..section_2_5_3(true) };
        assert!((2..=5).all(|n| [1e-3, 0.5, 5.0, 100.0].iter().all(|b_0| fleet(n, *b_0).verdict(true).holds)));
        assert!(fleet(5, 5.0).greatest_d() > Some(1.0) && fleet(6, 5.0).greatest_d() < Some(1.0));
        assert!(!fleet(6, 0.5).verdict(true).holds && !fleet(8, 3.0).verdict(true).holds);
        assert!(section_2_5_3(false).greatest_d().is_none());
    }

    #[test]
    fn with_the_extra_integrator_a_stable_q_is_not_enough_for_every_b_0() {
        // The claim below (2.35) is of a, b and c alone.
        let (a, b) = (0.59, 5.88);
        let c = 0.189 * a * b;
        let d = 0.751 * (a * b - c) * c / (a * a);
        let fleet = |b_0| Gateway { a, distance: vec![b, c, d], b_0, n: 5 };
        assert!(is_hurwitz(&fleet(1.0).follower()) && fleet(1.0).greatest_d() < Some(d));
        assert!(fleet(1.0).verdict(false).holds && !fleet(8.0).verdict(false).holds);
    }

    fn any_fleet() -> impl Strategy<Value = Gateway> {
        (0.2..4.0f64, prop::collection::vec(0.1..4.0f64, 2..4), 0.1..8.0f64, 2usize..6)
            .prop_map(|(a, distance, b_0, n)| Gateway { a, distance, b_0, n })
    }

    proptest! {
        #[test]
        fn the_polynomials_are_those_of_the_matrices(fleet in any_fleet()) {
            for (polynomial, matrix) in [
                (fleet.nominal(), matrix(&fleet, 1.0, false)),
                (fleet.with_failure(), matrix(&fleet, 1.0, true)),
            ] {
                // Values of det(s − A) at points off the axes.
                for s in [Complex::new(0.3, 1.1), Complex::new(-0.7, 0.4), Complex::new(1.5, -0.2)] {
                    let size = matrix.nrows();
                    let shifted = DMatrix::identity(size, size) * s - matrix.map(Complex::from);
                    let horner = polynomial.iter().fold(Complex::from(0.0), |sum, c| sum * s + c);
                    // The matrix of the stuck fleet has states more: they only integrate.
                    let surplus = size + 1 - polynomial.len();
                    let expected = shifted.determinant() / s.powi(surplus as i32);
                    prop_assert!((horner - expected).norm() < 1e-8 * (1.0 + horner.norm()), "{} {}", horner, expected);
                }
            }
        }

        #[test]
        fn a_stable_follower_makes_a_stable_gateway(a in 0.2..4.0f64, b in 0.1..4.0f64, part in 0.01..0.99f64,
            b_0 in 0.01..20.0f64, n in 2usize..7) {
            // The text's claim below (2.35): c < ab is all it takes.
            let fleet = Gateway { a, distance: vec![b, part * a * b], b_0, n };
            prop_assert!(is_hurwitz(&fleet.follower()));
            prop_assert!(fleet.verdict(false).holds, "{:?}", fleet);
            for factor in fleet.factors(false) {
                prop_assert!(abscissa(&factor).is_some_and(|slowest| slowest < 1e-9), "{:?}", fleet);
            }
        }

        /// Result xi.
        #[test]
        fn with_a_small_d_a_stuck_follower_is_borne_whatever_b_0_is(a in 0.2..4.0f64, b in 0.1..6.0f64,
            part in 0.02..0.98f64, of_d in 0.02..0.98f64, log_b_0 in -3.0..3.0f64, n in 2usize..9) {
            let mut fleet = Gateway { a, distance: vec![b, part * a * b, 0.0], b_0: 10f64.powf(log_b_0), n };
            fleet.distance[2] = of_d * fleet.greatest_d().expect("with the integrator");
            prop_assert!(is_hurwitz(&fleet.follower()) && fleet.verdict(true).holds, "{:?}", fleet);
        }

        #[test]
        fn with_a_larger_d_some_b_0_are_too_small(a in 0.2..4.0f64, b in 0.1..6.0f64, part in 0.05..0.95f64,
            more in 1.05..2.5f64, n in 3usize..9) {
            let mut fleet = Gateway { a, distance: vec![b, part * a * b, 0.0], b_0: 1e-6, n };
            fleet.distance[2] = more * fleet.greatest_d().expect("with the integrator");
            // Each follower alone is still stable.
            prop_assert!(is_hurwitz(&fleet.follower()) && !fleet.verdict(true).holds, "{:?}", fleet);
        }

        #[test]
        fn an_unstable_follower_makes_an_unstable_gateway(a in 0.2..4.0f64, b in 0.1..4.0f64, part in 1.05..3.0f64,
            b_0 in 0.01..20.0f64, n in 3usize..7) {
            let fleet = Gateway { a, distance: vec![b, part * a * b], b_0, n };
            let verdict = fleet.verdict(false);
            prop_assert!(!verdict.holds && verdict.norm_rate.is_none());
        }
    }
}
