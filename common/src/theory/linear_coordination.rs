//! Linear coordination laws on a fixed network: how fast the whole fleet agrees, from the eigenvalues of the closed loop.
//!
//! A law u = −Eη − Gξ with G1 = 0 in η' = u, ξ' = Cη + v_L1 (3.41) leaves, with θ = F_2ξ and F_1, F_2 of (3.6),
//!
//! ```text
//! η' = −Eη − GF_1 θ,    θ' = F_2Cη
//! ```
//!
//! as in (3.75). θ = 0 means agreement. With constant C its eigenvalues are the exact rates, whatever the graph.

pub use nalgebra::Complex;
use nalgebra::{DMatrix, DVector};

use crate::graph::Graph;
use crate::graph::incidence::Differences;
use crate::graph::spectrum::eigenvalues;

/// A linear coordination law of chapter 3 with the same gains for every vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// u = −(LC + C + A)η − ALξ (3.43).
    SolutionOne {
        /// a \[1/s\].
        a: f64,
    },
    /// u = −Aη − BCLξ (3.44).
    SolutionTwo {
        /// a \[1/s\].
        a: f64,
        /// b \[m²/s²\].
        b: f64,
    },
    /// u = −(A⁻¹L + A)Cη − B(η + A⁻¹Lξ): (3.45) while nothing is saturated.
    SolutionThree {
        /// a \[m/s\] for ξ without unit.
        a: f64,
        /// b \[1/s\].
        b: f64,
    },
    /// u = −aη − bC⁻¹Lξ (3.72).
    Directed {
        /// a \[1/s\].
        a: f64,
        /// b \[1/s²\].
        b: f64,
    },
}

/// How much later than it is a law sees what it uses \[s\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Late {
    /// The vehicle's own state.
    pub own: f64,
    /// That of its neighbours.
    pub neighbours: f64,
}

impl Late {
    /// A law that is held for a control period is half of it late; what neighbours say takes another.
    pub fn held(period: f64) -> Late {
        Late { own: 0.5 * period, neighbours: 1.5 * period }
    }
}

impl Law {
    /// (E, G) of u = −Eη − Gξ, for C = diag(1/R_i) and the Laplacian L.
    pub fn matrices(self, c: &DVector<f64>, l: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = c.len();
        let identity = DMatrix::identity(n, n);
        let c = DMatrix::from_diagonal(c);
        match self {
            Law::SolutionOne { a } => (l * &c + &c + &identity * a, l * a),
            Law::SolutionTwo { a, b } => (identity * a, &c * l * b),
            Law::SolutionThree { a, b } => ((l / a + &identity * a) * &c + identity * b, l * (b / a)),
            Law::Directed { a, b } => (identity * a, c.map_diagonal_inverse() * l * b),
        }
    }

    /// Eigenvalues of the closed loop in (η, θ) on this graph, with R_i \[m per unit of ξ\] constant. `None` if the
    /// graph cannot agree, or something is not positive and finite.
    pub fn eigenvalues(self, graph: &Graph, r: &[f64]) -> Option<Vec<Complex<f64>>> {
        self.late_eigenvalues(graph, &graph.laplacian(), r, Late::default())
    }

    /// The same with another matrix for L that is zero where L is, such as MWM' of (3.62), and for a law that acts late, to first order
    /// in that: it uses η(t − τ) ≈ η − τη' and ξ(t − τ) ≈ ξ − τCη, each with the τ of who says it.
    pub fn late_eigenvalues(self, graph: &Graph, l: &DMatrix<f64>, r: &[f64], late: Late) -> Option<Vec<Complex<f64>>> {
        let n = graph.len();
        if r.len() != n || l.shape() != (n, n) || !r.iter().all(|&r| r > 0.0 && r.is_finite()) {
            return None;
        }
        let c = DVector::from_iterator(n, r.iter().map(|r| 1.0 / r));
        let split = Differences::of(graph)?;
        let (e, g) = self.matrices(&c, l);
        let times = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * if i == j { late.own } else { late.neighbours })
        };
        let (pull, way) = (&g * &split.f_1, &split.f_2 * DMatrix::from_diagonal(&c));
        // (I − τE)η' = −Eη − Gξ + τGCη, τ by entries.
        let lead = (DMatrix::identity(n, n) - times(&e)).try_inverse()?;
        let mut closed = DMatrix::zeros(2 * n - 1, 2 * n - 1);
        closed.view_mut((0, 0), (n, n)).copy_from(&(&lead * (times(&g) * DMatrix::from_diagonal(&c) - e)));
        closed.view_mut((0, n), (n, n - 1)).copy_from(&-(lead * pull));
        closed.view_mut((n, 0), (n - 1, n)).copy_from(&way);
        eigenvalues(&closed)
    }

    /// The rate of the slowest mode \[1/s\], negative if it grows. `None` as for [`Law::eigenvalues`].
    pub fn rate(self, graph: &Graph, r: &[f64]) -> Option<f64> {
        self.eigenvalues(graph, r)?.iter().map(|eigenvalue| -eigenvalue.re).min_by(f64::total_cmp)
    }
}

