//! The stepped clock lets every vehicle run ahead as far as causality allows. A driver that takes one control period at
//! a time, and nothing else from the real one, must come to the same states and the same fates of messages.

use std::collections::BTreeMap;
use std::sync::Arc;

use bus::recording::canonical_order_of_records;
use common::machine::Machine;
use common::mission::Mission;
use common::record::{Name, Record, Row};
use common::time::Time;
use cpf_tests::{mission, mission_text, with};
use mission_control::simulate::simulate;
use network_emulator::emulator::{Channel, Emulator, Sent};
use proptest::prelude::*;
use vehicle_node::flight::{Flight, FlightInput, FlightOutput};

/// One control period after the other: vehicles by index, then the network takes what they said, then what is due before
/// the next period enters the inboxes.
fn one_period_at_a_time(mission: &Arc<Mission>) -> Vec<Record> {
    let mut records = Vec::new();
    let mut emulator = Emulator::new(mission.clone(), None);
    let mut flights: Vec<Flight> = (0..mission.vehicles.len())
        .map(|index| Flight::new(mission.clone(), index, None).expect("the mission can be flown"))
        .collect();
    let mut inboxes: BTreeMap<usize, Vec<(Time, Vec<u8>)>> = BTreeMap::new();
    let mut t = Time::ZERO;
    while t <= mission.end {
        // Deliveries that are due before this period, in order.
        while let Some(at) = emulator.poll_timeout().filter(|at| *at < t) {
            emulator.handle(at, None);
        }
        drain(mission, &mut emulator, &mut inboxes, &mut records);
        let mut said = Vec::new();
        for (from, flight) in flights.iter_mut().enumerate() {
            for (due, bytes) in inboxes.remove(&from).unwrap_or_default() {
                flight.handle(due, Some(FlightInput::Heard(bytes)));
            }
            flight.handle(t, None);
            while let Some(output) = flight.poll_output() {
                match output {
                    FlightOutput::Transmit(bytes) => said.push(Sent { from, bytes: bytes.into() }),
                    FlightOutput::Record(Row::Exact(record)) => records.push(record),
                    _ => {}
                }
            }
        }
        for sent in said {
            emulator.handle(t, Some(sent));
        }
        t += mission.control_period;
    }
    while let Some(at) = emulator.poll_timeout().filter(|at| *at <= mission.end) {
        emulator.handle(at, None);
    }
    emulator.finish(mission.end);
    drain(mission, &mut emulator, &mut inboxes, &mut records);
    in_order(records)
}

fn drain(
    mission: &Mission,
    emulator: &mut Emulator,
    inboxes: &mut BTreeMap<usize, Vec<(Time, Vec<u8>)>>,
    records: &mut Vec<Record>,
) {
    let name = |vehicle: usize| Name::from(mission.vehicles[vehicle].id.as_str());
    while let Some(output) = emulator.poll_output() {
        match output {
            Channel::Deliver { to, due, bytes, .. } => inboxes.entry(to).or_default().push((due, bytes.to_vec())),
            Channel::Record(Row::Exact(record)) => records.push(record),
            Channel::Record(_) => {}
            Channel::Settled(settled) => {
                let link = &mission.links[settled.link];
                records.push(Record::Message(settled.message(&name(link.from), &name(link.to))));
            }
        }
    }
}

fn as_far_as_allowed(mission: &Arc<Mission>) -> Vec<Record> {
    let mut records = Vec::new();
    let keep = |row| {
        if let Row::Exact(record) = row {
            records.push(record);
        }
    };
    simulate(mission, keep, |_| true).expect("the mission can be flown");
    // Commanded speeds come from the hub, which the other driver has not.
    records.retain(|record| !matches!(record, Record::Speed(_)));
    in_order(records)
}

fn in_order(mut records: Vec<Record>) -> Vec<Record> {
    records.sort_by(canonical_order_of_records);
    records
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn the_window_does_not_show(
        seed in 0u64..1000, least_ms in 0u32..900, jitter_ms in 0u32..700, every in 1u32..5, loss in 0.0..0.8f64,
    ) {
        let min_s = f64::from(least_ms) / 1e3;
        let max_s = min_s + f64::from(jitter_ms) / 1e3;
        let text = mission_text("tests/missions/rough-five.toml");
        let text = with(&text, "seed = 7", &format!("seed = {seed}"));
        let text = with(&text, "duration_s = 30.0", "duration_s = 13.0");
        let text = with(&text, "min_s = 0.13, max_s = 0.61", &format!("min_s = {min_s}, max_s = {max_s}"));
        let text = with(&text, "message_period_s = 0.1", &format!("message_period_s = {}", f64::from(every) * 0.05));
        let text = with(&text, "delay_s = 0.07", &format!("delay_s = {min_s}"));
        let mission = mission(&with(&text, "probability = 0.3", &format!("probability = {loss}")));
        let (one, far) = (one_period_at_a_time(&mission), as_far_as_allowed(&mission));
        let part = one.iter().zip(&far).find(|(a, b)| a != b);
        prop_assert!(part.is_none() && one.len() == far.len(), "{} and {} rows, {part:?}", one.len(), far.len());
    }
}
