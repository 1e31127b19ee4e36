//! What happens to a message between two vehicles: pure models, each with its own statistics.
//!
//! Every model is a function of numbers that belong to a *message number* (its time divided by the message period), of
//! positions, or of time. None draws in order of arrival, so two runs can be compared message by message.
//!
//! | model | what it is | source | file |
//! |---|---|---|---|
//! | [`Delay`] | constant, uniform, normal, gamma, from distance | any text; Mukherjee 1994 for the shifted gamma | [`mod@delay`] |
//! | [`Quantiles`] | one uniform number in, one of any density out | inversion | [`quantiles`] |
//! | [`Loss`] | Bernoulli, bursts, fades shared by links, a trace | Gilbert 1960, Elliott 1963 | [`mod@loss`] |
//! | [`SharedFades`] | fades of several links, as correlated as told | common shocks, Marshall and Olkin 1967 | [`shared_fades`] |
//! | [`TwoStates`] | bursts and gaps by message number | two-state Markov chain, its regeneration | [`two_states`] |
//! | [`Range`] | heard within a distance, or with a probability over it | hard disc; measured success curves | [`mod@range`] |
//! | [`Medium`] | airtime, queue, slots, duty cycle, collisions, half duplex | ALOHA, TDMA; ETSI EN 300 220 for the duty cycle | [`medium`] |
//! | [`Whereabouts`] | where vehicles said they were | ξ on the air and the paths | [`whereabouts`] |
//!
//! Which links come and go when is the switching signal's, [`crate::graph::switching`]. The channel that puts all of this
//! to work is the network emulator's.

pub mod delay;
pub mod loss;
pub mod medium;
pub mod quantiles;
pub mod range;
pub mod shared_fades;
pub mod two_states;
pub mod whereabouts;

pub use delay::Delay;
pub use loss::Loss;
pub use medium::Medium;
pub use quantiles::Quantiles;
pub use range::Range;
pub use shared_fades::SharedFades;
pub use two_states::TwoStates;
pub use whereabouts::Whereabouts;
