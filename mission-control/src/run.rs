//! `run`: conducts a flight of real processes, its own or a fleet that is already up.

use std::fs::{self, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::console::StopFlag;
use bus::drive::{Clock, Next, Port, Program, Shared, drive};
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::Events;
use bus::recording::merge;
use bus::setup::Endpoint;
use bus::{Plane, Refusal};
use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::fleet::{FleetStatus, FromFleet, Pace, ToFleet};
use common::wire::vehicle::{LogPiece, Phase};
use common::wire::{self, GarbageCount};
use network_emulator::hub::COLLECTOR;

use crate::brought::of_one_flight;
use crate::conduct::{Conduct, ConductInput, ConductOutput, INTERRUPTED, Landing, Step};
use crate::console::Progress;
use crate::folder::{self, HostFacts, RECORDING};
use crate::missing;
use crate::processes::Processes;
use crate::results::{ClockSummary, Summary};

/// How long own processes may take to come up.
const OWN_PATIENCE: Duration = Duration::from_secs(60);

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
    /// Whether that was asked for.
    pub pace_asked: bool,
    /// How long to wait until every vehicle of a fleet that is already up is armed.
    pub patience: Option<Duration>,
}

impl Plan {
    /// Whether the fleet is started for this flight, and ends with it.
    fn is_own(&self) -> bool {
        self.attach.is_none()
    }

