//! A fleet of ideal integrators, (3.41) and (4.8) without disturbances, to try coordination laws on.

use super::{CoordinationLaw, Demand, Neighbour, Own, SpeedReference};

/// Vehicles 1-2-3-4 in a row, each hearing those beside it.
pub(super) const ROW_OF_FOUR: [&[usize]; 4] = [&[1], &[0, 2], &[1, 3], &[2]];
/// Section 4.6: vehicle 2 hears 1 and 3, which hear only it.
pub(super) const STAR: [&[usize]; 3] = [&[1], &[0, 2], &[1]];
/// Two that hear each other.
pub(super) const PAIR: [&[usize]; 2] = [&[1], &[0]];

/// ξ and η of every vehicle, and the derivatives of the same.
#[derive(Clone, Debug)]
pub(super) struct Fleet<const N: usize> {
    pub(super) xi: [f64; N],
    pub(super) eta: [f64; N],
}

impl<const N: usize> Fleet<N> {
    pub(super) fn at(xi: [f64; N]) -> Fleet<N> {
        Fleet { xi, eta: [0.0; N] }
    }

    /// self + scale · rate.
    pub(super) fn moved(&self, rate: &Fleet<N>, scale: f64) -> Fleet<N> {
        Fleet {
            xi: std::array::from_fn(|i| self.xi[i] + scale * rate.xi[i]),
            eta: std::array::from_fn(|i| self.eta[i] + scale * rate.eta[i]),
        }
    }

    /// Largest ξ less smallest.
    pub(super) fn spread(&self) -> f64 {
        let (low, high) = self.xi.iter().fold((f64::MAX, f64::MIN), |(low, high), &xi| (low.min(xi), high.max(xi)));
        high - low
    }
}

/// Who hears whom, and R of every path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Network<'a, const N: usize> {
    pub(super) hears: [&'a [usize]; N],
    pub(super) r: [f64; N],
    pub(super) v_l: f64,
}

impl<const N: usize> Network<'_, N> {
    /// Lx.
    pub(super) fn laplacian(&self, x: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| self.hears[i].iter().map(|&j| x[i] - x[j]).sum())
    }

    /// What the law asks of vehicle `i` when the others are heard as in `heard`.
    fn demand(&self, law: &dyn CoordinationLaw, i: usize, fleet: &Fleet<N>, heard: &Fleet<N>) -> Demand {
        let own = Own { xi: fleet.xi[i], eta: fleet.eta[i], r: self.r[i], ..Own::default() };
        let neighbours: Vec<Neighbour> = self.hears[i]
            .iter()
            .map(|&j| Neighbour {
                xi: heard.xi[j],
                scalar: heard.eta[j] / self.r[j],
                vehicle: j,
                ..Neighbour::default()
            })
            .collect();
        law.demand(SpeedReference { v_l: self.v_l, v_l_dot: 0.0 }, &own, &neighbours)
    }

    /// ξ̇ = Cη + v_L, η̇ = u (3.41), or ξ̇ = v_r (4.8).
    pub(super) fn rate(&self, law: &dyn CoordinationLaw, fleet: &Fleet<N>) -> Fleet<N> {
        let mut rate = Fleet::at([0.0; N]);
        for i in 0..N {
            match self.demand(law, i, fleet, fleet) {
                Demand::Rate(v_r) => rate.xi[i] = v_r,
                // With R and v_L constant, u = dη/dt = dv/dt.
                Demand::Acceleration(u) | Demand::Forward(u) => {
                    rate.xi[i] = fleet.eta[i] / self.r[i] + self.v_l;
                    rate.eta[i] = u;
                }
            }
        }
        rate
    }

    /// The fleet `seconds` later, by Runge-Kutta steps of `dt`.
    pub(super) fn run(&self, law: &dyn CoordinationLaw, mut fleet: Fleet<N>, seconds: f64, dt: f64) -> Fleet<N> {
        for _ in 0..(seconds / dt).round() as usize {
            let k1 = self.rate(law, &fleet);
            let k2 = self.rate(law, &fleet.moved(&k1, 0.5 * dt));
            let k3 = self.rate(law, &fleet.moved(&k2, 0.5 * dt));
            let k4 = self.rate(law, &fleet.moved(&k3, dt));
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                fleet = fleet.moved(&k, weight * dt / 6.0);
            }
        }
        fleet
    }

    /// The fleet `seconds` later when a law that gives rates hears the others `delay` seconds late, and its demand
    /// is held for `dt`; before the start everybody stood where it starts (erratum 4.23). Also the last rates.
    pub(super) fn run_delayed(
        &self,
        law: &dyn CoordinationLaw,
        fleet: Fleet<N>,
        seconds: f64,
        delay: f64,
        dt: f64,
    ) -> (Fleet<N>, [f64; N]) {
        run_delayed_with(fleet, seconds, delay, dt, |_, i, now, heard| self.v_r(law, i, now, heard))
    }

    /// v_r of vehicle `i` by a law that gives rates.
    pub(super) fn v_r(&self, law: &dyn CoordinationLaw, i: usize, now: &Fleet<N>, heard: &Fleet<N>) -> f64 {
        match self.demand(law, i, now, heard) {
            Demand::Rate(v_r) => v_r,
            Demand::Acceleration(_) | Demand::Forward(_) => panic!("the law does not give rates"),
        }
    }
}

