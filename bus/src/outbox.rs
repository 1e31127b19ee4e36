//! The sending half of one line, the same at both ends. Sending never blocks the caller.
//!
//! The state plane may drop, so it is put straight into the transport. The mission plane may not, and the transport
//! blocks when its queue is full. Two ways lead into it:
//!
//! - *straight*: a message of one frame, while less than [`WINDOW`] is on its way. The transport's queue is four times
//!   that large, so this cannot block, and it costs no thread switch: the stepped clock lives on it.
//! - *the backlog*: everything else, in order, by a thread that may block as long as it likes.
//!
//! What is on its way is known from the other end's acknowledgements. They only choose between the two ways: one that
//! is lost makes a message take the slower one.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use crate::counts::Tally;
use crate::error::{Error, Result};
use crate::plane::{Frame, Plane, cost, frames};

/// How much of the mission plane may be on its way and still be added to without looking.
const WINDOW: u64 = 256 << 10;
/// The other end acknowledges this often, so a steady exchange never closes the window.
pub(crate) const ACK_EVERY: u64 = WINDOW / 4;
/// The most that waits for one line.
const BACKLOG_LIMIT: usize = 64 << 20;

#[derive(Debug)]
pub(crate) struct Outbox {
    state: Publisher<'static>,
    /// Acknowledgements go in a lane of their own, above the mission plane's: they must not wait behind it.
    acks: Publisher<'static>,
    lane: Arc<Lane>,
    tally: Arc<Tally>,
}

/// The mission plane's way into the transport.
#[derive(Debug)]
struct Lane {
    mission: Publisher<'static>,
    queue: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Queue {
    backlog: VecDeque<Vec<u8>>,
    backlog_bytes: usize,
    /// The thread holds a frame that it took from the backlog.
    in_hand: bool,
    has_thread: bool,
    closed: bool,
    large_messages: u32,
    /// Totals since the line was opened, as [`cost`] counts.
    sent: u64,
    taken: u64,
}

impl Queue {
    fn on_its_way(&self) -> u64 {
        self.sent.saturating_sub(self.taken)
    }
    fn idle(&self) -> bool {
        self.backlog.is_empty() && !self.in_hand
    }
}

impl Outbox {
    /// Declares the publishers of one direction of a line.
    pub(crate) fn new(session: &Session, key: impl Fn(Plane) -> String, tally: Arc<Tally>) -> Result<Outbox> {
        let publisher = |plane, congestion, priority| {
            session
                .declare_publisher(key(plane))
                .congestion_control(congestion)
                // A lane of its own for each: a blocked put holds its lane's lock.
                .priority(priority)
                .express(false)
                .wait()
                .map_err(Error::middleware)
        };
        // The mission plane gives way: an upload of logs must not delay the coordination of those still moving.
        let lane = Lane {
            mission: publisher(Plane::Mission, CongestionControl::Block, Priority::DataLow)?,
            queue: Mutex::default(),
            changed: Condvar::new(),
        };
        Ok(Outbox {
            state: publisher(Plane::State, CongestionControl::Drop, Priority::Data)?,
            acks: publisher(Plane::Mission, CongestionControl::Drop, Priority::DataHigh)?,
            lane: Arc::new(lane),
            tally,
        })
    }

    pub(crate) fn send(&self, plane: Plane, bytes: &[u8]) -> Result<()> {
        if bytes.len() > plane.limit() {
            return Err(Error::TooLarge { plane, bytes: bytes.len() });
        }
        match plane {
            Plane::State => {
                self.state.put(bytes).wait().map_err(|_| Error::NotConnected)?;
                self.tally.state_out.add_one();
            }
            Plane::Mission => {
                let sent = self.lane.send(bytes);
                match sent {
                    Ok(()) => self.tally.mission_out.add_one(),
                    Err(Error::Backlogged) => self.tally.backlogged.add_one(),
                    Err(_) => 0,
                };
                sent?;
            }
        }
        Ok(())
    }

