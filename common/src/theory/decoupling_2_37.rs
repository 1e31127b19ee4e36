//! Section 2.3.1: path following by the decoupling method together with a leader and its followers, about trimming.
//!
//! Path following alone has all its roots at −λ_p, coordination alone at those of λ³ + aλ² + bλ + c; a follower's speed
//! disturbs its turning and is disturbed by its distance from the path, and with that loop closed the characteristic
//! polynomial is (2.37). It is stable if path following is fast enough against the rate of turning v/R.
//!
//! With a = 3ξ, b = 3ξ², c = ξ³ and ξ = mλ_p the polynomial (2.38), divided by λ_p⁷ and with s = λ/λ_p, has only m and
//! k/λ_p² in it. For λ_p = 2m√k it has only m,
//!
//! ```text
//! (s + m)³(s + 1)⁴ − ¾ s(s + 4)(s + m/3)
//! ```
//!
//! which is stable for m > m_0 = 0.57734. The text says 0.63, which is enough but not critical (erratum 2.3).

use nalgebra::Complex;

use super::Verdict;
use super::polynomial::{abscissa, add, is_hurwitz, multiply, product, roots, scale, shifted_power};

/// Gains k_1 to k_4 that put all four roots of path following at −λ_p (2.16), for curvature `c_c` \[1/m\] and speed
/// `v` \[m/s\], not zero.
pub fn gains(lambda_p: f64, c_c: f64, v: f64) -> [f64; 4] {
    [
        4.0 * lambda_p,
        4.0 * lambda_p.powi(3) / v - 4.0 * lambda_p * c_c * c_c * v,
        6.0 * lambda_p * lambda_p - (c_c * v).powi(2),
        lambda_p.powi(4) / v,
    ]
}

/// λ⁴ + k_1λ³ + (k_3 + (c_c v)²)λ² + v(k_2 + k_1c_c²v)λ + k_4v: path following alone (2.15), with k_2 and k_3 where
/// they belong (erratum 2.1).
pub fn path_following(k: [f64; 4], c_c: f64, v: f64) -> Vec<f64> {
    let [k_1, k_2, k_3, k_4] = k;
    vec![1.0, k_1, k_3 + (c_c * v).powi(2), v * (k_2 + k_1 * c_c * c_c * v), k_4 * v]
}

/// λ³ + aλ² + bλ + c: a follower alone (2.29).
pub fn follower(a: f64, b: f64, c: f64) -> [f64; 4] {
    [1.0, a, b, c]
}

/// (λ + a_1)(λ + λ_p)⁴((λ³ + a_2λ² + b_2λ + c_2)(λ + λ_p)⁴ − (v_2/R_2)²λ(λ + 4λ_p)(b_2λ + c_2)): leader and follower
/// (2.37), with `turning` = v_2/R_2 \[rad/s\].
pub fn leader_and_follower(lambda_p: f64, a_1: f64, [a_2, b_2, c_2]: [f64; 3], turning: f64) -> Vec<f64> {
    let path = shifted_power(lambda_p, 4);
    let coupled = multiply(&[1.0, 4.0 * lambda_p, 0.0], &[b_2, c_2]);
    let loop_ = add(&multiply(&follower(a_2, b_2, c_2), &path), &scale(-turning * turning, &coupled));
    product(&[&[1.0, a_1], &path, &loop_])
}

/// (λ + ξ)³(λ + λ_p)⁴ − 3ξ²kλ(λ + 4λ_p)(λ + ξ/3): the part of it that k decides (2.38), with k = (v_2/R_2)² \[rad²/s²\].
pub fn coupled(lambda_p: f64, xi: f64, k: f64) -> Vec<f64> {
    let free = multiply(&shifted_power(xi, 3), &shifted_power(lambda_p, 4));
    let disturbed = multiply(&[1.0, 4.0 * lambda_p, 0.0], &[1.0, xi / 3.0]);
    add(&free, &scale(-3.0 * xi * xi * k, &disturbed))
}

/// m_0: (2.38) with λ_p = 2m√k and ξ = mλ_p is stable for every m above it (erratum 2.3).
pub fn m_0() -> f64 {
    // k = 1/4 makes λ_p = m and ξ = m².
    border(0.1, 2.0, |m| coupled(m, m * m, 0.25))
}

