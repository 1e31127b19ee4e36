//! Real polynomials: products, roots, and whether all roots lie in the left half-plane.
//!
//! Coefficients are from the highest power down: λ² + 3λ + 2 is `[1.0, 3.0, 2.0]`.

use nalgebra::{Complex, DMatrix};

use crate::graph::spectrum::eigenvalues;

/// The product of two polynomials; empty if one is.
pub fn multiply(a: &[f64], b: &[f64]) -> Vec<f64> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

/// The product of several polynomials; 1 for none.
pub fn product(factors: &[&[f64]]) -> Vec<f64> {
    factors.iter().fold(vec![1.0], |product, factor| multiply(&product, factor))
}

/// The sum of two polynomials.
pub fn add(a: &[f64], b: &[f64]) -> Vec<f64> {
    let (long, short) = if a.len() >= b.len() { (a, b) } else { (b, a) };
    let mut sum = long.to_vec();
    let offset = long.len() - short.len();
    sum.iter_mut().skip(offset).zip(short).for_each(|(sum, term)| *sum += term);
    sum
}

/// The polynomial times a number.
pub fn scale(factor: f64, polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().map(|coefficient| factor * coefficient).collect()
}

/// (λ + root)^power, whose roots are all at −`root`.
pub fn shifted_power(root: f64, power: usize) -> Vec<f64> {
    (0..power).fold(vec![1.0], |product, _| multiply(&product, &[1.0, root]))
}

/// The rate of the slowest root, minus its real part, and how many roots are there with it: errors then decay as t^(k−1) e^(−rate t),
/// for k > 1 at every rate below it but not at it. Roots that agree to four digits count as one. `None` as for [`roots`].
pub fn slowest(polynomial: &[f64]) -> Option<(f64, usize)> {
    let roots = roots(polynomial)?;
    let last = *roots.iter().max_by(|a, b| a.re.total_cmp(&b.re))?;
    let same = roots.iter().filter(|root| (*root - last).norm() <= 1e-4 * last.norm());
    let (count, sum) = same.fold((0, 0.0), |(count, sum), root| (count + 1, sum - root.re));
    // Their mean is right to more digits than each of them.
    Some((sum / count as f64, count))
}

/// All roots, as eigenvalues of the companion matrix, by real part and then by imaginary part. `None` if the leading
/// coefficient is zero, or one is not finite.
///
/// A root of multiplicity m is found to about the m-th root of the rounding error.
pub fn roots(polynomial: &[f64]) -> Option<Vec<Complex<f64>>> {
    let (&leading, rest) = polynomial.split_first()?;
    if leading == 0.0 || !polynomial.iter().all(|coefficient| coefficient.is_finite()) {
        return None;
    }
    let degree = rest.len();
    let companion = DMatrix::from_fn(degree, degree, |row, column| match row {
        0 => -rest[column] / leading,
        _ => f64::from(u8::from(row == column + 1)),
    });
    eigenvalues(&companion)
}

/// Whether all roots have negative real parts, by the criterion of Routh and Hurwitz; false on the border, and for
/// what is no polynomial. The sign of the polynomial does not matter.
pub fn is_hurwitz(polynomial: &[f64]) -> bool {
    let Some(&leading) = polynomial.first() else { return false };
    if leading == 0.0 || !polynomial.iter().all(|coefficient| coefficient.is_finite()) {
        return false;
    }
    let part = |parity: usize| polynomial.iter().skip(parity).step_by(2).map(|c| c / leading).collect::<Vec<_>>();
    let (mut above, mut row) = (part(0), part(1));
    // The first column of Routh's array must stay positive; each row follows from the two above it.
    while let Some(&first) = row.first() {
        if first <= 0.0 || !first.is_finite() {
            return false;
        }
        let factor = above[0] / first;
        let entry = |row: &[f64], k: usize| row.get(k).copied().unwrap_or(0.0);
        let next = (1..above.len()).map(|k| above[k] - factor * entry(&row, k)).collect();
        (above, row) = (row, next);
    }
    true
}

