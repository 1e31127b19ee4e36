//! From the file as written to a mission that can be flown, or to everything that is wrong with it.

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Vector3;
use toml::de::DeTable;

use super::build;
use super::fault::{Collector, Faults};
use super::file::{
    DelayChoice, FollowingChoice, LawChoice, LossChoice, MissionFile, ModelChoice, PathChoice, SegmentChoice,
    SwitchingChoice, VehicleSection,
};
use super::shape::check_shape;
use super::{Delay, Link, Mission, SpeedProfile, Start, VehiclePlan, digest};
use crate::coordination::{CoordinationLaw, DemandKind};
use crate::graph::Graph;
use crate::graph::switching::{Switching, UpInterval};
use crate::path::Path;
use crate::path::closest::closest_parameter;
use crate::random::Stream;
use crate::time::{Span, Time};
use crate::wire::vehicle::SpeedCommand;

/// Most vehicles in a mission.
const MOST_VEHICLES: usize = 64;
/// Longest mission \[s\]: thirty days.
const LONGEST: f64 = 30.0 * 86_400.0;
/// Shortest time in which links come and go \[s\], and how often they may in a mission.
const SHORTEST_SWITCHING: f64 = 1e-3;
const MOST_SWITCHINGS: f64 = 200_000.0;
/// Greatest formation speed \[units of ξ per s\].
const FASTEST: f64 = 1e6;

pub(super) fn check(name: &str, text: &str) -> Result<Mission, Faults> {
    let mut faults = Collector::new(text);
    match DeTable::parse(text) {
        Err(error) => {
            let byte = error.span().map(|span| span.start);
            faults.fault_at(byte, String::new(), error.message().to_string());
            return Err(faults.into_faults(name));
        }
        Ok(table) => check_shape(&mut faults, table.get_ref()),
    }
    let file: MissionFile = match toml::from_str(text) {
        Ok(file) => file,
        Err(error) => {
            // The shape check explains it better, unless it let something pass.
            if faults.is_empty() {
                let byte = error.span().map(|span| span.start);
                faults.fault_at(byte, String::new(), error.message().to_string());
            }
            return Err(faults.into_faults(name));
        }
    };
    match assemble(&mut faults, &file, text) {
        Some(mission) if faults.is_empty() => Ok(mission),
        _ => Err(faults.into_faults(name)),
    }
}

/// Everything that is checked beyond the shape; `None` only with a fault noted.
fn assemble(faults: &mut Collector<'_>, file: &MissionFile, text: &str) -> Option<Mission> {
    check_name(faults, "name", &file.name);
    let times = check_times(faults, file);
    let speed = check_formation(faults, file);
    let law = check_law(faults, file);
    let ids = check_ids(faults, &file.vehicles);
    let links = check_links(faults, file, &ids);
    let switching = check_switching(faults, file, &ids, links.as_deref().unwrap_or(&[]));
    let fastest = speed.as_ref().map_or(0.0, SpeedProfile::fastest);
    let factor = build::nominal_factor(&file.coordination.law);
    let vehicles: Vec<Option<VehiclePlan>> =
        (0..file.vehicles.len()).map(|i| check_vehicle(faults, file, i, law.as_deref(), factor, fastest)).collect();
    let (times, speed, law, links, switching) = (times?, speed?, law?, links?, switching?);
    let mission = Mission {
        digest: digest(text),
        text: text.to_string(),
        name: file.name.clone(),
        about: file.about.clone(),
        seed: file.seed,
        end: times.end,
        control_period: times.control_period,
        substeps: file.clock.substeps as usize,
        record_ticks: times.record_ticks,
        message_ticks: times.message_ticks,
        speed,
        law,
        law_choice: file.coordination.law.clone(),
        validity: file.coordination.validity_s.map(Span::from_secs),
        between: file.coordination.between,
        vehicles: vehicles.into_iter().collect::<Option<Vec<_>>>()?,
        links,
        switching,
        queue: file.network.queue as usize,
    };
    Some(mission)
}

fn is_name(text: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    !text.is_empty() && text.len() <= 32 && text.chars().all(plain)
}

fn check_name(faults: &mut Collector<'_>, key: &str, text: &str) {
    if !is_name(text) {
        faults.fault(key, format!("{text:?}"), "1 to 32 of a-z, 0-9, - and _");
    }
}

