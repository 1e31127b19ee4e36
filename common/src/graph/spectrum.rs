//! Eigenvalues that say how fast a graph agrees, and the error vector that measures it (section 4.2.2).
//!
//! Where gains are asked for, they are the k_i > 0 of K = diag(k_i), one per vehicle; β := K⁻¹1.

use nalgebra::{Complex, DMatrix, DVector, SymmetricEigen};

use super::Graph;

/// Eigenvalues of a symmetric matrix in increasing order; only its lower triangle is read. None at all if it holds
/// something that is not a finite number (or should the iteration not settle, which has not been seen).
pub fn symmetric_eigenvalues(matrix: &DMatrix<f64>) -> Vec<f64> {
    if matrix.is_empty() || matrix.iter().any(|entry| !entry.is_finite()) {
        return Vec::new();
    }
    // Two or three steps for each eigenvalue are usual.
    let most_steps = 300 * matrix.nrows();
    let Some(found) = SymmetricEigen::try_new(matrix.clone(), f64::EPSILON, most_steps) else { return Vec::new() };
    let mut eigenvalues: Vec<f64> = found.eigenvalues.iter().copied().collect();
    eigenvalues.sort_unstable_by(f64::total_cmp);
    eigenvalues
}

/// Eigenvalues of any square matrix, by real part and then by imaginary part; `None` if it holds something that is not
/// a finite number (or should the iteration that looks for them not settle, which has not been seen).
///
/// Laplacians of one-way networks often have many equal eigenvalues and few eigenvectors; the real Schur decomposition
/// of nalgebra 0.35 does not end on some of them and gives NaN for others. This is the textbook's complex QR iteration.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if !matrix.is_square() || matrix.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let mut eigenvalues = match matrix.nrows() {
        0 | 1 => matrix.iter().map(|&entry| Complex::from(entry)).collect(),
        _ => hessenberg_eigenvalues(matrix.clone().hessenberg().unpack_h().map(Complex::from))?,
    };
    // A complex iteration leaves rounding errors where a real eigenvalue has no imaginary part.
    let rounding = matrix.norm() * matrix.nrows() as f64 * f64::EPSILON;
    for eigenvalue in eigenvalues.iter_mut().filter(|eigenvalue| eigenvalue.im.abs() <= rounding) {
        eigenvalue.im = 0.0;
    }
    eigenvalues.sort_unstable_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
    Some(eigenvalues)
}

/// QR iteration with Wilkinson's shift on a Hessenberg matrix, splitting off eigenvalues at its end.
fn hessenberg_eigenvalues(mut h: DMatrix<Complex<f64>>) -> Option<Vec<Complex<f64>>> {
    /// Steps for one eigenvalue; two or three are usual.
    const MOST_STEPS: usize = 300;
    let negligible = h.norm() * f64::EPSILON;
    let (mut last, mut steps) = (h.nrows() - 1, 0);
    while last > 0 {
        let first = (1..=last).rev().find(|&k| h[(k, k - 1)].norm() <= negligible).unwrap_or(0);
        if first == last {
            (last, steps) = (last - 1, 0);
            continue;
        }
        if steps == MOST_STEPS {
            return None;
        }
        steps += 1;
        // An odd shift now and then, against cycles.
        let shift = if steps % 10 == 0 {
            h[(last, last)] + h[(last, last - 1)].norm()
        } else {
            wilkinson_shift(h[(last - 1, last - 1)], h[(last - 1, last)], h[(last, last - 1)], h[(last, last)])
        };
        qr_step(&mut h, first, last, shift);
    }
    Some(h.diagonal().iter().copied().collect())
}

/// The eigenvalue of \[a b; c d\] that is nearer to d.
fn wilkinson_shift(a: Complex<f64>, b: Complex<f64>, c: Complex<f64>, d: Complex<f64>) -> Complex<f64> {
    let half = (a - d) * 0.5;
    let root = (half * half + b * c).sqrt();
    let farther = if (half + root).norm() >= (half - root).norm() { half + root } else { half - root };
    // The two differences from d multiply to -bc: dividing by the larger one loses no digits.
    if farther.norm() > 0.0 { d - b * c / farther } else { d }
}

