//! What passed on a line, and what did not.

use std::sync::atomic::{AtomicU64, Ordering};

/// One end's count of a line's messages since the line was first opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// State-plane messages handed to the program.
    pub state_in: u64,
    /// Mission-plane messages handed to the program.
    pub mission_in: u64,
    /// State-plane messages given to the transport.
    pub state_out: u64,
    /// Mission-plane messages given to the transport or to the line's backlog.
    pub mission_out: u64,
    /// State-plane messages dropped because the program did not empty its queue.
    pub state_dropped: u64,
    /// State-plane messages dropped on the way out, because the other end does not keep up or is gone.
    pub state_unsent: u64,
    /// Mission-plane messages dropped because the program did not empty its queue.
    pub mission_dropped: u64,
    /// Mission-plane messages refused because the other end takes nothing and the backlog is full.
    pub backlogged: u64,
    /// Frames that mean nothing, or interrupt a message.
    pub garbage: u64,
    /// State-plane messages longer than that plane carries.
    pub oversized: u64,
}

/// [`Counts`] in the making.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Whose messages they are.
    source: String,
    pub(crate) state_in: Counter,
    pub(crate) mission_in: Counter,
    pub(crate) state_out: Counter,
    pub(crate) mission_out: Counter,
    pub(crate) state_dropped: Counter,
    pub(crate) state_unsent: Counter,
    pub(crate) mission_dropped: Counter,
    pub(crate) backlogged: Counter,
    pub(crate) garbage: Counter,
    pub(crate) oversized: Counter,
}

impl Tally {
    /// Nothing has passed from this source yet.
    pub(crate) fn of(source: &str) -> Tally {
        Tally { source: source.into(), ..Tally::default() }
    }

    /// A frame made no sense; the first is told.
    pub(crate) fn ignore_garbage(&self) {
        if self.garbage.add_one() == 1 {
            tracing::warn!("ignored what {} sent: it makes no sense; what follows is counted", self.source);
        }
    }

    /// A message was longer than its plane carries; the first is told.
    pub(crate) fn ignore_oversized(&self) {
        if self.oversized.add_one() == 1 {
            tracing::warn!("ignored what {} sent: it is too long; what follows is counted", self.source);
        }
    }

    /// A packet that was to be handed to the program had to make place for a newer one.
    pub(crate) fn drop_state(&self) {
        self.state_in.take_back(1);
        self.state_dropped.add(1);
    }

    pub(crate) fn counts(&self) -> Counts {
        Counts {
            state_in: self.state_in.get(),
            mission_in: self.mission_in.get(),
            state_out: self.state_out.get(),
            mission_out: self.mission_out.get(),
            state_dropped: self.state_dropped.get(),
            state_unsent: self.state_unsent.get(),
            mission_dropped: self.mission_dropped.get(),
            backlogged: self.backlogged.get(),
            garbage: self.garbage.get(),
            oversized: self.oversized.get(),
        }
    }
}

#[derive(Debug, Default)]
pub(crate) struct Counter(AtomicU64);

impl Counter {
    pub(crate) fn add_one(&self) -> u64 {
        self.0.fetch_add(1, Ordering::Relaxed) + 1
    }
    pub(crate) fn add(&self, count: u64) {
        self.0.fetch_add(count, Ordering::Relaxed);
    }
    /// Undoes so many.
    pub(crate) fn take_back(&self, count: u64) {
        self.0.fetch_sub(count, Ordering::Relaxed);
    }
    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
