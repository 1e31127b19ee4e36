//! Time series of a fleet, out of the rows of its recording.

use std::ops::Range;

use common::coordination::disagreement;
use common::mission::Pattern;
use common::record::{Record, SpeedRow, StateRow};
use common::time::Time;

use super::statistics::steady_from;
use super::{Facts, Way};

/// The rows of one vehicle in order of time.
#[derive(Clone, Debug)]
pub struct Track<'a> {
    /// Its name.
    pub id: &'a str,
    /// Its place in the pattern.
    pub pattern: Pattern,
    /// Its states.
    pub rows: Vec<&'a StateRow>,
}

/// The tracks of a fleet in the mission's order, vehicles without rows included.
pub fn tracks<'a>(exact: &'a [Record], facts: &'a Facts) -> Vec<Track<'a>> {
    let mut tracks: Vec<Track<'a>> = facts
        .vehicles
        .iter()
        .map(|vehicle| Track { id: &vehicle.id, pattern: vehicle.pattern, rows: Vec::new() })
        .collect();
    let mut guess = 0;
    for record in exact {
        let Record::State(row) = record else { continue };
        // Vehicles report in turn: the next one is most often the right one.
        let found = match tracks.get(guess) {
            Some(track) if track.id == &*row.vehicle => Some(guess),
            _ => tracks.iter().position(|track| track.id == &*row.vehicle),
        };
        if let Some(index) = found {
            tracks[index].rows.push(row);
            guess = (index + 1) % tracks.len();
        }
    }
    for track in &mut tracks {
        track.rows.sort_by_key(|row| row.t_ns);
    }
    tracks
}

/// The changes of the formation speed, in order of time.
pub(super) fn speeds(exact: &[Record]) -> Vec<&SpeedRow> {
    let rows = exact.iter().filter_map(|record| match record {
        Record::Speed(row) => Some(row),
        _ => None,
    });
    let mut rows: Vec<&SpeedRow> = rows.collect();
    rows.sort_by_key(|row| row.t_ns);
    rows
}

/// The coordination states of a fleet with the pattern removed, ξ_i − h_i, at common instants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coordination {
    /// The instants \[s\]: those of the first vehicle at which every other vehicle is known too.
    pub t_s: Vec<f64>,
    /// For each vehicle that has rows, in the mission's order, its state at these instants.
    pub states: Vec<Vec<f64>>,
    /// ‖(I − 11ᵀ/n) d‖ with d_i = ξ̇_i − v_i/R_i (3.36), how fast path following drives the error; `None` if no vehicle's speed is
    /// what coordination commands.
    pub disturbance: Option<Vec<f64>>,
}

