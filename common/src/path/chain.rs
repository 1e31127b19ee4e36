//! Lines and arcs joined end to end, each with its own length in ξ (Figures 3.7 and 3.8, Remark 3.8).

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// One segment of a [`Chain`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// Straight ahead.
    Line {
        /// Length \[m\], positive.
        length: f64,
        /// How far ξ advances along it, positive.
        xi_length: f64,
    },
    /// A piece of a circle that continues the direction of the segment before.
    Arc {
        /// Radius \[m\], positive.
        radius: f64,
        /// Angle turned \[rad\], not zero: positive to the left, negative to the right.
        sweep: f64,
        /// How far ξ advances along it, positive. With |sweep| here, R is the radius.
        xi_length: f64,
    },
    /// A sharp change of direction that takes no length.
    Corner {
        /// Angle turned \[rad\], positive to the left.
        angle: f64,
    },
}

/// A segment with all that is needed to evaluate it.
#[derive(Clone, Debug, PartialEq)]
struct Piece {
    xi: f64,
    start: Vector3<f64>,
    heading: f64,
    /// Signed curvature \[1/m\], zero for a line.
    curvature: f64,
    /// R = ds/dξ, constant on the piece.
    r: f64,
}

impl Piece {
    fn heading_at(&self, s: f64) -> f64 {
        self.heading + self.curvature * s
    }

    fn at(&self, xi: f64) -> PathPoint {
        let s = self.r * (xi - self.xi);
        let c = self.curvature;
        let (sin, cos) = self.heading_at(s).sin_cos();
        let tangent = Vector3::new(cos, sin, 0.0);
        let normal = Vector3::new(-sin, cos, 0.0);
        // On an arc the vehicle turns around start + normal(start)/c, at −normal/c from there.
        let p = if c == 0.0 {
            self.start + s * tangent
        } else {
            let (sin_0, cos_0) = self.heading.sin_cos();
            self.start + (Vector3::new(-sin_0, cos_0, 0.0) - normal) / c
        };
        let r = self.r;
        PathPoint { p, d1: r * tangent, d2: r * r * c * normal, d3: -r * r * r * c * c * tangent }
    }
}

/// Segments joined so that ξ and the position are continuous; R is constant on each. At a joint the following
/// segment counts. The first and the last segment go on beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Never empty; ordered by `xi`.
    pieces: Vec<Piece>,
    search_range: (f64, f64),
    corners: Vec<f64>,
    joints: Vec<f64>,
}

impl Chain {
    /// The chain that starts at `start` \[m\] in the direction `heading` \[rad\] when ξ = 0.
    pub fn new(start: Vector3<f64>, heading: f64, segments: &[Segment]) -> Result<Chain, String> {
        start.iter().try_for_each(|&x| finite("a chain's start", x).map(drop))?;
        let (mut xi, mut start, mut heading) = (0.0, start, finite("a chain's heading", heading)?);
        let mut pieces: Vec<Piece> = Vec::with_capacity(segments.len());
        let mut corners = Vec::new();
        for segment in segments {
            let (length, curvature, xi_length) = match *segment {
                Segment::Line { length, xi_length } => (positive("a line's length", length)?, 0.0, xi_length),
                Segment::Arc { radius, sweep, xi_length } => {
                    positive("an arc's radius", radius)?;
                    positive("the size of an arc's sweep", sweep.abs())?;
                    (radius * sweep.abs(), sweep.signum() / radius, xi_length)
                }
                Segment::Corner { angle } => {
                    heading += finite("a corner's angle", angle)?;
                    corners.push(xi);
                    continue;
                }
            };
            positive("a segment's length in xi", xi_length)?;
            let piece = Piece { xi, start, heading, curvature, r: length / xi_length };
            positive("a segment's length per unit of xi", piece.r)?;
            (xi, heading) = (xi + xi_length, piece.heading_at(length));
            start = piece.at(xi).p;
            pieces.push(piece);
        }
        let (Some(first), Some(last)) = (pieces.first(), pieces.last()) else {
            return Err("a chain needs a line or an arc".to_owned());
        };
        if corners.first() == Some(&0.0) || corners.last() == Some(&xi) {
            return Err("a corner must have a line or an arc before and after it".to_owned());
        }
        // A vehicle may start before a first line or after a last line, by as much as that line is long. An arc is
        // not prolonged: it would come round to where the chain has been.
        let first_end = pieces.get(1).map_or(xi, |second| second.xi);
        let before = if first.curvature == 0.0 { first_end } else { 0.0 };
        let after = if last.curvature == 0.0 { xi - last.xi } else { 0.0 };
        let joints = pieces.iter().skip(1).map(|piece| piece.xi).collect();
        Ok(Chain { search_range: (-before, xi + after), pieces, corners, joints })
    }
}

impl Path for Chain {
    fn at(&self, xi: f64) -> PathPoint {
        let following = self.pieces.partition_point(|piece| piece.xi <= xi);
        self.pieces[following.saturating_sub(1)].at(xi)
    }

    fn search_range(&self) -> (f64, f64) {
        self.search_range
    }

    fn tangent_breaks(&self) -> &[f64] {
        &self.corners
    }

