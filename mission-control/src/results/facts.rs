//! What the caller knows of a mission and the results need: names, patterns, predictions.

use common::mission::Pattern;

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
    /// Length of the mission \[s\].
    pub duration_s: f64,
    /// Control period \[s\].
    pub control_period_s: f64,
    /// Period of the switching network \[s\], if it is periodic.
    pub link_period_s: Option<f64>,
    /// The rate at which theory guarantees that the norm of the coordination error decays \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// The factor c of the guarantee ‖e(t)‖ ≤ c·exp(−rate·t)·‖e(0)‖; the envelope is drawn where it is known.
    pub guaranteed_factor: Option<f64>,
    /// The formation speed that theory predicts for the fleet \[units of ξ per s\].
    pub predicted_speed: Option<f64>,
    /// The mean along-track error that theory predicts \[m\].
    pub predicted_along_bias_m: Option<f64>,
    /// The symbol of the coordination state in figures: `ξ`, or `γ` in space; `ξ` if empty.
    pub symbol: String,
    /// Unit of the coordination state, empty if it has none.
    pub xi_unit: String,
    /// Whether the paths leave the plane; chooses the figures.
    pub spatial: bool,
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
    /// Size of one of its messages \[bytes\], if not the fleet's.
    pub message_bytes: Option<u64>,
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
