//! `report.html`: a run on one page, in one file, without a script.

use std::fmt::Write as _;

use serde::Serialize;

use super::decay::fitted_where;
use super::drawing::{GRID, INK, PAPER};
use super::graph::printed;
use super::summary::PATH_THRESHOLD_M;
use super::{ClockSummary, DeliverySummary, Facts, Figure, GraphFacts, LinkSummary, Summary, VehicleSummary};

/// A line of the table "theory beside measurement".
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TheoryRow {
    /// The theorem or quantity.
    pub name: String,
    /// What it requires.
    pub condition: String,
    /// What is the case in this mission.
    pub value: String,
    /// Whether the mission meets the condition; `None` if there is none to meet.
    pub holds: Option<bool>,
    /// What it predicts or guarantees.
    pub predicted: String,
    /// The rate at which the norm of the coordination error decays if it guarantees one \[1/s\].
    pub guaranteed_rate: Option<f64>,
    /// What was measured.
    pub measured: String,
}

/// Ends the measured cell of a row whose rate was not reached although its conditions hold.
pub const BELOW: &str = "below the guaranteed rate";

impl TheoryRow {
    /// Whether less was measured than is guaranteed, although all conditions hold.
    pub fn is_below(&self) -> bool {
        self.measured.ends_with(BELOW)
    }
}

/// Everything that the report shows.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// What is known of the mission.
    pub facts: &'a Facts,
    /// The numbers that mission and seed determine.
    pub summary: &'a Summary,
    /// The numbers of the clock.
    pub clock: &'a ClockSummary,
    /// The figures.
    pub figures: &'a [Figure],
    /// Theory beside measurement.
    pub theory: &'a [TheoryRow],
    /// More to tell: warnings of the mission check, how the run was made.
    pub notes: &'a [String],
    /// Commands that make the run again.
    pub reproduce: &'a [String],
    /// The mission file as flown.
    pub mission_toml: &'a str,
}

/// The report as HTML.
pub fn report(report: &Report<'_>) -> String {
    let mut page = String::with_capacity(256 * 1024);
    let title = escape(&report.facts.mission);
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<main>\n"
    );
    header(&mut page, report);
    theory(&mut page, report.theory);
    graph(&mut page, report.facts.graph.as_ref());
    figures(&mut page, report.figures);
    vehicles(&mut page, report);
    network(&mut page, report);
    clock(&mut page, report.clock);
    notes(&mut page, report);
    reproduce(&mut page, report);
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

