//! Fits a panel to what is in it: tick labels that all fit beside their axis, and a legend where no curve is.
//!
//! Where a legend is to be depends on the axes as they are drawn, so the panel is measured in pixels, at its size. If it is
//! full of curves, its vertical axis is made longer until there is room.

use kuva::plot::LegendPosition;
use kuva::render::layout::{ComputedLayout, Layout, TickFormat};
use kuva::render::render_utils::generate_ticks;

/// Side of the squares in which curves are looked for \[px\].
const SQUARE: f64 = 3.0;
/// Between a legend and the next curve \[px\].
const CLEARANCE: f64 = 5.0;
/// Between a legend and the axes \[px\].
const INSET: f64 = 8.0;
/// Between two places that are tried \[px\].
const STEP: f64 = 9.0;
/// The axis is made longer by this part of its length at a time, and so often at most.
const LONGER: f64 = 0.05;
const MOST_TIMES: u32 = 14;
/// Width of a digit as a part of the size of the type.
const DIGIT: f64 = 0.58;

/// A layout at its size, with room for its tick labels and its legend.
pub(super) fn fitted(mut layout: Layout, curves: &[Vec<(f64, f64)>], entries: usize, size: (f64, f64)) -> Layout {
    (layout.width, layout.height) = (Some(size.0), Some(size.1));
    // A legend beside the panel, which the library assumes, would take room from it.
    layout.legend_position = LegendPosition::InsideTopRight;
    label_ticks(&mut layout);
    if !layout.show_legend {
        return layout;
    }
    let measured = ComputedLayout::from_layout(&layout);
    let (low, high) = measured.y_range;
    let own = (layout.y_axis_min, layout.y_axis_max);
    for times in 0..=MOST_TIMES {
        // Upwards first, for legends are looked for at the top.
        for upwards in [true, false] {
            let (lower, upper) = longer((low, high), f64::from(times) * LONGER, layout.log_y, upwards);
            if times > 0 {
                (layout.y_axis_min, layout.y_axis_max) = (Some(lower), Some(upper));
                label_ticks(&mut layout);
            }
            let measured = ComputedLayout::from_layout(&layout);
            if let Some((left, top)) = free(&measured, curves, box_size(&measured, entries)) {
                // The library's corner is that of the first entry.
                return layout.with_legend_at(left + 5.0, top + measured.legend_padding);
            }
        }
    }
    (layout.y_axis_min, layout.y_axis_max) = own;
    label_ticks(&mut layout);
    layout
}

/// A range made longer at one end by a part of its length, as it is seen.
fn longer((low, high): (f64, f64), part: f64, log: bool, upwards: bool) -> (f64, f64) {
    match (log, upwards) {
        (false, true) => (low, high + part * (high - low)),
        (false, false) => (low - part * (high - low), high),
        (true, true) => (low, high * (high / low).powf(part)),
        (true, false) => (low / (high / low).powf(part), high),
    }
}

/// Gives all tick labels of the vertical axis as many decimals as their step needs, and moves the axis' own label clear of
/// them: the library takes their width from a first guess of the range.
fn label_ticks(layout: &mut Layout) {
    (layout.force_margin_left, layout.force_margin_right, layout.y_label_offset.0) = (None, None, 0.0);
    let measured = ComputedLayout::from_layout(layout);
    if layout.log_y || layout.y_categories.is_some() {
        return;
    }
    let ticks = generate_ticks(measured.y_range.0, measured.y_range.1, measured.y_ticks);
    layout.y_tick_format = tick_format(&ticks);
    let measured = ComputedLayout::from_layout(layout);
    let longest = ticks.iter().map(|tick| layout.y_tick_format.format(*tick).chars().count()).max().unwrap_or(0);
    let lacking = longest as f64 * DIGIT * f64::from(measured.tick_size) - measured.y_tick_label_px;
    if lacking > 0.0 {
        layout.force_margin_left = Some(measured.margin_left + lacking);
        layout.force_margin_right = Some(measured.margin_right);
        layout.y_label_offset.0 = -lacking;
    }
}

