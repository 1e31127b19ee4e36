//! A hub, participants, plain Zenoh clients and child processes for the tests.

use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::Events;
use bus::setup::Endpoint;
use bus::switchboard::{HubEvent, LineId, Switchboard, SwitchboardConfig};
use bus::{PROTOCOL_VERSION, Plane};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use zenoh::{Config, Session, Wait};

pub(crate) const PATIENCE: Duration = Duration::from_secs(30);

/// The next event; a failure if there is none in time.
pub(crate) fn next<Q: Queue>(queue: &Q) -> Q::Item {
    match queue.next_within(PATIENCE) {
        Ok(event) => event,
        Err(RecvTimeoutError::Timeout) => panic!("nothing happened for {PATIENCE:?}"),
        Err(RecvTimeoutError::Disconnected) => panic!("the queue is closed"),
    }
}

/// What a test waits on.
pub(crate) trait Queue {
    type Item;
    fn next_within(&self, patience: Duration) -> Result<Self::Item, RecvTimeoutError>;
}

impl<T> Queue for Receiver<T> {
    type Item = T;
    fn next_within(&self, patience: Duration) -> Result<T, RecvTimeoutError> {
        self.recv_timeout(patience)
    }
}

impl<T> Queue for Events<T> {
    type Item = T;
    fn next_within(&self, patience: Duration) -> Result<T, RecvTimeoutError> {
        self.recv_timeout(patience)
    }
}

/// A state-plane message as a bundle of its own.
pub(crate) fn alone(message: &[u8]) -> Vec<u8> {
    [&(message.len() as u16).to_le_bytes(), message].concat()
}

pub(crate) fn any_port() -> Endpoint {
    Endpoint::local().with_port(0)
}

/// An endpoint that was free a moment ago, for a hub that has to come back to it.
pub(crate) fn free_endpoint() -> Endpoint {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    Endpoint::local().with_port(listener.local_addr().expect("bound").port())
}

pub(crate) fn hub() -> (Switchboard, Events<HubEvent>) {
    Switchboard::open(SwitchboardConfig::new(any_port())).expect("the hub opens")
}

pub(crate) fn line(endpoint: &Endpoint, id: &str) -> (Line, Events<LineEvent>) {
    let mut config = LineConfig::new(endpoint.clone(), id);
    config.patience = Some(PATIENCE);
    config.queue = 1 << 16;
    let (line, events) = Line::connect(config).expect("the line connects");
    assert_eq!(next(&events), LineEvent::Connected);
    (line, events)
}

/// Connects a participant and takes the hub's `Joined` from its queue.
pub(crate) fn joined(hub: &Switchboard, hub_events: &Events<HubEvent>, id: &str) -> (Line, Events<LineEvent>, LineId) {
    let (line, events) = line(hub.endpoint(), id);
    let number = expect_joined(hub_events, id);
    (line, events, number)
}

pub(crate) fn expect_joined(hub_events: &Events<HubEvent>, expected: &str) -> LineId {
    match next(hub_events) {
        HubEvent::Joined { line, id } if id == expected => line,
        other => panic!("{expected} should have joined, but {other:?}"),
    }
}

pub(crate) fn expect_up(hub_events: &Events<HubEvent>, from: LineId) -> (Plane, Vec<u8>) {
    match next(hub_events) {
        HubEvent::Packet { line, plane, bytes, .. } if line == from => (plane, bytes),
        other => panic!("{from} should have sent something, but {other:?}"),
    }
}

pub(crate) fn expect_down(events: &Events<LineEvent>) -> (Plane, Vec<u8>) {
    match next(events) {
        LineEvent::Packet { plane, bytes, .. } => (plane, bytes),
        other => panic!("a packet should have arrived, but {other:?}"),
    }
}

/// A Zenoh client that knows nothing of this project.
pub(crate) fn plain_client(port: u16) -> Session {
    let config = format!(
        r#"{{mode: "client", connect: {{endpoints: ["tcp/127.0.0.1:{port}"], timeout_ms: 10000}},
            scouting: {{multicast: {{enabled: false}}, gossip: {{enabled: false}}}}}}"#
    );
    zenoh::open(Config::from_json5(&config).expect("valid")).wait().expect("the client opens")
}

/// Everything that a plain client hears on any key.
pub(crate) fn hear_everything(session: &Session, heard: Sender<(String, Vec<u8>)>) {
    session
        .declare_subscriber("**")
        .allowed_origin(zenoh::sample::Locality::Remote)
        .callback(move |sample| {
            let _ = heard.send((sample.key_expr().to_string(), sample.payload().to_bytes().into_owned()));
        })
        .background()
        .wait()
        .expect("declaring succeeds");
}

/// Asks for a line as the documentation of the lobby says; the port, or the refusal's text.
pub(crate) fn ask_for_line(lobby: &Session, id: &str, nonce: u64) -> Result<u16, String> {
    let question = format!("cpf/join/{id}?version={PROTOCOL_VERSION};nonce={nonce:016x}");
    let replies = lobby.get(question).timeout(PATIENCE).wait().expect("asking succeeds");
    let reply = replies.recv().expect("the hub answers");
    assert!(replies.recv().is_err(), "one answer, and no other");
    match reply.result() {
        Ok(sample) => {
            let text = sample.payload().try_to_string().expect("text").into_owned();
            let port = text.split(';').find_map(|field| field.strip_prefix("port=")).expect("a port");
            Ok(port.parse().expect("a number"))
        }
        Err(refusal) => Err(refusal.payload().try_to_string().expect("text").into_owned()),
    }
}

/// The frame that opens a line.
pub(crate) fn hello(nonce: u64) -> Vec<u8> {
    let mut frame = vec![0x10];
    frame.extend(nonce.to_le_bytes());
    frame
}

/// A process that plays one of the roles in `lives.rs`, and dies with the test.
pub(crate) struct Actor(Child);

impl Actor {
    pub(crate) fn start(role: &str, endpoint: &Endpoint) -> Actor {
        let test_program = std::env::current_exe().expect("this program");
        let child = Command::new(test_program)
            .args([role, "--exact", "--ignored", "--nocapture"])
            .env("CPF_TEST_ENDPOINT", endpoint.to_string())
            .stdout(Stdio::null())
            .spawn()
            .expect("a child process");
        Actor(child)
    }

    /// Stops every thread of the process, and returns when they have stopped.
    pub(crate) fn freeze(&self) {
        let pid = Pid::from_child(&self.0);
        kill_process(pid, Signal::STOP).expect("the child exists");
        waitpid(Some(pid), WaitOptions::UNTRACED).expect("the child stops");
    }

    pub(crate) fn thaw(&self) {
        kill_process(Pid::from_child(&self.0), Signal::CONT).expect("the child exists");
    }

    /// Kill -9.
    pub(crate) fn kill(mut self) {
        self.0.kill().expect("the child exists");
        self.0.wait().expect("the child is dead");
    }
}

impl Drop for Actor {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The endpoint that an actor was started with.
pub(crate) fn role_endpoint() -> Endpoint {
    std::env::var("CPF_TEST_ENDPOINT").expect("started by a test").parse().expect("an endpoint")
}
