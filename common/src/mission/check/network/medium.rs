//! Medium access.

use std::collections::HashMap;

use super::super::super::fault::Collector;
use super::super::super::file::{MissionFile, NetworkSection, SlotsSection, WhenFullChoice};
use crate::network::Medium;
use crate::network::medium::{Slots, WhenFull};
use crate::time::Span;
use crate::wire::state::STATE_LIMIT;

/// The least that says what a coordination message says \[bytes\]: sender, number, ξ and a checksum.
const LEAST_PACKET: u32 = 17;

/// Fastest rate \[bit/s\]; it stands in for one that is missing, as with it no message is too long for its slot.
const FASTEST_RATE: f64 = 1e12;

/// The medium of a mission, if it has one.
pub(in super::super) fn check_medium(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    network: &NetworkSection,
    ids: &HashMap<String, usize>,
) -> Option<Medium> {
    let section = network.medium.as_ref()?;
    let key = "network.medium";
    let within = |value: f64| (0.0..=3600.0).contains(&value);
    let rate = section.rate_bps.unwrap_or_else(|| {
        let allowed = "a number: bits that a sender puts on the air per second, or a preset that has a medium";
        faults.fault(key, "no rate_bps", allowed);
        FASTEST_RATE
    });
    let rate_ok = (1.0..=FASTEST_RATE).contains(&rate);
    faults.number(&format!("{key}.rate_bps"), rate, rate_ok, "1 to 1e12 bit/s");
    if let Some(bytes) = section.packet_bytes.filter(|bytes| !(LEAST_PACKET..=65_535).contains(bytes)) {
        let allowed = format!(
            "{LEAST_PACKET} to 65535 bytes: a modem that packs tightly still sends the sender (1), the number (4), ξ (8) \
             and a checksum (4)"
        );
        faults.fault(&format!("{key}.packet_bytes"), bytes, allowed);
    }
    let (preamble, backoff) = (section.preamble_s.unwrap_or(0.0), section.backoff_s.unwrap_or(0.0));
    faults.number(&format!("{key}.preamble_s"), preamble, within(preamble), "0 to 3600 s");
    faults.number(&format!("{key}.backoff_s"), backoff, within(backoff), "0 to 3600 s");
    let queue = section.queue.unwrap_or(1);
    if !(1..=10_000).contains(&queue) {
        faults.fault(&format!("{key}.queue"), queue, "1 to 10000 messages");
    }
    // Silence after a message is at most a hundred thousand times as long as the message.
    let duty_cycle = section.duty_cycle.unwrap_or(1.0);
    let duty_ok = (1e-5..=1.0).contains(&duty_cycle);
    faults.number(&format!("{key}.duty_cycle"), duty_cycle, duty_ok, "0.00001 to 1, a share of the time");
    let mut medium = Medium {
        rate,
        preamble: Span::from_secs(preamble),
        packet: section.packet_bytes.map(|bytes| bytes as usize),
        queue: queue as usize,
        when_full: match section.when_full.unwrap_or_default() {
            WhenFullChoice::DropNew => WhenFull::DropNew,
            WhenFullChoice::DropOld => WhenFull::DropOld,
        },
        backoff: Span::from_secs(backoff),
        half_duplex: section.half_duplex.unwrap_or(false),
        collisions: section.collisions.unwrap_or(false),
        slots: None,
        duty_cycle,
    };
    // What fits a slot at its greatest always fits.
    let airtime = medium.airtime(STATE_LIMIT);
    medium.slots = section.slots.as_ref().map(|slots| check_slots(faults, file, ids, slots, airtime));
    Some(medium)
}

fn check_slots(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
    section: &SlotsSection,
    airtime: Span,
) -> Slots {
    let key = "network.medium.slots";
    let n = file.vehicles.len();
    let slot_ok = section.slot_s > 0.0 && section.slot_s <= 86_400.0;
    faults.number(&format!("{key}.slot_s"), section.slot_s, slot_ok, "above 0 and at most 86400 s");
    let guard_ok = section.guard_s >= 0.0 && section.guard_s < section.slot_s;
    faults.number(&format!("{key}.guard_s"), section.guard_s, guard_ok, "0 to below slot_s");
    let order: Vec<usize> = match &section.order {
        None => (0..n).collect(),
        Some(order) => {
            for id in order.iter().filter(|id| !ids.contains_key(*id)) {
                let mut known: Vec<&str> = ids.keys().map(String::as_str).collect();
                known.sort_unstable();
                faults.fault(&format!("{key}.order"), format!("{id:?}, which is no vehicle"), known.join(", "));
            }
            for vehicle in file.vehicles.iter().filter(|vehicle| !order.contains(&vehicle.id)) {
                faults.fault(
                    &format!("{key}.order"),
                    format!("no slot for {}", vehicle.id),
                    "every vehicle at least once",
                );
            }
            if order.len() > 1000 {
                faults.fault(
                    &format!("{key}.order"),
                    format!("{} slots", order.len()),
                    "at most 1000 slots in a frame",
                );
            }
            order.iter().filter_map(|id| ids.get(id).copied()).collect()
        }
    };
    let slots = Slots::new(Span::from_secs(section.slot_s), Span::from_secs(section.guard_s), &order, n);
    if slot_ok && guard_ok && slots.usable() < airtime {
        let found = format!("{} s, less {} s of guard", section.slot_s, section.guard_s);
        let allowed = format!("at least the airtime of the longest message, {} s, and the guard", airtime.secs());
        faults.fault(&format!("{key}.slot_s"), found, allowed);
    }
    slots
}
