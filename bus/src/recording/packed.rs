//! What became of messages, packed: a dozen bytes for each, where the rows that they stand for take four hundred.
//!
//! The emulator of a busy fleet settles hundreds of thousands of messages per second. Its own log therefore holds them on the
//! topic `/network/settled` in packs; the metadata of the channel names the vehicles. [`RowReader`](super::RowReader) and
//! [`merge`](super::merge) unpack them into the rows of `/network/messages` and `/clock/achieved`, so that a merged
//! recording knows nothing of packs.
//!
//! Each message is a byte for its fate and for whether a lateness follows, then numbers of 7 bits per byte, least first:
//! from, to, its number on the link, when it was taken (less the same of the message before), its delay, when its fate was
//! decided (less when it was due), and the lateness. Numbers that may be negative alternate: 0, -1, 1, -2, and so on.

use common::record::{ClockRecord, Fate, Name, Record, Row, Settled};

/// A pack is handed on when it has this many bytes.
pub(crate) const PACK: usize = 16 << 10;

/// Fates by their numbers.
const FATES: [Fate; Fate::ALL.len()] = Fate::ALL;
const LATENESS_FOLLOWS: u8 = 0x80;

/// A pack in the making.
#[derive(Debug, Default)]
pub(crate) struct Pack {
    pub(crate) bytes: Vec<u8>,
    /// The earliest instant in it \[ns\].
    pub(crate) t_ns: i64,
    before_ns: i64,
}

impl Pack {
    /// Adds what became of a message between these two.
    pub(crate) fn add(&mut self, settled: &Settled, from: usize, to: usize) {
        let fate = settled.fate as u8;
        let lateness = if settled.late_ns.is_some() { LATENESS_FOLLOWS } else { 0 };
        self.t_ns = if self.bytes.is_empty() { settled.t_ns } else { self.t_ns.min(settled.t_ns) };
        self.bytes.push(fate | lateness);
        self.unsigned(from as u64);
        self.unsigned(to as u64);
        self.unsigned(settled.seq);
        self.signed(settled.sent_ns.wrapping_sub(self.before_ns));
        self.signed(settled.due_ns.wrapping_sub(settled.sent_ns));
        self.signed(settled.t_ns.wrapping_sub(settled.due_ns));
        if let Some(late_ns) = settled.late_ns {
            self.signed(late_ns);
        }
        self.before_ns = settled.sent_ns;
    }

    fn unsigned(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.bytes.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push(number as u8);
    }

    fn signed(&mut self, number: i64) {
        self.unsigned(((number << 1) ^ (number >> 63)) as u64);
    }
}

/// Unpacks into rows; false if the bytes are not a pack of a fleet of these vehicles.
pub(super) fn unpack(mut bytes: &[u8], vehicles: &[Name], mut row: impl FnMut(Row)) -> bool {
    let mut before_ns = 0i64;
    while !bytes.is_empty() {
        let Some((settled, from, to)) = next(&mut bytes, before_ns) else { return false };
        let name = |index: u64| usize::try_from(index).ok().and_then(|index| vehicles.get(index));
        let (Some(from), Some(to)) = (name(from), name(to)) else { return false };
        before_ns = settled.sent_ns;
        row(Row::Exact(Record::Message(settled.message(from, to))));
        if let Some(achieved) = settled.achieved(from, to) {
            row(Row::Clock(ClockRecord::Achieved(achieved)));
        }
    }
    true
}

fn next(bytes: &mut &[u8], before_ns: i64) -> Option<(Settled, u64, u64)> {
    let (kind, rest) = bytes.split_first()?;
    *bytes = rest;
    let fate = *FATES.get(usize::from(kind & !LATENESS_FOLLOWS))?;
    let (from, to, seq) = (unsigned(bytes)?, unsigned(bytes)?, unsigned(bytes)?);
    let sent_ns = before_ns.wrapping_add(signed(bytes)?);
    let due_ns = sent_ns.wrapping_add(signed(bytes)?);
    let t_ns = due_ns.wrapping_add(signed(bytes)?);
    let late_ns = if kind & LATENESS_FOLLOWS != 0 { Some(signed(bytes)?) } else { None };
    Some((Settled { t_ns, link: 0, seq, sent_ns, due_ns, fate, late_ns }, from, to))
}

fn unsigned(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0u64;
    for shift in (0..64).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

fn signed(bytes: &mut &[u8]) -> Option<i64> {
    let number = unsigned(bytes)?;
    Some((number >> 1) as i64 ^ -((number & 1) as i64))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn settled() -> impl Strategy<Value = (Settled, usize, usize)> {
        let numbers = (any::<i64>(), any::<u64>(), any::<i64>(), any::<i64>(), 0..FATES.len(), any::<Option<i64>>());
        (numbers, 0usize..3, 0usize..3).prop_map(|((t_ns, seq, sent_ns, due_ns, fate, late_ns), from, to)| {
            // The achieved row tells the delay, which must be a number.
            let due_ns = sent_ns.saturating_add((due_ns >> 1).max(0) % 1_000_000_000_000);
            (Settled { t_ns, link: 0, seq, sent_ns, due_ns, fate: FATES[fate], late_ns }, from, to)
        })
    }

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(messages in prop::collection::vec(settled(), 0..20)) {
            let vehicles: Vec<Name> = ["a", "b", "c"].map(Name::from).into();
            let mut pack = Pack::default();
            let mut expected = Vec::new();
            for (settled, from, to) in &messages {
                pack.add(settled, *from, *to);
                let (from, to) = (&vehicles[*from], &vehicles[*to]);
                expected.push(Row::Exact(Record::Message(settled.message(from, to))));
                expected.extend(settled.achieved(from, to).map(|row| Row::Clock(ClockRecord::Achieved(row))));
            }
            let mut rows = Vec::new();
            prop_assert!(unpack(&pack.bytes, &vehicles, |row| rows.push(row)));
            prop_assert_eq!(rows, expected);
        }

        #[test]
        fn arbitrary_bytes_are_refused_or_read_and_never_panic(bytes: Vec<u8>) {
            unpack(&bytes, &["a".into()], |_| {});
        }
    }

    #[test]
    fn a_message_of_a_busy_fleet_takes_a_dozen_bytes() {
        let mut pack = Pack::default();
        for seq in 0..1000 {
            let sent_ns = 60_000_000_000 + seq as i64 * 2_500;
            let fate = Fate::Delivered;
            let settled =
                Settled { t_ns: sent_ns, link: 0, seq, sent_ns, due_ns: sent_ns, fate, late_ns: Some(25_000) };
            pack.add(&settled, 7, 190);
        }
        assert!(pack.bytes.len() < 13_000, "{} bytes", pack.bytes.len());
    }
}
