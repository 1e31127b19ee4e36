//! The files of a fleet into one recording, and a cut file into a whole one.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use common::record::{Name, Record, Row};

use super::order::canonical_order;
use super::read::RowReader;
use super::recorder::Recorder;
use super::{Cause, Origin, RecordingError, Result};

/// Writes rows that come in order of time, and puts those of one instant in [canonical order](canonical_order).
///
/// Chunks are closed by size alone, so the same rows give the same bytes whoever recorded them and however fast.
pub struct CanonicalRecorder<W: Write + Seek> {
    recorder: Recorder<W>,
    place: PathBuf,
    /// The rows of the instant that is under way.
    instant: Vec<Row>,
}

impl CanonicalRecorder<BufWriter<File>> {
    /// A new file at `path`.
    pub fn create(path: impl AsRef<Path>, origin: &Origin) -> Result<Self> {
        let recorder = Recorder::create(&path, origin)?;
        Ok(CanonicalRecorder { recorder, place: path.as_ref().to_owned(), instant: Vec::new() })
    }
}

impl<W: Write + Seek> CanonicalRecorder<W> {
    /// Records into `writer`; errors name it `place`.
    pub fn new(writer: W, place: impl Into<PathBuf>, origin: &Origin) -> Result<Self> {
        let place = place.into();
        let recorder = Recorder::new(writer, &place, origin)?;
        Ok(CanonicalRecorder { recorder, place, instant: Vec::new() })
    }

    /// Takes a row. Its time must not lie before that of the row before it.
    pub fn write(&mut self, row: Row) -> Result<()> {
        if let Some(first) = self.instant.first() {
            let (t_ns, reached_ns) = (row.t_ns(), first.t_ns());
            if t_ns < reached_ns {
                let cause = Cause::OutOfOrder { t_ns, reached_ns };
                return Err(RecordingError { place: self.place.clone(), cause });
            }
            if t_ns > reached_ns {
                self.close_instant()?;
            }
        }
        self.instant.push(row);
        Ok(())
    }

    /// Ends the file and hands back the writer.
    pub fn finish(mut self) -> Result<W> {
        self.close_instant()?;
        self.recorder.finish()
    }

    /// Rows left out because a number in them was not finite.
    pub fn refused(&self) -> u64 {
        self.recorder.refused()
    }

    /// A hub that comes back records the speed commands again that it is told of. Of twins the last counts: it may have
    /// been said after others. Speeds come first in an instant.
    fn take_twins_for_one(&mut self) {
        let mut speeds = self.instant.partition_point(|row| matches!(row, Row::Exact(Record::Speed(_))));
        let mut index = 0;
        while index < speeds {
            if self.instant[index + 1..speeds].contains(&self.instant[index]) {
                self.instant.remove(index);
                speeds -= 1;
            } else {
                index += 1;
            }
        }
    }

    fn close_instant(&mut self) -> Result<()> {
        // Stable: rows that compare equal keep the order in which they came.
        self.instant.sort_by(canonical_order);
        self.take_twins_for_one();
        for row in self.instant.drain(..) {
            self.recorder.write(&row)?;
        }
        Ok(())
    }
}

/// What [`merge`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Merged {
    /// Rows written.
    pub rows: u64,
    /// Inputs that ended in the middle; what their whole chunks held is in the output.
    pub incomplete: Vec<PathBuf>,
    /// Inputs with damaged chunks, which were left out: how many, and what was wrong with the first.
    pub damaged: Vec<(PathBuf, u64, String)>,
    /// Inputs that are no recordings, with the reason: they are left out.
    pub left_out: Vec<(PathBuf, String)>,
    /// When the states of each vehicle begin and end \[ns\].
    pub spans: BTreeMap<Name, (i64, i64)>,
}

/// Merges recordings of one mission into `output`, in [canonical order](canonical_order); the same rows give the same
/// bytes. The output appears whole or not at all, and replaces an earlier one.
///
/// Rows that compare equal keep the order of `inputs`. Inputs in order of time, which is what the programs write, are
/// merged as a stream; if one is not, all are read and sorted in memory.
pub fn merge<P: AsRef<Path>>(inputs: &[P], output: impl AsRef<Path>) -> Result<Merged> {
    let output = output.as_ref();
    let temporary = beside(output);
    let merged = match merge_in_stream(inputs, &temporary) {
        Err(RecordingError { cause: Cause::OutOfOrder { .. }, .. }) => {
            remove(&temporary)?;
            merge_in_memory(inputs, &temporary)
        }
        other => other,
    };
    match merged {
        Ok(merged) => {
            fs::rename(&temporary, output).map_err(|cause| RecordingError::io(output, cause))?;
            Ok(merged)
        }
        Err(error) => {
            remove(&temporary)?;
            Err(error)
        }
    }
}

