//! Rows into an MCAP file, as they come.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::record::{ClockRecord, Name, NoteRow, Record, Row};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};

use super::packed::Pack;
use super::topic::{Topic, is_finite};
use super::{Cause, Origin, RecordingError, Result};

/// At most this much wall clock lies between two flushes by [`Recorder::flush_if_due`].
pub const FLUSH_PERIOD: Duration = Duration::from_millis(500);

/// Uncompressed bytes in a chunk: about one second of twenty vehicles at 50 Hz.
const CHUNK_BYTES: u64 = 256 * 1024;

/// Writes rows to an MCAP file.
///
/// The first failure stops the recorder: every later call says so and names the first cause, and nothing panics, so
/// that a fleet flies on when a disk is full.
pub struct Recorder<W: Write + Seek> {
    mcap: Writer<W>,
    place: PathBuf,
    /// One channel per topic other than states.
    shared: [Option<Channel>; Topic::COUNT],
    /// One channel per vehicle, in the order of first appearance.
    vehicles: Vec<(String, Channel)>,
    /// The channel of packed messages.
    settled: Option<Channel>,
    /// Where the next state row is looked for first: vehicles come in turn.
    next_vehicle: usize,
    /// Reused for every row.
    json: Vec<u8>,
    rows: u64,
    refused: u64,
    last_t_ns: i64,
    unflushed: bool,
    last_flush: Option<Instant>,
    failure: Option<String>,
}

/// An MCAP channel and how many messages it has.
#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

impl Recorder<BufWriter<File>> {
    /// A new file at `path`. An existing file is never overwritten: it may be all that a killed process left.
    pub fn create(path: impl AsRef<Path>, origin: &Origin) -> Result<Self> {
        let path = path.as_ref();
        let file = OpenOptions::new().write(true).create_new(true).open(path);
        let file = file.map_err(|cause| RecordingError::io(path, cause))?;
        Recorder::new(BufWriter::new(file), path, origin)
    }

    /// A new file `<stem>.mcap` in `directory`, or `<stem>-2.mcap` and so on if an earlier life of the process left one.
    pub fn create_next(directory: impl AsRef<Path>, stem: &str, origin: &Origin) -> Result<(PathBuf, Self)> {
        let directory = directory.as_ref();
        for life in 1_u32.. {
            let name = if life == 1 { format!("{stem}.mcap") } else { format!("{stem}-{life}.mcap") };
            let path = directory.join(name);
            match Recorder::create(&path, origin) {
                Err(RecordingError { cause: Cause::Io(cause), .. })
                    if cause.kind() == std::io::ErrorKind::AlreadyExists => {}
                other => return other.map(|recorder| (path, recorder)),
            }
        }
        Err(RecordingError::format(directory, "no free file name"))
    }
}

impl Recorder<Cursor<Vec<u8>>> {
    /// A recording in memory.
    pub fn in_memory(origin: &Origin) -> Result<Self> {
        Recorder::new(Cursor::new(Vec::new()), "(memory)", origin)
    }
}

impl<W: Write + Seek> Recorder<W> {
    /// Records into `writer`; errors name it `place`. The mission is written and flushed at once.
    pub fn new(writer: W, place: impl Into<PathBuf>, origin: &Origin) -> Result<Self> {
        let place = place.into();
        let mcap = start(writer, origin).map_err(|cause| RecordingError::mcap(&place, cause))?;
        Ok(Recorder {
            mcap,
            place,
            shared: [None; Topic::COUNT],
            vehicles: Vec::new(),
            settled: None,
            next_vehicle: 0,
            json: Vec::with_capacity(1024),
            rows: 0,
            refused: 0,
            last_t_ns: 0,
            unflushed: false,
            last_flush: None,
            failure: None,
        })
    }

    /// Writes a row. A row with a number that is not finite is counted in [`refused`](Recorder::refused) and left out.
    pub fn write(&mut self, row: &Row) -> Result<()> {
        if let Some(first) = &self.failure {
            return Err(RecordingError { place: self.place.clone(), cause: Cause::Stopped(first.clone()) });
        }
        if !is_finite(row) {
            self.refused += 1;
            return Ok(());
        }
        self.write_finite(row).map_err(|cause| self.stop(cause))
    }

