//! Effects: their times and errors, as tables and as a CSV file.

use std::fmt::Write as _;
use std::path::Path;

use super::number;
use crate::effects::{Error, Measured, Time};

/// The columns of the CSV file. A row of a time has the quantity "tick" and no errors; a row of an
/// error has no times.
pub const EFFECTS_HEADER: [&str; 14] = [
    "terrain",
    "path",
    "effect",
    "what",
    "unit",
    "median",
    "p99",
    "worst",
    "bound",
    "judged",
    "ns_q1",
    "ns_median",
    "ns_q3",
    "times_none",
];

/// Returns a block of times for each terrain and path, and one of errors for each terrain.
#[must_use]
pub fn effects(measured: &Measured) -> String {
    let mut text = String::new();
    let mut block = (String::new(), "");
    for row in &measured.times {
        if (row.terrain.as_str(), row.path) != (block.0.as_str(), block.1) {
            block = (row.terrain.clone(), row.path);
            // Writing to a String cannot fail.
            let _ = write!(text, "\n{} — {}\n{TIMES}\n", row.terrain, row.path);
        }
        let _ = writeln!(text, "{}", time(row));
    }
    let mut terrain = "";
    for row in &measured.errors {
        if row.terrain != terrain {
            terrain = &row.terrain;
            let _ = write!(
                text,
                "\n{terrain} — deviation from the formulas\n{ERRORS}\n"
            );
        }
        let _ = writeln!(text, "{}", error(row));
    }
    text
}

const TIMES: &str = "  effect, whole tick           ns/tick   quartiles       × none";
const ERRORS: &str = "  effect            path             what                                                             median       p99     worst   may be  judged";

fn time(row: &Time) -> String {
    let [low, median, high] = row.ns;
    format!(
        "  {:<27}{:>9} {:>7}–{:<7} {:>8.2}",
        row.effect,
        number(median),
        number(low),
        number(high),
        row.ratio
    )
}

fn error(row: &Error) -> String {
    let what = format!("{}, {}", row.what, row.unit);
    let bound = row.bound.map_or("–".to_owned(), digits);
    let spread = row.spread;
    format!(
        "  {:<17} {:<16} {what:<61} {:>9} {:>9} {:>9} {bound:>8} {:>7}",
        row.effect,
        row.path,
        short(spread.median),
        short(spread.p99),
        short(spread.worst),
        row.compared
    )
}

/// Formats a value with two significant digits.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        x if x < 1e-3 => format!("{value:.1e}"),
        x if x < 1.0 => format!("{value:.3}"),
        x if x < 10.0 => format!("{value:.2}"),
        _ => format!("{value:.1}"),
    }
}

/// Formats a value with four significant digits: the others differ from one machine to the next.
fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = (3.0 - value.abs().log10().floor()).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Writes all rows: times, then errors.
///
/// # Errors
/// If the file cannot be written.
pub fn write_effects(path: &Path, measured: &Measured) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record(EFFECTS_HEADER)?;
    for row in &measured.times {
        let mut record = vec![String::new(); EFFECTS_HEADER.len()];
        record[..4]
            .clone_from_slice(&[&row.terrain, row.path, row.effect, "tick"].map(str::to_owned));
        for (at, ns) in record[10..].iter_mut().zip(row.ns) {
            *at = digits(ns);
        }
        record[13] = digits(row.ratio);
        writer.write_record(&record)?;
    }
    for row in &measured.errors {
        let mut record: Vec<String> = [&row.terrain, row.path, row.effect, row.what, row.unit]
            .map(str::to_owned)
            .into();
        record.extend([row.spread.median, row.spread.p99, row.spread.worst].map(digits));
        record.push(row.bound.map_or(String::new(), digits));
        record.push(row.compared.to_string());
        record.resize(EFFECTS_HEADER.len(), String::new());
        writer.write_record(&record)?;
    }
    Ok(writer.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits_count() {
        for (value, formatted) in [
            (0.0, "0"),
            (1.0, "1"),
            (3.1, "3.1"),
            (123.456, "123.5"),
            (412_345.0, "412345"),
            (100.0, "100"),
            (-0.012_345_6, "-0.01235"),
            (5.513e-5, "0.00005513"),
        ] {
            assert_eq!(digits(value), formatted);
        }
    }
}
