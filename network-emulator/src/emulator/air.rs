//! What arrives at one receiver over a shared medium: messages that overlap, and words of its own.
//!
//! Every reception is entered when its transmission begins and leaves when it ends. Whatever could still disturb it begins
//! before it ends, hence has been entered by then. Both of two that overlap are spoilt, so it does not matter which of
//! them was entered first. A sender speaks one message after the other, so its own never spoil one another, even if the
//! way gets shorter meanwhile and the next begins to arrive a moment before the last has ended.

use std::collections::{BTreeMap, BTreeSet};

use common::network::Medium;
use common::record::Fate;
use common::time::{Span, Time};

/// The receptions under way at one vehicle, by when they begin: what overlaps is found without a look at all others.
#[derive(Default)]
pub(super) struct Air {
    receptions: BTreeMap<Place, Reception>,
    /// Those that nothing has spoilt.
    clean: BTreeSet<Place>,
    /// The longest reception so far: none that began earlier than this before another can overlap it.
    longest: Span,
    /// When the vehicle itself began and ends its latest transmission.
    speaks: Option<(Time, Time)>,
}

/// Where a reception is found again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    /// When it begins.
    pub(super) begin: Time,
    /// Tells those that begin at the same instant apart.
    pub(super) key: u64,
}

struct Reception {
    from: usize,
    end: Time,
    spoilt: Option<Fate>,
}

impl Air {
    /// A message of this sender arrives from its begin until `end`.
    pub(super) fn enter(&mut self, medium: &Medium, place: Place, from: usize, end: Time) {
        let during = (place.begin, end);
        self.longest = self.longest.max(end - place.begin);
        let mut spoilt = None;
        if medium.half_duplex && self.speaks.is_some_and(|own| overlap(own, during)) {
            spoilt = Some(Fate::HalfDuplex);
        }
        if medium.collisions {
            let around = self.around(during);
            let disturbs = |(other, reception): (&Place, &Reception)| {
                reception.from != from && overlap((other.begin, reception.end), during)
            };
            if self.receptions.range(around.clone()).any(disturbs) {
                spoilt.get_or_insert(Fate::Collision);
            }
            // Of many that overlap, most are spoilt already: only the others are looked at.
            let others: Vec<Place> = self.clean.range(around).copied().collect();
            for other in others {
                if self.receptions.get(&other).is_some_and(|reception| disturbs((&other, reception))) {
                    self.spoil(other, Fate::Collision);
                }
            }
        }
        if spoilt.is_none() {
            self.clean.insert(place);
        }
        self.receptions.insert(place, Reception { from, end, spoilt });
    }

    /// The vehicle itself speaks during \[begin, end): what it would have heard meanwhile is lost on it.
    pub(super) fn speak(&mut self, medium: &Medium, begin: Time, end: Time) {
        self.speaks = Some((begin, end));
        if medium.half_duplex {
            let around = self.around((begin, end));
            for (other, reception) in self.receptions.range_mut(around) {
                if overlap((other.begin, reception.end), (begin, end)) {
                    // Being deaf goes before colliding, whichever came first.
                    reception.spoilt = Some(Fate::HalfDuplex);
                    self.clean.remove(other);
                }
            }
        }
    }

    /// A reception is over: what spoilt it, if anything did.
    pub(super) fn leave(&mut self, place: Place) -> Option<Fate> {
        self.clean.remove(&place);
        self.receptions.remove(&place)?.spoilt
    }

    /// Where receptions begin that may overlap this time.
    fn around(&self, (begin, end): (Time, Time)) -> std::ops::Range<Place> {
        Place { begin: begin - self.longest, key: 0 }..Place { begin: end, key: 0 }
    }

    fn spoil(&mut self, place: Place, cause: Fate) {
        self.clean.remove(&place);
        if let Some(reception) = self.receptions.get_mut(&place) {
            reception.spoilt.get_or_insert(cause);
        }
    }
}

fn overlap(a: (Time, Time), b: (Time, Time)) -> bool {
    a.0 < b.1 && b.0 < a.1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn medium(half_duplex: bool) -> Medium {
        let section = format!("rate_bps = 80.0\nhalf_duplex = {half_duplex}\ncollisions = true");
        let text = include_str!("../../../missions/auv-helix.toml");
        let text = text.replace(
            "delay = { constant",
            &format!("medium = {{ {} }}\ndelay = {{ constant", section.replace('\n', ", ")),
        );
        common::mission::Mission::parse("m.toml", &text).expect("sound").medium.expect("there is one")
    }

    fn at(tenths: i64) -> Time {
        Time::from_nanos(tenths * 100_000_000)
    }

    proptest! {
        /// What spoils what is the same as if each were held against every other.
        #[test]
        fn what_overlaps_is_found_as_by_looking_at_all(
            half_duplex: bool,
            steps in prop::collection::vec((0usize..5, 0i64..6, 0i64..30, 1i64..15), 1..60),
        ) {
            let medium = medium(half_duplex);
            let mut air = Air::default();
            // (from, begin, end) and what spoilt it, with its own words among them as sender 4.
            let mut all: Vec<(usize, i64, i64, Option<Fate>)> = Vec::new();
            let (mut now, mut speaks) = (0, None);
            for (key, (from, wait, way, length)) in (0..).zip(steps) {
                now += wait;
                let (begin, end) = (now + way, now + way + length);
                let meets = |a: (i64, i64), b: (i64, i64)| a.0 < b.1 && b.0 < a.1;
                if from == 4 {
                    // Its own words begin now.
                    let own = (now, now + length);
                    air.speak(&medium, at(own.0), at(own.1));
                    speaks = Some(own);
                    for other in all.iter_mut().filter(|other| half_duplex && meets((other.1, other.2), own)) {
                        other.3 = Some(Fate::HalfDuplex);
                    }
                    all.push((from, 0, 0, None));
                    continue;
                }
                let mut spoilt = speaks.filter(|own| half_duplex && meets(*own, (begin, end))).map(|_| Fate::HalfDuplex);
                for other in all.iter_mut().filter(|o| o.0 != from && o.0 != 4 && meets((o.1, o.2), (begin, end))) {
                    other.3.get_or_insert(Fate::Collision);
                    spoilt.get_or_insert(Fate::Collision);
                }
                air.enter(&medium, Place { begin: at(begin), key }, from, at(end));
                all.push((from, begin, end, spoilt));
            }
            for (key, (from, begin, _, spoilt)) in (0..).zip(all) {
                if from < 4 {
                    prop_assert_eq!(air.leave(Place { begin: at(begin), key }), spoilt, "message {}", key);
                }
            }
        }
    }
}
