//! Theory beside measurement: the conditions of the statements that speak about a mission, and what they promise.

use common::graph::Graph;
use common::graph::measure::Connectivity;
use common::graph::spectrum;
use common::mission::file::{Between, FollowingChoice, FollowingType, LawChoice};
use common::mission::{Delay, Mission};
use common::theory::delay::{self, DelayGains};
use common::theory::theorem_4_4::Coordination;
use common::theory::{Gains, event_triggered, known_delay, theorem_4_5};
use common::time::{Span, Time};

use crate::results::{Summary, TheoryRow};

/// Changes of a switching signal looked at when its graphs are collected.
const MOST_CHANGES: usize = 20_000;

/// A guaranteed decay of the coordination error: ‖e(t)‖ ≤ factor · exp(−rate t) ‖e(0)‖.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarantee {
    /// Rate of the norm \[1/s\].
    pub rate: f64,
    /// Factor, where it is known.
    pub factor: Option<f64>,
}

/// What theory needs to know of the planned network.
struct Network {
    graph: Graph,
    planned: Connectivity,
    /// The graphs that occur.
    graphs: Vec<Graph>,
    /// Share of the time that each directed link is up.
    up: Vec<f64>,
    /// Without delay and loss, and all is said that there is, so that it is heard at once.
    immediate: bool,
}

impl Network {
    fn of(mission: &Mission) -> Network {
        let n = mission.vehicles.len();
        let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
        let mut signal = mission.switching.clone();
        let mut graphs: Vec<Graph> = Vec::new();
        let mut up = vec![0.0; arcs.len()];
        let mut t = Time::ZERO;
        for _ in 0..MOST_CHANGES {
            let present: Vec<usize> = (0..arcs.len()).filter(|&link| signal.is_up(link, t)).collect();
            let next = signal.next_change_after(t).unwrap_or(mission.end).min(mission.end);
            for &link in &present {
                up[link] += (next - t).secs() / mission.end.secs();
            }
            let graph = Graph::from_arcs(n, &present.iter().map(|&link| arcs[link]).collect::<Vec<_>>());
            if !graphs.contains(&graph) {
                graphs.push(graph);
            }
            t = next;
            if t >= mission.end {
                break;
            }
        }
        Network {
            graph: mission.graph(),
            planned: Connectivity::planned(mission.switching.clone(), n, &arcs, mission.end),
            graphs,
            up,
            immediate: mission.talk.is_none()
                && mission.links.iter().all(|l| l.delay == Delay::Constant(Span::ZERO) && l.loss == 0.0),
        }
    }

    fn alpha(&self) -> f64 {
        self.planned.loss_fraction()
    }

    fn t_0(&self) -> Option<Span> {
        (self.alpha() < 1.0).then(|| self.planned.t_0(self.alpha()))
    }
}

/// What theory guarantees for the coordination error of this mission, if it speaks about it.
pub fn guarantee(mission: &Mission) -> Option<Guarantee> {
    guarantee_over(mission, &Network::of(mission))
}

fn guarantee_over(mission: &Mission, network: &Network) -> Option<Guarantee> {
    if !network.immediate {
        return None;
    }
    match &mission.law_choice {
        // Lemma 1.1 with e' = −(a_1(t) + a_2(t)) e, where a_i(t) is the gain while vehicle i hears the other.
        LawChoice::Introduction(law) => {
            let rate = law.gain * network.up.iter().sum::<f64>();
            (rate > 0.0).then_some(Guarantee { rate, factor: None })
        }
        LawChoice::Switching(law) if moves_as_told(mission) => {
            let coordination = coordination(mission, network, law.gain)?;
            let factor = network.t_0().map(|t_0| coordination.overshoot(t_0));
            Some(Guarantee { rate: coordination.rate_of_agreement(), factor }).filter(|g| g.rate > 0.0)
        }
        _ => None,
    }
}

fn coordination(mission: &Mission, network: &Network, gain: f64) -> Option<Coordination> {
    Coordination::new(&network.graphs, &vec![gain; mission.vehicles.len()], network.alpha())
}

/// Whether the virtual targets move at exactly the rate the law asks for (path following of type II, η = 0).
fn moves_as_told(mission: &Mission) -> bool {
    mission
        .vehicles
        .iter()
        .all(|v| matches!(&v.following, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::II))
}

