//! The figures of a run, in the arrangement of the thesis.
//!
//! | figure | panels | after |
//! |---|---|---|
//! | `run.svg` (planar) | (a) trajectories (b) speeds (c) coordination errors (d) cross-track errors | Figures 1.9, 3.7 |
//! | `trajectories.svg` (in space) | (a) from above (b) third coordinate over time | Figure 4.2 |
//! | `errors.svg` (in space) | (a) path-following errors (b) coordination errors, outages shaded | Figure 4.3 |
//! | `rate.svg` | the norm of the coordination error, logarithmic, with the fitted and the guaranteed rate | |
//! | `links.svg` | when each directed link was up, if any ever was not | |

use std::ops::Range;

use bus::recording::Recording;
use common::record::StateRow;
use kuva::plot::annotations::ShadedRegion;
use kuva::render::layout::Layout;

use super::Facts;
use super::decay::{Decay, fitted_where};
use super::drawing::{
    Drawing, OUTAGE, OUTAGE_LIMIT, PAPER, PLANNED, Panel, SAMPLES, can_be_drawn, colour, extremes, render, subscript,
};
use super::html::number;
use super::network::Network;
use super::series::{Coordination, Track, tracks, unbroken};
use super::signal;
use super::statistics::thinned;

/// One figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// File name without extension.
    pub name: &'static str,
    /// What it shows, for the report.
    pub caption: String,
    /// The picture.
    pub svg: String,
}

/// The figures of a run.
pub fn figures(recording: &Recording, facts: &Facts) -> Vec<Figure> {
    let tracks = tracks(&recording.exact, facts);
    let coordination = Coordination::of(&tracks, facts);
    let network = Network::of(&recording.exact, facts);
    let outages = network.blackouts();
    let decay = Decay::of(&coordination, &recording.exact, facts);
    let view = View { facts, tracks, coordination, decay, outages };
    let mut figures = if facts.spatial { view.spatial() } else { view.planar() };
    figures.extend(view.rate());
    figures.extend(signal::figure(&network, facts));
    figures
}

/// What the panels draw from.
struct View<'a> {
    facts: &'a Facts,
    tracks: Vec<Track<'a>>,
    coordination: Coordination,
    decay: Decay,
    outages: Vec<(f64, f64)>,
}

/// ±height·exp(−rate·(t − start)) from its start on.
struct Envelope {
    start_s: f64,
    height: f64,
    rate: f64,
}

