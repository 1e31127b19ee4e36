//! What `--set` says: a key of the mission file and the values it is to have.

use std::collections::HashSet;

use toml::Value;

/// Most values of one key.
const MOST_VALUES: usize = 10_000;

/// A key of a mission file with the values it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Its dotted path, such as `coordination.law.switching.gain` or `vehicles[0].start.x_m`.
    pub key: String,
    /// The values, in order.
    pub values: Vec<Value>,
}

impl Setting {
    /// Reads `KEY=VALUES`: one value, several with commas between, or numbers as `FROM:TO:STEP`.
    ///
    /// # Errors
    /// What was found and what is allowed.
    pub fn parse(text: &str) -> Result<Setting, String> {
        let refused = |found: &str, allowed: &str| format!("--set {text}: found {found}; allowed: {allowed}");
        let Some((key, values)) = text.split_once('=') else {
            return Err(refused("no =", "KEY=VALUE, KEY=VALUE,VALUE or KEY=FROM:TO:STEP"));
        };
        let key = key.trim();
        if key.is_empty() || key.split('.').any(str::is_empty) {
            return Err(refused("an empty name in the key", "a dotted path such as coordination.law.switching.gain"));
        }
        let values = match range(values) {
            Some(found) => found.map_err(|allowed| refused(&format!("the range {values}"), allowed))?,
            None => listed(values).into_iter().map(value).collect(),
        };
        let values: Vec<Value> = values.into_iter().map(plain).collect();
        if values.is_empty() || values.len() > MOST_VALUES {
            return Err(refused(&format!("{} values", values.len()), &format!("1 to {MOST_VALUES}")));
        }
        let mut known = HashSet::new();
        if let Some(twice) = values.iter().map(shown).find(|value| !known.insert(value.clone())) {
            let allowed = "each value once; --repeat flies it several times";
            return Err(refused(&format!("{twice} twice"), allowed));
        }
        Ok(Setting { key: full_key(key, &values), values })
    }

    /// The setting for a mission: a gain may be named without the mission's law, `coordination.gain` for
    /// `coordination.law.switching.gain`, and a vehicle by its name, `vehicles.auv2.start.x_m` for `vehicles[1].start.x_m`.
    pub fn of(self, mission: &str) -> Setting {
        let gain = self.key.strip_prefix("coordination.").and_then(|gain| gain_of_law(mission, gain));
        let key = gain.or_else(|| self.key.strip_prefix("vehicles.").and_then(|rest| key_of_vehicle(mission, rest)));
        Setting { key: key.unwrap_or(self.key), ..self }
    }
}

/// The whole key of what is named as `ID.KEY`. A name has no dot, and no two vehicles have the same.
fn key_of_vehicle(mission: &str, rest: &str) -> Option<String> {
    let (id, key) = rest.split_once('.')?;
    let root: toml::Table = mission.parse().ok()?;
    let place = root
        .get("vehicles")?
        .as_array()?
        .iter()
        .position(|vehicle| vehicle.get("id").and_then(Value::as_str) == Some(id))?;
    Some(format!("vehicles[{place}].{key}"))
}

/// The gains of the mission's law as they may be named for short.
pub(super) fn short_gains(mission: &str) -> Vec<String> {
    let gains = || {
        let root: toml::Table = mission.parse().ok()?;
        let law = root.get("coordination")?.get("law")?.as_table()?.values().next()?;
        let numbers = law.as_table()?.keys().filter(|gain| gain_of_law(mission, gain).is_some());
        Some(numbers.map(|gain| format!("coordination.{gain}")).collect())
    };
    gains().unwrap_or_default()
}

/// The whole key of a gain that the mission's law has.
fn gain_of_law(mission: &str, gain: &str) -> Option<String> {
    let root: toml::Table = mission.parse().ok()?;
    let coordination = root.get("coordination")?.as_table()?;
    let (law, gains) = coordination.get("law")?.as_table()?.iter().next()?;
    let known = gains.as_table()?.contains_key(gain) && !coordination.contains_key(gain);
    known.then(|| format!("coordination.law.{law}.{gain}"))
}

