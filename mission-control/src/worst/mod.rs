//! `worst`: which of the switching signals that brief connectivity losses admit hurts a mission most?

mod search;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use common::coordination::disagreement;
use common::graph::adversary::{Allowance, Signal, Signals};
use common::mission::Mission;
use common::mission::file::{IntervalSwitching, MissionFile, SwitchingChoice, UpInterval};
use common::record::{Record, Row};
use common::theory::monitor::Envelope;
use common::time::{Span, Time};
use serde::Serialize;

use self::search::{most_hurting, search};
use crate::simulate::simulate;
use crate::theory;

/// What counts as hurt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Hurt {
    /// The coordination error (norm) at the end
    End,
    /// Its mean over the mission
    Mean,
}

impl Hurt {
    /// What an envelope allows of an error of one, after this time \[s\] or on average over it.
    fn allowed(self, envelope: &Envelope, length_s: f64) -> f64 {
        match self {
            Hurt::End => envelope.at(length_s),
            Hurt::Mean => envelope.mean(length_s),
        }
    }

    /// As on the command line.
    fn as_str(self) -> &'static str {
        match self {
            Hurt::End => "end",
            Hurt::Mean => "mean",
        }
    }
}

/// What is looked for, and how long.
#[derive(Clone, Copy, Debug)]
pub struct Quest {
    /// What a signal may do.
    pub allowance: Allowance,
    /// What counts as hurt.
    pub hurt: Hurt,
    /// How many flights the search may take.
    pub flights: usize,
    /// Seed of the search.
    pub seed: u64,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Worst {
    /// Coordination error (norm) at the start \[units of ξ\].
    pub initial: f64,
    /// What counts as hurt.
    pub hurt: Hurt,
    /// As the mission is written.
    pub as_written: f64,
    /// Under the worst signal found.
    pub worst: f64,
    /// Under the worst signal found, at the end: the decay that is left \[1/s\].
    pub rate: f64,
    /// What theory allows of what counts as hurt, if it speaks about the mission.
    pub bound: Option<f64>,
    /// Whether the worst found is within it, with what messages in periods and rounding may add; else there is a defect.
    pub within: Option<bool>,
    /// The statement that does.
    pub statement: Option<&'static str>,
    /// The rate that it guarantees \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// Why there is no bound.
    pub no_bound: Option<String>,
    /// How many flights it took.
    pub flights: usize,
    /// Whether the search came to its end.
    pub complete: bool,
    /// Where the mission with that signal is.
    pub saved: PathBuf,
}

/// The mission with a signal in place of its own.
struct Rewriter {
    file: MissionFile,
    /// Directed links by number, as pairs of ids.
    links: Vec<[String; 2]>,
    /// What is said about it besides.
    more: String,
}

impl Rewriter {
    fn text(&self, signals: &Signals, signal: &Signal) -> Result<String, String> {
        let pairs = |links: Vec<usize>| links.into_iter().map(|link| self.links[link].clone()).collect();
        let up = signals.intervals(signal).into_iter().map(|interval| UpInterval {
            from_s: interval.from.secs(),
            to_s: interval.to.secs(),
            links: interval.links.map(pairs),
        });
        let mut file = self.file.clone();
        file.name = format!("{}-worst", file.name);
        file.about = format!("{}{}", file.about, self.more);
        file.network.switching = SwitchingChoice::Intervals(IntervalSwitching { up: up.collect(), period_s: None });
        toml::to_string(&file).map_err(|error| format!("cannot write the mission: {error}"))
    }
}

/// Coordination error of a flight, as a norm \[units of ξ\].
#[derive(Clone, Copy, Debug)]
struct Errors {
    initial: f64,
    end: f64,
    mean: f64,
}

impl Errors {
    fn hurt(&self, hurt: Hurt) -> f64 {
        match hurt {
            Hurt::End => self.end,
            Hurt::Mean => self.mean,
        }
    }
}

/// Flies a mission to its end; none if it is not to go on.
fn fly(text: &str, go_on: impl Fn() -> bool) -> Result<Option<Errors>, String> {
    let mission = Arc::new(Mission::parse("the mission", text).map_err(|faults| faults.to_string())?);
    // Rows of one instant come from all vehicles, though not one after the other.
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); mission.vehicles.len()];
    let record = |row| {
        if let Row::Exact(Record::State(state)) = row
            && let Some(index) = mission.index_of(&state.vehicle)
        {
            rows[index].push(state.xi - mission.vehicles[index].pattern.at(Time::from_nanos(state.t_ns)).h);
        }
    };
    simulate(&mission, record, |_| go_on())?;
    if !go_on() {
        return Ok(None);
    }
    let instants = rows.iter().map(Vec::len).min().unwrap_or(0);
    let norm = |instant: usize| disagreement::of_fleet(rows.iter().map(|xi| xi[instant]));
    let norms: Vec<f64> = (0..instants).map(norm).collect();
    let (Some(&initial), Some(&end)) = (norms.first(), norms.last()) else {
        return Err("a flight recorded nothing".to_string());
    };
    Ok(Some(Errors { initial, end, mean: norms.iter().sum::<f64>() / instants as f64 }))
}

