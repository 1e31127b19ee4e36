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
use common::time::Time;
use common::wire::vehicle::LogPiece;

use crate::recording::packed::{PACK, Pack};
use crate::recording::{FLUSH_PERIOD, Origin, Recorder, RowReader};

/// Helpings of rows that wait for the disk; beyond, the process waits too, and it is noted how often.
const QUEUE: usize = 256;
/// Rows in a helping: the thread that writes is not woken for each.
const HELPING: usize = 64;
/// Bytes of a log sent at a time.
const PIECE: usize = 512 << 10;
/// Logs of earlier flights of a mission that are kept, of each name: the newest.
const KEPT: u64 = 5;

/// Where a recording comes from; `start_unix_ns` is when mission time is zero, if it passes with the wall clock.
pub fn origin(mission: &Mission, start_unix_ns: Option<i64>) -> Origin {
    let digest = format!("{:016x}", mission.digest);
    Origin { mission_toml: mission.text.clone(), digest, seed: mission.seed, start_unix_ns }
}

/// What earlier lives of a process recorded in a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Earlier {
    /// Mission time of the newest row; none if there are no rows.
    pub until: Option<Time>,
    /// The newest state.
    pub last_state: Option<StateRow>,
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
    /// To the disk with all that came before.
    Flush,
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

    /// Writes a file where the logs are to be, and removes it: a process that cannot keep logs had better say so before
    /// it is needed.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn check(&self) -> Result<(), String> {
        let trial = self.folder.join(format!(".{}-{}", self.stem, std::process::id()));
        fs::create_dir_all(&self.folder)
            .and_then(|()| fs::write(&trial, "\n"))
            .and_then(|()| fs::remove_file(&trial))
            .map_err(|error| format!("cannot keep logs in {}: {error}", self.folder.display()))
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

    /// Begins a log of a flight of this mission that starts then. If `fresh`, what earlier flights of the same mission left is set aside; otherwise it
    /// is kept, and its end is returned.
    ///
    /// # Errors
    /// Why the file cannot be made.
    pub fn open(&mut self, mission: &Mission, start_unix_ns: Option<i64>, fresh: bool) -> Result<Earlier, String> {
        self.close();
        let folder = self.folder_of(mission.digest);
        let refused = |error: &dyn std::fmt::Display| format!("cannot record in {}: {error}", folder.display());
        fs::create_dir_all(&folder).map_err(|error| refused(&error))?;
        let files = self.files(mission.digest);
        let mut earlier = Earlier::default();
        if fresh {
            for file in &files {
                set_aside(file).map_err(|error| refused(&error))?;
            }
        } else {
            earlier = ends_of(&files);
        }
        let origin = origin(mission, start_unix_ns);
        let (path, recorder) = Recorder::create_next(&folder, &self.stem, &origin).map_err(|error| refused(&error))?;
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
        Ok(earlier)
    }

    /// Records a row, if a log is open. It is handed to the disk with others, or with the next [`tend`](Logs::tend).
    pub fn write(&mut self, row: Row) {
        if let Some(open) = &mut self.open {
            // What is in the pack came before it.
            open.hand_over_pack();
            open.last_t_ns = row.t_ns();
            // A command cannot be told again by who is killed a moment later.
            let commanded = matches!(row, Row::Exact(Record::Speed(_)));
            open.rows.push(row);
            if open.rows.len() >= HELPING || commanded {
                open.hand_over_rows();
            }
            if commanded {
                open.hand_over(Helping::Flush);
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
            Ok(Helping::Flush) => recorder.flush().map_err(broken)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                recorder.finish().map_err(broken)?;
                return Ok(());
            }
        }
        recorder.flush_if_due(Instant::now()).map_err(broken)?;
    }
}

/// Moves a file into the folder `earlier` beside it, with the next number, and removes the oldest of its name there.
fn set_aside(file: &Path) -> std::io::Result<()> {
    let folder = file.with_file_name("earlier");
    fs::create_dir_all(&folder)?;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let path = |number: u64| folder.join(format!("{stem}.{number}.mcap"));
    let number = |name: &str| name.strip_prefix(&format!("{stem}."))?.strip_suffix(".mcap")?.parse::<u64>().ok();
    let names = fs::read_dir(&folder)?.flatten().map(|entry| entry.file_name());
    let there: Vec<u64> = names.filter_map(|name| number(&name.to_string_lossy())).collect();
    let next = there.iter().max().map_or(1, |newest| newest.saturating_add(1));
    fs::rename(file, path(next))?;
    there.into_iter().filter(|old| old.saturating_add(KEPT) <= next).try_for_each(|old| fs::remove_file(path(old)))
}

