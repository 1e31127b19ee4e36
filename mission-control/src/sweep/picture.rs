//! Pictures of a sweep: a curve with its band for one swept key, a heat map for two, several heat maps for three; and a measure over
//! another for several sweeps.

use std::sync::Arc;

use kuva::plot::{ColorMap, Heatmap, LinePlot, ScatterPlot};
use kuva::render::layout::{Layout, TickFormat};

use super::cells::{CellStatistics, Spread};
use super::measure::MEASURES;
use super::page::to_digits;
use super::parquet::number;
use super::plan::Plan;
use super::setting::{Setting, labels};
use crate::results::drawing::{Drawing, PLANNED, Panel, colour, render};

/// From this ratio of the largest to the smallest value on, an axis or a scale of colours is logarithmic.
const WIDE: f64 = 6.0;
/// Most heat maps side by side in one picture, and in a row.
const MOST_MAPS: usize = 9;
const MAPS_IN_A_ROW: usize = 3;
/// Colour of a cell without a value.
const BLANK: &str = "#f1f2f3";

/// What a dot with its band, or its bar, is; fewer than six runs have no interval.
fn legend(points: &[(f64, Spread)]) -> &'static str {
    match points.iter().filter(|(_, spread)| spread.sure.is_some()).count() {
        0 => "median",
        all if all == points.len() => "median, and its 95 % interval",
        _ => "median, and its 95 % interval where there are six runs or more",
    }
}

/// The picture of a sweep, if one, two or three keys are swept: a curve, a heat map, or a heat map for every value of the first
/// key.
pub fn picture(plan: &Plan, cells: &[CellStatistics], measure: usize, name: &str) -> Option<String> {
    let keys: Vec<&Setting> = swept(plan).collect();
    match keys[..] {
        [_] => Some(render(name, 1, 1, vec![curve(plan, cells, measure)?])),
        [down, across] => {
            let scale = Scale::of(cells, measure)?;
            Some(render(name, 1, 1, vec![heat_map(cells, measure, [down, across], scale, &title(measure, None))]))
        }
        [first, down, across] if first.values.len() <= MOST_MAPS => {
            let scale = Scale::of(cells, measure)?;
            let each = cells.chunks(down.values.len() * across.values.len());
            let maps = labels(&first.values).into_iter().zip(each).map(|(value, cells)| {
                heat_map(cells, measure, [down, across], scale, &title(measure, Some((&first.key, &value))))
            });
            let maps: Vec<Drawing> = maps.collect();
            let columns = maps.len().min(MAPS_IN_A_ROW);
            Some(render(name, maps.len().div_ceil(columns), columns, maps))
        }
        _ => None,
    }
}

fn title(measure: usize, of: Option<(&str, &str)>) -> String {
    match of {
        // The whole path would not fit above a map.
        Some((key, value)) => {
            format!("{}, {} = {value}", about(measure), key.rsplit('.').next().unwrap_or(key))
        }
        None => about(measure).into(),
    }
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
    low > 0.0 && high / low >= WIDE
}

fn curve(plan: &Plan, cells: &[CellStatistics], measure: usize) -> Option<Drawing> {
    let setting = swept(plan).next()?;
    let numbers: Option<Vec<f64>> = setting.values.iter().map(number).collect();
    // Words stand at 1, 2, ...
    let places = numbers.clone().unwrap_or_else(|| (1..=setting.values.len()).map(|place| place as f64).collect());
    let points: Vec<(f64, Spread)> =
        places.into_iter().zip(cells).filter_map(|(place, cell)| Some((place, cell.spreads[measure]?))).collect();
    if points.is_empty() {
        return None;
    }
    let mut panel = Panel::default();
    match &numbers {
        Some(_) => band(&mut panel, &points, 0, legend(&points)),
        None => intervals(&mut panel, &points),
    }
    // The axes follow from what is on the panel.
    let layout = panel.layout(&plan.mission.name, &setting.key, about(measure)).with_subtitle(legend(&points));
    if numbers.is_some() {
        return Some(panel.laid_out(logarithmic(layout, &points)));
    }
    let words = labels(&setting.values);
    let layout = logarithmic_upwards(layout, &points).with_x_axis_min(0.5).with_x_axis_max(words.len() as f64 + 0.5);
    Some(panel.laid_out(layout.with_x_categories(words)))
}

/// Medians with the bars of their confidence intervals: between words there is nothing that a line could show.
fn intervals(panel: &mut Panel, points: &[(f64, Spread)]) {
    let bars = points.iter().map(|(_, spread)| {
        let (low, high) = sure(spread);
        (spread.median - low, high - spread.median)
    });
    let dots = ScatterPlot::new()
        .with_data(points.iter().map(|(x, spread)| (*x, spread.median)).collect::<Vec<_>>())
        .with_y_err_asymmetric(bars)
        .with_color(colour(0))
        .with_size(4.5);
    panel.plots.push(dots.into());
}