/// Keys for which a number alone says enough: the loss of single messages, and a delay that is always the same.
fn full_key(key: &str, values: &[Value]) -> String {
    let numbers = values.iter().all(|value| value.is_float() || value.is_integer());
    match key {
        "network.loss" if numbers => "network.loss.bernoulli.probability".into(),
        "network.delay" if numbers => "network.delay.constant.delay_s".into(),
        _ => key.into(),
    }
}

/// `FROM:TO:STEP`, both ends included; `None` if it is no range at all.
fn range(text: &str) -> Option<Result<Vec<Value>, &'static str>> {
    let numbers: Option<Vec<f64>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
    let [from, to, step] = numbers?[..] else { return None };
    let steps = (to - from) / step;
    if !(from.is_finite() && to.is_finite() && step.is_finite() && steps.is_finite() && steps >= 0.0) {
        return Some(Err("finite numbers FROM:TO:STEP, the step leading from the one to the other"));
    }
    if steps > MOST_VALUES as f64 {
        return Some(Err("at most 10000 values"));
    }
    // A step that does not fit the range by a rounding error still ends at its end.
    let count = (steps + 1e-9).floor() as u32;
    Some(Ok((0..=count).map(|i| Value::Float(rounded(from + f64::from(i) * step))).collect()))
}