/// Conditions and predictions before a flight, for `check`; with the measured values after it.
pub fn rows(mission: &Mission, summary: Option<&Summary>) -> Vec<TheoryRow> {
    let network = Network::of(mission);
    let mut rows = vec![graph_row(&network)];
    if mission.vehicles.len() > 1 {
        rows.push(losses_row(&network, summary));
        rows.push(mean_row(&network));
        rows.extend(law_rows(mission, &network, summary));
        rows.extend(talk_row(mission, &network, summary));
    }
    rows.push(speed_row(mission, summary));
    rows.extend(bias_row(mission, summary));
    rows
}

fn measured(summary: Option<&Summary>, value: impl Fn(&Summary) -> String) -> String {
    summary.map_or_else(|| "–".to_string(), value)
}

fn fitted_rate(summary: Option<&Summary>) -> String {
    measured(summary, |s| s.fleet.coordination.fit.as_ref().map_or("–".into(), |fit| format!("{:.5} 1/s", fit.rate)))
}

fn graph_row(network: &Network) -> TheoryRow {
    let undirected = network.graph.is_undirected();
    let lambda_2 = if undirected { spectrum::lambda_2(&network.graph) } else { None };
    TheoryRow {
        name: "Graph of all links (section 3.1)".into(),
        condition: if undirected { "connected".into() } else { "has a globally reachable vertex".into() },
        holds: Some(network.graph.can_agree()),
        predicted: lambda_2.map_or_else(|| "agreement is possible".into(), |l| format!("λ₂ = {l:.4}")),
        measured: "–".into(),
    }
}

fn losses_row(network: &Network, summary: Option<&Summary>) -> TheoryRow {
    let t_0 = |t_0: Option<f64>| t_0.map_or("unbounded".to_string(), |t_0| format!("{t_0:.3} s"));
    TheoryRow {
        name: "Brief connectivity losses (Definition 4.3)".into(),
        condition: format!("α = {:.4} < 1", network.alpha()),
        holds: Some(network.alpha() < 1.0),
        predicted: format!("α = {:.4}, T₀ = {}", network.alpha(), t_0(network.t_0().map(Span::secs))),
        measured: measured(summary, |s| {
            let connectivity = s.fleet.connectivity.as_ref();
            connectivity.map_or("–".into(), |c| format!("α = {:.4}, T₀ = {}", c.alpha, t_0(c.t_0_s)))
        }),
    }
}

fn mean_row(network: &Network) -> TheoryRow {
    let window = network.planned.connected_in_mean();
    TheoryRow {
        name: "Uniformly connected in mean (Definition 4.4)".into(),
        condition: "every window of some length T connects all".into(),
        holds: Some(window.is_some()),
        predicted: window.map_or_else(|| "–".into(), |t| format!("T = {:.3} s", t.secs())),
        measured: "–".into(),
    }
}

