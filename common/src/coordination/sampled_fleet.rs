//! A fleet of any size and graph on ideal paths, under a law that may have states and differ from vehicle to vehicle. As in
//! flight, demands are held between control periods.

use nalgebra::Complex;
use proptest::prelude::*;

use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::graph::Graph;

/// See the module's head. R_i is constant and d_i = 0.
#[derive(Debug)]
pub(super) struct SampledFleet {
    laws: Vec<Box<dyn VehicleLaw>>,
    kind: DemandKind,
    pub(super) graph: Graph,
    pub(super) r: Vec<f64>,
    /// ξ_i, the pattern not removed.
    pub(super) xi: Vec<f64>,
    /// v_i, of laws that give accelerations.
    pub(super) v: Vec<f64>,
    /// ξ̇_i over the last control period, at its end.
    pub(super) rate: Vec<f64>,
    /// v_L, beside what `reference` gives.
    pub(super) v_l: f64,
    pub(super) reference: fn(f64) -> SpeedReference,
    /// Constant h_i, beside what `pattern` gives.
    pub(super) offset: Vec<f64>,
    /// h_i, h_i' and h_i'' at an instant.
    pub(super) pattern: fn(usize, f64) -> [f64; 3],
    pub(super) alpha_2: Vec<f64>,
    t: f64,
}

impl SampledFleet {
    pub(super) fn new(law: &dyn FleetLaw, graph: &Graph, xi: &[f64]) -> SampledFleet {
        let n = xi.len();
        SampledFleet {
            laws: (0..n).map(|i| law.vehicle(i)).collect(),
            kind: law.kind(),
            graph: graph.clone(),
            r: vec![1.0; n],
            xi: xi.to_vec(),
            v: vec![0.0; n],
            rate: vec![0.0; n],
            v_l: 0.0,
            reference: |_| SpeedReference::default(),
            offset: vec![0.0; n],
            pattern: |_, _| [0.0; 3],
            alpha_2: vec![0.0; n],
            t: 0.0,
        }
    }

    /// All travel at v_L at the start.
    pub(super) fn with_v_l(self, v_l: f64) -> SampledFleet {
        let v = self.r.iter().map(|r| r * v_l).collect();
        SampledFleet { v_l, v, ..self }
    }

    pub(super) fn with_r(self, r: &[f64]) -> SampledFleet {
        let v = r.iter().map(|r| r * self.v_l).collect();
        SampledFleet { r: r.to_vec(), v, ..self }
    }

    fn reference_now(&self) -> SpeedReference {
        let more = (self.reference)(self.t);
        SpeedReference { v_l: self.v_l + more.v_l, v_l_dot: more.v_l_dot }
    }

    /// ξ_i − h_i
    fn about_the_pattern(&self) -> Vec<f64> {
        let h = |i| self.offset[i] + (self.pattern)(i, self.t)[0];
        (0..self.xi.len()).map(|i| self.xi[i] - h(i)).collect()
    }

    fn own(&self, i: usize) -> Own {
        let [h, h_dot, h_ddot] = (self.pattern)(i, self.t);
        Own {
            xi: self.xi[i] - self.offset[i] - h,
            eta: match self.kind {
                DemandKind::Rate => 0.0,
                DemandKind::Acceleration => self.v[i] - self.r[i] * self.reference_now().v_l,
            },
            r: self.r[i],
            v: self.v[i],
            r_dot: 0.0,
            h_dot,
            h_ddot,
            alpha_2: self.alpha_2[i],
        }
    }

    /// What the laws ask of each vehicle now.
    pub(super) fn demands(&mut self) -> Vec<f64> {
        let reference = self.reference_now();
        let own: Vec<Own> = (0..self.xi.len()).map(|i| self.own(i)).collect();
        let said: Vec<Neighbour> = (0..own.len())
            .map(|j| {
                let scalar = self.laws[j].says(&own[j]).unwrap_or(0.0);
                Neighbour { vehicle: j, xi: own[j].xi, scalar, said: own[j].xi, age: 0.0 }
            })
            .collect();
        let mut demands = Vec::with_capacity(own.len());
        for (i, own) in own.iter().enumerate() {
            let heard: Vec<Neighbour> = self.graph.neighbours(i).map(|j| said[j]).collect();
            demands.push(demand_of(self.laws[i].as_mut(), reference, own, &heard));
        }
        demands
    }

