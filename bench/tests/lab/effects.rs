//! The stored figures of the effects: all exist, none exceeds its bound, and the errors equal those
//! of the present code.

use std::path::Path;

use hapterra_lab::compare::Effort;
use hapterra_lab::effects::{Effect, Error, errors, measure};
use hapterra_lab::{report, tick_states};

/// Tolerance of a stored figure, as a share of itself or of its bound: four digits are stored, and
/// machines round sines differently.
const OFF: f64 = 0.02;

fn recorded() -> Vec<csv::StringRecord> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.csv");
    let mut table = csv::Reader::from_path(file).expect("it is kept");
    assert_eq!(
        table.headers().expect("a header"),
        &report::EFFECTS_HEADER[..]
    );
    table.records().map(|row| row.expect("a row")).collect()
}

fn number(text: &str) -> f64 {
    text.parse().expect("a number")
}

#[test]
fn recorded_errors_match_the_code() {
    let recorded = recorded();
    let measured = errors(&tick_states::terrain(), Effort::FULL).expect("in reach");
    let count = recorded.iter().filter(|row| &row[3] != "tick").count();
    assert_eq!(
        count,
        measured.len(),
        "hapterra-lab contact --effects -o docs/effects.csv"
    );
    let is_kept = |error: &Error| {
        let names = [&error.terrain, error.path, error.effect, error.what];
        let row = recorded.iter().find(|row| row.iter().take(4).eq(names));
        let Some(row) = row else {
            return false;
        };
        let near = |text: &str, is: f64| {
            let off = (number(text) - is).abs();
            off <= OFF * is.abs().max(error.bound.unwrap_or(0.0))
        };
        let spread = &error.spread;
        near(&row[5], spread.median) && near(&row[6], spread.p99) && near(&row[7], spread.worst)
    };
    let stale: Vec<_> = measured.iter().filter(|error| !is_kept(error)).collect();
    assert!(
        stale.is_empty(),
        "hapterra-lab contact --effects -o docs/effects.csv: the table is older than {stale:#?}"
    );
}

#[test]
fn recorded_errors_are_below_their_bounds() {
    let rows = recorded();
    let is_kept = |effect: &Effect| {
        let is = |row: &&csv::StringRecord| &row[2] == effect.name() && &row[3] == "tick";
        rows.iter().filter(is).count() == 2
    };
    assert!(Effect::ALL.iter().all(is_kept));
    for row in rows.iter().filter(|row| !row[8].is_empty()) {
        assert!(number(&row[7]) <= number(&row[8]), "{row:?}");
    }
}

#[test]
fn effects_csv_has_every_measured_row() {
    let grid = tick_states::terrain();
    let effort = Effort {
        ticks: 400,
        rounds: 1,
        compared: 0,
    };
    let measured = measure(&grid, effort).expect("in reach");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("effects.csv");
    report::write_effects(&file, &measured).expect("it is written");
    let mut table = csv::Reader::from_path(file).expect("it is there");
    let rows = table.records().filter(Result::is_ok).count();
    assert_eq!(rows, measured.times.len() + measured.errors.len());
    let shown = report::effects(&measured);
    for effect in &Effect::ALL {
        assert!(shown.contains(effect.name()), "{shown}");
    }
}