/// The λ_p \[rad/s\] below which (2.38) is unstable for this ξ and k; zero if it is stable for all.
pub fn critical_lambda_p(xi: f64, k: f64) -> f64 {
    // ¾s… with λ_p ≥ 2m√k, m = ξ/λ_p, says that λ_p² = 2ξ√k/0.63… suffices; twice that is well above the border.
    let above = 2.0 * (2.0 * xi * k.sqrt()).sqrt() + 4.0 * k.sqrt();
    border(0.0, above, |lambda_p| coupled(lambda_p, xi, k))
}

/// Between an unstable and a stable value of a parameter, where it changes.
fn border(mut unstable: f64, mut stable: f64, polynomial: impl Fn(f64) -> Vec<f64>) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (unstable + stable);
        if is_hurwitz(&polynomial(middle)) {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    stable
}

/// The roots of (2.38) while λ_p runs from `from` to `to` in `steps` steps: Figure 2.8.
pub fn root_locus(xi: f64, k: f64, from: f64, to: f64, steps: u32) -> Vec<(f64, Vec<Complex<f64>>)> {
    let lambda_p = |step: u32| from + (to - from) * f64::from(step) / f64::from(steps.max(1));
    (0..=steps).map(lambda_p).filter_map(|lambda_p| Some((lambda_p, roots(&coupled(lambda_p, xi, k))?))).collect()
}

