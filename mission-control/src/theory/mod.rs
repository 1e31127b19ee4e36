//! Theory beside measurement: the conditions of the statements that speak about a mission, and what they promise.
//!
//! Each family of laws has a file with two functions of a `Case`: `rows`, the statements behind its laws, and
//! `guarantee`, the decay of the coordination error that they promise. A new law needs a line in `law_rows`, and one in
//! `guarantee_of` if there is a rate.
//!
//! | what | source | file |
//! |---|---|---|
//! | what statements ask for beyond their network | – | `surroundings.rs` |
//! | graph, losses, speed: said of every mission | sections 3.1, 4.2 | `fleet.rs` |
//! | rate, bias and distances that δ leaves | Theorem 4.7, results iv, v, xiii | `steady_motion.rs` |
//! | matrices of the graph, all graphs that can be | section 3.1, Lemma 4.1 | `graph.rs` |
//! | two vehicles on lines | Lemma 1.1 | `introduction.rs` |
//! | learned speeds: leader, gateway, row | sections 2.2 to 2.4 | `learned_speeds.rs` |
//! | solutions I to III | Propositions 3.4, 3.5 | `solutions.rs` |
//! | path following with coordination | Propositions 3.1–3.3, 3.8, 3.9, Table 3.1 | `together.rs` |
//! | weighted links, moving pattern | Remark 3.10, section 3.3.3 | `weights_and_patterns.rs` |
//! | one-way links, one told vehicle | Propositions 3.6, 3.7, Remark 3.13 | `directed.rs` |
//! | auxiliary state | Theorems 4.8, 4.9 | `auxiliary.rs` |
//! | switching networks | Theorems 4.4, 4.5 | `switching.rs` |
//! | late information | Lemmas 4.4, 4.5 | `delayed.rs` |
//! | whether news are as late as a law takes them to be | section 4.4 | `late_news.rs` |
//! | known and estimated delays, talk by event | docs/talking.md | `talk.rs` |
//! | what those of chapter 4 take for granted | sections 4.1, 4.4 | `premises.rs` |
//! | the run as flown | Theorems 4.4, 4.5, Lemmas 4.4–4.7 | `watched.rs` |
//! | the run so far | the same | `so_far.rs` |
//! | curves that need no run | Figure 2.8 and others | [`figures()`] |
//!
//! The mathematics is in `common::theory`; here is only which statement speaks of which mission, and in which words.

mod auxiliary;
mod delayed;
mod directed;
mod figures;
mod fleet;
mod graph;
mod introduction;
mod late_news;
mod learned_speeds;
mod network;
mod premises;
mod so_far;
mod solutions;
mod steady_motion;
mod surroundings;
mod switching;
mod talk;
#[cfg(test)]
mod testing;
mod together;
mod watched;
mod weights_and_patterns;

use common::mission::file::LawChoice;
use common::mission::{Mission, SpeedProfile};
use common::theory::Verdict;
use common::theory::linear_coordination::{Late, Law};
use common::theory::monitor::Premise;

pub use figures::figures;
pub use fleet::{lost_its_rate, predicted_speed};
pub use graph::graph_facts;
pub use so_far::{SoFar, so_far};
pub use steady_motion::predicted_biases;
pub use talk::speed_factor;
pub use watched::{envelope_over, guarantee_of_flight};

use crate::results::{BELOW, FIT_PART, Summary, TheoryRow};
use network::Network;
use surroundings::{Disturbances, Way, undisturbed};

/// A guaranteed decay of the coordination error: ‖e(t)‖ ≤ factor · exp(−rate t) ‖e(0)‖.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarantee {
    /// Rate of the norm \[1/s\].
    pub rate: f64,
    /// Factor, where it is known.
    pub factor: Option<f64>,
}

/// A mission as the statements see it: before a flight, or after it with what was measured.
struct Case<'a> {
    mission: &'a Mission,
    network: Network,
    summary: Option<&'a Summary>,
    way: Way,
    disturbances: Disturbances,
    /// The premise that messages which were dropped in the flight, and not for links that were down, do not meet.
    dropped: Option<Premise>,
}

