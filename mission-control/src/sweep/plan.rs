//! The runs of a sweep: every combination of values, each several times with a seed of its own.

use std::sync::Arc;

use common::mission::{Fault, Mission, digest};
use toml::Value;

use super::change::{changed, chosen};
use super::setting::{Setting, option, short_gains, shown};

/// Most runs of a sweep.
const MOST_RUNS: usize = 1_000_000;

/// One combination of values.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The values, in the order of the keys.
    pub values: Vec<Value>,
    /// The mission file with these values.
    text: String,
}

/// All runs of a sweep.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The mission file as it is in the replay commands.
    pub file: String,
    /// The mission without changes.
    pub mission: Arc<Mission>,
    /// The keys with their values.
    pub settings: Vec<Setting>,
    /// Runs of every cell.
    pub repeats: u32,
    /// Every combination of values; the last key changes fastest.
    pub cells: Vec<Cell>,
    /// Whether the seed follows from the repeat alone, so that every cell meets the same random numbers.
    pub paired: bool,
}

impl Plan {
    /// Plans a sweep and checks that every cell of it can be flown.
    ///
    /// # Errors
    /// Which cell cannot be flown, and why.
    pub fn new(file: &str, mission: Arc<Mission>, settings: Vec<Setting>, repeats: u32) -> Result<Plan, String> {
        let settings: Vec<Setting> = settings.into_iter().map(|setting| setting.of(&mission.text)).collect();
        if let Some(twice) = settings.iter().enumerate().find(|(i, s)| settings[..*i].iter().any(|o| o.key == s.key)) {
            return Err(format!("--set {}: found twice; allowed: once, with all of its values", twice.1.key));
        }
        if let Some(setting) = settings.iter().find(|setting| setting.key == "seed") {
            let why = "every run has a seed of its own, made from the mission's; for several of them say --repeat";
            return Err(format!("--set {}: found in a sweep; allowed: other keys ({why})", setting.key));
        }
        let count =
            settings.iter().try_fold(repeats as usize, |count, setting| count.checked_mul(setting.values.len()));
        if !count.is_some_and(|count| (1..=MOST_RUNS).contains(&count)) {
            let found = count.map_or("more runs than can be counted".to_string(), |count| format!("{count} runs"));
            return Err(format!("found {found}; allowed: 1 to {MOST_RUNS}"));
        }
        let mut combinations: Vec<Vec<Value>> = vec![Vec::new()];
        for setting in &settings {
            let with = |values: &Vec<Value>, value: &Value| [values.as_slice(), std::slice::from_ref(value)].concat();
            combinations = combinations
                .iter()
                .flat_map(|begun| setting.values.iter().map(move |value| with(begun, value)))
                .collect();
        }
        let cell = |values: Vec<Value>| {
            let changes: Vec<(&str, &Value)> = settings.iter().map(|s| s.key.as_str()).zip(&values).collect();
            let text = apply(&mission.text, &changes)?;
            Ok(Cell { values, text })
        };
        let cells = combinations.into_iter().map(cell).collect::<Result<Vec<Cell>, String>>()?;
        Ok(Plan { file: file.to_string(), mission, settings, repeats, cells, paired: false })
    }

    /// The plan with seeds that are the same in all cells, or not: to compare cells, such as two laws, under the same losses.
    pub fn paired(self, paired: bool) -> Plan {
        Plan { paired, ..self }
    }

    /// The seed of a run, from the mission's seed, the values of the cell and the number of the repeat: the first 53 bits of
    /// a SHA-256. It depends on nothing else, so a sweep that is enlarged keeps the runs that it has. In a paired plan the values
    /// have no part in it.
    pub fn seed(&self, cell: usize, repeat: u32) -> u64 {
        if self.paired {
            return digest(&format!("{} paired {repeat}", self.mission.seed)) >> 11;
        }
        let values: Vec<String> = self
            .settings
            .iter()
            .zip(&self.cells[cell].values)
            .map(|(s, v)| format!("{}={}", s.key, shown(v)))
            .collect();
        digest(&format!("{} {} {repeat}", self.mission.seed, values.join(" "))) >> 11
    }

