//! The hub as mission-control and the vehicles see it.

use common::mission::digest;
use common::wire::state::CoordinationState;
use common::wire::vehicle::FlightPlan;

use super::*;

const HELIX: &str = include_str!("../../../missions/auv-helix.toml");
const IDS: [&str; 3] = ["auv1", "auv2", "auv3"];

fn epoch() -> ClockPlan {
    ClockPlan::Real { epoch_unix_ns: 0, speed_up: 1.0 }
}

fn outputs(hub: &mut Hub) -> Vec<HubOutput> {
    std::iter::from_fn(|| hub.poll_output()).collect()
}

fn ask(hub: &mut Hub, at: Time, message: ToFleet) -> Vec<HubOutput> {
    hub.handle(at, Some(HubInput::FromControl { who: COLLECTOR.into(), message }));
    outputs(hub)
}

fn refusal(outputs: &[HubOutput]) -> Option<&str> {
    outputs.iter().find_map(|output| match output {
        HubOutput::ToControl { message: FromFleet::Refused { reason }, .. } => Some(reason.as_str()),
        _ => None,
    })
}

fn told<'o>(outputs: &'o [HubOutput], id: &str) -> Vec<&'o ToVehicle> {
    let to = |output: &'o HubOutput| match output {
        HubOutput::ToVehicle(to, message) if to == id => Some(message),
        _ => None,
    };
    outputs.iter().filter_map(to).collect()
}

/// Lets time pass: the hub is called whenever it wants to be.
fn pass(hub: &mut Hub, until_s: f64) {
    while let Some(at) = hub.poll_timeout().filter(|at| at.secs() < until_s) {
        hub.handle(at, None);
    }
    hub.handle(Time::from_secs(until_s), None);
}

fn joined(id: &str) -> HubInput {
    HubInput::Joined { id: id.into(), seat: IDS.iter().position(|known| *known == id).expect("of the mission") }
}

fn join(hub: &mut Hub, id: &str, phase: Phase, flight: Option<FlightPlan>) -> Vec<HubOutput> {
    hub.handle(Time::ZERO, Some(joined(id)));
    hub.handle(Time::ZERO, Some(HubInput::FromVehicle(id.into(), FromVehicle::Hello { phase, flight })));
    outputs(hub)
}

fn arm(hub: &mut Hub, at: Time, id: &str) -> Vec<HubOutput> {
    let message = FromVehicle::Armed { digest: digest(HELIX) };
    hub.handle(at, Some(HubInput::FromVehicle(id.into(), message)));
    outputs(hub)
}

/// A fleet of three that flies the flagship.
fn flying(pace: Pace, clock: ClockPlan) -> Hub {
    let mut hub = Hub::new();
    IDS.iter().for_each(|id| drop(join(&mut hub, id, Phase::Idle, None)));
    ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
    IDS.iter().for_each(|id| drop(arm(&mut hub, Time::ZERO, id)));
    let started = ask(&mut hub, Time::ZERO, ToFleet::Start { pace });
    assert!(started.contains(&HubOutput::StartClock(pace)), "{started:?}");
    hub.handle(Time::ZERO, Some(HubInput::ClockStarted(clock)));
    hub
}

#[test]
fn nothing_starts_before_every_vehicle_is_armed() {
    let mut hub = Hub::new();
    assert!(refusal(&ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Stepped })).is_some(), "no mission");
    join(&mut hub, "auv1", Phase::Idle, None);
    let uploaded = ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
    assert!(matches!(told(&uploaded, "auv1")[..], [ToVehicle::Arm { .. }]));
    arm(&mut hub, Time::ZERO, "auv1");
    let started = ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Stepped });
    assert!(refusal(&started).is_some_and(|r| r.contains("auv2, auv3")), "{started:?}");
    // Who comes later is armed on arrival.
    assert!(matches!(told(&join(&mut hub, "auv2", Phase::Idle, None), "auv2")[..], [ToVehicle::Arm { .. }]));
}

#[test]
fn a_wrong_mission_is_refused_with_its_faults() {
    let mut hub = Hub::new();
    let answer = ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: "name = 3".into() });
    assert!(refusal(&answer).is_some_and(|reason| reason.contains("name")), "{answer:?}");
    assert_eq!(hub.phase(), Phase::Idle);
}

