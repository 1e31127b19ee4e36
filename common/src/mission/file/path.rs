//! Paths.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A path.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PathChoice {
    /// A straight line.
    Line(LinePath),
    /// A circle; xi is the angle from its start.
    Circle(CirclePath),
    /// y = offset + amplitude sin(2π x / wavelength + phase); xi is x.
    Sinusoid(SinusoidPath),
    /// Lines and arcs, tangent to one another.
    Chain(ChainPath),
    /// A helix about a vertical axis, section 4.6.
    Helix(HelixPath),
    /// A smooth curve through waypoints.
    Spline(SplinePath),
    /// A smooth curve through the waypoints of a GeoJSON LineString.
    Geojson(GeojsonPath),
}

/// A smooth curve through waypoints, straight on before the first and after the last.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SplinePath {
    /// The waypoints, [east, north] or [east, north, up] (m).
    pub waypoints_m: Vec<Vec<f64>>,
    /// Metres per unit of xi, nearly; 1 if absent. Not with `xi`.
    pub rate_m: Option<f64>,
    /// xi at each waypoint, increasing: vehicles with the same values are abreast at their waypoints.
    pub xi: Option<Vec<f64>>,
}

/// A smooth curve through the waypoints of a GeoJSON LineString.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GeojsonPath {
    /// The GeoJSON text: a LineString, or features that contain it; positions are longitude, latitude and, if given, height
    /// over the ellipsoid, negative for a depth.
    pub text: String,
    /// Property `name` of the LineString, if there are several.
    pub line: Option<String>,
    /// Where x, y and z are zero.
    pub origin: OriginSection,
    /// Metres per unit of xi, nearly; 1 if absent. Not with `xi`.
    pub rate_m: Option<f64>,
    /// xi at each waypoint, increasing: vehicles with the same values are abreast at their waypoints.
    pub xi: Option<Vec<f64>>,
}

/// A place on the globe, WGS 84.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OriginSection {
    /// Longitude, positive to the east (deg).
    pub longitude_deg: f64,
    /// Latitude, positive to the north (deg).
    pub latitude_deg: f64,
    /// Height over the ellipsoid (m).
    #[serde(default)]
    pub height_m: f64,
}

/// A straight line.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LinePath {
    /// Where xi = 0 (m).
    pub start_m: [f64; 2],
    /// Direction, counter-clockwise from x (deg).
    #[serde(default)]
    pub heading_deg: f64,
    /// Metres per unit of xi.
    #[serde(default = "one")]
    pub rate_m: f64,
}

/// A circle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CirclePath {
    /// Centre (m).
    pub centre_m: [f64; 2],
    /// Radius (m).
    pub radius_m: f64,
    /// Polar angle at which xi = 0 (deg).
    #[serde(default)]
    pub start_deg: f64,
    /// Which way round.
    #[serde(default)]
    pub direction: Direction,
    /// Radians per unit of xi.
    #[serde(default = "one")]
    pub rate_rad: f64,
}

/// Which way round a circle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Counter-clockwise.
    #[default]
    Ccw,
    /// Clockwise.
    Cw,
}

/// A sinusoid along x.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SinusoidPath {
    /// Amplitude (m).
    pub amplitude_m: f64,
    /// Wavelength (m).
    pub wavelength_m: f64,
    /// Mean of y (m).
    #[serde(default)]
    pub offset_m: f64,
    /// Phase at x = 0 (deg).
    #[serde(default)]
    pub phase_deg: f64,
}

/// Lines and arcs, tangent to one another; the first and the last go on beyond their ends.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ChainPath {
    /// Where xi = 0 (m).
    pub start_m: [f64; 2],
    /// Direction there, counter-clockwise from x (deg).
    #[serde(default)]
    pub heading_deg: f64,
    /// The pieces, in order.
    pub segments: Vec<SegmentChoice>,
}

/// A piece of a chain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SegmentChoice {
    /// A straight piece.
    Line(LineSegment),
    /// A piece of a circle.
    Arc(ArcSegment),
    /// A turn on the spot, which not every law can follow.
    Corner(CornerSegment),
}

/// A turn on the spot.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CornerSegment {
    /// Angle turned through, positive to the left (deg).
    pub turn_deg: f64,
}

/// A straight piece.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LineSegment {
    /// Length (m).
    pub length_m: f64,
    /// Metres per unit of xi.
    #[serde(default = "one")]
    pub rate_m: f64,
}

/// A piece of a circle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ArcSegment {
    /// Radius (m).
    pub radius_m: f64,
    /// Angle turned through, positive to the left (deg).
    pub sweep_deg: f64,
    /// Metres per unit of xi; the radius if absent, so that xi is the angle.
    pub rate_m: Option<f64>,
}

/// A helix about a vertical axis.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct HelixPath {
    /// Radius c_1 (m).
    pub radius_m: f64,
    /// One lap in units of xi, T.
    pub lap: f64,
    /// Climb c_2 per unit of xi (m).
    pub climb_m: f64,
    /// Polar angle φ_d at xi = 0 (deg).
    #[serde(default)]
    pub phase_deg: f64,
    /// Height z_0 at xi = 0 (m).
    #[serde(default)]
    pub z0_m: f64,
}

fn one() -> f64 {
    1.0
}
