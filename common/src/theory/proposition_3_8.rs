//! Proposition 3.8 and Lemma 6.1: speeds stay bounded with the saturated law (3.45), so path following and coordination
//! go together.
//!
//! What the proof needs is Q = C⁻¹A⁻¹L + LC⁻¹A⁻¹ + 2C⁻¹A > 0 for every C on the way. (3.97) is enough for that by
//! Geršgorin's circles, not necessary: Figures 3.7 and 3.8 break it and are fine (erratum 3.14). So Q itself is looked at
//! too, with the R_i that occur.

use nalgebra::DMatrix;

use super::Verdict;
use crate::graph::Graph;
use crate::graph::spectrum::symmetric_eigenvalues;

/// ½(c_2/c_1 − a_1/a_2) max |N_i|: what a_1² must exceed (3.97), for gains and R_i within their bounds.
pub fn threshold(graph: &Graph, a: &[f64], r: &[f64]) -> f64 {
    let most = (0..graph.len()).map(|i| graph.degree(i)).max().unwrap_or(0) as f64;
    0.5 * (spread(r) - 1.0 / spread(a)) * most
}

/// Largest over smallest.
fn spread(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0f64), |(low, high), &v| (low.min(v), high.max(v)));
    high / low
}

/// The least eigenvalue of Q = C⁻¹A⁻¹L + LC⁻¹A⁻¹ + 2C⁻¹A (Lemma 6.1) for these R_i; `None` if sizes differ.
pub fn least_eigenvalue(graph: &Graph, a: &[f64], r: &[f64]) -> Option<f64> {
    let n = graph.len();
    if a.len() != n || r.len() != n {
        return None;
    }
    let l = graph.laplacian();
    let q = DMatrix::from_fn(n, n, |i, j| {
        l[(i, j)] * (r[i] / a[i] + r[j] / a[j]) + if i == j { 2.0 * r[i] * a[i] } else { 0.0 }
    });
    symmetric_eigenvalues(&q).first().copied()
}

