//! What can go wrong on the bus, in words for the person at the terminal.

use std::fmt;
use std::time::Duration;

use crate::lobby::Refusal;
use crate::plane::Plane;
use crate::setup::Endpoint;

/// Why the bus could not do what it was asked.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The text is not `tcp/HOST:PORT`.
    BadEndpoint {
        /// The text as given.
        found: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Another program listens there.
    PortInUse(Endpoint),
    /// The address does not belong to this machine, or its name is unknown.
    CannotListen {
        /// Where to listen.
        endpoint: Endpoint,
        /// The system's reason.
        why: String,
    },
    /// Nobody answered within the patience given.
    NoHub {
        /// Where a hub was expected.
        endpoint: Endpoint,
        /// How long it was waited for.
        waited: Duration,
        /// The last reason.
        why: String,
    },
    /// The hub was waited for until there was a reason to wait no longer.
    InVain(String),
    /// The hub answered, and said no.
    Refused(Refusal),
    /// The line has no living session at this moment; the message was not sent.
    NotConnected,
    /// No line has this number.
    NoSuchLine,
    /// The message is larger than its plane carries.
    TooLarge {
        /// The plane.
        plane: Plane,
        /// The message's size in bytes.
        bytes: usize,
    },
    /// The other end takes nothing and the line's backlog is full; the message was not sent.
    Backlogged,
    /// The middleware refused something that it should not have.
    Middleware(String),
}

/// Shorthand.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn middleware(error: impl fmt::Display) -> Error {
        Error::Middleware(plainly(&error.to_string()))
    }
}

/// What the middleware says, without the places in its own sources, which mean nothing at a terminal.
fn plainly(text: &str) -> String {
    if text.starts_with("Unable to connect to any of") {
        return "no session could be opened with what listens there".to_owned();
    }
    let mut words: Vec<&str> = Vec::new();
    for word in text.split_whitespace() {
        let is_place = word.starts_with('/') && word.contains(".rs:");
        match (is_place, words.last()) {
            (false, _) => words.push(word),
            (true, Some(&"at")) => {
                words.pop();
            }
            (true, _) => {}
        }
    }
    words.join(" ").trim_end_matches(['.', '!', ' ']).to_owned()
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::BadEndpoint { found, why } => {
                write!(f, "`tcp/HOST:PORT` expected (such as `tcp/127.0.0.1:7447`), found `{found}`: {why}")
            }
            Error::PortInUse(endpoint) => write!(
                f,
                "{endpoint} is already in use: another network-emulator may be running there; stop it, or choose \
                 another port with --listen (port 0 takes a free one)"
            ),
            Error::CannotListen { endpoint, why } => write!(f, "cannot listen on {endpoint}: {why}"),
            Error::NoHub { endpoint, waited, why } => {
                write!(f, "no network-emulator at {endpoint} after {:.1} s: {why}", waited.as_secs_f64())
            }
            Error::InVain(why) => f.write_str(why),
            Error::Refused(refusal) => refusal.fmt(f),
            Error::NotConnected => f.write_str("the line is not connected"),
            Error::NoSuchLine => f.write_str("there is no such line"),
            Error::TooLarge { plane, bytes } => {
                write!(f, "a message of {bytes} bytes exceeds the {plane} plane's limit of {} bytes", plane.limit())
            }
            Error::Backlogged => f.write_str("the other end takes no messages and the backlog is full"),
            Error::Middleware(why) => write!(f, "the middleware failed: {why}"),
        }
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_middleware_says_names_no_source() {
        for (said, told) in [
            (
                "Unable to connect to any of [Single(tcp/127.0.0.1:7447)]! at /root/.cargo/registry/src/x/orchestrator.rs:447.",
                "no session could be opened with what listens there",
            ),
            (
                "Can not create a listener: address in use at /home/a/.cargo/registry/src/x/unicast.rs:352. - Caused by y at \
                 /b/net.rs:7.",
                "Can not create a listener: address in use - Caused by y",
            ),
            ("the disk is full", "the disk is full"),
        ] {
            assert_eq!(Error::middleware(said), Error::Middleware(told.to_owned()));
        }
    }
}
