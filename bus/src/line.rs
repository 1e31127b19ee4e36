//! A participant's end of its line to the hub.
//!
//! [`Line::connect`] waits for the hub, asks in its lobby, and opens the line. From then on a thread of the line watches
//! for the hub's death; it reports [`LineEvent::Lost`], goes back to the lobby, and reports [`LineEvent::Connected`]
//! when there is a hub again. The program's own threads only send and receive.

use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::counts::{Counts, Tally};
use crate::error::{Error, Result};
use crate::inbox::{Handshake, Inbox};
use crate::lobby::{Admission, PROTOCOL_VERSION, Refusal, Request, check_id};
use crate::outbox::Outbox;
use crate::plane::{Frame, Plane, Size, down_key, hub_token, join_key, participant_token, up_key};
use crate::queue::{Events, Feed, queue};
use crate::setup::{self, Endpoint, LEASE};

/// How often a hub that is not there is looked for.
const RETRY: Duration = Duration::from_millis(100);
/// How often the waiting is mentioned.
const REMINDER: Duration = Duration::from_secs(5);
/// A host that does not even refuse is given up after this long, and tried again.
const REACH: Duration = Duration::from_secs(1);
/// One step of joining (connecting, the answer in the lobby, the handshake) fails after this long, and is tried again.
const STEP: Duration = Duration::from_secs(3);
/// How often the first word is repeated until it is answered.
const HELLO_AGAIN: Duration = Duration::from_millis(250);
/// The hub needs this long to notice that a participant of the same identity has frozen or lost its cable.
const GHOST: Duration = Duration::from_millis(LEASE.as_millis() as u64 + 500);
/// How long [`Line::close`] waits for the hub to take what was sent to it.
const FAREWELL: Duration = Duration::from_secs(1);

/// What a line is opened with.
#[derive(Clone, Debug)]
pub struct LineConfig {
    /// The hub's lobby.
    pub endpoint: Endpoint,
    /// Who joins: a vehicle's identity, or `mission-control`.
    pub id: String,
    /// How long to wait for the hub; `None` is for ever.
    pub patience: Option<Duration>,
    /// The most packets of each plane that wait for the program; beyond, the oldest states and the newest others are
    /// dropped and counted.
    pub queue: usize,
}

impl LineConfig {
    /// Waits for ever, with 8 192 waiting events: there may be a hundred of these processes.
    pub fn new(endpoint: Endpoint, id: impl Into<String>) -> LineConfig {
        LineConfig { endpoint, id: id.into(), patience: None, queue: 1 << 13 }
    }
}

/// What happens on a participant's line. Packets come only between `Connected` and `Lost`.
#[derive(Clone, PartialEq, Eq)]
pub enum LineEvent {
    /// The hub answers; messages pass both ways. The first event is this one.
    Connected,
    /// The hub is gone. The line looks for it by itself.
    Lost,
    /// The hub is back and does not let this participant in again; the line has given up. The last event.
    Refused(Refusal),
    /// A message has arrived.
    Packet {
        /// The plane it came on.
        plane: Plane,
        /// When it arrived, taken on the transport's thread.
        at: Instant,
        /// The message.
        bytes: Vec<u8>,
    },
}

impl fmt::Debug for LineEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LineEvent::Connected => f.write_str("Connected"),
            LineEvent::Lost => f.write_str("Lost"),
            LineEvent::Refused(refusal) => f.debug_tuple("Refused").field(refusal).finish(),
            LineEvent::Packet { plane, bytes, .. } => {
                f.debug_tuple("Packet").field(plane).field(&Size(bytes.len())).finish()
            }
        }
    }
}

/// One participant's line to the hub.
pub struct Line {
    shared: Arc<Shared>,
    signals: Sender<Signal>,
    keeper: Option<JoinHandle<()>>,
}

struct Shared {
    id: String,
    tally: Arc<Tally>,
    /// The living session's way out, if there is one.
    inbox: Mutex<Option<Arc<Inbox<LineEvent>>>>,
    /// Whether the program is about to leave: a hub that goes then is not missed.
    leaving: AtomicBool,
}

impl Shared {
    fn inbox(&self) -> Option<Arc<Inbox<LineEvent>>> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
    fn set_inbox(&self, inbox: Option<Arc<Inbox<LineEvent>>>) {
        *self.inbox.lock().unwrap_or_else(PoisonError::into_inner) = inbox;
    }
}

