//! Coordination of a fleet in which one vehicle alone is told the formation speed (section 3.3.5).

use super::disagreement::c;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// Which Laplacian (3.92) is computed with (erratum 3.16).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighing {
    /// L: every neighbour adds to the demand.
    Plain,
    /// D⁻¹L: neighbours are averaged, as in (3.88) and (3.90).
    Normalised,
}

/// Every vehicle matches position and speed of those it hears. The told one also hears a virtual leader that it runs itself:
/// ξ_L starts where the vehicle's own ξ is and goes at v_L. ξ_j and v_j/R_j of the neighbours are needed (erratum 3.22).
///
/// With constant R_i and v_L it agrees at v_L if every vehicle hears the told one, directly or through others, and, over the
/// non-zero eigenvalues μ of the Laplacian of the graph with the leader added, a²/b > max Im(μ)²/(Re(μ)|μ|²) (3.93): the
/// closed loop has the roots of s² + aμs + bμ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decentralised {
    told: usize,
    a: f64,
    b: f64,
    weighing: Weighing,
}

impl Decentralised {
    /// `told` is the index of the vehicle that is told v_L. `a` > 0 \[1/s\] damps differences in speed, `b` > 0 \[1/s²\]
    /// weighs differences in position; the same for all vehicles.
    pub fn new(told: usize, a: f64, b: f64, weighing: Weighing) -> Result<Decentralised, String> {
        Ok(Decentralised { told, a: positive("the gain a", a)?, b: positive("the gain b", b)?, weighing })
    }
}

impl FleetLaw for Decentralised {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        Some("normalised forward speed v/R [units of ξ per s]")
    }

    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw> {
        let leader = (index == self.told).then(Leader::default);
        Box::new(OneDecentralised { a: self.a, b: self.b, weighing: self.weighing, leader })
    }
}

/// The virtual leader V_1 of (3.91).
#[derive(Clone, Copy, Debug, Default)]
struct Leader {
    /// ξ_L; there is none before the first control period.
    xi: Option<f64>,
    /// ξ̇_L = v_L
    rate: f64,
}

/// Row i of the law.
#[derive(Debug)]
struct OneDecentralised {
    a: f64,
    b: f64,
    weighing: Weighing,
    /// Of the told vehicle.
    leader: Option<Leader>,
}

impl OneDecentralised {
    /// a Σ (v_i/R_i − v_j/R_j) + b Σ (ξ_i − ξ_j) for one j.
    fn differs(&self, own: &Own, xi: f64, rate: f64) -> f64 {
        self.a * (c(own) * own.v - rate) + self.b * (own.xi - xi)
    }
}

