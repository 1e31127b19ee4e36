//! Solutions I to III of section 3.3: fixed networks, paths whose R_i may vary.

use common::mission::file::LawChoice;
use common::theory::linear_coordination::{Complex, Late, Law};
use common::theory::{proposition_3_4, proposition_3_8};

use super::{Case, directed, weights_and_patterns};
use crate::results::TheoryRow;

pub(super) fn rows(case: &Case<'_>, law: Law) -> Vec<TheoryRow> {
    let graph = &case.network.graph;
    let mut verdict = proposition_3_4::verdict(law, graph, &case.way.rates(), case.network.is_fixed());
    if !case.mission.has_equal_gains() {
        // The propositions hold for every A and B, the rate is of equal gains.
        verdict.norm_rate = None;
        verdict.value += ", unequal gains";
    }
    let mut rows = vec![case.row(verdict)];
    if let Law::SolutionThree { .. } = law {
        rows.push(bounded_speeds(case));
    }
    rows
}

/// Proposition 3.8, for the saturated laws.
pub(super) fn bounded_speeds(case: &Case<'_>) -> TheoryRow {
    let graph = &case.network.graph;
    let bounded = proposition_3_8::verdict(graph, &case.mission.gains("a"), &case.way.places, case.network.is_fixed());
    TheoryRow {
        predicted: if bounded.holds { "speeds stay bounded, paths are reached".into() } else { "–".into() },
        measured: case.measured(|s| format!("{:.3e} m off the paths at the end", s.fleet.path_error_final_m)),
        ..case.row(bounded)
    }
}

/// The rate of the slowest mode of a law of chapter 3 that acts so late, where R_i is constant and gains are equal \[1/s\].
pub(super) fn late_rate(case: &Case<'_>, late: Late) -> Option<f64> {
    if !case.mission.has_equal_gains() {
        return None;
    }
    let (graph, r) = (&case.network.graph, case.way.constant()?);
    let law = match &case.mission.law_choice {
        LawChoice::Solution1(law) => Law::SolutionOne { a: law.a },
        LawChoice::Solution2(law) => Law::SolutionTwo { a: law.a, b: law.b },
        LawChoice::Solution3(law) | LawChoice::MovingPattern(law) => Law::SolutionThree { a: law.a, b: law.b },
        LawChoice::Directed(law) => Law::Directed { a: law.a, b: law.b },
        LawChoice::Weighted(law) => return weights_and_patterns::rate(case, law, late),
        LawChoice::TrulyDecentralised(law) => return directed::late_rate(case, law, late.neighbours),
        _ => return None,
    };
    slowest(&law.late_eigenvalues(graph, &graph.laplacian(), r, late)?)
}

pub(super) fn slowest(modes: &[Complex<f64>]) -> Option<f64> {
    modes.iter().map(|mode| -mode.re).min_by(f64::total_cmp)
}
