//! How this project uses Zenoh, in one place.
//!
//! | decision | why |
//! |---|---|
//! | no scouting, no gossip, no plugins, explicit endpoints | nobody may find a way around the emulator |
//! | the hub's sessions are routers, a participant's is a client | a client talks to its router only |
//! | default-deny access control on every listening session | what is not listed below does not cross |
//! | lease 2 s on both sides | each side's lease is what the *other* side waits before it believes a silence |
//! | 16 batches for each plane's queue | a burst must not become a loss, and the mission plane never blocks |
//! | the hub's sessions do not wait for room for a state | one slow participant would hold up all others |
//! | at most 64 KiB per message received | the default is 1 GiB |
//!
//! Sessions run on Zenoh's own threads, so everything here is called from plain threads and from no async runtime.
//! [`share_one_runtime`] halves those threads.

use std::fmt;
use std::io::ErrorKind;
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::str::FromStr;
use std::sync::mpsc;
use std::time::Duration;

use zenoh::{Config, Session, Wait};

use crate::error::{Error, Result};
use crate::plane::{Plane, down_key, hub_token, join_key, participant_token, up_key};

/// How long either side stays silent before the other holds it for dead. Death by `kill` is seen at once; this is for
/// frozen machines and cut cables, and shorter than two seconds a loaded machine would be held for dead too.
pub const LEASE: Duration = Duration::from_secs(2);

/// Zenoh keeps five runtimes with a thread or two each; this hands all their work to one with two threads. Two, so that
/// one that is busy does not hold up the signs of life.
const ONE_RUNTIME: &str =
    "(rx:(handover:app),tx:(handover:app),acc:(handover:app),net:(handover:app),app:(worker_threads:2))";

/// Gives this process half the threads and about a seventh less processor time per message; delays stay as they are.
///
/// To be called first in `main`. Zenoh takes this setting only from the environment variable `ZENOH_RUNTIME`, which a
/// running process cannot change safely; so the process replaces itself by itself with the variable set, keeping its
/// identity and arguments. It does nothing if the variable is set already, and goes on as it is where it cannot.
pub fn share_one_runtime() {
    const VARIABLE: &str = "ZENOH_RUNTIME";
    if std::env::var_os(VARIABLE).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let name = arguments.next().unwrap_or_default();
    let failure = match std::env::current_exe() {
        Ok(program) => Command::new(program).arg0(name).args(arguments).env(VARIABLE, ONE_RUNTIME).exec(),
        Err(error) => error,
    };
    tracing::debug!("this process keeps its many threads: {failure}");
}

/// A TCP address, `tcp/HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    host: String,
    port: u16,
}

impl Endpoint {
    /// Where the hub listens if nothing else is said: this machine only.
    pub fn local() -> Endpoint {
        Endpoint { host: "127.0.0.1".into(), port: 7447 }
    }
    /// The host, a name or an address (IPv6 in brackets).
    pub fn host(&self) -> &str {
        &self.host
    }
    /// The port; 0 lets the system choose one.
    pub fn port(&self) -> u16 {
        self.port
    }
    /// Another port of the same host.
    pub fn with_port(&self, port: u16) -> Endpoint {
        Endpoint { host: self.host.clone(), port }
    }

    fn addresses(&self) -> std::io::Result<impl Iterator<Item = std::net::SocketAddr>> {
        format!("{}:{}", self.host, self.port).to_socket_addrs()
    }

