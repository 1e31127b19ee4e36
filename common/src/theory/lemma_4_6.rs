//! Lemmas 4.6 and 4.7, Theorems 4.8 and 4.9: the coordination law with a state of its own (4.62).
//!
//! Its errors obey x_c' = A_c(p)x_c with x_c = (θ, z), (4.63). For A_1 = a_1I, A_2 = a_2I, with Λ_p = M̄'L_pM̄ (Lemma 4.2) and
//! z split into its mean and the rest, A_c falls into Λ_p ⊗ I-shaped blocks: for each eigenvalue λ of Λ_p
//!
//! ```text
//! A(λ) = [ −λ/a_1      1         ]        and −(a_1 + a_2) for the mean of z.
//!        [  λ         −(a_1 + a_2) ]
//! ```
//!
//! # The LMI (4.65), without a solver of semidefinite programmes
//!
//! (4.65) asks for an X with A_cX + XA_c' ≤ −λ_cX for all connected graphs and ≤ λ_dX for all others. Take X = X̂ ⊗ I with a
//! 2 × 2 matrix X̂. As Λ_p is symmetric, (4.65) then says the same of A(λ) and X̂ for every eigenvalue λ; and as it is affine
//! in λ, of the smallest and the largest λ only: two conditions for the connected graphs, two for the others, in 2 × 2
//! matrices, with two unknowns. Those are searched on a grid that closes in; whatever it finds is checked, not trusted.
//!
//! Nothing is lost by this form of X if every graph on n vertices may occur: then the conditions do not change when
//! vehicles are renamed, so the mean of X over all renamings satisfies them too (they are convex), and a matrix that all
//! renamings leave alone has this form (the space of differences is irreducible under them). If only some graphs
//! occur, it is a sufficient form.
//!
//! The X of (4.66), diag(I, xI), is a special case that often fails (errata 4.19, 4.20).
//!
//! # λ_d = 0 can always be had
//!
//! For all gains a_1, a_2 > 0 and whatever graphs occur, V = |z + a_1θ|² + a_1a_2|θ|² never grows: with θ' = z − Λ_pθ/a_1 and
//! z' = Λ_pθ − (a_1 + a_2)z, (z + a_1θ)' = −a_2z, so that
//!
//! ```text
//! V' = −2a_2 z'(z + a_1θ) + 2a_1a_2 θ'(z − Λ_pθ/a_1) = −2a_2(|z|² + θ'Λ_pθ) ≤ 0
//! ```
//!
//! which is negative definite while the graph is connected (Λ_p > 0). The mean of z decays by itself. So (4.65) has a solution
//! with λ_d = 0 and λ_c > 0 ([`Dynamic::calm`]), and the condition of Lemma 4.7 is α < 1: Theorem 4.9 does not depend on the
//! gains. ∎ Another X may still promise a better rate.

use nalgebra::{Matrix2, SymmetricEigen};

use super::Verdict;
use super::polynomial::abscissa;
use crate::graph::Graph;
use crate::graph::spectrum::symmetric_eigenvalues;
use crate::time::Span;

/// Smallest and largest eigenvalue ≠ 0 of Laplacians, over the graphs that occur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectra {
    /// λ_c from below and above, over the connected graphs.
    pub connected: (f64, f64),
    /// The largest over the others; `None` if there are no others.
    pub disconnected: Option<f64>,
}

impl Spectra {
    /// Of the graphs that occur; `None` if none of them is connected, or one has one-way links.
    pub fn of(graphs: &[Graph]) -> Option<Spectra> {
        let (mut connected, mut disconnected) = ((f64::INFINITY, 0.0f64), None);
        for graph in graphs {
            if !graph.is_undirected() || graph.len() < 2 {
                return None;
            }
            let eigenvalues = symmetric_eigenvalues(&graph.laplacian());
            let (least, most) = (*eigenvalues.get(1)?, *eigenvalues.last()?);
            if graph.is_connected() {
                connected = (connected.0.min(least), connected.1.max(most));
            } else {
                disconnected = Some(most.max(disconnected.unwrap_or(0.0)));
            }
        }
        (connected.1 > 0.0).then_some(Spectra { connected, disconnected })
    }
}