/// What [`recover`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recovered {
    /// Rows written.
    pub rows: u64,
    /// Whether the input was whole, and recovery was not needed.
    pub was_complete: bool,
    /// What was wrong with the input, if more than a missing end.
    pub damage: Option<String>,
}

/// Writes what can be read of `input` to `output`, with an end and an index.
pub fn recover(input: impl AsRef<Path>, output: impl AsRef<Path>) -> Result<Recovered> {
    let mut rows = RowReader::open(input)?;
    let mut recorder = Recorder::create(output, rows.origin())?;
    for row in &mut rows {
        recorder.write(&row?)?;
    }
    let recovered =
        Recovered { rows: recorder.rows(), was_complete: rows.is_complete(), damage: rows.damage().map(str::to_owned) };
    recorder.finish()?;
    Ok(recovered)
}

/// One input of a merge, with the row that comes next.
struct Input {
    rows: RowReader<BufReader<File>>,
    next: Option<Row>,
}

/// All inputs of a merge.
struct Inputs {
    origin: Origin,
    opened: Vec<Input>,
    left_out: Vec<(PathBuf, String)>,
}

/// Opens all inputs. What is no recording, its first bytes being damaged for instance, does not cost the others; but if
/// nothing else is there, it is an error.
fn open_all<P: AsRef<Path>>(inputs: &[P]) -> Result<Inputs> {
    let mut origin: Option<(Origin, PathBuf)> = None;
    let mut opened = Vec::with_capacity(inputs.len());
    let mut left_out = Vec::new();
    for path in inputs {
        let mut rows = match RowReader::open(path) {
            Err(RecordingError { place, cause: Cause::Format(cause) }) if left_out.len() + 1 < inputs.len() => {
                left_out.push((place, cause));
                continue;
            }
            opened => opened?,
        };
        match &mut origin {
            // A file that was cut before its mission says nothing about the run, and holds no rows.
            _ if *rows.origin() == Origin::default() => {}
            None => origin = Some((rows.origin().clone(), path.as_ref().to_owned())),
            Some((first, other)) if is_another_flight(first, rows.origin()) => {
                let cause = Cause::OtherFlight { other: other.clone() };
                return Err(RecordingError { place: path.as_ref().to_owned(), cause });
            }
            Some((first, other)) if first.digest != rows.origin().digest || first.seed != rows.origin().seed => {
                let cause = Cause::OtherMission { other: other.clone() };
                return Err(RecordingError { place: path.as_ref().to_owned(), cause });
            }
            Some((first, _)) => first.start_unix_ns = first.start_unix_ns.or(rows.origin().start_unix_ns),
        }
        let next = rows.next().transpose()?;
        opened.push(Input { rows, next });
    }
    Ok(Inputs { origin: origin.map(|(origin, _)| origin).unwrap_or_default(), opened, left_out })
}

/// Whether two flights of a mission began at different instants. Of a file that does not say when, nothing is known.
fn is_another_flight(one: &Origin, other: &Origin) -> bool {
    one.digest == other.digest && one.start_unix_ns.zip(other.start_unix_ns).is_some_and(|(one, other)| one != other)
}

fn merge_in_stream<P: AsRef<Path>>(inputs: &[P], output: &Path) -> Result<Merged> {
    let mut inputs = open_all(inputs)?;
    let mut recorder = create(output, &inputs.origin)?;
    let mut spans = BTreeMap::new();
    // At each turn, the input whose next row is earliest; on a tie the first, so that input order is kept.
    while let Some(input) = inputs
        .opened
        .iter_mut()
        .filter(|input| input.next.is_some())
        .min_by_key(|input| input.next.as_ref().map(Row::t_ns))
    {
        if let Some(row) = input.next.take() {
            note_span(&mut spans, &row);
            recorder.write(row)?;
        }
        input.next = input.rows.next().transpose()?;
    }
    finish(recorder, output, inputs, spans)
}

