//! Algebraic Riccati equations, by the matrix sign function of their Hamiltonian (Roberts, 1971).
//!
//! For designs at start-up and at changes of curvature, with a handful of states: the matrices are allocated.

use nalgebra::DMatrix;

/// Steps of Newton's method for the sign; it converges quadratically, a dozen are usual.
const STEPS: usize = 60;
/// What may be left of the equation, relative to its terms.
const RESIDUAL: f64 = 1e-8;

/// The symmetric X with AᵀX + XA − XGX + Q = 0 for which A − GX is stable; G and Q symmetric and, like A, n × n.
///
/// # Errors
/// If there is none: A cannot be stabilised through G, or does not show in Q a motion that does not decay.
pub fn stabilising(a: &DMatrix<f64>, g: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let n = a.nrows();
    let one = DMatrix::identity(n, n);
    // H = [A −G; −Q −Aᵀ]; its stable subspace is the range of [I; X].
    let mut h = DMatrix::zeros(2 * n, 2 * n);
    h.view_mut((0, 0), (n, n)).copy_from(a);
    h.view_mut((0, n), (n, n)).copy_from(&-g);
    h.view_mut((n, 0), (n, n)).copy_from(&-q);
    h.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
    let w = sign(h).ok_or("the Riccati equation has no stabilising solution")?;
    let part = |row: usize, column: usize| w.view((row * n, column * n), (n, n)).into_owned();

    // (sign(H) + I) [I; X] = 0
    let mut left = DMatrix::zeros(2 * n, n);
    left.view_mut((0, 0), (n, n)).copy_from(&part(0, 1));
    left.view_mut((n, 0), (n, n)).copy_from(&(part(1, 1) + &one));
    let mut right = DMatrix::zeros(2 * n, n);
    right.view_mut((0, 0), (n, n)).copy_from(&-(part(0, 0) + &one));
    right.view_mut((n, 0), (n, n)).copy_from(&-part(1, 0));
    let qr = left.qr();
    let right = qr.q().transpose() * right;
    let x = qr.unpack_r().solve_upper_triangular(&right);
    let x = x.ok_or("the Riccati equation has no stabilising solution")?;
    let x = 0.5 * (&x + x.transpose());

    let (ax, xgx) = (a.transpose() * &x, &x * g * &x);
    let left = (&ax + ax.transpose() - &xgx + q).norm();
    if left <= RESIDUAL * (2.0 * ax.norm() + xgx.norm() + q.norm()) {
        Ok(x)
    } else {
        Err("the Riccati equation has no solution that can be computed".to_owned())
    }
}

/// sign(M) by Newton's method with scaling by the determinant; `None` if M has an eigenvalue on the imaginary axis.
fn sign(mut m: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = m.nrows() as f64;
    for _ in 0..STEPS {
        let determinant = m.determinant().abs();
        let inverse = m.clone().try_inverse()?;
        // Near convergence the determinant is 1 and the scaling does nothing.
        let scale = determinant.powf(-1.0 / size);
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let next = 0.5 * (scale * &m + inverse / scale);
        let (change, norm) = ((&next - &m).norm(), next.norm());
        m = next;
        if change <= 1e-14 * norm {
            return Some(m);
        }
        if !norm.is_finite() {
            return None;
        }
    }
    // Rounding may keep the last digits moving: the caller looks at what is left of its equation.
    Some(m)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, dmatrix};
    use proptest::prelude::*;

    use super::stabilising;
    use crate::graph::spectrum::{eigenvalues, symmetric_eigenvalues};

    #[test]
    fn one_state_in_closed_form() {
        for (a, g, q) in [(1.0f64, 2.0, 3.0), (-0.5, 1.0, 1e-3), (0.0, 1.0, 4.0), (2.0, 0.5, 0.0)] {
            let x = stabilising(&dmatrix![a], &dmatrix![g], &dmatrix![q]).unwrap();
            let exact = (a + (a * a + g * q).sqrt()) / g;
            assert!((x[(0, 0)] - exact).abs() < 1e-12 * exact.max(1.0), "{x} {exact}");
        }
    }

    #[test]
    fn a_double_integrator_in_closed_form() {
        // ẍ = u with cost q₁x² + q₂ẋ² + u²: X = [√(q₁(q₂ + 2√q₁)), √q₁; ·, √(q₂ + 2√q₁)].
        let (q_1, q_2) = (4.0f64, 0.3f64);
        let x =
            stabilising(&dmatrix![0.0, 1.0; 0.0, 0.0], &dmatrix![0.0, 0.0; 0.0, 1.0], &dmatrix![q_1, 0.0; 0.0, q_2]);
        let root = (q_2 + 2.0 * q_1.sqrt()).sqrt();
        let exact = dmatrix![q_1.sqrt() * root, q_1.sqrt(); q_1.sqrt(), root];
        assert!((x.unwrap() - exact).norm() < 1e-12);
    }

    #[test]
    fn what_cannot_be_stabilised_or_seen_is_refused() {
        // An unstable state that the input does not reach; an oscillation that costs nothing.
        assert!(stabilising(&dmatrix![1.0], &dmatrix![0.0], &dmatrix![1.0]).is_err());
        let turning = dmatrix![0.0, 1.0; -1.0, 0.0];
        assert!(stabilising(&turning, &DMatrix::identity(2, 2), &DMatrix::zeros(2, 2)).is_err());
        assert!(stabilising(&dmatrix![f64::NAN], &dmatrix![1.0], &dmatrix![1.0]).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_solution_is_positive_and_stabilises(entries in proptest::collection::vec(-2.0..2.0f64, 24)) {
            let a = DMatrix::from_column_slice(4, 4, &entries[..16]);
            let b = DMatrix::from_column_slice(4, 1, &entries[16..20]) + DMatrix::from_element(4, 1, 0.05);
            let c = DMatrix::from_column_slice(1, 4, &entries[20..24]);
            let q = c.transpose() * &c + 0.1 * DMatrix::<f64>::identity(4, 4);
            let g = &b * b.transpose() + 0.1 * DMatrix::<f64>::identity(4, 4);
            let x = stabilising(&a, &g, &q).unwrap();
            let closed = &a - &g * &x;
            prop_assert!(eigenvalues(&closed).expect("it settles").iter().all(|s| s.re < 0.0));
            prop_assert!(symmetric_eigenvalues(&x)[0] > 0.0);
        }
    }
}
