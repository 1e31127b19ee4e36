//! Gains of their own for each vehicle: the diagonal matrices K, A and B of the thesis.

use std::sync::Arc;

use super::{DemandKind, FleetLaw, VehicleLaw};

/// A law whose vehicles differ by their gains: each has its row of the same law with gains of its own.
///
/// The theorems allow that for (1.5), (3.43) to (3.45), (3.62), (3.70) and (4.21). With a delay they do not: unequal gains
/// leave an error (erratum 4.2).
#[derive(Clone, Debug)]
pub struct Diagonal {
    rows: Vec<Arc<dyn FleetLaw>>,
}

impl Diagonal {
    /// From the law as each vehicle has it, in the order of the mission; at least one.
    pub fn new(rows: Vec<Arc<dyn FleetLaw>>) -> Result<Diagonal, String> {
        let Some(first) = rows.first() else { return Err("a law for no vehicle".to_owned()) };
        let alike = rows.iter().enumerate().all(|(i, row)| row.kind() == first.kind() && row.says(i) == first.says(0));
        if alike { Ok(Diagonal { rows }) } else { Err("vehicles with different laws".to_owned()) }
    }

    fn row(&self, index: usize) -> &dyn FleetLaw {
        &*self.rows[index.min(self.rows.len() - 1)]
    }
}

impl FleetLaw for Diagonal {
    fn kind(&self) -> DemandKind {
        self.row(0).kind()
    }

    fn says(&self, vehicle: usize) -> Option<&'static str> {
        self.row(vehicle).says(vehicle)
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        self.row(index).vehicle(index)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::Diagonal;
    use crate::coordination::FleetLaw;
    use crate::coordination::sampled_fleet::{SampledFleet, any_connected};
    use crate::coordination::solution_1_3_43::SolutionOne;
    use crate::coordination::solution_2_3_44::SolutionTwo;
    use crate::coordination::solution_3_3_45::SolutionThree;
    use crate::coordination::switching_4_21::Switching;
    use crate::graph::Graph;

    fn of<L: FleetLaw + 'static>(gains: &[[f64; 2]], law: impl Fn([f64; 2]) -> Result<L, String>) -> Diagonal {
        let row = |gains: &[f64; 2]| Arc::new(law(*gains).unwrap()) as Arc<dyn FleetLaw>;
        Diagonal::new(gains.iter().map(row).collect()).unwrap()
    }

    #[test]
    fn two_vehicles_agree_at_the_sum_of_their_gains_where_the_gains_weigh_them() {
        // γ_12' = −(k_1 + k_2) γ_12, and Σ γ_i/k_i moves at v_L alone: β of (4.22).
        let law = of(&[[0.1, 0.0], [0.4, 0.0]], |[k, _]| Switching::new(k));
        let mut fleet = SampledFleet::new(&law, &Graph::complete(2), &[1.0, 0.0]).with_v_l(0.5);
        fleet.run(4.0, 1e-4);
        assert!((fleet.xi[0] - fleet.xi[1] - (-0.5f64 * 4.0).exp()).abs() < 1e-4, "{:?}", fleet.xi);
        let weighed = fleet.xi[0] / 0.1 + fleet.xi[1] / 0.4;
        assert!((weighed - 10.0 - 0.5 * 4.0 * 12.5).abs() < 1e-9, "{weighed}");
    }

    #[test]
    fn each_vehicle_has_its_own_row() {
        let law = of(&[[1.0, 0.3], [2.0, 0.6]], |[a, b]| SolutionTwo::new(a, b));
        let alone = |index: usize, [a, b]: [f64; 2]| {
            let own = crate::coordination::Own { xi: 1.0, eta: 0.5, r: 2.0, ..Default::default() };
            let heard = [crate::coordination::Neighbour { vehicle: 1 - index, ..Default::default() }];
            let reference = Default::default();
            let row = SolutionTwo::new(a, b).unwrap();
            law.vehicle(index).demand(reference, &own, &heard) == row.vehicle(index).demand(reference, &own, &heard)
        };
        assert!(alone(0, [1.0, 0.3]) && alone(1, [2.0, 0.6]) && !alone(0, [2.0, 0.6]));
        assert!(law.says(1).is_none() && law.kind() == FleetLaw::kind(&SolutionTwo::new(1.0, 1.0).unwrap()));
    }

    #[test]
    fn no_vehicle_and_mixtures_are_refused() {
        assert!(Diagonal::new(Vec::new()).is_err());
        let (one, two) = (SolutionOne::new(1.0).unwrap(), SolutionTwo::new(1.0, 1.0).unwrap());
        assert!(Diagonal::new(vec![Arc::new(one), Arc::new(two)]).is_err(), "one of them sends more");
        assert!(Diagonal::new(vec![Arc::new(one), Arc::new(Switching::new(1.0).unwrap())]).is_err());
        assert!(
            Diagonal::new(vec![Arc::new(two), Arc::new(Switching::new(1.0).unwrap())]).is_err(),
            "an acceleration, a rate"
        );
        // Whoever comes after the last has the last row, and says what that says.
        let law = of(&[[1.0, 0.0], [2.0, 0.0]], |[a, _]| SolutionOne::new(a));
        assert!(
            law.says(0).is_some() && law.says(5) == law.says(1) && law.vehicle(5).says(&Default::default()).is_some()
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Propositions 3.4 and 3.5 with A = diag(a_i), B = diag(b_i), on any connected graph.
        #[test]
        fn unequal_gains_agree_too(graph in any_connected(), gains in prop::array::uniform5(prop::array::uniform2(0.4..2.0f64)),
                                   xi in prop::array::uniform5(-1.0..1.0f64), r in prop::array::uniform5(0.5..2.0f64)) {
            let n = graph.len();
            let gains = &gains[..n];
            let laws = [
                of(gains, |[a, _]| SolutionOne::new(a)),
                of(gains, |[a, b]| SolutionTwo::new(a, b)),
                of(gains, |[a, b]| SolutionThree::new(a, b, 1.0)),
            ];
            for law in laws {
                let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_v_l(0.1).with_r(&r[..n]);
                let start = fleet.spread();
                fleet.run(600.0, 0.02);
                prop_assert!(fleet.spread() < 1e-2 * start + 1e-9, "{:?}", fleet.xi);
            }
        }
    }
}
