//! The two planes of a line: their keys, their limits, and the frames of the mission plane.
//!
//! | plane | carries | when the other end is slow | largest message |
//! |---|---|---|---|
//! | state | one small coordination message per period | the oldest that wait are dropped and counted: newer ones follow | 8 KiB, in bundles |
//! | mission | missions, commands, the stepped clock, logs | the message waits in the line's backlog | 4 MiB, in frames of 32 KiB |
//!
//! A session of its own carries each line, so the keys name the participant only to be readable by outside tools.

use std::fmt;

/// Which of a line's two planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Plane {
    /// The coordination plane: small, periodic, droppable.
    State,
    /// The mission plane: none is lost and none is overtaken while the line is connected.
    Mission,
}

impl Plane {
    /// The largest message that the plane carries \[bytes\].
    pub const fn limit(self) -> usize {
        match self {
            Plane::State => 8 << 10,
            Plane::Mission => 4 << 20,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Plane::State => "state",
            Plane::Mission => "mission",
        }
    }
}

impl fmt::Display for Plane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A message's size stands for its bytes wherever an event is printed: they may be millions.
pub(crate) struct Size(pub(crate) usize);

impl fmt::Debug for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes", self.0)
    }
}

/// Where participants ask to be let in.
pub(crate) fn join_key(id: &str) -> String {
    format!("cpf/join/{id}")
}
/// From the participant to the hub.
pub(crate) fn up_key(id: &str, plane: Plane) -> String {
    format!("cpf/{id}/up/{plane}")
}
/// From the hub to the participant: its inbox.
pub(crate) fn down_key(id: &str, plane: Plane) -> String {
    format!("cpf/{id}/down/{plane}")
}
/// Exists while the participant lives.
pub(crate) fn participant_token(id: &str, nonce: u64) -> String {
    format!("cpf/{id}/alive/{nonce:016x}")
}
/// Exists while the hub lives.
pub(crate) fn hub_token(id: &str) -> String {
    format!("cpf/{id}/hub")
}

/// The payload of one mission-plane frame: one frame always fits in one batch of the transport.
pub(crate) const CHUNK: usize = 32 << 10;
const MAX_PARTS: usize = Plane::Mission.limit().div_ceil(CHUNK);

const WHOLE: u8 = 0x01;
const PART: u8 = 0x02;
const HELLO: u8 = 0x10;
const WELCOME: u8 = 0x11;
const ACK: u8 = 0x12;
const ACK_NOW: u8 = 0x13;
const STATES_TAKEN: u8 = 0x14;

