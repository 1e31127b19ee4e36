//! A recording as tables: `vehicles.csv`, `links.csv`, `topology.csv`.
//!
//! On a real clock `links.csv` has the lateness of each delivery in its last column; in a simulated or stepped run that is
//! empty. Numbers are written with as many digits as it takes to read back the same `f64`, times as exact decimals.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use bus::recording::Recording;
use common::record::Record;

use super::deliveries::Lateness;

/// Writes the tables of a recording into a folder, row by row.
pub struct Exporter<W: Write> {
    vehicles: csv::Writer<W>,
    links: csv::Writer<W>,
    topology: csv::Writer<W>,
}

const VEHICLES: [&str; 17] = [
    "t_s",
    "vehicle",
    "xi",
    "xi_rate",
    "v_ref",
    "x_m",
    "y_m",
    "z_m",
    "yaw_rad",
    "pitch_rad",
    "roll_rad",
    "speed_mps",
    "e_along_m",
    "e_cross_m",
    "e_norm_m",
    "psi_e_rad",
    "neighbours",
];
const LINKS: [&str; 8] = ["sent_s", "due_s", "decided_s", "from", "to", "seq", "fate", "late_s"];
const TOPOLOGY: [&str; 4] = ["t_s", "from", "to", "up"];

impl Exporter<BufWriter<File>> {
    /// Creates the three files in `directory`.
    pub fn create(directory: impl AsRef<Path>) -> io::Result<Self> {
        let file = |name: &str| {
            let path = directory.as_ref().join(name);
            let with_path = |cause: io::Error| io::Error::new(cause.kind(), format!("{}: {cause}", path.display()));
            File::create(&path).map(BufWriter::new).map_err(with_path)
        };
        Exporter::new(file("vehicles.csv")?, file("links.csv")?, file("topology.csv")?)
    }
}

impl<W: Write> Exporter<W> {
    /// Writes the headers.
    pub fn new(vehicles: W, links: W, topology: W) -> io::Result<Self> {
        let table = |writer| csv::WriterBuilder::new().has_headers(false).from_writer(writer);
        let mut exporter = Exporter { vehicles: table(vehicles), links: table(links), topology: table(topology) };
        exporter.vehicles.write_record(VEHICLES)?;
        exporter.links.write_record(LINKS)?;
        exporter.topology.write_record(TOPOLOGY)?;
        Ok(exporter)
    }

    /// Writes one row into its table, and of a delivery how late it was, if that is known \[ns of wall clock\]. The formation
    /// speed and warnings have no table.
    pub fn write(&mut self, record: &Record, late_ns: Option<i64>) -> io::Result<()> {
        match record {
            Record::State(row) => {
                let numbers = [
                    row.xi,
                    row.xi_rate,
                    row.v_ref,
                    row.x_m,
                    row.y_m,
                    row.z_m,
                    row.yaw_rad,
                    row.pitch_rad,
                    row.roll_rad,
                    row.speed_mps,
                    row.e_along_m,
                    row.e_cross_m,
                    row.e_norm_m,
                    row.psi_e_rad,
                ];
                self.vehicles.serialize((seconds(row.t_ns), &row.vehicle, numbers, row.neighbours))?;
            }
            Record::Message(row) => self.links.serialize((
                seconds(row.sent_ns),
                seconds(row.due_ns),
                seconds(row.t_ns),
                &row.from,
                &row.to,
                row.seq,
                row.fate.as_str(),
                late_ns.map(seconds),
            ))?,
            Record::Topology(row) => self.topology.serialize((seconds(row.t_ns), &row.from, &row.to, row.up))?,
            Record::Speed(_) | Record::Warning(_) => {}
        }
        Ok(())
    }

    /// Ends the tables and hands back the writers.
    pub fn finish(self) -> io::Result<[W; 3]> {
        let end = |table: csv::Writer<W>| table.into_inner().map_err(csv::IntoInnerError::into_error);
        let mut writers = [end(self.vehicles)?, end(self.links)?, end(self.topology)?];
        for writer in &mut writers {
            writer.flush()?;
        }
        Ok(writers)
    }
}

/// Writes the tables of a recording into `directory`.
pub fn export_csv(recording: &Recording, directory: impl AsRef<Path>) -> io::Result<()> {
    let mut exporter = Exporter::create(directory)?;
    let lateness = Lateness::of(&recording.clock);
    for record in &recording.exact {
        let late_ns = match record {
            Record::Message(row) => lateness.late_ns(row),
            _ => None,
        };
        exporter.write(record, late_ns)?;
    }
    exporter.finish().map(|_| ())
}

