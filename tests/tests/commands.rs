//! The commands of mission-control at a terminal and in a pipe: what they say, to which stream, with which exit code.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use cpf_tests::{Ground, PATIENCE, in_repository, mission_text, program, until, with};
use serde_json::Value;

/// What an MCAP file ends with, if it was closed.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The flagship, but short.
fn short(duration_s: &str) -> String {
    with(&mission_text("missions/auv-helix.toml"), "duration_s = 800.0", &format!("duration_s = {duration_s}"))
}

/// Keys that a JSON object must have.
fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} in {value:#}");
    }
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

// --- JSON for a pipe -----------------------------------------------------------------------------------------------------

#[test]
fn what_check_simulate_and_run_say_to_a_pipe_is_json_alone() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("20.0"));
    let checked = json(&ground.controlled(0, &["check", "mission.toml", "--json"]));
    assert_keys(&checked, &["mission", "digest", "theory"]);
    assert_keys(&checked["theory"][0], &["name", "condition", "value", "holds", "predicted", "guaranteed_rate"]);

    let simulate = ["simulate", "mission.toml", "--json", "--out", "simulated"];
    let run = ["run", "mission.toml", "--json", "--stepped", "--listen", "tcp/127.0.0.1:0", "--out", "stepped"];
    let [simulated, stepped] = [&simulate[..], &run].map(|arguments| json(&ground.controlled(0, arguments)));
    let keys = ["mission", "digest", "seed", "duration_s", "complete", "fleet", "vehicles", "links", "warnings"];
    assert_keys(&simulated, &keys);
    assert_keys(&simulated["fleet"]["coordination"], &["initial", "largest", "last", "last_s", "settled_s", "fit"]);
    assert_eq!(simulated, stepped);
    assert_eq!(simulated, ground.json("simulated/summary.json"));

    // What a run was made with.
    let host = ground.json("stepped/host.json");
    assert_keys(&host, &["how", "command", "speed_up", "version", "rustc", "zenoh", "host", "os", "cpu", "cores"]);
    assert_eq!(host["command"][1], "run");
    assert!(host["rustc"].as_str().is_some_and(|text| text.starts_with("rustc 1.")), "{host:#}");
    assert_eq!(host["zenoh"], "1.10.2");
}

#[test]
fn what_cannot_be_written_is_exit_code_4() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("1.0"));
    for arguments in [&["simulate", "mission.toml", "--json", "--out", "run"][..], &["check", "mission.toml"]] {
        let full = OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let said = Command::new(program("mission-control"))
            .args(arguments)
            .current_dir(ground.path(""))
            .stdout(full)
            .output()
            .expect("starts");
        let text = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(4), "{text}");
        assert!(text.contains("cannot write to standard output"), "{text}");
    }
    let search = ["worst", "mission.toml", "--alpha", "0.1", "--t0", "0.2", "--dwell", "0.1", "--flights", "1"];
    let mut worst = ground.control(&[&search[..], &["--out", "nowhere/worst.toml"]].concat());
    worst.ends_with(4);
    assert!(worst.stderr().contains("cannot write nowhere/worst.toml"), "{}", worst.stderr());
}

// --- for a person --------------------------------------------------------------------------------------------------------

#[test]
fn a_terminal_gets_a_bar_and_a_pipe_plain_lines() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("200.0"));
    let mut piped = ground.control(&["simulate", "mission.toml", "--out", "piped"]);
    piped.ends_with(0);
    let said = piped.stderr();
    assert!(said.contains("simulating: ") && said.contains(" of 200 s"), "{said}");
    assert!(!said.contains('\u{1b}') && !said.contains('\r'), "{said:?}");

    // script(1) gives its child a terminal.
    let command = format!("{} simulate mission.toml --out shown", program("mission-control").display());
    let mut script = Command::new("script");
    if Command::new("script").arg("--version").output().is_err() {
        // Past the test harness, which shows the output of failed tests only.
        let _ = writeln!(std::io::stderr(), "commands: skipped: script(1) is not installed");
        return;
    }
    let mut shown = ground.start("script", script.args(["-qec", &command, "typescript"]).env("TERM", "xterm"));
    shown.ends_with(0);
    let said = fs::read_to_string(ground.path("typescript")).expect("a typescript");
    assert!(said.contains('\u{1b}') && said.contains("simulating [") && said.contains('%'), "{said:?}");
    assert!(!said.contains("simulating: "), "{said:?}");
}

