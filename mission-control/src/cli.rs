//! The command line of mission-control.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bus::console::StopFlag;
use bus::setup::Endpoint;
use clap::{Parser, Subcommand, ValueEnum};
use common::mission::Mission;
use common::path::geodesy::Place;
use common::wire::fleet::{FromFleet, Pace, ToFleet};
use common::wire::vehicle::{ClockPlan, Phase};

use crate::console::{Count, Progress};
use crate::gallery::{GALLERY, Gallery};
use crate::results::report::told;
use crate::results::{ClockVerdict, Summary, TheoryRow, compare as compare_runs, export_csv, network_section};
use crate::run::{Failure, Plan, fly};
use crate::sweep::measure::index_of;
use crate::sweep::plan::{self, Plan as SweepPlan};
use crate::sweep::setting::Setting;
use crate::sweep::study::Study;
use crate::{folder, operator, rehearse, theory, waypoints, worst};

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
        /// Also draw what theory gives without a run, as SVG files
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
        /// Another value for a key of the mission file, such as network.loss=0.3; may be repeated
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
        after_help = "Example:\n  mission-control sweep tests/missions/loss-delay.toml --set network.loss.bernoulli.probability=0:0.8:0.2 --repeat 5\n\nExit codes: 0 all runs are there, 1 interrupted, 2 a wrong mission or key, 4 files cannot be read or written."
    )]
    Sweep {
        /// The mission file
        mission: PathBuf,
        /// A key of the mission file with its values: KEY=FROM:TO:STEP or KEY=VALUE,VALUE; may be repeated. For short:
        /// network.loss, network.delay, and coordination.GAIN for a gain of the mission's law
        #[arg(long = "set", value_name = "KEY=VALUES", required = true)]
        sets: Vec<String>,
        /// Runs of every combination, each with a seed of its own
        #[arg(long, value_name = "TIMES", default_value = "1")]
        repeat: u32,
        /// The number that is drawn; a column of runs.csv
        #[arg(long, value_name = "COLUMN", default_value = "coordination_last")]
        measure: String,
        /// The sweep's folder; the same command goes on with what is there (default: runs/sweep-MISSION)
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
        /// The folder: missions, and gallery.toml, which says what figures they make
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
        #[arg(allow_negative_numbers = true)]
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
        after_help = "Example:\n  mission-control report runs/auv-helix-2026-01-31-120000\n\nExit codes: 0 made, 4 files cannot be read or written."
    )]
    Report {
        /// The run folder
        run: PathBuf,
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
        Example:\n  mission-control worst missions/talk/naive.toml --alpha 0.5 --t0 5 --dwell 1\n\n\
        Exit codes: 0 found, 2 a wrong mission or number, 4 output cannot be written."
    )]
    Worst(WorstArgs),
    /// Print the lines of a GeoJSON file as paths in metres, to paste into a mission
    #[command(
        after_help = "Example:\n  mission-control waypoints lanes.geojson --origin=-9.13,38.69\n\nExit codes: 0 printed, 2 no GeoJSON, or no line in it, 4 output cannot be written."
    )]
    Waypoints {
        /// The GeoJSON file
        file: PathBuf,
        /// Where x, y and z are zero (default: the first position, at the height zero)
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

#[derive(Debug, clap::Args)]
struct RunArgs {
    /// The mission file
    mission: PathBuf,
    /// The run folder (default: runs/MISSION-TIME)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fly with a fleet that is already up, at this endpoint (default: tcp/127.0.0.1:7447). One run at a time conducts it:
    /// another is queued for 2.5 s and flies if its turn comes, else it gives up
    #[arg(long, value_name = "tcp/HOST:PORT", num_args = 0..=1, default_missing_value = "tcp/127.0.0.1:7447", env = "CPF_ATTACH", value_parser = attached)]
    attach: Option<Endpoint>,
    /// Where the own network-emulator listens (default: tcp/127.0.0.1:7447, or a free port if that is taken)
    #[arg(long, value_name = "tcp/HOST:PORT", conflicts_with = "attach")]
    listen: Option<Endpoint>,
    /// Mission seconds per second of wall clock
    #[arg(long, value_name = "FACTOR", default_value = "1", conflicts_with = "stepped")]
    speed_up: f64,
    /// Advance in lock step, as fast as the processes can; equals `simulate` bit for bit
    #[arg(long)]
    stepped: bool,
    /// Give up when the fleet is not complete after this long (s) (default: never with --attach, 60 s else)
    #[arg(long, value_name = "SECONDS", value_parser = bus::console::patience)]
    patience: Option<Duration>,
    /// JSON for a pipe
    #[arg(long)]
    json: bool,
}

/// An endpoint after `--attach`, which takes one or none: what follows it may be meant as the mission.
fn attached(text: &str) -> Result<Endpoint, String> {
    let hint = || match Path::new(text).extension() {
        Some(ending) if ending == "toml" => {
            "; the endpoint after --attach may be left out, and a mission then comes before it: \
                                             mission-control run MISSION --attach, or --attach=tcp/HOST:PORT MISSION"
        }
        _ => "",
    };
    text.parse().map_err(|error| format!("{error}{}", hint()))
}

#[derive(Debug, clap::Args)]
struct WorstArgs {
    /// The mission file; if its own switching is admitted, the search begins with it
    mission: PathBuf,
    /// Share of the time that may be lost in the long run, 0 to below 1
    #[arg(long, allow_negative_numbers = true)]
    alpha: f64,
    /// Connectivity-loss bound T_0 (s)
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    t0: f64,
    /// Least time between two changes (s)
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    dwell: f64,
    /// What counts as hurt
    #[arg(long, value_enum, default_value = "end")]
    hurt: worst::Hurt,
    /// How many flights the search may take
    #[arg(long, default_value = "400")]
    flights: usize,
    /// Seed of the search
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Where the worst mission goes (default: worst-MISSION.toml)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// JSON for a pipe
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
struct FleetArgs {
    /// The fleet's network-emulator; given up when it is not found within 3 s, or does not answer within 5 s
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/127.0.0.1:7447", env = "CPF_ATTACH")]
    attach: Endpoint,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// vehicles.csv, links.csv and topology.csv
    Csv,
    /// network.toml: when links were up and what they lost, as a section of a mission file
    Network,
}

/// How long a single command waits for the fleet to appear.
const COMMAND_PATIENCE: Duration = Duration::from_secs(3);

/// Why a command ends, and with which exit code.
struct End(u8, String);

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
        What::Check { mission, json, graph, figures } => check(&mission, json, graph, figures.as_deref()),
        What::Simulate { mission, out, sets, seed, json } => simulate(&mission, out.as_deref(), &sets, seed, json),
        What::Sweep { mission, sets, repeat, measure, out } => sweep(&mission, &sets, repeat, &measure, out),
        What::Study { study: path, out } => study(&path, out),
        What::Run(args) => run_fleet(args),
        What::Gallery { missions, out } => gallery(&missions, &out),
        What::Speed { speed, fleet } => speed_command(speed, &fleet.attach),
        What::Status { json, fleet } => status(json, &fleet.attach),
        What::Stop { fleet } => stop(&fleet.attach),
        What::Report { run } => report(&run),
        What::Export { run, format, out } => export(&run, format, out),
        What::Diff { a, b } => compare(&a, &b),
        What::Recover { recording, out } => recover(&recording, out),
        What::Worst(args) => search(&args),
        What::Waypoints { file, origin } => waypoints_of(&file, origin),
        What::Schema => {
            bus::tell!("{:#}", common::mission::schema());
            Ok(ExitCode::SUCCESS)
        }
        What::VehicleNode(args) => Ok(vehicle_node::program::run(args)),
        What::NetworkEmulator(args) => Ok(network_emulator::program::run(args)),
    }
}

