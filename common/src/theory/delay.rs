//! Late information: what a common delay τ on all links does to agreement (section 4.4).
//!
//! Under γ_i' = v_L − k_iΣ_{j∈N_i}(γ_i(t) − γ_j(t − τ)) (4.34) the fleet can move as one only if k_i|N_i| is the same k for
//! everyone at all times (case p2); it then travels at v_L* = v_L/(1 + kτ), not at v_L. Hence gains k/|N_i|, and v_L* for a
//! vehicle that hears nobody (Lemma 4.5, with the sign and the index of erratum 4.1).
//!
//! With fixed gains a delay leaves errors (erratum 4.2); how large they are is predicted here too.

use nalgebra::DVector;

use super::Verdict;
use crate::graph::Graph;
use crate::graph::incidence::Differences;
use crate::time::Span;

/// v_L* = v_L/(1 + kτ): the speed of a fleet with gains k/|N_i| and a delay τ. Never the other side of v_L, whatever τ:
/// a negative kτ is taken as zero.
#[doc(alias = "v_L*")]
pub fn steady_speed(v_l: f64, k: f64, tau: Span) -> f64 {
    v_l / (1.0 + (k * tau.secs()).max(0.0))
}

/// The k with k_i|N_i| = k for every vehicle in every one of these graphs (case p2); `None` if there is no such k, in
/// particular if somebody hears nobody.
pub fn common_gain(graphs: &[Graph], gains: &[f64]) -> Option<f64> {
    let mut products =
        graphs.iter().flat_map(|graph| gains.iter().enumerate().map(|(i, k)| k * graph.degree(i) as f64));
    let k = products.next().filter(|&k| k > 0.0 && k.is_finite())?;
    products.all(|other| (other - k).abs() <= 1e-12 * k).then_some(k)
}

/// Where a fleet with a delay settles.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The common speed \[units of γ per s\].
    pub speed: f64,
    /// γ_i less the average that the graph weighs; all zero iff coordinated.
    pub errors: DVector<f64>,
}

/// Where fixed gains k_i settle on a graph that does not change; `None` if it cannot agree or a gain is not positive.
///
/// γ(t) = v*t 1 + γ~ in (4.35) leaves Lγ~ = K⁻¹1(v_L − v*) − v*τD1. By β'L = 0 from the left, with β of (3.6),
///
/// ```text
/// v* = v_L / (1 + τ β'D1/β'K⁻¹1),    γ~ = F_1 L_11⁻¹ F_2 (K⁻¹1(v_L − v*) − v*τD1)
/// ```
pub fn settled(graph: &Graph, gains: &[f64], v_l: f64, tau: Span) -> Option<Settled> {
    if gains.len() != graph.len() || !gains.iter().all(|&k| k > 0.0 && k.is_finite()) {
        return None;
    }
    let split = Differences::of(graph)?;
    let degrees = DVector::from_fn(graph.len(), |i, _| graph.degree(i) as f64);
    let inverse_gains = DVector::from_iterator(gains.len(), gains.iter().map(|k| 1.0 / k));
    let tau = tau.secs().max(0.0);
    let speed = v_l / (1.0 + tau * split.beta.dot(&degrees) / split.beta.dot(&inverse_gains));
    let excess = &split.f_2 * (inverse_gains * (v_l - speed) - degrees * (speed * tau));
    let errors =
        if excess.is_empty() { DVector::zeros(gains.len()) } else { split.f_1 * split.l_11.lu().solve(&excess)? };
    Some(Settled { speed, errors })
}

/// How a mission gains on its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DelayGains<'a> {
    /// k/|N_i|, and v_L* alone: Lemma 4.5.
    Averaged(f64),
    /// k_i, whatever the number of neighbours, in these graphs: (4.34).
    Fixed(&'a [f64], &'a [Graph]),
}

