//! Python's `mcap` package reads our recordings, whole and cut.

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use bus::recording::{Origin, Recorder};
use common::record::{Fate, MessageRow, Record, Row, StateRow};

const TICKS: i64 = 200;

fn rows() -> impl Iterator<Item = Row> {
    (0..TICKS).flat_map(|step| {
        let t_ns = step * 50_000_000;
        let states = ["v1", "v2"].map(|vehicle| {
            Row::Exact(Record::State(StateRow {
                t_ns,
                vehicle: vehicle.into(),
                xi: 0.1 * step as f64,
                xi_rate: 1.0 / 3.0,
                v_ref: 0.5,
                x_m: 1.0,
                y_m: 2.0,
                z_m: 3.0,
                yaw_rad: 0.1,
                pitch_rad: 0.2,
                roll_rad: 0.3,
                speed_mps: 0.4,
                e_along_m: 0.5,
                e_cross_m: 0.6,
                e_norm_m: 0.7,
                psi_e_rad: 0.8,
                neighbours: 1,
            }))
        });
        let (from, to) = ("v1".into(), "v2".into());
        let seq = step.unsigned_abs();
        let row = MessageRow { t_ns, from, to, seq, sent_ns: t_ns, due_ns: t_ns, fate: Fate::LinkDown };
        states.into_iter().chain([Row::Exact(Record::Message(row))])
    })
}

fn python(script: &str, file: &Path) -> String {
    let output = Command::new("python3").arg("-c").arg(script).arg(file).output().expect("python3 runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn python_reads_whole_and_cut_recordings() {
    let available = Command::new("python3").args(["-c", "import mcap"]).output();
    if !available.is_ok_and(|output| output.status.success()) {
        // Past the test harness, which shows the output of failed tests only.
        let _ =
            writeln!(std::io::stderr(), "python_mcap: skipped: python package mcap not installed (pip install mcap)");
        return;
    }
    let directory = tempfile::tempdir().expect("directory");
    let whole = directory.path().join("whole.mcap");
    let origin =
        Origin { mission_toml: "name = \"helix\"\n".into(), digest: "abc".into(), seed: 42, start_unix_ns: None };
    let mut recorder = Recorder::create(&whole, &origin).expect("starts");
    for (count, row) in rows().enumerate() {
        recorder.write(&row).expect("writes");
        if count % 100 == 99 {
            recorder.flush().expect("flushes");
        }
    }
    recorder.finish().expect("ends");

    let indexed = r#"
import json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    counts = {}
    for schema, channel, message in reader.iter_messages():
        row = json.loads(message.data)
        assert row["t_ns"] == message.log_time == message.publish_time
        assert schema.encoding == "jsonschema" and json.loads(schema.data)["type"] == "object"
        assert message.sequence == counts.get(channel.topic, 0)
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        if channel.topic == "/vehicles/v2/state":
            assert row["xi_rate"] == 1 / 3 and row["neighbours"] == 1
        if channel.topic == "/network/messages":
            assert row["fate"] == "link_down"
    mission = [a.data.decode() for a in reader.iter_attachments() if a.name == "mission.toml"]
    metadata = {m.name: m.metadata for m in reader.iter_metadata()}
print(sorted(counts.items()), mission, metadata)
"#;
    assert_eq!(
        python(indexed, &whole),
        "[('/network/messages', 200), ('/vehicles/v1/state', 200), ('/vehicles/v2/state', 200)] \
         ['name = \"helix\"\\n'] {'mission': {'digest': 'abc', 'seed': '42'}}"
    );

    // As after kill -9: the file ends in the middle of a chunk.
    let bytes = std::fs::read(&whole).expect("reads");
    let cut = directory.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("writes");
    let streamed = r#"
import sys
from mcap.exceptions import EndOfFile
from mcap.records import Message
from mcap.stream_reader import StreamReader
count = 0
with open(sys.argv[1], "rb") as file:
    try:
        for record in StreamReader(file, validate_crcs=True).records:
            count += isinstance(record, Message)
    except EndOfFile:
        pass
print(count)
"#;
    let ours = bus::recording::read(&cut).expect("reads");
    assert!(!ours.complete);
    assert!(ours.exact.len() >= 100 && ours.exact.len() < 600 && ours.exact.len().is_multiple_of(100));
    assert_eq!(python(streamed, &cut), ours.exact.len().to_string());
}
