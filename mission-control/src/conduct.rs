//! A flight as mission-control conducts it, as a pure machine: make contact, upload, wait until every vehicle is armed,
//! start, watch, and collect the logs. `now` is the time since mission-control began.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use common::machine::Machine;
use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::fleet::{FleetStatus, FromFleet, Pace, ToFleet, VehicleStatus};
use common::wire::vehicle::{LogPiece, Phase};
use network_emulator::hub::HUB;
use vehicle_node::node::STOPPED;

use crate::missing::how_to_bring;

/// Between two questions after the fleet's status.
const POLL: Span = Span::from_nanos(200_000_000);
/// Why a run ended that was interrupted while the fleet was not flying yet, whether or not it had answered.
pub const INTERRUPTED: &str = "interrupted before the start";
/// Why a log is missing that there never was.
const NO_LOG: &str = "it has no log of this mission";
/// A piece of a log that has not come after this long is asked for again.
const PIECE_PATIENCE: Span = Span::from_nanos(3_000_000_000);
/// How often the same piece is asked for before the log is given up.
const PIECE_TRIES: u32 = 5;
/// A mission that the fleet does not have after this long is uploaded again, and a start that it did not make is asked for again.
const UPLOAD_PATIENCE: Span = Span::from_nanos(1_000_000_000);
/// How long a vehicle that is out of reach is waited for when the flight is over.
const RETURN_PATIENCE: Span = Span::from_nanos(5_000_000_000);

/// What can happen to a conducted flight, beside the passing of time.
#[derive(Clone, Debug, PartialEq)]
pub enum ConductInput {
    /// The line to the fleet is up.
    Connected,
    /// The line to the fleet is down.
    Lost,
    /// The fleet said something.
    FromFleet(Box<FromFleet>),
    /// The person at the terminal wants it ended.
    Interrupt,
}

/// What the conducted flight wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum ConductOutput {
    /// Say this to the fleet.
    Send(ToFleet),
    /// How it goes.
    Progress(Step, Option<FleetStatus>),
    /// A line for people.
    Remark(String),
    /// The flight is over, or was found to be; the logs are collected next.
    Over {
        /// How it ended.
        phase: Phase,
        /// Vehicles that gave up by themselves, and why.
        aborted: Vec<String>,
    },
    /// A piece of a log.
    Log {
        /// Whose.
        who: String,
        /// The piece.
        piece: LogPiece,
    },
    /// Everything that could be collected is here; what could not is named, with the reason. The fleet is dismissed when it
    /// is on disk.
    Done(Landing),
    /// It cannot be flown.
    Failed(String),
}

/// How a flight came to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Landing {
    /// Finished, or Aborted.
    pub phase: Phase,
    /// How mission time passed, if the fleet told.
    pub pace: Option<Pace>,
    /// Logs that are missing: whose, and why.
    pub missing: Vec<(String, String)>,
    /// Vehicles that gave up by themselves, and why.
    pub aborted: Vec<String>,
}

impl Landing {
    /// Which logs are missing and why, in words.
    pub(crate) fn missing_logs(&self) -> impl Iterator<Item = String> + '_ {
        self.missing.iter().map(|(who, why)| format!("log of {who}: {why}"))
    }

    /// Likewise, with where those are that there are, and how they come to this run.
    pub(crate) fn missing_logs_of(&self, run: &Path, digest: u64) -> impl Iterator<Item = String> {
        self.missing.iter().map(move |(who, why)| match why == NO_LOG {
            true => format!("log of {who}: {why}"),
            false => format!("log of {who}: {why}; {}", how_to_bring(who, digest, run)),
        })
    }

    /// Whether no log is missing but such as there never was.
    pub(crate) fn nobody_has_a_log(&self) -> bool {
        self.missing.iter().all(|(_, why)| why == NO_LOG)
    }
}

/// Where a conducted flight is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "in order")]
pub enum Step {
    Contact,
    Arming,
    Starting,
    Flying,
    Collecting,
    Ended,
}

