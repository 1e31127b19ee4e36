//! How space is seen on paper, and curves with no more points than the eye needs.

use super::file::Plane;

/// A way to see space: two directions, to the right and upwards on paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    right: [f64; 3],
    up: [f64; 3],
    labels: [&'static str; 2],
}

/// The view from above and aside: from how far to the left \[deg\], and from how high \[deg\].
const ASIDE_DEG: f64 = 30.0;
const ABOVE_DEG: f64 = 25.0;

impl View {
    pub(super) fn of(plane: Plane) -> View {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        match plane {
            Plane::Xy => View { right: x, up: y, labels: ["x [m]", "y [m]"] },
            Plane::Xz => View { right: x, up: z, labels: ["x [m]", "z [m]"] },
            Plane::Space => {
                let (sin_a, cos_a) = ASIDE_DEG.to_radians().sin_cos();
                let (sin_e, cos_e) = ABOVE_DEG.to_radians().sin_cos();
                let labels = ["seen from 25° above and 30° aside [m]", "[m]"];
                View { right: [cos_a, sin_a, 0.0], up: [-sin_a * sin_e, cos_a * sin_e, cos_e], labels }
            }
        }
    }

    /// Where a point of space is on paper.
    pub(super) fn see(&self, point: [f64; 3]) -> (f64, f64) {
        let along = |axis: &[f64; 3]| axis.iter().zip(point).map(|(a, p)| a * p).sum();
        (along(&self.right), along(&self.up))
    }

    /// What the axes say.
    pub(super) fn labels(&self) -> [&'static str; 2] {
        self.labels
    }
}

/// The smallest box around points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box2 {
    low: (f64, f64),
    high: (f64, f64),
}

impl Default for Box2 {
    fn default() -> Self {
        Box2 { low: (f64::INFINITY, f64::INFINITY), high: (f64::NEG_INFINITY, f64::NEG_INFINITY) }
    }
}

impl Box2 {
    pub(super) fn take(&mut self, (x, y): (f64, f64)) {
        self.low = (self.low.0.min(x), self.low.1.min(y));
        self.high = (self.high.0.max(x), self.high.1.max(y));
    }

    /// The longer side; 1 if there is none.
    pub(super) fn extent(&self) -> f64 {
        let side = (self.high.0 - self.low.0).max(self.high.1 - self.low.1);
        if side.is_finite() && side > 0.0 { side } else { 1.0 }
    }
}

/// The curve through some of the points that is nowhere further than `tolerance` from the left-out ones (Douglas and
/// Peucker).
pub(super) fn simplified(points: Vec<(f64, f64)>, tolerance: f64) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points;
    }
    let mut kept = vec![false; points.len()];
    (kept[0], kept[points.len() - 1]) = (true, true);
    let mut stretches = vec![(0, points.len() - 1)];
    while let Some((from, to)) = stretches.pop() {
        let far = (from + 1..to)
            .map(|index| (index, distance(points[index], points[from], points[to])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((index, off)) = far
            && off > tolerance
        {
            kept[index] = true;
            stretches.extend([(from, index), (index, to)]);
        }
    }
    points.into_iter().zip(kept).filter_map(|(point, keep)| keep.then_some(point)).collect()
}

/// Distance of a point from the straight piece between two others.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length2 = dx * dx + dy * dy;
    let along = ((point.0 - from.0) * dx + (point.1 - from.1) * dy) / length2;
    let part = if length2 > 0.0 { along.clamp(0.0, 1.0) } else { 0.0 };
    (point.0 - from.0 - part * dx).hypot(point.1 - from.1 - part * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_from_aside_keeps_lengths_that_lie_on_the_paper() {
        let View { right, up, .. } = View::of(Plane::Space);
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(right, right) - 1.0).abs() < 1e-12 && (dot(up, up) - 1.0).abs() < 1e-12);
        assert!(dot(right, up).abs() < 1e-12);
        assert!(View::of(Plane::Space).see([0.0, 0.0, 1.0]).1 > 0.9, "up is up");
    }

    #[test]
    fn a_straight_line_needs_two_points_and_a_corner_three() {
        let line: Vec<(f64, f64)> = (0..100).map(|step| (f64::from(step), 2.0 * f64::from(step))).collect();
        assert_eq!(simplified(line.clone(), 1e-9), [line[0], line[99]]);
        let corner = vec![(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0)];
        assert_eq!(simplified(corner, 1e-9), [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]);
        assert_eq!(simplified(vec![(1.0, 1.0); 5], 0.1).len(), 2);
    }

    #[test]
    fn no_point_of_a_circle_is_further_away_than_allowed() {
        let circle: Vec<(f64, f64)> = (0..=1000).map(|i| (f64::from(i) * 0.00628).sin_cos()).collect();
        let kept = simplified(circle.clone(), 0.01);
        assert!(kept.len() < 60, "{}", kept.len());
        for point in circle {
            let off = kept.windows(2).map(|pair| distance(point, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
            assert!(off <= 0.01 + 1e-12, "{off}");
        }
    }
}
