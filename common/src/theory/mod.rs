//! The conditions and rates of the theorems as functions.
//!
//! | statement | source | what it promises | file |
//! |---|---|---|---|
//! | two vehicles that switch | Lemma 1.1, (1.6), (1.7); erratum 1.1 | \|x\| decays at (1 − α)a | [`lemma_1_1`] |
//! | decoupled path following with a leader | (2.15), (2.16), (2.37), (2.38); errata 2.1, 2.3 | stable above a critical λ_p | [`decoupling_2_37`] |
//! | gateway, with a failed vehicle | (2.29), (2.35), (2.42), (2.43); errata 2.2, 2.11 | stable; a known steady error | [`gateway_2_35`] |
//! | neighbours in a row | this project, result x of docs/errata.md | the slowest mode | [`neighbours`] |
//! | two-way fixed networks | Propositions 3.4, 3.5; (3.41), (3.48), (3.75) | agreement; exact rates, and one for varying R_i proven here | [`proposition_3_4`], [`linear_coordination`] |
//! | one-way fixed networks | Propositions 3.6, 3.7, (3.73), (3.81), (3.85), (3.93); errata 3.13, 3.15, 3.16 | agreement at the slowest root | [`proposition_3_6`] |
//! | bounded speeds with saturation | Proposition 3.8, Lemma 6.1, (3.97); erratum 3.14 | Q > 0 | [`proposition_3_8`] |
//! | brief connectivity losses | Theorem 4.4; errata 4.4, 4.6 | V at λ_0 − 2αk_mλ_m or min(λ_1, 2(1 − α)k_mλ_m), norms at half | [`theorem_4_4`] |
//! | connected in mean | Theorems 4.2, 4.5; erratum 4.7 | agreement, with a rate proven here | [`theorem_4_5`] |
//! | event-triggered talk | this project; (4.21) with beliefs | ‖γ~‖ in the end below √n‖ΠA‖/λ_2 times the error of a belief | [`event_triggered`] |
//! | known delay | this project | agreement at v_L iff kλ_max τ < π/2, with its rate | [`known_delay`] |
//! | late information | Theorem 4.3, Lemmas 4.4, 4.5; errata 4.1–4.3 | agreement at v_L* = v_L/(1 + kτ) | [`delay`] |
//! | how fast, on a fixed network | (4.40) | the rightmost root | [`delay_rate`] |
//! | coordination with a state of its own | Lemmas 4.2, 4.6, 4.7, Theorems 4.8, 4.9, (4.63)–(4.66); errata 4.19, 4.20 | V at (1 − α)λ_c − αλ_d, norms at half | [`lemma_4_6`] |
//! | all of these over a run as measured | Definitions 4.3, 4.4, Theorems 4.4, 4.5, Lemma 4.7 | covered, not covered and by how much, or a defect | [`monitor`] |
//!
//! Quadratic functions such as V decay at twice the rate of the norms of errors (erratum 4.4). Rates of norms are what
//! can be laid beside a measurement, so [`Verdict::norm_rate`] is always one of those.

use serde::Serialize;

pub mod decoupling_2_37;
pub mod delay;
pub mod delay_rate;
pub mod event_triggered;
pub mod gateway_2_35;
pub mod known_delay;
pub mod lemma_1_1;
pub mod lemma_4_6;
pub mod linear_coordination;
pub mod monitor;
pub mod neighbours;
pub mod polynomial;
pub mod proposition_3_4;
pub mod proposition_3_6;
pub mod proposition_3_8;
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    #[test]
    fn every_path_in_the_index_exists() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
        let index = include_str!("../../../docs/theory.md");
        let quoted = index.split('`').skip(1).step_by(2).filter(|text| text.ends_with(".rs"));
        let (mut count, mut missing) = (0, Vec::new());
        for path in quoted {
            let found = root.join("common/src").join(path).exists() || root.join(path).exists();
            // A module is a file or a folder, as it grows.
            let folder = root.join("common/src").join(path.trim_end_matches(".rs")).join("mod.rs").exists();
            if !(found || folder) {
                missing.push(path);
            }
            count += 1;
        }
        assert!(count > 40 && missing.is_empty(), "{count} paths, missing: {missing:?}");
    }

    #[test]
    fn every_file_about_theory_is_in_the_index() {
        let index = include_str!("../../../docs/theory.md");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/theory");
        for entry in std::fs::read_dir(folder).expect("lists") {
            let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
            assert!(index.contains(&format!("`theory/{name}`")), "{name} is not in docs/theory.md");
        }
    }
}
