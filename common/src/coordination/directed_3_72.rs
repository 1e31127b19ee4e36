//! Coordination over one-way links (section 3.3.4), also about a fixed pattern (3.86).

use super::disagreement::Disagreement;
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// Solution II for one-way links: the coordination error is weighed by R_i instead of 1/R_i, so that stability depends on
/// the graph alone, not on the paths (Remark 3.12). Only ξ_j of the neighbours is needed (erratum 3.22).
///
/// With constant R_i it agrees if the graph has a globally reachable vertex and, over the non-zero eigenvalues μ of L,
/// a²/b > max Im(μ)²/Re(μ) (3.73), and no longer if the sign is turned: the closed loop has the roots of s² + as + bμ.
/// For ξ with a constant pattern removed the same law is (3.86).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directed {
    a: f64,
    b: f64,
}

impl Directed {
    /// `a` > 0 \[1/s\] damps the speed-tracking error; `b` > 0 \[1/s²\] weighs the coordination error; the same for all
    /// vehicles. Figure 3.10 has 2 and 1.
    pub fn new(a: f64, b: f64) -> Result<Directed, String> {
        Ok(Directed { a: positive("the gain a", a)?, b: positive("the gain b", b)? })
    }
}

impl CoordinationLaw for Directed {
    /// u = −Aη − BC⁻¹Lξ (3.72), of which row i is u_i = −a η_i − b R_i Σ (ξ_i − ξ_j) (3.74).
    fn demand(&self, _: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let ahead = Disagreement::among(own, neighbours).ahead;
        Demand::Acceleration(-self.a * own.eta - self.b * own.r * ahead)
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;
    use proptest::prelude::*;

    use super::Directed;
    use crate::coordination::ideal_fleet::assert_shift_invariant_and_ahead_slows_down as assert_sane;
    use crate::coordination::sampled_fleet::{SampledFleet, any_digraph, slowest_root};
    use crate::coordination::solution_2_3_44::SolutionTwo;
    use crate::coordination::{CoordinationLaw, Demand, FleetLaw, Neighbour, Own, SpeedReference};
    use crate::graph::Graph;
    use crate::graph::spectrum::eigenvalues;

    /// max Im(μ)²/Re(μ) over the non-zero eigenvalues of L, the right-hand side of (3.73), and these eigenvalues.
    fn condition_3_73(graph: &Graph) -> (f64, Vec<Complex<f64>>) {
        let mu = eigenvalues(&graph.laplacian()).expect("finite");
        let mu: Vec<_> = mu.into_iter().filter(|mu| mu.norm() > 1e-6).collect();
        (mu.iter().map(|mu| mu.im * mu.im / mu.re).fold(0.0, f64::max), mu)
    }

    /// Three that hear each other in a ring, (3.104): μ = 1.5 ± j0.866 (erratum 3.13).
    fn ring() -> Graph {
        Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)])
    }

    #[test]
    fn the_row_of_the_law_by_hand() {
        let heard = [
            Neighbour { xi: 1.0, scalar: 7.0, ..Neighbour::default() },
            Neighbour { xi: 2.5, scalar: 7.0, ..Neighbour::default() },
        ];
        let own = Own { xi: 2.0, eta: 1.0, r: 4.0, ..Own::default() };
        let u = Directed::new(2.0, 3.0).unwrap().demand(SpeedReference::default(), &own, &heard);
        assert_eq!(u, Demand::Acceleration(-2.0 - 3.0 * 4.0 * 0.5));
    }

    #[test]
    fn the_ring_of_figure_3_10_meets_the_condition() {
        let (least, mu) = condition_3_73(&ring());
        assert!((least - 0.5).abs() < 1e-12 && mu.len() == 2);
        assert!(mu.iter().all(|mu| (mu.re - 1.5).abs() < 1e-12 && (mu.im.abs() - 0.75f64.sqrt()).abs() < 1e-12));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_condition_is_sharp(
            graph in any_digraph(), b in 0.5..2.0f64, inside in 1.3..6.0f64, outside in 0.1..0.75f64,
            r in prop::array::uniform5(0.5..4.0f64), xi in prop::array::uniform5(-1.0..1.0f64),
        ) {
            let n = graph.len();
            let (least, mu) = condition_3_73(&graph);
            prop_assume!(xi[..n].iter().any(|x| (x - xi[0]).abs() > 0.1));
            let run = |a: f64, seconds: f64| {
                let law = Directed::new(a, b).unwrap();
                let mut fleet = SampledFleet::new(&law, &graph, &xi[..n]).with_v_l(0.1).with_r(&r[..n]);
                fleet.run(seconds, 0.005);
                fleet.size()
            };
            let start = SampledFleet::new(&Directed::new(1.0, b).unwrap(), &graph, &xi[..n]).size();
            // Inside: every difference decays, at the rate of the slowest root of s² + a s + b μ.
            let a = (inside * b * least).sqrt().max(0.5);
            let rate = -slowest_root(&mu, |mu| [Complex::from(a), mu * b]);
            prop_assert!(rate > 0.0);
            let seconds = (16.0 / rate).min(400.0);
            // A mode and those that equal eigenvalues tie to it start within a thousand times the start.
            let bound = 1e3 * (-0.85 * rate * seconds).exp();
            let end = run(a, seconds);
            prop_assert!(end < start * bound.max(1e-9), "{end} {start} {rate} {bound}");
            // Outside, where there is an outside: something grows.
            if least > 0.2 {
                let a = (outside * b * least).sqrt();
                let growth = slowest_root(&mu, |mu| [Complex::from(a), mu * b]);
                prop_assert!(growth > 0.0);
                if growth > 0.03 {
                    let seconds = 12.0 / growth;
                    prop_assert!(run(a, seconds) > 10.0 * run(a, 0.2 * seconds), "{graph:?} {growth}");
                }
            }
        }

        #[test]
        fn about_a_fixed_pattern_the_fleet_takes_it_3_86(h in prop::array::uniform3(-2.0..2.0f64)) {
            let law = Directed::new(2.0, 1.0).unwrap();
            let mut fleet = SampledFleet::new(&law, &ring(), &[0.0, 0.5, -0.5]).with_r(&[2.0, 3.0, 4.0]);
            fleet.offset = h.to_vec();
            fleet.run(60.0, 0.01);
            for i in 0..3 {
                let apart = fleet.xi[i] - fleet.xi[0] - (h[i] - h[0]);
                prop_assert!(apart.abs() < 1e-8, "{apart}");
            }
        }
    }

    #[test]
    fn solution_2_over_one_way_links_needs_another_gain_3_83() {
        // (3.85) with C = cI: a²/b > c² max Im(μ)²/Re(μ), 0.5 c² for the ring: it depends on the paths.
        let size = |r: f64, a: f64| {
            let law = SolutionTwo::new(a, 1.0).unwrap();
            let mut fleet = SampledFleet::new(&law, &ring(), &[0.0, 0.5, -0.5]).with_r(&[r; 3]);
            fleet.run(150.0, 0.005);
            fleet.size()
        };
        for r in [0.5, 2.0] {
            let least = (0.5f64).sqrt() / r;
            assert!(size(r, 1.3 * least) < 0.1 && size(r, 0.7 * least) > 3.0, "R = {r}");
        }
    }

    #[test]
    fn it_is_sane() {
        let law = Directed::new(1.0, 1.0).unwrap();
        assert_sane(&law);
        assert!(FleetLaw::says(&law, 0).is_none() && law.vehicle(0).says(&Own::default()).is_none());
        assert!(Directed::new(1.0, 0.0).is_err() && Directed::new(f64::INFINITY, 1.0).is_err());
    }
}