/// A flight as mission-control conducts it.
pub struct Conduct {
    mission: Arc<Mission>,
    pace: Pace,
    /// How long to wait until every vehicle is armed.
    patience: Option<Span>,
    /// Whether logs are collected over the network; a run that started its own processes finds them on disk.
    collects: bool,
    step: Step,
    since: Time,
    next_poll: Time,
    /// When the mission was last sent.
    uploaded: Time,
    /// The mission was loaded: from here on, a flight of it that is over was ended before its start.
    loaded: bool,
    ended: Phase,
    flown: Option<Pace>,
    aborted: Vec<String>,
    /// Whose logs are still to be had, the present one first.
    to_collect: VecDeque<Wanted>,
    missing: Vec<(String, String)>,
    outputs: VecDeque<ConductOutput>,
}

struct Wanted {
    who: String,
    file: u32,
    offset: u64,
    asked: Option<Time>,
    tries: u32,
}

impl Conduct {
    /// The flight of this mission file.
    pub fn new(mission: Arc<Mission>, pace: Pace, patience: Option<Span>, collects: bool) -> Conduct {
        Conduct {
            collects,
            mission,
            pace,
            patience,
            step: Step::Contact,
            since: Time::ZERO,
            next_poll: Time::ZERO,
            uploaded: Time::ZERO,
            loaded: false,
            ended: Phase::Idle,
            flown: None,
            aborted: Vec::new(),
            to_collect: VecDeque::new(),
            missing: Vec::new(),
            outputs: VecDeque::new(),
        }
    }

    /// Where it is.
    pub fn step(&self) -> Step {
        self.step
    }

    fn send(&mut self, message: ToFleet) {
        self.outputs.push_back(ConductOutput::Send(message));
    }

    fn enter(&mut self, step: Step, now: Time) {
        self.step = step;
        self.since = now;
    }

    fn fail(&mut self, reason: String) {
        self.step = Step::Ended;
        self.outputs.push_back(ConductOutput::Failed(reason));
    }

    fn poll(&mut self, now: Time) {
        self.next_poll = now + POLL;
        match self.step {
            Step::Ended => {}
            Step::Collecting => self.collect(now),
            _ => self.send(ToFleet::Status),
        }
    }

    fn status(&mut self, now: Time, status: FleetStatus) {
        self.outputs.push_back(ConductOutput::Progress(self.step, Some(status.clone())));
        let same = status.mission == self.mission.text;
        if same {
            self.flown = status.pace.or(self.flown);
        }
        match self.step {
            Step::Contact if status.phase == Phase::Running && !same => {
                let reason = "the fleet is flying another mission; stop it first (mission-control stop)";
                self.fail(reason.to_string());
            }
            Step::Contact if status.phase == Phase::Running => self.enter(Step::Flying, now),
            // A flight of this mission ended while no mission-control was there to collect it.
            Step::Contact if self.collects && same && is_over(status.phase) && !status.collected => {
                let remark = "collecting the flight that ended while nobody watched; run again to fly";
                self.outputs.push_back(ConductOutput::Remark(remark.to_string()));
                self.enter(Step::Flying, now);
                self.flying(now, &status, true);
            }
            Step::Contact => {
                self.enter(Step::Arming, now);
                self.upload(now);
            }
            Step::Arming | Step::Starting if !same => self.not_loaded(now, status.phase),
            // A vehicle told a hub without memory of the flight that it is in.
            Step::Arming | Step::Starting if same && status.phase == Phase::Running => self.enter(Step::Flying, now),
            // An answer from before the mission was loaded speaks of the flight before.
            Step::Arming if same && is_over(status.phase) && self.loaded => {
                self.fail("stopped before the start".to_string());
            }
            Step::Arming if same => {
                self.loaded |= status.phase == Phase::Armed;
                self.arming(now, &status);
            }
            // It did not hear of the start, or forgot it.
            Step::Starting if status.phase == Phase::Armed && now - self.since > UPLOAD_PATIENCE => {
                self.enter(Step::Arming, now);
            }
            Step::Starting if same && is_over(status.phase) => {
                self.enter(Step::Flying, now);
                self.flying(now, &status, same);
            }
            Step::Flying => self.flying(now, &status, same),
            _ => {}
        }
    }

