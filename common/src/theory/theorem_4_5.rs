//! Theorem 4.5: coordination over a network that is connected only in mean (Definition 4.4).
//!
//! Agreement follows (Theorem 4.2), but the printed rate is not valid (erratum 4.7): λ̄_m is the least of v'L_pv/v'v
//! over all v *outside* the kernel of L_p, an infimum that is not attained. Near the kernel the quotient is as small
//! as one likes, so V may decay as slowly as one likes at an instant although L_pγ~ ≠ 0; and (4.31) also has 1/k_M
//! where 2k_m would be needed. Below is a rate that does follow. It is conservative.
//!
//! # A rate that is proven
//!
//! For two-way links, η = 0, a dwell time τ and a T as in Definition 4.4. With x = K^{−½}γ~ and S_p = K^½L_pK^½ the
//! errors obey x' = −S_p x, and |x|² = 2V.
//!
//! 1. *Pieces.* Cut every time between two switchings, at least τ long, into equal pieces of length in \[τ, 2τ). Let a
//!    window begin with a piece at s and consist of the pieces that begin in \[s, s + T\]. There are at most
//!    N = ⌊T/τ⌋ + 1 of them, the window is shorter than W = T + 2τ, and the union of its graphs is connected. Choose a
//!    spanning tree of the union, and for each of its n − 1 edges a piece that has the edge. Let S_i' ≤ S_i be the part
//!    of S_i made of the edges chosen for piece i: it is zero but for n − 1 pieces, and the S_i' sum to the tree's.
//! 2. *Within a piece* of length τ_i, from x_− to x_+, let Δ_i = |x_−|² − |x_+|². With y the parts of x_− along the
//!    eigenvectors of S_i and σ_j their eigenvalues, Δ_i = Σ(1 − e^{−2σ_jτ_i})y_j². Term by term,
//!    ```text
//!    |x_+ − x_−|² ≤ h Δ_i,      (1 − e^{−στ_i})²/(1 − e^{−2στ_i}) = tanh(στ_i/2) ≤ h := tanh(στ)
//!    x_−'S_i x_− ≤ g Δ_i,       σ_j/(1 − e^{−2σ_jτ_i}) ≤ g := σ/(1 − e^{−2στ})
//!    x_+'S_i x_+ ≤ g Δ_i,       σ_j/(e^{2σ_jτ_i} − 1) ≤ 1/(2τ) ≤ g
//!    ```
//!    where σ = n k_M bounds all eigenvalues of all S_p.
//! 3. *To the middle.* Let c be the state after ⌊N/2⌋ pieces. A piece on either side lies at most 0, 1, …, H − 1 pieces from
//!    it, H = ⌈N/2⌉; so the end of the piece that is nearer to c differs from it by at most √(h d Δ_side), with d that number of
//!    pieces and Δ_side the sum of Δ on that side. With at most M = min(H, n − 1) chosen pieces on a side, the d sum to at most
//!    R = M(H − 1) − M(M − 1)/2. By Minkowski's inequality, with Δ the sum over the window,
//!    ```text
//!    (Σ c'S_i'c)^½ ≤ (gΔ)^½ + (σ h R Δ)^½
//!    ```
//! 4. *The tree.* Its connectivity is at least that of a path, λ = 2(1 − cos(π/n)) (Fiedler). x is orthogonal to
//!    K^{−½}1, as β'γ~ = 0; and with z := γ~ less its plain mean, |x|² ≤ z'K⁻¹z ≤ |z|²/k_m because the mean that K
//!    weighs is the one that makes the weighted sum of squares least. Hence Σ c'S_i'c = z'L_tree z ≥ λ|z|² ≥ k_mλ|c|².
//! 5. *The window.* As |x| never grows, |x_end|² ≤ |c|² ≤ Δ/q with q = k_mλ/(g^½ + (σhR)^½)², and
//!    |x_start|² = |x_end|² + Δ ≥ (1 + q)|x_end|². Hence V decays at ln(1 + q)/W at least, and norms at half of that.
//!    From any t_0 the first window begins within 2τ and the last may be incomplete, whence V(t) ≤
//!    (1 + q)^{1 + 2τ/W} e^{−(t − t_0) ln(1 + q)/W} V(t_0), and ‖γ~‖² lies between 2k_mV and 2k_MV. ∎

