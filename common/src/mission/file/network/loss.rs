//! Losses of single messages.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Loss of single messages.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LossChoice {
    /// None is lost.
    #[default]
    None,
    /// Each is lost with the same probability, independently.
    Bernoulli(Bernoulli),
    /// In bursts (Gilbert, Elliott).
    GilbertElliott(GilbertElliott),
    /// Fades that all links share.
    SharedFades(SharedFades),
    /// As recorded, over and over.
    Trace(LossTrace),
}

/// Independent losses.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Bernoulli {
    /// Probability that a message is lost, 0 to 1.
    pub probability: f64,
}

/// Losses in bursts.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GilbertElliott {
    /// Mean length of a burst (messages).
    pub mean_burst: f64,
    /// Mean length of a gap between bursts (messages).
    pub mean_gap: f64,
    /// Probability that a message in a burst is lost, 0 to 1.
    #[serde(default = "certain")]
    pub lost_in_burst: f64,
    /// Probability that a message in a gap is lost, 0 to 1.
    #[serde(default)]
    pub lost_in_gap: f64,
}

/// Fades that all links share.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SharedFades {
    /// Share of the messages that is lost, above 0 and below 1.
    pub probability: f64,
    /// Mean length of a fade (messages).
    pub mean_burst: f64,
    /// Correlation of the losses of any two links, 0 to 1.
    #[serde(default = "certain")]
    pub correlation: f64,
}

/// Losses as recorded.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LossTrace {
    /// Lengths of runs of message periods, by turns: arriving, lost, arriving, lost, …
    pub runs: Vec<u32>,
}

fn certain() -> f64 {
    1.0
}
