//! Instructions of a tick in each state, beside the table that is kept.
//!
//! Counted by valgrind, so no other load disturbs them; those of a release
//! build for x86-64, whatever processor runs it. After a change that is meant:
//! `HAPTERRA_COUNTS=write cargo test --release -p hapterra-bench --test instructions`

use std::path::Path;
use std::process::Command;

use hapterra_bench::state::STATES;

/// The kept table: `state,instructions`.
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instructions.csv");
/// More than this many times the kept count is a regression; another compiler
/// may take a few per cent.
const TOLERANCE: f64 = 1.1;

#[test]
fn no_state_of_the_tick_costs_more_than_it_did() {
    if cfg!(debug_assertions) || !cfg!(target_arch = "x86_64") {
        eprintln!("skipped: the table is for a release build on x86-64 (cargo test --release)");
        return;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("skipped: valgrind is not installed (apt-get install valgrind)");
        return;
    }
    let counted: Vec<(&str, f64)> = STATES.map(|(state, _)| (state, count(state))).to_vec();
    if std::env::var_os("HAPTERRA_COUNTS").is_some_and(|what| what == "write") {
        let mut table = csv::Writer::from_path(TABLE).expect("the table can be written");
        table
            .write_record(["state", "instructions"])
            .expect("written");
        for (state, count) in &counted {
            let record = [(*state).to_owned(), format!("{count:.0}")];
            table.write_record(&record).expect("written");
        }
        return;
    }
    let kept = kept();
    for (state, count) in counted {
        let kept = kept.iter().find(|(name, _)| name == state);
        let (_, kept) = kept.expect("every state is in the table");
        println!("{state}: {count:.0} instructions, kept {kept:.0}");
        assert!(
            count <= kept * TOLERANCE,
            "{state}: {count:.0} instructions a tick, {kept:.0} in the table"
        );
    }
}

fn kept() -> Vec<(String, f64)> {
    let mut table = csv::Reader::from_path(TABLE).expect("the table is there");
    table
        .deserialize()
        .map(|row| row.expect("state,instructions"))
        .collect()
}

/// Instructions a tick, on average over the state's ticks.
fn count(state: &str) -> f64 {
    let profile = Path::new(env!("CARGO_TARGET_TMPDIR")).join("instructions.out");
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=*counted_tick*"])
        .arg(format!("--callgrind-out-file={}", profile.display()))
        .args([env!("CARGO_BIN_EXE_hapterra-tick"), state])
        .output()
        .expect("valgrind runs");
    let (said, ticks) = (
        String::from_utf8_lossy(&run.stderr),
        String::from_utf8_lossy(&run.stdout),
    );
    let total = said
        .lines()
        .find_map(|line| line.split_once("Collected :"))
        .and_then(|(_, count)| count.trim().parse::<f64>().ok());
    let ticks = ticks.trim().parse::<f64>().ok();
    match (total, ticks) {
        (Some(total), Some(ticks)) => total / ticks,
        _ => panic!("no count of {state:?}: {said}"),
    }
}
