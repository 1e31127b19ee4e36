//! What the shape of a gallery file alone does not tell: that missions, vehicles and numbers exist and fit together.

use std::collections::BTreeMap;
use std::sync::Arc;

use common::mission::{Collector, Mission};

use super::file::{Expectation, FigureSection, GalleryFile, PanelSection};
use super::numbers;

/// The missions of a gallery by name.
pub(super) type Missions = BTreeMap<String, Arc<Mission>>;

/// Most panels side by side.
const MOST_COLUMNS: u32 = 4;

pub(super) fn check(faults: &mut Collector<'_>, file: &GalleryFile, missions: &Missions) {
    for (i, figure) in file.figures.iter().enumerate() {
        let key = format!("figures[{i}]");
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if figure.id.is_empty() || !figure.id.chars().all(plain) {
            faults.fault(&format!("{key}.id"), format!("{:?}", figure.id), "lower-case letters, digits and dashes");
        }
        if file.figures[..i].iter().any(|other| other.id == figure.id) {
            faults.fault(&format!("{key}.id"), format!("{:?} again", figure.id), "a name that no other figure has");
        }
        check_figure(faults, figure, &key, missions);
    }
}

fn check_figure(faults: &mut Collector<'_>, figure: &FigureSection, key: &str, missions: &Missions) {
    if figure.missions.is_empty() {
        faults.fault(&format!("{key}.missions"), "none", "at least one mission");
    }
    let known = || missions.keys().cloned().collect::<Vec<_>>().join(", ");
    for (i, name) in figure.missions.iter().enumerate() {
        if !missions.contains_key(name) {
            faults.fault(&format!("{key}.missions[{i}]"), format!("{name:?}, which is no mission here"), known());
        }
    }
    if !figure.labels.is_empty() && figure.labels.len() != figure.missions.len() {
        let allowed = format!("one for each of the {} missions", figure.missions.len());
        faults.fault(&format!("{key}.labels"), format!("{} labels", figure.labels.len()), allowed);
    }
    if !(1..=MOST_COLUMNS).contains(&figure.columns) {
        faults.fault(&format!("{key}.columns"), figure.columns, format!("1 to {MOST_COLUMNS}"));
    }
    if figure.panels.is_empty() {
        faults.fault(&format!("{key}.panels"), "none", "at least one panel");
    }
    for (i, panel) in figure.panels.iter().enumerate() {
        check_panel(faults, panel, figure, &format!("{key}.panels[{i}]"), missions);
    }
    for (i, expectation) in figure.expect.iter().enumerate() {
        check_expectation(faults, expectation, figure, &format!("{key}.expect[{i}]"), missions);
    }
}

fn check_panel(
    faults: &mut Collector<'_>,
    panel: &PanelSection,
    figure: &FigureSection,
    key: &str,
    missions: &Missions,
) {
    match (panel.plane, panel.over_time) {
        (Some(_), Some(_)) => faults.fault(key, "both plane and over_time", "one of them"),
        (None, None) => faults.fault(key, "neither plane nor over_time", "one of them"),
        (Some(_), None) if panel.log || panel.scale.is_some() || !panel.levels.is_empty() => {
            faults.fault(key, "log, scale or levels in a plane", "they go with over_time");
        }
        (None, Some(_)) if !panel.vehicles_at_s.is_empty() => {
            faults.fault(&format!("{key}.vehicles_at_s"), "instants", "they go with plane");
        }
        _ => {}
    }
    if panel.scale.is_some() && panel.label.is_none() {
        faults.fault(&format!("{key}.scale"), "a scale without a label", "label, with the unit that it makes");
    }
    check_order(faults, key, [("low", panel.low), ("high", panel.high)]);
    check_order(faults, key, [("from_s", panel.from_s), ("to_s", panel.to_s)]);
    if panel.log {
        faults.number(&format!("{key}.low"), panel.low.unwrap_or(1.0), panel.low.is_none_or(|l| l > 0.0), "above 0");
    }
    for (name, values) in [("levels", &panel.levels), ("vehicles_at_s", &panel.vehicles_at_s)] {
        for (i, value) in values.iter().enumerate() {
            faults.finite(&format!("{key}.{name}[{i}]"), *value, "");
        }
    }
    for (i, name) in panel.missions.iter().flatten().enumerate() {
        if !figure.missions.contains(name) {
            let found = format!("{name:?}, which is no mission of the figure");
            faults.fault(&format!("{key}.missions[{i}]"), found, figure.missions.join(", "));
        }
    }
    check_vehicles(faults, panel.vehicles.as_deref(), &figure.missions, key, missions);
}

