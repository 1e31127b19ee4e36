//! The whole fleet in one thread: the same machines as the processes, connected by queues in place of Zenoh, with
//! virtual time. What the processes record in a stepped run, this records bit for bit.

use std::collections::VecDeque;
use std::sync::Arc;

use common::machine::Machine;
use common::mission::Mission;
use common::record::{Name, Record, Row};
use common::time::Time;
use common::wire::fleet::{Pace, ToFleet};
use common::wire::vehicle::{ClockPlan, Phase};
use network_emulator::hub::{COLLECTOR, Hub, HubInput, HubOutput};
use vehicle_node::node::{NodeInput, NodeOutput, VehicleNode};

use crate::conduct::{Conduct, ConductInput, ConductOutput};

/// How often mission-control asks a fleet that has come to rest before it gives up.
const PATIENCE: u32 = 100;

/// How a simulation ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Finished, or Aborted.
    pub phase: Phase,
    /// Mission time reached.
    pub now: Time,
    /// Sent, delivered, dropped and in flight, over all links.
    pub messages: [u64; 4],
    /// Vehicles that gave up, and why.
    pub aborted: Vec<String>,
}

/// What happens next, and to whom.
enum Event {
    Hub(HubInput),
    Node(usize, NodeInput),
    Conduct(ConductInput),
}

struct Fleet<'m> {
    mission: &'m Arc<Mission>,
    names: Vec<Name>,
    hub: Hub,
    nodes: Vec<VehicleNode>,
    conduct: Conduct,
    events: VecDeque<Event>,
    now: Time,
    outcome: Option<Result<(Phase, Vec<String>), String>>,
}

/// Flies a mission from its start to its end. Every row goes to `record` as it happens; `progress` is told the
/// mission time from which on rows may still come and may end the simulation by returning false.
///
/// # Errors
/// Why the fleet could not fly.
pub fn simulate(
    mission: &Arc<Mission>,
    record: impl FnMut(Row),
    progress: impl FnMut(Time) -> bool,
) -> Result<Outcome, String> {
    simulate_with(Hub::new(), mission, record, progress)
}

/// [`simulate`] with this hub.
///
/// # Errors
/// Why the fleet could not fly.
pub fn simulate_with(
    hub: Hub,
    mission: &Arc<Mission>,
    mut record: impl FnMut(Row),
    mut progress: impl FnMut(Time) -> bool,
) -> Result<Outcome, String> {
    let mut fleet = Fleet {
        mission,
        names: mission.vehicles.iter().map(|vehicle| Name::from(vehicle.id.as_str())).collect(),
        hub,
        // Two hundred copies of a mission with forty thousand links would take gigabytes.
        nodes: mission.vehicles.iter().map(|vehicle| VehicleNode::knowing(&vehicle.id, mission.clone())).collect(),
        conduct: Conduct::new(mission.clone(), Pace::Stepped, None, false),
        events: VecDeque::new(),
        now: Time::ZERO,
        outcome: None,
    };
    for (index, vehicle) in mission.vehicles.iter().enumerate() {
        fleet.events.push_back(Event::Hub(HubInput::Joined { id: vehicle.id.clone(), seat: index }));
        fleet.events.push_back(Event::Node(index, NodeInput::Connected));
    }
    fleet.events.push_back(Event::Conduct(ConductInput::Connected));
    let mut told = Time::from_nanos(i64::MIN);
    let (mut quiet, mut asked_at) = (0, told);
    loop {
        while let Some(event) = fleet.events.pop_front() {
            fleet.step(event, &mut record);
            if fleet.now > told {
                told = fleet.now;
                if !progress(told) {
                    fleet.hub.handle(told, Some(from_control(ToFleet::Stop)));
                    fleet.drain_hub(&mut record);
                }
            }
            if let Some(outcome) = fleet.outcome.take() {
                let (phase, aborted) = outcome?;
                return Ok(Outcome { phase, now: fleet.now, messages: fleet.hub.totals(), aborted });
            }
        }
        // All is quiet: mission-control asks how it stands.
        quiet = if fleet.now == asked_at { quiet + 1 } else { 0 };
        asked_at = fleet.now;
        if quiet > PATIENCE {
            return Err(format!("the fleet came to rest at {} before the flight was over", fleet.now));
        }
        match fleet.conduct.poll_timeout() {
            Some(at) => fleet.conduct.handle(at, None),
            None => return Err("mission-control came to rest before the flight was over".to_string()),
        }
        fleet.drain_conduct();
    }
}

