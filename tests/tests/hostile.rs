//! A vehicle of the mission that is no vehicle of ours: a plain Zenoh client that joins by the book, and then says
//! everything it should not. It is counted and ignored; the honest vehicles agree.

use std::collections::BTreeMap;
use std::sync::mpsc;
use std::sync::{Arc, Mutex, PoisonError};

use bus::queue::Events;
use bus::switchboard::{HubEvent, LineId, Switchboard, SwitchboardConfig};
use bus::{PROTOCOL_VERSION, Plane};
use common::mission::Mission;
use common::record::ClockRecord;
use common::time::Time;
use common::wire::state::CoordinationState;
use common::wire::vehicle::{ClockPlan, FromVehicle, LogPiece, Phase, ToVehicle};
use common::wire::{Garbage, decode, encode};
use cpf_tests::{Ground, PATIENCE, Process, apart_at_last, found, mission, mission_text, of_vehicle, states, until};
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session, Wait};

const MISSION: &str = "tests/missions/parallel-three.toml";
/// First byte of a mission-plane frame that holds a whole message, and of a participant's first word.
const WHOLE: u8 = 0x01;
const HELLO: u8 = 0x10;

/// A Zenoh client that knows nothing of this project.
fn plain_client(port: &str) -> Session {
    let config = format!(
        r#"{{mode: "client", connect: {{endpoints: ["tcp/127.0.0.1:{port}"], timeout_ms: 10000}},
            scouting: {{multicast: {{enabled: false}}, gossip: {{enabled: false}}}}}}"#
    );
    zenoh::open(Config::from_json5(&config).expect("valid")).wait().expect("the client opens")
}

/// The client called `c`, on its line.
struct Hostile {
    session: Session,
    /// Keys on which it heard something.
    heard: Arc<Mutex<BTreeMap<String, u64>>>,
    /// It does what is asked of it on the mission plane, so that the flight can begin and end.
    _obliging: std::thread::JoinHandle<()>,
}

impl Hostile {
    fn join(endpoint: &str) -> Hostile {
        let lobby = plain_client(endpoint.rsplit(':').next().expect("a port"));
        let question = format!("cpf/join/c?version={PROTOCOL_VERSION};nonce={:016x}", 1);
        let replies = lobby.get(question).timeout(PATIENCE).wait().expect("asking succeeds");
        let reply = replies.recv().expect("an answer");
        let answer = reply.result().expect("let in").payload().try_to_string().expect("text").into_owned();
        let port = answer.split(';').find_map(|field| field.strip_prefix("port=")).expect("a port");
        let session = plain_client(port);

        let (orders, queue) = mpsc::channel::<Vec<u8>>();
        let heard = Arc::<Mutex<BTreeMap<String, u64>>>::default();
        let keys = Arc::clone(&heard);
        session
            .declare_subscriber("**")
            .allowed_origin(zenoh::sample::Locality::Remote)
            .callback(move |sample| {
                *keys.lock().expect("nobody panics").entry(sample.key_expr().to_string()).or_default() += 1;
                if sample.key_expr().as_str() == "cpf/c/down/mission" {
                    let _ = orders.send(sample.payload().to_bytes().into_owned());
                }
            })
            .background()
            .wait()
            .expect("declaring succeeds");
        let speaker = session.clone();
        let obliging = std::thread::spawn(move || {
            for frame in queue {
                if let Some((&WHOLE, message)) = frame.split_first()
                    && let Ok(order) = decode::<ToVehicle>(message)
                    && let Some(answer) = answer_to(order)
                {
                    put(&speaker, "cpf/c/up/mission", whole(&answer));
                }
            }
        });
        let mut hello = vec![HELLO];
        hello.extend(1_u64.to_le_bytes());
        put(&session, "cpf/c/up/mission", hello);
        Hostile { session, heard, _obliging: obliging }
    }

    fn says(&self, bytes: Vec<u8>) {
        // A bundle of one.
        put(&self.session, "cpf/c/up/state", [&(bytes.len() as u16).to_le_bytes()[..], &bytes].concat());
    }
}

