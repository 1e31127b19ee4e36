//! Graphs, switching signals and what can be said of them.
