//! The clerk of the hub: opens and closes lines, on a thread of its own, for opening a session takes milliseconds.

use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::query::Query;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use super::lines::{HubLine, Lines};
use super::{HubEvent, LineId, Shortcut, SwitchboardConfig};
use crate::clock::unix_ns;
use crate::counts::Tally;
use crate::error::{Error, Result};
use crate::inbox::{Handshake, Inbox};
use crate::lobby::{Admission, PROTOCOL_VERSION, Refusal, Request, check_id};
use crate::outbox::Outbox;
use crate::plane::{Frame, Plane, down_key, hub_token, participant_token, up_key};
use crate::queue::Feed;
use crate::setup::{self, Endpoint, LEASE};

/// How long a line that is out of service keeps its session, so that the two ends do not close it at once.
const REST: Duration = Duration::from_millis(500);
/// Another process may take a port between its being found free and its being listened on.
const PORT_TRIES: usize = 10;

/// What the clerk is asked to do.
pub(super) enum Task {
    /// Somebody asks to be let in.
    Knock(Query),
    /// The participant of this admission is gone from its line.
    Gone { line: LineId, admission: u64 },
    /// The end.
    Close(Sender<()>),
}

/// Who lets participants in, and sees them off.
pub(super) struct Clerk {
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
    /// The clerk of a hub that listens at this endpoint.
    pub(super) fn new(
        config: &SwitchboardConfig,
        endpoint: &Endpoint,
        events: Feed<HubEvent>,
        tasks: Sender<Task>,
        lines: Arc<Lines>,
        shortcut: Arc<OnceLock<Box<Shortcut>>>,
    ) -> Clerk {
        Clerk {
            endpoint: endpoint.clone(),
            max_lines: config.max_lines.min(usize::from(u16::MAX)),
            absence: config.absence,
            vacant: Vec::new(),
            events,
            shortcut,
            tasks,
            lines,
            by_id: HashMap::new(),
            sessions: HashMap::new(),
            admissions: 0,
            retired: Vec::new(),
        }
    }

    /// Works until the hub is closed.
    pub(super) fn work(&mut self, orders: &Receiver<Task>) {
        while let Ok(task) = orders.recv() {
            match task {
                Task::Knock(query) => self.answer(&query),
                Task::Gone { line, admission } => {
                    if self.sessions.get(&line).is_some_and(|session| session.admission == admission) {
                        self.retire(line);
                    }
                }
                Task::Close(done) => {
                    self.close();
                    let _ = done.send(());
                    return;
                }
            }
        }
    }

    /// Closes every line. Everybody's peers learn it at once, and one that is slow to close holds up none of the others.
    fn close(&mut self) {
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
        let Some(line) = self.line_of(id) else { return Ok(Err(Refusal::Full { lines: self.max_lines })) };
        if let Some(session) = self.sessions.get(&line) {
            let same = session.nonce == request.nonce;
            // One that was admitted a moment ago is on its way.
            if !same && (session.inbox.is_open() || session.opened.elapsed() < LEASE) {
                return Ok(Err(Refusal::Taken { id: id.into() }));
            }
            // The answer was late, and the participant asks again.
            if same && session.inbox.is_waiting() {
                return Ok(Ok(Admission { port: session.port, unix_ns: Some(unix_ns()) }));
            }
            // The participant has lost its session before the hub noticed, or never came for it.
            self.retire(line);
        }
        let session = self.open_line(line, id, request.nonce)?;
        let port = session.port;
        self.sessions.insert(line, session);
        Ok(Ok(Admission { port, unix_ns: Some(unix_ns()) }))
    }

