//! Figures in a Markdown page that come from a committed table, and whether they
//! are still what the table says.
//!
//! A figure is marked by a comment right before it, which no reader of the page
//! sees:
//!
//! ```markdown
//! sliding takes <!-- from bench/instructions-m4f.csv: sliding, median -->218 instructions
//! ```
//!
//! The comment names the table (a CSV file, from the repository's root), the row by
//! its first column, and after the last comma the column by its title. A row that
//! the first column alone does not tell is named by as many first columns as it
//! takes, with ` / ` between them:
//!
//! ```markdown
//! <!-- from docs/bench.csv: 525 × 525 / slide 0.01 / hapterra swept, times_plain -->0.72
//! ```
//!
//! The figure may be rounded: it must be the table's value to the digits shown. It
//! may have commas between its thousands, and an exponent (`2e-6`).

use std::path::Path;

const BEGIN: &str = "<!-- from ";
const END: &str = "-->";

/// How many figures a page has, and a sentence for each that is not what its table
/// says, or that cannot be looked up.
#[must_use]
pub fn check(page: &str, root: &Path) -> (usize, Vec<String>) {
    let marks: Vec<&str> = page.split(BEGIN).skip(1).collect();
    let wrong = marks.iter().filter_map(|mark| figure(mark, root).err());
    (marks.len(), wrong.collect())
}

/// Looks up one figure: what follows [`BEGIN`].
fn figure(mark: &str, root: &Path) -> Result<(), String> {
    let (source, rest) = mark.split_once(END).ok_or("a comment without an end")?;
    let source = source.trim();
    let is_figure = |c: char| c.is_ascii_digit() || "+-.,e".contains(c);
    let end = rest.find(|c| !is_figure(c)).unwrap_or(rest.len());
    let shown = rest[..end].trim_end_matches(['.', ',', '-']);
    let kept = look_up(source, root).map_err(|why| format!("{source}: {why}"))?;
    match is_rounded(shown, kept) {
        Some(true) => Ok(()),
        Some(false) => Err(format!("{source}: the page says {shown}, the table {kept}")),
        None => Err(format!(
            "{source}: no figure behind the comment, but {shown:?}"
        )),
    }
}

/// The value that `TABLE: ROW, COLUMN` names.
fn look_up(source: &str, root: &Path) -> Result<f64, String> {
    let (table, place) = source.split_once(": ").ok_or("no table is named")?;
    let (row, column) = place.rsplit_once(", ").ok_or("no column is named")?;
    let mut table = csv::Reader::from_path(root.join(table)).map_err(|why| why.to_string())?;
    let titles = table.headers().map_err(|why| why.to_string())?;
    let column = titles.iter().position(|title| title == column);
    let column = column.ok_or("there is no such column")?;
    let names: Vec<&str> = row.split(" / ").collect();
    let rows = table.records().filter_map(Result::ok);
    let mut found = rows.filter(|row| row.iter().take(names.len()).eq(names.iter().copied()));
    let row = found.next().ok_or("there is no such row")?;
    if found.next().is_some() {
        return Err("more than one row is called that".to_owned());
    }
    let value = row.get(column).unwrap_or_default();
    value.parse().map_err(|_| format!("{value:?} is no number"))
}

/// Whether a figure is `value` to the digits that it shows; `None` if it is none.
fn is_rounded(shown: &str, value: f64) -> Option<bool> {
    let shown = shown.replace(',', "");
    let (mantissa, exponent) = shown.split_once('e').unwrap_or((&shown, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, part)| part.len());
    let last_digit = 10_f64.powi(exponent.parse::<i32>().ok()? - decimals as i32);
    let figure: f64 = shown.parse().ok()?;
    // A hair more: half a digit has no exact binary fraction.
    Some((figure - value).abs() <= 0.5 * last_digit * (1.0 + 1e-9))
}
