//! Recordings: rows in, an MCAP file that survives `kill -9`, rows out.
//!
//! | topic | row | determined by mission and seed |
//! |---|---|---|
//! | `/mission/speed` | [`SpeedRow`](common::record::SpeedRow) | yes |
//! | `/network/topology` | [`TopologyRow`](common::record::TopologyRow) | yes |
//! | `/vehicles/<id>/state` | [`StateRow`](common::record::StateRow) | yes |
//! | `/network/messages` | [`MessageRow`](common::record::MessageRow) | yes |
//! | `/mission/warnings` | [`NoteRow`](common::record::NoteRow) | yes |
//! | `/clock/achieved` | [`AchievedRow`](common::record::AchievedRow) | no |
//! | `/clock/ticks` | [`TicksRow`](common::record::TicksRow) | no |
//! | `/clock/notes` | [`NoteRow`](common::record::NoteRow) | no |
//! | `/clock/overruns` | [`OverrunRow`](common::record::OverrunRow) | no |
//!
//! Messages are JSON with a JSON schema, in lz4 chunks. `log_time` and `publish_time` are mission time in nanoseconds;
//! what happened before the start (negative mission time) has `log_time` 0, and its row keeps the true `t_ns`.
//! `sequence` counts within a channel. The mission file is the attachment `mission.toml`, and the metadata record
//! `mission` holds its digest and the seed. Nothing in a file depends on the host or on the time of day.
//!
//! The emulator's own log holds what became of messages in packs (`packed.rs`), which reading and merging turn into rows.
//!
//! Two writers, for two needs:
//! - [`Recorder`] writes rows as they come; [`Recorder::flush_if_due`] closes the chunk by the wall clock, so that a
//!   killed process loses what it recorded since the last flush and no more.
//! - [`CanonicalRecorder`] writes rows in [`order`](canonical_order) and closes chunks by size alone, so that the same
//!   rows give the same bytes. [`merge`] makes it of the files of a fleet.

mod json;
mod merge;
mod order;
pub(crate) mod packed;
mod read;
mod recorder;
mod topic;

pub use merge::{CanonicalRecorder, Merged, Recovered, merge, recover};
pub use order::{canonical_order, canonical_order_of_records};
pub use read::{Recording, RowReader, read, read_from};
pub use recorder::{FLUSH_PERIOD, Recorder};
pub use topic::topic_of;

use std::fmt;
use std::path::{Path, PathBuf};

/// What a recording says about the run as a whole.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// The mission file, as flown.
    pub mission_toml: String,
    /// Its digest, in hexadecimal.
    pub digest: String,
    /// The seed of every random stream.
    pub seed: u64,
    /// When mission time was zero, which tells one flight of a mission from the next \[ns of the UNIX epoch\]; `None` if it did not pass
    /// with the wall clock.
    pub start_unix_ns: Option<i64>,
}

/// A recording that cannot be written or read: where, and why.
#[derive(Debug)]
pub struct RecordingError {
    /// The file.
    pub place: PathBuf,
    /// What went wrong.
    pub cause: Cause,
}

/// What went wrong with a recording.
#[derive(Debug)]
pub enum Cause {
    /// The operating system refused: no space, no permission, no such file.
    Io(std::io::Error),
    /// The file is not MCAP, or the format cannot hold what was asked.
    Format(String),
    /// An earlier write failed; nothing more is written to this file.
    Stopped(String),
    /// A row went back in time in a file that must be in order.
    OutOfOrder {
        /// Time of the row \[ns\].
        t_ns: i64,
        /// Time that had been reached \[ns\].
        reached_ns: i64,
    },
    /// Files of different missions or seeds cannot be merged.
    OtherMission {
        /// The file that it differs from.
        other: PathBuf,
    },
    /// Files of different flights of a mission cannot be merged.
    OtherFlight {
        /// The file that it differs from.
        other: PathBuf,
    },
}

/// The result of writing or reading a recording.
pub type Result<T> = std::result::Result<T, RecordingError>;

impl RecordingError {
    fn io(place: &Path, cause: std::io::Error) -> RecordingError {
        RecordingError { place: place.to_owned(), cause: Cause::Io(cause) }
    }

    fn mcap(place: &Path, cause: mcap::McapError) -> RecordingError {
        let cause = match cause {
            mcap::McapError::Io(cause) => Cause::Io(cause),
            other => Cause::Format(other.to_string()),
        };
        RecordingError { place: place.to_owned(), cause }
    }

    fn format(place: &Path, cause: impl Into<String>) -> RecordingError {
        RecordingError { place: place.to_owned(), cause: Cause::Format(cause.into()) }
    }
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "recording {}: ", self.place.display())?;
        match &self.cause {
            Cause::Io(cause) => write!(f, "{cause}"),
            Cause::Format(cause) => write!(f, "{cause}"),
            Cause::Stopped(first) => write!(f, "stopped after an earlier failure ({first})"),
            Cause::OutOfOrder { t_ns, reached_ns } => {
                write!(f, "a row at {t_ns} ns came after {reached_ns} ns had been reached")
            }
            Cause::OtherMission { other } => {
                write!(f, "belongs to another mission or seed than {}", other.display())
            }
            Cause::OtherFlight { other } => write!(f, "is of another flight of the mission than {}", other.display()),
        }
    }
}

impl std::error::Error for RecordingError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.cause {
            Cause::Io(cause) => Some(cause),
            _ => None,
        }
    }
}

#[cfg(test)]
mod testing;
