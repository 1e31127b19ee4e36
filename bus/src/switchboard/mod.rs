//! The hub's end of the star: a lobby, and one line for each participant.
//!
//! A line is reused when its participant comes back, but its session is not: every admission opens a fresh session on a
//! fresh port. What a frozen ghost of the participant still sends to the old port reaches nobody.
//!
//! Here is what the program sees of it; the clerk opens and closes lines.

mod clerk;
mod lines;

use std::fmt;
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::Wait;

use self::clerk::{Clerk, Task};
use self::lines::Lines;
use crate::counts::Counts;
use crate::error::{Error, Result};
pub use crate::inbox::Messages;
use crate::plane::{BUNDLE, Plane, Size, bundle, join_key};
use crate::queue::{Events, queue};
use crate::setup::{self, Endpoint};

/// How long [`Switchboard::close`] waits for participants to take what was sent to them.
const FAREWELL: Duration = Duration::from_secs(1);
/// What a hub is opened with.
#[derive(Clone, Debug)]
pub struct SwitchboardConfig {
    /// Where the lobby listens; lines listen on free ports of the same host. Port 0 lets the system choose.
    pub endpoint: Endpoint,
    /// The most participants, dead ones included.
    pub max_lines: usize,
    /// Who was let in and has not come for so long gives the place back.
    pub absence: Duration,
    /// The most packets of each plane that wait for the program; beyond, the oldest states and the newest others are
    /// dropped and counted.
    pub queue: usize,
}

impl SwitchboardConfig {
    /// 512 lines, ten seconds to come, and 65 536 waiting packets of each plane.
    pub fn new(endpoint: Endpoint) -> SwitchboardConfig {
        SwitchboardConfig { endpoint, max_lines: 512, absence: Duration::from_secs(10), queue: 1 << 16 }
    }
}

/// The number of a line: 0 for the first participant that joined, and its own for as long as the hub lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LineId(u16);

impl LineId {
    /// The number, for indexing.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for LineId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.0)
    }
}

/// What happens on the hub's lines. A line's packets come after its `Joined` and before its `Left`.
#[derive(Clone, PartialEq, Eq)]
pub enum HubEvent {
    /// A participant holds its line, and can be sent to.
    Joined {
        /// Its line.
        line: LineId,
        /// Its identity.
        id: String,
    },
    /// The participant closed its line, died, or was silent for too long.
    Left {
        /// Its line.
        line: LineId,
    },
    /// A message has arrived.
    Packet {
        /// Whose it is.
        line: LineId,
        /// The plane it came on.
        plane: Plane,
        /// When it arrived, taken on the transport's thread.
        at: Instant,
        /// The message.
        bytes: Vec<u8>,
    },
}

impl fmt::Debug for HubEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HubEvent::Joined { line, id } => f.debug_struct("Joined").field("line", line).field("id", id).finish(),
            HubEvent::Left { line } => f.debug_struct("Left").field("line", line).finish(),
            HubEvent::Packet { line, plane, bytes, .. } => {
                f.debug_tuple("Packet").field(line).field(plane).field(&Size(bytes.len())).finish()
            }
        }
    }
}

/// The hub: all lines of the star end here.
pub struct Switchboard {
    endpoint: Endpoint,
    lines: Arc<Lines>,
    tasks: Sender<Task>,
    clerk: Option<JoinHandle<()>>,
    shortcut: Arc<OnceLock<Box<Shortcut>>>,
    /// What is sent with the next [`flush`](Switchboard::flush), by line.
    posted: Vec<Posted>,
    /// The lines for which something is posted.
    addressed: Vec<LineId>,
}

