//! The receiving half of one line, the same at both ends: from the transport's callbacks into the program's queue.
//!
//! Callbacks run on the transport's own threads, so nothing here waits: what finds the queue full is dropped and
//! counted. A gate is shut until the two ends have shaken hands, and again when the line is lost, so that a program
//! sees every packet after the line's beginning and before its end.

use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::counts::Tally;
use crate::outbox::{ACK_EVERY, Outbox};
use crate::plane::{Assembled, Assembly, Frame, Plane, cost};

/// One end of a line, receiving: `E` is the program's event.
pub(crate) struct Inbox<E> {
    events: SyncSender<E>,
    packet: Box<dyn Fn(Plane, Instant, Vec<u8>) -> E + Send + Sync>,
    gate: Mutex<Gate>,
    tally: Arc<Tally>,
    pub(crate) outbox: Outbox,
}

#[derive(Debug, Default)]
struct Gate {
    phase: Phase,
    assembly: Assembly,
    /// What has arrived on the mission plane, as [`cost`] counts, and how much of it was acknowledged.
    taken: u64,
    acknowledged: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    #[default]
    Waiting,
    Open,
    Closed,
}

/// A frame that concerns the line itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Handshake {
    Hello(u64),
    Welcome(u64),
}

impl<E> Inbox<E> {
    pub(crate) fn new(
        events: SyncSender<E>,
        outbox: Outbox,
        tally: Arc<Tally>,
        packet: impl Fn(Plane, Instant, Vec<u8>) -> E + Send + Sync + 'static,
    ) -> Inbox<E> {
        Inbox { events, packet: Box::new(packet), gate: Mutex::default(), tally, outbox }
    }

    fn lock(&self) -> MutexGuard<'_, Gate> {
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether messages may pass.
    pub(crate) fn is_open(&self) -> bool {
        self.lock().phase == Phase::Open
    }

    /// Whether the two ends have not shaken hands yet.
    pub(crate) fn is_waiting(&self) -> bool {
        self.lock().phase == Phase::Waiting
    }

    /// Opens the gate, announcing it by `event` and then doing `then` before anything else passes; false if the
    /// program's queue has no room for the event, or the line is closed.
    pub(crate) fn open(&self, event: E, then: impl FnOnce()) -> bool {
        let mut gate = self.lock();
        match gate.phase {
            Phase::Open => return true,
            Phase::Closed => return false,
            Phase::Waiting => {}
        }
        if self.events.try_send(event).is_err() {
            return false;
        }
        then();
        gate.phase = Phase::Open;
        true
    }

    /// Shuts the gate for good; true if it was open.
    pub(crate) fn close(&self) -> bool {
        let mut gate = self.lock();
        self.outbox.close();
        std::mem::replace(&mut gate.phase, Phase::Closed) == Phase::Open
    }

    /// A state-plane message has arrived.
    pub(crate) fn on_state(&self, bytes: &[u8]) {
        let at = Instant::now();
        if bytes.len() > Plane::State.limit() {
            self.tally.oversized.add_one();
            return;
        }
        let gate = self.lock();
        if gate.phase == Phase::Open {
            self.deliver(Plane::State, at, bytes.to_vec());
        }
    }

    /// A mission-plane frame has arrived.
    pub(crate) fn on_mission(&self, bytes: &[u8]) -> Option<Handshake> {
        let at = Instant::now();
        let mut gate = self.lock();
        let frame = Frame::decode(bytes);
        if let Some(Frame::Ack { taken }) = frame {
            drop(gate);
            self.outbox.acknowledged(taken);
            return None;
        }
        gate.taken += cost(bytes);
        if gate.taken - gate.acknowledged >= ACK_EVERY || frame == Some(Frame::AckNow) {
            gate.acknowledged = gate.taken;
            self.outbox.acknowledge(gate.taken);
        }
        match frame {
            Some(Frame::Hello { nonce }) => return Some(Handshake::Hello(nonce)),
            Some(Frame::Welcome { nonce }) => return Some(Handshake::Welcome(nonce)),
            Some(Frame::AckNow | Frame::Ack { .. }) => {}
            Some(Frame::Whole(message)) if gate.phase == Phase::Open => {
                if gate.assembly.abandon() {
                    self.tally.garbage.add_one();
                }
                self.deliver(Plane::Mission, at, message.to_vec());
            }
            Some(Frame::Part { message, index, total, piece }) if gate.phase == Phase::Open => {
                if index == 0 && gate.assembly.abandon() {
                    self.tally.garbage.add_one();
                }
                match gate.assembly.add(message, index, total, piece) {
                    Assembled::Done(message) => self.deliver(Plane::Mission, at, message),
                    Assembled::Waiting => {}
                    Assembled::Garbage => {
                        self.tally.garbage.add_one();
                    }
                }
            }
            Some(Frame::Whole(_) | Frame::Part { .. }) if gate.phase == Phase::Closed => {}
            _ => {
                self.tally.garbage.add_one();
            }
        }
        None
    }

    /// The caller holds the gate.
    fn deliver(&self, plane: Plane, at: Instant, bytes: Vec<u8>) {
        let (delivered, dropped) = match plane {
            Plane::State => (&self.tally.state_in, &self.tally.state_dropped),
            Plane::Mission => (&self.tally.mission_in, &self.tally.mission_dropped),
        };
        // Before the program can see the message, so that it never finds a count behind what it holds.
        delivered.add_one();
        match self.events.try_send((self.packet)(plane, at, bytes)) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => {
                delivered.take_back();
                let so_far = dropped.add_one();
                if plane == Plane::Mission && so_far.is_power_of_two() {
                    tracing::error!("the program does not empty its queue: {so_far} mission messages are lost");
                }
            }
            // The program listens no more.
            Err(TrySendError::Disconnected(_)) => delivered.take_back(),
        }
    }
}
