//! Path-following laws, one per file.
