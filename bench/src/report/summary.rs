//! Summary of the figures: the product relative to the other methods, and the paper's own figures.

use std::fmt::Write as _;

use crate::compare::{PLAIN, Row};

/// The product's default.
const DEFAULT_LABEL: &str = "hapterra swept";
/// The paper's Table 1: average haptic updates a second, and for the closest point or the collision
/// alone, on a 2.4 GHz Pentium 4.
const TABLE_1: [(&str, f64); 2] = [("average update", 968e3), ("closest point alone", 200e3)];

/// Returns the speed-up over the other methods, terrain by terrain.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let mut text = String::from("\nhow many times faster than the opponent is hapterra swept?\n");
    let questions = [
        ("slide 0.01", PLAIN, "target 2.5"),
        ("slide 0.01", "parry within", "target 5"),
        ("slide 0.5", PLAIN, ""),
        ("fly low 0.5", PLAIN, "target 2"),
        ("fly high 0.5", PLAIN, "target 2"),
        ("unmoved", "copy of the last answer", "target 1"),
        ("sweep 50", "parry within", "target 10"),
        ("sweep 500", "parry within", ""),
        ("sweep 5000", "parry within", ""),
    ];
    for (path, opponent, target) in questions {
        let faster: Vec<String> = terrains(rows)
            .filter_map(|terrain| {
                let ns = |name| median(rows, terrain, path, name);
                Some(format!("{:.2}", ns(opponent)? / ns(DEFAULT_LABEL)?))
            })
            .collect();
        if !faster.is_empty() {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "  {path:<13} than {opponent:<24} {:<40} {target}",
                faster.join("  ")
            );
        }
    }
    let worst = |is_sweep: bool| {
        let default_rows = rows.iter().filter(|row| row.label.name == DEFAULT_LABEL);
        default_rows
            .filter(|row| row.path.starts_with("sweep") == is_sweep)
            .filter_map(|row| row.error)
            .fold(0.0, |worst: f64, error| worst.max(error.max))
    };
    let _ = writeln!(
        text,
        "  largest error of hapterra swept: {:.1e} cells",
        worst(false)
    );
    let _ = writeln!(
        text,
        "  how far it is behind the closest point in sweeps of hundreds of cells a tick: {:.1e} cells\n  \
         (the work of a tick is bounded; the next ticks cover the remaining distance)",
        worst(true)
    );
    for (what, rate) in TABLE_1 {
        let slide: Vec<String> = terrains(rows)
            .filter_map(|terrain| median(rows, terrain, "slide 0.01", DEFAULT_LABEL))
            .map(|ns| format!("{:.0}", 1e9 / ns / rate))
            .collect();
        if !slide.is_empty() {
            let _ = writeln!(
                text,
                "  over the paper's {what} ({:.0} kHz, on a machine of 2003, so mostly the machine): {} ×",
                rate / 1e3,
                slide.join("  ")
            );
        }
    }
    text
}

/// Returns the terrains in the order of measurement.
fn terrains(rows: &[Row]) -> impl Iterator<Item = &str> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.terrain.as_str()) {
            names.push(&row.terrain);
        }
    }
    names.into_iter()
}

fn median(rows: &[Row], terrain: &str, path: &str, name: &str) -> Option<f64> {
    let is = |row: &&Row| row.terrain == terrain && row.path == path && row.label.name == name;
    rows.iter().find(is).map(|row| row.ns[1])
}
