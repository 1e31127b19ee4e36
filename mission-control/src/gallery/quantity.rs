//! The quantities of a flight over time, each with its label.

use common::path::Path;
use common::record::StateRow;
use common::time::Time;

use crate::batch::Flight;
use crate::results::drawing::subscript;
use crate::results::{Coordination, Track, tracks};

use super::file::Quantity;

/// A quantity over time: of a vehicle, or of the fleet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    /// Index of the vehicle it belongs to, if it is of one.
    pub(super) vehicle: Option<usize>,
    /// What it is called in a legend.
    pub(super) name: String,
    /// Instants \[s\] and values.
    pub(super) points: Vec<(f64, f64)>,
}

impl Series {
    /// All series of a quantity: one per vehicle, per vehicle but the first, or one. `symbol` is what coordination states are
    /// called.
    pub(super) fn all(quantity: Quantity, flight: &Flight, symbol: &str) -> Vec<Series> {
        let tracks = tracks(&flight.recording.exact, &flight.facts);
        match quantity {
            Quantity::XiDifference => differences(flight, &tracks, symbol, true),
            Quantity::CoordinationError => differences(flight, &tracks, symbol, false),
            Quantity::LengthDifference => length_differences(flight, &tracks),
            Quantity::Disagreement => {
                let coordination = Coordination::of(&tracks, &flight.facts);
                let points = coordination.t_s.iter().copied().zip(coordination.spread()).collect();
                vec![Series { vehicle: None, name: "greatest difference".into(), points }]
            }
            Quantity::YawRate => each(&tracks, |track| turning(&track.rows)),
            _ => each(&tracks, |track| {
                track.rows.iter().filter_map(|row| Some((seconds(row), of_row(quantity, row)?))).collect()
            }),
        }
    }
}

fn each(tracks: &[Track<'_>], points: impl Fn(&Track<'_>) -> Vec<(f64, f64)>) -> Vec<Series> {
    let series = |(index, track): (usize, &Track<'_>)| Series {
        vehicle: Some(index),
        name: track.id.to_owned(),
        points: points(track),
    };
    tracks.iter().enumerate().map(series).collect()
}