impl VehicleLaw for OneDecentralised {
    /// F_i = −a R_i Σ (v_i/R_i − v_j/R_j) − b R_i Σ (ξ_i − ξ_j), row i of (3.92), divided by |N_i| for the normalised
    /// Laplacian (3.90). For R_i that varies along the path, Ṙ_i v_i/R_i keeps d/dt(v_i/R_i) what it is for constant C.
    /// Who hears nobody keeps its v_i/R_i.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let heard = neighbours.iter().filter(|other| other.xi.is_finite() && other.scalar.is_finite());
        let (mut sum, mut count) =
            heard.fold((0.0, 0u32), |(sum, count), j| (sum + self.differs(own, j.xi, j.scalar), count + 1));
        if let Some(leader) = &mut self.leader {
            let xi = *leader.xi.get_or_insert(own.xi);
            leader.rate = reference.v_l;
            sum += self.differs(own, xi, reference.v_l);
            count += 1;
        }
        let weight = match self.weighing {
            Weighing::Plain => 1.0,
            Weighing::Normalised => f64::from(count.max(1)).recip(),
        };
        Demand::Forward(-own.r * weight * sum + own.r_dot * c(own) * own.v)
    }

    /// ξ̇_L = v_L
    fn advance(&mut self, dt: f64) {
        if let Some(Leader { xi: Some(xi), rate }) = &mut self.leader {
            *xi += *rate * dt;
        }
    }

    /// The rate that the neighbour says it has.
    fn neighbour_rate(&self, _: SpeedReference, scalar: f64) -> f64 {
        scalar
    }

    /// v_i/R_i
    fn says(&self, own: &Own) -> Option<f64> {
        Some(c(own) * own.v)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;
    use proptest::prelude::*;

    use super::{Decentralised, Weighing};
    use crate::coordination::sampled_fleet::{SampledFleet, any_digraph, demand_of, slowest_root};
    use crate::coordination::{FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;
    use crate::graph::spectrum::eigenvalues;

    /// The right-hand side of (3.93) and the non-zero eigenvalues of the Laplacian of the graph with the leader.
    fn condition_3_93(graph: &Graph, told: usize, weighing: Weighing) -> (f64, Vec<Complex<f64>>) {
        let n = graph.len();
        let arcs: Vec<(usize, usize)> = graph.arcs().chain([(told, n)]).collect();
        let with_leader = Graph::from_arcs(n + 1, &arcs);
        let laplacian = match weighing {
            Weighing::Plain => with_leader.laplacian(),
            Weighing::Normalised => with_leader.normalised_laplacian(),
        };
        let mu: Vec<_> = eigenvalues(&laplacian).expect("finite").into_iter().filter(|mu| mu.norm() > 1e-6).collect();
        let least = mu.iter().map(|mu| mu.im * mu.im / (mu.re * mu.norm_sqr())).fold(0.0, f64::max);
        (least, mu)
    }

    const BOTH: [Weighing; 2] = [Weighing::Plain, Weighing::Normalised];

    fn ring() -> Graph {
        Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)])
    }

    #[test]
    fn the_row_of_the_law_by_hand() {
        let heard = [
            Neighbour { xi: 1.0, scalar: 0.5, ..Neighbour::default() },
            Neighbour { xi: 2.5, scalar: -0.25, ..Neighbour::default() },
        ];
        let own = Own { xi: 2.0, v: 1.0, r: 4.0, r_dot: 0.5, ..Own::default() };
        let reference = SpeedReference { v_l: 0.75, v_l_dot: 0.0 };
        let of = |vehicle, weighing| {
            let law = Decentralised::new(0, 2.0, 3.0, weighing).unwrap();
            demand_of(law.vehicle(vehicle).as_mut(), reference, &own, &heard)
        };
        // a (2/4 − 0.25) + b (1 − ½) = 2; the leader is where the vehicle is: a (¼ − ¾) = −1. And Ṙ v/R = 1/8.
        assert_eq!(of(1, Weighing::Plain), -4.0 * 2.0 + 0.125);
        assert_eq!(of(1, Weighing::Normalised), -4.0 * 2.0 / 2.0 + 0.125);
        assert_eq!(of(0, Weighing::Plain), -4.0 * (2.0 - 1.0) + 0.125);
        assert!((of(0, Weighing::Normalised) - (-4.0 / 3.0 + 0.125)).abs() < 1e-15);
    }

    #[test]
    fn the_thresholds_of_a_ring_are_those_of_the_erratum() {
        // Erratum 3.16.
        assert!((condition_3_93(&ring(), 0, Weighing::Normalised).0 - 0.13956).abs() < 5e-6);
        assert!((condition_3_93(&ring(), 0, Weighing::Plain).0 - 0.0724).abs() < 5e-5);
        // Erratum 3.15: two-way links give real eigenvalues, and no condition.
        assert_eq!(condition_3_93(&Graph::complete(4), 1, Weighing::Plain).0, 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn the_condition_is_sharp(
            graph in any_digraph(), pick in 0usize..5, weighing in prop::sample::select(&BOTH[..]), b in 0.5..1.5f64,
            inside in 1.5..6.0f64, outside in 0.1..0.7f64, r in prop::array::uniform5(0.5..3.0f64),
            xi in prop::array::uniform5(-1.0..1.0f64), v_l in 0.05..0.3f64,
        ) {
            let n = graph.len();
            let reachable = graph.globally_reachable();
            let told = reachable[pick % reachable.len()];
            let (least, mu) = condition_3_93(&graph, told, weighing);
            let fleet = |a: f64| {
                let law = Decentralised::new(told, a, b, weighing).unwrap();
                let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_r(&r[..n]);
                fleet.v_l = v_l;
                fleet
            };
            let a = (inside * b * least).sqrt().max(0.7);
            let rate = -slowest_root(&mu, |mu| [mu * a, mu * b]);
            prop_assert!(rate > 0.0);
            let mut agreed = fleet(a);
            let (start, seconds) = (agreed.size() + v_l, (16.0 / rate).min(400.0));
            agreed.run(seconds, 0.01);
            let bound = start * (1e3 * (-0.85 * rate * seconds).exp()).max(1e-9);
            prop_assert!(agreed.size() < bound, "{} {bound} {rate}", agreed.size());
            // From rest everybody has learned v_L.
            let worst = agreed.rate.iter().map(|rate| (rate - v_l).abs()).fold(0.0, f64::max);
            prop_assert!(worst < bound, "{worst} {bound} {rate}");
            if least > 0.05 {
                let a = (outside * b * least).sqrt();
                let growth = slowest_root(&mu, |mu| [mu * a, mu * b]);
                prop_assert!(growth > 0.0);
                if growth > 0.03 {
                    let (mut early, mut late) = (fleet(a), fleet(a));
                    early.run(2.4 / growth, 0.01);
                    late.run(14.0 / growth, 0.01);
                    prop_assert!(late.size() > 10.0 * early.size(), "{graph:?} {growth}");
                }
            }
        }

        #[test]
        fn who_is_not_told_v_l_does_not_use_it(
            v_l in -9.0..9.0f64, v_l_dot in -9.0..9.0f64, xi in -5.0..5.0f64, v in -2.0..2.0f64, scalar in -1.0..1.0f64,
            eta in -5.0..5.0f64, weighing in prop::sample::select(&BOTH[..]),
        ) {
            let law = Decentralised::new(0, 0.7, 0.3, weighing).unwrap();
            let heard = [Neighbour { xi: 1.0, scalar, ..Neighbour::default() }];
            // η would give v_L away.
            let ask = |vehicle, v_l, v_l_dot, eta| {
                let (mut law, reference) = (law.vehicle(vehicle), SpeedReference { v_l, v_l_dot });
                let own = Own { xi, v, eta, r: 2.0, ..Own::default() };
                [(); 3].map(|()| {
                    let demand = law.demand(reference, &own, &heard);
                    law.advance(0.1);
                    (demand, law.says(&own), law.neighbour_rate(reference, scalar))
                })
            };
            prop_assert_eq!(ask(1, v_l, v_l_dot, eta), ask(1, 0.0, 0.0, 0.0));
            prop_assert!(v_l.abs() < 1e-3 || ask(0, v_l, 0.0, 0.0) != ask(0, 0.0, 0.0, 0.0), "the told one does");
        }
    }

    #[test]
    fn a_ring_gives_way_between_the_thresholds_of_its_two_laplacians() {
        // a²/b = 0.1 is above 0.0724 and below 0.13956.
        let size = |weighing| {
            let law = Decentralised::new(0, 0.1f64.sqrt(), 1.0, weighing).unwrap();
            let mut fleet = SampledFleet::new(&law, &ring(), &[0.0, 0.5, -0.5]);
            fleet.v_l = 0.1;
            fleet.run(400.0, 0.002);
            fleet.size()
        };
        assert!(size(Weighing::Plain) < 0.05 && size(Weighing::Normalised) > 5.0);
    }

    #[test]
    fn a_new_formation_speed_reaches_the_vehicles_that_are_not_told() {
        let law = Decentralised::new(2, 1.0, 1.0, Weighing::Plain).unwrap();
        let mut fleet = SampledFleet::new(&law, &Graph::from_edges(3, &[(0, 1), (1, 2)]), &[0.0; 3]);
        fleet.reference = |t| SpeedReference { v_l: if t < 100.0 { 0.1 } else { 0.3 }, v_l_dot: 0.0 };
        fleet.run(99.0, 0.01);
        assert!(fleet.rate.iter().all(|rate| (rate - 0.1).abs() < 1e-4), "{:?}", fleet.rate);
        fleet.run(100.0, 0.01);
        assert!(fleet.rate.iter().all(|rate| (rate - 0.3).abs() < 1e-4), "{:?}", fleet.rate);
    }

    #[test]
    fn who_hears_nobody_keeps_its_rate_and_strange_words_are_not_heard() {
        let law = Decentralised::new(0, 1.0, 1.0, Weighing::Normalised).unwrap();
        let own = Own { xi: 3.0, v: 1.0, r: 2.0, ..Own::default() };
        let strange = [Neighbour { xi: f64::NAN, ..Neighbour::default() }];
        let mute = [Neighbour { xi: 1.0, scalar: f64::NAN, ..Neighbour::default() }];
        for heard in [&[][..], &strange, &mute] {
            assert_eq!(demand_of(law.vehicle(1).as_mut(), SpeedReference::default(), &own, heard), 0.0);
        }
        // Where R grows the speed must grow with it: Ṙ v/R.
        let wider = Own { v: 3.0, r_dot: 0.5, ..own };
        assert_eq!(demand_of(law.vehicle(1).as_mut(), SpeedReference::default(), &wider, &[]), 0.75);
        assert!(FleetLaw::says(&law, 0).is_some() && law.vehicle(1).says(&own) == Some(0.5));
        let reference = SpeedReference { v_l: 9.0, v_l_dot: 0.0 };
        assert_eq!(law.vehicle(1).neighbour_rate(reference, 0.25), 0.25, "a neighbour goes on as it says");
        assert!(Decentralised::new(0, 0.0, 1.0, Weighing::Plain).is_err());
    }
}
