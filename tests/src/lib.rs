//! A harness for tests with the real processes: finds the programs, starts, freezes and kills them, keeps what they
//! print, and waits on conditions with a deadline. Nothing that was started outlives its test.

use std::fmt::Debug;
use std::fs::{self, File};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant, SystemTime};

use bus::recording::Recording;
use common::mission::Mission;
use common::record::{Record, StateRow};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use serde_json::Value;
use tempfile::TempDir;

/// Long enough for anything that is expected to happen, on a machine with other things to do.
pub const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks at a condition.
const LOOK: Duration = Duration::from_millis(5);

// --- the programs ------------------------------------------------------------------------------------------------------

/// A program of the project beside the test's own executable, `target/<profile>/<name>`.
///
/// # Panics
/// If it is missing, or older than one of the sources that it was made from.
pub fn program(name: &str) -> PathBuf {
    let own = std::env::current_exe().expect("a test has an executable");
    let profile = own.ancestors().nth(2).expect("target/<profile>/deps/<test>");
    let path = profile.join(name);
    if let Some(fault) = stale(&path) {
        panic!("{fault}; run `cargo build --workspace` first, or `cargo test --workspace`");
    }
    path
}

/// Why a program must not be tested: it is not there, or one of the sources that it is made from is newer.
fn stale(program: &Path) -> Option<String> {
    let Some(built) = changed(program) else { return Some(format!("there is no {}", program.display())) };
    let crates = match program.file_name().and_then(|name| name.to_str()) {
        Some("vehicle-node") => &["common", "bus", "vehicle-node"][..],
        Some("network-emulator") => &["common", "bus", "network-emulator"],
        _ => &["common", "bus", "vehicle-node", "network-emulator", "mission-control"],
    };
    let newest = crates.iter().filter_map(|name| newest_source(&in_repository(name).join("src"))).max()?;
    (newest.0 > built).then(|| format!("{} is older than {}", program.display(), newest.1.display()))
}

fn changed(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|m| m.modified()).ok()
}

/// The Rust source below a folder that was changed last, and when.
fn newest_source(folder: &Path) -> Option<(SystemTime, PathBuf)> {
    let entries = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    entries
        .filter_map(|path| match path.is_dir() {
            true => newest_source(&path),
            false if path.extension().is_some_and(|e| e == "rs") => Some((changed(&path)?, path)),
            false => None,
        })
        .max()
}

/// A file of the repository, such as `missions/auv-helix.toml`.
pub fn in_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a workspace").join(path)
}