fn logarithmic_upwards(layout: Layout, points: &[(f64, Spread)]) -> Layout {
    let bounds = points.iter().flat_map(|(_, spread)| <[f64; 2]>::from(sure(spread)));
    if is_wide(bounds) { layout.with_log_y() } else { layout }
}

fn logarithmic(layout: Layout, points: &[(f64, Spread)]) -> Layout {
    let layout = logarithmic_upwards(layout, points);
    if is_wide(points.iter().map(|(x, _)| *x)) { layout.with_log_x() } else { layout }
}

/// The interval of a median; the median alone if there are too few runs for one.
fn sure(spread: &Spread) -> (f64, f64) {
    spread.sure.unwrap_or((spread.median, spread.median))
}

/// A line through medians, with the band of their confidence intervals.
fn band(panel: &mut Panel, points: &[(f64, Spread)], index: usize, name: &str) {
    panel.names.push(name.to_owned());
    panel.line(points.iter().map(|(x, spread)| (*x, spread.median)).collect(), |line: LinePlot| {
        line.with_color(colour(index))
            .with_stroke_width(1.8)
            .with_band(points.iter().map(|(_, s)| sure(s).0), points.iter().map(|(_, s)| sure(s).1))
            .with_legend(name)
    });
    let dots = ScatterPlot::new().with_data(points.iter().map(|(x, s)| (*x, s.median)).collect::<Vec<_>>());
    panel.plots.push(dots.with_color(colour(index)).with_size(3.5).into());
}

/// What colours stand for: the same in all maps of a picture.
#[derive(Clone, Copy)]
struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

impl Scale {
    /// From the least to the greatest median; `None` if no cell has one.
    fn of(cells: &[CellStatistics], measure: usize) -> Option<Scale> {
        let medians = cells.iter().filter_map(|cell| Some(cell.spreads[measure]?.median));
        let log = is_wide(medians.clone());
        let scale = Scale { low: f64::INFINITY, high: f64::NEG_INFINITY, log };
        let scale = medians.map(|median| scale.place(median)).fold(scale, |scale, place| Scale {
            low: scale.low.min(place),
            high: scale.high.max(place),
            log,
        });
        scale.low.is_finite().then_some(scale)
    }

    fn place(self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    /// The colours of a map whose values go from `low` to `high`, which the library takes for 0 and 1; what is no number is
    /// left blank.
    fn colours(self, low: f64, high: f64) -> ColorMap {
        let part = move |t: f64| (low + t * (high - low) - self.low) / (self.high - self.low).max(f64::MIN_POSITIVE);
        ColorMap::Custom(Arc::new(move |t| if t.is_nan() { BLANK.into() } else { ColorMap::Viridis.map(part(t)) }))
    }
}

/// A map of the medians; a cell in which no run has the measure is blank and hatched.
fn heat_map(
    cells: &[CellStatistics],
    measure: usize,
    [down, across]: [&Setting; 2],
    scale: Scale,
    title: &str,
) -> Drawing {
    let place = |cell: &CellStatistics| cell.spreads[measure].map_or(f64::NAN, |spread| scale.place(spread.median));
    // Rows are drawn from the bottom up, as an axis goes.
    let columns = across.values.len();
    let data: Vec<Vec<f64>> = cells.chunks(columns).map(|row| row.iter().map(place).collect()).collect();
    let values = || data.iter().flatten().copied();
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let mut panel = Panel::default();
    let missing: Vec<(usize, usize)> = data
        .iter()
        .enumerate()
        .flat_map(|(row, values)| {
            values.iter().enumerate().filter(|(_, v)| v.is_nan()).map(move |(column, _)| (row, column))
        })
        .collect();
    let map = Heatmap::new().with_data(data).with_color_map(scale.colours(low, high)).with_legend("");
    panel.plots.push(map.into());
    for (row, column) in &missing {
        hatch(&mut panel, *row as f64 + 0.5, *column as f64 + 0.5);
    }
    let mut layout = panel
        .layout(title, &across.key, &down.key)
        .with_x_categories(labels(&across.values))
        .with_y_categories(labels(&down.values))
        .with_colorbar_tick_format(TickFormat::Custom(Arc::new(move |place| {
            to_digits(if scale.log { 10_f64.powf(place) } else { place }, 3)
        })));
    layout.show_legend = false;
    if !missing.is_empty() {
        layout = layout.with_subtitle("hatched: no run has a value");
    }
    panel.laid_out(layout)
}

/// Slanted lines across the cell whose lower left corner is there.
fn hatch(panel: &mut Panel, row: f64, column: f64) {
    for (from, to) in [((0.0, 0.5), (0.5, 1.0)), ((0.0, 0.0), (1.0, 1.0)), ((0.5, 0.0), (1.0, 0.5))] {
        let at = |(x, y): (f64, f64)| (column + x, row + y);
        panel.line(vec![at(from), at(to)], |line| line.with_color(PLANNED).with_stroke_width(1.0));
    }
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
    let layout = logarithmic(panel.layout("", about(over), about(measure)), &all);
    Some(render(name, 1, 1, vec![panel.laid_out(layout)]))
}

#[cfg(test)]
mod tests {
    use common::mission::Mission;

