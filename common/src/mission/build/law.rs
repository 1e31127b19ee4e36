//! Coordination laws.

use std::sync::Arc;

use super::super::file::{Laplacian, LawChoice, LinkWeight};
use crate::coordination::FleetLaw;
use crate::coordination::auxiliary_4_59::Auxiliary;
use crate::coordination::decentralised_3_92::{Decentralised, Weighing};
use crate::coordination::delayed_4_34::Delayed;
use crate::coordination::delayed_4_42::DelayedAlone;
use crate::coordination::delayed_4_42_estimating::Estimating;
use crate::coordination::diagonal::Diagonal;
use crate::coordination::directed_3_72::Directed;
use crate::coordination::gateway_2_33::Gateway;
use crate::coordination::introduction_1_5::Introduction;
use crate::coordination::known_delay::KnownDelay;
use crate::coordination::leader_1_5::LeaderIntegral;
use crate::coordination::leader_follower_2_30::LeaderFollower;
use crate::coordination::neighbours_2_7::Neighbours;
use crate::coordination::pattern_3_70::MovingPattern;
use crate::coordination::prescribed_2_6::{Alone, SquareWave};
use crate::coordination::recruiting::Gains as Recruits;
use crate::coordination::solution_1_3_43::SolutionOne;
use crate::coordination::solution_2_3_44::SolutionTwo;
use crate::coordination::solution_3_3_45::SolutionThree;
use crate::coordination::switching_4_21::Switching;
use crate::coordination::weighted_3_62::Weighted;
use crate::theory::delay::steady_speed;
use crate::time::Span;

/// The coordination law of a choice, for vehicles with these ids.
pub(in crate::mission) fn law(choice: &LawChoice, ids: &[&str]) -> Result<Arc<dyn FleetLaw>, String> {
    let index = |id: &str| ids.iter().position(|other| *other == id).ok_or(format!("{id:?}, which is no vehicle"));
    Ok(match choice {
        LawChoice::Introduction(g) => Arc::new(Introduction::new(g.gain)?),
        LawChoice::LeaderIntegral(g) => Arc::new(LeaderIntegral::new(index(&g.leader)?, g.a, g.b)?),
        LawChoice::LeaderFollower(g) => {
            Arc::new(LeaderFollower::new(index(&g.leader)?, g.a1, Recruits { a: g.a, b: g.b, c: g.c })?)
        }
        LawChoice::Gateway(g) => Arc::new(Gateway::new(index(&g.gateway)?, g.b0, Recruits { a: g.a, b: g.b, c: g.c })?),
        LawChoice::GatewayIntegral(g) => {
            let gains = Recruits { a: g.a, b: g.b, c: g.c };
            Arc::new(Gateway::with_integral(index(&g.gateway)?, g.b0, gains, g.d)?)
        }
        LawChoice::Neighbours(g) => {
            Arc::new(Neighbours::new(index(&g.told)?, g.b0, Recruits { a: g.a, b: g.b, c: g.c })?)
        }
        LawChoice::Alone(g) => Arc::new(Alone::new(g.a1)?),
        LawChoice::SquareWave(g) => Arc::new(SquareWave::new(g.amplitude_mps2, g.period_s)?),
        LawChoice::Solution1(g) => Arc::new(SolutionOne::new(g.a)?),
        LawChoice::Solution2(g) => Arc::new(SolutionTwo::new(g.a, g.b)?),
        LawChoice::Solution3(g) => Arc::new(SolutionThree::new(g.a, g.b, g.x_m)?),
        LawChoice::Weighted(g) => {
            let weight = |w: &LinkWeight| Ok((index(&w.link[0])?, index(&w.link[1])?, w.weight));
            let weights = g.weights.iter().map(weight).collect::<Result<Vec<_>, String>>()?;
            Arc::new(Weighted::new(g.a, g.b, ids.len(), &weights)?)
        }
        LawChoice::MovingPattern(g) => Arc::new(MovingPattern::new(g.a, g.b, g.x_m)?),
        LawChoice::Directed(g) => Arc::new(Directed::new(g.a, g.b)?),
        LawChoice::TrulyDecentralised(g) => {
            let weighing = match g.laplacian {
                Laplacian::Plain => Weighing::Plain,
                Laplacian::Normalised => Weighing::Normalised,
            };
            Arc::new(Decentralised::new(index(&g.told)?, g.a, g.b, weighing)?)
        }
        LawChoice::Switching(g) => Arc::new(Switching::new(g.gain)?),
        LawChoice::Delayed(g) => Arc::new(Delayed::new(g.gain)?),
        LawChoice::DelayedWithLosses(g) => Arc::new(DelayedAlone::new(g.gain, g.delay_s)?),
        LawChoice::Auxiliary(g) => Arc::new(Auxiliary::fixed(g.a1, g.a2)?),
        LawChoice::AuxiliarySwitching(g) => Arc::new(Auxiliary::switching(g.a1, g.a2)?),
        LawChoice::DelayedEstimating(g) => Arc::new(Estimating::new(g.gain, g.time_constant_s)?),
        LawChoice::KnownDelay(g) => Arc::new(KnownDelay::new(g.gain, g.longest_s)?),
    })
}

