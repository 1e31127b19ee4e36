//! Mission control: checks, simulates, runs, watches, collects and reports flights.

pub mod conduct;
pub mod results;
pub mod simulate;