impl Coordination {
    /// Puts the tracks on common instants. Between two rows of a vehicle its state is interpolated linearly, if they
    /// are not further apart than ten control periods: of a vehicle that was silent longer nothing is claimed.
    pub fn of(tracks: &[Track<'_>], facts: &Facts) -> Coordination {
        let gap_ns = (10.0 * facts.control_period_s * 1e9) as i64;
        let present: Vec<&Track<'_>> = tracks.iter().filter(|track| !track.rows.is_empty()).collect();
        let mut cursors = vec![0; present.len()];
        let mut coordination =
            Coordination { t_s: Vec::new(), states: vec![Vec::new(); present.len()], disturbance: None };
        let ways: Vec<&Way> = present.iter().map(|track| way(facts, track.id)).collect();
        let mut d = Vec::new();
        let Some(first) = present.first() else { return coordination };
        let mut states = Vec::with_capacity(present.len());
        for row in &first.rows {
            states.clear();
            for (track, cursor) in present.iter().zip(&mut cursors) {
                let Some(xi) = interpolate(&track.rows, cursor, row.t_ns, gap_ns) else { break };
                states.push(xi - track.pattern.at(Time::from_nanos(row.t_ns)).h);
            }
            if states.len() == present.len() {
                coordination.t_s.push(row.t_ns as f64 / 1e9);
                coordination.states.iter_mut().zip(&states).for_each(|(series, state)| series.push(*state));
                let driven = present.iter().zip(&cursors).zip(&ways);
                let driven: Vec<f64> = driven
                    .map(|((track, cursor), way)| driven_by_following(track, *cursor, way, facts.control_period_s))
                    .collect();
                d.push(disagreement::of_fleet(driven.iter().copied()));
            }
        }
        coordination.disturbance = ways.iter().any(|way| way.0.is_some()).then_some(d);
        coordination
    }

    /// The largest difference between two vehicles, max |x_i − x_j|, over time.
    pub fn spread(&self) -> Vec<f64> {
        self.over_time(|states| {
            let low = states.iter().copied().fold(f64::INFINITY, f64::min);
            let high = states.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if states.is_empty() { 0.0 } else { high - low }
        })
    }

    /// ‖(I − 11ᵀ/n) x‖, the norm of what the states differ from their mean by, over time.
    pub fn norm(&self) -> Vec<f64> {
        self.over_time(|states| disagreement::of_fleet(states.iter().copied()))
    }

    fn over_time(&self, value: impl Fn(&[f64]) -> f64) -> Vec<f64> {
        let mut states = Vec::with_capacity(self.states.len());
        let at = |index: usize| {
            states.clear();
            states.extend(self.states.iter().map(|series| series[index]));
            value(&states)
        };
        (0..self.t_s.len()).map(at).collect()
    }
}

/// The parts of a series without a gap. A gap is three times as long as what is usual between two instants of the series, and ten
/// control periods at least: a busy machine may cost a row, a vehicle that is away costs many.
pub(super) fn unbroken(t_s: &[f64], facts: &Facts) -> Vec<Range<usize>> {
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let usual = if steps.is_empty() { 0.0 } else { *steps.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let longest = (3.0 * usual).max(10.0 * facts.control_period_s) + 1e-9;
    let breaks = (1..t_s.len()).filter(|at| t_s[*at] - t_s[*at - 1] > longest);
    let bounds: Vec<usize> = std::iter::once(0).chain(breaks).chain([t_s.len()]).collect();
    bounds.windows(2).map(|pair| pair[0]..pair[1]).filter(|part| !part.is_empty()).collect()
}

/// The index at which the steady part begins.
pub(super) fn steady_part(t_s: &[f64], facts: &Facts) -> usize {
    let (Some(first), Some(last)) = (t_s.first(), t_s.last()) else { return 0 };
    let from = steady_from(*last, *first, facts.link_period_s);
    t_s.partition_point(|time| *time < from - 1e-9)
}

/// Whether an instant is before the end by more than a row or two.
pub(super) fn is_early(t_s: f64, duration_s: f64) -> bool {
    duration_s - t_s > (0.01 * duration_s).max(1.0)
}

fn way<'a>(facts: &'a Facts, id: &str) -> &'a Way {
    const NONE: &Way = &Way(None);
    facts.vehicles.iter().find(|vehicle| vehicle.id == id).map_or(NONE, |vehicle| &vehicle.way)
}

/// d = ξ̇ − v/R at the vehicle's next row; nothing for a target that moves as told.
///
/// A target that is held for a control period keeps up with the mean speed of its vehicle in it: v is that, not the speed at its begin.
fn driven_by_following(track: &Track<'_>, cursor: usize, way: &Way, period_s: f64) -> f64 {
    let (Some(path), Some(row)) = (&way.0, track.rows.get(cursor)) else { return 0.0 };
    let (before, after) = (track.rows[cursor.saturating_sub(1)], track.rows.get(cursor + 1).unwrap_or(row));
    let between_s = (after.t_ns - before.t_ns) as f64 / 1e9;
    let v_dot = if between_s > 0.0 { (after.speed_mps - before.speed_mps) / between_s } else { 0.0 };
    row.xi_rate - (row.speed_mps + 0.5 * period_s * v_dot) / path.at(row.xi).r()
}

fn interpolate(rows: &[&StateRow], cursor: &mut usize, t_ns: i64, gap_ns: i64) -> Option<f64> {
    while rows.get(*cursor).is_some_and(|row| row.t_ns < t_ns) {
        *cursor += 1;
    }
    let after = rows.get(*cursor)?;
    if after.t_ns == t_ns {
        return Some(after.xi);
    }
    let before = rows.get(cursor.checked_sub(1)?)?;
    let span_ns = after.t_ns - before.t_ns;
    let part = (t_ns - before.t_ns) as f64 / span_ns as f64;
    (span_ns <= gap_ns).then_some(before.xi + part * (after.xi - before.xi))
}

#[cfg(test)]
mod tests {
    use common::mission::PatternMotion;

    use super::*;
    use crate::results::VehicleFacts;
    use crate::results::testing::state_row;

    fn facts() -> Facts {
        let vehicle = |id: &str, h| VehicleFacts { id: id.into(), pattern: Pattern::constant(h), ..Default::default() };
        Facts { vehicles: vec![vehicle("a", 0.5), vehicle("b", -0.25)], control_period_s: 0.1, ..Facts::default() }
    }