/// The law of a fleet whose vehicles have these laws, which differ by gains alone.
pub(in crate::mission) fn diagonal(choices: &[LawChoice], ids: &[&str]) -> Result<Arc<dyn FleetLaw>, String> {
    let rows = choices.iter().map(|choice| law(choice, ids)).collect::<Result<Vec<_>, String>>()?;
    Ok(Arc::new(Diagonal::new(rows)?))
}

/// The gains of which each vehicle may have its own, by their names: the entries of K, A and B.
pub(in crate::mission) fn gains_by_vehicle(choice: &mut LawChoice) -> Vec<(&'static str, &mut f64)> {
    match choice {
        LawChoice::Introduction(g) | LawChoice::Switching(g) => vec![("gain", &mut g.gain)],
        LawChoice::Solution1(g) => vec![("a", &mut g.a)],
        LawChoice::Solution2(g) => vec![("a", &mut g.a), ("b", &mut g.b)],
        LawChoice::Solution3(g) | LawChoice::MovingPattern(g) => vec![("a", &mut g.a), ("b", &mut g.b)],
        LawChoice::Weighted(g) => vec![("a", &mut g.a), ("b", &mut g.b)],
        _ => Vec::new(),
    }
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
        LawChoice::LeaderIntegral(_) => "leader_integral",
        LawChoice::LeaderFollower(_) => "leader_follower",
        LawChoice::Gateway(_) => "gateway",
        LawChoice::GatewayIntegral(_) => "gateway_integral",
        LawChoice::Neighbours(_) => "neighbours",
        LawChoice::Alone(_) => "alone",
        LawChoice::SquareWave(_) => "square_wave",
        LawChoice::Solution1(_) => "solution1",
        LawChoice::Solution2(_) => "solution2",
        LawChoice::Solution3(_) => "solution3",
        LawChoice::Weighted(_) => "weighted",
        LawChoice::MovingPattern(_) => "moving_pattern",
        LawChoice::Directed(_) => "directed",
        LawChoice::TrulyDecentralised(_) => "truly_decentralised",
        LawChoice::Switching(_) => "switching",
        LawChoice::Delayed(_) => "delayed",
        LawChoice::DelayedWithLosses(_) => "delayed_with_losses",
        LawChoice::Auxiliary(_) => "auxiliary",
        LawChoice::AuxiliarySwitching(_) => "auxiliary_switching",
        LawChoice::DelayedEstimating(_) => "delayed_estimating",
        LawChoice::KnownDelay(_) => "known_delay",
    }
}

/// The one vehicle that is told v_L, and the key that names it, under laws in which the others are not.
pub(in crate::mission) fn told(choice: &LawChoice) -> Option<(&'static str, &str)> {
    match choice {
        LawChoice::LeaderIntegral(g) => Some(("leader", &g.leader)),
        LawChoice::LeaderFollower(g) => Some(("leader", &g.leader)),
        LawChoice::Gateway(g) => Some(("gateway", &g.gateway)),
        LawChoice::GatewayIntegral(g) => Some(("gateway", &g.gateway)),
        LawChoice::Neighbours(g) => Some(("told", &g.told)),
        LawChoice::TrulyDecentralised(g) => Some(("told", &g.told)),
        _ => None,
    }
}
