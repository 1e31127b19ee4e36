//! Single commands to a fleet under way: `status`, `speed`, `stop`.

use std::time::{Duration, Instant};

use bus::Plane;
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::{Events, Wake, recv_until};
use bus::setup::Endpoint;
use common::wire;
use common::wire::fleet::{FleetStatus, FromFleet, ToFleet};
use common::wire::vehicle::Phase;
use network_emulator::hub::OPERATOR;
use vehicle_node::node::STOPPED;

/// How long the fleet may take to answer.
const ANSWER: Duration = Duration::from_secs(5);

/// Asks the fleet one thing and gives its answer.
///
/// # Errors
/// Why there is no answer.
pub fn ask(endpoint: &Endpoint, question: &ToFleet, patience: Duration) -> Result<FromFleet, String> {
    let mut config = LineConfig::new(endpoint.clone(), OPERATOR);
    config.patience = Some(patience);
    let (line, events) = Line::connect(config).map_err(|error| error.to_string())?;
    let answer = exchange(&line, &events, question);
    line.close();
    answer
}

fn exchange(line: &Line, events: &Events<LineEvent>, question: &ToFleet) -> Result<FromFleet, String> {
    let deadline = Instant::now() + ANSWER;
    loop {
        match recv_until(events, Some(deadline)) {
            Wake::Message(LineEvent::Connected) => {
                line.send(Plane::Mission, &wire::encode(question)).map_err(|error| error.to_string())?;
            }
            Wake::Message(LineEvent::Packet { plane: Plane::Mission, bytes, .. }) => {
                if let Ok(answer) = wire::decode::<FromFleet>(&bytes) {
                    return Ok(answer);
                }
            }
            Wake::Message(LineEvent::Refused(refusal)) => return Err(refusal.to_string()),
            Wake::Message(_) => {}
            Wake::Deadline => return Err(format!("the fleet did not answer within {} s", ANSWER.as_secs())),
            Wake::Closed => return Err("the line to the fleet closed".to_string()),
        }
    }
}

/// A status for a person.
pub fn describe(status: &FleetStatus) -> String {
    use std::fmt::Write as _;
    let mut text = String::new();
    let mission = common::mission::Mission::parse("the mission", &status.mission).ok();
    let name = mission.as_ref().map_or("no mission", |mission| &mission.name);
    let _ = writeln!(
        text,
        "{name}: {} at {:.1} of {:.1} s, formation speed {}",
        status.phase.as_str(),
        status.now.secs(),
        status.end.secs(),
        status.speed
    );
    let [sent, delivered, dropped, in_flight] = status.messages;
    let _ = writeln!(text, "messages: {sent} sent = {delivered} delivered + {dropped} dropped + {in_flight} in flight");
    if let Some(so_far) = mission.as_ref().and_then(|mission| crate::theory::so_far(mission, status)) {
        let _ = writeln!(text, "{so_far}");
    }
    for vehicle in &status.vehicles {
        let line = if vehicle.connected { "connected" } else { "not connected" };
        let how = match (vehicle.phase, vehicle.reason.as_str()) {
            (Phase::Aborted, STOPPED) => STOPPED.to_string(),
            (phase, "") => phase.as_str().to_string(),
            (phase, reason) => format!("{}: {reason}", phase.as_str()),
        };
        let _ = writeln!(text, "  {:<16} {:<14} {how}", vehicle.id, line);
    }
    text
}