/// What Lemmas 4.4 and 4.5 say of a fleet with a delay `tau`, on a network connected in mean or not. They give a speed
/// but no rate.
pub fn verdict(gains: DelayGains<'_>, tau: Span, v_l: f64, connected_in_mean: bool) -> Verdict {
    let (condition, k) = match gains {
        DelayGains::Averaged(k) => ("connected in mean, k > 0", (k > 0.0 && k.is_finite()).then_some(k)),
        DelayGains::Fixed(gains, graphs) => {
            ("connected in mean, k_i|N_i| the same for all vehicles and times", common_gain(graphs, gains))
        }
    };
    let speed = match k {
        Some(k) => format!("v_L* = {:.4} for v_L = {v_l:.4}, τ = {tau}", steady_speed(v_l, k, tau)),
        None if tau <= Span::ZERO => format!("no delay, v_L = {v_l:.4}"),
        None => format!("no common k, τ = {tau}: errors remain"),
    };
    // Without a delay any positive gains will do (Theorem 4.2).
    let gains_do = k.is_some() || (tau <= Span::ZERO && matches!(gains, DelayGains::Fixed(..)));
    Verdict {
        name: "Lemmas 4.4 and 4.5 (delay)",
        condition: condition.to_owned(),
        value: if connected_in_mean { speed } else { format!("not connected in mean, {speed}") },
        holds: connected_in_mean && gains_do,
        norm_rate: None,
    }
}