impl Line {
    /// Waits for the hub, joins, and opens the line.
    ///
    /// Ends with an error if the hub refuses, or does not appear within the patience. That the identity is in use is
    /// believed only after two and a half seconds: it may be this participant's own ghost, killed a moment ago.
    pub fn connect(config: LineConfig) -> Result<(Line, Events<LineEvent>)> {
        Line::connect_unless(config, &mut || None)
    }

    /// Likewise, until there is a reason to wait no longer: it is asked for after every attempt, ten times a second or so.
    pub fn connect_unless(
        config: LineConfig,
        in_vain: &mut dyn FnMut() -> Option<String>,
    ) -> Result<(Line, Events<LineEvent>)> {
        check_id(&config.id).map_err(Error::Refused)?;
        let (events, receiver) = queue(config.queue);
        let (signals, orders) = mpsc::channel();
        let tally = Arc::new(Tally::of("the network-emulator"));
        let shared =
            Arc::new(Shared { id: config.id, tally, inbox: Mutex::default(), leaving: AtomicBool::new(false) });
        let mut keeper = Keeper {
            endpoint: config.endpoint,
            // A number that no other incarnation of this participant has; the standard library's hasher has a seed.
            nonce: RandomState::new().hash_one(std::process::id()),
            shared: Arc::clone(&shared),
            events,
            signals: signals.clone(),
            orders,
            link: None,
        };
        keeper.join_hub(config.patience, Duration::ZERO, in_vain)?;
        let keeper = std::thread::Builder::new()
            .name("bus-line".into())
            .spawn(move || keeper.keep())
            .map_err(Error::middleware)?;
        Ok((Line { shared, signals, keeper: Some(keeper) }, receiver))
    }

    /// Sends to the hub, from any thread, without ever waiting for it.
    ///
    /// On the state plane the oldest messages are dropped and counted if the hub does not keep up. On the mission plane it waits in the
    /// line's backlog; it is lost only with the line, which the program then hears as [`LineEvent::Lost`].
    pub fn send(&self, plane: Plane, bytes: &[u8]) -> Result<()> {
        let inbox = self.shared.inbox().filter(|inbox| inbox.lets_send()).ok_or(Error::NotConnected)?;
        inbox.outbox.send(plane, bytes)
    }

    /// Whether messages pass at this moment.
    pub fn is_connected(&self) -> bool {
        self.shared.inbox().is_some_and(|inbox| inbox.is_open())
    }

    /// Who joined.
    pub fn id(&self) -> &str {
        &self.shared.id
    }

    /// What has passed so far, over all reconnections.
    pub fn counts(&self) -> Counts {
        self.shared.tally.counts()
    }

    /// Sends a last message and leaves. A hub that ends because of it is not missed.
    pub fn close_with(self, plane: Plane, bytes: &[u8]) -> Result<()> {
        self.shared.leaving.store(true, Ordering::Relaxed);
        self.send(plane, bytes)
        // Dropping does the rest.
    }

    /// Lets the hub take what was sent to it (for a second at most), then leaves.
    pub fn close(self) {
        // Dropping does it.
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.shared.leaving.store(true, Ordering::Relaxed);
        if let Some(inbox) = self.shared.inbox().filter(|inbox| inbox.is_open())
            && inbox.outbox.ask_to_acknowledge().is_ok()
        {
            inbox.outbox.drain(Instant::now() + FAREWELL);
        }
        let _ = self.signals.send(Signal::Close);
        if let Some(keeper) = self.keeper.take() {
            let _ = keeper.join();
        }
    }
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Line").field("id", &self.shared.id).finish_non_exhaustive()
    }
}

/// What the keeper is told, by the transport's threads and by the program. The number tells one link from the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Signal {
    Welcomed(u64),
    HubGone(u64),
    Close,
}

/// Keeps the line: joins, watches, and joins again.
struct Keeper {
    endpoint: Endpoint,
    nonce: u64,
    shared: Arc<Shared>,
    events: Feed<LineEvent>,
    signals: Sender<Signal>,
    orders: Receiver<Signal>,
    link: Option<Link>,
}

/// One session on the line.
struct Link {
    number: u64,
    session: Session,
    inbox: Arc<Inbox<LineEvent>>,
    _token: LivelinessToken,
}

/// Why joining did not work this time.
enum Setback {
    /// The hub is not there, or does not answer.
    Absent(String),
    /// The hub says no.
    Refused(Refusal),
    /// The program closes the line.
    Closing,
}