struct Times {
    end: Time,
    control_period: Span,
    record_ticks: i64,
    message_ticks: i64,
}

fn check_times(faults: &mut Collector<'_>, file: &MissionFile) -> Option<Times> {
    let period = file.clock.control_period_s;
    let period_ok = period.is_finite() && (1e-4..=10.0).contains(&period);
    faults.number("clock.control_period_s", period, period_ok, "0.0001 to 10 s");
    let duration_ok = file.duration_s > 0.0 && file.duration_s <= LONGEST;
    faults.number("duration_s", file.duration_s, duration_ok, "above 0 and at most 30 days (2592000 s)");
    if !(1..=1000).contains(&file.clock.substeps) {
        faults.fault("clock.substeps", file.clock.substeps, "1 to 1000");
    }
    if !period_ok || !duration_ok {
        return None;
    }
    let control_period = Span::from_secs(period);
    let ticks_in = |span: f64| (Span::from_secs(span).nanos() as f64 / control_period.nanos() as f64).round() as i64;
    let mut multiple = |key: &str, span: f64| {
        let ticks = if span.is_finite() && span > 0.0 && span <= LONGEST { ticks_in(span) } else { 0 };
        let exact = ticks >= 1 && (control_period * ticks).nanos() == Span::from_secs(span).nanos();
        if !exact {
            faults.fault(key, format!("{span} s"), format!("a multiple of the control period, {period} s"));
        }
        ticks.max(1)
    };
    let record_ticks = multiple("clock.record_period_s", file.clock.record_period_s);
    let message_ticks = multiple("coordination.message_period_s", file.coordination.message_period_s);
    let end = Time::ZERO + control_period * ticks_in(file.duration_s).max(1);
    if ticks_in(file.duration_s) > i64::from(u32::MAX) {
        let allowed = format!("at most {} control periods", u32::MAX);
        faults.fault("duration_s", format!("{} s", file.duration_s), allowed);
    }
    if let Some(validity) = file.coordination.validity_s {
        let key = "coordination.validity_s";
        let least = file.coordination.message_period_s;
        let allowed = format!("at least the message period, {least} s; leave it out for ever");
        faults.number(key, validity, validity >= least && validity <= LONGEST, &allowed);
    }
    Some(Times { end, control_period, record_ticks, message_ticks })
}

fn check_formation(faults: &mut Collector<'_>, file: &MissionFile) -> Option<SpeedProfile> {
    match (&file.formation.speed, &file.formation.profile) {
        (Some(speed), None) => {
            faults.number("formation.speed", *speed, speed.abs() <= FASTEST, "-1000000 to 1000000 units of xi per s");
            Some(SpeedProfile::new(vec![SpeedCommand { at: Time::ZERO, speed: *speed }]))
        }
        (None, Some(steps)) => {
            let mut before = f64::NEG_INFINITY;
            for (i, step) in steps.iter().enumerate() {
                let key = format!("formation.profile[{i}]");
                let ok = step.speed.abs() <= FASTEST;
                faults.number(&format!("{key}.speed"), step.speed, ok, "-1000000 to 1000000 units of xi per s");
                let ok = if i == 0 { step.from_s == 0.0 } else { step.from_s > before && step.from_s <= LONGEST };
                let allowed = if i == 0 { "0 for the first step" } else { "later than the step before" };
                faults.number(&format!("{key}.from_s"), step.from_s, ok, allowed);
                before = step.from_s;
            }
            if steps.is_empty() {
                faults.fault("formation.profile", "no steps", "at least one step, the first from 0 s");
            }
            let command =
                |step: &super::file::SpeedStep| SpeedCommand { at: Time::from_secs(step.from_s), speed: step.speed };
            Some(SpeedProfile::new(steps.iter().map(command).collect()))
        }
        (Some(_), Some(_)) => {
            faults.fault("formation", "both speed and profile", "one of them");
            None
        }
        (None, None) => {
            faults.fault("formation", "neither speed nor profile", "one of them");
            None
        }
    }
}