    fn joints(&self) -> &[f64] {
        &self.joints
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::Vector3;

    use super::{Chain, Segment};
    use crate::path::Path;
    use crate::path::check::assert_derivatives_agree;

    /// The path of one vehicle of Figure 3.7: arc, line, arc, line. R is the radius on the arcs and 1 on the lines.
    fn figure_3_7(radii: [f64; 2]) -> Chain {
        let arc = |radius, sweep: f64| Segment::Arc { radius, sweep, xi_length: sweep.abs() };
        let line = Segment::Line { length: 4.0, xi_length: 4.0 };
        let segments = [arc(radii[0], FRAC_PI_2), line, arc(radii[1], -FRAC_PI_2), line];
        Chain::new(Vector3::new(0.0, -radii[0], 0.0), 0.0, &segments).unwrap()
    }

    #[test]
    fn the_matrix_c_of_figures_3_7_and_3_8() {
        for (first, second) in [(2.0, 4.0), (3.0, 3.0), (4.0, 2.0)] {
            let path = figure_3_7([first, second]);
            for (xi, r, curvature) in [
                (0.5, first, 1.0 / first),
                (FRAC_PI_2 + 1.0, 1.0, 0.0),
                (FRAC_PI_2 + 4.5, second, -1.0 / second),
                (PI + 5.0, 1.0, 0.0),
            ] {
                assert!((path.at(xi).r() - r).abs() < 1e-14, "{xi}");
                assert!((path.at(xi).curvature() - curvature).abs() < 1e-14, "{xi}");
                assert_derivatives_agree(&path, xi);
            }
        }
    }

    #[test]
    fn nested_arcs_and_parallel_lines_keep_vehicles_abreast() {
        // Between vehicles 1 and 2 the distance is that between the lines, one metre, all along.
        let (one, two) = (figure_3_7([2.0, 4.0]), figure_3_7([3.0, 3.0]));
        for step in 0..90 {
            let xi = 0.1 * f64::from(step);
            assert!(((one.at(xi).p - two.at(xi).p).norm() - 1.0).abs() < 1e-12, "{xi}");
        }
    }

    #[test]
    fn position_and_direction_are_continuous_at_the_joints() {
        let path = figure_3_7([2.0, 4.0]);
        for joint in [FRAC_PI_2, FRAC_PI_2 + 4.0, PI + 4.0] {
            let (before, after) = (path.at(joint - 1e-9), path.at(joint + 1e-9));
            assert!((before.p - after.p).norm() < 1e-8);
            assert!((before.planar_tangent() - after.planar_tangent()).norm() < 1e-8);
        }
        assert!(path.tangent_breaks().is_empty());
    }

    #[test]
    fn the_ends_go_on() {
        let line = Segment::Line { length: 2.0, xi_length: 1.0 };
        let path = Chain::new(Vector3::zeros(), 0.0, &[line]).unwrap();
        assert_eq!((path.at(-1.0).p.x, path.at(3.0).p.x), (-2.0, 6.0));
        assert_eq!(path.search_range(), (-1.0, 2.0));
        assert_eq!(figure_3_7([2.0, 4.0]).search_range(), (0.0, PI + 12.0));
        // By the first line and no more, and beyond a last arc not at all.
        let arc = Segment::Arc { radius: 1.0, sweep: 1.0, xi_length: 0.5 };
        let path = Chain::new(Vector3::zeros(), 0.0, &[line, arc, line, arc]).unwrap();
        assert_eq!((path.search_range(), path.joints()), ((-1.0, 3.0), &[1.0, 1.5, 2.5][..]));
    }

    #[test]
    fn a_corner_is_told() {
        let line = Segment::Line { length: 1.0, xi_length: 1.0 };
        let corner = Segment::Corner { angle: FRAC_PI_2 };
        let path = Chain::new(Vector3::zeros(), 0.0, &[line, corner, line]).unwrap();
        assert_eq!(path.tangent_breaks(), [1.0]);
        assert!((path.at(2.0).p - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
        assert!(Chain::new(Vector3::zeros(), 0.0, &[corner, line]).is_err());
        assert!(Chain::new(Vector3::zeros(), 0.0, &[line, corner]).is_err());
        assert!(Chain::new(Vector3::zeros(), 0.0, &[corner, line, corner, line]).is_err());
        assert!(Chain::new(Vector3::zeros(), 0.0, &[line, corner, line, corner]).is_err());
    }

    #[test]
    fn impossible_segments_are_refused() {
        for segment in [
            Segment::Line { length: 0.0, xi_length: 1.0 },
            Segment::Line { length: 1.0, xi_length: 0.0 },
            Segment::Arc { radius: -1.0, sweep: 1.0, xi_length: 1.0 },
            Segment::Arc { radius: 1.0, sweep: 0.0, xi_length: 1.0 },
            Segment::Corner { angle: 1.0 },
        ] {
            assert!(Chain::new(Vector3::zeros(), 0.0, &[segment]).is_err(), "{segment:?}");
        }
        assert!(Chain::new(Vector3::zeros(), 0.0, &[]).is_err());
    }
}
