//! Placeholder.

pub mod recording;