    /// Whether somebody accepts connections here; cheap enough to ask several times a second.
    pub(crate) fn reachable(&self, timeout: Duration) -> std::io::Result<()> {
        let mut last = std::io::Error::from(ErrorKind::NotFound);
        for address in self.addresses()? {
            match TcpStream::connect_timeout(&address, timeout) {
                Ok(_) => return Ok(()),
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// This endpoint if it can be listened on, with a free port in place of port 0.
    ///
    /// The port is free when this returns; another process may still take it before it is used.
    pub(crate) fn free(&self) -> Result<Endpoint> {
        let cannot = |error: std::io::Error| match error.kind() {
            ErrorKind::AddrInUse => Error::PortInUse(self.clone()),
            _ => Error::CannotListen { endpoint: self.clone(), why: error.to_string() },
        };
        let mut addresses = self.addresses().map_err(cannot)?;
        let Some(address) = addresses.next() else {
            return Err(cannot(ErrorKind::NotFound.into()));
        };
        let listener = TcpListener::bind(address).map_err(cannot)?;
        Ok(self.with_port(listener.local_addr().map_err(cannot)?.port()))
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tcp/{}:{}", self.host, self.port)
    }
}

impl FromStr for Endpoint {
    type Err = Error;

    fn from_str(text: &str) -> Result<Endpoint> {
        let bad = |why| Error::BadEndpoint { found: text.into(), why };
        let address = text.strip_prefix("tcp/").ok_or_else(|| bad("it does not begin with `tcp/`"))?;
        let (host, port) = address.rsplit_once(':').ok_or_else(|| bad("it has no port"))?;
        let port = port.parse().map_err(|_| bad("the port is not a number from 0 to 65535"))?;
        let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._".contains(&b);
        let bracketed = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        match bracketed {
            Some(inner) if inner.parse::<std::net::Ipv6Addr>().is_ok() => {}
            Some(_) => return Err(bad("the brackets hold no IPv6 address")),
            None if host.is_empty() => return Err(bad("it has no host")),
            None if host.contains(':') => return Err(bad("an IPv6 address is written in brackets")),
            None if !host.bytes().all(plain) => return Err(bad("the host has a character that no host name has")),
            None => {}
        }
        Ok(Endpoint { host: host.into(), port })
    }
}

/// The hub's lobby: queries on `cpf/join/*` and their replies, nothing else.
pub(crate) fn lobby_config(endpoint: &Endpoint) -> Result<Config> {
    let join = join_key("*");
    let rules = [
        Rule { id: "ask", flow: "ingress", messages: r#""query""#, keys: vec![join.clone()] },
        Rule { id: "answer", flow: "egress", messages: r#""reply", "declare_queryable""#, keys: vec![join] },
    ];
    router_config(endpoint, &rules)
}

/// A participant's line: its two up keys in, its two down keys out, and the two signs of life.
///
/// Any key may be subscribed, so that a plain listener can be put on a line, but only the inbox comes out.
pub(crate) fn line_config(endpoint: &Endpoint, id: &str, nonce: u64) -> Result<Config> {
    let ups = || vec![up_key(id, Plane::State), up_key(id, Plane::Mission)];
    let downs = || vec![down_key(id, Plane::State), down_key(id, Plane::Mission)];
    let alive = || vec![participant_token(id, nonce)];
    let hub = || vec![hub_token(id)];
    let watch = r#""declare_liveliness_subscriber", "liveliness_query""#;
    let rules = [
        Rule { id: "up", flow: "ingress", messages: r#""put""#, keys: ups() },
        Rule { id: "up-known", flow: "egress", messages: r#""declare_subscriber""#, keys: ups() },
        Rule { id: "down", flow: "egress", messages: r#""put""#, keys: downs() },
        Rule { id: "listen", flow: "ingress", messages: r#""declare_subscriber""#, keys: vec!["**".into()] },
        Rule { id: "alive", flow: "ingress", messages: r#""liveliness_token""#, keys: alive() },
        Rule { id: "alive-watched", flow: "egress", messages: watch, keys: alive() },
        Rule { id: "hub", flow: "egress", messages: r#""liveliness_token""#, keys: hub() },
        Rule { id: "hub-watched", flow: "ingress", messages: watch, keys: hub() },
    ];
    router_config(endpoint, &rules)
}

struct Rule {
    id: &'static str,
    flow: &'static str,
    messages: &'static str,
    keys: Vec<String>,
}

fn router_config(endpoint: &Endpoint, rules: &[Rule]) -> Result<Config> {
    let listed = |rule: &Rule| {
        let Rule { id, flow, messages, keys } = rule;
        format!(
            r#"{{id: "{id}", permission: "allow", flows: ["{flow}"], messages: [{messages}], key_exprs: {keys:?}}}"#
        )
    };
    let rule_list = rules.iter().map(listed).collect::<Vec<_>>().join(", ");
    let names = rules.iter().map(|rule| format!("{:?}", rule.id)).collect::<Vec<_>>().join(", ");
    let policy = format!(
        r#"{{enabled: true, default_permission: "deny", rules: [{rule_list}],
             subjects: [{{id: "anyone"}}], policies: [{{rules: [{names}], subjects: ["anyone"]}}]}}"#
    );
    let settings = [
        ("mode", r#""router""#.to_owned()),
        ("listen/endpoints", format!(r#"["{endpoint}"]"#)),
        // A router otherwise sleeps half a second in open().
        ("scouting/delay", "0".to_owned()),
        ("timestamping/enabled", "false".to_owned()),
        // Connections that say nothing must not keep the others out.
        ("transport/unicast/accept_pending", "1000".to_owned()),
        ("transport/unicast/accept_timeout", "2000".to_owned()),
        ("access_control", policy),
    ];
    common_config(&settings)
}

/// A participant's session towards `endpoint`; opening it tries once, and gives up on a silent peer after `timeout`.
pub(crate) fn client_config(endpoint: &Endpoint, timeout: Duration) -> Result<Config> {
    let settings = [
        ("mode", r#""client""#.to_owned()),
        ("connect/endpoints", format!(r#"["{endpoint}"]"#)),
        // Trying again is the caller's business: it can be called off.
        ("connect/timeout_ms", "0".to_owned()),
        ("transport/unicast/open_timeout", timeout.as_millis().to_string()),
    ];
    common_config(&settings)
}

fn common_config(settings: &[(&str, String)]) -> Result<Config> {
    let shared = [
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("transport/link/tx/lease", LEASE.as_millis().to_string()),
        ("transport/link/tx/queue/size/data", "16".to_owned()),
        ("transport/link/tx/queue/size/data_low", "16".to_owned()),
        // What is for a peer that takes nothing is dropped at once: nobody else's may wait for it.
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "0".to_owned()),
        ("transport/link/rx/max_message_size", "65536".to_owned()),
    ];
    let mut config = Config::default();
    for (key, value) in shared.iter().chain(settings) {
        config.insert_json5(key, value).map_err(|error| Error::Middleware(format!("{key}: {error}")))?;
    }
    Ok(config)
}

/// Opens a session.
pub(crate) fn open(config: Config) -> Result<Session> {
    zenoh::open(config).wait().map_err(Error::middleware)
}

/// Opens a listening session; a port that is in use is an error of its own.
pub(crate) fn listen(endpoint: &Endpoint, config: Config) -> Result<Session> {
    open(config).map_err(|error| match error {
        Error::Middleware(why) if why.contains("in use") => Error::PortInUse(endpoint.clone()),
        error => error,
    })
}

/// Closes a session, waiting for it at most a second: a frozen peer must not hold up the caller.
pub(crate) fn close(session: Session) {
    let (done, finished) = mpsc::channel();
    let closer = std::thread::Builder::new().name("bus-close".into()).spawn(move || {
        if let Err(error) = session.close().wait() {
            tracing::debug!("closing a session: {error}");
        }
        let _ = done.send(());
    });
    if closer.is_ok() {
        let _ = finished.recv_timeout(Duration::from_secs(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_read_as_they_are_written() {
        for text in ["tcp/127.0.0.1:7447", "tcp/network-emulator:7447", "tcp/[::1]:0", "tcp/0.0.0.0:65535"] {
            assert_eq!(text.parse::<Endpoint>().map(|endpoint| endpoint.to_string()), Ok(text.to_owned()));
        }
    }

    #[test]
    fn a_wrong_endpoint_is_named_with_its_fault() {
        for (text, fault) in [
            ("127.0.0.1:7447", "does not begin"),
            ("udp/127.0.0.1:7447", "does not begin"),
            ("tcp/127.0.0.1", "no port"),
            ("tcp/127.0.0.1:", "not a number"),
            ("tcp/127.0.0.1:70000", "not a number"),
            ("tcp/:7447", "no host"),
            ("tcp/::1:7447", "brackets"),
            ("tcp/[nonsense]:7447", "no IPv6"),
            ("tcp/a\"b:7447", "no host name"),
            ("tcp/a b:7447", "no host name"),
        ] {
            let error = text.parse::<Endpoint>().expect_err(text).to_string();
            assert!(error.contains("tcp/HOST:PORT") && error.contains(text) && error.contains(fault), "{error}");
        }
    }

    #[test]
    fn zenoh_accepts_every_configuration() {
        let endpoint = Endpoint::local();
        assert!(lobby_config(&endpoint).is_ok());
        assert!(line_config(&endpoint, "auv1", 1).is_ok());
        assert!(client_config(&endpoint, LEASE).is_ok());
    }

    #[test]
    fn a_taken_port_is_told_apart_from_an_address_of_another_machine() {
        let free = Endpoint::local().with_port(0).free().expect("a free port");
        let _holder = TcpListener::bind((free.host(), free.port())).expect("the port was free");
        assert_eq!(free.free(), Err(Error::PortInUse(free.clone())));
        let foreign: Endpoint = "tcp/192.0.2.1:7447".parse().expect("an endpoint");
        assert!(matches!(foreign.free(), Err(Error::CannotListen { .. })));
    }
}
