//! Whether what vehicles hear of one another is as old as their law takes it to be: else the fleet goes at another rate than it says.
//!
//! Who is told no delay compares its own present with the past of others, and takes all for nearer than it is: under (4.21) with news
//! τ old on every link a fleet with d neighbours each travels at v_L/(1 + kdτ). Who is told τ reckons with just that.

use common::mission::file::{Between, LawChoice};
use common::time::Span;

use super::Case;
use super::premises::late_or_lost;
use super::steady_motion::is_excited;
use super::talk::common_delay;

/// The most that a message period may slow a fleet down that holds what it heard, as a part of its speed.
const SMALL: f64 = 0.02;

/// # Errors
/// Why what is heard is of another age.
pub(super) fn as_the_law_takes_them(case: &Case<'_>) -> Result<(), String> {
    let mission = case.mission;
    let held = mission.between == Between::Hold;
    if mission.vehicles.len() < 2 {
        return Ok(());
    }
    match &mission.law_choice {
        // Nobody is listened to, or the age of all is known.
        LawChoice::Alone(_) | LawChoice::SquareWave(_) | LawChoice::KnownDelay(_) => return Ok(()),
        LawChoice::DelayedEstimating(_) => return if is_4_34(case) { rarely_old(case) } else { Err(ESTIMATED.into()) },
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => {
            nothing_else(case, Span::from_secs(law.delay_s))?;
            if matches!(mission.law_choice, LawChoice::Delayed(_)) && !case.network.leaves_nobody_alone() {
                return Err("at times a vehicle hears nobody and goes at v_L, (4.34)".into());
            }
        }
        // A fleet that goes at v_L is where it was, advanced at v_L, however long ago that was.
        LawChoice::Switching(_) if mission.between == Between::Advance && !is_excited(mission) => return Ok(()),
        // What is lost makes what is held older, and so does the wrong rate.
        _ if held || (mission.between == Between::Advance && is_excited(mission)) => nothing_else(case, Span::ZERO)?,
        _ if mission.every_message_takes(Span::ZERO) => {}
        _ => return Err(NOT_SO_LATE.into()),
    }
    rarely_old(case)
}

const NOT_SO_LATE: &str = "messages are not as late as the law takes them to be";
const ESTIMATED: &str = "v_L* is estimated on board, and no theorem says how well";

/// Whether (4.42) with an estimate is (4.34) with the delay that all messages have: nobody is ever alone, and the estimate never used.
pub(super) fn is_4_34(case: &Case<'_>) -> bool {
    let at_once = common_delay(case.mission).is_some_and(|tau| late_or_lost(case.mission, tau).is_none());
    at_once && case.network.leaves_nobody_alone() && case.dropped.is_none()
}

fn nothing_else(case: &Case<'_>, told: Span) -> Result<(), String> {
    let broken = late_or_lost(case.mission, told).or_else(|| case.dropped.clone());
    broken.map_or(Ok(()), |premise| Err(format!("{NOT_SO_LATE}: {}", premise.found)))
}

/// What is held grows older until the next word.
fn rarely_old(case: &Case<'_>) -> Result<(), String> {
    let mission = case.mission;
    let (gain, is_mean) = match &mission.law_choice {
        _ if mission.between != Between::Hold => return Ok(()),
        LawChoice::Introduction(law) | LawChoice::Switching(law) => (law.gain, false),
        LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => (law.gain, true),
        LawChoice::DelayedEstimating(law) => (law.gain, true),
        _ => return Ok(()),
    };
    let graph = &case.network.graph;
    let most = (0..graph.len()).map(|i| graph.degree(i)).max().unwrap_or(0);
    let period = mission.control_period * mission.message_ticks;
    match gain * if is_mean { 1.0 } else { most as f64 } * period.secs() <= SMALL {
        true => Ok(()),
        false => Err(format!("what was heard is held for {period}, and older than the law takes it to be")),
    }
}
