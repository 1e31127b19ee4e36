//! Who hears whom: a directed graph.
//!
//! The arc (i, j) says that vehicle i *receives from* vehicle j, so row i of the adjacency matrix is N_i and
//! information flows against the arcs. A two-way link is both arcs.

use nalgebra::{DMatrix, DVector};

/// A directed graph without self-loops; each row is the set N_i as bits, in as many machine words as n vertices take.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Graph {
    n: usize,
    /// Row after row, in one piece: a graph of a small fleet is one word per vehicle.
    words: Vec<u64>,
}

impl Graph {
    /// The graph on `n` vertices in which nobody hears anybody.
    pub fn empty(n: usize) -> Graph {
        Graph { n, words: vec![0; n * width(n)] }
    }

    /// The graph with these arcs (receiver i, sender j). A vehicle that hears itself is not an arc: (i, i) is ignored.
    ///
    /// # Panics
    /// If an arc names a vertex that is not below `n`.
    pub fn from_arcs(n: usize, arcs: &[(usize, usize)]) -> Graph {
        let mut graph = Graph::empty(n);
        for &(receiver, sender) in arcs {
            graph.set(receiver, sender, true);
        }
        graph
    }

    /// The graph in which each of these pairs hears one another.
    ///
    /// # Panics
    /// As [`Graph::from_arcs`].
    pub fn from_edges(n: usize, edges: &[(usize, usize)]) -> Graph {
        let mut graph = Graph::from_arcs(n, edges);
        for &(i, j) in edges {
            graph.set(j, i, true);
        }
        graph
    }

    /// The graph in which everybody hears everybody else.
    pub fn complete(n: usize) -> Graph {
        let mut graph = Graph::empty(n);
        let everybody = all(n);
        for i in 0..n {
            graph.row_mut(i).copy_from_slice(&everybody);
            graph.row_mut(i)[i / BITS] &= !bit(i);
        }
        graph
    }

    /// Makes or breaks one arc; a self-loop is ignored.
    ///
    /// # Panics
    /// If either vertex is not below [`Graph::len`].
    pub fn set(&mut self, receiver: usize, sender: usize, hears: bool) {
        let n = self.len();
        assert!(receiver < n && sender < n, "arc ({receiver}, {sender}) in a graph of {n} vertices");
        if receiver == sender {
            return;
        }
        let word = &mut self.row_mut(receiver)[sender / BITS];
        if hears {
            *word |= bit(sender);
        } else {
            *word &= !bit(sender);
        }
    }

    /// The graph with the arcs of both (section 4.2.3); the larger vertex set is kept.
    pub fn union(&self, other: &Graph) -> Graph {
        let (mut large, small) = if self.len() >= other.len() { (self.clone(), other) } else { (other.clone(), self) };
        for i in 0..small.len() {
            join(large.row_mut(i), small.row(i));
        }
        large
    }

    /// The number of vertices n.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there is no vertex at all.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Whether i receives from j; false for vertices that do not exist.
    pub fn hears(&self, i: usize, j: usize) -> bool {
        j < self.n && has(self.row(i), j)
    }

    /// N_i in increasing order; empty for a vertex that does not exist.
    pub fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + use<'_> {
        members(self.row(i))
    }

    /// |N_i|.
    pub fn degree(&self, i: usize) -> usize {
        self.row(i).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The arcs (receiver, sender), by receiver and then by sender.
    pub fn arcs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.len()).flat_map(|i| self.neighbours(i).map(move |j| (i, j)))
    }

    /// N_i as bits; nothing for a vertex that does not exist.
    fn row(&self, i: usize) -> &[u64] {
        let width = width(self.n);
        self.words.get(i * width..(i + 1) * width).unwrap_or_default()
    }

    fn row_mut(&mut self, i: usize) -> &mut [u64] {
        let width = width(self.n);
        &mut self.words[i * width..(i + 1) * width]
    }

    /// Adjacency matrix A: a_ij = 1 iff j ∈ N_i.
    pub fn adjacency(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), self.len(), |i, j| f64::from(u8::from(self.hears(i, j))))
    }

    /// Degree matrix D = diag |N_i|.
    #[doc(alias = "D")]
    pub fn degrees(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_fn(self.len(), |i, _| self.degree(i) as f64))
    }

    /// Laplacian L = D − A of section 3.1.2, so that (Lξ)_i = Σ_{j∈N_i} (ξ_i − ξ_j), (3.9).
    pub fn laplacian(&self) -> DMatrix<f64> {
        self.degrees() - self.adjacency()
    }

    /// MWM' of (3.62) for two-way links: L with a weight on each link, `weight(i, j)` = `weight(j, i)`.
    pub fn weighted_laplacian(&self, weight: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let mut laplacian = DMatrix::zeros(self.len(), self.len());
        for (i, j) in self.arcs() {
            laplacian[(i, j)] = -weight(i, j);
            laplacian[(i, i)] += weight(i, j);
        }
        laplacian
    }

    /// Normalised Laplacian D⁻¹L, with d_ii := 1 where N_i is empty (erratum 3.16): each row averages over N_i.
    pub fn normalised_laplacian(&self) -> DMatrix<f64> {
        let mut laplacian = self.laplacian();
        for (i, mut row) in laplacian.row_iter_mut().enumerate() {
            row /= self.degree(i).max(1) as f64;
        }
        laplacian
    }

    /// Whether every link works both ways.
    pub fn is_undirected(&self) -> bool {
        self.arcs().all(|(i, j)| self.hears(j, i))
    }

    /// Whether any two vertices are joined by a path, whatever the directions of its arcs; true without vertices.
    pub fn is_connected(&self) -> bool {
        let mut both_ways = self.clone();
        for (i, j) in self.arcs() {
            both_ways.set(j, i, true);
        }
        self.is_empty() || both_ways.globally_reachable_bits() == all(self.len())
    }

    /// The vertices that everybody hears, directly or through others: reachable from every other along arcs i → j.
    pub fn globally_reachable(&self) -> Vec<usize> {
        members(&self.globally_reachable_bits()).collect()
    }

    /// Whether agreement is possible (Lemma 3.9): some vertex is globally reachable. Connectedness, if undirected.
    pub fn can_agree(&self) -> bool {
        self.globally_reachable_bits().iter().any(|word| *word != 0)
    }

    fn globally_reachable_bits(&self) -> Vec<u64> {
        // Warshall's transitive closure, a row of machine words at a time.
        let mut reach = self.clone();
        for i in 0..self.n {
            reach.row_mut(i)[i / BITS] |= bit(i);
        }
        for k in 0..self.n {
            let beyond_k = reach.row(k).to_vec();
            for i in 0..self.n {
                let from_i = reach.row_mut(i);
                if has(from_i, k) {
                    join(from_i, &beyond_k);
                }
            }
        }
        let mut common = all(self.n);
        for i in 0..self.n {
            common.iter_mut().zip(reach.row(i)).for_each(|(common, from_i)| *common &= from_i);
        }
        common
    }
}

