//! The sending half of one line, the same at both ends. Sending never blocks the caller, nor anything else.
//!
//! A transport whose queue is full drops the newest and tells nobody, or blocks: not only its sender but, when the peer is
//! then held for dead, one of the few threads that serve *all* sessions of the process. So none blocks, and for a peer that
//! tells the truth of what it has taken none is ever filled: of the mission
//! plane at most [`WINDOW`] is on its way, a quarter of what the queue holds, and of the state plane [`STATE_WINDOW`], half of
//! it; the rest waits here, and moves on when the other end acknowledges. What waits of the mission plane is kept; of the state
//! plane the oldest make place for the newest beyond [`STATE_BACKLOG`], and are counted. In a steady exchange of small
//! messages, as the stepped clock's, none ever waits.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use crate::counts::Tally;
use crate::error::{Error, Result};
use crate::plane::{BUNDLE, Frame, LEAST_STATE_COST, Plane, bundle, cost, frames, state_cost};

/// How much of the mission plane may be on its way.
const WINDOW: u64 = 256 << 10;
/// The other end acknowledges this often: what it has not acknowledged yet leaves room for the largest frame.
pub(crate) const ACK_EVERY: u64 = WINDOW / 4;
/// How much of the state plane may be on its way: 512 KiB, and no more than 32 bundles.
const STATE_WINDOW: u64 = 32 * LEAST_STATE_COST;
/// The other end acknowledges this often.
pub(crate) const STATE_ACK_EVERY: u64 = STATE_WINDOW / 4;
/// The most of the state plane that waits here: about a thousand messages, for what is older helps nobody.
const STATE_BACKLOG: usize = 2 * BUNDLE;
/// Messages that wait are put together up to this size: half a hundred that travel as one cost the transport as much as one,
/// and no more than these are dropped together.
const TOGETHER: usize = 2 << 10;
/// The most that waits for one line.
const BACKLOG_LIMIT: usize = 64 << 20;

#[derive(Debug)]
pub(crate) struct Outbox {
    state: Publisher<'static>,
    mission: Publisher<'static>,
    /// Acknowledgements go in a lane of their own, above the mission plane's: they must not wait behind it.
    acks: Publisher<'static>,
    queue: Mutex<Queue>,
    states: Mutex<States>,
    changed: Condvar,
    tally: Arc<Tally>,
}

/// The mission plane's way into the transport.
#[derive(Debug, Default)]
struct Queue {
    backlog: VecDeque<Vec<u8>>,
    backlog_bytes: usize,
    closed: bool,
    large_messages: u32,
    /// Totals since the line was opened, as [`cost`] counts.
    sent: u64,
    taken: u64,
}

/// The state plane's way into the transport.
#[derive(Debug, Default)]
struct States {
    /// Bundles with how many messages are in each, oldest first.
    waiting: VecDeque<(Vec<u8>, u64)>,
    waiting_bytes: usize,
    closed: bool,
    /// Totals since the line was opened, as [`state_cost`] counts.
    sent: u64,
    taken: u64,
}

impl States {
    /// A bundle waits for its turn, if possible with what came last.
    fn wait(&mut self, bundle: Vec<u8>, messages: u64) {
        self.waiting_bytes += bundle.len();
        match self.waiting.back_mut() {
            Some((last, so_far)) if last.len() + bundle.len() <= TOGETHER => {
                last.extend_from_slice(&bundle);
                *so_far += messages;
            }
            _ => self.waiting.push_back((bundle, messages)),
        }
    }

    /// The oldest bundle, if there is room for it on its way.
    fn next(&mut self) -> Option<(Vec<u8>, u64)> {
        let cost = state_cost(&self.waiting.front()?.0);
        if self.sent.saturating_sub(self.taken) + cost > STATE_WINDOW {
            return None;
        }
        self.sent += cost;
        self.pop()
    }

    fn pop(&mut self) -> Option<(Vec<u8>, u64)> {
        let oldest = self.waiting.pop_front()?;
        self.waiting_bytes -= oldest.0.len();
        Some(oldest)
    }

    /// How many messages had to make place so that no more waits than may.
    fn shorten(&mut self, most: usize) -> u64 {
        let mut dropped = 0;
        while self.waiting_bytes > most
            && let Some((_, messages)) = self.pop()
        {
            dropped += messages;
        }
        dropped
    }
}

