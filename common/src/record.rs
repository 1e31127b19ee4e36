//! What is recorded: one struct per topic.
//!
//! Rows of [`Record`] are determined by the mission and its seed. What depends on the wall clock (achieved delays,
//! missed deadlines) is in [`ClockRecord`], on topics of its own, so that equality of recordings means equality.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A vehicle's name in a row; shared, because thousands of rows carry the same few.
pub type Name = Arc<str>;

/// State of one vehicle at one control instant. Angles in radians, lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "the names are the documentation: they are the columns of vehicles.csv")]
pub struct StateRow {
    pub t_ns: i64,
    pub vehicle: Name,
    pub xi: f64,
    pub xi_rate: f64,
    pub v_ref: f64,
    pub x_m: f64,
    pub y_m: f64,
    pub z_m: f64,
    pub yaw_rad: f64,
    pub pitch_rad: f64,
    pub roll_rad: f64,
    pub speed_mps: f64,
    pub e_along_m: f64,
    pub e_cross_m: f64,
    pub e_norm_m: f64,
    pub psi_e_rad: f64,
    /// Number of neighbours in N_i at this instant.
    pub neighbours: u16,
}

impl StateRow {
    /// All of its measures, in the order of the fields.
    pub fn measures(&self) -> [f64; 14] {
        [
            self.xi,
            self.xi_rate,
            self.v_ref,
            self.x_m,
            self.y_m,
            self.z_m,
            self.yaw_rad,
            self.pitch_rad,
            self.roll_rad,
            self.speed_mps,
            self.e_along_m,
            self.e_cross_m,
            self.e_norm_m,
            self.psi_e_rad,
        ]
    }
}

/// What became of a message on one directed link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// Handed to the receiver at `due_ns`.
    Delivered,
    /// Lost by the loss model.
    Lost,
    /// The link was down when it should have arrived.
    LinkDown,
    /// The queue of the link, or of the sender, was full.
    QueueFull,
    /// Still under way when the mission ended.
    InFlight,
    /// The receiver was too far away.
    OutOfRange,
    /// The receiver was speaking itself.
    HalfDuplex,
    /// Another message arrived at the receiver at the same time.
    Collision,
    /// Handed over with a flipped bit, by which the receiver knows it for garbage.
    Corrupt,
    /// A second copy, which the network made, was handed to the receiver.
    Copied,
    /// A second copy did not get there, whyever.
    CopyDropped,
    /// A second copy was still under way when the mission ended.
    CopyInFlight,
    /// There was no process of the receiver when it arrived: killed, or its line down.
    ReceiverAbsent,
}

impl Fate {
    /// All of them, in the order of their numbers.
    pub const ALL: [Fate; 13] = [
        Fate::Delivered,
        Fate::Lost,
        Fate::LinkDown,
        Fate::QueueFull,
        Fate::InFlight,
        Fate::OutOfRange,
        Fate::HalfDuplex,
        Fate::Collision,
        Fate::Corrupt,
        Fate::Copied,
        Fate::CopyDropped,
        Fate::CopyInFlight,
        Fate::ReceiverAbsent,
    ];

    /// The causes for which a message is dropped.
    pub const DROPS: [Fate; 8] = [
        Fate::Lost,
        Fate::OutOfRange,
        Fate::LinkDown,
        Fate::QueueFull,
        Fate::HalfDuplex,
        Fate::Collision,
        Fate::Corrupt,
        Fate::ReceiverAbsent,
    ];

    /// Whether it is that of a second copy, which nobody sent.
    pub fn is_of_copy(self) -> bool {
        matches!(self, Fate::Copied | Fate::CopyDropped | Fate::CopyInFlight)
    }

    /// Its name, the same as in a recording.
    pub fn as_str(self) -> &'static str {
        match self {
            Fate::Delivered => "delivered",
            Fate::Lost => "lost",
            Fate::LinkDown => "link_down",
            Fate::QueueFull => "queue_full",
            Fate::InFlight => "in_flight",
            Fate::OutOfRange => "out_of_range",
            Fate::HalfDuplex => "half_duplex",
            Fate::Collision => "collision",
            Fate::Corrupt => "corrupt",
            Fate::Copied => "copied",
            Fate::CopyDropped => "copy_dropped",
            Fate::CopyInFlight => "copy_in_flight",
            Fate::ReceiverAbsent => "receiver_absent",
        }
    }
}

/// One message on one directed link, written when its fate is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "the names are the columns of links.csv")]
pub struct MessageRow {
    /// When the fate was decided.
    pub t_ns: i64,
    pub from: Name,
    pub to: Name,
    /// Number of the message on its link, from 0.
    pub seq: u64,
    /// When the emulator took it.
    pub sent_ns: i64,
    /// When it was to arrive.
    pub due_ns: i64,
    pub fate: Fate,
}

/// What became of a message, without names: what the emulator hands on for every message of a fleet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settled {
    /// When the fate was decided \[ns\].
    pub t_ns: i64,
    /// Index of the link among the mission's.
    pub link: usize,
    /// Number of the message on its link, from 0.
    pub seq: u64,
    /// When the emulator took it \[ns\].
    pub sent_ns: i64,
    /// When it was to arrive \[ns\].
    pub due_ns: i64,
    /// Its fate.
    pub fate: Fate,
    /// In real time, for a message that was delivered: how much later than due it was handed to the receiver's session
    /// \[ns of wall clock\]; negative if early.
    pub late_ns: Option<i64>,
}

