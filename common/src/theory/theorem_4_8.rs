//! Theorem 4.8 with a rate: path following and coordination that share a Lyapunov function, (4.59)–(4.61).
//!
//! The theorem says that errors decay exponentially into a ball that δ sets, and gives neither the rate nor the ball. Here are
//! both, and for equal vehicles on straight lines the exact rate at which coordination errors vanish, δ or not. The network is fixed,
//! two-way and connected, v_L is constant, all vehicles have the same a_1 and a_2.
//!
//! # Into the ball, from everywhere ([`Coupled`])
//!
//! Let x collect (√L)γ, z, and of every vehicle e, Mφ and √J z_2, so that 2V_c = |x|². Erratum 4.15 says
//!
//! ```text
//! V_c' = −a_1|η|² − a_2|z|² − Σ(k_e e'M⁻¹e + k_φ φ'Mφ + k_z|z_2|²) + Σe'δ,    a_1η = a_1z − Lγ − α_2
//! ```
//!
//! There is no term in γ alone, but η is one: it holds Lγ. By (4.46) |α_2i| ≤ s|e_i| + b|Mφ_i| with s = |p'| and
//! b = |v_n|m|p''| + k_e|p'| at their largest, so α_2 = s u + b w with |u_i| ≤ |e_i|, |w_i| ≤ |Mφ_i|. For any μ up to k_e/m and k_φ/m,
//! replacing e by u and Mφ by w in −V_c' − 2μV_c makes it no larger; what is left falls apart along the eigenvectors of L, and for
//! each eigenvalue λ is x'(Q(λ) − μI)x in x = (√λγ, z, u, w) with
//!
//! ```text
//! Q(λ) = a_1cc' + diag(0, a_2, k_e/m, k_φ/m),    c = (√λ/a_1, −1, s/a_1, b/a_1)
//! ```
//!
//! Q(λ) is positive definite for λ > 0 (its determinant is a_2 λ k_ek_φ/(a_1m²)). With μ the least eigenvalue of all Q(λ), λ ≠ 0, and no more than
//! k_z/j, therefore V_c' ≤ −2μV_c + Σe'δ. The mode of λ = 0 has no γ, and asks for no more: its block is a part of Q(λ), whose least
//! eigenvalue is no smaller (Cauchy). And μ ≤ k_e/m, k_φ/m, for a matrix of rank one lifts the least eigenvalue at most to the second (Weyl).
//! With |δ| of all vehicles together,
//!
//! ```text
//! |x(t)| ≤ |x(0)| e^(−μt) + (|δ|/μ)(1 − e^(−μt)),    ‖γ~‖ ≤ |x|/√λ_2   ∎
//! ```
//!
//! In the end less is left. Let a part ε of −k_e e'M⁻¹e bear δ, e_1δ_1 ≤ εk_e e_1²/m_11 + m_11δ_1²/(4εk_e), and μ_ε be the μ of (1 − ε)k_e:
//!
//! ```text
//! limsup |x|² ≤ Σ m_11δ_1²/k_e / (4 ε μ_ε)    for every ε in (0, 1)
//! ```
//!
//! # To zero, for equal vehicles on straight lines ([`OnALine`])
//!
//! A vehicle that starts on its line, points along it and moves along it stays there: nothing in Theorem 4.7 pushes it aside. With
//! p = m_11φ_1 what is left is linear,
//!
//! ```text
//! e' = (−k_e e + p)/m + δ_1 − sη,    p' = −(e + k_φ p)/m − k_e s η,    α_2 = −s e − k_e s p
//! γ' = v_L + η,    z' = −(a_1 + a_2)z + Lγ + α_2,    a_1η = a_1z − Lγ − α_2
//! ```
//!
//! and δ_1, the same for all, acts on the mean of the fleet only. The rest falls apart along the eigenvectors of L into B(λ) of size 4, and the
//! coordination error decays at the slowest root over λ ≠ 0: to zero, although δ ≠ 0. In the variables of Q the symmetric part of B(λ) is −Q(λ), so no
//! root is slower than μ. With α_2 = 0 the roots are those of s² + (λ/a_1 + a_1 + a_2)s + λa_2/a_1
//! ([`Dynamic::rate_on`](super::lemma_4_6::Dynamic::rate_on)); path following makes them slower or faster.
//!
//! A root says nothing of how large an error may grow before it decays. [`transient`] does: for a rate r below it, P with
//! (B + rI)'P + P(B + rI) = −W makes x'Px e^(2rt) fall, whence |x(t)| ≤ √cond(P) e^(−rt)|x(0)|, for every W > 0. W = Q(λ) is a good one: P is
//! then near I/2 where V_c by itself falls fast enough.

