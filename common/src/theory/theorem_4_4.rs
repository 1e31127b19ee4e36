//! Theorem 4.4: coordination under brief connectivity losses (Definition 4.3).
//!
//! While the graph is connected, V_2 = ½ γ~'K⁻¹γ~ decays at 2k_mλ_m; while it is not, at least it does not grow (type
//! II). The theorem's rates are those of such quadratic functions; norms decay at half of them (erratum 4.4). λ_m
//! is computed and not taken from its closed form (erratum 4.6). Links work both ways.

use super::{Gains, PathFollowing, Verdict};
use crate::graph::Graph;
use crate::graph::spectrum::{lambda_2_weighted, lambda_m};
use crate::time::Span;

/// Lemma 4.3: two systems that drive each other, the second with brief instabilities.
///
/// ```text
/// α_i|z_i|² ≤ V_i,   V_1' ≤ −λ_1V_1 + ρ_1|z_2|² + u_1²,   V_2' ≤ −λ_2(t)V_2 + ρ_2|z_1|² + u_2²
/// ```
///
/// with λ_2(t) = λ_2, or −λ~_2 for the part α of the time. With r_1 = ρ_1/α_2, r_2 = ρ_2/α_1 and the left eigenvector
/// (1, w) of [−λ_1, r_1; r_2, −λ_2] to its larger eigenvalue −λ_0, V = V_1 + wV_2 obeys V' ≤ −λ_0V while λ_2(t) = λ_2, and
/// V' ≤ (−λ_0 + λ_2 + λ~_2)V else; hence V(t) ≤ c e^{−λt}V(0) where nothing else drives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interconnection {
    /// λ_1 \[1/s\], positive.
    pub lambda_1: f64,
    /// λ_2 \[1/s\], positive.
    pub lambda_2: f64,
    /// λ~_2: growth during an instability \[1/s\], not negative.
    pub growth_2: f64,
    /// ρ_1/α_2: how much the second drives the first, not negative.
    pub drive_1: f64,
    /// ρ_2/α_1: how much the first drives the second, not negative; zero is the cascade.
    pub drive_2: f64,
}

impl Interconnection {
    /// λ_0 (4.18) \[1/s\].
    #[doc(alias = "λ_0")]
    pub fn lambda_0(&self) -> f64 {
        let middle = 0.5 * (self.lambda_1 + self.lambda_2);
        let apart = 0.5 * (self.lambda_1 - self.lambda_2);
        middle - (apart * apart + self.drive_1 * self.drive_2).sqrt()
    }

    /// (4.19) and α < λ_0/(λ_2 + λ~_2).
    pub fn holds(&self, alpha: f64) -> bool {
        let weakly = self.drive_1 * self.drive_2 < self.lambda_1 * self.lambda_2;
        weakly && alpha >= 0.0 && self.rate(alpha) > 0.0
    }

    /// λ = λ_0 − α(λ_2 + λ~_2): the rate of V \[1/s\]. For the cascade (ρ_2 = 0) it is min(λ_1, (1 − α)λ_2 − αλ~_2).
    pub fn rate(&self, alpha: f64) -> f64 {
        if self.drive_2 == 0.0 {
            return self.lambda_1.min((1.0 - alpha) * self.lambda_2 - alpha * self.growth_2);
        }
        self.lambda_0() - alpha * (self.lambda_2 + self.growth_2)
    }

    /// c = e^{(λ_2 + λ~_2)(1 − α)T_0} (4.20).
    pub fn overshoot(&self, alpha: f64, t_0: Span) -> f64 {
        ((self.lambda_2 + self.growth_2) * (1.0 - alpha) * t_0.secs()).exp()
    }

    /// w of V = V_1 + wV_2: (λ_1 − λ_0)/(ρ_2/α_1); `None` for the cascade, which has no such V.
    pub fn weight(&self) -> Option<f64> {
        (self.drive_2 > 0.0).then(|| (self.lambda_1 - self.lambda_0()) / self.drive_2)
    }

