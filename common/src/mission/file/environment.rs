//! What disturbs a vehicle, and what its actuators give at most.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest efforts of the actuators, either way; which of them a vehicle has depends on its model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitsSection {
    /// Force of each driven direction (N); not for kinematic_unicycle.
    pub force_n: Option<f64>,
    /// Torque about each driven axis (N m); not for kinematic_unicycle.
    pub torque_nm: Option<f64>,
    /// Change of speed (m/s²); for kinematic_unicycle only.
    pub acceleration_mps2: Option<f64>,
    /// Turning rate (deg/s); for kinematic_unicycle only.
    pub turn_rate_degps: Option<f64>,
}

/// How the water moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurrentSection {
    /// Velocity of the water: east, north, up (m/s). A vehicle's own speed is through the water.
    pub velocity_mps: [f64; 3],
    /// A slow sinusoid on top of it.
    pub tide: Option<TideSection>,
}

/// A slow sinusoid on top of a current: amplitude sin(2π t / period + phase).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TideSection {
    /// Amplitude: east, north, up (m/s).
    pub amplitude_mps: [f64; 3],
    /// Period (s).
    pub period_s: f64,
    /// Phase at the start of the mission (deg).
    #[serde(default)]
    pub phase_deg: f64,
}

/// Standard deviations of what the vehicle measures of itself, drawn anew at each control period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct NoiseSection {
    /// Of each coordinate of its position (m).
    pub position_m: f64,
    /// Of its heading (deg).
    pub heading_deg: f64,
    /// Of each measured component of its velocity (m/s).
    pub speed_mps: f64,
    /// Of each measured turning rate (deg/s).
    pub turn_rate_degps: f64,
}

/// What fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailureChoice {
    /// The forward speed is stuck at a value, section 2.4.
    SpeedStuck(SpeedStuck),
}

/// The forward speed is stuck at a value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpeedStuck {
    /// The speed (m/s).
    pub speed_mps: f64,
    /// When the failure begins (s).
    #[serde(default)]
    pub from_s: f64,
    /// When it is over (s); without it, never.
    pub to_s: Option<f64>,
}