fn check_law(faults: &mut Collector<'_>, file: &MissionFile) -> Option<Arc<dyn CoordinationLaw>> {
    let key = "coordination.law";
    if let LawChoice::Introduction(_) = file.coordination.law
        && file.vehicles.len() != 2
    {
        faults.fault(key, format!("introduction with {} vehicles", file.vehicles.len()), "two vehicles, as in (1.5)");
    }
    if file.coordination.between == super::file::Between::Align
        && !matches!(file.coordination.law, LawChoice::Delayed(_) | LawChoice::DelayedWithLosses(_))
    {
        let allowed = "hold or advance; align needs a law that is told the delay (delayed, delayed_with_losses)";
        faults.fault("coordination.between", "align", allowed);
    }
    if let LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) = &file.coordination.law {
        let ok = (0.0..=3600.0).contains(&law.delay_s);
        let key = format!("{key}.{}.delay_s", build::law_name(&file.coordination.law));
        faults.number(&key, law.delay_s, ok, "0 to 3600 s");
    }
    match build::law(&file.coordination.law) {
        Ok(law) => Some(law),
        Err(reason) => {
            let name = build::law_name(&file.coordination.law);
            faults.fault(&format!("{key}.{name}"), reason, "gains above 0");
            None
        }
    }
}

fn check_ids(faults: &mut Collector<'_>, vehicles: &[VehicleSection]) -> HashMap<String, usize> {
    let mut ids = HashMap::new();
    if vehicles.is_empty() || vehicles.len() > MOST_VEHICLES {
        faults.fault("vehicles", format!("{} vehicles", vehicles.len()), format!("1 to {MOST_VEHICLES}"));
    }
    for (i, vehicle) in vehicles.iter().enumerate() {
        let key = format!("vehicles[{i}].id");
        check_name(faults, &key, &vehicle.id);
        if ["mission-control", "network-emulator", "operator"].contains(&vehicle.id.as_str()) {
            faults.fault(&key, format!("{:?}", vehicle.id), "a name that is not one of the programs'");
        }
        if let Some(first) = ids.insert(vehicle.id.clone(), i) {
            let found = format!("{:?}, which is vehicles[{first}] too", vehicle.id);
            faults.fault(&key, found, "a name that no other vehicle has");
        }
    }
    ids
}

/// The directed links, both directions of a two-way link side by side.
fn check_links(faults: &mut Collector<'_>, file: &MissionFile, ids: &HashMap<String, usize>) -> Option<Vec<Link>> {
    let network = &file.network;
    let delay = check_delay(faults, "network.delay", &network.delay);
    let loss = check_loss(faults, "network.loss", &network.loss);
    if !(1..=1_000_000).contains(&network.queue) {
        faults.fault("network.queue", network.queue, "1 to 1000000 messages");
    }
    let mut links: Vec<Link> = Vec::new();
    let pairs = network.links.iter().enumerate().map(|(i, pair)| (format!("network.links[{i}]"), pair, true));
    let one_way = network.one_way.iter().enumerate().map(|(i, pair)| (format!("network.one_way[{i}]"), pair, false));
    for (key, pair, both_ways) in pairs.chain(one_way) {
        let Some((a, b)) = resolve(faults, &key, pair, ids) else { continue };
        for (from, to) in [(a, b), (b, a)].into_iter().take(if both_ways { 2 } else { 1 }) {
            if links.iter().any(|link| (link.from, link.to) == (from, to)) {
                faults.fault(&key, format!("a second link from {} to {}", pair[0], pair[1]), "each link once");
            } else {
                links.push(Link { from, to, delay, loss });
            }
        }
    }
    for (i, exception) in network.exceptions.iter().enumerate() {
        let key = format!("network.exceptions[{i}]");
        let pair = [exception.from.clone(), exception.to.clone()];
        let Some((from, to)) = resolve(faults, &key, &pair, ids) else { continue };
        let Some(link) = links.iter_mut().find(|link| (link.from, link.to) == (from, to)) else {
            let found = format!("{} -> {}, which is not a link", pair[0], pair[1]);
            faults.fault(&key, found, "a link of network.links or network.one_way");
            continue;
        };
        if let Some(delay) = &exception.delay {
            link.delay = check_delay(faults, &format!("{key}.delay"), delay);
        }
        if let Some(loss) = &exception.loss {
            link.loss = check_loss(faults, &format!("{key}.loss"), loss);
        }
    }
    let n = file.vehicles.len();
    let arcs: Vec<(usize, usize)> = links.iter().map(|link| (link.to, link.from)).collect();
    if (2..=MOST_VEHICLES).contains(&n) && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links by which at least one vehicle's word can reach every other (a globally reachable vertex)";
        faults.fault("network.links", "a graph that can never be connected", allowed);
    }
    Some(links)
}

