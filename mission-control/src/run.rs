//! `run`: conducts a flight of real processes, its own or a fleet that is already up.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::net::TcpListener;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::console::StopFlag;
use bus::drive::{Clock, Next, Port, Program, Shared, drive};
use bus::line::{Line, LineConfig, LineEvent};
use bus::recording::{Merged, merge};
use bus::setup::Endpoint;
use bus::{Plane, Refusal};
use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::fleet::{FleetStatus, FromFleet, Pace, ToFleet};
use common::wire::vehicle::{LogPiece, Phase};
use common::wire::{self, GarbageCount};
use network_emulator::hub::{COLLECTOR, HUB};
use rustix::process::{Pid, Signal, kill_process};

use crate::conduct::{Conduct, ConductInput, ConductOutput, Landing, NO_LOG, Step};
use crate::console::Progress;
use crate::folder::{self, HostFacts, RECORDING};
use crate::results::{ClockSummary, Summary};

/// How long own processes may take to come up.
const OWN_PATIENCE: Duration = Duration::from_secs(60);
/// How long own processes may take to end after they were dismissed.
const FAREWELL: Duration = Duration::from_secs(3);

/// How a flight shall be flown.
pub struct Plan {
    /// The mission.
    pub mission: Arc<Mission>,
    /// Its run folder, if not `runs/<mission>-<time>`.
    pub out: Option<PathBuf>,
    /// A fleet that is already up; without it, own processes are started.
    pub attach: Option<Endpoint>,
    /// Where an own emulator listens; without it, the usual place or a free port.
    pub listen: Option<Endpoint>,
    /// How mission time passes.
    pub pace: Pace,
    /// How long to wait until every vehicle of a fleet that is already up is armed.
    pub patience: Option<Duration>,
}

/// What became of a flight.
pub struct Flown {
    /// Its run folder.
    pub folder: PathBuf,
    /// Finished, or Aborted.
    pub phase: Phase,
    /// Whether every vehicle flew to the end, and there are states of it up to there.
    pub sound: bool,
    /// Its numbers; what is missing is among its warnings.
    pub summary: Summary,
    /// What depends on the machine.
    pub clock: ClockSummary,
}

/// Why a flight came to nothing.
#[derive(Debug)]
pub enum Failure {
    /// The fleet could not be reached, or its processes not started.
    Unreachable(String),
    /// The fleet refused, or the flight was interrupted before it began.
    Refused(String),
    /// Files could not be written.
    Files(String),
    /// The person at the terminal left a fleet that flies on.
    Detached(String),
}

