//! Topics and their schemas.

use std::borrow::Cow;

use common::record::{
    AchievedRow, ClockRecord, MessageRow, NoteRow, OverrunRow, Record, Row, SpeedRow, StateRow, TicksRow, TopologyRow,
};
use schemars::generate::SchemaSettings;

/// The kind of a topic; the discriminant is its rank in the canonical order. Exact topics rank before clock topics,
/// and within one instant the order is that of a tick: command, network, vehicles, messages, warnings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Topic {
    Speed,
    Topology,
    State,
    Message,
    Warning,
    Achieved,
    Ticks,
    Note,
    Overrun,
}

const STATE_PREFIX: &str = "/vehicles/";
const STATE_SUFFIX: &str = "/state";

impl Topic {
    pub(super) const COUNT: usize = 9;

    pub(super) fn of(row: &Row) -> Topic {
        match row {
            Row::Exact(Record::Speed(_)) => Topic::Speed,
            Row::Exact(Record::Topology(_)) => Topic::Topology,
            Row::Exact(Record::State(_)) => Topic::State,
            Row::Exact(Record::Message(_)) => Topic::Message,
            Row::Exact(Record::Warning(_)) => Topic::Warning,
            Row::Clock(ClockRecord::Achieved(_)) => Topic::Achieved,
            Row::Clock(ClockRecord::Ticks(_)) => Topic::Ticks,
            Row::Clock(ClockRecord::Note(_)) => Topic::Note,
            Row::Clock(ClockRecord::Overrun(_)) => Topic::Overrun,
        }
    }

    /// The full name of the topic; `vehicle` is used by states only.
    pub(super) fn name(self, vehicle: &str) -> Cow<'static, str> {
        match self {
            Topic::Speed => "/mission/speed".into(),
            Topic::Topology => "/network/topology".into(),
            Topic::State => format!("{STATE_PREFIX}{vehicle}{STATE_SUFFIX}").into(),
            Topic::Message => "/network/messages".into(),
            Topic::Warning => "/mission/warnings".into(),
            Topic::Achieved => "/clock/achieved".into(),
            Topic::Ticks => "/clock/ticks".into(),
            Topic::Note => "/clock/notes".into(),
            Topic::Overrun => "/clock/overruns".into(),
        }
    }

    /// The topic of that name; `None` if it is not one of ours.
    pub(super) fn named(name: &str) -> Option<Topic> {
        match name {
            "/mission/speed" => Some(Topic::Speed),
            "/network/topology" => Some(Topic::Topology),
            "/network/messages" => Some(Topic::Message),
            "/mission/warnings" => Some(Topic::Warning),
            "/clock/achieved" => Some(Topic::Achieved),
            "/clock/ticks" => Some(Topic::Ticks),
            "/clock/notes" => Some(Topic::Note),
            "/clock/overruns" => Some(Topic::Overrun),
            _ => name.strip_prefix(STATE_PREFIX)?.strip_suffix(STATE_SUFFIX).map(|_| Topic::State),
        }
    }

    /// The name and the JSON schema of the rows.
    pub(super) fn schema(self) -> (&'static str, Vec<u8>) {
        // Definitions are inlined: most viewers do not follow references.
        let generator = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true).into_generator();
        let (name, schema) = match self {
            Topic::Speed => ("cpf.Speed", generator.into_root_schema_for::<SpeedRow>()),
            Topic::Topology => ("cpf.Topology", generator.into_root_schema_for::<TopologyRow>()),
            Topic::State => ("cpf.State", generator.into_root_schema_for::<StateRow>()),
            Topic::Message => ("cpf.Message", generator.into_root_schema_for::<MessageRow>()),
            Topic::Achieved => ("cpf.Achieved", generator.into_root_schema_for::<AchievedRow>()),
            Topic::Ticks => ("cpf.Ticks", generator.into_root_schema_for::<TicksRow>()),
            Topic::Overrun => ("cpf.Overrun", generator.into_root_schema_for::<OverrunRow>()),
            Topic::Warning | Topic::Note => ("cpf.Note", generator.into_root_schema_for::<NoteRow>()),
        };
        (name, schema.as_value().to_string().into_bytes())
    }

    /// The row in a message of this topic.
    pub(super) fn decode(self, json: &[u8]) -> serde_json::Result<Row> {
        Ok(match self {
            Topic::Speed => Row::Exact(Record::Speed(serde_json::from_slice(json)?)),
            Topic::Topology => Row::Exact(Record::Topology(serde_json::from_slice(json)?)),
            Topic::State => Row::Exact(Record::State(serde_json::from_slice(json)?)),
            Topic::Message => Row::Exact(Record::Message(serde_json::from_slice(json)?)),
            Topic::Warning => Row::Exact(Record::Warning(serde_json::from_slice(json)?)),
            Topic::Achieved => Row::Clock(ClockRecord::Achieved(serde_json::from_slice(json)?)),
            Topic::Ticks => Row::Clock(ClockRecord::Ticks(serde_json::from_slice(json)?)),
            Topic::Note => Row::Clock(ClockRecord::Note(serde_json::from_slice(json)?)),
            Topic::Overrun => Row::Clock(ClockRecord::Overrun(serde_json::from_slice(json)?)),
        })
    }

    /// Appends the row, whose numbers are finite, as JSON.
    pub(super) fn encode(row: &Row, json: &mut Vec<u8>) -> serde_json::Result<()> {
        match row {
            Row::Exact(Record::Speed(row)) => serde_json::to_writer(json, row),
            Row::Exact(Record::Topology(row)) => serde_json::to_writer(json, row),
            Row::Exact(Record::Warning(row)) => serde_json::to_writer(json, row),
            Row::Exact(Record::State(row)) => {
                super::json::state(row, json);
                Ok(())
            }
            Row::Exact(Record::Message(row)) => {
                super::json::message(row, json);
                Ok(())
            }
            Row::Clock(ClockRecord::Achieved(row)) => {
                super::json::achieved(row, json);
                Ok(())
            }
            Row::Clock(ClockRecord::Ticks(row)) => serde_json::to_writer(json, row),
            Row::Clock(ClockRecord::Note(row)) => serde_json::to_writer(json, row),
            Row::Clock(ClockRecord::Overrun(row)) => serde_json::to_writer(json, row),
        }
    }
}

/// The topic on which a row is recorded.
pub fn topic_of(row: &Row) -> Cow<'static, str> {
    let vehicle = match row {
        Row::Exact(Record::State(state)) => &*state.vehicle,
        _ => "",
    };
    Topic::of(row).name(vehicle)
}

/// Whether every number in the row can be written as JSON.
pub(super) fn is_finite(row: &Row) -> bool {
    match row {
        Row::Exact(Record::State(s)) => s.measures().iter().all(|value| value.is_finite()),
        Row::Exact(Record::Speed(row)) => row.speed.is_finite(),
        _ => true,
    }
}
