//! What pages are written with: tables, figures, escaped text, and numbers as a person reads them.

use std::fmt::Write as _;

use super::drawing::{GRID, INK, PAPER};

/// The style sheet of the pages.
pub(crate) const STYLE: &str = include_str!("report.css");

/// A table that scrolls sideways on a narrow screen. Cells are HTML already.
pub(crate) fn table(page: &mut String, class: &str, header: &[&str], rows: impl Iterator<Item = Vec<String>>) {
    let _ = write!(page, "<div class=\"scroll\"><table class=\"{class}\">\n<thead><tr>");
    for cell in header {
        let _ = write!(page, "<th>{}</th>", escape(cell));
    }
    page.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        page.push_str("<tr>");
        for cell in row {
            let _ = write!(page, "<td>{cell}</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody></table></div>\n");
}

/// The figure as part of the page: as wide as there is room, in the colours of the page.
pub(super) fn inline(svg: &str) -> String {
    let attribute = |name: &str| -> Option<f64> {
        let start = svg.find(&format!(" {name}=\""))? + name.len() + 3;
        svg[start..].split('"').next()?.parse().ok()
    };
    let body = svg.find('>').map_or("", |end| &svg[end..]);
    let (width, height) = (attribute("width").unwrap_or(1000.0), attribute("height").unwrap_or(700.0));
    let body = body.replace(PAPER, "var(--paper)").replace(INK, "var(--ink)").replace(GRID, "var(--grid)");
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\" fill=\"var(--ink)\"{body}"
    )
}

/// Text that means itself in HTML.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// What a sentence of a page says on a terminal.
pub(super) fn on_a_terminal(html: &str) -> String {
    let marks = [("<strong>", ""), ("</strong>", ""), ("·10<sup>−", "e-"), ("·10<sup>", "e"), ("</sup>", "")];
    // The ampersand last: what it is followed by is text.
    let characters = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
    marks.iter().chain(&characters).fold(html.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// What is fit to be told to a person: a text with a number in it that is none says nothing, and none has a hundred digits.
pub(crate) fn told(text: &str) -> String {
    let is_none = |word: &str| ["NaN", "nan", "inf"].contains(&word);
    if text.split(|c: char| !c.is_alphanumeric()).any(is_none) {
        return "–".into();
    }
    let short = |word: &str| match word.parse::<f64>() {
        Ok(value) if word.len() > MOST_DIGITS => format!("{value:.3e}"),
        _ => word.to_owned(),
    };
    text.split(' ').map(short).collect::<Vec<_>>().join(" ")
}

/// A number with more characters than this is better written with a power of ten.
const MOST_DIGITS: usize = 24;

/// A number with its unit, or a dash.
pub(super) fn optional(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{}{unit}", number(value)))
}

/// A part of one, in per cent.
pub(super) fn percent(part: f64) -> String {
    if !part.is_finite() {
        return number(part);
    }
    format!("{}&nbsp;%", number((part * 1000.0).round() / 10.0))
}

/// A number with three or four significant digits, as HTML.
pub(crate) fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let magnitude = value.abs();
    let minus = if value < 0.0 { "−" } else { "" };
    if magnitude == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e6).contains(&magnitude) {
        let text = format!("{magnitude:.1e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{minus}{mantissa}·10<sup>{}</sup>", exponent.replace('-', "−"));
    }
    let decimals = (3.0 - magnitude.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{magnitude:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{minus}{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_not_told() {
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(number), ["–"; 3]);
        assert_eq!(told("information from infinity"), "information from infinity");
        assert_eq!(told(&format!("{:.5} 1/s, 0.25 m", -1.5e137)), "-1.500e137 1/s, 0.25 m");
    }

    #[test]
    fn a_terminal_has_no_marks() {
        let html = format!("<strong>Coordinated</strong>: {} &amp; {}", number(5.6e-9), number(-2.5e7));
        assert_eq!(on_a_terminal(&html), "Coordinated: 5.6e-9 & −2.5e7");
        let name = "a<b>'&lt;\"";
        assert_eq!(on_a_terminal(&escape(name)), name);
    }

    #[test]
    fn numbers_are_short() {
        let written = [0.0, 0.5, -12.345_67, 0.001_234_56, 3.1e-4, 123_456.7, 2.5e7, 100.0].map(number);
        let expected = ["0", "0.5", "−12.35", "0.001235", "3.1·10<sup>−4</sup>", "123457", "2.5·10<sup>7</sup>", "100"];
        assert_eq!(written, expected);
    }
}
