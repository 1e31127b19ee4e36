//! What the laws of chapter 2 have in common: what they see, what they give, and gains that follow the speed and the
//! curvature.
//!
//! Lines and circles are the paths that a wheeled robot drives with constant speeds, its trimming paths. About them the
//! errors of the vehicle against the closest point of its path (2.9) are linear and time-invariant, (2.12):
//!
//! ```text
//! ṙ = N/I,    ḋ_e = v ψ_e,    ψ̇_e = r − c_c² v d_e
//! ```

use crate::path::foot::LEAST_NEARNESS;
use crate::positive::positive;

/// A vehicle against the closest point of its path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// d_e, distance from the path \[m\], positive to its left (erratum 2.6).
    pub d_e: f64,
    /// ψ_e = ψ − ψ_T, heading against the tangent \[rad\], within \[−π, π\].
    #[doc(alias = "ψ_e")]
    pub psi_e: f64,
    /// c_c, signed curvature of the path there \[1/m\], positive for a turn to the left.
    pub c_c: f64,
    /// v, forward speed \[m/s\].
    pub v: f64,
    /// v̇ = F/m, as commanded \[m/s²\].
    pub v_dot: f64,
    /// r, turning rate \[rad/s\].
    pub r: f64,
}

impl Deviation {
    /// Whether the vehicle is so near the path's centre of curvature, or beyond, that 1 − d_e c_c is limited.
    pub fn is_singular(&self) -> bool {
        let nearness = 1.0 - self.d_e * self.c_c;
        nearness < LEAST_NEARNESS || nearness.is_nan()
    }

    /// 1 − d_e c_c, at least [`LEAST_NEARNESS`].
    fn nearness(&self) -> f64 {
        (1.0 - self.d_e * self.c_c).max(LEAST_NEARNESS)
    }

    /// ṡ = v cos ψ_e/(1 − d_e c_c) (2.10), speed of the closest point \[m/s\].
    pub fn s_dot(&self) -> f64 {
        self.v * self.psi_e.cos() / self.nearness()
    }

    /// ḋ_e = v sin ψ_e (2.9).
    pub fn d_e_dot(&self) -> f64 {
        self.v * self.psi_e.sin()
    }

    /// ψ̇_e = r − c_c ṡ (2.9).
    pub fn psi_e_dot(&self) -> f64 {
        self.r - self.c_c * self.s_dot()
    }

    /// η = r − c_c v (2.17, erratum 2.8), turning rate that the path does not ask for \[rad/s\].
    pub fn eta(&self) -> f64 {
        self.r - self.c_c * self.v
    }
}

/// Turning acceleration N/I over a control period, going evenly from one value to the other \[rad/s²\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turning {
    /// At its begin.
    pub from: f64,
    /// At its end.
    pub to: f64,
}

/// A path-following law of chapter 2.
pub trait TrimmingLaw: Send + std::fmt::Debug {
    /// Takes what is seen at the begin of a control period.
    fn see(&mut self, seen: &Deviation);
    /// Moves the law's states over `dt` seconds with what was seen held, and gives the turning acceleration meanwhile.
    fn advance(&mut self, dt: f64) -> Turning;
}

/// k_1 to k_4 of (2.14) and (2.19).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// On the turning rate \[1/s\].
    pub k_1: f64,
    /// On the distance \[1/(m s²)\].
    pub k_2: f64,
    /// On the heading \[1/s²\].
    pub k_3: f64,
    /// On the integral of the distance \[1/(m s³)\].
    pub k_4: f64,
}

/// Gains (2.16), which place all four eigenvalues at −λ_p, scheduled on the curvature and on the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    lambda_p: f64,
    v_min: f64,
}

impl Placement {
    /// `lambda_p` λ_p > 0 \[1/s\], well below the inverse of the control period; `v_min` > 0 \[m/s\], the speed with which
    /// slower vehicles are reckoned (erratum 2.4): k_2 and k_4 grow with 1/v, and r/c_c of the text is 0/0 on lines.
    pub fn new(lambda_p: f64, v_min: f64) -> Result<Placement, String> {
        Ok(Placement {
            lambda_p: positive("lambda_p", lambda_p)?,
            v_min: positive("the least speed of gain scheduling", v_min)?,
        })
    }

    /// (2.16) at curvature `c_c` \[1/m\] and speed `v` \[m/s\].
    pub fn gains(&self, c_c: f64, v: f64) -> Gains {
        let (lambda, v) = (self.lambda_p, v.max(self.v_min));
        Gains {
            k_1: 4.0 * lambda,
            k_2: 4.0 * lambda.powi(3) / v - 4.0 * lambda * c_c * c_c * v,
            k_3: 6.0 * lambda * lambda - (c_c * v).powi(2),
            k_4: lambda.powi(4) / v,
        }
    }
}

/// The low-pass 1/(τs + 1): what is behind it has s/(τs + 1) of the signal for its derivative, which is the approximate
/// differentiation of section 2.1.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    tau: f64,
    value: Option<f64>,
}

impl LowPass {
    /// `tau` τ > 0 \[s\]; it starts at the first value that it sees.
    pub fn new(tau: f64) -> Result<LowPass, String> {
        Ok(LowPass { tau: positive("the time constant of differentiation", tau)?, value: None })
    }

