//! What a Laplacian is made of: the spanning tree of an undirected graph (Lemma 3.8), and the part of a directed one
//! that acts on differences (3.6)–(3.8).

use nalgebra::{DMatrix, DVector};

use super::Graph;
use super::spectrum::{eigenvalues, orthogonal_complement};

/// An arc of an orientation: (tail, head).
pub type Oriented = (usize, usize);

/// Each two-way link once, from its lower to its higher vertex; a one-way link counts as a two-way one.
pub fn orientation(graph: &Graph) -> Vec<Oriented> {
    let n = graph.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    pairs.filter(|&(i, j)| graph.hears(i, j) || graph.hears(j, i)).collect()
}

/// Incidence matrix M of an orientation of n vertices: +1 at the head of each arc, −1 at its tail, so that MM' = L
/// (Lemma 3.6). Arcs must lie among the vertices.
///
/// # Panics
/// If an arc does not.
#[doc(alias = "M")]
pub fn incidence(n: usize, arcs: &[Oriented]) -> DMatrix<f64> {
    let mut m = DMatrix::zeros(n, arcs.len());
    for (arc, &(tail, head)) in arcs.iter().enumerate() {
        m[(tail, arc)] -= 1.0;
        m[(head, arc)] += 1.0;
    }
    m
}

/// The Laplacian of a connected graph from the incidence matrix of one of its spanning trees (Lemma 3.8, with the
/// sizes of erratum 3.1).
#[derive(Clone, Debug, PartialEq)]
pub struct SpanningTree {
    /// Which arcs are in the tree, n − 1 of them.
    pub tree: Vec<usize>,
    /// M_1: incidence matrix of the tree, n × (n − 1).
    pub m_1: DMatrix<f64>,
    /// M_2: incidence matrix of the other arcs.
    pub m_2: DMatrix<f64>,
    /// U := M_2'M_1(M_1'M_1)⁻¹, of entries 0 and ±1: the way through the tree from one end of each other arc to the
    /// other, so that M = M_1 \[I U'\].
    pub u: DMatrix<f64>,
    /// Y² = I + U'U (3.5), with which L = M_1 Y² M_1' (3.4).
    pub y_squared: DMatrix<f64>,
}

impl SpanningTree {
    /// The decomposition with the tree of the earliest arcs that close no cycle; `None` if the graph of these arcs is
    /// not connected or has no vertex.
    ///
    /// # Panics
    /// If an arc does not lie among the vertices.
    pub fn new(n: usize, arcs: &[Oriented]) -> Option<SpanningTree> {
        let mut component: Vec<usize> = (0..n).collect();
        let (mut tree, mut rest) = (Vec::new(), Vec::new());
        for (arc, &(tail, head)) in arcs.iter().enumerate() {
            let [joined, kept] = [component[tail], component[head]];
            if joined == kept {
                rest.push(arc);
                continue;
            }
            component.iter_mut().filter(|vertex| **vertex == joined).for_each(|vertex| *vertex = kept);
            tree.push(arc);
        }
        if tree.len() + 1 != n {
            return None;
        }
        let m = incidence(n, arcs);
        let (m_1, m_2) = (m.select_columns(&tree), m.select_columns(&rest));
        // U' is solved for, and rounded to the whole numbers that it consists of.
        let u = match (m_1.transpose() * &m_1).cholesky() {
            Some(gram) if n > 1 => gram.solve(&(m_1.transpose() * &m_2)).map(f64::round).transpose(),
            _ => DMatrix::zeros(rest.len(), n - 1),
        };
        let y_squared = DMatrix::identity(n - 1, n - 1) + u.transpose() * &u;
        Some(SpanningTree { tree, m_1, m_2, u, y_squared })
    }

    /// Y > 0, the symmetric root of Y² (3.5).
    #[doc(alias = "Y")]
    pub fn y(&self) -> DMatrix<f64> {
        if self.y_squared.is_empty() {
            return self.y_squared.clone();
        }
        let eigen = self.y_squared.clone().symmetric_eigen();
        let roots = DMatrix::from_diagonal(&eigen.eigenvalues.map(f64::sqrt));
        &eigen.eigenvectors * roots * eigen.eigenvectors.transpose()
    }
}

