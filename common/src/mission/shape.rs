//! Compares a file with the schema of what it is read into, so that every unknown or missing key and every value of a
//! wrong type is found at once, each with its line and what is allowed there.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Display;
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
pub(super) fn check_shape<T: JsonSchema>(faults: &mut Collector<'_>, root: &DeTable<'_>) -> Misfits {
    let schema = schema_of::<T>();
    let mut look = Look { faults, misfits: Misfits { schema: Arc::clone(&schema), ..Misfits::default() } };
    look.table(root, &schema, "");
    look.misfits
}

/// What of a file does not fit its schema.
#[derive(Debug, Default)]
pub(super) struct Misfits {
    pub(super) schema: Arc<Value>,
    /// Keys whose values cannot be read.
    pub(super) unreadable: HashSet<String>,
    /// Keys that are missing.
    missing: Vec<String>,
}

impl Misfits {
    /// Whether all can be read; unknown keys are faults, but in nobody's way.
    pub(super) fn none(&self) -> bool {
        self.unreadable.is_empty() && self.missing.is_empty()
    }

    /// Whether a key is one of those whose value has to be made up, or below one.
    pub(super) fn made_up(&self, key: &str) -> bool {
        let below = |of: &String| {
            key.strip_prefix(of.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.unreadable.iter().chain(&self.missing).any(below)
    }
}

struct Look<'a, 't> {
    faults: &'a mut Collector<'t>,
    misfits: Misfits,
}

impl Look<'_, '_> {
    fn table(&mut self, found: &DeTable<'_>, schema: &Value, key: &str) {
        let Some(properties) = schema["properties"].as_object() else { return };
        for (name, value) in found.iter() {
            let key = join(key, name.get_ref());
            match properties.get(name.get_ref().as_ref()) {
                Some(schema) => self.check(value.get_ref(), schema, &key),
                None => self.faults.fault(&key, "an unknown key", listed(properties.keys())),
            }
        }
        for required in required(schema).filter(|name| !found.contains_key(*name)) {
            self.misfits.missing.push(join(key, required));
            self.faults.fault(key, format!("no {required}"), describe(&properties[required]));
        }
    }

    /// Notes a value that cannot be read.
    fn unreadable(&mut self, key: &str, found: impl Display, allowed: impl Display) {
        self.misfits.unreadable.insert(key.to_string());
        self.faults.fault(key, found, allowed);
    }

    fn check(&mut self, found: &DeValue<'_>, schema: &Value, key: &str) {
        let schema = present(schema);
        if let Some(choices) = schema["oneOf"].as_array() {
            return self.choice(found, choices, key);
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
            return self.unreadable(key, a(found.type_str()), describe(schema));
        }
        if !in_range(found, schema) {
            return self.unreadable(key, shortened(found), describe(schema));
        }
        if let (Some(text), Some(values)) = (found.as_str(), schema["enum"].as_array())
            && !values.iter().any(|value| value == text)
        {
            return self.unreadable(key, format!("{text:?}"), listed(values.iter().filter_map(Value::as_str)));
        }
        if let Some(inner) = found.as_table() {
            self.table(inner, schema, key);
        }
        if let Some(array) = found.as_array() {
            let (least, most) = (schema["minItems"].as_u64(), schema["maxItems"].as_u64());
            let count = array.len() as u64;
            if least.is_some_and(|least| count < least) || most.is_some_and(|most| count > most) {
                let values = |count: u64| format!("{count} value{}", if count == 1 { "" } else { "s" });
                self.unreadable(key, values(count), values(least.or(most).unwrap_or(0)));
            }
            for (i, item) in array.iter().enumerate() {
                self.check(item.get_ref(), &schema["items"], &format!("{key}[{i}]"));
            }
        }
    }

    /// One of several named things: a name alone, or `{ name = { ... } }`.
    fn choice(&mut self, found: &DeValue<'_>, choices: &[Value], key: &str) {
        let names = || listed(choices.iter().flat_map(names_of));
        match (found.as_str(), found.as_table()) {
            (Some(text), _) if choices.iter().any(|c| c["const"] == text || in_enum(c, text)) => {}
            (Some(text), _) if variant(choices, text).is_some() => {
                self.unreadable(key, format!("{text:?} alone"), format!("{{ {text} = {{ ... }} }}"));
            }
            (Some(text), _) => self.unreadable(key, format!("{text:?}"), names()),
            (_, Some(inner)) if inner.len() == 1 => {
                for (name, value) in inner.iter() {
                    let name = name.get_ref().as_ref();
                    match variant(choices, name) {
                        Some(schema) => self.check(value.get_ref(), schema, &join(key, name)),
                        None => {
                            self.misfits.unreadable.insert(key.to_string());
                            self.faults.fault(&join(key, name), format!("{name:?}"), names());
                        }
                    }
                }
            }
            (_, Some(inner)) => {
                let found = inner.iter().map(|(name, _)| name.get_ref().as_ref());
                let found = if inner.is_empty() { "an empty table".to_string() } else { listed(found) };
                self.unreadable(key, found, format!("one of {}", names()));
            }
            _ => self.unreadable(key, a(found.type_str()), format!("one of {}", names())),
        }
    }
}

/// The schema of a value that is there: an optional one has its absence as an alternative, which never comes here.
pub(super) fn present(schema: &Value) -> &Value {
    let options = schema["anyOf"].as_array().into_iter().flatten();
    options.into_iter().find(|option| option["type"] != "null").map_or(schema, present)
}

/// The schema of the table that belongs to a name among choices.
pub(super) fn variant<'s>(choices: &'s [Value], name: &str) -> Option<&'s Value> {
    choices.iter().find_map(|choice| choice["properties"].get(name))
}