    /// The mission of a run.
    ///
    /// # Errors
    /// What is wrong with it; the plan has been checked, so nothing.
    pub fn mission(&self, cell: usize, repeat: u32) -> Result<Arc<Mission>, String> {
        let seed = Value::Integer(self.seed(cell, repeat).cast_signed());
        parse(&changed(&self.cells[cell].text, &[("seed", &seed)])?, |_| None).map(Arc::new)
    }

    /// The command that flies a run again.
    pub fn replay(&self, cell: usize, repeat: u32) -> String {
        let options: Vec<String> =
            self.settings.iter().zip(&self.cells[cell].values).map(|(s, value)| option(&s.key, value)).collect();
        let seed = format!("--seed {}", self.seed(cell, repeat));
        [vec![format!("mission-control simulate {}", self.file)], options, vec![seed]].concat().join(" ")
    }
}

/// The text of a mission with some of its keys set to other values.
///
/// # Errors
/// The values with which it cannot be flown, and why.
pub fn apply(text: &str, changes: &[(&str, &Value)]) -> Result<String, String> {
    let of_cell = |reason: String| {
        let options: Vec<String> = changes.iter().map(|(key, value)| option(key, value)).collect();
        format!("with {}: {reason}", options.join(" "))
    };
    let after = changed(text, changes).map_err(of_cell)?;
    let known = |fault: &Fault| second_model(text, changes, fault).or_else(|| short_form(text, changes, fault));
    parse(&after, known).map_err(of_cell)?;
    Ok(after)
}

/// The faults of a changed mission are told without lines: no file has them. `known` tells some in better words.
fn parse(text: &str, known: impl Fn(&Fault) -> Option<String>) -> Result<Mission, String> {
    let told = |fault: &Fault| known(fault).unwrap_or_else(|| fault.to_string());
    Mission::parse("", text).map_err(|faults| faults.list.iter().map(told).collect::<Vec<_>>().join("; "))
}

/// What is wrong with a key of a model beside which the mission already has another one, and what to do.
fn second_model(text: &str, changes: &[(&str, &Value)], fault: &Fault) -> Option<String> {
    let place = fault.key.as_str();
    // What is said of a choice with two names.
    if !fault.allowed.starts_with("one of ") {
        return None;
    }
    let (rest, value) =
        changes.iter().find_map(|(key, value)| Some((key.strip_prefix(place)?.strip_prefix('.')?, *value)))?;
    let (model, _) = rest.split_once('.')?;
    let there = chosen(text, place).filter(|there| there != model)?;
    // As one value of its own, for the whole place.
    let whole = format!("{place}={{ {rest} = {value} }}");
    Some(format!(
        "{place}: found {there} in the mission, so there is no {model} with keys to set; allowed: keys of {place}.{there}, or \
         another model as a whole, with all keys that it needs, say --set '{whole}'"
    ))
}

