//! The terrain files that are measured, and the files that are written.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use hapterra::cli::{Failure, report};
use indicatif::ProgressBar;

/// Terrain files, and files for the figures.
#[derive(Debug, clap::Args)]
pub struct Files {
    /// Terrain files to measure on
    #[arg(value_hint = ValueHint::FilePath)]
    pub files: Vec<PathBuf>,

    /// Measure on the files only, not on the synthetic terrains
    #[arg(long, requires = "files")]
    pub files_only: bool,

    /// Fewer ticks and rounds: not for figures to quote
    #[arg(long)]
    pub quick: bool,

    /// File for all figures, as CSV
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,

    /// File for a picture of the figures, as PNG
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub picture: Option<PathBuf>,
}

/// Writes a file if it has a name, and prints the name.
pub(super) fn write<E: Display>(
    file: Option<&PathBuf>,
    write: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), Failure> {
    let Some(file) = file else {
        return Ok(());
    };
    write(file).map_err(|error| {
        Failure::new(format!("cannot write {}: {error}", file.display()))
            .hint("check that the folder exists and that you may write there")
    })?;
    report::put(&format!("wrote {}\n", file.display()))
}

/// Shows progress during a measurement.
pub(super) fn spinner() -> ProgressBar {
    let spinner = ProgressBar::new_spinner();
    spinner.enable_steady_tick(Duration::from_millis(500));
    spinner
}
