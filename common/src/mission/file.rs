//! The mission file as written: TOML, units in the names of the keys, unknown keys are faults.
//!
//! Nothing here is checked beyond its type; the check turns it into a [`super::Mission`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A mission: who flies where, how fast, over which network.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MissionFile {
    /// Short name: lower-case letters, digits and dashes; names the run folder.
    pub name: String,
    /// One sentence for the report.
    #[serde(default)]
    pub about: String,
    /// Seed of every random stream of the run.
    #[serde(default = "one_u64")]
    pub seed: u64,
    /// Length of the mission (s).
    pub duration_s: f64,
    /// How time is cut into steps.
    #[serde(default)]
    pub clock: ClockSection,
    /// How fast the formation goes.
    pub formation: FormationSection,
    /// How the vehicles coordinate.
    pub coordination: CoordinationSection,
    /// How badly their messages travel.
    pub network: NetworkSection,
    /// What all vehicles have in common.
    #[serde(default)]
    pub fleet: FleetSection,
    /// The vehicles, in order: "ahead" and "first" refer to it.
    pub vehicles: Vec<VehicleSection>,
}

/// How time is cut into steps.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ClockSection {
    /// The control laws run at this period and hold their output between (s).
    pub control_period_s: f64,
    /// Runge-Kutta steps per control period.
    pub substeps: u32,
    /// Period of the recorded states (s); a multiple of the control period.
    pub record_period_s: f64,
}

impl Default for ClockSection {
    fn default() -> Self {
        ClockSection { control_period_s: 0.05, substeps: 1, record_period_s: 0.5 }
    }
}

/// How fast the formation goes: either `speed` or `profile`.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct FormationSection {
    /// Formation speed v_L for the whole mission (units of xi per s).
    pub speed: Option<f64>,
    /// Formation speed by steps, the first from 0 s.
    pub profile: Option<Vec<SpeedStep>>,
}

/// One step of a speed profile.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SpeedStep {
    /// From when on (s).
    pub from_s: f64,
    /// Formation speed v_L (units of xi per s).
    pub speed: f64,
}

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
    /// The last value, advanced from when it was made to now at v_L: a network observer.
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

/// What all vehicles have in common; a vehicle may differ.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct FleetSection {
    /// The plant.
    pub model: Option<ModelChoice>,
    /// The path-following law.
    pub following: Option<FollowingChoice>,
}

/// One vehicle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct VehicleSection {
    /// Its name: lower-case letters, digits, dash and underscore.
    pub id: String,
    /// The path it follows.
    pub path: PathChoice,
    /// Where it starts.
    pub start: StartSection,
    /// Its place h_i in the formation pattern: it is coordinated when xi_i - h_i agree.
    #[serde(default)]
    pub pattern: f64,
    /// Its plant, if other than the fleet's.
    pub model: Option<ModelChoice>,
    /// Its path-following law, if other than the fleet's.
    pub following: Option<FollowingChoice>,
}

/// Where a vehicle starts.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct StartSection {
    /// East (m).
    pub x_m: f64,
    /// North (m).
    pub y_m: f64,
    /// Up (m).
    #[serde(default)]
    pub z_m: f64,
    /// Heading, counter-clockwise from x (deg).
    #[serde(default)]
    pub yaw_deg: f64,
    /// Forward speed (m/s).
    #[serde(default)]
    pub speed_mps: f64,
    /// Path parameter of the virtual target; without it, of the path's point closest in the plane.
    pub xi: Option<f64>,
}

/// A plant.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModelChoice {
    /// Heading and speed are commanded at will, section 1.2.
    KinematicUnicycle,
    /// Wheeled robot with mass and inertia, (3.12).
    DynamicUnicycle(DynamicUnicycle),
    /// Underactuated rigid body in 3-D, (4.44) and (4.45).
    UnderactuatedAuv(AuvModel),
}

/// A wheeled robot's mass and inertia.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DynamicUnicycle {
    /// Mass m (kg).
    pub mass_kg: f64,
    /// Moment of inertia I about the vertical (kg m²).
    pub inertia_kgm2: f64,
}

impl Default for DynamicUnicycle {
    fn default() -> Self {
        DynamicUnicycle { mass_kg: 1.0, inertia_kgm2: 1.0 }
    }
}

/// Parameter set of an underactuated rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AuvModel {
    /// Sirene-like, derived (see `common::vehicle`).
    Sirene,
}

