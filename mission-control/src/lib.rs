//! Placeholder.

pub mod results;
