//! What statements ask for beyond their network, looked at in one place: how R_i goes along the way, that v_L is constant and not
//! zero, and that nothing disturbs.
//!
//! *Undisturbed* means: no current, no noise, no failure, no actuator at its limit, and an answer of the law at all times. Whether limits
//! are reached is known after the flight; before it, only that a path turns faster than its vehicle can.

use common::craft::{REFUSED, SATURATED};
use common::mission::{Mission, VehiclePlan};
use common::theory::proposition_3_4::PathRates;
use common::time::Time;

use super::Case;
use super::premises::minds_no_hull;
use crate::results::{Summary, TheoryRow};

/// Places along the way at which R_i is looked at.
const PLACES: u32 = 400;
/// Two values of R_i or of a curvature are the same if they differ by no more than this part.
const SAME: f64 = 1e-9;

/// How R_i goes while the fleet goes its way in formation.
pub(super) struct Way {
    /// R_i of every vehicle \[m per unit of ξ\], at instants of the mission.
    pub(super) places: Vec<Vec<f64>>,
    /// Whether some R_i jumps on the way.
    pub(super) jumps: bool,
    /// Whether every vehicle goes on circles and lines, joined or not: R_i and the curvature are piecewise constant.
    pub(super) trimmed: bool,
}

impl Way {
    pub(super) fn of(mission: &Mission) -> Way {
        let legs = legs(mission);
        let at = |place: usize| legs.iter().map(|(vehicle, xi)| vehicle.path.at(xi[place]).r()).collect();
        Way {
            places: (0..=PLACES as usize).map(at).collect(),
            jumps: legs.iter().any(|(vehicle, xi)| passed(vehicle, xi).any(|joint| jumps_at(vehicle, joint))),
            trimmed: legs.iter().all(|(vehicle, xi)| is_trimmed(vehicle, xi)),
        }
    }

    /// R_i of every vehicle, if none changes.
    pub(super) fn constant(&self) -> Option<&[f64]> {
        let first = self.places.first()?;
        let same = |r: &Vec<f64>| r.iter().zip(first).all(|(r, first)| (r - first).abs() <= SAME * first);
        self.places.iter().all(same).then_some(first)
    }

    /// What is known of R_i in the words of Proposition 3.4.
    pub(super) fn rates(&self) -> PathRates {
        match self.constant() {
            Some(r) => PathRates::Constant(r.to_vec()),
            None if self.jumps => PathRates::Jumping,
            None => PathRates::AtMost(self.places.iter().flatten().copied().fold(0.0, f64::max)),
        }
    }
}

/// The parameters of every vehicle along its way, if the fleet is in formation from where its last vehicle starts.
fn legs(mission: &Mission) -> Vec<(&VehiclePlan, Vec<f64>)> {
    let behind = |vehicle: &VehiclePlan| vehicle.start.xi - vehicle.pattern.at(Time::ZERO).h;
    let start = mission.vehicles.iter().map(behind).fold(f64::INFINITY, f64::min);
    let instant = |place: u32| Time::from_secs(mission.end.secs() * f64::from(place) / f64::from(PLACES));
    let xi = |vehicle: &VehiclePlan, t| start + mission.speed.distance(t) + vehicle.pattern.at(t).h;
    let leg = |vehicle| (0..=PLACES).map(|place| xi(vehicle, instant(place))).collect();
    mission.vehicles.iter().map(|vehicle| (vehicle, leg(vehicle))).collect()
}

/// The joints of its path that a vehicle passes.
fn passed<'a>(vehicle: &'a VehiclePlan, xi: &[f64]) -> impl Iterator<Item = f64> + use<'a> {
    let from = xi.iter().copied().fold(f64::INFINITY, f64::min);
    let to = xi.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    vehicle.path.joints().iter().copied().filter(move |joint| (from..=to).contains(joint))
}

fn jumps_at(vehicle: &VehiclePlan, joint: f64) -> bool {
    let before = vehicle.path.at(joint - SAME * joint.abs().max(1.0)).r();
    let after = vehicle.path.at(joint).r();
    (before - after).abs() > SAME * after
}

fn is_trimmed(vehicle: &VehiclePlan, xi: &[f64]) -> bool {
    let joints: Vec<f64> = passed(vehicle, xi).collect();
    xi.windows(2).all(|pair| {
        let (low, high) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        let (a, b) = (vehicle.path.at(pair[0]), vehicle.path.at(pair[1]));
        // Derivatives of circles are right to some digits less than the numbers that made them.
        let same = |a: f64, b: f64| (a - b).abs() <= 1e3 * SAME * a.abs().max(b.abs()).max(1e-6);
        joints.iter().any(|joint| (low..=high).contains(joint))
            || (same(a.r(), b.r()) && same(a.curvature(), b.curvature()))
    })
}

/// Whether the way of every vehicle is a straight line, gone along at one |p'|.
pub(super) fn on_lines(mission: &Mission) -> bool {
    legs(mission).iter().all(|(vehicle, xi)| {
        let mut along = xi.iter().map(|xi| vehicle.path.at(*xi).d1);
        along.next().is_some_and(|first| along.all(|d1| (d1 - first).norm() <= SAME * first.norm()))
    })
}