use nalgebra::{DMatrix, DVector, Matrix4, SymmetricEigen, Vector4};

use super::Underactuated;
use crate::graph::Graph;
use crate::graph::spectrum::{eigenvalues, symmetric_eigenvalues};

/// The fleet of Theorem 4.8, with the slowest path following and the strongest α_2 of any vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupled {
    /// a_1 \[1/s\], positive.
    pub a_1: f64,
    /// a_2 \[1/s\], positive.
    pub a_2: f64,
    /// k_e/m, k_φ/m and k_z/j at their least \[1/s\].
    pub decay: [f64; 3],
    /// s and b: by how much |e| and |Mφ| enter α_2 at most.
    pub pull: [f64; 2],
}

impl Coupled {
    /// Of the vehicles of a fleet; `None` if there is none, or if a gain, a mass or an inertia is not positive.
    pub fn new(a_1: f64, a_2: f64, vehicles: &[Underactuated]) -> Option<Coupled> {
        let (mut decay, mut pull) = ([f64::INFINITY; 3], [0.0f64; 2]);
        for vehicle in vehicles {
            let ([k_e, k_phi, k_z, _], m) = (vehicle.gains, vehicle.mass.1);
            let own = [k_e / m, k_phi / m, k_z / vehicle.inertia.1];
            let b = vehicle.fastest.abs() * m * vehicle.bend + k_e * vehicle.stretch;
            decay = std::array::from_fn(|i| decay[i].min(own[i]));
            pull = [pull[0].max(vehicle.stretch), pull[1].max(b)];
        }
        let positive = decay.iter().chain([&a_1, &a_2]).all(|value| *value > 0.0 && value.is_finite());
        let known = pull.iter().all(|value| value.is_finite());
        (positive && known && !vehicles.is_empty()).then_some(Coupled { a_1, a_2, decay, pull })
    }

    /// Q(λ) of the module's head.
    fn dissipation(&self, lambda: f64) -> Matrix4<f64> {
        let Coupled { a_1, a_2, decay, pull } = *self;
        let c = Vector4::new(lambda.sqrt(), -a_1, pull[0], pull[1]) / a_1;
        a_1 * c * c.transpose() + Matrix4::from_diagonal(&Vector4::new(0.0, a_2, decay[0], decay[1]))
    }

    /// μ: √V_c, that is every error of the fleet, decays at least at this rate into the ball \[1/s\]. `None` if the graph has one-way links or
    /// is not connected.
    #[doc(alias = "μ")]
    pub fn rate(&self, graph: &Graph) -> Option<f64> {
        let least = |lambda: &f64| self.dissipation(*lambda).symmetric_eigenvalues().min();
        let coupled = modes(graph)?.iter().map(least).min_by(f64::total_cmp)?;
        Some(coupled.min(self.decay[2])).filter(|rate| *rate > 0.0)
    }

    /// The radius |δ|/μ of the ball into which |x| decays at [`Coupled::rate`], `delta` being |δ| of all vehicles together \[m/s\].
    pub fn ball(&self, graph: &Graph, delta: f64) -> Option<f64> {
        Some(delta.abs() / self.rate(graph)?)
    }

    /// ‖γ~‖ at most, `t` seconds after |x| was `start`.
    pub fn apart_after(&self, graph: &Graph, delta: f64, start: f64, t: f64) -> Option<f64> {
        let decay = (-self.rate(graph)? * t).exp();
        Some((start * decay + self.ball(graph, delta)? * (1.0 - decay)) / modes(graph)?.first()?.sqrt())
    }