fn check_expectation(
    faults: &mut Collector<'_>,
    expectation: &Expectation,
    figure: &FigureSection,
    key: &str,
    missions: &Missions,
) {
    if expectation.what.is_empty() {
        faults.fault(key, "no what", "what is expected, in words");
    }
    let of = match &expectation.mission {
        Some(name) if !figure.missions.contains(name) => {
            let found = format!("{name:?}, which is no mission of the figure");
            return faults.fault(&format!("{key}.mission"), found, figure.missions.join(", "));
        }
        Some(name) => std::slice::from_ref(name),
        None if figure.missions.len() > 1 => {
            return faults.fault(key, "no mission", format!("one of {}", figure.missions.join(", ")));
        }
        None => &figure.missions,
    };
    match (&expectation.number, expectation.series) {
        (Some(_), Some(_)) => faults.fault(key, "both number and series", "one of them"),
        (None, None) => faults.fault(key, "neither number nor series", "one of them"),
        (Some(path), None) => {
            if let Err(reason) = numbers::check_path(path) {
                faults.fault(&format!("{key}.number"), format!("{path:?}"), reason);
            }
            let instants = [expectation.at_s, expectation.from_s, expectation.to_s];
            if expectation.take.is_some() || instants.iter().any(Option::is_some) {
                faults.fault(key, "take or instants with number", "they go with series");
            }
        }
        (None, Some(_)) => {
            if expectation.at_s.is_some()
                && (expectation.take.is_some() || expectation.from_s.is_some() || expectation.to_s.is_some())
            {
                faults.fault(&format!("{key}.at_s"), "an instant with take, from_s or to_s", "one or the other");
            }
        }
    }
    check_order(faults, key, [("from_s", expectation.from_s), ("to_s", expectation.to_s)]);
    check_order(faults, key, [("at_least", expectation.at_least), ("at_most", expectation.at_most)]);
    faults.finite(&format!("{key}.at_s"), expectation.at_s.unwrap_or(0.0), "(s)");
    faults.finite(&format!("{key}.value"), expectation.value.unwrap_or(0.0), "");
    let bounded = expectation.at_least.is_some() || expectation.at_most.is_some();
    match (expectation.value, expectation.within) {
        (Some(_), Some(within)) if !bounded => {
            faults.number(&format!("{key}.within"), within, within >= 0.0, "0 or above");
        }
        (None, None) if bounded => {}
        _ => faults.fault(key, "an incomplete bound", "value and within, or at_least, at_most or both"),
    }
    check_vehicles(faults, expectation.vehicles.as_deref(), of, key, missions);
}

fn check_order(faults: &mut Collector<'_>, key: &str, [(low_name, low), (high_name, high)]: [(&str, Option<f64>); 2]) {
    faults.finite(&format!("{key}.{low_name}"), low.unwrap_or(0.0), "");
    faults.finite(&format!("{key}.{high_name}"), high.unwrap_or(0.0), "");
    if let (Some(low), Some(high)) = (low, high)
        && low >= high
    {
        faults.fault(&format!("{key}.{high_name}"), high, format!("above {low_name}"));
    }
}

/// Every vehicle must fly in every mission looked at.
fn check_vehicles(
    faults: &mut Collector<'_>,
    vehicles: Option<&[String]>,
    of: &[String],
    key: &str,
    missions: &Missions,
) {
    for (i, id) in vehicles.unwrap_or_default().iter().enumerate() {
        for mission in of.iter().filter_map(|name| missions.get(name)) {
            if mission.index_of(id).is_none() {
                let known: Vec<&str> = mission.vehicles.iter().map(|vehicle| vehicle.id.as_str()).collect();
                let found = format!("{id:?}, which is no vehicle of {}", mission.name);
                faults.fault(&format!("{key}.vehicles[{i}]"), found, known.join(", "));
            }
        }
    }
}
