//! What a sweep found, as a page in Markdown.

use std::fmt::Write as _;

use super::Swept;
use super::cells::REPLAY;
use super::finding;
use super::measure::MEASURES;
use super::plan::Plan;
use super::setting::shown;

/// More cells than this are left to `cells.csv`.
const MOST_CELLS: usize = 200;

/// The page of a sweep.
pub(super) fn page(plan: &Plan, swept: &Swept, measure: usize, command: &str, pictured: bool) -> String {
    let mut page = format!("# {}\n\n", plan.mission.name);
    if !plan.mission.about.is_empty() {
        let _ = writeln!(page, "{}\n", plan.mission.about);
    }
    if let Some(found) = finding::of_sweep(plan, &swept.cells, measure) {
        let _ = writeln!(page, "**{found}**\n");
    }
    table(&mut page, plan, swept, measure, pictured.then_some("sweep.svg"));
    how(&mut page, plan, command);
    page
}

/// Picture and numbers of a sweep.
pub(super) fn table(page: &mut String, plan: &Plan, swept: &Swept, measure: usize, picture: Option<&str>) {
    let about = MEASURES[measure].about;
    match picture {
        Some(picture) => {
            let _ = writeln!(page, "![{about}]({picture})\n");
        }
        None => page.push_str(
            "No picture: there are pictures of one, two and three swept keys that have a value to draw, with up to nine values of the \
             first of three.\n\n",
        ),
    }
    if swept.cells.len() > MOST_CELLS {
        let _ = writeln!(page, "The numbers of the {} cells are in cells.csv.\n", swept.cells.len());
        return;
    }
    let _ = writeln!(page, "{}:\n", capitalised(about));
    let keys: Vec<&str> = plan.settings.iter().map(|setting| setting.key.as_str()).collect();
    let lead = keys.iter().map(|key| format!("{key} | ")).collect::<String>();
    let _ =
        writeln!(page, "| {lead}median | its 95 % interval from | to | 5 % quantile | 95 % quantile | mean | runs |");
    let _ = writeln!(page, "|{}", "---|".repeat(keys.len() + 7));
    for (cell, statistics) in plan.cells.iter().zip(&swept.cells) {
        let values: String = cell.values.iter().map(|value| format!("{} | ", shown(value))).collect();
        let numbers = match statistics.spreads[measure] {
            Some(s) => {
                let (from, to) = s.sure.map(|(from, to)| (short(from), short(to))).unwrap_or(("–".into(), "–".into()));
                [short(s.median), from, to, short(s.low), short(s.high), short(s.mean)].join(" | ")
            }
            None => "– | – | – | – | – | –".into(),
        };
        let _ = writeln!(page, "| {values}{numbers} | {} |", statistics.finished);
    }
    page.push_str(
        "\nThe interval is the confidence interval of the median at 95 %, from the ranks of the runs: it takes no shape of their \
         distribution for granted, and needs six runs. It is the band, or the bar, in pictures.\n\n",
    );
}

/// How the sweep is made again, and each run of it.
pub(super) fn how(page: &mut String, plan: &Plan, command: &str) {
    let runs = plan.cells.len() * plan.repeats as usize;
    let seeds = match plan.paired {
        false => {
            "The seed of a run follows from the mission's seed, the values of its cell and the number of the repeat"
        }
        true => {
            "The runs are paired: the seed of a run follows from the mission's seed and the number of the repeat alone, so that all cells \
             meet the same random numbers"
        }
    };
    let _ = write!(
        page,
        "{runs} runs, {} of each cell; made by\n\n```sh\n{command}\n```\n\n{seeds}; it is in runs.csv. The command that flies the first run of a cell again is \
         in cells.csv, in the column {REPLAY}; with another `--seed` from runs.csv it flies another run of that cell. Of the last \
         cell it is\n\n```sh\n{}\n```\n",
        plan.repeats,
        plan.replay(plan.cells.len() - 1, 0)
    );
}

fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// Four digits.
pub(super) fn short(value: f64) -> String {
    to_digits(value, 4)
}

/// A number with so many digits that matter.
pub(super) fn to_digits(value: f64, digits: u32) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e7).contains(&magnitude) {
        let decimals = (f64::from(digits) - 1.0 - magnitude.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}