    /// Writes what became of messages in a fleet of these vehicles.
    pub(crate) fn write_pack(&mut self, pack: &Pack, vehicles: &[Name]) -> Result<()> {
        if let Some(first) = &self.failure {
            return Err(RecordingError { place: self.place.clone(), cause: Cause::Stopped(first.clone()) });
        }
        self.try_pack(pack, vehicles).map_err(|cause| self.stop(cause))
    }

    fn try_pack(&mut self, pack: &Pack, vehicles: &[Name]) -> mcap::McapResult<()> {
        let mut channel = match self.settled {
            Some(channel) => channel,
            None => {
                let metadata = BTreeMap::from([(VEHICLES.to_owned(), vehicles.join(","))]);
                let id = self.mcap.add_channel(0, SETTLED, PACKED, &metadata)?;
                self.mcap.flush()?;
                Channel { id, sequence: 0 }
            }
        };
        let log_time = u64::try_from(pack.t_ns).unwrap_or(0);
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.sequence, log_time, publish_time: log_time };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.settled = Some(channel);
        self.mcap.write_to_known_channel(&header, &pack.bytes)?;
        self.last_t_ns = pack.t_ns;
        self.unflushed = true;
        Ok(())
    }

    /// Writes the open chunk to the file. After this, `kill -9` cannot take away what was recorded before.
    pub fn flush(&mut self) -> Result<()> {
        if !self.unflushed || self.failure.is_some() {
            return Ok(());
        }
        self.unflushed = false;
        self.mcap.flush().map_err(|cause| self.stop(cause))
    }

    /// Flushes if the last flush is [`FLUSH_PERIOD`] or more ago. Call it in every turn of a loop; it is cheap.
    pub fn flush_if_due(&mut self, now: Instant) -> Result<()> {
        let last = *self.last_flush.get_or_insert(now);
        if now.saturating_duration_since(last) < FLUSH_PERIOD {
            return Ok(());
        }
        self.last_flush = Some(now);
        self.flush()
    }

    /// Rows written.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Rows left out because a number in them was not finite.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Ends the file, with an index for quick access, and hands back the writer. Refused rows are noted in the file.
    pub fn finish(mut self) -> Result<W> {
        if self.refused > 0 {
            let note = NoteRow {
                t_ns: self.last_t_ns,
                source: "recorder".into(),
                text: "rows were left out because a value in them was not finite".into(),
                count: self.refused,
            };
            self.write(&Row::Clock(ClockRecord::Note(note)))?;
        }
        if let Some(first) = self.failure.take() {
            return Err(RecordingError { place: self.place, cause: Cause::Stopped(first) });
        }
        self.mcap.finish().map_err(|cause| RecordingError::mcap(&self.place, cause))?;
        let mut writer = self.mcap.into_inner();
        writer.flush().map_err(|cause| RecordingError::io(&self.place, cause))?;
        Ok(writer)
    }

    fn write_finite(&mut self, row: &Row) -> mcap::McapResult<()> {
        self.json.clear();
        Topic::encode(row, &mut self.json).map_err(std::io::Error::from)?;
        let t_ns = row.t_ns();
        let log_time = u64::try_from(t_ns).unwrap_or(0);
        let channel = match row {
            Row::Exact(Record::State(state)) => self.vehicle_channel(&state.vehicle)?,
            _ => self.shared_channel(Topic::of(row))?,
        };
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.sequence, log_time, publish_time: log_time };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &self.json)?;
        self.rows += 1;
        self.last_t_ns = t_ns;
        self.unflushed = true;
        Ok(())
    }

    fn shared_channel(&mut self, topic: Topic) -> mcap::McapResult<&mut Channel> {
        let slot = &mut self.shared[topic as usize];
        let channel = match *slot {
            Some(channel) => channel,
            None => add_channel(&mut self.mcap, topic, "")?,
        };
        Ok(slot.insert(channel))
    }

    fn vehicle_channel(&mut self, vehicle: &str) -> mcap::McapResult<&mut Channel> {
        let is_vehicle = |(name, _): &(String, Channel)| name == vehicle;
        let expected = self.vehicles.get(self.next_vehicle).is_some_and(is_vehicle).then_some(self.next_vehicle);
        let found = expected.or_else(|| self.vehicles.iter().position(is_vehicle));
        let index = match found {
            Some(index) => index,
            None => {
                let channel = add_channel(&mut self.mcap, Topic::State, vehicle)?;
                self.vehicles.push((vehicle.to_owned(), channel));
                self.vehicles.len() - 1
            }
        };
        self.next_vehicle = if index + 1 < self.vehicles.len() { index + 1 } else { 0 };
        Ok(&mut self.vehicles[index].1)
    }

    fn stop(&mut self, cause: mcap::McapError) -> RecordingError {
        let error = RecordingError::mcap(&self.place, cause);
        self.failure = Some(error.to_string());
        error
    }
}