    fn upload(&mut self, now: Time) {
        let mission = self.mission.text.clone();
        self.send(ToFleet::Upload { mission });
        self.uploaded = now;
        self.flown = None;
        self.loaded = false;
    }

    /// The fleet does not have the mission that it was sent: the answer is from before, or the network-emulator was killed
    /// meanwhile and has lost it.
    fn not_loaded(&mut self, now: Time, phase: Phase) {
        if phase == Phase::Running {
            self.fail("the fleet has gone on to another mission".to_string());
        } else if self.patience.is_some_and(|patience| now - self.since > patience) {
            self.fail("the network-emulator does not take the mission".to_string());
        } else if now - self.uploaded > UPLOAD_PATIENCE {
            self.step = Step::Arming;
            self.upload(now);
        }
    }

    fn arming(&mut self, now: Time, status: &FleetStatus) {
        if let Some(refusal) = status.vehicles.iter().find(|v| v.phase == Phase::Idle && !v.reason.is_empty()) {
            return self.fail(format!("{} refuses the mission: {}", refusal.id, refusal.reason));
        }
        let of_mission = || status.vehicles.iter().filter(|v| self.concerns(&v.id));
        if of_mission().count() > 0 && of_mission().all(|v| v.connected && v.phase == Phase::Armed) {
            let pace = self.pace;
            self.send(ToFleet::Start { pace });
            self.enter(Step::Starting, now);
        } else if self.patience.is_some_and(|patience| now - self.since > patience) {
            let waiting: Vec<String> = of_mission()
                .filter(|v| !(v.connected && v.phase == Phase::Armed))
                .map(|v| format!("{} ({})", v.id, if v.connected { v.phase.as_str() } else { "not connected" }))
                .collect();
            let absent = of_mission().filter(|v| self.collects && !v.connected);
            let absent: Vec<String> = absent.map(|v| format!("vehicle-node --id {}", v.id)).collect();
            let hint = match absent.is_empty() {
                true => String::new(),
                false => format!("; start with: {} (--connect says where the fleet is)", absent.join(", ")),
            };
            self.fail(format!("not every vehicle came to be armed; still waiting for {}{hint}", waiting.join(", ")));
        }
    }

    /// Whether a vehicle belongs to this mission.
    fn concerns(&self, id: &str) -> bool {
        self.mission.index_of(id).is_some()
    }

    fn flying(&mut self, now: Time, status: &FleetStatus, same: bool) {
        if !same {
            // A hub that has just come back and knows nothing yet; a vehicle will tell it.
            if status.phase != Phase::Idle {
                self.fail("the fleet has gone on to another mission".to_string());
            }
            return;
        }
        if !is_over(status.phase) {
            return;
        }
        let still_flying = status.vehicles.iter().any(|v| v.connected && v.phase == Phase::Running);
        let out_of_reach = status.vehicles.iter().any(|v| !v.connected);
        if self.ended == Phase::Idle {
            self.ended = status.phase;
            self.since = now;
        }
        if !still_flying && (!out_of_reach || now - self.since > RETURN_PATIENCE)
            || now - self.since > RETURN_PATIENCE * 2
        {
            self.over(now, status);
        }
    }

    fn over(&mut self, now: Time, status: &FleetStatus) {
        self.ended = status.phase;
        let gave_up = |v: &&VehicleStatus| self.concerns(&v.id) && v.phase == Phase::Aborted && v.reason != STOPPED;
        let why = |reason: &str| if reason.is_empty() { "it gave no reason".to_string() } else { reason.to_string() };
        self.aborted =
            status.vehicles.iter().filter(gave_up).map(|v| format!("{} aborted: {}", v.id, why(&v.reason))).collect();
        self.outputs.push_back(ConductOutput::Over { phase: status.phase, aborted: self.aborted.clone() });
        let wanted = |who: &str| Wanted { who: who.to_string(), file: 0, offset: 0, asked: None, tries: 0 };
        if self.collects {
            self.to_collect.push_back(wanted(HUB));
        }
        for vehicle in status.vehicles.iter().filter(|_| self.collects) {
            if vehicle.connected {
                self.to_collect.push_back(wanted(&vehicle.id));
            } else {
                self.missing.push((vehicle.id.clone(), "not connected when the flight was over".to_string()));
            }
        }
        self.enter(Step::Collecting, now);
        self.collect(now);
    }