fn resolve(
    faults: &mut Collector<'_>,
    key: &str,
    pair: &[String; 2],
    ids: &HashMap<String, usize>,
) -> Option<(usize, usize)> {
    let mut one = |id: &String| {
        let index = ids.get(id).copied();
        if index.is_none() {
            let mut known: Vec<&str> = ids.keys().map(String::as_str).collect();
            known.sort_unstable();
            faults.fault(key, format!("{id:?}, which is no vehicle"), known.join(", "));
        }
        index
    };
    let (a, b) = (one(&pair[0]), one(&pair[1]));
    let (a, b) = (a?, b?);
    if a == b {
        faults.fault(key, format!("a link from {} to itself", pair[0]), "two different vehicles");
        return None;
    }
    Some((a, b))
}

fn check_delay(faults: &mut Collector<'_>, key: &str, delay: &DelayChoice) -> Delay {
    let within = |value: f64| (0.0..=3600.0).contains(&value);
    match delay {
        DelayChoice::None => Delay::Constant(Span::ZERO),
        DelayChoice::Constant(c) => {
            faults.number(&format!("{key}.constant.delay_s"), c.delay_s, within(c.delay_s), "0 to 3600 s");
            Delay::Constant(Span::from_secs(c.delay_s))
        }
        DelayChoice::Jittered(j) => {
            faults.number(&format!("{key}.jittered.min_s"), j.min_s, within(j.min_s), "0 to 3600 s");
            let ok = within(j.max_s) && j.max_s >= j.min_s;
            faults.number(&format!("{key}.jittered.max_s"), j.max_s, ok, "min_s to 3600 s");
            Delay::Uniform(Span::from_secs(j.min_s), Span::from_secs(j.max_s))
        }
    }
}

fn check_loss(faults: &mut Collector<'_>, key: &str, loss: &LossChoice) -> f64 {
    match loss {
        LossChoice::None => 0.0,
        LossChoice::Bernoulli(b) => {
            let ok = (0.0..=1.0).contains(&b.probability);
            faults.number(&format!("{key}.bernoulli.probability"), b.probability, ok, "a probability, 0 to 1");
            b.probability
        }
    }
}