use super::{Gains, PathFollowing, Verdict};
use crate::time::Span;

/// ‖γ~(t)‖ ≤ overshoot · e^{−rate (t − t_0)} ‖γ~(t_0)‖, for two-way links and η = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Rate at which ‖γ~‖ decays \[1/s\].
    pub rate: f64,
    /// By how much ‖γ~‖ can exceed that decay.
    pub overshoot: f64,
}

/// The proven rate for a network connected in mean with this T and this dwell time, see the proof above.
/// `None` if the dwell is not positive or T is negative.
pub fn agreement(gains: Gains, mean: Span, dwell: Span) -> Option<Agreement> {
    if dwell <= Span::ZERO || mean < Span::ZERO || gains.n < 2 {
        return None;
    }
    let Gains { n, k_m, k_max } = gains;
    let (mean_s, tau) = (mean.secs(), dwell.secs());
    let pieces = mean.nanos() / dwell.nanos() + 1;
    let half = (pieces - pieces / 2) as f64;
    let chosen = half.min(n as f64 - 1.0);
    let apart = chosen * (half - 1.0) - chosen * (chosen - 1.0) / 2.0;
    let sigma = n as f64 * k_max;
    let g = sigma / -(-2.0 * sigma * tau).exp_m1();
    let h = (sigma * tau).tanh();
    let lambda = 2.0 * (1.0 - (std::f64::consts::PI / n as f64).cos());
    let q = k_m * lambda / (g.sqrt() + (sigma * h * apart).sqrt()).powi(2);
    let window = mean_s + 2.0 * tau;
    let rate_of_v = q.ln_1p() / window;
    let overshoot = ((1.0 + q).powf(1.0 + 2.0 * tau / window) * k_max / k_m).sqrt();
    Some(Agreement { rate: 0.5 * rate_of_v, overshoot })
}

/// The loop gain of the small-gain argument for type I, with the proven constants: the theorem holds if it is below one.
///
/// The first factor is (4.28)'s gain from γ~ to η; the second that of (4.33) from η to γ~, with the overshoot C and
/// the rate r above. (‖ℒ_βη‖ is no larger than ‖η‖ in the norm that K⁻¹ weighs, so C covers it too.)
///
/// ```text
/// √(ρ_1n²k_M²/(λ_1α_1)) · C/r
/// ```
pub fn loop_gain(gains: Gains, agreement: Agreement, lambda_1: f64, rho_1: f64, alpha_1: f64) -> f64 {
    (rho_1 / (lambda_1 * alpha_1)).sqrt() * gains.n as f64 * gains.k_max * agreement.overshoot / agreement.rate
}