    /// How long to wait until every vehicle is armed.
    fn patience(&self) -> Option<Duration> {
        if self.is_own() { Some(OWN_PATIENCE) } else { self.patience }
    }
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
    let begun = Instant::now();
    let is_new = folder::is_new(plan.out.as_deref());
    let discard = |folder: &Path| {
        if is_new {
            folder::discard(folder)
        }
    };
    let make_folder = || folder::make(plan.out.as_deref(), &plan.mission).map_err(Failure::Files);
    let stop = StopFlag::on_signals();
    if plan.is_own() {
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
    let mut in_vain = || if plan.is_own() { in_vain(&mut processes, stop.is_raised()) } else { None };
    let connected = connect(endpoint, plan.patience(), &mut in_vain);
    let (line, events) = connected.map_err(|failure| {
        processes.terminate();
        processes.end();
        folder.iter().for_each(|folder| discard(folder));
        match failure {
            _ if plan.is_own() && stop.is_raised() => Failure::Refused(INTERRUPTED.to_string()),
            Failure::Unreachable(why) => processes.failure(why),
            failure => failure,
        }
    })?;
    // Of an own fleet it is armed already, and may have been raised meanwhile.
    if !plan.is_own() {
        stop.arm();
    }
    // A fleet that cannot be reached leaves no folder behind.
    let folder = folder.map_or_else(make_folder, Ok)?;
    let collected = folder.join(".collected");
    let (ending, line) = conduct(plan, line, &events, &mut processes, &collected, stop);
    // Own processes close their logs and end; the logs of others are theirs to keep until they are merged here.
    let line = if plan.is_own() {
        dismiss(line);
        None
    } else {
        Some(line)
    };
    let landing = match ending {
        Ok(landing) => landing,
        Err(failure) => {
            processes.terminate();
            processes.end();
            discard(&folder);
            return Err(failure);
        }
    };
    if landing.phase != Phase::Finished {
        processes.terminate();
    }
    let ended_early = processes.end();

    let logs =
        if plan.is_own() { folder::logs(&folder, plan.mission.digest) } else { folder::recordings_in(&collected) };
    if logs.is_empty() {
        let failure = nothing_recorded(&folder, line, &landing, ended_early);
        if !plan.is_own() {
            discard(&folder);
        }
        return Err(failure);
    }
    let flight = merge_logs(plan, &folder, &logs, &landing, ended_early)?;
    if let Some(line) = line {
        // What is on disk here need not be kept there.
        dismiss(line);
        let _ = fs::remove_dir_all(&collected);
    }
    let sound = flight.sound;
    let host = flight.host(plan.is_own(), begun.elapsed(), landing.aborted);
    let (summary, clock) = folder::finish(&folder, &host).map_err(Failure::Files)?;
    Ok(Flown { folder, phase: landing.phase, sound, summary, clock })
}

/// The line to a fleet.
fn connect(
    endpoint: Endpoint,
    patience: Option<Duration>,
    in_vain: &mut dyn FnMut() -> Option<String>,
) -> Result<(Line, Events<LineEvent>), Failure> {
    let mut config = LineConfig::new(endpoint, COLLECTOR);
    config.patience = patience;
    Line::connect_unless(config, in_vain).map_err(|error| match error {
        bus::Error::Refused(refusal @ Refusal::Taken { .. }) => Failure::Unreachable(format!(
            "{refusal} to this fleet: another run conducts it. Wait until that is over, or end it with: mission-control stop"
        )),
        error => Failure::Unreachable(error.to_string()),
    })
}

/// Why an own fleet that does not answer yet never will, or need not.
fn in_vain(processes: &mut Processes, interrupted: bool) -> Option<String> {
    processes.look();
    if interrupted {
        return Some(INTERRUPTED.to_string());
    }
    (!processes.has_hub()).then(|| ended_early(processes))
}

/// What is told of own processes that ended before the flight.
fn ended_early(processes: &Processes) -> String {
    format!("{} before the flight; see its log in logs/, if it has one", processes.ended().join(", "))
}

/// Conducts the flight to its end; gives the line back.
fn conduct(
    plan: &Plan,
    line: Line,
    events: &Events<LineEvent>,
    processes: &mut Processes,
    collected: &Path,
    stop: StopFlag,
) -> (Ending, Line) {
    let patience = plan.patience().map(|patience| Span::from_secs(patience.as_secs_f64()));
    let conduct = Conduct::new(plan.mission.clone(), plan.pace, patience, !plan.is_own());
    let port = ConductPort {
        line,
        own: plan.is_own(),
        mission: plan.mission.clone(),
        processes,
        progress: Progress::new(plan.mission.end),
        collected,
        stop,
        interrupted: false,
        pace: plan.pace_asked.then_some(plan.pace),
        joined: false,
        garbage: GarbageCount::default(),
    };
    let program = Shared::new(Program::new(conduct, port, Clock::from_now()));
    let ending = drive(&program, events);
    let port = program.into_port();
    port.progress.done();
    (ending, port.line)
}

/// Tells the fleet that everything of the flight is here, and leaves it.
fn dismiss(line: Line) {
    let _ = line.close_with(Plane::Mission, &wire::encode(&ToFleet::Dismiss));
}

/// Leaves a fleet that has no log of the flight at all.
fn nothing_recorded(folder: &Path, line: Option<Line>, landing: &Landing, ended_early: Vec<String>) -> Failure {
    let missing: Vec<String> = landing.missing_logs().chain(ended_early).collect();
    let why = format!("nothing was recorded: {}", missing.join(", "));
    match line {
        None => return Failure::Files(format!("{why}; see logs/ in {}", folder.display())),
        // Nor will there ever be one: the next run of the mission must not look for it again.
        Some(line) if landing.nobody_has_a_log() => dismiss(line),
        Some(line) => line.close(),
    }
    Failure::Files(why)
}

/// A flight whose recording is on disk.
struct Recorded {
    /// How mission time passed: a flight that was joined or only collected may have been started by someone else.
    pace: Pace,
    /// Whether every vehicle flew to the end, and there are states of it up to there.
    sound: bool,
    /// What is missing, in words.
    missing: Vec<String>,
}

/// Merges the logs into the folder's recording, and finds what is missing from it.
fn merge_logs(
    plan: &Plan,
    folder: &Path,
    logs: &[PathBuf],
    landing: &Landing,
    ended_early: Vec<String>,
) -> Result<Recorded, Failure> {
    let (logs, left_out) = of_one_flight(logs.to_vec());
    let merged = merge(&logs, folder.join(RECORDING)).map_err(|error| Failure::Files(error.to_string()))?;
    let pace = landing.pace.unwrap_or(plan.pace);
    let cut_short = missing::cut_short(&plan.mission, landing.phase, &merged);
    let sound = landing.phase == Phase::Finished && landing.aborted.is_empty() && cut_short.is_empty();
    let missing_logs = landing.missing_logs_of(folder, plan.mission.digest);
    let mut all: Vec<String> = missing_logs.chain(ended_early).chain(left_out).collect();
    all.extend(missing::damage(&merged));
    all.extend(missing::late_beginnings(&plan.mission, pace, &merged));
    let untold = cut_short.into_iter().filter(|(id, _)| !missing::gave_up(&landing.aborted, id));
    all.extend(untold.map(|(_, text)| text));
    Ok(Recorded { pace, sound, missing: all })
}

impl Recorded {
    /// What it was flown with.
    fn host(self, own: bool, took: Duration, aborted: Vec<String>) -> HostFacts {
        let how = format!("mission-control run{}{}", if own { "" } else { " --attach" }, option(self.pace));
        let speed_up = match self.pace {
            Pace::Real { speed_up } => Some(speed_up),
            Pace::Stepped => None,
        };
        HostFacts::now(&how, speed_up, took.as_secs_f64(), self.missing, aborted)
    }
}

/// The option with which `run` flies at this pace.
fn option(pace: Pace) -> String {
    match pace {
        Pace::Stepped => " --stepped".to_string(),
        Pace::Real { speed_up: 1.0 } => String::new(),
        Pace::Real { speed_up } => format!(" --speed-up {speed_up}"),
    }
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

/// Since when messages are counted, if not from the start.
fn counted_since(status: &FleetStatus) -> String {
    let from = status.counted_from;
    if from > Time::ZERO { format!(" since {:.0} s:", from.secs()) } else { String::new() }
}

/// What is told to who joins a flight under way and asked for this.
fn joining(asked: Option<Pace>) -> String {
    let in_vain = match asked {
        Some(Pace::Stepped) => ", and --stepped changes nothing".to_string(),
        Some(Pace::Real { speed_up }) => format!(", and --speed-up {speed_up} changes nothing"),
        None => String::new(),
    };
    format!("the flight was under way already: it goes on at the speed it was started with{in_vain}")
}

/// What a status is shown as: a quick flight is under way or over before its start was answered, and the time of a flight before
/// is none of this one's.
fn shown(step: Step, status: &FleetStatus, is_this_mission: bool) -> (Step, Time) {
    let under_way = is_this_mission && status.phase == Phase::Running;
    let over = is_this_mission && matches!(status.phase, Phase::Finished | Phase::Aborted);
    match step {
        Step::Contact | Step::Arming if !under_way => (step, Time::ZERO),
        Step::Starting if under_way || over => (Step::Flying, status.now),
        _ if is_this_mission => (step, status.now),
        _ => (step, Time::ZERO),
    }
}

struct ConductPort<'p> {
    line: Line,
    own: bool,
    mission: Arc<Mission>,
    processes: &'p mut Processes,
    progress: Progress,
    /// Where logs are collected.
    collected: &'p Path,
    stop: StopFlag,
    interrupted: bool,
    /// How mission time was asked to pass.
    pace: Option<Pace>,
    /// Whether it was told that the flight was under way already.
    joined: bool,
    garbage: GarbageCount,
}

type Ending = Result<Landing, Failure>;

impl ConductPort<'_> {
    fn tell(&mut self, step: Step, status: Option<&FleetStatus>) {
        let Some(status) = status else {
            return self.progress.line("lost the network-emulator; looking for it");
        };
        let is_this_mission = status.mission == self.mission.text;
        if step == Step::Contact && status.phase == Phase::Running && is_this_mission {
            self.join();
        }
        let (step, now) = shown(step, status, is_this_mission);
        let name = match step {
            Step::Contact => "contact",
            Step::Arming => "arming",
            Step::Starting => "starting",
            Step::Flying => "flying",
            Step::Collecting | Step::Ended => "collecting",
        };
        let [sent, delivered, dropped, _] = status.messages;
        let message = match step {
            Step::Contact | Step::Starting => String::new(),
            Step::Arming => not_armed(&self.mission, status),
            _ => format!(
                "messages{} {sent} sent, {delivered} delivered, {dropped} dropped{}",
                counted_since(status),
                self.away(status)
            ),
        };
        self.progress.reached(name, now, &message);
    }