/// Why no worst signal was found, or none could be saved.
#[derive(Debug)]
pub enum Unfound {
    /// It cannot be searched or flown.
    Refused(String),
    /// Its file cannot be written.
    Unwritten(String),
}

impl From<String> for Unfound {
    fn from(reason: String) -> Unfound {
        Unfound::Refused(reason)
    }
}

/// How a saved mission begins.
const HEAD: &str = "# The worst switching signal found with ";

/// Whether the worst mission can be saved there: in place of an earlier one, but of nothing else. Asked before the search, for
/// that may take an hour.
fn vacant(out: &Path) -> Result<(), Unfound> {
    let unwritten = |reason: String| Unfound::Unwritten(format!("cannot write {}: {reason}", out.display()));
    let there = match std::fs::metadata(out) {
        Ok(there) if there.is_file() => std::fs::read(out).map_err(|error| unwritten(error.to_string()))?,
        Ok(_) => return Err(unwritten("it is no file".to_string())),
        Err(_) => Vec::new(),
    };
    if !(there.is_empty() || there.starts_with(HEAD.as_bytes())) {
        return Err(Unfound::Refused(format!(
            "{} is there, and not from an earlier search: it would be lost; name another file with --out",
            out.display()
        )));
    }
    // An empty file stays if the search is killed, and is vacant.
    let opened = std::fs::OpenOptions::new().append(true).create(true).open(out);
    opened.map(drop).map_err(|error| unwritten(error.to_string()))
}

/// Saves the mission, whole or not at all.
fn save(out: &Path, text: &str) -> Result<(), Unfound> {
    let mut part = out.as_os_str().to_owned();
    part.push(".part");
    crate::folder::write(Path::new(&part), text.as_bytes()).map_err(Unfound::Unwritten)?;
    let renamed = std::fs::rename(&part, out);
    renamed.map_err(|error| Unfound::Unwritten(format!("cannot write {}: {error}", out.display())))
}