    /// Sends a frame of the line's own, in order with the messages.
    pub(crate) fn send_frame(&self, frame: &Frame<'_>) -> Result<()> {
        self.lane.send_frames(std::iter::once(frame.encode()))
    }

    /// Tells the other end how much of its mission plane has arrived.
    pub(crate) fn acknowledge(&self, taken: u64) {
        // Sent from the transport's own threads, and dropped rather than waited for.
        let _ = self.acks.put(Frame::Ack { taken }.encode()).wait();
    }

    /// The other end has taken this much.
    pub(crate) fn acknowledged(&self, taken: u64) {
        let mut queue = self.lane.lock();
        if taken > queue.taken {
            queue.taken = taken;
            drop(queue);
            self.lane.changed.notify_all();
        }
    }

    /// Waits until the other end has taken all of the mission plane; false if it has not by the deadline.
    pub(crate) fn drain(&self, deadline: Instant) -> bool {
        if self.send_frame(&Frame::AckNow).is_err() {
            return false;
        }
        let mut queue = self.lane.lock();
        while !(queue.idle() && queue.on_its_way() == 0) {
            let left = deadline.saturating_duration_since(Instant::now());
            if left == Duration::ZERO || queue.closed {
                return false;
            }
            queue = self.lane.changed.wait_timeout(queue, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }

    /// No more is sent.
    pub(crate) fn close(&self) {
        let mut queue = self.lane.lock();
        queue.closed = true;
        queue.backlog.clear();
        drop(queue);
        self.lane.changed.notify_all();
    }
}

impl Drop for Outbox {
    fn drop(&mut self) {
        self.close();
    }
}

impl Lane {
    /// A thread that panicked elsewhere must not take the line with it: the queue is whole between statements.
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(self: &Arc<Lane>, bytes: &[u8]) -> Result<()> {
        let number = {
            let mut queue = self.lock();
            queue.large_messages = queue.large_messages.wrapping_add(1);
            queue.large_messages
        };
        self.send_frames(frames(number, bytes))
    }

    fn send_frames(self: &Arc<Lane>, frames: impl Iterator<Item = Vec<u8>>) -> Result<()> {
        let mut frames = frames.peekable();
        let Some(first) = frames.next() else { return Ok(()) };
        let single = frames.peek().is_none();

        let mut queue = self.lock();
        if queue.closed {
            return Err(Error::NotConnected);
        }
        if single && queue.idle() && queue.on_its_way() + cost(&first) <= WINDOW {
            queue.sent += cost(&first);
            // Under the lock: two callers' messages reach the transport in the order in which they are counted.
            return self.mission.put(first).wait().map_err(|_| Error::NotConnected);
        }
        let before = queue.backlog.len();
        let bytes_before = queue.backlog_bytes;
        for frame in std::iter::once(first).chain(frames) {
            queue.backlog_bytes += frame.len();
            queue.backlog.push_back(frame);
        }
        if queue.backlog_bytes > BACKLOG_LIMIT {
            queue.backlog.truncate(before);
            queue.backlog_bytes = bytes_before;
            return Err(Error::Backlogged);
        }
        if !queue.has_thread {
            queue.has_thread = true;
            let lane = Arc::clone(self);
            let spawned = std::thread::Builder::new().name("bus-backlog".into()).spawn(move || lane.work_off());
            if let Err(error) = spawned {
                queue.has_thread = false;
                queue.backlog.truncate(before);
                queue.backlog_bytes = bytes_before;
                return Err(Error::middleware(error));
            }
        }
        drop(queue);
        self.changed.notify_all();
        Ok(())
    }

    /// The thread of the backlog; it ends with the line.
    fn work_off(&self) {
        let mut queue = self.lock();
        loop {
            if queue.closed {
                return;
            }
            let Some(frame) = queue.backlog.pop_front() else {
                queue = self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            queue.backlog_bytes -= frame.len();
            queue.sent += cost(&frame);
            queue.in_hand = true;
            drop(queue);
            let put = self.mission.put(frame).wait();
            queue = self.lock();
            queue.in_hand = false;
            self.changed.notify_all();
            if put.is_err() {
                queue.closed = true;
            }
        }
    }
}
