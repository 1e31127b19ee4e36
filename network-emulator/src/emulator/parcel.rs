//! A message on its way over one directed link.

use std::sync::Arc;

use common::time::Time;

use super::air::Place;

/// A message as its sender gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Parcel {
    /// Index of the sender.
    pub(super) from: usize,
    /// Its number: its time divided by the message period.
    pub(super) seq: u32,
    /// How many were taken of this sender before.
    pub(super) number: u64,
    /// When it was taken.
    pub(super) sent: Time,
    pub(super) bytes: Arc<[u8]>,
}

/// A message, or a copy of one, between its sender and one receiver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct UnderWay {
    pub(super) due: Time,
    pub(super) parcel: Parcel,
    pub(super) link: usize,
    /// A second copy that the network made.
    pub(super) copy: bool,
    /// When a second copy of it is due, if it arrives itself.
    pub(super) copy_due: Option<Time>,
    /// A bit is flipped.
    pub(super) corrupt: bool,
    /// Its entry in the receiver's [`Air`](super::air::Air), if the medium is shared.
    pub(super) reception: Option<Place>,
}

impl UnderWay {
    /// The second copy of it that the network makes, if it makes one. It was heard already, so it is nothing on the air.
    pub(super) fn copy(&self) -> Option<UnderWay> {
        let copy = |due| UnderWay { due, copy: true, copy_due: None, reception: None, ..self.clone() };
        self.copy_due.map(copy)
    }

    /// Messages due at the same instant arrive by instant of sending, then sender, then number: an order that does not
    /// depend on when which of them was taken.
    fn key(&self) -> (Time, Time, usize, u64, usize, bool) {
        (self.due, self.parcel.sent, self.parcel.from, self.parcel.number, self.link, self.copy)
    }
}

impl Ord for UnderWay {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

impl PartialOrd for UnderWay {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
