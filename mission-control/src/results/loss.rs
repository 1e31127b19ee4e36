//! Vehicles of which nothing is known up to the end of a flight, and what is known of them.

use serde::Serialize;

use super::Facts;
use super::series::is_early;
use super::vehicle::VehicleSummary;
use crate::missing::gave_up;

/// A vehicle without states up to the end of the flight that did not give up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// Its name.
    pub vehicle: String,
    /// The instant of its last state; `None` if there is no log of it \[s\].
    pub recorded_until_s: Option<f64>,
    /// When the network last took a message of it, if that is not up to the end \[s\].
    pub heard_until_s: Option<f64>,
}

impl Loss {
    /// Since when nothing is known of it \[s\]; `None` if it was heard up to the end, or nobody knows.
    pub fn since_s(&self) -> Option<f64> {
        self.heard_until_s.map(|heard_s| self.recorded_until_s.map_or(heard_s, |recorded_s| recorded_s.max(heard_s)))
    }
}

/// Of a flight that was ended early vehicles hear one after the other: a second of wall clock may be a minute of mission time. Who
/// recorded up to this part of it, or so many seconds, was not lost \[s\].
const ENDING_PART: f64 = 0.05;
const ENDING_S: f64 = 5.0;

/// The vehicles that were lost, or whose logs were.
pub(super) fn losses(vehicles: &[VehicleSummary], facts: &Facts) -> Vec<Loss> {
    let end_s = facts.duration_s;
    let ending_s = match is_early(end_s, facts.planned_s) {
        true => (ENDING_PART * end_s).max(ENDING_S),
        false => 0.0,
    };
    let ends_early = |last_s: f64| end_s - last_s > ending_s;
    let is_gone = |vehicle: &&VehicleSummary| vehicle.rows == 0 || vehicle.early(end_s).is_some_and(ends_early);
    let gone = vehicles.iter().filter(is_gone).filter(|vehicle| !gave_up(&facts.aborted, &vehicle.id));
    gone.map(|vehicle| Loss {
        vehicle: vehicle.id.clone(),
        recorded_until_s: vehicle.last_s,
        heard_until_s: vehicle.last_heard_s.filter(|heard_s| is_early(*heard_s, end_s)),
    })
    .collect()
}
