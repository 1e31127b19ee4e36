//! The figures of a run, in the arrangement of the thesis.
//!
//! | figure | panels | after |
//! |---|---|---|
//! | `run.svg` (planar) | (a) trajectories (b) speeds (c) coordination errors (d) cross-track errors | Figures 1.9, 3.7 |
//! | `trajectories.svg` (in space) | (a) from above (b) third coordinate over time | Figure 4.2 |
//! | `errors.svg` (in space) | (a) path-following errors (b) coordination errors, outages shaded | Figure 4.3 |
//! | `rate.svg` | the norm of the coordination error, logarithmic, with the fitted and the guaranteed rate | |

use std::ops::Range;

use bus::recording::Recording;
use common::record::StateRow;
use kuva::plot::annotations::ShadedRegion;
use kuva::render::layout::Layout;

use super::Facts;
use super::drawing::{
    Drawing, OUTAGE, OUTAGE_LIMIT, PAPER, PLANNED, Panel, SAMPLES, colour, extremes, render, subscript,
};
use super::network::Network;
use super::series::{Coordination, Track, tracks, unbroken};
use super::statistics::fit_exponential;
use super::summary::thinned;

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
    let outages = Network::of(&recording.exact, facts).blackouts();
    let view = View { facts, tracks, coordination, outages };
    let mut figures = if facts.spatial { view.spatial() } else { view.planar() };
    figures.extend(view.rate());
    figures
}

/// What the panels draw from.
struct View<'a> {
    facts: &'a Facts,
    tracks: Vec<Track<'a>>,
    coordination: Coordination,
    outages: Vec<(f64, f64)>,
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
        let (start, height) = points[0];
        let end = points[points.len() - 1].0;
        let lowest = points.iter().fold(f64::INFINITY, |low, point| low.min(point.1));
        let mut panel = Panel::default();
        let parts = unbroken(t_s, self.facts)
            .into_iter()
            .map(|part| part.map(|at| (t_s[at], norm[at])).filter(|point| point.1 > 0.0).collect());
        broken(&mut panel, parts.collect(), 0, "measured");
        let fit = fit_exponential(t_s, &norm, self.facts.link_period_s);
        if let Some(fit) = fit {
            let at = t_s.partition_point(|time| *time < fit.from_s).min(norm.len() - 1);
            let value = |time: f64| (time, norm[at] * (-fit.rate * (time - fit.from_s)).exp());
            let name = format!("fitted: {:.3} /s", fit.rate);
            panel.names.push(name.clone());
            panel.line(vec![value(fit.from_s), value(fit.to_s)], |line| {
                line.with_color(colour(1)).with_stroke_width(1.8).with_dashed().with_legend(name)
            });
        }
        if let Some(rate) = self.facts.guaranteed_rate.filter(|rate| *rate > 0.0) {
            let factor = self.facts.guaranteed_factor.unwrap_or(1.0);
            // Not further down than the measurement goes: the axis is for what was measured.
            let until = end.min(start + (factor * height / lowest).ln() / rate);
            let value = |time: f64| (time, factor * height * (-rate * (time - start)).exp());
            let name =
                if rate < 0.01 { format!("guaranteed: {rate:.5} /s") } else { format!("guaranteed: {rate:.3} /s") };
            panel.names.push(name.clone());
            panel.line(vec![value(start), value(until)], |line| {
                line.with_color(PLANNED).with_stroke_width(1.8).with_dotted().with_legend(name)
            });
        }
        let unit = if self.facts.xi_unit.is_empty() { String::new() } else { format!(" [{}]", self.facts.xi_unit) };
        let layout = panel.layout("Decay of the coordination error", "time [s]", &format!("‖x − mean(x)‖{unit}"));
        let layout = self.time_axis(layout).with_log_y();
        let caption = "Norm of the coordination error on a logarithmic scale: a straight line is an exponential.";
        Some(Figure { name: "rate", caption: caption.into(), svg: render("rate", 1, 1, vec![panel.laid_out(layout)]) })
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

    /// Rate and height at t = 0 of the bound on |x_1 − x_j| ≤ √2·c·exp(−rate·t)·‖e(0)‖.
    fn envelope(&self) -> Option<(f64, f64)> {
        let first = *self.coordination.norm().first()?;
        let height = std::f64::consts::SQRT_2 * self.facts.guaranteed_factor? * first;
        Some((self.facts.guaranteed_rate?, height)).filter(|_| height > 0.0)
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
        if let Some((rate, height)) = self.envelope() {
            for sign in [1.0, -1.0] {
                let at = |step: u32| self.facts.duration_s * f64::from(step) / 200.0;
                let points = (0..=200).map(|step| (at(step), sign * height * (-rate * at(step)).exp())).collect();
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

/// A line with gaps: what was not recorded is not drawn. What is no number cannot be drawn either.
fn broken(panel: &mut Panel, parts: Vec<Vec<(f64, f64)>>, index: usize, name: &str) {
    let total = parts.iter().map(Vec::len).sum();
    for (number, points) in parts.into_iter().enumerate() {
        let samples = share(SAMPLES, points.len(), total);
        let finite = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
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
    use common::record::Record;

    #[test]
    fn planar_and_spatial_fleets_have_the_figures_of_the_thesis() {
        let names = |spatial| figures(&fleet(spatial), &facts(spatial)).into_iter().map(|f| f.name).collect::<Vec<_>>();
        assert_eq!(names(false), ["run", "rate"]);
        assert_eq!(names(true), ["trajectories", "errors", "rate"]);
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