/// The inverse of a diagonal matrix.
trait DiagonalInverse {
    fn map_diagonal_inverse(&self) -> DMatrix<f64>;
}

impl DiagonalInverse for DMatrix<f64> {
    fn map_diagonal_inverse(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&self.diagonal().map(|entry| 1.0 / entry))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::{Complex, Late, Law};
    use crate::graph::Graph;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// A connected graph with two-way links: a random tree and some more edges.
    pub(crate) fn connected_graph() -> impl Strategy<Value = Graph> {
        (2usize..6).prop_flat_map(|n| {
            let parents = prop::collection::vec(any::<prop::sample::Index>(), n - 1);
            let more = prop::collection::vec((0..n, 0..n), 0..n);
            (parents, more).prop_map(move |(parents, more)| {
                let mut edges: Vec<_> = parents.iter().enumerate().map(|(i, p)| (i + 1, p.index(i + 1))).collect();
                edges.extend(more);
                Graph::from_edges(n, &edges)
            })
        })
    }

    /// (η, ξ) after `t` seconds of the closed loop, exactly.
    pub(crate) fn flow(law: Law, graph: &Graph, r: &[f64], t: f64) -> DMatrix<f64> {
        let n = graph.len();
        let c = DVector::from_iterator(n, r.iter().map(|r| 1.0 / r));
        let (e, g) = law.matrices(&c, &graph.laplacian());
        let mut closed = DMatrix::zeros(2 * n, 2 * n);
        closed.view_mut((0, 0), (n, n)).copy_from(&-e);
        closed.view_mut((0, n), (n, n)).copy_from(&-g);
        closed.view_mut((n, 0), (n, n)).copy_from(&DMatrix::from_diagonal(&c));
        (closed * t).exp()
    }

    #[test]
    fn a_pair_in_closed_form() {
        // R = 1, a = 1, solution I: η_1 − η_2 and ξ_1 − ξ_2 give s² + (3 + a)s + 2a, the mean of η decays at 1 + a.
        let pair = Graph::complete(2);
        let rate = Law::SolutionOne { a: 1.0 }.rate(&pair, &[1.0; 2]).expect("connected");
        assert!((rate - (2.0 - 2f64.sqrt())).abs() < 1e-12);
        assert_eq!(Law::SolutionOne { a: 1.0 }.rate(&Graph::empty(2), &[1.0; 2]), None);
        assert_eq!(Law::SolutionOne { a: 1.0 }.rate(&pair, &[1.0]), None);
        assert_eq!(Law::SolutionOne { a: 1.0 }.rate(&pair, &[1.0, 0.0]), None);
        assert_eq!(Law::SolutionOne { a: 1.0 }.rate(&pair, &[1.0, -2.0]), None);
        assert_eq!(Law::SolutionOne { a: 1.0 }.rate(&pair, &[1.0, f64::INFINITY]), None);
        let of_three = Graph::complete(3).laplacian();
        assert_eq!(Law::SolutionOne { a: 1.0 }.late_eigenvalues(&pair, &of_three, &[1.0; 2], Late::default()), None);
    }