#[test]
fn the_ending_of_a_flight_begins_with_the_verdict_of_its_report() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("200.0"));
    let mut simulated = ground.control(&["simulate", "mission.toml", "--out", "run"]);
    simulated.ends_with(0);
    let said = simulated.stdout();
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines[0].starts_with("auv-helix finished: 200 s"), "{said}");
    let verdict = lines[1].trim_start();
    assert!(verdict.starts_with("Coordinated after ") || verdict.starts_with("Not coordinated at the end"), "{said}");
    let report = fs::read_to_string(ground.path("run/report.html")).expect("a report");
    let begin = verdict.split(':').next().expect("a begin");
    assert!(report.contains(&format!("<strong>{begin}</strong>")), "{verdict}");
    assert!(said.contains("  [covered]") && !said.contains("holds]"), "{said}");
    for line in said.lines().chain(simulated.stderr().lines()) {
        assert_eq!(line, line.trim_end());
    }
}

#[test]
fn a_paired_sweep_flies_every_combination_with_the_same_seeds() {
    let ground = Ground::new();
    ground.file("mission.toml", &mission_text("tests/missions/loss-delay.toml"));
    let law = "coordination.law={ switching = { gain = 0.15 } },{ delayed_estimating = { gain = 0.15 } }";
    let sets = ["--set", law, "--set", "network.loss=0.3,0.5", "--set", "vehicles.v1.start.x_m=2"];
    ground.controlled(
        0,
        &[&["sweep", "mission.toml", "--repeat", "2", "--paired", "--out", "swept"][..], &sets].concat(),
    );
    let table = fs::read_to_string(ground.path("swept/runs.csv")).expect("a table");
    // Three swept keys, the repeat, the seed.
    let row = |line: &str| line.split(',').skip(3).take(2).map(str::to_owned).collect::<Vec<String>>();
    let seeds: Vec<(String, String)> =
        table.lines().skip(1).map(row).map(|row| (row[0].clone(), row[1].clone())).collect();
    assert_eq!(seeds.len(), 8);
    for repeat in ["0", "1"] {
        let of: Vec<&String> = seeds.iter().filter(|(r, _)| r == repeat).map(|(_, seed)| seed).collect();
        assert!(of.len() == 4 && of.iter().all(|seed| *seed == of[0]), "{seeds:?}");
    }
    let picture = fs::read_to_string(ground.path("swept/sweep.svg")).expect("a picture");
    assert!(picture.contains(">switching<") && picture.contains(">delayed_estimating<"), "{picture}");
}

#[test]
fn the_help_of_every_program_has_an_example() {
    for name in ["mission-control", "network-emulator", "vehicle-node"] {
        let output = Command::new(program(name)).arg("--help").output().expect("starts");
        let help = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(help.contains("mission-control run missions/auv-helix.toml"), "{name}: {help}");
        assert!(name == "mission-control" || help.contains("Example, one terminal each:"), "{name}: {help}");
    }
}

#[test]
fn a_mission_behind_attach_is_no_endpoint_and_the_way_out_is_told() {
    let ground = Ground::new();
    let mut wrong = ground.control(&["run", "--attach", "missions/auv-helix.toml"]);
    wrong.ends_with(2);
    let said = wrong.stderr();
    assert!(said.contains("mission-control run MISSION --attach") && said.contains("--attach=tcp/HOST:PORT"), "{said}");
    let mut wrong = ground.control(&["run", "mission.toml", "--attach", "tcp/nowhere"]);
    wrong.ends_with(2);
    assert!(wrong.stderr().contains("it has no port") && !wrong.stderr().contains("MISSION --attach"));
}