    fn coordination(rows: &[(i64, &str, f64)]) -> Coordination {
        let exact: Vec<Record> =
            rows.iter().map(|(ms, id, xi)| Record::State(state_row(ms * 1_000_000, id, *xi))).collect();
        let facts = facts();
        Coordination::of(&tracks(&exact, &facts), &facts)
    }

    #[test]
    fn the_pattern_is_removed() {
        let coordination = coordination(&[(0, "a", 1.5), (0, "b", 0.75), (100, "a", 1.75), (100, "b", 0.75)]);
        assert_eq!(coordination.spread(), [0.0, 0.25]);
        let expected = 0.25 / 2.0_f64.sqrt();
        assert!(
            coordination.norm().iter().zip([0.0, expected]).all(|(norm, expected)| (norm - expected).abs() < 1e-15)
        );
    }

    #[test]
    fn a_pattern_that_moves_is_removed_as_it_is_at_each_instant() {
        let motion = PatternMotion { amplitude: 0.5, period: 0.4, phase: 0.0 };
        let moving = Pattern { constant: 1.0, motion: Some(motion) };
        let vehicle = |id: &str, pattern| VehicleFacts { id: id.into(), pattern, ..Default::default() };
        let facts = Facts {
            vehicles: vec![vehicle("a", moving), vehicle("b", Pattern::default())],
            control_period_s: 0.1,
            ..Facts::default()
        };
        // h is 1, 1.5 and 0.5 at 0, 0.1 and 0.3 s.
        let rows = [(0, "a", 1.0), (0, "b", 0.0), (100, "a", 1.5), (100, "b", 0.0), (300, "a", 1.5), (300, "b", 0.0)];
        let exact: Vec<Record> =
            rows.iter().map(|(ms, id, xi)| Record::State(state_row(ms * 1_000_000, id, *xi))).collect();
        let spread = Coordination::of(&tracks(&exact, &facts), &facts).spread();
        assert!(spread.iter().zip([0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{spread:?}");
    }

    #[test]
    fn what_path_following_does_to_coordination_is_seen() {
        let mut facts = facts();
        let circle = common::path::line::Line::new(Default::default(), 0.0, 2.0).expect("a line");
        facts.vehicles[0].way = Way(Some(std::sync::Arc::new(circle)));
        let row =
            |id: &str, xi_rate, speed_mps| Record::State(StateRow { xi_rate, speed_mps, ..state_row(0, id, 0.0) });
        // R = 2: 0.6 m/s make 0.3, and ξ goes at 0.5; the other target moves as told.
        let coordination = Coordination::of(&tracks(&[row("a", 0.5, 0.6), row("b", 0.9, 0.0)], &facts), &facts);
        let d = coordination.disturbance.expect("one vehicle goes along");
        assert!((d[0] - 0.2 / 2.0_f64.sqrt()).abs() < 1e-12, "{d:?}");
        facts.vehicles[0].way = Way(None);
        assert_eq!(Coordination::of(&tracks(&[row("a", 0.5, 0.6)], &facts), &facts).disturbance, None);
    }

    #[test]
    fn vehicles_that_report_at_other_instants_are_interpolated() {
        let coordination = coordination(&[(0, "b", 0.0), (50, "a", 0.75), (100, "b", 1.0)]);
        assert_eq!(coordination.states, [[0.25], [0.75]]);
    }

    #[test]
    fn nothing_is_claimed_of_a_vehicle_that_was_silent() {
        let rows =
            [(0, "b", 0.0), (0, "a", 0.0), (1000, "a", 0.0), (2000, "a", 0.0), (2000, "b", 0.0), (2100, "a", 0.0)];
        assert_eq!(coordination(&rows).t_s, [0.0, 2.0]);
    }

    #[test]
    fn a_series_is_broken_where_a_vehicle_was_away_and_not_where_a_row_is_missing() {
        let facts = Facts { control_period_s: 0.05, ..Facts::default() };
        let missing_one = [0.0, 0.5, 1.0, 2.0, 2.5];
        let whole = unbroken(&missing_one, &facts);
        assert_eq!((whole.len(), &whole[0]), (1, &(0..5)));
        let away = [0.0, 0.5, 1.0, 90.0, 90.5, 91.0];
        assert_eq!(unbroken(&away, &facts), [0..3, 3..6]);
        assert!(unbroken(&[], &facts).is_empty());
    }

    #[test]
    fn a_fleet_of_one_or_none_is_coordinated() {
        assert_eq!(coordination(&[(0, "a", 1.0)]).spread(), [0.0]);
        assert_eq!(coordination(&[]).norm(), [0.0; 0]);
    }
}
