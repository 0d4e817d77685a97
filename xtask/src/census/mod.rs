//! `cargo xtask census`: sizes of pages, command line and code, compared with their bounds and the
//! earlier sizes.

mod code;
mod prose;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::run::root;

/// Measures that have an upper bound.
const BOUNDS: [(&str, f64); 12] = [
    ("words on all pages", 36_000.0),
    ("words in a sentence, mean", 18.0),
    ("lines of README.md", 90.0),
    ("options of hapterra", 65.0),
    ("options in hapterra run -h", 24.0),
    ("lines of hapterra run -h", 60.0),
    ("circles of files in core", 0.0),
    ("circles of files in firmware", 0.0),
    ("circles of files in heightfield", 0.0),
    ("circles of files in heightfield-gdal", 0.0),
    ("circles of files in touch", 0.0),
    ("circles of files in host-tools", 0.0),
];
/// Tolerance of the committed table, as a share of each measure.
const MAX_STALE: f64 = 0.02;
const TABLE: &str = "docs/contributing/census.csv";
/// Folders with code, in the order of the data flow.
const ROOMS: [&str; 14] = [
    "core",
    "firmware",
    "heightfield",
    "heightfield-gdal",
    "touch",
    "host-tools",
    "c",
    "python",
    "page",
    "view",
    "tests",
    "bench",
    "fuzz",
    "xtask",
];
/// Folders of libraries for other programs.
const LIBRARIES: [&str; 6] = [
    "core",
    "firmware",
    "heightfield",
    "heightfield-gdal",
    "touch",
    "host-tools",
];
/// Folders of build results.
const BUILT: [&str; 3] = ["target", "node_modules", ".git"];

type Measures = Vec<(String, f64)>;

/// Prints all measures beside those of the committed table, and compares them with it and with
/// their bounds; `write` updates the table.
///
/// # Errors
/// The exceeded bounds, and the outdated parts of the table.
pub(crate) fn census(write: bool) -> Result<()> {
    let pages = prose::pages(root())?;
    for (path, page) in &pages {
        println!("{:8} words  {}", page.words, path.display());
    }
    for library in LIBRARIES {
        for import_cycle in code::import_cycles(&root().join(library).join("src"))? {
            println!("circle in {library}: {}", import_cycle.join(", "));
        }
    }
    let measures = measures(root(), &pages)?;
    let path = root().join(TABLE);
    let recorded = table(&fs::read_to_string(&path).context(TABLE)?);
    let mut faults = prose::faults(&pages);
    faults.extend(broken(&measures));
    let mut text = "measure,before,now\n".to_owned();
    for (name, now) in &measures {
        let [before, old] = { recorded.iter().find(|row| row[0] == *name) }
            .map_or(["", ""], |row| [&row[1], &row[2]]);
        println!("{before:>8} -> {now:<8} {name}");
        text += &format!("\"{name}\",{before},{now}\n");
        let is_old = old
            .parse()
            .map_or(true, |old: f64| (old - now).abs() > MAX_STALE * now);
        if is_old && !write {
            faults.push(format!(
                "{TABLE}: {name} is {now}, not {old:?}: type cargo xtask census --write"
            ));
        }
    }
    if write {
        fs::write(&path, text).context(TABLE)?;
    }
    match faults.is_empty() {
        true => Ok(()),
        false => bail!("{}", faults.join("\n")),
    }
}

/// Returns sentences on the measures above their bounds.
fn broken(measures: &Measures) -> Vec<String> {
    let above = measures.iter().filter_map(|(name, now)| {
        let (_, bound) = BOUNDS.iter().find(|(bounded, _)| bounded == name)?;
        (now > bound).then(|| format!("{now} {name}, at most {bound}"))
    });
    above.collect()
}

fn measures(root: &Path, pages: &[(PathBuf, prose::Page)]) -> Result<Measures> {
    let all = prose::total(pages);
    let mean = all.words_in_sentences as f64 / all.sentences.max(1) as f64;
    let readme = pages
        .iter()
        .find(|(path, _)| path.ends_with("README.md") && path.iter().count() == 1);
    let mut measures: Measures = vec![
        ("pages".into(), pages.len() as f64),
        ("words on all pages".into(), all.words as f64),
        (
            "words in a sentence, mean".into(),
            (10.0 * mean).round() / 10.0,
        ),
        (
            "words in the longest sentence".into(),
            all.longest_sentence as f64,
        ),
        (
            "characters in the longest line".into(),
            all.longest_line as f64,
        ),
        (
            "lines of README.md".into(),
            readme.map_or(0, |(_, page)| page.lines) as f64,
        ),
    ];
    measures.extend(command_line(root)?);
    for library in LIBRARIES {
        let folder = root.join(library);
        let import_cycles = code::import_cycles(&folder.join("src"))?.len();
        measures.push((
            format!("circles of files in {library}"),
            import_cycles as f64,
        ));
        let public = code::code(&folder)?.public;
        measures.push((format!("public items of {library}"), public as f64));
    }
    for room in ROOMS {
        let code = code::code(&root.join(room))?;
        measures.push((format!("lines of code in {room}"), code.lines as f64));
        measures.push((format!("lines of tests in {room}"), code.tests as f64));
    }
    Ok(measures)
}

/// Returns the sizes of the command line, from its generated page.
fn command_line(root: &Path) -> Result<Measures> {
    const PAGE: &str = "docs/reference/command-line.md";
    let text = fs::read_to_string(root.join(PAGE)).context(PAGE)?;
    let rows = text.lines().filter_map(|line| {
        let (name, value) = line
            .strip_prefix("| ")?
            .strip_suffix(" |")?
            .split_once(" | ")?;
        Some((name.replace('`', ""), value.parse().ok()?))
    });
    Ok(rows.collect())
}

/// Returns the rows of a table whose first cells are in quotes.
fn table(text: &str) -> Vec<[String; 3]> {
    let rows = text.lines().skip(1).filter_map(|line| {
        let (name, values) = line.strip_prefix('"')?.split_once("\",")?;
        let (before, now) = values.split_once(',')?;
        Some([name, before, now].map(str::to_owned))
    });
    rows.collect()
}

/// Returns the files in a folder and below it, except build results.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = vec![];
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let entry = entry?;
            let name = entry.file_name();
            match entry.file_type()?.is_dir() {
                true if BUILT.iter().any(|built| name == *built) => {}
                true => folders.push(entry.path()),
                false => found.push(entry.path()),
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_above_their_bounds_are_named() {
        let measures = |words| vec![("words on all pages".to_owned(), words)];
        assert!(broken(&measures(36_000.0)).is_empty());
        let faults = broken(&measures(36_001.0));
        assert_eq!(faults, ["36001 words on all pages, at most 36000"]);
    }

    #[test]
    fn names_with_commas_are_read_again() {
        let rows = table("measure,before,now\n\"words, mean\",,10.5\n");
        assert_eq!(rows, [["words, mean", "", "10.5"]]);
    }

    #[test]
    fn bounds_are_of_known_measures() {
        let measures = measures(root(), &prose::pages(root()).expect("pages")).expect("measured");
        for (name, _) in BOUNDS {
            assert!(measures.iter().any(|(known, _)| known == name), "{name}");
        }
    }
}
