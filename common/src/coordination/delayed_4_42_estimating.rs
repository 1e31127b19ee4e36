//! Agreement when what is heard is late, nobody is told how late, and at times nothing is heard.

use super::disagreement::Disagreement;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// As [`DelayedAlone`](super::delayed_4_42::DelayedAlone), with an estimate of v_L* in place of the value that the vehicles
/// would have to be told τ for: the question that the thesis leaves open after Lemma 4.5.
///
/// While a vehicle has neighbours, its own demand tends to v_L* (Lemma 4.4). So it keeps a slow average of that demand,
/// as a part f of v_L, and travels at f v_L while it is alone:
///
/// ```text
/// T df/dt = v_r/v_L − f  while N_i is not empty,    df/dt = 0  while it is;    0 ≤ f ≤ 1
/// ```
///
/// Once the fleet moves as one at f v_L, its demand in company is v_L − kτ f v_L, so T df/dt = 1 − (1 + kτ) f: the only rest
/// is f = 1/(1 + kτ), where coordination is exact. `docs/talking.md` has what T must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimating {
    k: f64,
    time_constant: f64,
}

impl Estimating {
    /// `k` > 0 \[1/s\], the sum of the gains of one vehicle; `time_constant` T > 0 \[s\].
    pub fn new(k: f64, time_constant: f64) -> Result<Estimating, String> {
        let time_constant = positive("the time constant", time_constant)?;
        Ok(Estimating { k: positive("the gain k", k)?, time_constant })
    }
}

impl FleetLaw for Estimating {
    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, _index: usize) -> Box<dyn VehicleLaw> {
        Box::new(Averaging { law: *self, part: 1.0, demanded: None })
    }
}

/// The law of one vehicle, with its estimate.
#[derive(Debug)]
struct Averaging {
    law: Estimating,
    /// f, the estimate of v_L*/v_L.
    part: f64,
    /// v_r/v_L of this control period, if the vehicle had neighbours.
    demanded: Option<f64>,
}

