//! Draws a figure of the gallery: panels of trajectories and of quantities over time.

use kuva::plot::LinePlot;
use kuva::plot::annotations::ShadedRegion;
use kuva::render::layout::Layout;

use crate::batch::Flight;
use crate::results::drawing::{Drawing, OUTAGE, OUTAGE_LIMIT, PAPER, PLANNED, Panel, colour, extremes, render};
use crate::results::{Network, Track, tracks};

use super::file::{FigureSection, PanelSection, Plane, Quantity};
use super::quantity::{Series, label};
use super::view::{Box2, View, simplified};

/// Points of all series of a figure together: keeps a picture below some 100 kB.
const POINTS: usize = 5_000;
/// Samples of one series at least and at most.
const LEAST_SAMPLES: usize = 60;
const MOST_SAMPLES: usize = 500;
/// Length of a drawn vehicle as a part of the panel's extent.
const VEHICLE: f64 = 0.035;
/// How far a drawn trajectory may be from the flown one, as a part of the panel's extent.
const TOLERANCE: f64 = 4e-4;

/// A figure's flights, in the order of its missions.
pub(super) struct Subject<'a> {
    pub(super) figure: &'a FigureSection,
    pub(super) flights: Vec<&'a Flight>,
}

/// Draws a figure.
pub(super) fn draw(subject: &Subject<'_>) -> String {
    let figure = subject.figure;
    let panels: Vec<&PanelSection> = figure.panels.iter().collect();
    let count: usize = panels.iter().map(|panel| subject.count_series(panel)).sum();
    let samples = (POINTS / count.max(1)).clamp(LEAST_SAMPLES, MOST_SAMPLES);
    let drawings: Vec<Drawing> = panels
        .iter()
        .enumerate()
        .map(|(index, panel)| {
            let letter = char::from(b'a' + (index % 26) as u8);
            let title = if panels.len() == 1 { panel.title.clone() } else { format!("({letter}) {}", panel.title) };
            match (panel.plane, panel.over_time) {
                (Some(plane), _) => subject.plane(panel, plane, &title),
                (None, Some(quantity)) => subject.over_time(panel, quantity, &title, samples),
                (None, None) => Panel::default().laid_out(Layout::new((0.0, 1.0), (0.0, 1.0))),
            }
        })
        .collect();
    let columns = (figure.columns as usize).min(drawings.len()).max(1);
    render(&figure.id, drawings.len().div_ceil(columns), columns, drawings)
}

/// One series as it is drawn.
struct Drawn {
    series: Series,
    name: String,
    colour: usize,
    /// Which of the figure's missions it is from: tells the kind of its line.
    dash: usize,
}