    /// Runs for `seconds` in control periods of `dt`.
    pub(super) fn run(&mut self, seconds: f64, dt: f64) {
        for _ in 0..(seconds / dt).round() as usize {
            let demands = self.demands();
            let r_v_l_dot = self.reference_now().v_l_dot;
            for (i, demand) in demands.into_iter().enumerate() {
                match self.kind {
                    DemandKind::Rate => {
                        self.rate[i] = demand;
                        self.xi[i] += demand * dt;
                    }
                    DemandKind::Acceleration => {
                        let v_dot = demand + self.r[i] * r_v_l_dot;
                        self.xi[i] += (self.v[i] + 0.5 * v_dot * dt) * dt / self.r[i];
                        self.v[i] += v_dot * dt;
                        self.rate[i] = self.v[i] / self.r[i];
                    }
                }
            }
            self.laws.iter_mut().for_each(|law| law.advance(dt));
            self.t += dt;
        }
    }

    /// Largest ξ − h less smallest.
    pub(super) fn spread(&self) -> f64 {
        let x = self.about_the_pattern();
        x.iter().copied().fold(f64::MIN, f64::max) - x.iter().copied().fold(f64::MAX, f64::min)
    }

    /// ‖ξ − h − mean‖
    pub(super) fn size(&self) -> f64 {
        let x = self.about_the_pattern();
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        x.iter().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt()
    }
}

/// The number that a law asks for.
pub(super) fn demand_of(
    law: &mut dyn VehicleLaw,
    reference: SpeedReference,
    own: &Own,
    neighbours: &[Neighbour],
) -> f64 {
    match law.demand(reference, own, neighbours) {
        Demand::Rate(value) | Demand::Acceleration(value) | Demand::Forward(value) => value,
    }
}

/// Two to five vertices with two-way links, connected.
pub(super) fn any_connected() -> impl Strategy<Value = Graph> {
    (2usize..6, prop::array::uniform4(0usize..4), 0u32..1024).prop_map(|(n, parents, more)| {
        let tree = (1..n).map(|i| (i, parents[i - 1] % i));
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        let extra = pairs.enumerate().filter(|(bit, _)| more >> bit & 1 == 1).map(|(_, pair)| pair);
        Graph::from_edges(n, &tree.chain(extra).collect::<Vec<_>>())
    })
}

/// Two to five vertices with one-way links, of which at least one is globally reachable.
pub(super) fn any_digraph() -> impl Strategy<Value = Graph> {
    (2usize..6, 0u32..1 << 20)
        .prop_map(|(n, bits)| {
            let pairs = (0..n).flat_map(|i| (0..n).filter(move |j| *j != i).map(move |j| (i, j)));
            let arcs = pairs.enumerate().filter(|(bit, _)| bits >> bit & 1 == 1).map(|(_, pair)| pair);
            Graph::from_arcs(n, &arcs.collect::<Vec<_>>())
        })
        .prop_filter("nobody is heard by all", Graph::can_agree)
}

/// The largest real part of the roots of s² + p s + q, over the \[p, q\] of each μ.
pub(super) fn slowest_root(mu: &[Complex<f64>], of: impl Fn(Complex<f64>) -> [Complex<f64>; 2]) -> f64 {
    let largest = |mu: &Complex<f64>| {
        let [p, q] = of(*mu);
        let root = (p * p - q * 4.0).sqrt();
        ((-p + root) * 0.5).re.max(((-p - root) * 0.5).re)
    };
    mu.iter().map(largest).fold(f64::NEG_INFINITY, f64::max)
}