    /// The line of a participant, a new one if need be; none if there is no place.
    fn line_of(&mut self, id: &str) -> Option<LineId> {
        if let Some(&line) = self.by_id.get(id) {
            return Some(line);
        }
        if self.by_id.len() >= self.max_lines {
            return None;
        }
        let line = match self.vacant.pop() {
            Some(vacant) => self.lines.replace(vacant, HubLine::new(id)),
            None => self.lines.add(HubLine::new(id)),
        };
        self.by_id.insert(id.into(), line);
        Some(line)
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

    /// Opens a line's session, and lets the participant with this nonce come.
    fn open_line(&mut self, line: LineId, id: &str, nonce: u64) -> Result<LineSession> {
        self.admissions += 1;
        let admission = self.admissions;
        let (endpoint, session) = self.listen(id, nonce)?;
        let hub_line = self.lines.get(line).ok_or(Error::NoSuchLine)?;
        let inbox = self.inbox(line, id, &session, &hub_line.tally)?;
        hear_states(&session, id, &inbox)?;
        hear_mission(&session, id, nonce, line, &inbox, &hub_line)?;
        self.watch(&session, id, nonce, line, admission)?;
        let hub_token = session.liveliness().declare_token(hub_token(id)).wait().map_err(Error::middleware)?;
        hub_line.set_inbox(Some(Arc::clone(&inbox)));
        Ok(LineSession { admission, nonce, port: endpoint.port(), opened: Instant::now(), session, inbox, hub_token })
    }

    /// A session on a free port of the hub's host.
    fn listen(&self, id: &str, nonce: u64) -> Result<(Endpoint, Session)> {
        let mut tries = 0;
        loop {
            let endpoint = self.endpoint.with_port(0).free()?;
            match setup::listen(&endpoint, setup::line_config(&endpoint, id, nonce)?) {
                Ok(session) => return Ok((endpoint, session)),
                Err(Error::PortInUse(_)) if tries < PORT_TRIES => tries += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// What a session's messages go through on their way to the program.
    fn inbox(&self, line: LineId, id: &str, session: &Session, tally: &Arc<Tally>) -> Result<Arc<Inbox<HubEvent>>> {
        let outbox = Outbox::new(session, |plane| down_key(id, plane), Arc::clone(tally))?;
        let packet = move |plane, at, bytes| HubEvent::Packet { line, plane, at, bytes };
        let lines = Arc::downgrade(&self.lines);
        let dropped = move |event: &HubEvent| {
            if let HubEvent::Packet { line, .. } = event
                && let Some(line) = lines.upgrade().and_then(|lines| lines.get(*line))
            {
                line.tally.drop_state();
            }
        };
        let inbox = Arc::new(Inbox::new(self.events.clone(), outbox, Arc::clone(tally), packet, dropped));
        if self.shortcut.get().is_some() {
            let shortcut = Arc::clone(&self.shortcut);
            inbox.set_shortcut(Box::new(move |at, messages| {
                shortcut.get().into_iter().for_each(|take| take(line, at, messages))
            }));
        }
        Ok(inbox)
    }

    /// Asks to be told when the participant is gone.
    fn watch(&self, session: &Session, id: &str, nonce: u64, line: LineId, admission: u64) -> Result<()> {
        let tasks = Mutex::new(self.tasks.clone());
        let watching = session.liveliness().declare_subscriber(participant_token(id, nonce)).callback(move |sign| {
            if sign.kind() == SampleKind::Delete {
                let _ = tasks.lock().unwrap_or_else(PoisonError::into_inner).send(Task::Gone { line, admission });
            }
        });
        watching.background().wait().map_err(Error::middleware)
    }
}

/// Takes what comes up on the state plane.
fn hear_states(session: &Session, id: &str, inbox: &Arc<Inbox<HubEvent>>) -> Result<()> {
    let up = Arc::clone(inbox);
    let hearing = session
        .declare_subscriber(up_key(id, Plane::State))
        .callback(move |sample| up.on_state(&sample.payload().to_bytes()));
    hearing.background().wait().map_err(Error::middleware)
}

/// Takes what comes up on the mission plane; the participant's hello opens the line.
fn hear_mission(
    session: &Session,
    id: &str,
    nonce: u64,
    line: LineId,
    inbox: &Arc<Inbox<HubEvent>>,
    hub_line: &Arc<HubLine>,
) -> Result<()> {
    let (up, hub_line, id) = (Arc::clone(inbox), Arc::clone(hub_line), id.to_owned());
    let key = up_key(&id, Plane::Mission);
    let hearing = session.declare_subscriber(key).callback(move |sample| {
        if let Some(Handshake::Hello(hello)) = up.on_mission(&sample.payload().to_bytes())
            && hello == nonce
        {
            // The program can send only after the welcome: the welcome is the first thing that goes down.
            let welcome = || _ = up.outbox.send_frame(&Frame::Welcome { nonce });
            if up.open(HubEvent::Joined { line, id: id.clone() }, welcome) {
                hub_line.known.store(true, Ordering::Release);
            }
        }
    });
    hearing.background().wait().map_err(Error::middleware)
}
