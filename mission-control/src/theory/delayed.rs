//! Coordination with late information, (4.34) and (4.42).

use common::mission::file::{Delayed, LawChoice};
use common::theory::delay::{self, DelayGains};
use common::theory::delay_rate;
use common::theory::monitor::Watched;
use common::time::Span;

use super::Case;
use super::premises::{premises_of_late_news, too_rare};
use crate::results::TheoryRow;

pub(super) fn rows(case: &Case<'_>, law: &Delayed) -> Vec<TheoryRow> {
    vec![row(case, law.gain, Span::from_secs(law.delay_s))]
}

/// What the lemmas say of this gain and delay.
pub(super) fn row(case: &Case<'_>, gain: f64, tau: Span) -> TheoryRow {
    let Case { mission, network, .. } = case;
    let v_l = mission.speed.at(mission.end).v_l;
    let in_mean = network.planned.connected_in_mean().is_some();
    let verdict = delay::verdict(DelayGains::Averaged(gain), tau, v_l, in_mean);
    let bears_losses = matches!(mission.law_choice, LawChoice::DelayedWithLosses(_));
    let broken = premises_of_late_news(mission, network, tau);
    let rare = too_rare(mission, network, &Watched::Delayed);
    let holds = verdict.holds && broken.is_empty() && rare.is_empty();
    let mut value = verdict.value.clone();
    for found in broken.iter().map(|premise| &premise.found).chain(&rare) {
        value += &format!("; {found}");
    }
    // On a network that never changes the rate is known exactly.
    let rate = (holds && network.graphs.len() == 1).then(|| delay_rate::rate(&network.graph, gain, tau)).flatten();
    TheoryRow {
        condition: if bears_losses {
            format!("{}, type II, every message τ late and none lost but by the switching", verdict.condition)
        } else {
            format!("{}, type II, every vehicle always hears someone, every message τ late", verdict.condition)
        },
        value,
        holds: Some(holds),
        predicted: match rate {
            Some(rate) => format!("exponential agreement; ‖e‖ decays at {rate:.5} 1/s (rightmost root of (4.40))"),
            None if holds => "exponential agreement, no rate".into(),
            None => "–".into(),
        },
        guaranteed_rate: rate,
        ..case.row(verdict)
    }
}