impl Subject<'_> {
    /// The flights of a panel with their place in the figure.
    fn chosen(&self, panel: &PanelSection) -> Vec<(usize, &Flight)> {
        let wanted = |name: &str| panel.missions.as_ref().is_none_or(|names| names.iter().any(|n| n == name));
        self.flights.iter().copied().enumerate().filter(|(_, flight)| wanted(&flight.mission.name)).collect()
    }

    fn label(&self, index: usize) -> &str {
        self.figure.labels.get(index).unwrap_or(&self.figure.missions[index])
    }

    fn count_series(&self, panel: &PanelSection) -> usize {
        let vehicles = |flight: &Flight| panel.vehicles.as_ref().map_or(flight.mission.vehicles.len(), Vec::len);
        self.chosen(panel).iter().map(|(_, flight)| vehicles(flight)).sum()
    }

    /// The series of a panel. Vehicles have their colours, missions their kinds of line; where every mission has but one
    /// series, the missions have the colours.
    fn series(&self, panel: &PanelSection, quantity: Quantity) -> Vec<Drawn> {
        let chosen = self.chosen(panel);
        let several = chosen.len() > 1;
        let mut all: Vec<Vec<Drawn>> = Vec::new();
        for (index, flight) in chosen {
            let shown = |series: &Series| match (series.vehicle, &panel.vehicles) {
                (Some(at), Some(wanted)) => wanted.contains(&flight.mission.vehicles[at].id),
                _ => true,
            };
            let drawn = |series: Series| Drawn {
                name: if several { format!("{}: {}", self.label(index), series.name) } else { series.name.clone() },
                colour: series.vehicle.unwrap_or(index),
                dash: index,
                series,
            };
            all.push(
                Series::all(quantity, flight, symbol_of(panel, flight)).into_iter().filter(shown).map(drawn).collect(),
            );
        }
        if !several {
            all.iter_mut().flatten().for_each(|drawn| drawn.dash = 0);
        } else if all.iter().all(|of_mission| of_mission.len() == 1) {
            for drawn in all.iter_mut().flatten() {
                (drawn.colour, drawn.name) = (drawn.dash, self.label(drawn.dash).to_owned());
            }
        }
        all.into_iter().flatten().collect()
    }

    fn over_time(&self, section: &PanelSection, quantity: Quantity, title: &str, samples: usize) -> Drawing {
        let flights = self.chosen(section);
        let end = flights.iter().map(|(_, flight)| flight.facts.duration_s).fold(0.0, f64::max);
        let (from, to) = (section.from_s.unwrap_or(0.0), section.to_s.unwrap_or(end));
        let scale = section.scale.unwrap_or(1.0);
        let in_log = |value: f64| if section.log { value.abs() } else { value };
        let mut panel = Panel::default();
        for drawn in self.series(section, quantity) {
            let points: Vec<(f64, f64)> = drawn.series.points.iter().map(|(t, y)| (*t, in_log(y * scale))).collect();
            let points = points.into_iter().filter(|(t, y)| (from..=to).contains(t) && y.is_finite());
            let points: Vec<(f64, f64)> = points.filter(|point| !section.log || point.1 > 0.0).collect();
            let points = extremes(points, samples);
            panel.names.push(drawn.name.clone());
            panel.line(points, |line| {
                let line = line.with_color(colour(drawn.colour)).with_stroke_width(1.5);
                dashed(line.with_legend(drawn.name), drawn.dash)
            });
        }
        for level in &section.levels {
            panel.line(vec![(from, *level), (to, *level)], |line| {
                line.with_color(PLANNED).with_stroke_width(1.4).with_dotted()
            });
        }
        let symbol = flights.first().map_or("ξ", |(_, flight)| symbol_of(section, flight));
        let y_label = section.label.clone().unwrap_or_else(|| label(quantity, symbol));
        let mut layout = panel.layout(title, "time [s]", &y_label).with_x_axis_min(from).with_x_axis_max(to);
        if section.log {
            layout = layout.with_log_y();
        }
        layout = section.low.into_iter().fold(layout, Layout::with_y_axis_min);
        layout = section.high.into_iter().fold(layout, Layout::with_y_axis_max);
        if section.outages {
            for (from, to) in outages(&flights, from, to) {
                let outage = ShadedRegion::vertical(from, to).with_color(OUTAGE).with_opacity(0.18);
                layout = layout.with_shaded_region(outage);
            }
        }
        panel.laid_out(layout)
    }

    fn plane(&self, section: &PanelSection, plane: Plane, title: &str) -> Drawing {
        let view = View::of(plane);
        let chosen = self.chosen(section);
        let mut panel = Panel::default();
        let mut bounds = Box2::default();
        for (_, flight) in &chosen {
            let rows = tracks(&flight.recording.exact, &flight.facts);
            rows.iter()
                .flat_map(|track| &track.rows)
                .for_each(|row| bounds.take(view.see([row.x_m, row.y_m, row.z_m])));
        }
        let tolerance = TOLERANCE * bounds.extent();
        for (place, (index, flight)) in chosen.iter().enumerate() {
            let shown = |id: &str| section.vehicles.as_ref().is_none_or(|wanted| wanted.iter().any(|w| w == id));
            for vehicle in flight.facts.vehicles.iter().filter(|vehicle| place == 0 && shown(&vehicle.id)) {
                let points = vehicle.planned.iter().map(|point| view.see(*point)).collect();
                panel.line(simplified(points, tolerance), |line| {
                    line.with_color(PLANNED).with_stroke_width(1.0).with_dashed()
                });
            }
            let all = tracks(&flight.recording.exact, &flight.facts);
            let flown: Vec<(usize, &Track<'_>)> =
                all.iter().enumerate().filter(|(_, track)| shown(track.id) && !track.rows.is_empty()).collect();
            let one_each = chosen.len() > 1 && flown.len() == 1;
            for (vehicle, track) in &flown {
                let points: Vec<(f64, f64)> =
                    track.rows.iter().map(|row| view.see([row.x_m, row.y_m, row.z_m])).collect();
                let start = points[0];
                let (hue, dash) = (if one_each { *index } else { *vehicle }, place);
                let name = match (one_each, chosen.len() > 1) {
                    (true, _) => self.label(*index).to_owned(),
                    (false, true) => format!("{}: {}", self.label(*index), track.id),
                    _ => track.id.to_owned(),
                };
                panel.names.push(name.clone());
                panel.line(simplified(points, tolerance), |line| {
                    dashed(line.with_color(colour(hue)).with_stroke_width(1.5).with_legend(name), dash)
                });
                panel.dot(start, colour(hue), 4.0);
                panel.dot(start, PAPER, 2.2);
            }
            for t_s in &section.vehicles_at_s {
                let hue = |vehicle: usize| colour(if one_each { *index } else { vehicle });
                formation(&mut panel, &flown, *t_s, &view, VEHICLE * bounds.extent(), hue);
            }
        }
        let [x_label, y_label] = view.labels();
        let layout = panel.layout(title, x_label, y_label).with_equal_aspect();
        panel.laid_out(layout)
    }
}

