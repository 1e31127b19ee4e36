//! Commands to a fleet under way: `speed`, `status`, `stop`.

use std::process::ExitCode;
use std::time::Duration;

use bus::setup::Endpoint;
use common::mission::Mission;
use common::wire::fleet::{FleetStatus, FromFleet, ToFleet};

use super::{End, Ended};
use crate::{operator, theory};

/// How long a single command waits for the fleet to appear.
const COMMAND_PATIENCE: Duration = Duration::from_secs(3);

#[derive(Debug, clap::Args)]
pub(super) struct FleetArgs {
    /// The fleet's network-emulator; given up when it is not found within 3 s, or does not answer within 5 s
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/127.0.0.1:7447", env = "CPF_ATTACH")]
    pub(super) attach: Endpoint,
}

fn ask(endpoint: &Endpoint, question: &ToFleet) -> Result<FromFleet, End> {
    match operator::ask(endpoint, question, COMMAND_PATIENCE) {
        Ok(FromFleet::Refused { reason }) => Err(End(1, reason)),
        Ok(answer) => Ok(answer),
        Err(error) => Err(End(3, error)),
    }
}

pub(super) fn speed(speed: f64, endpoint: &Endpoint) -> Ended {
    if let FromFleet::SpeedTaken { at, speed } = ask(endpoint, &ToFleet::Speed { speed })? {
        bus::tell!("formation speed {speed} from {at} on");
    }
    Ok(ExitCode::SUCCESS)
}

pub(super) fn status(json: bool, endpoint: &Endpoint) -> Ended {
    if let FromFleet::Status(status) = ask(endpoint, &ToFleet::Status)? {
        if json {
            bus::tell!("{:#}", as_json(&status));
        } else {
            bus::tell!("{}", operator::describe(&status).trim_end());
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn as_json(status: &FleetStatus) -> serde_json::Value {
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
    let mission = Mission::parse("the mission", &status.mission).ok();
    serde_json::json!({
        "phase": status.phase.as_str(), "now_s": status.now.secs(), "end_s": status.end.secs(),
        "speed": status.speed, "vehicles": vehicles,
        "messages": {"sent": sent, "delivered": delivered, "dropped": dropped, "in_flight": in_flight,
            "since_s": status.counted_from.secs()},
        "monitor": mission.and_then(|mission| theory::so_far(&mission, status)),
    })
}

pub(super) fn stop(endpoint: &Endpoint) -> Ended {
    ask(endpoint, &ToFleet::Stop)?;
    bus::tell!("stopped");
    Ok(ExitCode::SUCCESS)
}