impl Keeper {
    fn keep(mut self) {
        loop {
            match self.orders.recv() {
                Ok(Signal::HubGone(number)) if self.link.as_ref().is_some_and(|link| link.number == number) => {
                    if self.shared.leaving.load(Ordering::Relaxed) {
                        return self.hang_up();
                    }
                    tracing::warn!("{}: the network-emulator is gone; looking for it", self.shared.id);
                    self.hang_up();
                    if !self.events.announce(LineEvent::Lost) {
                        return;
                    }
                    // That it is looked for was said.
                    match self.join_hub(None, REMINDER, &mut || None) {
                        Ok(()) => tracing::info!("{}: the network-emulator is back", self.shared.id),
                        Err(Error::Refused(refusal)) => {
                            tracing::error!("{}: the network-emulator is back, but {refusal}", self.shared.id);
                            self.events.announce(LineEvent::Refused(refusal));
                            return;
                        }
                        Err(_) => return,
                    }
                }
                Ok(Signal::HubGone(_) | Signal::Welcomed(_)) => {}
                Ok(Signal::Close) | Err(_) => {
                    self.hang_up();
                    return;
                }
            }
        }
    }

    fn hang_up(&mut self) {
        self.shared.set_inbox(None);
        if let Some(Link { session, inbox, .. }) = self.link.take() {
            inbox.close();
            setup::close(session);
        }
    }

    /// Tries until it works, at first in silence, the patience ends, it is in vain, the hub's refusal is final, or the program
    /// closes the line.
    fn join_hub(
        &mut self,
        patience: Option<Duration>,
        silence: Duration,
        in_vain: &mut dyn FnMut() -> Option<String>,
    ) -> Result<()> {
        let begun = Instant::now();
        let mut reminder = begun + silence;
        let mut taken_since: Option<Instant> = None;
        loop {
            let left = patience.map_or(STEP, |patience| patience.saturating_sub(begun.elapsed()));
            let why = match self.try_to_join(left.clamp(RETRY, STEP)) {
                Ok(()) => return Ok(()),
                Err(Setback::Closing) => return Err(Error::NotConnected),
                Err(Setback::Refused(refusal @ Refusal::Taken { .. })) => {
                    if taken_since.get_or_insert_with(Instant::now).elapsed() > GHOST {
                        return Err(Error::Refused(refusal));
                    }
                    format!("{refusal}: queued for its place, for {:.1} s at most", GHOST.as_secs_f64())
                }
                Err(Setback::Refused(refusal)) => return Err(Error::Refused(refusal)),
                Err(Setback::Absent(why)) => {
                    taken_since = None;
                    why
                }
            };
            if let Some(why) = in_vain() {
                return Err(Error::InVain(why));
            }
            let waited = begun.elapsed();
            if patience.is_some_and(|patience| waited >= patience) {
                return Err(Error::NoHub { endpoint: self.endpoint.clone(), waited, why });
            }
            if Instant::now() >= reminder {
                reminder = Instant::now() + REMINDER;
                tracing::info!("{}: waiting for the network-emulator at {} ({why})", self.shared.id, self.endpoint);
            }
            let pause = patience.map_or(RETRY, |patience| RETRY.min(patience.saturating_sub(waited)));
            if self.closing_within(pause) {
                return Err(Error::NotConnected);
            }
        }
    }

