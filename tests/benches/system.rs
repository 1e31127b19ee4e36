//! The system as a whole, measured. Build the programs first:
//!
//! ```text
//! cargo build --release && cargo bench -p cpf-tests --bench system -- [machines] [simulate] [sweep] [stepped] [hop] [throughput] [delay] [fleet] [crowd] [flight] [medium]
//! ```
//!
//! Without a name, all are run, in two minutes or so. Rows are for docs/benchmarks.md. Medians count; on a shared machine the tails say more about
//! the machine than about the programs, so every figure with a comparison is taken in alternation with it.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use bus::Plane;
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::Events;
use bus::setup::Endpoint;
use common::machine::Machine;
use common::mission::Mission;
use common::record::{ClockRecord, Fate, Overrun, Record, Row};
use common::time::{Span, Time};
use common::wire::fleet::{FromFleet, Pace, ToFleet};
use common::wire::state::CoordinationState;
use common::wire::vehicle::{FromVehicle, Phase, ToVehicle};
use cpf_tests::{Ground, mission, mission_text, program, with};
use mission_control::sweep::plan::Plan as SweepPlan;
use mission_control::sweep::setting::Setting;
use network_emulator::emulator::{Channel, Emulator, Sent};
use zenoh::Wait;

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if names.first().is_some_and(|name| name == "plain-router") {
        return plain_router();
    }
    let wanted = |name: &str| names.is_empty() || names.iter().any(|n| n == name);
    println!("| what | figure |\n|---|---|");
    for (name, bench) in [
        ("machines", machines as fn()),
        ("simulate", simulate),
        ("sweep", sweep),
        ("stepped", stepped),
        ("hop", hop),
        ("throughput", throughput),
        ("delay", delay),
        ("fleet", fleet),
        ("crowd", crowd),
        ("flight", in_flight),
        ("medium", medium),
    ] {
        if wanted(name) {
            bench();
        }
    }
}

fn row(what: &str, figure: &str) {
    println!("| {what} | {figure} |");
}

fn percentile(sorted: &[f64], p: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * p).round() as usize]
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

fn median(values: Vec<f64>) -> f64 {
    percentile(&sorted(values), 0.5)
}

/// Processor seconds that this process has used so far.
fn cpu_seconds() -> f64 {
    cpu_seconds_of("self")
}

/// Processor seconds that a process has used so far.
fn cpu_seconds_of(process: &str) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("Linux");
    let after_name = stat.rsplit(')').next().expect("a stat line");
    let ticks: Vec<f64> = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse().ok()).collect();
    ticks.iter().sum::<f64>() / 100.0
}

// --- one thread --------------------------------------------------------------------------------------------------------

/// Vehicle-seconds per processor-second of some way to fly the flagship.
fn per_cpu_second(work: impl Fn(&Arc<Mission>)) -> f64 {
    let mission = mission(&mission_text("missions/auv-helix.toml"));
    let flown = mission.end.secs() * mission.vehicles.len() as f64;
    let of = |runs: u32| {
        let begun = cpu_seconds();
        (0..runs).for_each(|_| work(&mission));
        flown * f64::from(runs) / (cpu_seconds() - begun)
    };
    median((0..5).map(|_| of(20)).collect())
}

/// `simulate`, of the machines alone.
fn machines() {
    let machines = per_cpu_second(|mission| {
        let outcome = mission_control::simulate::simulate(mission, |_| {}, |_| true).expect("flies");
        assert_eq!(outcome.phase, Phase::Finished);
    });
    let figure = format!("{machines:.0} vehicle-seconds per CPU-second");
    row("`simulate` auv-helix, machines and rows, nothing written", &figure);
}

/// `simulate` with the recording written.
fn simulate() {
    let ground = Ground::new();
    let file = AtomicU64::new(0);
    let recorded = per_cpu_second(|mission| {
        let path = ground.path(&format!("r{}.mcap", file.fetch_add(1, Ordering::Relaxed)));
        mission_control::rehearse::record(mission, &path, |_| {}).expect("flies");
        std::fs::remove_file(path).expect("was written");
    });
    row("the same with the recording written", &format!("{recorded:.0} vehicle-seconds per CPU-second"));
}

