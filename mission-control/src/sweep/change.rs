//! Changes a mission file at a key.

use toml::{Table, Value};

/// Keys that say all there is to say of a model: it takes the place of whatever model the mission has there.
const WHOLE_MODELS: [&str; 2] = ["network.loss.bernoulli.probability", "network.delay.constant.delay_s"];

/// The text of a mission file with some of its keys set to other values. Whether the keys exist, and whether the mission can
/// be flown with them, is for the mission's own check to say.
///
/// # Errors
/// Which key cannot be reached, and why.
pub fn changed(text: &str, changes: &[(&str, &Value)]) -> Result<String, String> {
    let mut root: Table = text.parse().map_err(|error: toml::de::Error| error.message().to_string())?;
    // Before anything is set, so that no other change is lost with it.
    for (key, _) in changes.iter().filter(|(key, _)| WHOLE_MODELS.contains(key)) {
        let mut steps = key.split('.');
        let section = steps.next().and_then(|section| root.get_mut(section)?.as_table_mut());
        if let (Some(section), Some(model)) = (section, steps.next()) {
            section.remove(model);
        }
    }
    for (key, value) in changes {
        let mut steps: Vec<&str> = key.split('.').collect();
        let last = steps.pop().unwrap_or(key);
        let mut here = &mut root;
        for (depth, step) in steps.iter().enumerate() {
            let allowed = list_at(here, step);
            here = below(here, step).ok_or_else(|| {
                let allowed = allowed.as_deref().unwrap_or("a key of the mission file");
                format!("{key}: found nothing at {}; allowed: {allowed}", steps[..=depth].join("."))
            })?;
        }
        match index(last) {
            Some((name, at)) => {
                let item = here.get_mut(name).and_then(Value::as_array_mut).and_then(|array| array.get_mut(at));
                *item.ok_or_else(|| format!("{key}: found no such item; allowed: an item of the mission file"))? =
                    (*value).clone();
            }
            None => {
                here.insert(last.to_string(), (*value).clone());
            }
        }
    }
    Ok(root.to_string())
}

/// The only name in the table of a mission file at a key, if it has but one: of a choice, what is chosen.
pub(super) fn chosen(text: &str, key: &str) -> Option<String> {
    let root: Table = text.parse().ok()?;
    let step = |here: &Table, step: &str| match index(step) {
        Some((name, at)) => here.get(name)?.as_array()?.get(at)?.as_table().cloned(),
        None => here.get(step)?.as_table().cloned(),
    };
    let table = key.split('.').try_fold(root, |here, name| step(&here, name))?;
    let mut names = table.keys();
    names.next().filter(|_| names.next().is_none()).cloned()
}

/// The table below a table at `name` or `name[index]`. One that is not there yet is made: keys with a default need not be in
/// the file.
fn below<'t>(table: &'t mut Table, step: &str) -> Option<&'t mut Table> {
    if let Some((name, at)) = index(step) {
        return table.get_mut(name)?.as_array_mut()?.get_mut(at)?.as_table_mut();
    }
    let value = table.entry(step.to_string()).or_insert_with(|| Value::Table(Table::new()));
    // A choice without keys, such as "none", gives way to one with some.
    if value.is_str() {
        *value = Value::Table(Table::new());
    }
    value.as_table_mut()
}

/// How the items of the list at `name` or `name[9]` are written, if there is one.
fn list_at(table: &Table, step: &str) -> Option<String> {
    let name = index(step).map_or(step, |(name, _)| name);
    let items = table.get(name)?.as_array()?;
    let last = items.len().checked_sub(1)?;
    // Of vehicles, which have names, the names too.
    let id = items.iter().find_map(|item| item.get("id")?.as_str());
    let named = id.map_or(String::new(), |id| format!(", or the id: {name}.{id}.KEY"));
    Some(format!("an item of the list, '{name}[0].KEY' to '{name}[{last}].KEY' (in quotes for the shell){named}"))
}

