//! Proposition 3.6, Remark 3.13 and Proposition 3.7: one-way networks that do not change, R_i constant.
//!
//! | law | characteristic equation, μ ≠ 0 an eigenvalue of L | stable iff, for every μ |
//! |---|---|---|
//! | u = −aη − bC⁻¹Lξ (3.72) | λ² + aλ + bμ = 0 (3.79) | a²/b > Im²μ/Re μ (3.73) |
//! | u = −aη − bCLξ (3.83), C = cI | λ² + aλ + bc²μ = 0 | a²/b > c² Im²μ/Re μ (3.85) |
//! | F = −aC⁻¹LCv − bC⁻¹Lξ (3.92) | λ² + aμλ + bμ = 0 | a²/b > Im²μ/(Re μ \|μ\|²) (3.93) |
//!
//! The last is that of (3.94), the closed loop of (3.92).
//!
//! They are sharp: by Routh's criterion for complex coefficients, λ² + pλ + q is stable iff Re p > 0 and
//! (Re p)² Re q + Re p Im p Im q > (Im q)². On the border a pair of roots is on the imaginary axis.
//!
//! Remark 3.16 claims that the right side of (3.93) is never zero; two-way links or a chain make it zero (erratum
//! 3.15). Section 3.4.2 prints other eigenvalues and another condition than it means (erratum 3.13).

use nalgebra::Complex;

use super::Verdict;
use crate::graph::Graph;
use crate::graph::spectrum::eigenvalues;

/// Which of the three laws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DirectedLaw {
    /// (3.72).
    OverC,
    /// (3.83) with C = cI \[units of ξ per m\].
    TimesC(f64),
    /// (3.92): v_L known to a leader only. The graph is then that with the leader, 𝒢_{n+1}.
    Leader,
}

/// The eigenvalues μ ≠ 0 of a Laplacian; `None` if the graph cannot agree.
pub fn nonzero_spectrum(graph: &Graph, normalised: bool) -> Option<Vec<Complex<f64>>> {
    if !graph.can_agree() {
        return None;
    }
    let laplacian = if normalised { graph.normalised_laplacian() } else { graph.laplacian() };
    let mut spectrum = eigenvalues(&laplacian)?;
    let zero = (0..spectrum.len()).min_by(|&i, &j| spectrum[i].norm().total_cmp(&spectrum[j].norm()))?;
    spectrum.remove(zero);
    Some(spectrum)
}

impl DirectedLaw {
    /// The right side of the condition: what a²/b must exceed.
    pub fn threshold(self, spectrum: &[Complex<f64>]) -> f64 {
        let least = |mu: &Complex<f64>| match self {
            DirectedLaw::OverC => mu.im * mu.im / mu.re,
            DirectedLaw::TimesC(c) => c * c * mu.im * mu.im / mu.re,
            DirectedLaw::Leader => mu.im * mu.im / (mu.re * mu.norm_sqr()),
        };
        spectrum.iter().map(least).fold(0.0, f64::max)
    }