/// [`Network::run_delayed`] with any rule for v_r from the time, the vehicle, and the fleet now and as heard.
pub(super) fn run_delayed_with<const N: usize>(
    fleet: Fleet<N>,
    seconds: f64,
    delay: f64,
    dt: f64,
    v_r: impl Fn(f64, usize, &Fleet<N>, &Fleet<N>) -> f64,
) -> (Fleet<N>, [f64; N]) {
    let late = (delay / dt).round() as usize;
    let mut past = vec![fleet];
    let mut rate = Fleet::at([0.0; N]);
    for step in 0..(seconds / dt).round() as usize {
        let (now, heard) = (&past[step], &past[step.saturating_sub(late)]);
        rate.xi = std::array::from_fn(|i| v_r(step as f64 * dt, i, now, heard));
        past.push(now.moved(&rate, dt));
    }
    (past[past.len() - 1].clone(), rate.xi)
}

/// The demands of vehicles at ξ and at ξ + `shift` are the same, and a vehicle ahead of all others is asked for less
/// than one behind all others: what every coordination law must satisfy.
pub(super) fn assert_shift_invariant_and_ahead_slows_down(law: &dyn CoordinationLaw) {
    let value = |demand| match demand {
        Demand::Rate(value) | Demand::Acceleration(value) | Demand::Forward(value) => value,
    };
    let reference = SpeedReference { v_l: 0.5, v_l_dot: 0.1 };
    // Values that binary fractions represent, so that the shift is exact.
    let demand = |own: f64, others: [f64; 2]| {
        let others = others.map(|xi| Neighbour { xi, scalar: 0.25, ..Neighbour::default() });
        value(law.demand(reference, &Own { xi: own, eta: 0.5, r: 2.0, ..Own::default() }, &others))
    };
    for shift in [0.0, -64.0, 1024.0] {
        assert_eq!(demand(2.0 + shift, [1.0 + shift, 1.5 + shift]), demand(2.0, [1.0, 1.5]));
    }
    assert!(demand(2.0, [1.0, 1.5]) < demand(2.0, [2.0, 2.0]), "ahead slows down");
    assert!(demand(1.0, [1.25, 1.5]) > demand(1.0, [1.0, 1.0]), "behind hurries");
    let strange = [Neighbour { xi: f64::NAN, scalar: f64::NAN, ..Neighbour::default() }];
    assert!(value(law.demand(reference, &Own { xi: 0.0, eta: 0.0, r: 0.0, ..Own::default() }, &strange)).is_finite());
}
