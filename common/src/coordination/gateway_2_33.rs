//! The gateway, section 2.2.2: one vehicle hears all, all hear it. With the extra integrator of section 2.5.3, too.

use super::recruiting::{Gains, Recruit, ahead_of};
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// (2.33) for the gateway, with the sign of erratum 2.2, and (2.34) for the others. Only the gateway is told
/// v_1^c = R_1 v_L.
///
/// The modes are those of (2.35): they decay if ab > c, for every b_0 > 0. A vehicle that is stuck at v_0 is waited for by
/// all others, and stays b_0/c (v_0/R_2 − v_1^c/R_1) ahead of them (2.43); with the extra integrator it does not, if d is
/// small enough for the number of vehicles ([`greatest_d`](crate::theory::gateway_2_35::Gateway::greatest_d)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gateway {
    gateway: usize,
    b_0: f64,
    gains: Gains,
    d: Option<f64>,
}

impl Gateway {
    /// `gateway` is the gateway's index, `b_0` > 0 \[1/s²\] its gain on the integral of v_1 − v_1^c.
    pub fn new(gateway: usize, b_0: f64, gains: Gains) -> Result<Gateway, String> {
        Ok(Gateway { gateway, b_0: positive("the gain b_0", b_0)?, gains: gains.checked()?, d: None })
    }

    /// The same with the extra integrator: `d` > 0 \[1/s⁴\], with s⁴ + a s³ + b s² + c s + d stable. The others send
    /// δe_{1,i}, the integral of ξ_1 − ξ_i, beside ξ_i.
    pub fn with_integral(gateway: usize, b_0: f64, gains: Gains, d: f64) -> Result<Gateway, String> {
        let Gains { a, b, c } = gains;
        let most = (a * b - c) * c / (a * a);
        if positive("the gain d", d)? < most {
            Ok(Gateway { d: Some(d), ..Gateway::new(gateway, b_0, gains)? })
        } else {
            Err(format!("d must be below (a b - c) c/a^2 = {most}, it is {d}"))
        }
    }
}

impl FleetLaw for Gateway {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    /// The gateway itself says ξ alone: nobody minds how far it is ahead of itself.
    fn says(&self, vehicle: usize) -> Option<&'static str> {
        let says = self.d.is_some() && vehicle != self.gateway;
        says.then_some("integral of how far the gateway is ahead, δe [units of ξ times s]")
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        let d = self.d.unwrap_or(0.0);
        if index == self.gateway {
            let recruit = Recruit::new(self.gains, Some(self.b_0), d);
            Box::new(Hub { gateway: index, recruit, integrals: 0.0 })
        } else {
            let recruit = Recruit::new(self.gains, None, d);
            Box::new(Spoke { gateway: self.gateway, recruit, says: self.d.is_some() })
        }
    }
}

/// The gateway itself.
#[derive(Debug)]
struct Hub {
    gateway: usize,
    recruit: Recruit,
    /// Σ δe_{1,i} of those heard.
    integrals: f64,
}

impl VehicleLaw for Hub {
    /// F_1 = −z_1 − R_1 b Σ s̄_{1,i}, ż_1 = a v̇_1 + b_0 (v_1 − v_1^c) + R_1 c Σ s̄_{1,i} + R_1 d Σ δe_{1,i} (2.33),
    /// erratum 2.2: the printed minus signs leave a fleet with a stuck vehicle unstable.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let others = |j: &Neighbour| j.vehicle != self.gateway && j.xi.is_finite() && j.scalar.is_finite();
        self.integrals = neighbours.iter().filter(|j| others(j)).map(|j| j.scalar).sum();
        let ahead = ahead_of(own, neighbours, |j| j != self.gateway);
        self.recruit.demand(reference, own, ahead)
    }

    fn advance(&mut self, dt: f64) {
        self.recruit.advance_with(dt, self.integrals);
    }

    fn neighbour_rate(&self, _: SpeedReference, _: f64) -> f64 {
        self.recruit.rate()
    }
}

/// One of the others.
#[derive(Debug)]
struct Spoke {
    gateway: usize,
    recruit: Recruit,
    says: bool,
}

