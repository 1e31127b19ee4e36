//! mission-control ↔ network-emulator, on the mission plane.

use bincode::{Decode, Encode};

use super::vehicle::{LogPiece, Phase};
use crate::record::Fate;
use crate::time::Time;

/// How mission-control wants mission time to pass.
#[derive(Clone, Copy, Debug, PartialEq, Encode, Decode)]
pub enum Pace {
    /// With the wall clock, `speed_up` mission seconds per second.
    Real {
        /// Mission seconds per second of wall clock.
        speed_up: f64,
    },
    /// In lock step, as fast as the processes can.
    Stepped,
}

/// To the fleet.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToFleet {
    /// Tell how the fleet is.
    Status,
    /// Load this mission file into the emulator and every vehicle it names.
    Upload {
        /// The mission file.
        mission: String,
    },
    /// Begin the flight; refused unless every vehicle is armed.
    Start {
        /// How mission time shall pass.
        pace: Pace,
    },
    /// Fly at another formation speed from now on.
    Speed {
        /// v_L \[units of ξ per s\].
        speed: f64,
    },
    /// End the flight now.
    Stop,
    /// Everything is collected: processes that were started for one flight may end.
    Dismiss,
    /// Send a piece of a participant's log.
    SendLog {
        /// A vehicle's id, or `network-emulator`.
        who: String,
        /// Which mission's log.
        digest: u64,
        /// Which of its files.
        file: u32,
        /// From which byte.
        offset: u64,
    },
}

/// From the fleet.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum FromFleet {
    /// How the fleet is.
    Status(FleetStatus),
    /// A request was refused.
    Refused {
        /// Why.
        reason: String,
    },
    /// A speed command was taken.
    SpeedTaken {
        /// From when on it holds.
        at: Time,
        /// v_L \[units of ξ per s\].
        speed: f64,
    },
    /// A piece of a log.
    Log {
        /// Whose.
        who: String,
        /// The piece.
        piece: LogPiece,
    },
}

/// How one vehicle is, as the emulator knows.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct VehicleStatus {
    /// Its id.
    pub id: String,
    /// Whether its line is up.
    pub connected: bool,
    /// Where it is in its life.
    pub phase: Phase,
    /// Why it refused or aborted, or nothing.
    pub reason: String,
    /// When it last said where it is on its path, and where: ξ.
    pub said: Option<(Time, f64)>,
}

/// How the fleet is.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct FleetStatus {
    /// Where the fleet is in its life.
    pub phase: Phase,
    /// The mission file loaded, or nothing.
    pub mission: String,
    /// Mission time reached.
    pub now: Time,
    /// Mission time at which it ends.
    pub end: Time,
    /// Present formation speed.
    pub speed: f64,
    /// Since when it holds: zero, if it never changed under way.
    pub speed_since: Time,
    /// Vehicles of the mission, and others that are connected.
    pub vehicles: Vec<VehicleStatus>,
    /// Whether the logs of a flight that is over have been collected.
    pub collected: bool,
    /// How mission time passes in the flight under way, or passed in the one that is over.
    pub pace: Option<Pace>,
    /// Messages taken, delivered, dropped and in flight, over all links.
    pub messages: [u64; 4],
    /// What was dropped, by cause, in the order of [`Fate::DROPS`].
    pub drops: [u64; Fate::DROPS.len()],
    /// From when on these are counted: zero, or when the network-emulator came back that was killed under way.
    pub counted_from: Time,
}