#[cfg(test)]
mod tests {
    use super::{DelayGains, common_gain, settled, steady_speed, verdict};
    use crate::graph::Graph;
    use crate::time::Span;
    use proptest::prelude::*;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }
    fn star() -> Graph {
        Graph::from_edges(3, &[(0, 1), (0, 2)])
    }

    #[test]
    fn the_fleet_travels_slower() {
        assert!((steady_speed(0.5, 0.2, s(5.0)) - 0.25).abs() < 1e-12);
        assert_eq!((steady_speed(0.5, 0.2, s(0.0)), steady_speed(0.5, 0.2, s(-9.0))), (0.5, 0.5));
    }

    #[test]
    fn erratum_4_2_fixed_gains_on_the_star_settle_apart() {
        let fleet = settled(&star(), &[0.1; 3], 0.5, s(5.0)).expect("it can agree");
        assert!((fleet.speed - 0.3).abs() < 1e-12);
        assert!((fleet.errors[1] - fleet.errors[0] - 0.5).abs() < 1e-12, "{}", fleet.errors);
        assert!((fleet.errors[2] - fleet.errors[1]).abs() < 1e-12);
        // Averages settle together, at v_L*.
        let averaged = settled(&star(), &[0.05, 0.1, 0.1], 0.5, s(5.0)).expect("it can agree");
        assert!((averaged.speed - steady_speed(0.5, 0.1, s(5.0))).abs() < 1e-12);
        assert!(averaged.errors.amax() < 1e-12);
    }

    #[test]
    fn a_common_gain_needs_everyone_to_hear_someone() {
        assert_eq!(common_gain(&[star()], &[0.1, 0.2, 0.2]), Some(0.2));
        assert_eq!(common_gain(&[star(), Graph::complete(3)], &[0.1, 0.2, 0.2]), None);
        assert_eq!(common_gain(&[star()], &[0.1; 3]), None);
        assert_eq!(common_gain(&[Graph::empty(3)], &[0.1; 3]), None);
        assert_eq!(common_gain(&[], &[0.1; 3]), None);
    }

    #[test]
    fn verdicts() {
        let graphs = [star()];
        let holds = |gains, tau, connected| verdict(gains, s(tau), 0.5, connected).holds;
        assert!(holds(DelayGains::Averaged(0.1), 5.0, true) && !holds(DelayGains::Averaged(0.1), 5.0, false));
        assert!(!holds(DelayGains::Averaged(0.0), 5.0, true) && !holds(DelayGains::Averaged(f64::NAN), 0.0, true));
        assert!(!holds(DelayGains::Fixed(&[0.1; 3], &graphs), 5.0, true));
        assert!(holds(DelayGains::Fixed(&[0.1; 3], &graphs), 0.0, true));
        assert!(holds(DelayGains::Fixed(&[0.05, 0.1, 0.1], &graphs), 5.0, true));
        assert!(!holds(DelayGains::Averaged(f64::INFINITY), 5.0, true));
        let words = |tau| verdict(DelayGains::Fixed(&[0.1; 3], &graphs), s(tau), 0.5, true).value;
        assert!(words(5.0).contains("errors remain") && words(0.0).contains("no delay"));
        let connected = |connected| verdict(DelayGains::Averaged(0.2), s(5.0), 0.5, connected).value;
        assert!(connected(false).starts_with("not connected in mean") && connected(true).starts_with("v_L*"));
        assert!(verdict(DelayGains::Averaged(0.2), s(5.0), 0.5, true).value.contains("v_L* = 0.2500"));
    }

    #[test]
    fn nothing_settles_without_agreement() {
        assert_eq!(settled(&Graph::empty(2), &[1.0; 2], 1.0, s(1.0)), None);
        assert_eq!(settled(&star(), &[1.0, 0.0, 1.0], 1.0, s(1.0)), None);
        assert_eq!(settled(&star(), &[1.0; 2], 1.0, s(1.0)), None);
        assert_eq!(settled(&star(), &[1.0, f64::INFINITY, 1.0], 1.0, s(1.0)), None);
        let prompt = settled(&star(), &[1.0; 3], 1.0, s(0.0));
        assert_eq!(settled(&star(), &[1.0; 3], 1.0, s(-5.0)), prompt, "news do not come before they are said");
        let alone = settled(&Graph::empty(1), &[1.0], 1.0, s(1.0)).expect("a fleet of one");
        assert_eq!((alone.speed, alone.errors.len()), (1.0, 1));
    }

    #[test]
    fn the_delayed_law_goes_where_predicted() {
        // Euler steps of (4.34) on a directed graph, with the past kept in full.
        let graph = Graph::from_arcs(3, &[(0, 1), (1, 0), (1, 2), (2, 0)]);
        let (gains, v_l, tau, dt) = ([0.4, 0.3, 0.7], 0.5, 2.0, 0.01);
        let late = (tau / dt) as usize;
        let mut past = vec![[0.0, 3.0, -1.0]; late + 1];
        for _ in 0..20_000 {
            let now = past[past.len() - 1];
            let then = past[past.len() - 1 - late];
            let mut next = now;
            for i in 0..3 {
                let pull: f64 = graph.neighbours(i).map(|j| now[i] - then[j]).sum();
                next[i] += dt * (v_l - gains[i] * pull);
            }
            past.push(next);
        }
        let predicted = settled(&graph, &gains, v_l, s(tau)).expect("it can agree");
        let [before, now] = [past[past.len() - 2], past[past.len() - 1]];
        for i in 0..3 {
            assert!(((now[i] - before[i]) / dt - predicted.speed).abs() < 1e-9);
            let apart = predicted.errors[i] - predicted.errors[0];
            assert!((now[i] - now[0] - apart).abs() < 1e-6, "{i}: {} {apart}", now[i] - now[0]);
        }
    }

    proptest! {
        #[test]
        fn what_settles_solves_the_law(
            arcs in prop::collection::vec((0usize..5, 0usize..5), 0..20),
            gains in prop::collection::vec(0.1..2.0f64, 5),
            v_l in -1.0..1.0f64,
            tau in 0.0..5.0f64,
        ) {
            let graph = Graph::from_arcs(5, &arcs);
            let Some(fleet) = settled(&graph, &gains, v_l, s(tau)) else {
                prop_assert!(!graph.can_agree());
                return Ok(());
            };
            let tau = s(tau).secs();
            for (i, k) in gains.iter().enumerate() {
                let pull: f64 =
                    graph.neighbours(i).map(|j| fleet.errors[i] - fleet.errors[j] + fleet.speed * tau).sum();
                prop_assert!((fleet.speed - (v_l - k * pull)).abs() < 1e-9);
            }
        }
    }
}