/// Flies a mission and reports on it.
///
/// # Errors
/// Why there is no flight to report on.
pub fn fly(plan: &Plan) -> Result<Flown, Failure> {
    let is_new = folder::is_new(plan.out.as_deref());
    let discard = |folder: &Path| {
        if is_new {
            folder::discard(folder)
        }
    };
    let make_folder = || folder::make(plan.out.as_deref(), &plan.mission).map_err(Failure::Files);
    let begun = Instant::now();
    let own = plan.attach.is_none();
    let stop = StopFlag::on_signals();
    if own {
        stop.arm();
    }
    let (endpoint, mut processes, folder) = match &plan.attach {
        Some(endpoint) => (endpoint.clone(), Processes::default(), None),
        None => {
            let folder = make_folder()?;
            let started = Processes::start(&plan.mission, &folder, plan.listen.clone());
            let (endpoint, processes) = started.inspect_err(|_| discard(&folder))?;
            (endpoint, processes, Some(folder))
        }
    };
    let mut config = LineConfig::new(endpoint.clone(), COLLECTOR);
    config.patience = if own { Some(OWN_PATIENCE) } else { plan.patience };
    let (line, events) = Line::connect(config).map_err(|error| match error {
        bus::Error::Refused(refusal @ Refusal::Taken { .. }) => Failure::Unreachable(format!(
            "{refusal} to this fleet: another run conducts it. Wait until that is over, or end it with: mission-control stop"
        )),
        error => Failure::Unreachable(error.to_string()),
    })?;
    // Of an own fleet it is armed already, and may have been raised meanwhile.
    if !own {
        stop.arm();
    }
    // A fleet that cannot be reached leaves no folder behind.
    let folder = folder.map_or_else(make_folder, Ok)?;
    let patience = if own { Some(OWN_PATIENCE) } else { plan.patience };
    let patience = patience.map(|p| Span::from_secs(p.as_secs_f64()));
    let conduct = Conduct::new(plan.mission.clone(), plan.pace, patience, !own);
    let port = ConductPort {
        line,
        own,
        mission: plan.mission.clone(),
        processes: &mut processes,
        progress: Progress::new(plan.mission.end),
        collected: folder.join(".collected"),
        stop,
        interrupted: false,
        pace: plan.pace,
        joined: false,
        garbage: GarbageCount::default(),
    };
    let program = Shared::new(Program::new(conduct, port, Clock::from_now()));
    let exit = drive(&program, &events);
    let port = program.into_port();
    port.progress.done();
    let ConductPort { line, collected, .. } = port;
    // Own processes close their logs and end; the logs of others are theirs to keep until they are merged here.
    let line = if own {
        let _ = line.send(Plane::Mission, &wire::encode(&ToFleet::Dismiss));
        line.close();
        None
    } else {
        Some(line)
    };
    let Landing { phase, pace, missing, aborted } = match exit {
        Ok(landing) => landing,
        Err(failure) => {
            processes.terminate();
            processes.end();
            discard(&folder);
            return Err(failure);
        }
    };
    if phase != Phase::Finished {
        processes.terminate();
    }
    let nobody_has_one = missing.iter().all(|(_, why)| why == NO_LOG);
    let mut missing: Vec<String> = missing.into_iter().map(|(who, why)| format!("log of {who}: {why}")).collect();
    missing.extend(processes.end());

    let logs = if own { folder::logs(&folder, plan.mission.digest) } else { folder::recordings_in(&collected) };
    if logs.is_empty() {
        let why = format!("nothing was recorded: {}", missing.join(", "));
        if let Some(line) = line {
            if nobody_has_one {
                // Nor will there ever be: the next run of the mission must not look for it again.
                let _ = line.send(Plane::Mission, &wire::encode(&ToFleet::Dismiss));
            }
            line.close();
            discard(&folder);
            return Err(Failure::Files(why));
        }
        return Err(Failure::Files(format!("{why}; see logs/ in {}", folder.display())));
    }
    let merged = merge(&logs, folder.join(RECORDING)).map_err(|error| Failure::Files(error.to_string()))?;
    missing.extend(folder::shortcomings(&merged));
    // A flight that was joined or only collected may have been started by someone else.
    let pace = pace.unwrap_or(plan.pace);
    missing.extend(late_beginnings(&plan.mission, pace, &merged));
    let cut_short = cut_short(&plan.mission, phase, &merged);
    let sound = phase == Phase::Finished && aborted.is_empty() && cut_short.is_empty();
    missing.extend(cut_short.into_iter().filter(|(id, _)| !gave_up(&aborted, id)).map(|(_, text)| text));
    if let Some(line) = line {
        // What is on disk here need not be kept there.
        let _ = line.send(Plane::Mission, &wire::encode(&ToFleet::Dismiss));
        line.close();
        let _ = fs::remove_dir_all(&collected);
    }
    let how = format!("mission-control run{}{}", if own { "" } else { " --attach" }, option(pace));
    let speed_up = match pace {
        Pace::Real { speed_up } => Some(speed_up),
        Pace::Stepped => None,
    };
    let host = HostFacts::now(&how, speed_up, begun.elapsed().as_secs_f64(), missing, aborted);
    let (summary, clock) = folder::finish(&folder, &host).map_err(Failure::Files)?;
    Ok(Flown { folder, phase, sound, summary, clock })
}

/// The option with which `run` flies at this pace.
fn option(pace: Pace) -> String {
    match pace {
        Pace::Stepped => " --stepped".to_string(),
        Pace::Real { speed_up: 1.0 } => String::new(),
        Pace::Real { speed_up } => format!(" --speed-up {speed_up}"),
    }
}