fn check_switching(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    ids: &HashMap<String, usize>,
    links: &[Link],
) -> Option<Switching> {
    let n = links.len();
    let key = "network.switching";
    match &file.network.switching {
        SwitchingChoice::Always => Some(Switching::always(n)),
        SwitchingChoice::Periodic(p) => {
            let key = format!("{key}.periodic");
            check_period(faults, &format!("{key}.period_s"), p.period_s, file.duration_s);
            let from_ok = p.up_from_s >= 0.0 && p.up_from_s < p.period_s;
            faults.number(&format!("{key}.up_from_s"), p.up_from_s, from_ok, "0 to below period_s");
            let for_ok = p.up_for_s > 0.0 && p.up_for_s <= p.period_s;
            faults.number(&format!("{key}.up_for_s"), p.up_for_s, for_ok, "above 0 and at most period_s");
            let span = Span::from_secs;
            Some(Switching::periodic(n, span(p.period_s), span(p.up_from_s), span(p.up_for_s)))
        }
        SwitchingChoice::Intervals(choice) => {
            let key = format!("{key}.intervals");
            if let Some(period) = choice.period_s {
                check_period(faults, &format!("{key}.period_s"), period, file.duration_s);
            }
            let mut up = Vec::new();
            for (i, interval) in choice.up.iter().enumerate() {
                let key = format!("{key}.up[{i}]");
                faults.number(&format!("{key}.from_s"), interval.from_s, interval.from_s >= 0.0, "0 s or later");
                faults.number(
                    &format!("{key}.to_s"),
                    interval.to_s,
                    interval.to_s > interval.from_s,
                    "later than from_s",
                );
                let chosen = interval.links.as_ref().map(|pairs| {
                    let index = |pair: &[String; 2]| {
                        let (from, to) = resolve(faults, &format!("{key}.links"), pair, ids)?;
                        let index = links.iter().position(|link| (link.from, link.to) == (from, to));
                        if index.is_none() {
                            let found = format!("{} -> {}, which is not a link", pair[0], pair[1]);
                            faults.fault(&format!("{key}.links"), found, "a link of network.links or network.one_way");
                        }
                        index
                    };
                    pairs.iter().filter_map(index).collect()
                });
                let (from, to) = (Time::from_secs(interval.from_s), Time::from_secs(interval.to_s));
                up.push(UpInterval { from, to, links: chosen });
            }
            if choice.up.is_empty() {
                let allowed = "at least one interval, else the graph can never be connected";
                faults.fault(&format!("{key}.up"), "no intervals", allowed);
            }
            check_union(faults, file.vehicles.len(), links, &up, &key);
            Some(Switching::intervals(n, up, choice.period_s.map(Span::from_secs)))
        }
        SwitchingChoice::Random(r) => {
            let key = format!("{key}.random");
            let allowed = "0 to below 1: the share of time without connection that Definition 4.3 allows";
            faults.number(&format!("{key}.alpha"), r.alpha, (0.0..1.0).contains(&r.alpha), allowed);
            faults.positive(&format!("{key}.t_0_s"), r.t_0_s, "s");
            check_period(faults, &format!("{key}.dwell_s"), r.dwell_s, file.duration_s);
            let ok = r.dwell_s > 0.0 && r.dwell_s <= r.t_0_s;
            faults.number(&format!("{key}.dwell_s"), r.dwell_s, ok, "above 0 and at most t_0_s");
            let stream = Stream::new(file.seed, "switching");
            Some(Switching::random(n, r.alpha, Span::from_secs(r.t_0_s), Span::from_secs(r.dwell_s), stream))
        }
        SwitchingChoice::OneAtATime(o) => {
            check_period(faults, &format!("{key}.one_at_a_time.dwell_s"), o.dwell_s, file.duration_s);
            let mut groups: Vec<Vec<usize>> = Vec::new();
            for (index, link) in links.iter().enumerate() {
                let back = links[..index].iter().position(|other| (other.from, other.to) == (link.to, link.from));
                match back.and_then(|back| groups.iter_mut().find(|group| group.contains(&back))) {
                    Some(group) => group.push(index),
                    None => groups.push(vec![index]),
                }
            }
            Some(Switching::one_at_a_time(n, groups, Span::from_secs(o.dwell_s)))
        }
    }
}

/// A time in which links come and go: long enough that a mission is not made of changes alone.
fn check_period(faults: &mut Collector<'_>, key: &str, value: f64, duration: f64) {
    let least = SHORTEST_SWITCHING.max(duration.min(LONGEST) / MOST_SWITCHINGS);
    faults.number(
        key,
        value,
        value >= least && value <= LONGEST,
        &format!("{least} s to 30 days in a mission this long"),
    );
}

/// Links that are up at some time must be enough for everyone's word to reach everyone.
fn check_union(faults: &mut Collector<'_>, n: usize, links: &[Link], up: &[UpInterval], key: &str) {
    let ever = |index: usize| up.iter().any(|i| i.links.as_ref().is_none_or(|links| links.contains(&index)));
    let arcs: Vec<(usize, usize)> =
        links.iter().enumerate().filter(|(i, _)| ever(*i)).map(|(_, link)| (link.to, link.from)).collect();
    if (2..=MOST_VEHICLES).contains(&n) && !links.is_empty() && !Graph::from_arcs(n, &arcs).can_agree() {
        let allowed = "links that come up by which at least one vehicle's word can reach every other";
        faults.fault(key, "a graph that can never be connected", allowed);
    }
}

