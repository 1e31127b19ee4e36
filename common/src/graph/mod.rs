//! Graphs, switching signals and what can be said of them.
pub mod switching;
mod digraph;
pub use digraph::Graph;