    /// That of Theorem 4.4 for type I: with (4.25), (4.29) and θ_1 = ½k_mλ_m.
    pub fn of_type_1(fleet: &Coordination, lambda_1: f64, rho_1: f64, alpha_1: f64) -> Interconnection {
        let Gains { n, k_m, k_max } = fleet.gains;
        let theta_1 = 0.5 * fleet.speed();
        Interconnection {
            lambda_1,
            lambda_2: 2.0 * (fleet.speed() - theta_1),
            growth_2: 2.0 * theta_1,
            // V_2 ≥ |γ~|²/(2k_M).
            drive_1: rho_1 * (n as f64 * k_max).powi(2) * 2.0 * k_max,
            drive_2: 1.0 / (4.0 * k_m * theta_1) / alpha_1,
        }
    }
}

/// The coordination subsystem and its network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordination {
    /// Number of vehicles and bounds of their gains.
    pub gains: Gains,
    /// λ_m of Lemma 4.1, property 8, over the connected graphs that occur.
    #[doc(alias = "λ_m")]
    pub lambda_m: f64,
    /// The least λ_2(K^½LK^½) over them: what k_mλ_m is a lower bound of.
    pub lambda_2_weighted: f64,
    /// α: the asymptotic connectivity loss rate (4.11).
    #[doc(alias = "α")]
    pub alpha: f64,
}

impl Coordination {
    /// From the graphs that occur, of which those that are connected count; `None` if none is, if one has one-way
    /// links, or if the gains do not fit.
    pub fn new(graphs: &[Graph], gains: &[f64], alpha: f64) -> Option<Coordination> {
        Some(Coordination {
            gains: Gains::new(gains)?,
            lambda_m: lambda_m(graphs, gains)?,
            lambda_2_weighted: lambda_2_weighted(graphs, gains)?,
            alpha,
        })
    }

    /// k_mλ_m \[1/s\].
    fn speed(&self) -> f64 {
        self.gains.k_m * self.lambda_m
    }

    /// k_g := λ_m²k_m³/(n²k_M³).
    pub fn k_g(&self) -> f64 {
        let Gains { n, k_m, k_max } = self.gains;
        (self.lambda_m / n as f64).powi(2) * (k_m / k_max).powi(3)
    }

    /// λ_0 = λ~_0 − √(λ~_0² − k_mλ_mλ_1(1 − ρ_1/(k_g α_1 λ_1))),  λ~_0 = ½(λ_1 + k_mλ_m).
    #[doc(alias = "λ_0")]
    pub fn lambda_0(&self, lambda_1: f64, rho_1: f64, alpha_1: f64) -> f64 {
        let middle = 0.5 * (lambda_1 + self.speed());
        let coupling = 1.0 - rho_1 / (self.k_g() * alpha_1 * lambda_1);
        middle - (middle.powi(2) - self.speed() * lambda_1 * coupling).max(0.0).sqrt()
    }

