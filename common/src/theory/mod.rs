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
//! | disturbed path following | Assumption 4.1, (4.25)–(4.28); erratum 4.5 | \|ζ\| in the end below gains times what disturbs it | [`assumption_4_1`] |
//! | brief connectivity losses | Theorem 4.4; errata 4.4, 4.6 | V at λ_0 − 2αk_mλ_m or min(λ_1, 2(1 − α)k_mλ_m), norms at half | [`theorem_4_4`] |
//! | connected in mean | Theorems 4.2, 4.5; erratum 4.7 | agreement, with a rate proven here | [`theorem_4_5`] |
//! | event-triggered talk | this project; (4.21) with beliefs | ‖γ~‖ in the end below √n‖ΠA‖/λ_2 times the error of a belief | [`event_triggered`] |
//! | known delay | this project | agreement at v_L iff kλ_max τ < π/2, with its rate | [`known_delay`] |
//! | known delays that differ from link to link | this project | agreement if kλ_max τ < π/2 (alike both ways, with a rate), or if k‖T‖ < 1 | [`known_delay_by_link`] |
//! | late information | Theorem 4.3, Lemmas 4.4, 4.5; errata 4.1–4.3 | agreement at v_L* = v_L/(1 + kτ) | [`delay`] |
//! | how fast, on a fixed network | (4.40) | the rightmost root | [`delay_rate`] |
//! | coordination with a state of its own | Lemmas 4.2, 4.6, 4.7, Theorem 4.9, (4.63)–(4.66); errata 4.19, 4.20 | V at (1 − α)λ_c − αλ_d, norms at half | [`lemma_4_6`] |
//! | the same with α_2, on a fixed network | Theorem 4.8, (4.59)–(4.61); result xii of docs/errata.md | all errors at μ into a ball; to zero at an exact rate for equal vehicles on lines | [`theorem_4_8`] |
//! | what δ leaves | errata 4.3, 4.12, 4.14; results iv, v, xiii | the fleet's rate, every vehicle's bias, how far unequal vehicles stay apart | [`steady_motion`] |
//! | all of these over a run as measured | Definitions 4.3, 4.4, Theorems 4.4, 4.5, Lemma 4.7 | covered, not covered and by how much, or a defect | [`monitor`] |
//!
//! Quadratic functions such as V decay at twice the rate of the norms of errors (erratum 4.4). Rates of norms are what
//! can be laid beside a measurement, so [`Verdict::norm_rate`] is always one of those.

use serde::Serialize;

pub mod assumption_4_1;
pub mod decoupling_2_37;
pub mod delay;
pub mod delay_rate;
pub mod event_triggered;
pub mod gateway_2_35;
pub mod known_delay;
pub mod known_delay_by_link;
pub mod lemma_1_1;
pub mod lemma_4_6;
pub mod linear_coordination;
pub mod monitor;
pub mod neighbours;
pub mod polynomial;
pub mod proposition_3_4;
pub mod proposition_3_6;
pub mod proposition_3_8;
pub mod steady_motion;
pub mod theorem_4_4;
pub mod theorem_4_5;
pub mod theorem_4_8;

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

/// What Theorem 4.7 with (4.53) needs to be known of a vehicle and its path: W_4 then has the constants of Assumption 4.1.
///
/// From W_4 = ½|e|² + ½φ'M²φ + ½z_2'Jz_2 + ½η² and
/// W_4' = −k_e e'M⁻¹e − k_φ φ'Mφ − k_z|z_2|² − k_ηη² + e'δ + α_2v~_r, α_2 = −e'q + (Mφ)'h_1, |h_1| ≤ b := v_n m|p''| + k_e|p'|,
/// with m the largest mass and j the largest inertia: for λ_1 below 2·min(k_e/m, k_φ/m, k_z/j, k_η) what is left of the two first
/// terms bears v~_r by Young's inequality,
///
/// ```text
/// ρ_1 = (m/4)(|p'|²/(k_e(1 − λ_1m/(2k_e))) + b²/(k_φ(1 − λ_1m/(2k_φ)))),    α_1 = ½ min(1, least m², least j)
/// ```
///
/// and as little as one likes of the first bears δ. (4.54) is printed with |v~_r| where this has its square, as Assumption 4.1 does.
/// λ_1 is chosen to make ρ_1/(α_1λ_1) small.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Underactuated {
    /// Smallest and largest entry of M \[t\].
    pub mass: (f64, f64),
    /// Smallest and largest entry of J \[t m²\].
    pub inertia: (f64, f64),
    /// k_e, k_φ, k_z, k_η.
    pub gains: [f64; 4],
    /// The largest |v_n| \[1/s\].
    pub fastest: f64,
    /// The largest |p'| \[m\].
    pub stretch: f64,
    /// The largest |p''| \[m\].
    pub bend: f64,
}

