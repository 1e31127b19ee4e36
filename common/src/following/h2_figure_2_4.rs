//! The H_2 design behind Figures 2.3 and 2.4: the controller of (2.12), (2.13) from d_e, r and ∫d_e that makes the
//! L_2 norm of
//!
//! ```text
//! e = (20 d_e + 15 N,  5 z + 15 N,  50 r + 10 ψ_e + 75 N)
//! ```
//!
//! least under white disturbances: a Kalman filter and a linear-quadratic regulator, each from a Riccati equation.
//!
//! The text has one disturbance, in the equation of ψ_e. With it alone the turning rate is never excited, and without
//! noise in what is measured the filter would differentiate; so there is a disturbance of the torque and noise here
//! too, [`Disturbances`].

use nalgebra::{DMatrix, Matrix4, Matrix4x3, RowVector4, dmatrix};

use crate::positive::{finite, positive};
use crate::riccati::stabilising;

/// Standard deviations of the white signals that the design reckons with; their ratios count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbances {
    /// In ψ̇_e \[rad/s\]: the term −c_c v_e that (2.12) leaves out.
    pub heading: f64,
    /// In ṙ \[rad/s²\].
    pub torque: f64,
    /// In the measurements of r \[rad/s\], d_e \[m\] and ∫d_e \[m s\].
    pub noise: [f64; 3],
}

impl Default for Disturbances {
    /// One in ψ_e, as in the text; the others are chosen here.
    fn default() -> Disturbances {
        Disturbances { heading: 1.0, torque: 1.0, noise: [0.1; 3] }
    }
}

/// A controller ẋ = A x + B y, N/I = C x, with y = (r, d_e, ∫d_e).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// A.
    pub a: Matrix4<f64>,
    /// B.
    pub b: Matrix4x3<f64>,
    /// C.
    pub c: RowVector4<f64>,
}

/// (2.12), (2.13): rates of (r, d_e, ψ_e, z) from themselves, at curvature `c_c` \[1/m\] and speed `v` \[m/s\].
fn plant(c_c: f64, v: f64) -> DMatrix<f64> {
    dmatrix![
        0.0, 0.0, 0.0, 0.0;
        0.0, 0.0, v, 0.0;
        1.0, -c_c * c_c * v, 0.0, 0.0;
        0.0, 1.0, 0.0, 0.0
    ]
}

/// How N enters.
fn input() -> DMatrix<f64> {
    dmatrix![1.0; 0.0; 0.0; 0.0]
}

/// How (r, d_e, ψ_e, z) and N enter the performance index.
fn index() -> (DMatrix<f64>, DMatrix<f64>) {
    let states = dmatrix![
        0.0, 20.0, 0.0, 0.0;
        0.0, 0.0, 0.0, 5.0;
        50.0, 0.0, 10.0, 0.0
    ];
    (states, dmatrix![15.0; 15.0; 75.0])
}

/// What is measured: r, d_e, z.
fn output() -> DMatrix<f64> {
    dmatrix![
        1.0, 0.0, 0.0, 0.0;
        0.0, 1.0, 0.0, 0.0;
        0.0, 0.0, 0.0, 1.0
    ]
}

/// The H_2-optimal controller for curvature `c_c` \[1/m\] and speed `v` > 0 \[m/s\].
///
/// # Errors
/// What is wrong with the numbers, or that the Riccati equations have no solution.
pub fn design(c_c: f64, v: f64, disturbances: &Disturbances) -> Result<Controller, String> {
    let v = positive("the design speed", v)?;
    let a = plant(finite("the curvature", c_c)?, v);
    let (b, c) = (input(), output());
    let regulator = regulator(&a, &b)?;
    let filter = filter(&a, &c, disturbances)?;
    let dynamics = &a - &b * &regulator - &filter * &c;
    Ok(Controller {
        a: dynamics.fixed_view::<4, 4>(0, 0).into_owned(),
        b: filter.fixed_view::<4, 3>(0, 0).into_owned(),
        c: -regulator.fixed_view::<1, 4>(0, 0).into_owned(),
    })
}

