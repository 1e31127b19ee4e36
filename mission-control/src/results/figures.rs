//! The figures of a run, in the arrangement of the thesis.
//!
//! | figure | panels | after |
//! |---|---|---|
//! | `run.svg` (planar) | (a) trajectories (b) speeds (c) coordination errors (d) cross-track errors | Figures 1.9, 3.7 |
//! | `trajectories.svg` (in space) | (a) from above (b) depth over time | Figure 4.2 |
//! | `errors.svg` (in space) | (a) path-following errors (b) coordination errors, outages shaded | Figure 4.3 |
//!
//! Of a long series two samples per pixel column are drawn, its smallest and its largest, so that no peak is lost.

use bus::recording::Recording;
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
    if facts.spatial { view.spatial() } else { view.planar() }
}

/// What the panels draw from.
struct View<'a> {
    facts: &'a Facts,
    tracks: Vec<Track<'a>>,
    coordination: Coordination,
    outages: Vec<(f64, f64)>,
}

/// One panel: its series and its layout.
type Panel = (Vec<Plot>, Layout);

impl View<'_> {
    fn planar(&self) -> Vec<Figure> {
        let panels = vec![
            self.from_above("(a) Trajectories"),
            self.over_time("(b) Speeds", "speed [m/s]", |row| row.speed_mps),
            self.coordination_errors("(c) Coordination errors"),
            self.over_time("(d) Cross-track errors", "cross-track error [m]", |row| row.e_cross_m),
        ];
        let caption = format!("Trajectories, speeds, coordination errors{} and cross-track errors.", self.remark());
        vec![Figure { name: "run", caption, svg: render(2, 2, panels) }]
    }

    fn spatial(&self) -> Vec<Figure> {
        let trajectories = vec![
            self.from_above("(a) Trajectories from above"),
            self.over_time("(b) Height along z", "z [m]", |row| row.z_m),
        ];
        let (plots, layout) = self.over_time("(a) Path-following errors", "‖e‖ [m]", |row| row.e_norm_m);
        let errors = vec![(plots, layout.with_y_axis_min(0.0)), self.coordination_errors("(b) Coordination errors")];
        vec![
            Figure {
                name: "trajectories",
                caption: "Trajectories from above, and the third coordinate over time.".into(),
                svg: render(1, 2, trajectories),
            },
            Figure {
                name: "errors",
                caption: format!("Norms of the path-following errors, and coordination errors{}.", self.remark()),
                svg: render(2, 1, errors),
            },
        ]
    }

    /// What the caption has to say about the panel of the coordination errors.
    fn remark(&self) -> String {
        let mut remarks = Vec::new();
        if self.has_pattern() {
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

    fn has_pattern(&self) -> bool {
        self.tracks.iter().any(|track| track.pattern_offset != 0.0)
    }

    fn shades_outages(&self) -> bool {
        (1..=OUTAGE_LIMIT).contains(&self.outages.len())
    }

    /// Rate and height at t = 0 of the bound on |ξ_1 − ξ_j| ≤ √2·c·exp(−rate·t)·‖e(0)‖.
    fn envelope(&self) -> Option<(f64, f64)> {
        let first = *self.coordination.norm().first()?;
        let height = std::f64::consts::SQRT_2 * self.facts.guaranteed_factor? * first;
        Some((self.facts.guaranteed_rate?, height)).filter(|_| height > 0.0)
    }

    fn from_above(&self, title: &str) -> Panel {
        let mut plots: Vec<Plot> = Vec::new();
        for vehicle in &self.facts.vehicles {
            let points = vehicle.planned.iter().map(|[x, y, _]| (*x, *y)).collect();
            plots.push(line(points, PLANNED, 1.0).with_dashed().into());
        }
        for (index, track) in self.tracks.iter().enumerate() {
            let kept = thinned(track.rows.len(), SAMPLES);
            let points: Vec<(f64, f64)> = kept.iter().map(|at| (track.rows[*at].x_m, track.rows[*at].y_m)).collect();
            let Some((start, end)) = points.first().copied().zip(points.last().copied()) else { continue };
            plots.push(self.legend(line(points, colour(index), 1.6), track.id).into());
            plots.push(ScatterPlot::new().with_data([start]).with_color(PAPER).with_size(4.5).into());
            plots.push(ScatterPlot::new().with_data([start]).with_color(colour(index)).with_size(2.6).into());
            plots.push(ScatterPlot::new().with_data([end]).with_color(colour(index)).with_size(4.5).into());
        }
        let layout = layout(&plots, title, "x [m]", "y [m]").with_equal_aspect();
        (plots, layout)
    }

    fn over_time(&self, title: &str, label: &str, value: impl Fn(&common::record::StateRow) -> f64) -> Panel {
        let mut plots: Vec<Plot> = Vec::new();
        for (index, track) in self.tracks.iter().enumerate() {
            let points = extremes(track.rows.iter().map(|row| (row.t_ns as f64 / 1e9, value(row))).collect());
            plots.push(self.legend(line(points, colour(index), 1.4), track.id).into());
        }
        let layout = self.time_axis(layout(&plots, title, "time [s]", label));
        (plots, layout)
    }

    fn coordination_errors(&self, title: &str) -> Panel {
        let (symbol, t_s) = (self.facts.symbol(), &self.coordination.t_s);
        let mut plots: Vec<Plot> = Vec::new();
        let (first, others) = match self.coordination.states.split_first() {
            Some((first, others)) => (first.as_slice(), others),
            None => (&[][..], &[][..]),
        };
        for (index, other) in others.iter().enumerate() {
            let points = extremes(t_s.iter().zip(first.iter().zip(other)).map(|(t, (a, b))| (*t, a - b)).collect());
            let name = format!("{symbol}₁ − {symbol}{}", subscript(index + 2));
            plots.push(self.legend(line(points, colour(index + 1), 1.4), &name).into());
        }
        if let Some((rate, height)) = self.envelope() {
            for sign in [1.0, -1.0] {
                let at = |step: u32| self.facts.duration_s * f64::from(step) / 200.0;
                let points = (0..=200).map(|step| (at(step), sign * height * (-rate * at(step)).exp())).collect();
                plots.push(line(points, PLANNED, 1.2).with_dotted().into());
            }
        }
        let unit = if self.facts.xi_unit.is_empty() { String::new() } else { format!(" [{}]", self.facts.xi_unit) };
        let label = format!("{symbol}₁ − {symbol}ⱼ{unit}");
        let mut layout = self.time_axis(layout(&plots, title, "time [s]", &label));
        if self.shades_outages() {
            for (from, to) in &self.outages {
                layout =
                    layout.with_shaded_region(ShadedRegion::vertical(*from, *to).with_color(OUTAGE).with_opacity(0.18));
            }
        }
        (plots, layout)
    }

    fn legend(&self, line: LinePlot, name: &str) -> LinePlot {
        if self.tracks.len() <= LEGEND_LIMIT { line.with_legend(name) } else { line }
    }

    fn time_axis(&self, layout: Layout) -> Layout {
        if self.facts.duration_s > 0.0 {
            layout.with_x_axis_min(0.0).with_x_axis_max(self.facts.duration_s)
        } else {
            layout
        }
    }
}

fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

fn line(points: Vec<(f64, f64)>, colour: &str, width: f64) -> LinePlot {
    LinePlot::new().with_data(points).with_color(colour).with_stroke_width(width)
}

fn subscript(number: usize) -> String {
    number.to_string().chars().filter_map(|digit| char::from_u32('₀' as u32 + digit.to_digit(10)?)).collect()
}

fn layout(plots: &[Plot], title: &str, x_label: &str, y_label: &str) -> Layout {
    Layout::auto_from_plots(plots)
        .with_title(title)
        .with_x_label(x_label)
        .with_y_label(y_label)
        .with_theme(theme())
        .with_box_axes()
        .with_legend_position(LegendPosition::InsideTopRight)
        .with_title_size(15)
        .with_label_size(13)
        .with_tick_size(11)
        .with_body_size(12)
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

fn render(rows: usize, columns: usize, panels: Vec<Panel>) -> String {
    let (plots, layouts) = panels.into_iter().unzip();
    let width = if columns == 1 { 1.6 * WIDTH } else { WIDTH };
    let grid = Grid::new(rows, columns).with_plots(plots).with_layouts(layouts).with_cell_size(width, HEIGHT);
    SvgBackend::new().render_scene(&grid.render())
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
    use crate::results::testing::{facts, fleet};

    #[test]
    fn planar_and_spatial_fleets_have_the_figures_of_the_thesis() {
        let names = |spatial| figures(&fleet(spatial), &facts(spatial)).into_iter().map(|f| f.name).collect::<Vec<_>>();
        assert_eq!(names(false), ["run"]);
        assert_eq!(names(true), ["trajectories", "errors"]);
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
        let mut many = facts(false);
        many.vehicles = vec![many.vehicles[0].clone(); 50];
        assert_eq!(figures(&fleet(false), &many).len(), 1);
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