/// Who may take a line's state-plane messages at once, on the transport's thread: as many as it likes, beginning with the first.
pub type Shortcut = dyn Fn(LineId, Instant, &mut Messages<'_>) + Send + Sync;

/// State-plane messages for one line.
#[derive(Clone, Debug, Default)]
struct Posted {
    bundle: Vec<u8>,
    messages: u64,
}

impl Switchboard {
    /// Opens the lobby.
    pub fn open(config: SwitchboardConfig) -> Result<(Switchboard, Events<HubEvent>)> {
        let endpoint = config.endpoint.free()?;
        let lobby = setup::listen(&endpoint, setup::lobby_config(&endpoint)?)?;
        let (events, receiver) = queue(config.queue);
        let (tasks, orders) = mpsc::channel();
        let shortcut = Arc::<OnceLock<Box<Shortcut>>>::default();
        let lines = Arc::<Lines>::default();

        let knocks = Mutex::new(tasks.clone());
        lobby
            .declare_queryable(join_key("*"))
            .callback(move |query| {
                let _ = knocks.lock().unwrap_or_else(PoisonError::into_inner).send(Task::Knock(query));
            })
            .background()
            .wait()
            .map_err(Error::middleware)?;

        let mut clerk =
            Clerk::new(&config, &endpoint, events, tasks.clone(), Arc::clone(&lines), Arc::clone(&shortcut));
        let clerk = std::thread::Builder::new()
            .name("bus-clerk".into())
            .spawn(move || {
                clerk.work(&orders);
                setup::close(lobby);
            })
            .map_err(Error::middleware)?;
        tracing::debug!("the lobby listens on {endpoint}");
        let (posted, addressed) = (Vec::new(), Vec::new());
        Ok((Switchboard { endpoint, lines, tasks, clerk: Some(clerk), shortcut, posted, addressed }, receiver))
    }

    /// Where the lobby listens.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// Sends to one participant, from any thread, without ever waiting for it.
    ///
    /// On the state plane the oldest messages are dropped and counted if the participant does not keep up. On the mission plane it waits in
    /// the line's backlog; it is lost only with the line, which the hub then hears as [`HubEvent::Left`].
    pub fn send(&self, line: LineId, plane: Plane, bytes: &[u8]) -> Result<()> {
        let line = self.lines.get(line).ok_or(Error::NoSuchLine)?;
        let inbox = line.inbox().filter(|inbox| inbox.lets_send()).ok_or(Error::NotConnected)?;
        inbox.outbox.send(plane, bytes)
    }

    /// Puts a state-plane message with those that the next [`flush`](Switchboard::flush) sends to this participant.
    ///
    /// Messages that travel together cost the transport as much as one. A bundle that is full goes at once: the
    /// moment at which it was handed to the session, if it was.
    pub fn post(&mut self, line: LineId, message: &[u8]) -> Option<Instant> {
        if message.len() > Plane::State.limit() {
            return None;
        }
        if self.posted.len() <= line.index() {
            self.posted.resize(line.index() + 1, Posted::default());
        }
        let posted = &mut self.posted[line.index()];
        if posted.messages == 0 {
            self.addressed.push(line);
        }
        bundle(&mut posted.bundle, message);
        posted.messages += 1;
        if posted.bundle.len() < BUNDLE {
            return None;
        }
        let at = Switchboard::dispatch(&self.lines, line, posted);
        self.addressed.retain(|other| *other != line);
        Some(at)
    }

    /// Sends what was posted, without waiting for anybody; how many messages. `gone` is told when those of a line were
    /// handed to its session.
    ///
    /// What a participant cannot be sent is dropped, as the state plane may, and counted.
    pub fn flush(&mut self, mut gone: impl FnMut(LineId, Instant)) -> usize {
        let mut messages = 0;
        for line in self.addressed.drain(..) {
            let posted = &mut self.posted[line.index()];
            messages += posted.messages as usize;
            let at = Switchboard::dispatch(&self.lines, line, posted);
            gone(line, at);
        }
        messages
    }

    /// Whether nothing waits to be sent.
    pub fn is_flushed(&self) -> bool {
        self.addressed.is_empty()
    }

    /// Hands messages to a line's session; the moment at which that was done.
    fn dispatch(lines: &Lines, line: LineId, posted: &mut Posted) -> Instant {
        let Posted { bundle, messages } = std::mem::take(posted);
        let line = lines.get(line);
        let inbox = line.as_ref().and_then(|line| line.inbox());
        match inbox.filter(|inbox| inbox.is_open()) {
            // It fails only with the session, whose end is noticed elsewhere.
            Some(inbox) => _ = inbox.outbox.send_bundle(bundle, messages),
            None => line.iter().for_each(|line| line.tally.state_unsent.add(messages)),
        }
        Instant::now()
    }

    /// Lets state-plane messages be taken as they arrive, on the transport's threads and before they are queued. What is not
    /// taken is queued. It counts for lines that are opened from now on, and only the first shortcut does.
    pub fn set_shortcut(&self, shortcut: Box<Shortcut>) {
        let _ = self.shortcut.set(shortcut);
    }

    /// The identity of a line's participant.
    pub fn id(&self, line: LineId) -> Option<String> {
        self.lines.get(line).map(|line| line.id.clone())
    }

    /// What has passed on a line so far, over all of its sessions.
    pub fn counts(&self, line: LineId) -> Option<Counts> {
        self.lines.get(line).map(|line| line.tally.counts())
    }

    /// Lets participants take what was sent to them (for a second at most), then closes every line and the lobby.
    /// Dropping does the same.
    pub fn close(&mut self) {
        self.flush(|_, _| ());
        let deadline = Instant::now() + FAREWELL;
        let open = self.lines.open();
        // All are asked before any is waited for: a silent one must not use up the others' time.
        let asked: Vec<_> = open.iter().filter(|inbox| inbox.outbox.ask_to_acknowledge().is_ok()).collect();
        for inbox in asked {
            inbox.outbox.drain(deadline);
        }
        let (done, closed) = mpsc::channel();
        let _ = self.tasks.send(Task::Close(done));
        // The clerk may be stuck announcing something to a program that no longer listens.
        if closed.recv_timeout(Duration::from_secs(5)).is_ok()
            && let Some(clerk) = self.clerk.take()
        {
            let _ = clerk.join();
        }
    }
}

impl Drop for Switchboard {
    fn drop(&mut self) {
        self.close();
    }
}

impl fmt::Debug for Switchboard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Switchboard").field("endpoint", &self.endpoint).finish_non_exhaustive()
    }
}
