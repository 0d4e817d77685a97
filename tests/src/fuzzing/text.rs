//! Arbitrary bytes as the command's other input files: recordings, calibrations, tables of
//! materials, logs of a first power-up, commands.

use std::fs;
use std::path::Path;

use hapterra::bringup::Log;
use hapterra::calibrate;
use hapterra::cli::options::surface::table::TableFile;
use hapterra::replay::{RecordedColumns, RecordingRows, Trajectory};
use hapterra::steering::command;

/// Number of kinds.
pub const KINDS: u8 = 5;

/// Most rows of a recording that are read.
const MAX_ROWS: usize = 10_000;

/// Runs an input: the first byte selects the kind of file, the others are its content.
pub fn run(data: &[u8]) {
    let (kind, content) = data.split_first().unwrap_or((&0, data));
    if kind % KINDS == 4 {
        let lines = String::from_utf8_lossy(content);
        lines.lines().for_each(read_command);
        return;
    }
    let file = tempfile::NamedTempFile::new().expect("a file");
    fs::write(file.path(), content).expect("written");
    let path = file.path();
    match kind % KINDS {
        0 => read_recording(path),
        1 => check(calibrate::file::read(path)),
        2 => check(TableFile::open(path)),
        _ => check(Log::read(path)),
    }
}

/// Formats a result and its error.
fn check<T: std::fmt::Debug, E: std::error::Error>(read: Result<T, E>) {
    let reported = read.map_or_else(|error| error.to_string(), |read| format!("{read:?}"));
    assert!(!reported.is_empty());
}

fn read_command(line: &str) {
    check(command::parse(line));
}

/// Reads it as `replay`, the viewer and Python do.
fn read_recording(path: &Path) {
    if let Ok(rows) = Trajectory::open(path) {
        rows.take(MAX_ROWS).for_each(check);
    }
    if let Ok(rows) = RecordingRows::open(path) {
        rows.take(MAX_ROWS).for_each(check);
    }
    if let Err(error) = RecordedColumns::read(path) {
        assert!(!error.to_string().is_empty());
    }
}
