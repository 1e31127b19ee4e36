//! The ledger of a directed link: sent = delivered + dropped + in flight, at every instant.
//!
//! Copies that the network makes were sent by nobody. They have a ledger of their own, with the same equation: copies made
//! = copies delivered + copies dropped + copies in flight.

use common::record::Fate;

/// What became of the messages of one directed link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ledger {
    /// Taken from the sender.
    pub sent: u64,
    /// Still waiting or under way.
    pub in_flight: u64,
    /// Second copies made.
    pub copies: u64,
    /// Second copies still under way.
    pub copies_in_flight: u64,
    settled: [u64; Fate::ALL.len()],
}

impl Ledger {
    /// A message was taken and is under way.
    pub(crate) fn take(&mut self) {
        self.sent += 1;
        self.in_flight += 1;
    }

    /// A second copy was made of a message under way.
    pub(crate) fn copy(&mut self) {
        self.copies += 1;
        self.copies_in_flight += 1;
    }

    /// The fate of a message or copy under way was decided.
    pub(crate) fn settle(&mut self, fate: Fate) {
        match fate {
            Fate::InFlight | Fate::CopyInFlight => return,
            Fate::Copied | Fate::CopyDropped => self.copies_in_flight -= 1,
            _ => self.in_flight -= 1,
        }
        self.settled[fate as usize] += 1;
        debug_assert!(self.balances(), "{self:?}");
    }

    /// How many messages met this fate.
    pub fn of(&self, fate: Fate) -> u64 {
        match fate {
            Fate::InFlight => self.in_flight,
            Fate::CopyInFlight => self.copies_in_flight,
            fate => self.settled[fate as usize],
        }
    }

    /// Handed to the receiver.
    pub fn delivered(&self) -> u64 {
        self.of(Fate::Delivered)
    }

    /// Dropped for any cause.
    pub fn dropped(&self) -> u64 {
        Fate::DROPS.iter().map(|cause| self.of(*cause)).sum()
    }

    /// Whether it adds up.
    pub fn balances(&self) -> bool {
        self.sent == self.delivered() + self.dropped() + self.in_flight
            && self.copies == self.of(Fate::Copied) + self.of(Fate::CopyDropped) + self.copies_in_flight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fate_is_a_number_of_its_own_and_a_drop_a_delivery_a_copy_or_under_way() {
        for (number, fate) in Fate::ALL.into_iter().enumerate() {
            assert_eq!(fate as usize, number);
            let others = [Fate::Delivered, Fate::InFlight].contains(&fate) || fate.is_of_copy();
            assert!(others ^ Fate::DROPS.contains(&fate), "{fate:?}");
        }
    }

    #[test]
    fn each_fate_balances() {
        for fate in Fate::ALL {
            let mut ledger = Ledger::default();
            ledger.take();
            ledger.copy();
            ledger.settle(fate);
            assert!(ledger.balances() && ledger.of(fate) == 1, "{fate:?}: {ledger:?}");
        }
    }
}
