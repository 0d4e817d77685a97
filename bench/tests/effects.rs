//! The kept figures of the effects: all of them are there, and none is above what it may be.

use std::path::Path;

use hapterra_bench::compare::Effort;
use hapterra_bench::effects::{Effect, measure};
use hapterra_bench::{report, state};

#[test]
fn the_kept_errors_are_below_what_they_may_be() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.csv");
    let mut table = csv::Reader::from_path(file).expect("it is kept");
    assert_eq!(
        table.headers().expect("a header"),
        &report::EFFECTS_HEADER[..]
    );
    let rows: Vec<_> = table.records().map(|row| row.expect("a row")).collect();
    let is_kept = |effect: &Effect| {
        let is = |row: &&csv::StringRecord| &row[2] == effect.name() && &row[3] == "tick";
        rows.iter().filter(is).count() == 2
    };
    assert!(Effect::ALL.iter().all(is_kept));
    let number = |text: &str| text.parse::<f64>().expect("a number");
    for row in rows.iter().filter(|row| !row[8].is_empty()) {
        assert!(number(&row[7]) <= number(&row[8]), "{row:?}");
    }
}

#[test]
fn what_is_written_has_every_row_of_the_table() {
    let grid = state::terrain();
    let effort = Effort {
        ticks: 400,
        rounds: 1,
        judged: 0,
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
