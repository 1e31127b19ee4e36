//! A smooth curve through waypoints: the natural cubic spline in the path parameter.
//!
//! Position, tangent and p'' are continuous everywhere, and so is the curvature; p''' jumps at the waypoints, and with it
//! the derivative of the curvature: a law that feeds it forward has a torque that jumps there, and no error. Before the
//! first waypoint and after the last one the path goes straight on, which a natural spline (p'' = 0 at its ends) meets
//! smoothly.

use nalgebra::Vector3;

use super::{Path, PathPoint};
use crate::positive::{finite, positive};

/// Most waypoints of a path.
pub const MOST_WAYPOINTS: usize = 10_000;
/// How often the parameter is brought closer to the arc length; each time the difference shrinks by some tenfold.
const REFINEMENTS: usize = 6;
/// Points of the Gauss–Legendre rule on \[−1, 1\] with their weights, by which a piece is measured.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 128.0 / 225.0),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// A natural cubic spline.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    /// ξ of each waypoint, increasing.
    knots: Vec<f64>,
    points: Vec<Vector3<f64>>,
    /// p'' at each waypoint.
    bends: Vec<Vector3<f64>>,
    search_range: (f64, f64),
}

impl Spline {
    /// Through these points \[m\], two at least and no two in succession the same, with ξ close to the arc length divided
    /// by `rate` \[m per unit of ξ\]: R differs from `rate` by what the length of a piece leaves to its middle.
    pub fn by_length(points: Vec<Vector3<f64>>, rate: f64) -> Result<Spline, String> {
        positive("a spline's length per unit of xi", rate)?;
        check_points(&points)?;
        let mut lengths: Vec<f64> = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let mut spline = Spline::through(points, from_lengths(&lengths))?;
        for _ in 0..REFINEMENTS {
            lengths = (0..lengths.len()).map(|piece| spline.length(piece)).collect();
            spline = Spline::through(spline.points, from_lengths(&lengths))?;
        }
        let knots = spline.knots.iter().map(|knot| knot / rate).collect();
        Spline::through(spline.points, knots)
    }

    /// Through these points at these values of ξ, which must increase: vehicles whose waypoints have the same values are
    /// abreast at them.
    pub fn at_values(points: Vec<Vector3<f64>>, values: Vec<f64>) -> Result<Spline, String> {
        check_points(&points)?;
        if values.len() != points.len() {
            return Err(format!("{} values of xi for {} waypoints", values.len(), points.len()));
        }
        Spline::through(points, values)
    }

    fn through(points: Vec<Vector3<f64>>, knots: Vec<f64>) -> Result<Spline, String> {
        for (i, pair) in knots.windows(2).enumerate() {
            finite("a waypoint's xi", pair[0])?;
            positive(&format!("the step of xi after waypoint {i}"), pair[1] - pair[0])?;
        }
        let bends = bends(&points, &knots);
        if !bends.iter().all(|bend| bend.iter().all(|x| x.is_finite())) {
            return Err("the waypoints are too far apart or too close for their steps of xi".to_owned());
        }
        let (first, last) = (knots[0], knots[knots.len() - 1]);
        // A vehicle may start before the first waypoint, by a tenth of the path.
        let reach = 0.1 * (last - first);
        Ok(Spline { search_range: (first - reach, last + reach), knots, points, bends })
    }

    /// The waypoints' values of ξ.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The length of a piece \[m\].
    fn length(&self, piece: usize) -> f64 {
        let (from, to) = (self.knots[piece], self.knots[piece + 1]);
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        GAUSS.iter().map(|(x, weight)| weight * half * self.on(piece, middle + half * x).r()).sum()
    }

    /// The point of a piece, whose ends are waypoints `piece` and `piece` + 1:
    /// p = a p₀ + b p₁ + ((a³ − a) m₀ + (b³ − b) m₁) h²/6 with a = (ξ₁ − ξ)/h, b = 1 − a.
    fn on(&self, piece: usize, xi: f64) -> PathPoint {
        let (from, h) = (self.knots[piece], self.knots[piece + 1] - self.knots[piece]);
        let (p_0, p_1) = (self.points[piece], self.points[piece + 1]);
        let (m_0, m_1) = (self.bends[piece], self.bends[piece + 1]);
        let b = (xi - from) / h;
        let a = 1.0 - b;
        PathPoint {
            p: a * p_0 + b * p_1 + (m_0 * (a * a * a - a) + m_1 * (b * b * b - b)) * (h * h / 6.0),
            d1: (p_1 - p_0) / h + (m_1 * (3.0 * b * b - 1.0) - m_0 * (3.0 * a * a - 1.0)) * (h / 6.0),
            d2: a * m_0 + b * m_1,
            d3: (m_1 - m_0) / h,
        }
    }
}

