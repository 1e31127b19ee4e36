//! Rows out of an MCAP file, also of one that ends in the middle.

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use common::record::{ClockRecord, Name, Record, Row};
use mcap::McapError;
use mcap::records::{self, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::packed::unpack;
use super::recorder::{DIGEST, MISSION, MISSION_FILE, PACKED, SEED, SETTLED, START, VEHICLES};
use super::topic::Topic;
use super::{Origin, RecordingError, Result};

/// No record and no chunk of ours comes near this; a damaged length must not make us allocate without bound.
const LENGTH_LIMIT: usize = 256 * 1024 * 1024;

/// Bytes asked of the file at a time.
const READ_BYTES: usize = 64 * 1024;

/// A whole recording in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The mission file, as flown.
    pub mission_toml: String,
    /// Its digest, in hexadecimal.
    pub digest: String,
    /// The seed.
    pub seed: u64,
    /// When mission time was zero \[ns of the UNIX epoch\]; `None` if it did not pass with the wall clock.
    pub start_unix_ns: Option<i64>,
    /// Rows that mission and seed determine, in the order of the file.
    pub exact: Vec<Record>,
    /// Rows that depend on the wall clock, in the order of the file.
    pub clock: Vec<ClockRecord>,
    /// False if the file ends before its end: its process was killed, or is still writing.
    pub complete: bool,
    /// What is wrong with the first bytes that could not be used, if that is more than a missing end.
    pub damage: Option<String>,
}

impl Recording {
    /// What the recording says about the run as a whole.
    pub fn origin(&self) -> Origin {
        Origin {
            mission_toml: self.mission_toml.clone(),
            digest: self.digest.clone(),
            seed: self.seed,
            start_unix_ns: self.start_unix_ns,
        }
    }
}

/// Reads a recording whole. A file that ends in the middle gives what its whole chunks hold and `complete: false`.
pub fn read(path: impl AsRef<Path>) -> Result<Recording> {
    collect(RowReader::open(path)?)
}

/// Reads a recording from any source; errors name it `place`.
pub fn read_from(source: impl Read, place: impl Into<PathBuf>) -> Result<Recording> {
    collect(RowReader::new(source, place)?)
}

fn collect<R: Read>(mut rows: RowReader<R>) -> Result<Recording> {
    let mut recording = Recording::default();
    for row in rows.by_ref() {
        match row? {
            Row::Exact(record) => recording.exact.push(record),
            Row::Clock(record) => recording.clock.push(record),
        }
    }
    let Origin { mission_toml, digest, seed, start_unix_ns } = rows.origin().clone();
    Ok(Recording {
        mission_toml,
        digest,
        seed,
        start_unix_ns,
        complete: rows.is_complete(),
        damage: rows.damage().map(str::to_owned),
        ..recording
    })
}

/// Reads a recording row by row; memory holds one chunk.
///
/// A chunk is used whole or not at all; a damaged one is skipped, and what follows is read. Where the file is cut, or so
/// damaged that the next record cannot be found, the rows end. None of this is an error; ask
/// [`is_complete`](RowReader::is_complete) and [`damage`](RowReader::damage) afterwards. An error means that the file
/// cannot be read, is no recording at all, or holds rows of another version.
pub struct RowReader<R: Read> {
    source: R,
    place: PathBuf,
    reader: LinearReader,
    contents: Contents,
    skipped: u64,
    damage: Option<String>,
    end: End,
}

/// What was read.
#[derive(Default)]
struct Contents {
    topics: HashMap<u16, Topic>,
    /// The channels of packed messages, with the vehicles' names.
    packs: HashMap<u16, Vec<Name>>,
    origin: Origin,
    /// Rows that were not handed out yet.
    rows: VecDeque<Row>,
}

/// How far the reader is from the end of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Ahead,
    Reached,
    Cut,
    Damaged,
    /// An error was returned.
    Failed,
}

/// Why a record is of no use.
enum Trouble {
    /// It was damaged after it was written.
    Damaged(String),
    /// It was written so.
    Foreign(String),
}

impl RowReader<BufReader<File>> {
    /// Opens a file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|cause| RecordingError::io(path, cause))?;
        RowReader::new(BufReader::with_capacity(READ_BYTES, file), path)
    }
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LENGTH_LIMIT)
}

impl<R: Read> RowReader<R> {
    /// Reads from `source`; errors name it `place`. The origin is known when this returns.
    pub fn new(source: R, place: impl Into<PathBuf>) -> Result<Self> {
        let mut rows = RowReader {
            source,
            place: place.into(),
            reader: LinearReader::new_with_options(options().with_emit_chunks(true)),
            contents: Contents::default(),
            skipped: 0,
            damage: None,
            end: End::Ahead,
        };
        if let Some(first) = rows.next_row()? {
            rows.contents.rows.push_front(first);
        }
        Ok(rows)
    }