fn answer_to(order: ToVehicle) -> Option<FromVehicle> {
    match order {
        ToVehicle::Arm { mission } => Some(FromVehicle::Armed { digest: common::mission::digest(&mission) }),
        ToVehicle::Stop => Some(FromVehicle::Ended { phase: Phase::Aborted, reason: "stopped".into() }),
        ToVehicle::SendLog { file, offset, .. } => {
            Some(FromVehicle::Log(LogPiece { file, files: 0, offset, size: 0, bytes: Vec::new() }))
        }
        _ => None,
    }
}

fn whole(message: &FromVehicle) -> Vec<u8> {
    [&[WHOLE][..], &encode(message)].concat()
}

/// Nothing of what it says is to be lost on the way: the flood shall arrive.
fn put(session: &Session, key: &str, bytes: Vec<u8>) {
    session.put(key, bytes).congestion_control(CongestionControl::Block).wait().expect("the line is open");
}

/// Garbage of every kind; the same for the same number.
fn garbage(number: u64, mission: &Mission) -> Vec<u8> {
    let good = CoordinationState {
        mission: mission.digest,
        sender: 2,
        seq: 1_000_000 + number as u32,
        made: Time::from_secs(1.0),
        xi: 1e6,
        scalar: None,
    };
    let noise = |length: usize| {
        let mut x = number.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut byte = || {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            x as u8
        };
        (0..length).map(|_| byte()).collect::<Vec<u8>>()
    };
    match number % 9 {
        0 => CoordinationState { sender: 0, ..good }.encode(),
        1 => CoordinationState { sender: 999, ..good }.encode(),
        2 => CoordinationState { mission: !mission.digest, ..good }.encode(),
        3 => CoordinationState { xi: f64::NAN, ..good }.encode(),
        4 => good.encode()[..(number % 30) as usize].to_vec(),
        5 => [good.encode(), noise(20)].concat(),
        6 => noise((number % 60) as usize),
        7 => {
            let mut changed = good.encode();
            let last = changed.len() - 1;
            changed[number as usize % last] ^= 1 << (number / 9 % 8);
            changed
        }
        // The state plane takes 8 KiB; now and then something far beyond.
        _ => noise(if number % 1000 == 8 { 60_000 } else { 100 }),
    }
}

/// The kinds that are in [`garbage`], whoever hears it.
const SENT: [Garbage; 7] = [
    Garbage::Foreign,
    Garbage::Oversized,
    Garbage::Malformed,
    Garbage::Corrupt,
    Garbage::NotFinite,
    Garbage::WrongMission,
    Garbage::Forged,
];

/// Zenoh's threads belong to the whole process: a flood in one test would hold up the other.
static ALONE: Mutex<()> = Mutex::new(());

/// Resident memory of a process \[KiB\].
fn resident_kib(process: &Process) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).expect("it lives");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a number of KiB");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