/// Searches, on four threads, and saves the mission with the worst signal found as `out`, with what it was found by. `source` is
/// how the mission is called on the command line. `go_on` is told how many flights are over; the search ends early when it says
/// so, with the worst found so far.
///
/// A search that comes to its end is a function of the mission, the seed and the number of flights, not of the machine.
///
/// # Errors
/// What cannot be searched, flown or written.
pub fn worst(
    mission: &Mission,
    quest: &Quest,
    source: &str,
    out: &Path,
    go_on: impl Fn(usize) -> bool + Sync,
) -> Result<Worst, Unfound> {
    vacant(out)?;
    let file: MissionFile = toml::from_str(&mission.text).map_err(|error| error.to_string())?;
    let id = |i: usize| mission.vehicles[i].id.clone();
    let links = mission.links.iter().map(|link| [id(link.from), id(link.to)]).collect();
    let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
    let mut signals = Signals::new(mission.vehicles.len(), &arcs, quest.allowance, mission.end)?;
    let own = signals.given(mission.switching.clone());
    let Allowance { alpha, t_0, dwell } = quest.allowance;
    let allowed = format!("α = {alpha}, T₀ = {t_0} and a dwell time of {dwell}");
    let space = if file.about.is_empty() { "" } else { " " };
    let more = format!("{space}Under the worst switching signal found with {allowed}, seed {}.", quest.seed);
    let rewriter = Rewriter { file, links, more };
    let ended = AtomicBool::new(false);
    let under_way = || !ended.load(Ordering::Relaxed);
    let Some(written) = fly(&mission.text, || true)? else { return Err("not flown".to_string().into()) };

    let (flown, complete) = (AtomicUsize::new(0), AtomicBool::new(true));
    let known = own.clone().map(|signal| (written, signal));
    let flight = |signal: &Signal| {
        let errors = if under_way() { fly(&rewriter.text(&signals, signal)?, under_way)? } else { None };
        if errors.is_none() {
            complete.store(false, Ordering::Relaxed);
        } else if !go_on(flown.fetch_add(1, Ordering::Relaxed) + 1) {
            ended.store(true, Ordering::Relaxed);
        }
        Ok(errors)
    };
    let found = search(&signals, own, quest, flight)?;
    let (flights, complete) = (flown.into_inner(), complete.into_inner());
    // An interrupted search may not have come to the mission's own signal.
    let found = most_hurting(found.iter().chain(&known), quest.hurt).cloned();
    let (errors, signal) = found.ok_or_else(|| "interrupted before a flight was over".to_string())?;
    let worst = errors.hurt(quest.hurt);
    let text = rewriter.text(&signals, &signal)?;
    let Errors { initial, end, .. } = errors;
    let hurt = quest.hurt.as_str();
    let ended = if complete { "" } else { " The search was interrupted then; in full it is:" };
    let head = format!(
        "{HEAD}{allowed}:\n# coordination error ({hurt}) {worst:.4e}, at the start {initial:.4e}, \
         in {flights} flights.{ended}\n# mission-control worst {source} --alpha {alpha} --t0 {} --dwell {} --hurt {hurt} --flights {} --seed {}\n",
        t_0.secs(),
        dwell.secs(),
        quest.flights,
        quest.seed
    );
    save(out, &(head + &text))?;

    let length = mission.end - Time::ZERO;
    let allowed = |envelope: &Envelope| initial * quest.hurt.allowed(envelope, length.secs());
    let promise = theory::envelope_over(mission, signals.graphs(), (alpha, t_0, dwell), length);
    let within = promise
        .as_ref()
        .ok()
        .map(|(envelope, tolerance)| worst <= allowed(&tolerance.of_decay(envelope)) + tolerance.added);
    let envelope = promise.as_ref().ok().map(|(envelope, _)| envelope);
    Ok(Worst {
        initial,
        hurt: quest.hurt,
        as_written: written.hurt(quest.hurt),
        worst,
        rate: (initial / end).ln() / mission.end.secs(),
        bound: envelope.map(allowed),
        within,
        statement: envelope.map(|envelope| envelope.statement),
        guaranteed_rate: envelope.map(|envelope| envelope.rate),
        no_bound: promise.err(),
        flights,
        complete,
        saved: out.to_path_buf(),
    })
}

/// T_0 and the dwell time of a quest from seconds.
pub fn allowance(alpha: f64, t_0_s: f64, dwell_s: f64) -> Allowance {
    Allowance { alpha, t_0: Span::from_secs(t_0_s), dwell: Span::from_secs(dwell_s) }
}

#[cfg(test)]
mod tests {
    use common::graph::measure::Connectivity;
    use common::mission::Mission;

    use super::{Hurt, Quest, Unfound, allowance, worst};

    const BRIEF_LOSSES: &str = include_str!("../../../missions/brief-losses.toml");

    fn mission(text: &str) -> Mission {
        Mission::parse("m.toml", text).unwrap_or_else(|faults| panic!("{faults}"))
    }