impl Underactuated {
    /// The constants of Assumption 4.1 for type I; `None` if a gain, mass or inertia is not positive.
    pub fn type_1(&self) -> Option<PathFollowing> {
        const STEPS: u32 = 200;
        let [k_e, k_phi, k_z, k_eta] = self.gains;
        let (m, j) = (self.mass.1, self.inertia.1);
        let positive = [k_e, k_phi, k_z, k_eta, self.mass.0, m, self.inertia.0, j];
        if !positive.iter().all(|value| *value > 0.0 && value.is_finite()) {
            return None;
        }
        let alpha_1 = 0.5 * self.mass.0.powi(2).min(self.inertia.0).min(1.0);
        let border = 2.0 * (k_e / m).min(k_phi / m).min(k_z / j).min(k_eta);
        let b = self.fastest.abs() * m * self.bend + k_e * self.stretch;
        let rho_1 = |lambda_1: f64| {
            let left = |k: f64| k * (1.0 - lambda_1 * m / (2.0 * k));
            0.25 * m * (self.stretch.powi(2) / left(k_e) + b * b / left(k_phi))
        };
        (1..STEPS)
            .map(|step| border * f64::from(step) / f64::from(STEPS))
            .map(|lambda_1| PathFollowing::TypeI { lambda_1, rho_1: rho_1(lambda_1), alpha_1 })
            .min_by(|a, b| a.coupling().total_cmp(&b.coupling()))
    }
}

impl PathFollowing {
    /// ρ_1/(α_1λ_1): how much coordination excites path following; zero for type II, where it does not come back.
    pub fn coupling(&self) -> f64 {
        match *self {
            PathFollowing::TypeI { lambda_1, rho_1, alpha_1 } => rho_1 / (alpha_1 * lambda_1),
            PathFollowing::TypeII { .. } => 0.0,
        }
    }
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

    use super::{Gains, PathFollowing, Underactuated};