/// The Laplacian of a graph that can agree, split into agreement and differences (3.6)–(3.8):
///
/// ```text
/// F = [1 F_1],  F⁻¹ = [β'; F_2],  F⁻¹LF = diag(0, L_11),  F_2F_1 = I,  F_2 1 = 0,  β'F_1 = 0,  L = F_1 L_11 F_2
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    /// β ≥ 0: whose word counts for how much, β'L = 0 and β'1 = 1; zero but for the globally reachable vertices.
    #[doc(alias = "β")]
    pub beta: DVector<f64>,
    /// F_1, n × (n − 1): orthonormal columns.
    pub f_1: DMatrix<f64>,
    /// F_2, (n − 1) × n.
    pub f_2: DMatrix<f64>,
    /// L_11: nonsingular, all eigenvalues in the right half-plane (Lemma 3.9).
    pub l_11: DMatrix<f64>,
}

impl Differences {
    /// Of L = D − A; `None` if no vertex is globally reachable.
    pub fn of(graph: &Graph) -> Option<Differences> {
        Differences::of_laplacian(graph, &graph.laplacian())
    }

    /// Of D⁻¹L (erratum 3.16); `None` if no vertex is globally reachable.
    pub fn of_normalised(graph: &Graph) -> Option<Differences> {
        Differences::of_laplacian(graph, &graph.normalised_laplacian())
    }

    fn of_laplacian(graph: &Graph, l: &DMatrix<f64>) -> Option<Differences> {
        if !graph.can_agree() {
            return None;
        }
        let ones = DVector::from_element(graph.len(), 1.0);
        // L'β = 0 with 1'β = 1 is (L' + 11')β = 1, since 1'L' = 0; that matrix is regular as zero is a simple eigenvalue.
        let beta = (l.transpose() + &ones * ones.transpose()).lu().solve(&ones)?;
        let f_1 = orthogonal_complement(&beta);
        let f_2 = f_1.transpose() - f_1.transpose() * &ones * beta.transpose();
        let l_11 = &f_2 * l * &f_1;
        Some(Differences { beta, f_1, f_2, l_11 })
    }

    /// The least real part of the eigenvalues of L_11: differences under ξ' = −Lξ decay no slower than any smaller
    /// rate. `None` for a single vehicle.
    pub fn slowest(&self) -> Option<f64> {
        eigenvalues(&self.l_11)?.first().map(|eigenvalue| eigenvalue.re)
    }
}

#[cfg(test)]
mod tests {
    use super::{Differences, SpanningTree, incidence, orientation};
    use crate::graph::Graph;
    use nalgebra::{DMatrix, DVector, dmatrix, dvector};
    use proptest::prelude::*;

    /// The orientation of Figure 3.1(b): 1 -> 2 and 3 -> 1.
    const FIGURE_3_1: [(usize, usize); 2] = [(0, 1), (2, 0)];

    #[test]
    fn example_3_2_incidence() {
        let m = incidence(3, &FIGURE_3_1);
        assert_eq!(m, dmatrix![-1., 1.; 1., 0.; 0., -1.]);
        assert_eq!(&m * m.transpose(), Graph::from_edges(3, &FIGURE_3_1).laplacian());
        // Each link once, whichever way it works.
        assert_eq!(orientation(&Graph::from_arcs(3, &[(0, 1), (2, 0), (2, 1), (1, 2)])), [(0, 1), (0, 2), (1, 2)]);
    }

    #[test]
    fn example_3_3_spanning_tree() {
        let split = SpanningTree::new(3, &[(0, 1), (2, 0), (1, 2)]).expect("connected");
        assert_eq!(split.tree, [0, 1]);
        assert_eq!(split.m_1, dmatrix![-1., 1.; 1., 0.; 0., -1.]);
        assert_eq!(split.m_2, dmatrix![0.; -1.; 1.]);
        assert_eq!(split.u.transpose(), dmatrix![-1.; -1.]);
        assert_eq!(split.y_squared, dmatrix![2., 1.; 1., 2.]);
        assert!((split.y() * split.y() - &split.y_squared).amax() < 1e-12);
    }