#[test]
fn another_mission_waits_until_the_flight_is_over() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let other = HELIX.replace("seed = 1", "seed = 2");
    assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Upload { mission: other.clone() })).is_some());
    ask(&mut hub, Time::from_secs(1.0), ToFleet::Stop);
    assert_eq!(hub.phase(), Phase::Aborted);
    assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Upload { mission: other })).is_none());
}

#[test]
fn a_vehicle_that_comes_back_gets_mission_clock_and_speeds() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    ask(&mut hub, Time::from_secs(5.0), ToFleet::Speed { speed: 0.2 });
    hub.handle(Time::from_secs(6.0), Some(HubInput::Left("auv2".into())));
    outputs(&mut hub);
    assert!(matches!(told(&join(&mut hub, "auv2", Phase::Idle, None), "auv2")[..], [ToVehicle::Arm { .. }]));
    let armed = arm(&mut hub, Time::from_secs(9.0), "auv2");
    let [ToVehicle::Start { clock, speeds, .. }] = told(&armed, "auv2")[..] else { panic!("{armed:?}") };
    assert_eq!((*clock, speeds.len(), speeds[0].speed), (epoch(), 1, 0.2));
}

#[test]
fn a_hub_that_lost_its_memory_gets_it_back_from_a_vehicle() {
    let mut hub = Hub::new();
    let plan = FlightPlan { mission: HELIX.into(), clock: epoch(), speeds: vec![] };
    let heard = join(&mut hub, "auv3", Phase::Running, Some(plan));
    assert!(heard.contains(&HubOutput::FollowClock(epoch())), "{heard:?}");
    hub.handle(Time::from_secs(123.0), Some(HubInput::ClockStarted(epoch())));
    assert_eq!(hub.phase(), Phase::Running);
    let outputs = outputs(&mut hub);
    assert!(outputs.iter().any(|o| matches!(o, HubOutput::OpenLog { fresh: false, .. })), "{outputs:?}");
    assert!(told(&outputs, "auv3").is_empty(), "it is not started again");
}

#[test]
fn a_stepped_run_needs_every_vehicle() {
    let mut hub = flying(Pace::Stepped, ClockPlan::Stepped);
    hub.handle(Time::ZERO, Some(HubInput::Left("auv1".into())));
    assert_eq!(hub.phase(), Phase::Aborted);
    assert!(told(&outputs(&mut hub), "auv2").contains(&&ToVehicle::Stop));
}

/// Its last word never came, for it had no line. That is no reason to say that it gave none.
#[test]
fn who_lost_the_line_in_a_stepped_run_comes_back_with_the_reason() {
    let mut hub = flying(Pace::Stepped, ClockPlan::Stepped);
    IDS.iter().for_each(|id| hub.handle(Time::ZERO, Some(HubInput::Left((*id).into()))));
    let flight = FlightPlan { mission: HELIX.into(), clock: ClockPlan::Stepped, speeds: vec![] };
    join(&mut hub, "auv2", Phase::Aborted, Some(flight));
    let answers = ask(&mut hub, Time::ZERO, ToFleet::Status);
    let reason = answers.iter().find_map(|output| match output {
        HubOutput::ToControl { message: FromFleet::Status(status), .. } => Some(status.vehicles[1].reason.as_str()),
        _ => None,
    });
    assert_eq!(reason, Some("it lost the line to the network-emulator in a stepped run"));
}

#[test]
fn a_real_flight_goes_on_without_one() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    hub.handle(Time::from_secs(1.0), Some(HubInput::Left("auv1".into())));
    assert_eq!(hub.phase(), Phase::Running);
}

#[test]
fn the_answer_goes_to_who_asked() {
    let mut hub = Hub::new();
    hub.handle(Time::ZERO, Some(HubInput::FromControl { who: OPERATOR.into(), message: ToFleet::Status }));
    let answered = outputs(&mut hub);
    assert!(matches!(&answered[..], [HubOutput::ToControl { who, .. }] if who == OPERATOR), "{answered:?}");
}

#[test]
fn a_speed_that_is_no_number_is_refused() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    for speed in [f64::NAN, f64::INFINITY] {
        assert!(refusal(&ask(&mut hub, Time::from_secs(1.0), ToFleet::Speed { speed })).is_some());
    }
}