impl View<'_> {
    fn planar(&self) -> Vec<Figure> {
        let panels = vec![
            self.plan_view("(a) Trajectories"),
            self.over_time("(b) Speeds", "speed [m/s]", |row| row.speed_mps),
            self.coordination_errors("(c) Coordination errors"),
            self.over_time("(d) Cross-track errors", "cross-track error [m]", |row| row.e_cross_m),
        ];
        let caption = format!("Trajectories, speeds, coordination errors{} and cross-track errors.", self.remark());
        vec![Figure { name: "run", caption, svg: render("run", 2, 2, panels) }]
    }

    fn spatial(&self) -> Vec<Figure> {
        let trajectories = vec![
            self.plan_view("(a) Trajectories from above"),
            self.over_time("(b) Third coordinate", "z [m]", |row| row.z_m),
        ];
        let errors = vec![
            self.over_time("(a) Path-following errors", "‖e‖ [m]", |row| row.e_norm_m),
            self.coordination_errors("(b) Coordination errors"),
        ];
        vec![
            Figure {
                name: "trajectories",
                caption: "Trajectories from above, and the third coordinate over time.".into(),
                svg: render("trajectories", 1, 2, trajectories),
            },
            Figure {
                name: "errors",
                caption: format!("Norms of the path-following errors, and coordination errors{}.", self.remark()),
                svg: render("errors", 2, 1, errors),
            },
        ]
    }

    /// The decay of the coordination error beside the rates, if there is a fleet to coordinate.
    fn rate(&self) -> Option<Figure> {
        let (t_s, norm) = (&self.coordination.t_s, self.coordination.norm());
        let points: Vec<(f64, f64)> =
            t_s.iter().copied().zip(norm.iter().copied()).filter(|point| point.1 > 0.0).collect();
        if self.coordination.states.len() < 2 || points.len() < 2 {
            return None;
        }
        let end = points[points.len() - 1].0;
        let lowest = points.iter().fold(f64::INFINITY, |low, point| low.min(point.1));
        let mut panel = Panel::default();
        let parts = unbroken(t_s, self.facts)
            .into_iter()
            .map(|part| part.map(|at| (t_s[at], norm[at])).filter(|point| point.1 > 0.0).collect());
        broken(&mut panel, parts.collect(), 0, "measured");
        if let Some(fit) = self.decay.fit {
            let at = t_s.partition_point(|time| *time < fit.from_s).min(norm.len() - 1);
            let value = |time: f64| (time, norm[at] * (-fit.rate * (time - fit.from_s)).exp());
            let way = if fit.on_paths { "" } else { " on the way to the paths" };
            let name = format!("fitted{way}: {} /s", in_a_picture(fit.rate));
            panel.names.push(name.clone());
            panel.line(vec![value(fit.from_s), value(fit.to_s)], |line| {
                line.with_color(colour(1)).with_stroke_width(1.8).with_dashed().with_legend(name)
            });
        }
        // A rate without a factor is a slope: it lies where it can be laid beside the fitted one.
        let slope_alone = self.facts.guaranteed_factor.is_none();
        let from_s = self.decay.fit.filter(|_| slope_alone).map_or(self.decay.from_s, |fit| fit.from_s);
        let promised = points.iter().find(|point| point.0 >= from_s - 1e-9);
        let guaranteed = self.facts.guaranteed_rate.filter(|rate| *rate > 0.0);
        if let Some(((start, height), rate)) = promised.copied().zip(guaranteed) {
            let factor = self.facts.guaranteed_factor.unwrap_or(1.0);
            // Not further down than the measurement goes: the axis is for what was measured.
            let until = end.min(start + (factor * height / lowest).ln() / rate);
            let value = |time: f64| (time, factor * height * (-rate * (time - start)).exp());
            let name = format!("guaranteed: {} /s", in_a_picture(rate));
            panel.names.push(name.clone());
            panel.line(vec![value(start), value(until)], |line| {
                line.with_color(PLANNED).with_stroke_width(1.8).with_dotted().with_legend(name)
            });
        }
        let unit = if self.facts.xi_unit.is_empty() { String::new() } else { format!(" [{}]", self.facts.xi_unit) };
        let layout = panel.layout("Decay of the coordination error", "time [s]", &format!("‖x − mean(x)‖{unit}"));
        let layout = self.time_axis(layout).with_log_y();
        let mut caption =
            "Norm of the coordination error on a logarithmic scale: a straight line is an exponential".to_owned();
        if let Some(fit) = &self.decay.fit {
            caption += &format!(" (dashed: {})", fitted_where(fit));
        }
        caption += ".";
        if slope_alone && guaranteed.is_some() {
            caption += " Of the dotted line only the slope is guaranteed, not the height.";
        }
        if self.decay.fit.is_some_and(|fit| !fit.on_paths) {
            caption += " It was fitted on the way to the paths: d lasts as long as e.";
        }
        Some(Figure { name: "rate", caption, svg: render("rate", 1, 1, vec![panel.laid_out(layout)]) })
    }

    /// What the caption has to say about the panel of the coordination errors.
    fn remark(&self) -> String {
        let mut remarks = Vec::new();
        if self.tracks.iter().any(|track| !track.pattern.is_zero()) {
            remarks.push("the pattern is removed");
        }
        if self.shades_outages() {
            remarks.push("grey where every link was down");
        }
        if self.envelope().is_some() {
            remarks.push("dotted: the envelope that theory guarantees");
        }
        if remarks.is_empty() { String::new() } else { format!(" ({})", remarks.join("; ")) }
    }

    fn shades_outages(&self) -> bool {
        (1..=OUTAGE_LIMIT).contains(&self.outages.len())
    }

    /// The bound on |x_1 − x_j| ≤ √2·c·exp(−rate·(t − t_0))·‖e(t_0)‖ from the instant t_0 on from which on it is promised.
    fn envelope(&self) -> Option<Envelope> {
        let t_s = &self.coordination.t_s;
        let at = t_s.partition_point(|time| *time < self.decay.from_s - 1e-9);
        let (start_s, first) = (*t_s.get(at)?, *self.coordination.norm().get(at)?);
        let height = std::f64::consts::SQRT_2 * self.facts.guaranteed_factor? * first;
        Some(Envelope { start_s, height, rate: self.facts.guaranteed_rate? }).filter(|envelope| envelope.height > 0.0)
    }

    fn plan_view(&self, title: &str) -> Drawing {
        let mut panel = Panel::default();
        for vehicle in &self.facts.vehicles {
            let points = vehicle.planned.iter().map(|[x, y, _]| (*x, *y)).collect();
            panel.line(points, |line| line.with_color(PLANNED).with_stroke_width(1.0).with_dashed());
        }
        for (index, track) in self.tracks.iter().enumerate() {
            let place = |at: usize| (track.rows[at].x_m, track.rows[at].y_m);
            let total = track.rows.len();
            let Some((start, end)) = total.checked_sub(1).map(|last| (place(0), place(last))) else { continue };
            for (number, part) in self.parts(track).into_iter().enumerate() {
                let kept = thinned(part.len(), share(SAMPLES, part.len(), total));
                piece(&mut panel, kept.into_iter().map(|at| place(part.start + at)).collect(), index, track.id, number);
            }
            panel.dot(start, colour(index), 4.5);
            panel.dot(start, PAPER, 2.5);
            panel.dot(end, colour(index), 4.5);
        }
        let layout = panel.layout(title, "x [m]", "y [m]").with_equal_aspect();
        panel.laid_out(layout)
    }

    fn over_time(&self, title: &str, label: &str, value: impl Fn(&StateRow) -> f64) -> Drawing {
        let mut panel = Panel::default();
        for (index, track) in self.tracks.iter().enumerate() {
            let point = |at: usize| (track.rows[at].t_ns as f64 / 1e9, value(track.rows[at]));
            let parts = self.parts(track).into_iter().map(|part| part.map(point).collect());
            broken(&mut panel, parts.collect(), index, track.id);
        }
        let layout = self.time_axis(panel.layout(title, "time [s]", label));
        panel.laid_out(layout)
    }

    fn coordination_errors(&self, title: &str) -> Drawing {
        let symbol = self.facts.symbol();
        let mut panel = Panel::default();
        let mut present = self.tracks.iter().filter(|track| !track.rows.is_empty());
        let first = present.next();
        for (index, other) in present.enumerate() {
            // Each pair by itself: that a third one is away is nothing to it.
            let Some(first) = first else { break };
            let Coordination { t_s, states, .. } = Coordination::of(&[first.clone(), other.clone()], self.facts);
            let parts = unbroken(&t_s, self.facts)
                .into_iter()
                .map(|part| part.map(|at| (t_s[at], states[0][at] - states[1][at])).collect());
            broken(&mut panel, parts.collect(), index + 1, &format!("{symbol}₁ − {symbol}{}", subscript(index + 2)));
        }
        if let Some(Envelope { start_s, height, rate }) = self.envelope() {
            for sign in [1.0, -1.0] {
                let at = |step: u32| start_s + (self.facts.duration_s - start_s) * f64::from(step) / 200.0;
                let value = |time: f64| (time, sign * height * (-rate * (time - start_s)).exp());
                let points = (0..=200).map(|step| value(at(step))).collect();
                panel.line(points, |line| line.with_color(PLANNED).with_stroke_width(1.2).with_dotted());
            }
        }
        let unit = if self.facts.xi_unit.is_empty() { String::new() } else { format!(" [{}]", self.facts.xi_unit) };
        let mut layout = self.time_axis(panel.layout(title, "time [s]", &format!("{symbol}₁ − {symbol}ⱼ{unit}")));
        if self.shades_outages() {
            for (from, to) in &self.outages {
                let outage = ShadedRegion::vertical(*from, *to).with_color(OUTAGE).with_opacity(0.18);
                layout = layout.with_shaded_region(outage);
            }
        }
        panel.laid_out(layout)
    }

    /// The rows of a vehicle, in parts between which it was away.
    fn parts(&self, track: &Track<'_>) -> Vec<Range<usize>> {
        let t_s: Vec<f64> = track.rows.iter().map(|row| row.t_ns as f64 / 1e9).collect();
        unbroken(&t_s, self.facts)
    }

    fn time_axis(&self, layout: Layout) -> Layout {
        if self.facts.duration_s > 0.0 {
            layout.with_x_axis_min(0.0).with_x_axis_max(self.facts.duration_s)
        } else {
            layout
        }
    }
}