#[test]
fn the_help_of_each_command_has_an_example_and_its_exit_codes() {
    let ground = Ground::new();
    let help = ground.controlled(0, &["--help"]);
    let names = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<&str> = names.filter_map(|line| line.strip_prefix("  ")?.split(' ').next()).collect();
    let names: Vec<&str> = names.into_iter().filter(|name| !name.is_empty() && *name != "help").collect();
    assert!(names.len() >= 16, "{names:?}");
    for name in names {
        let help = ground.controlled(0, &[name, "--help"]);
        assert!(help.contains(&format!("Example:\n  mission-control {name}")), "{help}");
        assert!(help.contains("Exit codes: 0 "), "{help}");
        let files = help.split_whitespace().filter(|word| word.starts_with("missions/") || word.starts_with("tests/"));
        for file in files {
            assert!(in_repository(file).exists(), "{file} in the help of {name}");
        }
    }
}

#[test]
fn numbers_beyond_sense_are_warned_of_or_refused_and_no_report_has_one() {
    let ground = Ground::new();
    let text = short("20.0");
    ground.file("steep.toml", &with(&text, "gain = 0.1", "gain = 1e6"));
    let mut control = ground.control(&["simulate", "steep.toml", "--out", "steep"]);
    control.ends(PATIENCE);
    let said = control.stderr();
    assert!(said.contains("warning: coordination.law: a control period of 0.05 s"), "{said}");
    let page = fs::read_to_string(ground.path("steep/report.html")).expect("a report");
    let words = |text: &str| text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "NaN" || word == "inf");
    let told = control.stdout();
    assert!(!words(&page) && !words(&told), "{told}");
    let longest = |text: &str| text.split(|c: char| !c.is_ascii_digit()).map(str::len).max();
    assert!(longest(&told) < Some(30), "no number of a hundred digits: {told}");

    ground.file("far.toml", &with(&text, "x_m = 5.0, y_m = -15.0", "x_m = 5e200, y_m = -15.0"));
    let mut control = ground.control(&["check", "far.toml"]);
    control.ends_with(2);
    let said = control.stderr();
    assert!(said.contains("vehicles[1].start.x_m: found 5e200; allowed: -10000000 to 10000000 m"), "{said}");
    assert!(said.ends_with("1 fault in far.toml\n"), "check starts nothing anyway: {said}");
}

// --- recordings that are cut off -----------------------------------------------------------------------------------------

#[test]
fn diff_recover_and_export_take_what_is_there() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("100.0"));
    ground.controlled(0, &["simulate", "mission.toml", "--out", "a"]);
    ground.controlled(0, &["simulate", "mission.toml", "--out", "b"]);
    let said = ground.controlled(0, &["diff", "a", "b"]);
    assert!(said.starts_with("equal (") && said.ends_with(" rows)\n"), "{said}");

    let whole = fs::read(ground.path("a/recording.mcap")).expect("recorded");
    fs::write(ground.path("cut.mcap"), &whole[..whole.len() * 2 / 3]).expect("written");
    for (pair, name) in [(["a", "cut.mcap"], "cut.mcap"), (["cut.mcap", "a"], "cut.mcap")] {
        let said = ground.controlled(1, &["diff", pair[0], pair[1]]);
        assert!(
            said.starts_with("equal as far as both go (") && said.contains(&format!("; {name} is cut off at ")),
            "{said}"
        );
    }

    let said = ground.controlled(0, &["recover", "cut.mcap"]);
    assert!(said.ends_with(" rows to cut-recovered.mcap\n") && !said.starts_with('0'), "{said}");
    let mut again = ground.control(&["recover", "cut.mcap"]);
    again.ends_with(4);
    let said = again.stderr();
    assert!(said.contains("cut-recovered.mcap is there already") && said.contains("--out FILE"), "{said}");
    let recovered = bus::recording::read(ground.path("cut-recovered.mcap")).expect("a recording");
    assert!(recovered.complete && !recovered.exact.is_empty());
    let said = ground.controlled(1, &["diff", "a", "cut-recovered.mcap"]);
    assert!(said.contains(" is missing from the second run"), "{said}");

    let mut report = ground.control(&["report", "cut-recovered.mcap"]);
    report.ends_with(4);
    let said = report.stderr();
    assert!(said.contains("is a file; allowed: the folder of a run"), "{said}");
    let said = ground.controlled(0, &["export", "cut-recovered.mcap", "--format", "csv", "--out", "csv"]);
    assert!(said.starts_with(&format!("{} rows to csv/", recovered.exact.len())), "{said}");
    for (file, columns) in [
        ("vehicles.csv", &["t_s", "vehicle", "xi", "xi_rate", "x_m", "y_m", "z_m", "e_norm_m", "neighbours"][..]),
        ("links.csv", &["from", "to", "seq", "fate"]),
        ("topology.csv", &["t_s", "from", "to", "up"]),
    ] {
        let text = fs::read_to_string(ground.path("csv").join(file)).expect("exported");
        let header: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
        assert!(columns.iter().all(|column| header.contains(column)), "{file}: {header:?}");
        assert!(text.lines().count() > 1 && text.lines().all(|line| line.split(',').count() == header.len()), "{file}");
    }
    ground.controlled(0, &["export", "a", "--format", "network", "--out", "network"]);
    let section = fs::read_to_string(ground.path("network/network.toml")).expect("exported");
    assert!(section.contains("network"), "{section}");
}

