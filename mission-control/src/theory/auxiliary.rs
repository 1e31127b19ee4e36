//! Auxiliary state: Theorems 4.8 and 4.9.

use common::graph::Graph;
use common::mission::file::Auxiliary;
use common::mission::{Mission, VehiclePlan};
use common::theory::lemma_4_6::Dynamic;
use common::theory::theorem_4_8::{Coupled, OnALine};
use common::time::Time;

use super::fleet::{excused, v_l_at_the_end};
use super::surroundings::{last_step, on_lines};
use super::switching::moves_as_told;
use super::{Case, Guarantee, mode_words};
use crate::results::{BELOW, Summary, TheoryRow};

/// The part of the slowest root at which a bound on the transient is shown.
const BELOW_THE_ROOT: f64 = 0.9;

fn dynamic(case: &Case<'_>, law: &Auxiliary) -> Option<Dynamic> {
    Dynamic::new(law.a1, law.a2, &case.network.graphs)
}

/// Lemma 4.7 with the best solution of (4.65): z starts at zero, so that the norm of x_c starts as that of θ.
pub(super) fn guarantee(case: &Case<'_>, law: &Auxiliary) -> Option<Guarantee> {
    if !case.network.immediate || !moves_as_told(case.mission) {
        return None;
    }
    let (alpha, best) = (case.network.alpha(), dynamic(case, law)?.best(case.network.alpha())?);
    let factor = case.network.t_0().map(|t_0| best.overshoot(alpha, t_0));
    Some(Guarantee { rate: 0.5 * best.rate_of_v(alpha), factor }).filter(|guarantee| guarantee.rate > 0.0)
}

/// (4.59)–(4.61): Theorem 4.8. Into a ball from everywhere, and on lines to zero.
pub(super) fn rows_fixed(case: &Case<'_>, law: &Auxiliary) -> Vec<TheoryRow> {
    let mut rows = vec![into_a_ball(case, law)];
    if on_lines(case.mission) {
        // Who lacks what it asks for still has the theorem.
        rows.push(excused(to_zero(case, law), &rows));
    }
    rows
}