/// What the statement behind the mission's law asks for and promises.
fn law_rows(mission: &Mission, network: &Network, summary: Option<&Summary>) -> Vec<TheoryRow> {
    let mut row = TheoryRow { measured: fitted_rate(summary), ..TheoryRow::default() };
    match &mission.law_choice {
        LawChoice::Introduction(_) => {
            row.name = "Rate of coordination (Lemma 1.1)".into();
            row.condition = "no delay and no loss but the switching".into();
            row.holds = Some(network.immediate);
            row.predicted =
                guarantee_over(mission, network).map_or("–".into(), |g| format!("{:.5} 1/s on the paths", g.rate));
        }
        LawChoice::Solution1(_) | LawChoice::Solution2(_) | LawChoice::Solution3(_) => {
            let fixed = network.graphs.len() == 1 && network.immediate;
            let saturated = matches!(mission.law_choice, LawChoice::Solution3(_));
            row.name = format!("Agreement (Proposition {})", if saturated { "3.5" } else { "3.4" });
            row.condition = "fixed two-way connected network, no delay, no loss".into();
            row.holds = Some(fixed && network.graph.is_undirected() && network.graph.is_connected());
            row.predicted = if saturated { "agreement".into() } else { "exponential agreement".into() };
        }
        LawChoice::Switching(law) => return switching_rows(mission, network, summary, law.gain),
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => {
            let tau = Span::from_secs(law.delay_s);
            let v_l = mission.speed.at(mission.end).v_l;
            let in_mean = network.planned.connected_in_mean().is_some();
            let verdict = delay::verdict(DelayGains::Averaged(law.gain), tau, v_l, in_mean);
            let always_heard = matches!(mission.law_choice, LawChoice::DelayedWithLosses(_)) || never_alone(network);
            let told = mission.links.iter().all(|link| told_truly(link.delay, law.delay_s) && link.loss == 0.0);
            row.name = verdict.name.into();
            row.condition = match mission.law_choice {
                LawChoice::Delayed(_) => {
                    format!("{}, every vehicle always hears someone, every message τ late", verdict.condition)
                }
                _ => format!("{}, every message τ late and none lost but by the switching", verdict.condition),
            };
            row.holds = Some(verdict.holds && always_heard && told);
            row.predicted = "exponential agreement, no rate".into();
        }
        LawChoice::DelayedEstimating(_) => {
            row.name = "Agreement at an estimated v_L* (after Lemma 4.5)".into();
            row.condition = "connected in mean, one constant delay, none lost but by the switching".into();
            let in_mean = network.planned.connected_in_mean().is_some();
            row.holds = Some(in_mean && common_delay(mission).is_some() && mission.links.iter().all(|l| l.loss == 0.0));
            row.predicted = "v_L* is the only rest of the estimate".into();
        }
        LawChoice::KnownDelay(law) => {
            // What was said lately is used until the next word: older by up to a message period and a control period.
            let held = mission.control_period * (mission.message_ticks + 1);
            let oldest = mission.links.iter().map(|link| greatest(link.delay)).max().unwrap_or(Span::ZERO) + held;
            let turn = known_delay::turn(&network.graph, law.gain, oldest);
            let quiet =
                network.graphs.len() == 1 && mission.talk.is_none() && mission.links.iter().all(|l| l.loss == 0.0);
            row.name = "Agreement with known delay".into();
            row.condition = "fixed two-way network, one delay τ for all links, kλ_max τ < π/2 = 1.571".into();
            let below = turn.is_some_and(|turn| turn < std::f64::consts::FRAC_PI_2);
            row.holds = Some(quiet && common_delay(mission).is_some() && below && network.graph.is_connected());
            row.predicted = turn.map_or("–".into(), |turn| format!("kλ_max τ = {turn:.3} with the oldest news"));
        }
    }
    vec![row]
}

fn switching_rows(mission: &Mission, network: &Network, summary: Option<&Summary>, gain: f64) -> Vec<TheoryRow> {
    let immediate = network.immediate && moves_as_told(mission);
    let speaks = |condition: &str| format!("{condition}; no delay, no loss, targets that move as told (type II)");
    let guarantee = guarantee_over(mission, network);
    let two_way = network.graph.is_undirected();
    let four = TheoryRow {
        name: "Rate of coordination (Theorem 4.4; rate of the norm)".into(),
        condition: speaks("two-way links, α < 1"),
        holds: Some(guarantee.is_some()),
        predicted: guarantee.map_or("–".into(), |g| format!("≥ {:.5} 1/s", g.rate)),
        measured: fitted_rate(summary),
    };
    let in_mean = network.planned.connected_in_mean();
    let dwell = network.planned.dwell().unwrap_or(mission.end - Time::ZERO);
    let proven = Gains::new(&vec![gain; mission.vehicles.len()])
        .zip(in_mean)
        .filter(|_| two_way && immediate)
        .and_then(|(gains, mean)| theorem_4_5::agreement(gains, mean, dwell));
    let five = TheoryRow {
        name: "Agreement (Theorem 4.5; the printed rate is no bound, this one is proven)".into(),
        condition: speaks("connected in mean"),
        holds: Some(in_mean.is_some() && immediate),
        predicted: proven.map_or("agreement, no rate".into(), |p| format!("≥ {:.5} 1/s", p.rate)),
        measured: fitted_rate(summary),
    };
    // One of the two is enough: the one that covers the mission is shown, both if both do.
    match (four.holds, five.holds) {
        (Some(true), Some(true)) => vec![four, five],
        (Some(true), _) => vec![four],
        (_, Some(true)) => vec![five],
        _ => vec![four],
    }
}