/// What is wrong with a key for which a short form would do, with that form among what is allowed.
fn short_form(text: &str, changes: &[(&str, &Value)], fault: &Fault) -> Option<String> {
    changes.iter().find(|(key, _)| *key == fault.key)?;
    let short = match fault.key.as_str() {
        "network.loss" => {
            "a number, the probability with which each message is lost (in a sweep also FROM:TO:STEP)".into()
        }
        "network.delay" => "a number, the same delay for all messages (s) (in a sweep also FROM:TO:STEP)".into(),
        key if key.strip_prefix("coordination.").is_some_and(|name| !name.contains('.')) => {
            let gains = short_gains(text);
            if gains.is_empty() || !fault.found.contains("unknown key") {
                return None;
            }
            format!("for short {}", gains.join(", "))
        }
        _ => return None,
    };
    Some(format!("{fault}; {short}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSION: &str = include_str!("../../../missions/thesis/fig-1-9.toml");

    fn plan(sets: &[&str], repeats: u32) -> Result<Plan, String> {
        let settings = sets.iter().map(|text| Setting::parse(text)).collect::<Result<_, _>>()?;
        Plan::new("m.toml", Arc::new(parse(MISSION, |_| None)?), settings, repeats)
    }

    #[test]
    fn every_combination_is_a_cell() {
        let plan = plan(&["network.loss=0,0.5", "duration_s=5:7:1"], 4).expect("sound");
        assert_eq!(plan.cells.len(), 6);
        let mission = plan.mission(4, 3).expect("sound");
        assert!(format!("{:?}", mission.links[0]).contains("0.5"), "{:?}", mission.links[0]);
        assert_eq!(mission.end.secs(), 6.0);
        assert_eq!(mission.seed, plan.seed(4, 3));
    }

    #[test]
    fn seeds_differ_and_stay_when_a_sweep_is_enlarged() {
        let small = plan(&["network.loss=0,0.5"], 2).expect("sound");
        let large = plan(&["network.loss=0,0.25,0.5"], 5).expect("sound");
        assert_eq!(small.seed(1, 1), large.seed(2, 1));
        let mut seeds: Vec<u64> =
            (0..3).flat_map(|cell| (0..5).map(move |r| (cell, r))).map(|(c, r)| large.seed(c, r)).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 15);
        assert!(seeds.iter().all(|seed| *seed < 1 << 53));
    }

    #[test]
    fn in_a_paired_plan_every_cell_has_the_same_seeds() {
        let small = plan(&["network.loss=0,0.5"], 2).expect("sound").paired(true);
        let large = plan(&["network.loss=0,0.25,0.5", "duration_s=5,6"], 5).expect("sound").paired(true);
        for repeat in 0..2 {
            assert!((0..6).all(|cell| large.seed(cell, repeat) == small.seed(0, repeat)));
        }
        assert_ne!(small.seed(0, 0), small.seed(0, 1));
        assert_ne!(small.seed(0, 0), small.clone().paired(false).seed(0, 0));
    }

    #[test]
    fn a_run_is_replayed_by_a_command_with_its_values_and_seed() {
        let plan = plan(&["network.loss=0.5"], 1).expect("sound");
        let seed = plan.seed(0, 0);
        let expected =
            format!("mission-control simulate m.toml --set network.loss.bernoulli.probability=0.5 --seed {seed}");
        assert_eq!(plan.replay(0, 0), expected);
    }

    #[test]
    fn a_cell_that_cannot_be_flown_is_named_with_the_reason() {
        for (sets, reason) in [
            (
                &["network.loss=0.5,1.5"][..],
                "with --set network.loss.bernoulli.probability=1.5: network.loss.bernoulli.probability: found 1.5; allowed: ",
            ),
            (&["coordination.b0=1"][..], "coordination.b0: found an unknown key; allowed: "),
            (
                &["coordination.law.switching.gain=1,2"][..],
                "with --set coordination.law.switching.gain=1: coordination.law: found introduction in the mission, so there is no \
                 switching with keys to set; allowed: keys of coordination.law.introduction, or another model as a whole, with all \
                 keys that it needs, say --set 'coordination.law={ switching.gain = 1 }'",
            ),
            (&["coordination.gian=1"][..], "; for short coordination.gain"),
            (&["network.loss=abc"][..], "; a number, the probability with which each message is lost"),
            (&["network.delay=0:1"][..], "; a number, the same delay for all messages (s)"),
            (&["duration_s=1", "duration_s=2"][..], "--set duration_s: found twice"),
            (&["seed=1,2"][..], "--set seed: found in a sweep; allowed: other keys"),
            (&["duration_s=1:10000:1", "network.loss=0:0.999:0.001"][..], "found 10000000 runs"),
        ] {
            let found = plan(sets, 1).expect_err("refused");
            assert!(found.contains(reason), "{found}");
        }
        assert!(plan(&[], 0).is_err());
    }
}