/// How many short missions a sweep flies, on all cores and per core.
fn sweep() {
    let text = mission_text("missions/studies/base/loss-delay.toml");
    let settings = vec![Setting::parse("network.loss=0:0.9:0.1").expect("a setting")];
    let plan = SweepPlan::new("loss-delay.toml", mission(&text), settings, 40).expect("sound");
    let begun = Instant::now();
    let swept = mission_control::sweep::sweep(&plan, &Ground::new().path("sweep"), |_, _| true).expect("swept");
    let rate = swept.runs.len() as f64 / begun.elapsed().as_secs_f64();
    let cores = mission_control::batch::cores();
    row(
        &format!("sweep of a mission of 25 s with three vehicles on {cores} cores"),
        &format!("{rate:.0} missions per second, {:.0} per second and core", rate / cores as f64),
    );
}

// --- stepped processes -------------------------------------------------------------------------------------------------

fn flown_in(ground: &Ground, mission: &Path, name: &str, extra: &[&str]) -> f64 {
    let out = ground.path(name);
    let begun = Instant::now();
    let status = Command::new(program("mission-control"))
        .arg("run")
        .arg(mission)
        .args(extra)
        .arg("--out")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("runs");
    assert!(status.success(), "{name} failed");
    begun.elapsed().as_secs_f64()
}

/// A mission of `n` wheeled robots abreast, each hearing the two beside it.
fn abreast(n: usize, duration: f64, delay: &str, record: f64) -> String {
    let mut text = format!(
        "name = \"abreast\"\nduration_s = {duration:?}\n[clock]\ncontrol_period_s = 0.05\nrecord_period_s = {record:?}\n\
         [formation]\nspeed = 0.5\n[coordination]\nlaw = {{ switching = {{ gain = 0.2 }} }}\nmessage_period_s = 0.1\n\
         [network]\nlinks = ["
    );
    // Two have one link between them.
    for i in 0..if n > 2 { n } else { n - 1 } {
        text += &format!("[\"v{i}\", \"v{}\"], ", (i + 1) % n);
    }
    text += &format!(
        "]\n{delay}\n[fleet]\nmodel = {{ dynamic_unicycle = {{}} }}\nfollowing = {{ proposition31 = {{}} }}\n"
    );
    for i in 0..n {
        text += &format!(
            "[[vehicles]]\nid = \"v{i}\"\npath = {{ line = {{ start_m = [0.0, {i}.0] }} }}\nstart = {{ x_m = {:?}, y_m = {i}.3 }}\n",
            0.1 * i as f64
        );
    }
    text
}

fn stepped() {
    let ground = Ground::new();
    let helix = ground.file("helix.toml", &mission_text("missions/auv-helix.toml"));
    let wall = median((0..5).map(|i| flown_in(&ground, &helix, &format!("h{i}"), &["--stepped"])).collect());
    row(
        "stepped run of auv-helix, 5 processes, start to report",
        &format!("{wall:.2} s, {:.0} times real time", 800.0 / wall),
    );
    let eight = ground.file("eight.toml", &abreast(8, 200.0, "", 0.5));
    let wall = median((0..3).map(|i| flown_in(&ground, &eight, &format!("e{i}"), &["--stepped"])).collect());
    row(
        "stepped run of 8 vehicles without delay (an exchange every 0.1 s), start to report",
        &format!("{:.0} vehicle-seconds per second", 8.0 * 200.0 / wall),
    );
}

// --- one hop -----------------------------------------------------------------------------------------------------------

/// The plain comparison: a Zenoh router in a process of its own, of the same version and features.
fn plain_router() {
    let mut config = zenoh::Config::default();
    let port = std::env::args().nth(2).expect("a port");
    for (key, value) in [
        ("mode", "\"router\"".to_string()),
        ("listen/endpoints", format!("[\"tcp/127.0.0.1:{port}\"]")),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("scouting/delay", "0".into()),
    ] {
        config.insert_json5(key, &value).expect("a known key");
    }
    let _session = zenoh::open(config).wait().expect("opens");
    println!("up");
    std::thread::park();
}