#[test]
fn a_run_whose_mission_control_was_killed_is_reported_from_its_logs() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("100.0"));
    let run = ["run", "mission.toml", "--speed-up", "10", "--listen", "tcp/127.0.0.1:0", "--out", "own"];
    let mut control = ground.control(&run);
    until(PATIENCE, "it flies", || control.stderr().contains("flying: "));
    control.kill();
    // What there is so far is to be had, and does not stand in the way of the rest.
    ground.controlled(0, &["report", "own"]);
    let last = |id: &str| {
        let recording = ground.recording("own");
        cpf_tests::states(&recording.exact, id).last().map_or(0, |row| row.t_ns)
    };
    assert!(last("auv1") < 100_000_000_000);
    // Its processes finish the flight and end by themselves; each closes its log.
    let logs = ground.path("own/logs");
    let folder = || fs::read_dir(&logs).ok()?.flatten().map(|entry| entry.path()).find(|path| path.is_dir());
    let ended = |path: &Path| {
        let bytes = fs::read(path).unwrap_or_default();
        bytes.len() > MAGIC.len() && bytes.ends_with(MAGIC)
    };
    until(Duration::from_secs(120), "the flight ends and all logs are closed", || {
        let files =
            folder().map(|folder| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()));
        let files: Vec<_> = files.into_iter().flatten().collect();
        let files: Vec<_> = files.into_iter().filter(|path| path.extension().is_some_and(|e| e == "mcap")).collect();
        files.len() == 4 && files.iter().all(|path| ended(path))
    });
    ground.controlled(0, &["report", "own"]);
    assert_eq!(last("auv1"), 100_000_000_000, "merged again");
    fs::remove_file(ground.path("own/recording.mcap")).expect("merged");
    let mut diff = ground.control(&["diff", "own", "own"]);
    diff.ends_with(4);
    assert!(diff.stderr().contains("`mission-control report own` makes it of the logs"), "{}", diff.stderr());

    let said = ground.controlled(0, &["report", "own"]);
    assert_eq!(said, "report: own/report.html\n");
    for id in ["auv1", "auv2", "auv3"] {
        assert_eq!(last(id), 100_000_000_000, "{id}");
    }
    let page = || fs::read_to_string(ground.path("own/report.html")).expect("a report");
    assert!(page().contains("from 4 logs of a run that it did not end"));
    assert!(ground.json("own/host.json")["zenoh"].is_string(), "the versions of what made it");
    ground.controlled(0, &["report", "own"]);
    assert!(page().contains("from 4 logs of a run that it did not end"), "it is not forgotten");

    // The same without a report.
    fs::remove_file(ground.path("own/recording.mcap")).expect("there");
    let said = ground.controlled(0, &["recover", "own"]);
    assert!(said.starts_with("merged to own/recording.mcap"), "{said}");
    assert!(ground.path("own/recording.mcap").exists());
    let said = ground.controlled(0, &["recover", "own"]);
    assert!(said.ends_with("is there already\n"), "{said}");
    ground.controlled(4, &["recover", "."]);
}

#[test]
fn a_start_that_fails_leaves_no_empty_folder_and_names_no_source() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("20.0"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let endpoint = format!("tcp/{}", taken.local_addr().expect("bound"));
    let run = ["run", "mission.toml", "--attach", &endpoint, "--patience", "2", "--out", "attached"];
    let mut control = ground.control(&run);
    control.ends_with(3);
    let said = control.stderr();
    assert!(said.contains(&endpoint) && !said.contains(".rs") && !said.contains("Single("), "{said}");
    assert!(!ground.path("attached").exists());
}

