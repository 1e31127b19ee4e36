//! What arrives at one receiver over a shared medium: messages that overlap, and words of its own.
//!
//! Every reception is entered when its transmission begins and leaves when it ends. Whatever could still disturb it begins
//! before it ends, hence has been entered by then. Both of two that overlap are spoilt, so it does not matter which of
//! them was entered first.

use common::network::Medium;
use common::record::Fate;
use common::time::Time;

/// The receptions under way at one vehicle.
#[derive(Default)]
pub(super) struct Air {
    receptions: Vec<Reception>,
    /// When the vehicle itself began and ends its latest transmission.
    speaks: Option<(Time, Time)>,
}

struct Reception {
    key: u64,
    begin: Time,
    end: Time,
    spoilt: Option<Fate>,
}

impl Air {
    /// A message arrives during \[begin, end).
    pub(super) fn enter(&mut self, medium: &Medium, key: u64, begin: Time, end: Time) {
        let mut spoilt = None;
        if medium.half_duplex && self.speaks.is_some_and(|own| overlap(own, (begin, end))) {
            spoilt = Some(Fate::HalfDuplex);
        }
        if medium.collisions {
            for other in self.receptions.iter_mut().filter(|other| overlap((other.begin, other.end), (begin, end))) {
                other.spoilt.get_or_insert(Fate::Collision);
                spoilt.get_or_insert(Fate::Collision);
            }
        }
        self.receptions.push(Reception { key, begin, end, spoilt });
    }

    /// The vehicle itself speaks during \[begin, end): what it would have heard meanwhile is lost on it.
    pub(super) fn speak(&mut self, medium: &Medium, begin: Time, end: Time) {
        self.speaks = Some((begin, end));
        if medium.half_duplex {
            for reception in self.receptions.iter_mut().filter(|r| overlap((r.begin, r.end), (begin, end))) {
                // Being deaf goes before colliding, whichever came first.
                reception.spoilt = Some(Fate::HalfDuplex);
            }
        }
    }

    /// A reception is over: what spoilt it, if anything did.
    pub(super) fn leave(&mut self, key: u64) -> Option<Fate> {
        let index = self.receptions.iter().position(|reception| reception.key == key)?;
        self.receptions.swap_remove(index).spoilt
    }
}

fn overlap(a: (Time, Time), b: (Time, Time)) -> bool {
    a.0 < b.1 && b.0 < a.1
}
