//! Theory beside measurement: the conditions of the statements that speak about a mission, and what they promise.
//!
//! Each family of laws has a file with two functions of a `Case`: `rows`, the statements behind its laws, and
//! `guarantee`, the decay of the coordination error that they promise. A new law needs a line in `law_rows`, and one in
//! `guarantee_of` if there is a rate.
//!
//! | what | source | file |
//! |---|---|---|
//! | graph, losses, speed, bias: said of every mission | sections 3.1, 4.2 | `fleet.rs` |
//! | two vehicles on lines | Lemma 1.1 | `introduction.rs` |
//! | learned speeds: leader, gateway, row | sections 2.2 to 2.4 | `learned_speeds.rs` |
//! | solutions I to III | Propositions 3.4, 3.5 | `solutions.rs` |
//! | weighted links, moving pattern | Remark 3.10, section 3.3.3 | `weights_and_patterns.rs` |
//! | one-way links, one told vehicle | Propositions 3.6, 3.7, Remark 3.13 | `directed.rs` |
//! | auxiliary state | Theorems 4.8, 4.9 | `auxiliary.rs` |
//! | switching networks | Theorems 4.4, 4.5 | `switching.rs` |
//! | late information | Lemmas 4.4, 4.5 | `delayed.rs` |
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
mod introduction;
mod learned_speeds;
mod network;
mod premises;
mod so_far;
mod solutions;
mod switching;
mod talk;
mod watched;
mod weights_and_patterns;

use common::mission::Mission;
use common::mission::file::LawChoice;
use common::theory::Verdict;
use common::theory::linear_coordination::Law;

pub use figures::figures;
pub use so_far::{SoFar, so_far};
pub use talk::speed_factor;
pub use watched::{envelope_over, guarantee_of_flight};

use crate::results::{Summary, TheoryRow};
use network::Network;

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
}

impl<'a> Case<'a> {
    fn new(mission: &'a Mission, summary: Option<&'a Summary>) -> Case<'a> {
        Case { mission, network: Network::of(mission), summary }
    }

    /// A measured value in words, or a dash before the flight.
    fn measured(&self, value: impl Fn(&Summary) -> String) -> String {
        self.summary.map_or_else(|| "–".to_string(), value)
    }

    /// The row of a statement about how the fleet agrees.
    fn row(&self, verdict: Verdict) -> TheoryRow {
        TheoryRow {
            name: verdict.name.into(),
            condition: verdict.condition,
            value: verdict.value,
            holds: Some(verdict.holds),
            predicted: match (verdict.norm_rate, verdict.holds) {
                (Some(rate), _) => format!("‖e‖ decays at ≥ {rate:.5} 1/s"),
                (None, true) => "agreement, no rate".into(),
                (None, false) => "–".into(),
            },
            guaranteed_rate: verdict.norm_rate,
            measured: self.fitted_rate(),
        }
    }

    /// The measured rate of coordination.
    fn fitted_rate(&self) -> String {
        self.measured(|s| s.fleet.coordination.fit.as_ref().map_or("–".into(), |fit| format!("{:.5} 1/s", fit.rate)))
    }
}

/// What theory guarantees for the coordination error of this mission, if it speaks about it.
pub fn guarantee(mission: &Mission) -> Option<Guarantee> {
    guarantee_of(&Case::new(mission, None))
}

fn guarantee_of(case: &Case<'_>) -> Option<Guarantee> {
    match &case.mission.law_choice {
        LawChoice::Introduction(_) => introduction::guarantee(case),
        LawChoice::Switching(_) => switching::guarantee(case),
        LawChoice::AuxiliarySwitching(law) => auxiliary::guarantee(case, law),
        _ => None,
    }
}

/// Conditions and predictions before a flight, for `check`; with the measured values after it.
pub fn rows(mission: &Mission, summary: Option<&Summary>) -> Vec<TheoryRow> {
    let case = Case::new(mission, summary);
    let mut rows = vec![fleet::graph(&case)];
    if mission.vehicles.len() > 1 {
        rows.extend(fleet::spectrum(&case));
        rows.push(fleet::losses(&case));
        rows.push(fleet::connected_in_mean(&case));
        rows.extend(law_rows(&case));
        rows.extend(talk::row_of_events(&case));
    }
    rows.push(fleet::speed(&case));
    rows.extend(fleet::bias(&case));
    rows.extend(watched::row(&case));
    rows
}

/// What the statements behind the mission's law ask for and promise.
fn law_rows(case: &Case<'_>) -> Vec<TheoryRow> {
    match &case.mission.law_choice {
        LawChoice::Introduction(_) => introduction::rows(case),
        LawChoice::LeaderIntegral(law) => introduction::rows_of_a_leader(case, law),
        LawChoice::LeaderFollower(law) => learned_speeds::rows_of_a_leader(case, law),
        LawChoice::Gateway(law) => {
            learned_speeds::rows_of_a_gateway(case, &law.gateway, law.a, vec![law.b, law.c], law.b0)
        }
        LawChoice::GatewayIntegral(law) => {
            learned_speeds::rows_of_a_gateway(case, &law.gateway, law.a, vec![law.b, law.c, law.d], law.b0)
        }
        LawChoice::Neighbours(law) => learned_speeds::rows_of_a_row(case, law),
        law @ (LawChoice::Alone(_) | LawChoice::SquareWave(_)) => learned_speeds::rows_of_nothing(case, law),
        LawChoice::Solution1(law) => solutions::rows(case, Law::SolutionOne { a: law.a }),
        LawChoice::Solution2(law) if !case.network.graph.is_undirected() => {
            directed::rows_of_solution_2(case, law.a, law.b)
        }
        LawChoice::Solution2(law) => solutions::rows(case, Law::SolutionTwo { a: law.a, b: law.b }),
        LawChoice::Solution3(law) => solutions::rows(case, Law::SolutionThree { a: law.a, b: law.b }),
        LawChoice::Weighted(_) => weights_and_patterns::rows_of_weights(case),
        LawChoice::MovingPattern(_) => weights_and_patterns::rows_of_a_pattern(case),
        LawChoice::Directed(law) => directed::rows(case, law.a, law.b),
        LawChoice::TrulyDecentralised(law) => directed::rows_of_a_told_vehicle(case, law),
        LawChoice::Auxiliary(law) => auxiliary::rows_fixed(case, law),
        LawChoice::AuxiliarySwitching(law) => auxiliary::rows_switching(case, law),
        LawChoice::Switching(_) => switching::rows(case),
        LawChoice::DelayedEstimating(_) => talk::rows_of_estimating(case),
        LawChoice::KnownDelay(law) => talk::rows_of_known_delay(case, law),
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => delayed::rows(case, law),
    }
}
