//! Medium access.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The medium that all vehicles share.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MediumSection {
    /// Bits that a sender puts on the air per second (bit/s).
    pub rate_bps: f64,
    /// Size of a message on the air (bytes), as a modem would pack it, 17 to 65535; its own size if absent.
    pub packet_bytes: Option<u32>,
    /// Time on the air before the first bit of each message (s).
    #[serde(default)]
    pub preamble_s: f64,
    /// Messages that may wait at one sender.
    #[serde(default = "one_message")]
    pub queue: u32,
    /// What is dropped if more come.
    #[serde(default)]
    pub when_full: WhenFullChoice,
    /// Each message waits a random time up to this before it is sent (s).
    #[serde(default)]
    pub backoff_s: f64,
    /// Whether a vehicle is deaf while it speaks.
    #[serde(default)]
    pub half_duplex: bool,
    /// Whether messages that overlap at a receiver destroy one another.
    #[serde(default)]
    pub collisions: bool,
    /// Slots in which vehicles speak by turns; any time if absent.
    pub slots: Option<SlotsSection>,
    /// Greatest share of time that one sender may speak, above 0 to 1.
    #[serde(default = "whole")]
    pub duty_cycle: f64,
}

/// What a full sender drops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WhenFullChoice {
    /// The new message.
    #[default]
    DropNew,
    /// The message that has waited longest.
    DropOld,
}

/// Time-division multiple access.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SlotsSection {
    /// Length of a slot (s).
    pub slot_s: f64,
    /// End of each slot that stays silent, for the slots of others to arrive undisturbed (s).
    pub guard_s: f64,
    /// Who owns the slots of a frame, in order; every vehicle one, in the order of the file, if absent.
    pub order: Option<Vec<String>>,
}

fn one_message() -> u32 {
    1
}

fn whole() -> f64 {
    1.0
}