    #[test]
    fn what_is_found_is_admitted_repeatable_and_within_the_bound() {
        let folder = tempfile::tempdir().expect("a folder");
        let brief = mission(&BRIEF_LOSSES.replace("duration_s = 120.0", "duration_s = 60.0"));
        let quest = Quest { allowance: allowance(0.75, 15.0, 2.5), hurt: Hurt::End, flights: 40, seed: 3 };
        let search = |name: &str| {
            let out = folder.path().join(name);
            let found = worst(&brief, &quest, "brief.toml", &out, |_| true).expect("found");
            (found, std::fs::read_to_string(out).expect("saved"))
        };
        let (found, text) = search("one.toml");
        assert_eq!(search("two.toml").1, text, "a function of mission, seed and number of flights");
        // Twice the T_0 of the mission's own signal leaves room to hurt more.
        assert!(found.worst > 1.1 * found.as_written, "{found:?}");
        assert!(found.bound.is_some_and(|bound| found.worst < bound), "{found:?}");

        assert_eq!(found.flights, 40, "all that were allowed");
        assert!(text.starts_with("# The worst switching signal found with α = 0.75"), "{text}");
        assert!(text.contains("worst brief.toml --alpha 0.75 --t0 15 --dwell 2.5 --hurt end --flights 40 --seed 3\n"));

        let saved = mission(&text);
        assert!(saved.name == "brief-losses-worst" && saved.about.ends_with("seed 3."), "{}", saved.about);
        let arcs: Vec<(usize, usize)> = saved.links.iter().map(|link| (link.to, link.from)).collect();
        let planned = Connectivity::planned(saved.switching.clone(), saved.vehicles.len(), &arcs, saved.end);
        assert!(planned.t_0(0.75).secs() <= 15.0 + 1e-6, "{}", planned.t_0(0.75));
    }

    /// A brief flight, long enough for a few losses.
    fn brief() -> Mission {
        mission(&BRIEF_LOSSES.replace("duration_s = 120.0", "duration_s = 40.0"))
    }

    fn found(mission: &Mission, (alpha, t_0, dwell): (f64, f64, f64), flights: usize) -> super::Worst {
        let folder = tempfile::tempdir().expect("a folder");
        let quest = Quest { allowance: allowance(alpha, t_0, dwell), hurt: Hurt::End, flights, seed: 1 };
        worst(mission, &quest, "m.toml", &folder.path().join("m.toml"), |_| true).expect("found")
    }

    #[test]
    fn a_search_that_is_ended_early_keeps_the_worst_so_far() {
        let folder = tempfile::tempdir().expect("a folder");
        let quest = Quest { allowance: allowance(0.75, 7.5, 2.5), hurt: Hurt::End, flights: 40, seed: 1 };
        let out = folder.path().join("worst.toml");
        let found = worst(&brief(), &quest, "m.toml", &out, |flown| flown < 5).expect("found");
        // Of the flights under way on the other threads, some may have come to their end.
        assert!(!found.complete && (5..9).contains(&found.flights) && found.worst >= found.as_written, "{found:?}");
        let text = std::fs::read_to_string(&out).expect("saved");
        assert!(
            text.contains("The search was interrupted then; in full it is:\n# mission-control worst m.toml"),
            "{text}"
        );
        mission(&text);
        // The same place serves the whole search.
        assert!(worst(&brief(), &quest, "m.toml", &out, |_| true).expect("found").complete);
    }