/// To twelve digits, so that three steps of 0.1 are 0.3.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// The parts between commas that are not inside brackets or quotes.
fn listed(text: &str) -> Vec<&str> {
    let (mut parts, mut begin, mut depth, mut quote) = (Vec::new(), 0, 0_i32, None);
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                parts.push(&text[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[begin..]);
    parts
}

/// A whole number without a decimal point: 0, 0.0 and the first of 0:1:0.1 are the same value, of the same cell with the same
/// seeds, and a key that takes whole numbers only can have a range.
fn plain(value: Value) -> Value {
    // Up to here every whole number is one of these.
    const MOST: f64 = 9e15;
    match value {
        Value::Float(number) if number.fract() == 0.0 && number.abs() <= MOST => Value::Integer(number as i64),
        other => other,
    }
}

/// A value as in TOML; what is none there is text.
fn value(text: &str) -> Value {
    let text = text.trim();
    let read = format!("value = {text}").parse::<toml::Table>().ok().and_then(|mut table| table.remove("value"));
    read.unwrap_or_else(|| Value::String(text.to_string()))
}

/// A value as one would type it behind `--set KEY=`.
pub fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// The values as the labels of an axis: of a choice with keys, such as a law, its name, if no two of them have the same.
pub fn labels(values: &[Value]) -> Vec<String> {
    let named = |value: &Value| match value.as_table() {
        Some(table) if table.len() == 1 => table.keys().next().cloned(),
        _ => None,
    };
    let label = |value: &Value| named(value).unwrap_or_else(|| shown(value));
    let known: HashSet<String> = values.iter().map(label).collect();
    let distinct = known.len() == values.len();
    values.iter().map(|value| if distinct { label(value) } else { shown(value) }).collect()
}

/// `--set` that gives a key one value, ready for a shell.
pub fn option(key: &str, value: &Value) -> String {
    let text = format!("{key}={}", shown(value));
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-=+:/".contains(c);
    if text.chars().all(plain) { format!("--set {text}") } else { format!("--set '{}'", text.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown_values(text: &str) -> Vec<String> {
        Setting::parse(text).unwrap_or_else(|reason| panic!("{reason}")).values.iter().map(shown).collect()
    }

    #[test]
    fn a_range_has_both_ends_and_no_rounding_errors() {
        assert_eq!(shown_values("a=0:0.9:0.1").join(" "), "0 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9");
        assert_eq!(shown_values("a=5:-5:-5"), ["5", "0", "-5"]);
        assert_eq!(shown_values("a=1:1:1"), ["1"]);
    }

    #[test]
    fn a_list_is_split_where_no_bracket_or_quote_is_open() {
        assert_eq!(shown_values("a=0.05,0.1, 2"), ["0.05", "0.1", "2"]);
        assert_eq!(shown_values("between=hold,advance"), ["hold", "advance"]);
        assert_eq!(shown_values("a=[1, 2],[3, 4]"), ["[1, 2]", "[3, 4]"]);
        assert_eq!(shown_values("a={ b = 1, c = 'x,y' }").len(), 1);
    }

    #[test]
    fn a_number_is_enough_for_loss_and_delay() {
        assert_eq!(Setting::parse("network.loss=0.3").expect("one").key, "network.loss.bernoulli.probability");
        assert_eq!(Setting::parse("network.delay=0:5:1").expect("five").key, "network.delay.constant.delay_s");
        assert_eq!(Setting::parse("network.loss=none").expect("one").key, "network.loss");
    }

    #[test]
    fn a_gain_needs_no_law() {
        let mission = "[coordination]\nvalidity_s = 1.0\nlaw = { switching = { gain = 0.1 } }\n";
        let of = |key: &str| Setting::parse(&format!("{key}=1")).expect("one").of(mission).key;
        assert_eq!(of("coordination.gain"), "coordination.law.switching.gain");
        for whole in ["coordination.validity_s", "coordination.law.switching.gain", "coordination.b0", "gain"] {
            assert_eq!(of(whole), whole);
        }
        assert_eq!(Setting::parse("coordination.gain=1").expect("one").of("no mission").key, "coordination.gain");
    }

    #[test]
    fn a_vehicle_may_be_named() {
        let mission = "[[vehicles]]\nid = \"north\"\n[[vehicles]]\nid = \"0\"\n";
        let of = |key: &str| Setting::parse(&format!("{key}=1")).expect("one").of(mission).key;
        assert_eq!(of("vehicles.north.start.x_m"), "vehicles[0].start.x_m");
        // A name goes before a place, and a place is written in brackets.
        assert_eq!(of("vehicles.0.pattern"), "vehicles[1].pattern");
        for whole in ["vehicles[1].pattern", "vehicles.south.pattern", "vehicles.north"] {
            assert_eq!(of(whole), whole);
        }
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_the_reason() {
        for (text, reason) in [
            ("network.loss", "no ="),
            ("=3", "an empty name"),
            ("a..b=3", "an empty name"),
            ("a=0:1:0", "the range 0:1:0"),
            ("a=0:1:-0.1", "the range"),
            ("a=0:1:1e-9", "at most 10000"),
            ("a=0:inf:1", "the range"),
            ("a=0.1,0.1", "found 0.1 twice; allowed: each value once"),
            ("a=0,0.5,0.0", "found 0 twice"),
            ("a=none,0,none", "found none twice"),
        ] {
            let found = Setting::parse(text).expect_err(text);
            assert!(found.contains(reason) && found.contains("allowed: "), "{found}");
        }
    }

    #[test]
    fn a_choice_is_labelled_with_its_name_where_that_tells_it_from_the_others() {
        let labels = |text: &str| labels(&Setting::parse(text).expect("one").values);
        assert_eq!(labels("a={ x = { gain = 1 } },{ y = {} },none"), ["x", "y", "none"]);
        assert_eq!(labels("a=0.5,1"), ["0.5", "1"]);
        let twice = labels("a={ x = { gain = 1 } },{ x = { gain = 2 } }");
        assert!(twice[0] != twice[1] && twice[0].contains("gain = 1"), "{twice:?}");
    }

    #[test]
    fn an_option_survives_the_shell() {
        assert_eq!(option("network.loss", &Value::Float(0.3)), "--set network.loss=0.3");
        assert_eq!(option("about", &Value::String("it's".into())), "--set 'about=it'\\''s'");
    }
}