/// What is in the way of a network as the theorem has it.
fn network_lacks(case: &Case<'_>) -> Vec<&'static str> {
    let graph = &case.network.graph;
    let lacks = [
        (graph.is_undirected() && graph.is_connected(), "one-way links, or not connected"),
        (case.network.is_fixed(), "changes, delays or loses"),
    ];
    lacks.into_iter().filter(|(met, _)| !met).map(|(_, lack)| lack).collect()
}

/// α₂ does not vanish while δ ≠ 0: what the theorem promises is the way into a ball.
fn into_a_ball(case: &Case<'_>, law: &Auxiliary) -> TheoryRow {
    let graph = &case.network.graph;
    let lacks = network_lacks(case);
    let ball = Ball::of(case, law).filter(|_| lacks.is_empty());
    let last = |s: &Summary| s.fleet.coordination.series.norm.last().copied();
    // A vehicle that comes back begins anew.
    let whole = case.summary.filter(|s| s.fleet.absences.is_empty());
    let share = whole.and_then(|s| ball.as_ref()?.share(graph, s));
    let measured = case.measured(|s| {
        let last = last(s).map_or(String::new(), |last| format!("; ‖e‖ = {last:.3e} at the end"));
        let share = share.map_or(String::new(), |share| match share <= 1.0 {
            true => format!("; at most {:.0} % of the bound", 100.0 * share),
            false => format!("; {share:.2} times the bound: {BELOW}"),
        });
        format!("{}{last}{share}", case.fitted_rate())
    });
    TheoryRow {
        name: "Agreement into a ball set by δ (Theorem 4.8, result xii)".into(),
        condition: "fixed two-way connected network, no delay, no loss".into(),
        value: match &ball {
            Some(ball) => format!("two-way, connected, fixed; |δ| = {:.3} m/s", ball.delta),
            None => lacks.join("; "),
        },
        holds: Some(ball.is_some()),
        predicted: ball.and_then(|ball| ball.words(graph, dynamic(case, law)?.rate_on(graph)?)).unwrap_or("–".into()),
        guaranteed_rate: None,
        measured,
    }
}

/// What Theorem 4.8 knows of a mission.
struct Ball {
    fleet: Coupled,
    /// |δ| of all vehicles together.
    delta: f64,
    /// The sum of m_11δ_1²/k_e.
    pushed: f64,
    /// |x| at the start; `None` if v_L steps, for what is said is said of the time after.
    start: Option<f64>,
}

impl Ball {
    fn of(case: &Case<'_>, law: &Auxiliary) -> Option<Ball> {
        let mission = case.mission;
        let all = 0..mission.vehicles.len();
        let vehicles: Vec<_> = all.clone().map(|i| mission.underactuated(i)).collect::<Option<_>>()?;
        let (mut delta, mut pushed, mut start) = (0.0, 0.0, 0.0);
        for i in all {
            let (gains, auv) = mission.theorem_47(i)?;
            delta += gains.delta1.powi(2);
            pushed += auv.parameters().mass.x * gains.delta1.powi(2) / gains.k_e;
            start += 2.0 * mission.lyapunov_at_start(i)?;
        }
        let of = |plan: &VehiclePlan| plan.start.xi - plan.pattern.at(Time::ZERO).h;
        let gamma = mission.vehicles.iter().map(of).collect::<Vec<f64>>();
        // γ'Lγ, link by link.
        start += case.network.graph.arcs().map(|(i, j)| 0.5 * (gamma[i] - gamma[j]).powi(2)).sum::<f64>();
        let steady = last_step(mission).is_none() && v_l_at_the_end(case) == mission.speed.at(Time::ZERO).v_l;
        let start = Some(start.sqrt()).filter(|_| steady);
        Some(Ball { fleet: Coupled::new(law.a1, law.a2, &vehicles)?, delta: f64::sqrt(delta), pushed, start })
    }

    /// `alone` is the rate that ‖e‖ would have with α₂ = 0.
    fn words(&self, graph: &Graph, alone: f64) -> Option<String> {
        let (rate, end) = (self.fleet.rate(graph)?, self.fleet.apart_in_the_end(graph, self.pushed)?);
        let bound = match self.start.and_then(|start| self.fleet.apart_after(graph, self.delta, start, 0.0)) {
            Some(at_first) => format!("‖e‖ ≤ {at_first:.1} at first and {end:.3} in the end"),
            None => format!("‖e‖ ≤ {end:.3} in the end"),
        };
        Some(format!(
            "all errors together decay at ≥ {rate:.5} 1/s into a ball, {bound}; with α₂ = 0 ‖e‖ would at {alone:.5} 1/s"
        ))
    }

    /// The largest part of its bound that ‖e‖ reached.
    fn share(&self, graph: &Graph, summary: &Summary) -> Option<f64> {
        let series = &summary.fleet.coordination.series;
        let part = |(t, norm): (&f64, &f64)| Some(norm / self.fleet.apart_after(graph, self.delta, self.start?, *t)?);
        let parts: Option<Vec<f64>> = series.t_s.iter().zip(&series.norm).map(part).collect();
        parts?.into_iter().max_by(f64::total_cmp)
    }
}

/// Vehicles that are alike, on straight lines and along them: δ acts on their mean only.
fn to_zero(case: &Case<'_>, law: &Auxiliary) -> TheoryRow {
    let mission = case.mission;
    let each: Option<Vec<(OnALine, f64)>> = (0..mission.vehicles.len()).map(|i| on_a_line(mission, i)).collect();
    let one = each.as_ref().and_then(|each| each.first()).copied();
    let alike = each.as_ref().is_some_and(|each| each.windows(2).all(|pair| same(&pair[0], &pair[1])));
    let along = (0..mission.vehicles.len()).all(|i| mission.starts_along_its_path(i));
    let mut lacks = network_lacks(case);
    lacks.extend((!alike).then_some("vehicles, gains or |p'| that differ"));
    lacks.extend(
        (!along).then_some("not all start on their lines and point along them: how hulls turn is not in the statement"),
    );
    let met = one.filter(|_| lacks.is_empty());
    let slowest = met.and_then(|(line, _)| line.slowest(law.a1, law.a2, &case.network.graph));
    TheoryRow {
        name: "Agreement of equal vehicles on straight lines, whatever δ (Theorem 4.8, result xii)".into(),
        condition: "the same; equal vehicles, gains and |p'|, each starts on its line and along it".into(),
        value: if lacks.is_empty() { "equal, along their lines".into() } else { lacks.join("; ") },
        holds: Some(slowest.is_some()),
        predicted: slowest.map_or("–".into(), |slowest| {
            let rate = match slowest {
                (rate, 1) => format!("‖e‖ decays at ≥ {rate:.5} 1/s"),
                several => mode_words(several),
            };
            // At the root itself there need be no bound.
            let below = BELOW_THE_ROOT * slowest.0;
            let factor = met.and_then(|(line, _)| line.overshoot(law.a1, law.a2, &case.network.graph, below));
            factor.map_or(rate.clone(), |factor| {
                format!("{rate}; with those of path following, less their means, errors stay below {factor:.2} e^(−{below:.5} t) times their start")
            })
        }),
        guaranteed_rate: slowest.filter(|(_, times)| *times == 1).map(|(rate, _)| rate),
        measured: case.fitted_rate(),
    }
}

/// Whether two vehicles move alike along their lines, but for rounding.
fn same((a, delta_a): &(OnALine, f64), (b, delta_b): &(OnALine, f64)) -> bool {
    let stretch = (a.stretch - b.stretch).abs() <= 1e-9 * a.stretch;
    stretch && OnALine { stretch: a.stretch, ..*b } == *a && delta_a == delta_b
}

/// What moves a vehicle along a line, and its δ₁.
fn on_a_line(mission: &Mission, vehicle: usize) -> Option<(OnALine, f64)> {
    let (gains, auv) = mission.theorem_47(vehicle)?;
    let plan = mission.vehicles.get(vehicle)?;
    let stretch = plan.path.at(plan.start.xi).r();
    Some((OnALine { mass: auv.parameters().mass.x, k_e: gains.k_e, k_phi: gains.k_phi, stretch }, gains.delta1))
}

/// (4.62): Theorem 4.9.
pub(super) fn rows_switching(case: &Case<'_>, law: &Auxiliary) -> Vec<TheoryRow> {
    let guaranteed = guarantee(case, law);
    let Some(dynamic) = dynamic(case, law) else {
        return vec![TheoryRow {
            name: "Lemma 4.7 (Theorem 4.9)".into(),
            condition: "two-way links that connect the fleet at times".into(),
            value: "one-way links, or never connected".into(),
            holds: Some(false),
            predicted: "–".into(),
            measured: case.fitted_rate(),
            ..TheoryRow::default()
        }];
    };
    let row = case.row(dynamic.verdict(case.network.alpha()));
    let obstacle = match (case.network.immediate, moves_as_told(case.mission)) {
        (true, true) => "",
        (false, _) => "; messages are late or lost",
        (true, false) => "; targets do not move just as told",
    };
    let printed = dynamic.printed();
    let closed_form = TheoryRow {
        name: "Lemma 4.6 with the X of (4.66) (errata 4.19, 4.20)".into(),
        condition: "that X satisfies (4.65)".into(),
        value: format!("λ_c = {:.4}, λ_d = {:.4}", printed.lambda_c, printed.lambda_d),
        holds: None,
        predicted: if dynamic.printed_holds() {
            format!("bears α < {:.4}", printed.alpha_limit())
        } else {
            "nothing: it does not satisfy (4.65) with these gains".into()
        },
        measured: "–".into(),
        ..TheoryRow::default()
    };
    vec![
        TheoryRow {
            condition: format!("two-way links, all that is said is heard at once; {}", row.condition),
            value: format!("{}{obstacle}", row.value),
            holds: Some(guaranteed.is_some()),
            predicted: guaranteed.map_or("–".into(), |g| format!("‖e‖ decays at ≥ {:.5} 1/s", g.rate)),
            guaranteed_rate: guaranteed.map(|g| g.rate),
            ..row
        },
        closed_form,
    ]
}
