//! Solution II with a weight on every link (Remark 3.10).

use super::disagreement::c;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// Solution II in which some links count more than others. Only ξ_j of the neighbours is needed (erratum 3.22).
#[derive(Clone, Debug, PartialEq)]
pub struct Weighted {
    a: f64,
    b: f64,
    /// i, j and w_k of every link with another weight than 1.
    weights: Vec<(usize, usize, f64)>,
    vehicles: usize,
}

impl Weighted {
    /// `a` a_i > 0 \[1/s\] and `b` b_i > 0 \[m²/s²\] as in solution II; `weights` are pairs of vehicles with the weight
    /// w_k > 0 of the link between them, every other link has 1. A pair is named once, the vehicles are below `vehicles`.
    pub fn new(a: f64, b: f64, vehicles: usize, weights: &[(usize, usize, f64)]) -> Result<Weighted, String> {
        for &(i, j, weight) in weights {
            if i >= vehicles || j >= vehicles || i == j {
                return Err(format!("a weight between vehicles {i} and {j} of {vehicles}"));
            }
            positive("a weight", weight)?;
        }
        let (a, b) = (positive("the gain a", a)?, positive("the gain b", b)?);
        Ok(Weighted { a, b, weights: weights.to_vec(), vehicles })
    }
}

impl FleetLaw for Weighted {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        let mut weights = vec![1.0; self.vehicles];
        for &(i, j, weight) in &self.weights {
            if i == index {
                weights[j] = weight;
            } else if j == index {
                weights[i] = weight;
            }
        }
        Box::new(OneWeighted { a: self.a, b: self.b, weights })
    }
}

/// Row i of the law.
#[derive(Debug)]
struct OneWeighted {
    a: f64,
    b: f64,
    /// w_k of the link to each vehicle.
    weights: Vec<f64>,
}

impl OneWeighted {
    /// Σ w_k (ξ_i − ξ_j), the i-th row of MWMᵀξ. What is not finite counts as not heard.
    fn ahead(&self, own: &Own, neighbours: &[Neighbour]) -> f64 {
        let weight = |other: &Neighbour| self.weights.get(other.vehicle).copied().unwrap_or(0.0);
        neighbours
            .iter()
            .filter(|other| other.xi.is_finite())
            .fold(0.0, |sum, other| sum + weight(other) * (own.xi - other.xi))
    }
}