impl VehicleLaw for Spoke {
    /// F_i = −z_i + R_i b s̄_{1,i}, ż_i = a v̇_i − R_i c s̄_{1,i} − R_i d δe_{1,i} (2.34).
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let ahead = ahead_of(own, neighbours, |j| j == self.gateway);
        self.recruit.demand(reference, own, ahead)
    }

    /// With dδe_{1,i}/dt = s̄_{1,i}.
    fn advance(&mut self, dt: f64) {
        self.recruit.advance(dt);
    }

    fn neighbour_rate(&self, _: SpeedReference, _: f64) -> f64 {
        self.recruit.rate()
    }

    /// δe_{1,i}
    fn says(&self, _: &Own) -> Option<f64> {
        self.says.then(|| -self.recruit.integral())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Gateway;
    use crate::coordination::recruiting::Gains;
    use crate::coordination::sampled_fleet::SampledFleet;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;
    use crate::theory::gateway_2_35::Gateway as Theory;
    use crate::theory::polynomial::abscissa;

    const GAINS: Gains = Gains { a: 3.0, b: 3.0, c: 1.0 };
    const MORE: Gains = Gains { a: 4.0, b: 6.0, c: 4.0 };

    fn star(n: usize) -> Graph {
        Graph::from_edges(n, &(1..n).map(|i| (0, i)).collect::<Vec<_>>())
    }

    /// Section 2.5.3: radii of 2, 3 and 4 m at v_1^c = 0.2 m/s.
    fn section_2_5_3(law: &Gateway) -> SampledFleet {
        SampledFleet::new(law, &star(3), &[0.0; 3]).with_v_l(0.1).with_r(&[2.0, 3.0, 4.0])
    }

    /// The same with vehicle 2 stuck at 0.25 m/s for `seconds`: (2.42).
    fn stuck(law: &Gateway, seconds: f64) -> SampledFleet {
        let (mut fleet, dt) = (section_2_5_3(law), 0.01);
        for _ in 0..(seconds / dt) as usize {
            // Its own law pulls at it within a period; what counts is where it goes.
            let xi = fleet.xi[1];
            fleet.v[1] = 0.25;
            fleet.run(dt, dt);
            fleet.xi[1] = xi + 0.25 / 3.0 * dt;
        }
        fleet
    }

    #[test]
    fn a_vehicle_that_is_stuck_stays_behind_by_2_43() {
        let fleet = stuck(&Gateway::new(0, 5.0, GAINS).unwrap(), 150.0);
        // b_0/c (v_0/R_2 − v_1^c/R_1) = 5 (0.25/3 − 0.1): 0.083333 rad (erratum 2.11).
        assert!((fleet.xi[0] - fleet.xi[1] - 1.0 / 12.0).abs() < 1e-6, "{:?}", fleet.xi);
        assert!((fleet.xi[0] - fleet.xi[2]).abs() < 1e-6);
        assert!((fleet.v[0] - 0.5 / 3.0).abs() < 1e-6 && (fleet.v[2] - 1.0 / 3.0).abs() < 1e-6, "{:?}", fleet.v);
    }

    #[test]
    fn with_the_extra_integrator_it_does_not() {
        let fleet = stuck(&Gateway::with_integral(0, 5.0, MORE, 1.0).unwrap(), 150.0);
        assert!(fleet.spread() < 1e-6, "{:?}", fleet.xi);
    }

    #[test]
    fn everybody_learns_its_speed() {
        for law in [Gateway::new(0, 5.0, GAINS), Gateway::with_integral(0, 5.0, MORE, 1.0)] {
            let mut fleet = section_2_5_3(&law.unwrap());
            (fleet.v, fleet.xi) = (vec![0.0; 3], vec![0.1, 0.0, -0.2]);
            fleet.run(100.0, 0.02);
            assert!(fleet.spread() < 1e-5, "{:?}", fleet.xi);
            assert!(fleet.v.iter().zip([0.2, 0.3, 0.4]).all(|(v, wanted)| (v - wanted).abs() < 1e-5), "{:?}", fleet.v);
        }
    }

    #[test]
    fn the_law_by_hand() {
        let law = Gateway::with_integral(0, 5.0, MORE, 1.0).unwrap();
        let reference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
        let own = Own { v: 0.5, r: 2.0, xi: 1.0, ..Own::default() };
        let heard = [(1, 0.75, 0.3), (2, 0.5, -0.1), (0, 9.0, 9.0), (3, 0.0, f64::NAN)]
            .map(|(vehicle, xi, scalar)| Neighbour { vehicle, xi, scalar, ..Neighbour::default() });
        let mut hub = law.vehicle(0);
        let heard = &heard[..3];
        let Demand::Forward(first) = hub.demand(reference, &own, heard) else { panic!() };
        assert_eq!(first, -2.0 * 6.0 * 0.75, "itself it does not mind");
        hub.advance(0.1);
        let Demand::Forward(next) = hub.demand(reference, &own, heard) else { panic!() };
        // −dt (b_0 (v − v^c) + R c Σ s̄ + R d Σ δe)
        assert!((next - first + 0.1 * (5.0 * 0.3 + 2.0 * 4.0 * 0.75 + 2.0 * 0.2)).abs() < 1e-12);
        let mut spoke = law.vehicle(2);
        spoke.demand(reference, &own, &[Neighbour { vehicle: 0, xi: 1.5, ..Neighbour::default() }]);
        // ζ moves by R(cS + dE), E with it: S = −½ held for two periods, E in the middle of them −0.025 and −0.075.
        let mut moved = law.vehicle(2);
        let asked = [(); 3].map(|()| {
            let ahead = [Neighbour { vehicle: 0, xi: 1.5, ..Neighbour::default() }];
            let Demand::Forward(asked) = moved.demand(reference, &own, &ahead) else { panic!() };
            moved.advance(0.1);
            asked
        });
        assert!((asked[1] - asked[0] - 0.1 * 2.0 * (4.0 * 0.5 + 0.025)).abs() < 1e-12, "{asked:?}");
        assert!((asked[2] - asked[1] - 0.1 * 2.0 * (4.0 * 0.5 + 0.075)).abs() < 1e-12, "{asked:?}");
        // Not being told v_L, they take others to move as they do themselves.
        assert_eq!([hub.neighbour_rate(reference, 9.0), spoke.neighbour_rate(reference, 9.0)], [0.25; 2]);
        spoke.advance(0.1);
        assert!((spoke.says(&own).unwrap() - 0.05).abs() < 1e-15, "δe grows while the gateway is ahead");
        assert_eq!((hub.says(&own), law.says(0).is_some(), law.says(2).is_some()), (None, false, true));
        let plain = Gateway::new(0, 5.0, GAINS).unwrap();
        assert!(plain.says(1).is_none() && plain.vehicle(1).says(&own).is_none());
        // Without the extra integrator what a distance that stays adds is the same in every period.
        let mut spoke = plain.vehicle(1);
        let ahead = [Neighbour { vehicle: 0, xi: 1.5, ..Neighbour::default() }];
        let asked = [(); 3].map(|()| {
            let Demand::Forward(asked) = spoke.demand(reference, &own, &ahead) else { panic!() };
            spoke.advance(0.1);
            asked
        });
        assert!((asked[2] - 2.0 * asked[1] + asked[0]).abs() < 1e-12 && asked[1] > asked[0], "{asked:?}");
        // What is no number is not heard, of either kind.
        let strange = [
            Neighbour { vehicle: 1, xi: f64::NAN, ..Neighbour::default() },
            Neighbour { vehicle: 2, xi: 0.5, scalar: f64::NAN, ..Neighbour::default() },
        ];
        let [strange, nobody] = [&[Neighbour { scalar: 5.0, ..strange[0] }, strange[1]][..], &[]].map(|heard| {
            let mut hub = law.vehicle(0);
            [(); 3].map(|()| {
                // The second one's ξ is a number, and counts in that.
                let own = Own { xi: 0.5, ..own };
                let demand = hub.demand(reference, &own, heard);
                hub.advance(0.1);
                demand
            })
        });
        assert_eq!(strange, nobody);
    }

    #[test]
    fn gains_without_sense_are_refused() {
        assert!(Gateway::new(0, 0.0, GAINS).is_err() && Gateway::new(0, 1.0, Gains { c: 9.1, ..GAINS }).is_err());
        // (24 − 4) 4/16 = 5
        assert!(
            Gateway::with_integral(0, 5.0, MORE, 5.0).is_err() && Gateway::with_integral(0, 5.0, MORE, 4.9).is_ok()
        );
        assert!(Gateway::with_integral(0, 5.0, MORE, 0.0).is_err());
    }

    /// The fleet as theory has it.
    fn in_theory(gains: Gains, d: Option<f64>, b_0: f64, n: usize) -> Theory {
        Theory { a: gains.a, distance: [gains.b, gains.c].into_iter().chain(d).collect(), b_0, n }
    }

    /// Vehicles with these radii, the second stuck at 0.8 of the formation speed, after `seconds`; and the greatest spread in
    /// the second half of that time.
    fn with_a_stuck_one(law: &Gateway, r: &[f64], seconds: f64) -> (SampledFleet, f64) {
        let (n, dt) = (r.len(), 0.01);
        let mut fleet = SampledFleet::new(law, &star(n), &vec![0.0; n]).with_v_l(0.1).with_r(r);
        let (steps, mut most) = ((seconds / dt) as usize, 0f64);
        for step in 0..steps {
            let xi = fleet.xi[1];
            fleet.v[1] = 0.08 * r[1];
            fleet.run(dt, dt);
            fleet.xi[1] = xi + 0.08 * dt;
            if step > steps / 2 {
                most = most.max(fleet.spread());
            }
        }
        (fleet, most)
    }

    /// a, b, and c as a part of ab.
    fn gains(range: std::ops::Range<f64>) -> impl Strategy<Value = Gains> {
        (1.0..4.0f64, 1.0..4.0f64, range).prop_map(|(a, b, part)| Gains { a, b, c: part * a * b })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        /// (2.35) decays for every b_0 and any number of vehicles if ab > c.
        #[test]
        fn it_agrees_whatever_b_0_and_the_radii_if_ab_is_above_c(
            gains in gains(0.1..0.7), b_0 in 0.5..10.0f64, n in 2usize..6, xi in prop::array::uniform5(-0.5..0.5f64),
            r in prop::array::uniform5(0.5..5.0f64),
        ) {
            let law = Gateway::new(0, b_0, gains).unwrap();
            let rate = in_theory(gains, None, b_0, n).verdict(false).norm_rate.expect("it decays");
            prop_assume!(rate > 0.05);
            let mut fleet = SampledFleet::new(&law, &star(n), &xi[..n]).with_v_l(0.1).with_r(&r[..n]);
            fleet.run(16.0 / rate, 0.005);
            prop_assert!(fleet.spread() < 1e-3, "{:?}", fleet.xi);
        }

        #[test]
        fn it_does_not_if_c_is_above_ab(
            gains in gains(1.5..3.0), b_0 in 0.5..10.0f64, n in 3usize..6, r in prop::array::uniform5(0.5..5.0f64),
        ) {
            prop_assert!(Gateway::new(0, b_0, gains).is_err());
            let law = Gateway { gateway: 0, b_0, gains, d: None };
            let slowest = abscissa(&in_theory(gains, None, b_0, n).follower()).expect("a polynomial");
            // Two of the others are apart.
            let mut fleet = SampledFleet::new(&law, &star(n), &vec![0.0; n]).with_v_l(0.1).with_r(&r[..n]);
            fleet.xi[2] = 0.1;
            fleet.run(8.0 / slowest, 0.005);
            prop_assert!(fleet.spread() > 1.0, "{:?}", fleet.xi);
        }

        /// Section 2.5.3: no error stays, whatever b_0, if d is below what the number of vehicles allows.
        #[test]
        fn with_the_extra_integrator_a_stuck_vehicle_leaves_no_error(
            gains in gains(0.1..0.6), of_d in 0.3..0.8f64, b_0 in 0.2..8.0f64, n in 2usize..6,
            r in prop::array::uniform5(0.5..5.0f64),
        ) {
            let d = of_d * in_theory(gains, Some(0.0), b_0, n).greatest_d().expect("with the integrator");
            let theory = in_theory(gains, Some(d), b_0, n);
            let rate = theory.verdict(true).norm_rate.expect("it decays");
            prop_assume!(rate > 0.04);
            let (fleet, _) = with_a_stuck_one(&Gateway::with_integral(0, b_0, gains, d).unwrap(), &r[..n], 20.0 / rate);
            prop_assert!(fleet.spread() < 1e-4 && theory.steady_error(0.08 * r[1], r[1], 0.1 * r[0], r[0]) == 0.0, "{:?}", fleet.xi);
            prop_assert!(fleet.rate.iter().skip(2).all(|rate| (rate - 0.08).abs() < 1e-4), "{:?}", fleet.rate);
            // Without it one stays, that of (2.43).
            let plain = in_theory(gains, None, b_0, n);
            let rate = plain.verdict(true).norm_rate.expect("it decays");
            prop_assume!(rate > 0.04);
            let (fleet, _) = with_a_stuck_one(&Gateway::new(0, b_0, gains).unwrap(), &r[..n], 20.0 / rate);
            let stays = plain.steady_error(0.08 * r[1], r[1], 0.1 * r[0], r[0]);
            prop_assert!((fleet.xi[1] - fleet.xi[0] - stays).abs() < 1e-3 * (1.0 + stays.abs()), "{:?} {}", fleet.xi, stays);
        }

        #[test]
        fn and_with_a_larger_d_a_stuck_vehicle_upsets_the_others(b_0 in 0.1..0.5f64, n in 7usize..9) {
            // The gains of section 2.5.3: d = 1 will do for five vehicles.
            let theory = in_theory(MORE, Some(1.0), b_0, n);
            let slowest = abscissa(&theory.with_failure()).expect("a polynomial");
            prop_assert!(theory.greatest_d() < Some(1.0) && slowest > 0.0, "{}", slowest);
            let law = Gateway::with_integral(0, b_0, MORE, 1.0).unwrap();
            let most_of = |seconds: f64| with_a_stuck_one(&law, &vec![1.0; n], seconds).1;
            let (soon, late) = (most_of(4.0 / slowest), most_of(9.0 / slowest));
            prop_assert!(late > 10.0 * soon, "{} {}", soon, late);
        }
    }
}
