//! The command line of mission-control: what can be asked for. What is done then is in the files beside this one.

mod fleet;
mod flight;
mod many;
mod mission;
mod recordings;
mod worst;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use common::path::geodesy::Place;

use self::fleet::FleetArgs;
use self::flight::RunArgs;
use self::recordings::Format;
use self::worst::WorstArgs;
use crate::folder::quoted;
use crate::waypoints;

/// Flies fleets of vehicles that follow paths in coordination: checks a mission, simulates it, runs it as real processes
/// over an emulated network, and reports on it.
///
/// Exit codes: 0 all is well, 1 the flight or a vehicle of it was aborted or lost, or two runs differ, 2 a wrong mission
/// or command, 3 the fleet cannot be reached, 4 files cannot be read or written.
#[derive(Debug, Parser)]
#[command(
    name = "mission-control",
    version,
    after_help = "Start here:\n  \
    mission-control run missions/auv-helix.toml --speed-up 20\n  \
    mission-control simulate missions/auv-helix.toml\n  \
    mission-control check missions/auv-helix.toml"
)]
pub struct Cli {
    #[command(subcommand)]
    command: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Check a mission file: what is wrong with it, or what theory says of it
    #[command(
        after_help = "Example:\n  mission-control check missions/auv-helix.toml\n\nExit codes: 0 it can be flown, 2 something is wrong with it, 4 figures or output cannot be written."
    )]
    Check {
        /// The mission file
        mission: PathBuf,
        /// JSON for a pipe
        #[arg(long)]
        json: bool,
        /// Also print the graph: degrees, Laplacian, spanning tree, eigenvalues, all graphs that the network can take
        #[arg(long)]
        graph: bool,
        /// Also draw what theory gives without a run, as SVG files: curves of the mission's law where there are any, and Figure 2.8 of the
        /// thesis, which is the same for every mission
        #[arg(long, value_name = "DIR")]
        figures: Option<PathBuf>,
    },
    /// Fly a mission in one thread, as fast as it goes
    #[command(
        after_help = "Example:\n  mission-control simulate missions/auv-helix.toml --set seed=7 --out runs/seven\n\nExit codes: 0 flown, 1 aborted, 2 a wrong mission, 4 files or output cannot be written."
    )]
    Simulate {
        /// The mission file
        mission: PathBuf,
        /// The run folder (default: runs/MISSION-TIME)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Another value for a key of the mission file, such as network.loss=0.3, vehicles.auv2.start.x_m=3 (the same as
        /// 'vehicles[1].start.x_m=3') or coordination.GAIN for a gain of the mission's law; may be repeated
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<String>,
        /// Another seed
        #[arg(long)]
        seed: Option<u64>,
        /// JSON for a pipe
        #[arg(long)]
        json: bool,
    },
    /// Fly a mission with every combination of some values, each several times, and sum up what came of it
    #[command(
        after_help = "Example:\n  mission-control sweep tests/missions/loss-delay.toml --set network.loss.bernoulli.probability=0:0.8:0.2 --repeat 6\n\n\
        Two laws under the same losses:\n  mission-control sweep tests/missions/loss-delay.toml --paired --repeat 6 \\\n    --set network.loss=0:0.8:0.2 \\\n    \
        --set 'coordination.law={ switching.gain = 0.15 },{ delayed = { gain = 0.15, delay_s = 0 } }'\n\n\
        A key of one vehicle, and of an item of a list:\n  --set vehicles.v1.start.x_m=3,4   --set 'vehicles[0].start.x_m=3,4'\n\nExit codes: 0 all runs are there, 1 interrupted, 2 a wrong mission or key, or a folder with runs that this sweep would lose,\n  4 files cannot be read or written."
    )]
    Sweep {
        /// The mission file
        mission: PathBuf,
        /// A key of the mission file with its values: KEY=FROM:TO:STEP or KEY=VALUE,VALUE; may be repeated. For short:
        /// network.loss and network.delay for independent losses and a constant delay in place of the mission's models,
        /// coordination.GAIN for a gain of the mission's law, and vehicles.ID.KEY for vehicles[N].KEY
        #[arg(long = "set", value_name = "KEY=VALUES", required = true)]
        sets: Vec<String>,
        /// Runs of every combination, each with a seed of its own. The 95 % interval of a median needs six
        #[arg(long, value_name = "TIMES", default_value = "1")]
        repeat: u32,
        /// The seed of a run follows from the number of the repeat alone: all combinations meet the same random numbers, so that two
        /// laws, say, are compared under the same losses
        #[arg(long)]
        paired: bool,
        /// The number that is drawn; a column of runs.csv
        #[arg(long, value_name = "COLUMN", default_value = "coordination_last")]
        measure: String,
        /// The sweep's folder; the same command, or one of a larger sweep, goes on with what is there (default: runs/sweep-MISSION)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Fly the sweeps of a study and write its page
    #[command(
        after_help = "Example:\n  mission-control study missions/studies/loss-delay.toml\n\nExit codes: 0 all runs are there, 1 interrupted, 2 a wrong study, 4 files cannot be read or written."
    )]
    Study {
        /// The study file
        study: PathBuf,
        /// The study's folder; the same command goes on with what is there (default: runs/study-NAME)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Fly a mission as real processes: one per vehicle, one for the network between them
    #[command(
        after_help = "Example:\n  mission-control run missions/auv-helix.toml --speed-up 20\n\nExit codes: 0 flown (or left flying, with --attach), 1 aborted or refused, 2 a wrong mission, 3 the fleet cannot be reached,\n  4 files or output cannot be written."
    )]
    Run(RunArgs),
    /// Fly all missions of a folder and show them on one page, with the numbers expected of them (exit code 1: one disagrees)
    #[command(
        after_help = "Example:\n  mission-control gallery missions/thesis --out runs/gallery\n\nExit codes: 0 all numbers agree, 1 one disagrees, 2 a wrong mission or gallery file, 4 files cannot be read or written."
    )]
    Gallery {
        /// The folder: missions, each called as its file, and gallery.toml, which says what figures they make (docs/missions.md,
        /// "A gallery of your own")
        missions: PathBuf,
        /// Where the page goes
        #[arg(long, value_name = "DIR", default_value = "runs/gallery")]
        out: PathBuf,
    },
    /// Set the formation speed of the fleet under way
    #[command(
        after_help = "Example:\n  mission-control speed 0.4\n\nExit codes: 0 taken, 1 the fleet refused it, 3 the fleet cannot be reached."
    )]
    Speed {
        /// The speed v_L (units of xi per s)
        #[arg(allow_negative_numbers = true, value_parser = number)]
        speed: f64,
        #[command(flatten)]
        fleet: FleetArgs,
    },
    /// Tell how the fleet is
    #[command(
        after_help = "Example:\n  mission-control status --json\n\nExit codes: 0 told, 3 the fleet cannot be reached, 4 output cannot be written."
    )]
    Status {
        /// JSON for a pipe
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        fleet: FleetArgs,
    },
    /// End the flight under way
    #[command(
        after_help = "Example:\n  mission-control stop --attach tcp/127.0.0.1:7447\n\nExit codes: 0 stopped, 1 the fleet refused it, 3 the fleet cannot be reached."
    )]
    Stop {
        #[command(flatten)]
        fleet: FleetArgs,
    },
    /// Make summary, figures and report of a run again; its recording too, if mission-control was killed
    #[command(
        after_help = "A vehicle that was out of reach when the logs were collected keeps its own in LOGS/DIGEST, where LOGS is what its\n\
        vehicle-node was told by --logs. Bring the folder here and name it; the recording is merged again.\n\n\
        Example:\n  mission-control report runs/auv-helix-2026-01-31-120000\n  \
        mission-control report runs/auv-helix-2026-01-31-120000 --logs auv3-logs\n\n\
        Exit codes: 0 made, 4 files cannot be read or written, or no log could be added."
    )]
    Report {
        /// The run folder
        run: PathBuf,
        /// First add the logs that the run lacks from this folder (as --logs of vehicle-node names it), or this log; those of
        /// another mission or flight are refused
        #[arg(long, value_name = "DIR")]
        logs: Option<PathBuf>,
    },
    /// Write a run's recording in another format
    #[command(
        after_help = "Example:\n  mission-control export runs/auv-helix-2026-01-31-120000 --format csv --out csv\n\nExit codes: 0 written, 4 files cannot be read or written."
    )]
    Export {
        /// The run folder, or a recording
        run: PathBuf,
        /// The format
        #[arg(long, value_enum, default_value = "csv")]
        format: Format,
        /// Where to (default: the run folder)
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare two runs: equal, or the first message or state in which they part
    #[command(
        after_help = "Example:\n  mission-control diff runs/simulated runs/stepped\n\nExit codes: 0 equal, 1 different, or equal only as far as one goes that is cut off, 4 files cannot be read."
    )]
    Diff {
        /// A run folder, or a recording
        a: PathBuf,
        /// Another
        b: PathBuf,
    },
    /// Make a whole recording of one that was cut off, or of the logs of a run that was killed
    #[command(
        after_help = "Example:\n  mission-control recover runs/killed\n  mission-control recover logs/auv1.mcap --out auv1.mcap\n\nExit codes: 0 made, 4 files cannot be read or written, or nothing could be saved."
    )]
    Recover {
        /// The recording that was cut off, or the folder of a run whose mission-control was killed
        recording: PathBuf,
        /// The whole one (default: NAME-recovered.mcap beside it)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Search the worst switching signal that brief connectivity losses admit, and save the mission with it
    #[command(
        after_help = "A signal is admitted if in every window of length t the vehicles are not connected for at most\n\
        alpha t + (1 - alpha) T_0, and the network changes no faster than the dwell time (Definition 4.3).\n\
        Half of the flights go to signals to begin with: the mission's own if it is admitted, periodic extremes and random\n\
        losses; the rest to changes of the worst. What is found is no milder than any that was flown; that there is no\n\
        worse one is not shown.\n\n\
        Example:\n  mission-control worst missions/brief-losses.toml --alpha 0.75 --t0 7.5 --dwell 2.5\n\n\
        Exit codes: 0 found, 1 interrupted (the worst so far is saved), 2 a wrong mission or number, or --out is a file that no search made,\n  \
        4 output cannot be written."
    )]
    Worst(WorstArgs),
    /// Print the lines of a GeoJSON file as paths in metres, to paste into a mission
    #[command(
        after_help = "Example:\n  mission-control waypoints lanes.geojson --origin=-9.13,38.69\n\nExit codes: 0 printed, 2 no GeoJSON, no line in it, or none that makes a path, 4 output cannot be written."
    )]
    Waypoints {
        /// The GeoJSON file
        file: PathBuf,
        /// Where x, y and z are zero, the longitude first (default: the first position, at the height zero)
        #[arg(long, value_name = "LON,LAT[,HEIGHT]", value_parser = waypoints::place, allow_hyphen_values = true)]
        origin: Option<Place>,
    },
    /// Print the JSON schema of the mission file, for editors
    #[command(
        after_help = "Example:\n  mission-control schema > missions/mission.schema.json\n\nExit codes: 0 printed, 4 output cannot be written."
    )]
    Schema,
    #[command(hide = true)]
    VehicleNode(vehicle_node::program::Args),
    #[command(hide = true)]
    NetworkEmulator(network_emulator::program::Args),
}

