//! The channel's books: ledgers, totals, and what is recorded of every message.

use common::record::{ClockRecord, Fate, NoteRow, Row, Settled};
use common::time::Time;
use common::wire::GarbageCount;

use super::parcel::{Parcel, UnderWay};
use super::{Channel, Emulator};
use crate::ledger::Ledger;

impl Emulator {
    /// The ledger of each directed link, in the order of the mission's links.
    pub fn ledgers(&self) -> impl Iterator<Item = &Ledger> {
        self.links.iter().map(|link| &link.ledger)
    }

    /// When a vehicle made its newest message, and the ξ in it.
    pub fn said(&self, vehicle: usize) -> Option<(Time, f64)> {
        self.said.get(vehicle).copied().flatten()
    }

    /// Sent, delivered, dropped, in flight, over all links.
    pub fn totals(&self) -> [u64; 4] {
        let add =
            |[s, d, x, f]: [u64; 4], l: &Ledger| [s + l.sent, d + l.delivered(), x + l.dropped(), f + l.in_flight];
        self.ledgers().fold([0; 4], add)
    }

    /// What was dropped over all links, by cause, in the order of [`Fate::DROPS`].
    pub fn drops(&self) -> [u64; Fate::DROPS.len()] {
        Fate::DROPS.map(|cause| self.ledgers().map(|ledger| ledger.of(cause)).sum())
    }

    /// Garbage counted per vehicle.
    pub fn garbage(&self) -> &[GarbageCount] {
        &self.garbage
    }

    /// Closes the books: what is under way, or still waits to be sent, is recorded as such.
    pub fn finish(&mut self, now: Time) {
        while let Some(message) = self.under_way.pop() {
            let fate = if message.copy { Fate::CopyInFlight } else { Fate::InFlight };
            self.record_message(now, &message, fate);
            if let Some(copy) = message.copy() {
                self.record_message(now, &copy, Fate::CopyInFlight);
            }
        }
        self.turns.clear();
        for vehicle in 0..self.senders.len() {
            for parcel in self.senders[vehicle].rest() {
                for slot in 0..self.out[vehicle].len() {
                    let message = unsent(now, &parcel, self.out[vehicle][slot]);
                    self.record_message(now, &message, Fate::InFlight);
                }
            }
        }
        for (vehicle, garbage) in self.garbage.iter().enumerate() {
            if garbage.total() > 0 {
                let text = format!("messages ignored that came from {}", self.mission.vehicles[vehicle].id);
                let source = "network-emulator".to_string();
                let row = NoteRow { t_ns: now.nanos(), source, text, count: garbage.total() };
                self.outputs.push_back(Channel::Record(Row::Clock(ClockRecord::Note(row))));
            }
        }
    }

    /// The fate of a message is decided.
    pub(super) fn settle(&mut self, t: Time, message: &UnderWay, fate: Fate) {
        self.links[message.link].ledger.settle(fate);
        self.record_message(t, message, fate);
    }

    fn record_message(&mut self, t: Time, message: &UnderWay, fate: Fate) {
        self.outputs.push_back(Channel::Settled(settled(t, message, fate, None)));
    }
}

/// What is written down of a message whose fate was decided at `t`.
pub(super) fn settled(t: Time, message: &UnderWay, fate: Fate, late_ns: Option<i64>) -> Settled {
    Settled {
        t_ns: t.nanos(),
        link: message.link,
        seq: message.parcel.number,
        sent_ns: message.parcel.sent.nanos(),
        due_ns: message.due.nanos(),
        fate,
        late_ns,
    }
}

/// A message that never left its sender.
pub(super) fn unsent(now: Time, parcel: &Parcel, link: usize) -> UnderWay {
    UnderWay { due: now, parcel: parcel.clone(), link, copy: false, copy_due: None, corrupt: false, reception: None }
}
