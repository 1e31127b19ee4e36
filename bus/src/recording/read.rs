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
use super::recorder::{DIGEST, MISSION, MISSION_FILE, PACKED, SEED, SETTLED, VEHICLES};
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
        Origin { mission_toml: self.mission_toml.clone(), digest: self.digest.clone(), seed: self.seed }
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
    let Origin { mission_toml, digest, seed } = rows.origin().clone();
    Ok(Recording {
        mission_toml,
        digest,
        seed,
        complete: rows.is_complete(),
        damage: rows.damage().map(str::to_owned),
        ..recording
    })
}

/// Reads a recording row by row; memory holds one chunk.
///
/// A chunk is used whole or not at all. Where the file is cut or damaged the rows end, without an error; ask
/// [`is_complete`](RowReader::is_complete) and [`damage`](RowReader::damage) afterwards. An error means that the file
/// cannot be read, is no recording at all, or holds rows of another version.
pub struct RowReader<R: Read> {
    source: R,
    place: PathBuf,
    reader: LinearReader,
    topics: HashMap<u16, Topic>,
    /// The channels of packed messages, with the vehicles' names.
    packs: HashMap<u16, Vec<Name>>,
    origin: Origin,
    /// Read and not handed out yet.
    pending: VecDeque<Row>,
    end: End,
}

/// How far the reader is from the end of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
enum End {
    Ahead,
    Reached,
    Cut,
    Damaged(String),
    /// An error was returned.
    Failed,
}

impl RowReader<BufReader<File>> {
    /// Opens a file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|cause| RecordingError::io(path, cause))?;
        RowReader::new(BufReader::with_capacity(READ_BYTES, file), path)
    }
}

impl<R: Read> RowReader<R> {
    /// Reads from `source`; errors name it `place`. The origin is known when this returns.
    pub fn new(source: R, place: impl Into<PathBuf>) -> Result<Self> {
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LENGTH_LIMIT);
        let mut rows = RowReader {
            source,
            place: place.into(),
            reader: LinearReader::new_with_options(options),
            topics: HashMap::new(),
            packs: HashMap::new(),
            origin: Origin::default(),
            pending: VecDeque::new(),
            end: End::Ahead,
        };
        let first = rows.next_row()?;
        first.into_iter().for_each(|row| rows.pending.push_front(row));
        Ok(rows)
    }

    /// What the recording says about the run as a whole.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Whether the end of the file was reached as its writer meant it; known when the rows have ended.
    pub fn is_complete(&self) -> bool {
        self.end == End::Reached
    }

    /// What is wrong with the first bytes that could not be used, if that is more than a missing end.
    pub fn damage(&self) -> Option<&str> {
        match &self.end {
            End::Damaged(cause) => Some(cause),
            _ => None,
        }
    }

    /// Where the rows come from.
    pub fn place(&self) -> &Path {
        &self.place
    }

    fn next_row(&mut self) -> Result<Option<Row>> {
        while self.end == End::Ahead {
            let event = match self.reader.next_event() {
                Some(Ok(event)) => event,
                Some(Err(McapError::UnexpectedEof)) | None => {
                    self.end = End::Cut;
                    break;
                }
                Some(Err(cause @ (McapError::BadMagic | McapError::UnsupportedCompression(_)))) => {
                    self.end = End::Failed;
                    return Err(RecordingError::mcap(&self.place, cause));
                }
                Some(Err(cause)) => {
                    self.end = End::Damaged(cause.to_string());
                    break;
                }
            };
            let (opcode, data) = match event {
                LinearReadEvent::ReadRequest(wanted) => {
                    let buffer = self.reader.insert(wanted.min(READ_BYTES));
                    let read = read_some(&mut self.source, buffer).map_err(|cause| {
                        self.end = End::Failed;
                        RecordingError::io(&self.place, cause)
                    })?;
                    self.reader.notify_read(read);
                    continue;
                }
                LinearReadEvent::Record { opcode, data } => (opcode, data),
            };
            match mcap::parse_record(opcode, data) {
                Ok(records::Record::Message { header, data }) => {
                    if let Some(vehicles) = self.packs.get(&header.channel_id) {
                        if !unpack(&data, vehicles, |row| self.pending.push_back(row)) {
                            self.end = End::Failed;
                            return Err(RecordingError::format(&self.place, "a pack of messages cannot be read"));
                        }
                        if let Some(row) = self.pending.pop_front() {
                            return Ok(Some(row));
                        }
                        continue;
                    }
                    let Some(topic) = self.topics.get(&header.channel_id) else { continue };
                    match topic.decode(&data) {
                        Ok(row) => return Ok(Some(row)),
                        Err(cause) => {
                            self.end = End::Failed;
                            let what = format!("a row of {topic:?} cannot be read: {cause}");
                            return Err(RecordingError::format(&self.place, what));
                        }
                    }
                }
                Ok(records::Record::Channel(channel))
                    if channel.topic == SETTLED && channel.message_encoding == PACKED =>
                {
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
                }
                Ok(_) if opcode == op::FOOTER => self.end = End::Reached,
                Ok(_) => {}
                Err(cause) => self.end = End::Damaged(cause.to_string()),
            }
        }
        Ok(None)
    }
}

impl<R: Read> Iterator for RowReader<R> {
    type Item = Result<Row>;

    fn next(&mut self) -> Option<Result<Row>> {
        match self.pending.pop_front() {
            Some(row) => Some(Ok(row)),
            None => self.next_row().transpose(),
        }
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
    use super::super::testing::{SharedDisk, origin, tick};
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
            // Indexes follow the rows of a chunk: rows may be there before the chunk's last byte is.
            assert!(rows == whole * ROWS_PER_TICK || rows == (whole + 1) * ROWS_PER_TICK, "{length}: {rows}");
            assert_eq!(recording.damage, None, "{length}");
            // The last bytes are the magic, after the end proper.
            assert!(!recording.complete || length >= file.len() - mcap::MAGIC.len(), "{length}");
        }
        assert!(read_from(&file[..], "whole.mcap").expect("reads").complete);
    }

    #[test]
    fn a_damaged_chunk_ends_the_rows_and_is_named() {
        let (mut file, ends) = chunked(3);
        file[ends[0] + 200] ^= 0xff;
        let recording = read_from(&file[..], "damaged.mcap").expect("reads");
        assert_eq!(recording.exact.len() + recording.clock.len(), ROWS_PER_TICK);
        assert!(!recording.complete);
        assert!(recording.damage.is_some());
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