    /// Who is not there, in words. Of own processes, none that has ended is started again.
    fn away(&self, status: &FleetStatus) -> String {
        let away = status.vehicles.iter().filter(|v| !v.connected).map(|v| v.id.as_str());
        let (lost, awaited): (Vec<&str>, Vec<&str>) = away.partition(|id| self.own && !self.processes.is_running(id));
        let lost = lost.iter().map(|id| format!("; {id} is lost")).collect::<String>();
        let awaited =
            if awaited.is_empty() { awaited.concat() } else { format!("; waiting for {}", awaited.join(", ")) };
        lost + &awaited
    }

    /// A flight under way has its clock already, and whoever attaches cannot give it another.
    fn join(&mut self) {
        if !std::mem::replace(&mut self.joined, true) {
            self.progress.line(&joining(self.pace));
        }
    }

    fn keep(&self, who: &str, piece: &LogPiece) -> Result<(), String> {
        let path = self.collected.join(format!("{who}-{}.mcap", piece.file + 1));
        let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        fs::create_dir_all(self.collected).map_err(failed)?;
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
                Ok(message) => Some((None, ConductInput::FromFleet(message.into()))),
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
        if self.own && matches!(conduct.step(), Step::Contact | Step::Arming) && !self.processes.ended().is_empty() {
            return Next::Exit(Err(self.processes.failure(ended_early(self.processes))));
        }
        if self.own && !self.processes.has_hub() {
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

#[cfg(test)]
mod tests {
    use std::process::Command;

    use network_emulator::hub::HUB;

    use super::*;

    #[test]
    fn a_fleet_whose_emulator_has_ended_is_not_waited_for() {
        let process = |script: &str| Command::new("sh").args(["-c", script]).spawn().expect("starts");
        let mut sound = Processes::of(HUB, process("sleep 60"));
        assert_eq!(in_vain(&mut sound, false), None);
        assert_eq!(in_vain(&mut sound, true).as_deref(), Some(INTERRUPTED));
        let mut killed = Processes::of(HUB, process("kill -9 $$"));
        let begun = Instant::now();
        let why = loop {
            match in_vain(&mut killed, false) {
                Some(why) => break why,
                None => assert!(begun.elapsed() < Duration::from_secs(20), "it is noticed"),
            }
        };
        assert!(why.contains("SIGKILL") && why.contains("before the flight"), "{why}");
        assert!(matches!(killed.failure(why), Failure::Unreachable(_)));
    }

    #[test]
    fn a_fleet_that_can_keep_no_logs_is_a_matter_of_files() {
        let child = Command::new("sh").args(["-c", "exit 4"]).spawn().expect("starts");
        let mut processes = Processes::of("auv1", child);
        let begun = Instant::now();
        while processes.look().is_empty() {
            assert!(begun.elapsed() < Duration::from_secs(20), "it is noticed");
        }
        let failure = processes.failure(ended_early(&processes));
        assert!(matches!(&failure, Failure::Files(why) if why.contains("is the disk full?")), "{failure:?}");
    }

    fn status(phase: Phase, now_s: f64) -> FleetStatus {
        FleetStatus {
            phase,
            mission: String::new(),
            now: Time::from_secs(now_s),
            end: Time::from_secs(800.0),
            speed: 0.5,
            speed_since: Time::ZERO,
            vehicles: Vec::new(),
            collected: true,
            pace: None,
            messages: [0; 4],
            drops: [0; 8],
            counted_from: Time::ZERO,
        }
    }

    #[test]
    fn the_time_of_a_flight_before_is_not_shown_and_a_quick_one_is_not_starting() {
        let (over, running) = (status(Phase::Finished, 800.0), status(Phase::Running, 30.0));
        for step in [Step::Contact, Step::Arming] {
            assert_eq!(shown(step, &over, true), (step, Time::ZERO));
            assert_eq!(shown(step, &running, false), (step, Time::ZERO));
        }
        assert_eq!(shown(Step::Contact, &running, true), (Step::Contact, running.now));
        assert_eq!(shown(Step::Starting, &over, true), (Step::Flying, over.now));
        assert_eq!(shown(Step::Starting, &running, true), (Step::Flying, running.now));
        assert_eq!(shown(Step::Starting, &status(Phase::Armed, 0.0), true), (Step::Starting, Time::ZERO));
        assert_eq!(shown(Step::Collecting, &over, true), (Step::Collecting, over.now));
    }

    #[test]
    fn who_joins_is_told_of_what_was_asked_for_only() {
        assert!(joining(None).ends_with("at the speed it was started with"));
        let faster = joining(Some(Pace::Real { speed_up: 50.0 }));
        assert!(faster.ends_with(", and --speed-up 50 changes nothing"), "{faster}");
    }
}