/// The start of every file: header, mission, digest and seed.
fn start<W: Write + Seek>(writer: W, origin: &Origin) -> mcap::McapResult<Writer<W>> {
    // Without seeking, a chunk reaches the file whole or not at all, which is what makes a cut file readable.
    let options = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .profile("")
        .library("coordinated-path-following");
    let mut mcap = options.create(writer)?;
    mcap.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: MISSION_FILE.into(),
        media_type: "application/toml".into(),
        data: origin.mission_toml.as_bytes().into(),
    })?;
    let mut metadata =
        BTreeMap::from([(DIGEST.to_owned(), origin.digest.clone()), (SEED.to_owned(), origin.seed.to_string())]);
    metadata.extend(origin.start_unix_ns.map(|start| (START.to_owned(), start.to_string())));
    mcap.write_metadata(&Metadata { name: MISSION.into(), metadata })?;
    mcap.flush()?;
    Ok(mcap)
}

fn add_channel<W: Write + Seek>(mcap: &mut Writer<W>, topic: Topic, vehicle: &str) -> mcap::McapResult<Channel> {
    let (name, schema) = topic.schema();
    let schema = mcap.add_schema(name, "jsonschema", &schema)?;
    let id = mcap.add_channel(schema, &topic.name(vehicle), "json", &BTreeMap::new())?;
    // In a chunk of its own: a damaged row must not take along what the later ones need.
    mcap.flush()?;
    Ok(Channel { id, sequence: 0 })
}

/// The topic of packed messages, their encoding, and the key of the vehicles' names in the channel's metadata. (No vehicle's
/// name has a comma.)
pub(super) const SETTLED: &str = "/network/settled";
pub(super) const PACKED: &str = "cpf-packed";
pub(super) const VEHICLES: &str = "vehicles";

/// Name of the attachment that holds the mission file.
pub(super) const MISSION_FILE: &str = "mission.toml";
/// Name of the metadata record.
pub(super) const MISSION: &str = "mission";
/// Key of the digest in the metadata record.
pub(super) const DIGEST: &str = "digest";
/// Key of the seed in the metadata record.
pub(super) const SEED: &str = "seed";
/// Key of the instant of mission time zero in the mission's metadata.
pub(super) const START: &str = "start_unix_ns";

#[cfg(test)]
mod tests {
    use super::super::testing::{SmallDisk, origin, state, tick};
    use super::super::{read, read_from};
    use super::*;
    use common::record::SpeedRow;
    use proptest::prelude::*;

    fn round_trip(rows: &[Row]) -> super::super::Recording {
        let mut recorder = Recorder::in_memory(&origin()).expect("starts");
        for row in rows {
            recorder.write(row).expect("writes");
        }
        read_from(&recorder.finish().expect("ends").into_inner()[..], "test").expect("reads")
    }

