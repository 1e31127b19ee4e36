//! Commands that fly many missions, or one many times: `sweep`, `study`, `gallery`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bus::console::StopFlag;

use super::mission::load;
use super::{End, Ended, quoted};
use crate::console::Count;
use crate::gallery::{GALLERY, Gallery};
use crate::sweep::Broken;
use crate::sweep::measure::index_of;
use crate::sweep::plan::Plan;
use crate::sweep::setting::Setting;
use crate::sweep::study::Study;

pub(super) fn sweep(
    path: &Path,
    sets: &[String],
    repeat: u32,
    paired: bool,
    measure: &str,
    out: Option<PathBuf>,
) -> Ended {
    let refused = |reason: String| End(2, reason);
    let mission = load(path)?;
    let out = out.unwrap_or_else(|| PathBuf::from(format!("runs/sweep-{}", mission.name)));
    let settings: Vec<Setting> =
        sets.iter().map(|text| Setting::parse(text)).collect::<Result<_, _>>().map_err(refused)?;
    let measure = index_of(measure).map_err(|reason| End(2, format!("--measure: {reason}")))?;
    let plan = Plan::new(&path.display().to_string(), mission, settings, repeat).map_err(refused)?.paired(paired);
    let stop = StopFlag::on_signals();
    stop.arm();
    let mut progress = Count::new("sweeping", plan.cells.len() * plan.repeats as usize);
    let swept = crate::sweep::sweep(&plan, &out, |over, _| {
        progress.reach(over, "");
        !stop.is_raised()
    });
    progress.done();
    let swept = swept.map_err(broken)?;
    if !swept.complete {
        return Err(interrupted(&out));
    }
    let command: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    let command = format!("mission-control {}", command.join(" "));
    crate::sweep::show(&plan, &swept, measure, &command, &out).map_err(|reason| End(4, reason))?;
    bus::tell!(
        "{} runs, {} of them new: {}",
        swept.runs.len(),
        swept.runs.len() - swept.found,
        out.join("README.md").display()
    );
    Ok(ExitCode::SUCCESS)
}

pub(super) fn study(path: &Path, out: Option<PathBuf>) -> Ended {
    let study = Study::read(path).map_err(|reason| End(2, reason))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let out = out.unwrap_or_else(|| PathBuf::from(format!("runs/study-{stem}")));
    let stop = StopFlag::on_signals();
    stop.arm();
    let mut progress = Count::new("sweeping", study.runs());
    let command = format!("mission-control study {}", quoted(path.display().to_string()));
    let complete = study.make(&out, &command, |over, _| {
        progress.reach(over, "");
        !stop.is_raised()
    });
    progress.done();
    if !complete.map_err(broken)? {
        return Err(interrupted(&out));
    }
    bus::tell!("{} runs: {}", study.runs(), out.join("README.md").display());
    Ok(ExitCode::SUCCESS)
}

fn broken(broken: Broken) -> End {
    End(broken.exit_code(), broken.to_string())
}

fn interrupted(out: &Path) -> End {
    End(1, format!("interrupted; {} keeps the runs that are over, and the same command goes on", out.display()))
}

pub(super) fn gallery(missions: &Path, out: &Path) -> Ended {
    let gallery = Gallery::read(missions).map_err(|reason| End(2, reason))?;
    let mut progress = Count::new("flying", gallery.missions());
    let outcome = gallery.make(out, |name| progress.one_more(name));
    progress.done();
    let outcome = outcome.map_err(|reason| End(4, reason))?;
    for name in &outcome.unused {
        bus::remark!("warning: {name} is in no figure of {GALLERY}");
    }
    for fault in &outcome.faults {
        bus::remark!("{fault}");
    }
    let agree = if outcome.faults.is_empty() { "all agree" } else { "not all agree" };
    bus::tell!(
        "{} figures, {} expected numbers, {agree}: {}",
        outcome.figures,
        outcome.expected,
        out.join("index.html").display()
    );
    Ok(if outcome.faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
