//! Solution I of Proposition 3.4: linear, and fast because speeds are exchanged.

use super::disagreement::{Disagreement, c};
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// Solution I. Both ξ_j and η_j/R_j of the neighbours are needed (erratum 3.22).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolutionOne {
    a: f64,
}

impl SolutionOne {
    /// `a` a_i > 0 \[1/s\]: damps the speed-tracking error and weighs the coordination error; 1 in Figure 3.9.
    pub fn new(a: f64) -> Result<SolutionOne, String> {
        Ok(SolutionOne { a: positive("the gain a", a)? })
    }
}

impl CoordinationLaw for SolutionOne {
    /// u = −(LC + C + A)η − ALξ (3.43), of which row i is
    /// u_i = −(a_i + 1/R_i) η_i − Σ (a_i (ξ_i − ξ_j) + η_i/R_i − η_j/R_j).
    fn demand(&self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let disagreement = Disagreement::among(own, neighbours);
        Demand::Acceleration(-(self.a + c(own)) * own.eta - (self.a * disagreement.ahead + disagreement.faster))
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn needs_speed_error(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::SolutionOne;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, PAIR, ROW_OF_FOUR, assert_shift_invariant_and_ahead_slows_down as assert_sane,
    };
    use crate::coordination::{CoordinationLaw, Demand, Neighbour, Own, SpeedReference};

    const NETWORK: Network<'_, 4> = Network { hears: ROW_OF_FOUR, r: [1.0, 2.0, 3.0, 4.0], v_l: 0.1 };

    #[test]
    fn the_row_of_the_law_by_hand() {
        let neighbours = [
            Neighbour { xi: 1.0, scalar: 0.5, ..Neighbour::default() },
            Neighbour { xi: 2.5, scalar: -0.25, ..Neighbour::default() },
        ];
        let u = SolutionOne::new(2.0).unwrap().demand(
            SpeedReference { v_l: 9.0, v_l_dot: 9.0 },
            &Own { xi: 2.0, eta: 1.0, r: 4.0, ..Own::default() },
            &neighbours,
        );
        // −(2 + ¼)·1 − [2·(1 − 0.5) + (0.25 − 0.5) + (0.25 + 0.25)]
        assert_eq!(u, Demand::Acceleration(-2.25 - 1.25));
    }

    #[test]
    fn two_vehicles_in_closed_form() {
        // R = 1: η₁₂' = −(3 + a) η₁₂ − 2a ξ₁₂, so s² + (3 + a) s + 2a with a = 1: s = −2 ± √2.
        let law = SolutionOne::new(1.0).unwrap();
        let end = Network { hears: PAIR, r: [1.0; 2], v_l: 0.1 }.run(&law, Fleet::at([1.0, 0.0]), 3.0, 0.01);
        let (p, q) = (-2.0 + 2f64.sqrt(), -2.0 - 2f64.sqrt());
        let expected = (q * (3.0 * p).exp() - p * (3.0 * q).exp()) / (q - p);
        assert!((end.xi[0] - end.xi[1] - expected).abs() < 1e-8);
    }

    #[test]
    fn the_lyapunov_function_of_its_proof() {
        // V = ½ξᵀLξ + ½zᵀz with z = η + Lξ;  V̇ = −ηᵀCη − zᵀAz. V is quadratic: its difference is exact.
        let law = SolutionOne::new(0.7).unwrap();
        let z = |fleet: &Fleet<4>| {
            let l_xi = NETWORK.laplacian(&fleet.xi);
            std::array::from_fn::<f64, 4, _>(|i| fleet.eta[i] + l_xi[i])
        };
        let v = |fleet: &Fleet<4>| {
            let (z, l_xi) = (z(fleet), NETWORK.laplacian(&fleet.xi));
            (0..4).map(|i| 0.5 * (fleet.xi[i] * l_xi[i] + z[i] * z[i])).sum::<f64>()
        };
        let fleet = Fleet { xi: [0.3, -1.0, 2.0, 0.1], eta: [0.5, -0.2, 0.4, -1.0] };
        let rate = NETWORK.rate(&law, &fleet);
        let difference = v(&fleet.moved(&rate, 0.5)) - v(&fleet.moved(&rate, -0.5));
        let exact: f64 = (0..4).map(|i| -fleet.eta[i].powi(2) / NETWORK.r[i] - 0.7 * z(&fleet)[i].powi(2)).sum();
        assert!((difference - exact).abs() < 1e-12, "{difference} {exact}");
    }

    #[test]
    fn a_row_of_four_agrees() {
        let end = NETWORK.run(&SolutionOne::new(1.0).unwrap(), Fleet::at([0.0, 1.0, -2.0, 3.0]), 120.0, 0.05);
        assert!(end.spread() < 1e-5 && end.eta.iter().all(|eta| eta.abs() < 1e-5), "{end:?}");
    }

    #[test]
    fn it_is_sane() {
        let law = SolutionOne::new(1.0).unwrap();
        assert_sane(&law);
        assert!(law.needs_speed_error() && SolutionOne::new(-1.0).is_err());
    }
}
