//! Mission control: checks, simulates, runs, watches, collects and reports flights.
//!
//! [`conduct`] is a flight as a pure machine; [`simulate`] connects the machines of a whole fleet in one thread; [`run`]
//! conducts a fleet of processes; [`results`] is everything that happens to what was recorded; [`gallery`] shows many flights on
//! one page, [`sweep`] varies one.

pub mod batch;
mod brought;
pub mod cli;
pub mod conduct;
pub mod console;
pub mod facts;
pub mod folder;
pub mod gallery;
mod missing;
pub mod operator;
mod processes;
pub mod rehearse;
pub mod results;
pub mod run;
pub mod simulate;
pub mod sweep;
pub mod theory;
pub mod waypoints;
pub mod worst;
