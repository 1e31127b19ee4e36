//! Medium access: when a sender may speak, for how long, and what that does to others.

use crate::time::{Span, Time};

/// What a sender does with a new message when as many as may are already waiting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenFull {
    /// The new message is dropped.
    #[default]
    DropNew,
    /// The message that has waited longest is dropped: what is on the air is as fresh as it can be.
    DropOld,
}

/// The medium that all vehicles share.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Bits that a sender puts on the air per second \[bit/s\].
    pub rate: f64,
    /// Time on the air before the first bit of each message.
    pub preamble: Span,
    /// Size of every message on the air \[bytes\]; each its own if there is none.
    pub packet: Option<usize>,
    /// Messages that may wait at one sender, at least 1.
    pub queue: usize,
    /// What happens beyond that.
    pub when_full: WhenFull,
    /// Each message waits a random time up to this before it is sent, so that those who speak at the same instant do
    /// not always collide (pure ALOHA).
    pub backoff: Span,
    /// A vehicle cannot hear while it speaks.
    pub half_duplex: bool,
    /// Messages that overlap at a receiver destroy one another.
    pub collisions: bool,
    /// Who may speak when; anyone at any time without.
    pub slots: Option<Slots>,
    /// Greatest share of time δ that a sender may speak, in (0, 1].
    pub duty_cycle: f64,
}

/// Time-division multiple access: slots that recur with a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Slots {
    slot: Span,
    guard: Span,
    /// The slots of each vehicle within a frame.
    of: Vec<Vec<i64>>,
    /// Slots in a frame.
    frame: i64,
}

impl Slots {
    /// Slots of a length, of which the last `guard` stays silent, owned in this order by `n` vehicles.
    pub fn new(slot: Span, guard: Span, order: &[usize], n: usize) -> Slots {
        let mut of = vec![Vec::new(); n];
        for (k, vehicle) in (0..).zip(order) {
            if let Some(slots) = of.get_mut(*vehicle) {
                slots.push(k);
            }
        }
        Slots { slot, guard, of, frame: order.len() as i64 }
    }

    /// The time in a slot in which one may speak.
    pub fn usable(&self) -> Span {
        Span::from_nanos(self.slot.nanos() - self.guard.nanos())
    }

    /// The first instant from `earliest` on at which a vehicle can begin and end within a slot of its own; never, if it
    /// has none or they are too short.
    fn first(&self, vehicle: usize, earliest: Time, airtime: Span) -> Time {
        let latest_in_slot = self.usable().nanos() - airtime.nanos();
        let frame = self.slot.nanos().saturating_mul(self.frame);
        if latest_in_slot < 0 || frame <= 0 {
            return Time::MAX;
        }
        let this_frame = earliest.nanos().div_euclid(frame).saturating_mul(frame);
        let starts = [this_frame, this_frame.saturating_add(frame)].into_iter().flat_map(|begin| {
            self.of.get(vehicle).into_iter().flatten().map(move |k| begin.saturating_add(k * self.slot.nanos()))
        });
        let fits = starts
            .map(|begin| (begin, begin.max(earliest.nanos())))
            .filter(|(begin, start)| start - begin <= latest_in_slot);
        Time::from_nanos(fits.map(|(_, start)| start).min().unwrap_or(i64::MAX))
    }
}

impl Medium {
    /// How long a message is on the air: A = 8 · bytes / rate + preamble.
    pub fn airtime(&self, bytes: usize) -> Span {
        Span::from_secs(8.0 * self.packet.unwrap_or(bytes) as f64 / self.rate) + self.preamble
    }

    /// When a vehicle begins to send a message of this airtime that could go out at `earliest`.
    pub fn start(&self, vehicle: usize, earliest: Time, airtime: Span) -> Time {
        self.slots.as_ref().map_or(earliest, |slots| slots.first(vehicle, earliest, airtime))
    }

    /// When a sender that began at `start` may begin again: silence of A(1/δ − 1) follows each message.
    pub fn free_after(&self, start: Time, airtime: Span) -> Time {
        start + Span::from_secs(airtime.secs() / self.duty_cycle)
    }