#[test]
fn whatever_one_vehicle_says_the_others_fly_on_and_agree() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let ground = Ground::new();
    let text = mission_text(MISSION);
    ground.file("mission.toml", &text);
    let plan = mission(&text);
    let (mut emulator, endpoint) = ground.emulator("tcp/127.0.0.1:0");
    let mut honest = ["a", "b"].map(|id| ground.vehicle(id, &endpoint));
    let hostile = Hostile::join(&endpoint);
    let run = ["run", "mission.toml", "--attach", &endpoint, "--speed-up", "10", "--out", "run"];
    let mut control = ground.control(&run);
    ground.status_until(&endpoint, "the fleet is under way", |status| status["now_s"].as_f64() > Some(5.0));

    // A first helping, so that every queue and table has its size.
    (0..20_000).for_each(|number| hostile.says(garbage(number, &plan)));
    let before = resident_kib(&emulator);
    let own = CoordinationState { mission: plan.digest, sender: 2, seq: 0, made: Time::ZERO, xi: -50.0, scalar: None };
    hostile.says(own.encode());
    for number in 20_000..200_000 {
        match number % 200 {
            // Keys of others, and its own inbox; its only valid word again; and the mission plane.
            0 => put(&hostile.session, "cpf/a/down/state", CoordinationState { xi: 1e6, ..own }.encode()),
            50 => put(&hostile.session, "cpf/b/up/state", CoordinationState { sender: 1, xi: 1e6, ..own }.encode()),
            100 => hostile.says(own.encode()),
            150 => put(&hostile.session, "cpf/c/up/mission", garbage(number / 8, &plan)),
            _ => hostile.says(garbage(number, &plan)),
        }
    }
    // Orders that are not a vehicle's to give.
    let stop = encode(&common::wire::fleet::ToFleet::Stop);
    put(&hostile.session, "cpf/c/up/mission", [&[WHOLE][..], &stop].concat());
    put(&hostile.session, "cpf/mission-control/up/mission", [&[WHOLE][..], &stop].concat());
    let reached = FromVehicle::Reached { until: Time::from_secs(1e9), sent: vec![(Time::ZERO, own.encode()); 100] };
    put(&hostile.session, "cpf/c/up/mission", whole(&reached));

    let status = ground.status_until(&endpoint, "the fleet answers", |_| true);
    assert_eq!(status["phase"], "running", "{status}");
    for id in ["a", "b", "c"] {
        assert_eq!(of_vehicle(&status, id)["connected"], true, "{status}");
    }
    let grown = resident_kib(&emulator).saturating_sub(before);
    assert!(grown < 32 << 10, "the emulator's memory grew by {grown} KiB");
    // Long after the last word of c that could be believed.
    let from = status["now_s"].as_f64().expect("a time");
    ground.status_until(&endpoint, "the fleet flies on", |status| status["now_s"].as_f64() > Some(from + 30.0));
    ground.controlled(0, &["stop", "--attach", &endpoint]);
    control.ends_with(1);

    let heard = hostile.heard.lock().expect("nobody panics").clone();
    assert!(heard.keys().all(|key| key.starts_with("cpf/c/down/")), "{heard:?}");
    assert!(heard["cpf/c/down/state"] > 10, "a and b have links to c: {heard:?}");

    // What was ignored is counted by the emulator, and none of it reached a vehicle.
    let clock = ground.json("run/clock.json");
    let notes = clock["notes"].as_array().expect("notes");
    let counted = |text: &str, source: &str| {
        notes.iter().filter(|n| n["source"] == source && n["text"].as_str().is_some_and(|t| t.contains(text))).count()
    };
    let ignored = notes.iter().find(|n| n["text"] == "messages ignored that came from c").expect("counted");
    assert!(ignored["count"].as_u64() > Some(50_000), "{ignored}");
    // Of each kind there is one line, however often it came.
    let first: Vec<&str> = notes
        .iter()
        .filter_map(|note| note["text"].as_str().filter(|text| text.starts_with("first message ignored from c")))
        .collect();
    assert_eq!(first.iter().collect::<std::collections::BTreeSet<_>>().len(), first.len(), "{first:?}");
    // It says its only valid word again and again, too.
    for kind in SENT.into_iter().chain([Garbage::Stale]) {
        let line = format!("first message ignored from c that is {}", kind.as_str());
        assert!(first.contains(&line.as_str()), "{line:?} in {first:?}");
    }
    assert_eq!((counted("ignored", "a"), counted("ignored", "b")), (0, 0), "{notes:?}");
    let recording = ground.recording("run");
    let apart = apart_at_last(&recording.exact, "a", "b");
    assert!(apart.abs() < 0.1, "{apart}");
    let xi = states(&recording.exact, "a").last().expect("it recorded").xi;
    assert!(xi.abs() < 1e4, "nobody believed it: {xi}");
    eprintln!("{ignored}, memory grew by {grown} KiB");

    for process in honest.iter_mut().chain([&mut emulator]) {
        assert!(process.is_running() && !process.stderr().contains("panicked"), "{}", process.stderr());
    }
}

/// A hub that hands a vehicle garbage of every kind, and what the vehicle says in answer.
struct HostileHub {
    switchboard: Switchboard,
    events: Events<HubEvent>,
    line: LineId,
}