/// H − σI = QR, then H := RQ + σI, on the rows and columns first..=last.
fn qr_step(h: &mut DMatrix<Complex<f64>>, first: usize, last: usize, shift: Complex<f64>) {
    for k in first..=last {
        h[(k, k)] -= shift;
    }
    let mut rotations = Vec::with_capacity(last - first);
    for k in first..last {
        let (a, b) = (h[(k, k)], h[(k + 1, k)]);
        let length = a.norm().hypot(b.norm());
        let (c, s) = if length > 0.0 { (a / length, b / length) } else { (Complex::from(1.0), Complex::from(0.0)) };
        rotations.push((c, s));
        for column in k..=last {
            let (upper, lower) = (h[(k, column)], h[(k + 1, column)]);
            h[(k, column)] = c.conj() * upper + s.conj() * lower;
            h[(k + 1, column)] = c * lower - s * upper;
        }
    }
    for (k, (c, s)) in (first..last).zip(rotations) {
        for row in first..=k + 1 {
            let (left, right) = (h[(row, k)], h[(row, k + 1)]);
            h[(row, k)] = left * c + right * s;
            h[(row, k + 1)] = right * c.conj() - left * s.conj();
        }
    }
    for k in first..=last {
        h[(k, k)] += shift;
    }
}

/// λ_2, the connectivity of a graph with two-way links: the second smallest eigenvalue of L, positive iff connected.
/// `None` for one-way links or fewer than two vertices.
#[doc(alias = "λ_2")]
pub fn lambda_2(graph: &Graph) -> Option<f64> {
    let eigenvalues = graph.is_undirected().then(|| symmetric_eigenvalues(&graph.laplacian()))?;
    eigenvalues.get(1).map(|lambda_2| lambda_2.max(0.0))
}

/// β := K⁻¹1 (4.12).
#[doc(alias = "β")]
pub fn beta(gains: &[f64]) -> DVector<f64> {
    DVector::from_iterator(gains.len(), gains.iter().map(|k| 1.0 / k))
}

/// ℒ_β := I − 1β'/(β'1) (4.13), which takes γ to its errors γ~ = ℒ_β γ from the average that K weighs.
#[doc(alias = "L_β")]
pub fn l_beta(gains: &[f64]) -> DMatrix<f64> {
    let n = gains.len();
    let beta = beta(gains);
    DMatrix::identity(n, n) - DVector::from_element(n, 1.0) * beta.transpose() / beta.sum()
}

/// λ_m of Lemma 4.1, property 8: the least v'Lv/v'v with β'v = 0, over those of the graphs that are connected.
///
/// Computed as the least eigenvalue of L restricted to the complement of β; the closed form in the thesis is only a
/// lower bound of it (erratum 4.6), see [`lambda_m_lower_bound`]. `None` without a connected graph, if any graph has
/// one-way links or another number of vertices than gains, or if a gain is not positive.
#[doc(alias = "λ_m")]
pub fn lambda_m(graphs: &[Graph], gains: &[f64]) -> Option<f64> {
    let complement = orthogonal_complement(&beta(gains));
    least_over_connected(graphs, gains, |graph| {
        symmetric_eigenvalues(&(complement.transpose() * graph.laplacian() * &complement)).first().copied()
    })
}

/// λ_{2,m} of Lemma 4.1, property 8: the least connectivity among those of the graphs that are connected.
/// `None` as for [`lambda_m`].
#[doc(alias = "λ_2,m")]
pub fn lambda_2m(graphs: &[Graph], gains: &[f64]) -> Option<f64> {
    least_over_connected(graphs, gains, lambda_2)
}

/// (β'1)²/(n β'β) λ_{2,m} ≤ λ_m: the closed form of Lemma 4.1, property 8, with equality for complete graphs
/// (erratum 4.6). `None` as for [`lambda_m`].
///
/// Off its mean, v with β'v = 0 keeps at least that part of its squared length: its mean part is (1'v)²/n =
/// ((1 − cβ)'v)²/n ≤ |1 − cβ|²|v|²/n for every c, and the best c leaves 1 − (β'1)²/(n β'β) of |v|².
pub fn lambda_m_lower_bound(graphs: &[Graph], gains: &[f64]) -> Option<f64> {
    let beta = beta(gains);
    let kept = beta.sum().powi(2) / (beta.len() as f64 * beta.norm_squared());
    lambda_2m(graphs, gains).map(|lambda_2m| kept * lambda_2m)
}

/// The least λ_2(K^½ L K^½) over those of the graphs that are connected: exactly how fast ½ γ~'K⁻¹γ~ can be relied on
/// to decay, at twice this rate. At least k_m λ_m. `None` as for [`lambda_m`].
pub fn lambda_2_weighted(graphs: &[Graph], gains: &[f64]) -> Option<f64> {
    let root = DMatrix::from_diagonal(&DVector::from_iterator(gains.len(), gains.iter().map(|k| k.sqrt())));
    least_over_connected(graphs, gains, |graph| {
        symmetric_eigenvalues(&(&root * graph.laplacian() * &root)).get(1).copied()
    })
}

