//! The section `[network]`: links, and how badly messages travel on them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How badly messages travel.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct NetworkSection {
    /// Links in both directions: pairs of vehicle ids.
    #[serde(default)]
    pub links: Vec<[String; 2]>,
    /// Links in one direction: from and to.
    #[serde(default)]
    pub one_way: Vec<[String; 2]>,
    /// Delay of every message.
    #[serde(default)]
    pub delay: DelayChoice,
    /// Loss of single messages.
    #[serde(default)]
    pub loss: LossChoice,
    /// Links that come and go. A message is received if its link is up when it arrives.
    #[serde(default)]
    pub switching: SwitchingChoice,
    /// Most messages under way on one directed link; beyond it new ones are dropped.
    #[serde(default = "default_queue")]
    pub queue: u32,
    /// Exceptions for single directed links.
    #[serde(default)]
    pub exceptions: Vec<LinkException>,
}

/// An exception for one directed link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinkException {
    /// Sender.
    pub from: String,
    /// Receiver.
    pub to: String,
    /// Its delay, if other than the network's.
    pub delay: Option<DelayChoice>,
    /// Its loss, if other than the network's.
    pub loss: Option<LossChoice>,
}

/// Delay of every message.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DelayChoice {
    /// None at all.
    #[default]
    None,
    /// The same for every message.
    Constant(ConstantDelay),
    /// Uniform between two bounds, drawn for every message; messages may overtake one another.
    Jittered(JitteredDelay),
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

/// Loss of single messages.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LossChoice {
    /// None is lost.
    #[default]
    None,
    /// Each is lost with the same probability, independently.
    Bernoulli(Bernoulli),
}

/// Independent losses.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Bernoulli {
    /// Probability that a message is lost, 0 to 1.
    pub probability: f64,
}

/// Links that come and go.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SwitchingChoice {
    /// Every link is up all the time.
    #[default]
    Always,
    /// All links together, up for a part of every period.
    Periodic(PeriodicSwitching),
    /// All links, or the named ones, are up in these intervals only.
    Intervals(IntervalSwitching),
    /// All links together, at random, such that Definition 4.3 holds with this alpha and T_0.
    Random(RandomSwitching),
    /// One link at a time, in the order of `links`.
    OneAtATime(OneAtATime),
}

/// All links together, up for a part of every period.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct PeriodicSwitching {
    /// Length of the period (s).
    pub period_s: f64,
    /// When in the period the links come up (s).
    pub up_from_s: f64,
    /// How long they stay up (s).
    pub up_for_s: f64,
}

/// Links that are up in stated intervals only.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct IntervalSwitching {
    /// The intervals.
    pub up: Vec<UpInterval>,
    /// The intervals repeat with this period (s); without it they happen once.
    pub period_s: Option<f64>,
}

/// An interval during which links are up.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct UpInterval {
    /// Begin (s).
    pub from_s: f64,
    /// End (s).
    pub to_s: f64,
    /// Directed links from and to; all of them if absent.
    pub links: Option<Vec<[String; 2]>>,
}

/// Random switching with a guaranteed bound.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct RandomSwitching {
    /// Asymptotic connectivity-loss rate, 0 to below 1.
    pub alpha: f64,
    /// Connectivity-loss bound T_0 (s).
    pub t_0_s: f64,
    /// Least time between two changes (s).
    pub dwell_s: f64,
}

/// One link at a time.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct OneAtATime {
    /// How long each is up (s).
    pub dwell_s: f64,
}

fn default_queue() -> u32 {
    10_000
}