    #[test]
    fn the_constants_of_theorem_4_7_bear_what_young_says() {
        let vehicle = Underactuated {
            mass: (4.7, 7.6),
            inertia: (7.5, 7.7),
            gains: [0.5, 1.0, 4.0, 1.0],
            fastest: 0.5,
            stretch: 0.31,
            bend: 0.005,
        };
        let Some(PathFollowing::TypeI { lambda_1, rho_1, alpha_1 }) = vehicle.type_1() else {
            panic!("positive gains")
        };
        assert!(alpha_1 == 0.5 && lambda_1 < 2.0 * 0.5 / 7.6 && rho_1 > 0.0);
        // W_4' + λ_1W_4 − ρ_1v² with the worst masses is negative wherever one looks (z_2 = η = δ = 0).
        let (m, b) = (7.6, 0.5 * 7.6 * 0.005 + 0.5 * 0.31);
        for (e, y, v) in [(1.0, 0.0, 0.02), (1.0, 2.0, 0.1), (0.2, 3.0, 0.6), (5.0, 0.3, 0.4), (1.0, 1.0, 1.0)] {
            let decay = -(0.5 * e * e + y * y) / m + 0.31 * e * v + b * y * v;
            assert!(decay + lambda_1 * 0.5 * (e * e + y * y) - rho_1 * v * v <= 1e-12, "{e} {y} {v}");
        }
        assert!(Underactuated { gains: [0.5, 0.0, 4.0, 1.0], ..vehicle }.type_1().is_none());
    }

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
            // A file, or a folder.
            let named = [format!("`theory/{name}`"), format!("`theory/{name}/`")];
            assert!(named.iter().any(|named| index.contains(named)), "{name} is not in docs/theory.md");
        }
    }

    /// Unlike numbers all over, and |v_n| whatever its sign.
    const VEHICLE: Underactuated = Underactuated {
        mass: (4.7, 7.6),
        inertia: (7.5, 7.7),
        gains: [0.5, 1.3, 4.0, 1.1],
        fastest: -0.6,
        stretch: 0.31,
        bend: 0.2,
    };

    fn type_1(vehicle: Underactuated) -> (f64, f64, f64) {
        match vehicle.type_1() {
            Some(PathFollowing::TypeI { lambda_1, rho_1, alpha_1 }) => (lambda_1, rho_1, alpha_1),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn no_smaller_rho_1_would_do() {
        // Where e and y = Mφ are worst for a given v~_r, W_4' + λ_1W_4 − ρ_1v~_r² is just zero (z_2 = η = δ = 0).
        let (lambda_1, rho_1, _) = type_1(VEHICLE);
        let (m, v) = (7.6, 0.4);
        let (p, b) = (0.31, 0.6 * 7.6 * 0.2 + 0.5 * 0.31);
        let (of_e, of_y) = (0.5 / m - 0.5 * lambda_1, 1.3 / m - 0.5 * lambda_1);
        assert!(of_e > 0.0 && of_y > 0.0, "λ_1 is not too large to be borne");
        let (e, y) = (p * v / (2.0 * of_e), b * v / (2.0 * of_y));
        let worst = -of_e * e * e + p * e * v - of_y * y * y + b * y * v;
        assert!((worst - rho_1 * v * v).abs() < 1e-12 * rho_1, "{worst} {}", rho_1 * v * v);
    }

    #[test]
    fn lambda_1_leaves_the_least_coupling_and_some_of_every_term() {
        let (lambda_1, rho_1, alpha_1) = type_1(VEHICLE);
        let coupling = |lambda: f64| {
            let (p, b) = (0.31f64, 0.6f64 * 7.6 * 0.2 + 0.5 * 0.31);
            (p * p / (4.0 * (0.5 / 7.6 - 0.5 * lambda)) + b * b / (4.0 * (1.3 / 7.6 - 0.5 * lambda))) / (0.5 * lambda)
        };
        assert!((coupling(lambda_1) - rho_1 / (alpha_1 * lambda_1)).abs() < 1e-9);
        assert!([0.5, 0.9, 1.1, 1.2].iter().all(|part| coupling(part * lambda_1) > coupling(lambda_1)));
        // Whichever term decays slowest, λ_1 stays below twice its rate, and does not stop far from it where nothing else does.
        let with = |gains| type_1(Underactuated { gains, ..VEHICLE });
        assert!((0.0198..0.02).contains(&with([0.5, 1.3, 4.0, 0.01]).0), "k_η");
        assert!((0.99..1.0).contains(&(with([0.5, 1.3, 0.05, 1.1]).0 * 7.7 / 0.1)), "k_z/j");
        let slow_phi = with([0.5, 0.02, 4.0, 1.1]);
        assert!(slow_phi.0 < 2.0 * 0.02 / 7.6 && slow_phi.1 > 0.0, "k_φ/m");
        let slow_e = with([0.02, 1.3, 4.0, 1.1]);
        assert!(slow_e.0 < 2.0 * 0.02 / 7.6 && slow_e.1 > 0.0, "k_e/m");
    }

    #[test]
    fn alpha_1_is_half_of_the_least_of_one_m_squared_and_j() {
        let of =
            |mass: f64, inertia: f64| type_1(Underactuated { mass: (mass, 7.6), inertia: (inertia, 7.7), ..VEHICLE }).2;
        assert!((of(4.7, 7.5) - 0.5).abs() < 1e-12);
        assert!((of(0.6, 7.5) - 0.18).abs() < 1e-12);
        assert!((of(0.6, 0.3) - 0.15).abs() < 1e-12);
        assert!((of(0.6, 0.4) - 0.18).abs() < 1e-12);
        for wrong in [
            Underactuated { gains: [0.5, 1.3, f64::INFINITY, 1.1], ..VEHICLE },
            Underactuated { mass: (0.0, 7.6), ..VEHICLE },
            Underactuated { inertia: (-1.0, 7.7), ..VEHICLE },
        ] {
            assert_eq!(wrong.type_1(), None, "{wrong:?}");
        }
    }

    #[test]
    fn type_ii_is_not_excited_by_coordination() {
        assert!((PathFollowing::TypeI { lambda_1: 2.0, rho_1: 3.0, alpha_1: 5.0 }.coupling() - 0.3).abs() < 1e-12);
        assert_eq!(PathFollowing::TypeII { lambda_1: 2.0 }.coupling(), 0.0);
    }

    #[test]
    fn gains_are_positive_and_of_two_vehicles_at_least() {
        assert_eq!(Gains::new(&[2.0, 0.5, 1.0]), Some(Gains { n: 3, k_m: 0.5, k_max: 2.0 }));
        assert_eq!(Gains::new(&[0.1, 0.1]), Some(Gains { n: 2, k_m: 0.1, k_max: 0.1 }));
        let wrong: [&[f64]; 6] = [&[], &[1.0], &[1.0, 0.0], &[-1.0, 1.0], &[1.0, f64::INFINITY], &[f64::NAN, 1.0]];
        for gains in wrong {
            assert_eq!(Gains::new(gains), None, "{gains:?}");
        }
    }
}