/// A mission that shall be flown.
fn load(path: &Path) -> Result<Arc<Mission>, End> {
    folder::load(path).map_err(|reason| End(2, format!("{reason}; nothing was started")))
}

/// Longest GeoJSON file (bytes); of a longer one the begin is read, which is no GeoJSON.
const LONGEST_GEOJSON: u64 = 64 << 20;

/// The text of a file, but not more of it than that.
fn read_bounded(path: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    let file = std::fs::File::open(path)?;
    std::io::Read::read_to_string(&mut std::io::Read::take(file, LONGEST_GEOJSON), &mut text)?;
    Ok(text)
}

fn check(path: &Path, json: bool, graph: bool, figures: Option<&Path>) -> Ended {
    let mission = folder::load(path).map_err(|reason| End(2, reason))?;
    let rows = theory::rows(&mission, None);
    if json {
        let rows: Vec<_> = rows
            .iter()
            .map(|row| {
                serde_json::json!({
                    "name": row.name, "condition": row.condition, "value": row.value, "holds": row.holds,
                    "predicted": row.predicted, "guaranteed_rate": row.guaranteed_rate,
                })
            })
            .collect();
        let digest = format!("{:016x}", mission.digest);
        let graph = theory::graph_facts(&mission);
        let all = serde_json::json!({"mission": mission.name, "digest": digest, "theory": rows, "graph": graph});
        bus::tell!("{all:#}");
    } else {
        bus::tell!(
            "{}: {} vehicles, {} directed links, {}",
            mission.name,
            mission.vehicles.len(),
            mission.links.len(),
            mission.end
        );
        print_theory(&rows);
        if graph {
            bus::tell!("  Graph (sections 3.1 and 4.2)");
            for line in theory::graph_facts(&mission).lines() {
                bus::tell!("      {line}");
            }
        }
    }
    if let Some(folder) = figures {
        draw(&mission, folder).map_err(|error| End(4, format!("cannot draw in {}: {error}", folder.display())))?;
    }
    warn(&mission, &rows);
    Ok(ExitCode::SUCCESS)
}