/// What section 2.3.1 says of a follower with these gains that turns at `turning` = v/R \[rad/s\]: the rate is that of
/// the linearised system's slowest mode.
pub fn verdict(lambda_p: f64, a_1: f64, follower_gains: [f64; 3], turning: f64) -> Verdict {
    let polynomial = leader_and_follower(lambda_p, a_1, follower_gains, turning);
    let holds = is_hurwitz(&polynomial);
    let slowest = abscissa(&polynomial);
    Verdict {
        name: "Leader and follower, decoupling method (2.37)",
        condition: "all roots of (2.37) in the left half-plane".to_owned(),
        value: slowest.map_or("–".to_owned(), |re| format!("largest real part {re:.4}, v/R = {turning:.4} rad/s")),
        holds,
        norm_rate: slowest.filter(|_| holds).map(|re| -re),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// Characteristic polynomial by Faddeev and LeVerrier.
    fn characteristic(a: &DMatrix<f64>) -> Vec<f64> {
        let n = a.nrows();
        let (mut coefficients, mut m) = (vec![1.0], DMatrix::identity(n, n));
        for k in 1..=n {
            let am = a * &m;
            let c = -am.trace() / k as f64;
            coefficients.push(c);
            m = am + DMatrix::identity(n, n) * c;
        }
        coefficients
    }

    /// (2.36) for a leader and one follower: v, r, d, ψ, z of both, then s̄_12 and e_12.
    fn linearised(lambda_p: f64, a_1: f64, [a_2, b_2, c_2]: [f64; 3], v: [f64; 2], r: [f64; 2]) -> DMatrix<f64> {
        let mut m = DMatrix::zeros(12, 12);
        for i in 0..2 {
            let (row, c_c) = (5 * i, 1.0 / r[i]);
            let k = gains(lambda_p, c_c, v[i]);
            m[(row, row)] = -[a_1, a_2][i];
            for (column, gain) in [(1, k[0]), (2, k[1]), (3, k[2]), (4, k[3])] {
                m[(row + 1, row + column)] = -gain;
            }
            m[(row + 2, row + 3)] = v[i];
            m[(row + 3, row + 1)] = 1.0;
            m[(row + 3, row + 2)] = -c_c * c_c * v[i];
            m[(row + 3, row)] = -c_c;
            m[(row + 4, row + 2)] = 1.0;
            let sign = [1.0, -1.0][i];
            m[(10, row)] = sign / r[i];
            m[(10, row + 2)] = sign * v[i] / (r[i] * r[i]);
        }
        m[(5, 10)] = r[1] * b_2;
        m[(5, 11)] = r[1] * c_2;
        m[(11, 10)] = 1.0;
        m
    }

    proptest! {
        #[test]
        fn equation_2_37_is_the_linearised_fleet(
            lambda_p in 0.3..2.0f64, xi in 0.2..1.0f64, v in 0.1..1.0f64, r in (1.0..4.0f64, 1.0..4.0f64)
        ) {
            let follower = [3.0 * xi, 3.0 * xi * xi, xi.powi(3)];
            let speeds = [v, v * r.1 / r.0];
            let matrix = linearised(lambda_p, 0.7, follower, speeds, [r.0, r.1]);
            let expected = characteristic(&matrix);
            let found = leader_and_follower(lambda_p, 0.7, follower, speeds[1] / r.1);
            let size = expected.iter().fold(1.0f64, |size, c| size.max(c.abs()));
            for (found, expected) in found.iter().zip(&expected) {
                prop_assert!((found - expected).abs() < 1e-10 * size, "{} {}", found, expected);
            }
        }

        #[test]
        fn gains_place_all_four_roots(lambda_p in 0.2..2.0f64, c_c in -1.0..1.0f64, v in 0.1..1.0f64) {
            let polynomial = path_following(gains(lambda_p, c_c, v), c_c, v);
            prop_assert_eq!(polynomial.len(), 5);
            for (found, expected) in polynomial.iter().zip(shifted_power(lambda_p, 4)) {
                prop_assert!((found - expected).abs() < 1e-12 * (1.0 + expected));
            }
        }

        #[test]
        fn above_m_0_it_is_stable_and_below_it_is_not(k in 0.01..4.0f64, part in 0.02..1.0f64) {
            let stable = |m: f64| {
                let lambda_p = 2.0 * m * k.sqrt();
                is_hurwitz(&coupled(lambda_p, m * lambda_p, k))
            };
            prop_assert!(stable(m_0() * (1.0 + part)) && !stable(m_0() * (1.0 - 0.9 * part)));
        }

        #[test]
        fn above_the_critical_lambda_p_it_is_stable_and_below_it_is_not(
            log_xi in -4.0..3.0f64, log_k in -6.0..3.0f64, part in 0.01..1.0f64
        ) {
            let (xi, k) = (log_xi.exp(), log_k.exp());
            let critical = critical_lambda_p(xi, k);
            let stable = |lambda_p: f64| is_hurwitz(&coupled(lambda_p, xi, k));
            prop_assert!(stable(critical * (1.0 + part)) && !stable(critical * (1.0 - 0.9 * part)), "{}", critical);
        }
    }

    #[test]
    fn erratum_2_3_the_critical_values() {
        assert!((m_0() - 0.577_342_5).abs() < 1e-6, "{}", m_0());
        let critical = critical_lambda_p(0.4, 0.25);
        assert!((critical - 0.587_567).abs() < 1e-6, "{critical}");
        // There a pair of roots crosses the imaginary axis at 0.193 rad/s.
        let crossing = roots(&coupled(critical, 0.4, 0.25)).expect("a polynomial");
        assert!(crossing.iter().any(|root| root.re.abs() < 1e-6 && (root.im - 0.193).abs() < 1e-3), "{crossing:?}");
        // At the printed m_0 it is stable with room to spare.
        let printed = abscissa(&coupled(0.63, 0.4, 0.25)).expect("a polynomial");
        assert!((printed + 0.014_32).abs() < 1e-5, "{printed}");
    }

    #[test]
    fn equation_2_38_is_2_37_without_what_k_does_not_decide() {
        let (lambda_p, xi, k) = (0.8f64, 0.4f64, 0.25f64);
        let whole = leader_and_follower(lambda_p, 0.3, [3.0 * xi, 3.0 * xi * xi, xi.powi(3)], k.sqrt());
        let parts = product(&[&[1.0, 0.3], &shifted_power(lambda_p, 4), &coupled(lambda_p, xi, k)]);
        assert!(whole.iter().zip(&parts).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_locus_crosses_once() {
        let locus = root_locus(0.4, 0.25, 0.13, 2.63, 250);
        let stable: Vec<bool> = locus.iter().map(|(_, roots)| roots.iter().all(|root| root.re < 0.0)).collect();
        assert_eq!(stable.windows(2).filter(|pair| pair[0] != pair[1]).count(), 1);
        assert!(!stable[0] && stable[250] && locus.iter().all(|(_, roots)| roots.len() == 7));
        assert!(locus[0].0 == 0.13 && (locus[125].0 - 1.38).abs() < 1e-12 && (locus[250].0 - 2.63).abs() < 1e-12);
        let one: Vec<f64> = root_locus(0.4, 0.25, 0.5, 2.0, 0).iter().map(|(lambda_p, _)| *lambda_p).collect();
        assert_eq!(one, [0.5], "no steps: where it begins");
    }

    #[test]
    fn verdicts() {
        let gains = [1.2, 0.48, 0.064];
        let good = verdict(1.0, 1.0, gains, 0.5);
        assert!(good.holds && good.norm_rate.is_some_and(|rate| rate > 0.0));
        let slow = verdict(0.5, 1.0, gains, 0.5);
        assert_eq!((slow.holds, slow.norm_rate), (false, None));
    }
}
