//! `worst`: which of the switching signals that brief connectivity losses admit hurts a mission most?

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::graph::adversary::{Allowance, Signal, Signals};
use common::mission::Mission;
use common::mission::file::{
    FollowingChoice, FollowingType, IntervalSwitching, LawChoice, MissionFile, SwitchingChoice, UpInterval,
};
use common::random::Stream;
use common::record::{Record, Row};
use common::theory::theorem_4_4::Coordination;
use common::time::{Span, Time};
use serde::Serialize;

use crate::simulate::simulate;

/// What counts as hurt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Hurt {
    /// The coordination error (norm) at the end
    End,
    /// Its mean over the mission
    Mean,
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
    /// What Theorem 4.4 allows at the end, if it speaks about the mission.
    pub bound: Option<f64>,
    /// The rate that it guarantees \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// How many flights it took.
    pub flights: usize,
    /// Where the mission with that signal is.
    pub saved: PathBuf,
}

/// The mission with a signal in place of its own.
struct Rewriter {
    file: MissionFile,
    /// Directed links by number, as pairs of ids.
    links: Vec<[String; 2]>,
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
        file.network.switching = SwitchingChoice::Intervals(IntervalSwitching { up: up.collect(), period_s: None });
        toml::to_string(&file).map_err(|error| format!("cannot write the mission: {error}"))
    }
}

/// Coordination error of a flight, as a norm.
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

fn fly(text: &str) -> Result<Errors, String> {
    let mission = Arc::new(Mission::parse("the mission", text).map_err(|faults| faults.to_string())?);
    let n = mission.vehicles.len();
    // Rows of one instant come from all vehicles, though not one after the other.
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); n];
    let record = |row| {
        if let Row::Exact(Record::State(state)) = row
            && let Some(index) = mission.index_of(&state.vehicle)
        {
            rows[index].push(state.xi - mission.vehicles[index].pattern.at(Time::from_nanos(state.t_ns)).h);
        }
    };
    simulate(&mission, record, |_| true)?;
    let instants = rows.iter().map(Vec::len).min().unwrap_or(0);
    let norm = |instant: usize| {
        let mean = rows.iter().map(|xi| xi[instant]).sum::<f64>() / n as f64;
        rows.iter().map(|xi| (xi[instant] - mean).powi(2)).sum::<f64>().sqrt()
    };
    let norms: Vec<f64> = (0..instants).map(norm).collect();
    let (Some(&initial), Some(&end)) = (norms.first(), norms.last()) else {
        return Err("a flight recorded nothing".to_string());
    };
    Ok(Errors { initial, end, mean: norms.iter().sum::<f64>() / instants as f64 })
}

/// Searches, on two threads or more, and saves the mission with the worst signal found as `out`.
///
/// The search is a function of the mission, the seed and the number of flights, not of the machine.
///
/// # Errors
/// What cannot be searched, flown or written.
pub fn worst(
    mission: &Mission,
    quest: &Quest,
    out: &std::path::Path,
    progress: impl Fn(usize) + Sync,
) -> Result<Worst, String> {
    let file: MissionFile = toml::from_str(&mission.text).map_err(|error| error.to_string())?;
    let id = |i: usize| mission.vehicles[i].id.clone();
    let links = mission.links.iter().map(|link| [id(link.from), id(link.to)]).collect();
    let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
    let signals = Signals::new(mission.vehicles.len(), &arcs, quest.allowance, mission.end)?;
    let rewriter = Rewriter { file, links };
    let written = fly(&mission.text)?;

    let chains = CHAINS.min(quest.flights.max(1));
    let flown = AtomicUsize::new(0);
    let results: Vec<Result<(f64, Signal), String>> = std::thread::scope(|scope| {
        let chain = |number: usize| {
            let (signals, rewriter, flown, progress) = (&signals, &rewriter, &flown, &progress);
            scope.spawn(move || {
                let hurts = |signal: &Signal| {
                    let errors = fly(&rewriter.text(signals, signal)?)?;
                    progress(flown.fetch_add(1, Ordering::Relaxed) + 1);
                    Ok(errors.hurt(quest.hurt))
                };
                let stream = Stream::new(quest.seed, &format!("worst/{number}"));
                climb(signals, number, chains, quest.flights / chains, stream, hurts)
            })
        };
        let threads: Vec<_> = (0..chains).map(chain).collect();
        threads.into_iter().map(|thread| thread.join().map_err(|_| "a search thread ended".to_string())?).collect()
    });
    let mut best: Option<(f64, Signal)> = None;
    for result in results {
        let found = result?;
        if best.as_ref().is_none_or(|best| found.0 > best.0) {
            best = Some(found);
        }
    }
    let (worst, signal) = best.ok_or("no flight was allowed")?;
    let text = rewriter.text(&signals, &signal)?;
    let Errors { initial, end, .. } = fly(&text)?;
    std::fs::write(out, &text).map_err(|error| format!("cannot write {}: {error}", out.display()))?;
    let promise = promise(mission, &signals, &quest.allowance);
    Ok(Worst {
        initial,
        hurt: quest.hurt,
        as_written: written.hurt(quest.hurt),
        worst,
        rate: (initial / end).ln() / mission.end.secs(),
        bound: promise.map(|(rate, factor)| factor * (-rate * mission.end.secs()).exp() * initial),
        guaranteed_rate: promise.map(|(rate, _)| rate),
        flights: flown.into_inner(),
        saved: out.to_path_buf(),
    })
}

