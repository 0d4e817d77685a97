//! The table on the screen.

use std::fmt::Write as _;

use crate::compare::Row;

/// Returns one block for each terrain and path, with its variants in the order of measurement.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut block = (String::new(), "");
    for row in rows {
        if (row.terrain.as_str(), row.path) != (block.0.as_str(), block.1) {
            block = (row.terrain.clone(), row.path);
            // Writing to a String cannot fail.
            let _ = write!(text, "\n{} — {}\n{HEAD}\n", row.terrain, row.path);
        }
        let _ = writeln!(text, "{}", line(row));
    }
    text
}

const HEAD: &str = "  variant                      ns/tick   quartiles      × plain | error mean     p99      max  (cells) | force off mean    p99 (°) |  jump | missed | B/sample";

fn line(row: &Row) -> String {
    let [low, median, high] = row.ns;
    let timing = format!(
        "  {:<27}{:>9} {:>7}–{:<7} {:>8.2}",
        row.label.name,
        number(median),
        number(low),
        number(high),
        row.ratio
    );
    let errors = match &row.error {
        None => format!(" | {:>35} | {:>25}", "–", "–"),
        Some(error) => format!(
            " | {:>10.1e} {:>8.1e} {:>8.1e}          | {:>14} {:>10}",
            error.mean,
            error.p99,
            error.max,
            degrees(error.angle_mean),
            degrees(error.angle_p99),
        ),
    };
    let missed = match row.missed {
        0.0 => "none".to_owned(),
        part => format!("{:.1} %", 100.0 * part),
    };
    let unconverged = match row.unconverged {
        0.0 => String::new(),
        part => format!("  ({:.1} % of ticks left work over)", 100.0 * part),
    };
    format!(
        "{timing}{errors} | {:>5.2} | {missed:>6} | {:>8.2}{unconverged}",
        row.jump, row.label.extra_bytes
    )
}

fn degrees(angle: f64) -> String {
    if angle < 1e-3 {
        "<0.001".to_owned()
    } else {
        format!("{angle:.3}")
    }
}

/// Formats a value with about three digits.
pub(super) fn number(ns: f64) -> String {
    match ns {
        ns if ns < 10.0 => format!("{ns:.2}"),
        ns if ns < 100.0 => format!("{ns:.1}"),
        ns => format!("{ns:.0}"),
    }
}
