//! The numbers that a sweep keeps of every run.

use crate::results::Summary;

/// A number of a run.
pub struct Measure {
    /// Its column.
    pub name: &'static str,
    /// What it is, with its unit.
    pub about: &'static str,
    /// Where it is in a summary; `None` if the run does not have it.
    pub of: fn(&Summary) -> Option<f64>,
}

/// All of them, in the order of the columns.
pub const MEASURES: [Measure; 14] = [
    Measure {
        name: "coordination_initial",
        about: "coordination error at the start",
        of: |s| Some(s.fleet.coordination.initial),
    },
    Measure {
        name: "coordination_largest",
        about: "largest coordination error",
        of: |s| Some(s.fleet.coordination.largest),
    },
    Measure {
        name: "coordination_last",
        about: "coordination error at the end",
        of: |s| Some(s.fleet.coordination.last),
    },
    Measure {
        name: "coordination_rms",
        about: "coordination error in the steady part, root mean square",
        of: |s| Some(s.fleet.coordination.steady_rms),
    },
    Measure {
        name: "coordination_settled_s",
        about: "time to 2 % of the largest coordination error [s]",
        of: |s| s.fleet.coordination.settled_s,
    },
    Measure {
        name: "coordination_rate",
        about: "fitted rate of the coordination error [1/s]",
        of: |s| s.fleet.coordination.fit.map(|fit| fit.rate),
    },
    Measure { name: "speed", about: "steady speed of the fleet [1/s]", of: |s| Some(s.fleet.steady_speed) },
    Measure {
        name: "path_error_last_m",
        about: "largest path-following error at the end [m]",
        of: |s| Some(s.fleet.path_error_final_m),
    },
    Measure { name: "on_path_s", about: "time until all are on their paths [s]", of: |s| s.fleet.on_path_s },
    Measure { name: "sent", about: "messages on all links", of: |s| Some(s.fleet.messages.counts.sent as f64) },
    Measure { name: "delivered", about: "messages delivered", of: |s| Some(s.fleet.messages.counts.delivered as f64) },
    Measure { name: "transmissions", about: "transmissions", of: |s| Some(s.fleet.messages.transmissions as f64) },
    Measure { name: "bytes_on_air", about: "bytes on the air", of: |s| Some(s.fleet.messages.bytes_on_air as f64) },
    Measure {
        name: "alpha",
        about: "share of the time in which the fleet is not connected",
        of: |s| s.fleet.connectivity.as_ref().map(|c| c.alpha),
    },
];

/// Where a measure is among the columns.
///
/// # Errors
/// The names that there are.
pub fn index_of(name: &str) -> Result<usize, String> {
    MEASURES.iter().position(|measure| measure.name == name).ok_or_else(|| {
        let names: Vec<&str> = MEASURES.iter().map(|measure| measure.name).collect();
        format!("found {name:?}, which is no number of a run; allowed: {}", names.join(", "))
    })
}