fn check_points(points: &[Vector3<f64>]) -> Result<(), String> {
    if !(2..=MOST_WAYPOINTS).contains(&points.len()) {
        return Err(format!("2 to {MOST_WAYPOINTS} waypoints make a path, there are {}", points.len()));
    }
    points.iter().flat_map(|point| point.iter()).try_for_each(|&x| finite("a waypoint", x).map(drop))?;
    match points.windows(2).position(|pair| pair[0] == pair[1]) {
        Some(i) => Err(format!("waypoints {i} and {} are the same", i + 1)),
        None => Ok(()),
    }
}

fn from_lengths(lengths: &[f64]) -> Vec<f64> {
    let sums = lengths.iter().scan(0.0, |sum, length| {
        *sum += length;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// p'' at the knots: h_{i−1} m_{i−1} + 2(h_{i−1} + h_i) m_i + h_i m_{i+1} = 6(slope_i − slope_{i−1}), zero at both ends;
/// by elimination from the first to the last.
fn bends(points: &[Vector3<f64>], knots: &[f64]) -> Vec<Vector3<f64>> {
    let n = points.len();
    let step = |i: usize| knots[i + 1] - knots[i];
    let slope = |i: usize| (points[i + 1] - points[i]) / step(i);
    let mut bends = vec![Vector3::zeros(); n];
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let pivot = 2.0 * (step(i - 1) + step(i)) - step(i - 1) * upper[i - 1];
        upper[i] = step(i) / pivot;
        bends[i] = (6.0 * (slope(i) - slope(i - 1)) - step(i - 1) * bends[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        let next = bends[i + 1];
        bends[i] -= upper[i] * next;
    }
    bends
}

impl Path for Spline {
    fn at(&self, xi: f64) -> PathPoint {
        let last = self.knots.len() - 1;
        let end = if xi < self.knots[0] {
            Some((self.knots[0], self.on(0, self.knots[0])))
        } else if xi > self.knots[last] {
            Some((self.knots[last], self.on(last - 1, self.knots[last])))
        } else {
            None
        };
        match end {
            Some((knot, end)) => {
                let still = Vector3::zeros();
                PathPoint { p: end.p + end.d1 * (xi - knot), d1: end.d1, d2: still, d3: still }
            }
            None => {
                let following = self.knots.partition_point(|knot| *knot <= xi);
                self.on(following.clamp(1, last) - 1, xi)
            }
        }
    }

    fn search_range(&self) -> (f64, f64) {
        self.search_range
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    use super::*;
    use crate::path::check::assert_derivatives_agree;
    use crate::path::shape::{is_planar, is_straight};

    fn points(flat: &[[f64; 3]]) -> Vec<Vector3<f64>> {
        flat.iter().map(|p| Vector3::from(*p)).collect()
    }

    fn harbour() -> Vec<Vector3<f64>> {
        points(&[[0.0, 0.0, 0.0], [60.0, 5.0, 0.0], [90.0, 40.0, 0.0], [60.0, 80.0, 0.0], [-10.0, 85.0, 0.0]])
    }

    #[test]
    fn it_goes_through_its_waypoints_smoothly_and_straight_on_at_its_ends() {
        let path = Spline::by_length(harbour(), 1.0).unwrap();
        for (point, &knot) in harbour().iter().zip(path.knots()) {
            assert!((path.at(knot).p - point).norm() < 1e-12);
            let (before, after) = (path.at(knot - 1e-7), path.at(knot + 1e-7));
            assert!((before.p - after.p).norm() < 1e-6 && (before.d1 - after.d1).norm() < 1e-7);
            assert!((before.d2 - after.d2).norm() < 1e-7, "p'' is continuous at {knot}");
            assert!((before.curvature() - after.curvature()).abs() < 1e-7);
        }
        let (first, last) = (path.knots()[0], path.knots()[4]);
        assert_eq!((path.at(first - 5.0).d2, path.at(last + 5.0).d2), (Vector3::zeros(), Vector3::zeros()));
        for xi in [-7.0, 1.0, 30.0, 77.7, 150.0, 250.0, last + 3.0] {
            assert_derivatives_agree(&path, xi);
        }
        assert!(is_planar(&path));
    }

    #[test]
    fn the_parameter_is_close_to_the_arc_length() {
        let path = Spline::by_length(harbour(), 2.0).unwrap();
        let steps = 100_000;
        let (from, to) = (path.knots()[0], path.knots()[4]);
        let (mut length, mut worst) = (0.0, 0f64);
        for step in 0..steps {
            let r = path.at(from + (to - from) * (f64::from(step) + 0.5) / f64::from(steps)).r();
            length += r * (to - from) / f64::from(steps);
            worst = worst.max((r / 2.0 - 1.0).abs());
        }
        assert!((length / 2.0 - (to - from)).abs() < 1e-3, "{length} {to}");
        assert!(worst < 0.2, "R stays near the rate: {worst}");
    }

    #[test]
    fn on_a_circle_of_many_waypoints_it_is_the_circle() {
        let circle: Vec<Vector3<f64>> =
            (0..=60).map(|i| 0.1 * f64::from(i)).map(|a| Vector3::new(10.0 * a.cos(), 10.0 * a.sin(), 0.0)).collect();
        let path = Spline::by_length(circle, 1.0).unwrap();
        let middle = path.at(30.0);
        assert!((middle.p.norm() - 10.0).abs() < 1e-4 && (middle.curvature() - 0.1).abs() < 1e-3);
        assert!((middle.r() - 1.0).abs() < 1e-5, "{}", middle.r());
    }

    #[test]
    fn values_of_xi_put_vehicles_abreast() {
        let inner =
            Spline::at_values(points(&[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 9.0, 0.0]]), vec![0.0, 1.0, 2.0]);
        let outer =
            Spline::at_values(points(&[[0.0, -2.0, 0.0], [12.0, -2.0, 0.0], [12.0, 9.0, 0.0]]), vec![0.0, 1.0, 2.0]);
        let (inner, outer) = (inner.unwrap(), outer.unwrap());
        assert!((inner.at(1.0).p - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((outer.at(1.0).p - Vector3::new(12.0, -2.0, 0.0)).norm() < 1e-12);
        assert!(outer.at(0.5).r() > inner.at(0.5).r());
    }

    #[test]
    fn two_waypoints_make_a_line() {
        let path = Spline::by_length(points(&[[1.0, 2.0, 3.0], [4.0, 6.0, 3.0]]), 0.5).unwrap();
        assert!(is_straight(&path) && (path.knots()[1] - 10.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        assert!(Spline::by_length(points(&[[0.0; 3]]), 1.0).is_err());
        assert!(Spline::by_length(points(&[[0.0; 3], [0.0; 3]]), 1.0).unwrap_err().contains("0 and 1"));
        assert!(Spline::by_length(harbour(), 0.0).is_err());
        assert!(Spline::by_length(points(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]), 1.0).is_err());
        assert!(Spline::at_values(harbour(), vec![0.0, 1.0]).unwrap_err().contains("2 values of xi for 5"));
        assert!(Spline::at_values(harbour(), vec![0.0, 1.0, 1.0, 2.0, 3.0]).unwrap_err().contains("waypoint 1"));
        assert!(Spline::at_values(harbour(), vec![0.0, 1.0, 2.0, 3.0, f64::INFINITY]).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn it_turns_and_moves_with_its_waypoints(turn in -3.0..3.0f64, east in -1e3..1e3f64, xi in -20.0..320.0f64) {
            let (turned, shift) = (Rotation3::from_axis_angle(&Vector3::z_axis(), turn), Vector3::new(east, 5.0, -3.0));
            let here = Spline::by_length(harbour(), 1.0).unwrap().at(xi);
            let moved = harbour().iter().map(|p| turned * p + shift).collect();
            let there = Spline::by_length(moved, 1.0).unwrap().at(xi);
            prop_assert!((turned * here.p + shift - there.p).norm() < 1e-8);
            prop_assert!((here.curvature() - there.curvature()).abs() < 1e-9);
        }

        #[test]
        fn every_point_and_derivative_is_a_number(
            raw in prop::collection::vec(prop::array::uniform3(-1e3..1e3f64), 2..12), xi in -1e4..1e4f64,
        ) {
            if let Ok(path) = Spline::by_length(points(&raw), 1.0) {
                let at = path.at(xi);
                prop_assert!([at.p, at.d1, at.d2, at.d3].iter().all(|v| v.iter().all(|x| x.is_finite())));
            }
        }
    }

    #[test]
    fn a_vehicle_may_start_a_tenth_before_it_and_end_as_far_behind() {
        let path = Spline::at_values(harbour(), (0..harbour().len()).map(|i| 5.0 + 2.0 * i as f64).collect()).unwrap();
        let length = 2.0 * (harbour().len() - 1) as f64;
        let (from, to) = path.search_range();
        assert!(
            (from - (5.0 - 0.1 * length)).abs() < 1e-12 && (to - (5.0 + 1.1 * length)).abs() < 1e-12,
            "{from} {to}"
        );
    }
}