/// Robots on straight lines have no speed of their own that they cannot follow, and would fly out of all numbers.
#[test]
fn a_speed_that_no_mission_file_may_have_is_refused() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    let mut command = |speed| ask(&mut hub, Time::from_secs(1.0), ToFleet::Speed { speed });
    for speed in [1e308, -1.1e6] {
        let said = command(speed);
        assert!(refusal(&said).is_some_and(|why| why.ends_with("as in a mission file")), "{said:?}");
    }
    let text = |speed: &str| {
        let robots = include_str!("../../../tests/missions/parallel-three.toml");
        robots.replace("speed = 0.5", &format!("speed = {speed}"))
    };
    assert!(text("9") != text("8"), "the speed is found in the file");
    assert!(Mission::parse("m", &text("1e6")).is_ok() && Mission::parse("m", &text("1.1e6")).is_err());
}

fn ended(hub: &mut Hub, at_s: f64, id: &str, reason: &str) -> Vec<HubOutput> {
    let message = FromVehicle::Ended { phase: Phase::Aborted, reason: reason.into() };
    hub.handle(Time::from_secs(at_s), Some(HubInput::FromVehicle(id.into(), message)));
    outputs(hub)
}

fn notes(outputs: &[HubOutput]) -> Vec<&str> {
    let text = |output| match output {
        &HubOutput::Record(Row::Clock(common::record::ClockRecord::Note(ref row))) => Some(row.text.as_str()),
        _ => None,
    };
    outputs.iter().filter_map(text).collect()
}

#[test]
fn a_real_flight_ends_when_no_vehicle_flies_any_more() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let said = ended(&mut hub, 1.0, "auv1", "it has diverged");
    assert_eq!(notes(&said), ["auv1 aborted: it has diverged"]);
    ended(&mut hub, 1.1, "auv2", "it has diverged");
    assert_eq!(hub.phase(), Phase::Running, "auv3 flies on");
    let said = ended(&mut hub, 1.2, "auv3", "it has diverged");
    assert_eq!(hub.phase(), Phase::Aborted);
    assert!(
        said.contains(&HubOutput::CloseLog) && notes(&said).contains(&"flight ended: no vehicle flies any more"),
        "{said:?}"
    );
}

#[test]
fn a_flight_that_was_stopped_before_its_start_does_not_start() {
    let mut hub = Hub::new();
    IDS.iter().for_each(|id| drop(join(&mut hub, id, Phase::Idle, None)));
    ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
    IDS.iter().for_each(|id| drop(arm(&mut hub, Time::ZERO, id)));
    let said = ask(&mut hub, Time::from_secs(900.0), ToFleet::Stop);
    let stopped = |output: &HubOutput| match output {
        HubOutput::ToControl { message: FromFleet::Status(status), .. } => Some((status.phase, status.now)),
        _ => None,
    };
    // The time of a flight before is none of this one's.
    assert_eq!(said.iter().find_map(stopped), Some((Phase::Aborted, Time::ZERO)));
    assert!(refusal(&ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Stepped })).is_some());
}

fn running(speeds: Vec<SpeedCommand>, epoch_unix_ns: i64) -> Option<FlightPlan> {
    Some(FlightPlan { mission: HELIX.into(), clock: ClockPlan::Real { epoch_unix_ns, speed_up: 1.0 }, speeds })
}

fn hello(hub: &mut Hub, id: &str, flight: Option<FlightPlan>) -> Vec<HubOutput> {
    let hello = FromVehicle::Hello { phase: Phase::Running, flight };
    hub.handle(Time::from_secs(50.0), Some(HubInput::FromVehicle(id.into(), hello)));
    outputs(hub)
}

#[test]
fn a_vehicle_that_missed_the_end_of_its_flight_is_stopped_and_armed_for_the_next() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    hub.handle(Time::from_secs(1.0), Some(HubInput::Left("auv2".into())));
    ask(&mut hub, Time::from_secs(2.0), ToFleet::Stop);
    ask(&mut hub, Time::from_secs(3.0), ToFleet::Upload { mission: HELIX.into() });
    hub.handle(Time::from_secs(4.0), Some(joined("auv2")));
    let said = hello(&mut hub, "auv2", running(vec![], 0));
    assert!(matches!(told(&said, "auv2")[..], [ToVehicle::Stop, ToVehicle::Arm { .. }]), "{said:?}");
    // The same when the next flight is under way.
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let said = hello(&mut hub, "auv2", running(vec![], -7));
    assert!(matches!(told(&said, "auv2")[..], [ToVehicle::Stop, ToVehicle::Arm { .. }]), "{said:?}");
    assert!(told(&hello(&mut hub, "auv1", running(vec![], 0)), "auv1").is_empty(), "in the flight under way");
}