fn check_vehicle(
    faults: &mut Collector<'_>,
    file: &MissionFile,
    index: usize,
    law: Option<&dyn CoordinationLaw>,
    factor: f64,
    fastest: f64,
) -> Option<VehiclePlan> {
    let section = &file.vehicles[index];
    let key = format!("vehicles[{index}]");
    let start = &section.start;
    for (name, value) in [
        ("x_m", start.x_m),
        ("y_m", start.y_m),
        ("z_m", start.z_m),
        ("yaw_deg", start.yaw_deg),
        ("speed_mps", start.speed_mps),
    ] {
        faults.finite(&format!("{key}.start.{name}"), value, "");
    }
    faults.finite(&format!("{key}.pattern"), section.pattern, "units of xi");
    if let Some(xi) = start.xi {
        faults.finite(&format!("{key}.start.xi"), xi, "units of xi");
    }
    let model = section.model.clone().or_else(|| file.fleet.model.clone());
    let following = section.following.clone().or_else(|| file.fleet.following.clone());
    if model.is_none() {
        faults.fault(
            &key,
            "no model",
            "a model here or in [fleet]: kinematic_unicycle, dynamic_unicycle or underactuated_auv",
        );
    }
    if following.is_none() {
        let allowed = "a following law here or in [fleet]: line_of_sight, proposition31 or theorem47";
        faults.fault(&key, "no following", allowed);
    }
    let path = match build::path(&section.path) {
        Ok(path) => path,
        Err(reason) => {
            faults.fault(&format!("{key}.path.{}", path_name(&section.path)), reason, "");
            return None;
        }
    };
    let (model, following) = (model?, following?);
    if !check_fit(faults, &key, section, file, &model, &following, law, path.as_ref()) {
        return None;
    }
    let position = Vector3::new(start.x_m, start.y_m, start.z_m);
    let usable = position.iter().all(|x| x.is_finite());
    let xi = start.xi.or_else(|| usable.then(|| closest_parameter(path.as_ref(), position, true)))?;
    let start = Start { position: position.into(), yaw: start.yaw_deg.to_radians(), speed: start.speed_mps, xi };
    let plan = VehiclePlan { id: section.id.clone(), pattern: section.pattern, path, start, model, following };
    if let Err(reason) = build::craft(&plan, start, factor, fastest, law.map_or(DemandKind::Rate, |law| law.kind())) {
        faults.fault(&following_key(&key, section), reason, "");
        return None;
    }
    Some(plan)
}

/// Where the following law of a vehicle is written.
fn following_key(key: &str, section: &VehicleSection) -> String {
    if section.following.is_some() { format!("{key}.following") } else { "fleet.following".to_string() }
}

fn path_name(path: &PathChoice) -> &'static str {
    match path {
        PathChoice::Line(_) => "line",
        PathChoice::Circle(_) => "circle",
        PathChoice::Sinusoid(_) => "sinusoid",
        PathChoice::Chain(_) => "chain",
        PathChoice::Helix(_) => "helix",
    }
}

/// Whether model, following law, coordination law and path fit together; names both sides of every misfit.
#[expect(clippy::too_many_arguments, reason = "the sides of the fit")]
fn check_fit(
    faults: &mut Collector<'_>,
    key: &str,
    section: &VehicleSection,
    file: &MissionFile,
    model: &ModelChoice,
    following: &FollowingChoice,
    law: Option<&dyn CoordinationLaw>,
    path: &dyn Path,
) -> bool {
    let (fits, law_of_model) = match (model, following) {
        (ModelChoice::KinematicUnicycle, FollowingChoice::LineOfSight(_))
        | (ModelChoice::DynamicUnicycle(_), FollowingChoice::Proposition31(_))
        | (ModelChoice::UnderactuatedAuv(_), FollowingChoice::Theorem47(_)) => (true, ""),
        (ModelChoice::KinematicUnicycle, _) => (false, "line_of_sight with kinematic_unicycle"),
        (ModelChoice::DynamicUnicycle(_), _) => (false, "proposition31 with dynamic_unicycle"),
        (ModelChoice::UnderactuatedAuv(_), _) => (false, "theorem47 with underactuated_auv"),
    };
    if !fits {
        let found = format!("{} with {}", following_name(following), model_name(model));
        faults.fault(&following_key(key, section), found, law_of_model);
        return false;
    }
    let mut ok = true;
    let takes_acceleration = matches!(model, ModelChoice::DynamicUnicycle(_));
    if let Some(law) = law
        && law.kind() == DemandKind::Acceleration
        && !takes_acceleration
    {
        let found = format!(
            "{}, which gives an acceleration, for {}, whose {} takes a rate",
            build::law_name(&file.coordination.law),
            section.id,
            following_name(following)
        );
        faults.fault(
            "coordination.law",
            found,
            "introduction, switching, delayed or delayed_with_losses for this vehicle",
        );
        ok = false;
    }
    let path_key = format!("{key}.path.{}", path_name(&section.path));
    if let Some(at) = path.tangent_breaks().first() {
        let found = format!("a path whose direction jumps at xi = {at}");
        faults.fault(&path_key, found, format!("a path with a continuous tangent for {}", following_name(following)));
        ok = false;
    }
    if let (FollowingChoice::Theorem47(_), PathChoice::Chain(chain)) = (following, &section.path)
        && chain.segments.iter().any(|segment| matches!(segment, SegmentChoice::Arc(_)))
        && chain.segments.len() > 1
    {
        let allowed = "a path with a continuous curvature for theorem47: line, circle, sinusoid or helix";
        faults.fault(&path_key, "a chain, whose curvature jumps from piece to piece", allowed);
        ok = false;
    }
    if !matches!(model, ModelChoice::UnderactuatedAuv(_)) && !crate::path::shape::is_planar(path) {
        let found = format!("a path that leaves the plane for a {}", model_name(model));
        faults.fault(&path_key, found, "a line, circle, sinusoid or chain");
        ok = false;
    }
    ok
}