    /// Asks for the next piece, again if it has not come, or ends.
    fn collect(&mut self, now: Time) {
        while let Some(wanted) = self.to_collect.front_mut() {
            if wanted.asked.is_some_and(|asked| now - asked < PIECE_PATIENCE) {
                return;
            }
            wanted.tries += 1;
            if wanted.tries <= PIECE_TRIES {
                wanted.asked = Some(now);
                let (who, file, offset) = (wanted.who.clone(), wanted.file, wanted.offset);
                let digest = self.mission.digest;
                return self.send(ToFleet::SendLog { who, digest, file, offset });
            }
            let who = wanted.who.clone();
            self.to_collect.pop_front();
            self.missing.push((who, "it did not answer".to_string()));
        }
        self.step = Step::Ended;
        self.outputs.push_back(ConductOutput::Done(Landing {
            phase: self.ended,
            pace: self.flown,
            missing: std::mem::take(&mut self.missing),
            aborted: std::mem::take(&mut self.aborted),
        }));
    }

    fn log(&mut self, now: Time, who: &str, piece: LogPiece) {
        let Some(wanted) = self.to_collect.front_mut() else { return };
        let expected = wanted.who == who && wanted.file == piece.file && wanted.offset == piece.offset;
        if !expected || self.step != Step::Collecting {
            return;
        }
        wanted.offset += piece.bytes.len() as u64;
        wanted.asked = None;
        wanted.tries = 0;
        let whole = wanted.offset >= piece.size || piece.bytes.is_empty();
        let last = piece.file + 1 >= piece.files;
        if whole {
            wanted.file += 1;
            wanted.offset = 0;
        }
        if piece.files == 0 {
            self.missing.push((who.to_string(), NO_LOG.to_string()));
        } else {
            self.outputs.push_back(ConductOutput::Log { who: who.to_string(), piece });
        }
        if whole && last {
            self.to_collect.pop_front();
        }
        self.collect(now);
    }
}

fn is_over(phase: Phase) -> bool {
    matches!(phase, Phase::Finished | Phase::Aborted)
}

impl Machine for Conduct {
    type Input = ConductInput;
    type Output = ConductOutput;

    fn handle(&mut self, now: Time, input: Option<ConductInput>) {
        match input {
            Some(ConductInput::Connected) => self.poll(now),
            Some(ConductInput::Lost) => self.outputs.push_back(ConductOutput::Progress(self.step, None)),
            Some(ConductInput::FromFleet(message)) => match *message {
                FromFleet::Status(status) => self.status(now, status),
                FromFleet::Log { who, piece } => self.log(now, &who, piece),
                FromFleet::Refused { reason } => match self.step {
                    // A vehicle may have left between the status and the start.
                    Step::Starting => self.enter(Step::Arming, now),
                    Step::Arming => self.fail(reason),
                    _ => {}
                },
                FromFleet::SpeedTaken { .. } => {}
            },
            Some(ConductInput::Interrupt) => match self.step {
                Step::Starting | Step::Flying => self.send(ToFleet::Stop),
                Step::Collecting | Step::Ended => {}
                Step::Contact | Step::Arming => self.fail(INTERRUPTED.to_string()),
            },
            None => self.poll(now),
        }
    }

    fn poll_output(&mut self) -> Option<ConductOutput> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        (self.step != Step::Ended).then_some(self.next_poll)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELIX: &str = include_str!("../../missions/auv-helix.toml");

