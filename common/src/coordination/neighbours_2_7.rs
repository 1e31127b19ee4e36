//! Neighbours in a row, Figure 2.7-3, for which the thesis gives no law. This one is the gateway's, read for any vehicle.

use super::recruiting::{Gains, Recruit, ahead_of};
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// Every vehicle minds the one before and the one after it in the order of the fleet; one of them is told
/// v_1^c = R_1 v_L.
///
/// On circles and lines, over any two-way connected graph, it agrees at v_L for every b_0 > 0 if ab > c
/// (docs/errata.md, result x).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    told: usize,
    b_0: f64,
    gains: Gains,
}

impl Neighbours {
    /// `told` is the index of the vehicle that is told v_L, `b_0` > 0 \[1/s²\] its gain on the integral of v − R v_L.
    pub fn new(told: usize, b_0: f64, gains: Gains) -> Result<Neighbours, String> {
        Ok(Neighbours { told, b_0: positive("the gain b_0", b_0)?, gains: gains.checked()? })
    }
}

impl FleetLaw for Neighbours {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        let b_0 = (index == self.told).then_some(self.b_0);
        Box::new(InARow { index, recruit: Recruit::new(self.gains, b_0, 0.0) })
    }
}

/// A vehicle in the row.
#[derive(Debug)]
struct InARow {
    index: usize,
    recruit: Recruit,
}

impl VehicleLaw for InARow {
    /// F_i = −z_i − R_i b Σ (ξ_i − ξ_j), ż_i = a v̇_i + R_i c Σ (ξ_i − ξ_j), and for the told one + b_0 (v_i − v_i^c).
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let ahead = ahead_of(own, neighbours, |j| j.abs_diff(self.index) == 1);
        self.recruit.demand(reference, own, ahead)
    }

    fn advance(&mut self, dt: f64) {
        self.recruit.advance(dt);
    }

    fn neighbour_rate(&self, _: SpeedReference, _: f64) -> f64 {
        self.recruit.rate()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::Neighbours;
    use crate::coordination::gateway_2_33::Gateway;
    use crate::coordination::recruiting::Gains;
    use crate::coordination::sampled_fleet::{SampledFleet, any_connected};
    use crate::coordination::{FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;
    use crate::graph::spectrum::eigenvalues;

    const GAINS: Gains = Gains { a: 3.0, b: 3.0, c: 1.0 };

    #[test]
    fn two_in_a_row_are_a_gateway_and_its_only_vehicle() {
        let pair = Graph::complete(2);
        let laws: [&dyn FleetLaw; 2] =
            [&Neighbours::new(0, 5.0, GAINS).unwrap(), &Gateway::new(0, 5.0, GAINS).unwrap()];
        let [one, two] = laws.map(|law| {
            let mut fleet = SampledFleet::new(law, &pair, &[0.3, 0.0]).with_v_l(0.1).with_r(&[2.0, 3.0]);
            fleet.run(5.0, 0.02);
            fleet.xi
        });
        assert_eq!(one, two);
    }

    #[test]
    fn others_are_taken_to_move_as_one_does_oneself() {
        let mut one = Neighbours::new(0, 5.0, GAINS).unwrap().vehicle(1);
        let reference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
        one.demand(reference, &Own { v: 0.5, r: 2.0, ..Own::default() }, &[]);
        assert_eq!(one.neighbour_rate(reference, 9.0), 0.25);
    }

    #[test]
    fn whoever_is_told_the_row_agrees_though_all_hear_all() {
        for told in [0, 2] {
            let law = Neighbours::new(told, 5.0, GAINS).unwrap();
            let mut fleet = SampledFleet::new(&law, &Graph::complete(4), &[0.3, 0.0, -0.2, 0.5]);
            fleet = fleet.with_v_l(0.1).with_r(&[2.0, 3.0, 1.0, 4.0]);
            fleet.v = vec![0.0; 4];
            fleet.run(200.0, 0.02);
            assert!(fleet.spread() < 1e-4 && (fleet.rate[3] - 0.1).abs() < 1e-4, "{told}: {fleet:?}");
        }
    }

    #[test]
    fn vehicles_further_off_are_not_minded() {
        let law = Neighbours::new(0, 5.0, GAINS).unwrap();
        let far = Neighbour { vehicle: 3, xi: 50.0, ..Neighbour::default() };
        let (own, reference) = (Own { v: 0.2, r: 2.0, ..Own::default() }, SpeedReference::default());
        assert_eq!(law.vehicle(1).demand(reference, &own, &[far]), law.vehicle(1).demand(reference, &own, &[]));
        assert!(Neighbours::new(0, -1.0, GAINS).is_err());
    }

    /// The closed loop of the law on any graph: rates of (w, ξ, ζ'), w = v/R, with the told vehicle's integral.
    fn closed_loop(graph: &Graph, b_0: f64, gains: Gains) -> DMatrix<f64> {
        let (n, l) = (graph.len(), graph.laplacian());
        let mut m = DMatrix::zeros(3 * n, 3 * n);
        for i in 0..n {
            // ẇ = −a w − ζ − b L ξ,  ξ̇ = w,  ζ̇ = c L ξ + b_0 w_1
            m[(i, i)] = -gains.a;
            m[(i, 2 * n + i)] = -1.0;
            m[(n + i, i)] = 1.0;
            for j in 0..n {
                m[(i, n + j)] -= gains.b * l[(i, j)];
                m[(2 * n + i, n + j)] += gains.c * l[(i, j)];
            }
        }
        m[(2 * n, 0)] += b_0;
        m
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Result x: no mode grows, for every connected graph and every b_0, if ab > c. (One stands: the place of the fleet.)
        #[test]
        fn every_connected_graph_will_do(graph in any_connected(), b_0 in 0.05..20.0f64, a in 0.5..4.0f64, b in 0.5..4.0f64,
                                         part in 0.05..0.95f64) {
            let closed = closed_loop(&graph, b_0, Gains { a, b, c: part * a * b });
            let roots = eigenvalues(&closed).expect("it settles");
            let decaying = roots.iter().filter(|s| s.re < -1e-9).count();
            prop_assert!(roots.iter().all(|s| s.re < 1e-9), "{:?}", roots);
            prop_assert_eq!(decaying, 3 * graph.len() - 1, "{:?}", roots);
        }

        #[test]
        fn and_with_c_beyond_ab_none_will(graph in any_connected(), more in 1.1..3.0f64) {
            let roots = eigenvalues(&closed_loop(&graph, 0.01, Gains { a: 1.0, b: 1.0, c: more })).expect("it settles");
            prop_assert!(roots.iter().any(|s| s.re > 1e-4), "{:?}", roots);
        }
    }
}
