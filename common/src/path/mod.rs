//! Paths: one abstraction for every chapter.
//!
//! A path is `p(ξ)`. The parameter `ξ` *is* the coordination state (γ in chapter 4); formations are
//! parametrisations, so that vehicles are coordinated exactly when their parameters agree.
//!
//! | path | source | equation | file |
//! |---|---|---|---|
//! | straight line | section 1.2 | p = p₀ + ρ ξ (cos ψ, sin ψ, 0) | [`mod@line`] |
//! | circle | Figure 1.5, Figure 3.10 | p = c + R (cos(θ₀ ± ρ ξ), sin(θ₀ ± ρ ξ), 0) | [`circle`] |
//! | sinusoid | Figure 3.9 | y = y₀ + a sin(2π x/λ + φ), x = ξ | [`sinusoid`] |
//! | helix | section 4.6 | p = (c₁ cos(2π ξ/T + φ), c₁ sin(2π ξ/T + φ), c₂ ξ + z₀) | [`helix`] |
//! | smooth curve through waypoints | – | natural cubic spline, C², ξ near the arc length or given at the waypoints | [`spline`] |
//! | lines and arcs joined | Figures 3.7 and 3.8, Remark 3.8 | R_i constant on each segment | [`chain`] |
//!
//! Waypoints on the globe come from [`geojson`] by [`geodesy`].
//!
//! What follows from p', p'' and p''' (R, heading, curvature) is in [`geometry`], the point closest to a vehicle in
//! [`closest`], the same followed under way in [`foot`], and what a law may ask of a path as a whole in [`shape`].

pub mod chain;
pub mod circle;
pub mod closest;
pub mod foot;
pub mod geodesy;
pub mod geojson;
pub mod geometry;
pub mod helix;
pub mod line;
pub mod shape;
pub mod sinusoid;
pub mod spline;

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

    /// The parameters at which the direction of the tangent jumps. A law that turns a vehicle with bounded effort
    /// cannot follow such a path without error.
    fn tangent_breaks(&self) -> &[f64] {
        &[]
    }

    /// The parameters at which R = ds/dξ or the curvature may jump; between them both are continuous.
    fn joints(&self) -> &[f64] {
        &[]
    }
}

#[cfg(test)]
mod check;