/// A number as the report writes it, for a picture, which has no raised digits.
fn in_a_picture(value: f64) -> String {
    let text = number(value);
    if text.contains('<') { format!("{value:.1e}") } else { text }
}

/// A line with gaps: what was not recorded is not drawn. What is no number cannot be drawn either.
fn broken(panel: &mut Panel, parts: Vec<Vec<(f64, f64)>>, index: usize, name: &str) {
    let total = parts.iter().map(Vec::len).sum();
    for (number, points) in parts.into_iter().enumerate() {
        let samples = share(SAMPLES, points.len(), total);
        let finite = points.into_iter().filter(can_be_drawn).collect();
        piece(panel, extremes(finite, samples), index, name, number);
    }
}

/// One part of a line; the first has the line's name.
fn piece(panel: &mut Panel, points: Vec<(f64, f64)>, index: usize, name: &str, number: usize) {
    match number {
        0 => panel.series(points, index, name),
        _ => panel.line(points, |line| line.with_color(colour(index)).with_stroke_width(1.5)),
    }
}

/// The samples that a part of so many rows gets of all.
fn share(samples: usize, part: usize, total: usize) -> usize {
    if part == total { samples } else { (samples * part / total.max(1)).max(2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::VehicleFacts;
    use crate::results::drawing::renumbered;
    use crate::results::testing::{facts, fleet, state_row};
    use crate::results::{fit_exponential, summarise};
    use common::record::{Record, SpeedRow};

    #[test]
    fn planar_and_spatial_fleets_have_the_figures_of_the_thesis() {
        let names = |spatial| figures(&fleet(spatial), &facts(spatial)).into_iter().map(|f| f.name).collect::<Vec<_>>();
        assert_eq!(names(false), ["run", "rate", "links"]);
        assert_eq!(names(true), ["trajectories", "errors", "rate", "links"]);
    }

    /// A forged row, or one of a vehicle that flew out of all numbers: the length of an axis that holds it is none.
    #[test]
    fn what_no_axis_can_hold_is_not_drawn() {
        for spatial in [false, true] {
            let mut recording = fleet(spatial);
            let mut sign = 1.0;
            for record in recording.exact.iter_mut().step_by(50) {
                let Record::State(row) = record else { continue };
                sign = -sign;
                (row.x_m, row.z_m, row.xi, row.speed_mps) =
                    (sign * 1.7e308, sign * 1.7e308, sign * 1.7e308, sign * 1.7e308);
                (row.e_norm_m, row.e_cross_m) = (1.7e308, sign * 1.7e308);
            }
            for figure in figures(&recording, &facts(spatial)) {
                for none in ["NaN", "inf"] {
                    assert!(!figure.svg.contains(none), "{none} in {}", figure.name);
                }
            }
        }
    }

    #[test]
    fn figures_are_small_and_say_what_the_axes_are() {
        let all = figures(&fleet(true), &facts(true));
        for figure in &all {
            assert!(figure.svg.len() < 200_000, "{} has {} bytes", figure.name, figure.svg.len());
            assert!(!figure.svg.contains("NaN"));
        }
        for text in ["time [s]", "‖e‖ [m]", "γ₁ − γ₃", "(b) Coordination errors"] {
            assert!(all[1].svg.contains(text), "{text}");
        }
    }

    /// A fleet whose speed changes at 200 s, when its error is small already, and is thrown apart again.
    fn changing() -> Recording {
        let mut recording = fleet(true);
        recording.exact.push(Record::Speed(SpeedRow { t_ns: 200_000_000_000, speed: 0.6 }));
        for record in &mut recording.exact {
            let Record::State(row) = record else { continue };
            let since_s = row.t_ns as f64 / 1e9 - 200.0;
            if &*row.vehicle == "v1" && since_s >= 0.0 {
                row.xi += 5.0 * (-0.07 * since_s).exp();
            }
        }
        recording
    }

    /// The points of the line of this colour and dash in a picture, in its own units.
    fn ends_of(svg: &str, stroke: &str, dash: &str) -> Vec<f64> {
        let path = svg.split("<path").find(|path| path.contains(stroke) && path.contains(dash)).expect("the line");
        let drawn = path.split(" d=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("its points");
        let numbers = drawn.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
        numbers.filter_map(|number| number.parse().ok()).collect()
    }

    fn named(name: &str, recording: &Recording, facts: &Facts) -> Figure {
        figures(recording, facts).into_iter().find(|figure| figure.name == name).expect("drawn")
    }

    #[test]
    fn the_rate_in_the_figure_is_that_of_the_summary() {
        for recording in [fleet(true), changing()] {
            let fit = summarise(&recording, &facts(true)).fleet.coordination.fit.expect("decays");
            let drawn = named("rate", &recording, &facts(true));
            assert!(drawn.svg.contains(&format!("fitted: {} /s", number(fit.rate))), "{fit:?}");
            let part = format!("(dashed: fitted from {} s to {} s)", number(fit.from_s), number(fit.to_s));
            assert!(drawn.caption.contains(&part), "{part} / {}", drawn.caption);
        }
        let whole = Coordination::of(&tracks(&changing().exact, &facts(true)), &facts(true));
        let whole = fit_exponential(&whole.t_s, &whole.norm(), Some(10.0)).expect("decays");
        let fit = summarise(&changing(), &facts(true)).fleet.coordination.fit.expect("decays");
        assert!(number(whole.rate) != number(fit.rate) && fit.from_s > 200.0, "{whole:?} {fit:?}");
    }

    #[test]
    fn the_promise_is_drawn_from_the_last_change_of_speed_on() {
        let start = |recording: &Recording, guaranteed_factor| {
            let facts = Facts { guaranteed_factor, ..facts(true) };
            let drawn = named("rate", recording, &facts).svg;
            ends_of(&drawn, PLANNED, "stroke-dasharray")[0]
        };
        let (whole, changed) = (start(&fleet(true), Some(1.3)), start(&changing(), Some(1.3)));
        assert!(changed > whole + 100.0, "{whole} {changed}");
        // Without a factor there is no height to start from: the slope is laid where the fit begins.
        assert!(start(&changing(), None) > changed + 1.0, "{changed}");
    }

    #[test]
    fn what_was_not_recorded_is_not_drawn() {
        let lines = |recording: &Recording| {
            let all = figures(recording, &facts(true));
            let errors = &all.iter().find(|figure| figure.name == "errors").expect("drawn").svg;
            errors.matches("<path").count() + errors.matches("<polyline").count()
        };
        let (whole, mut away) = (fleet(true), fleet(true));
        // v2 is away in the middle: its own line and that of γ₁ − γ₂ are broken, and no other.
        let gap = |row: &Record| matches!(row, Record::State(row) if *row.vehicle == *"v2" && (4_000_000_000..20_000_000_000).contains(&row.t_ns));
        assert!(away.exact.iter().any(gap));
        away.exact.retain(|row| !gap(row));
        assert_eq!(lines(&away), lines(&whole) + 2);
    }

    #[test]
    fn an_empty_recording_and_a_large_fleet_can_be_drawn() {
        assert_eq!(figures(&Recording::default(), &Facts::default()).len(), 1);
        assert_eq!(figures(&Recording::default(), &facts(true)).len(), 2);
        let (mut many, mut recording) = (facts(false), Recording::default());
        many.vehicles =
            (0..50).map(|index| VehicleFacts { id: format!("v{index}"), ..VehicleFacts::default() }).collect();
        for (index, t_ns) in (0..50).zip([0, 100_000_000].into_iter().cycle()) {
            recording.exact.push(Record::State(state_row(t_ns, &format!("v{index}"), f64::from(index))));
        }
        assert_eq!(figures(&recording, &many).len(), 1);
    }

    #[test]
    fn the_same_run_gives_the_same_bytes() {
        assert!(figures(&fleet(false), &facts(false)) == figures(&fleet(false), &facts(false)));
        assert_eq!(
            renumbered("a kuva-clip-17 b kuva-clip-4 c kuva-clip-17", "run"),
            "a run-clip-0 b run-clip-1 c run-clip-0"
        );
    }
}
