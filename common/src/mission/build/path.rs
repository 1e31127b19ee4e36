//! Paths.

use std::sync::Arc;

use nalgebra::Vector3;

use super::super::file::{Direction, OriginSection, PathChoice, SegmentChoice};
use crate::path::Path;
use crate::path::chain::{Chain, Segment};
use crate::path::circle::{Circle, Turn};
use crate::path::geodesy::Place;
use crate::path::geojson;
use crate::path::helix::Helix;
use crate::path::line::Line;
use crate::path::sinusoid::Sinusoid;
use crate::path::spline::Spline;

/// The path of a choice.
pub(in crate::mission) fn path(choice: &PathChoice) -> Result<Arc<dyn Path>, String> {
    let plane = |xy: [f64; 2]| Vector3::new(xy[0], xy[1], 0.0);
    Ok(match choice {
        PathChoice::Line(l) => Arc::new(Line::new(plane(l.start_m), l.heading_deg.to_radians(), l.rate_m)?),
        PathChoice::Circle(c) => {
            let turn = match c.direction {
                Direction::Ccw => Turn::Left,
                Direction::Cw => Turn::Right,
            };
            Arc::new(Circle::new(plane(c.centre_m), c.radius_m, turn, c.start_deg.to_radians(), c.rate_rad)?)
        }
        PathChoice::Sinusoid(s) => {
            Arc::new(Sinusoid::new(s.amplitude_m, s.offset_m, s.wavelength_m, s.phase_deg.to_radians(), 0.0)?)
        }
        PathChoice::Chain(c) => {
            let segments = c.segments.iter().map(segment).collect::<Result<Vec<_>, String>>()?;
            Arc::new(Chain::new(plane(c.start_m), c.heading_deg.to_radians(), &segments)?)
        }
        PathChoice::Spline(s) => {
            let points = s.waypoints_m.iter().map(|point| waypoint(point)).collect::<Result<Vec<_>, String>>()?;
            Arc::new(spline(points, s.rate_m, s.xi.as_deref())?)
        }
        PathChoice::Geojson(g) => {
            let OriginSection { longitude_deg, latitude_deg, height_m } = g.origin;
            let origin = Place { longitude: longitude_deg, latitude: latitude_deg, height: height_m }.checked()?;
            let line = geojson::line(&g.text, g.line.as_deref())?;
            // Positions without a height are at that of the origin.
            let at = |place: &Place| Place { height: if line.has_heights { place.height } else { height_m }, ..*place };
            let points = line.places.iter().map(|place| origin.local(at(place))).collect();
            Arc::new(spline(points, g.rate_m, g.xi.as_deref())?)
        }
        PathChoice::Helix(h) => Arc::new(Helix::new(h.radius_m, h.lap, h.phase_deg.to_radians(), h.climb_m, h.z0_m)?),
    })
}

fn waypoint(point: &[f64]) -> Result<Vector3<f64>, String> {
    match *point {
        [x, y] => Ok(Vector3::new(x, y, 0.0)),
        [x, y, z] => Ok(Vector3::new(x, y, z)),
        _ => Err(format!("a waypoint has two or three coordinates, not {}", point.len())),
    }
}

fn spline(points: Vec<Vector3<f64>>, rate: Option<f64>, xi: Option<&[f64]>) -> Result<Spline, String> {
    match (rate, xi) {
        (Some(_), Some(_)) => Err("both rate_m and xi: one of them says how fast xi runs".to_string()),
        (_, Some(values)) => Spline::at_values(points, values.to_vec()),
        (rate, None) => Spline::by_length(points, rate.unwrap_or(1.0)),
    }
}

fn segment(choice: &SegmentChoice) -> Result<Segment, String> {
    let rate = |rate: f64| if rate > 0.0 { Ok(rate) } else { Err(format!("rate_m must be above 0, it is {rate}")) };
    Ok(match choice {
        SegmentChoice::Line(l) => Segment::Line { length: l.length_m, xi_length: l.length_m / rate(l.rate_m)? },
        SegmentChoice::Arc(a) => {
            let sweep = a.sweep_deg.to_radians();
            let rate = rate(a.rate_m.unwrap_or(a.radius_m))?;
            Segment::Arc { radius: a.radius_m, sweep, xi_length: a.radius_m * sweep.abs() / rate }
        }
        SegmentChoice::Corner(c) => Segment::Corner { angle: c.turn_deg.to_radians() },
    })
}
