//! The words exchanged in the lobby: a participant asks for its line, the hub names a port or a reason.
//!
//! The request is a query on `cpf/join/<id>` with the parameters `version=2;nonce=<hex>`; the answer is the text
//! `port=<n>;version=2;clock=<ns>`, or an error reply `<code>: <reason>`. The nonce tells one incarnation of a participant
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
    /// The hub's wall clock when it answered \[ns of the UNIX epoch\].
    pub(crate) unix_ns: Option<i64>,
}

impl Admission {
    pub(crate) fn encode(self) -> String {
        let clock = self.unix_ns.map_or(String::new(), |unix_ns| format!(";clock={unix_ns}"));
        format!("port={};version={PROTOCOL_VERSION}{clock}", self.port)
    }

    pub(crate) fn decode(text: &str) -> Option<Admission> {
        let unix_ns = field(text, "clock").and_then(|clock| clock.parse().ok());
        Some(Admission { port: field(text, "port")?.parse().ok()?, unix_ns })
    }
}

/// Clocks that agree to within this are those of one fleet \[ns\].
const AGREED_NS: i64 = 1_000_000_000;

/// How far the clock of a participant is ahead of the hub's \[ns\], from when it asked and when it had its answer on its own clock,
/// and when the hub answered on its own; `None` if both may agree: an answer may have taken long.
pub(crate) fn clock_ahead(asked_ns: i64, answered_ns: i64, hub_ns: i64) -> Option<i64> {
    let (least, most) = (asked_ns.saturating_sub(hub_ns), answered_ns.saturating_sub(hub_ns));
    let off = least > AGREED_NS || most < -AGREED_NS;
    off.then_some(least / 2 + most / 2)
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
        let admission = Admission { port: 40_123, unix_ns: Some(-1_700_000_000_000_000_001) };
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
        assert_eq!(Admission::decode("port=99999;clock=0"), None);
        assert_eq!(Admission::decode("port=9;clock=x"), Some(Admission { port: 9, unix_ns: None }));
        assert_eq!(Refusal::decode("version: 1"), None);
    }

    #[test]
    fn clocks_are_off_only_if_no_delay_explains_it() {
        const S: i64 = 1_000_000_000;
        let ahead = |asked: i64, answered: i64| clock_ahead(100 * S + asked, 100 * S + answered, 100 * S);
        assert_eq!(ahead(-S / 10, S / 10), None);
        assert_eq!(ahead(-20 * S, S / 10), None, "the answer took 20 s");
        assert_eq!(ahead(29 * S / 10, 31 * S / 10), Some(3 * S));
        assert_eq!(ahead(-3601 * S, -3599 * S), Some(-3600 * S));
        assert_eq!(clock_ahead(i64::MAX, i64::MAX, i64::MIN), Some(i64::MAX / 2 * 2));
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
