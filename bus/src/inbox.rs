//! The receiving half of one line, the same at both ends: from the transport's callbacks into the program's queue.
//!
//! Callbacks run on the transport's own threads, so nothing here waits: what finds no room in the queue is dropped and
//! counted. A gate is shut until the two ends have shaken hands, and again when the line is lost, so that a program
//! sees every packet after the line's beginning and before its end.

use std::fmt;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use crate::counts::Tally;
use crate::outbox::{ACK_EVERY, Outbox, STATE_ACK_EVERY};
use crate::plane::{Assembled, Assembly, BUNDLE, Frame, Plane, Size, cost, state_cost, unbundle};
use crate::queue::{Feed, Refused};

/// Who may take state-plane messages at once, on the transport's thread: as many as it likes, beginning with the first.
pub(crate) type Shortcut = dyn Fn(Instant, &mut Messages<'_>) + Send + Sync;

/// The state-plane messages that have arrived together. Each is counted before it is taken, so that a program never finds a
/// count behind what it holds.
pub struct Messages<'a> {
    bytes: &'a [u8],
    tally: &'a Tally,
}

impl<'a> Iterator for Messages<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let (message, rest) = unbundle(self.bytes)?;
        self.bytes = rest;
        self.tally.state_in.add(1);
        Some(message)
    }
}

impl fmt::Debug for Messages<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Messages").field(&Size(self.bytes.len())).finish()
    }
}

/// One end of a line, receiving: `E` is the program's event.
pub(crate) struct Inbox<E> {
    events: Feed<E>,
    packet: Box<dyn Fn(Plane, Instant, Vec<u8>) -> E + Send + Sync>,
    /// Told of each packet that had to make place for a newer one, which may be another line's.
    dropped: Box<dyn Fn(&E) + Send + Sync>,
    shortcut: OnceLock<Box<Shortcut>>,
    phase: AtomicU8,
    gate: Mutex<Gate>,
    /// What has arrived on the state plane, as [`state_cost`] counts, and how much of it was acknowledged.
    states_taken: AtomicU64,
    states_acknowledged: AtomicU64,
    tally: Arc<Tally>,
    pub(crate) outbox: Outbox,
}

/// The phases of a gate. It is changed under the lock, and looked at without.
const WAITING: u8 = 0;
const OPEN: u8 = 1;
const CLOSED: u8 = 2;

#[derive(Debug, Default)]
struct Gate {
    assembly: Assembly,
    /// What has arrived on the mission plane, as [`cost`] counts, and how much of it was acknowledged.
    taken: u64,
    acknowledged: u64,
}

/// A frame that concerns the line itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Handshake {
    Hello(u64),
    Welcome(u64),
}

impl<E> Inbox<E> {
    pub(crate) fn new(
        events: Feed<E>,
        outbox: Outbox,
        tally: Arc<Tally>,
        packet: impl Fn(Plane, Instant, Vec<u8>) -> E + Send + Sync + 'static,
        dropped: impl Fn(&E) + Send + Sync + 'static,
    ) -> Inbox<E> {
        let (shortcut, phase, gate) = (OnceLock::new(), AtomicU8::new(WAITING), Mutex::default());
        let (states_taken, states_acknowledged) = (AtomicU64::new(0), AtomicU64::new(0));
        let (packet, dropped) = (Box::new(packet), Box::new(dropped));
        Inbox { events, packet, dropped, shortcut, phase, gate, states_taken, states_acknowledged, tally, outbox }
    }

    /// Lets state-plane packets be taken before they are queued.
    pub(crate) fn set_shortcut(&self, shortcut: Box<Shortcut>) {
        // There is one in the life of a line.
        let _ = self.shortcut.set(shortcut);
    }

    fn lock(&self) -> MutexGuard<'_, Gate> {
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn phase(&self) -> u8 {
        self.phase.load(Ordering::Acquire)
    }

    /// Whether messages may pass.
    pub(crate) fn is_open(&self) -> bool {
        self.phase() == OPEN
    }

    /// Whether messages may be sent: also by a program that heard that the line opens a moment before it does.
    pub(crate) fn lets_send(&self) -> bool {
        self.is_open() || {
            let _opening = self.lock();
            self.is_open()
        }
    }

    /// Whether the two ends have not shaken hands yet.
    pub(crate) fn is_waiting(&self) -> bool {
        self.phase() == WAITING
    }

    /// Opens the gate, announcing it by `event` and then doing `then` before anything else passes; false if the
    /// program's queue has no room for the event, or the line is closed.
    pub(crate) fn open(&self, event: E, then: impl FnOnce()) -> bool {
        let _gate = self.lock();
        match self.phase() {
            OPEN => return true,
            WAITING => {}
            _ => return false,
        }
        if self.events.lasting(event).is_err() {
            return false;
        }
        then();
        self.phase.store(OPEN, Ordering::Release);
        true
    }