/// Searches that go on side by side: a fixed number, so that what is found does not depend on the machine.
const CHAINS: usize = 4;

/// Climbs from this chain's share of the starts: takes every change that hurts no less.
fn climb(
    signals: &Signals,
    number: usize,
    chains: usize,
    flights: usize,
    mut stream: Stream,
    hurts: impl Fn(&Signal) -> Result<f64, String>,
) -> Result<(f64, Signal), String> {
    let starts = signals.starts();
    let mut best: Option<(f64, Signal)> = None;
    let mut left = flights.max(1);
    for start in starts.iter().cycle().skip(number % starts.len()).step_by(chains).take(starts.len().div_ceil(chains)) {
        if left == 0 {
            break;
        }
        left -= 1;
        let value = hurts(start)?;
        if best.as_ref().is_none_or(|best| value > best.0) {
            best = Some((value, start.clone()));
        }
    }
    let mut best = best.ok_or("the search has no start")?;
    for _ in 0..left {
        let other = signals.changed(&best.1, &mut stream);
        if other == best.1 {
            continue;
        }
        let value = hurts(&other)?;
        if value >= best.0 {
            best = (value, other);
        }
    }
    Ok(best)
}

/// Rate and factor that Theorem 4.4 gives for every signal that is admitted: for (4.21), targets that move as told, and
/// messages that are neither late nor lost.
fn promise(mission: &Mission, signals: &Signals, allowance: &Allowance) -> Option<(f64, f64)> {
    let LawChoice::Switching(_) = &mission.law_choice else { return None };
    let at_once = mission.every_message_takes(Span::ZERO) && mission.loses_by_switching_only();
    let as_told = mission
        .vehicles
        .iter()
        .all(|v| matches!(&v.following, FollowingChoice::Theorem47(gains) if gains.kind == FollowingType::II));
    if !(at_once && as_told) {
        return None;
    }
    let coordination = Coordination::new(signals.graphs(), &mission.gains("gain"), allowance.alpha)?;
    Some((coordination.rate_of_agreement(), coordination.overshoot(allowance.t_0)))
}

/// T_0 and the dwell time of a quest from seconds.
pub fn allowance(alpha: f64, t_0_s: f64, dwell_s: f64) -> Allowance {
    Allowance { alpha, t_0: Span::from_secs(t_0_s), dwell: Span::from_secs(dwell_s) }
}

#[cfg(test)]
mod tests {
    use common::graph::measure::Connectivity;
    use common::mission::Mission;

    use super::{Hurt, Quest, allowance, worst};

    const BRIEF_LOSSES: &str = include_str!("../../missions/brief-losses.toml");

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
            let found = worst(&brief, &quest, &out, |_| {}).expect("found");
            (found, std::fs::read_to_string(out).expect("saved"))
        };
        let (found, text) = search("one.toml");
        assert_eq!(search("two.toml").1, text, "a function of mission, seed and number of flights");
        // Twice the T_0 of the mission's own signal leaves room to hurt more.
        assert!(found.worst > 1.1 * found.as_written, "{found:?}");
        assert!(found.bound.is_some_and(|bound| found.worst < bound), "{found:?}");

        let saved = mission(&text);
        let arcs: Vec<(usize, usize)> = saved.links.iter().map(|link| (link.to, link.from)).collect();
        let planned = Connectivity::planned(saved.switching.clone(), saved.vehicles.len(), &arcs, saved.end);
        assert!(planned.t_0(0.75).secs() <= 15.0 + 1e-6, "{}", planned.t_0(0.75));
    }

    #[test]
    fn without_a_theorem_there_is_no_bound() {
        let folder = tempfile::tempdir().expect("a folder");
        let late = BRIEF_LOSSES.replace("[network]\n", "[network]\ndelay = { constant = { delay_s = 1.0 } }\n");
        let quest = Quest { allowance: allowance(0.5, 5.0, 2.5), hurt: Hurt::Mean, flights: 3, seed: 1 };
        let found = worst(&mission(&late), &quest, &folder.path().join("late.toml"), |_| {}).expect("found");
        assert_eq!((found.bound, found.guaranteed_rate), (None, None));
    }
}