/// K of N = −K x: K = R⁻¹ (BᵀX + Sᵀ), with X from the Riccati equation of A − B R⁻¹ Sᵀ and Q − S R⁻¹ Sᵀ, where
/// Q = C_1ᵀC_1, S = C_1ᵀD_12, R = D_12ᵀD_12.
fn regulator(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let (c_1, d_12) = index();
    let r = d_12.norm_squared();
    let (q, s) = (c_1.transpose() * &c_1, c_1.transpose() * &d_12);
    let x = stabilising(&(a - b * s.transpose() / r), &(b * b.transpose() / r), &(q - &s * s.transpose() / r))?;
    Ok((b.transpose() * x + s.transpose()) / r)
}

/// L of the filter: L = Y Cᵀ V⁻¹, with Y from A Y + Y Aᵀ − Y Cᵀ V⁻¹ C Y + W = 0.
fn filter(a: &DMatrix<f64>, c: &DMatrix<f64>, disturbances: &Disturbances) -> Result<DMatrix<f64>, String> {
    let Disturbances { heading, torque, noise } = *disturbances;
    positive("the disturbance of the heading", heading)?;
    positive("the disturbance of the torque", torque)?;
    noise.iter().try_for_each(|&sigma| positive("the noise of a measurement", sigma).map(drop))?;
    let certainty =
        DMatrix::from_diagonal(&nalgebra::dvector![noise[0], noise[1], noise[2]].map(|sigma| sigma.powi(-2)));
    let w = DMatrix::from_diagonal(&nalgebra::dvector![torque * torque, 0.0, heading * heading, 0.0]);
    let gain = c.transpose() * certainty;
    let y = stabilising(&a.transpose(), &(&gain * c), &w)?;
    Ok(y * gain)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::{Controller, Disturbances, design, index, input, output, plant};
    use crate::following::trimming::Deviation;
    use crate::graph::spectrum::eigenvalues;

    /// The closed loop of plant and controller.
    fn closed_loop(k: &Controller, c_c: f64, v: f64) -> DMatrix<f64> {
        let (a, b, c) = (plant(c_c, v), input(), output());
        let mut whole = DMatrix::zeros(8, 8);
        whole.view_mut((0, 0), (4, 4)).copy_from(&a);
        whole.view_mut((0, 4), (4, 4)).copy_from(&(&b * DMatrix::from_row_slice(1, 4, k.c.as_slice())));
        whole.view_mut((4, 0), (4, 4)).copy_from(&(DMatrix::from_column_slice(4, 3, k.b.as_slice()) * c));
        whole.view_mut((4, 4), (4, 4)).copy_from(&DMatrix::from_column_slice(4, 4, k.a.as_slice()));
        whole
    }

    fn slowest(k: &Controller, c_c: f64, v: f64) -> f64 {
        eigenvalues(&closed_loop(k, c_c, v)).expect("it settles").iter().map(|s| s.re).fold(f64::MIN, f64::max)
    }

    /// The square of the H_2 norm from the disturbances to the index: trace of E P Eᵀ with M P + P Mᵀ + D Dᵀ = 0.
    fn h_2_squared(k: &Controller, c_c: f64, v: f64, d: &Disturbances) -> f64 {
        let m = closed_loop(k, c_c, v);
        let mut noise = DMatrix::zeros(8, 5);
        noise[(0, 0)] = d.torque;
        noise[(2, 1)] = d.heading;
        for row in 0..4 {
            for column in 0..3 {
                noise[(4 + row, 2 + column)] = k.b[(row, column)] * d.noise[column];
            }
        }
        let (one, q) = (DMatrix::<f64>::identity(8, 8), &noise * noise.transpose());
        let p = (one.kronecker(&m) + m.kronecker(&one)).lu().solve(&-DVector::from_column_slice(q.as_slice())).unwrap();
        let p = DMatrix::from_column_slice(8, 8, p.as_slice());
        let (c_1, d_12) = index();
        let mut e = DMatrix::zeros(3, 8);
        e.view_mut((0, 0), (3, 4)).copy_from(&c_1);
        e.view_mut((0, 4), (3, 4)).copy_from(&(d_12 * DMatrix::from_row_slice(1, 4, k.c.as_slice())));
        (&e * p * e.transpose()).trace()
    }

    #[test]
    fn the_plant_is_2_9_about_trimming() {
        // By central differences of (2.9) in (r, d_e, ψ_e), without the term −c_c v_e that counts as a disturbance.
        let (c_c, v, h) = (0.5, 0.4, 1e-5);
        let found = plant(c_c, v);
        for column in 0..3 {
            let rates = |sign: f64| {
                let [r, d_e, psi_e] = std::array::from_fn(|i| if i == column { sign * h } else { 0.0 });
                let seen = Deviation { r: c_c * v + r, d_e, psi_e, c_c, v, v_dot: 0.0 };
                [0.0, seen.d_e_dot(), seen.psi_e_dot(), d_e]
            };
            let (ahead, back) = (rates(1.0), rates(-1.0));
            for row in 0..4 {
                assert!((found[(row, column)] - (ahead[row] - back[row]) / (2.0 * h)).abs() < 1e-9, "{row} {column}");
            }
        }
        assert!(found.column(3).iter().all(|entry| *entry == 0.0), "the integral moves nothing");
        assert_eq!((input(), output() * input()), (dvector(&[1.0, 0.0, 0.0, 0.0]), dvector(&[1.0, 0.0, 0.0])));
    }

    fn dvector(entries: &[f64]) -> DMatrix<f64> {
        DMatrix::from_column_slice(entries.len(), 1, entries)
    }

    #[test]
    fn the_index_and_the_measurements_by_hand() {
        // r = 1, d_e = 2, ψ_e = 3, z = 4 and N = 5: e = (20·2 + 15·5, 5·4 + 15·5, 50·1 + 10·3 + 75·5).
        let state = dvector(&[1.0, 2.0, 3.0, 4.0]);
        let (c_1, d_12) = index();
        assert_eq!(c_1 * &state + d_12 * 5.0, dvector(&[115.0, 95.0, 455.0]));
        assert_eq!(output() * state, dvector(&[1.0, 2.0, 4.0]));
        assert_eq!(Disturbances::default(), Disturbances { heading: 1.0, torque: 1.0, noise: [0.1; 3] });
    }

    #[test]
    fn one_design_serves_the_three_speeds_of_figure_2_4() {
        let k = design(0.5, 0.4, &Disturbances::default()).unwrap();
        for v in [0.3, 0.4, 0.5] {
            let slowest = slowest(&k, 0.5, v);
            assert!(slowest < -0.05, "{v}: {slowest}");
        }
    }

    #[test]
    fn no_neighbouring_controller_is_better() {
        let d = Disturbances::default();
        let best = design(0.5, 0.4, &d).unwrap();
        let least = h_2_squared(&best, 0.5, 0.4, &d);
        let step = 1e-3;
        for entry in 0..32 {
            let mut slopes = [0.0; 2];
            for (slope, sign) in slopes.iter_mut().zip([1.0, -1.0]) {
                let mut other = best;
                let value = match entry {
                    0..16 => &mut other.a.as_mut_slice()[entry],
                    16..28 => &mut other.b.as_mut_slice()[entry - 16],
                    _ => &mut other.c.as_mut_slice()[entry - 28],
                };
                *value += sign * step;
                *slope = h_2_squared(&other, 0.5, 0.4, &d) / least - 1.0;
            }
            assert!(slopes.iter().all(|&more| more > -1e-9), "entry {entry}: {slopes:?}");
            assert!((slopes[0] - slopes[1]).abs() < 0.1 * step, "entry {entry} is not stationary: {slopes:?}");
        }
    }

    #[test]
    fn designs_without_sense_are_refused() {
        let d = Disturbances::default();
        assert!(design(0.5, 0.0, &d).is_err() && design(f64::NAN, 0.4, &d).is_err());
        assert!(design(0.5, 0.4, &Disturbances { torque: 0.0, ..d }).is_err());
        assert!(design(0.5, 0.4, &Disturbances { noise: [0.1, 0.0, 0.1], ..d }).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn every_design_stabilises_its_plant(c_c in -2.0..2.0f64, v in 0.05..2.0f64, noise in 0.01..1.0f64) {
            let d = Disturbances { noise: [noise; 3], ..Disturbances::default() };
            let k = design(c_c, v, &d).unwrap();
            prop_assert!(slowest(&k, c_c, v) < 0.0);
            prop_assert_eq!(k, design(-c_c, v, &d).unwrap(), "the curvature counts by its square");
        }
    }
}