/// One frame of the mission plane, little-endian after a byte that says which.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Frame<'a> {
    /// A message that fits in one frame.
    Whole(&'a [u8]),
    /// One piece of a larger message.
    Part { message: u32, index: u16, total: u16, piece: &'a [u8] },
    /// The participant's first word, repeated until it is answered.
    Hello { nonce: u64 },
    /// The hub's answer: both directions work.
    Welcome { nonce: u64 },
    /// How much of the mission plane has arrived since the line was opened, as [`cost`] counts it.
    Ack { taken: u64 },
    /// Please acknowledge at once.
    AckNow,
    /// How much of the state plane has arrived since the line was opened, as [`cost`] counts it.
    StatesTaken { taken: u64 },
}

impl<'a> Frame<'a> {
    pub(crate) fn decode(bytes: &'a [u8]) -> Option<Frame<'a>> {
        let (&kind, rest) = bytes.split_first()?;
        Some(match kind {
            WHOLE if rest.len() <= CHUNK => Frame::Whole(rest),
            PART => {
                let (message, rest) = rest.split_first_chunk()?;
                let (index, rest) = rest.split_first_chunk()?;
                let (total, piece) = rest.split_first_chunk()?;
                Frame::Part {
                    message: u32::from_le_bytes(*message),
                    index: u16::from_le_bytes(*index),
                    total: u16::from_le_bytes(*total),
                    piece,
                }
            }
            HELLO => Frame::Hello { nonce: number(rest)? },
            WELCOME => Frame::Welcome { nonce: number(rest)? },
            ACK => Frame::Ack { taken: number(rest)? },
            STATES_TAKEN => Frame::StatesTaken { taken: number(rest)? },
            ACK_NOW if rest.is_empty() => Frame::AckNow,
            _ => return None,
        })
    }

    pub(crate) fn encode(&self) -> Vec<u8> {
        let numbered = |kind: u8, number: u64| {
            let mut bytes = vec![kind];
            bytes.extend(number.to_le_bytes());
            bytes
        };
        match *self {
            Frame::Whole(message) => {
                let mut bytes = Vec::with_capacity(1 + message.len());
                bytes.push(WHOLE);
                bytes.extend_from_slice(message);
                bytes
            }
            Frame::Part { message, index, total, piece } => {
                let mut bytes = Vec::with_capacity(9 + piece.len());
                bytes.push(PART);
                bytes.extend(message.to_le_bytes());
                bytes.extend(index.to_le_bytes());
                bytes.extend(total.to_le_bytes());
                bytes.extend_from_slice(piece);
                bytes
            }
            Frame::Hello { nonce } => numbered(HELLO, nonce),
            Frame::Welcome { nonce } => numbered(WELCOME, nonce),
            Frame::Ack { taken } => numbered(ACK, taken),
            Frame::AckNow => vec![ACK_NOW],
            Frame::StatesTaken { taken } => numbered(STATES_TAKEN, taken),
        }
    }
}

fn number(bytes: &[u8]) -> Option<u64> {
    Some(u64::from_le_bytes(bytes.try_into().ok()?))
}

/// The frames of one message; `message` numbers the large ones.
pub(crate) fn frames(message: u32, bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let total = bytes.len().div_ceil(CHUNK).max(1);
    (0..total).map(move |index| {
        if total == 1 {
            return Frame::Whole(bytes).encode();
        }
        let piece = &bytes[index * CHUNK..bytes.len().min((index + 1) * CHUNK)];
        Frame::Part { message, index: index as u16, total: total as u16, piece }.encode()
    })
}

/// The most bytes of state-plane messages that travel together.
pub(crate) const BUNDLE: usize = 32 << 10;

/// Adds a state-plane message to a bundle: its length in two bytes, and itself.
pub(crate) fn bundle(bundle: &mut Vec<u8>, message: &[u8]) {
    // The plane's limit is below 64 KiB.
    bundle.extend((message.len() as u16).to_le_bytes());
    bundle.extend_from_slice(message);
}

/// The next message of a bundle and the rest; `None` if it is cut off or larger than the plane carries.
pub(crate) fn unbundle(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    let length = usize::from(u16::from_le_bytes(*length));
    (length <= Plane::State.limit()).then_some(())?;
    rest.split_at_checked(length)
}

/// What a frame of the mission plane costs in the transport's queue: itself and a generous header \[bytes\].
pub(crate) fn cost(frame: &[u8]) -> u64 {
    frame.len() as u64 + 64
}

/// What a bundle of the state plane is reckoned to cost there \[bytes\]: also a small one so much that few may be on their
/// way at once. Of messages in a steady exchange there never are; in a flood, those that wait for their turn travel together,
/// which costs the transport far less than each by itself.
pub(crate) fn state_cost(bundle: &[u8]) -> u64 {
    cost(bundle).max(LEAST_STATE_COST)
}

/// See [`state_cost`].
pub(crate) const LEAST_STATE_COST: u64 = 16 << 10;

/// Puts one message together out of its parts; what does not continue it is garbage.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    message: u32,
    total: u16,
    next: u16,
    bytes: Vec<u8>,
}

/// What a part led to.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Assembled {
    /// More parts are to come.
    Waiting,
    /// The message is complete.
    Done(Vec<u8>),
    /// The part, and what it interrupted, are thrown away.
    Garbage,
}

impl Assembly {
    pub(crate) fn add(&mut self, message: u32, index: u16, total: u16, piece: &[u8]) -> Assembled {
        if index == 0 && (2..=MAX_PARTS).contains(&usize::from(total)) {
            *self = Assembly { message, total, next: 0, bytes: Vec::with_capacity(usize::from(total) * CHUNK) };
        } else if index == 0 || (message, index, total) != (self.message, self.next, self.total) {
            self.abandon();
            return Assembled::Garbage;
        }
        let last = index + 1 == total;
        if (!last && piece.len() != CHUNK) || (last && (piece.is_empty() || piece.len() > CHUNK)) {
            self.abandon();
            return Assembled::Garbage;
        }
        self.bytes.extend_from_slice(piece);
        self.next = index + 1;
        if last { Assembled::Done(std::mem::take(self).bytes) } else { Assembled::Waiting }
    }

