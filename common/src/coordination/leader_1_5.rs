//! Two vehicles on parallel lines of which one knows the formation speed and the other learns it (section 1.2).

use super::disagreement::Disagreement;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// The leader goes by (1.5); the other integrates how far the leader is ahead, and so learns a constant v_L. Only
/// positions along the lines are on the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeaderIntegral {
    leader: usize,
    a: f64,
    b: f64,
}

impl LeaderIntegral {
    /// `leader` is the index of the vehicle that knows v_L. `a` a_i > 0 \[1/s\] weighs the distance, `b` b₂ > 0 \[1/s²\]
    /// its integral: s² + 2a s + b has the roots −a ± √(a² − b), both −a for b = a².
    pub fn new(leader: usize, a: f64, b: f64) -> Result<LeaderIntegral, String> {
        Ok(LeaderIntegral { leader, a: positive("the gain a", a)?, b: positive("the gain b", b)? })
    }
}

impl FleetLaw for LeaderIntegral {
    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        if index == self.leader {
            Box::new(Leader { a: self.a })
        } else {
            Box::new(Learner { a: self.a, b: self.b, e_i: 0.0, e_i_dot: 0.0 })
        }
    }
}

/// The vehicle that knows v_L.
#[derive(Debug)]
struct Leader {
    a: f64,
}

impl VehicleLaw for Leader {
    /// ẋ₁ = −a₁ (x₁ − x₂) + v_L
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        Demand::Rate(-self.a * Disagreement::among(own, neighbours).ahead + reference.v_l)
    }
}

/// The vehicle that learns it.
#[derive(Debug)]
struct Learner {
    a: f64,
    b: f64,
    /// e_I, zero at the start: b₂ e_I is the speed learned so far.
    e_i: f64,
    e_i_dot: f64,
}

impl VehicleLaw for Learner {
    /// ẋ₂ = −a₂ (x₂ − x₁) + b₂ e_I; what it has learned, b₂ e_I, while it hears nobody.
    fn demand(&mut self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let ahead = Disagreement::among(own, neighbours).ahead;
        self.e_i_dot = -ahead;
        Demand::Rate(-self.a * ahead + self.b * self.e_i)
    }

    /// ė_I = x₁ − x₂
    fn advance(&mut self, dt: f64) {
        self.e_i += self.e_i_dot * dt;
    }

    /// The speed learned so far.
    fn neighbour_rate(&self, _: SpeedReference, _: f64) -> f64 {
        self.b * self.e_i
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::LeaderIntegral;
    use crate::coordination::sampled_fleet::{SampledFleet, demand_of};
    use crate::coordination::{FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;

    fn pair(law: &LeaderIntegral, xi: [f64; 2], v_l: f64) -> SampledFleet {
        SampledFleet::new(law, &Graph::complete(2), &xi).with_v_l(v_l)
    }

    #[test]
    fn a_double_root_in_closed_form() {
        // b = a²: x_c' = A x_c + (v_L, 0)' from (e₀, 0). e'' + 2a e' + a² e = 0 with e'(0) = −2a e₀ + v_L:
        // e = (e₀ + (v_L − a e₀) t) e^(−at).
        let (a, e_0, v_l, t) = (0.5, 2.0, 0.3, 3.0);
        let law = LeaderIntegral::new(0, a, a * a).unwrap();
        let mut fleet = pair(&law, [e_0, 0.0], v_l);
        fleet.run(t, 1e-4);
        let expected = (e_0 + (v_l - a * e_0) * t) * (-a * t).exp();
        assert!((fleet.xi[0] - fleet.xi[1] - expected).abs() < 1e-4, "{:?} {expected}", fleet.xi);
    }

    proptest! {
        #[test]
        fn it_learns_any_speed_from_anywhere(
            a in 0.2..1.0f64, part in 0.3..2.0f64, xi in prop::array::uniform2(-5.0..5.0f64),
            v_l in -1.0..1.0f64, leader in 0usize..2,
        ) {
            let law = LeaderIntegral::new(leader, a, part * a * a).unwrap();
            let mut fleet = pair(&law, xi, v_l);
            // The slower root is −a(1 − √(1 − part)) where it is real, else −a: at least 0.16 a.
            fleet.run(120.0 / a, 0.02);
            prop_assert!((fleet.xi[0] - fleet.xi[1]).abs() < 1e-4, "{:?}", fleet.xi);
            prop_assert!(fleet.rate.iter().all(|rate| (rate - v_l).abs() < 1e-4), "{:?}", fleet.rate);
        }

        #[test]
        fn the_learner_does_not_use_v_l(v_l in -9.0..9.0f64, other in -5.0..5.0f64) {
            let law = LeaderIntegral::new(0, 0.2, 0.04).unwrap();
            let heard = [Neighbour { xi: other, ..Neighbour::default() }];
            let demands = |v_l| {
                let (mut learner, reference) = (law.vehicle(1), SpeedReference { v_l, v_l_dot: 1.0 });
                [(); 3].map(|()| {
                    let demand = learner.demand(reference, &Own::default(), &heard);
                    learner.advance(0.1);
                    (demand, learner.neighbour_rate(reference, 0.0))
                })
            };
            prop_assert_eq!(demands(v_l), demands(0.0));
        }
    }

    #[test]
    fn a_constantly_accelerating_leader_is_followed_at_a_bounded_distance() {
        // e_I must grow at v̇_L/b₂, so e tends to v̇_L/b₂ and the leader's rate to v_L − a v̇_L/b₂.
        let law = LeaderIntegral::new(0, 0.5, 0.25).unwrap();
        let mut fleet = SampledFleet::new(&law, &Graph::complete(2), &[0.0, 0.0]);
        fleet.reference = |t| SpeedReference { v_l: 0.01 * t, v_l_dot: 0.01 };
        fleet.run(60.0, 1e-3);
        assert!((fleet.xi[0] - fleet.xi[1] - 0.04).abs() < 1e-4, "{:?}", fleet.xi);
    }

    #[test]
    fn alone_it_goes_on_at_what_it_has_learned() {
        let law = LeaderIntegral::new(0, 0.5, 0.25).unwrap();
        let mut fleet = pair(&law, [1.0, 0.0], 0.4);
        fleet.run(60.0, 0.01);
        fleet.graph = Graph::empty(2);
        fleet.run(10.0, 0.01);
        assert!((fleet.rate[1] - 0.4).abs() < 1e-4 && (fleet.xi[0] - fleet.xi[1]).abs() < 1e-3, "{fleet:?}");
    }

    #[test]
    fn only_the_position_is_on_the_air() {
        let law = LeaderIntegral::new(0, 0.2, 0.04).unwrap();
        assert!(law.says(0).is_none() && law.vehicle(1).says(&Own::default()).is_none());
        // Two ahead for a quarter of a second: b₂e_I is what it goes at when it hears nobody, and what it takes a neighbour to go at.
        let mut learner = LeaderIntegral::new(0, 0.7, 0.3).unwrap().vehicle(1);
        let (heard, reference) =
            ([Neighbour { xi: 2.0, ..Neighbour::default() }], SpeedReference { v_l: 9.0, v_l_dot: 0.0 });
        learner.demand(reference, &Own::default(), &heard);
        learner.advance(0.25);
        assert_eq!(demand_of(learner.as_mut(), reference, &Own::default(), &[]), 0.15);
        assert_eq!(learner.neighbour_rate(reference, 0.0), 0.15);
        assert!(LeaderIntegral::new(0, 0.2, 0.0).is_err() && LeaderIntegral::new(0, -0.2, 0.1).is_err());
    }
}
