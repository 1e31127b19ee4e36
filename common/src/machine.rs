//! The seam: everything that decides is a pure state machine.
//!
//! Time is an argument, effects are values, randomness is a named stream. A machine holds no clock, no socket
//! and no thread; a driver feeds it and carries out what it asks for. `simulate` and the real processes drive
//! the same machines, which is why a stepped run of processes equals a simulation bit for bit.

use crate::time::Time;

/// A pure state machine. Call [`handle`](Machine::handle), drain [`poll_output`](Machine::poll_output) until it
/// is empty, then ask [`poll_timeout`](Machine::poll_timeout) when to call next if nothing arrives before.
pub trait Machine {
    /// What can happen to the machine.
    type Input;
    /// What the machine wants done.
    type Output;

    /// Something happened at mission time `now`; `None` means that the time of `poll_timeout` has come.
    fn handle(&mut self, now: Time, input: Option<Self::Input>);
    /// The next effect to carry out, in order.
    fn poll_output(&mut self) -> Option<Self::Output>;
    /// When the machine wants to be called even if nothing happens.
    fn poll_timeout(&self) -> Option<Time>;
}