#[test]
fn a_hub_without_memory_that_was_given_the_mission_again_takes_up_the_flight() {
    let mut hub = Hub::new();
    ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
    hub.handle(Time::ZERO, Some(joined("auv3")));
    let said = hello(&mut hub, "auv3", running(vec![], 0));
    assert!(said.contains(&HubOutput::FollowClock(epoch())), "{said:?}");
}

#[test]
fn a_hub_that_takes_up_a_flight_says_since_when_it_counts() {
    let counted = |hub: &mut Hub, at_s: f64| {
        let said = ask(hub, Time::from_secs(at_s), ToFleet::Status);
        said.into_iter().find_map(|output| match output {
            HubOutput::ToControl { message: FromFleet::Status(status), .. } => Some(status.counted_from),
            _ => None,
        })
    };
    let mut first = flying(Pace::Real { speed_up: 1.0 }, epoch());
    assert_eq!(counted(&mut first, 60.0), Some(Time::ZERO));
    let mut back = Hub::new();
    back.handle(Time::ZERO, Some(joined("auv3")));
    hello(&mut back, "auv3", running(vec![], 0));
    back.handle(Time::from_secs(50.0), Some(HubInput::ClockStarted(epoch())));
    assert_eq!(counted(&mut back, 60.0), Some(Time::from_secs(50.0)));
}

fn recorded(outputs: &[HubOutput]) -> Vec<&common::record::Record> {
    let record = |output| match output {
        &HubOutput::Record(Row::Exact(ref record)) => Some(record),
        _ => None,
    };
    outputs.iter().filter_map(record).collect()
}