/// Puts bytes on the plain router.
type Put = Box<dyn Fn(&[u8])>;

struct Plain {
    router: Child,
    put: Put,
    _sessions: Vec<zenoh::Session>,
}

impl Drop for Plain {
    fn drop(&mut self) {
        let _ = self.router.kill();
        let _ = self.router.wait();
    }
}

/// Two plain clients of a plain router; what the second receives goes to `heard`.
fn plain(heard: impl Fn(&[u8]) + Send + Sync + 'static) -> Plain {
    let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = free.local_addr().expect("bound").port();
    drop(free);
    let router = Command::new(std::env::current_exe().expect("myself"))
        .args(["plain-router", &port.to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    let client = || {
        let config = format!(
            "{{ mode: \"client\", connect: {{ endpoints: [\"tcp/127.0.0.1:{port}\"], timeout_ms: 10000 }}, \
             scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }} }}"
        );
        zenoh::open(zenoh::Config::from_json5(&config).expect("sound")).wait().expect("opens")
    };
    let (sender, receiver) = (client(), client());
    receiver
        .declare_subscriber("plain")
        .callback(move |s| heard(&s.payload().to_bytes()))
        .background()
        .wait()
        .expect("ok");
    let publisher = sender
        .declare_publisher("plain")
        .congestion_control(zenoh::qos::CongestionControl::Drop)
        .wait()
        .expect("declares");
    let deadline = Instant::now() + Duration::from_secs(10);
    while !publisher.matching_status().wait().expect("status").matching() && Instant::now() < deadline {
        std::thread::yield_now();
    }
    let put = Box::new(move |bytes: &[u8]| publisher.put(bytes.to_vec()).wait().expect("puts"));
    Plain { router, put, _sessions: vec![sender, receiver] }
}

/// The emulator with a flight of two vehicles under way, both played by this process.
struct Emulated {
    _ground: Ground,
    mission: Arc<Mission>,
    sender: Line,
    _receiver: Line,
    _control: Line,
    folder: std::path::PathBuf,
    emulator: Child,
    seq: std::cell::Cell<u32>,
}

impl Emulated {
    fn new(network: &str, heard: impl Fn(Vec<u8>, Instant) + Send + 'static) -> Emulated {
        let ground = Ground::new();
        let text = abreast(2, 100_000.0, network, 0.5);
        let mission = mission(&text);
        let folder = ground.path("logs");
        let (emulator, endpoint) = emulator(&folder);
        let (mut lines, control) = under_way(&text, &mission, &endpoint);
        let (receiver, from_1) = lines.pop().expect("v1");
        let (sender, from_0) = lines.pop().expect("v0");
        std::thread::spawn(move || {
            for event in from_1 {
                if let LineEvent::Packet { plane: Plane::State, at, bytes } = event {
                    heard(bytes, at);
                }
            }
        });
        std::thread::spawn(move || from_0.for_each(drop));
        Emulated {
            _ground: ground,
            mission,
            sender,
            _receiver: receiver,
            _control: control,
            folder,
            emulator,
            seq: std::cell::Cell::new(0),
        }
    }

    fn send(&self) -> u32 {
        let seq = self.seq.get();
        self.seq.set(seq + 1);
        let _ = self.sender.send(Plane::State, &word(&self.mission, 0, seq));
        seq
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

/// An emulator in a process of its own.
fn emulator(logs: &Path) -> (Child, Endpoint) {
    let mut emulator = Command::new(program("network-emulator"))
        .args(["--listen", "tcp/127.0.0.1:0", "--logs"])
        .arg(logs)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let mut line = String::new();
    std::io::BufRead::read_line(&mut std::io::BufReader::new(emulator.stdout.take().expect("piped")), &mut line)
        .expect("says where");
    (emulator, line.trim().parse().expect("an endpoint"))
}

/// The lines of all vehicles of a mission, played by this process, and mission-control's, with the flight under way.
fn under_way(text: &str, mission: &Mission, endpoint: &Endpoint) -> (Vec<(Line, Events<LineEvent>)>, Line) {
    let join = |id: &str| Line::connect(LineConfig::new(endpoint.clone(), id)).expect("joins");
    let lines: Vec<(Line, Events<LineEvent>)> = mission.vehicles.iter().map(|vehicle| join(&vehicle.id)).collect();
    let (control, from_hub) = join("mission-control");
    lines.iter().for_each(|(line, _)| say(line, &FromVehicle::Hello { phase: Phase::Idle, flight: None }));
    control.send(Plane::Mission, &common::wire::encode(&ToFleet::Upload { mission: text.to_string() })).expect("sent");
    for (line, events) in &lines {
        wait_for(events, |m: ToVehicle| matches!(m, ToVehicle::Arm { .. }));
        say(line, &FromVehicle::Armed { digest: mission.digest });
    }
    loop {
        let start = ToFleet::Start { pace: Pace::Real { speed_up: 1.0 } };
        control.send(Plane::Mission, &common::wire::encode(&start)).expect("sent");
        control.send(Plane::Mission, &common::wire::encode(&ToFleet::Status)).expect("sent");
        let mut running = false;
        wait_for(&from_hub, |m: FromFleet| {
            if let FromFleet::Status(status) = &m {
                running = status.phase == Phase::Running && status.now > Time::ZERO;
            }
            matches!(m, FromFleet::Status(_))
        });
        if running {
            return (lines, control);
        }
    }
}

fn say(line: &Line, message: &FromVehicle) {
    line.send(Plane::Mission, &common::wire::encode(message)).expect("sent");
}

fn wait_for<M: bincode::Decode<()>>(events: &Events<LineEvent>, mut is_it: impl FnMut(M) -> bool) {
    loop {
        let event = events.recv_timeout(Duration::from_secs(10)).expect("an answer");
        if let LineEvent::Packet { plane: Plane::Mission, bytes, .. } = event
            && common::wire::decode::<M>(&bytes).is_ok_and(&mut is_it)
        {
            return;
        }
    }
}

/// A coordination state of this vehicle.
fn word(mission: &Mission, sender: u16, seq: u32) -> Vec<u8> {
    CoordinationState { mission: mission.digest, sender, seq, made: Time::ZERO, xi: 1.0, scalar: None }.encode()
}

/// One-way latency at 1000 messages per second, alternating between the plain router and the emulator.
fn hop() {
    let (plain_heard, plain_times) = channel();
    let plain = plain(move |_| plain_heard.send(Instant::now()).unwrap_or_default());
    let (emulated_heard, emulated_times) = channel();
    let emulated = Emulated::new("", move |_, at| emulated_heard.send(at).unwrap_or_default());
    let (mut of_plain, mut of_emulated) = (Vec::new(), Vec::new());
    let begun = Instant::now();
    for i in 0..6000u32 {
        let due = begun + Duration::from_micros(1000) * i;
        while Instant::now() < due {
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        let sent = Instant::now();
        let received = if i % 2 == 0 {
            (plain.put)(&[7; 35]);
            plain_times.recv_timeout(Duration::from_secs(2))
        } else {
            emulated.send();
            emulated_times.recv_timeout(Duration::from_secs(2))
        };
        if let Ok(received) = received {
            let latency = received.duration_since(sent).as_secs_f64() * 1e6;
            if i % 2 == 0 { of_plain.push(latency) } else { of_emulated.push(latency) }
        }
    }
    let (p, e) = (sorted(of_plain), sorted(of_emulated));
    let show = |v: &[f64]| format!("{:.0} / {:.0} µs", percentile(v, 0.5), percentile(v, 0.99));
    row("one hop through a plain Zenoh router, p50 / p99", &show(&p));
    row("one hop through the emulator, in alternation, p50 / p99", &show(&e));
    row("ratio at the median", &format!("{:.2}", percentile(&e, 0.5) / percentile(&p, 0.5)));
}

/// Messages delivered per second, flat out for two seconds each, in alternation.
fn throughput() {
    let counter = || Arc::new(AtomicU64::new(0));
    let (of_plain, of_emulated) = (counter(), counter());
    let (p, e) = (of_plain.clone(), of_emulated.clone());
    let plain = plain(move |_| {
        p.fetch_add(1, Ordering::Relaxed);
    });
    let emulated = Emulated::new("queue = 1000000", move |_, _| {
        e.fetch_add(1, Ordering::Relaxed);
    });
    let measure = |count: &AtomicU64, send: &dyn Fn()| {
        let before = count.load(Ordering::Relaxed);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(2) {
            (0..32).for_each(|_| send());
        }
        (count.load(Ordering::Relaxed) - before) as f64 / begun.elapsed().as_secs_f64()
    };
    let (mut plain_rates, mut emulated_rates) = (Vec::new(), Vec::new());
    for _ in 0..3 {
        plain_rates.push(measure(&of_plain, &|| (plain.put)(&[7; 35])));
        emulated_rates.push(measure(&of_emulated, &|| {
            emulated.send();
        }));
        // What still waits belongs to neither.
        let mut last = u64::MAX;
        while last != of_emulated.load(Ordering::Relaxed) {
            last = of_emulated.load(Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(200));
        }
    }
    let (p, e) = (median(plain_rates), median(emulated_rates));
    row("delivered per second through a plain router, flat out", &format!("{p:.0}"));
    row("delivered per second through the emulator, flat out", &format!("{e:.0}"));
    row("ratio", &format!("{:.2}", e / p));
}

/// Achieved minus commanded delay, as the emulator records it for every message.
fn delay() {
    bare_sleep();
    for (name, seconds) in [("5 ms", 0.005), ("100 ms", 0.1), ("1 s", 1.0)] {
        let emulated = Emulated::new(&format!("delay = {{ constant = {{ delay_s = {seconds:?} }} }}"), |_, _| {});
        paced(3000).for_each(|_| _ = emulated.send());
        std::thread::sleep(Duration::from_secs_f64(seconds + 1.5));
        punctuality(name, &emulated.mission, &emulated.folder);
    }
    delay_with_everything();
}

/// What the machine itself makes of a thread that sleeps until an instant, with nothing else running.
fn bare_sleep() {
    bus::clock::sharpen_this_thread();
    let begun = Instant::now();
    let late = |turn: u32| {
        let due = begun + Duration::from_millis(1) * turn;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        (Instant::now() - due).as_secs_f64() * 1e6
    };
    let late = sorted((1..=3000).map(late).collect());
    row(
        "a thread that sleeps until an instant, alone: p50 / p99",
        &format!("{:.0} / {:.0} µs late", percentile(&late, 0.5), percentile(&late, 0.99)),
    );
}

/// The same with every model on that can be on together: four vehicles speak 250 times a second each.
fn delay_with_everything() {
    let text = with(&mission_text("tests/missions/everything-fast.toml"), "duration_s = 6.0", "duration_s = 600.0");
    let (ground, mission) = (Ground::new(), mission(&text));
    let folder = ground.path("logs");
    let (mut emulator, endpoint) = emulator(&folder);
    let (lines, _control) = under_way(&text, &mission, &endpoint);
    let mut vehicles = Vec::new();
    for (line, events) in lines {
        std::thread::spawn(move || events.for_each(drop));
        vehicles.push(line);
    }
    let speakers = vehicles.len() as u32;
    let used = || cpu_seconds_of(&emulator.id().to_string());
    let (begun, before) = (Instant::now(), used());
    for i in paced(4000) {
        let sender = i % speakers;
        let bytes = word(&mission, sender as u16, i / speakers);
        let _ = vehicles[sender as usize].send(Plane::State, &bytes);
    }
    let share = (used() - before) / begun.elapsed().as_secs_f64();
    std::thread::sleep(Duration::from_secs(2));
    punctuality(EVERYTHING_ON, &mission, &folder);
    row("of one processor, the emulator used there", &format!("{:.0} %", 100.0 * share));
    let _ = emulator.kill();
    let _ = emulator.wait();
}

/// What tests/missions/everything-fast.toml has on.
const EVERYTHING_ON: &str = "10 to 30 ms with four speakers and all of this on: slots with guard time, preamble, backoff, duty cycle, \
    half duplex, collisions, queues; range curve and disc; Markov and random switching; bursts, shared fades, a trace and single losses; \
    distance, jitter, gamma and normal delays in order; copies; flipped bits";

/// So many turns, a thousand a second.
fn paced(turns: u32) -> impl Iterator<Item = u32> {
    let begun = Instant::now();
    (0..turns).inspect(move |turn| {
        let due = begun + Duration::from_micros(1000) * *turn;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    })
}

/// How late the deliveries of this flight were, as its emulator recorded it, and how many of the messages were delivered.
fn punctuality(name: &str, mission: &Mission, folder: &Path) {
    let log = folder.join(format!("{:016x}", mission.digest)).join("network-emulator.mcap");
    let recording = bus::recording::read(log).expect("readable while written");
    let late = |row: &ClockRecord| match row {
        ClockRecord::Achieved(row) => Some(row.late_ns as f64 / 1e3),
        _ => None,
    };
    let late = sorted(recording.clock.iter().filter_map(late).collect());
    let sent =
        recording.exact.iter().filter(|row| matches!(row, Record::Message(row) if !row.fate.is_of_copy())).count();
    let early = if late[0] < 0.0 { "EARLY" } else { "never early" };
    row(
        &format!("achieved minus commanded, {name}, 1000/s: least / p50 / p99; share delivered"),
        &format!(
            "{:.0} / {:.0} / {:.0} µs, {early}; {} of {sent}, {:.0} %",
            late[0],
            percentile(&late, 0.5),
            percentile(&late, 0.99),
            late.len(),
            100.0 * late.len() as f64 / sent as f64
        ),
    );
}

/// Fifty vehicle processes in real time for a minute.
fn fleet() {
    let ground = Ground::new();
    let file = ground.file("fifty.toml", &abreast(50, 60.0, "", 5.0));
    let out = ground.path("fifty");
    let mut run = Command::new(program("mission-control"))
        .args(["run", "--listen", "tcp/127.0.0.1:0"])
        .arg(&file)
        .arg("--out")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    std::thread::sleep(Duration::from_secs(40));
    let memory = fleet_memory(run.id());
    assert!(run.wait().expect("ends").success());
    let clock: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("clock.json")).expect("written")).expect("JSON");
    let sum = |key: &str| {
        clock["deadlines"].as_array().into_iter().flatten().filter_map(|d| d[key].as_u64()).sum::<u64>() as f64
    };
    let (met, missed) = (sum("met"), sum("missed"));
    row(
        "50 vehicle processes, 20 Hz control, 10 Hz messages, 60 s in real time: missed deadlines",
        &format!("{missed:.0} of {:.0} ({:.3} %)", met + missed, 100.0 * missed / (met + missed)),
    );
    row("memory of a vehicle process there, resident / proportional, median", &memory);
}

/// Resident and proportional memory of the vehicle processes below a process.
fn fleet_memory(parent: u32) -> String {
    let children = std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap_or_default();
    let (mut rss, mut pss) = (Vec::new(), Vec::new());
    for pid in children.split_whitespace() {
        let command = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let rollup = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).unwrap_or_default();
        let field = |name: &str| {
            let line = rollup.lines().find(|line| line.starts_with(name))?;
            line.split_whitespace().nth(1)?.parse::<f64>().ok()
        };
        if command.contains("vehicle-node")
            && let (Some(r), Some(p)) = (field("Rss:"), field("Pss:"))
        {
            rss.push(r / 1024.0);
            pss.push(p / 1024.0);
        }
    }
    if rss.is_empty() {
        return "not measured".to_string();
    }
    format!("{:.1} / {:.1} MB ({} processes)", median(rss.clone()), median(pss), rss.len())
}

// --- crowds --------------------------------------------------------------------------------------------------------------

/// The emulator at two hundred vehicles that all hear one another: at 10 Hz, at 50 Hz, and at more than this machine can do.
fn crowd() {
    crowd_at(10);
    crowd_at(50);
    crowd_at(150);
}

/// Ten seconds of it at so many messages per second and vehicle.
fn crowd_at(hertz: u32) {
    const N: usize = 200;
    let rounds = 10 * hertz;
    let ground = Ground::new();
    let mut links = String::new();
    for i in 0..N {
        (i + 1..N).for_each(|j| links += &format!("[\"v{i}\", \"v{j}\"], "));
    }
    let text = abreast(N, 100_000.0, "", 0.5);
    let (begin, end) = (text.find("links = [").expect("links"), text.find("]\n\n[fleet]").expect("the end of them"));
    let text = format!("{}links = [{links}{}", &text[..begin], &text[end..]);
    let mission = mission(&text);
    let folder = ground.path("logs");
    let (mut emulator, endpoint) = emulator(&folder);
    let (lines, control) = under_way(&text, &mission, &endpoint);
    let heard = Arc::new(AtomicU64::new(0));
    let mut vehicles = Vec::new();
    for (line, events) in lines {
        let heard = heard.clone();
        let listens = move || {
            let states = events.filter(|event| matches!(event, LineEvent::Packet { plane: Plane::State, .. }));
            states.for_each(|_| _ = heard.fetch_add(1, Ordering::Relaxed));
        };
        std::thread::spawn(listens);
        vehicles.push(line);
    }
    let begun = Instant::now();
    for seq in 0..rounds {
        std::thread::sleep((begun + Duration::from_secs(seq.into()) / hertz).saturating_duration_since(Instant::now()));
        for (sender, line) in (0..).zip(&vehicles) {
            let _ = line.send(Plane::State, &word(&mission, sender, seq));
        }
    }
    // What still waits is let out, and nothing more comes.
    let mut last = u64::MAX;
    while last != heard.load(Ordering::Relaxed) {
        last = heard.load(Ordering::Relaxed);
        std::thread::sleep(Duration::from_secs(1));
    }
    let seconds = begun.elapsed().as_secs_f64();
    let memory = std::fs::read_to_string(format!("/proc/{}/status", emulator.id())).expect("it lives");
    let memory = |name: &str| {
        let line = memory.lines().find(|line| line.starts_with(name)).expect("a known field");
        line.split_whitespace().nth(1).and_then(|kb| kb.parse::<f64>().ok()).expect("a number") / 1024.0
    };
    let (now, most) = (memory("VmRSS:"), memory("VmHWM:"));
    let (unsent, own): (u64, u64) = vehicles
        .iter()
        .map(|line| line.counts())
        .fold((0, 0), |(unsent, own), counts| (unsent + counts.state_unsent, own + counts.state_dropped));
    control.send(Plane::Mission, &common::wire::encode(&ToFleet::Stop)).expect("sent");
    std::thread::sleep(Duration::from_secs(3));
    let log = folder.join(format!("{:016x}", mission.digest)).join("network-emulator.mcap");
    let (mut delivered, mut before, mut behind) = (0u64, 0, 0);
    for row in bus::recording::RowReader::open(log).expect("a recording") {
        match row.expect("readable") {
            Row::Exact(Record::Message(row)) => delivered += u64::from(row.fate == Fate::Delivered),
            Row::Clock(ClockRecord::Overrun(row)) if row.place == Overrun::BeforeEmulator => before += row.count,
            Row::Clock(ClockRecord::Overrun(row)) => behind += row.count,
            _ => {}
        }
    }
    let _ = emulator.kill();
    let _ = emulator.wait();
    let asked = N as u64 * (N as u64 - 1) * u64::from(rounds);
    row(
        &format!("{N} vehicles that all hear one another, {hertz} Hz for 10 s: deliveries asked, booked, received"),
        &format!("{asked}, {delivered}, {} within {seconds:.0} s", heard.load(Ordering::Relaxed)),
    );
    row(
        "dropped for want of time: words at the vehicle, words before the emulator, on the way to receivers, in their queues",
        &format!("{unsent}, {before}, {behind}, {own}"),
    );
    row("memory of the emulator there, at the end / at most", &format!("{now:.0} / {most:.0} MB"));
}

/// Resident memory of this process \[bytes\].
fn resident() -> f64 {
    let statm = std::fs::read_to_string("/proc/self/statm").expect("Linux");
    statm.split_whitespace().nth(1).and_then(|pages| pages.parse::<f64>().ok()).expect("pages") * 4096.0
}

/// What a message under way costs, in time and memory, by how many are.
fn in_flight() {
    for n in [100_000u32, 1_000_000] {
        let network = "queue = 1000000\ndelay = { jittered = { min_s = 2000.0, max_s = 3000.0 } }";
        let mission = mission(&abreast(2, 100_000.0, network, 0.5));
        let mut emulator = Emulator::new(mission.clone(), None);
        while emulator.poll_output().is_some() {}
        let words: Vec<Arc<[u8]>> = (0..n).map(|seq| word(&mission, 0, seq).into()).collect();
        let (memory, begun) = (resident(), cpu_seconds());
        for (seq, bytes) in (0..).zip(words) {
            emulator.handle(Time::from_nanos(seq * 1_000_000), Some(Sent { from: 0, bytes }));
        }
        let (memory, taken) = (resident() - memory, cpu_seconds());
        emulator.handle(Time::from_secs(9_000.0), None);
        let mut settled = 0u32;
        while let Some(output) = emulator.poll_output() {
            settled += u32::from(matches!(output, Channel::Settled(_)));
        }
        let n = f64::from(n);
        assert_eq!(f64::from(settled), n);
        row(
            &format!("{n:.0} messages under way: taking one, delivering one, memory of one beside its bytes"),
            &format!(
                "{:.0} ns, {:.0} ns, {:.0} bytes",
                (taken - begun) / n * 1e9,
                (cpu_seconds() - taken) / n * 1e9,
                memory / n
            ),
        );
    }
}

/// What a message costs on a shared medium where all hear all, by how many vehicles there are.
fn medium() {
    for n in [16usize, 32, 64, 128] {
        let mut links = String::new();
        for i in 0..n {
            (i + 1..n).for_each(|j| links += &format!("[\"v{i}\", \"v{j}\"], "));
        }
        let network = "medium = { rate_bps = 1e5, backoff_s = 0.09, half_duplex = true, collisions = true }\n\
                       delay = { distance = { speed_mps = 1500.0 } }";
        let text = abreast(n, 100_000.0, network, 0.5);
        let (begin, end) = (text.find("links = [").expect("links"), text.find("]\nmedium").expect("the end of them"));
        let mission = mission(&format!("{}links = [{links}{}", &text[..begin], &text[end..]));
        let mut emulator = Emulator::new(mission.clone(), None);
        let rounds = 200_000 / (n * n) as u32 + 2;
        let begun = cpu_seconds();
        for seq in 0..rounds {
            let at = Time::from_nanos(i64::from(seq) * 100_000_000);
            for sender in 0..n {
                let bytes = word(&mission, sender as u16, seq).into();
                emulator.handle(at, Some(Sent { from: sender, bytes }));
            }
            emulator.handle(at + Span::from_secs(0.099), None);
            while emulator.poll_output().is_some() {}
        }
        let messages = f64::from(rounds) * (n * (n - 1)) as f64;
        row(
            &format!("a message on one link of a shared medium, {n} vehicles that all hear one another"),
            &format!("{:.0} ns", (cpu_seconds() - begun) / messages * 1e9),
        );
    }
}