/// λ_c and λ_d of (4.65), and the X̂ that shows them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate {
    /// λ_c: V decays at least at this rate while the graph is connected \[1/s\].
    pub lambda_c: f64,
    /// λ_d: V grows at most at this rate while it is not \[1/s\]; not negative.
    pub lambda_d: f64,
    /// X̂.
    pub x: Matrix2<f64>,
}

/// The gains of (4.62), the same for all vehicles, and the spectra of the graphs that occur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamic {
    /// a_1, positive.
    pub a_1: f64,
    /// a_2, positive.
    pub a_2: f64,
    /// Of the graphs that occur.
    pub spectra: Spectra,
}

/// Points of the grid along each side, and how often it closes in.
const GRID: (u32, u32) = (24, 30);

impl Dynamic {
    /// `None` if a gain is not positive and finite, or without a connected graph.
    pub fn new(a_1: f64, a_2: f64, graphs: &[Graph]) -> Option<Dynamic> {
        let positive = [a_1, a_2].iter().all(|&a| a > 0.0 && a.is_finite());
        Some(Dynamic { a_1, a_2, spectra: Spectra::of(graphs)? }).filter(|_| positive)
    }

    /// A(λ) above.
    pub fn block(&self, lambda: f64) -> Matrix2<f64> {
        Matrix2::new(-lambda / self.a_1, 1.0, lambda, -(self.a_1 + self.a_2))
    }

    /// The least μ with A(λ)X + XA(λ)' ≤ μX.
    fn growth(&self, lambda: f64, x: &Matrix2<f64>) -> f64 {
        let a = self.block(lambda);
        let s = a * x + x * a.transpose();
        // det(S − μX) = 0, a quadratic in μ with two real roots as X > 0.
        let det_x = x.determinant();
        let half = 0.5 * (s[(0, 0)] * x[(1, 1)] + s[(1, 1)] * x[(0, 0)] - 2.0 * s[(0, 1)] * x[(0, 1)]) / det_x;
        half + (half * half - s.determinant() / det_x).max(0.0).sqrt()
    }

    /// The best λ_c and λ_d that this X̂ shows; `None` if X̂ is not positive definite.
    pub fn certify(&self, x: &Matrix2<f64>) -> Option<Certificate> {
        if !(x[(0, 0)] > 0.0 && x.determinant() > 0.0) {
            return None;
        }
        let (least, most) = self.spectra.connected;
        let connected = self.growth(least, x).max(self.growth(most, x)).max(-2.0 * (self.a_1 + self.a_2));
        let others = self.spectra.disconnected.map(|most| self.growth(0.0, x).max(self.growth(most, x)));
        Some(Certificate { lambda_c: -connected, lambda_d: others.unwrap_or(0.0).max(0.0), x: *x })
    }

    /// The solution of (4.65) with λ_d = 0 that always exists: X̂ = [1, −a_1; −a_1, a_1(a_1 + a_2)], whose inverse is V above.
    pub fn calm(&self) -> Certificate {
        let x = Matrix2::new(1.0, -self.a_1, -self.a_1, self.a_1 * (self.a_1 + self.a_2));
        let (least, most) = self.spectra.connected;
        let connected = self.growth(least, &x).max(self.growth(most, &x)).max(-2.0 * (self.a_1 + self.a_2));
        Certificate { lambda_c: -connected, lambda_d: 0.0, x }
    }

    /// λ_c, λ_d and X of (4.66), as printed: they need not satisfy (4.65) (erratum 4.20).
    pub fn printed(&self) -> Certificate {
        let (least, most) = self.spectra.connected;
        let (a_1, a_2) = (self.a_1, self.a_2);
        let lambda_p = most * least / (most + least);
        let x = a_1 * a_1 * a_2 * (most + least) / ((a_1 + 2.0 * a_2) * (2.0 * a_1 * a_2 - lambda_p));
        let sum = a_1 + a_2;
        Certificate {
            lambda_c: lambda_p * (a_1 + 2.0 * a_2) / (2.0 * a_1 * a_2),
            lambda_d: (sum * sum + x).sqrt() - sum,
            x: Matrix2::new(1.0, 0.0, 0.0, x),
        }
    }

