//! Being awake when a deadline comes.
//!
//! Systems wake a thread late, by some 10 to 100 µs most of the time. So it asks to be woken earlier by what it has learned, and
//! stays awake for the rest of the time.

use std::time::{Duration, Instant};

use crate::queue::{Events, Wake};

/// How long before a moment a thread must ask to be woken so as to be awake at it, and whether it may.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lead {
    length: Duration,
    purse: Purse,
}

impl Lead {
    /// More than this is never spent awake before a deadline.
    const MOST: Duration = Duration::from_micros(100);
    const STEP: Duration = Duration::from_micros(1);

    /// Nothing is known yet.
    pub(crate) fn new() -> Lead {
        Lead { length: Duration::ZERO, purse: Purse { saved: Duration::ZERO, counted: Instant::now() } }
    }

    /// Waits as [`Events::wait`] does, without patience, and is awake when the deadline comes; in so far as there is time for it.
    pub(crate) fn wait<E>(&mut self, events: &Events<E>, deadline: Instant) -> Wake<()> {
        let begun = Instant::now();
        if !self.purse.affords(Lead::MOST, begun) {
            return events.wait(Some(deadline), false);
        }
        let ask = deadline.checked_sub(self.length).unwrap_or(deadline);
        let end = events.wait(Some(ask), false);
        if end != Wake::Deadline {
            return end;
        }
        let awake = Instant::now();
        if begun < ask {
            self.learn(awake - ask);
        }
        let end = events.watch(deadline);
        self.purse.spend(awake.elapsed());
        end
    }

    /// The thread was woken so late. The lead settles where it is enough three times out of four.
    fn learn(&mut self, late: Duration) {
        self.length = match late > self.length {
            true => (self.length + 3 * Lead::STEP).min(Lead::MOST),
            false => self.length.saturating_sub(Lead::STEP),
        };
    }
}

/// Time that may be spent awake: an eighth of what passes, so that thousands of deadlines a second do not take a processor from
/// the rest of a fleet.
#[derive(Clone, Copy, Debug)]
struct Purse {
    saved: Duration,
    counted: Instant,
}

impl Purse {
    const SHARE: u32 = 8;
    /// No more is saved up than this.
    const MOST: Duration = Duration::from_millis(10);

    /// Whether so much may be spent by now.
    fn affords(&mut self, length: Duration, now: Instant) -> bool {
        let passed = now.saturating_duration_since(self.counted);
        self.saved = (self.saved + passed / Purse::SHARE).min(Purse::MOST);
        self.counted = now;
        self.saved >= length
    }

    fn spend(&mut self, length: Duration) {
        self.saved = self.saved.saturating_sub(length);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::queue::queue;

    #[test]
    fn waiting_with_a_lead_never_ends_early_and_hears_messages() {
        let (feed, events) = queue(9);
        let mut lead = Lead::new();
        // The first have nothing to spend, the last have.
        for micros in [0, 1, 50, 3_000, 300, 50, 1, 0] {
            let deadline = Instant::now() + Duration::from_micros(micros);
            assert_eq!(lead.wait(&events, deadline), Wake::Deadline);
            assert!(Instant::now() >= deadline);
        }
        feed.lasting(1).expect("room");
        assert_eq!(lead.wait(&events, Instant::now() + Duration::from_secs(600)), Wake::Message(()));
        assert_eq!(events.pop(), Some(1));
        drop(feed);
        assert_eq!(lead.wait(&events, Instant::now() + Duration::from_secs(600)), Wake::Closed);
    }

    proptest! {
        /// Wake-ups that are late by anything up to a limit: a quarter of them is later than the lead, to a few steps.
        #[test]
        fn a_lead_is_enough_three_times_out_of_four(limit in 12u64..120, seed: u64) {
            let mut lead = Lead::new();
            let mut number = seed;
            let mut late = || {
                // A full-period sequence: every lateness is as frequent as the others.
                number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                Duration::from_micros(limit) * ((number >> 40) as u32) / (1 << 24)
            };
            (0..2_000).for_each(|_| lead.learn(late()));
            let mut enough = 0;
            for _ in 0..4_000 {
                let late = late();
                enough += u32::from(late <= lead.length);
                lead.learn(late);
            }
            prop_assert!((2_900..3_100).contains(&enough), "{enough} of 4000");
        }

        #[test]
        fn a_lead_has_a_limit(late in prop::collection::vec(0u64..1 << 40, 0..400)) {
            let mut lead = Lead::new();
            for late in late {
                lead.learn(Duration::from_nanos(late));
                prop_assert!(lead.length <= Lead::MOST);
            }
        }

        /// However often there are deadlines, and whenever.
        #[test]
        fn no_more_than_an_eighth_of_the_time_is_spent(gaps in prop::collection::vec((0u64..2_000, 0u64..=100), 1..2_000)) {
            let begun = Instant::now();
            let mut purse = Purse { saved: Duration::ZERO, counted: begun };
            let (mut now, mut spent) = (begun, Duration::ZERO);
            for (gap, wanted) in gaps {
                now += Duration::from_micros(gap);
                if purse.affords(Lead::MOST, now) {
                    let length = Duration::from_micros(wanted);
                    purse.spend(length);
                    now += length;
                    spent += length;
                }
                prop_assert!(spent * Purse::SHARE <= now - begun);
            }
        }
    }
}