impl<'a> Case<'a> {
    fn new(mission: &'a Mission, summary: Option<&'a Summary>) -> Case<'a> {
        let (way, disturbances) = (Way::of(mission), Disturbances::of(mission, summary));
        let counts = summary.map(|summary| summary.fleet.messages.counts);
        let dropped = counts.and_then(|counts| premises::dropped(mission, counts.sent, |fate| counts.met(fate)));
        Case { mission, network: Network::of(mission), summary, way, disturbances, dropped }
    }

    /// The formation speed as flown; before a flight, as planned.
    fn speed(&self) -> SpeedProfile {
        flown_speed(self.mission, self.summary)
    }

    /// A measured value in words, or a dash before the flight and if nothing was recorded.
    fn measured(&self, value: impl Fn(&Summary) -> String) -> String {
        let has_rows = |summary: &&Summary| summary.vehicles.iter().any(|vehicle| vehicle.rows > 0);
        self.summary.filter(has_rows).map_or_else(|| "–".to_string(), value)
    }

    /// The row of a statement about how the fleet agrees.
    fn row(&self, verdict: Verdict) -> TheoryRow {
        TheoryRow {
            name: verdict.name.into(),
            condition: verdict.condition,
            value: verdict.value,
            holds: Some(verdict.holds),
            predicted: match (verdict.norm_rate, verdict.holds) {
                (Some(rate), true) => format!("‖e‖ decays at ≥ {rate:.5} 1/s"),
                (None, true) => "agreement, no rate".into(),
                (_, false) => "–".into(),
            },
            guaranteed_rate: verdict.norm_rate.filter(|_| verdict.holds),
            measured: self.fitted_rate(),
        }
    }

    /// The measured rate of coordination.
    fn fitted_rate(&self) -> String {
        self.measured(|s| match &s.fleet.coordination.fit {
            Some(fit) if fit.on_paths => format!("{:.5} 1/s", fit.rate),
            Some(fit) => format!("{:.5} 1/s on the way to the paths: d lasts as long as e", fit.rate),
            None => "–".into(),
        })
    }

    /// Says so where the measured rate is below what the row guarantees, although its conditions hold.
    ///
    /// Rates are those of laws in continuous time. A law that is held for a control period acts half of that late, and what neighbours
    /// say another period: what is left of the rate then is what a flight can show.
    fn judged(&self, row: TheoryRow) -> TheoryRow {
        let fit = self.summary.and_then(|s| s.fleet.coordination.fit).filter(|fit| fit.on_paths);
        let (Some(fit), Some(guaranteed), Some(true)) = (fit, row.guaranteed_rate, row.holds) else { return row };
        let least = |rate: f64| (1.0 - FIT_PART) * rate;
        if fit.rate >= least(guaranteed) {
            return row;
        }
        let measured = match self.held_rate().filter(|held| fit.rate >= least(*held)) {
            Some(held) => {
                let period = self.mission.control_period;
                format!("{}; held for {period} the law reaches {held:.5} 1/s", row.measured)
            }
            None => format!("{}: {BELOW}", row.measured),
        };
        TheoryRow { measured, ..row }
    }

    /// What is left of the rate of a law that is held for a control period, where that is known.
    fn held_rate(&self) -> Option<f64> {
        solutions::late_rate(self, Late::held(self.mission.control_period.secs()))
    }
}

/// The formation speed as flown; without a flight, as planned.
fn flown_speed(mission: &Mission, summary: Option<&Summary>) -> SpeedProfile {
    summary.map_or_else(|| mission.speed.clone(), |summary| mission.speed.as_recorded(&summary.fleet.speeds))
}

/// The slowest mode in words: a root that occurs several times is no rate itself.
fn mode_words((rate, times): (f64, usize)) -> String {
    match times {
        1 => format!("slowest mode {rate:.5} 1/s"),
        _ => format!("every rate below {rate:.5} 1/s, a root {times} times"),
    }
}

/// What theory guarantees for the coordination error of this mission, if it speaks about it.
pub fn guarantee(mission: &Mission) -> Option<Guarantee> {
    guarantee_of(&Case::new(mission, None))
}

/// The least rate that a flight can show although what is guaranteed is kept: the law is held for a control period.
pub fn least_rate(mission: &Mission) -> Option<f64> {
    let case = Case::new(mission, None);
    let rate = guarantee_of(&case)?.rate;
    Some(case.held_rate().map_or(rate, |held| held.min(rate)))
}

fn guarantee_of(case: &Case<'_>) -> Option<Guarantee> {
    match &case.mission.law_choice {
        LawChoice::Introduction(_) => introduction::guarantee(case),
        LawChoice::Switching(_) => switching::guarantee(case),
        LawChoice::AuxiliarySwitching(law) => auxiliary::guarantee(case, law),
        _ => {
            let rates = law_rows(case).into_iter().filter_map(|row| row.guaranteed_rate);
            rates.max_by(f64::total_cmp).map(|rate| Guarantee { rate, factor: None })
        }
    }
}