    /// Whether (4.66) satisfies (4.65).
    pub fn printed_holds(&self) -> bool {
        let printed = self.printed();
        self.certify(&printed.x).is_some_and(|true_| {
            true_.lambda_c >= printed.lambda_c - 1e-12 && true_.lambda_d <= printed.lambda_d + 1e-12
        })
    }

    /// The certificate with the largest λ_c among those with λ_d at most this; `None` if there is none with λ_c > 0.
    pub fn largest_lambda_c(&self, lambda_d: f64) -> Option<Certificate> {
        self.search(|certificate| {
            if certificate.lambda_d <= lambda_d { certificate.lambda_c } else { lambda_d - certificate.lambda_d - 1e3 }
        })
        .filter(|certificate| certificate.lambda_c > 0.0 && certificate.lambda_d <= lambda_d)
    }

    /// The certificate that promises most at a loss rate α: the largest (1 − α)λ_c − αλ_d of Lemma 4.7. `None` if
    /// there is none with λ_c > 0.
    pub fn best(&self, alpha: f64) -> Option<Certificate> {
        let calm = self.calm();
        let better = |found: &Certificate| found.lambda_c > 0.0 && found.rate_of_v(alpha) >= calm.rate_of_v(alpha);
        let found = self.search(|certificate| certificate.rate_of_v(alpha)).filter(better).unwrap_or(calm);
        Some(found).filter(|certificate| certificate.lambda_c > 0.0)
    }

    /// Grid search over X̂ = [1, ρ√x; ρ√x, x], in ln x and ρ.
    fn search(&self, value: impl Fn(&Certificate) -> f64) -> Option<Certificate> {
        let (points, rounds) = GRID;
        // x has the unit of a²: its logarithm around theirs.
        let (mut middle, mut half) = ((2.0 * (self.a_1 + self.a_2).ln(), 0.0), (12.0, 0.999_999));
        let mut best: Option<(f64, Certificate)> = None;
        for _ in 0..rounds {
            let mut at = middle;
            for i in 0..=points {
                for j in 0..=points {
                    let offset = |k: u32| 2.0 * f64::from(k) / f64::from(points) - 1.0;
                    let (ln_x, rho) = (middle.0 + half.0 * offset(i), middle.1 + half.1 * offset(j));
                    let x = ln_x.exp();
                    let y = rho * x.sqrt();
                    let Some(found) = self.certify(&Matrix2::new(1.0, y, y, x)) else { continue };
                    let worth = value(&found);
                    if worth.is_finite() && best.as_ref().is_none_or(|(known, _)| worth > *known) {
                        (best, at) = (Some((worth, found)), (ln_x, rho));
                    }
                }
            }
            middle = at;
            half = (half.0 * 0.5, half.1 * 0.5);
        }
        best.map(|(_, found)| found)
    }

    /// The exact rate on one connected graph that does not change \[1/s\], Theorem 4.8 with α_2 = 0: the slowest root of
    /// s² + (λ/a_1 + a_1 + a_2)s + λa_2/a_1 over its eigenvalues λ. `None` if the graph is not connected.
    pub fn rate_on(&self, graph: &Graph) -> Option<f64> {
        let spectra = Spectra::of(std::slice::from_ref(graph))?;
        spectra.disconnected.is_none().then_some(())?;
        symmetric_eigenvalues(&graph.laplacian())
            .iter()
            .skip(1)
            .filter_map(|lambda| {
                abscissa(&[1.0, lambda / self.a_1 + self.a_1 + self.a_2, lambda * self.a_2 / self.a_1])
            })
            .map(|slowest| -slowest)
            .min_by(f64::total_cmp)
    }

    /// What Lemma 4.7 says at a loss rate α, with the best certificate, and whether Theorem 4.9 is reached with these gains.
    pub fn verdict(&self, alpha: f64) -> Verdict {
        let best = self.best(alpha);
        let holds = best.is_some_and(|best| alpha < best.alpha_limit());
        Verdict {
            name: "Lemma 4.7 with (4.65) solved (Theorem 4.9)",
            condition: match best {
                Some(best) => format!(
                    "α < λ_c/(λ_c + λ_d) = {:.4}, with λ_c = {:.4}, λ_d = {:.4}",
                    best.alpha_limit(),
                    best.lambda_c,
                    best.lambda_d
                ),
                None => "λ_c > 0 and λ_d with (4.65)".to_owned(),
            },
            value: format!(
                "α = {alpha:.4}; the X of (4.66) {}",
                if self.printed_holds() { "would do too" } else { "does not satisfy (4.65)" }
            ),
            holds,
            norm_rate: best.filter(|_| holds).map(|best| 0.5 * best.rate_of_v(alpha)),
        }
    }
}

