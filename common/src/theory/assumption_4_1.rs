//! Assumption 4.1: what a path-following subsystem does with what disturbs it, as a bound of its state.
//!
//! From (4.6) and (4.7),
//!
//! ```text
//! α|ζ|² ≤ W ≤ ᾱ|ζ|²,    dW/dt ≤ −λ_1 W + ρ_1|v~_r|² + ρ_2 d²
//! ```
//!
//! follows W(t) ≤ W(t_0) e^(−λ_1(t − t_0)) + (ρ_1/λ_1) sup|v~_r|² + (ρ_2/λ_1) sup d². Divided by α, and with the root of each
//! term for the root of the sum,
//!
//! ```text
//! |ζ(t)| ≤ √(ᾱ/α) |ζ(t_0)| e^(−½λ_1(t − t_0)) + √(ρ_1/(λ_1 α)) sup|v~_r| + √(ρ_2/(λ_1 α)) sup|d|
//! ```
//!
//! The print has ρ_2/(λ_1 α) without the root. Over the fleet, V_1 = ΣW_i has ρ_1 n²k_M² in place of ρ_1 (4.27) and
//! u_1² = ρ_2 Σ d_i² for the last term, where (4.26) lacks ρ_2; and (4.28) decays at ½λ_1 from √(ᾱ/α)|ζ(t_0)|, with α in its
//! gains where ᾱ is printed (erratum 4.5).

use crate::positive::{not_negative, positive};

use super::Gains;

/// The constants of Assumption 4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assumption41 {
    /// λ_1: decay rate of W \[1/s\], positive.
    pub lambda_1: f64,
    /// ρ_1: how much a demanded change of speed excites W, not negative.
    pub rho_1: f64,
    /// ρ_2: how much a disturbance excites W, not negative.
    pub rho_2: f64,
    /// α: lower bound of W, positive.
    pub alpha: f64,
    /// ᾱ: upper bound of W, not below α.
    pub alpha_bar: f64,
}

/// |ζ(t)| ≤ overshoot |ζ(t_0)| e^(−rate (t − t_0)) + of_speed sup|v~_r| + of_disturbance sup|d|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// √(ᾱ/α).
    pub overshoot: f64,
    /// ½λ_1 \[1/s\].
    pub rate: f64,
    /// ρ_v; for a fleet, of ‖γ~‖.
    #[doc(alias = "ρ_v")]
    pub of_speed: f64,
    /// ρ_d; for a fleet, of the root of Σ d_i².
    #[doc(alias = "ρ_d")]
    pub of_disturbance: f64,
}

impl Assumption41 {
    /// The constants if they can be, otherwise what is wrong with them.
    pub fn checked(self) -> Result<Assumption41, String> {
        positive("lambda_1", self.lambda_1)?;
        not_negative("rho_1", self.rho_1)?;
        not_negative("rho_2", self.rho_2)?;
        positive("the lower bound of W", self.alpha)?;
        positive("the upper bound of W", self.alpha_bar)?;
        if self.alpha <= self.alpha_bar { Ok(self) } else { Err("the lower bound of W is above the upper one".into()) }
    }

    /// Of one vehicle: below (4.7), erratum 4.5.
    pub fn bound(&self) -> Bound {
        let gain = |rho: f64| (rho / (self.lambda_1 * self.alpha)).sqrt();
        Bound {
            overshoot: (self.alpha_bar / self.alpha).sqrt(),
            rate: 0.5 * self.lambda_1,
            of_speed: gain(self.rho_1),
            of_disturbance: gain(self.rho_2),
        }
    }

    /// Of the fleet: (4.28), erratum 4.5.
    pub fn bound_of_fleet(&self, gains: &Gains) -> Bound {
        let Bound { of_speed, .. } = self.bound();
        Bound { of_speed: gains.n as f64 * gains.k_max * of_speed, ..self.bound() }
    }
}

