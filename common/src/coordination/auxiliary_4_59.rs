//! Coordination with an auxiliary state (section 4.5.2): over a fixed network, where it also takes up what coordination does
//! to path following, and over a switching one.

use super::disagreement::Disagreement;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// The surplus rate η_i = γ̇_i − v_L of a virtual target is z_i less the coordination error; z_i follows that error and so
/// makes up for part of it. Only γ_j of the neighbours is needed (erratum 3.22).
///
/// Lγ/a₁ and Lγ are added to z and ż: γ has no unit, a₁ and a₂ are in 1/s, and a small a₁ asks for large rates
/// (erratum 4.26).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Auxiliary {
    a_1: f64,
    a_2: f64,
    feeds_back: bool,
}

impl Auxiliary {
    /// (4.59)–(4.61), Theorem 4.8: α_2 is fed back, for a fixed network. `a_1` > 0 and `a_2` > 0 are in 1/s.
    pub fn fixed(a_1: f64, a_2: f64) -> Result<Auxiliary, String> {
        Ok(Auxiliary { a_1: positive("the gain a_1", a_1)?, a_2: positive("the gain a_2", a_2)?, feeds_back: true })
    }

    /// (4.62), Theorem 4.9: α_2 ≡ 0, for a network that switches. `a_1` > 0 and `a_2` > 0 are in 1/s.
    pub fn switching(a_1: f64, a_2: f64) -> Result<Auxiliary, String> {
        Ok(Auxiliary { feeds_back: false, ..Auxiliary::fixed(a_1, a_2)? })
    }
}

impl FleetLaw for Auxiliary {
    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, _: usize) -> Box<dyn VehicleLaw> {
        Box::new(OneAuxiliary { law: *self, z: 0.0, driven_by: 0.0 })
    }
}

/// Row i of the law.
#[derive(Debug)]
struct OneAuxiliary {
    law: Auxiliary,
    /// z_i, zero at the start.
    z: f64,
    /// (Lγ)_i + α_2i
    driven_by: f64,
}