    #[test]
    fn what_was_not_found_by_a_search_is_not_written_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let own = folder.path().join("own.toml");
        std::fs::write(&own, BRIEF_LOSSES).expect("written");
        let quest = Quest { allowance: allowance(0.75, 7.5, 2.5), hurt: Hurt::End, flights: 1, seed: 1 };
        let search = |out: &std::path::Path| worst(&brief(), &quest, "m.toml", out, |_| false);
        assert!(matches!(search(&own), Err(Unfound::Refused(reason)) if reason.contains("own.toml is there")));
        assert_eq!(std::fs::read_to_string(&own).expect("there"), BRIEF_LOSSES);
        let nowhere = folder.path().join("nowhere/worst.toml");
        assert!(matches!(search(&nowhere), Err(Unfound::Unwritten(reason)) if reason.contains("nowhere")));
        assert!(matches!(search(folder.path()), Err(Unfound::Unwritten(reason)) if reason.contains("no file")));
        assert!(matches!(search("/dev/null".as_ref()), Err(Unfound::Unwritten(_))));
        let empty = folder.path().join("empty.toml");
        std::fs::write(&empty, "").expect("written");
        assert!(search(&empty).is_ok_and(|found| found.complete), "one flight of one, and the last word was to stop");
    }

    #[test]
    fn a_smaller_dwell_time_admits_more_and_hurts_no_less() {
        let found = [2.5, 0.5].map(|dwell| found(&brief(), (0.75, 7.5, dwell), 40).worst);
        assert!(found[1] >= found[0], "{found:?}");
    }

    #[test]
    fn nothing_milder_than_the_signal_of_the_mission_is_found_even_in_one_flight() {
        for dwell in [2.5, 0.3] {
            let found = found(&brief(), (0.75, 7.5, dwell), 1);
            assert!(found.worst >= found.as_written && found.flights == 1, "{found:?}");
        }
    }

    #[test]
    fn what_is_found_hurts_no_less_than_random_losses() {
        let periodic = "periodic = { period_s = 10.0, up_from_s = 7.5, up_for_s = 2.5 }";
        assert!(BRIEF_LOSSES.contains(periodic));
        let random = brief().text.replace(periodic, "random = { alpha = 0.75, t_0_s = 7.5, dwell_s = 0.5 }");
        let found = found(&brief(), (0.75, 7.5, 0.5), 40).worst;
        for seed in 11..21 {
            let random = random.replace("seed = 1\n", &format!("seed = {seed}\n"));
            let errors = super::fly(&random, || true).expect("flown").expect("to its end");
            assert!(errors.end <= found, "seed {seed}: {} {found}", errors.end);
        }
    }

    #[test]
    fn without_a_theorem_there_is_no_bound() {
        let folder = tempfile::tempdir().expect("a folder");
        let late = BRIEF_LOSSES.replace("[network]\n", "[network]\ndelay = { constant = { delay_s = 1.0 } }\n");
        let quest = Quest { allowance: allowance(0.5, 5.0, 2.5), hurt: Hurt::Mean, flights: 3, seed: 1 };
        let found =
            worst(&mission(&late), &quest, "late.toml", &folder.path().join("late.toml"), |_| true).expect("found");
        assert_eq!((found.bound, found.guaranteed_rate), (None, None));
        assert!(found.no_bound.is_some_and(|reason| reason.contains("they take 1.000 s")));
        // What is too short for messages is that alone: windows of T₀ see the fleet connected, so T is bounded.
        let quest = Quest { allowance: allowance(0.5, 5.0, 1.0), ..quest };
        let found = worst(&mission(BRIEF_LOSSES), &quest, "m.toml", &folder.path().join("m.toml"), |_| true);
        let reason = found.expect("found").no_bound.expect("none");
        assert!(reason.contains("age of news") && !reason.contains("unbounded"), "{reason}");
    }

    #[test]
    fn a_flight_in_which_v_l_changes_is_not_bounded() {
        let step = "\nprofile = [{ from_s = 0.0, speed = 0.5 }, { from_s = 39.0, speed = 0.9 }]\n";
        let stepped = mission(&brief().text.replace("\nspeed = 0.5\n", step));
        let unbounded = found(&stepped, (0.75, 7.5, 2.5), 2);
        assert_eq!((unbounded.bound, unbounded.within), (None, None));
        assert!(unbounded.no_bound.is_some_and(|reason| reason.contains("v_L changes under way, first at 39.000 s")));
        let late = mission(&stepped.text.replace("from_s = 39.0", "from_s = 40.0"));
        assert_eq!(found(&late, (0.75, 7.5, 2.5), 2).within, Some(true), "at the end it changes nothing any more");
    }

    #[test]
    fn the_law_with_a_state_of_its_own_and_means_are_bounded_too() {
        const EXAMPLE: &str = include_str!("../../../missions/thesis/eq-4-62-example-4-1.toml");
        let folder = tempfile::tempdir().expect("a folder");
        let duration = "duration_s = ";
        let at = EXAMPLE.find(duration).expect("a duration");
        let end = at + EXAMPLE[at..].find('\n').expect("a line");
        let short = format!("{}{duration}40.0{}", &EXAMPLE[..at], &EXAMPLE[end..]);
        let quest = Quest { allowance: allowance(0.5, 5.0, 2.5), hurt: Hurt::Mean, flights: 6, seed: 1 };
        let found = worst(&mission(&short), &quest, "m.toml", &folder.path().join("m.toml"), |_| true).expect("found");
        assert_eq!(found.statement, Some("Lemma 4.7"));
        assert!(found.bound.is_some_and(|bound| bound > found.worst) && found.within == Some(true), "{found:?}");
    }
}
