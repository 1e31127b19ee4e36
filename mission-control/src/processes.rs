//! The processes of an own fleet: this very program under other names, one for the network and one per vehicle.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader};
use std::net::TcpListener;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bus::setup::Endpoint;
use common::mission::Mission;
use network_emulator::hub::HUB;
use rustix::process::{Pid, Signal, kill_process};

use crate::run::Failure;

/// How long own processes may take to end after they were dismissed.
const FAREWELL: Duration = Duration::from_secs(3);

/// The processes of an own fleet, by name.
#[derive(Default)]
pub(crate) struct Processes {
    running: BTreeMap<String, Child>,
    ended: Vec<String>,
    /// Whether one of them ended because it could keep no logs.
    logless: bool,
}

/// With this exit code a process says that it can keep no logs.
const LOGLESS: i32 = 4;

impl Processes {
    /// Starts the emulator, then a process per vehicle. All are this very program under other names.
    pub(crate) fn start(
        mission: &Mission,
        folder: &Path,
        listen: Option<Endpoint>,
    ) -> Result<(Endpoint, Processes), Failure> {
        let logs = folder.join("logs");
        fs::create_dir_all(&logs)
            .map_err(|error| Failure::Files(format!("cannot make {}: {error}", logs.display())))?;
        let mut processes = Processes::default();
        let listen = listen.unwrap_or_else(|| {
            let usual = Endpoint::local();
            let free = TcpListener::bind((usual.host(), usual.port())).is_ok();
            if free { usual } else { usual.with_port(0) }
        });
        let mut emulator = processes.spawn(&logs, HUB, &["--listen", &listen.to_string()])?;
        // Its first line is where it listens.
        let mut endpoint = String::new();
        if let Some(stdout) = emulator.stdout.take() {
            let _ = BufReader::new(stdout).read_line(&mut endpoint);
        }
        processes.running.insert(HUB.into(), emulator);
        let endpoint: Endpoint = endpoint.trim().parse().map_err(|_| {
            let _ = processes.end();
            processes.failure(format!("the network-emulator did not come up: {}", last_words(&logs)))
        })?;
        bus::remark!("network-emulator listens on {endpoint}; another terminal can use --attach {endpoint}");
        for vehicle in &mission.vehicles {
            let child = processes.spawn(&logs, &vehicle.id, &["--id", &vehicle.id, "--connect", &endpoint.to_string()]);
            match child {
                Ok(child) => processes.running.insert(vehicle.id.clone(), child),
                Err(failure) => {
                    let _ = processes.end();
                    return Err(failure);
                }
            };
        }
        Ok((endpoint, processes))
    }

    fn spawn(&self, logs: &Path, name: &str, arguments: &[&str]) -> Result<Child, Failure> {
        let failed = |error: io::Error| Failure::Unreachable(format!("cannot start {name}: {error}"));
        let log = logs.join(format!("{name}.log"));
        let said =
            File::create(&log).map_err(|error| Failure::Files(format!("cannot write {}: {error}", log.display())))?;
        let program = if name == HUB { HUB } else { "vehicle-node" };
        Command::new(std::env::current_exe().map_err(failed)?)
            .arg(program)
            .args(arguments)
            .args(["--once", "--end-with-stdin"])
            .args([OsStr::new("--logs"), logs.as_os_str()])
            // A group of its own: what the terminal signals reaches mission-control, which ends the flight in order.
            .process_group(0)
            // Never written to: it is closed when this process is gone, however it went.
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(said)
            .spawn()
            .map_err(failed)
    }

    /// A single process under this name.
    #[cfg(test)]
    pub(crate) fn of(name: &str, child: Child) -> Processes {
        let mut one = Processes::default();
        one.running.insert(name.to_string(), child);
        one
    }

    /// Whether this process is there; one that has ended is not started again.
    pub(crate) fn is_running(&self, name: &str) -> bool {
        self.running.contains_key(name)
    }

    /// Whether the one that the flight depends on is there.
    pub(crate) fn has_hub(&self) -> bool {
        self.is_running(HUB)
    }

    /// Those that have ended so far, in words.
    pub(crate) fn ended(&self) -> &[String] {
        &self.ended
    }

    /// Why there is no flight: own processes could not be started, or can keep no logs.
    pub(crate) fn failure(&self, why: String) -> Failure {
        match self.logless {
            true => Failure::Files(format!("{why} (exit status {LOGLESS}: no logs can be kept; is the disk full?)")),
            false => Failure::Unreachable(why),
        }
    }

    /// Processes that have ended since the last look, in words.
    pub(crate) fn look(&mut self) -> Vec<String> {
        let mut news = Vec::new();
        self.running.retain(|name, child| match child.try_wait() {
            Ok(Some(status)) => {
                self.logless |= status.code() == Some(LOGLESS);
                news.push(format!("{name} has ended ({status})"));
                false
            }
            _ => true,
        });
        self.ended.extend(news.iter().cloned());
        news
    }

    /// Asks all to end now: each closes its log first.
    pub(crate) fn terminate(&self) {
        for child in self.running.values() {
            if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
                let _ = kill_process(pid, Signal::TERM);
            }
        }
    }

    /// Waits for all to end, makes those that do not, and tells of those that ended early.
    pub(crate) fn end(&mut self) -> Vec<String> {
        let early = std::mem::take(&mut self.ended);
        let deadline = Instant::now() + FAREWELL;
        while !self.running.is_empty() && Instant::now() < deadline {
            self.look();
            std::thread::sleep(Duration::from_millis(5));
        }
        self.kill();
        early
    }

    fn kill(&mut self) {
        for child in self.running.values_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.running.clear();
    }
}

/// Why an emulator ended that did not come up, as it told in its log, which goes: a folder with nothing else in it need not stay.
fn last_words(logs: &Path) -> String {
    let log = logs.join(format!("{HUB}.log"));
    let said = fs::read_to_string(&log).unwrap_or_default();
    let _ = fs::remove_file(&log);
    let last = said.lines().last().unwrap_or("it said nothing");
    // Without instant and level.
    last.split_once("ERROR ").map_or(last, |(_, why)| why).to_string()
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.kill();
    }
}