    /// What is behind the filter rises by, over `dt` seconds with the signal held at `y`.
    pub fn rise(&mut self, y: f64, dt: f64) -> f64 {
        self.rise_by(y - self.value.unwrap_or(y), y, dt)
    }

    /// The same for an angle, the short way round.
    pub fn rise_of_angle(&mut self, y: f64, dt: f64) -> f64 {
        self.rise_by(crate::path::geometry::wrap_angle(y - self.value.unwrap_or(y)), y, dt)
    }

    fn rise_by(&mut self, ahead: f64, y: f64, dt: f64) -> f64 {
        let rise = -(-dt / self.tau).exp_m1() * ahead;
        self.value = Some(y - ahead + rise);
        rise
    }
}

/// Where the derivatives of the D-methodology come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Derivative {
    /// Exact, by (2.9) or by carrying the differentiation through the controller.
    Exact,
    /// s/(τs + 1) of what is measured.
    Filtered {
        /// τ \[s\], positive and small against 1/λ_p.
        tau: f64,
    },
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Deviation, LowPass, Placement};

    #[test]
    fn gains_2_16_by_hand() {
        let gains = Placement::new(2.0, 0.05).unwrap().gains(-0.5, 0.4);
        assert_eq!((gains.k_1, gains.k_3), (8.0, 24.0 - 0.04));
        assert!((gains.k_2 - (80.0 - 0.8)).abs() < 1e-12 && (gains.k_4 - 40.0).abs() < 1e-12);
    }

    #[test]
    fn slow_vehicles_are_reckoned_with_the_least_speed() {
        let placement = Placement::new(1.0, 0.05).unwrap();
        for slow in [0.0, 0.049, -3.0, f64::NAN] {
            assert_eq!(placement.gains(0.5, slow), placement.gains(0.5, 0.05));
        }
        assert!(Placement::new(0.0, 0.05).is_err() && Placement::new(1.0, 0.0).is_err());
    }

    #[test]
    fn at_the_centre_of_curvature_everything_is_finite() {
        for d_e in [2.0, 5.0, 1e9, f64::NAN] {
            let seen = Deviation { d_e, c_c: 0.5, v: 0.3, psi_e: 0.2, ..Deviation::default() };
            assert!(seen.is_singular() && seen.psi_e_dot().is_finite(), "{d_e}");
        }
        assert!(!Deviation { d_e: -1e9, c_c: 0.5, ..Deviation::default() }.is_singular(), "the outside is wide");
    }

    #[test]
    fn a_step_behind_the_filter() {
        let mut filter = LowPass::new(0.5).unwrap();
        assert_eq!(filter.rise(3.0, 0.1), 0.0, "it starts where the signal does");
        let risen: f64 = (0..10).map(|_| filter.rise(4.0, 0.1)).sum();
        assert!((risen - (1.0 - (-2.0f64).exp())).abs() < 1e-12);
    }

    #[test]
    fn a_heading_that_passes_half_a_turn_does_not_jump() {
        let mut filter = LowPass::new(0.5).unwrap();
        filter.rise_of_angle(3.1, 0.1);
        let rise = filter.rise_of_angle(-3.1, 0.1);
        assert!(rise > 0.0 && rise < 0.1, "{rise}");
        assert!(LowPass::new(0.0).is_err());
    }

    proptest! {
        /// The same mirrored: left is right, and the sense of the circle with it.
        #[test]
        fn the_errors_are_mirror_symmetric(d_e in -0.5..0.5f64, psi_e in -3.0..3.0f64, c_c in -1.0..1.0f64,
                                           v in 0.0..1.0f64, r in -1.0..1.0f64) {
            let seen = Deviation { d_e, psi_e, c_c, v, v_dot: 0.1, r };
            let mirrored = Deviation { d_e: -d_e, psi_e: -psi_e, c_c: -c_c, r: -r, ..seen };
            prop_assert_eq!(seen.s_dot(), mirrored.s_dot());
            prop_assert_eq!(seen.psi_e_dot(), -mirrored.psi_e_dot());
            prop_assert_eq!((seen.d_e_dot(), seen.eta()), (-mirrored.d_e_dot(), -mirrored.eta()));
            let placement = Placement::new(1.0, 0.05).unwrap();
            prop_assert_eq!(placement.gains(c_c, v), placement.gains(-c_c, v));
        }
    }

    #[test]
    fn equations_2_9_and_2_10_by_hand() {
        // 1 − d_e c_c = 0.8 for a turn to the left with the vehicle to the left of the path.
        let seen = Deviation { d_e: 0.4, psi_e: 0.3, c_c: 0.5, v: 0.6, v_dot: 0.0, r: 0.7 };
        let s_dot = 0.6 * 0.3f64.cos() / 0.8;
        assert!((seen.s_dot() - s_dot).abs() < 1e-15 && (seen.d_e_dot() - 0.6 * 0.3f64.sin()).abs() < 1e-15);
        assert!((seen.psi_e_dot() - (0.7 - 0.5 * s_dot)).abs() < 1e-15 && (seen.eta() - 0.4).abs() < 1e-15);
        // Half way to the centre of curvature, on circles of 2 m and of ½ m, is not near it; nine tenths and more are.
        let at = |d_e, c_c| Deviation { d_e, c_c, ..Deviation::default() }.is_singular();
        assert!(!at(1.0, 0.5) && !at(0.25, 2.0) && at(1.9, 0.5) && at(0.475, 2.0));
    }
}
