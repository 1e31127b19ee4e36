//! The conditions and rates of the theorems as functions.
