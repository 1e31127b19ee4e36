//! Paths.

use std::sync::Arc;

use nalgebra::Vector3;

use super::super::file::{Direction, PathChoice, SegmentChoice};
use crate::path::Path;
use crate::path::chain::{Chain, Segment};
use crate::path::circle::{Circle, Turn};
use crate::path::helix::Helix;
use crate::path::line::Line;
use crate::path::sinusoid::Sinusoid;

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
        PathChoice::Helix(h) => Arc::new(Helix::new(h.radius_m, h.lap, h.phase_deg.to_radians(), h.climb_m, h.z0_m)?),
    })
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