#[test]
fn what_is_known_of_a_flight_that_is_taken_up_is_recorded_again_and_links_were_down() {
    use common::record::Record;
    let command = |at_s, speed| SpeedCommand { at: Time::from_secs(at_s), speed };
    let mut hub = Hub::new();
    ["auv1", "auv2"].iter().for_each(|id| hub.handle(Time::ZERO, Some(joined(id))));
    join(&mut hub, "auv3", Phase::Running, running(vec![command(30.0, 0.2)], 0));
    hub.handle(Time::from_secs(58.0), Some(HubInput::ClockStarted(epoch())));
    outputs(&mut hub);
    let last = Some(Time::from_secs(40.0));
    hub.handle(Time::from_secs(58.0), Some(HubInput::LogOpened { last }));
    let said = outputs(&mut hub);
    let mut speeds = Vec::new();
    let mut changes = Vec::new();
    for record in recorded(&said) {
        match record {
            Record::Speed(row) => speeds.push((row.t_ns / 1_000_000_000, row.speed)),
            Record::Topology(row) => changes.push((row.t_ns / 1_000_000_000, row.up)),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(speeds, [(0, 0.5), (30, 0.2)]);
    // Four links, down from the last row on; at 58 s the network of this mission is up.
    assert_eq!(changes, [[(40, false); 4], [(58, true); 4]].concat());
    // Another vehicle knows of a speed that this one missed: all are told, and it is recorded.
    hub.handle(Time::from_secs(59.0), Some(joined("auv1")));
    let said = hello(&mut hub, "auv1", running(vec![command(30.0, 0.2), command(45.0, 0.3)], 0));
    assert!(told(&said, "auv3").contains(&&ToVehicle::Speed(command(45.0, 0.3))), "{said:?}");
    assert!(matches!(recorded(&said)[..], [Record::Speed(row)] if row.speed == 0.3), "{said:?}");
}

#[test]
fn the_status_tells_where_vehicles_said_they_are() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let made = Time::from_secs(1.0);
    let state = CoordinationState { mission: digest(HELIX), sender: 1, seq: 10, made, xi: 71.5, scalar: None };
    hub.handle(made, Some(HubInput::State(1, state.encode().into())));
    let answers = ask(&mut hub, Time::from_secs(1.2), ToFleet::Status);
    let status = answers.into_iter().find_map(|output| match output {
        HubOutput::ToControl { message: FromFleet::Status(status), .. } => Some(status),
        _ => None,
    });
    let said: Vec<_> = status.expect("an answer").vehicles.into_iter().map(|vehicle| vehicle.said).collect();
    assert_eq!(said, [None, Some((made, 71.5)), None]);
}

#[test]
fn the_channel_knows_who_has_left_and_who_is_back() {
    use common::record::Fate;
    use common::wire::state::CoordinationState;

    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let say = |hub: &mut Hub, at: f64, seq: u32| {
        let state =
            CoordinationState { mission: digest(HELIX), sender: 0, seq, made: Time::ZERO, xi: 1.0, scalar: None };
        pass(hub, at);
        hub.handle(Time::from_secs(at), Some(HubInput::State(0, state.encode().into())));
        // 5 s of delay; the link is up for the last 2.5 s of every 10 s.
        pass(hub, at + 5.0);
        outputs(hub).into_iter().find_map(|output| match output {
            HubOutput::Settled(settled) => Some(settled.fate),
            HubOutput::Deliver { settled, seat: 1, .. } => settled.map(|settled| settled.fate),
            _ => None,
        })
    };
    assert_eq!(say(&mut hub, 3.0, 30), Some(Fate::Delivered));
    pass(&mut hub, 9.0);
    hub.handle(Time::from_secs(9.0), Some(HubInput::Left("auv2".into())));
    assert_eq!(say(&mut hub, 13.0, 130), Some(Fate::ReceiverAbsent));
    assert_eq!(say(&mut hub, 19.0, 190), Some(Fate::LinkDown), "the link would not have carried it either");
    pass(&mut hub, 25.0);
    hub.handle(Time::from_secs(25.0), Some(joined("auv2")));
    assert_eq!(say(&mut hub, 33.0, 330), Some(Fate::Delivered));
}

#[test]
fn nobody_is_believed_what_cannot_have_been_commanded() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let hello = |hub: &mut Hub, id: &str, speeds: Vec<(i64, f64)>, epoch_unix_ns: i64| {
        let command = |(at, speed): (i64, f64)| SpeedCommand { at: Time::from_nanos(at), speed };
        let flight = running(speeds.into_iter().map(command).collect(), epoch_unix_ns);
        let hello = FromVehicle::Hello { phase: Phase::Finished, flight };
        hub.handle(Time::from_secs(50.0), Some(HubInput::FromVehicle(id.into(), hello)));
        outputs(hub)
    };
    hub.handle(Time::ZERO, Some(HubInput::Joined { id: "outsider".into(), seat: 7 }));
    let is_told = |said: &[HubOutput]| IDS.iter().any(|id| !told(said, id).is_empty());
    assert!(!is_told(&hello(&mut hub, "outsider", vec![(1, 0.2)], 0)), "it is not of the mission");
    for speed in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300] {
        let said = hello(&mut hub, "auv2", vec![(1, 0.1), (1, speed)], 0);
        assert!(!is_told(&said), "{speed}: {said:?}");
    }
    assert!(!is_told(&hello(&mut hub, "auv2", vec![(1, 0.2)], -7)), "of another flight");
    let many: Vec<(i64, f64)> = (0..200_000).map(|at| (at, 0.1)).collect();
    assert!(!is_told(&hello(&mut hub, "auv2", many, 0)));
    // What was commanded is told to all, once.
    let said = hello(&mut hub, "auv2", vec![(1, 0.2), (1, 0.2)], 0);
    assert_eq!(told(&said, "auv1").len(), 1, "{said:?}");
    assert!(told(&hello(&mut hub, "auv3", vec![(1, 0.2)], 0), "auv1").is_empty());
}

#[test]
fn a_hub_without_memory_takes_up_no_flight_that_cannot_be() {
    let hello = |clock: ClockPlan, speeds: Vec<SpeedCommand>| {
        let mut hub = Hub::new();
        let plan = FlightPlan { mission: HELIX.into(), clock, speeds };
        let said = join(&mut hub, "auv3", Phase::Running, Some(plan));
        (hub, said.iter().any(|output| matches!(output, HubOutput::FollowClock(_))))
    };
    for speed_up in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e300] {
        assert!(!hello(ClockPlan::Real { epoch_unix_ns: 0, speed_up }, vec![]).1, "{speed_up}");
    }
    assert!(!hello(epoch(), vec![SpeedCommand { at: Time::ZERO, speed: f64::NAN }]).1);
    let (hub, _) = hello(ClockPlan::Stepped, vec![]);
    assert_eq!(hub.phase(), Phase::Aborted, "a stepped run does not outlive its hub");
    // One that begins in a year is seen when its clock runs.
    let (mut hub, followed) = hello(epoch(), vec![]);
    assert!(followed);
    hub.handle(Time::from_secs(-3e7), Some(HubInput::ClockStarted(epoch())));
    assert_eq!(hub.phase(), Phase::Idle);
    assert!(refusal(&ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() })).is_none(), "it is free");
}

