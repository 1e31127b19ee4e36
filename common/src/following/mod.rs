//! Path-following laws, one per file.

pub mod theorem_4_7;
