//! The conditions and rates of the theorems as functions.
//!
//! | statement | source | what it promises | file |
//! |---|---|---|---|
//! | two vehicles that switch | Lemma 1.1, (1.6), (1.7); erratum 1.1 | \|x\| decays at (1 − α)a | [`lemma_1_1`] |
//! | brief connectivity losses | Theorem 4.4; errata 4.4, 4.6 | V at λ_0 − 2αk_mλ_m or min(λ_1, 2(1 − α)k_mλ_m), norms at half | [`theorem_4_4`] |
//! | connected in mean | Theorems 4.2, 4.5; erratum 4.7 | agreement, with a rate proven here | [`theorem_4_5`] |
//! | event-triggered talk | this project; (4.21) with beliefs | ‖γ~‖ in the end below √n‖ΠA‖/λ_2 times the error of a belief | [`event_triggered`] |
//! | known delay | this project | agreement at v_L iff kλ_max τ < π/2, with its rate | [`known_delay`] |
//! | late information | Theorem 4.3, Lemmas 4.4, 4.5; errata 4.1–4.3 | agreement at v_L* = v_L/(1 + kτ) | [`delay`] |
//!
//! Quadratic functions such as V decay at twice the rate of the norms of errors (erratum 4.4). Rates of norms are what
//! can be laid beside a measurement, so [`Verdict::norm_rate`] is always one of those.

use serde::Serialize;

pub mod delay;
pub mod event_triggered;
pub mod known_delay;
pub mod lemma_1_1;
pub mod theorem_4_4;
pub mod theorem_4_5;

/// What a statement says of a mission or of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The statement.
    pub name: &'static str,
    /// What it asks for.
    pub condition: String,
    /// What is the case.
    pub value: String,
    /// Whether that is what it asks for.
    pub holds: bool,
    /// The rate at which it then guarantees that errors (norms, not squares) decay \[1/s\], if it guarantees one.
    pub norm_rate: Option<f64>,
}

/// A path-following subsystem as coordination sees it: Assumption 4.1, (4.6) and (4.7).
///
/// ```text
/// α_1|ζ_i|² ≤ W_i,    dW_i/dt ≤ −λ_1 W_i + ρ_1|v~_r|² + ρ_2 d_i²
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathFollowing {
    /// The speed-tracking error η_i is a state, which disturbs coordination.
    TypeI {
        /// λ_1: decay rate of W_i \[1/s\], positive.
        lambda_1: f64,
        /// ρ_1: how much a demanded change of speed excites W_i, not negative.
        rho_1: f64,
        /// α_1: the lower bound of W_i, positive.
        alpha_1: f64,
    },
    /// The virtual target takes its demanded rate at once, η_i = 0.
    TypeII {
        /// λ_1: decay rate of W_i \[1/s\], positive.
        lambda_1: f64,
    },
}

/// What the theorems need of the gains: n vehicles, each with a gain between k_m and k_M.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// n: how many vehicles.
    pub n: usize,
    /// k_m: the smallest gain \[1/s\].
    pub k_m: f64,
    /// k_M: the largest gain \[1/s\].
    pub k_max: f64,
}

impl Gains {
    /// `None` for fewer than two vehicles, or if a gain is not positive and finite.
    pub fn new(gains: &[f64]) -> Option<Gains> {
        let valid = gains.len() > 1 && gains.iter().all(|&k| k > 0.0 && k.is_finite());
        let k_m = gains.iter().copied().fold(f64::INFINITY, f64::min);
        let k_max = gains.iter().copied().fold(0.0, f64::max);
        valid.then_some(Gains { n: gains.len(), k_m, k_max })
    }
}
