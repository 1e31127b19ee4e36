//! Compares a file with the schema of what it is read into, so that every unknown or missing key and every value of a
//! wrong type is found at once, each with its line and what is allowed there.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use schemars::JsonSchema;
use serde_json::Value;
use toml::de::{DeTable, DeValue};

use super::fault::Collector;
use super::file::MissionFile;

/// JSON schema of the mission file, for editors and for the check itself.
pub fn schema() -> Value {
    (*schema_of::<MissionFile>()).clone()
}

/// The schema of `T`, made once: a sweep reads thousands of files of one kind, and making it takes longer than a short flight.
fn schema_of<T: JsonSchema>() -> Arc<Value> {
    static MADE: Mutex<BTreeMap<&str, Arc<Value>>> = Mutex::new(BTreeMap::new());
    let make = || {
        let mut settings = schemars::generate::SchemaSettings::draft2020_12();
        settings.inline_subschemas = true;
        Arc::new(settings.into_generator().into_root_schema_for::<T>().to_value())
    };
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(std::any::type_name::<T>()).or_insert_with(make).clone()
}

/// Notes every difference in shape between a file and the schema of `T`.
pub(super) fn check_shape<T: JsonSchema>(faults: &mut Collector<'_>, root: &DeTable<'_>) {
    table(faults, root, &schema_of::<T>(), "");
}

fn table(faults: &mut Collector<'_>, found: &DeTable<'_>, schema: &Value, key: &str) {
    let Some(properties) = schema["properties"].as_object() else { return };
    for (name, value) in found.iter() {
        let key = join(key, name.get_ref());
        match properties.get(name.get_ref().as_ref()) {
            Some(schema) => check(faults, value.get_ref(), schema, &key),
            None => faults.fault(&key, "an unknown key", listed(properties.keys())),
        }
    }
    for required in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        if !found.contains_key(required) {
            faults.fault(key, format!("no {required}"), describe(&properties[required]));
        }
    }
}

fn check(faults: &mut Collector<'_>, found: &DeValue<'_>, schema: &Value, key: &str) {
    if let Some(choices) = schema["oneOf"].as_array() {
        return choice(faults, found, choices, key);
    }
    if let Some(options) = schema["anyOf"].as_array() {
        // An optional value: the alternative to it is its absence, which does not come here.
        if let Some(schema) = options.iter().find(|option| option["type"] != "null") {
            check(faults, found, schema, key);
        }
        return;
    }
    let fits = match type_of(schema) {
        Some("number") => found.is_float() || found.is_integer(),
        Some("integer") => found.is_integer(),
        Some("string") => found.is_str(),
        Some("boolean") => found.is_bool(),
        Some("array") => found.is_array(),
        Some("object") => found.is_table(),
        _ => true,
    };
    if !fits {
        return faults.fault(key, format!("a {}", found.type_str()), describe(schema));
    }
    if let (Some(text), Some(values)) = (found.as_str(), schema["enum"].as_array())
        && !values.iter().any(|value| value == text)
    {
        return faults.fault(key, format!("{text:?}"), listed(values.iter().filter_map(Value::as_str)));
    }
    if let Some(inner) = found.as_table() {
        table(faults, inner, schema, key);
    }
    if let Some(array) = found.as_array() {
        let (least, most) = (schema["minItems"].as_u64(), schema["maxItems"].as_u64());
        let count = array.len() as u64;
        if least.is_some_and(|least| count < least) || most.is_some_and(|most| count > most) {
            faults.fault(key, format!("{count} values"), format!("{} values", least.or(most).unwrap_or(0)));
        }
        for (i, item) in array.iter().enumerate() {
            check(faults, item.get_ref(), &schema["items"], &format!("{key}[{i}]"));
        }
    }
}

/// One of several named things: a name alone, or `{ name = { ... } }`.
fn choice(faults: &mut Collector<'_>, found: &DeValue<'_>, choices: &[Value], key: &str) {
    let names = || choices.iter().flat_map(names_of);
    let tables = |name: &str| choices.iter().find_map(|c| c["properties"].get(name));
    match (found.as_str(), found.as_table()) {
        (Some(text), _) if choices.iter().any(|c| c["const"] == text || in_enum(c, text)) => {}
        (Some(text), _) if tables(text).is_some() => {
            faults.fault(key, format!("{text:?} alone"), format!("{{ {text} = {{ ... }} }}"));
        }
        (Some(text), _) => faults.fault(key, format!("{text:?}"), listed(names())),
        (_, Some(inner)) if inner.len() == 1 => {
            for (name, value) in inner.iter() {
                let name = name.get_ref().as_ref();
                let key = join(key, name);
                match tables(name) {
                    Some(schema) => check(faults, value.get_ref(), schema, &key),
                    None => faults.fault(&key, format!("{name:?}"), listed(names())),
                }
            }
        }
        _ => faults.fault(key, format!("a {}", found.type_str()), format!("one of {}", listed(names()))),
    }
}

fn names_of(choice: &Value) -> Vec<&str> {
    let constant = choice["const"].as_str();
    let values = choice["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let tables = choice["properties"].as_object().into_iter().flat_map(|p| p.keys()).map(String::as_str);
    constant.into_iter().chain(values).chain(tables).collect()
}

fn in_enum(choice: &Value, text: &str) -> bool {
    choice["enum"].as_array().is_some_and(|values| values.iter().any(|value| value == text))
}

fn type_of(schema: &Value) -> Option<&str> {
    match &schema["type"] {
        Value::String(name) => Some(name),
        Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null"),
        _ => None,
    }
}

/// What a value of this schema is, in words: its documentation, or its type.
fn describe(schema: &Value) -> String {
    match schema["description"].as_str().and_then(|text| text.lines().next()) {
        Some(text) => text.trim_end_matches('.').to_string(),
        None => format!("a {}", type_of(schema).unwrap_or("value")),
    }
}

fn listed<S: AsRef<str>>(names: impl Iterator<Item = S>) -> String {
    let mut names: Vec<String> = names.map(|name| name.as_ref().to_string()).collect();
    names.sort();
    names.join(", ")
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() { name.to_string() } else { format!("{key}.{name}") }
}

#[cfg(test)]
mod tests {
    use super::schema;

    #[test]
    fn the_published_schema_is_the_present_one() {
        let published: serde_json::Value =
            serde_json::from_str(include_str!("../../../missions/mission.schema.json")).expect("JSON");
        assert!(
            published == schema(),
            "missions/mission.schema.json is out of date; write it again with: mission-control schema"
        );
    }
}
