//! Instructions of single ticks, and of filling a buffer with a tile, on an emulated Cortex-M4F,
//! compared with the stored table and the targets.
//!
//! Exact counts of the code on a board; no other load affects them. They are instructions, not
//! cycles. `cargo xtask counts` builds the image and runs this over all scenes; after an intended
//! change, `cargo xtask counts --write`. As a test, it counts a part of the scenes, and only their
//! largest counts are compared with the table.

#[allow(dead_code)] // The cycles use others of them.
mod m4f;

use hapterra_tests::instruction_counter::CountingBoard;
use m4f::table::{Row, Table};
use m4f::{chain, contact, soak, tiles};

#[test]
fn tick_instruction_counts_do_not_exceed_the_stored_table() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let requested = std::env::var("HAPTERRA_COUNTS").unwrap_or_default();
    let scenes = if requested.is_empty() {
        soak::PART
    } else {
        soak::ALL
    };
    let mut rows = contact::rows(&board);
    rows.extend(chain::rows(&board));
    rows.extend(tiles::rows(&board));
    rows.extend(soak::rows(&board, scenes));
    println!("{}", Row::TITLES);
    rows.iter().for_each(|row| println!("{row}"));
    if requested == "write" {
        return Table::write(&rows);
    }
    let regressions = Table::recorded().regressions(&rows);
    assert!(regressions.is_empty(), "{}", regressions.join("\n"));
}