fn header(page: &mut String, report: &Report<'_>) {
    let Report { facts, summary, .. } = report;
    let _ = write!(page, "<header>\n<h1>{}</h1>\n", escape(&facts.mission));
    if !facts.description.is_empty() {
        let _ = writeln!(page, "<p class=\"lead\">{}</p>", escape(&facts.description));
    }
    let (good, sentences) = verdict(report);
    let class = if good { "good" } else { "attention" };
    let _ = writeln!(page, "<p class=\"verdict {class}\">{sentences}</p>");
    let vehicles = summary.vehicles.len();
    let plural = if vehicles == 1 { "" } else { "s" };
    let entries = [
        ("flown", format!("{vehicles} vehicle{plural}, {} s", number(summary.duration_s))),
        ("formation speed", optional(summary.fleet.formation_speed, "/s")),
        ("control period", format!("{} s", number(facts.control_period_s))),
        ("seed", summary.seed.to_string()),
        ("mission digest", format!("<code>{}</code>", escape(summary.digest.get(..16).unwrap_or(&summary.digest)))),
    ];
    page.push_str("<dl>");
    for (name, value) in entries {
        let _ = write!(page, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    page.push_str("</dl>\n</header>\n");
}

/// How closely a steady error must agree with its prediction to count as predicted.
const PREDICTED_PART: f64 = 0.1;

/// Whether all is well, and what happened in a sentence or two.
fn verdict(report: &Report<'_>) -> (bool, String) {
    let fleet = &report.summary.fleet;
    let coordination = &fleet.coordination;
    let flown = report.summary.vehicles.iter().filter(|vehicle| vehicle.rows > 0).count();
    if flown == 0 {
        return (false, "Nothing was recorded.".into());
    }
    let mut good = report.summary.complete && fleet.messages.balanced;
    let mut sentences = Vec::new();
    if flown > 1 {
        let settled = coordination.settled_s.or(coordination.settled_absolute_s);
        let mut range = format!(
            "the largest coordination error went from {} to {}",
            number(coordination.initial),
            number(coordination.last)
        );
        if let Some(at) = coordination.early(report.summary.duration_s) {
            let _ = write!(range, " at {} s, when all were last recorded", number(at));
        }
        // An error that was never measured is none that is small.
        let settled = settled.filter(|_| coordination.last_s.is_some());
        if coordination.last_s.is_none() {
            range = "the vehicles were never recorded together".to_owned();
        }
        good &= settled.is_some() && coordination.early(report.summary.duration_s).is_none();
        sentences.push(match settled {
            Some(at) => format!("<strong>Coordinated after {} s</strong>: {range}.", number(at)),
            None => format!("<strong>Not coordinated at the end</strong>: {range}."),
        });
    }
    // A steady error that theory predicts is no surprise: the design vector δ of Theorem 4.7 leaves one.
    let biases = report.facts.vehicles.iter().filter_map(|vehicle| vehicle.predicted_along_bias_m.map(f64::abs));
    let bias = biases.max_by(f64::total_cmp);
    let as_predicted = bias.filter(|bias| (fleet.path_error_final_m - bias).abs() <= PREDICTED_PART * bias);
    good &= fleet.on_path_s.is_some() || as_predicted.is_some();
    let each = if flown > 1 { "Every vehicle" } else { "The vehicle" };
    sentences.push(match fleet.on_path_s {
        Some(at) => {
            format!("{each} stayed within {} m of its path from {} s on.", number(PATH_THRESHOLD_M), number(at))
        }
        None => {
            let end = number(fleet.path_error_final_m);
            match as_predicted {
                Some(bias) => format!(
                    "The largest path-following error at the end was {end} m, of the {} m that the law leaves by design.",
                    number(bias)
                ),
                None => format!("The largest path-following error at the end was {end} m."),
            }
        }
    });
    let failed = report.theory.iter().filter(|row| row.holds == Some(false)).count();
    if failed > 0 {
        good = false;
        let (noun, verb) = if failed == 1 { ("condition", "does") } else { ("conditions", "do") };
        sentences.push(format!("{failed} {noun} of the theory {verb} not hold for this mission."));
    }
    if report.theory.iter().any(TheoryRow::is_below) {
        good = false;
        sentences.push(format!("The coordination error decayed {BELOW}."));
    }
    (good, sentences.join(" "))
}

fn theory(page: &mut String, rows: &[TheoryRow]) {
    if rows.is_empty() {
        return;
    }
    page.push_str("<section>\n<h2>Theory beside measurement</h2>\n");
    let header = ["statement", "condition", "here", "holds", "guaranteed", "measured"];
    let rows = rows.iter().map(|row| {
        let holds = match row.holds {
            Some(true) => "<span class=\"yes\">yes</span>",
            Some(false) => "<span class=\"no\">no</span>",
            None => "–",
        };
        let text =
            [&row.name, &row.condition, &row.value, &row.predicted, &row.measured].map(|text| escape(&told(text)));
        let [name, condition, value, predicted, measured] = text;
        let measured = if row.is_below() { format!("<span class=\"no\">{measured}</span>") } else { measured };
        vec![name, condition, value, holds.into(), predicted, measured]
    });
    table(page, "prose", &header, rows);
    page.push_str("</section>\n");
}

/// The graph of all links, and its matrices if the fleet is small.
fn graph(page: &mut String, graph: Option<&GraphFacts>) {
    let Some(graph) = graph.filter(|graph| graph.vehicles.len() > 1) else { return };
    page.push_str("<section>\n<h2>Graph</h2>\n");
    let rows = graph.facts().into_iter().map(|(name, text)| vec![escape(name), escape(&text)]);
    table(page, "prose", &["of the graph of all links", "here"], rows);
    let matrices = graph.matrices();
    if !matrices.is_empty() {
        let order = escape(&graph.vehicles.join(", "));
        let _ = writeln!(page, "<details><summary>Matrices, rows and columns in the order {order}</summary>");
        for (name, matrix) in matrices {
            let _ =
                writeln!(page, "<p class=\"remark\">{}</p>\n<pre>{}</pre>", escape(name), printed(matrix).join("\n"));
        }
        page.push_str("</details>\n");
    }
    page.push_str("</section>\n");
}

fn figures(page: &mut String, figures: &[Figure]) {
    if figures.is_empty() {
        return;
    }
    page.push_str("<section>\n<h2>Figures</h2>\n");
    for figure in figures {
        let caption = escape(&figure.caption);
        let _ = writeln!(page, "<figure>{}<figcaption>{caption}</figcaption></figure>", inline(&figure.svg));
    }
    page.push_str("</section>\n");
}

fn vehicles(page: &mut String, report: &Report<'_>) {
    page.push_str("<section>\n<h2>Vehicles</h2>\n");
    let header = [
        "vehicle",
        "path",
        "steady rate",
        "speed [m/s]",
        "‖e‖ at end [m]",
        "‖e‖ rms [m]",
        "on path from [s]",
        "along mean [m]",
        "cross rms [m]",
        "alone",
    ];
    let row = |vehicle: &VehicleSummary| {
        vec![
            escape(&vehicle.id),
            escape(&vehicle.path),
            number(vehicle.steady_speed),
            number(vehicle.steady_speed_mps),
            at_end(vehicle, report.summary.duration_s),
            number(vehicle.path_error_rms_m),
            optional(vehicle.on_path_s, ""),
            number(vehicle.along_mean_m),
            number(vehicle.cross_rms_m),
            percent(vehicle.alone_fraction),
        ]
    };
    table(page, "numbers names-2", &header, report.summary.vehicles.iter().map(row));
    let coordination = &report.summary.fleet.coordination;
    let mut sentences = Vec::new();
    if let Some(fit) = coordination.fit {
        let mut sentence = format!(
            "The norm of the coordination error decayed at {} per second ({})",
            number(fit.rate),
            fitted_where(&fit)
        );
        if let Some(guaranteed) = coordination.guaranteed_rate {
            let _ = write!(sentence, "; theory guarantees {}", number(guaranteed));
        }
        sentences.push(format!("{sentence}."));
    }
    let fleet = &report.summary.fleet;
    if let Some(predicted) = fleet.predicted_speed {
        let (measured, predicted) = (number(fleet.steady_speed), number(predicted));
        sentences.push(format!("The fleet's steady rate was {measured} per second; theory predicts {predicted}."));
    }
    sentences.push("Means and rms are over the last fifth of the run; “alone” is the time without a neighbour.".into());
    let _ = write!(page, "<p class=\"remark\">{}</p>\n</section>\n", sentences.join(" "));
}

/// Most links in the table.
const MOST_LINKS: usize = 300;

fn network(page: &mut String, report: &Report<'_>) {
    let links = &report.summary.links;
    if links.is_empty() {
        return;
    }
    page.push_str("<section>\n<h2>Network</h2>\n");
    let totals = &report.summary.fleet.messages;
    // What can always happen has a column, the rest only where it did.
    type Column = (&'static str, fn(&LinkSummary) -> u64, u64, bool);
    let columns: Vec<Column> = [
        ("sent", (|link| link.sent) as fn(&LinkSummary) -> u64, totals.sent, true),
        ("delivered", |link| link.delivered, totals.delivered, true),
        ("lost", |link| link.lost, totals.lost, true),
        ("out of range", |link| link.out_of_range, totals.out_of_range, false),
        ("link down", |link| link.link_down, totals.link_down, true),
        ("queue full", |link| link.queue_full, totals.queue_full, true),
        ("deaf while speaking", |link| link.half_duplex, totals.half_duplex, false),
        ("collided", |link| link.collision, totals.collision, false),
        ("corrupt", |link| link.corrupt, totals.corrupt, false),
        ("receiver absent", |link| link.receiver_absent, totals.receiver_absent, false),
        ("in flight", |link| link.in_flight, totals.in_flight, true),
        ("second copies", |link| link.copied, totals.copied, false),
    ]
    .into_iter()
    .filter(|(_, _, total, always)| *always || *total > 0)
    .collect();
    let mut header = vec!["link"];
    header.extend(columns.iter().map(|column| column.0));
    // On a real clock the achieved delay stands beside the commanded one.
    let clock = &report.clock.links;
    if clock.is_empty() {
        header.push("delay [s]");
    } else {
        header.extend(["commanded delay [s]", "late, median [ms]", "late, 99 % [ms]"]);
    }
    let late_ms = |deliveries: Option<&DeliverySummary>| {
        let late = deliveries.map(|deliveries| deliveries.late_s);
        [late.map(|late| late.median), late.map(|late| late.p99)].map(|late| optional(late.map(|s| s * 1e3), ""))
    };
    header.extend(["up", "longest outage [s]", "ledger"]);
    let row = |link: &LinkSummary| {
        let ledger =
            if link.balanced { "<span class=\"yes\">balanced</span>" } else { "<span class=\"no\">open</span>" };
        let mut cells = vec![format!("{}&nbsp;→&nbsp;{}", escape(&link.from), escape(&link.to))];
        cells.extend(columns.iter().map(|column| column.1(link).to_string()));
        cells.push(optional(link.delay.map(|delay| delay.median), ""));
        if !clock.is_empty() {
            let own = clock.iter().find(|own| own.from == link.from && own.to == link.to);
            cells.extend(late_ms(own.map(|own| &own.deliveries)));
        }
        cells.extend([percent(link.up_fraction), number(link.longest_outage_s), ledger.into()]);
        cells
    };
    let sum = (links.len() > 1).then(|| {
        let mut cells = vec!["all".to_owned()];
        cells.extend(columns.iter().map(|column| column.2.to_string()));
        cells.push(String::new());
        if !clock.is_empty() {
            cells.extend(late_ms(report.clock.deliveries.as_ref()));
        }
        cells.extend(["", "", ""].map(str::to_owned));
        cells
    });
    // A complete graph of two hundred vehicles would be a page of its own.
    let mut shown: Vec<&LinkSummary> = links.iter().collect();
    if shown.len() > MOST_LINKS {
        shown.sort_by_key(|link| std::cmp::Reverse(link.sent - link.delivered.min(link.sent)));
        shown.truncate(MOST_LINKS);
    }
    table(page, "numbers", &header, shown.iter().map(|link| row(link)).chain(sum));
    let mut sentences = Vec::new();
    if shown.len() < links.len() {
        let (few, all) = (shown.len(), links.len());
        sentences.push(format!("The {few} of {all} links that delivered least; all are in <code>summary.json</code>."));
    }
    sentences.push(format!(
        "{} transmissions of at most {} bytes: {} bytes on the air.",
        totals.transmissions, totals.message_bytes, totals.bytes_on_air
    ));
    if let Some(connectivity) = report.summary.fleet.connectivity {
        let mut sentence = format!("Measured loss of connectivity: α = {}", number(connectivity.alpha));
        if let Some(t_0_s) = connectivity.t_0_s {
            let _ = write!(sentence, ", T<sub>0</sub> = {} s", number(t_0_s));
        }
        if let Some(t_s) = connectivity.t_s {
            let _ = write!(sentence, "; connected in the union over every {} s", number(t_s));
        }
        sentences.push(format!("{sentence}."));
    }
    let _ = write!(page, "<p class=\"remark\">{}</p>\n</section>\n", sentences.join(" "));
}

fn clock(page: &mut String, clock: &ClockSummary) {
    let Some(verdict) = &clock.verdict else { return };
    page.push_str("<section>\n<h2>On the clock</h2>\n");
    let class = if verdict.kept_time { "good" } else { "attention" };
    let _ = writeln!(page, "<p class=\"verdict {class}\">{}</p>", escape(&verdict.text));
    if !clock.deadlines.is_empty() {
        let row = |deadlines: &super::DeadlineSummary| {
            let missed = match deadlines.missed {
                0 => "0".to_owned(),
                missed => format!("<span class=\"no\">{missed}</span>"),
            };
            let worst = number(deadlines.worst_late_s * 1e3);
            vec![escape(&deadlines.vehicle), deadlines.met.to_string(), missed, worst]
        };
        let header = ["vehicle", "deadlines met", "missed", "worst lateness [ms]"];
        table(page, "numbers", &header, clock.deadlines.iter().map(row));
    }
    if let Some(deliveries) = &clock.deliveries {
        let spread = &deliveries.late_s;
        let late = [spread.median, spread.p99, spread.max, deliveries.least_late_s].map(|s| number(s * 1e3));
        let commanded = number(deliveries.commanded_s.median);
        let _ = writeln!(
            page,
            "<p class=\"remark\">{} deliveries with a commanded delay of {commanded} s (median) came {} ms late \
             (median), {} ms (99 %), {} ms (worst), {} ms (least).</p>",
            deliveries.count, late[0], late[1], late[2], late[3]
        );
    }
    if !clock.overruns.is_empty() {
        let row = |overrun: &super::OverrunSummary| {
            vec![escape(&overrun.vehicle), overrun.place.as_str().to_owned(), overrun.count.to_string()]
        };
        let header = ["vehicle", "where the oldest messages were dropped for want of time", "messages"];
        table(page, "numbers names-2", &header, clock.overruns.iter().map(row));
    }
    page.push_str("</section>\n");
}

fn notes(page: &mut String, report: &Report<'_>) {
    let warnings =
        report.summary.warnings.iter().map(|warning| format!("<li class=\"warning\">{}</li>", escape(warning)));
    let told = report.notes.iter().map(|note| format!("<li>{}</li>", escape(note)));
    let noted = report.clock.notes.iter().map(|note| {
        let often = if note.count > 1 { format!(" ({} times)", note.count) } else { String::new() };
        let (source, text) = (escape(&note.source), escape(&note.text));
        format!("<li><span class=\"when\">{} s</span> {source}: {text}{often}</li>", number(note.t_s))
    });
    let items: Vec<String> = warnings.chain(told).chain(noted).collect();
    if !items.is_empty() {
        let _ = write!(page, "<section>\n<h2>Notes</h2>\n<ul>{}</ul>\n</section>\n", items.join("\n"));
    }
}

fn reproduce(page: &mut String, report: &Report<'_>) {
    page.push_str("<section>\n<h2>The mission</h2>\n");
    if !report.reproduce.is_empty() {
        let commands: Vec<String> = report.reproduce.iter().map(|command| escape(command)).collect();
        let _ = writeln!(page, "<p>To make this run again:</p>\n<pre><code>{}</code></pre>", commands.join("\n"));
    }
    let _ = write!(
        page,
        "<details><summary>mission.toml as flown</summary>\n<pre><code>{}</code></pre>\n</details>\n</section>\n",
        escape(report.mission_toml)
    );
}

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
fn inline(svg: &str) -> String {
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

/// The path-following error at the end, with the instant if the vehicle did not last.
fn at_end(vehicle: &VehicleSummary, duration_s: f64) -> String {
    let error = number(vehicle.path_error_final_m);
    vehicle.early(duration_s).map_or(error.clone(), |at| format!("{error} (at {} s)", number(at)))
}

fn optional(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{}{unit}", number(value)))
}

fn percent(part: f64) -> String {
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

pub(crate) const STYLE: &str = include_str!("report.css");

#[cfg(test)]
mod tests {
    use super::super::testing::{facts, fleet};
    use super::super::{figures as draw, summarise, summarise_clock};
    use super::*;

    fn page(spatial: bool, theory: &[TheoryRow]) -> String {
        let (recording, facts) = (fleet(spatial), facts(spatial));
        report(&Report {
            facts: &facts,
            summary: &summarise(&recording, &facts),
            clock: &summarise_clock(&recording),
            figures: &draw(&recording, &facts),
            theory,
            notes: &["a <b>bold</b> note".into()],
            reproduce: &["mission-control simulate mission.toml --seed 42".into()],
            mission_toml: &recording.mission_toml,
        })
    }

    #[test]
    fn the_page_is_one_file_without_a_script() {
        let page = page(true, &[]);
        for forbidden in ["<script", "src=", "href=", "url(h", "@import"] {
            assert!(!page.contains(forbidden), "{forbidden}");
        }
        assert!(page.len() < 600_000, "{} bytes", page.len());
        assert_eq!(page.matches("<svg").count(), 3);
    }

    #[test]
    fn what_was_flown_and_how_it_went_is_said() {
        let page = page(true, &[]);
        for text in
            ["Coordinated after", "Every vehicle stayed within 0.1 m", "v2&nbsp;→&nbsp;v3", "balanced", "--seed 42"]
        {
            assert!(page.contains(text), "{text}");
        }
        assert!(page.contains("verdict good"));
    }

    #[test]
    fn on_a_real_clock_each_link_has_its_lateness_beside_the_commanded_delay() {
        let page = page(true, &[]);
        let row = page.lines().find(|line| line.starts_with("<tr><td>v1&nbsp;→&nbsp;v2")).expect("a row");
        assert!(page.contains("<th>commanded delay [s]</th><th>late, median [ms]</th><th>late, 99 % [ms]</th>"));
        assert!(row.contains("<td>5</td><td>0.06</td><td>2</td>"), "{row}");
        let other = page.lines().find(|line| line.starts_with("<tr><td>v2&nbsp;→&nbsp;v1")).expect("a row");
        assert!(other.contains("<td>5</td><td>–</td><td>–</td>"), "{other}");
        let (mut recording, facts) = (fleet(true), facts(true));
        recording.clock.clear();
        let (summary, clock) = (summarise(&recording, &facts), summarise_clock(&recording));
        let (facts, mission_toml) = (&facts, "");
        let (figures, theory, notes, reproduce) = (&[], &[], &[], &[]);
        let report =
            Report { facts, summary: &summary, clock: &clock, figures, theory, notes, reproduce, mission_toml };
        assert!(super::report(&report).contains("<th>delay [s]</th><th>up</th>"));
    }

    #[test]
    fn all_text_is_escaped() {
        let row = TheoryRow { name: "<i>".into(), condition: "a < b & c".into(), ..TheoryRow::default() };
        let page = page(false, &[row]);
        for text in ["<b>bold", "<i>", "<5 %", "<ξ"] {
            assert!(!page.contains(text), "{text}");
        }
        for text in ["a &lt; b &amp; c", "&lt;5 % &amp; more", "&lt;ξ = 12.5&gt;"] {
            assert!(page.contains(text), "{text}");
        }
    }

    #[test]
    fn a_condition_that_does_not_hold_asks_for_attention() {
        let page = page(false, &[TheoryRow { holds: Some(false), ..TheoryRow::default() }]);
        assert!(page.contains("verdict attention") && page.contains("1 condition of the theory does not hold"));
    }

    #[test]
    fn what_is_no_number_is_not_printed() {
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(number), ["–"; 3]);
        let row = TheoryRow { predicted: "-NaN m".into(), measured: "inf".into(), ..TheoryRow::default() };
        let page = page(false, &[row]);
        for text in ["NaN", ">inf<"] {
            assert!(!page.contains(text), "{text}");
        }
        assert_eq!(told("information from infinity"), "information from infinity");
        assert_eq!(told(&format!("{:.5} 1/s, 0.25 m", -1.5e137)), "-1.500e137 1/s, 0.25 m");
    }

    #[test]
    fn a_number_that_is_not_of_the_end_has_its_instant() {
        let (mut recording, facts) = (fleet(true), facts(true));
        let last = recording.exact.iter().map(common::record::Record::t_ns).max().expect("rows");
        let of_v2 = |row: &common::record::Record| matches!(row, common::record::Record::State(row) if *row.vehicle == *"v2" && row.t_ns > last / 4);
        recording.exact.retain(|row| !of_v2(row));
        let summary = summarise(&recording, &facts);
        let at = summary.fleet.coordination.early(facts.duration_s).expect("before the end");
        let page = report(&Report {
            facts: &facts,
            summary: &summary,
            clock: &summarise_clock(&recording),
            figures: &[],
            theory: &[],
            notes: &[],
            reproduce: &[],
            mission_toml: "",
        });
        assert!(page.contains(&format!("at {} s, when all were last recorded", number(at))), "{at}");
        assert!(page.contains("verdict attention"));
        assert!(page.contains("v2 recorded nothing after "));
    }

    #[test]
    fn numbers_are_short() {
        let written = [0.0, 0.5, -12.345_67, 0.001_234_56, 3.1e-4, 123_456.7, 2.5e7, 100.0].map(number);
        let expected = ["0", "0.5", "−12.35", "0.001235", "3.1·10<sup>−4</sup>", "123457", "2.5·10<sup>7</sup>", "100"];
        assert_eq!(written, expected);
    }
}
