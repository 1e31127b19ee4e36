//! One vehicle: its plant, its path-following law, its coordination law, and the life of its process.
//!
//! [`flight`] is one flight, [`node`] the process around it; both are pure machines.

pub mod flight;
pub mod neighbours;
pub mod node;
pub mod program;
