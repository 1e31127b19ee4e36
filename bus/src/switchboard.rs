//! The hub's end of the star: a lobby, and one line for each participant.
//!
//! A line is reused when its participant comes back, but its session is not: every admission opens a fresh session on a
//! fresh port. What a frozen ghost of the participant still sends to the old port reaches nobody.

use std::collections::HashMap;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::query::Query;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::counts::{Counts, Tally};
use crate::error::{Error, Result};
pub use crate::inbox::Messages;
use crate::inbox::{Handshake, Inbox};
use crate::lobby::{Admission, PROTOCOL_VERSION, Refusal, Request, check_id};
use crate::outbox::Outbox;
use crate::plane::{BUNDLE, Frame, Plane, Size, bundle, down_key, hub_token, join_key, participant_token, up_key};
use crate::queue::{Events, Feed, queue};
use crate::setup::{self, Endpoint, LEASE};

/// How long [`Switchboard::close`] waits for participants to take what was sent to them.
const FAREWELL: Duration = Duration::from_secs(1);
/// How long a line that is out of service keeps its session, so that the two ends do not close it at once.
const REST: Duration = Duration::from_millis(500);
/// Another process may take a port between its being found free and its being listened on.
const PORT_TRIES: usize = 10;

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

/// The lines, as the sending threads see them.
#[derive(Default)]
struct Lines(RwLock<Vec<Arc<HubLine>>>);

struct HubLine {
    id: String,
    tally: Arc<Tally>,
    /// Whether the program has ever heard of it.
    known: AtomicBool,
    /// The living session's way out, if there is one.
    inbox: Mutex<Option<Arc<Inbox<HubEvent>>>>,
}

impl HubLine {
    fn new(id: &str) -> HubLine {
        HubLine {
            id: id.into(),
            tally: Arc::new(Tally::of(id)),
            known: AtomicBool::new(false),
            inbox: Mutex::default(),
        }
    }
    fn inbox(&self) -> Option<Arc<Inbox<HubEvent>>> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
    fn set_inbox(&self, inbox: Option<Arc<Inbox<HubEvent>>>) {
        *self.inbox.lock().unwrap_or_else(PoisonError::into_inner) = inbox;
    }
}

impl Lines {
    fn get(&self, line: LineId) -> Option<Arc<HubLine>> {
        self.0.read().unwrap_or_else(PoisonError::into_inner).get(line.index()).cloned()
    }
    fn add(&self, line: HubLine) -> LineId {
        let mut lines = self.0.write().unwrap_or_else(PoisonError::into_inner);
        lines.push(Arc::new(line));
        LineId((lines.len() - 1) as u16)
    }
    /// Puts another line in the place of one that the program has never heard of.
    fn replace(&self, at: LineId, line: HubLine) -> LineId {
        let mut lines = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = lines.get_mut(at.index()) {
            *place = Arc::new(line);
        }
        at
    }
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

        let mut clerk = Clerk {
            endpoint: endpoint.clone(),
            max_lines: config.max_lines.min(usize::from(u16::MAX)),
            absence: config.absence,
            vacant: Vec::new(),
            events,
            tasks: tasks.clone(),
            lines: Arc::clone(&lines),
            shortcut: Arc::clone(&shortcut),
            by_id: HashMap::new(),
            sessions: HashMap::new(),
            admissions: 0,
            retired: Vec::new(),
        };
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
        let lines = self.lines.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        let deadline = Instant::now() + FAREWELL;
        let open: Vec<_> = lines.iter().filter_map(|line| line.inbox()).filter(|inbox| inbox.is_open()).collect();
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

/// What the clerk is asked to do.
enum Task {
    /// Somebody asks to be let in.
    Knock(Query),
    /// The participant of this admission is gone from its line.
    Gone { line: LineId, admission: u64 },
    /// The end.
    Close(Sender<()>),
}

/// Opens and closes lines, on a thread of its own: opening a session takes milliseconds.
struct Clerk {
    endpoint: Endpoint,
    max_lines: usize,
    absence: Duration,
    /// Lines of participants that never came: for the next.
    vacant: Vec<LineId>,
    events: Feed<HubEvent>,
    shortcut: Arc<OnceLock<Box<Shortcut>>>,
    tasks: Sender<Task>,
    lines: Arc<Lines>,
    by_id: HashMap<String, LineId>,
    sessions: HashMap<LineId, LineSession>,
    admissions: u64,
    /// The threads that close sessions which are out of service; dropping the sender wakes one from its rest.
    retired: Vec<(Sender<()>, JoinHandle<()>)>,
}

/// One admission: the session behind a port.
struct LineSession {
    /// Which of all admissions this is.
    admission: u64,
    /// Which incarnation of the participant it is for.
    nonce: u64,
    port: u16,
    opened: Instant,
    session: Session,
    inbox: Arc<Inbox<HubEvent>>,
    hub_token: LivelinessToken,
}

impl LineSession {
    /// Closes the session. The sign of life goes with it and not before: a participant that saw it vanish would close
    /// its end at the same moment, and two closings that meet make a task of Zenoh 1.10.2 panic.
    fn close(self) {
        let LineSession { session, hub_token, .. } = self;
        setup::close(session);
        drop(hub_token);
    }