fn model_name(model: &ModelChoice) -> &'static str {
    match model {
        ModelChoice::KinematicUnicycle => "kinematic_unicycle",
        ModelChoice::DynamicUnicycle(_) => "dynamic_unicycle",
        ModelChoice::UnderactuatedAuv(_) => "underactuated_auv",
    }
}

fn following_name(following: &FollowingChoice) -> &'static str {
    match following {
        FollowingChoice::LineOfSight(_) => "line_of_sight",
        FollowingChoice::Proposition31(_) => "proposition31",
        FollowingChoice::Theorem47(_) => "theorem47",
    }
}

#[cfg(test)]
mod tests {
    use super::super::Mission;

    const HELIX: &str = include_str!("../../../missions/auv-helix.toml");
    const FIG_3_7: &str = include_str!("../../../missions/thesis/fig-3-7.toml");

    /// What the check says of a mission file, one fault a line.
    fn faults(text: &str) -> Vec<String> {
        Mission::parse("m.toml", text)
            .err()
            .map_or(Vec::new(), |faults| faults.to_string().lines().map(str::to_string).collect())
    }

    /// What it says of the flagship with one thing replaced.
    fn faults_with(old: &str, new: &str) -> Vec<String> {
        assert!(HELIX.contains(old), "{old:?} is not in the mission");
        faults(&HELIX.replacen(old, new, 1))
    }

    #[test]
    fn every_mission_of_the_project_can_be_flown() {
        for (name, text) in [
            ("auv-helix", HELIX),
            ("fig-1-9", include_str!("../../../missions/thesis/fig-1-9.toml")),
            ("fig-1-10", include_str!("../../../missions/thesis/fig-1-10.toml")),
            ("fig-3-7", FIG_3_7),
            ("fig-3-9", include_str!("../../../missions/thesis/fig-3-9.toml")),
            ("fig-4-2", include_str!("../../../missions/thesis/fig-4-2.toml")),
        ] {
            let mission = Mission::parse(name, text).unwrap_or_else(|faults| panic!("{faults}"));
            assert_eq!(mission.name, name);
        }
    }

    #[test]
    fn the_initial_target_is_the_closest_point_in_the_plane() {
        // Erratum 4.23.
        let mission = Mission::parse("m.toml", HELIX).expect("sound");
        for (vehicle, gamma) in mission.vehicles.iter().zip([79.517, 70.483, 65.596]) {
            assert!((vehicle.start.xi - gamma).abs() < 1e-3, "{} starts at {}", vehicle.id, vehicle.start.xi);
        }
    }

    #[test]
    fn the_digest_is_of_the_text() {
        let parse = |text: &str| Mission::parse("m.toml", text).expect("sound").digest;
        assert_eq!(parse(HELIX), parse(HELIX));
        assert_ne!(parse(HELIX), parse(&HELIX.replace("seed = 1", "seed = 2")));
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_what_is_allowed() {
        let found = faults_with("z0_m = -5.0", "z0 = -5.0");
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("m.toml:38: vehicles[1].path.helix.z0: found an unknown key; allowed: "),
            "{}",
            found[0]
        );
        assert!(found[0].contains("z0_m"));
    }