/// What the proposition says of a fleet with gains a_i that meets these R_i on its way, one list for each place.
///
/// It holds if (3.97) does at every place, or else if Q > 0 at every place, and if the network is `fixed`: it never changes, and passes
/// everything on at once.
pub fn verdict(graph: &Graph, a: &[f64], places: &[Vec<f64>], fixed: bool) -> Verdict {
    let a_1 = a.iter().copied().fold(f64::INFINITY, f64::min);
    // C changes along the way, and the bounds (3.42) are those over all places.
    let all: Vec<f64> = places.iter().flatten().copied().collect();
    let threshold = threshold(graph, a, &all);
    let least = places.iter().filter_map(|r| least_eigenvalue(graph, a, r)).min_by(f64::total_cmp);
    let meets = a_1 * a_1 > threshold;
    let two_way = graph.is_undirected() && graph.is_connected();
    Verdict {
        name: "Proposition 3.8 (bounded speeds)",
        condition: format!(
            "fixed two-way connected network, no delay, no loss; Q > 0, for which a₁² > {threshold:.4} (3.97) is enough"
        ),
        value: format!(
            "a₁² = {:.4}{}, least eigenvalue of Q {}{}",
            a_1 * a_1,
            if meets { "" } else { ", not enough" },
            least.map_or("–".to_owned(), |least| format!("{least:.4}")),
            if fixed { "" } else { ", the network changes, delays or loses" }
        ),
        holds: fixed && two_way && (meets || least.is_some_and(|least| least > 0.0)),
        norm_rate: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::linear_coordination::tests::connected_graph;
    use proptest::prelude::*;

    #[test]
    fn erratum_3_14_figure_3_7_breaks_the_bound_and_is_fine() {
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let legs = [vec![2.0, 3.0, 4.0], vec![1.0; 3], vec![4.0, 3.0, 2.0]];
        assert!((threshold(&star, &[1.0; 3], &legs[0]) - 1.0).abs() < 1e-12, "1 > 1 on an arc");
        assert!((threshold(&star, &[1.0; 3], &legs.concat()) - 3.0).abs() < 1e-12, "1 > 3 on all legs");
        let least = |r: &Vec<f64>| least_eigenvalue(&star, &[1.0; 3], r).expect("sizes fit");
        let of_legs: Vec<f64> = legs.iter().map(least).collect();
        assert!(of_legs.iter().all(|&least| (2.0 - 1e-9..5.2).contains(&least)), "{of_legs:?}");
        let verdict = verdict(&star, &[1.0; 3], &legs, true);
        assert!(verdict.holds && verdict.value.contains("not enough"));
    }

    #[test]
    fn very_different_paths_break_it() {
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let verdict = verdict(&star, &[0.2; 3], &[vec![20.0, 1.0, 1.0]], true);
        assert!(!verdict.holds, "{verdict:?}");
        assert_eq!(least_eigenvalue(&star, &[1.0; 2], &[1.0; 3]), None);
    }

    proptest! {
        #[test]
        fn lemma_6_1_the_bound_is_enough(
            graph in connected_graph(), r in prop::collection::vec(0.5..3.0f64, 6), a in prop::collection::vec(0.5..3.0f64, 6)
        ) {
            let (a, r) = (&a[..graph.len()], &r[..graph.len()]);
            let a_1 = a.iter().copied().fold(f64::INFINITY, f64::min);
            // Raised until they meet (3.97).
            let needed = (threshold(&graph, a, r).max(0.0)).sqrt() / a_1 * 1.001;
            let a: Vec<f64> = a.iter().map(|a| a * needed.max(1.0)).collect();
            prop_assert!(least_eigenvalue(&graph, &a, r).expect("sizes fit") > 0.0);
        }
    }

    #[test]
    fn unlike_gains_and_radii_by_hand() {
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        // ½(3 − ½)·2: R differ by 3, gains by 2, and the centre has two neighbours.
        assert!((threshold(&star, &[1.0, 2.0, 1.0], &[0.2, 0.6, 0.3]) - 2.5).abs() < 1e-12);
        // A pair with a = (1, 2), R = (1, 3): Q = [4 −2.5; −2.5 15].
        let least = least_eigenvalue(&Graph::complete(2), &[1.0, 2.0], &[1.0, 3.0]).expect("sizes fit");
        assert!((least - (19.0 - 146f64.sqrt()) / 2.0).abs() < 1e-9, "{least}");
        assert_eq!(least_eigenvalue(&star, &[1.0; 3], &[1.0; 2]), None);
        // The star with R = (2, 1, 1): [12 −3 −3; −3 4 0; −3 0 4], with 4 and 8 ∓ √34.
        let least = least_eigenvalue(&star, &[1.0; 3], &[2.0, 1.0, 1.0]).expect("sizes fit");
        assert!((least - (8.0 - 34f64.sqrt())).abs() < 1e-9, "{least}");
    }

    #[test]
    fn either_condition_will_do_on_a_two_way_connected_network_only() {
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let at = |graph: &Graph, r: [f64; 3]| verdict(graph, &[0.5; 3], &[r.to_vec()], true);
        // (3.97) with a_1² = 0.25: 0.2 is enough, 0.4 is not, but Q is still positive there.
        let meets = at(&star, [1.2, 1.0, 1.0]);
        assert!(meets.holds && meets.value.starts_with("a₁² = 0.2500,") && !meets.value.contains("not enough"));
        let fails = at(&star, [1.12, 0.8, 0.8]);
        assert!(fails.holds && fails.value.starts_with("a₁² = 0.2500, not enough"), "{fails:?}");
        let least = least_eigenvalue(&star, &[0.5; 3], &[1.12, 0.8, 0.8]).expect("sizes fit");
        assert!((0.5..1.0).contains(&least), "{least}");
        // The same numbers, but somebody hears nobody, or is not heard.
        for graph in [Graph::from_arcs(3, &[(0, 1), (1, 2), (2, 0)]), Graph::from_edges(3, &[(0, 1)])] {
            assert!(threshold(&graph, &[0.5; 3], &[1.0; 3]) <= 0.0 && !at(&graph, [1.0; 3]).holds);
        }
        // The same numbers, but late or lost.
        let late = verdict(&star, &[0.5; 3], &[vec![1.2, 1.0, 1.0]], false);
        assert!(!late.holds && late.value.contains("changes, delays or loses"), "{late:?}");
        // One place where Q is not positive is enough to fail.
        assert!(!verdict(&star, &[0.2; 3], &[vec![1.0; 3], vec![20.0, 1.0, 1.0]], true).holds);
    }
}
