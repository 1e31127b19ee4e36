//! What a row costs to record and to read back.

use std::hint::black_box;

use bus::recording::{CanonicalRecorder, Origin, Recorder, read_from};
use common::record::{Fate, MessageRow, Record, Row, StateRow};
use divan::Bencher;
use divan::counter::ItemsCount;

const ROWS: usize = 40_000;

fn main() {
    divan::main();
}

fn state(index: usize) -> Row {
    let step = (index / 3) as f64;
    Row::Exact(Record::State(StateRow {
        t_ns: (index / 3) as i64 * 50_000_000,
        vehicle: ["v1", "v2", "v3"][index % 3].into(),
        xi: 0.0251 * step,
        xi_rate: 0.5 + (0.01 * step).sin(),
        v_ref: 0.5,
        x_m: 20.0 * (0.003 * step).cos(),
        y_m: 20.0 * (0.003 * step).sin(),
        z_m: -0.007 * step,
        yaw_rad: 0.0031 * step,
        pitch_rad: 0.0123,
        roll_rad: 0.0,
        speed_mps: 0.5 + 0.1 * (0.02 * step).sin(),
        e_along_m: (-0.001 * step).exp(),
        e_cross_m: (-0.002 * step).exp(),
        e_norm_m: (-0.0015 * step).exp(),
        psi_e_rad: (-0.003 * step).exp(),
        neighbours: 2,
    }))
}

fn message(index: usize) -> Row {
    let (from, to) = [("v1", "v2"), ("v2", "v1"), ("v2", "v3"), ("v3", "v2")][index % 4];
    let sent_ns = (index / 4) as i64 * 100_000_000;
    Row::Exact(Record::Message(MessageRow {
        t_ns: sent_ns + 5_000_000_000,
        from: from.into(),
        to: to.into(),
        seq: (index / 4) as u64,
        sent_ns,
        due_ns: sent_ns + 5_000_000_000,
        fate: Fate::Delivered,
    }))
}

fn recorded(rows: &[Row]) -> Vec<u8> {
    let mut recorder = Recorder::in_memory(&Origin::default()).expect("starts");
    for row in rows {
        recorder.write(row).expect("writes");
    }
    recorder.finish().expect("ends").into_inner()
}

#[divan::bench(args = ["states", "messages"])]
fn write(bencher: Bencher<'_, '_>, kind: &str) {
    let rows: Vec<Row> = (0..ROWS).map(if kind == "states" { state } else { message }).collect();
    bencher.counter(ItemsCount::new(ROWS)).bench(|| black_box(recorded(&rows)).len());
}

#[divan::bench]
fn write_in_order(bencher: Bencher<'_, '_>) {
    bencher.counter(ItemsCount::new(ROWS)).with_inputs(|| (0..ROWS).map(state).collect::<Vec<Row>>()).bench_values(
        |rows| {
            let cursor = std::io::Cursor::new(Vec::new());
            let mut recorder = CanonicalRecorder::new(cursor, "memory", &Origin::default()).expect("starts");
            rows.into_iter().for_each(|row| recorder.write(row).expect("writes"));
            recorder.finish().expect("ends").into_inner().len()
        },
    );
}

#[divan::bench(args = ["states", "messages"])]
fn read(bencher: Bencher<'_, '_>, kind: &str) {
    let rows: Vec<Row> = (0..ROWS).map(if kind == "states" { state } else { message }).collect();
    let file = recorded(&rows);
    bencher.counter(ItemsCount::new(ROWS)).bench(|| read_from(&file[..], "memory").expect("reads").exact.len());
}
