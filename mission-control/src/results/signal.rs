//! The switching signal as it truly was: when each link was up.

use kuva::render::layout::Layout;

use super::Facts;
use super::drawing::{OUTAGE, Panel, colour, render};
use super::figures::Figure;
use super::network::Network;

/// More links than this are too many to be told apart.
const MOST_LINKS: usize = 24;
/// A gap shorter than this part of the flight is narrower than a pixel, and not drawn.
const PIXEL: f64 = 1.0 / 1200.0;

/// A row for each link, with a bar for each time that it was up; `None` where all links were up all the time.
pub(super) fn figure(network: &Network, facts: &Facts) -> Option<Figure> {
    let up: Vec<Vec<(f64, f64)>> = facts.links.iter().map(|(from, to)| network.up_times(from, to)).collect();
    let whole = |times: &Vec<(f64, f64)>| times[..] == [(0.0, facts.duration_s)];
    if facts.duration_s <= 0.0 || up.iter().all(whole) {
        return None;
    }
    let shown = up.len().min(MOST_LINKS);
    let mut panel = Panel::default();
    for (row, times) in up.iter().take(shown).enumerate() {
        // The first link is the topmost.
        let y = (shown - row) as f64;
        for (from, to) in joined(times, PIXEL * facts.duration_s) {
            panel.line(vec![(from, y), (to, y)], |line| line.with_color(colour(0)).with_stroke_width(7.0));
        }
    }
    // Where nothing is up there is nothing to draw, and the axes still want a size.
    panel.line(vec![(0.0, 0.4), (facts.duration_s, 0.4)], |line| line.with_color(OUTAGE).with_stroke_width(0.0));
    let labels = facts.links.iter().take(shown).rev().map(|(from, to)| format!("{from} → {to}"));
    let layout: Layout = panel
        .layout("Links that were up", "time [s]", "")
        .with_x_axis_min(0.0)
        .with_x_axis_max(facts.duration_s)
        .with_y_axis_min(0.4)
        .with_y_axis_max(shown as f64 + 0.6)
        .with_y_categories(labels.collect());
    let rest = if shown < up.len() { format!("; the first {shown} of {}", up.len()) } else { String::new() };
    Some(Figure {
        name: "links",
        caption: format!("The switching signal as it was: when each directed link was up{rest}."),
        svg: render("links", 1, 1, vec![panel.laid_out(layout)]),
    })
}

/// Intervals with no gap shorter than `gap` between them.
fn joined(times: &[(f64, f64)], gap: f64) -> Vec<(f64, f64)> {
    let mut joined: Vec<(f64, f64)> = Vec::new();
    for &(from, to) in times {
        match joined.last_mut() {
            Some(last) if from - last.1 < gap => last.1 = to,
            _ => joined.push((from, to)),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::testing::{facts, fleet};
    use common::record::Record;

    #[test]
    fn every_time_that_a_link_was_up_is_a_bar_and_links_always_up_are_no_figure() {
        let (mut recording, facts) = (fleet(true), facts(true));
        let network = Network::of(&recording.exact, &facts);
        let figure = figure(&network, &facts).expect("links go down");
        let bars: usize = facts.links.iter().map(|(from, to)| network.up_times(from, to).len()).sum();
        let drawn = figure.svg.matches("stroke-width=\"7\"").count();
        assert!(bars > 80 && drawn == bars, "{drawn} bars of {bars}");
        for (from, to) in &facts.links {
            assert!(figure.svg.contains(&format!("{from} → {to}")), "{from} → {to}");
        }
        assert!(!figure.svg.contains("NaN") && figure.caption.ends_with("was up."));
        recording.exact.retain(|record| !matches!(record, Record::Topology(_)));
        assert_eq!(super::figure(&Network::of(&recording.exact, &facts), &facts), None);
    }

    #[test]
    fn gaps_that_nobody_could_see_are_not_drawn() {
        assert_eq!(joined(&[(0.0, 1.0), (1.05, 2.0), (3.0, 4.0)], 0.1), [(0.0, 2.0), (3.0, 4.0)]);
        assert_eq!(joined(&[], 0.1), []);
    }
}