    /// The loss rate below which the theorem holds: λ_0/(2k_mλ_m) for type I, zero if the coupling leaves none; 1 for type II.
    pub fn alpha_limit(&self, following: PathFollowing) -> f64 {
        match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => {
                (self.lambda_0(lambda_1, rho_1, alpha_1) / (2.0 * self.speed())).max(0.0)
            }
            PathFollowing::TypeII { .. } => 1.0,
        }
    }

    /// Whether the theorem's conditions hold.
    pub fn holds(&self, following: PathFollowing) -> bool {
        let weakly_coupled = match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => rho_1 / (alpha_1 * lambda_1) < self.k_g(),
            PathFollowing::TypeII { lambda_1 } => lambda_1 > 0.0,
        };
        weakly_coupled && self.alpha >= 0.0 && self.alpha < self.alpha_limit(following)
    }

    /// λ: the rate at which the Lyapunov function of the whole fleet decays \[1/s\], if the conditions hold.
    ///
    /// λ_0 − 2αk_mλ_m for type I, min(λ_1, 2(1 − α)k_mλ_m) for type II.
    /// (If those two are equal, every smaller rate: the cascade then decays like t e^{−λt}.)
    pub fn rate_of_v(&self, following: PathFollowing) -> Option<f64> {
        let rate = match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => {
                self.lambda_0(lambda_1, rho_1, alpha_1) - 2.0 * self.alpha * self.speed()
            }
            PathFollowing::TypeII { lambda_1 } => lambda_1.min(2.0 * (1.0 - self.alpha) * self.speed()),
        };
        self.holds(following).then_some(rate)
    }

    /// λ/2: the rate at which the errors themselves decay \[1/s\] (erratum 4.4).
    pub fn rate_of_norm(&self, following: PathFollowing) -> Option<f64> {
        self.rate_of_v(following).map(|rate| 0.5 * rate)
    }

    /// (1 − α)k_mλ_m: the rate at which ‖γ~‖ alone decays with path following of type II \[1/s\], which then disturbs
    /// it in no way.
    pub fn rate_of_agreement(&self) -> f64 {
        (1.0 - self.alpha) * self.speed()
    }

    /// (1 − α)λ_2(K^½LK^½): the same, sharper for unequal gains \[1/s\].
    ///
    /// With x = K^{−½}γ~ and β'γ~ = 0, x is orthogonal to the kernel of K^½LK^½, so V_2' = −x'K^½LK^½x ≤ −2λ_2 V_2.
    pub fn sharper_rate_of_agreement(&self) -> f64 {
        (1.0 - self.alpha) * self.lambda_2_weighted
    }

    /// √c with c = e^{2k_mλ_m(1 − α)T_0} (4.20) and the bounds of V_2 by norms: by how much ‖γ~‖ can exceed its decay at
    /// [`Coordination::rate_of_agreement`].
    ///
    /// ‖γ~(t)‖ ≤ √(k_M/k_m) e^{(1 − α)k_mλ_m(T_0 − (t − t_0))} ‖γ~(t_0)‖.
    pub fn overshoot(&self, t_0: Span) -> f64 {
        (self.gains.k_max / self.gains.k_m).sqrt() * (self.rate_of_agreement() * t_0.secs()).exp()
    }

    /// What the theorem says of this fleet.
    pub fn verdict(&self, following: PathFollowing) -> Verdict {
        let (name, condition, coupling) = match following {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => (
                "Theorem 4.4 (type I)",
                format!("α < {:.4}, ρ_1/(α_1λ_1) < {:.6}", self.alpha_limit(following), self.k_g()),
                format!(", ρ_1/(α_1λ_1) = {:.6}", rho_1 / (alpha_1 * lambda_1)),
            ),
            PathFollowing::TypeII { .. } => ("Theorem 4.4 (type II)", "α < 1".to_owned(), String::new()),
        };
        Verdict {
            name,
            condition,
            value: format!("α = {:.4}{coupling}, λ_m = {:.5}", self.alpha, self.lambda_m),
            holds: self.holds(following),
            norm_rate: self.rate_of_norm(following),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Coordination, Interconnection};
    use crate::graph::Graph;
    use crate::graph::measure::Connectivity;
    use crate::graph::spectrum::l_beta;
    use crate::graph::spectrum::tests::{a_fleet, all_graphs};
    use crate::graph::switching::Switching;
    use crate::random::Stream;
    use crate::theory::Gains;
    use crate::theory::PathFollowing::{TypeI, TypeII};
    use crate::time::{Span, Time};
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn remark_4_2(alpha: f64) -> Coordination {
        Coordination::new(&all_graphs(3), &[1.0; 3], alpha).expect("some graphs are connected")
    }
    fn close(a: Option<f64>, b: f64) -> bool {
        a.is_some_and(|a| (a - b).abs() < 1e-9)
    }

    #[test]
    fn remark_4_2_numbers() {
        let fleet = remark_4_2(0.2);
        assert!((fleet.lambda_m - 1.0).abs() < 1e-12 && (fleet.k_g() - 1.0 / 9.0).abs() < 1e-12);
        let type_i = |rho_1| TypeI { lambda_1: 1.0, rho_1, alpha_1: 0.5 };
        let type_ii = TypeII { lambda_1: 1.0 };
        // The printed rates are those of V; norms have half (erratum 4.4).
        assert!(close(fleet.rate_of_v(type_i(1.0 / 72.0)), 0.1) && close(fleet.rate_of_v(type_ii), 1.0));
        assert!(close(fleet.rate_of_norm(type_i(1.0 / 72.0)), 0.05) && close(fleet.rate_of_norm(type_ii), 0.5));
        // rho_1 < 1/18 and alpha < (1 - sqrt(18 rho_1))/2.
        for rho_1 in [0.0, 0.01, 0.04, 0.055] {
            let limit = fleet.alpha_limit(type_i(rho_1));
            assert!((limit - (1.0 - (18.0 * rho_1).sqrt()) / 2.0).abs() < 1e-9, "{rho_1}: {limit}");
        }
        let connected = remark_4_2(0.0);
        assert!(connected.holds(type_i(0.999 / 18.0)) && !connected.holds(type_i(1.001 / 18.0)));
        assert!(remark_4_2(0.499).holds(type_i(0.0)) && !remark_4_2(0.501).holds(type_i(0.0)), "at best one half");
        assert!(remark_4_2(0.999).holds(type_ii) && !remark_4_2(1.0).holds(type_ii));
    }

    #[test]
    fn section_4_6_decays_at_a_fortieth() {
        let star = Graph::from_edges(3, &[(0, 1), (0, 2)]);
        let fleet = Coordination::new(&[star, Graph::empty(3)], &[0.1; 3], 0.75).expect("connected");
        assert!((fleet.rate_of_agreement() - 0.025).abs() < 1e-12);
        let verdict = fleet.verdict(TypeII { lambda_1: 1.0 });
        assert!(verdict.holds && close(verdict.norm_rate, 0.025));
        assert!(verdict.value.contains("α = 0.7500"));
    }

    #[test]
    fn what_does_not_hold_has_no_rate() {
        let fleet = remark_4_2(0.3);
        for following in [TypeI { lambda_1: 1.0, rho_1: 1.0, alpha_1: 0.5 }, TypeII { lambda_1: 0.0 }] {
            let verdict = fleet.verdict(following);
            assert_eq!((verdict.holds, verdict.norm_rate), (false, None), "{verdict:?}");
        }
        assert!(!remark_4_2(f64::NAN).holds(TypeII { lambda_1: 1.0 }));
        assert!(Coordination::new(&[Graph::empty(3)], &[1.0; 3], 0.0).is_none());
        assert!(Coordination::new(&[Graph::complete(1)], &[1.0], 0.0).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn errors_decay_at_least_as_promised(
            (graph, gains, gamma) in a_fleet(), alpha in 0.1..0.9f64, t_0 in 0.2..4.0f64, seed in any::<u64>()
        ) {
            let Some(fleet) = Coordination::new(std::slice::from_ref(&graph), &gains, alpha) else { return Ok(()) };
            prop_assert!(fleet.sharper_rate_of_agreement() >= fleet.rate_of_agreement() - 1e-9);
            let arcs: Vec<_> = graph.arcs().collect();
            let t_0 = Span::from_secs(t_0);
            let mut signal = Switching::random(arcs.len(), alpha, t_0, Span::from_secs(0.05), Stream::new(seed, "p"));
            let end = Time::from_secs(20.0);
            // What was measured promises no less than what was asked for.
            let measured = Connectivity::planned(signal.clone(), graph.len(), &arcs, end);
            let overshoot = fleet.overshoot(measured.t_0(alpha));
            let k = DMatrix::from_diagonal(&DVector::from_vec(gains.clone()));
            let flow = -(&k * graph.laplacian());
            let l_beta = l_beta(&gains);
            let start = (&l_beta * &gamma).norm();
            let (mut gamma, mut t) = (gamma, Time::ZERO);
            while t < end {
                let next = signal.next_change_after(t).unwrap_or(end).min(end);
                if signal.is_up(0, t) {
                    // Exactly, phase by phase: gamma' = -K L gamma.
                    gamma = (&flow * (next - t).secs()).exp() * gamma;
                }
                t = next;
                let promised = overshoot * (-fleet.rate_of_agreement() * t.secs()).exp() * start;
                let left = (&l_beta * &gamma).norm();
                prop_assert!(left <= promised * (1.0 + 1e-9) + 1e-9, "{} {} at {}", left, promised, t);
            }
        }
    }

    #[test]
    fn theorem_4_4_of_type_i_is_lemma_4_3() {
        for (alpha_1, rho_1) in [(0.5, 0.0), (0.5, 1.0 / 72.0), (2.0, 0.1)] {
            let fleet = remark_4_2(0.1);
            let lemma = Interconnection::of_type_1(&fleet, 1.0, rho_1, alpha_1);
            assert!((lemma.lambda_0() - fleet.lambda_0(1.0, rho_1, alpha_1)).abs() < 1e-12);
            let following = TypeI { lambda_1: 1.0, rho_1, alpha_1 };
            assert_eq!(lemma.holds(0.1), fleet.holds(following));
            assert!(close(fleet.rate_of_v(following), lemma.rate(0.1)) || !lemma.holds(0.1));
        }
        let cascade = Interconnection { lambda_1: 3.0, lambda_2: 1.0, growth_2: 0.5, drive_1: 9.0, drive_2: 0.0 };
        assert!((cascade.rate(0.2) - 0.7).abs() < 1e-12 && cascade.weight().is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// z_1' = −a_1z_1 + b_1z_2, z_2' = −a_2(t)z_2 + b_2z_1 with V_i = z_i²: by 2|xy| ≤ θx² + y²/θ, λ_i = 2a_i − θ and
        /// ρ_i = b_i²/θ, and while the second is unstable with a_2 = −g, λ~_2 = 2g + θ.
        #[test]
        fn two_systems_that_drive_each_other_decay_as_lemma_4_3_says(
            (a_1, a_2, growth) in (0.5..2.0f64, 0.5..2.0f64, 0.0..0.3f64), (b_1, b_2) in (-0.5..0.5f64, -0.5..0.5f64),
            (z_1, z_2) in (-3.0..3.0f64, -3.0..3.0f64), alpha in 0.0..0.3f64, seed in any::<u64>(),
        ) {
            let theta = 0.4;
            let square = |b: f64| (b * b).max(1e-6) / theta;
            let lemma = Interconnection {
                lambda_1: 2.0 * a_1 - theta,
                lambda_2: 2.0 * a_2 - theta,
                growth_2: 2.0 * growth + theta,
                drive_1: square(b_1),
                drive_2: square(b_2),
            };
            let arcs = [(0, 1), (1, 0)];
            let mut signal =
                Switching::random(2, alpha.max(0.01), Span::from_secs(0.5), Span::from_secs(0.05), Stream::new(seed, "p"));
            let end = Time::from_secs(15.0);
            let t_0 = Connectivity::planned(signal.clone(), 2, &arcs, end).t_0(alpha);
            let Some(w) = lemma.weight().filter(|_| lemma.holds(alpha)) else { return Ok(()) };
            let v = |z: &DVector<f64>| z[0] * z[0] + w * z[1] * z[1];
            let mut z = DVector::from_column_slice(&[z_1, z_2]);
            let (start, mut t) = (v(&z), Time::ZERO);
            while t < end {
                let next = signal.next_change_after(t).unwrap_or(end).min(end);
                let damping = if signal.is_up(0, t) { a_2 } else { -growth };
                let flow = DMatrix::from_row_slice(2, 2, &[-a_1, b_1, b_2, -damping]);
                z = (&flow * (next - t).secs()).exp() * z;
                t = next;
                let promised = lemma.overshoot(alpha, t_0) * (-lemma.rate(alpha) * t.secs()).exp() * start;
                prop_assert!(v(&z) <= promised * (1.0 + 1e-9) + 1e-12, "{} {} at {}", v(&z), promised, t);
            }
        }
    }

    #[test]
    fn lemma_4_3_in_closed_form() {
        // λ_0 = 2 − √(1 + 0.75), whichever of the two drives more.
        let lambda_0 = 2.0 - 1.75f64.sqrt();
        for (drive_1, drive_2) in [(1.5, 0.5), (0.75, 1.0)] {
            let two = Interconnection { lambda_1: 3.0, lambda_2: 1.0, growth_2: 0.5, drive_1, drive_2 };
            assert!((two.lambda_0() - lambda_0).abs() < 1e-12);
            assert!((two.rate(0.2) - (lambda_0 - 0.3)).abs() < 1e-12);
            // (1, w) is a left eigenvector of [−λ_1 r_1; r_2 −λ_2].
            let w = two.weight().expect("they drive each other");
            assert!(
                w > 0.0 && (-3.0 + w * drive_2 + lambda_0).abs() < 1e-12 && (drive_1 - w + lambda_0 * w).abs() < 1e-12
            );
            // α < λ_0/(λ_2 + λ~_2) = 0.4514, and no part of the time is less than none.
            assert!(
                two.holds(0.0) && two.holds(0.451) && !two.holds(0.452) && !two.holds(-0.1) && !two.holds(f64::NAN)
            );
            assert!((two.overshoot(0.25, Span::from_secs(2.0)) - 2.25f64.exp()).abs() < 1e-9);
        }
        // (4.19): λ_1λ_2 = 6 bears a product of drives below it, not above.
        let driven = |drive_1| Interconnection { lambda_1: 3.0, lambda_2: 2.0, growth_2: 0.5, drive_1, drive_2: 1.0 };
        assert!(driven(5.99).holds(0.0) && !driven(6.01).holds(0.0));
        // A cascade goes at the rate of the slower of the two.
        let cascade = |lambda_1| Interconnection { lambda_1, lambda_2: 2.0, growth_2: 0.5, drive_1: 9.0, drive_2: 0.0 };
        assert!((cascade(3.0).rate(0.2) - 1.5).abs() < 1e-12 && (cascade(0.5).rate(0.2) - 0.5).abs() < 1e-12);
    }

    /// Gains between ½ and 2, λ_m = 3, λ_2(K^½LK^½) = 4.
    fn unlike_gains(alpha: f64) -> Coordination {
        Coordination { gains: Gains { n: 3, k_m: 0.5, k_max: 2.0 }, lambda_m: 3.0, lambda_2_weighted: 4.0, alpha }
    }

    #[test]
    fn with_unlike_gains_it_is_still_lemma_4_3() {
        let fleet = unlike_gains(0.1);
        // 3²·½³/(3²·2³).
        assert!((fleet.k_g() - 1.0 / 64.0).abs() < 1e-15);
        for (lambda_1, alpha_1, part) in [(0.7, 0.4, 0.0), (0.7, 0.4, 0.3), (2.5, 3.0, 0.6), (0.7, 3.0, 1.2)] {
            let rho_1 = part * fleet.k_g() * alpha_1 * lambda_1;
            let (lemma, following) =
                (Interconnection::of_type_1(&fleet, lambda_1, rho_1, alpha_1), TypeI { lambda_1, rho_1, alpha_1 });
            assert!((lemma.lambda_0() - fleet.lambda_0(lambda_1, rho_1, alpha_1)).abs() < 1e-12);
            assert!((fleet.alpha_limit(following) - (lemma.lambda_0() / 3.0).max(0.0)).abs() < 1e-12, "2k_mλ_m = 3");
            assert_eq!((fleet.holds(following), lemma.holds(0.1)), (part < 1.0, part < 1.0), "{part}");
            assert!(close(fleet.rate_of_v(following), lemma.rate(0.1)) || part > 1.0);
            // Each of the two drives, (4.25) and (4.29).
            assert!((lemma.drive_1 - rho_1 * 36.0 * 4.0).abs() < 1e-12);
            assert!((lemma.drive_2 - 1.0 / (4.0 * 0.5 * 0.75) / alpha_1).abs() < 1e-12);
        }
    }

    #[test]
    fn agreement_with_unlike_gains_in_closed_form() {
        let fleet = unlike_gains(0.25);
        assert!((fleet.rate_of_agreement() - 1.125).abs() < 1e-12);
        assert!((fleet.sharper_rate_of_agreement() - 3.0).abs() < 1e-12);
        // √(k_M/k_m) = 2.
        assert!((fleet.overshoot(Span::from_secs(2.0)) - 2.0 * 2.25f64.exp()).abs() < 1e-9);
        let type_ii = TypeII { lambda_1: 9.0 };
        assert!(fleet.holds(type_ii) && !unlike_gains(-0.25).holds(type_ii), "no part of the time is less than none");
    }
}
