//! The mission that the benchmark of delays flies has every model on, and enough of its messages arrive to be measured.

use std::collections::BTreeMap;

use common::record::{Fate, Record, Row};
use cpf_tests::{mission, mission_text};
use mission_control::simulate::simulate;

#[test]
fn everything_is_on_and_more_than_half_of_the_messages_arrive() {
    let mission = mission(&mission_text("tests/missions/everything-fast.toml"));
    let medium = mission.medium.as_ref().expect("shared");
    assert!(medium.slots.is_some() && medium.half_duplex && medium.collisions && medium.duty_cycle < 1.0);
    assert!(medium.backoff.nanos() > 0 && medium.preamble.nanos() > 0);
    assert!(mission.links.iter().all(|link| link.needs_distance() && link.duplicate > 0.0 && link.in_order));

    let mut fates: BTreeMap<&str, f64> = BTreeMap::new();
    let count = |row: Row| {
        if let Row::Exact(Record::Message(row)) = row {
            *fates.entry(row.fate.as_str()).or_default() += 1.0;
        }
    };
    simulate(&mission, count, |_| true).expect("flies");
    // In a simulation everyone is there; whether a copy is under way at the end is chance.
    for fate in Fate::ALL.into_iter().filter(|fate| ![Fate::ReceiverAbsent, Fate::CopyInFlight].contains(fate)) {
        assert!(fates.contains_key(fate.as_str()), "{} in {fates:?}", fate.as_str());
    }
    let of_copies: f64 = Fate::ALL.iter().filter(|f| f.is_of_copy()).filter_map(|f| fates.get(f.as_str())).sum();
    let share = fates["delivered"] / (fates.values().sum::<f64>() - of_copies);
    assert!((0.6..0.8).contains(&share), "{share}: {fates:?}");
}