/// v/R = R v_L times the curvature, where the way of a vehicle turns fastest \[rad/s\].
pub(super) fn turning(mission: &Mission, index: usize) -> f64 {
    let (vehicle, xi) = &legs(mission)[index];
    let turn = |xi: &f64| {
        let point = vehicle.path.at(*xi);
        point.curvature().abs() * point.r() * mission.speed.fastest()
    };
    xi.iter().map(turn).fold(0.0, f64::max)
}

/// What is in the way of "undisturbed", in words.
pub(super) struct Disturbances {
    /// Currents, noise and limits.
    surroundings: Vec<String>,
    /// Vehicles that are stuck.
    failures: Vec<String>,
    /// Whether there are limits of which the flight will tell more.
    open: bool,
}

impl Disturbances {
    pub(super) fn of(mission: &Mission, summary: Option<&Summary>) -> Disturbances {
        let whose = |what: &str, hit: &dyn Fn(usize, &VehiclePlan) -> bool| {
            let ids: Vec<&str> = mission
                .vehicles
                .iter()
                .enumerate()
                .filter(|(index, vehicle)| hit(*index, vehicle))
                .map(|(_, vehicle)| vehicle.id.as_str())
                .collect();
            (!ids.is_empty()).then(|| format!("{what} ({})", ids.join(", ")))
        };
        let limits = |vehicle: &VehiclePlan| {
            let limits = vehicle.limits;
            [limits.force, limits.torque, limits.acceleration, limits.turn_rate].iter().any(|limit| limit.is_finite())
        };
        let warned_of = |what: &str, vehicle: &VehiclePlan| {
            let begin = format!("{}: {what}", vehicle.id);
            summary.is_some_and(|summary| summary.warnings.iter().any(|warning| warning.starts_with(&begin)))
        };
        Disturbances {
            surroundings: [
                whose("a current", &|_, vehicle| vehicle.disturbances.current.is_some()),
                whose("noise", &|_, vehicle| vehicle.disturbances.noise.is_some()),
                whose("a path that turns faster than the limit", &|index, vehicle| {
                    vehicle.limits.turn_rate < turning(mission, index)
                }),
                whose(SATURATED, &|_, vehicle| warned_of(SATURATED, vehicle)),
                whose(REFUSED, &|_, vehicle| warned_of(REFUSED, vehicle)),
            ]
            .into_iter()
            .flatten()
            .collect(),
            failures: whose("a failure", &|_, vehicle| {
                vehicle.disturbances.stuck.is_some_and(|stuck| stuck.from < mission.end)
            })
            .into_iter()
            .collect(),
            open: summary.is_none() && mission.vehicles.iter().any(limits),
        }
    }

    /// Whether failures are all there is.
    pub(super) fn only_failures(&self) -> bool {
        self.surroundings.is_empty()
    }

    /// Whether there is none at all.
    pub(super) fn is_empty(&self) -> bool {
        self.surroundings.is_empty() && self.failures.is_empty()
    }
}

/// The row of a statement that holds undisturbed, with constant v_L.
pub(super) fn undisturbed(case: &Case<'_>, row: TheoryRow) -> TheoryRow {
    with_premises(case, row, true)
}

/// The same of a statement that is about failures.
pub(super) fn undisturbed_but_for_failures(case: &Case<'_>, row: TheoryRow) -> TheoryRow {
    with_premises(case, row, false)
}

fn with_premises(case: &Case<'_>, mut row: TheoryRow, failures_matter: bool) -> TheoryRow {
    // A target that moves just as told does not mind what happens to the hull, unless α₂ tells coordination.
    if row.holds.is_none() || minds_no_hull(case.mission) {
        return row;
    }
    let what = if failures_matter { "undisturbed" } else { "otherwise undisturbed" };
    add(&mut row.condition, &format!("v_L constant, {what}"));
    if let Some(at) = last_step(case.mission) {
        add(&mut row.value, &format!("v_L steps, the last time at {} s: said of what follows", at.secs()));
    }
    let failures = case.disturbances.failures.iter().filter(|_| failures_matter);
    let words: Vec<&str> = case.disturbances.surroundings.iter().chain(failures).map(String::as_str).collect();
    if !words.is_empty() {
        add(&mut row.value, &format!("disturbed by {}", words.join(", ")));
        row = TheoryRow { holds: Some(false), predicted: "–".into(), guaranteed_rate: None, ..row };
    } else if case.disturbances.open {
        add(&mut row.value, "whether a limit is reached, the flight will tell");
    }
    row
}

/// Appends to a cell of the table.
fn add(cell: &mut String, words: &str) {
    if cell.is_empty() || cell == "–" {
        *cell = words.to_string();
    } else {
        cell.push_str("; ");
        cell.push_str(words);
    }
}

/// When v_L changes for the last time, if it does under way.
pub(super) fn last_step(mission: &Mission) -> Option<Time> {
    let mut steps =
        mission.speed.steps().windows(2).filter(|pair| pair[0].speed != pair[1].speed).map(|pair| pair[1].at);
    steps.rfind(|at| (Time::ZERO..mission.end).contains(at) && *at > Time::ZERO)
}