impl VehicleLaw for Averaging {
    /// v_r = v_L − (k/|N_i|) Σ (γ_i(t) − γ_j(t − τ)), or f v_L when N_i is empty: (4.42), errata 4.1 and 4.24.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let disagreement = Disagreement::among(own, neighbours);
        let v_l = reference.v_l;
        if disagreement.neighbours == 0 {
            self.demanded = None;
            return Demand::Rate(self.part * v_l);
        }
        let v_r = v_l - self.law.k * disagreement.mean_ahead();
        self.demanded = Some(v_r / v_l).filter(|part| part.is_finite());
        Demand::Rate(v_r)
    }

    fn advance(&mut self, dt: f64) {
        if let Some(demanded) = self.demanded {
            let weight = 1.0 - (-dt / self.law.time_constant).exp();
            self.part = (self.part + weight * (demanded - self.part)).clamp(0.0, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Estimating;
    use crate::coordination::delayed_4_34::Delayed;
    use crate::coordination::delayed_4_42::DelayedAlone;
    use crate::coordination::ideal_fleet::STAR;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
    use proptest::prelude::*;

    const REFERENCE: SpeedReference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };
    const DT: f64 = 0.05;

    fn ask(law: &mut dyn VehicleLaw, xi: f64, heard: &[f64]) -> f64 {
        let own = Own { xi, r: 1.0, ..Own::default() };
        let neighbours: Vec<Neighbour> = heard.iter().map(|&xi| Neighbour { xi, ..Neighbour::default() }).collect();
        match law.demand(REFERENCE, &own, &neighbours) {
            Demand::Rate(rate) => rate,
            other => panic!("{other:?}"),
        }
    }

    /// The vehicles of section 4.6 with delay `tau`, and what each hears as `hears` says at an instant: the spread at the
    /// end, and the speeds at which they would travel alone from there.
    fn fly(
        law: &dyn FleetLaw,
        tau: f64,
        seconds: f64,
        hears: impl Fn(f64, usize) -> &'static [usize],
    ) -> (f64, [f64; 3]) {
        let mut laws = [law.vehicle(0), law.vehicle(1), law.vehicle(2)];
        let late = (tau / DT).round() as usize;
        let mut past = vec![[79.517, 70.483, 65.596]];
        for step in 0..(seconds / DT).round() as usize {
            let (now, then) = (past[step], past[step.saturating_sub(late)]);
            let next = std::array::from_fn(|i| {
                let heard: Vec<f64> = hears(step as f64 * DT, i).iter().map(|&j| then[j]).collect();
                now[i] + DT * ask(laws[i].as_mut(), now[i], &heard)
            });
            laws.iter_mut().for_each(|law| law.advance(DT));
            past.push(next);
        }
        let end = past[past.len() - 1];
        let spread = end.iter().copied().fold(f64::MIN, f64::max) - end.iter().copied().fold(f64::MAX, f64::min);
        (spread, std::array::from_fn(|i| ask(laws[i].as_mut(), end[i], &[])))
    }

    fn law() -> Estimating {
        Estimating::new(0.1, 10.0).unwrap()
    }

    #[test]
    fn every_vehicle_finds_v_l_star_to_a_thousandth() {
        for (k, tau) in [(0.1, 5.0), (0.1, 0.0), (0.4, 2.0), (0.2, 10.0)] {
            let (spread, alone) = fly(&Estimating::new(k, 10.0).unwrap(), tau, 1500.0, |_, i| STAR[i]);
            let star = 0.5 / (1.0 + k * tau);
            assert!(spread < 1e-6, "{spread}");
            assert!(alone.iter().all(|speed| (speed - star).abs() < 1e-3 * star), "k {k}, τ {tau}: {alone:?}, {star}");
        }
    }

    /// Down for t mod 10 in [0, 7.5) (erratum 4.23), for all or for the first vehicle alone.
    fn all_alone(t: f64, i: usize) -> &'static [usize] {
        if t % 10.0 < 7.5 { &[] } else { STAR[i] }
    }

    fn first_alone(t: f64, i: usize) -> &'static [usize] {
        const REST: [&[usize]; 3] = [&[], &[2], &[1]];
        if t % 10.0 < 7.5 { REST[i] } else { STAR[i] }
    }

    #[test]
    fn one_vehicle_cut_off_alone_keeps_coordination_as_if_it_had_been_told() {
        // Erratum 4.24.
        let told = fly(&DelayedAlone::new(0.1, 5.0).unwrap(), 5.0, 1200.0, first_alone).0;
        let (estimated, alone) = fly(&law(), 5.0, 1200.0, first_alone);
        let not_told = fly(&Delayed::new(0.1).unwrap(), 5.0, 1200.0, first_alone).0;
        assert!(told < 1e-3 && estimated < 5e-3 && not_told > 3.0, "{told} {estimated} {not_told}");
        assert!(alone.iter().all(|speed| (speed - 1.0 / 3.0).abs() < 1e-3 / 3.0), "{alone:?}");
    }

    #[test]
    fn all_cut_off_together_still_find_it() {
        let (spread, alone) = fly(&law(), 5.0, 1200.0, all_alone);
        assert!(spread < 1e-3, "{spread}");
        assert!(alone.iter().all(|speed| (speed - 1.0 / 3.0).abs() < 1e-3 / 3.0), "{alone:?}");
    }

    #[test]
    fn a_new_formation_speed_takes_the_estimate_along() {
        let mut law = law().vehicle(0);
        for _ in 0..4000 {
            ask(law.as_mut(), 0.0, &[-2.5]);
            law.advance(DT);
        }
        let own = Own { r: 1.0, ..Own::default() };
        let alone = law.demand(SpeedReference { v_l: 0.2, v_l_dot: 0.0 }, &own, &[]);
        assert!(matches!(alone, Demand::Rate(rate) if (rate - 0.1).abs() < 1e-6), "{alone:?}");
        // Nothing can be learnt from a fleet that stands still.
        law.demand(SpeedReference::default(), &own, &[Neighbour::default()]);
        law.advance(DT);
        assert!((ask(law.as_mut(), 0.0, &[]) - 0.25).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn alone_it_is_never_faster_than_v_l_nor_backwards(heard in proptest::collection::vec(-1e9..1e9f64, 1..50)) {
            let mut law = law().vehicle(0);
            for xi in heard {
                ask(law.as_mut(), 0.0, &[xi]);
                law.advance(1.0);
                prop_assert!((0.0..=0.5).contains(&ask(law.as_mut(), 0.0, &[])));
            }
        }
    }

    #[test]
    fn the_estimate_is_a_slow_average_of_what_is_asked_for_in_company() {
        let mut one = law().vehicle(0);
        assert_eq!(ask(one.as_mut(), 3.0, &[]), 0.5, "who never heard anyone goes at v_L");
        // In company it is asked for v_L − 0.1·2 = 0.6 v_L, for half of T: f = 0.6 + 0.4e^(−½).
        assert!((ask(one.as_mut(), 3.0, &[1.0]) - 0.3).abs() < 1e-15);
        one.advance(5.0);
        assert!((ask(one.as_mut(), 3.0, &[]) - 0.5 * (0.6 + 0.4 * (-0.5f64).exp())).abs() < 1e-12);
        // Alone it keeps it.
        one.advance(50.0);
        assert!((ask(one.as_mut(), 3.0, &[]) - 0.5 * (0.6 + 0.4 * (-0.5f64).exp())).abs() < 1e-12);
    }
}
