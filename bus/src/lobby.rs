//! The words exchanged in the lobby: a participant asks for its line, the hub names a port or a reason.
//!
//! The request is a query on `cpf/join/<id>` with the parameters `version=2;nonce=<hex>`; the answer is the text
//! `port=<n>;version=2`, or an error reply `<code>: <reason>`. The nonce tells one incarnation of a participant
//! from the next.

use std::fmt;

/// Both ends must speak the same.
pub const PROTOCOL_VERSION: u16 = 4;

/// The longest identity of a participant.
const LONGEST_ID: usize = 32;

/// Why the hub does not let a participant in.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// A living participant has this identity.
    Taken {
        /// The identity.
        id: String,
    },
    /// The identity has characters other than `a-z 0-9 - _`, or is empty or too long.
    BadId {
        /// The identity.
        id: String,
    },
    /// The hub speaks another version of the protocol.
    Version {
        /// The hub's.
        hub: u16,
        /// The participant's.
        participant: u16,
    },
    /// All lines are taken.
    Full {
        /// How many there are.
        lines: usize,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Taken { id } => write!(f, "{id} is already connected"),
            Refusal::BadId { id } => {
                write!(
                    f,
                    "`{id}` cannot be an identity: 1 to {LONGEST_ID} of the characters a-z, 0-9, - and _ are expected"
                )
            }
            Refusal::Version { hub, participant } => write!(
                f,
                "the network-emulator speaks version {hub} of the line protocol and this program version {participant}: \
                 start programs of one release"
            ),
            Refusal::Full { lines } => write!(f, "all {lines} lines of the network-emulator are taken"),
        }
    }
}

impl Refusal {
    pub(crate) fn encode(&self) -> String {
        match self {
            Refusal::Taken { id } => format!("taken: {id}"),
            Refusal::BadId { id } => format!("id: {id}"),
            Refusal::Version { hub, participant } => format!("version: {hub} {participant}"),
            Refusal::Full { lines } => format!("full: {lines}"),
        }
    }

    pub(crate) fn decode(text: &str) -> Option<Refusal> {
        let (code, rest) = text.split_once(": ")?;
        Some(match code {
            "taken" => Refusal::Taken { id: rest.into() },
            "id" => Refusal::BadId { id: rest.into() },
            "version" => {
                let (hub, participant) = rest.split_once(' ')?;
                Refusal::Version { hub: hub.parse().ok()?, participant: participant.parse().ok()? }
            }
            "full" => Refusal::Full { lines: rest.parse().ok()? },
            _ => return None,
        })
    }
}

/// Accepts 1 to 32 of `a-z 0-9 - _`.
///
/// # Errors
/// The refusal that the hub would answer.
pub fn check_id(id: &str) -> Result<(), Refusal> {
    let fits = (1..=LONGEST_ID).contains(&id.len())
        && id.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'_');
    if fits { Ok(()) } else { Err(Refusal::BadId { id: id.into() }) }
}

/// What a participant asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) version: u16,
    pub(crate) nonce: u64,
}

impl Request {
    pub(crate) fn encode(self) -> String {
        format!("version={};nonce={:016x}", self.version, self.nonce)
    }

    pub(crate) fn decode(text: &str) -> Option<Request> {
        Some(Request {
            version: field(text, "version")?.parse().ok()?,
            nonce: u64::from_str_radix(field(text, "nonce")?, 16).ok()?,
        })
    }
}

/// Where the participant's line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Admission {
    pub(crate) port: u16,
}

impl Admission {
    pub(crate) fn encode(self) -> String {
        format!("port={};version={PROTOCOL_VERSION}", self.port)
    }

    pub(crate) fn decode(text: &str) -> Option<Admission> {
        Some(Admission { port: field(text, "port")?.parse().ok()? })
    }
}

fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.split(';').find_map(|pair| pair.split_once('=').filter(|(key, _)| *key == name)).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_admissions_and_refusals_survive_the_wire() {
        let request = Request { version: 7, nonce: 0x00ab_cdef };
        assert_eq!(Request::decode(&request.encode()), Some(request));
        let admission = Admission { port: 40_123 };
        assert_eq!(Admission::decode(&admission.encode()), Some(admission));
        for refusal in [
            Refusal::Taken { id: "auv1".into() },
            Refusal::BadId { id: "A: 1".into() },
            Refusal::Version { hub: 1, participant: 2 },
            Refusal::Full { lines: 256 },
        ] {
            assert_eq!(Refusal::decode(&refusal.encode()), Some(refusal));
        }
    }

    #[test]
    fn malformed_words_are_no_words() {
        for text in ["", "version=1", "nonce=0", "version=x;nonce=0", "version=1;nonce=xyz", "version=1;nonce=-1"] {
            assert_eq!(Request::decode(text), None, "{text}");
        }
        assert_eq!(Admission::decode("port=99999"), None);
        assert_eq!(Refusal::decode("version: 1"), None);
    }

    #[test]
    fn identities_are_short_and_plain() {
        for id in ["auv1", "mission-control", "a", "x_2", &"a".repeat(32)] {
            assert_eq!(check_id(id), Ok(()), "{id}");
        }
        for id in ["", "AUV1", "auv 1", "auv/1", "*", "é", &"a".repeat(33)] {
            assert!(check_id(id).is_err(), "{id}");
        }
    }
}
