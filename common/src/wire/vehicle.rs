//! network-emulator ↔ vehicle, on the mission plane.

use std::ops::RangeInclusive;

use bincode::{Decode, Encode};

use crate::time::Time;

/// How mission time passes.
#[derive(Clone, Copy, Debug, PartialEq, Encode, Decode)]
pub enum ClockPlan {
    /// With the wall clock, from an instant that all hosts agree on.
    Real {
        /// Mission time zero as nanoseconds of the UNIX epoch.
        epoch_unix_ns: i64,
        /// Mission seconds per second of wall clock.
        speed_up: f64,
    },
    /// In lock step, as fast as the processes can.
    Stepped,
}

impl ClockPlan {
    /// How many mission seconds there may be in one of wall clock.
    pub const SPEED_UPS: RangeInclusive<f64> = 0.001..=1000.0;

    /// When mission time is zero \[ns of the UNIX epoch\], if it passes with the wall clock.
    pub fn start_unix_ns(self) -> Option<i64> {
        match self {
            ClockPlan::Real { epoch_unix_ns, .. } => Some(epoch_unix_ns),
            ClockPlan::Stepped => None,
        }
    }

    /// Whether it is one by which anybody can fly.
    pub fn is_sound(self) -> bool {
        match self {
            ClockPlan::Real { speed_up, .. } => ClockPlan::SPEED_UPS.contains(&speed_up),
            ClockPlan::Stepped => true,
        }
    }
}

/// A formation speed that holds from an instant on.
#[derive(Clone, Copy, Debug, PartialEq, Encode, Decode)]
pub struct SpeedCommand {
    /// From when on.
    pub at: Time,
    /// v_L \[units of ξ per s\].
    pub speed: f64,
}

/// A flight as it was started: enough to join it late.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct FlightPlan {
    /// The mission file.
    pub mission: String,
    /// How mission time passes.
    pub clock: ClockPlan,
    /// Speeds commanded under way so far.
    pub speeds: Vec<SpeedCommand>,
}

/// Where a participant is in the life of a fleet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
#[allow(missing_docs, reason = "the life of a fleet, in order")]
pub enum Phase {
    Idle,
    Armed,
    Running,
    Finished,
    Aborted,
}

impl Phase {
    /// In one word.
    pub fn as_str(self) -> &'static str {
        match self {
            Phase::Idle => "idle",
            Phase::Armed => "armed",
            Phase::Running => "running",
            Phase::Finished => "finished",
            Phase::Aborted => "aborted",
        }
    }
}

/// To a vehicle.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToVehicle {
    /// Accept this mission file, or say why not.
    Arm {
        /// The mission file.
        mission: String,
    },
    /// Begin, or join, the flight of the armed mission.
    Start {
        /// Digest of the mission meant.
        digest: u64,
        /// How mission time passes.
        clock: ClockPlan,
        /// Speeds commanded under way so far.
        speeds: Vec<SpeedCommand>,
    },
    /// Fly at another formation speed from an instant on.
    Speed(SpeedCommand),
    /// End the flight now.
    Stop,
    /// Everything is collected: a process that was started for one flight may end.
    Dismiss,
    /// Stepped clock: run every control period up to `until`.
    Grant {
        /// Last instant to run.
        until: Time,
        /// What is heard meanwhile, and when.
        heard: Vec<(Time, Vec<u8>)>,
        /// Speeds commanded meanwhile.
        speeds: Vec<SpeedCommand>,
    },
    /// Send a piece of the log of the mission with this digest.
    SendLog {
        /// Which mission's log.
        digest: u64,
        /// Which of its files.
        file: u32,
        /// From which byte.
        offset: u64,
    },
}

/// From a vehicle.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum FromVehicle {
    /// First words after every connection.
    Hello {
        /// Where it is in its life.
        phase: Phase,
        /// The flight it is in, so that a hub that lost its memory can go on.
        flight: Option<FlightPlan>,
    },
    /// The mission is accepted.
    Armed {
        /// Its digest.
        digest: u64,
    },
    /// The mission is refused.
    Refused {
        /// Its digest.
        digest: u64,
        /// Why.
        reason: String,
    },
    /// Stepped clock: every control period up to `until` has run.
    Reached {
        /// Last instant run.
        until: Time,
        /// What was transmitted meanwhile, and when.
        sent: Vec<(Time, Vec<u8>)>,
    },
    /// The flight is over.
    Ended {
        /// Finished or Aborted.
        phase: Phase,
        /// Why, if aborted.
        reason: String,
    },
    /// A piece of a log.
    Log(LogPiece),
}

/// A piece of a log file.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct LogPiece {
    /// Which of the files.
    pub file: u32,
    /// How many files there are.
    pub files: u32,
    /// Where the piece begins.
    pub offset: u64,
    /// Size of the file.
    pub size: u64,
    /// The piece.
    pub bytes: Vec<u8>,
}
