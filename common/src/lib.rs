//! Pure mathematics and shared vocabulary of coordinated path-following.
//!
//! Nothing in this crate reads a clock, opens a socket or starts a thread. Start with [`machine`] for the seam,
//! [`coordination`] and [`following`] for the laws, [`graph`] for the network's theory and [`mission`] for the
//! mission file. `docs/notation.md` maps the thesis' symbols to names.

pub mod coordination;
pub mod craft;
pub mod following;
pub mod graph;
pub mod machine;
pub mod mission;
pub mod network;
pub mod path;
mod positive;
pub mod random;
pub mod record;
pub mod riccati;
pub mod talk;
pub mod theory;
pub mod time;
pub mod vehicle;
pub mod wire;
