//! The coordination state: the one message that vehicles exchange.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::{Decode, Encode};

use super::Garbage;
use crate::time::Time;

/// Largest coordination message \[bytes\].
pub const STATE_LIMIT: usize = 64;

const MAGIC: [u8; 2] = *b"CX";

/// What one vehicle tells the others, and nothing else: no position, no velocity, no telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Encode, Decode)]
pub struct CoordinationState {
    /// First eight bytes of the mission's digest: states of different missions are never mixed.
    pub mission: u64,
    /// Index of the sender in the mission.
    pub sender: u16,
    /// Number of the control period in which it was made: grows within a mission, also across a restart.
    pub seq: u32,
    /// When it was made.
    pub made: Time,
    /// Coordination state with the pattern removed, ξ − h.
    #[doc(alias = "γ")]
    pub xi: f64,
    /// Normalised speed-tracking error η/R, sent only when the mission's law asks for it.
    #[doc(alias = "η")]
    pub scalar: Option<f64>,
}

type StateCodec = Configuration<LittleEndian, Fixint, Limit<STATE_LIMIT>>;

fn codec() -> StateCodec {
    bincode::config::standard().with_fixed_int_encoding().with_limit::<STATE_LIMIT>()
}

impl CoordinationState {
    /// The bytes that go on the air.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(STATE_LIMIT);
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&super::PROTOCOL.to_le_bytes());
        bincode::encode_into_std_write(self, &mut bytes, codec()).expect("encoding into memory");
        bytes
    }

    /// Reads bytes from the air; checks everything that can be checked without knowing the mission.
    ///
    /// # Errors
    /// Says which kind of garbage the bytes are.
    pub fn decode(bytes: &[u8]) -> Result<CoordinationState, Garbage> {
        if bytes.len() > STATE_LIMIT {
            return Err(Garbage::Oversized);
        }
        let body = super::body(bytes, MAGIC)?;
        let (state, used): (CoordinationState, usize) =
            bincode::decode_from_slice(body, codec()).map_err(|_| Garbage::Malformed)?;
        if used != body.len() {
            return Err(Garbage::Malformed);
        }
        if !state.xi.is_finite() || state.scalar.is_some_and(|eta| !eta.is_finite()) {
            return Err(Garbage::NotFinite);
        }
        Ok(state)
    }
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

    proptest! {
        #[test]
        fn what_is_sent_is_what_is_read(state in any_state()) {
            prop_assert_eq!(CoordinationState::decode(&state.encode()), Ok(state));
        }

        #[test]
        fn no_truncation_is_accepted(state in any_state(), cut in 1usize..30) {
            let bytes = state.encode();
            prop_assert!(CoordinationState::decode(&bytes[..bytes.len() - cut]).is_err());
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
            let _: Result<super::super::vehicle::ToVehicle, _> = super::super::decode(&bytes);
            let mut framed = super::super::encode(&());
            framed.extend(&bytes);
            let _: Result<super::super::vehicle::ToVehicle, _> = super::super::decode(&framed);
            let _: Result<super::super::fleet::FromFleet, _> = super::super::decode(&framed);
        }
    }

    #[test]
    fn a_state_is_small() {
        let state = CoordinationState { mission: 1, sender: 2, seq: 3, made: Time::ZERO, xi: 0.5, scalar: None };
        assert_eq!(state.encode().len(), 35);
        assert_eq!(CoordinationState { scalar: Some(0.0), ..state }.encode().len(), 43);
    }

    #[test]
    fn a_number_that_is_not_finite_stays_off_the_air() {
        let state = CoordinationState { mission: 1, sender: 2, seq: 3, made: Time::ZERO, xi: f64::NAN, scalar: None };
        assert_eq!(CoordinationState::decode(&state.encode()), Err(Garbage::NotFinite));
    }
}