/// Why a command ends, and with which exit code.
struct End(u8, String);

/// How a command ends.
type Ended = Result<ExitCode, End>;

/// Runs a command to its end.
pub fn main(cli: Cli) -> ExitCode {
    match run(cli.command) {
        Ok(_) if bus::console::lost() => {
            bus::remark!("cannot write to standard output; what was to be told is lost");
            ExitCode::from(4)
        }
        Ok(code) => code,
        Err(End(code, reason)) => {
            bus::remark!("{reason}");
            ExitCode::from(code)
        }
    }
}

fn run(what: What) -> Ended {
    match what {
        What::Check { mission, json, graph, figures } => mission::check(&mission, json, graph, figures.as_deref()),
        What::Simulate { mission, out, sets, seed, json } => {
            flight::simulate(&mission, out.as_deref(), &sets, seed, json)
        }
        What::Sweep { mission, sets, repeat, paired, measure, out } => {
            many::sweep(&mission, &sets, repeat, paired, &measure, out)
        }
        What::Study { study, out } => many::study(&study, out),
        What::Run(args) => flight::run(args),
        What::Gallery { missions, out } => many::gallery(&missions, &out),
        What::Speed { speed, fleet } => fleet::speed(speed, &fleet.attach),
        What::Status { json, fleet } => fleet::status(json, &fleet.attach),
        What::Stop { fleet } => fleet::stop(&fleet.attach),
        What::Report { run, logs } => recordings::report(&run, logs.as_deref()),
        What::Export { run, format, out } => recordings::export(&run, format, out),
        What::Diff { a, b } => recordings::diff(&a, &b),
        What::Recover { recording, out } => recordings::recover(&recording, out),
        What::Worst(args) => worst::worst(&args),
        What::Waypoints { file, origin } => mission::waypoints(&file, origin),
        What::Schema => mission::schema(),
        What::VehicleNode(args) => Ok(vehicle_node::program::run(args)),
        What::NetworkEmulator(args) => Ok(network_emulator::program::run(args)),
    }
}

/// A number, as given on a command line.
fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "allowed: a number, such as 0.4".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of a wrong command.
    fn refused(words: &[&str]) -> String {
        let words = ["mission-control"].iter().chain(words);
        Cli::try_parse_from(words).map(|_| ()).expect_err("wrong").to_string()
    }

    #[test]
    fn a_number_that_is_none_is_told_what_is_allowed() {
        let speed = refused(&["speed", "abc"]);
        assert!(speed.contains("'abc'") && speed.contains("allowed: a number, such as 0.4"), "{speed}");
        for factor in ["0", "abc", "-1", "1001", "nan"] {
            let said = refused(&["run", "m.toml", "--speed-up", factor]);
            assert!(said.contains(&format!("'{factor}'")) && said.contains("allowed: 0.001 to 1000"), "{said}");
        }
    }
}
