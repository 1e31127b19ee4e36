//! What passes between processes, and how it is encoded.
//!
//! | file | edge |
//! |---|---|
//! | [`state`] | vehicle → network-emulator → vehicle: the coordination state, the only thing on the air |
//! | [`vehicle`] | network-emulator ↔ vehicle: arm, start, speed, stop, the stepped clock, logs |
//! | [`fleet`] | mission-control ↔ network-emulator: upload, start, speed, stop, status, logs |
//!
//! Encoding is bincode with a size limit on every decode; a decoded message must use up its bytes exactly. Nothing
//! that arrives can make the decoder panic or allocate without bound.

pub mod fleet;
pub mod state;
pub mod vehicle;

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::{Decode, Encode};

/// Version of everything on the wire; programs of different versions do not talk.
pub const PROTOCOL: u16 = 1;

/// Largest message of the mission plane \[bytes\].
pub const MISSION_LIMIT: usize = 4 << 20;

/// First bytes of every mission-plane message.
const MAGIC: [u8; 2] = *b"CM";

/// Why bytes were not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Garbage {
    /// Not of this protocol and version.
    Foreign,
    /// Longer than any message of its kind.
    Oversized,
    /// Truncated, or with bytes left over, or with an impossible value.
    Malformed,
    /// Changed on the way: its checksum does not fit.
    Corrupt,
    /// A number that is not finite, or beyond all sense.
    NotFinite,
    /// Of another mission.
    WrongMission,
    /// Claims a sender other than the one it came from.
    Forged,
    /// Made in the receiver's future.
    FromTheFuture,
    /// Older than, or the same as, one already received.
    Stale,
}

impl Garbage {
    /// Every kind.
    pub const ALL: [Garbage; 9] = [
        Garbage::Foreign,
        Garbage::Oversized,
        Garbage::Malformed,
        Garbage::Corrupt,
        Garbage::NotFinite,
        Garbage::WrongMission,
        Garbage::Forged,
        Garbage::FromTheFuture,
        Garbage::Stale,
    ];

    /// In words.
    pub fn as_str(self) -> &'static str {
        match self {
            Garbage::Foreign => "not of this protocol and version",
            Garbage::Oversized => "longer than any message of its kind",
            Garbage::Malformed => "malformed",
            Garbage::Corrupt => "changed on the way",
            Garbage::NotFinite => "carries a number that is not finite",
            Garbage::WrongMission => "of another mission",
            Garbage::Forged => "names a sender other than the one it came from",
            Garbage::FromTheFuture => "made in the future",
            Garbage::Stale => "older than one already received",
        }
    }
}

/// How often each kind of garbage came from one source. Bounded: one counter per kind.
#[derive(Clone, Debug, Default)]
pub struct GarbageCount([u64; Garbage::ALL.len()]);

impl GarbageCount {
    /// Counts one; true the first time, when it deserves a line in the log.
    pub fn count(&mut self, kind: Garbage) -> bool {
        let slot = &mut self.0[kind as usize];
        *slot += 1;
        *slot == 1
    }
    /// How many of this kind.
    pub fn of(&self, kind: Garbage) -> u64 {
        self.0[kind as usize]
    }
    /// How many in all.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

type MissionCodec = Configuration<LittleEndian, Fixint, Limit<MISSION_LIMIT>>;

fn mission_codec() -> MissionCodec {
    bincode::config::standard().with_fixed_int_encoding().with_limit::<MISSION_LIMIT>()
}

/// Encodes a mission-plane message.
pub fn encode<M: Encode>(message: &M) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(64);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&PROTOCOL.to_le_bytes());
    // Encoding plain data into a growing vector cannot fail.
    bincode::encode_into_std_write(message, &mut bytes, mission_codec()).expect("encoding into memory");
    bytes
}

/// Decodes a mission-plane message.
///
/// # Errors
/// Says which kind of garbage the bytes are.
pub fn decode<M: Decode<()>>(bytes: &[u8]) -> Result<M, Garbage> {
    if bytes.len() > MISSION_LIMIT {
        return Err(Garbage::Oversized);
    }
    let body = body(bytes, MAGIC)?;
    match bincode::decode_from_slice(body, mission_codec()) {
        Ok((message, used)) if used == body.len() => Ok(message),
        _ => Err(Garbage::Malformed),
    }
}

/// The bytes after magic and version.
fn body(bytes: &[u8], magic: [u8; 2]) -> Result<&[u8], Garbage> {
    match bytes {
        [a, b, low, high, body @ ..] if [*a, *b] == magic && u16::from_le_bytes([*low, *high]) == PROTOCOL => Ok(body),
        _ => Err(Garbage::Foreign),
    }
}
