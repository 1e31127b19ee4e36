//! A figure of given curves: for what theory draws without a run.

use kuva::plot::ScatterPlot;

use super::drawing::{Panel, colour, render};
use super::figures::Figure;

/// A figure of one panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// File name without extension.
    pub name: &'static str,
    /// Above the panel.
    pub title: String,
    /// What it shows, for a reader.
    pub caption: String,
    /// Of the horizontal axis.
    pub x: String,
    /// Of the vertical axis.
    pub y: String,
    /// What is drawn.
    pub curves: Vec<Curve>,
}

/// One curve of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
    dots: bool,
}

impl Curve {
    /// A line; without a name it is not in the legend.
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { name: name.into(), points, dots: false }
    }

    /// Points that nothing connects.
    pub fn dots(name: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { name: name.into(), points, dots: true }
    }
}

impl Chart {
    /// The figure. Points that are no finite numbers are left out.
    pub fn draw(self) -> Figure {
        let mut panel = Panel::default();
        for (index, curve) in self.curves.into_iter().enumerate() {
            let Curve { name, mut points, dots } = curve;
            points.retain(|(x, y)| x.is_finite() && y.is_finite());
            let named = !name.is_empty();
            if named {
                panel.names.push(name.clone());
            }
            if dots {
                panel.drawn.extend(points.iter().map(|point| vec![*point]));
                let scatter = ScatterPlot::new().with_data(points).with_color(colour(index)).with_size(2.0);
                panel.plots.push(if named { scatter.with_legend(name) } else { scatter }.into());
            } else {
                panel.line(points, |line| {
                    let line = line.with_color(colour(index)).with_stroke_width(1.2);
                    if named { line.with_legend(name) } else { line }
                });
            }
        }
        let layout = panel.layout(&self.title, &self.x, &self.y);
        Figure { name: self.name, caption: self.caption, svg: render(self.name, 1, 1, vec![panel.laid_out(layout)]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_its_curves_and_survives_what_is_no_number() {
        let chart = Chart {
            name: "chart",
            title: "Title".into(),
            caption: "Caption".into(),
            x: "across".into(),
            y: "up".into(),
            curves: vec![
                Curve::line("rising", vec![(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN)]),
                Curve::dots("two dots", vec![(0.0, 1.0), (1.0, 0.0)]),
                Curve::dots("", vec![]),
            ],
        };
        let drawn = chart.clone().draw();
        for words in ["<svg", "Title", "across", "up", "rising", "two dots"] {
            assert!(drawn.svg.contains(words), "{words}");
        }
        assert!(!drawn.svg.contains("NaN"));
        assert!(drawn == chart.draw(), "the same curves make the same bytes");
    }
}
