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

use std::ops::Range;
use std::path::Path;

const BEGIN: &str = "<!-- from ";
const BEGIN_TABLE: &str = "<!-- table ";
const END: &str = "-->";
const NO_END: &str = "a comment without an end";

/// A figure on a page.
struct Figure {
    /// Its table, row and column: `TABLE: ROW, COLUMN`.
    source: String,
    /// Its place on the page, bytes.
    at: Range<usize>,
}

impl Figure {
    /// Creates the figure at the beginning of `page[at..]`.
    fn new(source: String, page: &str, at: usize) -> Self {
        let is_figure = |c: char| c.is_ascii_digit() || "+-.,e".contains(c);
        let text = &page[at..];
        let end = text.find(|c| !is_figure(c)).unwrap_or(text.len());
        let length = text[..end].trim_end_matches(['.', ',', '-']).len();
        let at = at..at + length;
        Self { source, at }
    }
}

/// Returns the number of figures on a page, and a message for each that differs from its table or
/// cannot be looked up.
#[must_use]
pub fn check(page: &str, root: &Path) -> (usize, Vec<String>) {
    let figures = figures_of(page);
    let compared = |figure: &Result<Figure, String>| match figure {
        Ok(figure) => compare(&figure.source, &page[figure.at.clone()], root),
        Err(why) => Err(why.clone()),
    };
    let wrong = figures.iter().filter_map(|figure| compared(figure).err());
    (figures.len(), wrong.collect())
}

/// Returns a page on which each figure that differs from its table is replaced: with as many
/// decimals, and with commas or an exponent as before.
#[must_use]
pub fn renewed(page: &str, root: &Path) -> String {
    let mut figures: Vec<Figure> = figures_of(page).into_iter().flatten().collect();
    figures.sort_by_key(|figure| figure.at.start);
    let mut page = page.to_owned();
    // From the end: the places before stay valid.
    for figure in figures.into_iter().rev() {
        let shown = &page[figure.at.clone()];
        if let Ok(recorded) = look_up(&figure.source, root)
            && is_rounded(shown, recorded) == Some(false)
        {
            page.replace_range(figure.at, &written_as(shown, recorded));
        }
    }
    page
}

/// Returns all figures of a page with their places, or why one has none.
fn figures_of(page: &str) -> Vec<Result<Figure, String>> {
    let single = page.match_indices(BEGIN);
    let single = single.map(|(at, mark)| figure(page, at + mark.len()));
    let tables = page.match_indices(BEGIN_TABLE);
    let cells = tables
        .flat_map(|(at, mark)| table(page, at + mark.len()).unwrap_or_else(|why| vec![Err(why)]));
    single.chain(cells).collect()
}

/// Returns the figure of a comment that begins at `at`, behind [`BEGIN`].
fn figure(page: &str, at: usize) -> Result<Figure, String> {
    let end = page[at..].find(END).ok_or(NO_END)?;
    let source = page[at..at + end].split_whitespace();
    let source = source.collect::<Vec<_>>().join(" ");
    Ok(Figure::new(source, page, at + end + END.len()))
}

/// Returns the figures of a table whose comment begins at `at`, behind [`BEGIN_TABLE`].
fn table(page: &str, at: usize) -> Result<Vec<Result<Figure, String>>, String> {
    let end = at + page[at..].find(END).ok_or(NO_END)?;
    let mut head = page[at..end].lines().map(str::trim);
    let source = head.next().unwrap_or_default();
    let (file, columns) = source.split_once(": ").ok_or("no columns are named")?;
    let columns: Vec<&str> = columns.split(", ").collect();
    let names: Vec<&str> = head.filter(|name| !name.is_empty()).collect();
    let is_row = |(_, line): &(usize, &str)| line.starts_with('|');
    let rows = lines_with_places(&page[end..]).skip_while(|line| !is_row(line));
    let rows: Vec<_> = rows.take_while(is_row).skip(2).collect();
    if rows.len() != names.len() {
        let (named, shown) = (names.len(), rows.len());
        return Err(format!("{file}: {named} rows are named, {shown} shown"));
    }
    let mut figures = Vec::new();
    for (name, (begin, row)) in names.iter().zip(rows) {
        let cells = cells_with_places(row);
        if cells.len() != columns.len() {
            figures.push(Err(format!("{file}: {name}: another number of columns")));
        }
        let cells = columns.iter().zip(cells);
        let cells = cells.filter(|(column, (_, cell))| **column != "-" && !cell.is_empty());
        figures.extend(cells.map(|(column, (place, _))| {
            let source = format!("{file}: {name}, {column}");
            Ok(Figure::new(source, page, end + begin + place))
        }));
    }
    Ok(figures)
}

/// Returns the lines of a text with their places, bytes.
fn lines_with_places(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let place = |line: &str| line.as_ptr().addr() - text.as_ptr().addr();
    text.lines().map(move |line| (place(line), line))
}

/// Returns the cells of a table's row with their places in it, bytes.
fn cells_with_places(row: &str) -> Vec<(usize, &str)> {
    let cells = row.trim_matches('|').split('|').map(str::trim);
    let place = |cell: &str| cell.as_ptr().addr() - row.as_ptr().addr();
    cells.map(|cell| (place(cell), cell)).collect()
}

/// Compares a figure with its source.
fn compare(source: &str, shown: &str, root: &Path) -> Result<(), String> {
    let recorded = look_up(source, root).map_err(|why| format!("{source}: {why}"))?;
    match is_rounded(shown, recorded) {
        Some(true) => Ok(()),
        Some(false) => Err(format!(
            "{source}: {shown} on the page, {recorded} in the table"
        )),
        None => Err(format!(
            "{source}: no figure behind the comment, but {shown:?}"
        )),
    }
}

/// Returns a value in the form of a figure: as many decimals, an exponent, commas.
fn written_as(shown: &str, value: f64) -> String {
    let mantissa = shown.split('e').next().unwrap_or(shown);
    let decimals = mantissa.split_once('.').map_or(0, |(_, part)| part.len());
    if shown.contains('e') {
        return format!("{value:.decimals$e}");
    }
    let plain = format!("{value:.decimals$}");
    let digits = |text: &str| text.split('.').next().unwrap_or_default().len();
    // Four digits without a comma: the page has none.
    if !shown.contains(',') && digits(shown) > 3 {
        return plain;
    }
    let whole = digits(&plain);
    let mut text = String::new();
    for (i, digit) in plain.chars().enumerate() {
        let is_group = i > 0 && i < whole && (whole - i).is_multiple_of(3);
        if is_group && !text.ends_with('-') {
            text.push(',');
        }
        text.push(digit);
    }
    text
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