    /// Closes a session whose participant is leaving or has left: it first lets the other end close.
    fn retire(self, resting: &Receiver<()>) {
        let LineSession { session, hub_token, .. } = self;
        drop(hub_token);
        let _ = resting.recv_timeout(REST);
        setup::close(session);
    }
}

impl Clerk {
    fn work(&mut self, orders: &Receiver<Task>) {
        while let Ok(task) = orders.recv() {
            match task {
                Task::Knock(query) => self.answer(&query),
                Task::Gone { line, admission } => {
                    if self.sessions.get(&line).is_some_and(|session| session.admission == admission) {
                        self.retire(line);
                    }
                }
                Task::Close(done) => {
                    // Everybody's peers learn it at once, and one that is slow to close holds up none of the others.
                    let lines: Vec<LineId> = self.sessions.keys().copied().collect();
                    std::thread::scope(|scope| {
                        for line in lines {
                            let Some((session, was_open)) = self.unplug(line) else { continue };
                            if was_open {
                                // The program may listen no more.
                                self.events.announce(HubEvent::Left { line });
                            }
                            scope.spawn(move || session.close());
                        }
                    });
                    for (rest, closer) in self.retired.drain(..) {
                        drop(rest);
                        let _ = closer.join();
                    }
                    let _ = done.send(());
                    return;
                }
            }
        }
    }

    fn answer(&mut self, query: &Query) {
        let key = query.key_expr().as_str();
        let id = key.rsplit('/').next().unwrap_or(key);
        let replied = match self.admit(id, query.parameters().as_str()) {
            Ok(Ok(admission)) => query.reply(query.key_expr().clone(), admission.encode()).wait(),
            Ok(Err(refusal)) => {
                tracing::info!("refused: {refusal}");
                query.reply_err(refusal.encode()).wait()
            }
            Err(error) => {
                tracing::error!("no line for {id}: {error}");
                query.reply_err(error.to_string()).wait()
            }
        };
        if let Err(error) = replied {
            tracing::debug!("{id} did not wait for its answer: {error}");
        }
    }

    fn admit(&mut self, id: &str, request: &str) -> Result<std::result::Result<Admission, Refusal>> {
        if let Err(refusal) = check_id(id) {
            return Ok(Err(refusal));
        }
        let request = Request::decode(request).unwrap_or(Request { version: 0, nonce: 0 });
        if request.version != PROTOCOL_VERSION {
            return Ok(Err(Refusal::Version { hub: PROTOCOL_VERSION, participant: request.version }));
        }
        self.forget_absentees();
        let line = match self.by_id.get(id) {
            Some(&line) => line,
            None if self.by_id.len() >= self.max_lines => return Ok(Err(Refusal::Full { lines: self.max_lines })),
            None => {
                let line = match self.vacant.pop() {
                    Some(vacant) => self.lines.replace(vacant, HubLine::new(id)),
                    None => self.lines.add(HubLine::new(id)),
                };
                self.by_id.insert(id.into(), line);
                line
            }
        };
        if let Some(session) = self.sessions.get(&line) {
            let same = session.nonce == request.nonce;
            // One that was admitted a moment ago is on its way.
            if !same && (session.inbox.is_open() || session.opened.elapsed() < LEASE) {
                return Ok(Err(Refusal::Taken { id: id.into() }));
            }
            // The answer was late, and the participant asks again.
            if same && session.inbox.is_waiting() {
                return Ok(Ok(Admission { port: session.port }));
            }
            // The participant has lost its session before the hub noticed, or never came for it.
            self.retire(line);
        }
        let session = self.open_line(line, id, request.nonce)?;
        let port = session.port;
        self.sessions.insert(line, session);
        Ok(Ok(Admission { port }))
    }

