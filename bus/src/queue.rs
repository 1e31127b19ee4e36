//! The queue between the transport's threads and a program: bounded, and sparing with wake-ups.
//!
//! State-plane packets may be lost, and a newer one is worth more than an older one: when they find no room, the oldest of
//! them makes place and is counted. Everything else keeps its place, and is refused when there is no room. Both come out in
//! the order in which they went in.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvError, RecvTimeoutError, TryRecvError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How many hints to the processor, of some 20 to 50 ns each, are between two looks at a queue that is watched.
const HINTS: usize = 32;

/// A queue for at most `capacity` state-plane packets and as many other events.
pub(crate) fn queue<E>(capacity: usize) -> (Feed<E>, Events<E>) {
    let line = Line { due: Inner::default(), feeds: 1, listening: true, waiting: false, patient: false, nudged: false };
    let shared = Arc::new(Shared {
        line: Mutex::new(line),
        changed: Condvar::new(),
        capacity: capacity.max(1),
        droppable: AtomicUsize::new(0),
    });
    (Feed(Arc::clone(&shared)), Events { shared, taken: RefCell::default() })
}

struct Shared<E> {
    line: Mutex<Line<E>>,
    changed: Condvar,
    capacity: usize,
    /// Packets that wait, here or with the program.
    droppable: AtomicUsize,
}

struct Line<E> {
    due: Inner<E>,
    feeds: usize,
    listening: bool,
    waiting: bool,
    /// The program waits, and not for packets.
    patient: bool,
    nudged: bool,
}

/// Two queues with one order.
struct Inner<E> {
    droppable: VecDeque<(u64, E)>,
    lasting: VecDeque<(u64, E)>,
    /// The next place in the order.
    ticket: u64,
}

impl<E> Default for Inner<E> {
    fn default() -> Inner<E> {
        Inner { droppable: VecDeque::new(), lasting: VecDeque::new(), ticket: 0 }
    }
}

impl<E> Inner<E> {
    fn is_empty(&self) -> bool {
        self.droppable.is_empty() && self.lasting.is_empty()
    }

    fn ticket(&mut self) -> u64 {
        self.ticket += 1;
        self.ticket
    }

    /// The first in order, and whether it was droppable.
    fn pop(&mut self) -> Option<(E, bool)> {
        let droppable = match (self.droppable.front(), self.lasting.front()) {
            (Some((one, _)), Some((other, _))) => one < other,
            (one, _) => one.is_some(),
        };
        let from = if droppable { &mut self.droppable } else { &mut self.lasting };
        from.pop_front().map(|(_, event)| (event, droppable))
    }
}

impl<E> Shared<E> {
    fn lock(&self) -> MutexGuard<'_, Line<E>> {
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the program if it sleeps: a wake-up of one that is awake would cost a system call.
    fn wake(&self, line: &mut Line<E>) {
        if std::mem::take(&mut line.waiting) {
            self.changed.notify_one();
        }
    }
}

/// The transport's end of a queue.
pub(crate) struct Feed<E>(Arc<Shared<E>>);

/// An event was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refused {
    /// There is no room.
    Full,
    /// The program listens no more.
    Nobody,
}

impl<E> Feed<E> {
    /// Packets that may be dropped. Others, the oldest, may have to make place: `dropped` is told which. False if the program
    /// listens no more.
    pub(crate) fn droppable(&self, events: impl Iterator<Item = E>, mut dropped: impl FnMut(&E)) -> bool {
        let mut line = self.0.lock();
        if !line.listening {
            return false;
        }
        for event in events {
            if line.due.droppable.len() >= self.0.capacity {
                line.due.droppable.pop_front().iter().for_each(|(_, oldest)| dropped(oldest));
            } else {
                self.0.droppable.fetch_add(1, Ordering::Release);
            }
            let ticket = line.due.ticket();
            line.due.droppable.push_back((ticket, event));
        }
        if !line.patient {
            self.0.wake(&mut line);
        }
        true
    }