/// What event-triggered talk costs at most.
fn talk_row(mission: &Mission, network: &Network, summary: Option<&Summary>) -> Option<TheoryRow> {
    let trigger = mission.talk?;
    let LawChoice::Switching(law) = &mission.law_choice else { return None };
    let used = mission.control_period * (mission.message_ticks + 1) + trigger.least_silence();
    let slowest = mission.links.iter().map(|link| greatest(link.delay)).max().unwrap_or(Span::ZERO);
    let staleness = (used + slowest).secs();
    let bound = event_triggered::ultimate_bound(&network.graph, law.gain, trigger.floor(), staleness);
    let heard = network.graphs.len() == 1 && mission.links.iter().all(|link| link.loss == 0.0);
    Some(TheoryRow {
        name: "Coordination error left by event-triggered talk".into(),
        condition: "fixed two-way network, nothing lost, advance, a small gain, targets that move as told (type II)"
            .into(),
        holds: Some(bound.is_some() && heard && mission.between == Between::Advance && moves_as_told(mission)),
        predicted: bound.map_or("no bound".into(), |b| format!("two vehicles at most {:.4} apart", 2f64.sqrt() * b)),
        measured: measured(summary, |s| format!("{:.4} in the steady part", s.fleet.coordination.steady_rms)),
    })
}

/// The delay that all messages on all links have, if they have.
fn common_delay(mission: &Mission) -> Option<Span> {
    let first = mission.links.first()?.delay.least();
    mission.links.iter().all(|link| link.delay == Delay::Constant(first)).then_some(first)
}

fn greatest(delay: Delay) -> Span {
    match delay {
        Delay::Constant(delay) | Delay::Uniform(_, delay) => delay,
    }
}

/// The speed at which the fleet will travel, as a part of v_L, if theory knows it.
pub fn speed_factor(mission: &Mission) -> Option<f64> {
    match &mission.law_choice {
        LawChoice::DelayedEstimating(law) => common_delay(mission).map(|tau| delay::steady_speed(1.0, law.gain, tau)),
        _ => Some(mission.nominal_factor()),
    }
}

/// Whether every vehicle has a neighbour at all times.
fn never_alone(network: &Network) -> bool {
    network.graphs.iter().all(|graph| (0..graph.len()).all(|i| graph.degree(i) > 0))
}

/// Whether the law was told the delay that the link has.
fn told_truly(delay: Delay, tau: f64) -> bool {
    delay == Delay::Constant(Span::from_secs(tau))
}

fn speed_row(mission: &Mission, summary: Option<&Summary>) -> TheoryRow {
    let v_l = mission.speed.at(mission.end).v_l;
    let (name, condition) = match mission.law_delay() {
        Some(tau) => ("Fleet speed v_L* = v_L/(1 + kτ) (after Lemma 4.4)", format!("every message τ = {tau} s late")),
        None => ("Fleet speed v_L", "the vehicles agree".to_string()),
    };
    TheoryRow {
        name: name.into(),
        condition,
        holds: mission.law_delay().map(|tau| mission.links.iter().all(|link| told_truly(link.delay, tau))),
        predicted: speed_factor(mission).map_or("–".into(), |factor| format!("{:.5} 1/s", factor * v_l)),
        measured: measured(summary, |s| format!("{:.5} 1/s", s.fleet.steady_speed)),
    }
}

fn bias_row(mission: &Mission, summary: Option<&Summary>) -> Option<TheoryRow> {
    let first = (0..mission.vehicles.len()).find(|&i| mission.predicted_along_bias(i).is_some())?;
    let bias = mission.predicted_along_bias(first)?;
    Some(TheoryRow {
        name: "Along-path bias left by δ (Theorem 4.7, erratum 4.12)".into(),
        condition: "δ₁ < 0, the matrix B keeps its rank".into(),
        holds: Some(true),
        predicted: format!("{bias:.3} m"),
        measured: measured(summary, |s| {
            s.vehicles.get(first).map_or("–".into(), |v| format!("{:.3} m", v.along_mean_m))
        }),
    })
}
