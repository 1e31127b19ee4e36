//! Commands that fly one mission: `simulate` and `run`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use bus::setup::Endpoint;
use common::mission::Mission;
use common::wire::fleet::Pace;
use common::wire::vehicle::{ClockPlan, Phase};
use network_emulator::hub::ENDED;

use super::mission::{load, print_theory, warn};
use super::{End, Ended};
use crate::console::error_in_words;
use crate::results::{ClockVerdict, MessageCounts, Summary};
use crate::run::{Failure, Plan, fly};
use crate::sweep::plan;
use crate::sweep::setting::Setting;
use crate::{folder, rehearse, theory};

#[derive(Debug, clap::Args)]
pub(super) struct RunArgs {
    /// The mission file
    mission: PathBuf,
    /// The run folder (default: runs/MISSION-TIME)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fly with a fleet that is already up, at this endpoint (default: tcp/127.0.0.1:7447). One run at a time conducts it:
    /// another is queued for 2.5 s and flies if its turn comes, else it gives up
    #[arg(long, value_name = "tcp/HOST:PORT", num_args = 0..=1, default_missing_value = "tcp/127.0.0.1:7447", env = "CPF_ATTACH", value_parser = attached)]
    attach: Option<Endpoint>,
    /// Where the own network-emulator listens (default: tcp/127.0.0.1:7447, or a free port if that is taken)
    #[arg(long, value_name = "tcp/HOST:PORT", conflicts_with = "attach")]
    listen: Option<Endpoint>,
    /// Mission seconds per second of wall clock (default: 1)
    #[arg(long, value_name = "FACTOR", conflicts_with = "stepped", value_parser = speed_up, allow_negative_numbers = true)]
    speed_up: Option<f64>,
    /// Advance in lock step, as fast as the processes can; equals `simulate` bit for bit
    #[arg(long)]
    stepped: bool,
    /// Give up when the fleet is not complete after this long (s) (default: never with --attach, 60 s else)
    #[arg(long, value_name = "SECONDS", value_parser = bus::console::patience)]
    patience: Option<Duration>,
    /// JSON for a pipe
    #[arg(long)]
    json: bool,
}

/// A speed-up that can be flown.
fn speed_up(text: &str) -> Result<f64, String> {
    let flown = text.parse::<f64>().ok().filter(|factor| ClockPlan::SPEED_UPS.contains(factor));
    flown.ok_or_else(|| "allowed: 0.001 to 1000".to_string())
}

/// An endpoint after `--attach`, which takes one or none: what follows it may be meant as the mission.
fn attached(text: &str) -> Result<Endpoint, String> {
    let hint = || match Path::new(text).extension() {
        Some(ending) if ending == "toml" => {
            "; the endpoint after --attach may be left out, and a mission then comes before it: \
                                             mission-control run MISSION --attach, or --attach=tcp/HOST:PORT MISSION"
        }
        _ => "",
    };
    text.parse().map_err(|error| format!("{error}{}", hint()))
}

pub(super) fn simulate(path: &Path, out: Option<&Path>, sets: &[String], seed: Option<u64>, json: bool) -> Ended {
    let mission = changed(load(path)?, sets, seed).map_err(|reason| End(2, reason))?;
    warn(&mission, &theory::rows(&mission, None));
    let (folder, outcome, summary) = rehearse::rehearse(&mission, out).map_err(|error| End(4, error))?;
    let sound = outcome.phase == Phase::Finished && outcome.aborted.is_empty();
    tell(&mission, &folder, outcome.phase, sound, &summary, None, json)
}

/// The mission with some of its keys at other values.
fn changed(mission: Arc<Mission>, sets: &[String], seed: Option<u64>) -> Result<Arc<Mission>, String> {
    let mut settings = sets.iter().map(|text| Setting::parse(text)).collect::<Result<Vec<_>, _>>()?;
    if let Some(several) = settings.iter().find(|setting| setting.values.len() > 1) {
        return Err(format!("--set {}: found several values; allowed: one (several are for sweep)", several.key));
    }
    settings.extend(seed.map(|seed| Setting::parse(&format!("seed={seed}"))).transpose()?);
    if settings.is_empty() {
        return Ok(mission);
    }
    let settings: Vec<Setting> = settings.into_iter().map(|setting| setting.of(&mission.text)).collect();
    let changes: Vec<_> = settings.iter().map(|setting| (setting.key.as_str(), &setting.values[0])).collect();
    let text = plan::apply(&mission.text, &changes)?;
    Mission::parse(folder::MISSION, &text).map(Arc::new).map_err(|faults| faults.to_string())
}

