//! Coordination laws.

use std::sync::Arc;

use super::super::file::LawChoice;
use crate::coordination::FleetLaw;
use crate::coordination::delayed_4_34::Delayed;
use crate::coordination::delayed_4_42::DelayedAlone;
use crate::coordination::delayed_4_42_estimating::Estimating;
use crate::coordination::introduction_1_5::Introduction;
use crate::coordination::known_delay::KnownDelay;
use crate::coordination::solution_1_3_43::SolutionOne;
use crate::coordination::solution_2_3_44::SolutionTwo;
use crate::coordination::solution_3_3_45::SolutionThree;
use crate::coordination::switching_4_21::Switching;
use crate::theory::delay::steady_speed;
use crate::time::Span;

/// The coordination law of a choice.
pub(in crate::mission) fn law(choice: &LawChoice) -> Result<Arc<dyn FleetLaw>, String> {
    Ok(match choice {
        LawChoice::Introduction(g) => Arc::new(Introduction::new(g.gain)?),
        LawChoice::Solution1(g) => Arc::new(SolutionOne::new(g.a)?),
        LawChoice::Solution2(g) => Arc::new(SolutionTwo::new(g.a, g.b)?),
        LawChoice::Solution3(g) => Arc::new(SolutionThree::new(g.a, g.b, g.x_m)?),
        LawChoice::Switching(g) => Arc::new(Switching::new(g.gain)?),
        LawChoice::Delayed(g) => Arc::new(Delayed::new(g.gain)?),
        LawChoice::DelayedWithLosses(g) => Arc::new(DelayedAlone::new(g.gain, g.delay_s)?),
        LawChoice::DelayedEstimating(g) => Arc::new(Estimating::new(g.gain, g.time_constant_s)?),
        LawChoice::KnownDelay(g) => Arc::new(KnownDelay::new(g.gain, g.longest_s)?),
    })
}

/// v_L* / v_L, as the law of a choice will make it.
pub(in crate::mission) fn nominal_factor(choice: &LawChoice) -> f64 {
    match choice {
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => {
            steady_speed(1.0, law.gain, Span::from_secs(law.delay_s))
        }
        _ => 1.0,
    }
}

/// The name of a choice in the mission file.
pub(in crate::mission) fn law_name(choice: &LawChoice) -> &'static str {
    match choice {
        LawChoice::Introduction(_) => "introduction",
        LawChoice::Solution1(_) => "solution1",
        LawChoice::Solution2(_) => "solution2",
        LawChoice::Solution3(_) => "solution3",
        LawChoice::Switching(_) => "switching",
        LawChoice::Delayed(_) => "delayed",
        LawChoice::DelayedWithLosses(_) => "delayed_with_losses",
        LawChoice::DelayedEstimating(_) => "delayed_estimating",
        LawChoice::KnownDelay(_) => "known_delay",
    }
}
