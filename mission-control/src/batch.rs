//! Many missions at once: each flown in one thread and kept in memory, on all cores.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;

use bus::recording::Recording;
use common::mission::Mission;
use common::record::Row;
use common::wire::vehicle::Phase;

use crate::facts::facts;
use crate::results::{Facts, Summary, summarise};
use crate::simulate::simulate;

/// A mission that was flown, with everything that was recorded.
#[derive(Debug)]
pub struct Flight {
    /// The mission.
    pub mission: Arc<Mission>,
    /// What was known of it beforehand.
    pub facts: Facts,
    /// The rows, as they happened.
    pub recording: Recording,
    /// The numbers.
    pub summary: Summary,
}

/// Flies a mission from its start to its end.
///
/// # Errors
/// Why it could not be flown.
pub fn fly(mission: &Arc<Mission>) -> Result<Flight, String> {
    let mut recording = Recording {
        mission_toml: mission.text.clone(),
        digest: format!("{:016x}", mission.digest),
        seed: mission.seed,
        complete: true,
        ..Recording::default()
    };
    let keep = |row| match row {
        Row::Exact(record) => recording.exact.push(record),
        Row::Clock(record) => recording.clock.push(record),
    };
    let outcome = simulate(mission, keep, |_| true)?;
    if outcome.phase != Phase::Finished {
        return Err(format!("{} was not flown to its end: {}", mission.name, outcome.phase.as_str()));
    }
    let facts = facts(mission);
    let summary = summarise(&recording, &facts);
    Ok(Flight { mission: mission.clone(), facts, recording, summary })
}

/// Threads that work side by side: one per core.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Does the work of every item on all cores, the first items first. Each result is handed to `done`, in the calling
/// thread and in the order in which they come about; once it returns false, no further item is begun.
pub fn on_all_cores<T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut done: impl FnMut(usize, R) -> bool,
) {
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        // Nobody works far ahead of what is done with the results.
        let (results, finished) = sync_channel(cores());
        for _ in 0..cores().min(items.len()) {
            let (results, next, work) = (results.clone(), &next, &work);
            scope.spawn(move || {
                while let Some((index, item)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    items.get(index).map(|item| (index, item))
                } {
                    if results.send((index, work(item))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(results);
        for (index, result) in finished {
            if !done(index, result) {
                next.store(items.len(), Ordering::Relaxed);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once() {
        let items: Vec<usize> = (0..100).collect();
        let mut found = vec![0; items.len()];
        on_all_cores(
            &items,
            |item| item * item,
            |index, square| {
                found[index] += square;
                true
            },
        );
        assert_eq!(found, items.iter().map(|item| item * item).collect::<Vec<_>>());
    }

    #[test]
    fn no_item_is_begun_once_enough_is_done() {
        let items: Vec<usize> = (0..100_000).collect();
        let mut count = 0;
        on_all_cores(
            &items,
            |_| (),
            |_, ()| {
                count += 1;
                count < 5
            },
        );
        assert!((5..items.len()).contains(&count), "{count}");
    }
}
