//! The coordination state: the one message that vehicles exchange.
//!
//! ```text
//! magic 2 | version 2 | mission 8 | sender 2 | number 4 | made 8 | flags 1 | ξ 8 | [scalar 8] | [heard 4 each] | CRC-32 4
//! ```
//!
//! The checksum is of everything before it. In messages as short as these, CRC-32 finds every change of up to four bits
//! and every burst of up to 32; of other changes one in 2³² passes.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::{Decode, Encode};

use super::Garbage;
use crate::time::Time;

/// Largest coordination message \[bytes\].
pub const STATE_LIMIT: usize = 64;

/// Most acknowledgements in one message: what fits below [`STATE_LIMIT`].
pub const MOST_HEARD: usize = 4;

/// Largest size of ξ and of a second scalar in a message: a thousand times the largest that a mission may begin with.
pub const LARGEST_NUMBER: f64 = 1e12;

const MAGIC: [u8; 2] = *b"CX";
const CHECKSUM: usize = 4;
/// Shortest message: without scalar and without acknowledgements.
const LEAST: usize = 39;

/// Bits of the flags; the upper four are the number of acknowledgements.
const HAS_SCALAR: u8 = 1;
const ASKS: u8 = 2;
const COUNT_SHIFT: u32 = 4;
const UNUSED: u8 = 0b1100;

/// What one vehicle tells the others, and nothing else: no position, no velocity, no telemetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoordinationState {
    /// First eight bytes of the mission's digest: states of different missions are never mixed.
    pub mission: u64,
    /// Index of the sender in the mission.
    pub sender: u16,
    /// Number of the message period in which it was made: grows within a mission, also across a restart.
    pub seq: u32,
    /// When it was made.
    pub made: Time,
    /// Coordination state with the pattern removed, ξ − h.
    #[doc(alias = "γ")]
    pub xi: f64,
    /// The one more scalar that the mission's law asks for, if it does; normalised speed-tracking error η/R, say.
    #[doc(alias = "η")]
    pub scalar: Option<f64>,
}

/// What the sender has heard of one vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Acknowledgement {
    /// Index of the vehicle whose messages these are.
    pub vehicle: u16,
    /// Number of its newest message; `None` if nothing was heard of it, or nothing for 65,535 message periods.
    pub seq: Option<u32>,
}

/// Everything in one message: the state, and what event-triggered vehicles add to it ([`crate::talk`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The coordination state.
    pub state: CoordinationState,
    /// Whether the sender asks for an answer, because it does not know whether it is heard.
    pub asks: bool,
    heard: [Acknowledgement; MOST_HEARD],
    count: usize,
}

/// The part that is always there, as it goes on the air.
#[derive(Encode, Decode)]
struct Head {
    mission: u64,
    sender: u16,
    seq: u32,
    made: Time,
    flags: u8,
    xi: f64,
}

type StateCodec = Configuration<LittleEndian, Fixint, Limit<STATE_LIMIT>>;

fn codec() -> StateCodec {
    bincode::config::standard().with_fixed_int_encoding().with_limit::<STATE_LIMIT>()
}

fn put(bytes: &mut Vec<u8>, value: impl Encode) {
    bincode::encode_into_std_write(value, bytes, codec()).expect("encoding into memory");
}

fn take<T: Decode<()>>(bytes: &mut &[u8]) -> Result<T, Garbage> {
    let (value, used) = bincode::decode_from_slice(bytes, codec()).map_err(|_| Garbage::Malformed)?;
    *bytes = bytes.get(used..).ok_or(Garbage::Malformed)?;
    Ok(value)
}

/// Puts the checksum of some bytes behind them.
pub fn seal(bytes: &mut Vec<u8>) {
    let checksum = crc32fast::hash(bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes());
}

impl CoordinationState {
    /// The bytes that go on the air when there is nothing to add.
    pub fn encode(&self) -> Vec<u8> {
        Word::from(*self).encode()
    }

    /// Reads bytes from the air; checks everything that can be checked without knowing the mission.
    ///
    /// # Errors
    /// Says which kind of garbage the bytes are.
    pub fn decode(bytes: &[u8]) -> Result<CoordinationState, Garbage> {
        Word::decode(bytes).map(|word| word.state)
    }
}

impl From<CoordinationState> for Word {
    fn from(state: CoordinationState) -> Word {
        Word { state, asks: false, heard: [Acknowledgement::default(); MOST_HEARD], count: 0 }
    }
}

impl Word {
    /// What the sender has heard of others.
    pub fn heard(&self) -> &[Acknowledgement] {
        &self.heard[..self.count]
    }