/// Conditions and predictions before a flight, for `check`; with the measured values after it.
pub fn rows(mission: &Mission, summary: Option<&Summary>) -> Vec<TheoryRow> {
    let case = Case::new(mission, summary);
    let of_the_law = law_rows(&case).into_iter().map(|row| watched::with_everyone(&case, row));
    let statements: Vec<TheoryRow> = of_the_law.map(|row| case.judged(row)).collect();
    let mut rows = vec![fleet::graph(&case)];
    if mission.vehicles.len() > 1 {
        rows.extend(fleet::spectrum(&case));
        rows.push(fleet::excused(fleet::losses(&case), &statements));
        rows.push(fleet::excused(fleet::connected_in_mean(&case), &statements));
        let together = together::table_3_1(&case, &statements);
        rows.extend(statements.iter().cloned());
        rows.extend(together);
        rows.extend(talk::row_of_events(&case).map(|row| watched::with_everyone(&case, row)));
    }
    rows.extend(together::path_following(&case, &statements));
    rows.push(fleet::speed(&case, &statements));
    rows.extend(steady_motion::apart(&case));
    rows.extend(steady_motion::bias(&case));
    let mut rows: Vec<TheoryRow> = rows.into_iter().map(promises_if_it_holds).collect();
    rows.extend(watched::row(&case));
    rows
}

/// A statement whose conditions do not hold promises nothing.
fn promises_if_it_holds(row: TheoryRow) -> TheoryRow {
    match row.holds {
        Some(false) => TheoryRow { predicted: "–".into(), guaranteed_rate: None, ..row },
        _ => row,
    }
}

/// What the statements behind the mission's law ask for and promise.
fn law_rows(case: &Case<'_>) -> Vec<TheoryRow> {
    match &case.mission.law_choice {
        LawChoice::LeaderFollower(law) => learned_speeds::rows_of_a_leader(case, law),
        LawChoice::Gateway(law) => {
            learned_speeds::rows_of_a_gateway(case, &law.gateway, law.a, vec![law.b, law.c], law.b0)
        }
        LawChoice::GatewayIntegral(law) => {
            learned_speeds::rows_of_a_gateway(case, &law.gateway, law.a, vec![law.b, law.c, law.d], law.b0)
        }
        LawChoice::Neighbours(law) => learned_speeds::rows_of_a_row(case, law),
        law @ (LawChoice::Alone(_) | LawChoice::SquareWave(_)) => learned_speeds::rows_of_nothing(case, law),
        law => statements(case, law).into_iter().map(|row| undisturbed(case, row)).collect(),
    }
}

/// Of the laws that speak of no failures.
fn statements(case: &Case<'_>, law: &LawChoice) -> Vec<TheoryRow> {
    match law {
        LawChoice::Introduction(_) => introduction::rows(case),
        LawChoice::LeaderIntegral(law) => introduction::rows_of_a_leader(case, law),
        LawChoice::Solution1(law) => solutions::rows(case, Law::SolutionOne { a: law.a }),
        LawChoice::Solution2(law) if !case.network.graph.is_undirected() => {
            directed::rows_of_solution_2(case, law.a, law.b)
        }
        LawChoice::Solution2(law) => solutions::rows(case, Law::SolutionTwo { a: law.a, b: law.b }),
        LawChoice::Solution3(law) => solutions::rows(case, Law::SolutionThree { a: law.a, b: law.b }),
        LawChoice::Weighted(law) => weights_and_patterns::rows_of_weights(case, law),
        LawChoice::MovingPattern(law) => weights_and_patterns::rows_of_a_pattern(case, law),
        LawChoice::Directed(law) => directed::rows(case, law.a, law.b),
        LawChoice::TrulyDecentralised(law) => directed::rows_of_a_told_vehicle(case, law),
        LawChoice::Auxiliary(law) => auxiliary::rows_fixed(case, law),
        LawChoice::AuxiliarySwitching(law) => auxiliary::rows_switching(case, law),
        LawChoice::Switching(_) => switching::rows(case),
        LawChoice::DelayedEstimating(law) => talk::rows_of_estimating(case, law),
        LawChoice::KnownDelay(law) => talk::rows_of_known_delay(case, law),
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => delayed::rows(case, law),
        // Sections 2.2 to 2.4, which speak of failures too, are above.
        LawChoice::LeaderFollower(_)
        | LawChoice::Gateway(_)
        | LawChoice::GatewayIntegral(_)
        | LawChoice::Neighbours(_)
        | LawChoice::Alone(_)
        | LawChoice::SquareWave(_) => Vec::new(),
    }
}
