//! Graphs, switching signals and what can be said of them.

mod digraph;
pub mod measure;
pub mod switching;

pub use digraph::Graph;