/// Nanoseconds as exact decimal seconds.
pub(super) fn seconds(nanos: i64) -> String {
    let (whole, rest) = (nanos.unsigned_abs() / 1_000_000_000, nanos.unsigned_abs() % 1_000_000_000);
    let sign = if nanos < 0 { "-" } else { "" };
    let digits = format!("{rest:09}");
    let digits = digits.trim_end_matches('0');
    format!("{sign}{whole}.{}", if digits.is_empty() { "0" } else { digits })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::{fleet, state_row};
    use common::record::{AchievedRow, ClockRecord, Fate, MessageRow, TopologyRow};

    fn exported(rows: &[Record], late_ns: Option<i64>) -> [String; 3] {
        let mut exporter = Exporter::new(Vec::new(), Vec::new(), Vec::new()).expect("starts");
        rows.iter().for_each(|row| exporter.write(row, late_ns).expect("writes"));
        exporter.finish().expect("ends").map(|table| String::from_utf8(table).expect("text"))
    }

    #[test]
    fn the_columns_are_those_of_the_documentation() {
        let (from, to) = (String::from("a"), String::from("b,c"));
        let message = MessageRow {
            t_ns: 1_250_000_001,
            from: from.as_str().into(),
            to: to.as_str().into(),
            seq: 3,
            sent_ns: 1_000_000_000,
            due_ns: -1,
            fate: Fate::QueueFull,
        };
        let [_, late, _] = exported(&[Record::Message(message.clone())], Some(-2_500));
        let rows = [
            Record::State(state_row(50_000_000, "v1", 0.1 + 0.2)),
            Record::Message(message),
            Record::Topology(TopologyRow { t_ns: 0, from: from.into(), to: to.into(), up: false }),
        ];
        let [vehicles, links, topology] = exported(&rows, None);
        assert_eq!(
            vehicles,
            "t_s,vehicle,xi,xi_rate,v_ref,x_m,y_m,z_m,yaw_rad,pitch_rad,roll_rad,speed_mps,e_along_m,e_cross_m,\
             e_norm_m,psi_e_rad,neighbours\n\
             0.05,v1,0.30000000000000004,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0\n"
        );
        assert_eq!(
            links,
            "sent_s,due_s,decided_s,from,to,seq,fate,late_s\n1.0,-0.000000001,1.250000001,a,\"b,c\",3,queue_full,\n"
        );
        assert!(late.ends_with(",queue_full,-0.0000025\n"), "{late}");
        assert_eq!(topology, "t_s,from,to,up\n0.0,a,\"b,c\",false\n");
    }

    #[test]
    fn numbers_read_back_exactly() {
        let fleet = fleet(true);
        let [vehicles, ..] = exported(&fleet.exact, None);
        let mut states = fleet.exact.iter().filter_map(|record| match record {
            Record::State(row) => Some(row),
            _ => None,
        });
        for line in csv::Reader::from_reader(vehicles.as_bytes()).records() {
            let line = line.expect("a line");
            let row = states.next().expect("a row");
            let x_m: f64 = line[5].parse().expect("a number");
            assert_eq!(x_m.to_bits(), row.x_m.to_bits());
            let t_s: f64 = line[0].parse().expect("a number");
            assert_eq!(t_s, row.t_ns as f64 / 1e9);
        }
        assert!(states.next().is_none());
    }

    #[test]
    fn deliveries_on_a_real_clock_tell_how_late_they_were_and_simulated_ones_do_not() {
        let mut fleet = fleet(true);
        // The instant of the row is that of the delivery, as the emulator writes it.
        let delivered = |record: &Record| match record {
            Record::Message(row) => (row.fate == Fate::Delivered).then(|| row.clone()),
            _ => None,
        };
        let row = fleet.exact.iter().find_map(delivered).expect("something was delivered");
        let (from, to, commanded_ns) = (row.from, row.to, row.due_ns - row.sent_ns);
        let achieved = AchievedRow { t_ns: row.t_ns, from, to, seq: row.seq, commanded_ns, late_ns: 31_000 };
        fleet.clock = vec![ClockRecord::Achieved(achieved)];
        let late = |fleet: &Recording| {
            let folder = tempfile::tempdir().expect("a folder");
            export_csv(fleet, folder.path()).expect("writes");
            let mut table = csv::Reader::from_path(folder.path().join("links.csv")).expect("a table");
            let rows = table.records().map(|line| line.expect("a line"));
            rows.map(|line| (line[6].to_owned(), line[7].to_owned()))
                .filter(|(_, late)| !late.is_empty())
                .collect::<Vec<_>>()
        };
        assert_eq!(late(&fleet), [("delivered".to_owned(), "0.000031".to_owned())]);
        fleet.clock.clear();
        assert_eq!(late(&fleet), []);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = export_csv(&Recording::default(), "/nonexistent/folder").expect_err("refused").to_string();
        assert!(error.contains("/nonexistent/folder/vehicles.csv"), "{error}");
    }
}
