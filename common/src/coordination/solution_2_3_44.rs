//! Solution II of Proposition 3.4: linear, and content with the neighbours' positions along their paths.

use super::disagreement::{Disagreement, c};
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// Solution II. Only ξ_j of the neighbours is needed (erratum 3.22).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolutionTwo {
    a: f64,
    b: f64,
}

impl SolutionTwo {
    /// `a` a_i > 0 \[1/s\] damps the speed-tracking error; `b` b_i > 0 \[m²/s²\] weighs the coordination error. Two
    /// vehicles with R = 1 do not overshoot if a² ≥ 8b.
    pub fn new(a: f64, b: f64) -> Result<SolutionTwo, String> {
        Ok(SolutionTwo { a: positive("the gain a", a)?, b: positive("the gain b", b)? })
    }
}

impl CoordinationLaw for SolutionTwo {
    /// u = −Aη − BCLξ (3.44), of which row i is u_i = −a_i η_i − (b_i/R_i) Σ (ξ_i − ξ_j).
    fn demand(&self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let disagreement = Disagreement::among(own, neighbours);
        Demand::Acceleration(-self.a * own.eta - self.b * c(own) * disagreement.ahead)
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }
}

#[cfg(test)]
mod tests {
    use super::SolutionTwo;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, PAIR, ROW_OF_FOUR, assert_shift_invariant_and_ahead_slows_down as assert_sane,
    };
    use crate::coordination::{CoordinationLaw, Demand, Neighbour, Own, SpeedReference};

    const NETWORK: Network<'_, 4> = Network { hears: ROW_OF_FOUR, r: [1.0, 2.0, 3.0, 4.0], v_l: 0.1 };

    #[test]
    fn the_row_of_the_law_by_hand() {
        let neighbours = [
            Neighbour { xi: 1.0, scalar: 7.0, ..Neighbour::default() },
            Neighbour { xi: 2.5, scalar: 7.0, ..Neighbour::default() },
        ];
        let own = Own { xi: 2.0, eta: 1.0, r: 4.0, ..Own::default() };
        let u = SolutionTwo::new(2.0, 3.0).unwrap().demand(SpeedReference::default(), &own, &neighbours);
        assert_eq!(u, Demand::Acceleration(-2.0 - 3.0 / 4.0 * 0.5));
    }

    #[test]
    fn two_vehicles_in_closed_form() {
        // R = 1, a = 3, b = 1: s² + 3 s + 2 = (s + 1)(s + 2).
        let law = SolutionTwo::new(3.0, 1.0).unwrap();
        let end = Network { hears: PAIR, r: [1.0; 2], v_l: 0.1 }.run(&law, Fleet::at([1.0, 0.0]), 3.0, 0.01);
        assert!((end.xi[0] - end.xi[1] - 2.0 * (-3.0f64).exp() + (-6.0f64).exp()).abs() < 1e-8);
    }

    #[test]
    fn the_lyapunov_function_of_its_proof() {
        // V = ½ηᵀB⁻¹η + ½ξᵀLξ (3.50);  V̇ = −ηᵀB⁻¹Aη. V is quadratic: its difference is exact.
        let law = SolutionTwo::new(0.7, 0.3).unwrap();
        let v = |fleet: &Fleet<4>| {
            let l_xi = NETWORK.laplacian(&fleet.xi);
            (0..4).map(|i| 0.5 * (fleet.xi[i] * l_xi[i] + fleet.eta[i].powi(2) / 0.3)).sum::<f64>()
        };
        let fleet = Fleet { xi: [0.3, -1.0, 2.0, 0.1], eta: [0.5, -0.2, 0.4, -1.0] };
        let rate = NETWORK.rate(&law, &fleet);
        let difference = v(&fleet.moved(&rate, 0.5)) - v(&fleet.moved(&rate, -0.5));
        let exact: f64 = fleet.eta.iter().map(|eta| -eta * eta * 0.7 / 0.3).sum();
        assert!((difference - exact).abs() < 1e-12, "{difference} {exact}");
    }

    #[test]
    fn a_row_of_four_agrees() {
        let law = SolutionTwo::new(1.0, 1.0).unwrap();
        let end = NETWORK.run(&law, Fleet::at([0.0, 1.0, -2.0, 3.0]), 250.0, 0.05);
        assert!(end.spread() < 1e-4 && end.eta.iter().all(|eta| eta.abs() < 1e-4), "{end:?}");
    }

    #[test]
    fn it_is_sane() {
        let law = SolutionTwo::new(1.0, 1.0).unwrap();
        assert_sane(&law);
        assert!(!law.needs_speed_error() && SolutionTwo::new(1.0, 0.0).is_err() && SolutionTwo::new(0.0, 1.0).is_err());
    }
}
