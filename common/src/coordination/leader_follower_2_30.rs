//! Leader and followers, section 2.2.1: the leader keeps its speed, the others learn theirs.

use super::recruiting::{Gains, Recruit, ahead_of};
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// (2.30) for the leader, (2.31) for the followers, each of which minds the leader alone. Only the leader is told
/// v_1^c = R_1 v_L.
///
/// On circles the modes are s + a_1 and, for each follower, s³ + a s² + b s + c, whatever the radii. A leader that is
/// stuck at a speed is followed at that speed (2.41), a follower that is stuck disturbs nobody.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeaderFollower {
    leader: usize,
    a_1: f64,
    gains: Gains,
}

impl LeaderFollower {
    /// `leader` is the leader's index, `a_1` > 0 \[1/s\] the rate at which its speed comes to v_1^c.
    pub fn new(leader: usize, a_1: f64, gains: Gains) -> Result<LeaderFollower, String> {
        Ok(LeaderFollower { leader, a_1: positive("the gain a_1", a_1)?, gains: gains.checked()? })
    }
}

impl FleetLaw for LeaderFollower {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        if index == self.leader {
            Box::new(Leader { a_1: self.a_1 })
        } else {
            Box::new(Follower { leader: self.leader, recruit: Recruit::new(self.gains, None, 0.0) })
        }
    }
}

/// A vehicle that keeps the speed that it is told.
#[derive(Debug)]
pub(super) struct Leader {
    pub(super) a_1: f64,
}

impl VehicleLaw for Leader {
    /// F_1 = −a_1 (v_1 − v_1^c) (2.30), v_1^c = R_1 v_L.
    fn demand(&mut self, reference: SpeedReference, own: &Own, _: &[Neighbour]) -> Demand {
        Demand::Forward(-self.a_1 * (own.v - own.r * reference.v_l))
    }
}

/// A vehicle that minds one other.
#[derive(Debug)]
struct Follower {
    leader: usize,
    recruit: Recruit,
}

impl VehicleLaw for Follower {
    /// F_i = −z_i + R_i b s̄_{1,i}, ż_i = −R_i c s̄_{1,i} + a v̇_i (2.31), s̄_{1,i} = ξ_1 − ξ_i.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let ahead = ahead_of(own, neighbours, |j| j == self.leader);
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
    use proptest::prelude::*;

    use super::LeaderFollower;
    use crate::coordination::recruiting::Gains;
    use crate::coordination::sampled_fleet::SampledFleet;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;

    const GAINS: Gains = Gains { a: 3.0, b: 3.0, c: 1.0 };

    /// Everybody hears vehicle 0, and nobody else is heard.
    fn fleet(law: &LeaderFollower, n: usize) -> SampledFleet {
        let arcs: Vec<(usize, usize)> = (1..n).map(|i| (i, 0)).collect();
        SampledFleet::new(law, &Graph::from_arcs(n, &arcs), &vec![0.0; n])
    }

    #[test]
    fn a_follower_in_closed_form() {
        // The leader at its speed, the follower with it but ξ₀ behind: (s + 1)³ from (ξ, ξ̇) = (ξ₀, 0) and ∫ = 0, thus
        // e = ξ₀ (1 + t − t²) e^(−t): e(0) = 1, ė(0) = 0, ë(0) = −b = −3.
        let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
        let mut fleet = fleet(&law, 2).with_v_l(0.1).with_r(&[2.0, 3.0]);
        fleet.xi = vec![0.2, 0.0];
        let t = 1.5f64;
        fleet.run(t, 1e-4);
        let expected = 0.2 * (1.0 + t - t * t) * (-t).exp();
        assert!((fleet.xi[0] - fleet.xi[1] - expected).abs() < 1e-4, "{:?} {expected}", fleet.xi);
    }

    #[test]
    fn followers_learn_their_speeds_from_rest() {
        let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
        let mut fleet = fleet(&law, 3).with_v_l(0.1).with_r(&[2.0, 3.0, 4.0]);
        (fleet.v, fleet.xi) = (vec![0.0; 3], vec![0.3, 0.0, -0.4]);
        fleet.run(40.0, 0.02);
        assert!(fleet.spread() < 1e-6 && (fleet.v[2] - 0.4).abs() < 1e-6, "{fleet:?}");
    }

