//! From the choices of the mission file to the laws, paths and vehicles they name: the one place where names and types
//! meet.

mod craft;
mod law;
mod path;

pub(super) use craft::{auv, auv_gains, auv_state, craft, largest_stretch, stretched_most};
pub(super) use law::{diagonal, gains_by_vehicle, law, law_name, nominal_factor, told};
pub(super) use path::path;
