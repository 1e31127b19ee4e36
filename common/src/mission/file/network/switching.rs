//! Links that come and go.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// At random and without memory, up and down for exponential times.
    Markov(MarkovSwitching),
    /// One link at a time, at random, such that Definition 4.4 holds with this window.
    ConnectedInMean(InMeanSwitching),
    /// As recorded: `mission-control export RUN --format network` writes this section.
    Trace(SwitchingTrace),
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

/// Links that come and go without memory.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MarkovSwitching {
    /// Mean time up (s).
    pub mean_up_s: f64,
    /// Mean time down (s).
    pub mean_down_s: f64,
    /// Which links come and go together.
    #[serde(default)]
    pub together: Together,
}

/// Which links come and go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Together {
    /// All of them.
    All,
    /// Both directions of a link.
    #[default]
    Pairs,
    /// Each directed link is on its own.
    None,
}

/// Random switching that is connected in mean.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct InMeanSwitching {
    /// The window T of Definition 4.4 (s).
    pub window_s: f64,
    /// Least time between two changes (s).
    pub dwell_s: f64,
}

/// Links that are up as they were in a recorded run.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SwitchingTrace {
    /// Every directed link of the mission.
    pub links: Vec<LinkTrace>,
}

/// When one directed link was up.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinkTrace {
    /// Sender.
    pub from: String,
    /// Receiver.
    pub to: String,
    /// Intervals [from, to] (s).
    pub up_s: Vec<[f64; 2]>,
}
