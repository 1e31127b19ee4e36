//! The command `worst`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use bus::console::StopFlag;
use common::mission::Mission;

use super::mission::load;
use super::{End, Ended, quoted};
use crate::console::Progress;
use crate::worst::{self, Hurt, Quest, Worst};

#[derive(Debug, clap::Args)]
pub(super) struct WorstArgs {
    /// The mission file; if its own switching is admitted, the search begins with it
    mission: PathBuf,
    /// Share of the time that may be lost in the long run, 0 to below 1
    #[arg(long, allow_negative_numbers = true, value_parser = super::number)]
    alpha: f64,
    /// Connectivity-loss bound T_0 (s)
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = super::number)]
    t0: f64,
    /// Least time between two changes (s)
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = super::number)]
    dwell: f64,
    /// What counts as hurt
    #[arg(long, value_enum, default_value = "end")]
    hurt: Hurt,
    /// How many flights the search may take
    #[arg(long, default_value = "400", value_parser = at_least_one)]
    flights: usize,
    /// Seed of the search
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Where the worst mission goes, in place of an earlier one (default: worst-MISSION.toml)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// JSON for a pipe
    #[arg(long)]
    json: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|flights| *flights > 0).ok_or_else(|| "allowed: a whole number from 1".to_string())
}

pub(super) fn worst(args: &WorstArgs) -> Ended {
    let mission = load(&args.mission)?;
    let quest = quest(args)?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("worst-{}.toml", mission.name)));
    let place = |path: &Path| path.canonicalize().ok();
    if place(&out).is_some_and(|out| place(&args.mission) == Some(out)) {
        return Err(End(2, format!("--out: found the mission itself, {}; allowed: another file", out.display())));
    }
    let progress = Mutex::new(Progress::new(mission.end));
    let stop = StopFlag::on_signals();
    stop.arm();
    let reached = |flown: usize| {
        progress.lock().unwrap_or_else(PoisonError::into_inner).counted("searching", flown, args.flights);
        !stop.is_raised()
    };
    let source = quoted(args.mission.display().to_string());
    let found = worst::worst(&mission, &quest, &source, &out, reached);
    progress.lock().unwrap_or_else(PoisonError::into_inner).done();
    let found = found.map_err(|reason| match reason {
        worst::Unfound::Refused(reason) => End(2, reason),
        worst::Unfound::Unwritten(reason) => End(4, reason),
    })?;
    if args.json {
        bus::tell!("{}", serde_json::to_string_pretty(&found).map_err(|error| End(4, error.to_string()))?);
    } else {
        tell(&mission, &found);
    }
    if found.complete {
        return Ok(ExitCode::SUCCESS);
    }
    bus::remark!("interrupted after {} of {} flights", found.flights, args.flights);
    Ok(ExitCode::from(1))
}

/// What is looked for, if the numbers given can be.
fn quest(args: &WorstArgs) -> Result<Quest, End> {
    let seconds = |name: &str, value: f64, least: f64| match value.is_finite() && value >= least && value <= 1e6 {
        true => Ok(()),
        false => Err(End(2, format!("--{name}: found {value}; allowed: {least} to 1000000 s"))),
    };
    if !(0.0..1.0).contains(&args.alpha) {
        let why = "it is a share of the time, and vehicles that are never connected cannot agree";
        return Err(End(2, format!("--alpha: found {}; allowed: 0 to below 1 ({why})", args.alpha)));
    }
    seconds("t0", args.t0, 0.0)?;
    seconds("dwell", args.dwell, 1e-3)?;
    Ok(Quest {
        allowance: worst::allowance(args.alpha, args.t0, args.dwell),
        hurt: args.hurt,
        flights: args.flights,
        seed: args.seed,
    })
}

/// A ratio with digits that count.
fn short(ratio: f64) -> String {
    if (1e-2..1e4).contains(&ratio) { format!("{ratio:.3}") } else { format!("{ratio:.2e}") }
}

/// What was found, for a person.
fn tell(mission: &Mission, found: &Worst) {
    let when = match found.hurt {
        Hurt::End => "at the end",
        Hurt::Mean => "on average",
    };
    let cut = if found.complete { "" } else { ", then interrupted" };
    bus::tell!("{}: coordination error {when} ({} flights of {}{cut})", mission.name, found.flights, mission.end);
    bus::tell!("  at the start          {:.4e}", found.initial);
    bus::tell!("  as the mission is     {:.4e}", found.as_written);
    let decay = match found.rate {
        rate if rate.is_finite() => format!("a decay at {rate:.5} 1/s"),
        f64::INFINITY => "no error is left at the end".to_string(),
        _ => "there is no error at the start that could decay".to_string(),
    };
    bus::tell!("  worst signal found    {:.4e}, {decay}", found.worst);
    match (found.bound, found.guaranteed_rate, found.statement) {
        (Some(bound), Some(rate), Some(statement)) => {
            let beyond = match found.within {
                Some(false) => "; the worst found is beyond that: a defect",
                _ if found.worst > bound => {
                    "; what the worst found is beyond that is within messages in periods and rounding"
                }
                _ => "",
            };
            let times = match found.worst > 0.0 {
                true => format!("{} times the worst found", short(bound / found.worst)),
                false => "none was found".to_string(),
            };
            bus::tell!("  {statement} allows {bound:.4e} {when}, a decay at {rate:.5} 1/s: {times}{beyond}");
        }
        _ => bus::tell!("  no theorem bounds it: {}", found.no_bound.as_deref().unwrap_or("none speaks of it")),
    }
    bus::tell!("saved: {}", found.saved.display());
}
