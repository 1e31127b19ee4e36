//! The section `[coordination]`: the law, its gains, and when vehicles speak.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the vehicles coordinate.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CoordinationSection {
    /// The coordination law and its gains.
    pub law: LawChoice,
    /// Every vehicle speaks at this period (s); a multiple of the control period.
    #[serde(default = "default_message_period")]
    pub message_period_s: f64,
    /// A neighbour leaves N_i when nothing has been heard of it for this long (s); without it, it never leaves.
    pub validity_s: Option<f64>,
    /// What stands for a neighbour's state between its messages.
    #[serde(default)]
    pub between: Between,
    /// When vehicles speak.
    #[serde(default)]
    pub talk: Talk,
}

/// When vehicles speak.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Talk {
    /// Every vehicle speaks in every message period.
    #[default]
    Periodic,
    /// A vehicle speaks when what the others believe of it has become wrong; looked at once in every message period.
    EventTriggered(EventTriggered),
}

/// When a difference is worth a message.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventTriggered {
    /// A vehicle speaks when it is further than this from where the others believe it (units of xi).
    pub threshold: f64,
    /// How much higher the threshold is at the start (units of xi).
    #[serde(default)]
    pub start: f64,
    /// Rate at which that decays (1/s).
    #[serde(default)]
    pub decay_per_s: f64,
    /// Nothing is said sooner after the last message (s).
    #[serde(default)]
    pub least_silence_s: f64,
    /// Something is said at the latest so long after the last message (s).
    pub most_silence_s: Option<f64>,
    /// The part of the longest silence by which it is shortened at random, 0 to below 1.
    #[serde(default)]
    pub jitter: f64,
    /// With it messages acknowledge what was heard, and what is not acknowledged after this long (s) is said again;
    /// without it, what was said counts as heard.
    pub patience_s: Option<f64>,
}

/// What stands for a neighbour's state between its messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Between {
    /// The last value heard.
    #[default]
    Hold,
    /// The last value, advanced from when it was made to now at v_L: a network observer.
    Advance,
    /// The last value, advanced from when it was made to now at the rate of the vehicle's last messages.
    Estimate,
    /// The last value, advanced from when it was made to now less the law's delay at the speed the fleet travels at:
    /// the sampled γ_j(t − τ) of (4.34) and (4.42).
    Align,
}

/// A coordination law and its gains.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawChoice {
    /// (1.5): two vehicles on lines.
    Introduction(GainOnly),
    /// Solution I, (3.43).
    Solution1(Solution1),
    /// Solution II, (3.44).
    Solution2(Solution2),
    /// Solution III with saturation, (3.45).
    Solution3(Solution3),
    /// Switching networks, (4.21).
    Switching(GainOnly),
    /// Delayed information, every vehicle always with a neighbour, (4.34).
    Delayed(Delayed),
    /// Delayed information and losses, (4.42).
    DelayedWithLosses(Delayed),
    /// As the one before, by vehicles that are not told the delay: they estimate v_L*.
    DelayedEstimating(DelayedEstimating),
    /// Delayed information compared with one's own past of the same age.
    KnownDelay(KnownDelay),
}

/// One gain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GainOnly {
    /// Coordination gain k (1/s).
    pub gain: f64,
}

/// Gains of (3.43).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution1 {
    /// a_i, the same for all (1/s).
    pub a: f64,
}

/// Gains of (3.44).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution2 {
    /// a_i, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (m²/s²).
    pub b: f64,
}

/// Gains of (3.45).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution3 {
    /// a_i, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (1/s).
    pub b: f64,
    /// Saturation bound (m/s).
    pub x_m: f64,
}

/// Gain and delay of (4.34) and (4.42).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Delayed {
    /// Coordination gain k, divided by the number of neighbours heard (1/s).
    pub gain: f64,
    /// The delay τ the vehicles are told, to compute v_L* = v_L / (1 + k τ) (s).
    pub delay_s: f64,
}

/// Gain of (4.42) with an estimate of v_L*.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct DelayedEstimating {
    /// Coordination gain k, divided by the number of neighbours heard (1/s).
    pub gain: f64,
    /// Time constant of the estimate, in time with neighbours (s).
    #[serde(default = "default_time_constant")]
    pub time_constant_s: f64,
}

/// Gain of the law that knows how old its news are.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct KnownDelay {
    /// Coordination gain k (1/s).
    pub gain: f64,
    /// How far back a vehicle remembers where it was; older news do not count (s).
    pub longest_s: f64,
}

fn default_time_constant() -> f64 {
    10.0
}

fn default_message_period() -> f64 {
    0.1
}