/// Vehicles without states up to the end of the flight, in words: they were lost, or what they recorded was.
fn cut_short(mission: &Mission, phase: Phase, merged: &Merged) -> Vec<(String, String)> {
    let grace = mission.control_period * mission.record_ticks;
    let of = |id: &str| match merged.spans.get(id) {
        None => Some(format!("there are no states of {id}")),
        Some((_, end)) if phase == Phase::Finished && Time::from_nanos(*end) + grace < mission.end => {
            Some(format!("the states of {id} end at {}, before the flight did", Time::from_nanos(*end)))
        }
        Some(_) => None,
    };
    mission.vehicles.iter().filter_map(|vehicle| Some((vehicle.id.clone(), of(&vehicle.id)?))).collect()
}

/// Whether a vehicle is among those that gave up: its states end early, and that is told already.
fn gave_up(aborted: &[String], id: &str) -> bool {
    aborted.iter().any(|text| text.split(' ').next() == Some(id))
}

/// How late a vehicle may begin that did not begin in mid-flight \[s of wall clock\].
const LATE_START_S: f64 = 0.5;

/// Vehicles whose states begin in mid-flight, in words: an earlier life of theirs recorded elsewhere.
fn late_beginnings(mission: &Mission, pace: Pace, merged: &Merged) -> Vec<String> {
    // A busy machine misses the first control periods of a flight.
    let grace = match pace {
        Pace::Real { speed_up } => {
            mission.control_period * mission.record_ticks + Span::from_secs(LATE_START_S * speed_up)
        }
        Pace::Stepped => Span::ZERO,
    };
    let begin = |id: &str| merged.spans.get(id).map(|(begin, _)| *begin);
    let late = |id: &str| begin(id).filter(|begin| *begin > grace.nanos());
    let late = mission.vehicles.iter().filter_map(|vehicle| Some((&vehicle.id, late(&vehicle.id)?)));
    late.map(|(id, begin)| {
        let begin = Time::from_nanos(begin);
        format!(
            "the log of {id} begins at {begin}: it has none of what {id} recorded before, in another folder perhaps"
        )
    })
    .collect()
}

/// Who is not armed yet, and why, in words.
fn not_armed(mission: &Mission, status: &FleetStatus) -> String {
    let of_mission = status.vehicles.iter().filter(|v| mission.index_of(&v.id).is_some());
    let waiting: Vec<String> = of_mission
        .filter(|v| !(v.connected && v.phase == Phase::Armed))
        .map(|v| {
            let why = match (v.connected, v.phase, v.reason.is_empty()) {
                (false, ..) => "not connected",
                (true, Phase::Running, _) => "still in another flight",
                (true, _, false) => v.reason.as_str(),
                (true, ..) => "has not answered yet",
            };
            format!("{} ({why})", v.id)
        })
        .collect();
    if waiting.is_empty() { String::new() } else { format!("waiting for {}", waiting.join(", ")) }
}

// --- the processes of an own fleet -------------------------------------------------------------------------------------

/// The processes of an own fleet, by name.
#[derive(Default)]
struct Processes {
    running: BTreeMap<String, Child>,
    ended: Vec<String>,
}

