//! Agreement at v_L when every message says how old it is.

use std::collections::VecDeque;

use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// Most places of its own that a vehicle remembers.
pub const MOST_REMEMBERED: usize = 100_000;

/// Each vehicle compares what a neighbour said with where it was itself at that same instant, so that the age of the
/// news makes no difference between vehicles abreast: the fleet travels at v_L, not at v_L/(1 + kτ), whatever the delays
/// of the single links. What delay costs is stability, see [`crate::theory::known_delay`].
///
/// It needs clocks that agree on when a message was made. A result of this project; the thesis' laws (4.34) and (4.42)
/// compare the present with the past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownDelay {
    k: f64,
    longest: f64,
}

impl KnownDelay {
    /// `k` > 0 \[1/s\]; `longest` > 0 \[s\], how far back a vehicle remembers: older news do not count.
    pub fn new(k: f64, longest: f64) -> Result<KnownDelay, String> {
        Ok(KnownDelay { k: positive("the gain k", k)?, longest: positive("the longest delay", longest)? })
    }
}

impl FleetLaw for KnownDelay {
    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, _index: usize) -> Box<dyn VehicleLaw> {
        Box::new(Remembering { law: *self, past: Past::default() })
    }
}

/// The law of one vehicle, with its own past.
#[derive(Debug)]
struct Remembering {
    law: KnownDelay,
    past: Past,
}

impl VehicleLaw for Remembering {
    /// v_r = v_L − k Σ (γ_i(t − τ_ij) − γ_j(t − τ_ij)), over those of N_i whose news are not older than the memory.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        self.past.keep(own.xi, self.law.longest);
        let ahead =
            |other: &Neighbour| self.past.ago(other.age).map(|then| then - other.said).filter(|x| x.is_finite());
        Demand::Rate(reference.v_l - self.law.k * neighbours.iter().filter_map(ahead).sum::<f64>())
    }

    fn advance(&mut self, dt: f64) {
        self.past.now += dt;
    }
}

/// Where a vehicle was, for as long as it remembers.
#[derive(Debug, Default)]
struct Past {
    /// Time since the vehicle began \[s\].
    now: f64,
    /// Instants and places, the newest last.
    places: VecDeque<(f64, f64)>,
}

impl Past {
    fn keep(&mut self, xi: f64, longest: f64) {
        // One place beyond the memory's end, to interpolate from.
        while self.places.len() >= MOST_REMEMBERED
            || self.places.get(1).is_some_and(|(at, _)| *at <= self.now - longest)
        {
            self.places.pop_front();
        }
        self.places.push_back((self.now, xi));
    }

    /// Where it was `age` seconds ago, on the straight line between the places before and after; `None` if that is not
    /// remembered. What comes from the future is of now.
    fn ago(&self, age: f64) -> Option<f64> {
        const ROUNDING: f64 = 1e-6;
        let at = (self.now - age).min(self.now);
        let after = self.places.partition_point(|(t, _)| *t < at);
        let &(t_1, xi_1) = self.places.get(after)?;
        let Some(&(t_0, xi_0)) = after.checked_sub(1).and_then(|before| self.places.get(before)) else {
            return (t_1 - at <= ROUNDING).then_some(xi_1);
        };
        Some(xi_0 + (xi_1 - xi_0) * ((at - t_0) / (t_1 - t_0)))
    }
}