#[test]
fn a_clock_that_nobody_can_fly_by_is_not_started() {
    let mut hub = Hub::new();
    IDS.iter().for_each(|id| drop(join(&mut hub, id, Phase::Idle, None)));
    ask(&mut hub, Time::ZERO, ToFleet::Upload { mission: HELIX.into() });
    IDS.iter().for_each(|id| drop(arm(&mut hub, Time::ZERO, id)));
    for speed_up in [f64::NAN, 0.0, 1e-308, 1e300] {
        let said = ask(&mut hub, Time::ZERO, ToFleet::Start { pace: Pace::Real { speed_up } });
        assert!(refusal(&said).is_some_and(|why| why.contains("0.001 to 1000")), "{said:?}");
    }
}

#[test]
fn a_vehicle_that_comes_back_is_heard_whatever_was_said_in_its_name() {
    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let say = |hub: &mut Hub, at: f64, seq: u32| {
        let sent = hub.totals()[0];
        let state =
            CoordinationState { mission: digest(HELIX), sender: 0, seq, made: Time::ZERO, xi: 1.0, scalar: None };
        hub.handle(Time::from_secs(at), Some(HubInput::State(0, state.encode().into())));
        hub.totals()[0] > sent
    };
    assert!(say(&mut hub, 1.0, u32::MAX));
    assert!(!say(&mut hub, 2.0, 20), "older than what was said");
    hub.handle(Time::from_secs(3.0), Some(HubInput::Left("auv1".into())));
    hub.handle(Time::from_secs(4.0), Some(joined("auv1")));
    assert!(say(&mut hub, 5.0, 50));
}

/// Its process was stopped for half a minute: the record must not tell of a network that was not there.
#[test]
fn a_hub_that_was_not_let_run_records_that_every_link_was_down() {
    use common::record::{Fate, Record};

    for (speed_up, wakes_s) in [(1.0, 38.0), (10.0, 38.0), (1000.0, 38.0)] {
        let clock = ClockPlan::Real { epoch_unix_ns: 0, speed_up };
        let mut hub = flying(Pace::Real { speed_up }, clock);
        let state =
            CoordinationState { mission: digest(HELIX), sender: 0, seq: 30, made: Time::ZERO, xi: 1.0, scalar: None };
        pass(&mut hub, 3.0);
        hub.handle(Time::from_secs(3.0), Some(HubInput::State(0, state.encode().into())));
        pass(&mut hub, 5.0);
        outputs(&mut hub);
        // A message is due at 8 s, and the links are up for the last 2.5 s of every 10 s.
        hub.handle(Time::from_secs(wakes_s), None);
        let said = outputs(&mut hub);
        let fates = |said: &[HubOutput]| -> Vec<Fate> {
            let fate = |output: &HubOutput| match output {
                HubOutput::Settled(settled) => Some(settled.fate),
                HubOutput::Deliver { settled, .. } => settled.map(|settled| settled.fate),
                _ => None,
            };
            said.iter().filter_map(fate).collect()
        };
        if speed_up == 1000.0 {
            assert!(!fates(&said).contains(&Fate::LinkDown), "33 ms of wall clock are no sleep: {said:?}");
            assert!(notes(&said).is_empty(), "{said:?}");
            continue;
        }
        assert!(!fates(&said).is_empty() && fates(&said).iter().all(|fate| *fate == Fate::LinkDown), "{said:?}");
        assert!(!said.iter().any(|output| matches!(output, HubOutput::Deliver { .. })), "{said:?}");
        let change = |record: &Record| match record {
            Record::Topology(row) => Some((row.t_ns / 1_000_000_000, row.up)),
            _ => None,
        };
        let changes: Vec<_> = recorded(&said).into_iter().filter_map(change).collect();
        assert_eq!(changes, [[(5, false); 4], [(38, true); 4]].concat());
        assert_eq!(
            notes(&said),
            ["the emulator was not let run from 5.000 s to 38.000 s; every link was down meanwhile"]
        );
        // From here on the network is as planned.
        pass(&mut hub, 43.0);
        let changes: Vec<_> = recorded(&outputs(&mut hub)).into_iter().filter_map(change).collect();
        assert_eq!(changes, [(40, false); 4]);
    }
}
