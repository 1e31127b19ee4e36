//! The ledger of a directed link: sent = delivered + dropped + in flight, at every instant.

use common::record::Fate;

/// What became of the messages of one directed link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ledger {
    /// Taken from the sender.
    pub sent: u64,
    /// Handed to the receiver.
    pub delivered: u64,
    /// Lost by the loss model.
    pub lost: u64,
    /// Arrived while the link was down.
    pub link_down: u64,
    /// Refused because too many were under way.
    pub queue_full: u64,
    /// Still under way.
    pub in_flight: u64,
}

impl Ledger {
    /// A message was taken and is under way.
    pub(crate) fn take(&mut self) {
        self.sent += 1;
        self.in_flight += 1;
    }

    /// The fate of a message under way was decided.
    pub(crate) fn settle(&mut self, fate: Fate) {
        let column = match fate {
            Fate::Delivered => &mut self.delivered,
            Fate::Lost => &mut self.lost,
            Fate::LinkDown => &mut self.link_down,
            Fate::QueueFull => &mut self.queue_full,
            Fate::InFlight => return,
        };
        *column += 1;
        self.in_flight -= 1;
    }

    /// Dropped for any cause.
    pub fn dropped(&self) -> u64 {
        self.lost + self.link_down + self.queue_full
    }

    /// Whether it adds up.
    pub fn balances(&self) -> bool {
        self.sent == self.delivered + self.dropped() + self.in_flight
    }
}
