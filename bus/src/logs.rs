//! The logs of one process: a folder with one folder per mission, in it one file per life of the process. Rows are
//! written on a thread of their own, so that a slow disk does not delay a control loop.

use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use common::mission::Mission;
use common::record::{ClockRecord, Name, NoteRow, Record, Row, Settled, StateRow};
use common::wire::vehicle::LogPiece;

use crate::recording::packed::{PACK, Pack};
use crate::recording::{FLUSH_PERIOD, Origin, Recorder, RowReader, time_of};

/// Helpings of rows that wait for the disk; beyond, the process waits too, and it is noted how often.
const QUEUE: usize = 256;
/// Rows in a helping: the thread that writes is not woken for each.
const HELPING: usize = 64;
/// Bytes of a log sent at a time.
const PIECE: usize = 512 << 10;

/// Where a recording comes from.
pub fn origin(mission: &Mission) -> Origin {
    Origin { mission_toml: mission.text.clone(), digest: format!("{:016x}", mission.digest), seed: mission.seed }
}

/// The logs of one process.
pub struct Logs {
    folder: PathBuf,
    stem: String,
    open: Option<Open>,
    failure: Arc<Mutex<Option<String>>>,
}

struct Open {
    digest: u64,
    to_disk: SyncSender<Helping>,
    writer: JoinHandle<()>,
    /// The ends of each link, by index among the vehicles.
    links: Vec<(usize, usize)>,
    rows: Vec<Row>,
    pack: Pack,
    /// How often the disk was waited for.
    waits: u64,
    last_t_ns: i64,
}

/// What is handed to the thread that writes.
enum Helping {
    Rows(Vec<Row>),
    Pack(Pack),
}

impl Open {
    fn hand_over(&mut self, helping: Helping) {
        match self.to_disk.try_send(helping) {
            Ok(()) => {}
            Err(TrySendError::Full(helping)) => {
                self.waits += 1;
                // The writer only ends after this end of the channel is dropped.
                let _ = self.to_disk.send(helping);
            }
            Err(TrySendError::Disconnected(_)) => {}
        }
    }

    fn hand_over_rows(&mut self) {
        if !self.rows.is_empty() {
            let rows = std::mem::take(&mut self.rows);
            self.hand_over(Helping::Rows(rows));
        }
    }

    fn hand_over_pack(&mut self) {
        if !self.pack.bytes.is_empty() {
            let pack = std::mem::take(&mut self.pack);
            self.hand_over(Helping::Pack(pack));
        }
    }
}

impl Logs {
    /// Logs of the process called `stem`, below `folder`.
    pub fn new(folder: impl Into<PathBuf>, stem: &str) -> Logs {
        Logs { folder: folder.into(), stem: stem.to_string(), open: None, failure: Arc::default() }
    }

    fn folder_of(&self, digest: u64) -> PathBuf {
        self.folder.join(format!("{digest:016x}"))
    }

    /// Files of a mission, in the order in which they were begun.
    fn files(&self, digest: u64) -> Vec<PathBuf> {
        let folder = self.folder_of(digest);
        let name = |life: u32| match life {
            1 => format!("{}.mcap", self.stem),
            _ => format!("{}-{life}.mcap", self.stem),
        };
        (1..).map(|life| folder.join(name(life))).take_while(|path| path.exists()).collect()
    }

    /// Begins a log of this mission. If `fresh`, what earlier flights of the same mission left is set aside; otherwise it
    /// is kept, and the last state in it is returned.
    ///
    /// # Errors
    /// Why the file cannot be made.
    pub fn open(&mut self, mission: &Mission, fresh: bool) -> Result<Option<StateRow>, String> {
        self.close();
        let folder = self.folder_of(mission.digest);
        let refused = |error: &dyn std::fmt::Display| format!("cannot record in {}: {error}", folder.display());
        fs::create_dir_all(&folder).map_err(|error| refused(&error))?;
        let earlier = self.files(mission.digest);
        let mut last = None;
        if fresh {
            for file in &earlier {
                set_aside(file).map_err(|error| refused(&error))?;
            }
        } else {
            last = earlier.iter().rev().find_map(|file| last_state(file));
        }
        let (path, recorder) =
            Recorder::create_next(&folder, &self.stem, &origin(mission)).map_err(|error| refused(&error))?;
        tracing::debug!("recording in {}", path.display());
        let (to_disk, queue) = sync_channel(QUEUE);
        let vehicles = mission.vehicles.iter().map(|vehicle| Name::from(vehicle.id.as_str())).collect::<Vec<_>>();
        let failure = Arc::clone(&self.failure);
        let writer = std::thread::Builder::new()
            .name("log".into())
            .spawn(move || {
                if let Err(error) = write_rows(recorder, &queue, &vehicles) {
                    *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                    // Rows go on coming; they must not block the one who sends them.
                    while queue.recv().is_ok() {}
                }
            })
            .map_err(|error| refused(&error))?;
        self.open = Some(Open {
            digest: mission.digest,
            to_disk,
            writer,
            links: mission.links.iter().map(|link| (link.from, link.to)).collect(),
            rows: Vec::new(),
            pack: Pack::default(),
            waits: 0,
            last_t_ns: 0,
        });
        Ok(last)
    }

