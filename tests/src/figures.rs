//! Compares the figures of a Markdown page with the committed tables they are taken from.
//!
//! A comment before a figure names its source. It is invisible on the rendered page:
//!
//! ```markdown
//! sliding takes <!-- from bench/instructions-m4f.csv: sliding, median -->218 instructions
//! ```
//!
//! The comment names the table (a CSV file, from the repository's root), the row by its first
//! column, and after the last comma the column by its title. If the first column is ambiguous, the
//! row is named by more columns, separated by ` / `:
//!
//! ```markdown
//! <!-- from docs/bench.csv: 525 × 525 / slide 0.01 / hapterra swept, times_plain -->0.72
//! ```
//!
//! A comment before a table names the source of all its cells: the file, a column of the file for
//! each column of the page (`-` for a column without figures), and on each further line the name of
//! a row. An empty cell is not compared.
//!
//! ```markdown
//! <!-- table bench/instructions-m4f.csv: -, median, max
//! sliding
//! chain, free
//! -->
//! | state | median | largest |
//! | --- | --- | --- |
//! | sliding | 283 | 2,004 |
//! | free | 1,210 | 2,291 |
//! ```
//!
//! A figure may be rounded: it must be the table's value to the digits shown. It
//! may have commas between its thousands, and an exponent (`2e-6`).

use std::path::Path;

const BEGIN: &str = "<!-- from ";
const BEGIN_TABLE: &str = "<!-- table ";
const END: &str = "-->";
const NO_END: &str = "a comment without an end";

/// Returns the number of figures on a page, and a message for each that differs from its table or
/// cannot be looked up.
#[must_use]
pub fn check(page: &str, root: &Path) -> (usize, Vec<String>) {
    let single = page.split(BEGIN).skip(1).map(|mark| figure(mark, root));
    let tables = page.split(BEGIN_TABLE).skip(1);
    let cells = tables.flat_map(|mark| table(mark, root).unwrap_or_else(|why| vec![Err(why)]));
    let results: Vec<_> = single.chain(cells).collect();
    let wrong = results.iter().filter_map(|result| result.clone().err());
    (results.len(), wrong.collect())
}

/// Checks one figure: the text after [`BEGIN`].
fn figure(mark: &str, root: &Path) -> Result<(), String> {
    let (source, rest) = mark.split_once(END).ok_or(NO_END)?;
    let source = source.split_whitespace().collect::<Vec<_>>().join(" ");
    compare(&source, rest, root)
}

/// Checks the cells of one table: the text after [`BEGIN_TABLE`].
fn table(mark: &str, root: &Path) -> Result<Vec<Result<(), String>>, String> {
    let (head, rest) = mark.split_once(END).ok_or(NO_END)?;
    let mut head = head.lines().map(str::trim);
    let source = head.next().unwrap_or_default();
    let (file, columns) = source.split_once(": ").ok_or("no columns are named")?;
    let columns: Vec<&str> = columns.split(", ").collect();
    let names: Vec<&str> = head.filter(|name| !name.is_empty()).collect();
    let is_row = |line: &&str| line.starts_with('|');
    let rows = rest.lines().skip_while(|line| !is_row(line));
    let rows: Vec<&str> = rows.take_while(is_row).skip(2).collect();
    if rows.len() != names.len() {
        let (named, shown) = (names.len(), rows.len());
        return Err(format!("{file}: {named} rows are named, {shown} shown"));
    }
    let mut results = Vec::new();
    for (name, row) in names.iter().zip(rows) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        if cells.len() != columns.len() {
            results.push(Err(format!("{file}: {name}: another number of columns")));
        }
        let cells = columns.iter().zip(cells);
        let cells = cells.filter(|(column, cell)| **column != "-" && !cell.is_empty());
        results.extend(
            cells.map(|(column, cell)| compare(&format!("{file}: {name}, {column}"), cell, root)),
        );
    }
    Ok(results)
}

/// Compares the figure at the beginning of `text` with its source.
fn compare(source: &str, text: &str, root: &Path) -> Result<(), String> {
    let is_figure = |c: char| c.is_ascii_digit() || "+-.,e".contains(c);
    let end = text.find(|c| !is_figure(c)).unwrap_or(text.len());
    let shown = text[..end].trim_end_matches(['.', ',', '-']);
    let recorded = look_up(source, root).map_err(|why| format!("{source}: {why}"))?;
    match is_rounded(shown, recorded) {
        Some(true) => Ok(()),
        Some(false) => Err(format!(
            "{source}: the page says {shown}, the table {recorded}"
        )),
        None => Err(format!(
            "{source}: no figure behind the comment, but {shown:?}"
        )),
    }
}

/// Returns the value that `TABLE: ROW, COLUMN` names.
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

/// Returns true if a figure equals `value` to its digits, or `None` if it is not a figure.
fn is_rounded(shown: &str, value: f64) -> Option<bool> {
    let shown = shown.replace(',', "");
    let (mantissa, exponent) = shown.split_once('e').unwrap_or((&shown, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, part)| part.len());
    let last_digit = 10_f64.powi(exponent.parse::<i32>().ok()? - decimals as i32);
    let figure: f64 = shown.parse().ok()?;
    // Slightly more than half a digit, which has no exact binary fraction.
    Some((figure - value).abs() <= 0.5 * last_digit * (1.0 + 1e-9))
}
