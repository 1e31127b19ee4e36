//! What the documents of the repository point to is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Files that the reader makes.
const MADE_BY_THE_READER: [&str; 1] = ["missions/two-abreast.toml"];
/// Files that the programs write, most of them into a run folder.
const WRITTEN: [&str; 9] = [
    "mission.toml",
    "host.json",
    "summary.json",
    "theory.json",
    "clock.json",
    "report.html",
    "rate.svg",
    "network.toml",
    "figures/links.svg",
];
/// What a path to a file of ours ends with.
const ENDINGS: [&str; 6] = ["rs", "toml", "md", "svg", "json", "html"];
/// What is built or flown is not ours.
const NOT_OURS: [&str; 3] = ["target", "runs", "logs"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// What is in a folder, but for what is hidden, built or flown.
fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("lists").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| !name_of(path).starts_with('.') && !NOT_OURS.contains(&name_of(path).as_str())).collect()
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let within = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![path] };
    listed(folder).into_iter().flat_map(within).collect()
}

/// What stands in backticks on one line of a text.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.lines().flat_map(|line| line.split('`').skip(1).step_by(2))
}

/// Where the links of a text lead, those to other sites and to places on the same page left out.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#', ' ']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://") && !target.contains('\n'))
}

/// Whether a quoted text is the path of a file or folder of ours.
fn is_path(text: &str, tops: &BTreeSet<String>) -> bool {
    let plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
    let ending = text.rsplit_once('.').is_some_and(|(before, ending)| !before.is_empty() && ENDINGS.contains(&ending));
    let below = text.split_once('/').is_some_and(|(top, _)| tops.contains(top));
    plain && !text.starts_with(['/', '.']) && (below || ending)
}

#[test]
fn every_path_and_link_in_the_documents_leads_somewhere() {
    let all = files(root());
    let names: BTreeSet<String> = all.iter().map(|path| name_of(path)).collect();
    let tops: BTreeSet<String> = listed(root()).iter().map(|path| name_of(path)).collect();
    let (mut count, mut missing) = (0, Vec::new());
    for document in all.iter().filter(|path| path.extension().is_some_and(|ending| ending == "md")) {
        let text = fs::read_to_string(document).expect("reads");
        let here = document.parent().expect("a folder");
        // The index of equations leaves out where most files are.
        let bases = [root().to_path_buf(), here.to_path_buf(), root().join("common/src")];
        for path in quoted(&text).filter(|text| is_path(text, &tops)) {
            count += 1;
            // A name alone is that of a file somewhere.
            let named = !path.contains('/') && names.contains(path);
            if !(named
                || WRITTEN.contains(&path)
                || MADE_BY_THE_READER.contains(&path)
                || bases.iter().any(|base| base.join(path).exists()))
            {
                missing.push(format!("{}: `{path}`", document.display()));
            }
        }
        for link in links(&text) {
            count += 1;
            if !here.join(link).exists() {
                missing.push(format!("{}: ({link})", document.display()));
            }
        }
    }
    assert!(count > 300 && missing.is_empty(), "{count} paths and links, missing: {missing:#?}");
}