/// `name[3]` as its parts.
fn index(step: &str) -> Option<(&str, usize)> {
    let (name, rest) = step.split_once('[')?;
    Some((name, rest.strip_suffix(']')?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use common::mission::Mission;

    use super::*;

    const MISSION: &str = include_str!("../../../missions/thesis/fig-1-9.toml");

    fn with(key: &str, value: impl Into<Value>) -> Result<Mission, String> {
        let text = changed(MISSION, &[(key, &value.into())])?;
        Mission::parse("m.toml", &text).map_err(|faults| faults.to_string())
    }

    #[test]
    fn a_key_that_is_there_is_changed() {
        assert_eq!(with("duration_s", 7.0).expect("sound").end.secs(), 7.0);
        assert_eq!(with("vehicles[1].start.x_m", 3).expect("sound").vehicles[1].start.position[0], 3.0);
        assert_eq!(with("network.links[0]", vec!["v2", "v1"]).expect("sound").links[0].from, 1);
    }

    #[test]
    fn a_key_with_a_default_is_added_and_a_bare_choice_gives_way() {
        let lossy = with("network.loss.bernoulli.probability", 0.25).expect("sound");
        assert!(format!("{:?}", lossy.links[0]).contains("0.25"), "{:?}", lossy.links[0]);
        assert!(with("coordination.validity_s", 1.5).expect("sound").validity.is_some());
        let bare = changed(MISSION, &[("network.loss", &Value::from("none"))]).expect("changed");
        assert!(changed(&bare, &[("network.loss.bernoulli.probability", &Value::from(0.5))]).is_ok());
    }

    #[test]
    fn a_loss_or_a_delay_in_one_number_takes_the_place_of_any_model() {
        let bursts = format!("{MISSION}\n").replace(
            "[network]\n",
            "[network]\nloss = { gilbert_elliott = { mean_burst = 3.0, mean_gap = 9.0 } }\ndelay = { jittered = { min_s = 1.0, max_s = 2.0 } }\n",
        );
        assert!(bursts.contains("jittered"), "{bursts}");
        let (loss, delay) = (Value::from(0.25), Value::from(0.5));
        let changes = [("network.loss.bernoulli.probability", &loss), ("network.delay.constant.delay_s", &delay)];
        let text = changed(&bursts, &changes).expect("changed");
        let mission = Mission::parse("m.toml", &text).unwrap_or_else(|faults| panic!("{faults}"));
        assert_eq!(mission.links[0].fixed_delay().map(|delay| delay.secs()), Some(0.5));
        assert!(format!("{:?}", mission.links[0].layers[0].loss).contains("Bernoulli(0.25)"), "{:?}", mission.links[0]);
        // Who sets both says two things.
        let gap = Value::from(5.0);
        let both = changed(&bursts, &[("network.loss.gilbert_elliott.mean_gap", &gap), changes[0]]).expect("changed");
        let faults = Mission::parse("m.toml", &both).expect_err("two models").to_string();
        assert!(faults.contains("network.loss: found bernoulli, gilbert_elliott"), "{faults}");
    }

    #[test]
    fn what_a_mission_chose_is_the_one_name_there() {
        assert_eq!(chosen(MISSION, "coordination.law").as_deref(), Some("introduction"));
        assert_eq!((chosen(MISSION, "coordination"), chosen(MISSION, "vehicles[0].path.nothing")), (None, None));
    }

    #[test]
    fn what_no_mission_has_is_refused_with_the_reason() {
        for (key, value, reason) in [
            ("network.los", Value::from(1.0), "network.los: found an unknown key; allowed: "),
            (
                "coordination.law.switching.gain",
                Value::from(1.0),
                "coordination.law: found introduction, switching; allowed: one of",
            ),
            (
                "vehicles[7].id",
                Value::from("x"),
                "vehicles[7].id: found nothing at vehicles[7]; allowed: an item of the list, 'vehicles[0].KEY' to 'vehicles[1].KEY'",
            ),
            ("vehicles.0.start.x_m", Value::from(3), "or the id: vehicles.v1.KEY"),
            ("duration_s.x", Value::from(1), "duration_s.x: found nothing at duration_s"),
            ("duration_s", Value::from("long"), "duration_s: found a string; allowed: "),
            ("network.links[9]", Value::from(1), "network.links[9]: found no such item"),
        ] {
            let found = with(key, value).expect_err(key);
            assert!(found.contains(reason), "{found}");
        }
    }

    #[test]
    fn nothing_else_is_changed() {
        let same = changed(MISSION, &[]).expect("changed");
        let (a, b): (Table, Table) = (MISSION.parse().expect("a table"), same.parse().expect("a table"));
        assert_eq!(a, b);
    }
}
