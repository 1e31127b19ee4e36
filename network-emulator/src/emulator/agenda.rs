//! What is under way, in the order in which it arrives.
//!
//! One heap of everything costs the more for each message the more there are: its depth grows, and each step down is further
//! away in memory. So only what is due next is in a heap; the rest lies in buckets by when it is due, unordered.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use common::time::Time;

use super::parcel::UnderWay;

/// A bucket is 2²⁴ ns wide, 17 ms: small at the rates of fleets, and few in the delays of their networks.
const WIDTH_BITS: u32 = 24;

/// Messages under way.
#[derive(Default)]
pub(super) struct Agenda {
    /// What is due in bucket `reached` or before; empty only if there is nothing at all.
    next: BinaryHeap<Reverse<UnderWay>>,
    reached: i64,
    /// What is due later, by bucket; no bucket is empty.
    later: BTreeMap<i64, Vec<UnderWay>>,
}

fn bucket(due: Time) -> i64 {
    due.nanos() >> WIDTH_BITS
}

impl Agenda {
    pub(super) fn push(&mut self, message: UnderWay) {
        let bucket = bucket(message.due);
        if self.next.is_empty() {
            self.reached = bucket;
        }
        if bucket <= self.reached {
            self.next.push(Reverse(message));
        } else {
            self.later.entry(bucket).or_default().push(message);
        }
    }

    /// When the first is due.
    pub(super) fn due(&self) -> Option<Time> {
        self.next.peek().map(|Reverse(message)| message.due)
    }

    /// The first.
    pub(super) fn pop(&mut self) -> Option<UnderWay> {
        let Reverse(message) = self.next.pop()?;
        if self.next.is_empty()
            && let Some((bucket, messages)) = self.later.pop_first()
        {
            self.reached = bucket;
            self.next = messages.into_iter().map(Reverse).collect();
        }
        Some(message)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::parcel::Parcel;
    use super::*;

    fn message((due, sent, from): (i64, i64, usize), number: u64) -> UnderWay {
        let parcel = Parcel { from, seq: 0, number, sent: Time::from_nanos(sent), bytes: [].into() };
        let due = Time::from_nanos(due);
        UnderWay { due, parcel, link: 0, copy: false, copy_due: None, corrupt: false, reception: None }
    }

    proptest! {
        /// Whatever is put in and taken out when: the first is the one that a sorted list has first.
        #[test]
        fn the_first_of_all_comes_out_first(
            steps in prop::collection::vec(
                // Far apart, within a bucket, and at the same instant; also before zero.
                ((prop_oneof![-1i64 << 27..1 << 33, 0i64..1 << 26, 0i64..3], 0i64..3, 0usize..3), 0usize..4),
                1..300,
            )
        ) {
            let (mut agenda, mut sorted) = (Agenda::default(), Vec::<UnderWay>::new());
            for (number, (what, pops)) in (0..).zip(steps) {
                let message = message(what, number);
                sorted.insert(sorted.partition_point(|other| *other < message), message.clone());
                agenda.push(message);
                for _ in 0..pops.min(sorted.len()) {
                    prop_assert_eq!(agenda.due(), Some(sorted[0].due));
                    prop_assert_eq!(agenda.pop(), Some(sorted.remove(0)));
                }
            }
            for expected in sorted {
                prop_assert_eq!(agenda.pop(), Some(expected));
            }
            prop_assert_eq!((agenda.due(), agenda.pop()), (None, None));
        }
    }
}
