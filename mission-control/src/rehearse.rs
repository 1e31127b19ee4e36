//! `simulate`: flies a mission in one thread into a run folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use bus::logs::origin;
use bus::recording::{CanonicalRecorder, canonical_order};
use common::mission::Mission;
use common::record::Row;
use common::time::Time;

use crate::console::Progress;
use crate::folder::{self, HostFacts, RECORDING};
use crate::results::Summary;
use crate::simulate::{Outcome, simulate};

/// Simulates a mission into a run folder and reports on it.
///
/// # Errors
/// What could not be flown or written.
pub fn rehearse(mission: &Arc<Mission>, out: Option<&Path>) -> Result<(PathBuf, Outcome, Summary), String> {
    let is_new = folder::is_new(out);
    let folder = folder::make(out, mission)?;
    let begun = Instant::now();
    let mut progress = Progress::new(mission.end);
    let path = folder.join(RECORDING);
    let outcome = record(mission, &path, |now| progress.reached("simulating", now, ""));
    progress.done();
    let outcome = outcome.inspect_err(|_| {
        if is_new {
            folder::discard(&folder);
        }
    })?;
    let wall_s = begun.elapsed().as_secs_f64();
    let host = HostFacts::now("mission-control simulate", None, wall_s, Vec::new(), outcome.aborted.clone());
    let (summary, _) = folder::finish(&folder, &host)?;
    Ok((folder, outcome, summary))
}

/// Simulates a mission into a recording in canonical order; memory holds no more rows than the fleet makes in one
/// exchange.
///
/// # Errors
/// What could not be flown or written.
pub fn record(mission: &Arc<Mission>, path: &Path, mut progress: impl FnMut(Time)) -> Result<Outcome, String> {
    let broken = |error: bus::recording::RecordingError| error.to_string();
    let mut recorder = CanonicalRecorder::create(path, &origin(mission, None)).map_err(broken)?;
    let pending = std::cell::RefCell::new(Vec::<Row>::new());
    let mut failure = None;
    let outcome = simulate(
        mission,
        |row| pending.borrow_mut().push(row),
        |now| {
            progress(now);
            // Rows from `now` on may still be joined by others that belong before them.
            let written = write_before(&mut recorder, &mut pending.borrow_mut(), now);
            failure = written.err();
            failure.is_none()
        },
    )?;
    if let Some(error) = failure {
        return Err(broken(error));
    }
    write_before(&mut recorder, &mut pending.borrow_mut(), Time::MAX).map_err(broken)?;
    recorder.finish().map_err(broken)?;
    Ok(outcome)
}

fn write_before<W: std::io::Write + std::io::Seek>(
    recorder: &mut CanonicalRecorder<W>,
    pending: &mut Vec<Row>,
    before: Time,
) -> bus::recording::Result<()> {
    pending.sort_by(canonical_order);
    let ready = pending.partition_point(|row| row.t_ns() < before.nanos());
    pending.drain(..ready).try_for_each(|row| recorder.write(row))
}
