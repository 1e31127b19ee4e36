//! A file whose shape is wrong in places, made whole with stand-ins, so that what is wrong with the rest is found as well.
//!
//! The stand-ins are made up, so a fault counts only if it is there whatever they are: several files are made, each with other
//! stand-ins, and what is wrong with all of them alike is wrong with what the user wrote.

use serde_json::Value as Schema;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

use super::shape::{Misfits, integer, join, names_of, present, required, type_of, variant};

/// How many different sets of stand-ins there are: more than there are choices of anything, so that each is tried.
pub(super) const WAYS: usize = 24;

const NUMBERS: [f64; 3] = [1.0, 0.013, 170.0];

/// The file with other values where it cannot be read, and with what is missing.
pub(super) fn mended(root: &DeTable<'_>, misfits: &Misfits, way: usize) -> Table {
    Mender { misfits, way }.table(root, &misfits.schema, "")
}

struct Mender<'m> {
    misfits: &'m Misfits,
    way: usize,
}

impl Mender<'_> {
    fn table(&self, found: &DeTable<'_>, schema: &Schema, key: &str) -> Table {
        let properties = &schema["properties"];
        let mut table = Table::new();
        for (name, value) in found.iter() {
            // What is unknown has been told, and nobody reads it.
            if let Some(schema) = properties.get(name.get_ref().as_ref()) {
                table.insert(
                    name.get_ref().to_string(),
                    self.value(value.get_ref(), schema, &join(key, name.get_ref())),
                );
            }
        }
        for name in required(schema).filter(|name| !found.contains_key(*name)) {
            table.insert(name.to_string(), self.stand_in(&properties[name]));
        }
        table
    }

    fn value(&self, found: &DeValue<'_>, schema: &Schema, key: &str) -> Value {
        let schema = present(schema);
        if self.misfits.unreadable.contains(key) {
            return self.stand_in(schema);
        }
        match found {
            DeValue::Table(inner) => Value::Table(match schema["oneOf"].as_array() {
                Some(choices) => {
                    let mend = |name: &str, value: &DeValue<'_>| {
                        Some(self.value(value, variant(choices, name)?, &join(key, name)))
                    };
                    let entries = inner.iter().map(|(name, value)| (name.get_ref().as_ref(), value.get_ref()));
                    entries.filter_map(|(name, value)| Some((name.to_string(), mend(name, value)?))).collect()
                }
                None => self.table(inner, schema, key),
            }),
            DeValue::Array(items) => {
                let items = items.iter().enumerate();
                let item = |(i, item): (usize, &Spanned<DeValue<'_>>)| {
                    self.value(item.get_ref(), &schema["items"], &format!("{key}[{i}]"))
                };
                Value::Array(items.map(item).collect())
            }
            DeValue::String(text) => Value::String(text.to_string()),
            DeValue::Boolean(value) => Value::Boolean(*value),
            DeValue::Float(float) => Value::Float(float.as_str().parse().unwrap_or(NUMBERS[self.way % 3])),
            DeValue::Integer(_) => {
                Value::Integer(integer(found).and_then(|value| i64::try_from(value).ok()).unwrap_or(1))
            }
            DeValue::Datetime(_) => self.stand_in(schema),
        }
    }

    /// Some value of this schema, another one for each way.
    fn stand_in(&self, schema: &Schema) -> Value {
        let schema = present(schema);
        if let Some(choices) = schema["oneOf"].as_array().filter(|choices| !choices.is_empty()) {
            let choice = &choices[self.way % choices.len()];
            let name = names_of(choice).first().map_or(String::new(), |name| name.to_string());
            return match choice["properties"].get(&name) {
                Some(inner) => Value::Table([(name, self.stand_in(inner))].into_iter().collect()),
                None => Value::String(name),
            };
        }
        if let Some(values) = schema["enum"].as_array().filter(|values| !values.is_empty()) {
            return Value::String(values[self.way % values.len()].as_str().unwrap_or_default().to_string());
        }
        match type_of(schema) {
            Some("integer") => Value::Integer([1, 2, 50][self.way % 3]),
            Some("string") => Value::String(format!("stand-in-{}", self.way)),
            Some("boolean") => Value::Boolean(self.way % 2 == 1),
            Some("array") => {
                let count = schema["minItems"].as_u64().unwrap_or(1 + self.way as u64 % 3);
                Value::Array((0..count).map(|_| self.stand_in(&schema["items"])).collect())
            }
            Some("object") => Value::Table(self.table(&DeTable::new(), schema, "")),
            _ => Value::Float(NUMBERS[self.way % 3]),
        }
    }
}
