//! Path-following laws and their gains.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A path-following law and its gains.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FollowingChoice {
    /// Line of sight, (1.4).
    LineOfSight(LineOfSight),
    /// Chapter 2, full state by the D-methodology, (2.14) to (2.16).
    Decoupling(Decoupling),
    /// Chapter 2, from the distance and the turning rate alone, Figures 2.3 and 2.4.
    OutputFeedback(OutputFeedback),
    /// Chapter 2, state transformation, (2.17) to (2.19).
    StateTransformation(StateTransformation),
    /// Proposition 3.1 with Appendix 6.1.
    Proposition31(Proposition31),
    /// Proposition 3.2: Proposition 3.1 without the coupling Δ.
    Proposition32(Proposition31),
    /// Proposition 3.3 for fully actuated marine vehicles, with erratum 3.3.
    Proposition33(Proposition33),
    /// Theorem 4.7, with the roll treatment of docs/errata.md.
    Theorem47(Theorem47),
}

/// Gain of (1.4).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LineOfSight {
    /// Look-ahead distance Δ (m).
    pub distance_m: f64,
}

/// Where the derivatives of the D-methodology come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DerivativeChoice {
    /// Exact ones.
    #[default]
    Exact,
    /// s/(τ s + 1) of what is measured.
    Filtered(Filtered),
}

/// The filter s/(τ s + 1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Filtered {
    /// Time constant τ (s).
    pub tau_s: f64,
}

/// Gains of (2.14) to (2.16).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Decoupling {
    /// All four eigenvalues are placed at -λ_p (1/s).
    pub lambda_p: f64,
    /// Slower vehicles are reckoned with this speed in gain scheduling (m/s).
    pub v_min_mps: f64,
    /// Where the derivatives come from.
    pub derivative: DerivativeChoice,
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
}

impl Default for Decoupling {
    fn default() -> Self {
        Decoupling { lambda_p: 1.0, v_min_mps: 0.05, derivative: DerivativeChoice::Exact, k_speed: 2.0 }
    }
}

/// The design of Figures 2.3 and 2.4.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct OutputFeedback {
    /// The speed that the controller is designed for, whatever the vehicle's is (m/s).
    pub design_speed_mps: f64,
    /// Disturbance of the heading that the design reckons with (rad/s).
    pub heading_disturbance: f64,
    /// Disturbance of the turning acceleration (rad/s²).
    pub torque_disturbance: f64,
    /// Noise of the measurements of turning rate (rad/s), distance (m) and its integral (m s).
    pub noise: [f64; 3],
    /// Where the derivatives come from.
    pub derivative: DerivativeChoice,
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
}

impl Default for OutputFeedback {
    fn default() -> Self {
        OutputFeedback {
            design_speed_mps: 0.4,
            heading_disturbance: 1.0,
            torque_disturbance: 1.0,
            noise: [0.1; 3],
            derivative: DerivativeChoice::Exact,
            k_speed: 2.0,
        }
    }
}

/// Gains of (2.19) with (2.16).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StateTransformation {
    /// All four eigenvalues are placed at -λ_p (1/s).
    pub lambda_p: f64,
    /// Slower vehicles are reckoned with this speed in gain scheduling (m/s).
    pub v_min_mps: f64,
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
}

impl Default for StateTransformation {
    fn default() -> Self {
        StateTransformation { lambda_p: 1.0, v_min_mps: 0.05, k_speed: 2.0 }
    }
}

/// The angle at which a vehicle approaches its path, over its distance y from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApproachChoice {
    /// asin(k_2 y/(|y| + ε_0)), (3.13), of `k2` and `epsilon_m`.
    #[default]
    Arcsine,
    /// (2ψ_a/π) atan(y/length), Appendix 6.1; `k2` and `epsilon_m` are not used.
    Arctangent(ArctangentApproach),
}

/// The approach of Appendix 6.1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ArctangentApproach {
    /// Steepest approach ψ_a, above 0 and at most 90 (deg).
    pub psi_a_deg: f64,
    /// Distance at which half of it is reached (m); 1 in the thesis.
    #[serde(default = "one_metre")]
    pub length_m: f64,
}