    fn conduct(collects: bool) -> Conduct {
        let mission = Mission::parse("m.toml", HELIX).unwrap_or_else(|faults| panic!("{faults}"));
        Conduct::new(Arc::new(mission), Pace::Stepped, Some(Span::from_secs(60.0)), collects)
    }

    fn status(phase: Phase, mission: &str, vehicles: Phase) -> FleetStatus {
        let vehicle = |id: &str| VehicleStatus {
            id: id.into(),
            connected: true,
            phase: vehicles,
            reason: String::new(),
            said: None,
        };
        FleetStatus {
            phase,
            mission: mission.into(),
            now: Time::ZERO,
            end: Time::from_secs(800.0),
            speed: 0.5,
            speed_since: Time::ZERO,
            vehicles: ["auv1", "auv2", "auv3"].map(vehicle).into(),
            collected: false,
            pace: matches!(phase, Phase::Running | Phase::Finished | Phase::Aborted).then_some(Pace::Stepped),
            messages: [0; 4],
            drops: [0; 8],
            counted_from: Time::ZERO,
        }
    }

    /// What it says to the fleet, and how it ends, when the fleet says this.
    fn hears(conduct: &mut Conduct, at_s: f64, message: FromFleet) -> Vec<ConductOutput> {
        conduct.handle(Time::from_secs(at_s), Some(ConductInput::FromFleet(message.into())));
        let all = std::iter::from_fn(|| conduct.poll_output());
        all.filter(|output| !matches!(output, ConductOutput::Progress(..))).collect()
    }

    fn piece(file: u32, files: u32, offset: u64, size: u64, bytes: usize) -> LogPiece {
        LogPiece { file, files, offset, size, bytes: vec![0; bytes] }
    }

    #[test]
    fn upload_arm_start_fly_end() {
        let mut conduct = conduct(false);
        let said = hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
        assert!(matches!(&said[..], [ConductOutput::Send(ToFleet::Upload { .. })]), "{said:?}");
        let said = hears(&mut conduct, 0.1, FromFleet::Status(status(Phase::Armed, HELIX, Phase::Idle)));
        assert_eq!(said, vec![], "not all are armed");
        let said = hears(&mut conduct, 0.2, FromFleet::Status(status(Phase::Armed, HELIX, Phase::Armed)));
        assert_eq!(said, vec![ConductOutput::Send(ToFleet::Start { pace: Pace::Stepped })]);
        hears(&mut conduct, 0.3, FromFleet::Status(status(Phase::Running, HELIX, Phase::Running)));
        let said = hears(&mut conduct, 9.0, FromFleet::Status(status(Phase::Finished, HELIX, Phase::Running)));
        assert_eq!(said, vec![], "a vehicle still flies");
        let said = hears(&mut conduct, 9.2, FromFleet::Status(status(Phase::Finished, HELIX, Phase::Finished)));
        assert_eq!(said[0], ConductOutput::Over { phase: Phase::Finished, aborted: vec![] });
        assert!(matches!(&said[1], ConductOutput::Done(landing) if landing.phase == Phase::Finished));
        assert_eq!(conduct.poll_timeout(), None);
    }

