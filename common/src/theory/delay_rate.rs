//! How fast a fleet with late information agrees, where that can be said: for Lemmas 4.4 and 4.5 on a network that never
//! changes. The thesis gives no rate.
//!
//! With gains k/|N_i| the errors obey γ~' = −kγ~ + kD⁻¹Aγ~(t − τ) (4.40). On one graph, modes of D⁻¹A with eigenvalue μ ≠ 1
//! part company (μ = 1 is the fleet's common motion, (4.37)), each with
//!
//! ```text
//! s + k = kμ e^{−sτ},      rightmost root  s = −k + W_0(kτμ e^{kτ})/τ
//! ```
//!
//! where W_0 is the principal branch of Lambert's function, which has the largest real part of all branches. As |μ| ≤ 1,
//! a root with Re s ≥ 0 would need |s + k| ≤ k, so s = 0 and μ = 1: the fleet agrees for every delay, as the lemmas say.

use nalgebra::{Complex, DMatrix};

use crate::graph::Graph;
use crate::graph::spectrum::eigenvalues;
use crate::time::Span;

/// W_0(e^{`ln_z`}), for real ln z or Im in (−π, π]: the solution of w + ln w = ln z on the principal branch.
///
/// Newton's iteration where z is large, else Halley's from several starts.
fn lambert_w_0(ln_z: Complex<f64>) -> Complex<f64> {
    let one = Complex::from(1.0);
    // z itself where it does not overflow, so that the branch point at −1/e is passed safely.
    if ln_z.re > 3.0 {
        let mut w = ln_z - ln_z.ln();
        for _ in 0..60 {
            let step = (w + w.ln() - ln_z) * w / (w + one);
            w -= step;
            if step.norm() <= 1e-15 * w.norm() {
                break;
            }
        }
        return w;
    }
    let z = ln_z.exp();
    let branch = (Complex::from(2.0) * (z * std::f64::consts::E + one)).sqrt();
    // Near the branch point, near zero, and far from both. The principal branch has the largest real part of all, so what
    // another start finds on another branch does no harm.
    let starts = [branch - one - branch * branch / 3.0, (one + z).ln(), ln_z - ln_z.ln()];
    starts
        .into_iter()
        .map(|start| halley(z, start))
        .filter(|w| (w * w.exp() - z).norm() <= 1e-9 * z.norm())
        .max_by(|a, b| a.re.total_cmp(&b.re))
        .unwrap_or(Complex::from(f64::NAN))
}

/// Halley's iteration for we^w = z.
fn halley(z: Complex<f64>, start: Complex<f64>) -> Complex<f64> {
    let one = Complex::from(1.0);
    let mut w = start;
    for _ in 0..60 {
        let exp = w.exp();
        let excess = w * exp - z;
        let derivative = exp * (w + one);
        let step = excess / (derivative - (w + 2.0) * excess / ((w + one) * 2.0));
        if !step.re.is_finite() || !step.im.is_finite() {
            break;
        }
        w -= step;
        if step.norm() <= 1e-15 * (1.0 + w.norm()) {
            break;
        }
    }
    w
}

/// The rightmost root of s + k = kμe^{−sτ} \[1/s\].
pub fn rightmost(k: f64, mu: Complex<f64>, tau: Span) -> Complex<f64> {
    let tau = tau.secs();
    if mu.norm() == 0.0 {
        return Complex::from(-k);
    }
    if tau <= 0.0 {
        return (mu - 1.0) * k;
    }
    lambert_w_0((mu * (k * tau)).ln() + k * tau) / tau - k
}

