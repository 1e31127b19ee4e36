//! Curves that theory gives without a run, as SVG: for `check --figures`.
//!
//! | figure | shows | source |
//! |---|---|---|
//! | `figure-2-8.svg` | roots of (2.38) while λ_p passes its critical value; ξ = 0.4, k = 0.25 | Figure 2.8, erratum 2.3 |
//! | `eigenvalues.svg` | the eigenvalues that a condition on a²/b is about, and the border that this mission's a²/b draws: to the right of it, it holds | (3.73), (3.85), (3.93) |
//! | `loss-rate.svg` | the guaranteed rate over the loss rate α, for this mission's law | Theorem 4.4 |

use common::mission::Mission;
use common::mission::file::{Laplacian, LawChoice};
use common::theory::decoupling_2_37 as decoupling;
use common::theory::proposition_3_6::{DirectedLaw, nonzero_spectrum};
use common::theory::theorem_4_4::Coordination;

use super::directed::with_leader;
use super::network::Network;
use super::surroundings::Way;
use crate::results::{Chart, Curve, Figure};

/// ξ \[rad/s\] and k \[rad²/s²\] of Figure 2.8.
const FIGURE_2_8: (f64, f64) = (0.4, 0.25);

/// The figures about this mission, and Figure 2.8.
pub fn figures(mission: &Mission) -> Vec<Figure> {
    let network = Network::of(mission);
    [Some(figure_2_8()), eigenvalues(mission, &network), loss_rate(mission, &network)].into_iter().flatten().collect()
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

/// The eigenvalues that a condition on a²/b is about, with the border that a²/b draws: to the right of it, the condition holds.
fn eigenvalues(mission: &Mission, network: &Network) -> Option<Figure> {
    let (law, ratio, normalised) = match &mission.law_choice {
        LawChoice::Directed(law) => (DirectedLaw::OverC, law.a * law.a / law.b, false),
        LawChoice::Solution2(law) if !network.graph.is_undirected() => {
            // (3.85) speaks of equal R_i.
            let way = Way::of(mission);
            let r = *way.constant()?.first()?;
            let equal = way.constant()?.iter().all(|other| (other - r).abs() <= 1e-9 * r);
            if !equal {
                return None;
            }
            (DirectedLaw::TimesC(1.0 / r), law.a * law.a / law.b, false)
        }
        LawChoice::TrulyDecentralised(law) => {
            (DirectedLaw::Leader, law.a * law.a / law.b, law.laplacian == Laplacian::Normalised)
        }
        _ => return None,
    };
    let (graph, whose) = match &mission.law_choice {
        LawChoice::TrulyDecentralised(law) => {
            (with_leader(mission, &network.graph, law)?, "the graph with the virtual leader")
        }
        _ => (network.graph.clone(), "the graph of all links"),
    };
    let mu = nonzero_spectrum(&graph, normalised)?;
    let threshold = law.threshold(&mu);
    let equation = law.equation();
    let reach = mu.iter().map(|mu| mu.re.max(mu.im.abs())).fold(0.0, f64::max).max(1.0) * 1.3;
    let border = law.border(ratio, reach, 200);
    let mirrored = border.iter().rev().map(|(re, im)| (*re, -im)).chain(border.iter().copied()).collect();
    let verdict = if ratio > threshold {
        "all are to the right of it, and it holds"
    } else {
        "not all are to the right of it, and it does not hold"
    };
    let shape = match law {
        DirectedLaw::OverC => "Im² = (a²/b) Re",
        DirectedLaw::TimesC(_) => "c² Im² = (a²/b) Re",
        DirectedLaw::Leader => "Im² = (a²/b) Re |μ|²",
    };
    Some(
        Chart {
            name: "eigenvalues",
            title: format!("Eigenvalues and condition {equation}"),
            caption: format!(
                "Eigenvalues μ ≠ 0 of {whose}, and the border {shape} of {equation} for this mission's a²/b = {ratio:.4}, which \
                 must exceed {threshold:.4}: {verdict}."
            ),
            x: "Re μ".into(),
            y: "Im μ".into(),
            curves: vec![
                Curve::dots("eigenvalues", mu.iter().map(|mu| (mu.re, mu.im)).collect()),
                Curve::line(format!("a²/b = {ratio:.4}"), mirrored),
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
