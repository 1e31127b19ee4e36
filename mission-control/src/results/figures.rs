//! The figures of a run, in the arrangement of the thesis.
//!
//! | figure | panels | after |
//! |---|---|---|
//! | `run.svg` (planar) | (a) trajectories (b) speeds (c) coordination errors (d) cross-track errors | Figures 1.9, 3.7 |
//! | `trajectories.svg` (in space) | (a) from above (b) third coordinate over time | Figure 4.2 |
//! | `errors.svg` (in space) | (a) path-following errors (b) coordination errors, outages shaded | Figure 4.3 |
//! | `rate.svg` | the norm of the coordination error, logarithmic, with the fitted and the guaranteed rate | |
//!
//! Of a long series two samples per pixel column are drawn, its smallest and its largest, so that no peak is lost.

use std::fmt::Write as _;

use bus::recording::Recording;
use common::record::StateRow;
use kuva::backend::svg::SvgBackend;
use kuva::plot::annotations::ShadedRegion;
use kuva::plot::{LegendPosition, LinePlot, ScatterPlot};
use kuva::render::figure::Figure as Grid;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use super::Facts;
use super::network::Network;
use super::series::{Coordination, Track, tracks};
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

/// Colours of the paper, replaced by those of the page where a figure is shown inside one. No other element of a
/// figure has them.
pub(super) const PAPER: &str = "#fffffe";
/// Colour of text and axes.
pub(super) const INK: &str = "#1b1f24";
/// Colour of the grid.
pub(super) const GRID: &str = "#e6e8eb";

/// Series colours that are told apart by the colour-blind, on light and on dark paper (after Okabe and Ito).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31"];
const PLANNED: &str = "#9aa0a6";
const OUTAGE: &str = "#8a9099";

/// Samples of a drawn series.
const SAMPLES: usize = 600;
/// More series than this have no legend: it would hide them.
const LEGEND_LIMIT: usize = 8;
/// More outages than this are not shaded: they would be one grey area.
const OUTAGE_LIMIT: usize = 60;

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 360.0;

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

/// One panel under construction.
#[derive(Default)]
pub(super) struct Panel {
    pub(super) plots: Vec<Plot>,
    /// Every point that is drawn, to place the legend where there are few.
    pub(super) drawn: Vec<(f64, f64)>,
    /// Names in the legend.
    pub(super) names: Vec<String>,
}

impl Panel {
    pub(super) fn line(&mut self, points: Vec<(f64, f64)>, style: impl FnOnce(LinePlot) -> LinePlot) {
        self.drawn.extend(&points);
        self.plots.push(style(LinePlot::new().with_data(points)).into());
    }

    /// A line of its own colour with a name.
    fn series(&mut self, points: Vec<(f64, f64)>, index: usize, name: &str) {
        self.names.push(name.to_owned());
        self.line(points, |line| line.with_color(colour(index)).with_stroke_width(1.5).with_legend(name));
    }

    fn dot(&mut self, at: (f64, f64), colour: &str, size: f64) {
        self.plots.push(ScatterPlot::new().with_data([at]).with_color(colour).with_size(size).into());
    }

    pub(super) fn layout(&self, title: &str, x_label: &str, y_label: &str) -> Layout {
        let mut layout = Layout::auto_from_plots(&self.plots)
            .with_title(title)
            .with_x_label(x_label)
            .with_y_label(y_label)
            .with_x_label_offset(0.0, -6.0)
            .with_theme(theme())
            .with_box_axes()
            .with_legend_position(self.emptiest_corner())
            .with_title_size(15)
            .with_label_size(13)
            .with_tick_size(11)
            .with_body_size(12);
        // A legend of fifty names would hide what it explains.
        layout.show_legend = (2..=LEGEND_LIMIT).contains(&self.names.len());
        layout
    }

    /// The corner in which a legend hides the fewest points; the top right if there are several.
    fn emptiest_corner(&self) -> LegendPosition {
        let range = |value: fn(&(f64, f64)) -> f64| {
            let values = || self.drawn.iter().map(value);
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, right), (bottom, top)) = (range(|point| point.0), range(|point| point.1));
        let longest = self.names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as f64;
        let width = (0.13 + 0.016 * longest) * (right - left);
        let height = (0.1 + 0.07 * self.names.len() as f64) * (top - bottom);
        let corners = [
            (LegendPosition::InsideTopRight, right - width, right, top - height, top),
            (LegendPosition::InsideBottomRight, right - width, right, bottom, bottom + height),
            (LegendPosition::InsideTopLeft, left, left + width, top - height, top),
            (LegendPosition::InsideBottomLeft, left, left + width, bottom, bottom + height),
        ];
        let hidden = |corner: &(LegendPosition, f64, f64, f64, f64)| {
            let (_, left, right, bottom, top) = corner;
            self.drawn.iter().filter(|(x, y)| (*left..=*right).contains(x) && (*bottom..=*top).contains(y)).count()
        };
        corners.iter().min_by_key(|corner| hidden(corner)).map_or(LegendPosition::InsideTopRight, |corner| corner.0)
    }
}