/// A mission file of the repository, as text.
pub fn mission_text(path: &str) -> String {
    fs::read_to_string(in_repository(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A mission.
pub fn mission(text: &str) -> Arc<Mission> {
    Arc::new(Mission::parse("the test's mission", text).unwrap_or_else(|faults| panic!("{faults}")))
}

/// Replaces a piece of a mission file that must be there exactly once.
pub fn with(text: &str, piece: &str, replacement: &str) -> String {
    assert_eq!(text.matches(piece).count(), 1, "{piece:?} in the mission");
    text.replace(piece, replacement)
}

// --- waiting -----------------------------------------------------------------------------------------------------------

/// Waits until a condition holds.
///
/// # Panics
/// If it does not within `patience`.
pub fn until(patience: Duration, what: &str, mut condition: impl FnMut() -> bool) {
    found(patience, what, || condition().then_some(()));
}

/// Waits until there is something, and gives it.
///
/// # Panics
/// If there is nothing within `patience`.
pub fn found<T>(patience: Duration, what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + patience;
    loop {
        if let Some(value) = look() {
            return value;
        }
        assert!(Instant::now() < deadline, "waited {patience:?} in vain: {what}");
        std::thread::sleep(LOOK);
    }
}

// --- processes ---------------------------------------------------------------------------------------------------------

/// A process under test. It is killed when dropped, and what it printed is shown if the test failed.
#[derive(Debug)]
pub struct Process {
    name: String,
    child: Child,
    status: Option<ExitStatus>,
    stdout: PathBuf,
    stderr: PathBuf,
}

impl Process {
    /// What it has written to stdout so far.
    pub fn stdout(&self) -> String {
        fs::read_to_string(&self.stdout).unwrap_or_default()
    }

    /// What it has written to stderr so far.
    pub fn stderr(&self) -> String {
        fs::read_to_string(&self.stderr).unwrap_or_default()
    }

    /// Kill -9: no last words.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        self.status = self.child.wait().ok();
    }

    /// SIGTERM: asks it to end.
    pub fn terminate(&self) {
        kill_process(Pid::from_child(&self.child), Signal::TERM).expect("the process exists");
    }

    /// SIGSTOP; returns when it stands still.
    pub fn freeze(&self) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, Signal::STOP).expect("the process exists");
        waitpid(Some(pid), WaitOptions::UNTRACED).expect("the process stops");
    }

    /// SIGCONT.
    pub fn thaw(&self) {
        kill_process(Pid::from_child(&self.child), Signal::CONT).expect("the process exists");
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether it has not ended.
    pub fn is_running(&mut self) -> bool {
        if self.status.is_none() {
            self.status = self.child.try_wait().expect("the process is ours");
        }
        self.status.is_none()
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// If it does not end within `patience`.
    pub fn ends(&mut self, patience: Duration) -> ExitStatus {
        let what = format!("{} ends", self.name);
        found(patience, &what, || (!self.is_running()).then_some(self.status)?)
    }

    /// Waits for its end, which must come with this exit code.
    ///
    /// # Panics
    /// If it ends otherwise.
    pub fn ends_with(&mut self, code: i32) {
        let status = self.ends(PATIENCE);
        let (out, err) = (self.stdout(), self.stderr());
        assert_eq!(status.code(), Some(code), "{} ended with {status}\n{out}\n{err}", self.name);
        assert!(!err.contains("panicked"), "{}: {err}", self.name);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
        if std::thread::panicking() {
            let (out, err) = (self.stdout(), self.stderr());
            eprintln!("=== {} ({:?}), stdout:\n{out}--- stderr:\n{err}===", self.name, self.status);
        }
    }
}

/// A folder for one test, and the processes that work in it.
#[derive(Debug)]
pub struct Ground {
    folder: TempDir,
    started: AtomicU16,
}

impl Default for Ground {
    fn default() -> Self {
        Ground::new()
    }
}

impl Ground {
    /// An empty folder.
    ///
    /// # Panics
    /// If there can be none.
    pub fn new() -> Ground {
        Ground { folder: tempfile::tempdir().expect("a temporary folder"), started: AtomicU16::new(0) }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file into the folder.
    ///
    /// # Panics
    /// If that fails.
    pub fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("the folder takes files");
        path
    }

    /// Starts any command in the folder.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(&self, name: &str, command: &mut Command) -> Process {
        let number = self.started.fetch_add(1, Ordering::Relaxed);
        let (stdout, stderr) = (self.path(&format!("{number}-{name}.out")), self.path(&format!("{number}-{name}.err")));
        let create = |path: &Path| File::create(path).expect("the folder takes files");
        let child = command
            .current_dir(self.folder.path())
            .env_remove("RUST_LOG")
            .env("RUST_BACKTRACE", "0")
            .stdin(Stdio::null())
            .stdout(create(&stdout))
            .stderr(create(&stderr))
            .spawn()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        Process { name: name.to_string(), child, status: None, stdout, stderr }
    }

    /// Starts the emulator and waits until it listens; port 0 takes a free one.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn emulator(&self, listen: &str) -> (Process, String) {
        let mut command = Command::new(program("network-emulator"));
        let mut process = self.start("network-emulator", command.args(["--listen", listen, "--logs", "logs"]));
        let endpoint = found(PATIENCE, "the emulator says where it listens", || {
            assert!(process.is_running(), "the emulator ended");
            process.stdout().split_once('\n').map(|(line, _)| line.to_string())
        });
        (process, endpoint)
    }

    /// Starts a vehicle.
    pub fn vehicle(&self, id: &str, endpoint: &str) -> Process {
        let mut command = Command::new(program("vehicle-node"));
        self.start(id, command.args(["--id", id, "--connect", endpoint, "--logs", "logs"]))
    }

    /// Starts mission-control.
    pub fn control(&self, arguments: &[&str]) -> Process {
        let mut command = Command::new(program("mission-control"));
        self.start("mission-control", command.args(arguments))
    }

    /// Runs mission-control to its end, which must come with this exit code; gives its stdout.
    pub fn controlled(&self, code: i32, arguments: &[&str]) -> String {
        let mut process = self.control(arguments);
        process.ends_with(code);
        process.stdout()
    }

    /// Reads the recording of a run folder.
    ///
    /// # Panics
    /// If there is none.
    pub fn recording(&self, run: &str) -> Recording {
        bus::recording::read(self.path(run).join("recording.mcap")).expect("a recording")
    }

    /// A JSON file in the folder.
    ///
    /// # Panics
    /// If it is none.
    pub fn json(&self, name: &str) -> Value {
        let text = fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// What `mission-control status --json` says of the fleet; `None` if it could not be asked.
    ///
    /// # Panics
    /// If what it says is no JSON.
    pub fn status(&self, endpoint: &str) -> Option<Value> {
        let mut process = self.control(&["status", "--json", "--attach", endpoint]);
        let status = process.ends(PATIENCE);
        let text = process.stdout();
        status.success().then(|| serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}")))
    }

    /// Waits until the fleet's status is such.
    pub fn status_until(&self, endpoint: &str, what: &str, is_such: impl Fn(&Value) -> bool) -> Value {
        found(PATIENCE, what, || self.status(endpoint).filter(&is_such))
    }
}

/// What the status says of one vehicle.
///
/// # Panics
/// If it says nothing.
pub fn of_vehicle<'s>(status: &'s Value, id: &str) -> &'s Value {
    let vehicles = status["vehicles"].as_array().expect("vehicles");
    vehicles.iter().find(|vehicle| vehicle["id"] == id).unwrap_or_else(|| panic!("{id} in {status}"))
}

