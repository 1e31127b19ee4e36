//! The hub: the emulator program as a pure machine. Lets participants in, loads the mission, starts the clock, carries
//! coordination states through the [`Emulator`], conducts the stepped clock, and relays the mission plane.
//!
//! The hub is the fleet's memory: a vehicle that comes back gets the mission and the clock from it, and so does a new
//! mission-control. A hub that was killed gets both back from the first vehicle that finds it again.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use common::machine::Machine;
use common::mission::{Mission, SharedMission};
use common::record::{Row, Settled};
use common::time::{Span, Time};
use common::wire::fleet::{FromFleet, Pace, ToFleet};
use common::wire::vehicle::{ClockPlan, FromVehicle, LogPiece, Phase, SpeedCommand, ToVehicle};

use crate::emulator::{Emulator, Sent};
use crate::lockstep::{Lockstep, WINDOW};

mod clock;
mod control;
mod vehicles;

/// Name under which mission-control joins when it conducts a flight and collects its logs.
pub const COLLECTOR: &str = "mission-control";
/// Name under which single commands (status, speed, stop) join.
pub const OPERATOR: &str = "operator";
/// Name of the hub as a source of logs and notes.
pub const HUB: &str = "network-emulator";

/// The note with which a flight ends before its time begins with this; what follows is why.
pub const ENDED: &str = "flight ended: ";

/// The note about a time in which the emulator carried nothing although it was there begins with this.
pub const ASLEEP: &str = "the emulator was not let run";

/// A speed commanded now holds from this much later, so that every vehicle has it in time \[s of wall clock\].
const SPEED_LEAD_S: f64 = 0.25;

/// Most speeds that are commanded in a flight: one a second for nearly three hours.
const MOST_SPEEDS: usize = 10_000;
/// How often the hub looks at the clock of a real flight if nothing happens \[s of wall clock\].
const BEAT_S: f64 = 0.25;
/// A hub that has not looked at the clock for longer than this was not let run \[s of wall clock\].
const ASLEEP_S: f64 = BEAT_S + 1.0;

/// A flight that is taken up from a vehicle does not begin later than this much from now \[s of wall clock\].
const LATEST_BEGIN_S: f64 = 60.0;

/// What can happen to the hub, beside the passing of time.
#[derive(Clone, Debug, PartialEq)]
pub enum HubInput {
    /// A vehicle's line came up.
    Joined {
        /// Its name.
        id: String,
        /// The number of its line, which is the same whenever it comes back.
        seat: usize,
    },
    /// A vehicle's line went down.
    Left(String),
    /// A vehicle said something on the mission plane.
    FromVehicle(String, FromVehicle),
    /// The vehicle of this seat put bytes on the air.
    State(usize, Arc<[u8]>),
    /// Mission-control, or an operator at another terminal, said something.
    FromControl {
        /// Who: the answer goes there.
        who: String,
        /// What.
        message: ToFleet,
    },
    /// The log could not be opened, and why.
    LogFailed(String),
    /// The driver has started the clock.
    ClockStarted(ClockPlan),
    /// The log of a flight that was taken up is open; `last` is the time up to which an earlier life of the hub recorded.
    LogOpened {
        /// That time, if there is an earlier log.
        last: Option<Time>,
    },
    /// A piece of the hub's own log, as asked for.
    Log(LogPiece),
}

/// What the hub wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum HubOutput {
    /// Say this to a vehicle on the mission plane.
    ToVehicle(String, ToVehicle),
    /// Hand these bytes to a vehicle on the coordination plane.
    Deliver {
        /// Its seat.
        seat: usize,
        /// The bytes.
        bytes: Arc<[u8]>,
        /// What to record of it, with the lateness at which it is handed over.
        settled: Option<Settled>,
    },
    /// Say this to mission-control, or to an operator.
    ToControl {
        /// To whom.
        who: String,
        /// What.
        message: FromFleet,
    },
    /// Open a log for this mission and answer with [`HubInput::LogOpened`].
    OpenLog {
        /// The mission.
        mission: SharedMission,
        /// Whether the flight begins: what an earlier flight of the same mission left is set aside.
        fresh: bool,
    },
    /// Everything is collected: a process that was started for one flight may end.
    Dismissed,
    /// Record this row.
    Record(Row),
    /// Record what became of a message.
    Settled(Settled),
    /// The flight is over: close the log.
    CloseLog,
    /// Choose the clock's origin, start the clock, and answer with [`HubInput::ClockStarted`].
    StartClock(Pace),
    /// Follow this clock, which others started, and answer with [`HubInput::ClockStarted`].
    FollowClock(ClockPlan),
    /// Read a piece of the log and answer with [`HubInput::Log`].
    ReadLog {
        /// Which mission's.
        digest: u64,
        /// Which of its files.
        file: u32,
        /// From which byte.
        offset: u64,
    },
    /// A line for people.
    Say(String),
}

/// The emulator program as a pure machine.
pub struct Hub {
    vehicles: BTreeMap<String, Known>,
    /// Which vehicle of the loaded mission has a seat.
    aboard: Vec<Option<usize>>,
    load: Option<Load>,
    /// Who asked for what is being answered.
    asker: Option<String>,
    /// Whether this life of the hub has seen a flight: of one that it has not seen it may have lost its memory.
    flown: bool,
    /// Most control periods in one grant of the stepped clock.
    window: i64,
    outputs: VecDeque<HubOutput>,
}