fn from_control(message: ToFleet) -> HubInput {
    HubInput::FromControl { who: COLLECTOR.to_string(), message }
}

impl Fleet<'_> {
    fn step(&mut self, event: Event, record: &mut impl FnMut(Row)) {
        match event {
            Event::Hub(input) => {
                self.hub.handle(self.now, Some(input));
                self.drain_hub(record);
            }
            Event::Node(index, input) => {
                self.nodes[index].handle(self.now, Some(input));
                self.drain_node(index, record);
            }
            Event::Conduct(input) => {
                self.conduct.handle(Time::ZERO, Some(input));
                self.drain_conduct();
            }
        }
    }

    fn drain_hub(&mut self, record: &mut impl FnMut(Row)) {
        while let Some(output) = self.hub.poll_output() {
            match output {
                HubOutput::ToVehicle(id, message) => {
                    if let Some(index) = self.mission.index_of(&id) {
                        self.events.push_back(Event::Node(index, NodeInput::Message(message)));
                    }
                }
                HubOutput::ToControl { message, .. } => {
                    self.events.push_back(Event::Conduct(ConductInput::FromFleet(message.into())));
                }
                HubOutput::Record(row) => record(row),
                HubOutput::Settled(settled) => {
                    let link = &self.mission.links[settled.link];
                    let row = settled.message(&self.names[link.from], &self.names[link.to]);
                    record(Row::Exact(Record::Message(row)));
                }
                HubOutput::StartClock(_) => {
                    self.hub.handle(self.now, Some(HubInput::ClockStarted(ClockPlan::Stepped)));
                }
                // A stepped clock delivers with the grant; logs are not files here; the console is elsewhere.
                HubOutput::Deliver { .. }
                | HubOutput::OpenLog { .. }
                | HubOutput::CloseLog
                | HubOutput::Dismissed
                | HubOutput::FollowClock(_)
                | HubOutput::ReadLog { .. }
                | HubOutput::Say(_) => {}
            }
        }
        self.now = self.now.max(self.hub.mission_time());
    }

    fn drain_node(&mut self, index: usize, record: &mut impl FnMut(Row)) {
        while let Some(output) = self.nodes[index].poll_output() {
            match output {
                NodeOutput::Send(message) => {
                    let id = self.mission.vehicles[index].id.clone();
                    self.events.push_back(Event::Hub(HubInput::FromVehicle(id, message)));
                }
                NodeOutput::Record(row) => record(row),
                NodeOutput::OpenLog { .. } => {
                    // Answered at once, as the loop of the processes does.
                    self.nodes[index].handle(self.now, Some(NodeInput::LogOpened { last: None }));
                }
                NodeOutput::FollowClock(_) => self.nodes[index].handle(self.now, Some(NodeInput::ClockStarted)),
                NodeOutput::Transmit(_)
                | NodeOutput::Dismissed
                | NodeOutput::CloseLog
                | NodeOutput::ReadLog { .. }
                | NodeOutput::Say(_) => {}
            }
        }
    }

    fn drain_conduct(&mut self) {
        while let Some(output) = self.conduct.poll_output() {
            match output {
                ConductOutput::Send(message) => self.events.push_back(Event::Hub(from_control(message))),
                ConductOutput::Over { phase, aborted } => self.outcome = Some(Ok((phase, aborted))),
                ConductOutput::Failed(reason) => self.outcome = Some(Err(reason)),
                ConductOutput::Progress(..)
                | ConductOutput::Remark(_)
                | ConductOutput::Log { .. }
                | ConductOutput::Done { .. } => {}
            }
        }
    }
}