    /// Shuts the gate for good; true if it was open.
    pub(crate) fn close(&self) -> bool {
        let _gate = self.lock();
        self.outbox.close();
        self.phase.swap(CLOSED, Ordering::AcqRel) == OPEN
    }

    /// A bundle of state-plane messages has arrived.
    pub(crate) fn on_state(&self, bytes: &[u8]) {
        self.take_states(bytes);
        // Taken or not, it takes no more room on the way here.
        let cost = state_cost(bytes);
        let taken = self.states_taken.fetch_add(cost, Ordering::Relaxed) + cost;
        if taken - self.states_acknowledged.load(Ordering::Relaxed).min(taken) >= STATE_ACK_EVERY {
            self.states_acknowledged.store(taken, Ordering::Relaxed);
            self.outbox.acknowledge(&Frame::StatesTaken { taken });
        }
    }

    fn take_states(&self, bytes: &[u8]) {
        let at = Instant::now();
        if bytes.len() > BUNDLE + Plane::State.limit() {
            self.tally.ignore_oversized();
            return;
        }
        let mut messages = Messages { bytes, tally: &self.tally };
        // Not under the lock: who takes them may send on this very line.
        if let Some(shortcut) = self.shortcut.get().filter(|_| self.is_open()) {
            shortcut(at, &mut messages);
        }
        if messages.bytes.is_empty() {
            return;
        }
        let _gate = self.lock();
        if !self.is_open() {
            return;
        }
        let mut came = 0;
        let packets = messages.by_ref().map(|message| {
            came += 1;
            (self.packet)(Plane::State, at, message.to_vec())
        });
        if !self.events.droppable(packets, &*self.dropped) {
            self.tally.state_in.take_back(came);
            return;
        }
        if !messages.bytes.is_empty() {
            self.tally.ignore_garbage();
        }
    }

    /// A mission-plane frame has arrived.
    pub(crate) fn on_mission(&self, bytes: &[u8]) -> Option<Handshake> {
        let at = Instant::now();
        let mut gate = self.lock();
        let frame = Frame::decode(bytes);
        if let Some(Frame::Ack { taken } | Frame::StatesTaken { taken }) = frame {
            drop(gate);
            let ack = matches!(frame, Some(Frame::Ack { .. }));
            let credible = if ack { self.outbox.acknowledged(taken) } else { self.outbox.states_acknowledged(taken) };
            if !credible {
                self.tally.ignore_garbage();
            }
            return None;
        }
        gate.taken += cost(bytes);
        if gate.taken - gate.acknowledged >= ACK_EVERY || frame == Some(Frame::AckNow) {
            gate.acknowledged = gate.taken;
            self.outbox.acknowledge(&Frame::Ack { taken: gate.taken });
        }
        match frame {
            Some(Frame::Hello { nonce }) => return Some(Handshake::Hello(nonce)),
            Some(Frame::Welcome { nonce }) => return Some(Handshake::Welcome(nonce)),
            Some(Frame::AckNow | Frame::Ack { .. } | Frame::StatesTaken { .. }) => {}
            Some(Frame::Whole(message)) if self.is_open() => {
                if gate.assembly.abandon() {
                    self.tally.ignore_garbage();
                }
                self.deliver(at, message.to_vec());
            }
            Some(Frame::Part { message, index, total, piece }) if self.is_open() => {
                if index == 0 && gate.assembly.abandon() {
                    self.tally.ignore_garbage();
                }
                match gate.assembly.add(message, index, total, piece) {
                    Assembled::Done(message) => self.deliver(at, message),
                    Assembled::Waiting => {}
                    Assembled::Garbage => {
                        self.tally.ignore_garbage();
                    }
                }
            }
            Some(Frame::Whole(_) | Frame::Part { .. }) if self.phase() == CLOSED => {}
            _ => {
                self.tally.ignore_garbage();
            }
        }
        None
    }

    /// Takes a message of the mission plane; the caller holds the gate.
    fn deliver(&self, at: Instant, bytes: Vec<u8>) {
        self.tally.mission_in.add_one();
        match self.events.lasting((self.packet)(Plane::Mission, at, bytes)) {
            Ok(()) => {}
            Err(Refused::Full) => {
                self.tally.mission_in.take_back(1);
                let so_far = self.tally.mission_dropped.add_one();
                if so_far.is_power_of_two() {
                    tracing::error!("the program does not empty its queue: {so_far} mission messages are lost");
                }
            }
            Err(Refused::Nobody) => self.tally.mission_in.take_back(1),
        }
    }
}