    /// Adds an acknowledgement while there is room; true if there was.
    pub fn acknowledge(&mut self, heard: Acknowledgement) -> bool {
        let room = self.count < MOST_HEARD;
        if room {
            self.heard[self.count] = heard;
            self.count += 1;
        }
        room
    }

    /// The bytes that go on the air.
    pub fn encode(&self) -> Vec<u8> {
        let state = &self.state;
        let flags = (u8::from(state.scalar.is_some()) * HAS_SCALAR)
            | (u8::from(self.asks) * ASKS)
            | ((self.count as u8) << COUNT_SHIFT);
        let mut bytes = Vec::with_capacity(STATE_LIMIT);
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&super::PROTOCOL.to_le_bytes());
        let (mission, sender, seq) = (state.mission, state.sender, state.seq);
        put(&mut bytes, Head { mission, sender, seq, made: state.made, flags, xi: state.xi });
        if let Some(scalar) = state.scalar {
            put(&mut bytes, scalar);
        }
        for heard in self.heard() {
            // How many message periods ago, which is shorter than the number itself; the last value says "not heard".
            let back = heard.seq.and_then(|seq| u16::try_from(state.seq.wrapping_sub(seq)).ok()).unwrap_or(u16::MAX);
            put(&mut bytes, (heard.vehicle, back));
        }
        seal(&mut bytes);
        bytes
    }

    /// Reads bytes from the air; checks everything that can be checked without knowing the mission.
    ///
    /// # Errors
    /// Says which kind of garbage the bytes are.
    pub fn decode(bytes: &[u8]) -> Result<Word, Garbage> {
        if bytes.len() > STATE_LIMIT {
            return Err(Garbage::Oversized);
        }
        if let Err(kind) = super::body(bytes, MAGIC) {
            // One flipped bit does not make a stranger of it.
            return Err(if is_nearly_ours(bytes) { Garbage::Corrupt } else { kind });
        }
        if bytes.len() < LEAST {
            return Err(Garbage::Malformed);
        }
        let (whole, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        if crc32fast::hash(whole).to_le_bytes() != checksum {
            return Err(Garbage::Corrupt);
        }
        let mut rest = super::body(whole, MAGIC)?;
        let Head { mission, sender, seq, made, flags, xi } = take(&mut rest)?;
        let count = usize::from(flags >> COUNT_SHIFT);
        if count > MOST_HEARD || flags & UNUSED != 0 {
            return Err(Garbage::Malformed);
        }
        let scalar: Option<f64> = if flags & HAS_SCALAR != 0 { Some(take(&mut rest)?) } else { None };
        let mut word = Word::from(CoordinationState { mission, sender, seq, made, xi, scalar });
        word.asks = flags & ASKS != 0;
        for _ in 0..count {
            let (vehicle, back): (u16, u16) = take(&mut rest)?;
            let heard = if back == u16::MAX { None } else { Some(seq.wrapping_sub(u32::from(back))) };
            word.acknowledge(Acknowledgement { vehicle, seq: heard });
        }
        if !rest.is_empty() {
            return Err(Garbage::Malformed);
        }
        let makes_sense = |number: f64| number.abs() <= LARGEST_NUMBER;
        if !makes_sense(xi) || !scalar.is_none_or(makes_sense) {
            return Err(Garbage::NotFinite);
        }
        Ok(word)
    }
}