    /// An event that must not be dropped.
    pub(crate) fn lasting(&self, event: E) -> Result<(), Refused> {
        let mut line = self.0.lock();
        if !line.listening {
            return Err(Refused::Nobody);
        }
        if line.due.lasting.len() >= self.0.capacity {
            return Err(Refused::Full);
        }
        let ticket = line.due.ticket();
        line.due.lasting.push_back((ticket, event));
        self.0.wake(&mut line);
        Ok(())
    }

    /// An event of which there are few, whether there is room or not; false if the program listens no more.
    pub(crate) fn announce(&self, event: E) -> bool {
        let mut line = self.0.lock();
        let ticket = line.due.ticket();
        line.due.lasting.push_back((ticket, event));
        self.0.wake(&mut line);
        line.listening
    }
}

impl<E> Clone for Feed<E> {
    fn clone(&self) -> Feed<E> {
        self.0.lock().feeds += 1;
        Feed(Arc::clone(&self.0))
    }
}

impl<E> Drop for Feed<E> {
    fn drop(&mut self) {
        let mut line = self.0.lock();
        line.feeds -= 1;
        if line.feeds == 0 {
            self.0.wake(&mut line);
        }
    }
}

/// Wakes a program from its wait, and knows whether packets wait for it.
pub struct Bell<E>(Arc<Shared<E>>);

impl<E> Bell<E> {
    /// Has the program's [`wait`](Events::wait) end, now or when it begins next.
    pub fn ring(&self) {
        let mut line = self.0.lock();
        line.nudged = true;
        self.0.wake(&mut line);
    }

    /// Whether packets wait that the program has not taken; one that came later may not be looked at before them.
    pub fn is_crowded(&self) -> bool {
        self.0.droppable.load(Ordering::Acquire) > 0
    }
}

/// The program's end of a queue.
pub struct Events<E> {
    shared: Arc<Shared<E>>,
    /// What was taken from the queue at once.
    taken: RefCell<Inner<E>>,
}

/// What ended a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake<T> {
    /// A message arrived.
    Message(T),
    /// The deadline has passed, and no message was waiting.
    Deadline,
    /// All senders are gone.
    Closed,
}

