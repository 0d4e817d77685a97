//! Changes of the force, as a table in Markdown.

use std::fmt::Write as _;

use crate::compare::Label;
use crate::continuity::{DEPTH, Row, STEP};

/// Returns a line for each ground and a column for each variant: the largest change of the
/// displacement in a tick, and its 99th percentile, in cells.
#[must_use]
pub fn continuity(rows: &[Row]) -> String {
    let (mut grounds, mut variants): (Vec<&str>, Vec<&Label>) = (vec![], vec![]);
    for row in rows {
        if !grounds.contains(&row.ground) {
            grounds.push(row.ground);
        }
        if !variants
            .iter()
            .any(|variant| variant.name == row.label.name)
        {
            variants.push(&row.label);
        }
    }
    let mut text = format!(
        "\nlargest change of the force in a tick, and 99 % of them, cells of stretch; the HIP {DEPTH} cell deep moves {STEP} cell a tick\n\n"
    );
    let names: Vec<&str> = variants.iter().map(|label| label.name).collect();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "| ground | {} |", names.join(" | "));
    let _ = writeln!(text, "|---|{}", "---|".repeat(names.len()));
    for ground in grounds {
        let cell = |name: &&str| {
            let is = |row: &&Row| row.ground == ground && row.label.name == *name;
            rows.iter().find(is).map_or(String::new(), formatted)
        };
        let cells: Vec<String> = names.iter().map(cell).collect();
        let _ = writeln!(text, "| {ground} | {} |", cells.join(" | "));
    }
    text
}

fn formatted(row: &Row) -> String {
    let missed = match row.missed {
        0.0 => String::new(),
        part => format!(", no contact in {:.0} %", 100.0 * part),
    };
    format!("{}, {}{missed}", number(row.max_change), number(row.p99))
}

fn number(cells: f64) -> String {
    let digits = (1.0 - cells.max(1e-9).log10().floor()) as usize;
    format!("{cells:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_digits_count() {
        assert_eq!(number(0.141_46), "0.14");
        assert_eq!(number(5.02e-5), "0.000050");
    }
}