/// What coordination states are called in a panel.
fn symbol_of<'a>(panel: &'a PanelSection, flight: &'a Flight) -> &'a str {
    panel.symbol.as_deref().unwrap_or(flight.facts.symbol())
}

/// The vehicles at an instant, as arrowheads that point where they head, and a line through them.
fn formation(
    panel: &mut Panel,
    flown: &[(usize, &Track<'_>)],
    t_s: f64,
    view: &View,
    length: f64,
    hue: impl Fn(usize) -> &'static str,
) {
    let mut through = Vec::new();
    for (vehicle, track) in flown {
        let at = track.rows.partition_point(|row| (row.t_ns as f64) < t_s * 1e9 - 0.5).min(track.rows.len() - 1);
        let row = track.rows[at];
        let (sin, cos) = row.yaw_rad.sin_cos();
        let corner = |ahead: f64, left: f64| {
            let (ahead, left) = (ahead * length, left * length);
            view.see([row.x_m + ahead * cos - left * sin, row.y_m + ahead * sin + left * cos, row.z_m])
        };
        let outline = [corner(0.6, 0.0), corner(-0.4, 0.3), corner(-0.4, -0.3), corner(0.6, 0.0)];
        through.push(view.see([row.x_m, row.y_m, row.z_m]));
        panel.line(outline.to_vec(), |line| line.with_color(hue(*vehicle)).with_stroke_width(1.8));
    }
    panel.line(through, |line| line.with_color(PLANNED).with_stroke_width(1.2));
}

/// Another kind of line for every mission of a panel.
fn dashed(line: LinePlot, mission: usize) -> LinePlot {
    match mission % 4 {
        0 => line,
        1 => line.with_dashed(),
        2 => line.with_dotted(),
        _ => line.with_dashdot(),
    }
}

/// When every link of the first flight was down, unless that is too often to be seen.
fn outages(flights: &[(usize, &Flight)], from: f64, to: f64) -> Vec<(f64, f64)> {
    let Some((_, flight)) = flights.first() else { return Vec::new() };
    let all = Network::of(&flight.recording.exact, &flight.facts).blackouts();
    let seen: Vec<(f64, f64)> = all
        .into_iter()
        .filter(|outage| outage.1 > from && outage.0 < to)
        .map(|(a, b)| (a.max(from), b.min(to)))
        .collect();
    if seen.len() > OUTAGE_LIMIT { Vec::new() } else { seen }
}
