//! An emulator that was restarted under way learns from the vehicles what it has forgotten, in whatever order they come.
//! Machine level: no processes.

use std::collections::VecDeque;

use common::machine::Machine;
use common::time::Time;
use common::wire::fleet::{FromFleet, ToFleet};
use common::wire::vehicle::{ClockPlan, Phase, ToVehicle};
use cpf_tests::{mission, mission_text};
use network_emulator::hub::{Hub, HubInput, HubOutput, OPERATOR};
use vehicle_node::node::{NodeInput, NodeOutput, VehicleNode};

const IDS: [&str; 3] = ["a", "b", "c"];
const CLOCK: ClockPlan = ClockPlan::Real { epoch_unix_ns: 0, speed_up: 1.0 };

/// A vehicle that is flying.
fn flying(id: &str, mission: &str) -> VehicleNode {
    let digest = common::mission::digest(mission);
    let mut node = VehicleNode::new(id);
    for message in
        [ToVehicle::Arm { mission: mission.to_string() }, ToVehicle::Start { digest, clock: CLOCK, speeds: Vec::new() }]
    {
        node.handle(Time::ZERO, Some(NodeInput::Message(message)));
    }
    node.handle(Time::ZERO, Some(NodeInput::ClockStarted));
    node.handle(Time::ZERO, Some(NodeInput::LogOpened { last: None }));
    while node.poll_output().is_some() {}
    assert_eq!(node.phase(), Phase::Running);
    node
}

/// What the hub says of every vehicle after they came back in this order: joins and first words, each with a vehicle.
fn after(order: &[(&str, usize)]) -> Vec<(bool, Phase, String)> {
    let text = mission_text("tests/missions/parallel-three.toml");
    let plan = mission(&text);
    let now = Time::from_secs(20.0);
    let mut nodes = IDS.map(|id| flying(id, &text));
    let mut hub = Hub::new();
    let mut inputs = VecDeque::new();
    for (what, vehicle) in order {
        let id = IDS[*vehicle].to_string();
        if *what == "joins" {
            inputs.push_back(HubInput::Joined { id, seat: *vehicle });
        } else {
            nodes[*vehicle].handle(now, Some(NodeInput::Connected));
            inputs.extend(said(&mut nodes[*vehicle], &id));
        }
    }
    let mut status = None;
    // When everything is said, an operator asks.
    let question = || HubInput::FromControl { who: OPERATOR.into(), message: ToFleet::Status };
    while status.is_none() {
        let input = inputs.pop_front().unwrap_or_else(question);
        hub.handle(now, Some(input));
        while let Some(output) = hub.poll_output() {
            match output {
                HubOutput::FollowClock(clock) => hub.handle(now, Some(HubInput::ClockStarted(clock))),
                HubOutput::OpenLog { .. } => hub.handle(now, Some(HubInput::LogOpened { last: None })),
                HubOutput::ToVehicle(id, message) => {
                    let index = plan.index_of(&id).expect("a vehicle of the mission");
                    nodes[index].handle(now, Some(NodeInput::Message(message)));
                    inputs.extend(said(&mut nodes[index], &id));
                }
                HubOutput::ToControl { message: FromFleet::Status(answer), .. } => status = Some(answer),
                _ => {}
            }
        }
    }
    assert!(nodes.iter().all(|node| node.phase() == Phase::Running), "nobody was disturbed");
    let status = status.expect("the hub answers");
    assert_eq!(status.phase, Phase::Running);
    status.vehicles.into_iter().map(|v| (v.connected, v.phase, v.reason)).collect()
}

fn said(node: &mut VehicleNode, id: &str) -> Vec<HubInput> {
    let mut words = Vec::new();
    while let Some(output) = node.poll_output() {
        if let NodeOutput::Send(message) = output {
            words.push(HubInput::FromVehicle(id.to_string(), message));
        }
    }
    words
}

#[test]
fn everyone_is_known_to_fly_whoever_comes_first() {
    let flying = vec![(true, Phase::Running, String::new()); 3];
    let (joins, speaks) = ("joins", "speaks");
    let one_by_one = [(joins, 0), (speaks, 0), (joins, 1), (speaks, 1), (joins, 2), (speaks, 2)];
    assert_eq!(after(&one_by_one), flying);
    // All join before the first of them is heard: the hub arms those of whom it has not heard yet.
    let together = [(joins, 0), (joins, 1), (joins, 2), (speaks, 2), (speaks, 0), (speaks, 1)];
    assert_eq!(after(&together), flying);
    let overtaken = [(joins, 1), (joins, 0), (speaks, 0), (speaks, 1), (joins, 2), (speaks, 2)];
    assert_eq!(after(&overtaken), flying);
}