const BITS: usize = u64::BITS as usize;

/// How many words a row of `n` bits takes.
fn width(n: usize) -> usize {
    n.div_ceil(BITS)
}

/// The bit of a vertex in its word.
fn bit(vertex: usize) -> u64 {
    1 << (vertex % BITS)
}

fn has(row: &[u64], vertex: usize) -> bool {
    row.get(vertex / BITS).is_some_and(|word| word & bit(vertex) != 0)
}

fn join(row: &mut [u64], more: &[u64]) {
    row.iter_mut().zip(more).for_each(|(word, more)| *word |= more);
}

fn all(n: usize) -> Vec<u64> {
    let mut words = vec![u64::MAX; width(n)];
    if let Some(last) = words.last_mut().filter(|_| !n.is_multiple_of(BITS)) {
        *last = bit(n) - 1;
    }
    words
}

fn members(row: &[u64]) -> impl Iterator<Item = usize> {
    row.iter().enumerate().flat_map(|(index, word)| {
        let mut set = *word;
        std::iter::from_fn(move || {
            let lowest = (set != 0).then(|| set.trailing_zeros() as usize)?;
            set &= set - 1;
            Some(index * BITS + lowest)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::Graph;
    use crate::graph::incidence::incidence;
    use crate::graph::rows;
    use nalgebra::{DVector, dmatrix, dvector};
    use proptest::prelude::*;

    #[test]
    fn example_3_2_path_of_three() {
        let graph = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        assert_eq!(graph.adjacency(), dmatrix![0., 1., 1.; 1., 0., 0.; 1., 0., 0.]);
        assert_eq!(graph.degrees(), dmatrix![2., 0., 0.; 0., 1., 0.; 0., 0., 1.]);
        assert_eq!(graph.laplacian(), dmatrix![2., -1., -1.; -1., 1., 0.; -1., 0., 1.]);
        assert!(graph.is_undirected() && graph.is_connected());
    }

    #[test]
    fn example_3_4_only_the_second_vertex_is_heard_by_all() {
        let graph = Graph::from_arcs(3, &[(0, 1), (0, 2), (2, 0)]);
        assert_eq!(graph.laplacian(), dmatrix![2., -1., -1.; 0., 0., 0.; -1., 0., 1.]);
        assert_eq!(graph.globally_reachable(), [1]);
        assert!(graph.can_agree() && graph.is_connected() && !graph.is_undirected());
        assert_eq!(graph.normalised_laplacian(), dmatrix![1., -0.5, -0.5; 0., 0., 0.; -1., 0., 1.]);
    }

    #[test]
    fn a_weight_on_each_link_is_mwm_of_3_62() {
        let graph = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let weights = dmatrix![0., 2., 5.; 2., 0., 9.; 5., 9., 0.];
        let weighted = graph.weighted_laplacian(|i, j| weights[(i, j)]);
        assert_eq!(weighted, dmatrix![7., -2., -5.; -2., 2., 0.; -5., 0., 5.]);
        let m = incidence(3, &[(0, 1), (0, 2)]);
        assert_eq!(weighted, &m * dmatrix![2., 0.; 0., 5.] * m.transpose());
        assert_eq!(graph.weighted_laplacian(|_, _| 1.0), graph.laplacian());
        assert_eq!(rows(&dmatrix![1., 2.; 3., 4.]), [[1.0, 2.0], [3.0, 4.0]], "as it is written");
    }

    #[test]
    fn example_3_5_laplacian_uses_only_what_is_heard() {
        let graph = Graph::from_arcs(3, &[(0, 1), (0, 2), (2, 0)]);
        let xi = dvector![1.0, 10.0, 100.0];
        assert_eq!(graph.laplacian() * xi, dvector![(1. - 10.) + (1. - 100.), 0., 100. - 1.]);
        assert_eq!(graph.neighbours(0).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(graph.neighbours(1).count(), 0);
        assert_eq!(graph.neighbours(2).collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn two_independent_leaders_cannot_agree_though_weakly_connected() {
        // 1 listens to 0 and to 2, who listen to nobody.
        let graph = Graph::from_arcs(3, &[(1, 0), (1, 2)]);
        assert!(graph.is_connected() && !graph.can_agree());
        assert!(graph.union(&Graph::from_arcs(3, &[(0, 2)])).can_agree());
    }

    #[test]
    fn the_extreme_sizes_work() {
        assert!(!Graph::empty(0).can_agree() && Graph::empty(0).is_connected());
        assert!(Graph::empty(0).is_empty() && !Graph::empty(1).is_empty());
        assert!(Graph::empty(1).can_agree() && Graph::empty(1).is_connected());
        assert!(!Graph::empty(2).can_agree());
    }

    #[test]
    fn what_does_not_exist_is_not_heard() {
        let graph = Graph::complete(2);
        assert!(!graph.hears(0, 0) && !graph.hears(0, 2) && !graph.hears(70, 0));
        assert_eq!((graph.degree(5), graph.neighbours(5).count()), (0, 0));
        assert_eq!(Graph::from_arcs(2, &[(1, 1)]), Graph::empty(2));
    }

    #[test]
    fn fleets_of_more_than_a_word_are_as_good_as_small_ones() {
        for n in [63, 64, 65, 128, 129, 200, 256] {
            let full = Graph::complete(n);
            assert_eq!((full.degree(n - 1), full.arcs().count()), (n - 1, n * (n - 1)));
            assert_eq!(full.neighbours(0).collect::<Vec<_>>(), (1..n).collect::<Vec<_>>());
            assert_eq!(full.globally_reachable().len(), n);
            // A chain in which each hears the one before: all hear the first, through others.
            let mut chain = Graph::from_arcs(n, &(1..n).map(|i| (i, i - 1)).collect::<Vec<_>>());
            assert_eq!(chain.globally_reachable(), [0]);
            assert!(chain.is_connected() && chain.hears(n - 1, n - 2) && !chain.hears(n - 2, n - 1));
            chain.set(n - 1, n - 2, false);
            assert!(!chain.can_agree() && !chain.is_connected());
            assert!(chain.union(&Graph::from_arcs(n, &[(n - 1, 0)])).can_agree());
        }
        let larger = Graph::from_arcs(65, &[(64, 0)]).union(&Graph::complete(3));
        assert_eq!(larger.arcs().count(), 7);
    }

    #[test]
    #[should_panic(expected = "arc (0, 3)")]
    fn an_arc_to_nowhere_is_refused() {
        Graph::from_arcs(3, &[(0, 3)]);
    }

    fn any_graph() -> impl Strategy<Value = Graph> {
        (1usize..9).prop_flat_map(|n| {
            prop::collection::vec((0..n, 0..n), 0..2 * n).prop_map(move |arcs| Graph::from_arcs(n, &arcs))
        })
    }

    proptest! {
        #[test]
        fn agreement_is_a_simple_zero_eigenvalue(graph in any_graph()) {
            // Lemma 3.9 and its converse: rank L = n - 1 exactly when some vertex is globally reachable.
            let rank = graph.laplacian().rank(1e-9);
            prop_assert_eq!(graph.can_agree(), rank + 1 == graph.len());
        }

        #[test]
        fn rows_of_the_laplacian_sum_to_zero(graph in any_graph()) {
            let ones = DVector::from_element(graph.len(), 1.0);
            prop_assert_eq!((graph.laplacian() * &ones).amax(), 0.0);
            prop_assert!((graph.normalised_laplacian() * &ones).amax() < 1e-15);
        }

        #[test]
        fn renaming_vertices_changes_no_property(graph in any_graph()) {
            let n = graph.len();
            let arcs: Vec<_> = graph.arcs().map(|(i, j)| (n - 1 - i, n - 1 - j)).collect();
            let renamed = Graph::from_arcs(n, &arcs);
            prop_assert_eq!(graph.can_agree(), renamed.can_agree());
            prop_assert_eq!(graph.is_connected(), renamed.is_connected());
            let mut heard: Vec<_> = renamed.globally_reachable().into_iter().map(|i| n - 1 - i).collect();
            heard.sort_unstable();
            prop_assert_eq!(graph.globally_reachable(), heard);
        }
    }
}