    use super::*;

    fn plan(sets: &[&str]) -> Plan {
        let text = include_str!("../../../tests/missions/loss-delay.toml");
        let mission = Arc::new(Mission::parse("m.toml", text).expect("sound"));
        let settings = sets.iter().map(|text| Setting::parse(text).expect("a setting")).collect();
        Plan::new("m.toml", mission, settings, 1).expect("sound")
    }

    /// Cells with these medians in all measures.
    fn cells(medians: &[Option<f64>]) -> Vec<CellStatistics> {
        let spread = |median: f64| Spread { mean: median, median, sure: None, low: median, high: median };
        let cell = |median: &Option<f64>| CellStatistics {
            runs: 1,
            finished: 1,
            spreads: vec![median.map(spread); MEASURES.len()],
        };
        medians.iter().map(cell).collect()
    }

    #[test]
    fn a_cell_without_a_value_is_blank_and_hatched_and_no_colour_stands_for_it() {
        let plan = plan(&["network.loss=0,0.5", "network.delay=0,1"]);
        let whole = picture(&plan, &cells(&[Some(1.0), Some(2.0), Some(3.0), Some(4.0)]), 0, "m").expect("a picture");
        assert!(!whole.contains(BLANK) && !whole.contains("hatched"), "{whole}");
        let lacking = picture(&plan, &cells(&[Some(1.0), None, Some(3.0), Some(4.0)]), 0, "m").expect("a picture");
        assert_eq!(lacking.matches(BLANK).count(), 1);
        assert!(lacking.contains("hatched: no run has a value") && !lacking.contains("NaN"));
        assert_eq!(picture(&plan, &cells(&[None; 4]), 0, "m"), None);
    }

    #[test]
    fn colours_of_values_far_apart_are_logarithmic() {
        let scale = Scale::of(&cells(&[Some(0.01), Some(1.0), None]), 0).expect("values");
        assert_eq!((scale.low, scale.high, scale.log), (-2.0, 0.0, true));
        assert!(!Scale::of(&cells(&[Some(1.0), Some(2.0)]), 0).expect("values").log);
        // The middle of the scale, in a map that has the upper half only.
        assert_eq!(scale.colours(-1.0, 0.0).map(0.0), ColorMap::Viridis.map(0.5));
    }

    #[test]
    fn words_stand_side_by_side_with_nothing_drawn_between_them() {
        let medians = [Some(1.0), Some(2.0)];
        let words =
            picture(&plan(&["coordination.between=hold,advance"]), &cells(&medians), 0, "m").expect("a picture");
        assert!(words.contains(">hold<") && words.contains(">advance<"), "{words}");
        let numbers = picture(&plan(&["coordination.gain=0.1,0.2"]), &cells(&medians), 0, "m").expect("a picture");
        for svg in [&words, &numbers] {
            assert_eq!((svg.matches("<circle").count(), svg.contains(">median<")), (2, true), "{svg}");
        }
        let paths = |svg: &str| svg.matches("<path").count();
        assert!(paths(&words) < paths(&numbers), "{} {}", paths(&words), paths(&numbers));
    }

    #[test]
    fn three_swept_keys_make_a_map_for_every_value_of_the_first_and_four_make_none() {
        let medians: Vec<Option<f64>> = (1..=12).map(|value| Some(f64::from(value))).collect();
        let three = plan(&["coordination.gain=0.1,0.2,0.3", "network.loss=0,0.5", "network.delay=0,1"]);
        let drawn = picture(&three, &cells(&medians), 0, "m").expect("a picture");
        for title in ["gain = 0.1", "gain = 0.2", "gain = 0.3"] {
            assert!(drawn.contains(title), "{title}");
        }
        let four = plan(&["coordination.gain=0.1,0.2", "network.loss=0,0.5", "network.delay=0,1", "duration_s=5,6"]);
        assert_eq!(picture(&four, &cells(&medians), 0, "m"), None);
    }
}
