//! Solution III, Proposition 3.5: coordination errors, however large, ask for a bounded acceleration.

use super::disagreement::{Disagreement, c};
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// Solution III. Both ξ_j and η_j/R_j of the neighbours are needed (erratum 3.22).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolutionThree {
    a: f64,
    b: f64,
    x_m: f64,
}

impl SolutionThree {
    /// `a` a_i > 0 damps the speed-tracking error, `b` b_i > 0 \[1/s\] weighs the saturated error and `x_m` > 0
    /// \[m/s\] bounds it: at rest the demand stays within b x_m. Figure 3.7 has 1, 0.25 and 1.
    pub fn new(a: f64, b: f64, x_m: f64) -> Result<SolutionThree, String> {
        Ok(SolutionThree {
            a: positive("the gain a", a)?,
            b: positive("the gain b", b)?,
            x_m: positive("the saturation x_m", x_m)?,
        })
    }

    /// sat(x), (3.46).
    fn sat(&self, x: f64) -> f64 {
        x.clamp(-self.x_m, self.x_m)
    }
}

impl CoordinationLaw for SolutionThree {
    /// u = −(A⁻¹L + A)Cη − B sat(η + A⁻¹Lξ) (3.45), of which row i is (3.64):
    /// u_i = −(a_i/R_i) η_i − (1/a_i) Σ (η_i/R_i − η_j/R_j) − b_i sat(η_i + (1/a_i) Σ (ξ_i − ξ_j)).
    fn demand(&self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let disagreement = Disagreement::among(own, neighbours);
        let z = own.eta + disagreement.ahead / self.a;
        Demand::Acceleration(-self.a * c(own) * own.eta - disagreement.faster / self.a - self.b * self.sat(z))
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
    use proptest::prelude::*;

    use super::SolutionThree;
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
        let own = Own { xi: 2.0, eta: 1.0, r: 4.0, ..Own::default() };
        let law = |x_m| SolutionThree::new(2.0, 3.0, x_m).unwrap();
        // −2/4·1 − ½·(−0.25 + 0.5) − 3·sat(1 + ½·0.5)
        let u = law(10.0).demand(SpeedReference::default(), &own, &neighbours);
        assert_eq!(u, Demand::Acceleration(-0.5 - 0.125 - 3.75));
        let u = law(1.0).demand(SpeedReference::default(), &own, &neighbours);
        assert_eq!(u, Demand::Acceleration(-0.5 - 0.125 - 3.0));
    }

    #[test]
    fn two_vehicles_in_closed_form() {
        // R = 1, a = 1, b = 2, unsaturated: s² + (3 + b) s + 2b = (s + 1)(s + 4).
        let law = SolutionThree::new(1.0, 2.0, 10.0).unwrap();
        let end = Network { hears: PAIR, r: [1.0; 2], v_l: 0.1 }.run(&law, Fleet::at([1.0, 0.0]), 2.0, 0.005);
        let expected = (4.0 * (-2.0f64).exp() - (-8.0f64).exp()) / 3.0;
        assert!((end.xi[0] - end.xi[1] - expected).abs() < 1e-8);
    }

    proptest! {
        #[test]
        fn from_rest_the_demand_is_bounded(xi in -1e9..1e9f64, other in -1e9..1e9f64, r in 0.1..10.0f64) {
            let law = SolutionThree::new(1.0, 0.25, 1.0).unwrap();
            let neighbours = [Neighbour { xi: other, scalar: 0.0, ..Neighbour::default() }];
            let demand = law.demand(SpeedReference::default(), &Own { xi, eta: 0.0, r, ..Own::default() }, &neighbours);
            let Demand::Acceleration(u) = demand else { unreachable!() };
            prop_assert!(u.abs() <= 0.25 && u * (xi - other) <= 0.0);
        }
    }

    #[test]
    fn the_lyapunov_function_of_its_proof() {
        // V = ½ξᵀLξ + ½zᵀz with z = η + A⁻¹Lξ;  V̇ = −ηᵀACη − zᵀB sat(z), saturated and not.
        let law = SolutionThree::new(0.7, 0.3, 1.0).unwrap();
        let z = |fleet: &Fleet<4>| {
            let l_xi = NETWORK.laplacian(&fleet.xi);
            std::array::from_fn::<f64, 4, _>(|i| fleet.eta[i] + l_xi[i] / 0.7)
        };
        let v = |fleet: &Fleet<4>| {
            let (z, l_xi) = (z(fleet), NETWORK.laplacian(&fleet.xi));
            (0..4).map(|i| 0.5 * (fleet.xi[i] * l_xi[i] + z[i] * z[i])).sum::<f64>()
        };
        let fleet = Fleet { xi: [0.3, 0.2, 2.0, 0.1], eta: [0.5, -0.2, 0.4, -1.0] };
        assert!(z(&fleet).iter().any(|z| z.abs() > 1.0) && z(&fleet).iter().any(|z| z.abs() < 1.0));
        let rate = NETWORK.rate(&law, &fleet);
        let difference = v(&fleet.moved(&rate, 0.5)) - v(&fleet.moved(&rate, -0.5));
        let exact: f64 = (0..4)
            .map(|i| {
                let z = z(&fleet)[i];
                -0.7 * fleet.eta[i].powi(2) / NETWORK.r[i] - 0.3 * z * z.clamp(-1.0, 1.0)
            })
            .sum();
        assert!((difference - exact).abs() < 1e-12, "{difference} {exact}");
    }

    #[test]
    fn a_row_of_four_agrees_with_the_gains_of_figure_3_7() {
        let law = SolutionThree::new(1.0, 0.25, 1.0).unwrap();
        let end = NETWORK.run(&law, Fleet::at([0.0, 1.0, -2.0, 3.0]), 250.0, 0.05);
        assert!(end.spread() < 1e-4 && end.eta.iter().all(|eta| eta.abs() < 1e-4), "{end:?}");
    }

    #[test]
    fn it_is_sane() {
        // The sign is only visible below saturation.
        let law = SolutionThree::new(1.0, 1.0, 10.0).unwrap();
        assert_sane(&law);
        assert!(law.needs_speed_error() && SolutionThree::new(1.0, 1.0, 0.0).is_err());
    }
}