    /// Asking to be let in costs nothing, and places are few: who did not come gives the place back.
    fn forget_absentees(&mut self) {
        let is_absent = |session: &LineSession| session.inbox.is_waiting() && session.opened.elapsed() > self.absence;
        let absent: Vec<LineId> =
            self.sessions.iter().filter(|(_, session)| is_absent(session)).map(|(line, _)| *line).collect();
        for line in absent {
            let was_open = self.retire(line);
            if let Some(place) = self.lines.get(line)
                && !(was_open || place.known.load(Ordering::Acquire))
            {
                self.by_id.remove(&place.id);
                self.vacant.push(line);
            }
        }
    }

    /// Ends a line's session; its participant may come back. Whether it had joined.
    fn retire(&mut self, line: LineId) -> bool {
        let Some((session, was_open)) = self.unplug(line) else { return false };
        if was_open {
            self.events.announce(HubEvent::Left { line });
        }
        self.retired.retain(|(_, closer)| !closer.is_finished());
        let (rest, resting) = mpsc::channel();
        let closer = std::thread::Builder::new().name("bus-retire".into()).spawn(move || session.retire(&resting));
        if let Ok(closer) = closer {
            self.retired.push((rest, closer));
        }
        was_open
    }

    /// Takes a line's session out of service; true if its participant had joined.
    fn unplug(&mut self, line: LineId) -> Option<(LineSession, bool)> {
        let session = self.sessions.remove(&line)?;
        if let Some(line) = self.lines.get(line) {
            line.set_inbox(None);
        }
        let was_open = session.inbox.close();
        Some((session, was_open))
    }

    fn open_line(&mut self, line: LineId, id: &str, nonce: u64) -> Result<LineSession> {
        self.admissions += 1;
        let admission = self.admissions;
        let mut tries = 0;
        let (endpoint, session) = loop {
            let endpoint = self.endpoint.with_port(0).free()?;
            match setup::listen(&endpoint, setup::line_config(&endpoint, id, nonce)?) {
                Ok(session) => break (endpoint, session),
                Err(Error::PortInUse(_)) if tries < PORT_TRIES => tries += 1,
                Err(error) => return Err(error),
            }
        };
        let hub_line = self.lines.get(line).ok_or(Error::NoSuchLine)?;
        let tally = Arc::clone(&hub_line.tally);
        let outbox = Outbox::new(&session, |plane| down_key(id, plane), Arc::clone(&tally))?;
        let packet = move |plane, at, bytes| HubEvent::Packet { line, plane, at, bytes };
        let lines = Arc::downgrade(&self.lines);
        let dropped = move |event: &HubEvent| {
            if let HubEvent::Packet { line, .. } = event
                && let Some(line) = lines.upgrade().and_then(|lines| lines.get(*line))
            {
                line.tally.drop_state();
            }
        };
        let inbox = Arc::new(Inbox::new(self.events.clone(), outbox, tally, packet, dropped));

        if self.shortcut.get().is_some() {
            let shortcut = Arc::clone(&self.shortcut);
            inbox.set_shortcut(Box::new(move |at, messages| {
                shortcut.get().into_iter().for_each(|take| take(line, at, messages))
            }));
        }

        let up = Arc::clone(&inbox);
        session
            .declare_subscriber(up_key(id, Plane::State))
            .callback(move |sample| up.on_state(&sample.payload().to_bytes()))
            .background()
            .wait()
            .map_err(Error::middleware)?;

        let (up, known) = (Arc::clone(&inbox), Arc::clone(&hub_line));
        let name = id.to_owned();
        session
            .declare_subscriber(up_key(id, Plane::Mission))
            .callback(move |sample| {
                if let Some(Handshake::Hello(hello)) = up.on_mission(&sample.payload().to_bytes())
                    && hello == nonce
                {
                    // The program can send only after the welcome: the welcome is the first thing that goes down.
                    let welcome = || _ = up.outbox.send_frame(&Frame::Welcome { nonce });
                    if up.open(HubEvent::Joined { line, id: name.clone() }, welcome) {
                        known.known.store(true, Ordering::Release);
                    }
                }
            })
            .background()
            .wait()
            .map_err(Error::middleware)?;

        let tasks = Mutex::new(self.tasks.clone());
        session
            .liveliness()
            .declare_subscriber(participant_token(id, nonce))
            .callback(move |sign| {
                if sign.kind() == SampleKind::Delete {
                    let _ = tasks.lock().unwrap_or_else(PoisonError::into_inner).send(Task::Gone { line, admission });
                }
            })
            .background()
            .wait()
            .map_err(Error::middleware)?;
        let hub_token = session.liveliness().declare_token(hub_token(id)).wait().map_err(Error::middleware)?;

        hub_line.set_inbox(Some(Arc::clone(&inbox)));
        Ok(LineSession { admission, nonce, port: endpoint.port(), opened: Instant::now(), session, inbox, hub_token })
    }
}