fn read_piece(path: &Path, offset: u64) -> std::io::Result<(u64, Vec<u8>)> {
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    file.seek(SeekFrom::Start(offset))?;
    let mut bytes = Vec::with_capacity(PIECE.min(size.saturating_sub(offset) as usize));
    file.take(PIECE as u64).read_to_end(&mut bytes)?;
    Ok((size, bytes))
}

/// Where the logs of earlier lives end, looked for from the newest on.
fn ends_of(files: &[PathBuf]) -> Earlier {
    let mut earlier = Earlier::default();
    for file in files.iter().rev() {
        let Ok(reader) = RowReader::open(file) else { continue };
        let mut last_state = None;
        for row in reader.map_while(Result::ok) {
            earlier.until = earlier.until.max(Some(Time::from_nanos(row.t_ns())));
            if let Row::Exact(Record::State(state)) = row {
                last_state = Some(state);
            }
        }
        earlier.last_state = earlier.last_state.or(last_state);
        if earlier.last_state.is_some() {
            break;
        }
    }
    earlier
}

#[cfg(test)]
mod tests {
    use common::record::SpeedRow;

    use super::*;
    use crate::recording::read;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");

    fn mission() -> Mission {
        Mission::parse("m.toml", HELIX).unwrap_or_else(|faults| panic!("{faults}"))
    }

    fn speed(t_ns: i64) -> Row {
        Row::Exact(Record::Speed(SpeedRow { t_ns, speed: 0.5 }))
    }

    #[test]
    fn a_command_is_on_disk_at_once() {
        let folder = tempfile::tempdir().expect("directory");
        let mut logs = Logs::new(folder.path(), "hub");
        logs.open(&mission(), None, true).expect("opens");
        logs.write(speed(7));
        let path = logs.folder_of(mission().digest).join("hub.mcap");
        // The thread that writes is not asked to tend or close: a process that is killed does neither.
        let deadline = Instant::now() + FLUSH_PERIOD * 20;
        while read(&path).is_ok_and(|recording| recording.exact.is_empty()) {
            assert!(Instant::now() < deadline, "it stays in memory");
            std::thread::yield_now();
        }
    }

    #[test]
    fn the_end_of_an_earlier_life_is_known() {
        let folder = tempfile::tempdir().expect("directory");
        let mut logs = Logs::new(folder.path(), "hub");
        assert_eq!(logs.open(&mission(), None, true).expect("opens"), Earlier::default());
        [3, 9, 5].map(speed).into_iter().for_each(|row| logs.write(row));
        let earlier = logs.open(&mission(), None, false).expect("opens");
        assert_eq!(earlier, Earlier { until: Some(Time::from_nanos(9)), last_state: None });
        assert_eq!(logs.open(&mission(), None, true).expect("opens"), Earlier::default(), "it is set aside");
    }

    #[test]
    fn a_log_says_of_which_flight_it_is() {
        let folder = tempfile::tempdir().expect("directory");
        let mut logs = Logs::new(folder.path(), "hub");
        logs.open(&mission(), Some(1_700_000_000_000_000_000), true).expect("opens");
        logs.close();
        let path = logs.folder_of(mission().digest).join("hub.mcap");
        assert_eq!(read(path).expect("a recording").start_unix_ns, Some(1_700_000_000_000_000_000));
    }

    #[test]
    fn the_newest_logs_of_earlier_flights_are_kept() {
        let folder = tempfile::tempdir().expect("directory");
        let mut logs = Logs::new(folder.path(), "hub");
        for _ in 0..9 {
            logs.open(&mission(), None, true).expect("opens");
        }
        logs.close();
        let earlier = logs.folder_of(mission().digest).join("earlier");
        let mut names: Vec<_> = fs::read_dir(earlier)
            .expect("there")
            .flatten()
            .map(|e| e.file_name().into_string().expect("text"))
            .collect();
        names.sort();
        assert_eq!(names, ["hub.4.mcap", "hub.5.mcap", "hub.6.mcap", "hub.7.mcap", "hub.8.mcap"]);
    }

    #[test]
    fn a_folder_that_takes_no_files_is_told_beforehand() {
        let folder = tempfile::tempdir().expect("directory");
        assert_eq!(Logs::new(folder.path().join("new"), "hub").check(), Ok(()));
        assert_eq!(fs::read_dir(folder.path().join("new")).expect("made").count(), 0, "nothing is left behind");
        let refused = Logs::new("/proc/nope", "hub").check().expect_err("no files there");
        assert!(refused.starts_with("cannot keep logs in /proc/nope: "), "{refused}");
    }
}