fn draw(mission: &Mission, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for figure in theory::figures(mission) {
        let path = folder.join(figure.name).with_extension("svg");
        std::fs::write(&path, &figure.svg)?;
        bus::remark!("{}: {}", path.display(), figure.caption);
    }
    Ok(())
}

/// A mission that violates a condition flies, with a warning that names it.
fn warn(mission: &Mission, rows: &[TheoryRow]) {
    for text in mission.advice() {
        bus::remark!("warning: {text}");
    }
    for row in rows.iter().filter(|row| row.holds == Some(false)) {
        let here = if row.value.is_empty() { String::new() } else { format!("; here: {}", row.value) };
        bus::remark!("warning: not covered by theory: {}: needs {}{here}", row.name, row.condition);
    }
}

fn print_theory(rows: &[TheoryRow]) {
    for row in rows {
        let holds = match row.holds {
            Some(true) => "  [holds]",
            Some(false) => "  [does not hold]",
            None => "",
        };
        bus::tell!("  {}{holds}", row.name);
        let lines = [
            ("needs", &row.condition),
            ("here", &row.value),
            ("predicts", &row.predicted),
            ("measured", &row.measured),
        ];
        for (label, text) in lines {
            let text = told(text);
            if !text.is_empty() && text != "–" {
                bus::tell!("      {label:<9} {text}");
            }
        }
    }
}

fn simulate(path: &Path, out: Option<&Path>, sets: &[String], seed: Option<u64>, json: bool) -> Ended {
    let mission = changed(load(path)?, sets, seed).map_err(|reason| End(2, reason))?;
    warn(&mission, &theory::rows(&mission, None));
    let (folder, outcome, summary) = rehearse::rehearse(&mission, out).map_err(|error| End(4, error))?;
    let sound = outcome.phase == Phase::Finished && outcome.aborted.is_empty();
    tell(&mission, &folder, outcome.phase, sound, &summary, None, json)
}

/// The mission with some of its keys at other values.
fn changed(mission: Arc<Mission>, sets: &[String], seed: Option<u64>) -> Result<Arc<Mission>, String> {
    let mut settings = sets.iter().map(|text| Setting::parse(text)).collect::<Result<Vec<_>, _>>()?;
    if let Some(several) = settings.iter().find(|setting| setting.values.len() > 1) {
        return Err(format!("--set {}: found several values; allowed: one (several are for sweep)", several.key));
    }
    settings.extend(seed.map(|seed| Setting::parse(&format!("seed={seed}"))).transpose()?);
    if settings.is_empty() {
        return Ok(mission);
    }
    let settings: Vec<Setting> = settings.into_iter().map(|setting| setting.of(&mission.text)).collect();
    let changes: Vec<_> = settings.iter().map(|setting| (setting.key.as_str(), &setting.values[0])).collect();
    let text = plan::apply(&mission.text, &changes)?;
    Mission::parse(folder::MISSION, &text).map(Arc::new).map_err(|faults| faults.to_string())
}

