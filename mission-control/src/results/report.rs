//! `report.html`: a run on one page, in one file, without a script.

use std::fmt::Write as _;

use serde::Serialize;

use super::decay::fitted_where;
use super::graph::printed;
use super::html::{STYLE, escape, inline, number, optional, percent, table, told};
use super::verdict::verdict;
use super::{
    ClockSummary, DeadlineSummary, DeliverySummary, Facts, Figure, FleetSummary, GraphFacts, LinkSummary,
    MessageCounts, OverrunSummary, Summary, VehicleSummary,
};

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
    let entries = [
        ("flown", flown(summary)),
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

/// By how many vehicles, and how long; by how many of them to the end, if not all were.
fn flown(summary: &Summary) -> String {
    let (vehicles, lost) = (summary.vehicles.len(), summary.fleet.lost.len() + summary.fleet.aborted.len());
    let plural = if vehicles == 1 { "" } else { "s" };
    let to_the_end = match vehicles.saturating_sub(lost) {
        whole if whole == vehicles => String::new(),
        0 => ", none to the end".to_owned(),
        whole => format!(", {whole} to the end"),
    };
    format!("{vehicles} vehicle{plural}{to_the_end}, {} s", number(summary.duration_s))
}

fn theory(page: &mut String, rows: &[TheoryRow]) {
    if rows.is_empty() {
        return;
    }
    page.push_str("<section>\n<h2>Theory beside measurement</h2>\n");
    let header = ["statement", "condition", "here", "covered", "guaranteed", "measured"];
    let rows = rows.iter().map(|row| {
        let covered = match row.holds {
            Some(true) => "<span class=\"yes\">yes</span>",
            Some(false) => "<span class=\"no\">no</span>",
            None => "–",
        };
        let text =
            [&row.name, &row.condition, &row.value, &row.predicted, &row.measured].map(|text| escape(&told(text)));
        let [name, condition, value, predicted, measured] = text;
        let measured = if row.is_below() { format!("<span class=\"no\">{measured}</span>") } else { measured };
        vec![name, condition, value, covered.into(), predicted, measured]
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

/// A column of the table of links: its name, what it counts, and whether it is there although nothing was counted.
type Column = (&'static str, fn(&MessageCounts) -> u64, bool);

/// What can always happen has a column, the rest only where it did.
const COLUMNS: [Column; 12] = [
    ("sent", |counts| counts.sent, true),
    ("delivered", |counts| counts.delivered, true),
    ("lost", |counts| counts.lost, true),
    ("out of range", |counts| counts.out_of_range, false),
    ("link down", |counts| counts.link_down, true),
    ("queue full", |counts| counts.queue_full, true),
    ("deaf while speaking", |counts| counts.half_duplex, false),
    ("collided", |counts| counts.collision, false),
    ("corrupt", |counts| counts.corrupt, false),
    ("receiver absent", |counts| counts.receiver_absent, false),
    ("in flight", |counts| counts.in_flight, true),
    ("second copies", |counts| counts.copied, false),
];

/// Most links in the table.
const MOST_LINKS: usize = 300;

fn network(page: &mut String, report: &Report<'_>) {
    let links = &report.summary.links;
    if links.is_empty() {
        return;
    }
    page.push_str("<section>\n<h2>Network</h2>\n");
    let totals = &report.summary.fleet.messages;
    let columns: Vec<&Column> =
        COLUMNS.iter().filter(|(_, count, always)| *always || count(&totals.counts) > 0).collect();
    let counted = |counts: &MessageCounts| -> Vec<String> {
        columns.iter().map(|(_, count, _)| count(counts).to_string()).collect()
    };
    let mut header = vec!["link"];
    header.extend(columns.iter().map(|column| column.0));
    // On a real clock the achieved delay stands beside the commanded one.
    let clock = &report.clock.links;
    if clock.is_empty() {
        header.push("delay [s]");
    } else {
        header.extend(["commanded delay [s]", "late [ms], median, 99 %"]);
    }
    let late_ms = |deliveries: Option<&DeliverySummary>| match deliveries.map(|deliveries| deliveries.late_s) {
        Some(late) => format!("{}, {}", number(late.median * 1e3), number(late.p99 * 1e3)),
        None => "–".to_owned(),
    };
    header.extend(["up", "longest outage [s]", "ledger"]);
    let row = |link: &LinkSummary| {
        let ledger =
            if link.balanced { "<span class=\"yes\">balanced</span>" } else { "<span class=\"no\">open</span>" };
        let mut cells = vec![format!("{}&nbsp;→&nbsp;{}", escape(&link.from), escape(&link.to))];
        cells.extend(counted(&link.messages));
        cells.push(optional(link.delay.map(|delay| delay.median), ""));
        if !clock.is_empty() {
            let own = clock.iter().find(|own| own.from == link.from && own.to == link.to);
            cells.push(late_ms(own.map(|own| &own.deliveries)));
        }
        cells.extend([percent(link.up_fraction), number(link.longest_outage_s), ledger.into()]);
        cells
    };
    let sum = (links.len() > 1).then(|| {
        let mut cells = vec!["all".to_owned()];
        cells.extend(counted(&totals.counts));
        cells.push(String::new());
        if !clock.is_empty() {
            cells.push(late_ms(report.clock.deliveries.as_ref()));
        }
        cells.extend(["", "", ""].map(str::to_owned));
        cells
    });
    // A complete graph of two hundred vehicles would be a page of its own.
    let mut shown: Vec<&LinkSummary> = links.iter().collect();
    if shown.len() > MOST_LINKS {
        shown.sort_by_key(|link| std::cmp::Reverse(link.messages.sent.saturating_sub(link.messages.delivered)));
        shown.truncate(MOST_LINKS);
    }
    table(page, "numbers", &header, shown.iter().map(|link| row(link)).chain(sum));
    let hidden = (shown.len() < links.len()).then(|| {
        let (few, all) = (shown.len(), links.len());
        format!("The {few} of {all} links that delivered least; all are in <code>summary.json</code>. ")
    });
    let remark = hidden.unwrap_or_default() + &on_the_air(&report.summary.fleet);
    let _ = write!(page, "<p class=\"remark\">{remark}</p>\n</section>\n");
}

/// What was transmitted, and what it left of the fleet's connectivity.
fn on_the_air(fleet: &FleetSummary) -> String {
    let totals = &fleet.messages;
    let mut text = format!(
        "{} transmissions of at most {} bytes: {} bytes on the air.",
        totals.transmissions, totals.message_bytes, totals.bytes_on_air
    );
    if let Some(connectivity) = fleet.connectivity {
        let _ = write!(text, " Measured loss of connectivity: α = {}", number(connectivity.alpha));
        if let Some(t_0_s) = connectivity.t_0_s {
            let _ = write!(text, ", T<sub>0</sub> = {} s", number(t_0_s));
        }
        if let Some(t_s) = connectivity.t_s {
            let _ = write!(text, "; connected in the union over every {} s", number(t_s));
        }
        text.push('.');
    }
    text
}

fn clock(page: &mut String, clock: &ClockSummary) {
    let Some(verdict) = &clock.verdict else { return };
    page.push_str("<section>\n<h2>On the clock</h2>\n");
    let class = if verdict.kept_time { "good" } else { "attention" };
    let _ = writeln!(page, "<p class=\"verdict {class}\">{}</p>", escape(&verdict.text));
    if !clock.deadlines.is_empty() {
        let row = |deadlines: &DeadlineSummary| {
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
        let row = |overrun: &OverrunSummary| {
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

/// The path-following error at the end, with the instant if the vehicle did not last.
fn at_end(vehicle: &VehicleSummary, duration_s: f64) -> String {
    let error = number(vehicle.path_error_final_m);
    vehicle.early(duration_s).map_or(error.clone(), |at| format!("{error} (at {} s)", number(at)))
}

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
        assert_eq!(page.matches("<svg").count(), 4);
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
        assert!(page.contains("<th>commanded delay [s]</th><th>late [ms], median, 99 %</th>"));
        assert!(row.contains("<td>5</td><td>0.06, 2</td>"), "{row}");
        let other = page.lines().find(|line| line.starts_with("<tr><td>v2&nbsp;→&nbsp;v1")).expect("a row");
        assert!(other.contains("<td>5</td><td>–</td>"), "{other}");
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
        assert!(
            page.contains("verdict attention") && page.contains("1 statement of the theory does not cover this flight")
        );
    }

    #[test]
    fn what_is_no_number_is_not_printed() {
        let row = TheoryRow { predicted: "-NaN m".into(), measured: "inf".into(), ..TheoryRow::default() };
        let page = page(false, &[row]);
        for text in ["NaN", ">inf<"] {
            assert!(!page.contains(text), "{text}");
        }
    }

    fn page_of(recording: &bus::recording::Recording, facts: &Facts) -> String {
        report(&Report {
            facts,
            summary: &summarise(recording, facts),
            clock: &summarise_clock(recording),
            figures: &[],
            theory: &[],
            notes: &[],
            reproduce: &[],
            mission_toml: "",
        })
    }

    #[test]
    fn the_head_says_who_was_lost_and_of_whom_the_numbers_are() {
        use common::record::Record;
        let (mut recording, facts) = (fleet(true), facts(true));
        let after = |record: &Record| match record {
            Record::State(row) => *row.vehicle == *"v3",
            Record::Message(row) => *row.from == *"v3" && row.sent_ns > 200_000_000_000,
            _ => false,
        };
        recording.exact.retain(|record| !after(record));
        let page = page_of(&recording, &facts);
        let said = "<strong>v3 was lost at 200 s</strong>, and there is no log of it: the numbers are of v1 and v2.";
        assert!(page.contains(said) && page.contains("verdict attention"), "{page}");
        assert!(page.contains("3 vehicles, 2 to the end, 400 s"));
        let row = page.lines().find(|line| line.starts_with("<tr><td>v3</td>")).expect("a row");
        assert!(row.contains("<td>–</td>") && !row.contains("<td>0</td>") && !row.contains('%'), "{row}");
    }

    #[test]
    fn the_head_says_that_a_flight_was_stopped_and_its_speed_changed() {
        use common::record::{ClockRecord, NoteRow};
        let mut recording = fleet(true);
        let (text, source) = ("flight ended: stopped by mission-control".to_owned(), "network-emulator".to_owned());
        recording.clock.push(ClockRecord::Note(NoteRow { t_ns: 400_000_000_000, source, text, count: 1 }));
        let facts = Facts { planned_s: 800.0, commanded: vec![(60.0, 0.4)], ..facts(true) };
        let page = page_of(&recording, &facts);
        assert!(page.contains("<strong>Stopped by mission-control</strong> at 400 of 800 s."), "{page}");
        assert!(page.contains("v_L was changed under way to 0.4 /s at 60 s.") && page.contains("verdict attention"));
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
        // It was heard to the end: its log was cut, not the vehicle lost.
        assert!(page.contains("<strong>The log of v2 ends at 100 s</strong>"), "{page}");
    }
}