impl<E> Events<E> {
    /// Waits until an event is there, a [`Bell`] rings, or the deadline has passed (`None`: never): [`Wake::Message`] in the
    /// first two cases, and [`Wake::Deadline`] never early. With `patience`, packets that may be dropped do not end the wait:
    /// in a flood of them it is cheaper to wait for many than to be woken for each.
    pub fn wait(&self, deadline: Option<Instant>, patience: bool) -> Wake<()> {
        if !self.taken.borrow().is_empty() {
            return Wake::Message(());
        }
        let mut line = self.shared.lock();
        loop {
            line.patient = false;
            if !line.due.lasting.is_empty() || line.nudged || !(patience || line.due.droppable.is_empty()) {
                line.nudged = false;
                return Wake::Message(());
            }
            if line.feeds == 0 {
                return Wake::Closed;
            }
            line.waiting = true;
            line.patient = patience;
            let changed = &self.shared.changed;
            line = match deadline {
                None => changed.wait(line).unwrap_or_else(PoisonError::into_inner),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left == Duration::ZERO {
                        line.waiting = false;
                        line.patient = false;
                        return Wake::Deadline;
                    }
                    changed.wait_timeout(line, left).unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }

    /// Waits without patience and without sleeping: ends within a microsecond or two of the deadline, at the price of a processor for so long.
    pub(crate) fn watch(&self, deadline: Instant) -> Wake<()> {
        loop {
            let now = Instant::now();
            match self.wait(Some(now), false) {
                // The queue is left alone in between, for those who feed it.
                Wake::Deadline if now < deadline => (0..HINTS).for_each(|_| std::hint::spin_loop()),
                end => return end,
            }
        }
    }

    /// The next event, if one is there.
    pub fn pop(&self) -> Option<E> {
        let mut taken = self.taken.borrow_mut();
        if taken.is_empty() {
            // All at once: the two ends meet once per burst and not once per event.
            let mut line = self.shared.lock();
            taken.ticket = line.due.ticket;
            std::mem::swap(&mut *taken, &mut line.due);
        }
        let (event, droppable) = taken.pop()?;
        if droppable {
            self.shared.droppable.fetch_sub(1, Ordering::Release);
        }
        Some(event)
    }

    /// A bell for this queue.
    pub fn bell(&self) -> Bell<E> {
        Bell(Arc::clone(&self.shared))
    }

    /// The next event, without waiting.
    ///
    /// # Errors
    /// None is there, or all senders are gone.
    pub fn try_recv(&self) -> Result<E, TryRecvError> {
        match self.pop() {
            Some(event) => Ok(event),
            None if self.shared.lock().feeds == 0 => self.pop().ok_or(TryRecvError::Disconnected),
            None => Err(TryRecvError::Empty),
        }
    }

    /// The next event.
    ///
    /// # Errors
    /// All senders are gone.
    pub fn recv(&self) -> Result<E, RecvError> {
        match recv_until(self, None) {
            Wake::Message(event) => Ok(event),
            Wake::Deadline | Wake::Closed => Err(RecvError),
        }
    }

    /// The next event, if it comes in time.
    ///
    /// # Errors
    /// None came, or all senders are gone.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<E, RecvTimeoutError> {
        match recv_until(self, Instant::now().checked_add(timeout)) {
            Wake::Message(event) => Ok(event),
            Wake::Deadline => Err(RecvTimeoutError::Timeout),
            Wake::Closed => Err(RecvTimeoutError::Disconnected),
        }
    }
}

impl<E> Drop for Events<E> {
    fn drop(&mut self) {
        let mut line = self.shared.lock();
        line.listening = false;
        // What nobody will see is freed now, outside the lock.
        let unseen = std::mem::take(&mut line.due);
        drop(line);
        drop(unseen);
    }
}

impl<E> Iterator for Events<E> {
    type Item = E;

    fn next(&mut self) -> Option<E> {
        self.recv().ok()
    }
}

impl<E> fmt::Debug for Events<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Events").finish_non_exhaustive()
    }
}

