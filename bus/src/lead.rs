//! Being awake when a deadline comes.
//!
//! Systems wake a thread late: by 10 to 100 µs, much the same time after time, on one machine and another. So it asks to be
//! woken earlier by what it has learned, and stays awake for the rest of the time.

use std::time::{Duration, Instant};

use crate::queue::{Events, Wake};

/// How long before a moment a thread must ask to be woken so as to be awake at it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lead(Duration);

impl Lead {
    /// More than this is never spent awake before a deadline: a machine that wakes later still is too busy for it.
    const MOST: Duration = Duration::from_micros(100);
    const STEP: Duration = Duration::from_micros(1);

    /// Waits as [`Events::wait`] does, without patience, and is awake when the deadline comes.
    pub(crate) fn wait<E>(&mut self, events: &Events<E>, deadline: Instant) -> Wake<()> {
        let ask = deadline.checked_sub(self.0).unwrap_or(deadline);
        let sleeps = Instant::now() < ask;
        let end = events.wait(Some(ask), false);
        if end != Wake::Deadline {
            return end;
        }
        if sleeps {
            self.learn(ask.elapsed());
        }
        events.watch(deadline)
    }

    /// The thread was woken so late. The lead settles where it is enough three times out of four.
    fn learn(&mut self, late: Duration) {
        self.0 = match late > self.0 {
            true => (self.0 + 3 * Lead::STEP).min(Lead::MOST),
            false => self.0.saturating_sub(Lead::STEP),
        };
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
        let mut lead = Lead::default();
        for micros in [0, 1, 50, 300, 2_000] {
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
            let mut lead = Lead::default();
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
                enough += u32::from(late <= lead.0);
                lead.learn(late);
            }
            prop_assert!((2_900..3_100).contains(&enough), "{enough} of 4000");
        }

        #[test]
        fn a_busy_machine_is_not_made_busier(late in prop::collection::vec(0u64..1 << 40, 0..400)) {
            let mut lead = Lead::default();
            for late in late {
                lead.learn(Duration::from_nanos(late));
                prop_assert!(lead.0 <= Lead::MOST);
            }
        }
    }
}
