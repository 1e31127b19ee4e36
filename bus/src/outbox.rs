//! The sending half of one line, the same at both ends. Sending never blocks the caller, nor anything else.
//!
//! The state plane may drop, so it is put straight into the transport. The mission plane may not, and a transport whose
//! queue is full blocks: not only its sender but, when the peer is then held for dead, one of the few threads that serve
//! *all* sessions of the process. So it is never filled: at most [`WINDOW`] is on its way, a quarter of what the queue
//! holds; the rest waits here, and moves on when the other end acknowledges. In a steady exchange of small messages, as
//! the stepped clock's, none ever waits.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use crate::counts::Tally;
use crate::error::{Error, Result};
use crate::plane::{Frame, Plane, bundle, cost, frames};

/// How much of the mission plane may be on its way.
const WINDOW: u64 = 256 << 10;
/// The other end acknowledges this often: what it has not acknowledged yet leaves room for the largest frame.
pub(crate) const ACK_EVERY: u64 = WINDOW / 4;
/// The most that waits for one line.
const BACKLOG_LIMIT: usize = 64 << 20;

#[derive(Debug)]
pub(crate) struct Outbox {
    state: Publisher<'static>,
    mission: Publisher<'static>,
    /// Acknowledgements go in a lane of their own, above the mission plane's: they must not wait behind it.
    acks: Publisher<'static>,
    queue: Mutex<Queue>,
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
        let publisher = |plane, congestion, priority| {
            session
                .declare_publisher(key(plane))
                .congestion_control(congestion)
                .priority(priority)
                .express(false)
                .wait()
                .map_err(Error::middleware)
        };
        Ok(Outbox {
            state: publisher(Plane::State, CongestionControl::Drop, Priority::Data)?,
            // The mission plane gives way: an upload of logs must not delay the coordination of those still moving.
            mission: publisher(Plane::Mission, CongestionControl::Block, Priority::DataLow)?,
            acks: publisher(Plane::Mission, CongestionControl::Block, Priority::DataHigh)?,
            queue: Mutex::default(),
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

    /// Sends so many state-plane messages at once.
    pub(crate) fn send_bundle(&self, bundle: Vec<u8>, messages: u64) -> Result<()> {
        self.state.put(bundle).wait().map_err(|_| Error::NotConnected)?;
        self.tally.state_out.add(messages);
        Ok(())
    }

    /// Sends a frame of the line's own, in order with the messages.
    pub(crate) fn send_frame(&self, frame: &Frame<'_>) -> Result<()> {
        self.enqueue(self.lock(), std::iter::once(frame.encode()))
    }

    /// Tells the other end how much of its mission plane has arrived.
    pub(crate) fn acknowledge(&self, taken: u64) {
        // It fails only with the session, whose end is noticed elsewhere.
        let _ = self.acks.put(Frame::Ack { taken }.encode()).wait();
    }

    /// The other end has taken this much.
    pub(crate) fn acknowledged(&self, taken: u64) {
        let mut queue = self.lock();
        if taken > queue.taken {
            queue.taken = taken;
            // A failure here is the session's end, too.
            let _ = self.enqueue(queue, std::iter::empty());
            self.changed.notify_all();
        }
    }

    /// Has the other end say what it has taken, once it has taken all that was sent before.
    pub(crate) fn ask_to_acknowledge(&self) -> Result<()> {
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
