//! Paths: one abstraction for every chapter.
//!
//! A path is `p(ξ)`. The parameter `ξ` *is* the coordination state (γ in chapter 4); formations are
//! parametrisations, so that vehicles are coordinated exactly when their parameters agree.

use nalgebra::Vector3;

/// A point of a path with its derivatives with respect to the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Position p(ξ) \[m\].
    pub p: Vector3<f64>,
    /// First derivative p'(ξ) \[m per unit of ξ\].
    pub d1: Vector3<f64>,
    /// Second derivative p''(ξ).
    pub d2: Vector3<f64>,
    /// Third derivative p'''(ξ).
    pub d3: Vector3<f64>,
}

/// A smooth curve in space with its parametrisation.
pub trait Path: Send + Sync + std::fmt::Debug {
    /// The point at parameter `xi`, any finite number: open paths continue beyond their ends.
    fn at(&self, xi: f64) -> PathPoint;

    /// The range of `xi` in which to look for the point closest to a vehicle at the start; one lap of a closed path.
    fn search_range(&self) -> (f64, f64);
}
