//! How one vehicle followed its path and kept its place in the fleet, in numbers.

use std::collections::BTreeMap;

use common::record::StateRow;
use common::time::Time;
use serde::Serialize;

use super::Facts;
use super::links::Said;
use super::series::{Track, is_early, steady_part};
use super::statistics::{SETTLED_PART, largest, mean, rms, settling_time};

/// A vehicle counts as on its path when its path-following error stays below this \[m\].
pub(super) const PATH_THRESHOLD_M: f64 = 0.1;

/// The numbers of one vehicle. "Steady" is the last fifth of its rows, in whole periods of the network. What would be made of no
/// rows is NaN, `null` in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VehicleSummary {
    /// Its name.
    pub id: String,
    /// Its path.
    pub path: String,
    /// Its place in the pattern; its mean, if it moves.
    pub pattern_offset: f64,
    /// Rows of its state.
    pub rows: u64,
    /// Instant of the last of them \[s\].
    pub last_s: Option<f64>,
    /// When the network last took a message of it \[s\].
    pub last_heard_s: Option<f64>,
    /// x_i − x_1 at the end.
    pub coordination_final: f64,
    /// Mean rate of ξ in the steady part \[units of ξ per s\].
    pub steady_speed: f64,
    /// Mean forward speed in the steady part \[m/s\].
    pub steady_speed_mps: f64,
    /// Root mean square of ξ's rate minus its reference, v_r, in the steady part.
    pub speed_error_rms: f64,
    /// Largest magnitude of that in the steady part.
    pub speed_error_max: f64,
    /// Path-following error at the end \[m\].
    pub path_error_final_m: f64,
    /// Largest path-following error \[m\].
    pub path_error_largest_m: f64,
    /// Largest path-following error after settling (in the steady part, if it did not settle) \[m\].
    pub path_error_after_settling_m: f64,
    /// Root mean square of the path-following error in the steady part \[m\].
    pub path_error_rms_m: f64,
    /// From when on it stayed below 2 % of its largest value \[s\].
    pub path_settled_s: Option<f64>,
    /// From when on it stayed below 0.1 m \[s\].
    pub on_path_s: Option<f64>,
    /// Mean along-track error in the steady part \[m\].
    pub along_mean_m: f64,
    /// What theory predicts for it.
    pub predicted_along_bias_m: Option<f64>,
    /// Root mean square of the cross-track error in the steady part \[m\].
    pub cross_rms_m: f64,
    /// Root mean square of the heading error in the steady part \[rad\].
    pub heading_rms_rad: f64,
    /// Part of the rows in which it had no neighbour.
    pub alone_fraction: f64,
    /// Messages that it put on the air, each once, however many hear it.
    pub messages_said: u64,
    /// Their size \[bytes\].
    pub bytes_on_air: u64,
}

impl VehicleSummary {
    /// The numbers of the vehicle with this track among all; `said` is what each put on the air.
    pub(super) fn of(
        track: &Track<'_>,
        all: &[Track<'_>],
        facts: &Facts,
        said: &BTreeMap<&str, Said>,
    ) -> VehicleSummary {
        let rows = &track.rows;
        let t_s: Vec<f64> = rows.iter().map(|row| row.t_ns as f64 / 1e9).collect();
        let errors: Vec<f64> = rows.iter().map(|row| row.e_norm_m).collect();
        let steady_index = steady_part(&t_s, facts);
        let steady = &rows[steady_index..];
        let peak = largest(errors.iter().copied());
        let path_settled_s = settling_time(&t_s, &errors, SETTLED_PART * peak);
        let settled_index = path_settled_s.map_or(steady_index, |settled| t_s.partition_point(|time| *time < settled));
        let h = |track: &Track<'_>, row: &StateRow| track.pattern.at(Time::from_nanos(row.t_ns)).h;
        let removed = |track: &Track<'_>| track.rows.last().map(|row| row.xi - h(track, row));
        let first = all.iter().find_map(removed);
        let own = said.get(track.id).copied().unwrap_or_default();
        let planned = facts.vehicles.iter().find(|vehicle| vehicle.id == track.id);
        VehicleSummary {
            id: track.id.to_owned(),
            path: planned.map(|vehicle| vehicle.path.clone()).unwrap_or_default(),
            pattern_offset: track.pattern.constant,
            rows: rows.len() as u64,
            last_s: t_s.last().copied(),
            last_heard_s: own.last_s,
            coordination_final: removed(track).zip(first).map_or(f64::NAN, |(own, first)| own - first),
            steady_speed: match (steady.first(), steady.last()) {
                // The mean rate of ξ − h exactly, not the mean of samples of the rate.
                (Some(a), Some(b)) if b.t_ns > a.t_ns => {
                    (b.xi - a.xi - (h(track, b) - h(track, a))) / ((b.t_ns - a.t_ns) as f64 / 1e9)
                }
                _ => rows.last().map_or(f64::NAN, |row| row.xi_rate),
            },
            steady_speed_mps: mean(steady.iter().map(|row| row.speed_mps)),
            speed_error_rms: rms(steady.iter().map(|row| row.xi_rate - row.v_ref)),
            speed_error_max: largest(steady.iter().map(|row| (row.xi_rate - row.v_ref).abs())),
            path_error_final_m: errors.last().copied().unwrap_or(f64::NAN),
            path_error_largest_m: peak,
            path_error_after_settling_m: largest(errors[settled_index..].iter().copied()),
            path_error_rms_m: rms(errors[steady_index..].iter().copied()),
            path_settled_s,
            on_path_s: settling_time(&t_s, &errors, PATH_THRESHOLD_M),
            along_mean_m: mean(steady.iter().map(|row| row.e_along_m)),
            predicted_along_bias_m: planned.and_then(|vehicle| vehicle.predicted_along_bias_m),
            cross_rms_m: rms(steady.iter().map(|row| row.e_cross_m)),
            heading_rms_rad: rms(steady.iter().map(|row| row.psi_e_rad)),
            alone_fraction: mean(rows.iter().map(|row| f64::from(u8::from(row.neighbours == 0)))),
            messages_said: own.transmissions,
            bytes_on_air: own.transmissions * facts.bytes_of(track.id),
        }
    }

    /// The instant of the last row, if that is not the end of the run.
    pub fn early(&self, duration_s: f64) -> Option<f64> {
        self.last_s.filter(|last_s| is_early(*last_s, duration_s))
    }
}