/// Waits for a message until a deadline (`None`: without end). Never returns [`Wake::Deadline`] early, and prefers a
/// waiting message even when the deadline has passed.
pub fn recv_until<E>(events: &Events<E>, deadline: Option<Instant>) -> Wake<E> {
    loop {
        if let Some(event) = events.pop() {
            return Wake::Message(event);
        }
        match events.wait(deadline, false) {
            Wake::Message(()) => {}
            Wake::Deadline => return Wake::Deadline,
            Wake::Closed => return Wake::Closed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::sharpen_this_thread;
    use proptest::prelude::*;

    #[test]
    fn a_wait_never_ends_early() {
        let (_feed, events) = queue::<()>(1);
        sharpen_this_thread();
        for micros in [0, 1, 50, 300, 2_000] {
            let deadline = Instant::now() + Duration::from_micros(micros);
            assert_eq!(recv_until(&events, Some(deadline)), Wake::Deadline);
            assert!(Instant::now() >= deadline);
        }
    }

    #[test]
    fn watching_never_ends_early_and_sees_what_waiting_sees() {
        let (feed, events) = queue(9);
        let deadline = Instant::now() + Duration::from_micros(300);
        assert_eq!(events.watch(deadline), Wake::Deadline);
        assert!(Instant::now() >= deadline);
        // What comes meanwhile, or is there, ends it long before this deadline.
        let later = Instant::now() + Duration::from_secs(600);
        let bell = events.bell();
        std::thread::scope(|scope| {
            scope.spawn(move || bell.ring());
            assert_eq!(events.watch(later), Wake::Message(()));
        });
        feed.droppable([1].into_iter(), |_| ());
        assert_eq!(events.watch(later), Wake::Message(()));
        drop(feed);
        assert_eq!(events.pop(), Some(1));
        assert_eq!(events.watch(later), Wake::Closed);
    }

    #[test]
    fn a_waiting_message_comes_before_a_passed_deadline_and_closing_after_the_last_message() {
        let (feed, events) = queue(9);
        feed.lasting(1).expect("room");
        feed.droppable([2].into_iter(), |_| ());
        let passed = Some(Instant::now());
        assert_eq!(recv_until(&events, passed), Wake::Message(1));
        assert_eq!(recv_until(&events, None), Wake::Message(2));
        assert_eq!(recv_until(&events, passed), Wake::Deadline);
        let other = feed.clone();
        drop(feed);
        assert_eq!(events.try_recv(), Err(TryRecvError::Empty));
        assert!(other.announce(3));
        drop(other);
        assert_eq!(recv_until(&events, None), Wake::Message(3));
        assert_eq!(recv_until(&events, None), Wake::Closed);
        assert_eq!(recv_until(&events, passed), Wake::Closed);
    }

    #[test]
    fn a_bell_ends_one_wait_and_is_not_forgotten() {
        let (_feed, events) = queue::<()>(1);
        events.bell().ring();
        assert_eq!(events.wait(None, false), Wake::Message(()));
        assert_eq!(events.pop(), None);
        assert_eq!(events.wait(Some(Instant::now()), false), Wake::Deadline);
    }

    #[test]
    fn patience_is_not_disturbed_by_packets() {
        let (feed, events) = queue(9);
        feed.droppable([1].into_iter(), |_| ());
        let soon = Some(Instant::now() + Duration::from_millis(1));
        assert_eq!(events.wait(soon, true), Wake::Deadline);
        feed.lasting(2).expect("room");
        assert_eq!(events.wait(None, true), Wake::Message(()));
        assert_eq!((events.pop(), events.pop()), (Some(1), Some(2)));
    }

    #[test]
    fn who_does_not_listen_is_sent_nothing() {
        let (feed, events) = queue(1);
        drop(events);
        assert!(!feed.droppable([1].into_iter(), |_| ()));
        assert_eq!(feed.lasting(1), Err(Refused::Nobody));
        assert!(!feed.announce(1));
    }

    proptest! {
        /// What is lost is the oldest of what may be lost; the rest comes in the order in which it was sent.
        #[test]
        fn the_oldest_packets_are_dropped_and_the_order_is_kept(
            capacity in 1usize..6, sent in prop::collection::vec(any::<bool>(), 0..40)
        ) {
            let (feed, events) = queue(capacity);
            let bell = events.bell();
            let (mut dropped, mut refused) = (Vec::new(), 0);
            for (number, droppable) in sent.iter().enumerate() {
                match droppable {
                    true => prop_assert!(feed.droppable([number].into_iter(), |oldest| dropped.push(*oldest))),
                    false => refused += usize::from(feed.lasting(number) == Err(Refused::Full)),
                }
            }
            prop_assert_eq!(bell.is_crowded(), sent.contains(&true));
            let came: Vec<usize> = std::iter::from_fn(|| events.pop()).collect();
            let of = |kind: bool| (0..sent.len()).filter(|n| sent[*n] == kind).collect::<Vec<_>>();
            let (packets, others) = (of(true), of(false));
            let mut expected: Vec<usize> = packets[packets.len().saturating_sub(capacity)..].to_vec();
            expected.extend(&others[..others.len().min(capacity)]);
            expected.sort_unstable();
            prop_assert_eq!(came, expected);
            prop_assert_eq!(&dropped[..], &packets[..packets.len().saturating_sub(capacity)]);
            prop_assert_eq!(refused, others.len().saturating_sub(capacity));
            prop_assert!(!bell.is_crowded());
        }
    }
}
