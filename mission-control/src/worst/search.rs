//! The search for the signal that hurts most: from several starts uphill, on several threads.

use common::graph::adversary::{Signal, Signals};
use common::random::Stream;

use super::{Errors, Hurt, Quest};

/// Searches that go on side by side: a fixed number, so that what is found does not depend on the machine.
const CHAINS: usize = 4;

/// So many changes in a row may change nothing.
const MOST_IDLE: usize = 1000;

/// The errors under a signal; none if it was not flown, or not to its end, for the search has been ended.
pub(super) type Flown = Result<Option<Errors>, String>;

/// A signal and the errors under it.
pub(super) type Found = (Errors, Signal);

/// The signal that hurts most of those that were flown; none if none was.
///
/// # Errors
/// What could not be flown.
pub(super) fn search(
    signals: &Signals,
    own: Option<Signal>,
    quest: &Quest,
    fly: impl Fn(&Signal) -> Flown + Sync,
) -> Result<Option<Found>, String> {
    let starts = starts(signals, own, quest);
    let chains = CHAINS.min(quest.flights.max(1));
    let results: Vec<Result<Option<Found>, String>> = std::thread::scope(|scope| {
        let chain = |number: usize| {
            let (starts, fly) = (&starts, &fly);
            scope.spawn(move || {
                let stream = Stream::new(quest.seed, &format!("worst/{number}"));
                let more = usize::from(number < quest.flights % chains);
                let own_starts = starts.iter().skip(number).step_by(chains);
                climb((signals, quest.hurt), own_starts, quest.flights / chains + more, stream, fly)
            })
        };
        let threads: Vec<_> = (0..chains).map(chain).collect();
        threads.into_iter().map(|thread| thread.join().map_err(|_| "a search thread ended".to_string())?).collect()
    });
    let found = results.into_iter().collect::<Result<Vec<_>, _>>()?;
    Ok(most_hurting(found.iter().flatten(), quest.hurt).cloned())
}

/// Signals to begin with, no more than half of the flights (but one): the mission's own if it is admitted, then periodic
/// extremes and random ones by turns.
fn starts(signals: &Signals, own: Option<Signal>, quest: &Quest) -> Vec<Signal> {
    let mut periodic = signals.periodic_starts();
    let random = (0..).flat_map(|number| {
        let random = signals.random_start(number, quest.seed);
        periodic.next().into_iter().chain([random])
    });
    let admitted = random.filter(|signal| signals.admits(signal));
    own.into_iter().chain(admitted).take((quest.flights / 2).max(CHAINS)).collect()
}

/// Flies the starts, then climbs from the worst of them: takes every change that hurts no less. With each dwell time it
/// spends half of the flights that are left, and begins with the worst so far that keeps it.
///
/// What it returns hurts no less than anything it has flown, also when it is ended before its time.
fn climb<'a>(
    (signals, hurt): (&Signals, Hurt),
    starts: impl Iterator<Item = &'a Signal>,
    flights: usize,
    mut stream: Stream,
    fly: impl Fn(&Signal) -> Flown,
) -> Result<Option<Found>, String> {
    let mut left = flights.max(1);
    let mut flown: Vec<Found> = Vec::new();
    for start in starts.take(left) {
        left -= 1;
        let Some(errors) = fly(start)? else { return Ok(most_hurting(flown.iter(), hurt).cloned()) };
        flown.push((errors, start.clone()));
    }
    let dwells = signals.allowance().dwells();
    for (stage, &dwell) in dwells.iter().enumerate() {
        let signals = signals.with_dwell(dwell);
        let mut spend = if stage + 1 < dwells.len() { left / 2 } else { left };
        let admitted = flown.iter().filter(|(_, signal)| signals.admits(signal));
        let Some(mut best) = most_hurting(admitted, hurt).cloned() else { continue };
        // A change that changes nothing is no flight; where almost nothing can change, the search ends early.
        let mut idle = 0;
        while spend > 0 && idle < MOST_IDLE {
            let other = signals.changed(&best.1, &mut stream);
            if other == best.1 || !signals.admits(&other) {
                idle += 1;
                continue;
            }
            (idle, spend, left) = (0, spend - 1, left - 1);
            let Some(errors) = fly(&other)? else {
                left = 0;
                break;
            };
            if errors.hurt(hurt) >= best.0.hurt(hurt) {
                best = (errors, other);
            }
        }
        flown.push(best);
    }
    Ok(most_hurting(flown.iter(), hurt).cloned())
}

/// The first of those that hurt most.
pub(super) fn most_hurting<'a>(flown: impl Iterator<Item = &'a Found>, hurt: Hurt) -> Option<&'a Found> {
    flown.reduce(|most, other| if other.0.hurt(hurt) > most.0.hurt(hurt) { other } else { most })
}