impl Queue {
    fn on_its_way(&self) -> u64 {
        self.sent.saturating_sub(self.taken)
    }
    fn close(&mut self) {
        self.closed = true;
        self.backlog = VecDeque::new();
    }
}

impl Outbox {
    /// Declares the publishers of one direction of a line.
    pub(crate) fn new(session: &Session, key: impl Fn(Plane) -> String, tally: Arc<Tally>) -> Result<Outbox> {
        let publisher = |plane, priority| {
            session
                .declare_publisher(key(plane))
                // Only a peer that lies about what it has taken loses anything by it.
                .congestion_control(CongestionControl::Drop)
                .priority(priority)
                .express(false)
                .wait()
                .map_err(Error::middleware)
        };
        Ok(Outbox {
            state: publisher(Plane::State, Priority::Data)?,
            // The mission plane gives way: an upload of logs must not delay the coordination of those still moving.
            mission: publisher(Plane::Mission, Priority::DataLow)?,
            acks: publisher(Plane::Mission, Priority::DataHigh)?,
            queue: Mutex::default(),
            states: Mutex::default(),
            changed: Condvar::new(),
            tally,
        })
    }

    pub(crate) fn send(&self, plane: Plane, bytes: &[u8]) -> Result<()> {
        if bytes.len() > plane.limit() {
            return Err(Error::TooLarge { plane, bytes: bytes.len() });
        }
        match plane {
            Plane::State => {
                let mut one = Vec::with_capacity(2 + bytes.len());
                bundle(&mut one, bytes);
                self.send_bundle(one, 1)?;
            }
            Plane::Mission => {
                let mut queue = self.lock();
                if queue.backlog_bytes + bytes.len() > BACKLOG_LIMIT {
                    self.tally.backlogged.add_one();
                    return Err(Error::Backlogged);
                }
                queue.large_messages = queue.large_messages.wrapping_add(1);
                let number = queue.large_messages;
                self.enqueue(queue, frames(number, bytes))?;
                self.tally.mission_out.add_one();
            }
        }
        Ok(())
    }

    /// Sends so many state-plane messages at once, as soon as the other end has taken enough of what was sent before.
    pub(crate) fn send_bundle(&self, bundle: Vec<u8>, messages: u64) -> Result<()> {
        let mut states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
        if states.closed {
            self.tally.state_unsent.add(messages);
            return Err(Error::NotConnected);
        }
        states.wait(bundle, messages);
        self.send_states(&mut states)
    }

    /// Gives the transport what may go, under the lock, so that the order is kept; what is too much is dropped.
    fn send_states(&self, states: &mut States) -> Result<()> {
        while let Some((bundle, messages)) = states.next() {
            self.put(bundle, messages)?;
        }
        self.tally.state_unsent.add(states.shorten(STATE_BACKLOG));
        Ok(())
    }

    /// Gives the transport a bundle of states.
    fn put(&self, bundle: Vec<u8>, messages: u64) -> Result<()> {
        if self.state.put(bundle).wait().is_err() {
            self.tally.state_unsent.add(messages);
            return Err(Error::NotConnected);
        }
        self.tally.state_out.add(messages);
        Ok(())
    }

    /// The other end has taken this much of the state plane; false if that is more than was sent.
    pub(crate) fn states_acknowledged(&self, taken: u64) -> bool {
        let mut states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
        if taken > states.sent {
            return false;
        }
        states.taken = states.taken.max(taken);
        // A failure here is the session's end, which is noticed elsewhere.
        let _ = self.send_states(&mut states);
        true
    }

    /// Sends a frame of the line's own, in order with the messages.
    pub(crate) fn send_frame(&self, frame: &Frame<'_>) -> Result<()> {
        self.enqueue(self.lock(), std::iter::once(frame.encode()))
    }

    /// Tells the other end how much of one of its planes has arrived.
    pub(crate) fn acknowledge(&self, taken: &Frame<'_>) {
        // It fails only with the session, whose end is noticed elsewhere.
        let _ = self.acks.put(taken.encode()).wait();
    }

