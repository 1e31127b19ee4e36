//! What is missing from the recording of a flight, in words.

use std::path::Path;

use bus::recording::Merged;
use common::mission::Mission;
use common::time::{Span, Time};
use common::wire::fleet::Pace;
use common::wire::vehicle::Phase;
use network_emulator::hub::HUB;

/// Logs that end in the middle, pieces of them that are left out because they are damaged, and logs that are no recordings.
pub(crate) fn damage(merged: &Merged) -> Vec<String> {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let cut = merged.incomplete.iter().map(|path| format!("{} ends in the middle", name(path)));
    let damaged = merged.damaged.iter().map(|(path, chunks, cause)| {
        format!("{chunks} damaged pieces of {} are left out; the first: {cause}", name(path))
    });
    let left_out = merged.left_out.iter().map(|(path, cause)| format!("{} is left out: {cause}", name(path)));
    cut.chain(damaged).chain(left_out).collect()
}

/// Vehicles without states up to the end of the flight, with what is to be told of each: they were lost, or what they recorded was.
pub(crate) fn cut_short(mission: &Mission, phase: Phase, merged: &Merged) -> Vec<(String, String)> {
    let grace = mission.control_period * mission.record_ticks;
    let of = |id: &str| match merged.spans.get(id) {
        None => Some(format!("there are no states of {id}")),
        Some((_, end)) if phase == Phase::Finished && Time::from_nanos(*end) + grace < mission.end => {
            Some(format!("the states of {id} end at {}, before the flight did", Time::from_nanos(*end)))
        }
        Some(_) => None,
    };
    mission.vehicles.iter().filter_map(|vehicle| Some((vehicle.id.clone(), of(&vehicle.id)?))).collect()
}

/// Whether a vehicle is among those that gave up: its states end early, and that is told already.
pub(crate) fn gave_up(aborted: &[String], id: &str) -> bool {
    aborted.iter().any(|text| text.split(' ').next() == Some(id))
}

/// Whether this tells that states of a vehicle are missing: no longer true once they are there.
pub(crate) fn is_about_states_of(text: &str, id: &str) -> bool {
    let begins = |words: &str| text.strip_prefix(words).and_then(|rest| rest.strip_prefix(id));
    let rest = ["log of ", "there are no states of ", "the states of ", "the log of "].into_iter().find_map(begins);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with([':', ' ']))
}

/// Where the log of a participant is that could not be collected, and how it comes to the run.
pub(crate) fn how_to_bring(who: &str, digest: u64, run: &Path) -> String {
    let program = if who == HUB { HUB } else { "vehicle-node" };
    format!(
        "it is on the machine of {who} in LOGS/{digest:016x}, where LOGS is what its {program} was told by --logs (logs, if nothing); \
         bring it here and say: mission-control report {} --logs LOGS",
        run.display()
    )
}

/// How late a vehicle may begin that did not begin in mid-flight \[s of wall clock\].
const LATE_START_S: f64 = 0.5;

/// Vehicles whose states begin in mid-flight: an earlier life of theirs recorded elsewhere.
pub(crate) fn late_beginnings(mission: &Mission, pace: Pace, merged: &Merged) -> Vec<String> {
    // A busy machine misses the first control periods of a flight.
    let grace = match pace {
        Pace::Real { speed_up } => {
            mission.control_period * mission.record_ticks + Span::from_secs(LATE_START_S * speed_up)
        }
        Pace::Stepped => Span::ZERO,
    };
    let begin = |id: &str| merged.spans.get(id).map(|(begin, _)| *begin);
    let late = |id: &str| begin(id).filter(|begin| *begin > grace.nanos());
    let late = mission.vehicles.iter().filter_map(|vehicle| Some((&vehicle.id, late(&vehicle.id)?)));
    late.map(|(id, begin)| {
        let begin = Time::from_nanos(begin);
        format!(
            "the log of {id} begins at {begin}: it has none of what {id} recorded before, in another folder perhaps"
        )
    })
    .collect()
}
