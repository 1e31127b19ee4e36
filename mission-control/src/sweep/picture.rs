//! Pictures of a sweep: a heat map of two swept keys, or a curve with its band of one; and a measure over another for several
//! sweeps.

use kuva::plot::{ColorMap, Heatmap, LinePlot, ScatterPlot};
use kuva::render::layout::Layout;

use super::cells::{CellStatistics, Spread};
use super::measure::MEASURES;
use super::parquet::number;
use super::plan::Plan;
use super::setting::{Setting, shown};
use crate::results::drawing::{Drawing, Panel, colour, render};

/// From this ratio of the largest to the smallest value on, an axis is logarithmic.
const DECADES: f64 = 100.0;

/// The picture of a sweep, if one or two keys are swept.
pub fn picture(plan: &Plan, cells: &[CellStatistics], measure: usize, name: &str) -> Option<String> {
    let drawing = match plan.settings.iter().filter(|setting| setting.values.len() > 1).count() {
        1 => curve(plan, cells, measure)?,
        2 => heat_map(plan, cells, measure)?,
        _ => return None,
    };
    Some(render(name, 1, 1, vec![drawing]))
}

fn swept(plan: &Plan) -> impl Iterator<Item = &Setting> {
    plan.settings.iter().filter(|setting| setting.values.len() > 1)
}

fn about(measure: usize) -> &'static str {
    MEASURES[measure].about
}

/// Whether values are better seen on a logarithmic axis.
fn is_wide(values: impl Iterator<Item = f64> + Clone) -> bool {
    let (low, high) = (values.clone().fold(f64::INFINITY, f64::min), values.fold(0.0, f64::max));
    low > 0.0 && high / low >= DECADES
}

fn curve(plan: &Plan, cells: &[CellStatistics], measure: usize) -> Option<Drawing> {
    let setting = swept(plan).next()?;
    let points: Vec<(f64, Spread)> = setting
        .values
        .iter()
        .zip(cells)
        .enumerate()
        .filter_map(|(place, (value, cell))| Some((number(value).unwrap_or(place as f64), cell.spreads[measure]?)))
        .collect();
    if points.is_empty() {
        return None;
    }
    let mut panel = Panel::default();
    band(&mut panel, &points, 0, "median, 5 to 95 %");
    let layout = panel.layout(&plan.mission.name, &setting.key, about(measure));
    Some((panel.plots, logarithmic(layout, &points)))
}

fn logarithmic(layout: Layout, points: &[(f64, Spread)]) -> Layout {
    if is_wide(points.iter().flat_map(|(_, s)| [s.low, s.high])) { layout.with_log_y() } else { layout }
}

/// A line through medians, with the band in which nine in ten runs are.
fn band(panel: &mut Panel, points: &[(f64, Spread)], index: usize, name: &str) {
    panel.names.push(name.to_owned());
    panel.line(points.iter().map(|(x, spread)| (*x, spread.median)).collect(), |line: LinePlot| {
        line.with_color(colour(index))
            .with_stroke_width(1.8)
            .with_band(points.iter().map(|(_, s)| s.low), points.iter().map(|(_, s)| s.high))
            .with_legend(name)
    });
    let dots = ScatterPlot::new().with_data(points.iter().map(|(x, s)| (*x, s.median)).collect::<Vec<_>>());
    panel.plots.push(dots.with_color(colour(index)).with_size(3.5).into());
}

fn heat_map(plan: &Plan, cells: &[CellStatistics], measure: usize) -> Option<Drawing> {
    let mut both = swept(plan);
    let (down, across) = (both.next()?, both.next()?);
    let medians = || cells.iter().filter_map(|cell| Some(cell.spreads[measure]?.median));
    let wide = is_wide(medians());
    let lowest = medians().fold(f64::INFINITY, f64::min);
    if !lowest.is_finite() {
        return None;
    }
    let shade = |cell: &CellStatistics| {
        let median = cell.spreads[measure].map_or(lowest, |spread| spread.median);
        if wide { median.log10() } else { median }
    };
    // Rows are drawn from the bottom up, as an axis goes.
    let columns = across.values.len();
    let data: Vec<Vec<f64>> = cells.chunks(columns).map(|row| row.iter().map(shade).collect()).collect();
    let names = |setting: &Setting| setting.values.iter().map(shown).collect::<Vec<String>>();
    let legend = if wide { "log₁₀" } else { "" };
    let map = Heatmap::new().with_data(data).with_color_map(ColorMap::Viridis).with_legend(legend);
    let plots = vec![map.into()];
    let title = format!("{}{}", if wide { "log₁₀ of the " } else { "" }, about(measure));
    let mut panel = Panel { plots, ..Panel::default() };
    let layout =
        panel.layout(&title, &across.key, &down.key).with_x_categories(names(across)).with_y_categories(names(down));
    Some((std::mem::take(&mut panel.plots), layout))
}

/// One measure over another, a line for every sweep: the medians of its cells, with the band of the measure upwards.
pub fn against(sweeps: &[(&str, &[CellStatistics])], measure: usize, over: usize, name: &str) -> Option<String> {
    let mut panel = Panel::default();
    let mut all = Vec::new();
    for (index, (label, cells)) in sweeps.iter().enumerate() {
        let mut points: Vec<(f64, Spread)> =
            cells.iter().filter_map(|cell| Some((cell.spreads[over]?.median, cell.spreads[measure]?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !points.is_empty() {
            band(&mut panel, &points, index, label);
            all.extend(points);
        }
    }
    if all.is_empty() {
        return None;
    }
    let mut layout = logarithmic(panel.layout("", about(over), about(measure)), &all);
    if is_wide(all.iter().map(|(x, _)| *x)) {
        layout = layout.with_log_x();
    }
    Some(render(name, 1, 1, vec![(panel.plots, layout)]))
}
