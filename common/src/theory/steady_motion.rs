//! What δ leaves in the end: the rate at which a fleet travels, how far apart its targets stay, and how far every vehicle is behind its own.
//!
//! α_2 of (4.46) does not vanish when δ ≠ 0 (erratum 4.14). In steady motion along a straight path it is affine in the rate of the target,
//! α_2i = a_0i + a_1i(γ̇ − v_n) ([`Gains::steady_alpha_2`](crate::following::theorem_4_7::Gains::steady_alpha_2)), and the target goes at
//!
//! ```text
//! type I,  (4.53) at rest:        γ̇ = v_r,i − α_2i/κ_i,    κ_i = k_η        v_r,i = v_L − g_i(Lγ)_i − g_i d_i τ γ̇
//! (4.59), (4.60) at rest:         γ̇ = v_L − ((Lγ)_i + α_2i)/κ_i,            κ_i = a_1(a_1 + a_2)/a_2
//! ```
//!
//! the latter from z = (Lγ + α_2)/(a_1 + a_2). Under (4.21) g_i = k_i and τ = 0; under (4.34) and (4.42) g_i = k/|N_i| and g_i d_i τ = kτ =: ℓ. With
//! g_i = 1/κ_i for (4.59) all of them say
//!
//! ```text
//! g_i(Lγ~)_i + γ̇(1 + ℓ + a_1i/κ_i) = v_L − (a_0i − a_1i v_n)/κ_i,    Σγ~_i = 0
//! ```
//!
//! n + 1 equations for γ~ and one γ̇ for all. If a_0, a_1 and κ are the same for all, γ~ = 0 and γ̇ does not depend on the network: this
//! is result v of docs/errata.md. Else the vehicles settle apart from one another.
//!
//! The rate then gives the bias of every vehicle ([`Gains::predicted_bias_at`](crate::following::theorem_4_7::Gains::predicted_bias_at), with
//! s = (γ̇ − v_n)|p'|). None of this exists where |p'| changes on the way, for α_2 changes with it.

use nalgebra::{DMatrix, DVector};

use crate::graph::Graph;

/// One vehicle of the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling {
    /// a_0 and a_1 of α_2.
    pub alpha_2: [f64; 2],
    /// κ_i, positive.
    #[doc(alias = "κ")]
    pub kappa: f64,
    /// g_i, positive.
    pub gain: f64,
}

/// A fleet that has settled.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyMotion {
    /// γ̇ \[1/s\], the same for all.
    pub rate: f64,
    /// γ~: the coordination state of every vehicle less their mean.
    pub apart: Vec<f64>,
}

/// How a fleet travels in the end on a network that does not change: v_L and v_n \[1/s\], and ℓ = kτ of a law that hears of others late
/// (else 0). `None` if sizes differ, or if there is no such motion or more than one: nobody is heard by all.
pub fn steady_motion(vehicles: &[Settling], graph: &Graph, v_l: f64, v_n: f64, lag: f64) -> Option<SteadyMotion> {
    let n = vehicles.len();
    if graph.len() != n || n == 0 || !graph.can_agree() {
        return None;
    }
    let l = graph.laplacian();
    let mut system = DMatrix::zeros(n + 1, n + 1);
    let mut right = DVector::zeros(n + 1);
    for (i, vehicle) in vehicles.iter().enumerate() {
        let [a_0, a_1] = vehicle.alpha_2;
        for j in 0..n {
            system[(i, j)] = vehicle.gain * l[(i, j)];
        }
        system[(i, n)] = 1.0 + lag + a_1 / vehicle.kappa;
        right[i] = v_l - (a_0 - a_1 * v_n) / vehicle.kappa;
        system[(n, i)] = 1.0;
    }
    let solved = system.lu().solve(&right).filter(|solved| solved.iter().all(|value| value.is_finite()))?;
    Some(SteadyMotion { rate: solved[n], apart: solved.iter().take(n).copied().collect() })
}

/// Whether all settle alike, so that they agree, whatever the network does.
pub fn alike(vehicles: &[Settling]) -> bool {
    // Lines in other directions differ in |p'| by a rounding error.
    let same = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-9 * a.abs();
    let pair_alike = |a: &Settling, b: &Settling| {
        a.alpha_2.iter().zip(&b.alpha_2).all(|(a, b)| same(*a, *b)) && same(a.kappa, b.kappa)
    };
    vehicles.windows(2).all(|pair| pair_alike(&pair[0], &pair[1]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::following::theorem_4_7::Gains;
    use crate::theory::linear_coordination::tests::connected_graph;
    use crate::vehicle::sirene::sirene;

    const STRETCH: f64 = 0.32;

    fn vehicle(gains: Gains, kappa: f64, gain: f64) -> Settling {
        let [a_0, at_one] = [0.0, 1.0].map(|x| gains.steady_alpha_2(&sirene(), x, STRETCH));
        Settling { alpha_2: [a_0, at_one - a_0], kappa, gain }
    }

    #[test]
    fn equal_vehicles_agree_at_the_rate_of_one() {
        let gains = Gains::default();
        let fleet = vec![vehicle(gains, gains.k_eta, 0.1); 3];
        let star = Graph::from_edges(3, &[(0, 1), (1, 2)]);
        let settled = steady_motion(&fleet, &star, 0.5, 0.5, 0.0).expect("connected");
        let alone = gains.predicted_rate_type_1(&sirene(), 0.5, 0.5, STRETCH);
        assert!((settled.rate - alone).abs() < 1e-12 && alone < 0.45, "{settled:?} {alone}");
        assert!(settled.apart.iter().all(|apart| apart.abs() < 1e-12) && alike(&fleet));
        // v_r = v_L − kτγ̇ is what a fleet hears of itself τ late: without α_2 it is v_L*.
        let plain = vec![Settling { alpha_2: [0.0; 2], ..fleet[0] }; 3];
        let late = steady_motion(&plain, &star, 0.5, 1.0 / 3.0, 0.5).expect("connected");
        assert!((late.rate - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(steady_motion(&fleet, &Graph::empty(3), 0.5, 0.5, 0.0), None);
        assert_eq!(steady_motion(&fleet[..2], &star, 0.5, 0.5, 0.0), None);
    }

    proptest! {
        #[test]
        fn the_law_is_at_rest_there(
            graph in connected_graph(), delta in prop::collection::vec(-0.6..-0.2f64, 6), a_1 in 1.0..10.0f64,
            a_2 in 1.0..10.0f64, v_l in 0.1..0.6f64,
        ) {
            // (4.61) with what the vehicles then do: γ̇ is the same for all, ż = 0.
            let of = |delta1: &f64| {
                let kappa = a_1 * (a_1 + a_2) / a_2;
                vehicle(Gains { delta1: *delta1, ..Gains::default() }, kappa, kappa.recip())
            };
            let fleet: Vec<Settling> = delta.iter().take(graph.len()).map(of).collect();
            let settled = steady_motion(&fleet, &graph, v_l, v_l, 0.0).expect("connected");
            let apart = DVector::from_column_slice(&settled.apart);
            let ahead = graph.laplacian() * &apart;
            prop_assert!(apart.sum().abs() < 1e-9 && !alike(&fleet));
            for (vehicle, ahead) in fleet.iter().zip(ahead.iter()) {
                let driven = ahead + vehicle.alpha_2[0] + vehicle.alpha_2[1] * (settled.rate - v_l);
                let z = driven / (a_1 + a_2);
                prop_assert!((v_l + z - driven / a_1 - settled.rate).abs() < 1e-9, "{:?}", settled);
            }
        }
    }
}