impl VehicleLaw for OneWeighted {
    /// u_i = −a_i η_i − (b_i/R_i) Σ w_k (ξ_i − ξ_j) (3.62)
    fn demand(&mut self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        Demand::Acceleration(-self.a * own.eta - self.b * c(own) * self.ahead(own, neighbours))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Weighted;
    use crate::coordination::sampled_fleet::{SampledFleet, any_connected, demand_of};
    use crate::coordination::solution_2_3_44::SolutionTwo;
    use crate::coordination::{FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;

    #[test]
    fn the_row_of_the_law_by_hand() {
        let law = Weighted::new(2.0, 3.0, 3, &[(0, 2, 0.5), (1, 0, 4.0)]).unwrap();
        let heard = [
            Neighbour { vehicle: 1, xi: 1.0, scalar: 7.0, ..Neighbour::default() },
            Neighbour { vehicle: 2, xi: 2.5, scalar: f64::NAN, ..Neighbour::default() },
        ];
        let own = Own { xi: 2.0, eta: 1.0, r: 4.0, ..Own::default() };
        let u = demand_of(law.vehicle(0).as_mut(), SpeedReference::default(), &own, &heard);
        assert_eq!(u, -2.0 - 3.0 / 4.0 * (4.0 * 1.0 + 0.5 * -0.5));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn without_weights_it_is_solution_2(graph in any_connected(), xi in prop::array::uniform5(-3.0..3.0f64)) {
            let n = graph.len();
            let mut weighted = SampledFleet::new(&Weighted::new(0.7, 0.3, n, &[]).unwrap(), &graph, &xi[..n]);
            let mut plain = SampledFleet::new(&SolutionTwo::new(0.7, 0.3).unwrap(), &graph, &xi[..n]);
            weighted.run(2.0, 0.05);
            plain.run(2.0, 0.05);
            prop_assert!(weighted.xi.iter().zip(&plain.xi).all(|(a, b)| (a - b).abs() < 1e-12));
        }

        #[test]
        fn a_connected_fleet_agrees_whatever_the_weights(
            graph in any_connected(), xi in prop::array::uniform5(-3.0..3.0f64), a in 0.8..2.0f64, b in 0.3..2.0f64,
            weight in prop::array::uniform10(0.3..3.0f64), r in prop::array::uniform5(0.5..2.0f64),
        ) {
            let n = graph.len();
            let pairs = graph.arcs().filter(|(i, j)| i < j).zip(weight).map(|((i, j), w)| (i, j, w));
            let law = Weighted::new(a, b, n, &pairs.collect::<Vec<_>>()).unwrap();
            let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_v_l(0.1).with_r(&r[..n]);
            fleet.run(600.0, 0.02);
            prop_assert!(fleet.spread() < 1e-2, "{:?} {}", fleet.xi, fleet.spread());
        }
    }

    #[test]
    fn the_lyapunov_function_of_its_remark() {
        // V = ½ηᵀB⁻¹η + ½θᵀWθ with θ = Mᵀξ (3.61);  V̇ = −ηᵀB⁻¹Aη. V is quadratic: its difference is exact.
        let law = Weighted::new(0.7, 0.3, 4, &[(0, 1, 2.0), (1, 2, 0.5), (3, 2, 3.0)]).unwrap();
        let graph = Graph::from_edges(4, &[(0, 1), (1, 2), (2, 3)]);
        let (r, eta) = ([1.0, 2.0, 3.0, 4.0], [0.5, -0.2, 0.4, -1.0]);
        let mut fleet = SampledFleet::new(&law, &graph, &[0.3, -1.0, 2.0, 0.1]).with_r(&r);
        fleet.v = eta.to_vec();
        let v = |xi: &[f64], eta: &[f64]| {
            let links = [(0, 1, 2.0), (1, 2, 0.5), (2, 3, 3.0)];
            0.5 * links.iter().map(|&(i, j, w)| w * (xi[i] - xi[j]).powi(2)).sum::<f64>()
                + 0.5 * eta.iter().map(|eta| eta * eta / 0.3).sum::<f64>()
        };
        let u = fleet.demands();
        let moved = |s: f64| {
            let xi: Vec<f64> = (0..4).map(|i| fleet.xi[i] + s * eta[i] / r[i]).collect();
            let eta: Vec<f64> = (0..4).map(|i| eta[i] + s * u[i]).collect();
            v(&xi, &eta)
        };
        let exact: f64 = eta.iter().map(|eta| -eta * eta * 0.7 / 0.3).sum();
        assert!((moved(0.5) - moved(-0.5) - exact).abs() < 1e-12);
    }

    #[test]
    fn only_the_position_is_on_the_air_and_nonsense_is_refused() {
        let law = Weighted::new(1.0, 1.0, 2, &[]).unwrap();
        assert!(law.says(0).is_none() && law.vehicle(0).says(&Own::default()).is_none());
        for wrong in [(0, 0, 1.0), (0, 2, 1.0), (0, 1, 0.0), (0, 1, f64::NAN)] {
            assert!(Weighted::new(1.0, 1.0, 2, &[wrong]).is_err(), "{wrong:?}");
        }
        assert!(Weighted::new(1.0, 1.0, 2, &[(2, 0, 1.0)]).is_err());
        let strange = [
            Neighbour { vehicle: 1, xi: f64::NAN, ..Neighbour::default() },
            Neighbour { vehicle: 7, xi: 9.0, ..Neighbour::default() },
        ];
        let own = Own { xi: 1.0, eta: 0.5, r: 2.0, ..Own::default() };
        assert_eq!(demand_of(law.vehicle(0).as_mut(), SpeedReference::default(), &own, &strange), -0.5);
        assert!(Weighted::new(0.0, 1.0, 2, &[]).is_err() && Weighted::new(1.0, 0.0, 2, &[]).is_err());
    }
}