    /// How long a message waits at random, with its own uniform number.
    pub fn wait(&self, u: f64) -> Span {
        Span::from_nanos((self.backoff.nanos() as f64 * u) as i64)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn s(seconds: f64) -> Span {
        Span::from_secs(seconds)
    }

    fn at(seconds: f64) -> Time {
        Time::from_secs(seconds)
    }

    fn medium(slots: Option<Slots>) -> Medium {
        let (rate, preamble, packet) = (80.0, s(0.3), Some(17));
        let (when_full, backoff, duty_cycle) = (WhenFull::DropNew, Span::ZERO, 1.0);
        let (half_duplex, collisions) = (true, true);
        Medium { rate, preamble, packet, queue: 1, when_full, backoff, half_duplex, collisions, slots, duty_cycle }
    }

    #[test]
    fn seventeen_bytes_at_eighty_bits_a_second_take_one_point_seven_seconds() {
        let medium = medium(None);
        assert_eq!(medium.airtime(39), s(2.0), "packed, after a preamble of 0.3 s");
        assert_eq!(Medium { packet: None, ..medium }.airtime(40), s(4.3), "as it is");
    }

    #[test]
    fn a_vehicle_speaks_in_its_own_slot_and_ends_before_the_guard_time() {
        let medium = medium(Some(Slots::new(s(15.0), s(3.0), &[0, 1, 2], 3)));
        for (vehicle, earliest, start) in
            [(0, 0.0, 0.0), (0, 9.9, 9.9), (0, 10.1, 45.0), (1, 0.0, 15.0), (1, 44.0, 60.0), (2, 44.9, 75.0)]
        {
            assert_eq!(medium.start(vehicle, at(earliest), s(2.0)), at(start), "vehicle {vehicle} from {earliest} s");
        }
    }

    #[test]
    fn a_slot_shorter_than_the_airtime_is_never_used() {
        let start = |slots: Slots, vehicle: usize| medium(Some(slots)).start(vehicle, at(1.0), s(2.0));
        assert_eq!(start(Slots::new(s(3.0), s(1.5), &[0], 1), 0), Time::MAX);
        assert_eq!(start(Slots::new(s(15.0), s(1.0), &[0], 2), 1), Time::MAX, "has no slot");
        assert_eq!(start(Slots::new(s(15.0), s(1.0), &[], 2), 1), Time::MAX, "no slots at all");
    }

    #[test]
    fn the_duty_cycle_is_kept() {
        let medium = Medium { duty_cycle: 0.1, ..medium(None) };
        assert_eq!(medium.free_after(at(5.0), s(2.0)), at(25.0), "2 s on the air, 18 s of silence");
        assert_eq!(Medium { duty_cycle: 1.0, ..medium }.free_after(at(5.0), s(2.0)), at(7.0));
    }

    proptest! {
        /// Slots of different vehicles never overlap on the air.
        #[test]
        fn every_transmission_lies_in_a_slot_of_its_sender(
            earliest in 0.0..1e4f64, vehicle in 0usize..3, order in prop::collection::vec(0usize..3, 1..8),
            slot in 2.5..20.0f64, guard in 0.0..0.5f64,
        ) {
            let medium = medium(Some(Slots::new(s(slot), s(guard), &order, 3)));
            let start = medium.start(vehicle, at(earliest), s(2.0));
            if order.contains(&vehicle) {
                prop_assert!(start >= at(earliest));
                let (slot, guard) = (s(slot).nanos(), s(guard).nanos());
                prop_assert_eq!(order[(start.nanos() / slot) as usize % order.len()], vehicle);
                prop_assert!(start.nanos() % slot + s(2.0).nanos() <= slot - guard);
                prop_assert!((start - at(earliest)).nanos() <= slot * (order.len() as i64 + 1));
            } else {
                prop_assert_eq!(start, Time::MAX);
            }
        }
    }
}
