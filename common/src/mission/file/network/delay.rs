//! Delays.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Delay of every message.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DelayChoice {
    /// None at all.
    #[default]
    None,
    /// The same for every message.
    Constant(ConstantDelay),
    /// Uniform between two bounds.
    Jittered(JitteredDelay),
    /// Normal, cut off below the least delay.
    Normal(RandomDelay),
    /// The least delay plus a gamma variable.
    Gamma(RandomDelay),
    /// Distance over the speed of the signal; distances follow from xi and the paths.
    Distance(DistanceDelay),
}

/// The same delay for every message.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ConstantDelay {
    /// The delay (s).
    pub delay_s: f64,
}

/// A delay drawn for every message.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct JitteredDelay {
    /// Least delay (s).
    pub min_s: f64,
    /// Greatest delay (s).
    pub max_s: f64,
}

/// A delay drawn for every message from an unbounded distribution.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct RandomDelay {
    /// Mean (s); of the normal distribution before it is cut off.
    pub mean_s: f64,
    /// Standard deviation (s); of the normal distribution before it is cut off.
    pub deviation_s: f64,
    /// Least delay (s).
    #[serde(default)]
    pub min_s: f64,
}

/// A delay from distance.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct DistanceDelay {
    /// Speed of the signal (m/s); of sound in sea water if absent.
    #[serde(default = "speed_of_sound")]
    pub speed_mps: f64,
    /// Added to every delay: what modems take (s).
    #[serde(default)]
    pub extra_s: f64,
}

fn speed_of_sound() -> f64 {
    1500.0
}