    /// What the recording says about the run as a whole.
    pub fn origin(&self) -> &Origin {
        &self.contents.origin
    }

    /// Whether the end of the file was reached as its writer meant it, with nothing left out; known when the rows have
    /// ended.
    pub fn is_complete(&self) -> bool {
        self.end == End::Reached && self.skipped == 0
    }

    /// Chunks that were skipped because they are damaged.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// What is wrong with the first bytes that could not be used, if that is more than a missing end.
    pub fn damage(&self) -> Option<&str> {
        self.damage.as_deref()
    }

    /// Where the rows come from.
    pub fn place(&self) -> &Path {
        &self.place
    }

    fn next_row(&mut self) -> Result<Option<Row>> {
        loop {
            if let Some(row) = self.contents.rows.pop_front() {
                return Ok(Some(row));
            }
            if self.end != End::Ahead {
                return Ok(None);
            }
            let taken = match self.reader.next_event() {
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = self.reader.insert(wanted.min(READ_BYTES));
                    let read = read_some(&mut self.source, buffer).map_err(|cause| {
                        self.end = End::Failed;
                        RecordingError::io(&self.place, cause)
                    })?;
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, data })) => self.contents.take_chunk(data),
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    if opcode == op::FOOTER {
                        self.end = End::Reached;
                    }
                    self.contents.take(opcode, data)
                }
                Some(Err(McapError::UnexpectedEof)) | None => {
                    self.end = End::Cut;
                    continue;
                }
                Some(Err(cause @ McapError::BadMagic)) => Err(Trouble::Foreign(cause.to_string())),
                Some(Err(cause)) => {
                    // Where the next record begins is not known.
                    self.end = End::Damaged;
                    Err(Trouble::Damaged(cause.to_string()))
                }
            };
            match taken {
                Ok(()) => {}
                Err(Trouble::Damaged(cause)) => {
                    self.skipped += u64::from(self.end != End::Damaged);
                    self.damage.get_or_insert(cause);
                }
                Err(Trouble::Foreign(cause)) => {
                    self.end = End::Failed;
                    return Err(RecordingError::format(&self.place, cause));
                }
            }
        }
    }
}

impl Contents {
    /// Takes a chunk, whole or not at all.
    fn take_chunk(&mut self, chunk: &[u8]) -> std::result::Result<(), Trouble> {
        let mut head = vec![op::CHUNK];
        head.extend((chunk.len() as u64).to_le_bytes());
        let mut source = head.chain(chunk);
        let mut reader = LinearReader::new_with_options(options().with_skip_start_magic(true));
        let before = self.rows.len();
        loop {
            let taken = match reader.next_event() {
                None | Some(Err(McapError::UnexpectedEof)) => return Ok(()),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = reader.insert(wanted.min(READ_BYTES));
                    // Memory does not fail to be read.
                    let read = source.read(buffer).unwrap_or(0);
                    reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => self.take(opcode, data),
                Some(Err(cause)) => Err(Trouble::Damaged(cause.to_string())),
            };
            if taken.is_err() {
                self.rows.truncate(before);
                return taken;
            }
        }
    }