/// Most decimals of a tick label.
const MOST_DECIMALS: usize = 4;

/// As many decimals as tell neighbouring ticks apart exactly.
fn tick_format(ticks: &[f64]) -> TickFormat {
    let exact = |decimals: &usize| {
        let shown = |tick: &f64| format!("{tick:.decimals$}").parse::<f64>().unwrap_or(f64::NAN);
        let step = ticks.get(1).zip(ticks.first()).map_or(1.0, |(b, a)| b - a);
        ticks.iter().all(|tick| (shown(tick) - tick).abs() < 1e-3 * step)
    };
    let large = ticks.iter().any(|tick| tick.abs() >= 1e5);
    match (0..=MOST_DECIMALS).find(exact) {
        Some(decimals) if !large => TickFormat::Fixed(decimals),
        _ => TickFormat::Auto,
    }
}

fn box_size(measured: &ComputedLayout, entries: usize) -> (f64, f64) {
    let between = measured.legend_line_height - measured.legend_swatch_size;
    let height = entries as f64 * measured.legend_line_height + 2.0 * measured.legend_padding - between;
    (measured.legend_width, height)
}

/// The left upper corner of a box of this size that hides no curve: in a corner of the panel if possible, the right upper one
/// first, else as near to a corner as possible.
fn free(measured: &ComputedLayout, curves: &[Vec<(f64, f64)>], (width, height): (f64, f64)) -> Option<(f64, f64)> {
    let (left, top) = (measured.margin_left, measured.margin_top);
    let (right, bottom) = (left + measured.plot_width(), top + measured.plot_height());
    let (first_x, last_x) = (left + INSET, right - INSET - width);
    let (first_y, last_y) = (top + INSET, bottom - INSET - height);
    if last_x < first_x || last_y < first_y {
        return None;
    }
    let ink = Ink::of(measured, curves);
    let is_free =
        |(x, y): (f64, f64)| ink.is_free(x - CLEARANCE, y - CLEARANCE, x + width + CLEARANCE, y + height + CLEARANCE);
    let corners = [(last_x, first_y), (last_x, last_y), (first_x, first_y), (first_x, last_y)];
    if let Some(corner) = corners.into_iter().find(|corner| is_free(*corner)) {
        return Some(corner);
    }
    let places = |first: f64, last: f64| (0..=((last - first) / STEP) as usize).map(move |n| first + n as f64 * STEP);
    let away = |&(x, y): &(f64, f64)| {
        corners.iter().map(|corner| (x - corner.0).hypot(y - corner.1)).fold(f64::INFINITY, f64::min)
    };
    places(first_x, last_x)
        .flat_map(|x| places(first_y, last_y).map(move |y| (x, y)))
        .filter(|place| is_free(*place))
        .min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// Where a panel has curves: squares counted from the left upper corner, summed up to the left and upwards.
struct Ink {
    columns: usize,
    rows: usize,
    corner: (f64, f64),
    sums: Vec<u32>,
}

impl Ink {
    fn of(measured: &ComputedLayout, curves: &[Vec<(f64, f64)>]) -> Ink {
        let corner = (measured.margin_left, measured.margin_top);
        let extent = (measured.plot_width(), measured.plot_height());
        let columns = (extent.0 / SQUARE).ceil() as usize + 1;
        let rows = (extent.1 / SQUARE).ceil() as usize + 1;
        let mut sums = vec![0; columns * rows];
        let mut mark = |(x, y): (f64, f64)| {
            let (column, row) = ((x / SQUARE) as usize, (y / SQUARE) as usize);
            sums[row.min(rows - 1) * columns + column.min(columns - 1)] = 1;
        };
        for curve in curves {
            let seen = |(x, y): &(f64, f64)| (measured.map_x(*x) - corner.0, measured.map_y(*y) - corner.1);
            let points: Vec<(f64, f64)> =
                curve.iter().map(seen).filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
            let alone = [[points.first(), points.first()]];
            let pieces = points.windows(2).map(|pair| [pair.first(), pair.last()]);
            for piece in pieces.chain(alone) {
                let [Some(from), Some(to)] = piece else { continue };
                let Some((from, to)) = clipped(*from, *to, extent) else { continue };
                let steps = ((to.0 - from.0).hypot(to.1 - from.1) / SQUARE).ceil().max(1.0);
                (0..=steps as u32).map(|step| f64::from(step) / steps).for_each(|part| {
                    mark((from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1)));
                });
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let at = row * columns + column;
                let left = if column > 0 { sums[at - 1] } else { 0 };
                let above = if row > 0 { sums[at - columns] } else { 0 };
                let both = if row > 0 && column > 0 { sums[at - columns - 1] } else { 0 };
                sums[at] += left + above - both;
            }
        }
        Ink { columns, rows, corner, sums }
    }

    fn is_free(&self, left: f64, top: f64, right: f64, bottom: f64) -> bool {
        let square = |value: f64, count: usize| ((value.max(0.0) / SQUARE) as usize).min(count - 1);
        let (x, y) = self.corner;
        let (from, to) = (square(left - x, self.columns), square(right - x, self.columns));
        let (above, below) = (square(top - y, self.rows), square(bottom - y, self.rows));
        let up_to = |column: Option<usize>, row: Option<usize>| match (column, row) {
            (Some(column), Some(row)) => self.sums[row * self.columns + column],
            _ => 0,
        };
        let (before, over) = (from.checked_sub(1), above.checked_sub(1));
        up_to(Some(to), Some(below)) + up_to(before, over) == up_to(before, Some(below)) + up_to(Some(to), over)
    }
}