pub(super) fn run(args: RunArgs) -> Ended {
    let mission = load(&args.mission)?;
    warn(&mission, &theory::rows(&mission, None));
    let pace = if args.stepped { Pace::Stepped } else { Pace::Real { speed_up: args.speed_up.unwrap_or(1.0) } };
    let plan = Plan {
        mission: mission.clone(),
        out: args.out,
        attach: args.attach,
        listen: args.listen,
        pace,
        pace_asked: args.stepped || args.speed_up.is_some(),
        patience: args.patience,
    };
    match fly(&plan) {
        Ok(flown) => {
            // Vehicles that gave up are among the warnings; that they had to may have a reason that none of them knows.
            for why in flown.clock.notes.iter().filter(|note| note.text.starts_with(ENDED)) {
                bus::remark!("{}", why.text);
            }
            let clock = flown.clock.verdict.as_ref();
            tell(&mission, &flown.folder, flown.phase, flown.sound, &flown.summary, clock, args.json)
        }
        Err(Failure::Unreachable(reason)) => Err(End(3, reason)),
        Err(Failure::Refused(reason)) => Err(End(1, reason)),
        Err(Failure::Files(reason)) => Err(End(4, reason)),
        Err(Failure::Detached(reason)) => {
            bus::remark!("{reason}");
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// What came of a flight, for a person or a pipe.
fn tell(
    mission: &Mission,
    folder: &Path,
    phase: Phase,
    sound: bool,
    summary: &Summary,
    clock: Option<&ClockVerdict>,
    json: bool,
) -> Ended {
    // On standard error, so that a pipe gets the numbers alone; who gave up and what is missing is among them.
    for text in &summary.warnings {
        bus::remark!("warning: {text}");
    }
    if json {
        bus::tell!("{}", serde_json::to_string_pretty(summary).map_err(|error| End(4, error.to_string()))?);
    } else {
        bus::tell!("{} {}: {} s of mission time", mission.name, phase.as_str(), summary.duration_s);
        for sentence in &summary.headline {
            bus::tell!("  {sentence}");
        }
        bus::tell!("");
        let rows = theory::rows(mission, Some(summary));
        print_theory(&rows);
        for row in rows.iter().filter(|row| row.is_below()) {
            bus::remark!("warning: {}: {}, although its conditions hold", row.name, row.measured);
        }
        tell_messages(&summary.fleet.messages.counts);
        if let Some(clock) = clock {
            bus::tell!("  On the clock: {}", clock.text);
        }
        bus::tell!("  {}", coordination_at_end(summary));
        bus::tell!("report: {}", folder.join("report.html").display());
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// What became of the messages; of what rarely happens, only what did.
fn tell_messages(m: &MessageCounts) {
    let more: String = [
        (m.out_of_range, "out of range"),
        (m.half_duplex, "unheard while speaking"),
        (m.collision, "collided"),
        (m.corrupt, "corrupt"),
        (m.receiver_absent, "with the receiver absent"),
    ]
    .iter()
    .filter(|(count, _)| *count > 0)
    .map(|(count, what)| format!("{count} {what} + "))
    .collect();
    bus::tell!(
        "  Messages: {} sent = {} delivered + {} lost + {} with the link down + {} with the queue full + {more}{} in flight",
        m.sent,
        m.delivered,
        m.lost,
        m.link_down,
        m.queue_full,
        m.in_flight
    );
    if m.copied + m.copy_dropped + m.copy_in_flight > 0 {
        let (copied, dropped, in_flight) = (m.copied, m.copy_dropped, m.copy_in_flight);
        bus::tell!("  Second copies: {copied} delivered, {dropped} dropped, {in_flight} in flight");
    }
}

/// The coordination error at the end of a flight, or what is known instead.
fn coordination_at_end(summary: &Summary) -> String {
    let coordination = &summary.fleet.coordination;
    let value = match coordination.last.is_finite() {
        true => error_in_words(coordination.last_norm(), coordination.last),
        false => "beyond what can be told".to_string(),
    };
    match (coordination.last_s, coordination.early(summary.duration_s)) {
        (None, _) => "Coordination error at the end: unknown, the vehicles were never recorded together".to_string(),
        (_, Some(at)) => format!("Coordination error at {at} s, when all were last recorded: {value}"),
        _ => format!("Coordination error at the end: {value}"),
    }
}
