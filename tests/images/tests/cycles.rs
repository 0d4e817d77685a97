//! Upper bounds of the cycles of single ticks on the boards' chips, compared with the stored table
//! `bench/cycles.csv` (docs/reference/cycles.md). `cargo xtask cycles` runs this over all counted
//! scenes; after an intended change, `cargo xtask cycles --write`. As a test, it uses the scenes
//! that compare the emulated processor with the host.

#[path = "../../../bench/tests/m4f/mod.rs"]
#[allow(dead_code)] // The counts of instructions use others of them.
mod m4f;

use hapterra_image_tests::counting::follow;
use hapterra_tests::instruction_counter::CountingBoard;
use hapterra_tests::repository;
use m4f::table::Row;
use m4f::{chain, contact, soak};

/// The stored table, in the repository.
const TABLE: &str = "bench/cycles.csv";
/// A figure above the stored one by more than this share is a regression, as for instructions.
const TOLERANCE: f64 = 1.05;
/// The columns: cycles of an STM32G474 and of an STM32H743.
const TITLES: [&str; 8] = [
    "state",
    "max instructions",
    "g474 median",
    "g474 p99",
    "g474 max",
    "h743 median",
    "h743 p99",
    "h743 max",
];

/// Returns a row's cells.
fn record(row: &Row) -> Vec<String> {
    let figures = row.cycles.as_flattened().iter();
    let figures = row.counts[2..].iter().chain(figures);
    let cells = [row.state.clone()].into_iter();
    cells.chain(figures.map(ToString::to_string)).collect()
}

/// Writes the table.
fn write(rows: &[Row]) {
    let mut table =
        csv::Writer::from_path(repository().join(TABLE)).expect("the table can be written");
    table.write_record(TITLES).expect("written");
    for row in rows {
        table.write_record(record(row)).expect("written");
    }
}

/// Returns a message for each figure in these columns above the table's allowance.
fn regressions(rows: &[Row], columns: &[usize]) -> Vec<String> {
    let mut table = csv::Reader::from_path(repository().join(TABLE)).expect("the table is there");
    let recorded: Vec<_> = table.records().map(|row| row.expect("a row")).collect();
    let worse_row = |row: &Row| {
        let record = record(row);
        let Some(recorded) = recorded.iter().find(|recorded| recorded[0] == *row.state) else {
            return vec![format!("{}: not in the table", row.state)];
        };
        let number = |text: &str| text.parse::<f64>().expect("a number");
        let is_worse = |i: &usize| number(&record[*i]) > TOLERANCE * number(&recorded[*i]);
        let reported = |i: usize| {
            let (title, now, recorded) = (TITLES[i], &record[i], &recorded[i]);
            format!("{}: {title} {now}, {recorded} in the table", row.state)
        };
        let regressions = columns.iter().copied().filter(is_worse);
        regressions.map(reported).collect()
    };
    rows.iter().flat_map(worse_row).collect()
}

#[test]
fn compared_scenes_do_not_exceed_recorded_cycles() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let rows = soak::compared_rows(&board.following(follow));
    let regressions = regressions(&rows, &[1, 2, 3, 4, 5, 6, 7]);
    assert!(regressions.is_empty(), "{}", regressions.join("\n"));
}

/// `cargo xtask cycles` runs this; `--write` writes the table.
#[test]
#[ignore = "runs for minutes: cargo xtask cycles"]
fn tick_states_do_not_exceed_recorded_cycles() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let board = board.following(follow);
    let mut rows = chain::rows(&board);
    rows.extend(contact::rows(&board));
    let requested = std::env::var("HAPTERRA_COUNTS").unwrap_or_default();
    let scenes = if requested == "all" {
        soak::ALL
    } else {
        soak::PART
    };
    rows.extend(soak::rows(&board, scenes));
    rows.extend(soak::compared_rows(&board));
    println!("{}", TITLES.join(", "));
    rows.iter()
        .for_each(|row| println!("{}", record(row).join(", ")));
    if requested == "write" {
        return write(&rows);
    }
    // The table's rows of the stress test cover a part of the scenes.
    let is_bound = |i: &usize| requested != "all" || TITLES[*i].contains("max");
    let columns: Vec<usize> = (1..TITLES.len()).filter(is_bound).collect();
    let regressions = regressions(&rows, &columns);
    assert!(regressions.is_empty(), "{}", regressions.join("\n"));
}