fn least_over_connected(graphs: &[Graph], gains: &[f64], value: impl Fn(&Graph) -> Option<f64>) -> Option<f64> {
    let fits = |graph: &Graph| graph.len() == gains.len() && graph.is_undirected();
    if !graphs.iter().all(fits) || !gains.iter().all(|&k| k > 0.0 && k.is_finite()) {
        return None;
    }
    graphs.iter().filter(|graph| graph.is_connected()).filter_map(value).min_by(f64::total_cmp)
}

/// Columns that complete b/|b| to an orthonormal basis; b must not be zero. Unit vectors if b is one.
///
/// They are the columns of the reflection that takes b to its largest axis, without that one.
pub(crate) fn orthogonal_complement(b: &DVector<f64>) -> DMatrix<f64> {
    let n = b.len();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let pivot = b.iamax();
    let mut normal = b / b.norm();
    normal[pivot] += normal[pivot].signum();
    let reflection = DMatrix::identity(n, n) - &normal * normal.transpose() * (2.0 / normal.norm_squared());
    reflection.remove_column(pivot)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};
    use proptest::prelude::*;

    /// Every graph with two-way links on n vertices, connected or not.
    pub(crate) fn all_graphs(n: usize) -> Vec<Graph> {
        let pairs: Vec<(usize, usize)> = (0..n).flat_map(|j| (0..j).map(move |i| (i, j))).collect();
        (0..1u32 << pairs.len())
            .map(|chosen| {
                let edges: Vec<_> =
                    pairs.iter().enumerate().filter(|(e, _)| chosen >> e & 1 == 1).map(|(_, pair)| *pair).collect();
                Graph::from_edges(n, &edges)
            })
            .collect()
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9 * (1.0 + a.abs().max(b.abs()))
    }

    #[test]
    fn example_3_4_has_the_printed_eigenvalues() {
        let graph = Graph::from_arcs(3, &[(0, 1), (0, 2), (2, 0)]);
        let found = eigenvalues(&graph.laplacian()).expect("it settles");
        let golden = (3.0 - 5f64.sqrt()) / 2.0;
        for (eigenvalue, expected) in found.iter().zip([0.0, golden, 3.0 - golden]) {
            assert!((eigenvalue - expected).norm() < 1e-12, "{eigenvalue} {expected}");
        }
        assert_eq!(((golden * 100.0).round(), ((3.0 - golden) * 100.0).round()), (38.0, 262.0), "as printed");
        assert_eq!(lambda_2(&graph), None, "no symmetric Laplacian");
    }

    #[test]
    fn a_cycle_has_its_eigenvalues_on_a_circle() {
        // 1 - exp(2 pi i k / n); permutation matrices are where careless QR iterations never end.
        for n in [3, 4, 7, 64] {
            let arcs: Vec<_> = (0..n).map(|i| (i, (i + 1) % n)).collect();
            let found = eigenvalues(&Graph::from_arcs(n, &arcs).laplacian()).expect("it settles");
            assert_eq!(found.len(), n);
            assert!(found.iter().all(|eigenvalue| close((1.0 - eigenvalue).norm(), 1.0)));
            let k_1 = 1.0 - (std::f64::consts::TAU / n as f64).cos();
            assert!(close(found[1].re, k_1), "{n}: {}", found[1]);
        }
    }

    #[test]
    fn a_nearly_defective_laplacian_settles_too() {
        // Implicit real QR iterations have been seen to circle for ever on this one.
        let arcs = [(2, 7), (6, 1), (6, 3), (5, 8), (1, 6), (5, 1), (8, 2), (8, 6), (3, 0), (4, 7)];
        let l = Graph::from_arcs(9, &arcs).laplacian();
        let found = eigenvalues(&l).expect("it settles");
        // 0 and 7 listen to nobody; without 1 and 6, who hear each other, everybody's own degree is an eigenvalue.
        let mut expected = vec![0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0];
        let golden = (3.0 - 5f64.sqrt()) / 2.0;
        expected.extend([golden, 3.0 - golden]);
        expected.sort_by(f64::total_cmp);
        for (eigenvalue, expected) in found.iter().zip(expected) {
            assert!((eigenvalue - expected).norm() < 1e-4, "{eigenvalue} {expected}");
        }
    }

    #[test]
    fn equal_eigenvalues_are_numbers() {
        // 2 hears three, 7 and 8 hear one each: a triangular Laplacian with its degrees as eigenvalues.
        let l = Graph::from_arcs(9, &[(7, 6), (2, 5), (8, 7), (2, 0), (2, 3)]).laplacian();
        let found = eigenvalues(&l).expect("it settles");
        for (eigenvalue, expected) in found.iter().zip([0., 0., 0., 0., 0., 0., 1., 1., 3.]) {
            assert!((eigenvalue - expected).norm() < 1e-7, "{eigenvalue} {expected}");
        }
    }

    #[test]
    fn connectivity_of_known_graphs() {
        let path = Graph::from_edges(4, &[(0, 1), (1, 2), (2, 3)]);
        assert!(close(lambda_2(&path).expect("two-way"), 2.0 - 2f64.sqrt()));
        assert!(close(lambda_2(&Graph::complete(5)).expect("two-way"), 5.0));
        assert!(close(lambda_2(&Graph::from_edges(4, &[(0, 1), (2, 3)])).expect("two-way"), 0.0));
        assert_eq!((lambda_2(&Graph::empty(1)), lambda_2(&Graph::empty(0))), (None, None));
    }

    #[test]
    fn erratum_4_6_the_closed_form_is_only_a_bound() {
        let (graphs, gains) = (all_graphs(3), [1.0, 2.0, 4.0]);
        assert!((lambda_m(&graphs, &gains).expect("some are connected") - 0.783_39).abs() < 5e-6);
        assert!((lambda_m_lower_bound(&graphs, &gains).expect("some are connected") - 7.0 / 9.0).abs() < 1e-12);
        let complete = [Graph::complete(3)];
        let [truth, bound] = [lambda_m, lambda_m_lower_bound].map(|f| f(&complete, &gains).expect("connected"));
        assert!(close(truth, bound) && close(truth, 3.0 * 7.0 / 9.0), "equal for the complete graph");
    }

    #[test]
    fn equal_gains_leave_the_connectivity() {
        let graphs = all_graphs(4);
        let [a, b, c] = [lambda_m, lambda_2m, lambda_m_lower_bound].map(|f| f(&graphs, &[0.3; 4]).expect("connected"));
        let path = 2.0 - 2f64.sqrt();
        assert!(close(a, path) && close(b, path) && close(c, path), "the path is the least connected graph");
    }

    #[test]
    fn what_cannot_be_answered_is_not() {
        let path = [Graph::from_edges(3, &[(0, 1), (1, 2)])];
        for gains in [&[1.0, 1.0][..], &[1.0, 0.0, 1.0], &[1.0, -1.0, 1.0], &[1.0, f64::NAN, 1.0], &[]] {
            assert_eq!((lambda_m(&path, gains), lambda_m_lower_bound(&path, gains)), (None, None), "{gains:?}");
        }
        assert_eq!(lambda_m(&[Graph::empty(3)], &[1.0; 3]), None, "never connected");
        assert_eq!(lambda_m(&[Graph::from_arcs(2, &[(0, 1)])], &[1.0; 2]), None, "one-way");
        assert_eq!(lambda_m(&[Graph::complete(1)], &[1.0]), None, "nobody to disagree with");
        let one_of_them = [Graph::complete(3), Graph::from_arcs(3, &[(0, 1)])];
        assert_eq!(lambda_m(&one_of_them, &[1.0; 3]), None, "one is one-way");
        assert_eq!(lambda_2m(&[Graph::complete(3), Graph::complete(2)], &[1.0; 3]), None, "one is of another size");
        assert_eq!(lambda_2_weighted(&path, &[1.0, f64::INFINITY, 1.0]), None);
        assert!(symmetric_eigenvalues(&dmatrix![1.0, 0.0; 0.0, f64::NAN]).is_empty());
        assert!(symmetric_eigenvalues(&DMatrix::zeros(0, 0)).is_empty());
        assert_eq!(eigenvalues(&dmatrix![f64::NAN]), None);
    }

    #[test]
    fn the_complement_of_an_axis_is_the_other_axes() {
        assert_eq!(orthogonal_complement(&dvector![0.0, 3.0, 0.0]), dmatrix![1., 0.; 0., 0.; 0., 1.]);
    }

    /// A graph with two-way links, gains and a state, all of one size.
    pub(crate) fn a_fleet() -> impl Strategy<Value = (Graph, Vec<f64>, DVector<f64>)> {
        (2usize..7).prop_flat_map(|n| {
            let edges = prop::collection::vec((0..n, 0..n), 1..2 * n);
            let gains = prop::collection::vec(0.1..5.0f64, n);
            let state = prop::collection::vec(-10.0..10.0f64, n);
            (edges, gains, state)
                .prop_map(move |(edges, gains, state)| (Graph::from_edges(n, &edges), gains, DVector::from_vec(state)))
        })
    }

    proptest! {
        #[test]
        fn lemma_4_1((graph, gains, gamma) in a_fleet()) {
            let n = gains.len();
            let (l_beta, beta, l) = (l_beta(&gains), beta(&gains), graph.laplacian());
            let k = DMatrix::from_diagonal(&DVector::from_vec(gains.clone()));
            let k_inverse = DMatrix::from_diagonal(&beta);
            let ones = DVector::from_element(n, 1.0);
            let error = &l_beta * &gamma;
            // 1: a projection of rank n - 1 with these null vectors.
            prop_assert!((&l_beta * &ones).amax() < 1e-12 && (beta.transpose() * &l_beta).amax() < 1e-12);
            prop_assert!((&l_beta * &l_beta - &l_beta).amax() < 1e-12 && close(l_beta.trace(), n as f64 - 1.0));
            // 2, 5 and 6.
            prop_assert!((&l_beta * &k * &l - &k * &l).amax() < 1e-10);
            prop_assert!(beta.dot(&error).abs() < 1e-10);
            prop_assert!((&l * &error - &l * &gamma).amax() < 1e-10);
            // 3, whose left side needs a transpose that the print misplaces (erratum 4.8).
            let (of_error, of_state) = (error.dot(&(&k_inverse * &error)), gamma.dot(&(&k_inverse * &gamma)));
            prop_assert!(of_error <= of_state * (1.0 + 1e-12));
            // 4: equal states have no error, and only they.
            prop_assert!((&l_beta * (&ones * 3.0)).amax() < 1e-12);
            prop_assert!(error.norm() > 1e-9 || gamma.max() - gamma.min() < 1e-8);
            // 7.
            let size = error.norm() * (1.0 + 1e-12);
            prop_assert!(gamma.max() - gamma.min() <= 2f64.sqrt() * size + 1e-12);
            prop_assert!((&k * &l * &gamma).norm() <= n as f64 * size * k.amax() + 1e-12);
            // 9.
            let z = &l * &gamma;
            for i in 0..n {
                let heard: f64 = graph.neighbours(i).map(|j| gamma[i] - gamma[j]).sum();
                prop_assert!((z[i] - heard).abs() < 1e-10);
            }
        }

        #[test]
        fn lemma_4_1_property_8_orders_its_rates((graph, gains, gamma) in a_fleet()) {
            let graphs = [graph.clone()];
            let Some(truth) = lambda_m(&graphs, &gains) else {
                prop_assert!(!graph.is_connected());
                return Ok(());
            };
            let bound = lambda_m_lower_bound(&graphs, &gains).unwrap_or(f64::NAN);
            let connectivity = lambda_2m(&graphs, &gains).unwrap_or(f64::NAN);
            let weighted = lambda_2_weighted(&graphs, &gains).unwrap_or(f64::NAN);
            let k_m = gains.iter().copied().fold(f64::INFINITY, f64::min);
            prop_assert!(0.0 < bound && bound <= truth + 1e-9 && truth <= connectivity + 1e-9);
            prop_assert!(k_m * truth <= weighted + 1e-9);
            // The inequality that the lemma is for, and the sharper one.
            let error = l_beta(&gains) * &gamma;
            let dissipation = error.dot(&(graph.laplacian() * &error));
            prop_assert!(dissipation >= truth * error.norm_squared() - 1e-8);
            let v_2 = 0.5 * error.dot(&error.component_mul(&beta(&gains)));
            prop_assert!(dissipation >= 2.0 * weighted * v_2 - 1e-8);
        }

        #[test]
        fn eigenvalues_sum_to_the_trace(arcs in prop::collection::vec((0usize..9, 0usize..9), 0..40)) {
            let l = Graph::from_arcs(9, &arcs).laplacian();
            let found = eigenvalues(&l).expect("it settles");
            let sum: Complex<f64> = found.iter().sum();
            prop_assert!((sum - l.trace()).norm() < 1e-9);
            let squares: Complex<f64> = found.iter().map(|eigenvalue| eigenvalue * eigenvalue).sum();
            prop_assert!((squares - (&l * &l).trace()).norm() < 1e-8);
            // Gershgorin: no eigenvalue of a Laplacian lies left of the imaginary axis. Defective ones are found
            // only to the root of the rounding error.
            prop_assert!(found.iter().all(|eigenvalue| eigenvalue.re > -1e-2));
        }
    }
}