    /// |x| in the end at most; `pushed` is the sum of m_11δ_1²/k_e over the vehicles.
    pub fn in_the_end(&self, graph: &Graph, pushed: f64) -> Option<f64> {
        const STEPS: u32 = 50;
        let with = |step: u32| {
            let part = f64::from(step) / f64::from(STEPS);
            let mut left = *self;
            left.decay[0] *= 1.0 - part;
            Some(pushed.max(0.0) / (4.0 * part * left.rate(graph)?))
        };
        (1..STEPS).filter_map(with).min_by(f64::total_cmp).map(f64::sqrt)
    }

    /// ‖γ~‖ in the end at most.
    pub fn apart_in_the_end(&self, graph: &Graph, pushed: f64) -> Option<f64> {
        Some(self.in_the_end(graph, pushed)? / modes(graph)?.first()?.sqrt())
    }
}

/// What the motion of a vehicle along a straight line depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnALine {
    /// m_11 \[t\], positive.
    pub mass: f64,
    /// k_e \[t/s\], positive.
    pub k_e: f64,
    /// k_φ \[t/s\], positive.
    #[doc(alias = "k_φ")]
    pub k_phi: f64,
    /// |p'| \[m per unit of γ\].
    pub stretch: f64,
}

impl OnALine {
    /// B(λ) of the module's head, of (√λγ, z, e, p) for λ > 0: in these variables its symmetric part is −Q(λ).
    fn block(&self, a_1: f64, a_2: f64, lambda: f64) -> DMatrix<f64> {
        let OnALine { mass: m, k_e, k_phi, stretch: s } = *self;
        // Rows of Lγ + α_2 and of η.
        let driven = Vector4::new(lambda.sqrt(), 0.0, -s, -k_e * s).transpose();
        let eta = Vector4::new(0.0, 1.0, 0.0, 0.0).transpose() - driven / a_1;
        let gamma = lambda.sqrt() * eta;
        let z = driven + Vector4::new(0.0, -(a_1 + a_2), 0.0, 0.0).transpose();
        let e = Vector4::new(0.0, 0.0, -k_e / m, 1.0 / m).transpose() - s * eta;
        let p = Vector4::new(0.0, 0.0, -1.0 / m, -k_phi / m).transpose() - k_e * s * eta;
        let rows = Matrix4::from_rows(&[gamma, z, e, p]);
        DMatrix::from_fn(4, 4, |i, j| rows[(i, j)])
    }