    #[test]
    fn each_fault_names_its_key() {
        for (old, new, key) in [
            ("duration_s = 800.0", "duration_s = -1", "duration_s"),
            ("duration_s = 800.0", "duration_s = \"long\"", "duration_s"),
            ("control_period_s = 0.05", "control_period_s = 0.0", "clock.control_period_s"),
            ("message_period_s = 0.1", "message_period_s = 0.07", "coordination.message_period_s"),
            ("validity_s = 0.3", "validity_s = 0.01", "coordination.validity_s"),
            ("gain = 0.1", "gain = -0.1", "coordination.law.delayed_with_losses"),
            ("between = \"align\"", "between = \"guess\"", "coordination.between"),
            ("up_for_s = 2.5", "up_for_s = 20.0", "network.switching.periodic.up_for_s"),
            (
                "delay = { constant = { delay_s = 5.0 } }",
                "loss = { bernoulli = { probability = 1.5 } }",
                "network.loss.bernoulli.probability",
            ),
            ("id = \"auv2\"", "id = \"auv1\"", "vehicles[1].id"),
            ("id = \"auv2\"", "id = \"AUV 2\"", "vehicles[1].id"),
            ("[\"auv2\", \"auv3\"]", "[\"auv2\", \"auv9\"]", "network.links[1]"),
            (", [\"auv2\", \"auv3\"]", "", "network.links"),
            ("kind = \"II\"", "delta1_mps = 0.3", "fleet.following"),
            ("{ underactuated_auv = \"sirene\" }", "\"kinematic_unicycle\"", "fleet.following"),
            ("delayed_with_losses = { gain = 0.1, delay_s = 5.0 }", "solution1 = { a = 1.0 }", "coordination.law"),
            ("speed = 0.5", "", "formation"),
            ("start = { x_m = 5.0, y_m = -10.0, z_m = -5.0 }", "", "vehicles[0]"),
        ] {
            let found = faults_with(old, new);
            assert!(found.iter().any(|line| line.contains(&format!(": {key}"))), "{new:?}: {found:?}");
        }
    }

    #[test]
    fn a_corner_is_refused_for_a_law_that_needs_a_smooth_path() {
        let text = FIG_3_7.replacen("{ line = { length_m = 3.0 } },", "{ corner = { turn_deg = 30.0 } },", 1);
        let found = faults(&text);
        assert!(
            found.iter().any(|line| line.contains("whose direction jumps") && line.contains("proposition31")),
            "{found:?}"
        );
    }

    #[test]
    fn a_law_that_does_not_fit_names_both_sides() {
        let found = faults_with("{ theorem47 = { kind = \"II\" } }", "{ proposition31 = {} }");
        assert!(found.iter().any(|l| l.contains("proposition31 with underactuated_auv")), "{found:?}");
    }

    #[test]
    fn several_faults_are_reported_together_in_the_order_of_the_file() {
        let text = HELIX
            .replace("duration_s = 800.0", "duration_s = 0")
            .replace("up_for_s = 2.5", "up_for_s = -1")
            .replace("id = \"auv3\"", "id = \"auv1\"")
            .replace(
                "climb_m = 0.05, phase_deg = -135.0, z0_m = 0.0",
                "climb = 0.05, phase_deg = -135.0, z0_m = 0.0, climb_m = 0.05",
            );
        let found = faults(&text);
        for key in ["duration_s", "up_for_s", "vehicles[2].id", "vehicles[2].path.helix.climb"] {
            assert!(found.iter().any(|line| line.contains(key)), "{key}: {found:?}");
        }
        let lines: Vec<usize> = found.iter().filter_map(|l| l.split(':').nth(1)?.parse().ok()).collect();
        assert!(lines.is_sorted(), "{found:?}");
    }

    #[test]
    fn what_is_no_toml_is_refused_with_its_line() {
        let found = faults("name = \"x\"\nseed = = 3\n");
        assert!(found[0].starts_with("m.toml:2:"), "{found:?}");
    }
}
