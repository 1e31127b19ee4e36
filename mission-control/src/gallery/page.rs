//! The page: every figure with what its source says of it, and the numbers expected beside those measured. As HTML for a
//! browser, and as Markdown for who reads the repository.

use std::fmt::Write as _;

use crate::results::html::{STYLE, escape, number, table};

use super::file::{Expectation, FigureSection, GalleryFile};
use super::numbers::Verdict;

/// A figure as it is shown.
pub(super) struct Shown<'a> {
    pub(super) figure: &'a FigureSection,
    pub(super) verdicts: Vec<Verdict>,
    /// Why it could not be made, if it could not.
    pub(super) missing: Option<String>,
}

impl Shown<'_> {
    fn agrees(&self) -> bool {
        self.missing.is_none() && self.verdicts.iter().all(|verdict| verdict.agrees)
    }

    /// Each number expected: what, expected, measured, whether they agree, where from.
    fn rows(&self) -> impl Iterator<Item = [String; 5]> {
        self.figure.expect.iter().zip(&self.verdicts).map(|(expectation, verdict)| {
            let what = match (&expectation.mission, self.figure.missions.len()) {
                (Some(mission), 2..) => {
                    let at = self.figure.missions.iter().position(|name| name == mission).unwrap_or(0);
                    let label = self.figure.labels.get(at).unwrap_or(mission);
                    format!("{}: {}", escape(label), escape(&expectation.what))
                }
                _ => escape(&expectation.what),
            };
            let agrees = if verdict.agrees { "agrees" } else { "<strong>disagrees</strong>" };
            let source = escape(&expectation.source);
            [what, expected(expectation), measured(expectation, verdict), agrees.into(), source]
        })
    }

    fn commands(&self, folder: &str) -> String {
        let line = |name: &String| format!("mission-control simulate {folder}/{name}.toml");
        self.figure.missions.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

fn expected(expectation: &Expectation) -> String {
    let text = match (expectation.value, expectation.within, expectation.at_least, expectation.at_most) {
        (Some(value), Some(within), ..) => format!("{} ± {}", number(value), number(within)),
        (_, _, Some(least), Some(most)) => format!("{} to {}", number(least), number(most)),
        (_, _, Some(least), None) => format!("≥ {}", number(least)),
        (_, _, None, Some(most)) => format!("≤ {}", number(most)),
        _ => "–".into(),
    };
    with_unit(text, expectation)
}

/// More values than this are told by their range.
const MOST_VALUES: usize = 4;

fn measured(expectation: &Expectation, verdict: &Verdict) -> String {
    let values = || verdict.measured.iter().map(|(_, value)| *value);
    let text = |value: f64| if value.is_finite() { number(value) } else { "none".into() };
    let list = match verdict.measured.len() {
        0 => "nothing".into(),
        1 => text(values().next().unwrap_or(f64::NAN)),
        2..=MOST_VALUES => values().map(text).collect::<Vec<_>>().join(", "),
        _ => {
            let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            format!("{} to {}", text(low), text(high))
        }
    };
    with_unit(list, expectation)
}

fn with_unit(text: String, expectation: &Expectation) -> String {
    if expectation.unit.is_empty() { text } else { format!("{text} {}", escape(&expectation.unit)) }
}

const HEADER: [&str; 5] = ["quantity", "expected", "measured", "", "source"];

/// What is true of the page as a whole.
fn verdict(shown: &[Shown<'_>]) -> (bool, String) {
    let total: usize = shown.iter().map(|figure| figure.verdicts.len()).sum();
    let agree = shown.iter().flat_map(|figure| &figure.verdicts).filter(|verdict| verdict.agrees).count();
    let made = shown.iter().filter(|figure| figure.missing.is_none()).count();
    let sentence = format!("{made} of {} figures made; {agree} of {total} expected numbers agree.", shown.len());
    (made == shown.len() && agree == total, sentence)
}

/// The page for a browser; the pictures lie beside it.
pub(super) fn html(file: &GalleryFile, shown: &[Shown<'_>], folder: &str) -> String {
    let title = escape(&file.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>{STYLE}{MORE_STYLE}</style>\n\
         </head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n<p class=\"lead\">{}</p>\n",
        escape(&file.about)
    );
    let (good, sentence) = verdict(shown);
    let class = if good { "good" } else { "attention" };
    let _ = writeln!(page, "<p class=\"verdict {class}\">{sentence}</p>");
    page.push_str("<ul class=\"contents\">\n");
    for figure in shown {
        let sign = if figure.agrees() { "✓" } else { "✗" };
        let FigureSection { id, source, title, .. } = figure.figure;
        let _ = writeln!(page, "<li>{sign} <a href=\"#{id}\">{}</a> {}</li>", escape(source), escape(title));
    }
    page.push_str("</ul>\n</header>\n");
    for shown in shown {
        let FigureSection { id, source, title, says, note, .. } = shown.figure;
        let _ = writeln!(page, "<section id=\"{id}\">\n<h2>{}: {}</h2>", escape(source), escape(title));
        match &shown.missing {
            Some(reason) => {
                let _ = writeln!(page, "<p class=\"verdict attention\">Not made: {}</p>", escape(reason));
            }
            None => {
                let _ = writeln!(
                    page,
                    "<figure><img src=\"{id}.svg\" alt=\"{}\" loading=\"lazy\"></figure>",
                    escape(title)
                );
            }
        }
        let _ = writeln!(page, "<p>{}</p>", escape(says));
        if !note.is_empty() {
            let _ = writeln!(page, "<p class=\"note\">{}</p>", escape(note));
        }
        if !shown.verdicts.is_empty() {
            table(&mut page, "numbers", &HEADER, shown.rows().map(Vec::from));
        }
        let _ = writeln!(page, "<pre><code>{}</code></pre>\n</section>", escape(&shown.commands(folder)));
    }
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

/// The page for who reads the repository.
pub(super) fn markdown(file: &GalleryFile, shown: &[Shown<'_>], folder: &str) -> String {
    let mut page = format!("# {}\n\n{}\n\n", plain(&file.title), plain(&file.about));
    let _ = writeln!(page, "**{}**\n", verdict(shown).1);
    let _ = writeln!(page, "Made by `mission-control gallery {folder}`.\n");
    for figure in shown {
        let sign = if figure.agrees() { "✓" } else { "✗" };
        let FigureSection { id, source, title, .. } = figure.figure;
        let _ = writeln!(page, "- {sign} [{}](#{id}) {}", plain(source), plain(title));
    }
    for shown in shown {
        let FigureSection { id, source, title, says, note, .. } = shown.figure;
        let _ = writeln!(page, "\n<a id=\"{id}\"></a>\n\n## {}: {}\n", plain(source), plain(title));
        match &shown.missing {
            Some(reason) => page.push_str(&format!("**Not made: {}**\n\n", plain(reason))),
            None => page.push_str(&format!("![{}]({id}.svg)\n\n", plain(title))),
        }
        let _ = writeln!(page, "{}\n", plain(says));
        if !note.is_empty() {
            let _ = writeln!(page, "*{}*\n", plain(note));
        }
        if !shown.verdicts.is_empty() {
            let _ = writeln!(page, "| {} |\n|---|---|---|---|---|", HEADER.join(" | "));
            for row in shown.rows() {
                let _ = writeln!(page, "| {} |", row.map(|cell| cell.replace('|', "\\|")).join(" | "));
            }
            page.push('\n');
        }
        let _ = writeln!(page, "```sh\n{}\n```", shown.commands(folder));
    }
    page
}

/// Text that means itself in Markdown, apart from marks that the gallery file may use on purpose.
fn plain(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

const MORE_STYLE: &str = "
figure { margin: 1rem 0; background: #fff; border-radius: 6px; padding: .5rem; }
figure img { display: block; width: 100%; height: auto; }
.contents { padding-left: 0; list-style: none; columns: 2 22rem; }
.note { color: var(--soft); }
";