    /// The slowest root of a fleet of such vehicles, minus its real part \[1/s\], and how many roots of one B(λ) are there. `None` if the graph
    /// has one-way links or is not connected.
    pub fn slowest(&self, a_1: f64, a_2: f64, graph: &Graph) -> Option<(f64, usize)> {
        let slowest_of = |lambda: &f64| {
            let roots = eigenvalues(&self.block(a_1, a_2, *lambda))?;
            let last = *roots.last()?;
            let same = roots.iter().filter(|root| (*root - last).norm() <= 1e-4 * last.norm());
            Some((-last.re, same.count()))
        };
        let all: Option<Vec<(f64, usize)>> = modes(graph)?.iter().map(slowest_of).collect();
        all?.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// By how much |x| less its mean over the fleet can exceed its decay at `rate`, if that is below the slowest root.
    pub fn overshoot(&self, a_1: f64, a_2: f64, graph: &Graph, rate: f64) -> Option<f64> {
        let of_mode = |lambda: &f64| transient(&self.block(a_1, a_2, *lambda), rate);
        let all: Option<Vec<f64>> = modes(graph)?.iter().map(of_mode).collect();
        all?.into_iter().max_by(f64::total_cmp)
    }
}

/// c with |x(t)| ≤ c e^(−rate t)|x(0)| for x' = Ax, by the module's head, with W = −(A + A')/2 if that is positive definite, else I; `None`
/// unless every root of A is to the left of −`rate`.
pub fn transient(a: &DMatrix<f64>, rate: f64) -> Option<f64> {
    let n = a.nrows();
    let shifted = a + DMatrix::identity(n, n) * rate;
    if !eigenvalues(&shifted)?.iter().all(|root| root.re < 0.0) {
        return None;
    }
    // A'P + PA = −W as a system of n² equations.
    let identity = DMatrix::<f64>::identity(n, n);
    let lost = (a + a.transpose()) * -0.5;
    let weight = if lost.symmetric_eigenvalues().min() > 0.0 { lost } else { identity.clone() };
    let transposed = shifted.transpose();
    let system = identity.kronecker(&transposed) + transposed.kronecker(&identity);
    let right = DVector::from_iterator(n * n, weight.iter().map(|entry| -entry));
    let p = DMatrix::from_column_slice(n, n, system.lu().solve(&right)?.as_slice());
    let spectrum = SymmetricEigen::new((&p + p.transpose()) * 0.5).eigenvalues;
    Some((spectrum.max() / spectrum.min()).sqrt()).filter(|factor| factor.is_finite() && spectrum.min() > 0.0)
}

/// The eigenvalues of L other than that of the mean, ascending; `None` if the graph has one-way links or is not connected.
fn modes(graph: &Graph) -> Option<Vec<f64>> {
    (graph.len() > 1 && graph.is_undirected() && graph.is_connected())
        .then(|| symmetric_eigenvalues(&graph.laplacian()).split_off(1))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::coordination::auxiliary_4_59::Auxiliary;
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
    use crate::craft::Craft;
    use crate::craft::auv::AuvCraft;
    use crate::following::theorem_4_7::tests::Helix;
    use crate::following::theorem_4_7::{Gains, TargetMotion, TargetRate, Theorem47};
    use crate::path::Path;
    use crate::path::line::Line;
    use crate::random::Stream;
    use crate::theory::lemma_4_6::Dynamic;
    use crate::theory::linear_coordination::tests::connected_graph;
    use crate::theory::polynomial::abscissa;
    use crate::vehicle::auv::AuvState;
    use crate::vehicle::sirene::sirene;

    /// The vehicles of section 4.6 with the default gains.
    fn section_4_6() -> Underactuated {
        let stretch = Helix::stretch();
        let bend = Helix::section_4_6(0.0).at(0.0).d2.norm();
        Underactuated {
            mass: (4.7, 7.6),
            inertia: (2.2, 7.7),
            gains: [0.5, 1.0, 4.0, 1.0],
            fastest: 0.5,
            stretch,
            bend,
        }
    }

    #[test]
    fn two_vehicles_in_closed_form() {
        // λ = 2, a_1 = 1, a_2 = 3, m = k_e = 1, k_φ = 3, s = ½: (s + 1)(s + 2)(s² + 7.5s + 12).
        let line = OnALine { mass: 1.0, k_e: 1.0, k_phi: 3.0, stretch: 0.5 };
        let pair = Graph::complete(2);
        let (rate, times) = line.slowest(1.0, 3.0, &pair).expect("connected");
        assert!((rate - 1.0).abs() < 1e-9 && times == 1, "{rate}");
        // Without α_2 it is s² + 6s + 6.
        let alone = OnALine { stretch: 0.0, ..line }.slowest(1.0, 3.0, &pair).expect("connected").0;
        assert!((alone - (3.0 - 3f64.sqrt())).abs() < 1e-9, "{alone}");
        let dynamic = Dynamic::new(1.0, 3.0, std::slice::from_ref(&pair)).expect("positive");
        assert!((dynamic.rate_on(&pair).expect("connected") - alone).abs() < 1e-9);
    }

    #[test]
    fn no_rate_without_the_premises() {
        let line = OnALine { mass: 1.0, k_e: 1.0, k_phi: 3.0, stretch: 0.5 };
        let fleet = Coupled::new(10.0, 16.0, &[section_4_6()]).expect("positive");
        for graph in [Graph::empty(2), Graph::from_arcs(2, &[(0, 1)]), Graph::from_edges(4, &[(0, 1), (2, 3)])] {
            assert_eq!((fleet.rate(&graph), line.slowest(1.0, 3.0, &graph)), (None, None));
            assert_eq!((fleet.ball(&graph, 0.3), line.overshoot(1.0, 3.0, &graph, 0.0)), (None, None));
            assert_eq!((fleet.in_the_end(&graph, 1.0), fleet.apart_in_the_end(&graph, 1.0)), (None, None));
        }
        assert!(Coupled::new(0.0, 1.0, &[section_4_6()]).is_none() && Coupled::new(1.0, 1.0, &[]).is_none());
        let stuck = Underactuated { gains: [0.5, 0.0, 4.0, 1.0], ..section_4_6() };
        assert!(Coupled::new(1.0, 1.0, &[section_4_6(), stuck]).is_none());
        // Nor a bound at a rate that is not below the slowest root.
        assert!(line.overshoot(1.0, 3.0, &Graph::complete(2), 1.001).is_none());
        assert!(line.overshoot(1.0, 3.0, &Graph::complete(2), 0.999).is_some_and(|factor| factor >= 1.0));
    }

    #[test]
    fn a_turning_error_that_decays_slowly_is_the_slowest() {
        let lazy = Underactuated { gains: [0.5, 1.0, 0.01, 1.0], ..section_4_6() };
        let rate = |vehicle| Coupled::new(10.0, 16.0, &[vehicle]).and_then(|fleet| fleet.rate(&Graph::complete(3)));
        assert_eq!(rate(lazy), Some(0.01 / 7.7));
        assert!(rate(section_4_6()).is_some_and(|rate| rate > 0.01), "{:?}", rate(section_4_6()));
    }

    /// B(λ) by hand, as (z − the rest) of the loop 1 + (λ/s + G)(s + a_2)/(a_1(s + a_1 + a_2)) = 0, where α_2 = Gη and
    /// G = S²((1 + k_e²)s + (k_φ + k_e³)/m)/Δ, Δ = (s + k_e/m)(s + k_φ/m) + 1/m², S = |p'|.
    fn by_hand(line: &OnALine, a_1: f64, a_2: f64, lambda: f64) -> f64 {
        let OnALine { mass: m, k_e, k_phi, stretch } = *line;
        let delta = [1.0, (k_e + k_phi) / m, (k_e * k_phi + 1.0) / (m * m)];
        let s_2 = stretch * stretch;
        let n = [s_2 * (1.0 + k_e * k_e), s_2 * (k_phi + k_e.powi(3)) / m];
        // a_1 s(s + a_1 + a_2)Δ + (λΔ + s n)(s + a_2)
        let b = a_1 + a_2;
        let d = [lambda + n[0], lambda * delta[1] + n[1], lambda * delta[2]];
        let quartic = [
            a_1,
            a_1 * (delta[1] + b) + d[0],
            a_1 * (delta[2] + b * delta[1]) + d[1] + a_2 * d[0],
            a_1 * b * delta[2] + d[2] + a_2 * d[1],
            a_2 * d[2],
        ];
        -abscissa(&quartic).expect("a quartic")
    }

    fn any_line() -> impl Strategy<Value = OnALine> {
        (0.5..6.0f64, 0.2..3.0f64, 0.2..4.0f64, 0.0..2.0f64).prop_map(|(mass, k_e, k_phi, stretch)| OnALine {
            mass,
            k_e,
            k_phi,
            stretch,
        })
    }

    /// γ~ of a fleet.
    fn apart(gamma: &[f64]) -> f64 {
        let mean = gamma.iter().sum::<f64>() / gamma.len() as f64;
        gamma.iter().map(|gamma| (gamma - mean).powi(2)).sum::<f64>().sqrt()
    }

    /// A fleet of underactuated vehicles under (4.59), held for `DT`.
    struct Fleet {
        graph: Graph,
        laws: Vec<Box<dyn VehicleLaw>>,
        craft: Vec<AuvCraft>,
        paths: Vec<Arc<dyn Path>>,
        reference: SpeedReference,
    }

    const DT: f64 = 0.02;

    impl Fleet {
        fn new(
            graph: &Graph,
            a: [f64; 2],
            v_l: f64,
            starts: Vec<(Arc<dyn Path>, AuvState, f64)>,
            gains: Gains,
        ) -> Fleet {
            let law = Auxiliary::fixed(a[0], a[1]).expect("positive");
            let following = Theorem47::new(gains, sirene()).expect("valid gains");
            let paths = starts.iter().map(|start| start.0.clone()).collect();
            let craft = starts
                .into_iter()
                .map(|(path, state, gamma)| AuvCraft::new(following, TargetMotion::TypeII, 1.0, path, state, gamma))
                .collect();
            let laws = (0..graph.len()).map(|i| law.vehicle(i)).collect();
            Fleet { graph: graph.clone(), laws, craft, paths, reference: SpeedReference { v_l, v_l_dot: 0.0 } }
        }

        fn gamma(&self) -> Vec<f64> {
            self.craft.iter().map(|craft| craft.observe().xi).collect()
        }

        fn fly(&mut self, seconds: f64) {
            for _ in 0..(seconds / DT).round() as usize {
                let gamma = self.gamma();
                for i in 0..gamma.len() {
                    let own = self.craft[i].own(self.reference);
                    let heard: Vec<Neighbour> = (self.graph.neighbours(i))
                        .map(|j| Neighbour { vehicle: j, xi: gamma[j], ..Neighbour::default() })
                        .collect();
                    let demand = self.laws[i].demand(self.reference, &own, &heard);
                    self.craft[i].command(self.reference, demand);
                }
                for (law, craft) in self.laws.iter_mut().zip(&mut self.craft) {
                    law.advance(DT);
                    craft.advance(DT, 1);
                }
            }
        }

        /// z_i: what the law asks for when nothing drives it.
        fn z(&mut self, i: usize) -> f64 {
            match self.laws[i].demand(SpeedReference::default(), &Own::default(), &[]) {
                Demand::Rate(z) => z,
                other => panic!("{other:?}"),
            }
        }

        /// |x| of the module's head.
        fn size(&mut self) -> f64 {
            let gamma = DVector::from_vec(self.gamma());
            let mut squared = (gamma.transpose() * self.graph.laplacian() * &gamma)[0];
            for i in 0..gamma.len() {
                squared += self.z(i).powi(2);
                let craft = &self.craft[i];
                let v_l = self.reference.v_l;
                let rate = TargetRate { nominal: v_l, nominal_dot: 0.0, actual: v_l };
                let at = craft.law().evaluate(craft.state(), &self.paths[i].at(gamma[i]), rate);
                squared += 2.0 * craft.law().lyapunov(&at);
            }
            squared.sqrt()
        }
    }

    /// Vehicles on parallel lines, pointing and moving along them, ahead of their targets by `ahead`.
    fn on_lines(stretch: f64, gamma: &[f64], ahead: &[f64], speed: &[f64]) -> Vec<(Arc<dyn Path>, AuvState, f64)> {
        let of = |i: usize| {
            let start = Vector3::new(0.0, 5.0 * i as f64, -2.0);
            let line = Line::new(start, 0.0, stretch).expect("a line");
            let place = start + Vector3::new(stretch * gamma[i] + ahead[i], 0.0, 0.0);
            let mut state = AuvState::at_rest(place, UnitQuaternion::identity());
            state.velocity.x = speed[i];
            (Arc::new(line) as Arc<dyn Path>, state, gamma[i])
        };
        (0..gamma.len()).map(of).collect()
    }

    #[test]
    fn the_fleet_of_section_4_6_stays_below_the_bound() {
        // Far from its helices, in any attitude, at any speed: δ ≠ 0 leaves a ball, and |x| is never above the bound.
        let star = Graph::from_edges(3, &[(0, 1), (1, 2)]);
        let fleet = Coupled::new(10.0, 16.0, &[section_4_6()]).expect("positive");
        let rate = fleet.rate(&star).expect("connected");
        let ball = fleet.ball(&star, 0.3 * 3f64.sqrt()).expect("connected");
        let at_last = fleet.in_the_end(&star, 3.0 * 4.7 * 0.09 / 0.5).expect("connected");
        assert!(at_last < 0.7 * ball, "{at_last} {ball}");
        let mut stream = Stream::new(48, "Theorem 4.8");
        let mut tightest = f64::INFINITY;
        for _ in 0..6 {
            let starts = (0..3)
                .map(|i| {
                    let path = Helix::section_4_6(-5.0 * f64::from(i));
                    let gamma = stream.uniform(40.0, 100.0);
                    let place = path.at(gamma).p + Vector3::from_fn(|_, _| stream.uniform(-8.0, 8.0));
                    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, stream.uniform(-3.0, 3.0));
                    let mut state = AuvState::at_rest(place, turn);
                    state.velocity.x = stream.uniform(-0.2, 0.5);
                    (Arc::new(path) as Arc<dyn Path>, state, gamma)
                })
                .collect();
            let mut flight = Fleet::new(&star, [10.0, 16.0], 0.5, starts, Gains::default());
            let start = flight.size();
            let bound_of_apart = |t: f64| fleet.apart_after(&star, 0.3 * 3f64.sqrt(), start, t).expect("connected");
            for second in 1..=120 {
                flight.fly(1.0);
                let decay = (-rate * f64::from(second)).exp();
                let (size, bound) = (flight.size(), start * decay + ball * (1.0 - decay));
                // Holding the command costs a little.
                assert!(size < 1.01 * bound, "{second} s: {size} {bound}");
                tightest = tightest.min(bound / size);
                assert!(apart(&flight.gamma()) < 1.01 * bound_of_apart(f64::from(second)));
            }
            flight.fly(80.0);
            let size = flight.size();
            // δ keeps |e| alone at 0.94 m.
            assert!(size < at_last && size > 0.9 * 3f64.sqrt(), "{size} {at_last}");
        }
        // Not so far above that a rate of twice the size would go unnoticed.
        assert!(tightest < 1.5, "{tightest}");
    }