/// ξ_1 − ξ_j for every other vehicle.
fn differences(flight: &Flight, tracks: &[Track<'_>], symbol: &str, with_pattern: bool) -> Vec<Series> {
    let Coordination { t_s, states, .. } = Coordination::of(tracks, &flight.facts);
    // Vehicles without rows have no states; the mission's own order is that of the tracks that have some.
    let present: Vec<usize> = (0..tracks.len()).filter(|&i| !tracks[i].rows.is_empty()).collect();
    let Some(&first) = present.first() else { return Vec::new() };
    let other = |(at, &vehicle): (usize, &usize)| {
        let offset = |t_s: f64| {
            let h = |vehicle: usize| tracks[vehicle].pattern.at(Time::from_secs(t_s)).h;
            if with_pattern { h(first) - h(vehicle) } else { 0.0 }
        };
        let points = t_s.iter().zip(states[0].iter().zip(&states[at])).map(|(&t, (a, b))| (t, a - b + offset(t)));
        let name = format!("{symbol}{} − {symbol}{}", subscript(first + 1), subscript(vehicle + 1));
        Series { vehicle: Some(vehicle), name, points: points.collect() }
    };
    present.iter().enumerate().skip(1).map(other).collect()
}

/// s_1 − s_j for every other vehicle, where the first has rows.
fn length_differences(flight: &Flight, tracks: &[Track<'_>]) -> Vec<Series> {
    let lengths: Vec<Vec<(f64, f64)>> =
        tracks.iter().zip(&flight.mission.vehicles).map(|(track, plan)| lengths(&*plan.path, &track.rows)).collect();
    let Some((first, others)) = lengths.split_first() else { return Vec::new() };
    let difference = |other: &[(f64, f64)]| {
        first.iter().filter_map(|(t, s)| Some((*t, s - value_at(other, *t)?))).collect::<Vec<(f64, f64)>>()
    };
    let series = |(at, other): (usize, &Vec<(f64, f64)>)| Series {
        vehicle: Some(at + 1),
        name: format!("s₁ − s{}", subscript(at + 2)),
        points: difference(other),
    };
    others.iter().enumerate().map(series).collect()
}

/// Parts of a step between two rows in which a path counts as evenly parametrised.
const PARTS: u32 = 10;

/// The way along a path since the first row \[m\]: the integral of |p'(ξ)|, by the midpoints of small steps.
fn lengths(path: &dyn Path, rows: &[&StateRow]) -> Vec<(f64, f64)> {
    let mut length = 0.0;
    let mut last = rows.first().map_or(0.0, |row| row.xi);
    let mut at = |row: &&StateRow| {
        let step = (row.xi - last) / f64::from(PARTS);
        let middles = (0..PARTS).map(|part| last + (f64::from(part) + 0.5) * step);
        length += middles.map(|xi| path.at(xi).r() * step).sum::<f64>();
        last = row.xi;
        (seconds(row), length)
    };
    rows.iter().map(&mut at).collect()
}

fn seconds(row: &StateRow) -> f64 {
    row.t_ns as f64 / 1e9
}

/// The mean rate of the heading from each row to the next, at the instant between.
fn turning(rows: &[&StateRow]) -> Vec<(f64, f64)> {
    use std::f64::consts::{PI, TAU};
    let between = |pair: &[&StateRow]| {
        let (t0, t1) = (seconds(pair[0]), seconds(pair[1]));
        let turned = (pair[1].yaw_rad - pair[0].yaw_rad + PI).rem_euclid(TAU) - PI;
        (t1 > t0).then_some(((t0 + t1) / 2.0, turned / (t1 - t0)))
    };
    rows.windows(2).filter_map(between).collect()
}

fn of_row(quantity: Quantity, row: &StateRow) -> Option<f64> {
    Some(match quantity {
        Quantity::Xi => row.xi,
        Quantity::XiRate => row.xi_rate,
        Quantity::ReferenceRate => row.v_ref,
        Quantity::Speed => row.speed_mps,
        Quantity::X => row.x_m,
        Quantity::Y => row.y_m,
        Quantity::Z => row.z_m,
        Quantity::Yaw => row.yaw_rad,
        Quantity::Pitch => row.pitch_rad,
        Quantity::Roll => row.roll_rad,
        Quantity::AlongError => row.e_along_m,
        Quantity::CrossError => row.e_cross_m,
        Quantity::PathError => row.e_norm_m,
        Quantity::HeadingError => row.psi_e_rad,
        Quantity::Neighbours => f64::from(row.neighbours),
        Quantity::YawRate
        | Quantity::XiDifference
        | Quantity::CoordinationError
        | Quantity::LengthDifference
        | Quantity::Disagreement => return None,
    })
}

/// What an axis says of a quantity.
pub(super) fn label(quantity: Quantity, symbol: &str) -> String {
    match quantity {
        Quantity::Xi => symbol.to_owned(),
        Quantity::XiRate => format!("rate of {symbol} [1/s]"),
        Quantity::ReferenceRate => format!("commanded rate of {symbol} [1/s]"),
        Quantity::XiDifference | Quantity::CoordinationError => format!("{symbol}₁ − {symbol}ⱼ"),
        Quantity::LengthDifference => "s₁ − sⱼ [m]".into(),
        Quantity::Disagreement => format!("max |{symbol}ᵢ − {symbol}ⱼ|"),
        Quantity::Speed => "speed [m/s]".into(),
        Quantity::X => "x [m]".into(),
        Quantity::Y => "y [m]".into(),
        Quantity::Z => "z [m]".into(),
        Quantity::Yaw => "heading [rad]".into(),
        Quantity::YawRate => "angular speed [rad/s]".into(),
        Quantity::Pitch => "pitch [rad]".into(),
        Quantity::Roll => "roll [rad]".into(),
        Quantity::AlongError => "along-track error [m]".into(),
        Quantity::CrossError => "cross-track error [m]".into(),
        Quantity::PathError => "‖e‖ [m]".into(),
        Quantity::HeadingError => "heading error [rad]".into(),
        Quantity::Neighbours => "neighbours heard".into(),
    }
}

/// The value of a series at an instant, interpolated linearly; `None` outside of it.
pub(super) fn value_at(points: &[(f64, f64)], t: f64) -> Option<f64> {
    let after = points.partition_point(|point| point.0 < t);
    let (b, a) = (points.get(after), after.checked_sub(1).map(|before| points[before]));
    match (a, b) {
        (_, Some(b)) if b.0 - t < 1e-9 => Some(b.1),
        (Some(a), Some(b)) => Some(a.1 + (t - a.0) / (b.0 - a.0) * (b.1 - a.1)),
        (Some(a), None) => (t - a.0 < 1e-9).then_some(a.1),
        (None, _) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::state_row;

    #[test]
    fn between_two_samples_a_value_is_interpolated_and_outside_there_is_none() {
        let points = [(0.0, 1.0), (1.0, 3.0)];
        let found = [-0.1, 0.0, 0.25, 1.0, 1.1].map(|t| value_at(&points, t));
        assert_eq!(found, [None, Some(1.0), Some(1.5), Some(3.0), None]);
        assert_eq!(value_at(&[], 0.0), None);
    }

    #[test]
    fn the_way_along_a_path_is_its_length_whatever_its_parameter() {
        let text = include_str!("../../../missions/thesis/fig-2-11-ccw.toml");
        let mission = common::mission::Mission::parse("m", text).expect("sound");
        // A circle of 2 m, whose parameter is the angle.
        let circle = &*mission.vehicles[0].path;
        let row = |t_ns: i64, xi: f64| StateRow { xi, ..state_row(t_ns, "v", 0.0) };
        let rows = [row(0, 1.0), row(1_000_000_000, 1.5), row(2_000_000_000, 1.25)];
        let found = lengths(circle, &rows.iter().collect::<Vec<_>>());
        let expected = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.5)];
        assert!(found.iter().zip(expected).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-12), "{found:?}");
    }

    #[test]
    fn turning_past_the_reversed_direction_is_no_jump() {
        let row = |t_ns: i64, yaw_rad: f64| StateRow { yaw_rad, ..state_row(t_ns, "v", 0.0) };
        let rows = [row(0, 3.1), row(100_000_000, -3.1)];
        let turned = turning(&rows.iter().collect::<Vec<_>>());
        assert!((turned[0].0 - 0.05).abs() < 1e-12);
        assert!((turned[0].1 - (std::f64::consts::TAU - 6.2) / 0.1).abs() < 1e-9, "{turned:?}");
    }
}
