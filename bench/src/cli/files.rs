//! The terrain files that are measured, and the files that are written.

use std::ffi::OsStr;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use clap::builder::{PathBufValueParser, TypedValueParser as _};
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

    /// Files for the figures.
    #[command(flatten)]
    pub outputs: Outputs,
}

/// Files for the figures.
#[derive(Debug, clap::Args)]
pub struct Outputs {
    /// File for the figures: FILE.csv for all of them, FILE.png for a picture; may be given twice
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath,
          value_parser = PathBufValueParser::new().try_map(OutputFile::of))]
    pub out: Vec<OutputFile>,
}

/// A file for the figures, by its ending.
#[derive(Clone, Debug)]
pub enum OutputFile {
    /// A CSV with all figures.
    Table(PathBuf),
    /// A picture, as PNG.
    Picture(PathBuf),
}

impl OutputFile {
    fn of(path: PathBuf) -> Result<Self, &'static str> {
        match path.extension().and_then(OsStr::to_str) {
            Some("csv") => Ok(Self::Table(path)),
            Some("png") => Ok(Self::Picture(path)),
            _ => Err("its ending is .csv (all figures) or .png (a picture)"),
        }
    }
}

impl Outputs {
    /// Returns the file for the table and the file for the picture.
    ///
    /// # Errors
    /// Two files of a kind.
    pub(super) fn table_and_picture(
        &self,
    ) -> Result<(Option<&PathBuf>, Option<&PathBuf>), Failure> {
        let (mut table, mut picture) = (None, None);
        for file in &self.out {
            let before = match file {
                OutputFile::Table(path) => table.replace(path),
                OutputFile::Picture(path) => picture.replace(path),
            };
            if before.is_some() {
                return Err(Failure::new("-o names two files with the same ending")
                    .hint("give it once for FILE.csv and once for FILE.png"));
            }
        }
        Ok((table, picture))
    }

    /// Returns the file for the table, for figures without a picture.
    ///
    /// # Errors
    /// Two files of a kind, or a picture.
    pub(super) fn table_only(&self) -> Result<Option<&PathBuf>, Failure> {
        let (table, picture) = self.table_and_picture()?;
        match picture {
            None => Ok(table),
            Some(_) => {
                Err(Failure::new("these figures have no picture")
                    .hint("leave the FILE.png of -o out"))
            }
        }
    }
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