/// The part of a straight piece that is inside the rectangle from (0, 0) to `extent` (Liang and Barsky).
fn clipped(from: (f64, f64), to: (f64, f64), extent: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut begin, mut end) = (0.0_f64, 1.0_f64);
    for (along, room) in [(-dx, from.0), (dx, extent.0 - from.0), (-dy, from.1), (dy, extent.1 - from.1)] {
        if along == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if along < 0.0 {
            begin = begin.max(room / along);
        } else {
            end = end.min(room / along);
        }
    }
    let at = |part: f64| (from.0 + part * dx, from.1 + part * dy);
    (begin <= end).then(|| (at(begin), at(end)))
}

#[cfg(test)]
mod tests {
    use kuva::plot::LinePlot;
    use kuva::render::plots::Plot;

    use super::*;

    const SIZE: (f64, f64) = (520.0, 360.0);

    fn layout(curves: &[Vec<(f64, f64)>]) -> Layout {
        let line = |curve: &Vec<(f64, f64)>| LinePlot::new().with_data(curve.clone()).with_legend("a curve").into();
        let plots: Vec<Plot> = curves.iter().map(line).collect();
        Layout::auto_from_plots(&plots).with_y_label("up").with_legend_position(LegendPosition::InsideTopRight)
    }

    /// Left, top, right and bottom of the legend.
    fn legend(layout: &Layout, entries: usize) -> [f64; 4] {
        let measured = ComputedLayout::from_layout(layout);
        let LegendPosition::Custom(x, y) = layout.legend_position else { panic!("not placed") };
        let (width, height) = box_size(&measured, entries);
        let (left, top) = (x - 5.0, y - measured.legend_padding);
        [left, top, left + width, top + height]
    }