impl VehicleLaw for OneAuxiliary {
    /// γ̇_i = v_L + η_i with η = z − A₁⁻¹Lγ − A₁⁻¹α_2 (4.56), (4.59).
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let alpha_2 = if self.law.feeds_back && own.alpha_2.is_finite() { own.alpha_2 } else { 0.0 };
        self.driven_by = Disagreement::among(own, neighbours).ahead + alpha_2;
        Demand::Rate(reference.v_l + self.z - self.driven_by / self.law.a_1)
    }

    /// ż = −(A₁ + A₂)z + Lγ + α_2 (4.60), solved for what drives it held over `dt`.
    fn advance(&mut self, dt: f64) {
        let rate = self.law.a_1 + self.law.a_2;
        self.z += -(-rate * dt).exp_m1() * (self.driven_by / rate - self.z);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Auxiliary;
    use crate::coordination::sampled_fleet::{SampledFleet, any_connected, demand_of};
    use crate::coordination::{FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;
    use crate::graph::spectrum::symmetric_eigenvalues;

    #[test]
    fn two_vehicles_in_closed_form() {
        // With γ₁₂ = g, z₁₂ = y: ġ = y − 2g/a₁, ẏ = −(a₁ + a₂) y + 2g. For a₁ = 1, a₂ = 2: s² + 5 s + 4.
        let law = Auxiliary::switching(1.0, 2.0).unwrap();
        let mut fleet = SampledFleet::new(&law, &Graph::complete(2), &[1.0, 0.0]).with_v_l(0.5);
        fleet.run(1.5, 1e-4);
        // g = A e^(−t) + B e^(−4t), g(0) = 1, ġ(0) = −2.
        let expected = 2.0 / 3.0 * (-1.5f64).exp() + 1.0 / 3.0 * (-6.0f64).exp();
        assert!((fleet.xi[0] - fleet.xi[1] - expected).abs() < 1e-4, "{:?} {expected}", fleet.xi);
        assert!((fleet.xi[0] + fleet.xi[1] - 1.0 - 2.0 * 0.5 * 1.5).abs() < 1e-9, "the mean travels at v_L");
    }

    #[test]
    fn the_row_of_the_law_by_hand() {
        let heard = [1.0, 2.5].map(|xi| Neighbour { xi, ..Neighbour::default() });
        let own = Own { xi: 2.0, alpha_2: 0.25, ..Own::default() };
        let reference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };
        let ask = |law: Auxiliary| demand_of(law.vehicle(0).as_mut(), reference, &own, &heard);
        assert_eq!(ask(Auxiliary::fixed(10.0, 16.0).unwrap()), 0.5 - (0.5 + 0.25) / 10.0);
        assert_eq!(ask(Auxiliary::switching(10.0, 16.0).unwrap()), 0.5 - 0.5 / 10.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_connected_fleet_agrees_at_no_less_than_the_rate_of_its_slowest_mode(
            graph in any_connected(), xi in prop::array::uniform5(-3.0..3.0f64), a_1 in 0.8..4.0f64, a_2 in 0.5..8.0f64,
        ) {
            // Each λ of L has s² + (λ/a₁ + a₁ + a₂) s + λ a₂/a₁ = 0, whose roots are real: the part of γ in it starts with
            // z = 0 and stays within twice its slow exponential.
            let n = graph.len();
            let lambda = symmetric_eigenvalues(&graph.laplacian())[1];
            let p = lambda / a_1 + a_1 + a_2;
            let rate = 2.0 * lambda * a_2 / a_1 / (p + (p * p - 4.0 * lambda * a_2 / a_1).sqrt());
            let law = Auxiliary::switching(a_1, a_2).unwrap();
            let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_v_l(0.5);
            let start = fleet.size();
            let seconds = 6.0 / rate;
            fleet.run(seconds, 0.01);
            let bound = 2.0 * start * (-0.97 * rate * seconds).exp() + 1e-12;
            prop_assert!(fleet.size() <= bound, "{} {bound}", fleet.size());
            prop_assert!(fleet.rate.iter().all(|rate| (rate - 0.5).abs() < bound + 1e-2 * start), "{:?}", fleet.rate);
        }

        #[test]
        fn links_that_are_down_for_a_while_are_survived(
            xi in prop::array::uniform3(-3.0..3.0f64), up in 2.5..9.0f64, a_2 in 1.6..8.0f64,
        ) {
            // Example 4.1: the star, all links down for up to 75 % of every 10 s.
            let law = Auxiliary::switching(1.0, a_2).unwrap();
            let star = Graph::from_edges(3, &[(0, 1), (1, 2)]);
            let mut fleet = SampledFleet::new(&law, &star, &xi).with_v_l(0.5);
            for _ in 0..12 {
                fleet.graph = star.clone();
                fleet.run(up, 0.02);
                fleet.graph = Graph::empty(3);
                fleet.run(10.0 - up, 0.02);
            }
            prop_assert!(fleet.spread() < 1e-4, "{}", fleet.spread());
        }
    }

    #[test]
    fn excitation_that_stays_slows_the_fleet() {
        // Erratum 4.14: at rest z = α_2/(a₁ + a₂), so γ̇ = v_L − α_2 a₂/(a₁(a₁ + a₂)).
        let star = Graph::from_edges(3, &[(0, 1), (1, 2)]);
        let rate = |law: Auxiliary| {
            let mut fleet = SampledFleet::new(&law, &star, &[0.0; 3]).with_v_l(0.5);
            fleet.alpha_2 = vec![0.2; 3];
            fleet.run(20.0, 0.05);
            fleet.rate[0]
        };
        assert!((rate(Auxiliary::fixed(10.0, 16.0).unwrap()) - (0.5 - 0.2 * 16.0 / 260.0)).abs() < 1e-12);
        assert_eq!(rate(Auxiliary::switching(10.0, 16.0).unwrap()), 0.5);
    }

    #[test]
    fn only_the_coordination_state_is_on_the_air_and_nonsense_does_no_harm() {
        for law in [Auxiliary::fixed(1.0, 1.0).unwrap(), Auxiliary::switching(1.0, 1.0).unwrap()] {
            assert!(law.says(0).is_none() && law.vehicle(0).says(&Own::default()).is_none());
            let strange = [Neighbour { xi: f64::NAN, ..Neighbour::default() }];
            let own = Own { alpha_2: f64::NAN, ..Own::default() };
            let mut one = law.vehicle(0);
            assert_eq!(demand_of(one.as_mut(), SpeedReference { v_l: 0.5, v_l_dot: 0.0 }, &own, &strange), 0.5);
            one.advance(0.1);
            assert!(demand_of(one.as_mut(), SpeedReference::default(), &own, &[]).is_finite());
        }
        assert!(Auxiliary::fixed(0.0, 1.0).is_err() && Auxiliary::switching(1.0, f64::NAN).is_err());
    }
}
