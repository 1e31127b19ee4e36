//! Graphs, switching signals and what can be said of them.
//!
//! | question | source | answer | file |
//! |---|---|---|---|
//! | who hears whom, can they agree? | section 3.1.2, Lemma 3.9 | L = D − A, a globally reachable vertex | [`Graph`], `digraph.rs` |
//! | which links work when? | section 4.2.1, Definition 4.3 | p(t) | [`switching`] |
//! | which signals does Definition 4.3 admit, and which hurt? | Definition 4.3 | a search | [`adversary`] |
//! | how well did the network do? | Definitions 4.3, 4.4; erratum 4.21 | α, T_0, T, τ_D | [`measure`] |
//! | how fast can they agree? | Lemma 4.1; erratum 4.6 | λ_2, λ_m, ℒ_β | [`spectrum`] |
//! | what is a Laplacian made of? | Lemma 3.8, (3.6)–(3.8); erratum 3.1 | M_1 Y² M_1', F_1 L_11 F_2 | [`incidence`] |

pub mod adversary;
mod digraph;
pub mod incidence;
pub mod measure;
pub mod spectrum;
pub mod switching;

pub use digraph::Graph;

/// A matrix row by row, for what knows nothing of matrices.
pub fn rows(matrix: &nalgebra::DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}