    /// Records a row, if a log is open. It is handed to the disk with others, or with the next [`tend`](Logs::tend).
    pub fn write(&mut self, row: Row) {
        if let Some(open) = &mut self.open {
            // What is in the pack came before it.
            open.hand_over_pack();
            open.last_t_ns = time_of(&row);
            open.rows.push(row);
            if open.rows.len() >= HELPING {
                open.hand_over_rows();
            }
        }
    }

    /// Records what became of a message, likewise.
    pub fn settled(&mut self, settled: &Settled) {
        if let Some(open) = &mut self.open
            && let Some(&(from, to)) = open.links.get(settled.link)
        {
            open.hand_over_rows();
            open.pack.add(settled, from, to);
            open.last_t_ns = settled.t_ns;
            if open.pack.bytes.len() >= PACK {
                open.hand_over_pack();
            }
        }
    }

    /// Hands over what waits to be written; tells, once, why recording has stopped.
    pub fn tend(&mut self) -> Option<String> {
        if let Some(open) = &mut self.open {
            open.hand_over_rows();
            open.hand_over_pack();
        }
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Ends the log and waits until it is on disk.
    pub fn close(&mut self) {
        if let Some(mut open) = self.open.take() {
            open.hand_over_rows();
            open.hand_over_pack();
            if open.waits > 0 {
                let text = "the process waited for the disk".to_string();
                let note = NoteRow { t_ns: open.last_t_ns, source: self.stem.clone(), text, count: open.waits };
                open.hand_over(Helping::Rows(vec![Row::Clock(ClockRecord::Note(note))]));
            }
            drop(open.to_disk);
            let _ = open.writer.join();
        }
    }

    /// A piece of a log of the mission with this digest; a piece of no file if there is none.
    pub fn piece(&self, digest: u64, file: u32, offset: u64) -> LogPiece {
        let files = self.files(digest);
        // A log that is being written is not whole: it counts once the flight is over.
        let count = if self.open.as_ref().is_some_and(|open| open.digest == digest) { 0 } else { files.len() as u32 };
        let nothing = LogPiece { file, files: count, offset, size: 0, bytes: Vec::new() };
        let Some(path) = files.get(file as usize).filter(|_| count > 0) else { return nothing };
        match read_piece(path, offset) {
            Ok((size, bytes)) => LogPiece { size, bytes, ..nothing },
            Err(error) => {
                tracing::warn!("cannot read {}: {error}", path.display());
                nothing
            }
        }
    }
}

impl Drop for Logs {
    fn drop(&mut self) {
        self.close();
    }
}

fn write_rows(
    mut recorder: Recorder<std::io::BufWriter<File>>,
    queue: &Receiver<Helping>,
    vehicles: &[Name],
) -> Result<(), String> {
    let broken = |error: crate::recording::RecordingError| format!("recording has stopped: {error}");
    loop {
        match queue.recv_timeout(FLUSH_PERIOD) {
            Ok(Helping::Rows(rows)) => rows.iter().try_for_each(|row| recorder.write(row)).map_err(broken)?,
            Ok(Helping::Pack(pack)) => recorder.write_pack(&pack, vehicles).map_err(broken)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                recorder.finish().map_err(broken)?;
                return Ok(());
            }
        }
        recorder.flush_if_due(Instant::now()).map_err(broken)?;
    }
}

/// Moves a file into the folder `earlier` beside it, under a name that is free.
fn set_aside(file: &Path) -> std::io::Result<()> {
    let folder = file.with_file_name("earlier");
    fs::create_dir_all(&folder)?;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let free = (1..).map(|n| folder.join(format!("{stem}.{n}.mcap"))).find(|path| !path.exists());
    free.map_or(Ok(()), |path| fs::rename(file, path))
}

fn read_piece(path: &Path, offset: u64) -> std::io::Result<(u64, Vec<u8>)> {
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    file.seek(SeekFrom::Start(offset))?;
    let mut bytes = Vec::with_capacity(PIECE.min(size.saturating_sub(offset) as usize));
    file.take(PIECE as u64).read_to_end(&mut bytes)?;
    Ok((size, bytes))
}

/// The last state that a log holds.
fn last_state(path: &Path) -> Option<StateRow> {
    let reader = RowReader::open(path).ok()?;
    let states = reader.filter_map(|row| match row {
        Ok(Row::Exact(Record::State(state))) => Some(state),
        _ => None,
    });
    states.last()
}
