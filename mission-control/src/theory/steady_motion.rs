//! What δ leaves of a mission in the end: the rate of the targets, the bias of every vehicle, and how far apart unequal vehicles stay.
//!
//! The mathematics is `common::theory::steady_motion`; here is what it needs of a mission, and where it has no answer and why.

use common::mission::Mission;
use common::mission::file::{FollowingChoice, FollowingType, LawChoice};
use common::theory::steady_motion::{Settling, SteadyMotion, alike, steady_motion};
use common::time::Span;

use super::Case;
use super::fleet::{rate_in_the_end, v_l_at_the_end};
use super::late_news::as_the_law_takes_them;
use super::talk::common_delay;
use crate::results::{TheoryRow, VehicleSummary};

/// Biases that differ by less are shown as one \[m\].
const SAME_BIAS: f64 = 5e-4;

/// Whether some target's rate depends on α_2: under (4.59), or of type I (4.53). δ then keeps it from what it was told (erratum 4.14).
pub(super) fn is_excited(mission: &Mission) -> bool {
    matches!(mission.law_choice, LawChoice::Auxiliary(_)) || (0..mission.vehicles.len()).any(|i| is_type_1(mission, i))
}

fn is_type_1(mission: &Mission, vehicle: usize) -> bool {
    let following = &mission.vehicles[vehicle].following;
    matches!(following, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::I)
}

/// The steady motion of a fleet whose targets depend on α_2.
///
/// # Errors
/// Why there is none, or why it cannot be told from the mission.
pub(super) fn motion(case: &Case<'_>, v_l: f64) -> Result<SteadyMotion, String> {
    let Case { mission, network, way, .. } = case;
    if way.constant().is_none() {
        return Err("|p'| changes on the way, and α₂ with it: there is no steady rate".into());
    }
    as_the_law_takes_them(case)?;
    let lag = match &mission.law_choice {
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => law.gain * law.delay_s,
        LawChoice::DelayedEstimating(law) => law.gain * common_delay(mission).map_or(0.0, Span::secs),
        _ => 0.0,
    };
    let vehicles: Option<Vec<Settling>> = (0..mission.vehicles.len()).map(|i| settling(case, i, v_l)).collect();
    let vehicles = vehicles.ok_or("no statement about the steady rate of targets with α₂ under this law")?;
    // Vehicles that are alike agree, and who agrees does not mind who is heard; but who hears late goes at another rate when alone.
    let fixed = network.graphs.len() == 1 && mission.loses_by_switching_only() && case.dropped.is_none();
    if !fixed && (lag != 0.0 || !alike(&vehicles)) {
        return Err("the network changes, and with it what late or unequal vehicles are asked for".into());
    }
    steady_motion(&vehicles, &network.graph, v_l, mission.nominal_factor() * v_l, lag)
        .ok_or_else(|| "nobody is heard by all".to_string())
}

/// Which way hulls point along their paths: 1 if as the path goes, −1 if v_L sends them back along it. δ₁ < 0 turns every hull to where
/// its target goes, and p' is ±|p'| in its axes.
fn heading(v_l: f64) -> f64 {
    if v_l < 0.0 { -1.0 } else { 1.0 }
}

/// How a vehicle settles under the mission's law.
fn settling(case: &Case<'_>, vehicle: usize, v_l: f64) -> Option<Settling> {
    let Case { mission, network, .. } = case;
    let (gains, auv) = mission.theorem_47(vehicle)?;
    let plan = mission.vehicles.get(vehicle)?;
    let stretch = heading(v_l) * plan.path.at(plan.start.xi).r();
    let [a_0, at_one] = [0.0, 1.0].map(|x| gains.steady_alpha_2(&auv, x, stretch));
    let of_type = if is_type_1(mission, vehicle) { gains.k_eta } else { f64::INFINITY };
    let shared = |gain: f64| gain / network.graph.degree(vehicle) as f64;
    let (kappa, gain) = match &mission.law_choice {
        LawChoice::Auxiliary(law) => {
            let kappa = law.a1 * (law.a1 + law.a2) / law.a2;
            (kappa, kappa.recip())
        }
        LawChoice::Switching(_) => (of_type, *mission.gains("gain").get(vehicle)?),
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => (of_type, shared(law.gain)),
        LawChoice::DelayedEstimating(law) => (of_type, shared(law.gain)),
        LawChoice::KnownDelay(law) => (of_type, law.gain),
        _ => return None,
    };
    Some(Settling { alpha_2: [a_0, at_one - a_0], kappa, gain })
}

/// The along-path error in which each vehicle ends \[m\]; `None` for vehicles without δ.
///
/// # Errors
/// Why none can be told.
pub(super) fn biases(case: &Case<'_>, v_l: f64) -> Result<Vec<Option<f64>>, String> {
    let mission = case.mission;
    if v_l == 0.0 {
        return Err("v_L = 0, and hulls may point anywhere".into());
    }
    let rate = rate_in_the_end(case, v_l)?;
    let surplus = rate - mission.nominal_factor() * v_l;
    if surplus.abs() > 1e-9 * v_l.abs() && case.way.constant().is_none() {
        return Err("|p'| changes on the way, and targets do not go at v_n".into());
    }
    let of = |(i, plan): (usize, &common::mission::VehiclePlan)| {
        let (gains, auv) = mission.theorem_47(i)?;
        let stretch = heading(v_l) * plan.path.at(plan.start.xi).r();
        Some(heading(v_l) * gains.predicted_bias_at(&auv, surplus * stretch))
    };
    Ok(mission.vehicles.iter().enumerate().map(of).collect())
}

