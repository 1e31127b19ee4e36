//! The star over real sockets and, where something must die, real processes.
//!
//! Nothing here sleeps to be in step: every wait is for an event, with a deadline that only a failure reaches.

mod exchange;
mod isolation;
mod lives;
mod support;
