//! The sections `[fleet]` and `[[vehicles]]`: plants and where they start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CurrentSection, FailureChoice, FollowingChoice, LimitsSection, NoiseSection, OwnGains, PathChoice};

/// What all vehicles have in common; a vehicle may differ.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct FleetSection {
    /// The plant.
    pub model: Option<ModelChoice>,
    /// The path-following law.
    pub following: Option<FollowingChoice>,
    /// What the actuators give at most.
    pub limits: Option<LimitsSection>,
    /// How the water moves.
    pub current: Option<CurrentSection>,
    /// How the instruments err.
    pub noise: Option<NoiseSection>,
    /// What fails, and when.
    pub failure: Option<FailureChoice>,
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
    /// How its place moves about `pattern`, for the law moving_pattern.
    pub pattern_motion: Option<PatternMotionSection>,
    /// Its own coordination gains, where they are other than those of coordination.law.
    pub gains: Option<OwnGains>,
    /// Its plant, if other than the fleet's.
    pub model: Option<ModelChoice>,
    /// Its path-following law, if other than the fleet's.
    pub following: Option<FollowingChoice>,
    /// What its actuators give at most, if other than the fleet's.
    pub limits: Option<LimitsSection>,
    /// How the water moves around it, if other than around the fleet.
    pub current: Option<CurrentSection>,
    /// How its instruments err, if other than the fleet's.
    pub noise: Option<NoiseSection>,
    /// What fails on it, and when, if other than on the fleet.
    pub failure: Option<FailureChoice>,
}

/// A place in the pattern that moves: amplitude sin(2π t / period + phase) is added to it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct PatternMotionSection {
    /// Amplitude (units of xi).
    pub amplitude: f64,
    /// Period (s).
    pub period_s: f64,
    /// Phase at the start (deg).
    #[serde(default)]
    pub phase_deg: f64,
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
    /// Marine vehicle with forces ahead and aside, in the plane, (3.28).
    MarineVehicle(MarineVehicle),
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

/// Masses and drag of a fully actuated marine vehicle, added mass included. The defaults are of a robot of half a tonne.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MarineVehicle {
    /// Mass m_u ahead (kg).
    pub mass_u_kg: f64,
    /// Mass m_v aside (kg).
    pub mass_v_kg: f64,
    /// Moment of inertia m_r about the vertical (kg m²).
    pub inertia_kgm2: f64,
    /// Drag d_u ahead (kg/s).
    pub drag_u_kgps: f64,
    /// Drag d_v aside (kg/s).
    pub drag_v_kgps: f64,
    /// Drag d_r on turning (kg m²/s).
    pub drag_r_kgm2ps: f64,
}

impl Default for MarineVehicle {
    fn default() -> Self {
        MarineVehicle {
            mass_u_kg: 500.0,
            mass_v_kg: 1000.0,
            inertia_kgm2: 700.0,
            drag_u_kgps: 100.0,
            drag_v_kgps: 300.0,
            drag_r_kgm2ps: 400.0,
        }
    }
}

/// Parameter set of an underactuated rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AuvModel {
    /// Sirene-like, derived (see `common::vehicle`).
    Sirene,
    /// A table of its own.
    Parameters(AuvTable),
}

/// Parameters of an underactuated rigid body, along or about its axes x (ahead), y and z; added mass included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AuvTable {
    /// Diagonal of M (t).
    pub mass_t: [f64; 3],
    /// Diagonal of J (t m²).
    pub inertia_tm2: [f64; 3],
    /// Linear drag (kN s/m).
    pub linear_drag: [f64; 3],
    /// Quadratic drag (kN s²/m²).
    pub quadratic_drag: [f64; 3],
    /// Linear drag on turning (kN m s).
    pub linear_spin_drag: [f64; 3],
    /// Quadratic drag on turning (kN m s²).
    pub quadratic_spin_drag: [f64; 3],
    /// Weight W (kN).
    pub weight_kn: f64,
    /// Buoyancy B (kN); the weight if absent.
    pub buoyancy_kn: Option<f64>,
    /// r_B (m); a negative z is righting (erratum 4.17).
    pub centre_of_buoyancy_m: [f64; 3],
}
