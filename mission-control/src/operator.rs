//! Single commands to a fleet under way: `status`, `speed`, `stop`.

use std::time::{Duration, Instant};

use bus::Plane;
use bus::line::{Line, LineConfig, LineEvent};
use bus::queue::{Events, Wake, recv_until};
use bus::setup::Endpoint;
use common::time::Time;
use common::wire;
use common::wire::fleet::{FleetStatus, FromFleet, ToFleet, VehicleStatus};
use common::wire::vehicle::Phase;
use network_emulator::hub::OPERATOR;
use vehicle_node::node::STOPPED;

use crate::console::short;

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

/// When and where a vehicle was heard last.
fn last_heard(status: &FleetStatus, vehicle: &VehicleStatus) -> String {
    match vehicle.said {
        Some((made, xi)) => format!("last heard {:.1} s ago at ξ = {}", (status.now - made).secs().max(0.0), short(xi)),
        None if status.counted_from > Time::ZERO => {
            format!("not heard since {:.1} s, when the network-emulator came back", status.counted_from.secs())
        }
        None => "never heard".to_string(),
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
    let since = match status.counted_from > Time::ZERO {
        true => format!(" since {:.1} s, when the network-emulator came back", status.counted_from.secs()),
        false => String::new(),
    };
    let _ = writeln!(
        text,
        "messages{since}: {sent} sent = {delivered} delivered + {dropped} dropped + {in_flight} in flight"
    );
    if let Some(so_far) = mission.as_ref().and_then(|mission| crate::theory::so_far(mission, status)) {
        let _ = writeln!(text, "{so_far}");
    }
    for vehicle in &status.vehicles {
        if !vehicle.connected && status.phase == Phase::Running {
            let _ = writeln!(text, "  {:<16} lost, {}", vehicle.id, last_heard(status, vehicle));
            continue;
        }
        let line = if vehicle.connected { "connected" } else { "not connected" };
        let place = vehicle.said.map_or(String::new(), |(_, xi)| format!(", ξ = {}", short(xi)));
        let how = match (vehicle.phase, vehicle.reason.as_str()) {
            (Phase::Aborted, STOPPED) => STOPPED.to_string(),
            (phase, "") => phase.as_str().to_string(),
            (phase, reason) => format!("{}: {reason}", phase.as_str()),
        };
        let _ = writeln!(text, "  {:<16} {:<14} {how}{place}", vehicle.id, line);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vehicle(id: &str, connected: bool, said: Option<(f64, f64)>) -> VehicleStatus {
        let said = said.map(|(made, xi)| (Time::from_secs(made), xi));
        VehicleStatus { id: id.into(), connected, phase: Phase::Running, reason: String::new(), said }
    }

    fn status() -> FleetStatus {
        FleetStatus {
            phase: Phase::Running,
            mission: String::new(),
            now: Time::from_secs(212.7),
            end: Time::from_secs(800.0),
            speed: 0.5,
            speed_since: Time::ZERO,
            vehicles: vec![vehicle("auv1", true, Some((212.6, 91.25))), vehicle("auv3", false, Some((200.4, 87.2)))],
            collected: false,
            pace: None,
            messages: [9, 4, 3, 2],
            drops: [0, 0, 3, 0, 0, 0, 0, 0],
            counted_from: Time::ZERO,
        }
    }

    #[test]
    fn who_is_lost_is_told_with_where_it_was_heard_last() {
        let told = describe(&status());
        assert!(told.contains("auv3             lost, last heard 12.3 s ago at ξ = 87.2\n"), "{told}");
        assert!(told.contains("auv1             connected      running, ξ = 91.25\n"), "{told}");
        assert!(told.contains("\nmessages: 9 sent"), "{told}");
        let mut silent = status();
        silent.vehicles[1].said = None;
        assert!(describe(&silent).contains("lost, never heard"), "{}", describe(&silent));
        let mut over = status();
        over.phase = Phase::Finished;
        assert!(describe(&over).contains("auv3             not connected"), "{}", describe(&over));
    }

    #[test]
    fn a_stop_is_no_failure_and_counts_say_since_when() {
        let mut stopped = status();
        stopped.phase = Phase::Aborted;
        (stopped.vehicles[0].phase, stopped.vehicles[0].reason) = (Phase::Aborted, STOPPED.into());
        stopped.counted_from = Time::from_secs(83.2);
        let told = describe(&stopped);
        assert!(told.contains("auv1             connected      stopped, ξ"), "{told}");
        assert!(told.contains("messages since 83.2 s, when the network-emulator came back: 9 sent"), "{told}");
        stopped.phase = Phase::Running;
        stopped.vehicles[1].said = None;
        assert!(describe(&stopped).contains("not heard since 83.2 s"), "{}", describe(&stopped));
    }
}
