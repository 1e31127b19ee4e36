//! Curves that theory gives without a run, as SVG: for `check --figures`.
//!
//! | figure | shows | source |
//! |---|---|---|
//! | `figure-2-8.svg` | roots of (2.38) while λ_p passes its critical value; ξ = 0.4, k = 0.25 | Figure 2.8, erratum 2.3 |
//! | `eigenvalues.svg` | σ(L) of this mission's graph and the parabola of (3.73) within which a²/b must leave it | (3.73) |
//! | `loss-rate.svg` | the guaranteed rate over the loss rate α, for this mission's law | Theorem 4.4 |

use common::graph::spectrum;
use common::mission::Mission;
use common::mission::file::LawChoice;
use common::theory::decoupling_2_37 as decoupling;
use common::theory::theorem_4_4::Coordination;

use super::network::Network;
use crate::results::{Chart, Curve, Figure};

/// ξ \[rad/s\] and k \[rad²/s²\] of Figure 2.8.
const FIGURE_2_8: (f64, f64) = (0.4, 0.25);

/// The figures about this mission, and Figure 2.8.
pub fn figures(mission: &Mission) -> Vec<Figure> {
    let network = Network::of(mission);
    [Some(figure_2_8()), eigenvalues(&network), loss_rate(mission, &network)].into_iter().flatten().collect()
}

fn figure_2_8() -> Figure {
    let (xi, k) = FIGURE_2_8;
    let critical = decoupling::critical_lambda_p(xi, k);
    let locus = |from: f64, to: f64| {
        let roots = decoupling::root_locus(xi, k, from, to, 300);
        roots.into_iter().flat_map(|(_, roots)| roots).map(|root| (root.re, root.im)).collect::<Vec<_>>()
    };
    Chart {
        name: "figure-2-8",
        title: "Root locus, Figure 2.8".into(),
        caption: format!(
            "Roots of (2.38) for ξ = {xi} rad/s and k = {k} rad²/s² while λ_p grows from {:.3} to {:.3} rad/s. They are \
             all in the left half-plane from λ_p = {critical:.4} rad/s on.",
            critical - 0.5,
            critical + 2.0
        ),
        x: "real part [rad/s]".into(),
        y: "imaginary part [rad/s]".into(),
        curves: vec![
            Curve::dots(format!("λₚ < {critical:.3}"), locus(critical - 0.5, critical)),
            Curve::dots(format!("λₚ > {critical:.3}"), locus(critical, critical + 2.0)),
            Curve::line("", vec![(0.0, -1.5), (0.0, 1.5)]),
        ],
    }
    .draw()
}

fn eigenvalues(network: &Network) -> Option<Figure> {
    if network.graph.is_undirected() {
        return None;
    }
    let mu = spectrum::eigenvalues(&network.graph.laplacian())?;
    let widest = mu.iter().map(|mu| mu.re).fold(0.0, f64::max).max(1.0) * 1.2;
    let threshold = mu.iter().filter(|mu| mu.norm() > 1e-9).map(|mu| mu.im * mu.im / mu.re).fold(0.0, f64::max);
    let parabola = |sign: f64| {
        (0..=100).map(|i| widest * f64::from(i) / 100.0).map(|re| (re, sign * (threshold * re).sqrt())).collect()
    };
    Some(
        Chart {
            name: "eigenvalues",
            title: "Eigenvalues of L and condition (3.73)".into(),
            caption: format!(
                "σ(L) of the graph of all links. Condition (3.73) asks that all of it lies within the parabola \
                 Im² = (a²/b) Re; the one drawn, a²/b = {threshold:.4}, is the border."
            ),
            x: "Re μ".into(),
            y: "Im μ".into(),
            curves: vec![
                Curve::dots("σ(L)", mu.iter().map(|mu| (mu.re, mu.im)).collect()),
                Curve::line("border of (3.73)", parabola(1.0)),
                Curve::line("", parabola(-1.0)),
            ],
        }
        .draw(),
    )
}

fn loss_rate(mission: &Mission, network: &Network) -> Option<Figure> {
    let LawChoice::Switching(_) = &mission.law_choice else { return None };
    let gains = mission.gains("gain");
    let at = |alpha: f64| {
        let coordination = Coordination::new(&network.graphs, &gains, alpha)?;
        Some((alpha, coordination.rate_of_agreement()))
    };
    let promised: Vec<(f64, f64)> = (0..=100).filter_map(|i| at(f64::from(i) / 100.0)).collect();
    let here = at(network.alpha())?;
    Some(
        Chart {
            name: "loss-rate",
            title: "Guaranteed rate over the loss rate".into(),
            caption: format!(
                "Theorem 4.4, type II, rate of the norm: (1 − α) k_m λ_m. The dot is this mission, α = {:.4}.",
                here.0
            ),
            x: "α".into(),
            y: "rate [1/s]".into(),
            curves: vec![Curve::line("(1 − α) kₘ λₘ", promised), Curve::dots("this mission", vec![here])],
        }
        .draw(),
    )
}

#[cfg(test)]
mod tests {
    use super::figure_2_8;

    #[test]
    fn figure_2_8_names_the_corrected_critical_value() {
        let figure = figure_2_8();
        assert!(figure.caption.contains("0.5876") && figure.svg.contains("imaginary part"));
        assert!(figure.svg.len() < 1_000_000);
    }
}