impl Settled {
    /// The row of `links.csv`, for a link between these two.
    pub fn message(&self, from: &Name, to: &Name) -> MessageRow {
        let Settled { t_ns, seq, sent_ns, due_ns, fate, .. } = *self;
        MessageRow { t_ns, from: from.clone(), to: to.clone(), seq, sent_ns, due_ns, fate }
    }

    /// The row that compares the commanded delay with the achieved one, if the clock is a real one.
    pub fn achieved(&self, from: &Name, to: &Name) -> Option<AchievedRow> {
        let Settled { t_ns, seq, sent_ns, due_ns, .. } = *self;
        // Of a forged recording it is none; its reader refuses it.
        let commanded_ns = due_ns.saturating_sub(sent_ns);
        self.late_ns.map(|late_ns| AchievedRow { t_ns, from: from.clone(), to: to.clone(), seq, commanded_ns, late_ns })
    }
}

/// A directed link came up or went down.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "the names are the columns of topology.csv")]
pub struct TopologyRow {
    pub t_ns: i64,
    pub from: Name,
    pub to: Name,
    pub up: bool,
}

/// The formation speed changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "plain")]
pub struct SpeedRow {
    pub t_ns: i64,
    /// v_L \[units of ξ per s\].
    pub speed: f64,
}

/// A row that the mission and its seed determine.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "one variant per row type")]
pub enum Record {
    State(StateRow),
    Message(MessageRow),
    Topology(TopologyRow),
    Speed(SpeedRow),
    Warning(NoteRow),
}

impl Record {
    /// When the row was written, in mission time \[ns\].
    pub fn t_ns(&self) -> i64 {
        match self {
            Record::State(row) => row.t_ns,
            Record::Message(row) => row.t_ns,
            Record::Topology(row) => row.t_ns,
            Record::Speed(row) => row.t_ns,
            Record::Warning(row) => row.t_ns,
        }
    }
}

/// A delivery in real time: what was commanded and what was achieved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "plain")]
pub struct AchievedRow {
    pub t_ns: i64,
    pub from: Name,
    pub to: Name,
    pub seq: u64,
    /// Commanded delay \[ns of mission time\].
    pub commanded_ns: i64,
    /// Achieved minus commanded \[ns of wall clock\]; negative if it was handed over early.
    pub late_ns: i64,
}

/// The control loop's deadlines since the last row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "plain")]
pub struct TicksRow {
    pub t_ns: i64,
    pub vehicle: Name,
    pub met: u64,
    pub missed: u64,
    /// Largest lateness of a met deadline \[ns of wall clock\].
    pub worst_late_ns: i64,
}

/// Where messages were dropped that the network did not mean to drop: a queue of a program or a session was full, and the
/// oldest made place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Overrun {
    /// At the vehicle, on its way to the emulator.
    AtSender,
    /// At the emulator, before it could decide about them: they are in no ledger.
    BeforeEmulator,
    /// At the emulator, on the way to this vehicle: the ledger has them as delivered.
    ToReceiver,
    /// In the vehicle's own queue, before it could look at them.
    AtReceiver,
}

impl Overrun {
    /// In words.
    pub fn as_str(self) -> &'static str {
        match self {
            Overrun::AtSender => "on the way to the emulator",
            Overrun::BeforeEmulator => "before the emulator could decide about them",
            Overrun::ToReceiver => "on the way to the receiver, after they were booked as delivered",
            Overrun::AtReceiver => "in the receiver's own queue",
        }
    }
}

/// Messages that were dropped for want of time or room since the last such row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "plain")]
pub struct OverrunRow {
    pub t_ns: i64,
    /// Whose messages, or on the way to whom.
    pub vehicle: Name,
    pub place: Overrun,
    pub count: u64,
}

/// A line for people: a warning, a rejoin, a refused message, with how often it happened. What a vehicle warns of at
/// the end of its flight follows from the mission ([`Record::Warning`]); all else is of the clock ([`ClockRecord::Note`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "plain")]
pub struct NoteRow {
    pub t_ns: i64,
    pub source: String,
    pub text: String,
    pub count: u64,
}

/// A row that depends on the wall clock and the machine.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "one variant per row type")]
pub enum ClockRecord {
    Achieved(AchievedRow),
    Ticks(TicksRow),
    Note(NoteRow),
    Overrun(OverrunRow),
}

impl ClockRecord {
    /// When the row was written, in mission time \[ns\].
    pub fn t_ns(&self) -> i64 {
        match self {
            ClockRecord::Achieved(row) => row.t_ns,
            ClockRecord::Ticks(row) => row.t_ns,
            ClockRecord::Note(row) => row.t_ns,
            ClockRecord::Overrun(row) => row.t_ns,
        }
    }
}

/// Any row.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// Determined by the mission and its seed.
    Exact(Record),
    /// Depends on the wall clock.
    Clock(ClockRecord),
}

impl Row {
    /// When the row was written, in mission time \[ns\].
    pub fn t_ns(&self) -> i64 {
        match self {
            Row::Exact(record) => record.t_ns(),
            Row::Clock(record) => record.t_ns(),
        }
    }
}
