//! What is wrong with a mission file, where, and what would be right.

use std::fmt;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Line in the file, from 1; 0 if the file is not to blame as a whole.
    pub line: usize,
    /// Key, as in `vehicles[1].path.helix.radius_m`; empty if the fault is not in one key.
    pub key: String,
    /// What was found.
    pub found: String,
    /// What is allowed, or what to do.
    pub allowed: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "found {}", self.found)?;
        if !self.allowed.is_empty() {
            write!(f, "; allowed: {}", self.allowed)?;
        }
        Ok(())
    }
}

/// Everything that is wrong with a mission file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Faults {
    /// Name of the file as the user gave it.
    pub file: String,
    /// In the order of the file.
    pub list: Vec<Fault>,
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.list.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{}:{}: {fault}", self.file, fault.line)?;
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

/// A number as a person writes it: not with three hundred digits.
pub(super) fn plain(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 || (1e-6..1e15).contains(&magnitude) || !value.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Finds the line of a key in a mission file.
pub(super) struct Locator<'t> {
    text: &'t str,
    table: Option<Spanned<DeTable<'t>>>,
}

impl<'t> Locator<'t> {
    pub(super) fn new(text: &'t str) -> Locator<'t> {
        Locator { text, table: DeTable::parse(text).ok() }
    }

    /// Line of a byte, from 1.
    pub(super) fn line_of_byte(&self, byte: usize) -> usize {
        1 + self.text.as_bytes().iter().take(byte).filter(|&&b| b == b'\n').count()
    }

    /// Line of a key such as `vehicles[1].start.x_m`, or of the closest ancestor that is in the file.
    pub(super) fn line(&self, key: &str) -> usize {
        let Some(root) = &self.table else { return 0 };
        let mut line = 1;
        let mut here: Option<&DeValue<'_>> = None;
        for step in key.split(['.', '[']).filter(|step| !step.is_empty()) {
            let next = match step.strip_suffix(']') {
                Some(index) => index
                    .parse::<usize>()
                    .ok()
                    .and_then(|index| here.and_then(DeValue::as_array).and_then(|array| array.get(index)))
                    .map(|value| (value.span().start, value)),
                None => match here {
                    None => root.get_ref().get_key_value(step),
                    Some(value) => value.as_table().and_then(|table| table.get_key_value(step)),
                }
                .map(|(name, value)| (name.span().start, value)),
            };
            let Some((byte, value)) = next else { break };
            line = self.line_of_byte(byte);
            here = Some(value.get_ref());
        }
        line
    }
}

/// Collects faults while a file is checked.
pub struct Collector<'t> {
    locator: Locator<'t>,
    list: Vec<Fault>,
    /// Whether a link names nobody: what follows from who hears whom is then not told.
    pub(super) links_in_doubt: bool,
}

impl<'t> Collector<'t> {
    pub(super) fn new(text: &'t str) -> Collector<'t> {
        Collector { locator: Locator::new(text), list: Vec::new(), links_in_doubt: false }
    }

    /// Notes a fault of a key such as `vehicles[1].start.x_m`.
    pub fn fault(&mut self, key: &str, found: impl fmt::Display, allowed: impl fmt::Display) {
        let line = self.locator.line(key);
        let (found, allowed) = (found.to_string(), allowed.to_string());
        let fault = Fault { line, key: key.to_string(), found, allowed };
        if !self.list.contains(&fault) {
            self.list.push(fault);
        }
    }

    /// Notes a fault that the links have, unless some of them are not known.
    pub(super) fn fault_of_links(&mut self, key: &str, found: impl fmt::Display, allowed: impl fmt::Display) {
        if !self.links_in_doubt {
            self.fault(key, found, allowed);
        }
    }

    /// Notes the faults that are in all of these lists, of such keys.
    pub(super) fn add_common(&mut self, lists: Vec<Vec<Fault>>, of: impl Fn(&str) -> bool) {
        let Some((first, others)) = lists.split_first() else { return };
        let common = first.iter().filter(|fault| others.iter().all(|list| list.contains(fault)));
        for fault in common.filter(|fault| of(&fault.key)) {
            if !self.list.contains(fault) {
                self.list.push(fault.clone());
            }
        }
    }

    pub(super) fn into_list(self) -> Vec<Fault> {
        self.list
    }

    /// Notes a fault at a byte of the file, as the parser reports it.
    pub(super) fn fault_at(&mut self, byte: Option<usize>, found: String, allowed: String) {
        let line = byte.map_or(0, |byte| self.locator.line_of_byte(byte));
        self.list.push(Fault { line, key: String::new(), found, allowed });
    }

    pub(super) fn line_of_byte(&self, byte: usize) -> usize {
        self.locator.line_of_byte(byte)
    }

    /// Notes a fault unless the number is finite and `ok`.
    pub fn number(&mut self, key: &str, value: f64, ok: bool, allowed: &str) {
        if !(ok && value.is_finite()) {
            self.fault(key, plain(value), allowed);
        }
    }

    /// Notes a fault unless the number is at most so large, whatever its sign.
    pub(super) fn magnitude(&mut self, key: &str, value: f64, most: f64, unit: &str) {
        self.number(key, value, value.abs() <= most, &format!("-{most} to {most} {unit}"));
    }

    /// Notes a fault unless the number is in a range.
    pub(super) fn between(&mut self, key: &str, value: f64, least: f64, most: f64, unit: &str) {
        self.number(key, value, (least..=most).contains(&value), &format!("{least} to {most} {unit}"));
    }

    pub(super) fn count(&self) -> usize {
        self.list.len()
    }

    /// Notes a fault unless the number is finite and above 0.
    pub fn positive(&mut self, key: &str, value: f64, unit: &str) {
        self.number(key, value, value > 0.0, &format!("a finite number above 0 {unit}"));
    }

    /// Notes a fault unless the number is finite.
    pub fn finite(&mut self, key: &str, value: f64, unit: &str) {
        self.number(key, value, true, &format!("a finite number {unit}"));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(super) fn into_faults(mut self, file: &str) -> Faults {
        self.list.sort_by_key(|fault| fault.line);
        Faults { file: file.to_string(), list: self.list }
    }
}