/// An endpoint for an emulator that has to come back to it. Its port is below those that the system hands out by itself,
/// so nobody takes it meanwhile by accident.
///
/// # Panics
/// If there is none.
pub fn lasting_endpoint() -> String {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = std::process::id().wrapping_mul(17) ^ SystemTime::UNIX_EPOCH.elapsed().map_or(0, |t| t.subsec_micros());
    for _ in 0..1000 {
        let step = u32::from(NEXT.fetch_add(1, Ordering::Relaxed));
        let port = 20_000 + (first.wrapping_add(step) % 12_000) as u16;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return format!("tcp/127.0.0.1:{port}");
        }
    }
    panic!("a thousand ports are taken");
}

// --- recordings --------------------------------------------------------------------------------------------------------

/// The states of one vehicle, in order of time.
pub fn states<'r>(exact: &'r [Record], id: &str) -> Vec<&'r StateRow> {
    let mut rows: Vec<&StateRow> = exact
        .iter()
        .filter_map(|record| match record {
            Record::State(row) if *row.vehicle == *id => Some(row),
            _ => None,
        })
        .collect();
    rows.sort_by_key(|row| row.t_ns);
    rows
}

/// The state of a vehicle at an instant, or the last one before it.
///
/// # Panics
/// If there is none.
pub fn state_at<'r>(exact: &'r [Record], id: &str, t_s: f64) -> &'r StateRow {
    let rows = states(exact, id);
    let after = rows.partition_point(|row| row.t_ns as f64 / 1e9 <= t_s + 1e-9);
    rows.get(after.wrapping_sub(1)).unwrap_or_else(|| panic!("no state of {id} before {t_s} s"))
}

/// The coordination state of a vehicle at an instant, on the straight line between the rows around it: in real time a
/// busy machine may cost a row.
///
/// # Panics
/// If there are no rows on both sides of it.
pub fn xi_at(exact: &[Record], id: &str, t_s: f64) -> f64 {
    let rows: Vec<(f64, f64)> = states(exact, id).iter().map(|row| (row.t_ns as f64 / 1e9, row.xi)).collect();
    let after = rows.partition_point(|(t, _)| *t < t_s);
    let &(t_1, xi_1) = rows.get(after).unwrap_or_else(|| panic!("no state of {id} at {t_s} s or later"));
    let (t_0, xi_0) = if after > 0 { rows[after - 1] } else { (t_1, xi_1) };
    if t_1 > t_0 { xi_0 + (xi_1 - xi_0) * (t_s - t_0) / (t_1 - t_0) } else { xi_1 }
}

/// ξ of one vehicle minus ξ of another at the last instant that both recordings reach.
///
/// # Panics
/// If one of them recorded nothing.
pub fn apart_at_last(exact: &[Record], one: &str, other: &str) -> f64 {
    let last = |id| states(exact, id).last().unwrap_or_else(|| panic!("no state of {id}")).t_ns;
    let t_s = last(one).min(last(other)) as f64 / 1e9;
    xi_at(exact, one, t_s) - xi_at(exact, other, t_s)
}

/// Asserts that two files hold the same bytes, without printing them.
///
/// # Panics
/// If they do not.
pub fn assert_same_file(a: &Path, b: &Path) {
    let read = |path: &Path| fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (left, right) = (read(a), read(b));
    let part = left.iter().zip(&right).position(|(a, b)| a != b);
    let sizes = (left.len(), right.len());
    assert!(left == right, "{} and {} part at byte {part:?}, sizes {sizes:?}", a.display(), b.display());
}

/// Asserts that a value lies within a part of what was expected.
///
/// # Panics
/// If it does not.
pub fn assert_close(what: impl Debug, found: f64, expected: f64, part: f64) {
    let off = (found - expected).abs();
    assert!(off <= part * expected.abs(), "{what:?}: found {found}, expected {expected} within {part} of it");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_older_than_its_source_is_refused() {
        let ground = Ground::new();
        let program = ground.file("vehicle-node", "");
        assert_eq!(stale(&program), None, "made just now");
        let file = File::options().write(true).open(&program).expect("there");
        file.set_modified(SystemTime::UNIX_EPOCH).expect("the time can be set");
        assert!(stale(&program).is_some_and(|fault| fault.contains("older than")));
        assert!(stale(Path::new("/nowhere")).is_some_and(|fault| fault.contains("there is no")));
    }

    #[test]
    fn lasting_endpoints_differ() {
        assert_ne!(lasting_endpoint(), lasting_endpoint());
    }
}