/// What the theorem says of a network that is connected in mean with T = `mean` (`None`: it is not) and that dwells
/// for `dwell` in each graph.
///
/// Definition 4.4 is for two-way links; that one-way links do too is known from the literature (Moreau 2004, Lin 2006) and not
/// covered here (`two_way` false). The rate is for path following of type II. Type I has a loop gain to keep below one; small
/// gain gives no rate.
pub fn verdict(gains: Gains, mean: Option<Span>, dwell: Span, two_way: bool, following: PathFollowing) -> Verdict {
    let proven = mean.filter(|_| two_way).and_then(|mean| agreement(gains, mean, dwell));
    let mut connected = mean.map_or("never connected".to_owned(), |mean| format!("T = {mean}"));
    if !two_way {
        connected += ", one-way links";
    }
    match following {
        PathFollowing::TypeII { lambda_1 } => Verdict {
            name: "Theorem 4.5 (type II)",
            condition: "two-way links, connected in mean for some T".to_owned(),
            value: connected,
            holds: mean.is_some() && two_way,
            norm_rate: proven.map(|agreement| agreement.rate.min(0.5 * lambda_1)).filter(|&rate| rate > 0.0),
        },
        PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => {
            let gain = proven.map(|agreement| loop_gain(gains, agreement, lambda_1, rho_1, alpha_1));
            Verdict {
                name: "Theorem 4.5 (type I)",
                condition: "two-way links, connected in mean for some T, loop gain < 1".to_owned(),
                value: format!(
                    "{connected}, loop gain {}",
                    gain.map_or("unknown".to_owned(), |gain| format!("{gain:.4}"))
                ),
                holds: gain.is_some_and(|gain| gain < 1.0),
                norm_rate: None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Agreement, agreement, loop_gain, verdict};
    use crate::graph::Graph;
    use crate::graph::measure::Connectivity;
    use crate::graph::spectrum::l_beta;
    use crate::random::Stream;
    use crate::theory::Gains;
    use crate::theory::PathFollowing::{TypeI, TypeII};
    use crate::time::{Span, Time};
    use nalgebra::{DMatrix, DVector, dvector};
    use proptest::prelude::*;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn gains(k: &[f64]) -> Gains {
        Gains::new(k).expect("positive")
    }
    fn flow(edges: &[(usize, usize)], k: &[f64], t: f64) -> DMatrix<f64> {
        let k_matrix = DMatrix::from_diagonal(&DVector::from_column_slice(k));
        (-(k_matrix * Graph::from_edges(k.len(), edges).laplacian()) * t).exp()
    }

    #[test]
    fn erratum_4_7_alternating_links_are_slower_than_printed() {
        let k = [1.0; 3];
        let turn = flow(&[(0, 2)], &k, 10.0) * flow(&[(0, 1)], &k, 10.0);
        let l_beta = l_beta(&k);
        // Each turn averages two vehicles: errors halve in every turn of 10 s, V falls by a factor of 4.
        let mut gamma = &turn * dvector![0.0, 5.0, -3.0];
        let before = (&l_beta * &gamma).norm_squared();
        gamma = &turn * gamma;
        let rate_of_v = (before / (&l_beta * &gamma).norm_squared()).ln() / 20.0;
        assert!((rate_of_v - 4f64.ln() / 10.0).abs() < 1e-6, "{rate_of_v}");
        let printed = (1.0 / 3.0) * 1.0; // (τ_D/(T + 2τ_D)) λ̄_m/k_M with the least nonzero eigenvalue for λ̄_m
        assert!(rate_of_v < printed, "the printed bound is no bound");
        let proven = agreement(gains(&k), s(10.0), s(10.0)).expect("it dwells");
        // By hand: N = 2, H = 1, R = 0, g = σ = 3, λ = 1, q = 1/3, W = 30 s.
        assert!((2.0 * proven.rate - (4.0f64 / 3.0).ln() / 30.0).abs() < 1e-9);
        assert!(2.0 * proven.rate < rate_of_v);
    }

    #[test]
    fn longer_waits_shorter_dwells_and_more_vehicles_are_worse() {
        let rate = |n: usize, mean, dwell| agreement(gains(&vec![0.5; n]), s(mean), s(dwell)).expect("it dwells").rate;
        assert!(rate(3, 10.0, 5.0) > rate(3, 20.0, 5.0));
        assert!(rate(3, 10.0, 1.0) > rate(3, 10.0, 0.1));
        assert!(rate(3, 10.0, 5.0) > rate(5, 10.0, 5.0));
        assert!(agreement(gains(&[1.0; 2]), s(1.0), Span::ZERO).is_none());
        assert!(agreement(gains(&[1.0; 2]), s(-1.0), s(1.0)).is_none());
    }

    #[test]
    fn verdicts_promise_only_what_is_proven() {
        let fleet = gains(&[1.0; 3]);
        let type_ii = TypeII { lambda_1: 1.0 };
        let good = verdict(fleet, Some(s(10.0)), s(10.0), true, type_ii);
        assert!(good.holds && good.norm_rate.is_some_and(|rate| rate > 0.0));
        let one_way = verdict(fleet, Some(s(10.0)), s(10.0), false, type_ii);
        assert_eq!((one_way.holds, one_way.norm_rate), (false, None));
        assert!(one_way.value.ends_with("one-way links") && !good.value.contains("one-way"));
        let never = verdict(fleet, None, s(10.0), true, type_ii);
        assert_eq!((never.holds, never.norm_rate), (false, None));
        let slow_following = verdict(fleet, Some(s(10.0)), s(10.0), true, TypeII { lambda_1: 1e-4 });
        assert_eq!(slow_following.norm_rate, Some(5e-5));
        let proven = agreement(fleet, s(10.0), s(10.0)).expect("it dwells");
        let type_i = |rho_1| TypeI { lambda_1: 1.0, rho_1, alpha_1: 0.5 };
        let limit = 1.0 / loop_gain(fleet, proven, 1.0, 1.0, 0.5).powi(2);
        assert!(verdict(fleet, Some(s(10.0)), s(10.0), true, type_i(0.99 * limit)).holds);
        assert!(!verdict(fleet, Some(s(10.0)), s(10.0), true, type_i(1.01 * limit)).holds);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn errors_decay_at_least_as_promised(
            k in prop::collection::vec(0.2..2.0f64, 2..6), dwell in 0.05..3.0f64, seed in any::<u64>()
        ) {
            // One random edge at a time, each for at least the dwell; T as measured.
            let n = k.len();
            let mut stream = Stream::new(seed, "edges");
            let (mut run, mut phases, mut t) = (Connectivity::new(), Vec::new(), Time::ZERO);
            for _ in 0..80 {
                let i = stream.below(n);
                let edge = (i, (i + 1 + stream.below(n - 1)) % n);
                let lasts = s(stream.uniform(dwell, 2.5 * dwell));
                run.graph(t, Graph::from_edges(n, &[edge]));
                phases.push((edge, lasts));
                t += lasts;
            }
            run.advance(t);
            let Some(mean) = run.connected_in_mean() else { return Ok(()) };
            let proven = agreement(gains(&k), mean, s(dwell)).expect("it dwells");
            prop_assert!(proven.rate > 0.0 && proven.overshoot >= 1.0);
            let l_beta = l_beta(&k);
            let mut gamma = DVector::from_fn(n, |_, _| stream.uniform(-5.0, 5.0));
            let (start, mut t) = ((&l_beta * &gamma).norm(), 0.0);
            for (edge, lasts) in phases {
                gamma = flow(&[edge], &k, lasts.secs()) * gamma;
                t += lasts.secs();
                let promised = proven.overshoot * (-proven.rate * t).exp() * start;
                prop_assert!((&l_beta * &gamma).norm() <= promised + 1e-9);
            }
        }

        #[test]
        fn a_window_contracts_as_step_5_says(seed in any::<u64>(), dwell in 0.02..5.0f64) {
            // The least contraction of a window that meets every edge of a path once, from the flow's singular
            // values in the norm that K weighs: the proof's q must not claim more.
            let mut stream = Stream::new(seed, "window");
            let n = 2 + stream.below(4);
            let k: Vec<f64> = (0..n).map(|_| stream.uniform(0.2, 2.0)).collect();
            let mut order: Vec<usize> = (0..n - 1).collect();
            for i in (1..n - 1).rev() {
                order.swap(i, stream.below(i + 1));
            }
            let mut total = DMatrix::identity(n, n);
            for &edge in &order {
                total = flow(&[(edge, edge + 1)], &k, dwell) * total;
            }
            let root = DMatrix::from_diagonal(&DVector::from_iterator(n, k.iter().map(|k| k.sqrt())));
            let inverse = DMatrix::from_diagonal(&DVector::from_iterator(n, k.iter().map(|k| 1.0 / k.sqrt())));
            let mut singular: Vec<f64> = (inverse * total * root).singular_values().iter().copied().collect();
            singular.sort_by(f64::total_cmp);
            // The largest one is agreement itself, which does not change.
            let contraction = singular[n - 2].powi(2);
            let mean = dwell * (n as f64 - 2.0) + 1e-6;
            let proven = agreement(gains(&k), s(mean), s(dwell)).expect("it dwells");
            let claimed = (-2.0 * proven.rate * (mean + 2.0 * dwell)).exp();
            prop_assert!(contraction <= claimed + 1e-12, "{} {}", contraction, claimed);
        }
    }

    #[test]
    fn the_proof_by_hand_for_four_unlike_gains() {
        // T = 0.7 s, τ = 0.1 s: N = 8, H = 4, M = 3, and the three nearest of four pieces are 3, 2 and 1 pieces away.
        let proven = agreement(gains(&[0.5, 1.0, 2.0, 1.0]), s(0.7), s(0.1)).expect("it dwells");
        let (sigma, apart, lambda) = (8.0f64, 3.0 + 2.0 + 1.0, 2.0 - 2f64.sqrt());
        let (g, h) = (sigma / (1.0 - (-1.6f64).exp()), 0.8f64.tanh());
        let q = 0.5 * lambda / (g.sqrt() + (sigma * h * apart).sqrt()).powi(2);
        assert!((proven.rate - 0.5 * (1.0 + q).ln() / 0.9).abs() < 1e-12, "{}", proven.rate);
        assert!(
            (proven.overshoot - ((1.0 + q).powf(11.0 / 9.0) * 2.0 / 0.5).sqrt()).abs() < 1e-12,
            "{}",
            proven.overshoot
        );
        // A tree of three has two edges, so that only the pieces 3 and 2 away count, and λ = 1.
        let three = agreement(gains(&[0.5, 1.0, 2.0]), s(0.7), s(0.1)).expect("it dwells");
        let (g, h) = (6.0 / (1.0 - (-1.2f64).exp()), 0.6f64.tanh());
        let q_3 = 0.5 / (g.sqrt() + (6.0 * h * 5.0).sqrt()).powi(2);
        assert!((three.rate - 0.5 * (1.0 + q_3).ln() / 0.9).abs() < 1e-12, "{}", three.rate);
        assert_eq!(agreement(Gains { n: 1, k_m: 1.0, k_max: 1.0 }, s(0.7), s(0.1)), None, "nobody to agree with");
        // An odd number of pieces has its middle in one of them: N = 7, H = 4 as well.
        let odd = agreement(gains(&[0.5, 1.0, 2.0, 1.0]), s(0.6), s(0.1)).expect("it dwells");
        assert!((odd.rate - 0.5 * (1.0 + q).ln() / 0.8).abs() < 1e-12, "{}", odd.rate);
    }

    #[test]
    fn the_loop_gain_by_hand() {
        // √(18/(½·4)) = 3, times n k_M = 8, times C/r = 12.
        let gain = loop_gain(gains(&[1.0, 2.0, 1.0, 0.5]), Agreement { rate: 0.25, overshoot: 3.0 }, 0.5, 18.0, 4.0);
        assert!((gain - 288.0).abs() < 1e-9, "{gain}");
        let type_i = TypeI { lambda_1: 1.0, rho_1: 0.0, alpha_1: 0.5 };
        let fleet = gains(&[1.0; 3]);
        assert!(verdict(fleet, Some(s(10.0)), s(10.0), true, type_i).holds);
        assert!(
            !verdict(fleet, None, s(10.0), true, type_i).holds
                && !verdict(fleet, Some(s(10.0)), s(10.0), false, type_i).holds
        );
        // Path following that does not decay leaves no rate to promise.
        assert_eq!(verdict(fleet, Some(s(10.0)), s(10.0), true, TypeII { lambda_1: 0.0 }).norm_rate, None);
    }
}
