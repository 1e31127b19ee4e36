//! Rows and writers for the tests of this module.

use std::cell::RefCell;
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::rc::Rc;

use common::record::{AchievedRow, ClockRecord, Fate, MessageRow, Record, Row, SpeedRow, StateRow, TopologyRow};

use super::Origin;

pub(super) fn origin() -> Origin {
    Origin { mission_toml: "name = \"tëst\"\n".into(), digest: "c0ffee".into(), seed: 7, start_unix_ns: None }
}

pub(super) fn state(t_ns: i64, vehicle: &str, xi: f64) -> Row {
    Row::Exact(Record::State(StateRow {
        t_ns,
        vehicle: vehicle.into(),
        xi,
        xi_rate: 0.1 + 0.2,
        v_ref: 1.0 / 3.0,
        x_m: -0.0,
        y_m: 5e-324,
        z_m: 1.797_693_134_862_315_7e308,
        yaw_rad: std::f64::consts::PI,
        pitch_rad: 1e-7,
        roll_rad: 123_456_789.123_456_79,
        speed_mps: 0.5,
        e_along_m: 1.0,
        e_cross_m: -2.0,
        e_norm_m: 5_f64.sqrt(),
        psi_e_rad: -1e-300,
        neighbours: 2,
    }))
}

pub(super) fn message(t_ns: i64, from: &str, to: &str, seq: u64) -> Row {
    let (from, to) = (from.into(), to.into());
    Row::Exact(Record::Message(MessageRow { t_ns, from, to, seq, sent_ns: t_ns, due_ns: t_ns, fate: Fate::Delivered }))
}

/// One tick of two vehicles and their network, in no particular order within the instant.
pub(super) fn tick(t_ns: i64) -> Vec<Row> {
    let xi = t_ns as f64 * 1e-9;
    let clock = AchievedRow { t_ns, from: "a".into(), to: "b".into(), seq: 1, commanded_ns: 5, late_ns: 3 };
    vec![
        Row::Clock(ClockRecord::Achieved(clock)),
        message(t_ns, "b", "a", 4),
        message(t_ns, "a", "b", 9),
        message(t_ns, "a", "b", 8),
        state(t_ns, "b", xi),
        state(t_ns, "a", xi),
        Row::Exact(Record::Topology(TopologyRow { t_ns, from: "a".into(), to: "b".into(), up: true })),
        Row::Exact(Record::Speed(SpeedRow { t_ns, speed: 0.5 })),
    ]
}

/// A disk that takes `room` bytes.
pub(super) struct SmallDisk {
    pub(super) written: Cursor<Vec<u8>>,
    pub(super) room: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.room {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.room -= bytes.len();
        self.written.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.written.seek(position)
    }
}

/// A disk that can be looked at while it is written.
#[derive(Clone, Default)]
pub(super) struct SharedDisk(Rc<RefCell<Cursor<Vec<u8>>>>);

impl SharedDisk {
    pub(super) fn bytes(&self) -> Vec<u8> {
        self.0.borrow().get_ref().clone()
    }
}

impl Write for SharedDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SharedDisk {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.0.borrow_mut().seek(position)
    }
}