impl Processes {
    /// Starts the emulator, then a process per vehicle. All are this very program under other names.
    fn start(mission: &Mission, folder: &Path, listen: Option<Endpoint>) -> Result<(Endpoint, Processes), Failure> {
        let logs = folder.join("logs");
        fs::create_dir_all(&logs)
            .map_err(|error| Failure::Files(format!("cannot make {}: {error}", logs.display())))?;
        let mut processes = Processes::default();
        let listen = listen.unwrap_or_else(|| {
            let usual = Endpoint::local();
            let free = TcpListener::bind((usual.host(), usual.port())).is_ok();
            if free { usual } else { usual.with_port(0) }
        });
        let mut emulator = processes.spawn(&logs, "network-emulator", &["--listen", &listen.to_string()])?;
        let mut endpoint = String::new();
        let stdout = emulator.stdout.take();
        if let Some(stdout) = stdout {
            let _ = BufReader::new(stdout).read_line(&mut endpoint);
        }
        processes.running.insert("network-emulator".into(), emulator);
        let endpoint: Endpoint = endpoint.trim().parse().map_err(|_| {
            let _ = processes.end();
            let log = logs.join("network-emulator.log");
            let said = fs::read_to_string(&log).unwrap_or_default();
            let last = said.lines().last().unwrap_or("it said nothing");
            // Without instant and level: of the line in its log.
            let why = last.split_once("ERROR ").map_or(last, |(_, why)| why).to_string();
            // What it said is told; a folder with nothing else in it need not stay.
            let _ = fs::remove_file(&log);
            Failure::Unreachable(format!("the network-emulator did not come up: {why}"))
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
        let failed = |error: std::io::Error| Failure::Unreachable(format!("cannot start {name}: {error}"));
        let said = File::create(logs.join(format!("{name}.log"))).map_err(failed)?;
        let program = if name == "network-emulator" { "network-emulator" } else { "vehicle-node" };
        Command::new(std::env::current_exe().map_err(failed)?)
            .arg(program)
            .args(arguments)
            .args(["--once", "--end-with-stdin"])
            .args([std::ffi::OsStr::new("--logs"), logs.as_os_str()])
            // A group of its own: what the terminal signals reaches mission-control, which ends the flight in order.
            .process_group(0)
            // Never written to: it is closed when this process is gone, however it went.
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(said)
            .spawn()
            .map_err(failed)
    }

    /// Processes that have ended since the last look, in words.
    fn look(&mut self) -> Vec<String> {
        let mut news = Vec::new();
        self.running.retain(|name, child| match child.try_wait() {
            Ok(Some(status)) => {
                news.push(format!("{name} has ended ({status})"));
                false
            }
            _ => true,
        });
        self.ended.extend(news.iter().cloned());
        news
    }

    /// Asks all to end now: each closes its log first.
    fn terminate(&self) {
        for child in self.running.values() {
            if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
                let _ = kill_process(pid, Signal::TERM);
            }
        }
    }

    /// Waits for all to end, makes those that do not, and tells of those that ended early.
    fn end(&mut self) -> Vec<String> {
        let early = std::mem::take(&mut self.ended);
        let deadline = Instant::now() + FAREWELL;
        while !self.running.is_empty() && Instant::now() < deadline {
            self.look();
            std::thread::sleep(Duration::from_millis(5));
        }
        for child in self.running.values_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.running.clear();
        early
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for child in self.running.values_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

// --- the port ----------------------------------------------------------------------------------------------------------

struct ConductPort<'p> {
    line: Line,
    own: bool,
    mission: Arc<Mission>,
    processes: &'p mut Processes,
    progress: Progress,
    collected: PathBuf,
    stop: StopFlag,
    interrupted: bool,
    pace: Pace,
    /// Whether it was told that the flight was under way already.
    joined: bool,
    garbage: GarbageCount,
}

type Ending = Result<Landing, Failure>;

impl ConductPort<'_> {
    fn tell(&mut self, step: Step, status: Option<&FleetStatus>) {
        let name = match step {
            Step::Contact => "contact",
            Step::Arming => "arming",
            Step::Starting => "starting",
            Step::Flying => "flying",
            Step::Collecting | Step::Ended => "collecting",
        };
        let Some(status) = status else {
            return self.progress.line("lost the network-emulator; looking for it");
        };
        let [sent, delivered, dropped, _] = status.messages;
        let message = match step {
            Step::Contact | Step::Starting => String::new(),
            Step::Arming => not_armed(&self.mission, status),
            _ => format!("messages {sent} sent, {delivered} delivered, {dropped} dropped{}", self.away(status)),
        };
        if step == Step::Contact && status.phase == Phase::Running && status.mission == self.mission.text {
            self.join();
        }
        // The time of a mission that the fleet flew before is none of this one's.
        let now = if status.mission == self.mission.text { status.now } else { Time::ZERO };
        self.progress.reached(name, now, &message);
    }

    /// Who is not there, in words. Of own processes, none that has ended is started again.
    fn away(&self, status: &FleetStatus) -> String {
        let away = status.vehicles.iter().filter(|v| !v.connected).map(|v| v.id.as_str());
        let (lost, awaited): (Vec<&str>, Vec<&str>) =
            away.partition(|id| self.own && !self.processes.running.contains_key(*id));
        let lost = lost.iter().map(|id| format!("; {id} is lost")).collect::<String>();
        let awaited =
            if awaited.is_empty() { awaited.concat() } else { format!("; waiting for {}", awaited.join(", ")) };
        lost + &awaited
    }

    /// A flight under way has its clock already, and whoever attaches cannot give it another.
    fn join(&mut self) {
        let wanted = match self.pace {
            Pace::Stepped => "--stepped".to_string(),
            Pace::Real { speed_up } => format!("--speed-up {speed_up}"),
        };
        let text = format!(
            "the flight was under way already: it goes on at the speed it was started with, and {wanted} changes nothing"
        );
        if !std::mem::replace(&mut self.joined, true) {
            self.progress.line(&text);
        }
    }

    fn keep(&self, who: &str, piece: &LogPiece) -> Result<(), String> {
        let path = self.collected.join(format!("{who}-{}.mcap", piece.file + 1));
        let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        fs::create_dir_all(&self.collected).map_err(failed)?;
        let mut file =
            OpenOptions::new().create(true).write(true).truncate(piece.offset == 0).open(&path).map_err(failed)?;
        file.seek(SeekFrom::Start(piece.offset)).map_err(failed)?;
        file.write_all(&piece.bytes).map_err(failed)
    }
}

impl Port for ConductPort<'_> {
    type Machine = Conduct;
    type Event = LineEvent;
    type Exit = Ending;

