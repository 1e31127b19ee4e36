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
    /// The last value, advanced from when it was made to now at v_L: a network observer. Vehicles that are not told v_L
    /// advance at what they have learned, or at what the neighbour says.
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
    /// After (1.5): two vehicles on lines, one of which learns v_L.
    LeaderIntegral(LeaderIntegral),
    /// Leader and followers, (2.30) and (2.31).
    LeaderFollower(LeaderFollower),
    /// Gateway, (2.33) and (2.34).
    Gateway(Gateway),
    /// Gateway with the extra integrator, section 2.5.3.
    GatewayIntegral(GatewayIntegral),
    /// Neighbours in a row, Figure 2.7.
    Neighbours(NeighboursInARow),
    /// Every vehicle by itself, (2.30).
    Alone(Alone),
    /// The same square wave of force for every vehicle, Figure 2.6.
    SquareWave(SquareWave),
    /// Solution I, (3.43).
    Solution1(Solution1),
    /// Solution II, (3.44).
    Solution2(Solution2),
    /// Solution III with saturation, (3.45).
    Solution3(Solution3),
    /// Solution II with weighted links, (3.62).
    Weighted(Weighted),
    /// Solution III about a pattern that moves, (3.70).
    MovingPattern(Solution3),
    /// One-way links, (3.72); with a pattern, (3.86).
    Directed(Directed),
    /// One vehicle is told v_L, (3.90) to (3.92).
    TrulyDecentralised(TrulyDecentralised),
    /// Switching networks, (4.21).
    Switching(GainOnly),
    /// Delayed information, every vehicle always with a neighbour, (4.34).
    Delayed(Delayed),
    /// Delayed information and losses, (4.42).
    DelayedWithLosses(Delayed),
    /// Auxiliary state that takes up alpha_2, fixed network, (4.59) to (4.61).
    Auxiliary(Auxiliary),
    /// Auxiliary state, switching network, (4.62).
    AuxiliarySwitching(Auxiliary),
    /// As delayed_with_losses, (4.42), by vehicles that are not told the delay: they estimate v_L*.
    DelayedEstimating(DelayedEstimating),
    /// Delayed information compared with one's own past of the same age.
    KnownDelay(KnownDelay),
}

/// Gains that a vehicle has for itself, in place of those of the coordination law and by the same names: its entries of the
/// diagonal matrices K, A and B. Under introduction and switching `gain`; under solution1 `a`; under solution2,
/// solution3, weighted and moving_pattern `a` and `b`. No other law bears gains that differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OwnGains {
    /// k_i of (4.21) or a_i of (1.5), above 0 (1/s).
    pub gain: Option<f64>,
    /// a_i, above 0 (1/s).
    pub a: Option<f64>,
    /// b_i, above 0 (in the unit of the law's b).
    pub b: Option<f64>,
}

/// One gain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GainOnly {
    /// Coordination gain k_i of every vehicle that has no own (1/s).
    pub gain: f64,
}

/// Who knows v_L, and the gains of the law after (1.5).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LeaderIntegral {
    /// The vehicle that knows v_L; the other learns it.
    pub leader: String,
    /// a_i, the same for both (1/s).
    pub a: f64,
    /// b_2 of the integral (1/s²); a² gives a double root at -a.
    pub b: f64,
}

/// Who leads, and the gains of (2.30) and (2.31).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LeaderFollower {
    /// The vehicle that is told v_L; the others learn their speeds from it.
    pub leader: String,
    /// a_1 of the leader (1/s).
    pub a1: f64,
    /// a_i of the followers, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (1/s²).
    pub b: f64,
    /// c_i, the same for all (1/s³); below a b.
    pub c: f64,
}

/// Which vehicle is the gateway, and the gains of (2.33) and (2.34).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Gateway {
    /// The vehicle that is told v_L and talks with all others.
    pub gateway: String,
    /// b_0 of the gateway (1/s²).
    pub b0: f64,
    /// a_i, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (1/s²).
    pub b: f64,
    /// c_i, the same for all (1/s³); below a b.
    pub c: f64,
}

/// The same with the extra integrator of section 2.5.3.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GatewayIntegral {
    /// The vehicle that is told v_L and talks with all others.
    pub gateway: String,
    /// b_0 of the gateway (1/s²).
    pub b0: f64,
    /// a_i, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (1/s²).
    pub b: f64,
    /// c_i, the same for all (1/s³); below a b.
    pub c: f64,
    /// d_i, the same for all (1/s⁴); below (a b - c) c / a².
    pub d: f64,
}

/// Who is told v_L, and the gains of neighbours in a row.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct NeighboursInARow {
    /// The vehicle that is told v_L.
    pub told: String,
    /// b_0 of the told vehicle (1/s²).
    pub b0: f64,
    /// a, the same for all (1/s).
    pub a: f64,
    /// b, the same for all (1/s²).
    pub b: f64,
    /// c, the same for all (1/s³); below a b.
    pub c: f64,
}

/// Gain of (2.30) for every vehicle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Alone {
    /// a_1, the same for all (1/s).
    pub a1: f64,
}

/// The force of Figure 2.6, over the vehicle's mass.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SquareWave {
    /// Acceleration, forward in the first half of each period and backward in the second (m/s²).
    pub amplitude_mps2: f64,
    /// Period (s).
    pub period_s: f64,
}

/// Gains of (3.43).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution1 {
    /// a_i of every vehicle that has no own (1/s).
    pub a: f64,
}

/// Gains of (3.44).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution2 {
    /// a_i of every vehicle that has no own (1/s).
    pub a: f64,
    /// b_i of every vehicle that has no own (m²/s²).
    pub b: f64,
}

/// Gains and weights of (3.62).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Weighted {
    /// a_i of every vehicle that has no own (1/s).
    pub a: f64,
    /// b_i of every vehicle that has no own (m²/s²).
    pub b: f64,
    /// Weights of links; a link that is not named has 1.
    #[serde(default)]
    pub weights: Vec<LinkWeight>,
}

/// The weight of a link, both ways.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinkWeight {
    /// The two vehicles.
    pub link: [String; 2],
    /// w_k, above 0.
    pub weight: f64,
}

/// Gains of (3.72).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Directed {
    /// a, the same for all (1/s).
    pub a: f64,
    /// b, the same for all (1/s²).
    pub b: f64,
}

/// Who is told v_L, and the gains of (3.92).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct TrulyDecentralised {
    /// The vehicle that is told v_L and runs the virtual leader, which starts where its own target does.
    pub told: String,
    /// a, the same for all (1/s).
    pub a: f64,
    /// b, the same for all (1/s²).
    pub b: f64,
    /// Whether neighbours add up or are averaged.
    #[serde(default)]
    pub laplacian: Laplacian,
}

/// Which Laplacian a law is computed with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Laplacian {
    /// L: neighbours add up.
    Plain,
    /// D⁻¹L: neighbours are averaged.
    #[default]
    Normalised,
}

/// Gains of (4.59) to (4.62).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Auxiliary {
    /// a_1, the same for all (1/s).
    pub a1: f64,
    /// a_2, the same for all (1/s).
    pub a2: f64,
}

/// Gains of (3.45).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Solution3 {
    /// a_i of every vehicle that has no own (1/s).
    pub a: f64,
    /// b_i of every vehicle that has no own (1/s).
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
