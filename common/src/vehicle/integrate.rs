//! The classical Runge-Kutta method of fourth order on states of fixed size: no allocation, the same bits everywhere.

use nalgebra::SVector;

/// One step of length `dt` from `x` at time `t`, for ẋ = `model`(t, x, u, params) with `u` held.
pub fn rk4_step<const N: usize, U, P>(
    model: impl Fn(f64, &SVector<f64, N>, &U, &P) -> SVector<f64, N>,
    t: f64,
    x: &SVector<f64, N>,
    u: &U,
    params: &P,
    dt: f64,
) -> SVector<f64, N> {
    let half = 0.5 * dt;
    let k1 = model(t, x, u, params);
    let k2 = model(t + half, &(x + half * k1), u, params);
    let k3 = model(t + half, &(x + half * k2), u, params);
    let k4 = model(t + dt, &(x + dt * k3), u, params);
    x + (dt / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
}

/// The state `dt` seconds later, in `substeps` equal steps (at least one) with `u` held.
pub fn advance<const N: usize, U, P>(
    model: impl Fn(f64, &SVector<f64, N>, &U, &P) -> SVector<f64, N>,
    x: &SVector<f64, N>,
    u: &U,
    params: &P,
    dt: f64,
    substeps: usize,
) -> SVector<f64, N> {
    let substeps = substeps.max(1);
    let step = dt / substeps as f64;
    (0..substeps).fold(*x, |x, k| rk4_step(&model, k as f64 * step, &x, u, params, step))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector1, Vector2};

    use super::{advance, rk4_step};

    #[test]
    fn a_cubic_in_time_is_integrated_exactly() {
        // ∫₁³ (u t³ + p) dt = u·20 + 2p
        let model = |t: f64, _: &Vector1<f64>, u: &f64, p: &f64| Vector1::new(u * t.powi(3) + p);
        let end = rk4_step(model, 1.0, &Vector1::new(0.5), &2.0, &3.0, 2.0);
        assert!((end.x - (0.5 + 40.0 + 6.0)).abs() < 1e-12);
    }

    #[test]
    fn halving_the_step_divides_the_error_by_sixteen() {
        let model = |_: f64, x: &Vector2<f64>, w: &f64, _: &()| Vector2::new(w * x.y, -w * x.x);
        let error = |substeps| {
            let end = advance(model, &Vector2::new(0.0, 1.0), &2.0, &(), 1.0, substeps);
            (end - Vector2::new(2f64.sin(), 2f64.cos())).norm()
        };
        let ratio = error(20) / error(40);
        assert!((14.0..18.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn time_goes_on_from_one_substep_to_the_next() {
        // ∫₀² t³ dt = 4, in any number of steps.
        let model = |t: f64, _: &Vector1<f64>, _: &(), _: &()| Vector1::new(t.powi(3));
        for substeps in [1, 2, 5] {
            assert!((advance(model, &Vector1::new(0.0), &(), &(), 2.0, substeps).x - 4.0).abs() < 1e-12, "{substeps}");
        }
    }

    #[test]
    fn no_substeps_count_as_one() {
        let model = |_: f64, x: &Vector1<f64>, _: &(), _: &()| -x;
        let x = Vector1::new(1.0);
        assert_eq!(advance(model, &x, &(), &(), 0.1, 0), advance(model, &x, &(), &(), 0.1, 1));
        assert_eq!(advance(model, &x, &(), &(), 0.1, 1), rk4_step(model, 0.0, &x, &(), &(), 0.1));
    }
}