fn sweep(path: &Path, sets: &[String], repeat: u32, measure: &str, out: Option<PathBuf>) -> Ended {
    let refused = |reason: String| End(2, reason);
    let mission = load(path)?;
    let out = out.unwrap_or_else(|| PathBuf::from(format!("runs/sweep-{}", mission.name)));
    let settings: Vec<Setting> =
        sets.iter().map(|text| Setting::parse(text)).collect::<Result<_, _>>().map_err(refused)?;
    let measure = index_of(measure).map_err(|reason| End(2, format!("--measure: {reason}")))?;
    let plan = SweepPlan::new(&path.display().to_string(), mission, settings, repeat).map_err(refused)?;
    let stop = StopFlag::on_signals();
    stop.arm();
    let mut progress = Count::new("sweeping", plan.cells.len() * plan.repeats as usize);
    let swept = crate::sweep::sweep(&plan, &out, |over, _| {
        progress.reach(over, "");
        !stop.is_raised()
    });
    progress.done();
    let swept = swept.map_err(|reason| End(4, reason))?;
    if !swept.complete {
        return Err(interrupted(&out));
    }
    let command: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    let command = format!("mission-control {}", command.join(" "));
    crate::sweep::show(&plan, &swept, measure, &command, &out).map_err(|reason| End(4, reason))?;
    bus::tell!(
        "{} runs, {} of them new: {}",
        swept.runs.len(),
        swept.runs.len() - swept.found,
        out.join("README.md").display()
    );
    Ok(ExitCode::SUCCESS)
}

fn study(path: &Path, out: Option<PathBuf>) -> Ended {
    let study = Study::read(path).map_err(|reason| End(2, reason))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let out = out.unwrap_or_else(|| PathBuf::from(format!("runs/study-{stem}")));
    let stop = StopFlag::on_signals();
    stop.arm();
    let mut progress = Count::new("sweeping", study.runs());
    let command = format!("mission-control study {}", quoted(path.display().to_string()));
    let complete = study.make(&out, &command, |over, _| {
        progress.reach(over, "");
        !stop.is_raised()
    });
    progress.done();
    if !complete.map_err(|reason| End(4, reason))? {
        return Err(interrupted(&out));
    }
    bus::tell!("{} runs: {}", study.runs(), out.join("README.md").display());
    Ok(ExitCode::SUCCESS)
}

fn interrupted(out: &Path) -> End {
    End(1, format!("interrupted; {} keeps the runs that are over, and the same command goes on", out.display()))
}

