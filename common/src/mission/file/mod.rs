//! The mission file as written: TOML, units in the names of the keys, unknown keys are faults.
//!
//! Nothing here is checked beyond its type; the check turns it into a [`super::Mission`].

mod coordination;
mod environment;
mod following;
mod network;
mod path;
mod vehicle;

pub use coordination::*;
pub use environment::*;
pub use following::*;
pub use network::*;
pub use path::*;
pub use vehicle::*;

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

fn one_u64() -> u64 {
    1
}