    /// Takes a record.
    fn take(&mut self, opcode: u8, data: &[u8]) -> std::result::Result<(), Trouble> {
        match mcap::parse_record(opcode, data) {
            Ok(records::Record::Message { header, data }) => {
                if let Some(vehicles) = self.packs.get(&header.channel_id) {
                    let before = self.rows.len();
                    let unpacked = unpack(&data, vehicles, |row| self.rows.push_back(row));
                    let credible = self.rows.range(before..).all(is_credible);
                    if !(unpacked && credible) {
                        self.rows.truncate(before);
                    }
                    return match (unpacked, credible) {
                        (false, _) => Err(Trouble::Foreign("a pack of messages cannot be read".into())),
                        (true, false) => Err(Trouble::Damaged("a pack of messages has numbers that cannot be".into())),
                        (true, true) => Ok(()),
                    };
                }
                let Some(topic) = self.topics.get(&header.channel_id) else { return Ok(()) };
                let row = topic.decode(&data);
                let row =
                    row.map_err(|cause| Trouble::Foreign(format!("a row of {topic:?} cannot be read: {cause}")))?;
                if !is_credible(&row) {
                    return Err(Trouble::Damaged(format!("a row of {topic:?} has numbers that cannot be")));
                }
                self.rows.push_back(row);
            }
            Ok(records::Record::Channel(channel)) if channel.topic == SETTLED && channel.message_encoding == PACKED => {
                let names = channel.metadata.get(VEHICLES).map_or("", String::as_str);
                self.packs.insert(channel.id, names.split(',').map(Name::from).collect());
            }
            Ok(records::Record::Channel(channel)) => {
                // Topics of others are skipped: a recording may be enriched with views of it.
                if let Some(topic) = Topic::named(&channel.topic).filter(|_| channel.message_encoding == "json") {
                    self.topics.insert(channel.id, topic);
                }
            }
            Ok(records::Record::Attachment { header, data, .. }) if header.name == MISSION_FILE => {
                self.origin.mission_toml = String::from_utf8_lossy(&data).into_owned();
            }
            Ok(records::Record::Metadata(metadata)) if metadata.name == MISSION => {
                self.origin.digest = metadata.metadata.get(DIGEST).cloned().unwrap_or_default();
                let seed = metadata.metadata.get(SEED).and_then(|seed| seed.parse().ok());
                self.origin.seed = seed.unwrap_or_default();
                self.origin.start_unix_ns = metadata.metadata.get(START).and_then(|start| start.parse().ok());
            }
            // Other programs' records have numbers from 0x80 on.
            Ok(records::Record::Unknown { opcode: ..0x80, .. }) => {
                return Err(Trouble::Damaged(format!("there is no record of kind {opcode:#04x}")));
            }
            Ok(_) => {}
            Err(cause) => return Err(Trouble::Damaged(cause.to_string())),
        }
        Ok(())
    }
}

/// No mission lasts longer than 30 days; a day more is for what is said before its begin and after its end \[ns\].
const FARTHEST_NS: u64 = 31 * 86_400 * 1_000_000_000;
/// A message may be due long after the end of its mission, but not so late that instants cannot be subtracted \[ns\].
const LATEST_NS: u64 = i64::MAX as u64 / 4;
/// No process counts as far as this; the counts of a million rows can still be added up.
const MOST: u64 = 1 << 44;

/// Whether the numbers of a row can be those of a flight: what reads the rows subtracts instants and adds counts.
fn is_credible(row: &Row) -> bool {
    let near = |t_ns: i64| t_ns.unsigned_abs() <= FARTHEST_NS;
    let ever = |t_ns: i64| t_ns.unsigned_abs() <= LATEST_NS;
    near(row.t_ns())
        && match row {
            Row::Exact(Record::Message(row)) => near(row.sent_ns) && ever(row.due_ns) && row.seq <= MOST,
            Row::Exact(Record::Warning(row)) | Row::Clock(ClockRecord::Note(row)) => row.count <= MOST,
            Row::Exact(Record::State(_) | Record::Topology(_) | Record::Speed(_)) => true,
            Row::Clock(ClockRecord::Achieved(row)) => ever(row.commanded_ns) && ever(row.late_ns) && row.seq <= MOST,
            Row::Clock(ClockRecord::Ticks(row)) => row.met <= MOST && row.missed <= MOST && ever(row.worst_late_ns),
            Row::Clock(ClockRecord::Overrun(row)) => row.count <= MOST,
        }
}

impl<R: Read> Iterator for RowReader<R> {
    type Item = Result<Row>;

    fn next(&mut self) -> Option<Result<Row>> {
        self.next_row().transpose()
    }
}

