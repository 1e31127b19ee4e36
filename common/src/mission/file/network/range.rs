//! Ranges.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Over which distance messages are heard; distances follow from xi and the paths.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RangeChoice {
    /// Over any.
    #[default]
    Unlimited,
    /// Up to a radius.
    Disc(DiscRange),
    /// With a probability over distance.
    Curve(CurveRange),
}

/// Heard up to a radius.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct DiscRange {
    /// The radius (m).
    pub radius_m: f64,
}

/// Heard with a probability over distance.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CurveRange {
    /// Points [distance (m), probability of success], linear between them, none beyond the last.
    pub points: Vec<[f64; 2]>,
}