impl Bound {
    /// The bound of |ζ| after `t` seconds.
    pub fn at(&self, start: f64, t: f64, speed: f64, disturbance: f64) -> f64 {
        let decaying = self.overshoot * start * (-self.rate * t).exp();
        decaying + self.of_speed * speed + self.of_disturbance * disturbance
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// ζ' = −kζ + v + d with W = ½ζ²: W' = −kζ² + ζ(v + d) ≤ −kW + (v² + d²)/k.
    fn first_order(k: f64) -> Assumption41 {
        Assumption41 { lambda_1: k, rho_1: 1.0 / k, rho_2: 1.0 / k, alpha: 0.5, alpha_bar: 0.5 }
    }

    #[test]
    fn erratum_4_5_without_the_root_the_bound_does_not_hold() {
        // With d alone W' ≤ −kW + d²/(2k): the bound is reached.
        let k = 2.0;
        let alone = Assumption41 { rho_1: 0.0, rho_2: 0.5 / k, ..first_order(k) };
        let (d, settled) = (1.0, 1.0 / k);
        assert!((alone.bound().at(1.0, 40.0, 0.0, d) - settled).abs() < 1e-15);
        let printed = alone.rho_2 / (alone.lambda_1 * alone.alpha);
        assert!(printed * d < 0.6 * settled, "{printed}: as printed a quarter of what it is in the end");
        // (4.26) without ρ_2: an input ten times as strong has the same u_1, and exceeds what is printed.
        let strong = Assumption41 { rho_2: 100.0 * alone.rho_2, ..alone };
        assert!((strong.bound().of_disturbance - 10.0 * alone.bound().of_disturbance).abs() < 1e-12);
        let printed = 1.0 / (strong.lambda_1 * strong.alpha_bar).sqrt();
        assert!(printed < 10.0 * settled, "{printed}");
    }

    #[test]
    fn erratum_4_5_of_the_fleet() {
        let unlike = Assumption41 { alpha: 0.5, alpha_bar: 2.0, ..first_order(2.0) };
        let fleet = unlike.bound_of_fleet(&Gains::new(&[1.0, 3.0, 2.0]).expect("gains"));
        assert_eq!((fleet.overshoot, fleet.rate), (2.0, 1.0));
        assert!((fleet.of_speed - 9.0 * unlike.bound().of_speed).abs() < 1e-12);
        // ζ = (ζ_1, ζ_2) with W = ½ζ_1² + 2ζ_2², ζ_1' = −ζ_1 + 4ζ_2, ζ_2' = −ζ_2 − ζ_1, W' = −2W: from ζ = (0, 1) it grows
        // before it decays, which needs the overshoot.
        let (mut zeta, mut most) = ([0.0, 1.0f64], 0f64);
        let turning = Assumption41 { lambda_1: 2.0, rho_1: 0.0, rho_2: 0.0, alpha: 0.5, alpha_bar: 2.0 };
        for step in 1..=4000 {
            let t = 1e-3 * f64::from(step);
            // The exact solution: e^(−t) (2 sin 2t, cos 2t).
            let (sin, cos) = (2.0 * t).sin_cos();
            zeta = [2.0 * sin, cos].map(|x| x * (-t).exp());
            let size = zeta[0].hypot(zeta[1]);
            most = most.max(size * t.exp());
            assert!(size <= turning.bound().at(1.0, t, 0.0, 0.0) * (1.0 + 1e-12), "{t}");
        }
        assert!(most > 1.9 && zeta[1].is_finite(), "{most}: without the overshoot it would be exceeded");
    }

    proptest! {
        #[test]
        fn no_input_exceeds_the_bound(k in 0.2..4.0f64, start in -2.0..2.0f64, speeds in prop::collection::vec(-1.0..1.0f64, 30),
                                      disturbances in prop::collection::vec(-3.0..3.0f64, 30), lasts in 0.05..1.0f64) {
            let bound = first_order(k).bound();
            let (mut zeta, mut t) = (start, 0.0);
            for (v, d) in speeds.iter().zip(&disturbances) {
                // Exactly, for inputs that are held.
                let settled = (v + d) / k;
                zeta = settled + (zeta - settled) * (-k * lasts).exp();
                t += lasts;
                prop_assert!(zeta.abs() <= bound.at(start.abs(), t, 1.0, 3.0) * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn constants_that_cannot_be_are_refused() {
        let sound = first_order(1.0);
        for wrong in [
            Assumption41 { lambda_1: 0.0, ..sound },
            Assumption41 { alpha: 0.6, ..sound },
            Assumption41 { rho_1: -0.1, ..sound },
            Assumption41 { rho_2: -0.1, ..sound },
            Assumption41 { alpha: 0.0, ..sound },
            Assumption41 { alpha: -0.5, alpha_bar: -0.5, ..sound },
            Assumption41 { alpha_bar: f64::INFINITY, ..sound },
            Assumption41 { alpha_bar: f64::NAN, ..sound },
        ] {
            assert!(wrong.checked().is_err(), "{wrong:?}");
        }
        assert_eq!(sound.checked(), Ok(sound));
    }

    #[test]
    fn what_starts_and_what_moves_it_each_have_their_term() {
        // One at a time, for ζ' = −ζ + v + d from ζ(0): the others' terms cannot make up for a lost one.
        let bound = first_order(1.0).bound();
        for (start, v, d) in [(10.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0)] {
            let settled: f64 = v + d;
            for t in [0.0f64, 0.5, 2.0, 40.0] {
                let zeta = settled + (start - settled) * (-t).exp();
                let most = bound.at(start, t, v, d);
                assert!(zeta <= most * (1.0 + 1e-12), "{start} {v} {d} at {t}: {zeta} > {most}");
            }
        }
        // And they add up: 2·7e^(−1) + 3·11 + 5·13.
        let known = Bound { overshoot: 2.0, rate: 0.5, of_speed: 3.0, of_disturbance: 5.0 };
        assert!((known.at(7.0, 2.0, 11.0, 13.0) - (14.0 * (-1.0f64).exp() + 98.0)).abs() < 1e-12);
    }

    #[test]
    fn the_gains_have_the_lower_bound_of_w_in_them_and_each_its_own_rho() {
        // λ_1α = 1: √3 and √5; with ᾱ in place of α, as printed, half of that (erratum 4.5).
        let bound = Assumption41 { lambda_1: 2.0, rho_1: 3.0, rho_2: 5.0, alpha: 0.5, alpha_bar: 2.0 }.bound();
        assert!((bound.of_speed - 3f64.sqrt()).abs() < 1e-12 && (bound.of_disturbance - 5f64.sqrt()).abs() < 1e-12);
        assert!(bound.overshoot == 2.0 && bound.rate == 1.0);
    }
}