    #[test]
    fn a_law_sees_itself_half_a_period_late_and_others_one_more() {
        let held = Late::held(0.2);
        assert!((held.own - 0.1).abs() < 1e-15 && (held.neighbours - 0.3).abs() < 1e-15);
        // A pair on R = 2, solution II, c = ½: with x = ξ_1 − ξ_2, (1 − aτ_o)s² + (a − bc²(τ_o + τ_n))s + 2bc² = 0.
        let (a, b, c, pair) = (1.0, 2.0, 0.5, Graph::complete(2));
        let late = Late { own: 0.02, neighbours: 0.1 };
        let found = Law::SolutionTwo { a, b }.late_eigenvalues(&pair, &pair.laplacian(), &[2.0; 2], late);
        let residual = |s: &Complex<f64>| {
            let (lead, damping) = (1.0 - a * late.own, a - b * c * c * (late.own + late.neighbours));
            (s * s * lead + s * damping + 2.0 * b * c * c).norm()
        };
        let modes = found.expect("connected");
        assert_eq!(modes.iter().filter(|s| s.im != 0.0).count(), 2, "{modes:?}");
        assert!(modes.iter().filter(|s| s.im != 0.0).all(|s| residual(s) < 1e-9), "{modes:?}");
    }

    #[test]
    fn a_late_law_has_the_modes_of_the_exact_delay() {
        // One vehicle pair, solution II with R = 1: the difference obeys s² + (as + 2b)e^(−sτ) = 0.
        let (law, pair, tau) = (Law::SolutionTwo { a: 1.0, b: 0.4 }, Graph::complete(2), 0.01);
        let both = Late { own: tau, neighbours: tau };
        let late = law.late_eigenvalues(&pair, &pair.laplacian(), &[1.0; 2], both).expect("connected");
        let residual = |s: &Complex<f64>| (s * s + (s * 1.0 + 0.8) * (-s * tau).exp()).norm();
        let pair_of_modes: Vec<_> = late.iter().filter(|mode| mode.im != 0.0).collect();
        assert!(pair_of_modes.len() == 2 && pair_of_modes.iter().all(|mode| residual(mode) < 1e-4), "{late:?}");
        let prompt = law.rate(&pair, &[1.0; 2]).expect("connected");
        // (1 − aτ)s² + (a − 2bτ)s + 2b = 0.
        assert!((prompt - 0.5).abs() < 1e-12 && (pair_of_modes[0].re + 0.5 * 0.992 / 0.99).abs() < 1e-9);
    }

    #[test]
    fn late_news_go_the_way_of_the_link() {
        // 1 hears 0, who hears nobody, R = 1 and (3.72): 0 comes to v_L by itself, (1 − aτ_o)s + a, and 1 to 0,
        // (1 − aτ_o)s² + (a − bτ_o)s + b, however late what 0 says is.
        let (a, b, graph) = (1.0, 0.5, Graph::from_arcs(2, &[(1, 0)]));
        for neighbours in [0.02, 0.3] {
            let late = Late { own: 0.02, neighbours };
            let found = Law::Directed { a, b }.late_eigenvalues(&graph, &graph.laplacian(), &[1.0; 2], late);
            let (lead, damping) = (1.0 - a * late.own, a - b * late.own);
            let product = |s: &Complex<f64>| ((s * lead + a) * (s * s * lead + s * damping + b)).norm();
            assert!(found.expect("it can agree").iter().all(|s| product(s) < 1e-9), "{neighbours}");
        }
    }

    proptest! {
        #[test]
        fn proposition_3_4_solutions_agree_on_every_connected_graph(
            graph in connected_graph(), a in 0.1..3.0f64, b in 0.1..3.0f64, r in prop::collection::vec(0.2..4.0f64, 6)
        ) {
            let r = &r[..graph.len()];
            for law in [Law::SolutionOne { a }, Law::SolutionTwo { a, b }, Law::SolutionThree { a, b }] {
                let rate = law.rate(&graph, r).expect("connected");
                prop_assert!(rate > 0.0, "{:?} {}", law, rate);
                // The exponential of the whole loop says the same: beyond the slowest mode nothing is left.
                let after = flow(law, &graph, r, 25.0 / rate) * DVector::from_fn(2 * graph.len(), |i, _| i as f64);
                let xi = after.rows(graph.len(), graph.len());
                prop_assert!(xi.max() - xi.min() < 1e-6 * (1.0 + xi.amax()));
            }
        }

        #[test]
        fn proposition_3_4_needs_a_connected_graph(a in 0.1..3.0f64) {
            let apart = Graph::from_edges(4, &[(0, 1), (2, 3)]);
            prop_assert_eq!(Law::SolutionOne { a }.rate(&apart, &[1.0; 4]), None);
            let after = flow(Law::SolutionOne { a }, &apart, &[1.0; 4], 500.0) * DVector::from_fn(8, |i, _| i as f64);
            prop_assert!((after[7] - after[4]).abs() > 1.0, "two clusters stay apart");
        }
    }
}