    #[test]
    fn what_is_written_is_read() {
        let rows: Vec<Row> = [tick(0), tick(20_000_000), tick(-5)].concat();
        let recording = round_trip(&rows);
        assert_eq!(recording.origin(), origin());
        assert!(recording.complete);
        let (exact, clock): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| matches!(row, Row::Exact(_)));
        assert_eq!(recording.exact.into_iter().map(Row::Exact).collect::<Vec<_>>(), exact);
        assert_eq!(recording.clock.into_iter().map(Row::Clock).collect::<Vec<_>>(), clock);
    }

    proptest! {
        #[test]
        fn every_finite_number_returns_bit_for_bit(bits: u64) {
            let speed = f64::from_bits(bits);
            prop_assume!(speed.is_finite());
            let recording = round_trip(&[Row::Exact(Record::Speed(SpeedRow { t_ns: 1, speed }))]);
            let [Record::Speed(row)] = &recording.exact[..] else { panic!("one speed row") };
            prop_assert_eq!(row.speed.to_bits(), bits);
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_left_out_and_said() {
        let recording = round_trip(&[state(1, "a", f64::NAN), state(2, "a", 1.0), state(3, "a", f64::INFINITY)]);
        assert_eq!(recording.exact.len(), 1);
        let [ClockRecord::Note(note)] = &recording.clock[..] else { panic!("one note") };
        assert_eq!(note.count, 2);
    }

    #[test]
    fn a_full_disk_is_an_error_with_place_and_cause_and_no_panic() {
        for room in [0, 100, 1000, 4000, 40_000] {
            let disk = SmallDisk { written: Cursor::default(), room };
            let recorder = Recorder::new(disk, "full.mcap", &origin());
            let Ok(mut recorder) = recorder else { continue };
            let mut outcome = Ok(());
            for t_ns in 0..2000 {
                outcome = tick(t_ns).iter().try_for_each(|row| recorder.write(row)).and_then(|()| recorder.flush());
                if outcome.is_err() {
                    break;
                }
            }
            let first = outcome.expect_err("the disk is too small").to_string();
            assert!(first.contains("full.mcap") && first.contains("no storage space"), "{first}");
            let then = recorder.write(&state(0, "a", 0.0)).expect_err("stopped").to_string();
            assert!(then.contains(&first), "{then}");
            assert!(recorder.finish().is_err());
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_full_device_is_an_error() {
        let device = OpenOptions::new().write(true).open("/dev/full").expect("opens");
        let error = Recorder::new(BufWriter::new(device), "/dev/full", &origin()).err().expect("refused");
        assert!(matches!(&error.cause, Cause::Io(cause) if cause.kind() == std::io::ErrorKind::StorageFull), "{error}");
    }

    #[test]
    fn a_file_of_an_earlier_life_is_kept() {
        let directory = tempfile::tempdir().expect("directory");
        let (first, recorder) = Recorder::create_next(directory.path(), "v1", &origin()).expect("first life");
        drop(recorder);
        let (second, _) = Recorder::create_next(directory.path(), "v1", &origin()).expect("second life");
        assert_eq!((first.file_name(), second.file_name()), (Some("v1.mcap".as_ref()), Some("v1-2.mcap".as_ref())));
        let error = Recorder::create(&first, &origin()).err().expect("refused").to_string();
        assert!(error.contains("v1.mcap"), "{error}");
    }

    #[test]
    fn flushing_by_the_clock_bounds_what_a_kill_takes() {
        let directory = tempfile::tempdir().expect("directory");
        let path = directory.path().join("live.mcap");
        let mut recorder = Recorder::create(&path, &origin()).expect("starts");
        let start = Instant::now();
        for step in 0..100_u32 {
            recorder.write(&state(i64::from(step), "a", 0.0)).expect("writes");
            recorder.flush_if_due(start + step * Duration::from_millis(20)).expect("flushes");
        }
        // The process is killed here: nothing is finished, nothing is dropped.
        std::mem::forget(recorder);
        let recording = read(&path).expect("reads");
        assert!(!recording.complete);
        assert_eq!(recording.damage, None);
        assert_eq!(recording.exact.len(), 76, "all rows up to the flush at 1.5 s");
    }
}