impl HostileHub {
    fn says(&self, plane: Plane, bytes: &[u8]) {
        until(PATIENCE, "the line takes it", || match self.switchboard.send(self.line, plane, bytes) {
            // What no plane carries does not get onto the line.
            Ok(()) | Err(bus::Error::TooLarge { .. }) => true,
            Err(_) => false,
        });
    }

    /// The next answer of the vehicle that is such.
    fn hears(&self, what: &str, is_such: impl Fn(&FromVehicle) -> bool) {
        until(PATIENCE, what, || {
            std::iter::from_fn(|| self.events.pop()).any(|event| match event {
                HubEvent::Packet { plane: Plane::Mission, bytes, .. } => {
                    decode(&bytes).is_ok_and(|said| is_such(&said))
                }
                _ => false,
            })
        });
    }
}

#[test]
fn garbage_costs_a_vehicle_no_memory_and_one_line_of_each_kind() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let ground = Ground::new();
    let text = mission_text(MISSION);
    let plan = mission(&text);
    let anywhere = "tcp/127.0.0.1:0".parse().expect("an endpoint");
    let (switchboard, events) = Switchboard::open(SwitchboardConfig::new(anywhere)).expect("it opens");
    let mut vehicle = ground.vehicle("a", &switchboard.endpoint().to_string());
    let line = found(PATIENCE, "the vehicle joins", || match events.pop() {
        Some(HubEvent::Joined { line, .. }) => Some(line),
        _ => None,
    });
    let hub = HostileHub { switchboard, events, line };
    hub.says(Plane::Mission, &encode(&ToVehicle::Arm { mission: text }));
    hub.hears("the vehicle is armed", |said| matches!(said, FromVehicle::Armed { .. }));
    let now = std::time::SystemTime::UNIX_EPOCH.elapsed().expect("after 1970").as_nanos() as i64;
    let clock = ClockPlan::Real { epoch_unix_ns: now, speed_up: 1.0 };
    hub.says(Plane::Mission, &encode(&ToVehicle::Start { digest: plan.digest, clock, speeds: vec![] }));
    until(PATIENCE, "the vehicle flies", || vehicle.stderr().contains("flying parallel-three"));

    let helping = |numbers: std::ops::Range<u64>| {
        for number in numbers {
            hub.says(Plane::State, &garbage(number, &plan));
            if number % 100 == 0 {
                hub.says(Plane::Mission, &garbage(number, &plan));
            }
        }
        // It answers in order: what was said before is done with.
        hub.says(Plane::Mission, &encode(&ToVehicle::SendLog { digest: plan.digest, file: 0, offset: 0 }));
        hub.hears("the vehicle answers", |said| matches!(said, FromVehicle::Log(_)));
    };
    helping(0..20_000);
    let before = resident_kib(&vehicle);
    helping(20_000..200_000);
    let grown = resident_kib(&vehicle).saturating_sub(before);
    assert!(grown < 16 << 10, "the vehicle's memory grew by {grown} KiB");

    hub.says(Plane::Mission, &encode(&ToVehicle::Stop));
    hub.hears("the vehicle stops", |said| matches!(said, FromVehicle::Ended { .. }));
    vehicle.terminate();
    vehicle.ends_with(0);
    let log = bus::recording::read(ground.path(&format!("logs/{:016x}/a.mcap", plan.digest))).expect("it recorded");
    let mut kinds: Vec<String> = Vec::new();
    for record in &log.clock {
        if let ClockRecord::Note(note) = record
            && note.text.starts_with("first message ignored")
        {
            kinds.push(note.text.clone());
        }
    }
    let count = kinds.len();
    kinds.sort();
    kinds.dedup();
    assert_eq!(kinds.len(), count, "each kind once: {kinds:?}");
    for kind in SENT {
        let line = format!("first message ignored that is {}", kind.as_str());
        assert!(kinds.contains(&line), "{line:?} in {kinds:?}");
    }
    let said = vehicle.stderr();
    let lines = said.lines().filter(|line| line.contains("ignored a message on the mission plane")).count();
    assert!((1..=Garbage::ALL.len()).contains(&lines), "{said}");
}