    /// Which equation the condition is.
    pub fn equation(self) -> &'static str {
        match self {
            DirectedLaw::OverC => "(3.73)",
            DirectedLaw::TimesC(_) => "(3.85)",
            DirectedLaw::Leader => "(3.93)",
        }
    }

    /// The upper half of the border that a²/b draws in the plane of μ, up to |μ| or Re μ of about `reach`: the condition holds iff all
    /// eigenvalues are to the right of it and of its mirror image.
    pub fn border(self, ratio: f64, reach: f64, points: u32) -> Vec<(f64, f64)> {
        let part = |i: u32| f64::from(i) / f64::from(points);
        match self {
            DirectedLaw::OverC | DirectedLaw::TimesC(_) => {
                let c = if let DirectedLaw::TimesC(c) = self { c } else { 1.0 };
                let at = |re: f64| (re, (ratio * re).sqrt() / c);
                // Close together where the curve is steep.
                (0..=points).map(|i| at(reach * part(i) * part(i))).collect()
            }
            // sin²φ = (a²/b) ρ cos φ for μ = ρe^{jφ}.
            DirectedLaw::Leader => (0..=points)
                .map(|i| std::f64::consts::FRAC_PI_2 * part(i))
                .map(|phi| (phi, phi.sin().powi(2) / (ratio * phi.cos())))
                .take_while(|(_, rho)| *rho <= reach)
                .map(|(phi, rho)| (rho * phi.cos(), rho * phi.sin()))
                .collect(),
        }
    }

    /// The two roots that belong to μ; for (3.72) that is (3.81).
    pub fn roots(self, a: f64, b: f64, mu: Complex<f64>) -> [Complex<f64>; 2] {
        let (p, q) = match self {
            DirectedLaw::OverC => (Complex::from(a), mu * b),
            DirectedLaw::TimesC(c) => (Complex::from(a), mu * (b * c * c)),
            DirectedLaw::Leader => (mu * a, mu * b),
        };
        let half = p * -0.5;
        let root = (half * half - q).sqrt();
        let larger = if (half + root).norm() >= (half - root).norm() { half + root } else { half - root };
        // Their product is q.
        [larger, if larger.norm() > 0.0 { q / larger } else { larger }]
    }

    /// The rate of the slowest mode \[1/s\], negative if it grows. For (3.72) and (3.83) the mean of η, which decays
    /// at a, counts as well.
    pub fn rate(self, a: f64, b: f64, spectrum: &[Complex<f64>]) -> f64 {
        let rates = spectrum.iter().flat_map(|&mu| self.roots(a, b, mu)).map(|root| -root.re);
        let mean = if self == DirectedLaw::Leader { f64::INFINITY } else { a };
        rates.fold(mean, f64::min)
    }

    /// What the proposition says of this fleet; `fixed`: the network never changes, and delays and loses nothing.
    pub fn verdict(self, graph: &Graph, normalised: bool, a: f64, b: f64, fixed: bool) -> Verdict {
        let equation = self.equation();
        let name = match self {
            DirectedLaw::OverC => "Proposition 3.6",
            DirectedLaw::TimesC(_) => "Remark 3.13",
            DirectedLaw::Leader => "Proposition 3.7",
        };
        let Some(spectrum) = nonzero_spectrum(graph, normalised) else {
            return Verdict {
                name,
                condition: format!("a globally reachable vertex, and a²/b {equation}"),
                value: "nobody is heard by all".to_owned(),
                holds: false,
                norm_rate: None,
            };
        };
        let threshold = self.threshold(&spectrum);
        let holds = a > 0.0 && b > 0.0 && a * a / b > threshold && fixed;
        Verdict {
            name,
            condition: format!("network fixed, without delay and loss; a²/b > {threshold:.5} {equation}"),
            value: format!(
                "a²/b = {:.5}{}",
                a * a / b,
                if fixed { "" } else { "; the network changes, delays or loses" }
            ),
            holds,
            norm_rate: holds.then(|| self.rate(a, b, &spectrum)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::linear_coordination::Law;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    fn cycle() -> Graph {
        Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)])
    }
    /// A leader, number 0, whom number 1 hears, before this graph.
    fn with_leader(graph: &Graph) -> Graph {
        let arcs: Vec<_> = graph.arcs().map(|(i, j)| (i + 1, j + 1)).chain([(1, 0)]).collect();
        Graph::from_arcs(graph.len() + 1, &arcs)
    }

    #[test]
    fn erratum_3_13_the_eigenvalues_of_section_3_4_2() {
        let spectrum = nonzero_spectrum(&cycle(), false).expect("everybody is heard by all");
        for (mu, im) in spectrum.iter().zip([-0.866_025_4, 0.866_025_4]) {
            assert!((mu.re - 1.5).abs() < 1e-9 && (mu.im - im).abs() < 1e-6, "{mu}");
        }
        assert!((DirectedLaw::OverC.threshold(&spectrum) - 0.5).abs() < 1e-9);
        assert!(DirectedLaw::OverC.verdict(&cycle(), false, 2.0, 1.0, true).holds, "4 > 0.5");
        assert!(!DirectedLaw::OverC.verdict(&cycle(), false, 2.0, 1.0, false).holds, "it must not change");
    }

    #[test]
    fn erratum_3_16_the_leader_of_a_cycle() {
        let threshold = |normalised| {
            DirectedLaw::Leader.threshold(&nonzero_spectrum(&with_leader(&cycle()), normalised).expect("the leader"))
        };
        assert!((threshold(true) - 0.139_56).abs() < 1e-4, "{}", threshold(true));
        assert!((threshold(false) - 0.0724).abs() < 1e-4, "{}", threshold(false));
    }

    #[test]
    fn erratum_3_15_two_way_links_and_chains_ask_for_nothing() {
        for graph in [Graph::complete(3), Graph::from_arcs(3, &[(1, 0), (2, 1)])] {
            let spectrum = nonzero_spectrum(&with_leader(&graph), false).expect("the leader is heard by all");
            assert!(DirectedLaw::Leader.threshold(&spectrum) < 1e-12);
        }
    }

    #[test]
    fn nobody_in_common_is_no_agreement() {
        let two_leaders = Graph::from_arcs(3, &[(1, 0), (1, 2)]);
        let answer = DirectedLaw::OverC.verdict(&two_leaders, false, 9.0, 1.0, true);
        assert_eq!((answer.holds, answer.norm_rate), (false, None));
        assert_eq!(nonzero_spectrum(&Graph::empty(0), false), None);
    }

    /// A one-way cycle and some more arcs: everybody is heard by all, and eigenvalues are complex.
    fn rooted_graph() -> impl Strategy<Value = Graph> {
        (3usize..6).prop_flat_map(|n| {
            prop::collection::vec((0..n, 0..n), 0..n).prop_map(move |more| {
                let arcs: Vec<_> = (0..n).map(|i| (i, (i + 1) % n)).chain(more).collect();
                Graph::from_arcs(n, &arcs)
            })
        })
    }

    /// The slowest mode of (3.89) with (3.92) in v and ξ, without the two zeros of the leader, who moves at v_L.
    fn rate_with_leader(graph: &Graph, a: f64, b: f64, r: &[f64]) -> f64 {
        let n = graph.len();
        let c = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 / r[i] } else { 0.0 });
        let inverse = DMatrix::from_fn(n, n, |i, j| if i == j { r[i] } else { 0.0 });
        let l = graph.laplacian();
        let mut closed = DMatrix::zeros(2 * n, 2 * n);
        closed.view_mut((0, 0), (n, n)).copy_from(&(&inverse * &l * &c * -a));
        closed.view_mut((0, n), (n, n)).copy_from(&(&inverse * &l * -b));
        closed.view_mut((n, 0), (n, n)).copy_from(&c);
        let mut found = eigenvalues(&closed).expect("it settles");
        found.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        found[2..].iter().map(|eigenvalue| -eigenvalue.re).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig { max_global_rejects: 10_000, ..ProptestConfig::with_cases(64) })]

        #[test]
        fn conditions_3_73_and_3_85_are_sharp(
            graph in rooted_graph(), b in 0.1..3.0f64, part in 1.02..3.0f64, c in 0.3..3.0f64,
            r in prop::collection::vec(0.3..3.0f64, 6),
        ) {
            let spectrum = nonzero_spectrum(&graph, false).expect("rooted");
            for (law, r) in [(DirectedLaw::OverC, r[..graph.len()].to_vec()), (DirectedLaw::TimesC(c), vec![1.0 / c; graph.len()])] {
                let threshold = law.threshold(&spectrum);
                prop_assume!(threshold > 1e-3);
                let loop_rate = |a: f64| {
                    let loop_ = match law {
                        DirectedLaw::OverC => Law::Directed { a, b },
                        _ => Law::SolutionTwo { a, b },
                    };
                    loop_.rate(&graph, &r).expect("rooted")
                };
                let (above, below) = ((threshold * b * part).sqrt(), (threshold * b / part).sqrt());
                prop_assert!(loop_rate(above) > 0.0 && loop_rate(below) < 0.0, "{} {}", loop_rate(above), loop_rate(below));
                prop_assert!(law.verdict(&graph, false, above, b, true).holds);
                prop_assert!(!law.verdict(&graph, false, below, b, true).holds);
                for a in [above, below] {
                    prop_assert!((law.rate(a, b, &spectrum) - loop_rate(a)).abs() < 1e-4, "{}", a);
                }
            }
        }

        #[test]
        fn condition_3_93_is_sharp(
            graph in rooted_graph(), b in 0.1..3.0f64, part in 1.05..3.0f64, r in prop::collection::vec(0.3..3.0f64, 6)
        ) {
            // The leader speaks to a vehicle that all others hear.
            let first = graph.globally_reachable()[0];
            let name = |i: usize| if i == first { 1 } else if i < first { i + 2 } else { i + 1 };
            let arcs: Vec<_> = graph.arcs().map(|(i, j)| (name(i), name(j))).chain([(1, 0)]).collect();
            let graph = Graph::from_arcs(graph.len() + 1, &arcs);
            let spectrum = nonzero_spectrum(&graph, false).expect("the leader");
            let law = DirectedLaw::Leader;
            let threshold = law.threshold(&spectrum);
            prop_assume!(threshold > 1e-2);
            let mut r = r[..graph.len()].to_vec();
            r[0] = 1.0;
            let (above, below) = ((threshold * b * part).sqrt(), (threshold * b / part).sqrt());
            prop_assert!(rate_with_leader(&graph, above, b, &r) > 0.0);
            prop_assert!(rate_with_leader(&graph, below, b, &r) < 0.0);
            prop_assert!((law.rate(above, b, &spectrum) - rate_with_leader(&graph, above, b, &r)).abs() < 1e-3);
        }

        #[test]
        fn on_the_border_the_condition_is_just_met(ratio in 0.1..5.0f64, c in 0.3..3.0f64) {
            for law in [DirectedLaw::OverC, DirectedLaw::TimesC(c), DirectedLaw::Leader] {
                let border = law.border(ratio, 3.0, 50);
                prop_assert!(border.len() > 3);
                for &(re, im) in border.iter().filter(|(re, im)| *re > 1e-9 && *im > 1e-9) {
                    let threshold = law.threshold(&[Complex::new(re, im)]);
                    prop_assert!((threshold - ratio).abs() < 1e-6 * ratio, "{:?} {} {}: {}", law, re, im, threshold);
                }
            }
        }

        #[test]
        fn routh_for_complex_coefficients(re in 0.05..3.0f64, im in -3.0..3.0f64, a in 0.05..3.0f64, b in 0.05..3.0f64) {
            let mu = Complex::new(re, im);
            for law in [DirectedLaw::OverC, DirectedLaw::TimesC(0.7), DirectedLaw::Leader] {
                let margin = a * a / b - law.threshold(&[mu]);
                prop_assume!(margin.abs() > 1e-6);
                let stable = law.roots(a, b, mu).iter().all(|root| root.re < 0.0);
                prop_assert_eq!(stable, margin > 0.0, "{:?} {}", law, mu);
            }
        }
    }

    #[test]
    fn gains_that_are_not_positive_promise_nothing() {
        // a²/b does not tell a from −a, and b = 0 makes it infinite.
        for (a, b) in [(-2.0, 1.0), (2.0, 0.0), (2.0, -1.0), (0.0, 1.0)] {
            let answer = DirectedLaw::OverC.verdict(&cycle(), false, a, b, true);
            assert_eq!((answer.holds, answer.norm_rate), (false, None), "{a} {b}");
        }
    }

    #[test]
    fn the_roots_of_one_mode_in_closed_form() {
        // λ² + aμλ + bμ at μ = 8: 4 ∓ √8, slower than nothing else, for the leader's loop has no mean of η that decays at a.
        let rate = DirectedLaw::Leader.rate(1.0, 1.0, &[Complex::from(8.0)]);
        assert!((rate - (4.0 - 8f64.sqrt())).abs() < 1e-12, "{rate}");
        // Who is alone has a mean of η only: it decays at a, unless the vehicle leads.
        assert_eq!(
            (DirectedLaw::OverC.rate(2.0, 1.0, &[]), DirectedLaw::Leader.rate(2.0, 1.0, &[])),
            (2.0, f64::INFINITY)
        );
        // Roots far apart: the small one, b/a, to all its digits.
        for a in [1e6, -1e6] {
            let [large, small] = DirectedLaw::OverC.roots(a, 1.0, Complex::from(1.0));
            assert!(
                (large.re / -a - 1.0).abs() < 1e-9 && (small.re * -a - 1.0 - 1e-12).abs() < 1e-15,
                "{large} {small}"
            );
        }
    }

    #[test]
    fn the_border_is_drawn_as_far_as_is_asked() {
        let border = DirectedLaw::OverC.border(2.0, 3.0, 10);
        assert_eq!((border.len(), border[0]), (11, (0.0, 0.0)));
        assert!((border[10].0 - 3.0).abs() < 1e-12 && (border[10].1 - 6f64.sqrt()).abs() < 1e-12);
        // Im²μ = 2 Re μ is steep at zero: its points go up in equal steps.
        assert!(border.windows(2).all(|pair| (pair[1].1 - pair[0].1 - 0.1 * 6f64.sqrt()).abs() < 1e-12));
        let furthest = |(re, im): &(f64, f64)| re.hypot(*im);
        let leader = DirectedLaw::Leader.border(1.0, 3.0, 400);
        assert!(leader.last().is_some_and(|last| (2.9..=3.0).contains(&furthest(last))), "{:?}", leader.last());
    }
}