    /// Forgets a message that was begun; true if there was one.
    pub(crate) fn abandon(&mut self) -> bool {
        std::mem::take(self).next > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn reassemble(bytes: &[u8]) -> Option<Vec<u8>> {
        let mut assembly = Assembly::default();
        for frame in frames(7, bytes) {
            match Frame::decode(&frame)? {
                Frame::Whole(message) => return Some(message.to_vec()),
                Frame::Part { message, index, total, piece } => match assembly.add(message, index, total, piece) {
                    Assembled::Done(message) => return Some(message),
                    Assembled::Waiting => {}
                    Assembled::Garbage => return None,
                },
                _ => return None,
            }
        }
        None
    }

    #[test]
    fn messages_of_every_awkward_size_survive_the_frames() {
        for size in [0, 1, CHUNK - 1, CHUNK, CHUNK + 1, 2 * CHUNK, 2 * CHUNK + 1, Plane::Mission.limit()] {
            let bytes: Vec<u8> = (0..size).map(|i| (i * 31 % 251) as u8).collect();
            assert_eq!(reassemble(&bytes).as_deref(), Some(&bytes[..]), "{size} bytes");
        }
    }

    #[test]
    fn every_frame_fits_the_promised_size() {
        let largest = frames(0, &vec![0; Plane::Mission.limit()]).map(|frame| frame.len()).max();
        assert!(largest <= Some(CHUNK + 9), "{largest:?}");
    }

    #[test]
    fn a_lost_repeated_or_foreign_part_spoils_only_its_own_message() {
        let full = [1; CHUNK];
        let mut assembly = Assembly::default();
        assert_eq!(assembly.add(1, 0, 3, &full), Assembled::Waiting);
        assert_eq!(assembly.add(1, 2, 3, &full), Assembled::Garbage);
        assert_eq!(assembly.add(1, 1, 3, &full), Assembled::Garbage);
        assert_eq!(assembly.add(2, 0, 2, &full), Assembled::Waiting);
        assert_eq!(assembly.add(3, 1, 2, &[9]), Assembled::Garbage);
        assert_eq!(assembly.add(4, 0, 2, &full), Assembled::Waiting);
        assert_eq!(assembly.add(5, 0, 2, &full), Assembled::Waiting, "a new message replaces one that was cut off");
        assert_eq!(assembly.add(4, 1, 2, &[9]), Assembled::Garbage);
        assert_eq!(assembly.add(4, 0, 2, &full), Assembled::Waiting);
        assert!(matches!(assembly.add(4, 1, 2, &[9]), Assembled::Done(message) if message.len() == CHUNK + 1));
    }

    #[test]
    fn a_part_that_announces_too_much_reserves_nothing() {
        let mut assembly = Assembly::default();
        assert_eq!(assembly.add(1, 0, u16::MAX, &[1; CHUNK]), Assembled::Garbage);
        assert_eq!(assembly.bytes.capacity(), 0);
    }

    proptest! {
        #[test]
        fn bundles_hold_what_was_put_in_and_arbitrary_bytes_end_in_bounds(
            messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 0..20), noise: Vec<u8>
        ) {
            let mut bytes = Vec::new();
            messages.iter().for_each(|message| bundle(&mut bytes, message));
            let mut rest = &bytes[..];
            for message in &messages {
                let (next, after) = unbundle(rest).expect("whole");
                prop_assert_eq!(next, &message[..]);
                rest = after;
            }
            prop_assert!(rest.is_empty());
            let mut rest = &noise[..];
            while let Some((message, after)) = unbundle(rest) {
                prop_assert!(message.len() + after.len() + 2 == rest.len());
                rest = after;
            }
        }

        #[test]
        fn arbitrary_bytes_never_panic_and_never_assemble_more_than_the_limit(
            inputs in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..40), 0..40)
        ) {
            let mut assembly = Assembly::default();
            for bytes in inputs {
                if let Some(Frame::Part { message, index, total, piece }) = Frame::decode(&bytes) {
                    assembly.add(message, index, total, piece);
                }
                prop_assert!(assembly.bytes.capacity() <= Plane::Mission.limit());
            }
        }

        #[test]
        fn frames_decode_to_what_was_encoded(nonce: u64, message: u32, index: u16, total: u16, piece: Vec<u8>) {
            for frame in [
                Frame::Whole(&piece), Frame::Part { message, index, total, piece: &piece },
                Frame::Hello { nonce }, Frame::Welcome { nonce }, Frame::Ack { taken: nonce }, Frame::AckNow,
                Frame::StatesTaken { taken: nonce },
            ] {
                let bytes = frame.encode();
                prop_assert_eq!(Frame::decode(&bytes), Some(frame));
            }
        }
    }
}
