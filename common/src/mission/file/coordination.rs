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
}

/// One gain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GainOnly {
    /// Coordination gain k (1/s).
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

/// Gains and weights of (3.62).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Weighted {
    /// a_i, the same for all (1/s).
    pub a: f64,
    /// b_i, the same for all (m²/s²).
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

fn default_message_period() -> f64 {
    0.1
}