/// The largest real part of a root: by how much the slowest mode decays, if negative. `None` as for [`roots`], and for
/// constants.
pub fn abscissa(polynomial: &[f64]) -> Option<f64> {
    roots(polynomial)?.iter().map(|root| root.re).max_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn products_and_sums_by_hand() {
        assert_eq!(multiply(&[1.0, 2.0], &[1.0, 3.0]), [1.0, 5.0, 6.0]);
        assert_eq!(add(&[1.0, 0.0, 0.0], &[2.0, 3.0]), [1.0, 2.0, 3.0]);
        assert_eq!(shifted_power(2.0, 3), [1.0, 6.0, 12.0, 8.0]);
        assert_eq!(product(&[&[2.0], &[1.0, 1.0], &[1.0, -1.0]]), [2.0, 0.0, -2.0]);
        assert!(multiply(&[], &[1.0]).is_empty() && multiply(&[1.0, 2.0], &[]).is_empty());
    }

    #[test]
    fn roots_by_hand() {
        let found = roots(&[2.0, 0.0, 8.0]).expect("a polynomial");
        assert!((found[0] - Complex::new(0.0, -2.0)).norm() < 1e-12 && (found[1].im - 2.0).abs() < 1e-12);
        assert_eq!(roots(&[5.0]), Some(vec![]));
        assert_eq!((roots(&[]), roots(&[0.0, 1.0]), roots(&[1.0, f64::NAN])), (None, None, None));
        assert_eq!(abscissa(&[1.0, 3.0]), Some(-3.0));
    }

    #[test]
    fn hurwitz_by_hand() {
        // λ³ + aλ² + bλ + c is stable iff all are positive and ab > c.
        assert!(is_hurwitz(&[1.0, 3.0, 3.0, 1.0]) && is_hurwitz(&[-1.0, -3.0, -3.0, -1.0]));
        assert!(!is_hurwitz(&[1.0, 1.0, 1.0, 1.0]) && !is_hurwitz(&[1.0, 1.0, 1.0, 2.0]));
        assert!(!is_hurwitz(&[1.0, -1.0]) && !is_hurwitz(&[]) && !is_hurwitz(&[0.0, 1.0]) && is_hurwitz(&[4.0]));
        assert!(!is_hurwitz(&[1.0, f64::INFINITY]) && !is_hurwitz(&[1.0, 0.0]));
        assert!(!is_hurwitz(&[0.0]) && !is_hurwitz(&[f64::INFINITY]) && !is_hurwitz(&[f64::NAN]));
    }

    #[test]
    fn a_root_several_times_is_counted() {
        let close = |found: Option<(f64, usize)>, rate: f64, times| {
            found.is_some_and(|(found, count)| (found - rate).abs() < 1e-6 && count == times)
        };
        assert!(close(slowest(&shifted_power(1.0, 3)), 1.0, 3));
        assert!(close(slowest(&[1.0, 0.4, 0.04]), 0.2, 2));
        assert!(close(slowest(&[1.0, 3.0, 2.0]), 1.0, 1));
        assert!(close(slowest(&[1.0, 1.0, 1.0]), 0.5, 1), "a pair of complex roots is two different ones");
        assert_eq!(slowest(&[0.0, 1.0]), None);
        // (λ² + 0.2λ + 1)(λ + 3): a pair that turns is slower than a root that does not.
        assert!(close(slowest(&multiply(&[1.0, 0.2, 1.0], &[1.0, 3.0])), 0.1, 1));
        // Four digits of each, however slow: 0.001 and 0.00105 are two.
        assert!(close(slowest(&[1.0, 2.05e-3, 1.05e-6]), 1e-3, 1));
    }

    proptest! {
        #[test]
        fn the_criterion_and_the_roots_agree(coefficients in prop::collection::vec(-2.0..6.0f64, 1..8)) {
            let polynomial: Vec<f64> = std::iter::once(1.0).chain(coefficients).collect();
            let abscissa = abscissa(&polynomial).expect("not constant");
            prop_assume!(abscissa.abs() > 1e-6);
            prop_assert_eq!(is_hurwitz(&polynomial), abscissa < 0.0, "{}", abscissa);
        }

        #[test]
        fn roots_rebuild_the_polynomial(real in prop::collection::vec(-3.0..3.0f64, 1..7)) {
            let polynomial = real.iter().fold(vec![1.0], |product, root| multiply(&product, &[1.0, -root]));
            let rebuilt = roots(&polynomial).expect("a polynomial").iter().fold(
                vec![Complex::from(1.0)],
                |product, root| {
                    let mut next = product.clone();
                    next.push(Complex::from(0.0));
                    for (k, coefficient) in product.iter().enumerate() {
                        next[k + 1] -= coefficient * root;
                    }
                    next
                },
            );
            let size = polynomial.iter().fold(1.0f64, |size, c| size.max(c.abs()));
            for (rebuilt, coefficient) in rebuilt.iter().zip(&polynomial) {
                prop_assert!((rebuilt - coefficient).norm() < 1e-9 * size);
            }
        }
    }
}