impl Certificate {
    /// (1 − α)λ_c − αλ_d: the rate at which V = x_c'X⁻¹x_c decays at a loss rate α \[1/s\] (Lemma 4.7).
    pub fn rate_of_v(&self, alpha: f64) -> f64 {
        (1.0 - alpha) * self.lambda_c - alpha * self.lambda_d
    }

    /// λ_c/(λ_c + λ_d): the loss rate that Lemma 4.7 bears.
    pub fn alpha_limit(&self) -> f64 {
        self.lambda_c / (self.lambda_c + self.lambda_d)
    }

    /// By how much ‖x_c‖ can exceed its decay at half of [`Certificate::rate_of_v`], with T_0 as in (4.11):
    /// √cond(X̂) e^{½(1 − α)(λ_c + λ_d)T_0}.
    pub fn overshoot(&self, alpha: f64, t_0: Span) -> f64 {
        let eigenvalues = SymmetricEigen::new(self.x).eigenvalues;
        let spread = eigenvalues.max() / eigenvalues.min();
        spread.sqrt() * (0.5 * (1.0 - alpha) * (self.lambda_c + self.lambda_d) * t_0.secs()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::measure::Connectivity;
    use crate::graph::spectrum::tests::all_graphs;
    use crate::random::Stream;
    use crate::theory::linear_coordination::tests::connected_graph;
    use crate::time::Time;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn example_4_1(a_2: f64) -> Dynamic {
        Dynamic::new(1.0, a_2, &all_graphs(3)).expect("some graphs are connected")
    }

    /// (4.62) for γ and z.
    fn closed(graph: &Graph, a_1: f64, a_2: f64) -> DMatrix<f64> {
        let n = graph.len();
        let (l, identity) = (graph.laplacian(), DMatrix::<f64>::identity(n, n));
        let mut matrix = DMatrix::zeros(2 * n, 2 * n);
        matrix.view_mut((0, 0), (n, n)).copy_from(&(&l * (-1.0 / a_1)));
        matrix.view_mut((0, n), (n, n)).copy_from(&identity);
        matrix.view_mut((n, 0), (n, n)).copy_from(&l);
        matrix.view_mut((n, n), (n, n)).copy_from(&(identity * -(a_1 + a_2)));
        matrix
    }

    /// |(θ, z)|: θ are the differences of γ from its mean.
    fn norm(state: &DVector<f64>) -> f64 {
        let n = state.len() / 2;
        let (gamma, z) = (state.rows(0, n), state.rows(n, n));
        (gamma.add_scalar(-gamma.mean()).norm_squared() + z.norm_squared()).sqrt()
    }

    #[test]
    fn example_4_1_and_erratum_4_19() {
        let fleet = example_4_1(1.6);
        assert!((fleet.spectra.connected.0 - 1.0).abs() < 1e-9 && (fleet.spectra.connected.1 - 3.0).abs() < 1e-9);
        assert!((fleet.spectra.disconnected.expect("some are not") - 2.0).abs() < 1e-9);
        let printed = fleet.printed();
        assert!((printed.lambda_c - 0.984_375).abs() < 1e-9 && (printed.lambda_d - 0.116_977).abs() < 1e-6);
        assert!(fleet.printed_holds());
        let printed = example_4_1(5.0).printed();
        assert!(
            (printed.lambda_c - 0.825).abs() < 1e-9 && (printed.lambda_d - 0.016_36).abs() < 1e-5,
            "not 0.85, 0.01"
        );
    }

    #[test]
    fn erratum_4_20_the_printed_form_fails_below_1_576_and_the_lmi_does_not() {
        assert!(!example_4_1(1.575).printed_holds() && example_4_1(1.577).printed_holds());
        // "None for a_2 ≤ 1.5" is true of that form of X only.
        let at = |a_2: f64| example_4_1(a_2).largest_lambda_c(0.01).expect("feasible");
        assert!(at(1.0).lambda_c > 0.76 && at(1.0).lambda_d <= 0.01, "{:?}", at(1.0));
        assert!(at(1.5).lambda_c > 1.0, "{:?}", at(1.5));
        // More loss allowed, more decay found; and the best is better than what is printed.
        let more = example_4_1(1.6).largest_lambda_c(0.116_977).expect("feasible");
        assert!(more.lambda_c > 0.984_375, "{more:?}");
        let best = example_4_1(1.6).best(0.75).expect("feasible");
        assert!(best.rate_of_v(0.75) >= 0.25 * 0.984_375 - 0.75 * 0.116_977);
    }

    #[test]
    fn lemma_4_7_is_a_condition() {
        let fleet = example_4_1(1.6);
        let good = fleet.verdict(0.75);
        assert!(good.holds && good.norm_rate.is_some_and(|rate| rate > 0.0), "{good:?}");
        assert_eq!(good.norm_rate, fleet.best(0.75).map(|best| 0.5 * best.rate_of_v(0.75)), "half of that of V");
        assert!(fleet.largest_lambda_c(-0.1).is_none(), "V may not fall without connection");
        let never = fleet.verdict(1.0);
        assert_eq!((never.holds, never.norm_rate), (false, None));
        assert!(Dynamic::new(1.0, 1.0, &[Graph::empty(3)]).is_none(), "never connected");
        assert!(Dynamic::new(1.0, 1.0, &[Graph::from_arcs(2, &[(0, 1)])]).is_none(), "one-way");
        assert!(Dynamic::new(0.0, 1.0, &all_graphs(3)).is_none());
        assert!(fleet.certify(&Matrix2::new(1.0, 2.0, 2.0, 1.0)).is_none(), "not positive definite");
    }

    #[test]
    fn theorem_4_8_in_closed_form() {
        // A pair: λ = 2, a_1 = 1, a_2 = 2: s² + 5s + 4.
        let pair = Graph::complete(2);
        let fleet = Dynamic::new(1.0, 2.0, std::slice::from_ref(&pair)).expect("connected");
        assert!((fleet.rate_on(&pair).expect("connected") - 1.0).abs() < 1e-12);
        assert_eq!(fleet.rate_on(&Graph::empty(2)), None);
        // Never disconnected: the certificate comes close to the exact rate, and never beyond it.
        let best = fleet.best(0.0).expect("connected");
        assert!((0.5 * best.rate_of_v(0.0) - 1.0).abs() < 1e-3, "{best:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn for_all_gains_some_x_never_grows_on_any_graph(
            a_1 in 0.05..10.0f64, a_2 in 0.05..10.0f64, n in 2usize..5, theta in -3.0..3.0f64, z in -3.0..3.0f64
        ) {
            let fleet = Dynamic::new(a_1, a_2, &all_graphs(n)).expect("some graphs are connected");
            let calm = fleet.calm();
            prop_assert!(calm.lambda_c > 0.0 && calm.alpha_limit() == 1.0, "{:?}", calm);
            // Where (4.65) is looked at for itself it says the same, but for rounding: on no graph does V grow.
            let worst = fleet.certify(&calm.x).expect("X is positive definite");
            prop_assert!(worst.lambda_d < 1e-6 * (a_1 + a_2) && (worst.lambda_c - calm.lambda_c).abs() < 1e-9);
            // V as written, along A(λ).
            let state = nalgebra::Vector2::new(theta, z);
            for lambda in [0.0, 0.3, n as f64] {
                let rate = fleet.block(lambda) * state;
                let slope = 2.0 * (z + a_1 * theta) * (rate.y + a_1 * rate.x) + 2.0 * a_1 * a_2 * theta * rate.x;
                let expected = -2.0 * a_2 * (z * z + lambda * theta * theta);
                prop_assert!((slope - expected).abs() < 1e-9 * (1.0 + (a_1 + a_2).powi(3) * state.norm_squared()));
            }
            // So Theorem 4.9 is reached however rarely the graph is connected.
            prop_assert!(fleet.verdict(0.99).holds, "{:?}", fleet.verdict(0.99));
        }

        #[test]
        fn theorem_4_8_on_every_connected_graph(graph in connected_graph(), a_1 in 0.3..3.0f64, a_2 in 0.3..3.0f64) {
            let fleet = Dynamic::new(a_1, a_2, std::slice::from_ref(&graph)).expect("connected");
            let rate = fleet.rate_on(&graph).expect("connected");
            let start = DVector::from_fn(2 * graph.len(), |i, _| ((i * 5 + 2) % 7) as f64 - 3.0);
            let after = (closed(&graph, a_1, a_2) * (20.0 / rate)).exp() * &start;
            prop_assert!(norm(&after) < 1e-6 * norm(&start));
            let best = fleet.best(0.0).expect("connected");
            prop_assert!(0.5 * best.rate_of_v(0.0) <= rate * (1.0 + 1e-9));
        }

        #[test]
        fn lemma_4_7_the_state_stays_below_the_bound(
            n in 2usize..5, a_1 in 0.3..2.0f64, a_2 in 0.3..4.0f64, seed in any::<u64>()
        ) {
            // Any graphs, in any order.
            let mut stream = Stream::new(seed, "graphs");
            let every = all_graphs(n);
            let mut phases = vec![(Graph::complete(n), Span::from_secs(1.0))];
            for _ in 0..20 {
                phases.push((every[stream.below(every.len())].clone(), Span::from_secs(stream.uniform(0.1, 3.0))));
            }
            let graphs: Vec<Graph> = phases.iter().map(|(graph, _)| graph.clone()).collect();
            let fleet = Dynamic::new(a_1, a_2, &graphs).expect("one is complete");
            let (mut run, mut t) = (Connectivity::new(), Time::ZERO);
            for (graph, lasts) in &phases {
                run.graph(t, graph.clone());
                t += *lasts;
            }
            run.advance(t);
            let alpha = run.loss_fraction();
            let best = fleet.best(alpha).expect("connected at times");
            // And by any other X, under which V may grow without connection.
            let other = fleet.certify(&Matrix2::new(1.0, 0.0, 0.0, stream.uniform(0.5, 4.0))).expect("positive definite");
            let begin = DVector::from_fn(2 * n, |_, _| stream.uniform(-3.0, 3.0));
            for certificate in [best, other] {
                let (rate, overshoot) = (0.5 * certificate.rate_of_v(alpha), certificate.overshoot(alpha, run.t_0(alpha)));
                let (mut state, start, mut t) = (begin.clone(), norm(&begin), 0.0);
                for (graph, lasts) in &phases {
                    state = (closed(graph, a_1, a_2) * lasts.secs()).exp() * state;
                    t += lasts.secs();
                    let promised = overshoot * (-rate * t).exp() * start;
                    prop_assert!(norm(&state) <= promised * (1.0 + 1e-9) + 1e-9, "{} > {} at {}", norm(&state), promised, t);
                }
            }
        }
    }

    #[test]
    fn the_spectra_are_the_outermost_of_all_graphs_that_occur() {
        // In any order: an edge has 2, no edge 0.
        let (pair, none) = (Graph::from_edges(3, &[(0, 1)]), Graph::empty(3));
        for graphs in
            [[Graph::complete(3), pair.clone(), none.clone()], [none.clone(), pair.clone(), Graph::complete(3)]]
        {
            let spectra = Spectra::of(&graphs).expect("one is connected");
            assert!((spectra.disconnected.expect("two are not") - 2.0).abs() < 1e-9, "{spectra:?}");
            assert!((spectra.connected.0 - 3.0).abs() < 1e-9 && (spectra.connected.1 - 3.0).abs() < 1e-9);
        }
        let never = Spectra::of(&[Graph::complete(3), none]).expect("one is connected").disconnected;
        assert!(never.is_some_and(|most| most.abs() < 1e-9), "{never:?}");
        assert_eq!(Spectra::of(&[Graph::complete(3)]).expect("connected").disconnected, None);
        assert!(Dynamic::new(f64::INFINITY, 1.0, &all_graphs(3)).is_none());
    }

    proptest! {
        /// (4.65) by its definition: the largest eigenvalue of A(λ)X + XA(λ)' against X, at all λ that occur.
        #[test]
        fn a_certificate_says_exactly_what_its_x_shows(
            a_1 in 0.1..4.0f64, a_2 in 0.1..4.0f64, x in 0.1..9.0f64, rho in -0.95..0.95f64, size in 0.2..5.0f64
        ) {
            let y = rho * x.sqrt();
            let x = Matrix2::new(1.0, y, y, x) * size;
            let growth = |fleet: &Dynamic, lambda: f64| {
                let a = fleet.block(lambda);
                let inverse = x.cholesky().expect("positive definite").l().try_inverse().expect("so is its root");
                let form = inverse * (a * x + x * a.transpose()) * inverse.transpose();
                SymmetricEigen::new((form + form.transpose()) * 0.5).eigenvalues.max()
            };
            let fleet = Dynamic::new(a_1, a_2, &all_graphs(3)).expect("some graphs are connected");
            let found = fleet.certify(&x).expect("positive definite");
            let tolerance = 1e-7 * (1.0 + found.lambda_c.abs() + found.lambda_d);
            let connected = growth(&fleet, 1.0).max(growth(&fleet, 3.0));
            prop_assert!((found.lambda_c + connected).abs() < tolerance, "{:?} {}", found, connected);
            let others = growth(&fleet, 0.0).max(growth(&fleet, 2.0)).max(0.0);
            prop_assert!((found.lambda_d - others).abs() < tolerance, "{:?} {}", found, others);
            // Where every graph is connected nothing ever grows.
            let always = Dynamic::new(a_1, a_2, &[Graph::complete(3)]).expect("connected");
            prop_assert_eq!(always.certify(&x).map(|found| found.lambda_d), Some(0.0));
            prop_assert_eq!(fleet.certify(&-x), None);
        }
    }

    #[test]
    fn lemma_4_7_in_closed_form() {
        // λ_c = 2, λ_d = ½: at α = ¼ V decays at 1.5 − 0.125, α < 4/5 is borne, and X̂ of condition 4 doubles a norm.
        let known = Certificate { lambda_c: 2.0, lambda_d: 0.5, x: Matrix2::new(2.0, 0.0, 0.0, 8.0) };
        assert!((known.rate_of_v(0.25) - 1.375).abs() < 1e-12 && (known.alpha_limit() - 0.8).abs() < 1e-12);
        assert!(known.rate_of_v(0.799) > 0.0 && known.rate_of_v(0.801) < 0.0, "the limit is where the rate is zero");
        assert!((known.overshoot(0.25, Span::from_secs(2.0)) - 2.0 * 1.875f64.exp()).abs() < 1e-9);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_other_x_promises_more_than_the_best(
            a_1 in 0.2..4.0f64, a_2 in 0.2..4.0f64, alpha in 0.0..0.95f64,
            others in prop::collection::vec((-4.0..4.0f64, -0.99..0.99f64), 200),
        ) {
            let fleet = Dynamic::new(a_1, a_2, &all_graphs(3)).expect("some graphs are connected");
            let best = fleet.best(alpha).expect("there is one").rate_of_v(alpha);
            prop_assert!(best >= fleet.calm().rate_of_v(alpha));
            for (ln_x, rho) in others {
                let x = (2.0 * (a_1 + a_2).ln() + ln_x).exp();
                let other = fleet.certify(&Matrix2::new(1.0, rho * x.sqrt(), rho * x.sqrt(), x)).expect("positive definite");
                prop_assert!(other.rate_of_v(alpha) <= best + 0.02 * best.abs(), "{} {}", other.rate_of_v(alpha), best);
            }
        }
    }

    #[test]
    fn equation_4_66_where_neither_gain_nor_eigenvalue_is_one() {
        // a_1 = 2, a_2 = 3 and eigenvalues from 2 to 5: λ_p = 10/7, x = 4·3·7/(8·(12 − 10/7)).
        let spectra = Spectra { connected: (2.0, 5.0), disconnected: Some(3.0) };
        let printed = Dynamic { a_1: 2.0, a_2: 3.0, spectra }.printed();
        let x = 588.0 / 592.0;
        assert!((printed.x[(1, 1)] - x).abs() < 1e-12 && (printed.lambda_c - 20.0 / 21.0).abs() < 1e-12, "{printed:?}");
        assert!((printed.lambda_d - ((25.0 + x).sqrt() - 5.0)).abs() < 1e-12, "{printed:?}");
    }
}