/// Whether magic and version are this protocol's but for one bit, in a message of a length that there is.
fn is_nearly_ours(bytes: &[u8]) -> bool {
    let [low, high] = super::PROTOCOL.to_le_bytes();
    let ours = u32::from_le_bytes([MAGIC[0], MAGIC[1], low, high]);
    let begins = bytes.first_chunk().map(|four| u32::from_le_bytes(*four));
    bytes.len() >= LEAST && begins.is_some_and(|found| (found ^ ours).is_power_of_two())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_state() -> impl Strategy<Value = CoordinationState> {
        (any::<u64>(), any::<u16>(), any::<u32>(), any::<i64>(), -1e9..1e9, proptest::option::of(-1e3..1e3)).prop_map(
            |(mission, sender, seq, made, xi, scalar)| CoordinationState {
                mission,
                sender,
                seq,
                made: Time::from_nanos(made),
                xi,
                scalar,
            },
        )
    }

    fn any_word() -> impl Strategy<Value = Word> {
        let heard = (any::<u16>(), proptest::option::of(0u32..65_535));
        (any_state(), any::<bool>(), proptest::collection::vec(heard, 0..=MOST_HEARD)).prop_map(
            |(state, asks, heard)| {
                let mut word = Word { asks, ..Word::from(state) };
                for (vehicle, back) in heard {
                    word.acknowledge(Acknowledgement { vehicle, seq: back.map(|back| state.seq.wrapping_sub(back)) });
                }
                word
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_sent_is_what_is_read(word in any_word()) {
            let bytes = word.encode();
            prop_assert!(bytes.len() <= STATE_LIMIT);
            prop_assert_eq!(Word::decode(&bytes), Ok(word));
            prop_assert_eq!(CoordinationState::decode(&bytes), Ok(word.state));
            prop_assert_eq!(CoordinationState::decode(&word.state.encode()), Ok(word.state));
        }

        #[test]
        fn no_bit_flips_unnoticed(word in any_word()) {
            let bytes = word.encode();
            for bit in 0..bytes.len() * 8 {
                let mut changed = bytes.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                prop_assert_eq!(Word::decode(&changed), Err(Garbage::Corrupt), "bit {}", bit);
            }
        }

        #[test]
        fn no_four_bits_flip_unnoticed(word in any_word(), bits in proptest::collection::btree_set(0usize..312, 2..=4)) {
            let mut bytes = word.encode();
            bits.iter().for_each(|bit| bytes[bit / 8] ^= 1 << (bit % 8));
            prop_assert!(Word::decode(&bytes).is_err());
        }

        #[test]
        fn no_truncation_is_accepted(word in any_word(), cut in 1usize..38) {
            let bytes = word.encode();
            prop_assert!(Word::decode(&bytes[..bytes.len() - cut]).is_err());
        }

        #[test]
        fn nothing_after_the_message_is_accepted(state in any_state(), extra in 1usize..30) {
            let mut bytes = state.encode();
            bytes.extend(std::iter::repeat_n(0, extra));
            prop_assert!(CoordinationState::decode(&bytes).is_err());
        }

        #[test]
        fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = CoordinationState::decode(&bytes);
            let mut framed = b"CX\x01\x00".to_vec();
            framed.extend(&bytes);
            seal(&mut framed);
            let _ = Word::decode(&framed);
            let _: Result<super::super::vehicle::ToVehicle, _> = super::super::decode(&bytes);
            let mut framed = super::super::encode(&());
            framed.extend(&bytes);
            let _: Result<super::super::vehicle::ToVehicle, _> = super::super::decode(&framed);
            let _: Result<super::super::fleet::FromFleet, _> = super::super::decode(&framed);
        }
    }

    fn state() -> CoordinationState {
        CoordinationState { mission: 1, sender: 2, seq: 3, made: Time::ZERO, xi: 0.5, scalar: None }
    }

    #[test]
    fn a_state_is_small() {
        assert_eq!(state().encode().len(), LEAST);
        assert_eq!(CoordinationState { scalar: Some(0.0), ..state() }.encode().len(), 47);
        let mut word = Word::from(CoordinationState { scalar: Some(0.0), ..state() });
        for vehicle in 0..MOST_HEARD as u16 {
            assert!(word.acknowledge(Acknowledgement { vehicle, seq: None }));
        }
        assert!(!word.acknowledge(Acknowledgement::default()), "full");
        assert_eq!(word.encode().len(), 63);
    }

    #[test]
    fn a_number_that_is_not_finite_or_beyond_all_sense_stays_off_the_air() {
        for number in [f64::NAN, f64::INFINITY, -1.7e308, 1.001e12] {
            for state in
                [CoordinationState { xi: number, ..state() }, CoordinationState { scalar: Some(number), ..state() }]
            {
                assert_eq!(CoordinationState::decode(&state.encode()), Err(Garbage::NotFinite));
            }
        }
        let largest = CoordinationState { xi: -LARGEST_NUMBER, scalar: Some(LARGEST_NUMBER), ..state() };
        assert_eq!(CoordinationState::decode(&largest.encode()), Ok(largest));
    }

    #[test]
    fn what_was_heard_too_long_ago_was_not_heard() {
        let mut word = Word::from(CoordinationState { seq: 70_000, ..state() });
        word.acknowledge(Acknowledgement { vehicle: 1, seq: Some(4_465) });
        word.acknowledge(Acknowledgement { vehicle: 1, seq: Some(4_466) });
        let heard = Word::decode(&word.encode()).expect("sound");
        assert_eq!(heard.heard().iter().map(|heard| heard.seq).collect::<Vec<_>>(), [None, Some(4_466)]);
    }
}