/// A panel that can be drawn.
type Drawing = (Vec<Plot>, Layout);

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
        panel.series(extremes(points), 0, "measured");
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
            let name = format!("guaranteed: {rate:.3} /s");
            panel.names.push(name.clone());
            panel.line(vec![value(start), value(until)], |line| {
                line.with_color(PLANNED).with_stroke_width(1.8).with_dotted().with_legend(name)
            });
        }
        let unit = if self.facts.xi_unit.is_empty() { String::new() } else { format!(" [{}]", self.facts.xi_unit) };
        let layout = panel.layout("Decay of the coordination error", "time [s]", &format!("‖x − mean(x)‖{unit}"));
        let layout = self.time_axis(layout).with_log_y().with_legend_position(LegendPosition::InsideTopRight);
        let caption = "Norm of the coordination error on a logarithmic scale: a straight line is an exponential.";
        Some(Figure { name: "rate", caption: caption.into(), svg: render("rate", 1, 1, vec![(panel.plots, layout)]) })
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
            let kept = thinned(track.rows.len(), SAMPLES);
            let points: Vec<(f64, f64)> = kept.iter().map(|at| (track.rows[*at].x_m, track.rows[*at].y_m)).collect();
            let Some((start, end)) = points.first().copied().zip(points.last().copied()) else { continue };
            panel.series(points, index, track.id);
            panel.dot(start, colour(index), 4.5);
            panel.dot(start, PAPER, 2.5);
            panel.dot(end, colour(index), 4.5);
        }
        let layout = panel.layout(title, "x [m]", "y [m]").with_equal_aspect();
        (panel.plots, layout)
    }

    fn over_time(&self, title: &str, label: &str, value: impl Fn(&StateRow) -> f64) -> Drawing {
        let mut panel = Panel::default();
        for (index, track) in self.tracks.iter().enumerate() {
            let points = extremes(track.rows.iter().map(|row| (row.t_ns as f64 / 1e9, value(row))).collect());
            panel.series(points, index, track.id);
        }
        let layout = self.time_axis(panel.layout(title, "time [s]", label));
        (panel.plots, layout)
    }

    fn coordination_errors(&self, title: &str) -> Drawing {
        let (symbol, t_s) = (self.facts.symbol(), &self.coordination.t_s);
        let mut panel = Panel::default();
        let (first, others) = match self.coordination.states.split_first() {
            Some((first, others)) => (first.as_slice(), others),
            None => (&[][..], &[][..]),
        };
        for (index, other) in others.iter().enumerate() {
            let points = extremes(t_s.iter().zip(first.iter().zip(other)).map(|(t, (a, b))| (*t, a - b)).collect());
            panel.series(points, index + 1, &format!("{symbol}₁ − {symbol}{}", subscript(index + 2)));
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
        (panel.plots, layout)
    }

    fn time_axis(&self, layout: Layout) -> Layout {
        if self.facts.duration_s > 0.0 {
            layout.with_x_axis_min(0.0).with_x_axis_max(self.facts.duration_s)
        } else {
            layout
        }
    }
}

pub(super) fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

fn subscript(number: usize) -> String {
    number.to_string().chars().filter_map(|digit| char::from_u32('₀' as u32 + digit.to_digit(10)?)).collect()
}

fn theme() -> Theme {
    Theme {
        background: PAPER.into(),
        axis_color: INK.into(),
        grid_color: GRID.into(),
        tick_color: INK.into(),
        text_color: INK.into(),
        legend_bg: PAPER.into(),
        legend_border: GRID.into(),
        font_family: Some("Helvetica, Arial, DejaVu Sans, sans-serif".into()),
        ..Theme::light()
    }
}

pub(super) fn render(name: &str, rows: usize, columns: usize, panels: Vec<Drawing>) -> String {
    let (plots, layouts) = panels.into_iter().unzip();
    let width = if columns == 1 { 1.6 * WIDTH } else { WIDTH };
    let grid = Grid::new(rows, columns).with_plots(plots).with_layouts(layouts).with_cell_size(width, HEIGHT);
    renumbered(&SvgBackend::new().render_scene(&grid.render()), name)
}

/// The library numbers the clip paths of a whole process. Here they are numbered within the figure, so that the same
/// run gives the same bytes, and named after it, so that figures can share a page.
fn renumbered(svg: &str, name: &str) -> String {
    const CLIP: &str = "kuva-clip-";
    let mut numbers: Vec<&str> = Vec::new();
    let mut parts = svg.split(CLIP);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (number, rest) = part.split_at(part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len()));
        let index = numbers.iter().position(|known| *known == number).unwrap_or_else(|| {
            numbers.push(number);
            numbers.len() - 1
        });
        let _ = write!(text, "{name}-clip-{index}{rest}");
    }
    text
}

/// Smallest and largest sample of each of some hundred stretches of a series, in order of time.
fn extremes(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= SAMPLES {
        return points;
    }
    let stretches = SAMPLES / 2;
    let mut kept = Vec::with_capacity(SAMPLES + 2);
    kept.push(points[0]);
    for stretch in 0..stretches {
        let part = &points[points.len() * stretch / stretches..points.len() * (stretch + 1) / stretches];
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (Some(low), Some(high)) = (part.iter().min_by(by_value), part.iter().max_by(by_value)) else { continue };
        let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
        kept.extend([*first, *second]);
    }
    kept.extend(points.last());
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::VehicleFacts;
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

    #[test]
    fn a_legend_goes_where_the_lines_are_not() {
        let mut panel = Panel::default();
        panel.series((0..100).map(|step| (f64::from(step), f64::from(step))).collect(), 0, "rising");
        assert!(matches!(panel.emptiest_corner(), LegendPosition::InsideBottomRight));
        let mut panel = Panel::default();
        panel.series((0..100).map(|step| (f64::from(step), -f64::from(step))).collect(), 0, "falling");
        assert!(matches!(panel.emptiest_corner(), LegendPosition::InsideTopRight));
    }

    #[test]
    fn no_peak_is_lost_by_thinning() {
        let mut points: Vec<(f64, f64)> = (0..10_000).map(|step| (f64::from(step), 0.0)).collect();
        points[4321].1 = 5.0;
        let kept = extremes(points);
        assert!(kept.len() <= SAMPLES + 2 && kept.contains(&(4321.0, 5.0)));
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn subscripts_have_all_digits() {
        assert_eq!(subscript(120), "₁₂₀");
    }
}
