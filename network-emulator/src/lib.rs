//! The network between the vehicles: the only way from one to another.
//!
//! [`emulator`] decides for every message and every directed link; [`hub`] is the program around it as a pure machine.

pub mod emulator;
pub mod hub;
pub mod ledger;
mod lockstep;
pub mod program;