// --- a flight under way --------------------------------------------------------------------------------------------------

#[test]
fn who_joins_a_flight_is_told_that_its_speed_stays() {
    let ground = Ground::new();
    ground.file("mission.toml", &short("60.0"));
    let (_emulator, endpoint) = ground.emulator("tcp/127.0.0.1:0");
    let _vehicles = ["auv1", "auv2", "auv3"].map(|id| ground.vehicle(id, &endpoint));
    let run = |speed_up: &str, out: &str| {
        ground.control(&["run", "mission.toml", "--attach", &endpoint, "--speed-up", speed_up, "--out", out])
    };
    let mut first = run("4", "first");
    until(PATIENCE, "it flies", || first.stderr().contains("flying: "));
    assert!(!first.stderr().contains("under way already"), "{}", first.stderr());
    first.kill();
    let mut second = run("50", "second");
    second.ends_with(0);
    let said = second.stderr();
    assert!(said.contains("it goes on at the speed it was started with, and --speed-up 50 changes nothing"), "{said}");
    let host = ground.json("second/host.json");
    assert_eq!(host["how"], "mission-control run --attach --speed-up 4", "as it was flown");
    assert_eq!(host["speed_up"], 4.0, "{host:#}");
}

// --- the README ----------------------------------------------------------------------------------------------------------

/// A piece of the README between fences of this language that contains this.
fn snippet(language: &str, part: &str) -> String {
    let text = fs::read_to_string(in_repository("README.md")).expect("the README");
    let fence = format!("```{language}\n");
    let pieces = text.split(&fence).skip(1).filter_map(|rest| Some(rest.split_once("```")?.0));
    let mut found = pieces.filter(|piece| piece.contains(part));
    found.next().unwrap_or_else(|| panic!("{part} in the README")).to_string()
}

#[test]
fn the_rows_that_the_readme_counts_are_there() {
    let ground = Ground::new();
    let mission = in_repository("missions/auv-helix.toml");
    ground.controlled(0, &["simulate", mission.to_str().expect("plain"), "--out", "simulated"]);
    let said = ground.controlled(0, &["diff", "simulated", "simulated"]);
    let readme = fs::read_to_string(in_repository("README.md")).expect("the README");
    assert!(readme.contains(&format!("The last says `{}`", said.trim_end())), "{said}");
}

#[test]
fn the_python_of_the_readme_prints_what_it_says() {
    let python = |arguments: &[&str]| Command::new("python3").args(arguments).output();
    if !python(&["--version"]).is_ok_and(|output| output.status.success()) {
        // Past the test harness, which shows the output of failed tests only.
        let _ = writeln!(std::io::stderr(), "commands: skipped: python3 is not installed");
        return;
    }
    let ground = Ground::new();
    let mission = in_repository("missions/auv-helix.toml");
    ground.controlled(0, &["simulate", mission.to_str().expect("plain"), "--out", "simulated"]);
    ground.controlled(0, &["export", "simulated", "--format", "csv", "--out", "csv"]);
    let here = |text: String| {
        let [simulated, csv] = ["simulated", "csv"].map(|name| ground.path(name).display().to_string());
        text.replace("/tmp/simulated", &simulated).replace("/tmp/csv", &csv)
    };
    let says = |text: String| {
        let output = python(&["-c", &here(text)]).expect("starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_string()
    };
    let by_csv = says(snippet("python", "csv.DictReader"));
    assert!(by_csv.starts_with("800.0 338.186"), "{by_csv}");
    if !python(&["-c", "import mcap"]).is_ok_and(|output| output.status.success()) {
        // Past the test harness, which shows the output of failed tests only.
        let _ = writeln!(
            std::io::stderr(),
            "commands: skipped in part: the python package mcap is not installed (pip install mcap)"
        );
        return;
    }
    let by_mcap = says(snippet("python", "make_reader"));
    assert!(by_mcap.starts_with("800.0 338.186") && by_mcap.contains(" 0.940"), "{by_mcap}");
}