/// A word of a command as a shell takes it.
fn quoted(word: String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-=+:,/[]".contains(c);
    if word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

fn run_fleet(args: RunArgs) -> Ended {
    let mission = load(&args.mission)?;
    if !ClockPlan::SPEED_UPS.contains(&args.speed_up) {
        return Err(End(2, format!("--speed-up: found {:e}; allowed: 0.001 to 1000", args.speed_up)));
    }
    warn(&mission, &theory::rows(&mission, None));
    let pace = if args.stepped { Pace::Stepped } else { Pace::Real { speed_up: args.speed_up } };
    let plan = Plan {
        mission: mission.clone(),
        out: args.out,
        attach: args.attach,
        listen: args.listen,
        pace,
        patience: args.patience,
    };
    match fly(&plan) {
        Ok(flown) => {
            let clock = flown.clock.verdict.as_ref();
            tell(&mission, &flown.folder, flown.phase, flown.sound, &flown.summary, clock, args.json)
        }
        Err(Failure::Unreachable(reason)) => Err(End(3, reason)),
        Err(Failure::Refused(reason)) => Err(End(1, reason)),
        Err(Failure::Files(reason)) => Err(End(4, reason)),
        Err(Failure::Detached(reason)) => {
            bus::remark!("{reason}");
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// What came of a flight, for a person or a pipe.
fn tell(
    mission: &Mission,
    folder: &Path,
    phase: Phase,
    sound: bool,
    summary: &Summary,
    clock: Option<&ClockVerdict>,
    json: bool,
) -> Ended {
    // On standard error, so that a pipe gets the numbers alone; who gave up and what is missing is among them.
    for text in &summary.warnings {
        bus::remark!("warning: {text}");
    }
    if json {
        bus::tell!("{}", serde_json::to_string_pretty(summary).map_err(|error| End(4, error.to_string()))?);
    } else {
        bus::tell!("{} {}: {} s of mission time", mission.name, phase.as_str(), summary.duration_s);
        let rows = theory::rows(mission, Some(summary));
        print_theory(&rows);
        for row in rows.iter().filter(|row| row.is_below()) {
            bus::remark!("warning: {}: {}, although its conditions hold", row.name, row.measured);
        }
        let m = &summary.fleet.messages;
        let more: String = [
            (m.out_of_range, "out of range"),
            (m.half_duplex, "unheard while speaking"),
            (m.collision, "collided"),
            (m.corrupt, "corrupt"),
            (m.receiver_absent, "with the receiver absent"),
        ]
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what} + "))
        .collect();
        bus::tell!(
            "  Messages: {} sent = {} delivered + {} lost + {} with the link down + {} with the queue full + {more}{} in flight",
            m.sent,
            m.delivered,
            m.lost,
            m.link_down,
            m.queue_full,
            m.in_flight
        );
        if m.copied + m.copy_dropped + m.copy_in_flight > 0 {
            let (copied, dropped, in_flight) = (m.copied, m.copy_dropped, m.copy_in_flight);
            bus::tell!("  Second copies: {copied} delivered, {dropped} dropped, {in_flight} in flight");
        }
        if let Some(clock) = clock {
            bus::tell!("  On the clock: {}", clock.text);
        }
        bus::tell!("  {}", coordination_at_end(summary));
        bus::tell!("report: {}", folder.join("report.html").display());
    }
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The coordination error at the end of a flight, or what is known instead.
fn coordination_at_end(summary: &Summary) -> String {
    let coordination = &summary.fleet.coordination;
    let value = match coordination.last.is_finite() {
        true => format!("{:.2e}", coordination.last),
        false => "beyond what can be told".to_string(),
    };
    match (coordination.last_s, coordination.early(summary.duration_s)) {
        (None, _) => "Coordination error at the end: unknown, the vehicles were never recorded together".to_string(),
        (_, Some(at)) => format!("Coordination error at {at} s, when all were last recorded: {value}"),
        _ => format!("Coordination error at the end: {value}"),
    }
}

fn ask(endpoint: &Endpoint, question: &ToFleet) -> Result<FromFleet, End> {
    match operator::ask(endpoint, question, COMMAND_PATIENCE) {
        Ok(FromFleet::Refused { reason }) => Err(End(1, reason)),
        Ok(answer) => Ok(answer),
        Err(error) => Err(End(3, error)),
    }
}

fn speed_command(speed: f64, endpoint: &Endpoint) -> Ended {
    if let FromFleet::SpeedTaken { at, speed } = ask(endpoint, &ToFleet::Speed { speed })? {
        bus::tell!("formation speed {speed} from {at} on");
    }
    Ok(ExitCode::SUCCESS)
}

fn status(json: bool, endpoint: &Endpoint) -> Ended {
    if let FromFleet::Status(status) = ask(endpoint, &ToFleet::Status)? {
        if json {
            let vehicles: Vec<_> = status
                .vehicles
                .iter()
                .map(|v| {
                    let said = v.said.map(|(made, xi)| serde_json::json!({"t_s": made.secs(), "xi": xi}));
                    serde_json::json!({
                        "id": v.id, "connected": v.connected, "phase": v.phase.as_str(), "reason": v.reason, "said": said,
                    })
                })
                .collect();
            let [sent, delivered, dropped, in_flight] = status.messages;
            let monitor = Mission::parse("the mission", &status.mission)
                .ok()
                .and_then(|mission| theory::so_far(&mission, &status));
            bus::tell!(
                "{:#}",
                serde_json::json!({
                    "phase": status.phase.as_str(), "now_s": status.now.secs(), "end_s": status.end.secs(),
                    "speed": status.speed, "vehicles": vehicles,
                    "messages": {"sent": sent, "delivered": delivered, "dropped": dropped, "in_flight": in_flight},
                    "monitor": monitor,
                })
            );
        } else {
            bus::tell!("{}", operator::describe(&status).trim_end());
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn stop(endpoint: &Endpoint) -> Ended {
    ask(endpoint, &ToFleet::Stop)?;
    bus::tell!("stopped");
    Ok(ExitCode::SUCCESS)
}

fn gallery(missions: &Path, out: &Path) -> Ended {
    let gallery = Gallery::read(missions).map_err(|reason| End(2, reason))?;
    let mut progress = Count::new("flying", gallery.missions());
    let outcome = gallery.make(out, |name| progress.one_more(name));
    progress.done();
    let outcome = outcome.map_err(|reason| End(4, reason))?;
    for name in &outcome.unused {
        bus::remark!("warning: {name} is in no figure of {GALLERY}");
    }
    for fault in &outcome.faults {
        bus::remark!("{fault}");
    }
    let agree = if outcome.faults.is_empty() { "all agree" } else { "not all agree" };
    bus::tell!(
        "{} figures, {} expected numbers, {agree}: {}",
        outcome.figures,
        outcome.expected,
        out.join("index.html").display()
    );
    Ok(if outcome.faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn report(run: &Path) -> Ended {
    for text in folder::salvage(run).map_err(|error| End(4, error))?.unwrap_or_default() {
        bus::remark!("{text}");
    }
    folder::report(run).map_err(|error| End(4, error))?;
    bus::tell!("report: {}", run.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}

fn waypoints_of(file: &Path, origin: Option<Place>) -> Ended {
    let text = read_bounded(file).map_err(|error| End(2, format!("cannot read {}: {error}", file.display())))?;
    let section =
        waypoints::section(&text, origin).map_err(|reason| End(2, format!("{}: {reason}", file.display())))?;
    bus::tell!("{}", section.trim_end());
    Ok(ExitCode::SUCCESS)
}

fn export(run: &Path, format: Format, out: Option<PathBuf>) -> Ended {
    let recording = folder::recording(run).map_err(|error| End(4, error))?;
    let beside = if run.is_dir() { run } else { run.parent().unwrap_or(Path::new(".")) };
    let out = out.unwrap_or_else(|| beside.to_path_buf());
    let failed = |error: std::io::Error| End(4, format!("cannot export to {}: {error}", out.display()));
    std::fs::create_dir_all(&out).map_err(failed)?;
    match format {
        Format::Csv => {
            export_csv(&recording, &out).map_err(failed)?;
            bus::tell!("{} rows to {}/{{vehicles,links,topology}}.csv", recording.exact.len(), out.display());
        }
        Format::Network => {
            let path = out.join("network.toml");
            let mission = Mission::parse(folder::MISSION, &recording.mission_toml)
                .map_err(|faults| End(4, faults.to_string()))?;
            let section = network_section(&recording.exact, mission.message_period());
            std::fs::write(&path, section).map_err(failed)?;
            bus::tell!("the network of {} rows to {}", recording.exact.len(), path.display());
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn compare(a: &Path, b: &Path) -> Ended {
    let left = folder::recording(a).map_err(|error| End(4, error))?;
    let right = folder::recording(b).map_err(|error| End(4, error))?;
    let [name_a, name_b] = [a, b].map(|path| path.display().to_string());
    let outcome = compare_runs(&left, &right, [&name_a, &name_b]);
    bus::tell!("{}", outcome.text);
    Ok(if outcome.equal { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn search(args: &WorstArgs) -> Ended {
    let mission = load(&args.mission)?;
    let seconds = |name: &str, value: f64, least: f64| match value.is_finite() && value >= least && value <= 1e6 {
        true => Ok(()),
        false => Err(End(2, format!("--{name}: found {value}; allowed: {least} to 1000000 s"))),
    };
    if !(0.0..1.0).contains(&args.alpha) {
        let why = "it is a share of the time, and vehicles that are never connected cannot agree";
        return Err(End(2, format!("--alpha: found {}; allowed: 0 to below 1 ({why})", args.alpha)));
    }
    seconds("t0", args.t0, 0.0)?;
    seconds("dwell", args.dwell, 1e-3)?;
    let quest = worst::Quest {
        allowance: worst::allowance(args.alpha, args.t0, args.dwell),
        hurt: args.hurt,
        flights: args.flights,
        seed: args.seed,
    };
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("worst-{}.toml", mission.name)));
    let progress = Mutex::new(Progress::new(mission.end));
    let tell = |flown: usize| {
        progress.lock().unwrap_or_else(PoisonError::into_inner).counted("searching", flown, args.flights);
    };
    let source = quoted(args.mission.display().to_string());
    let found = worst::worst(&mission, &quest, &source, &out, tell);
    progress.lock().unwrap_or_else(PoisonError::into_inner).done();
    let found = found.map_err(|reason| End(2, reason))?;
    if args.json {
        bus::tell!("{}", serde_json::to_string_pretty(&found).map_err(|error| End(4, error.to_string()))?);
        return Ok(ExitCode::SUCCESS);
    }
    let when = match args.hurt {
        worst::Hurt::End => "at the end",
        worst::Hurt::Mean => "on average",
    };
    bus::tell!("{}: coordination error {when} ({} flights of {})", mission.name, found.flights, mission.end);
    bus::tell!("  at the start          {:.4e}", found.initial);
    bus::tell!("  as the mission is     {:.4e}", found.as_written);
    let decay = match found.rate {
        rate if rate.is_finite() => format!("a decay at {rate:.5} 1/s"),
        f64::INFINITY => "no error is left at the end".to_string(),
        _ => "there is no error at the start that could decay".to_string(),
    };
    bus::tell!("  worst signal found    {:.4e}, {decay}", found.worst);
    match (found.bound, found.guaranteed_rate, found.statement) {
        (Some(bound), Some(rate), Some(statement)) => {
            let beyond = match found.within {
                Some(false) => "; the worst found is beyond that: a defect",
                _ if found.worst > bound => {
                    "; what the worst found is beyond that is within messages in periods and rounding"
                }
                _ => "",
            };
            let times = match found.worst > 0.0 {
                true => format!("{:.3} times the worst found", bound / found.worst),
                false => "none was found".to_string(),
            };
            bus::tell!("  {statement} allows {bound:.4e} {when}, a decay at {rate:.5} 1/s: {times}{beyond}");
        }
        _ => bus::tell!("  no theorem bounds it: {}", found.no_bound.as_deref().unwrap_or("none speaks of it")),
    }
    bus::tell!("saved: {}", found.saved.display());
    Ok(ExitCode::SUCCESS)
}

fn recover(path: &Path, out: Option<PathBuf>) -> Ended {
    if path.is_dir() {
        return recover_run(path, out);
    }
    let out = out.unwrap_or_else(|| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        path.with_file_name(format!("{stem}-recovered.mcap"))
    });
    // What is there may be all that is left: it is never overwritten.
    if out.exists() {
        let text = "is there already and is not overwritten: move it away, or say --out FILE with another name";
        return Err(End(4, format!("{} {text}", out.display())));
    }
    let recovered = bus::recording::recover(path, &out).map_err(|error| End(4, error.to_string()))?;
    if recovered.rows == 0 {
        return Err(End(4, format!("{} holds no row that could be saved", path.display())));
    }
    if let Some(damage) = &recovered.damage {
        bus::remark!("warning: {} is damaged, and what is damaged is left out: {damage}", path.display());
    }
    bus::tell!("{} rows to {}", recovered.rows, out.display());
    Ok(ExitCode::SUCCESS)
}

/// Makes the recording of a run whose mission-control was killed, of the logs of its processes.
fn recover_run(run: &Path, out: Option<PathBuf>) -> Ended {
    if out.is_some() {
        return Err(End(2, "--out: found with a run folder; allowed: with a recording".to_string()));
    }
    let recording = run.join(folder::RECORDING);
    match folder::salvage(run).map_err(|error| End(4, error))? {
        Some(notes) => {
            for text in &notes {
                bus::remark!("{text}");
            }
            bus::tell!("merged to {}; next: mission-control report {}", recording.display(), run.display());
            Ok(ExitCode::SUCCESS)
        }
        None if recording.exists() => {
            bus::tell!("{} is there already", recording.display());
            Ok(ExitCode::SUCCESS)
        }
        None => Err(End(4, format!("{} holds no logs of a run of its own that could be merged", run.display()))),
    }
}