#[cfg(test)]
mod tests {
    use super::{KnownDelay, MOST_REMEMBERED, Past};
    use crate::coordination::delayed_4_34::Delayed;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference};
    use std::f64::consts::FRAC_PI_2;

    const V_L: f64 = 0.5;

    /// Flies `law` on directed links (receiver, sender, delay in steps of `dt`) for `steps`: spread at the end, and speeds.
    fn fly(
        law: &dyn FleetLaw,
        start: &[f64],
        links: &[(usize, usize, usize)],
        dt: f64,
        steps: usize,
    ) -> (f64, Vec<f64>) {
        let mut laws: Vec<_> = (0..start.len()).map(|i| law.vehicle(i)).collect();
        let mut past = vec![start.to_vec()];
        let mut rates = Vec::new();
        for step in 0..steps {
            let now = past[step].clone();
            rates = (0..start.len())
                .map(|i| {
                    let heard: Vec<Neighbour> = links
                        .iter()
                        .filter(|(to, _, late)| *to == i && *late <= step)
                        .map(|&(_, vehicle, late)| {
                            let said = past[step - late][vehicle];
                            Neighbour { vehicle, xi: said, said, age: late as f64 * dt, scalar: 0.0 }
                        })
                        .collect();
                    let own = Own { xi: now[i], r: 1.0, ..Own::default() };
                    match laws[i].demand(SpeedReference { v_l: V_L, v_l_dot: 0.0 }, &own, &heard) {
                        Demand::Rate(rate) => rate,
                        other => panic!("{other:?}"),
                    }
                })
                .collect();
            past.push(now.iter().zip(&rates).map(|(xi, rate)| xi + dt * rate).collect());
            laws.iter_mut().for_each(|law| law.advance(dt));
        }
        let end = &past[steps];
        let spread = end.iter().copied().fold(f64::MIN, f64::max) - end.iter().copied().fold(f64::MAX, f64::min);
        (spread, rates)
    }

    #[test]
    fn with_a_delay_of_its_own_on_every_link_the_fleet_agrees_at_v_l() {
        // Links one way and the other differ too: 1, 2.5, 4 and 5 s.
        let links = [(0, 1, 20), (1, 0, 50), (1, 2, 80), (2, 1, 100)];
        let (spread, speeds) = fly(&KnownDelay::new(0.05, 10.0).unwrap(), &[10.0, 4.0, 0.0], &links, 0.05, 20_000);
        assert!(spread < 1e-6, "{spread}");
        assert!(speeds.iter().all(|speed| (speed - V_L).abs() < 1e-6), "{speeds:?}");
        // Where (4.34) is slower.
        let links = [(0, 1, 100), (1, 0, 100)];
        let (_, speeds) = fly(&Delayed::new(0.1).unwrap(), &[4.0, 0.0], &links, 0.05, 20_000);
        assert!((speeds[0] - V_L / 1.5).abs() < 1e-3, "{speeds:?}");
    }

    #[test]
    fn a_pair_agrees_just_inside_the_bound_and_not_outside() {
        // Two links of 1 s: λ_max = 2. Euler steps of dt hold the demand, which is half a step more of delay.
        let pair = |part: f64| {
            let k = part * FRAC_PI_2 / (2.0 * 1.0);
            fly(&KnownDelay::new(k, 2.0).unwrap(), &[1.0, 0.0], &[(0, 1, 500), (1, 0, 500)], 0.002, 40_000).0
        };
        assert!(pair(0.9) < 0.01 && pair(1.1) > 10.0, "{} {}", pair(0.9), pair(1.1));
    }

    #[test]
    fn the_law_at_a_point() {
        let mut law = KnownDelay::new(0.1, 10.0).unwrap().vehicle(0);
        let reference = SpeedReference { v_l: V_L, v_l_dot: 0.0 };
        let own = |xi| Own { xi, r: 1.0, ..Own::default() };
        assert_eq!(law.demand(reference, &own(3.0), &[]), Demand::Rate(V_L), "alone");
        law.advance(2.0);
        // A second ago it was at 3.5, and the neighbour said that it was at 2.5 then.
        let other = Neighbour { said: 2.5, xi: 99.0, age: 1.0, ..Neighbour::default() };
        assert_eq!(law.demand(reference, &own(4.0), &[other]), Demand::Rate(V_L - 0.1));
        // Before it began it was nowhere; what is no number was not heard.
        for strange in [Neighbour { age: 5.0, ..other }, Neighbour { said: f64::NAN, ..other }] {
            assert_eq!(law.demand(reference, &own(4.0), &[strange]), Demand::Rate(V_L));
        }
        assert!(KnownDelay::new(0.0, 1.0).is_err() && KnownDelay::new(0.1, 0.0).is_err());
    }

    #[test]
    fn memory_is_bounded() {
        let mut past = Past::default();
        for step in 0..5_000 {
            past.now = f64::from(step) * 0.1;
            past.keep(past.now * 2.0, 10.0);
        }
        assert!(past.places.len() <= 102, "{}", past.places.len());
        assert!((past.ago(10.0).expect("remembered") - 2.0 * (past.now - 10.0)).abs() < 1e-9);
        assert_eq!(past.ago(10.3), None);
        assert_eq!(past.ago(-1.0), Some(2.0 * past.now));
    }

    #[test]
    fn what_is_remembered_has_an_end_however_long_the_memory() {
        let mut past = Past::default();
        for period in 0..MOST_REMEMBERED + 10 {
            past.now = period as f64;
            past.keep(0.5 * period as f64, f64::INFINITY);
            assert!(past.places.len() <= MOST_REMEMBERED);
        }
        assert_eq!(
            (past.ago(0.5), past.ago(MOST_REMEMBERED as f64)),
            (Some(0.5 * (MOST_REMEMBERED as f64 + 8.5)), None)
        );
    }

    #[test]
    fn every_neighbour_is_compared_with_its_own_instant() {
        // Where it was 0.5 s and 1 s ago, at 0.5 per second: v_r = v_L − 0.2((0.75 − 0.7) + (0.5 − 0.2)).
        let mut one = KnownDelay::new(0.2, 10.0).unwrap().vehicle(0);
        let reference = SpeedReference { v_l: V_L, v_l_dot: 0.0 };
        let at = |xi: f64| Own { xi, ..Own::default() };
        for step in 0..20 {
            one.demand(reference, &at(0.05 * f64::from(step)), &[]);
            one.advance(0.1);
        }
        let heard =
            [(0.7, 0.5), (0.2, 1.0)].map(|(said, age)| Neighbour { said, age, xi: 99.0, ..Neighbour::default() });
        let Demand::Rate(asked) = one.demand(reference, &at(1.0), &heard) else { panic!() };
        assert!((asked - (V_L - 0.2 * 0.35)).abs() < 1e-12, "{asked}");
    }
}