/// One read that is not put off by a signal.
fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Recorder;
    use std::collections::BTreeSet;

    use common::record::MessageRow;

    use super::super::testing::{SharedDisk, message, origin, state, tick};
    use super::*;

    const ROWS_PER_TICK: usize = 8;

    /// A file with one chunk per tick, and where each chunk ends.
    fn chunked(ticks: i64) -> (Vec<u8>, Vec<usize>) {
        let mut ends = Vec::new();
        let disk = SharedDisk::default();
        let mut recorder = Recorder::new(disk.clone(), "shared", &origin()).expect("starts");
        for t_ns in 0..ticks {
            tick(t_ns).iter().for_each(|row| recorder.write(row).expect("writes"));
            recorder.flush().expect("flushes");
            ends.push(disk.bytes().len());
        }
        recorder.finish().expect("ends");
        (disk.bytes(), ends)
    }

    #[test]
    fn a_cut_file_gives_its_whole_chunks_at_every_length() {
        let (file, ends) = chunked(3);
        for length in 0..file.len() {
            let recording = read_from(&file[..length], "cut.mcap").expect("reads");
            let whole = ends.iter().filter(|end| **end <= length).count();
            let rows = recording.exact.len() + recording.clock.len();
            // Indexes follow the rows of a chunk: rows may be there before the chunk's last byte is. And the rows of the
            // first tick are in many chunks, for each begins a channel.
            let expected = |rows| rows == whole * ROWS_PER_TICK || rows == (whole + 1) * ROWS_PER_TICK;
            assert!(expected(rows) || (whole == 0 && rows <= ROWS_PER_TICK), "{length}: {rows}");
            assert_eq!(recording.damage, None, "{length}");
            // The last bytes are the magic, after the end proper.
            assert!(!recording.complete || length >= file.len() - mcap::MAGIC.len(), "{length}");
        }
        assert!(read_from(&file[..], "whole.mcap").expect("reads").complete);
    }

    /// Wherever a byte is wrong: the rows of the other chunks are read, in order, and the damage is told. (A wrong length
    /// is where the file ends.)
    #[test]
    fn a_damaged_chunk_is_skipped_and_named() {
        let (sound, ends) = chunked(4);
        let all = read_from(&sound[..], "sound.mcap").expect("reads").exact;
        let (mut skipped, mut ended) = (0, 0);
        // The channels are in the first chunks.
        for at in (ends[0]..ends[2]).step_by(3) {
            let mut file = sound.clone();
            file[at] ^= 0x55;
            let recording = read_from(&file[..], "damaged.mcap").expect("reads");
            let of_chunk = |t_ns: i64| all.iter().filter(|row| row.t_ns() == t_ns).cloned().collect::<Vec<_>>();
            let damaged = if at < ends[1] { 1 } else { 2 };
            let others: Vec<Record> = (0..4).filter(|t| *t != damaged).flat_map(of_chunk).collect();
            let first: Vec<Record> = (0..damaged).flat_map(of_chunk).collect();
            match recording.exact {
                rows if rows == all => {}
                rows if rows == others => {
                    skipped += 1;
                    assert!(!recording.complete && recording.damage.is_some(), "{at}");
                }
                rows => {
                    ended += 1;
                    assert!(!recording.complete, "{at}");
                    assert!(rows.starts_with(&first), "{at}");
                }
            }
        }
        // Damage in what a chunk holds is skipped; damage in its header, a few bytes, may end the reading.
        assert!(skipped > 150 && skipped > 5 * ended, "{skipped} skipped, {ended} ended");
    }

    /// Sound framing proves nothing: whoever wrote the file may have written anything.
    #[test]
    fn rows_with_numbers_that_cannot_be_are_damaged() {
        let late = |row: Row| match row {
            Row::Exact(Record::Message(row)) => Row::Exact(Record::Message(MessageRow { due_ns: i64::MIN, ..row })),
            other => other,
        };
        for forged in [state(i64::MIN, "a", 0.0), state(i64::MAX, "a", 0.0), late(message(1, "a", "b", 9))] {
            let disk = SharedDisk::default();
            let mut recorder = Recorder::new(disk.clone(), "shared", &origin()).expect("starts");
            for t_ns in 0..3 {
                tick(t_ns).iter().for_each(|row| recorder.write(row).expect("writes"));
                if t_ns == 1 {
                    recorder.write(&forged).expect("writes");
                }
                recorder.flush().expect("flushes");
            }
            recorder.finish().expect("ends");
            let recording = read_from(&disk.bytes()[..], "forged.mcap").expect("reads");
            let instants: BTreeSet<i64> = recording.exact.iter().map(Record::t_ns).collect();
            assert_eq!(instants, BTreeSet::from([0, 2]), "the chunk with the forged row is left out");
            let damage = recording.damage.expect("told");
            assert!(!recording.complete && damage.ends_with("has numbers that cannot be"), "{damage}");
        }
    }

    #[test]
    fn zeros_after_a_power_cut_end_the_rows() {
        let (mut file, ends) = chunked(3);
        file[ends[1]..].fill(0);
        let recording = read_from(&file[..], "zeros.mcap").expect("reads");
        assert_eq!(recording.exact.len() + recording.clock.len(), 2 * ROWS_PER_TICK);
        assert!(!recording.complete);
    }

    #[test]
    fn what_is_not_a_recording_is_refused_by_name() {
        let error = read_from(&b"name = \"not a recording\"\n"[..], "mission.toml").expect_err("refused").to_string();
        assert!(error.contains("mission.toml") && error.contains("magic"), "{error}");
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read("/nonexistent/recording.mcap").expect_err("refused").to_string();
        assert!(error.contains("/nonexistent/recording.mcap"), "{error}");
    }
}