    /// Lets time pass; true if the program closes the line.
    fn closing_within(&self, pause: Duration) -> bool {
        let until = Instant::now() + pause;
        loop {
            match self.orders.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(Signal::Close) | Err(RecvTimeoutError::Disconnected) => return true,
                Err(RecvTimeoutError::Timeout) => return false,
                Ok(_) => {}
            }
        }
    }

    fn try_to_join(&mut self, step: Duration) -> std::result::Result<(), Setback> {
        let absent = |error: Error| Setback::Absent(error.to_string());
        // Asking the socket first is cheaper than opening a session, and quieter.
        self.endpoint.reachable(step.min(REACH)).map_err(|error| Setback::Absent(error.to_string()))?;
        let lobby = setup::open(setup::client_config(&self.endpoint, step).map_err(absent)?).map_err(absent)?;
        let admission = self.ask(&lobby, step);
        setup::close(lobby);
        let endpoint = self.endpoint.with_port(admission?.port);

        let session = setup::open(setup::client_config(&endpoint, step).map_err(absent)?).map_err(absent)?;
        let link = self.plug_in(session).map_err(absent)?;
        // Before the handshake: who hears `Connected` may send at once.
        self.shared.set_inbox(Some(Arc::clone(&link.inbox)));
        let shaken = self.shake_hands(&link, step);
        self.link = Some(link);
        if shaken.is_err() {
            self.hang_up();
        }
        shaken
    }

    fn ask(&self, lobby: &Session, step: Duration) -> std::result::Result<Admission, Setback> {
        let absent = |why: &str| Setback::Absent(why.to_owned());
        let request = Request { version: PROTOCOL_VERSION, nonce: self.nonce };
        let question = format!("{}?{}", join_key(&self.shared.id), request.encode());
        let replies = lobby.get(question).timeout(step).wait().map_err(|error| absent(&error.to_string()))?;
        let Ok(reply) = replies.recv() else {
            return Err(absent("something listens there, but does not answer as a network-emulator"));
        };
        match reply.result() {
            Ok(sample) => {
                let text = sample.payload().try_to_string().unwrap_or_default();
                Admission::decode(&text).ok_or_else(|| absent("its answer is not understood"))
            }
            Err(error) => {
                let text = error.payload().try_to_string().unwrap_or_default();
                Err(Refusal::decode(&text).map_or_else(|| Setback::Absent(text.into_owned()), Setback::Refused))
            }
        }
    }

    /// Declares everything on a fresh session. The order matters: who says hello can already hear.
    fn plug_in(&self, session: Session) -> Result<Link> {
        let id = self.shared.id.as_str();
        let number = RandomState::new().hash_one(self.nonce);
        let tally = Arc::clone(&self.shared.tally);
        let outbox = Outbox::new(&session, |plane| up_key(id, plane), Arc::clone(&tally))?;
        let packet = |plane, at, bytes| LineEvent::Packet { plane, at, bytes };
        let own = Arc::clone(&tally);
        let dropped = move |_: &LineEvent| own.drop_state();
        let inbox = Arc::new(Inbox::new(self.events.clone(), outbox, tally, packet, dropped));

        let down = Arc::clone(&inbox);
        session
            .declare_subscriber(down_key(id, Plane::State))
            .callback(move |sample| down.on_state(&sample.payload().to_bytes()))
            .background()
            .wait()
            .map_err(Error::middleware)?;

        let down = Arc::clone(&inbox);
        let nonce = self.nonce;
        let signals = Mutex::new(self.signals.clone());
        session
            .declare_subscriber(down_key(id, Plane::Mission))
            .callback(move |sample| {
                if down.on_mission(&sample.payload().to_bytes()) == Some(Handshake::Welcome(nonce)) {
                    let opened = down.open(LineEvent::Connected, || ());
                    let signal = if opened { Signal::Welcomed(number) } else { Signal::HubGone(number) };
                    let _ = signals.lock().unwrap_or_else(PoisonError::into_inner).send(signal);
                }
            })
            .background()
            .wait()
            .map_err(Error::middleware)?;

        let signals = Mutex::new(self.signals.clone());
        session
            .liveliness()
            .declare_subscriber(hub_token(id))
            .history(true)
            .callback(move |sign| {
                if sign.kind() == SampleKind::Delete {
                    let _ = signals.lock().unwrap_or_else(PoisonError::into_inner).send(Signal::HubGone(number));
                }
            })
            .background()
            .wait()
            .map_err(Error::middleware)?;
        let token =
            session.liveliness().declare_token(participant_token(id, nonce)).wait().map_err(Error::middleware)?;
        Ok(Link { number, session, inbox, _token: token })
    }

    /// Says hello until it is welcomed.
    fn shake_hands(&self, link: &Link, step: Duration) -> std::result::Result<(), Setback> {
        let begun = Instant::now();
        while begun.elapsed() < step {
            link.inbox
                .outbox
                .send_frame(&Frame::Hello { nonce: self.nonce })
                .map_err(|error| Setback::Absent(error.to_string()))?;
            let again = Instant::now() + HELLO_AGAIN;
            loop {
                match self.orders.recv_timeout(again.saturating_duration_since(Instant::now())) {
                    Ok(Signal::Welcomed(welcomed)) if welcomed == link.number => return Ok(()),
                    Ok(Signal::HubGone(gone)) if gone == link.number => {
                        return Err(Setback::Absent("the line was closed".into()));
                    }
                    Ok(Signal::Close) | Err(RecvTimeoutError::Disconnected) => return Err(Setback::Closing),
                    Err(RecvTimeoutError::Timeout) => break,
                    Ok(_) => {}
                }
            }
        }
        Err(Setback::Absent("the line does not answer".into()))
    }
}
