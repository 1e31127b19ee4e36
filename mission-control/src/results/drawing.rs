//! What all pictures are made of: panels of lines in one style, put side by side into an SVG.
//!
//! Of a long series two samples per pixel column are drawn, its smallest and its largest, so that no peak is lost.

use std::fmt::Write as _;

use kuva::backend::svg::SvgBackend;
use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::figure::Figure as Grid;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use super::legend::fitted;

/// Colours of the paper, replaced by those of the page where a figure is shown inside one. No other element of a
/// figure has them.
pub(crate) const PAPER: &str = "#fffffe";
/// Colour of text and axes.
pub(crate) const INK: &str = "#1b1f24";
/// Colour of the grid.
pub(crate) const GRID: &str = "#e6e8eb";

/// Series colours that are told apart by the colour-blind, on light and on dark paper (after Okabe and Ito).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31"];
/// Colour of what was planned or promised.
pub(crate) const PLANNED: &str = "#9aa0a6";
/// Colour of the time in which no link was up.
pub(crate) const OUTAGE: &str = "#8a9099";

/// Samples of a drawn series.
pub(crate) const SAMPLES: usize = 600;
/// More series than this have no legend: it would hide them.
const LEGEND_LIMIT: usize = 8;
/// More outages than this are not shaded: they would be one grey area.
pub(crate) const OUTAGE_LIMIT: usize = 60;

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 360.0;

/// No axis can hold greater values: the length of an axis, with room at its ends, must be a number too.
const GREATEST: f64 = 1e300;

/// Whether a point has a place on an axis.
pub(crate) fn can_be_drawn((x, y): &(f64, f64)) -> bool {
    x.abs() < GREATEST && y.abs() < GREATEST
}

/// One panel under construction.
#[derive(Default)]
pub(crate) struct Panel {
    pub(crate) plots: Vec<Plot>,
    /// Every curve that is drawn, to place the legend where there is none.
    pub(crate) drawn: Vec<Vec<(f64, f64)>>,
    /// Names in the legend.
    pub(crate) names: Vec<String>,
}

impl Panel {
    /// A line through those of the points that can be drawn.
    pub(crate) fn line(&mut self, mut points: Vec<(f64, f64)>, style: impl FnOnce(LinePlot) -> LinePlot) {
        points.retain(can_be_drawn);
        self.drawn.push(points.clone());
        self.plots.push(style(LinePlot::new().with_data(points)).into());
    }

    /// A line of its own colour with a name.
    pub(crate) fn series(&mut self, points: Vec<(f64, f64)>, index: usize, name: &str) {
        self.names.push(name.to_owned());
        self.line(points, |line| line.with_color(colour(index)).with_stroke_width(1.5).with_legend(name));
    }

    pub(crate) fn dot(&mut self, at: (f64, f64), colour: &str, size: f64) {
        let drawn = Some(at).filter(can_be_drawn);
        self.plots.push(ScatterPlot::new().with_data(drawn).with_color(colour).with_size(size).into());
    }

    pub(crate) fn layout(&self, title: &str, x_label: &str, y_label: &str) -> Layout {
        let mut layout = Layout::auto_from_plots(&self.plots)
            .with_title(title)
            .with_x_label(x_label)
            .with_y_label(y_label)
            .with_x_label_offset(0.0, -6.0)
            .with_theme(theme())
            .with_box_axes()
            .with_title_size(15)
            .with_label_size(13)
            .with_tick_size(11)
            .with_body_size(12);
        // A legend of fifty names would hide what it explains.
        layout.show_legend = (2..=LEGEND_LIMIT).contains(&self.names.len());
        layout
    }

    /// The panel with its layout, ready to be drawn.
    pub(crate) fn laid_out(self, layout: Layout) -> Drawing {
        Drawing { plots: self.plots, layout, curves: self.drawn, entries: self.names.len() }
    }
}

/// A panel that can be drawn.
pub(crate) struct Drawing {
    plots: Vec<Plot>,
    layout: Layout,
    curves: Vec<Vec<(f64, f64)>>,
    entries: usize,
}

/// Colour of series number `index`.
pub(crate) fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// A number as subscript.
pub(crate) fn subscript(number: usize) -> String {
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

/// Panels in rows and columns as an SVG; `name` must differ from that of any other figure on the same page.
pub(crate) fn render(name: &str, rows: usize, columns: usize, panels: Vec<Drawing>) -> String {
    let width = if columns == 1 { 1.6 * WIDTH } else { WIDTH };
    let fit = |panel: Drawing| {
        let layout = fitted(panel.layout, &panel.curves, panel.entries, (width, HEIGHT));
        (panel.plots, layout)
    };
    let (plots, layouts) = panels.into_iter().map(fit).unzip();
    let grid = Grid::new(rows, columns).with_plots(plots).with_layouts(layouts).with_cell_size(width, HEIGHT);
    renumbered(&SvgBackend::new().render_scene(&grid.render()), name)
}

/// The library numbers the clip paths of a whole process. Here they are numbered within the figure, so that the same
/// run gives the same bytes, and named after it, so that figures can share a page.
pub(crate) fn renumbered(svg: &str, name: &str) -> String {
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
pub(crate) fn extremes(points: Vec<(f64, f64)>, samples: usize) -> Vec<(f64, f64)> {
    if points.len() <= samples {
        return points;
    }
    let stretches = (samples / 2).max(1);
    let mut kept = Vec::with_capacity(samples + 2);
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

    #[test]
    fn no_peak_is_lost_by_thinning() {
        let mut points: Vec<(f64, f64)> = (0..10_000).map(|step| (f64::from(step), 0.0)).collect();
        points[4321].1 = 5.0;
        let kept = extremes(points, SAMPLES);
        assert!(kept.len() <= SAMPLES + 2 && kept.contains(&(4321.0, 5.0)));
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn subscripts_have_all_digits() {
        assert_eq!(subscript(120), "₁₂₀");
    }
}
