//! Missions for the tests of this folder, changed and flown.

use std::sync::Arc;

use bus::recording::Recording;
use common::mission::Mission;
use common::record::Row;

use crate::simulate::simulate;

/// A mission file with some of its text replaced.
pub(super) fn changed(text: &str, changes: &[(&str, &str)]) -> Arc<Mission> {
    let text = changes.iter().fold(text.to_string(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    Arc::new(Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}")))
}

/// What a simulation of it records.
pub(super) fn flown(mission: &Arc<Mission>) -> Recording {
    let mut recording = Recording { complete: true, ..Recording::default() };
    let keep = |row: Row| {
        if let Row::Exact(record) = row {
            recording.exact.push(record);
        }
    };
    simulate(mission, keep, |_| true).expect("flies");
    recording
}
