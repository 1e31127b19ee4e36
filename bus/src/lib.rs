//! The bus: the only part of the project that names Zenoh or reads a wall clock.
//!
//! The network is a star. Its hub, the [`switchboard`], lives in the network-emulator; every participant (a vehicle, or
//! mission-control) holds one [`line`](mod@line) to it. A participant asks for its line in the hub's *lobby* and is given a port
//! of its own, behind which is a Zenoh session of its own. Sessions are not linked, so nothing crosses from one line to
//! another except what the hub's program sends on.
//!
//! ```text
//!  participant                               hub process
//!  Line::connect  -- who I am -->  lobby  (tcp/host:7447)
//!                 <-- port p ----
//!                 == session ===>  line   (tcp/host:p)   up/state  up/mission
//!                                                        down/state  down/mission
//! ```

pub mod clock;
pub mod console;
pub mod drive;
pub mod line;
pub mod logs;
pub mod plane;
pub mod queue;
pub mod recording;
pub mod setup;
pub mod switchboard;

mod counts;
mod error;
mod inbox;
mod lead;
mod lobby;
mod outbox;

pub use counts::Counts;
pub use error::{Error, Result};
pub use lobby::{PROTOCOL_VERSION, Refusal, check_id};
pub use plane::Plane;
