//! Formations whose pattern changes in time (section 3.3.3).

use super::disagreement::c;
use super::solution_3_3_45::SolutionThree;
use super::{CoordinationLaw, Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};

/// Solution III about a moving pattern h(t): ξ_i − h_i agree. ξ_j − h_j and η_j/R_j − h_j' of the neighbours are needed, and
/// both derivatives of the own h_i (errata 3.21 and 3.22). The h_i need not add up to zero: only their differences show
/// (Remark 3.11).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingPattern {
    still: SolutionThree,
}

impl MovingPattern {
    /// The gains of [`SolutionThree::new`].
    pub fn new(a: f64, b: f64, x_m: f64) -> Result<MovingPattern, String> {
        Ok(MovingPattern { still: SolutionThree::new(a, b, x_m)? })
    }
}

impl FleetLaw for MovingPattern {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        Some("normalised speed-tracking error about the pattern η/R − h' [units of ξ per s]")
    }

    fn vehicle(&self, _: usize) -> Box<dyn VehicleLaw> {
        Box::new(*self)
    }
}

impl VehicleLaw for MovingPattern {
    /// u = d/dt(C⁻¹h') − (A⁻¹L + A)(Cη − h') − B sat(η − C⁻¹h' + A⁻¹L(ξ − h)) (3.70): with μ = η − C⁻¹h' (3.68) it is
    /// (3.45) in μ and ξ − h, and d/dt(R h') = R'ξ̇ h' + R h''.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let about_the_pattern = Own { eta: mu(own), ..*own };
        match self.still.demand(reference, &about_the_pattern, neighbours) {
            Demand::Acceleration(u) => Demand::Acceleration(own.r_dot * own.h_dot + own.r * own.h_ddot + u),
            other => other,
        }
    }

    /// Cμ = η/R − h'
    fn says(&self, own: &Own) -> Option<f64> {
        Some(c(own) * mu(own))
    }
}

/// μ_i = η_i − R_i h_i' (3.68)
#[doc(alias = "μ")]
fn mu(own: &Own) -> f64 {
    own.eta - own.r * own.h_dot
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::MovingPattern;
    use crate::coordination::sampled_fleet::{SampledFleet, any_connected, demand_of};
    use crate::coordination::solution_3_3_45::SolutionThree;
    use crate::coordination::{CoordinationLaw, Demand, FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;

    #[test]
    fn the_row_of_the_law_by_hand() {
        let heard = [
            Neighbour { xi: 1.0, scalar: 0.5, ..Neighbour::default() },
            Neighbour { xi: 2.5, scalar: -0.25, ..Neighbour::default() },
        ];
        let own = Own { xi: 2.0, eta: 1.0, r: 4.0, r_dot: 0.3, h_dot: 0.125, h_ddot: -0.25, ..Own::default() };
        let law = MovingPattern::new(2.0, 3.0, 10.0).unwrap();
        let u = demand_of(law.vehicle(0).as_mut(), SpeedReference::default(), &own, &heard);
        // μ = 1 − 4/8 = ½, Cμ = 1/8: d/dt(R h') − 2/8 − ½ (2/8 − ¼) − 3 (½ + ½·½)
        assert!((u - (0.3 * 0.125 - 4.0 * 0.25 - 0.25 - 0.0 - 3.0 * 0.75)).abs() < 1e-15, "{u}");
        assert_eq!(law.vehicle(0).says(&own), Some(0.125));
    }

    /// h_i = (i + 1)/4 + ½ (−1)ⁱ sin(0.2 t + i), with its derivatives.
    fn waves(i: usize, t: f64) -> [f64; 3] {
        let (sign, angle) = (if i.is_multiple_of(2) { 0.5 } else { -0.5 }, 0.2 * t + i as f64);
        [0.25 * (i as f64 + 1.0) + sign * angle.sin(), 0.2 * sign * angle.cos(), -0.04 * sign * angle.sin()]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn a_connected_fleet_tracks_the_pattern(
            graph in any_connected(), xi in prop::array::uniform5(-3.0..3.0f64), a in 0.7..1.5f64, b in 0.5..1.5f64,
            r in prop::array::uniform5(0.5..2.0f64),
        ) {
            let n = graph.len();
            let law = MovingPattern::new(a, b, 1.0).unwrap();
            let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_v_l(0.1).with_r(&r[..n]);
            fleet.pattern = waves;
            fleet.run(200.0, 0.01);
            prop_assert!(fleet.spread() < 5e-3, "{}", fleet.spread());
        }

        #[test]
        fn a_pattern_at_rest_is_solution_3(eta in -1.0..1.0f64, xi in -3.0..3.0f64, scalar in -1.0..1.0f64) {
            let own = Own { xi, eta, r: 2.0, r_dot: 0.7, ..Own::default() };
            let heard = [Neighbour { xi: 1.0, scalar, ..Neighbour::default() }];
            let (law, still) = (MovingPattern::new(1.0, 0.25, 1.0).unwrap(), SolutionThree::new(1.0, 0.25, 1.0).unwrap());
            let u = demand_of(law.vehicle(0).as_mut(), SpeedReference::default(), &own, &heard);
            prop_assert_eq!(Demand::Acceleration(u), still.demand(SpeedReference::default(), &own, &heard));
        }
    }

    #[test]
    fn without_the_derivatives_of_the_pattern_an_error_stays() {
        // Erratum 3.21: h = ½ sin 0.2t told as a constant at every instant leaves an error of the size of h itself.
        let graph = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let error = |law: &dyn FleetLaw| {
            let mut fleet = SampledFleet::new(law, &graph, &[0.0; 3]).with_v_l(0.1);
            fleet.pattern = waves;
            fleet.run(150.0, 0.01);
            (0..400).fold(0.0, |largest: f64, _| {
                fleet.run(0.1, 0.01);
                largest.max(fleet.spread())
            })
        };
        let (told, not_told) =
            (error(&MovingPattern::new(1.0, 0.25, 1.0).unwrap()), error(&SolutionThree::new(1.0, 0.25, 1.0).unwrap()));
        assert!(told < 2e-3 && not_told > 0.3, "{told} {not_told}");
    }

    #[test]
    fn strange_words_give_numbers_and_gains_are_checked() {
        let strange = [Neighbour { xi: f64::NAN, scalar: f64::NAN, ..Neighbour::default() }];
        let law = MovingPattern::new(1.0, 1.0, 1.0).unwrap();
        let own = Own { h_dot: 0.1, ..Own::default() };
        assert!(demand_of(law.vehicle(0).as_mut(), SpeedReference::default(), &own, &strange).is_finite());
        assert!(law.vehicle(0).says(&own).is_some_and(f64::is_finite));
        assert!(FleetLaw::says(&law, 0).is_some() && MovingPattern::new(1.0, -1.0, 1.0).is_err());
    }
}
