//! A vehicle's turn to speak: messages wait at their sender until the medium lets them out.

use std::collections::VecDeque;

use common::network::Medium;
use common::network::medium::WhenFull;
use common::random::Stream;
use common::time::Time;

use super::parcel::Parcel;

/// The queue of one vehicle.
pub(super) struct Sender {
    vehicle: usize,
    /// Decides how long message m waits at random.
    stream: Stream,
    waiting: VecDeque<Parcel>,
    /// When the last transmission, and the silence after it, is over.
    free: Time,
    /// When the first of those that wait is sent.
    next: Option<Time>,
}

impl Sender {
    pub(super) fn new(vehicle: usize, stream: Stream) -> Sender {
        let free = Time::from_nanos(i64::MIN);
        Sender { vehicle, stream, waiting: VecDeque::new(), free, next: None }
    }

    /// Takes a message; the one that has no place, if the queue is full.
    pub(super) fn take(&mut self, medium: &Medium, parcel: Parcel) -> Option<Parcel> {
        let mut dropped = None;
        if self.waiting.len() >= medium.queue {
            match medium.when_full {
                WhenFull::DropNew => return Some(parcel),
                WhenFull::DropOld => dropped = self.waiting.pop_front(),
            }
        }
        self.waiting.push_back(parcel);
        self.plan(medium);
        dropped
    }

    /// When this vehicle speaks next.
    pub(super) fn next(&self) -> Option<Time> {
        self.next
    }

    /// The message that is sent now.
    pub(super) fn speak(&mut self, medium: &Medium) -> Option<Parcel> {
        let parcel = self.waiting.pop_front();
        if let (Some(start), Some(parcel)) = (self.next, &parcel) {
            self.free = medium.free_after(start, medium.airtime(parcel.bytes.len()));
        }
        self.plan(medium);
        parcel
    }

    /// What is left waiting when the mission ends.
    pub(super) fn rest(&mut self) -> impl Iterator<Item = Parcel> + use<> {
        self.next = None;
        std::mem::take(&mut self.waiting).into_iter()
    }

    fn plan(&mut self, medium: &Medium) {
        self.next = None;
        if let Some(parcel) = self.waiting.front() {
            let waits = if medium.backoff.nanos() > 0 { self.stream.unit_at(u64::from(parcel.seq), 0) } else { 0.0 };
            let earliest = (parcel.sent + medium.wait(waits)).max(self.free);
            self.next = Some(medium.start(self.vehicle, earliest, medium.airtime(parcel.bytes.len())))
                .filter(|start| *start < Time::MAX);
        }
    }
}