    #[test]
    fn a_leader_that_is_stuck_is_followed_at_its_speed() {
        // (2.41): without the mode of the leader, the modes stay.
        let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
        let mut fleet = fleet(&law, 3).with_v_l(0.1).with_r(&[2.0, 3.0, 4.0]);
        for _ in 0..2000 {
            fleet.v[0] = 0.15;
            fleet.run(0.02, 0.02);
        }
        // The leader's law pulls within each period, by a_1 (v_0 − v_1^c) dt.
        assert!(fleet.spread() < 1e-3, "{:?}", fleet.xi);
        assert!((fleet.v[1] - 0.225).abs() < 2e-3 && (fleet.v[2] - 0.3).abs() < 2e-3, "{:?}", fleet.v);
    }

    #[test]
    fn a_follower_that_is_stuck_disturbs_nobody() {
        let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
        let mut fleet = fleet(&law, 3).with_v_l(0.1).with_r(&[2.0, 3.0, 4.0]);
        fleet.xi = vec![0.1, 0.0, 0.0];
        for _ in 0..2000 {
            // Its own law pulls at it within a period; what counts is where it goes.
            let xi = fleet.xi[1];
            fleet.v[1] = 0.25;
            fleet.run(0.02, 0.02);
            fleet.xi[1] = xi + 0.25 / 3.0 * 0.02;
        }
        assert!((fleet.xi[0] - fleet.xi[2]).abs() < 1e-5 && (fleet.v[0] - 0.2).abs() < 1e-9, "{fleet:?}");
        // 40 s of 0.1 − 0.25/3
        assert!((fleet.xi[0] - fleet.xi[1] - 0.1 - 40.0 / 60.0).abs() < 1e-9, "{:?}", fleet.xi);
    }

    #[test]
    fn who_does_not_hear_the_leader_goes_on_as_it_has_learnt() {
        let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
        let mut follower = law.vehicle(1);
        let reference = SpeedReference { v_l: 77.0, v_l_dot: 0.0 };
        let own = Own { v: 0.3, r: 3.0, ..Own::default() };
        let stranger = Neighbour { vehicle: 2, xi: 5.0, ..Neighbour::default() };
        for heard in [&[][..], &[stranger], &[Neighbour { vehicle: 0, xi: f64::NAN, ..stranger }]] {
            assert_eq!(follower.demand(reference, &own, heard), Demand::Forward(0.0));
            follower.advance(0.1);
        }
        assert!((follower.neighbour_rate(reference, 0.0) - 0.1).abs() < 1e-15);
    }

    #[test]
    fn the_law_by_hand_and_its_signs() {
        let law = LeaderFollower::new(0, 2.0, GAINS).unwrap();
        let reference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
        let own = Own { v: 0.5, r: 2.0, xi: 1.0, ..Own::default() };
        assert_eq!(law.vehicle(0).demand(reference, &own, &[]), Demand::Forward(-2.0 * (0.5 - 0.2)));
        let ahead = [Neighbour { vehicle: 0, xi: 1.25, ..Neighbour::default() }];
        let mut follower = law.vehicle(1);
        assert_eq!(follower.demand(reference, &own, &ahead), Demand::Forward(2.0 * 3.0 * 0.25));
        follower.advance(0.1);
        // ζ has fallen by R c s̄ dt: the demand rises by as much.
        let Demand::Forward(next) = follower.demand(reference, &own, &ahead) else { panic!() };
        assert!((next - 1.5 - 2.0 * 0.25 * 0.1).abs() < 1e-15);
        assert!(law.says(0).is_none() && follower.says(&own).is_none());
    }

    #[test]
    fn gains_without_sense_are_refused() {
        assert!(LeaderFollower::new(0, 0.0, GAINS).is_err());
        assert!(LeaderFollower::new(0, 1.0, Gains { c: 9.0, ..GAINS }).is_err(), "ab = c swings for ever");
        assert!(LeaderFollower::new(0, 1.0, Gains { b: -1.0, ..GAINS }).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn positions_along_the_path_count_by_their_differences_alone(shift in -100.0..100.0f64, lag in -1.0..1.0f64) {
            let law = LeaderFollower::new(0, 1.0, GAINS).unwrap();
            let run = |shift: f64| {
                let mut fleet = fleet(&law, 2).with_v_l(0.1).with_r(&[2.0, 3.0]);
                fleet.xi = vec![shift + lag, shift];
                fleet.run(5.0, 0.02);
                fleet.xi[0] - fleet.xi[1]
            };
            prop_assert!((run(shift) - run(0.0)).abs() < 1e-9);
        }
    }
}