#[derive(Clone, Debug)]
struct Known {
    connected: bool,
    seat: usize,
    phase: Phase,
    reason: String,
    /// Whether it told of a flight that cannot be.
    doubted: bool,
}

struct Load {
    mission: Arc<Mission>,
    phase: Phase,
    clock: Option<ClockPlan>,
    emulator: Emulator,
    /// The seat of each vehicle of the mission, once it has one.
    seats: Vec<Option<usize>>,
    lockstep: Option<Lockstep>,
    /// Speeds commanded under way.
    speeds: Vec<SpeedCommand>,
    /// Taken over from a vehicle after the hub lost its memory.
    adopted: bool,
    /// Its logs are where they belong.
    collected: bool,
    /// From when on messages are counted.
    counted_from: Time,
    /// When the hub last looked at the clock.
    awake: Time,
    now: Time,
}

impl Load {
    /// The flight is under way on a real clock; mission seconds per second of wall clock.
    fn speed_up(&self) -> Option<f64> {
        match self.clock {
            Some(ClockPlan::Real { speed_up, .. }) if self.phase == Phase::Running => Some(speed_up),
            _ => None,
        }
    }
}

impl Default for Hub {
    fn default() -> Self {
        Hub::new()
    }
}

impl Hub {
    /// A hub that knows nothing yet.
    pub fn new() -> Hub {
        Hub::with_window(WINDOW)
    }

    /// A hub whose stepped clock grants at most this many control periods at once. What is flown does not depend on it.
    pub fn with_window(window: i64) -> Hub {
        Hub {
            vehicles: BTreeMap::new(),
            aboard: Vec::new(),
            load: None,
            asker: None,
            flown: false,
            window,
            outputs: VecDeque::new(),
        }
    }

    /// Where the fleet is in its life.
    pub fn phase(&self) -> Phase {
        self.load.as_ref().map_or(Phase::Idle, |load| load.phase)
    }

    /// Mission time up to which a stepped run is complete.
    pub fn mission_time(&self) -> Time {
        self.load.as_ref().map_or(Time::ZERO, |load| load.now)
    }

    /// Sent, delivered, dropped and in flight over all links.
    pub fn totals(&self) -> [u64; 4] {
        self.load.as_ref().map_or([0; 4], |load| load.emulator.totals())
    }

    fn say(&mut self, text: String) {
        self.outputs.push_back(HubOutput::Say(text));
    }

    fn tell_vehicle(&mut self, id: &str, message: ToVehicle) {
        self.outputs.push_back(HubOutput::ToVehicle(id.to_string(), message));
    }

    /// Answers whoever asked, if anyone did.
    fn answer(&mut self, message: FromFleet) {
        if let Some(who) = self.asker.clone() {
            self.outputs.push_back(HubOutput::ToControl { who, message });
        }
    }

    fn refuse(&mut self, reason: String) {
        self.answer(FromFleet::Refused { reason });
    }

    /// Ids of the mission's vehicles that are connected, in the mission's order.
    fn connected(&self) -> Vec<String> {
        let Some(load) = &self.load else { return Vec::new() };
        let is_up = |id: &str| self.vehicles.get(id).is_some_and(|known| known.connected);
        load.mission.vehicles.iter().map(|v| v.id.clone()).filter(|id| is_up(id)).collect()
    }

    fn tell_fleet(&mut self, message: &ToVehicle) {
        for id in self.connected() {
            self.tell_vehicle(&id, message.clone());
        }
    }
}

impl Machine for Hub {
    type Input = HubInput;
    type Output = HubOutput;

    fn handle(&mut self, now: Time, input: Option<HubInput>) {
        self.look_at_the_clock(now);
        match input {
            Some(HubInput::Joined { id, seat }) => self.joined(now, id, seat),
            Some(HubInput::Left(id)) => self.left(now, &id),
            Some(HubInput::FromVehicle(id, message)) => self.hear_vehicle(now, &id, message),
            Some(HubInput::FromControl { who, message }) => {
                self.asker = Some(who);
                self.hear_control(now, message);
                self.asker = None;
            }
            Some(HubInput::LogFailed(reason)) => self.stop(now, &reason),
            Some(HubInput::ClockStarted(clock)) => self.clock_started(now, clock),
            Some(HubInput::LogOpened { last }) => self.log_opened(now, last),
            Some(HubInput::Log(piece)) => {
                self.collected(HUB, piece);
            }
            Some(HubInput::State(seat, bytes)) => {
                if let Some(load) = self.load.as_mut().filter(|l| l.phase == Phase::Running && l.lockstep.is_none())
                    && let Some(Some(from)) = self.aboard.get(seat).copied()
                {
                    load.emulator.handle(now, Some(Sent { from, bytes }));
                    self.drain_emulator();
                }
            }
            None => {
                if let Some(load) = self.load.as_mut().filter(|l| l.phase == Phase::Running && l.lockstep.is_none()) {
                    load.now = now;
                    load.emulator.handle(now.min(load.mission.end), None);
                    let over = now >= load.mission.end;
                    self.drain_emulator();
                    if over {
                        self.finish(now);
                    }
                }
            }
        }
    }

    fn poll_output(&mut self) -> Option<HubOutput> {
        self.outputs.pop_front()
    }

    fn poll_timeout(&self) -> Option<Time> {
        let load = self.load.as_ref()?;
        let beat = load.awake + Span::from_secs(BEAT_S * load.speed_up()?);
        let next = load.mission.end.min(beat);
        Some(load.emulator.poll_timeout().map_or(next, |at| at.min(next)))
    }
}

#[cfg(test)]
mod tests;