fn merge_in_memory<P: AsRef<Path>>(inputs: &[P], output: &Path) -> Result<Merged> {
    let mut inputs = open_all(inputs)?;
    let mut all = Vec::new();
    for input in &mut inputs.opened {
        all.extend(input.next.take());
        for row in &mut input.rows {
            all.push(row?);
        }
    }
    all.sort_by(canonical_order);
    let mut recorder = create(output, &inputs.origin)?;
    let mut spans = BTreeMap::new();
    for row in all {
        note_span(&mut spans, &row);
        recorder.write(row)?;
    }
    finish(recorder, output, inputs, spans)
}

/// Rows come in order of time.
fn note_span(spans: &mut BTreeMap<Name, (i64, i64)>, row: &Row) {
    if let Row::Exact(Record::State(state)) = row {
        match spans.get_mut(&state.vehicle) {
            Some((_, end)) => *end = state.t_ns,
            None => drop(spans.insert(state.vehicle.clone(), (state.t_ns, state.t_ns))),
        }
    }
}

fn create(output: &Path, origin: &Origin) -> Result<CanonicalRecorder<BufWriter<File>>> {
    // A temporary file that an interrupted merge left behind is in nobody's way.
    remove(output)?;
    CanonicalRecorder::create(output, origin)
}

fn finish(
    mut recorder: CanonicalRecorder<BufWriter<File>>,
    output: &Path,
    Inputs { opened, left_out, .. }: Inputs,
    spans: BTreeMap<Name, (i64, i64)>,
) -> Result<Merged> {
    recorder.close_instant()?;
    let rows = recorder.recorder.rows();
    let file = recorder.finish()?;
    file.get_ref().sync_all().map_err(|cause| RecordingError::io(output, cause))?;
    let place = |input: &Input| input.rows.place().to_owned();
    let incomplete = opened.iter().filter(|input| !input.rows.is_complete() && input.rows.skipped() == 0);
    let damaged = opened.iter().filter_map(|input| {
        let cause = input.rows.damage().unwrap_or_default().to_owned();
        (input.rows.skipped() > 0).then(|| (place(input), input.rows.skipped(), cause))
    });
    Ok(Merged { rows, incomplete: incomplete.map(place).collect(), damaged: damaged.collect(), left_out, spans })
}

/// The temporary file that becomes `output`; beside it, so that renaming does not copy.
fn beside(output: &Path) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    output.with_file_name(name)
}

fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(RecordingError::io(path, cause)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::super::testing::{message, origin, state, tick};
    use super::*;

    /// Writes live files, flushed at odd places, and merges them.
    fn merged(files: &[Vec<Row>], flush_every: usize) -> (tempfile::TempDir, PathBuf, Merged) {
        let directory = tempfile::tempdir().expect("directory");
        let mut paths = Vec::new();
        for (index, rows) in files.iter().enumerate() {
            let path = directory.path().join(format!("{index}.mcap"));
            let mut recorder = Recorder::create(&path, &origin()).expect("starts");
            for (count, row) in rows.iter().enumerate() {
                recorder.write(row).expect("writes");
                if count % flush_every == 0 {
                    recorder.flush().expect("flushes");
                }
            }
            recorder.finish().expect("ends");
            paths.push(path);
        }
        let output = directory.path().join("recording.mcap");
        let merged = merge(&paths, &output).expect("merges");
        (directory, output, merged)
    }

    fn ticks(count: i64) -> Vec<Row> {
        (0..count).flat_map(|step| tick(step * 20_000_000)).collect()
    }

    #[test]
    fn the_same_rows_give_the_same_bytes_whoever_recorded_them() {
        let all = ticks(1000);
        let (of_a, of_others): (Vec<Row>, Vec<Row>) =
            all.iter().cloned().partition(|row| matches!(row, Row::Exact(common::record::Record::State(_))));
        let (_one, first, merged_one) = merged(std::slice::from_ref(&all), 3);
        let (_two, second, _) = merged(&[of_a, of_others], 170);
        assert_eq!(merged_one.rows, 8000);
        let bytes = fs::read(first).expect("reads");
        assert!(bytes == fs::read(second).expect("reads"), "the files differ");

        let mut direct = CanonicalRecorder::new(std::io::Cursor::new(Vec::new()), "test", &origin()).expect("starts");
        all.into_iter().for_each(|row| direct.write(row).expect("writes"));
        assert!(bytes == direct.finish().expect("ends").into_inner(), "a direct recording differs");
    }

    #[test]
    fn rows_are_in_order_also_when_the_inputs_are_not() {
        let mut backwards = ticks(50);
        backwards.reverse();
        let (_directory, path, merged) = merged(&[backwards], 10);
        assert_eq!(merged.rows, 400);
        let rows: Vec<Row> = RowReader::open(path).expect("opens").map(|row| row.expect("reads")).collect();
        assert!(rows.is_sorted_by(|a, b| canonical_order(a, b).is_le()));
    }

    #[test]
    fn within_an_instant_the_order_is_that_of_a_tick() {
        let (_directory, path, _) = merged(&[tick(0)], 1);
        let topics: Vec<_> = RowReader::open(path)
            .expect("opens")
            .map(|row| super::super::topic_of(&row.expect("reads")).into_owned())
            .collect();
        let messages = "/network/messages";
        let expected = [
            "/mission/speed",
            "/network/topology",
            "/vehicles/a/state",
            "/vehicles/b/state",
            messages,
            messages,
            messages,
            "/clock/achieved",
        ];
        assert_eq!(topics, expected);
    }

    #[test]
    fn a_cut_input_is_merged_as_far_as_it_goes_and_named() {
        let directory = tempfile::tempdir().expect("directory");
        let (whole, cut) = (directory.path().join("whole.mcap"), directory.path().join("cut.mcap"));
        for path in [&whole, &cut] {
            let mut recorder = Recorder::create(path, &origin()).expect("starts");
            recorder.write(&state(0, "a", 0.0)).expect("writes");
            recorder.flush().expect("flushes");
            recorder.write(&message(1, "a", "b", 0)).expect("writes");
            if path == &cut {
                std::mem::forget(recorder);
            } else {
                recorder.finish().expect("ends");
            }
        }
        let output = directory.path().join("recording.mcap");
        let merged = merge(&[&whole, &cut], &output).expect("merges");
        let spans = BTreeMap::from([("a".into(), (0, 0))]);
        assert_eq!(merged, Merged { rows: 3, incomplete: vec![cut.clone()], damaged: vec![], left_out: vec![], spans });

        let recovered = recover(&cut, directory.path().join("recovered.mcap")).expect("recovers");
        assert_eq!(recovered, Recovered { rows: 1, was_complete: false, damage: None });
        assert!(read(directory.path().join("recovered.mcap")).expect("reads").complete);
    }

    #[test]
    fn what_is_no_recording_does_not_cost_the_others() {
        let directory = tempfile::tempdir().expect("directory");
        let (sound, broken) = (directory.path().join("sound.mcap"), directory.path().join("broken.mcap"));
        let mut recorder = Recorder::create(&sound, &origin()).expect("starts");
        recorder.write(&state(0, "a", 0.0)).expect("writes");
        recorder.finish().expect("ends");
        fs::write(&broken, "no magic at all").expect("writes");
        let output = directory.path().join("recording.mcap");
        let merged = merge(&[&broken, &sound], &output).expect("merges");
        assert_eq!(merged.rows, 1);
        let [(path, cause)] = &merged.left_out[..] else { panic!("{merged:?}") };
        assert!(*path == broken && cause.contains("magic"), "{cause}");
        assert_eq!(read(&output).expect("reads").seed, origin().seed);
        merge(&[&broken], &output).expect_err("there is nothing else");
    }

    #[test]
    fn a_command_that_was_recorded_twice_is_one() {
        use common::record::{Record, SpeedRow};
        let speed = |t_ns, speed| Row::Exact(Record::Speed(SpeedRow { t_ns, speed }));
        let (first, second) = (vec![speed(0, 0.5), speed(7, 0.4)], vec![speed(0, 0.5), speed(7, 0.3), speed(7, 0.4)]);
        let (_directory, path, merged) = merged(&[first, second], 1);
        assert_eq!(merged.rows, 3);
        let rows: Vec<Row> = RowReader::open(path).expect("opens").map(|row| row.expect("reads")).collect();
        assert_eq!(rows, [speed(0, 0.5), speed(7, 0.3), speed(7, 0.4)]);
    }

    #[test]
    fn another_seed_is_refused_and_leaves_nothing_behind() {
        let directory = tempfile::tempdir().expect("directory");
        let (ours, theirs) = (directory.path().join("ours.mcap"), directory.path().join("theirs.mcap"));
        Recorder::create(&ours, &origin()).expect("starts").finish().expect("ends");
        Recorder::create(&theirs, &Origin { seed: 8, ..origin() }).expect("starts").finish().expect("ends");
        let error = merge(&[&ours, &theirs], directory.path().join("out.mcap")).expect_err("refused").to_string();
        assert!(error.contains("theirs.mcap") && error.contains("ours.mcap"), "{error}");
        assert_eq!(fs::read_dir(directory.path()).expect("lists").count(), 2);
    }
}