fn one_metre() -> f64 {
    1.0
}

/// The speed whose sign is sign(v) of (3.13), with hysteresis (erratum 3.9).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SenseChoice {
    /// That of the vehicle, as printed.
    #[default]
    ActualSpeed,
    /// The one that is wanted of it: calmer where a transient carries the vehicle's through zero, but while the two have
    /// different signs the vehicle moves away from its path.
    DesiredSpeed,
}

/// Gains of Proposition 3.1.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Proposition31 {
    /// Heading gain k_1 (1/s).
    pub k1: f64,
    /// Approach-angle gain k_2, above 0 and at most 1.
    pub k2: f64,
    /// Along-path gain k_3 of the virtual target (1/s).
    pub k3: f64,
    /// Turn-rate gain k_4 (1/s).
    pub k4: f64,
    /// Length ε_0 over which the approach angle builds up (m).
    pub epsilon_m: f64,
    /// Shape of the approach angle.
    pub approach: ApproachChoice,
    /// Which speed decides whether the vehicle counts as going forward: sign(v) of (3.13).
    pub sense_of: SenseChoice,
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
}

impl Default for Proposition31 {
    fn default() -> Self {
        Proposition31 {
            k1: 1.0,
            k2: 0.6,
            k3: 1.0,
            k4: 1.0,
            epsilon_m: 0.3,
            approach: ApproachChoice::Arcsine,
            sense_of: SenseChoice::ActualSpeed,
            k_speed: 2.0,
        }
    }
}

/// Gains of Proposition 3.3, and the side-slip that is wanted: mean + amplitude sin(2π t / period).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Proposition33 {
    /// Heading gain k_1 (1/s).
    pub k1: f64,
    /// Approach-angle gain k_2, above 0 and at most 1.
    pub k2: f64,
    /// Along-path gain k_3 of the virtual target (1/s).
    pub k3: f64,
    /// Turn-rate gain k_4 (1/s).
    pub k4: f64,
    /// Length ε_0 over which the approach angle builds up (m).
    pub epsilon_m: f64,
    /// Shape of the approach angle.
    pub approach: ApproachChoice,
    /// Which speed decides whether the vehicle counts as going forward: sign(v) of (3.13).
    pub sense_of: SenseChoice,
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
    /// Gain k_0 of the side-slip (1/s).
    pub k_slip: f64,
    /// Mean of the side-slip, positive to the left (deg).
    pub slip_deg: f64,
    /// Amplitude of the side-slip (deg).
    pub slip_amplitude_deg: f64,
    /// Period of the side-slip (s).
    pub slip_period_s: f64,
}

impl Default for Proposition33 {
    fn default() -> Self {
        let Proposition31 { k1, k2, k3, k4, epsilon_m, approach, sense_of, k_speed } = Proposition31::default();
        Proposition33 {
            k1,
            k2,
            k3,
            k4,
            epsilon_m,
            approach,
            sense_of,
            k_speed,
            k_slip: 1.0,
            slip_deg: 0.0,
            slip_amplitude_deg: 0.0,
            slip_period_s: 60.0,
        }
    }
}

/// Gains of Theorem 4.7.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Theorem47 {
    /// How the virtual target moves.
    pub kind: FollowingType,
    /// Position gain k_e (t/s).
    pub k_e: f64,
    /// Velocity gain k_φ (t/s).
    pub k_phi: f64,
    /// Turn-rate gain k_z (t m²/s).
    pub k_z: f64,
    /// Gain k_η of type I (1/s).
    pub k_eta: f64,
    /// First entry of the design vector δ, below 0 (m/s).
    pub delta1_mps: f64,
}

impl Default for Theorem47 {
    fn default() -> Self {
        Theorem47 { kind: FollowingType::II, k_e: 0.5, k_phi: 1.0, k_z: 4.0, k_eta: 1.0, delta1_mps: -0.3 }
    }
}

/// How the virtual target moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FollowingType {
    /// γ' = v_r + η with its own dynamics, (4.53).
    I,
    /// γ' = v_r.
    II,
}