    #[test]
    fn two_vehicles_on_lines_decay_at_just_that_rate() {
        let (pair, gains) = (Graph::complete(2), Gains::default());
        let line = OnALine { mass: 4.7, k_e: gains.k_e, k_phi: gains.k_phi, stretch: 1.0 };
        let (rate, _) = line.slowest(10.0, 6.0, &pair).expect("connected");
        let mut fleet =
            Fleet::new(&pair, [10.0, 6.0], 0.15, on_lines(1.0, &[2.0, 0.0], &[0.5, -0.5], &[0.0, 0.3]), gains);
        fleet.fly(6.0 / rate);
        let before = apart(&fleet.gamma());
        fleet.fly(6.0 / rate);
        let seen = (before / apart(&fleet.gamma())).ln() * rate / 6.0;
        assert!((seen / rate - 1.0).abs() < 0.01, "{seen} {rate}");
        // Without α_2 it would be another.
        let alone = OnALine { stretch: 0.0, ..line }.slowest(10.0, 6.0, &pair).expect("connected").0;
        assert!((alone / rate - 1.0).abs() > 0.05, "{alone} {rate}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_loop_loses_just_what_the_lyapunov_function_says(
            line in any_line(), a_1 in 0.3..8.0f64, a_2 in 0.3..8.0f64, lambda in 0.1..5.0f64,
        ) {
            let OnALine { mass: m, k_e, k_phi, stretch: s } = line;
            // α_2 = −s e − k_e s p: u and w with their signs.
            let fleet = Coupled { a_1, a_2, decay: [k_e / m, k_phi / m, 1.0], pull: [-s, -k_e * s] };
            let b = line.block(a_1, a_2, lambda);
            let symmetric = (&b + b.transpose()) * 0.5;
            let q = fleet.dissipation(lambda);
            let difference = DMatrix::from_fn(4, 4, |i, j| symmetric[(i, j)] + q[(i, j)]);
            prop_assert!(difference.norm() < 1e-12 * (1.0 + q.norm()), "{} {}", b, q);
        }

        #[test]
        fn the_slowest_root_is_that_of_the_loop_by_hand(
            line in any_line(), a_1 in 0.3..8.0f64, a_2 in 0.3..8.0f64, n in 2usize..6,
        ) {
            // The complete graph has λ = n only.
            let (rate, times) = line.slowest(a_1, a_2, &Graph::complete(n)).expect("connected");
            let expected = by_hand(&line, a_1, a_2, n as f64);
            prop_assert!(times > 1 || (rate - expected).abs() < 1e-6 * expected, "{} {}", rate, expected);
        }

        #[test]
        fn the_bound_from_everywhere_is_never_above_the_exact_rate(
            line in any_line(), a_1 in 0.3..8.0f64, a_2 in 0.3..8.0f64, graph in connected_graph(),
        ) {
            let OnALine { mass, k_e, k_phi, stretch } = line;
            let vehicle = Underactuated {
                mass: (mass, mass), inertia: (1.0, 1.0), gains: [k_e, k_phi, 50.0, 1.0], fastest: 1.0, stretch, bend: 0.0,
            };
            let anywhere = Coupled::new(a_1, a_2, &[vehicle]).and_then(|fleet| fleet.rate(&graph)).expect("positive");
            let exact = line.slowest(a_1, a_2, &graph).expect("connected").0;
            prop_assert!(anywhere > 0.0 && anywhere <= exact * (1.0 + 1e-6), "{} {}", anywhere, exact);
        }

        #[test]
        fn no_start_exceeds_the_transient(
            line in any_line(), a_1 in 0.3..8.0f64, a_2 in 0.3..8.0f64, graph in connected_graph(), part in 0.5..0.99f64,
            start in prop::array::uniform4(-1.0..1.0f64),
        ) {
            let rate = part * line.slowest(a_1, a_2, &graph).expect("connected").0;
            let factor = line.overshoot(a_1, a_2, &graph, rate).expect("below the root");
            let x = DVector::from_column_slice(&start);
            for lambda in modes(&graph).expect("connected") {
                let b = line.block(a_1, a_2, lambda);
                for t in [0.05, 0.3, 1.0, 3.0].map(|t| t / rate) {
                    let now = ((&b * t).exp() * &x).norm();
                    prop_assert!(now <= factor * (-rate * t).exp() * x.norm() * (1.0 + 1e-6) + 1e-12);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn vehicles_on_lines_agree_at_no_less_than_the_rate(
            graph in connected_graph(), a_1 in 1.0..6.0f64, a_2 in 1.0..8.0f64, stretch in 0.5..1.5f64, k_e in 0.3..1.5f64,
            gamma in prop::array::uniform5(-3.0..3.0f64), ahead in prop::array::uniform5(-2.0..2.0f64),
            speed in prop::array::uniform5(-0.1..0.4f64),
        ) {
            // δ ≠ 0, and still the errors vanish: at the slowest root, and below its bound.
            let n = graph.len();
            let gains = Gains { k_e, ..Gains::default() };
            let line = OnALine { mass: 4.7, k_e, k_phi: gains.k_phi, stretch };
            let (slowest, _) = line.slowest(a_1, a_2, &graph).expect("connected");
            let rate = 0.95 * slowest;
            let factor = line.overshoot(a_1, a_2, &graph, rate).expect("below the root");
            let starts = on_lines(stretch, &gamma[..n], &ahead[..n], &speed[..n]);
            let mut fleet = Fleet::new(&graph, [a_1, a_2], 0.15, starts, gains);
            // |x| less the mean of the fleet; φ = v − v_L s + k_e e/m − δ_1, of which the mean takes what is common.
            let p: Vec<f64> = (0..n).map(|i| 4.7 * speed[i] + k_e * ahead[i]).collect();
            let l = graph.laplacian();
            let states = DVector::from_column_slice(&gamma[..n]);
            let start = ((states.transpose() * l * &states)[0] + apart(&ahead[..n]).powi(2) + apart(&p).powi(2)).sqrt();
            let lambda_2 = modes(&graph).expect("connected")[0];
            let seconds = 20.0 / slowest;
            for part in 1..=20 {
                fleet.fly(seconds / 20.0);
                let t = seconds * f64::from(part) / 20.0;
                let bound = factor * (-rate * t).exp() * start / lambda_2.sqrt();
                let error = apart(&fleet.gamma());
                // Holding the command for 20 ms costs a little of the rate.
                prop_assert!(error <= bound * (0.01 * rate * t).exp() + 1e-9, "{} s: {} {}", t, error, bound);
            }
            for craft in &fleet.craft {
                prop_assert!(craft.observe().e_cross < 1e-9, "it stays on its line");
            }
        }
    }
}