/// A path-following law and its gains.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FollowingChoice {
    /// Line of sight, (1.4).
    LineOfSight(LineOfSight),
    /// Proposition 3.1 with Appendix 6.1.
    Proposition31(Proposition31),
    /// Theorem 4.7, with the roll treatment of docs/errata.md.
    Theorem47(Theorem47),
}

/// Gain of (1.4).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LineOfSight {
    /// Look-ahead distance Δ (m).
    pub distance_m: f64,
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
    /// Gain of the speed loop when the coordination law gives a rate (1/s).
    pub k_speed: f64,
}

impl Default for Proposition31 {
    fn default() -> Self {
        Proposition31 { k1: 1.0, k2: 0.6, k3: 1.0, k4: 1.0, epsilon_m: 0.3, k_speed: 2.0 }
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

/// A path.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PathChoice {
    /// A straight line.
    Line(LinePath),
    /// A circle; xi is the angle from its start.
    Circle(CirclePath),
    /// y = offset + amplitude sin(2π x / wavelength + phase); xi is x.
    Sinusoid(SinusoidPath),
    /// Lines and arcs, tangent to one another.
    Chain(ChainPath),
    /// A helix about a vertical axis, section 4.6.
    Helix(HelixPath),
}

/// A straight line.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinePath {
    /// Where xi = 0 (m).
    pub start_m: [f64; 2],
    /// Direction, counter-clockwise from x (deg).
    #[serde(default)]
    pub heading_deg: f64,
    /// Metres per unit of xi.
    #[serde(default = "one")]
    pub rate_m: f64,
}

/// A circle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CirclePath {
    /// Centre (m).
    pub centre_m: [f64; 2],
    /// Radius (m).
    pub radius_m: f64,
    /// Polar angle at which xi = 0 (deg).
    #[serde(default)]
    pub start_deg: f64,
    /// Which way round.
    #[serde(default)]
    pub direction: Direction,
    /// Radians per unit of xi.
    #[serde(default = "one")]
    pub rate_rad: f64,
}

/// Which way round a circle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Counter-clockwise.
    #[default]
    Ccw,
    /// Clockwise.
    Cw,
}

/// A sinusoid along x.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SinusoidPath {
    /// Amplitude (m).
    pub amplitude_m: f64,
    /// Wavelength (m).
    pub wavelength_m: f64,
    /// Mean of y (m).
    #[serde(default)]
    pub offset_m: f64,
    /// Phase at x = 0 (deg).
    #[serde(default)]
    pub phase_deg: f64,
}

/// Lines and arcs, tangent to one another; the first and the last go on beyond their ends.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ChainPath {
    /// Where xi = 0 (m).
    pub start_m: [f64; 2],
    /// Direction there, counter-clockwise from x (deg).
    #[serde(default)]
    pub heading_deg: f64,
    /// The pieces, in order.
    pub segments: Vec<SegmentChoice>,
}

/// A piece of a chain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SegmentChoice {
    /// A straight piece.
    Line(LineSegment),
    /// A piece of a circle.
    Arc(ArcSegment),
    /// A turn on the spot, which not every law can follow.
    Corner(CornerSegment),
}

/// A turn on the spot.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CornerSegment {
    /// Angle turned through, positive to the left (deg).
    pub turn_deg: f64,
}

/// A straight piece.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LineSegment {
    /// Length (m).
    pub length_m: f64,
    /// Metres per unit of xi.
    #[serde(default = "one")]
    pub rate_m: f64,
}

/// A piece of a circle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ArcSegment {
    /// Radius (m).
    pub radius_m: f64,
    /// Angle turned through, positive to the left (deg).
    pub sweep_deg: f64,
    /// Metres per unit of xi; the radius if absent, so that xi is the angle.
    pub rate_m: Option<f64>,
}

/// A helix about a vertical axis.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct HelixPath {
    /// Radius c_1 (m).
    pub radius_m: f64,
    /// One lap in units of xi, T.
    pub lap: f64,
    /// Climb c_2 per unit of xi (m).
    pub climb_m: f64,
    /// Polar angle φ_d at xi = 0 (deg).
    #[serde(default)]
    pub phase_deg: f64,
    /// Height z_0 at xi = 0 (m).
    #[serde(default)]
    pub z0_m: f64,
}

fn one() -> f64 {
    1.0
}
fn one_u64() -> u64 {
    1
}
fn default_message_period() -> f64 {
    0.1
}
fn default_queue() -> u32 {
    10_000
}
