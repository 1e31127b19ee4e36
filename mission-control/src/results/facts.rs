//! What the caller knows of a mission and the results need: names, patterns, predictions.

use std::sync::Arc;

use common::mission::Pattern;
use common::path::Path;

use super::GraphFacts;

/// What is known of a run without looking at its recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// Name of the mission.
    pub mission: String,
    /// What is flown, in a sentence or two for the report; may be empty.
    pub description: String,
    /// The vehicles, in the mission's order.
    pub vehicles: Vec<VehicleFacts>,
    /// The directed links (from, to) of the network.
    pub links: Vec<(String, String)>,
    /// Size of one message on the air, as the medium packs it, of vehicles that have no size of their own \[bytes\].
    pub message_bytes: u64,
    /// Length of the mission, as far as it was flown \[s\].
    pub duration_s: f64,
    /// Length that was planned \[s\].
    pub planned_s: f64,
    /// Formation speeds that were commanded under way: from when on \[s\], and what \[units of ξ per s\].
    pub commanded: Vec<(f64, f64)>,
    /// Control period \[s\].
    pub control_period_s: f64,
    /// A neighbour leaves N_i after this silence \[s\]; never, without.
    pub validity_s: Option<f64>,
    /// Period of the switching network \[s\], if it is periodic.
    pub link_period_s: Option<f64>,
    /// The rate at which theory guarantees that the norm of the coordination error decays \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// What is left of it by the law's being held for a control period, where that is less \[1/s\].
    pub least_rate: Option<f64>,
    /// The factor c of the guarantee ‖e(t)‖ ≤ c·exp(−rate·t)·‖e(0)‖; the envelope is drawn where it is known.
    pub guaranteed_factor: Option<f64>,
    /// The formation speed v_L in force at the end \[units of ξ per s\].
    pub formation_speed_at_the_end: Option<f64>,
    /// The formation speed that theory predicts for the fleet \[units of ξ per s\].
    pub predicted_speed: Option<f64>,
    /// The symbol of the coordination state in figures: `ξ`, or `γ` in space; `ξ` if empty.
    pub symbol: String,
    /// Unit of the coordination state, empty if it has none.
    pub xi_unit: String,
    /// Whether the paths leave the plane; chooses the figures.
    pub spatial: bool,
    /// What could not be collected, and why.
    pub missing: Vec<String>,
    /// Vehicles that gave up, and why.
    pub aborted: Vec<String>,
    /// Who can hear whom, and what follows from it.
    pub graph: Option<GraphFacts>,
}

/// The path whose R = ds/dξ turns a vehicle's speed into the rate of its coordination state, for a vehicle whose target goes where the
/// vehicle goes: d = ξ̇ − v/R (3.36) is then what path following does to coordination.
#[derive(Clone, Debug, Default)]
pub struct Way(pub Option<Arc<dyn Path>>);

/// The same path, not one like it.
impl PartialEq for Way {
    fn eq(&self, other: &Way) -> bool {
        match (&self.0, &other.0) {
            (Some(one), Some(two)) => Arc::ptr_eq(one, two),
            (one, two) => one.is_none() && two.is_none(),
        }
    }
}

/// What is known of one vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleFacts {
    /// Its name in the recording.
    pub id: String,
    /// Its place h_i(t) in the pattern: coordination means that ξ_i − h_i is the same for all.
    pub pattern: Pattern,
    /// What its path is called.
    pub path: String,
    /// The path as planned \[m\], for the figures; may be empty.
    pub planned: Vec<[f64; 3]>,
    /// Its path, where its speed is what coordination commands.
    pub way: Way,
    /// Size of one of its messages \[bytes\], if not the fleet's.
    pub message_bytes: Option<u64>,
    /// The mean along-track error in which theory says that it ends \[m\].
    pub predicted_along_bias_m: Option<f64>,
}

impl Facts {
    /// Size of one message of this vehicle \[bytes\].
    pub(super) fn bytes_of(&self, id: &str) -> u64 {
        let own = self.vehicles.iter().find(|vehicle| vehicle.id == id).and_then(|vehicle| vehicle.message_bytes);
        own.unwrap_or(self.message_bytes)
    }

    /// The symbol of the coordination state.
    pub(crate) fn symbol(&self) -> &str {
        if self.symbol.is_empty() { "ξ" } else { &self.symbol }
    }
}