    fn translate(&mut self, event: LineEvent) -> Option<(Option<Instant>, ConductInput)> {
        match event {
            LineEvent::Connected => Some((None, ConductInput::Connected)),
            LineEvent::Lost => Some((None, ConductInput::Lost)),
            LineEvent::Refused(refusal) => {
                self.progress.line(&refusal.to_string());
                None
            }
            LineEvent::Packet { plane: Plane::Mission, bytes, .. } => match wire::decode::<FromFleet>(&bytes) {
                Ok(message) => Some((None, ConductInput::FromFleet(message))),
                Err(kind) => {
                    if self.garbage.count(kind) {
                        self.progress.line(&format!("ignored a message of the fleet: {}", kind.as_str()));
                    }
                    None
                }
            },
            LineEvent::Packet { .. } => None,
        }
    }

    fn perform(&mut self, output: ConductOutput, _clock: &mut Clock) -> Next<Self> {
        match output {
            ConductOutput::Send(message) => {
                // What is not sent is sent again when an answer shows that it was not heard.
                let _ = self.line.send(Plane::Mission, &wire::encode(&message));
            }
            ConductOutput::Progress(step, status) => self.tell(step, status.as_ref()),
            ConductOutput::Remark(text) => self.progress.line(&text),
            ConductOutput::Over { .. } => {}
            ConductOutput::Log { who, piece } => {
                if let Err(error) = self.keep(&who, &piece) {
                    return Next::Exit(Err(Failure::Files(error)));
                }
            }
            ConductOutput::Done(landing) => return Next::Exit(Ok(landing)),
            ConductOutput::Failed(reason) => return Next::Exit(Err(Failure::Refused(reason))),
        }
        Next::Go
    }

    fn tend(&mut self, conduct: &Conduct) -> Next<Self> {
        for news in self.processes.look() {
            self.progress.line(&news);
        }
        if self.stop.is_raised() && !self.interrupted {
            self.interrupted = true;
            let has_begun = !matches!(conduct.step(), Step::Contact | Step::Arming);
            if !self.own && has_begun {
                let reason = "left; the fleet flies on. Attach again with the same command, or end it with: mission-control stop";
                return Next::Exit(Err(Failure::Detached(reason.to_string())));
            }
            self.stop.arm();
            self.progress.line("stopping the flight; once more ends at once");
            return Next::Feed(ConductInput::Interrupt);
        }
        if self.own && matches!(conduct.step(), Step::Contact | Step::Arming) && !self.processes.ended.is_empty() {
            let ended = self.processes.ended.join(", ");
            return Next::Exit(Err(Failure::Unreachable(format!("{ended} before the flight; see its log in logs/"))));
        }
        if self.own && !self.processes.running.contains_key(HUB) {
            // Nobody will start it again; what was recorded is worth a report.
            self.progress.line("the network-emulator has ended, and the flight with it");
            return Next::Exit(Ok(Landing {
                phase: Phase::Aborted,
                pace: None,
                missing: Vec::new(),
                aborted: Vec::new(),
            }));
        }
        Next::Go
    }

    fn closed(&mut self) -> Ending {
        Err(Failure::Unreachable("the line to the fleet is closed".to_string()))
    }
}
