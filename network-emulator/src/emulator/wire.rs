//! One directed link: what it does to a message is a function of seed, link and message number.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use common::mission::Link;
use common::network::{Delay, Loss, Range};
use common::random::{LANES, Stream};
use common::record::Fate;
use common::time::{Span, Time};

use crate::ledger::Ledger;

/// Lanes of the numbers of a message in the first layer's stream. A layer's loss also takes 0, 6 and 7.
const DELAY: usize = 1;
const RANGE: usize = 2;
const DUPLICATE: usize = 3;
const DELAY_OF_COPY: usize = 4;
const CORRUPT: usize = 5;

/// A directed link at work.
pub(super) struct Wire {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) ledger: Ledger,
    layers: Vec<Layer>,
    range: Range,
    duplicate: f64,
    corrupt: f64,
    in_order: bool,
    /// Most messages under way, and most copies.
    queue: usize,
    /// Whether distances make any difference.
    pub(super) needs_distance: bool,
    messages: Places,
    /// Copies have places of their own, so that they take none from what was sent.
    copies: Places,
    /// When the latest message so far arrives; copies hold nothing back.
    latest: Time,
}

/// The places of a queue, by when each is free again. Kept apart from the ledger: a stepped run settles arrivals ahead of
/// what is sent before them, and must find the same queue as a run in real time.
#[derive(Default)]
struct Places(BinaryHeap<Reverse<Time>>);

impl Places {
    /// How many are taken at this instant. What is due at this very instant is still there: the network takes what was
    /// sent before it delivers.
    fn taken(&mut self, now: Time) -> usize {
        while self.0.peek().is_some_and(|Reverse(due)| *due < now) {
            self.0.pop();
        }
        self.0.len()
    }

    fn take(&mut self, until: Time) {
        self.0.push(Reverse(until));
    }
}

struct Layer {
    stream: Stream,
    delay: Delay,
    loss: Option<Loss>,
    /// Whether it takes random numbers at all.
    draws: bool,
}

/// What a link makes of one message.
pub(super) struct Verdict {
    /// When it is to arrive, or would have been.
    pub(super) due: Time,
    /// Why it is dropped on the spot, if it is.
    pub(super) dropped: Option<Fate>,
    /// When a second copy arrives, if there is one.
    pub(super) copy: Option<Time>,
    /// The number of the bit that is flipped, if one is.
    pub(super) flipped: Option<usize>,
}

impl Wire {
    pub(super) fn new(link: &Link, seed: u64) -> Wire {
        let of_message = link.duplicate > 0.0 || link.corrupt > 0.0 || matches!(link.range, Range::Curve(_));
        let layer = |(index, layer): (usize, &common::mission::Layer)| Layer {
            stream: Stream::new(seed, &layer.stream),
            delay: layer.delay.clone(),
            loss: layer.loss.clone(),
            draws: (index == 0 && of_message)
                || layer.loss.is_some()
                || !matches!(layer.delay, Delay::Constant(_) | Delay::Distance { .. }),
        };
        Wire {
            from: link.from,
            to: link.to,
            ledger: Ledger::default(),
            layers: link.layers.iter().enumerate().map(layer).collect(),
            range: link.range.clone(),
            duplicate: link.duplicate,
            corrupt: link.corrupt,
            in_order: link.in_order,
            queue: link.queue,
            needs_distance: link.needs_distance(),
            messages: Places::default(),
            copies: Places::default(),
            latest: Time::from_nanos(i64::MIN),
        }
    }

    /// Decides about message `seq` of `bits` bits, which begins at `start` and is on the air for `airtime`, over this
    /// distance.
    pub(super) fn decide(&mut self, seq: u32, bits: usize, (start, airtime): (Time, Span), distance: f64) -> Verdict {
        let number = u64::from(seq);
        let mut first = [0.0; LANES];
        let (mut delay, mut delay_of_copy, mut lost) = (Span::ZERO, Span::ZERO, false);
        for (index, layer) in self.layers.iter_mut().enumerate() {
            let drawn = if layer.draws { layer.stream.units_at(number) } else { [0.0; LANES] };
            delay = delay + layer.delay.of(drawn[DELAY], distance);
            lost |= layer.loss.as_mut().is_some_and(|loss| loss.loses(&mut layer.stream, number, &drawn));
            if self.duplicate > 0.0 {
                delay_of_copy = delay_of_copy + layer.delay.of(drawn[DELAY_OF_COPY], distance);
            }
            if index == 0 {
                first = drawn;
            }
        }
        let mut due = start + airtime + delay;
        if self.in_order {
            due = due.max(self.latest);
        }
        let dropped = if first[RANGE] >= self.range.success(distance) {
            Some(Fate::OutOfRange)
        } else if lost {
            Some(Fate::Lost)
        } else if self.messages.taken(start) >= self.queue {
            Some(Fate::QueueFull)
        } else {
            None
        };
        let mut verdict = Verdict { due, dropped, copy: None, flipped: None };
        if dropped.is_some() {
            return verdict;
        }
        self.messages.take(due);
        self.latest = due.max(self.latest);
        if first[CORRUPT] < self.corrupt {
            // Given that it is below the probability, the number is uniform up to it.
            verdict.flipped =
                Some(((first[CORRUPT] / self.corrupt * bits as f64) as usize).min(bits.saturating_sub(1)));
        } else if first[DUPLICATE] < self.duplicate && self.copies.taken(start) < self.queue {
            // A copy does not come before its original.
            let due = (start + airtime + delay_of_copy).max(due);
            self.copies.take(due);
            verdict.copy = Some(due);
        }
        verdict
    }
}

/// The same bytes with one bit flipped.
pub(super) fn flip(bytes: &[u8], bit: usize) -> Arc<[u8]> {
    let mut bytes = bytes.to_vec();
    if let Some(byte) = bytes.get_mut(bit / 8) {
        *byte ^= 1 << (bit % 8);
    }
    bytes.into()
}
