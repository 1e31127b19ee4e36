//! The hub as mission-control and the vehicles see it.

use common::mission::digest;
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

#[test]
fn the_channel_knows_who_has_left_and_who_is_back() {
    use common::record::Fate;
    use common::wire::state::CoordinationState;

    let mut hub = flying(Pace::Real { speed_up: 1.0 }, epoch());
    outputs(&mut hub);
    let say = |hub: &mut Hub, at: f64, seq: u32| {
        let state =
            CoordinationState { mission: digest(HELIX), sender: 0, seq, made: Time::ZERO, xi: 1.0, scalar: None };
        hub.handle(Time::from_secs(at), Some(HubInput::State(0, state.encode().into())));
        // 5 s of delay; the link is up for the last 2.5 s of every 10 s.
        hub.handle(Time::from_secs(at + 5.0), None);
        outputs(hub).into_iter().find_map(|output| match output {
            HubOutput::Settled(settled) => Some(settled.fate),
            HubOutput::Deliver { settled, seat: 1, .. } => settled.map(|settled| settled.fate),
            _ => None,
        })
    };
    assert_eq!(say(&mut hub, 3.0, 30), Some(Fate::Delivered));
    hub.handle(Time::from_secs(9.0), Some(HubInput::Left("auv2".into())));
    assert_eq!(say(&mut hub, 13.0, 130), Some(Fate::ReceiverAbsent));
    assert_eq!(say(&mut hub, 19.0, 190), Some(Fate::LinkDown), "the link would not have carried it either");
    hub.handle(Time::from_secs(25.0), Some(joined("auv2")));
    assert_eq!(say(&mut hub, 33.0, 330), Some(Fate::Delivered));
}
