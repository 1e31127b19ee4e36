//! Plants: equations of motion, one per file.

pub mod attitude;
pub mod auv;
pub mod sirene;