pub(super) fn required(schema: &Value) -> impl Iterator<Item = &str> {
    schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// Whether a number is one that can be kept, and an integer in the range of its type.
fn in_range(found: &DeValue<'_>, schema: &Value) -> bool {
    match (found, type_of(schema)) {
        (DeValue::Integer(_), Some("integer")) => {
            let (least, most) = range(schema);
            integer(found).is_some_and(|value| (least..=most).contains(&value))
        }
        (DeValue::Integer(_), _) => integer(found).is_some_and(|value| i64::try_from(value).is_ok()),
        (DeValue::Float(float), _) => {
            let named = float.as_str().contains("inf") || float.as_str().contains("nan");
            named || float.as_str().parse::<f64>().is_ok_and(f64::is_finite)
        }
        _ => true,
    }
}

/// An integer of a file.
pub(super) fn integer(found: &DeValue<'_>) -> Option<i128> {
    let DeValue::Integer(number) = found else { return None };
    i128::from_str_radix(number.as_str(), number.radix()).ok()
}

/// The integers of a type. A file knows none beyond 64 bits with a sign.
fn range(schema: &Value) -> (i128, i128) {
    let most = match schema["format"].as_str() {
        Some("uint8") => i128::from(u8::MAX),
        Some("uint16") => i128::from(u16::MAX),
        Some("uint32") => i128::from(u32::MAX),
        _ => i128::from(i64::MAX),
    };
    let least = if schema["minimum"] == 0 { 0 } else { i128::from(i64::MIN) };
    (least, schema["maximum"].as_i64().map_or(most, i128::from))
}

/// A number as written, if it is short.
fn shortened(found: &DeValue<'_>) -> String {
    match found {
        DeValue::Integer(number) if number.as_str().len() <= 24 => number.to_string(),
        DeValue::Integer(number) => format!("a number of {} digits", number.as_str().len()),
        DeValue::Float(number) if number.as_str().len() <= 24 => number.to_string(),
        _ => "a number too large".to_string(),
    }
}

/// A type with its article.
fn a(name: &str) -> String {
    let article = if name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {name}")
}

pub(super) fn names_of(choice: &Value) -> Vec<&str> {
    let constant = choice["const"].as_str();
    let values = choice["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let tables = choice["properties"].as_object().into_iter().flat_map(|p| p.keys()).map(String::as_str);
    constant.into_iter().chain(values).chain(tables).collect()
}

fn in_enum(choice: &Value, text: &str) -> bool {
    choice["enum"].as_array().is_some_and(|values| values.iter().any(|value| value == text))
}

pub(super) fn type_of(schema: &Value) -> Option<&str> {
    match &schema["type"] {
        Value::String(name) => Some(name),
        Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null"),
        _ => None,
    }
}

/// What a value of this schema is, in words: its type, and what is written of it.
fn describe(schema: &Value) -> String {
    let inner = present(schema);
    let kind = match type_of(inner) {
        _ if inner["oneOf"].is_array() => {
            format!("one of {}", listed(inner["oneOf"].as_array().into_iter().flatten().flat_map(names_of)))
        }
        Some("integer") => {
            let (least, most) = range(inner);
            format!("an integer from {least} to {most}")
        }
        Some("object") => "a table".to_string(),
        name => a(name.unwrap_or("value")),
    };
    let about = schema["description"].as_str().or(inner["description"].as_str());
    match about.and_then(|text| text.lines().next()) {
        Some(text) => format!("{kind}: {}", text.trim_end_matches('.')),
        None => kind,
    }
}

fn listed<S: AsRef<str>>(names: impl Iterator<Item = S>) -> String {
    let mut names: Vec<String> = names.map(|name| name.as_ref().to_string()).collect();
    names.sort();
    names.join(", ")
}

pub(super) fn join(key: &str, name: &str) -> String {
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
