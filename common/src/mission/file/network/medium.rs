//! Medium access.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The medium that all vehicles share. A key that is absent is the preset's, if the preset has it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MediumSection {
    /// Bits that a sender puts on the air per second (bit/s); required if no preset has it.
    pub rate_bps: Option<f64>,
    /// Size of a message on the air (bytes), as a modem would pack it, 17 to 65535; its own size if absent.
    pub packet_bytes: Option<u32>,
    /// Time on the air before the first bit of each message (s); 0 if absent.
    pub preamble_s: Option<f64>,
    /// Messages that may wait at one sender; 1 if absent.
    pub queue: Option<u32>,
    /// What is dropped if more come; the new message if absent.
    pub when_full: Option<WhenFullChoice>,
    /// Each message waits a random time up to this before it is sent (s); 0 if absent.
    pub backoff_s: Option<f64>,
    /// Whether a vehicle is deaf while it speaks; it is not if absent.
    pub half_duplex: Option<bool>,
    /// Whether messages that overlap at a receiver destroy one another; they do not if absent.
    pub collisions: Option<bool>,
    /// Slots in which vehicles speak by turns; any time if absent.
    pub slots: Option<SlotsSection>,
    /// Greatest share of time that one sender may speak, above 0 to 1; 1 if absent.
    pub duty_cycle: Option<f64>,
}

impl MediumSection {
    /// This medium, with what it does not say as another one has it.
    pub fn over(self, other: MediumSection) -> MediumSection {
        MediumSection {
            rate_bps: self.rate_bps.or(other.rate_bps),
            packet_bytes: self.packet_bytes.or(other.packet_bytes),
            preamble_s: self.preamble_s.or(other.preamble_s),
            queue: self.queue.or(other.queue),
            when_full: self.when_full.or(other.when_full),
            backoff_s: self.backoff_s.or(other.backoff_s),
            half_duplex: self.half_duplex.or(other.half_duplex),
            collisions: self.collisions.or(other.collisions),
            slots: self.slots.or(other.slots),
            duty_cycle: self.duty_cycle.or(other.duty_cycle),
        }
    }
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