    #[test]
    fn a_tree_is_its_own_spanning_tree() {
        let split = SpanningTree::new(3, &FIGURE_3_1).expect("connected");
        assert_eq!((split.u.nrows(), split.y_squared), (0, DMatrix::identity(2, 2)));
        assert!(SpanningTree::new(3, &[(0, 1)]).is_none() && SpanningTree::new(0, &[]).is_none());
        assert_eq!(SpanningTree::new(1, &[]).expect("connected").y(), DMatrix::zeros(0, 0));
    }

    #[test]
    fn example_3_4_the_second_vehicle_leads() {
        let split = Differences::of(&Graph::from_arcs(3, &[(0, 1), (0, 2), (2, 0)])).expect("it can agree");
        assert!((split.beta - dvector![0., 1., 0.]).amax() < 1e-14);
        assert!((split.f_1 - dmatrix![1., 0.; 0., 0.; 0., 1.]).amax() < 1e-14);
        assert!((split.f_2 - dmatrix![1., -1., 0.; 0., -1., 1.]).amax() < 1e-14);
        assert!((split.l_11 - dmatrix![2., -1.; -1., 1.]).amax() < 1e-14);
    }

    #[test]
    fn two_way_links_give_everyone_the_same_say() {
        let path = Graph::from_edges(4, &[(0, 1), (1, 2), (2, 3)]);
        let split = Differences::of(&path).expect("it can agree");
        assert!((split.beta - DVector::from_element(4, 0.25)).amax() < 1e-14);
        // Averages over N_i weigh by the number of neighbours instead.
        let split = Differences::of_normalised(&path).expect("it can agree");
        assert!((split.beta - dvector![1., 2., 2., 1.] / 6.0).amax() < 1e-14);
        assert!(Differences::of(&Graph::empty(2)).is_none() && Differences::of(&Graph::empty(0)).is_none());
        assert_eq!(Differences::of(&Graph::empty(1)).expect("trivially").slowest(), None);
    }

    proptest! {
        #[test]
        fn lemma_3_8_rebuilds_the_laplacian(edges in prop::collection::vec((0usize..6, 0usize..6), 0..15)) {
            let graph = Graph::from_edges(6, &edges);
            let arcs = orientation(&graph);
            let m = incidence(6, &arcs);
            prop_assert_eq!(&m * m.transpose(), graph.laplacian());
            let Some(split) = SpanningTree::new(6, &arcs) else {
                prop_assert!(!graph.is_connected());
                return Ok(());
            };
            prop_assert!(graph.is_connected());
            prop_assert_eq!(&split.m_1 * &split.y_squared * split.m_1.transpose(), graph.laplacian());
            prop_assert_eq!(&split.u * split.m_1.transpose(), split.m_2.transpose());
            prop_assert!(split.u.iter().all(|entry| entry.abs() <= 1.0));
        }

        #[test]
        fn equations_3_7_and_3_8_hold(arcs in prop::collection::vec((0usize..6, 0usize..6), 0..20)) {
            let graph = Graph::from_arcs(6, &arcs);
            for (split, l) in [
                (Differences::of(&graph), graph.laplacian()),
                (Differences::of_normalised(&graph), graph.normalised_laplacian()),
            ] {
                let Some(split) = split else {
                    prop_assert!(!graph.can_agree());
                    continue;
                };
                let ones = DVector::from_element(6, 1.0);
                prop_assert!((&split.f_2 * &split.f_1 - DMatrix::identity(5, 5)).amax() < 1e-10);
                prop_assert!((&split.f_2 * &ones).amax() < 1e-10);
                prop_assert!((split.beta.transpose() * &split.f_1).amax() < 1e-10);
                prop_assert!((split.beta.transpose() * &l).amax() < 1e-10 && (split.beta.sum() - 1.0).abs() < 1e-10);
                prop_assert!((&split.f_1 * &split.l_11 * &split.f_2 - &l).amax() < 1e-9);
                prop_assert!(split.slowest().is_some_and(|rate| rate > 0.0));
                for vertex in 0..6 {
                    let leads = graph.globally_reachable().contains(&vertex);
                    prop_assert_eq!(split.beta[vertex] > 1e-9, leads);
                }
            }
        }
    }
}