    #[test]
    fn a_network_emulator_that_lost_the_mission_gets_it_again_before_the_start() {
        for armed in [Phase::Idle, Phase::Armed] {
            let mut conduct = conduct(true);
            hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
            // Said before the mission was loaded, heard after it was sent.
            assert_eq!(hears(&mut conduct, 0.1, FromFleet::Status(status(Phase::Idle, "", Phase::Idle))), vec![]);
            hears(&mut conduct, 0.2, FromFleet::Status(status(Phase::Armed, HELIX, armed)));
            let said = hears(&mut conduct, 3.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
            assert!(matches!(&said[..], [ConductOutput::Send(ToFleet::Upload { .. })]), "{said:?}");
            let said = hears(&mut conduct, 3.2, FromFleet::Status(status(Phase::Armed, HELIX, Phase::Armed)));
            assert_eq!(said, vec![ConductOutput::Send(ToFleet::Start { pace: Pace::Stepped })]);
            // One that forgets it again and again is not waited for without end.
            let said = hears(&mut conduct, 99.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
            assert!(matches!(&said[..], [ConductOutput::Failed(_)]), "{said:?}");
        }
    }

    #[test]
    fn a_start_that_was_not_heard_is_asked_for_again() {
        let mut conduct = conduct(true);
        hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
        let armed = || FromFleet::Status(status(Phase::Armed, HELIX, Phase::Armed));
        let start = vec![ConductOutput::Send(ToFleet::Start { pace: Pace::Stepped })];
        assert_eq!(hears(&mut conduct, 0.2, armed()), start);
        assert_eq!(hears(&mut conduct, 0.4, armed()), vec![], "it may be on its way");
        hears(&mut conduct, 2.0, armed());
        assert_eq!(hears(&mut conduct, 2.2, armed()), start);
    }

    #[test]
    fn a_refusal_ends_it_with_the_reason() {
        let mut conduct = conduct(false);
        hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
        let mut refusing = status(Phase::Armed, HELIX, Phase::Idle);
        refusing.vehicles[1].reason = "no such path".into();
        let said = hears(&mut conduct, 0.1, FromFleet::Status(refusing));
        assert!(matches!(&said[..], [ConductOutput::Failed(r)] if r.contains("auv2") && r.contains("no such path")));
    }

    #[test]
    fn a_flight_that_is_stopped_before_its_start_fails() {
        let mut conduct = conduct(true);
        let collected = |phase| FleetStatus { collected: true, ..status(phase, HELIX, Phase::Aborted) };
        hears(&mut conduct, 0.0, FromFleet::Status(collected(Phase::Aborted)));
        // Said before the mission was loaded, heard after it was sent.
        assert_eq!(hears(&mut conduct, 0.1, FromFleet::Status(collected(Phase::Aborted))), vec![]);
        assert_eq!(hears(&mut conduct, 0.2, FromFleet::Status(status(Phase::Armed, HELIX, Phase::Idle))), vec![]);
        let said = hears(&mut conduct, 0.3, FromFleet::Status(status(Phase::Aborted, HELIX, Phase::Aborted)));
        assert_eq!(said, vec![ConductOutput::Failed("stopped before the start".into())]);
        assert_eq!(conduct.poll_timeout(), None);
    }

    #[test]
    fn who_gave_up_is_named_with_the_reason_and_who_was_stopped_is_not() {
        let mut conduct = conduct(false);
        hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Running, HELIX, Phase::Running)));
        let mut over = status(Phase::Aborted, HELIX, Phase::Aborted);
        for (vehicle, reason) in over.vehicles.iter_mut().zip(["it has diverged", STOPPED, ""]) {
            vehicle.reason = reason.into();
        }
        let said = hears(&mut conduct, 1.0, FromFleet::Status(over));
        let aborted = vec!["auv1 aborted: it has diverged".to_string(), "auv3 aborted: it gave no reason".to_string()];
        assert_eq!(said[0], ConductOutput::Over { phase: Phase::Aborted, aborted });
    }

    #[test]
    fn who_is_missing_is_named_when_patience_ends() {
        let mut conduct = conduct(true);
        hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Idle, "", Phase::Idle)));
        let mut waiting = status(Phase::Armed, HELIX, Phase::Armed);
        waiting.vehicles[2].connected = false;
        let said = hears(&mut conduct, 61.0, FromFleet::Status(waiting));
        assert!(
            matches!(&said[..], [ConductOutput::Failed(r)] if r.contains("auv3 (not connected)") && r.contains("start with: vehicle-node --id auv3 ")),
            "{said:?}"
        );
    }

    #[test]
    fn a_flight_under_way_is_joined_and_another_is_left_alone() {
        let mut joined = conduct(true);
        assert_eq!(hears(&mut joined, 0.0, FromFleet::Status(status(Phase::Running, HELIX, Phase::Running))), vec![]);
        assert_eq!(joined.step, Step::Flying);
        let mut other = conduct(true);
        let said = hears(&mut other, 0.0, FromFleet::Status(status(Phase::Running, "other", Phase::Running)));
        assert!(matches!(&said[..], [ConductOutput::Failed(_)]));
    }

    #[test]
    fn a_flight_that_ended_unseen_is_collected_and_a_collected_one_is_flown_again() {
        let mut unseen = conduct(true);
        let said = hears(&mut unseen, 0.0, FromFleet::Status(status(Phase::Finished, HELIX, Phase::Finished)));
        assert!(matches!(&said[0], ConductOutput::Remark(text) if text.contains("run again to fly")), "{said:?}");
        assert_eq!(said[1], ConductOutput::Over { phase: Phase::Finished, aborted: vec![] });
        // It is told how that one was flown, not how this one was to be.
        assert_eq!(unseen.flown, Some(Pace::Stepped));
        let mut again = conduct(true);
        let collected = FleetStatus { collected: true, ..status(Phase::Finished, HELIX, Phase::Finished) };
        let said = hears(&mut again, 0.0, FromFleet::Status(collected));
        assert!(matches!(&said[..], [ConductOutput::Send(ToFleet::Upload { .. })]), "{said:?}");
    }

    #[test]
    fn logs_are_collected_piece_by_piece_and_asked_for_again() {
        let mut conduct = conduct(true);
        hears(&mut conduct, 0.0, FromFleet::Status(status(Phase::Finished, HELIX, Phase::Finished)));
        let log = |who: &str, piece| FromFleet::Log { who: who.into(), piece };
        // The hub has one file in two pieces.
        let said = hears(&mut conduct, 0.1, log(HUB, piece(0, 1, 0, 10, 6)));
        assert!(matches!(
            &said[..],
            [ConductOutput::Log { .. }, ConductOutput::Send(ToFleet::SendLog { offset: 6, .. })]
        ));
        assert_eq!(hears(&mut conduct, 0.2, log(HUB, piece(0, 1, 0, 10, 6))), vec![], "the same piece twice");
        conduct.handle(Time::from_secs(4.0), None);
        assert!(
            matches!(conduct.poll_output(), Some(ConductOutput::Send(ToFleet::SendLog { offset: 6, .. }))),
            "again"
        );
        let said = hears(&mut conduct, 4.1, log(HUB, piece(0, 1, 6, 10, 4)));
        assert!(matches!(&said[1], ConductOutput::Send(ToFleet::SendLog { who, .. }) if who == "auv1"), "{said:?}");
        // auv1 has two files, auv2 none, auv3 does not answer.
        hears(&mut conduct, 4.2, log("auv1", piece(0, 2, 0, 3, 3)));
        let said = hears(&mut conduct, 4.3, log("auv1", piece(1, 2, 0, 3, 3)));
        assert!(matches!(&said[1], ConductOutput::Send(ToFleet::SendLog { who, .. }) if who == "auv2"), "{said:?}");
        hears(&mut conduct, 4.4, log("auv2", piece(0, 0, 0, 0, 0)));
        let mut at = 4.4;
        let missing = loop {
            at += 3.5;
            assert!(at < 60.0, "it gives up");
            conduct.handle(Time::from_secs(at), None);
            let outputs: Vec<_> = std::iter::from_fn(|| conduct.poll_output()).collect();
            if let Some(ConductOutput::Done(landing)) = outputs.last() {
                break landing.missing.clone();
            }
        };
        assert_eq!(missing.iter().map(|(who, _)| who.as_str()).collect::<Vec<_>>(), ["auv2", "auv3"]);
        let landing = Landing { phase: Phase::Finished, pace: None, missing, aborted: Vec::new() };
        let told: Vec<String> = landing.missing_logs_of(Path::new("runs/x"), 0xabc).collect();
        assert_eq!(told[0], "log of auv2: it has no log of this mission");
        assert!(
            told[1]
                .starts_with("log of auv3: it did not answer; it is on the machine of auv3 in LOGS/0000000000000abc")
        );
        assert!(told[1].ends_with("mission-control report runs/x --logs LOGS"), "{}", told[1]);
    }
}