/// The rate at which the differences decay under (4.34) with gains k/|N_i| and delay τ \[1/s\], on a graph that never
/// changes and in which everybody hears somebody; `None` if somebody does not, if it cannot agree, or if k is not positive.
pub fn rate(graph: &Graph, k: f64, tau: Span) -> Option<f64> {
    let n = graph.len();
    let everybody_hears = (0..n).all(|i| graph.degree(i) > 0);
    let usable = k > 0.0 && k.is_finite();
    if n < 2 || !everybody_hears || !graph.can_agree() || !usable {
        return None;
    }
    let averages = DMatrix::identity(n, n) - graph.normalised_laplacian();
    let mut spectrum = eigenvalues(&averages)?;
    let common = (0..n).min_by(|&i, &j| (spectrum[i] - 1.0).norm().total_cmp(&(spectrum[j] - 1.0).norm()))?;
    spectrum.remove(common);
    spectrum.iter().map(|&mu| -rightmost(k, mu, tau).re).min_by(f64::total_cmp).filter(|rate| rate.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::linear_coordination::tests::connected_graph;
    use proptest::prelude::*;

    #[test]
    fn lambert_by_hand() {
        // W(e) = 1, W(1) = Ω, W(−1/e) = −1, W(−π/2) = ±iπ/2.
        let w = |z: Complex<f64>| lambert_w_0(z.ln());
        assert!((w(Complex::from(std::f64::consts::E)) - 1.0).norm() < 1e-12);
        assert!((w(Complex::from(1.0)) - 0.567_143_290_409_783_8).norm() < 1e-12);
        assert!((w(Complex::from(-(-1.0f64).exp() * (1.0 - 1e-12))) + 1.0).norm() < 1e-5);
        for z in [-0.37, -0.5, -0.6679, -0.7364, -1.0, -3.0, -19.0, -21.0] {
            let found = lambert_w_0(Complex::new(f64::ln(-z), std::f64::consts::PI));
            assert!(
                (found * found.exp() - z).norm() < 1e-12 && (0.0..std::f64::consts::PI).contains(&found.im),
                "{z}: {found}"
            );
        }
        let quarter = w(Complex::from(-std::f64::consts::FRAC_PI_2));
        assert!((quarter.re.abs() < 1e-12) && (quarter.im.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((lambert_w_0(Complex::from(800.0)) + lambert_w_0(Complex::from(800.0)).ln() - 800.0).norm() < 1e-9);
    }

    #[test]
    fn a_pair_and_the_star() {
        // μ = −1 for a pair. Without delay its difference decays at 2k; the star's μ are 0 and −1.
        assert!((rate(&Graph::complete(2), 0.1, Span::ZERO).expect("connected") - 0.2).abs() < 1e-12);
        let star = Graph::from_edges(3, &[(0, 1), (1, 2)]);
        assert!((rate(&star, 0.1, Span::ZERO).expect("connected") - 0.1).abs() < 1e-9);
        assert_eq!(rate(&Graph::empty(2), 0.1, Span::ZERO), None);
        assert_eq!(rate(&star, 0.0, Span::ZERO), None);
        assert_eq!(rate(&Graph::from_arcs(2, &[(0, 1)]), 0.1, Span::ZERO), None, "vehicle 1 hears nobody");
        let two_pairs = Graph::from_edges(4, &[(0, 1), (2, 3)]);
        assert_eq!(rate(&two_pairs, 0.1, Span::from_secs(1.0)), None, "all hear somebody, and yet not all agree");
        let between_two = Graph::from_arcs(5, &[(0, 1), (1, 0), (2, 3), (3, 2), (4, 0), (4, 2)]);
        assert_eq!(rate(&between_two, 0.1, Span::from_secs(1.0)), None, "nor if somebody hears both");
        // μ = 0: who hears only those that have settled follows at k.
        assert_eq!(rightmost(0.3, Complex::from(0.0), Span::from_secs(2.0)), Complex::from(-0.3));
    }

    proptest! {
        #[test]
        fn it_is_a_root_and_none_is_to_its_right(
            k in 0.05..2.0f64, re in -1.0..0.95f64, im in prop_oneof![Just(0.0), -0.9..0.9f64], tau in 0.05..8.0f64
        ) {
            let mu = Complex::new(re, im);
            prop_assume!(mu.norm() <= 1.0 && mu.norm() > 1e-3);
            let span = Span::from_secs(tau);
            let tau = span.secs();
            let s = rightmost(k, mu, span);
            prop_assert!((s + k - mu * k * (-s * tau).exp()).norm() < 1e-7 * (1.0 + s.norm()), "{}", s);
            prop_assert!(s.re < 0.0);
            // The number of roots with a larger real part, by the argument principle on a box.
            let f = |s: Complex<f64>| s + k - mu * k * (-s * tau).exp();
            let (left, right, high) = (s.re + 1e-3 * (1.0 + s.re.abs()), 3.0 * k + 1.0, 3.0 * k + 1.0);
            let corners = [Complex::new(left, -high), Complex::new(right, -high), Complex::new(right, high), Complex::new(left, high)];
            let mut turns = 0.0;
            for side in 0..4 {
                let (from, to) = (corners[side], corners[(side + 1) % 4]);
                let mut before = f(from);
                for step in 1..=4000 {
                    let now = f(from + (to - from) * (f64::from(step) / 4000.0));
                    turns += (now / before).arg();
                    before = now;
                }
            }
            prop_assert!((turns / std::f64::consts::TAU).abs() < 0.2, "{} roots", turns / std::f64::consts::TAU);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn the_law_decays_as_fast(graph in connected_graph(), k in 0.2..1.0f64, tau in 0.0..2.0f64) {
            // Euler steps of (4.34), compared over a stretch late enough for the slowest mode to be alone.
            let (n, dt) = (graph.len(), 0.01);
            let late = (tau / dt).round() as usize;
            let rate = rate(&graph, k, Span::from_secs(late as f64 * dt)).expect("connected");
            prop_assume!(rate > 0.02);
            let mut past = vec![DVector::from_fn(n, |i, _| [1.0, -2.0, 0.3, 2.2, -0.9][i]); late + 1];
            let spread = |state: &DVector<f64>| state.max() - state.min();
            let steps = (12.0 / rate / dt) as usize;
            for _ in 0..steps {
                let (now, then) = (&past[past.len() - 1], &past[past.len() - 1 - late]);
                let next = DVector::from_fn(n, |i, _| {
                    let pull: f64 = graph.neighbours(i).map(|j| now[i] - then[j]).sum();
                    now[i] - dt * k / graph.degree(i) as f64 * pull
                });
                past.push(next);
            }
            // e^{−12} of the start at the promised rate, times a power of t where roots nearly meet; a rate a quarter
            // slower would leave e^{−9}.
            prop_assert!(spread(&past[past.len() - 1]) < 20.0 * (-10.5f64).exp());
        }
    }

    use nalgebra::DVector;
}