/// What theory says of the along-path errors of an undisturbed mission, vehicle by vehicle.
pub fn predicted_biases(mission: &Mission, v_l: f64) -> Vec<Option<f64>> {
    let case = Case::new(mission, None);
    let known = if has_rank(mission) { biases(&case, v_l).ok() } else { None };
    known.filter(|_| case.disturbances.is_empty()).unwrap_or_else(|| vec![None; mission.vehicles.len()])
}

/// |δ₁| and what it must exceed, of the vehicle for which that is tightest.
fn tightest_margin(mission: &Mission) -> Option<(f64, f64)> {
    let margins = (0..mission.vehicles.len()).filter_map(|i| mission.rank_margin(i));
    margins.min_by(|(a, b), (c, d)| (a - b).total_cmp(&(c - d)))
}

fn has_rank(mission: &Mission) -> bool {
    tightest_margin(mission).is_some_and(|(size, least)| size > least)
}

/// The bias of every vehicle that has one.
pub(super) fn bias(case: &Case<'_>) -> Option<TheoryRow> {
    let mission = case.mission;
    let (size, least) = tightest_margin(mission)?;
    let v_l = v_l_at_the_end(case);
    let known = biases(case, v_l);
    let holds = known.is_ok() && case.disturbances.is_empty() && size > least;
    let mut value = format!("|δ₁| = {size} > {least:.4} m/s");
    match (&known, rate_in_the_end(case, v_l)) {
        (Err(why), _) => value += &format!("; not predicted: {why}"),
        (Ok(_), Ok(rate)) => {
            let surplus = rate - mission.nominal_factor() * v_l;
            if surplus.abs() > 1e-9 * v_l.abs() {
                value += &format!("; γ̇ − v_n = {surplus:.5} 1/s (results iv, v)");
            }
        }
        _ => {}
    }
    if !case.disturbances.is_empty() {
        value += "; disturbed";
    }
    let ids = || mission.vehicles.iter().map(|plan| plan.id.as_str());
    let predicted: Vec<Option<f64>> = known.unwrap_or_default();
    let measured = |s: &crate::results::Summary| {
        let is_measured = |vehicle: &&VehicleSummary| vehicle.rows > 0;
        let of = |id: &str| s.vehicles.iter().filter(is_measured).find(|vehicle| vehicle.id == id);
        let of = |id: &str| of(id).map(|vehicle| vehicle.along_mean_m);
        let with_delta = |i: usize, id| mission.rank_margin(i).and_then(|_| of(id));
        words(ids().enumerate().map(|(i, id)| (id, with_delta(i, id))))
    };
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, |δ₁| > |v_n| |p'| max|m_ii − m₁₁|/m₁₁, so that the matrix B keeps its rank; a known rate of the targets; undisturbed"
            .into(),
        value,
        holds: Some(holds),
        predicted: if holds { words(ids().zip(predicted)) } else { "–".into() },
        measured: case.measured(measured),
        ..TheoryRow::default()
    })
}

/// One number if all have the same, else each with its name.
fn words<'a>(of: impl Iterator<Item = (&'a str, Option<f64>)>) -> String {
    let known: Vec<(&str, f64)> = of.filter_map(|(id, value)| Some((id, value?))).collect();
    let Some((_, first)) = known.first() else { return "–".into() };
    if known.iter().all(|(_, value)| (value - first).abs() < SAME_BIAS) {
        return format!("{first:.3} m");
    }
    let each: Vec<String> = known.iter().map(|(id, value)| format!("{id} {value:.3} m")).collect();
    each.join(", ")
}

/// How far apart vehicles that are not alike stay, if α_2 reaches their targets.
pub(super) fn apart(case: &Case<'_>) -> Option<TheoryRow> {
    let mission = case.mission;
    let v_l = v_l_at_the_end(case);
    let vehicles: Vec<Settling> = (0..mission.vehicles.len()).map(|i| settling(case, i, v_l)).collect::<Option<_>>()?;
    if !is_excited(mission) || alike(&vehicles) {
        return None;
    }
    let found = motion(case, v_l).ok().filter(|_| case.disturbances.is_empty());
    let spread = |apart: &[f64]| {
        let (least, most) = apart.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        most - least
    };
    let why = motion(case, v_l).err();
    Some(TheoryRow {
        name: "Coordination error that unequal vehicles leave (result xiii)".into(),
        condition: "a fixed network, |p'| constant, v_L constant, undisturbed".into(),
        value: match (&found, why) {
            (Some(_), _) => "α₂ differs from vehicle to vehicle".into(),
            (None, Some(why)) => why,
            (None, None) => "disturbed".into(),
        },
        holds: Some(found.is_some()),
        predicted: found.map_or("–".into(), |motion| format!("{:.4} apart", spread(&motion.apart))),
        measured: case.measured(|s| format!("{:.4} apart at the end", s.fleet.coordination.last)),
        ..TheoryRow::default()
    })
}
