//! How fast neighbours in a row agree (Figure 2.7-3): the eigenvalues behind result x of docs/errata.md.
//!
//! In w_i = v_i/R_i − v_L the radii cancel. With θ = F_2ξ and F_1, F_2 of (3.6), its integral q, and the told vehicle's own
//! integral p,
//!
//! ```text
//! w' = −aw − bLF_1θ − cLF_1q − b_0 p e_told,    θ' = F_2w,    q' = θ,    p' = w_told
//! ```

use nalgebra::DMatrix;

use crate::graph::Graph;
use crate::graph::incidence::Differences;
use crate::graph::spectrum::eigenvalues;

/// The rate of the slowest mode on circles and lines \[1/s\], negative if it grows, for the gains a, b, c of all vehicles and
/// b_0 of the told one. `None` if the graph is not two-way and connected, or has no such vehicle.
pub fn rate(graph: &Graph, told: usize, [a, b, c]: [f64; 3], b_0: f64) -> Option<f64> {
    let n = graph.len();
    if told >= n || !graph.is_undirected() || !graph.is_connected() {
        return None;
    }
    let split = Differences::of(graph)?;
    let pull = graph.laplacian() * &split.f_1;
    let (theta, q, p) = (n, 2 * n - 1, 3 * n - 2);
    let mut closed = DMatrix::zeros(3 * n - 1, 3 * n - 1);
    closed.view_mut((0, 0), (n, n)).fill_diagonal(-a);
    closed.view_mut((0, theta), (n, n - 1)).copy_from(&(&pull * -b));
    closed.view_mut((0, q), (n, n - 1)).copy_from(&(&pull * -c));
    closed[(told, p)] = -b_0;
    closed.view_mut((theta, 0), (n - 1, n)).copy_from(&split.f_2);
    closed.view_mut((q, theta), (n - 1, n - 1)).fill_diagonal(1.0);
    closed[(p, told)] = 1.0;
    eigenvalues(&closed)?.iter().map(|eigenvalue| -eigenvalue.re).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::rate;
    use crate::graph::Graph;
    use crate::theory::gateway_2_35::Gateway;
    use crate::theory::linear_coordination::tests::connected_graph;
    use proptest::prelude::*;

    #[test]
    fn who_is_cut_off_does_not_agree() {
        let gains = [3.0, 3.0, 1.0];
        assert_eq!(rate(&Graph::from_edges(3, &[(0, 1)]), 0, gains, 5.0), None);
        assert_eq!(rate(&Graph::from_arcs(2, &[(0, 1)]), 0, gains, 5.0), None);
        assert_eq!(rate(&Graph::complete(2), 2, gains, 5.0), None);
        assert!(rate(&Graph::complete(2), 1, gains, 5.0).is_some());
    }

    proptest! {
        #[test]
        fn on_a_star_it_is_the_gateway(
            n in 2usize..6, a in 0.5..4.0f64, b in 0.2..4.0f64, part in 0.05..0.95f64, b_0 in 0.1..8.0f64
        ) {
            let (c, star) = (part * a * b, (1..n).map(|i| (0, i)).collect::<Vec<_>>());
            let gateway = Gateway { a, distance: vec![b, c], b_0, n }.verdict(false).norm_rate.expect("stable");
            let found = rate(&Graph::from_edges(n, &star), 0, [a, b, c], b_0).expect("connected");
            prop_assert!((found - gateway).abs() < 1e-3 * gateway.max(1.0), "{} {}", found, gateway);
        }

        #[test]
        fn result_x_every_connected_graph_will_do(
            graph in connected_graph(), a in 0.5..4.0f64, b in 0.2..4.0f64, part in 0.05..0.9f64, b_0 in 0.1..8.0f64
        ) {
            for told in 0..graph.len() {
                let found = rate(&graph, told, [a, b, part * a * b], b_0).expect("connected");
                prop_assert!(found > 0.0, "{} {}", told, found);
            }
        }
    }
}