    /// Whether some of the straight piece is inside the legend, by halving: another way than the one tested.
    fn crosses(from: (f64, f64), to: (f64, f64), area: [f64; 4], depth: u32) -> bool {
        let [left, top, right, bottom] = area;
        let apart =
            from.0.max(to.0) < left || from.0.min(to.0) > right || from.1.max(to.1) < top || from.1.min(to.1) > bottom;
        let middle = ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0);
        let inside = (left..=right).contains(&middle.0) && (top..=bottom).contains(&middle.1);
        !apart
            && (inside || depth > 0 && (crosses(from, middle, area, depth - 1) || crosses(middle, to, area, depth - 1)))
    }

    fn hides(layout: &Layout, curves: &[Vec<(f64, f64)>]) -> bool {
        let (measured, area) = (ComputedLayout::from_layout(layout), legend(layout, curves.len()));
        let at = |point: (f64, f64)| (measured.map_x(point.0), measured.map_y(point.1));
        curves.iter().flat_map(|curve| curve.windows(2)).any(|pair| crosses(at(pair[0]), at(pair[1]), area, 12))
    }

    #[test]
    fn a_legend_goes_into_the_corner_where_the_lines_are_not() {
        for (slope, right, upper) in [(1.0, true, false), (-1.0, true, true)] {
            let curve: Vec<(f64, f64)> = (0..100).map(|step| (f64::from(step), slope * f64::from(step))).collect();
            let fitted = fitted(layout(std::slice::from_ref(&curve)), &[curve], 1, SIZE);
            let [left, top, ..] = legend(&fitted, 1);
            assert_eq!((left > SIZE.0 / 2.0, top < SIZE.1 / 2.0), (right, upper), "slope {slope}");
        }
    }

    #[test]
    fn a_line_counts_where_it_has_no_points() {
        // Two points each: what is between them would be hidden in all four corners but for the lines.
        let curves = [vec![(0.0, 1.0), (1.0, 1.0)], vec![(0.0, 0.0), (1.0, 0.0)], vec![(0.0, 0.0), (1.0, 1.0)]];
        let fitted = fitted(layout(&curves), &curves, 3, SIZE);
        assert!(!hides(&fitted, &curves));
    }

    #[test]
    fn a_panel_full_of_curves_gets_a_longer_axis() {
        let full: Vec<Vec<(f64, f64)>> = (0..4)
            .map(|phase| (0..400).map(f64::from).map(|t| (t, (0.9 * t + f64::from(phase)).sin())).collect())
            .collect();
        let before = ComputedLayout::from_layout(&layout(&full)).y_range;
        let fitted = fitted(layout(&full), &full, 4, SIZE);
        let after = ComputedLayout::from_layout(&fitted).y_range;
        assert!(!hides(&fitted, &full));
        assert!(after.1 - after.0 > 1.1 * (before.1 - before.0), "{before:?} {after:?}");
    }

    #[test]
    fn tick_labels_have_the_decimals_of_their_step_and_push_the_label_of_the_axis_away() {
        assert!(matches!(tick_format(&[-0.5, 0.0, 0.5]), TickFormat::Fixed(1)));
        assert!(matches!(tick_format(&[-0.075, -0.05, -0.025]), TickFormat::Fixed(3)));
        assert!(matches!(tick_format(&[0.0, 2e-7]), TickFormat::Auto));
        let curve = vec![(0.0, -0.0725), (1.0, -0.07)];
        let mut layout = layout(&[curve]);
        (layout.width, layout.height) = (Some(SIZE.0), Some(SIZE.1));
        label_ticks(&mut layout);
        let measured = ComputedLayout::from_layout(&layout);
        let (low, high) = measured.y_range;
        let longest = generate_ticks(low, high, measured.y_ticks)
            .iter()
            .map(|tick| layout.y_tick_format.format(*tick).len())
            .max()
            .expect("ticks");
        let room = measured.y_tick_label_px - layout.y_label_offset.0;
        assert!(room >= longest as f64 * DIGIT * f64::from(measured.tick_size), "{room} for {longest} characters");
    }

    #[test]
    fn a_piece_is_clipped_to_the_panel() {
        let extent = (10.0, 10.0);
        assert_eq!(clipped((-10.0, 5.0), (30.0, 5.0), extent), Some(((0.0, 5.0), (10.0, 5.0))));
        assert_eq!(clipped((1.0, 1.0), (1.0, 1.0), extent), Some(((1.0, 1.0), (1.0, 1.0))));
        assert_eq!(clipped((-1.0, 20.0), (11.0, 20.0), extent), None);
    }
}