    /// The other end has taken this much; false if that is more than was sent.
    pub(crate) fn acknowledged(&self, taken: u64) -> bool {
        let mut queue = self.lock();
        if taken > queue.sent {
            return false;
        }
        if taken > queue.taken {
            queue.taken = taken;
            // A failure here is the session's end, too.
            let _ = self.enqueue(queue, std::iter::empty());
            self.changed.notify_all();
        }
        true
    }

    /// Has the other end say what it has taken, once it has taken all that was sent before: also the states that wait, for
    /// which the transport's queue has room, but for no more after them.
    pub(crate) fn ask_to_acknowledge(&self) -> Result<()> {
        let mut states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some((bundle, messages)) = states.pop() {
            states.sent += state_cost(&bundle);
            self.put(bundle, messages)?;
        }
        drop(states);
        self.send_frame(&Frame::AckNow)
    }

    /// Waits until the other end has taken all of the mission plane, as far as it was asked; false if it has not by
    /// the deadline.
    pub(crate) fn drain(&self, deadline: Instant) -> bool {
        let mut queue = self.lock();
        while !(queue.backlog.is_empty() && queue.on_its_way() == 0) {
            let left = deadline.saturating_duration_since(Instant::now());
            if left == Duration::ZERO || queue.closed {
                return false;
            }
            queue = self.changed.wait_timeout(queue, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }

    /// No more is sent.
    pub(crate) fn close(&self) {
        self.lock().close();
        let mut states = self.states.lock().unwrap_or_else(PoisonError::into_inner);
        states.closed = true;
        self.tally.state_unsent.add(states.shorten(0));
        drop(states);
        self.changed.notify_all();
    }

    /// A thread that panicked elsewhere must not take the line with it: the queue is whole between statements.
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends frames, then gives the transport as many as the window admits. All under the lock, so that frames reach
    /// the transport in the order in which they are queued.
    fn enqueue(&self, mut queue: MutexGuard<'_, Queue>, frames: impl Iterator<Item = Vec<u8>>) -> Result<()> {
        if queue.closed {
            return Err(Error::NotConnected);
        }
        for frame in frames {
            queue.backlog_bytes += frame.len();
            queue.backlog.push_back(frame);
        }
        while let Some(frame) = queue.backlog.front()
            && queue.on_its_way() + cost(frame) <= WINDOW
            && let Some(frame) = queue.backlog.pop_front()
        {
            queue.backlog_bytes -= frame.len();
            queue.sent += cost(&frame);
            if self.mission.put(frame).wait().is_err() {
                queue.close();
                return Err(Error::NotConnected);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever the other end takes, no more is on its way or waits than may; what is lost is the oldest and is counted,
        /// and the rest goes in order.
        #[test]
        fn the_oldest_states_make_place_and_every_message_is_accounted_for(
            steps in prop::collection::vec((prop_oneof![1usize..40, 1usize..5_000], any::<bool>()), 1..400)
        ) {
            let mut states = States::default();
            let (mut sent, mut counted, mut dropped) = (Vec::new(), 0, 0);
            for (number, (times, takes)) in (0u64..).zip(&steps) {
                states.wait(number.to_le_bytes().repeat(*times), 1);
                if *takes {
                    states.taken = states.sent;
                }
                while let Some((bundle, messages)) = states.next() {
                    sent.extend(bundle.chunks(8).map(|number| u64::from_le_bytes(number.try_into().expect("eight"))));
                    counted += messages;
                }
                dropped += states.shorten(STATE_BACKLOG);
                prop_assert!(states.sent - states.taken <= STATE_WINDOW);
                let waiting = states.waiting.iter().map(|(bundle, _)| bundle.len()).sum::<usize>();
                prop_assert!(waiting <= STATE_BACKLOG && waiting == states.waiting_bytes);
            }
            prop_assert!(sent.is_sorted());
            sent.dedup();
            prop_assert_eq!(sent.len() as u64, counted);
            let waiting: u64 = states.waiting.iter().map(|(_, messages)| messages).sum();
            prop_assert_eq!(counted + dropped + waiting, steps.len() as u64);
            if steps.iter().all(|(_, takes)| *takes) {
                prop_assert_eq!(dropped, 0, "who keeps up loses nothing");
            }
        }
    }
}
