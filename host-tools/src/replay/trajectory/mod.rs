//! Trajectory files: `t_s,x_mm,y_mm,z_mm` or `x_mm,y_mm,z_mm` as CSV, or a recording in either
//! format.
//!
//! Lengths are millimetres of the arm's tip over the rendered terrain: x east, y north, z up,
//! origin at the south-west sample at height zero.

mod bounded;
mod columns;
mod comments;
mod csv_reader;
mod fault;
mod parquet_reader;
mod recording_rows;

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use hapterra_core::grid::{GridPoint, MAX_CELL};
pub use hapterra_touch::ticks::Row;
use hapterra_touch::ticks::TimeFault;

pub use columns::{ColumnValues, RecordedColumns};
pub use fault::TrajectoryError;
pub use recording_rows::{RecordingRow, RecordingRows};

use super::settings::Settings;
use crate::terrain::Scale;
use fault::TrajectoryFault;

/// The columns, in this order. A recording also begins with them, and additional columns are
/// skipped, so a recording can be replayed.
const COLUMNS: [&str; 4] = ["t_s", "x_mm", "y_mm", "z_mm"];

/// The columns without the time.
const PLACE: &[&str] = COLUMNS.split_at(1).1;

/// Returns the first columns of every row, if a header begins like a trajectory's.
fn columns_of<N: AsRef<str>>(header: &[N]) -> Option<&'static [&'static str]> {
    let begins = |columns: &[&str]| {
        let names = header.iter().map(AsRef::as_ref);
        names.take(columns.len()).eq(columns.iter().copied())
    };
    [&COLUMNS[..], PLACE].into_iter().find(|it| begins(it))
}

/// The column with the number of a row's placement.
const VIEW: &str = "view";

/// Returns a row from the values of its first columns, which may lack the time.
fn row(numbers: &[f64], view: u32) -> Row {
    let (t_s, place) = match numbers {
        [t_s, place @ ..] if place.len() == PLACE.len() => (Some(*t_s), place),
        place => (None, place),
    };
    let number = |axis: usize| place.get(axis).copied().unwrap_or_default();
    Row {
        t_s,
        hip_mm: std::array::from_fn(number),
        view,
    }
}

/// A trajectory, read row by row.
pub struct Trajectory {
    path: PathBuf,
    form: Form,
    settings: Option<Settings>,
}

enum Form {
    Csv(Box<csv_reader::Rows<File>>),
    Parquet(Box<parquet_reader::Rows>),
}

impl Trajectory {
    /// Opens a trajectory file, reads its settings if it is a recording, and checks its header.
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn open(path: &Path) -> Result<Self, TrajectoryError> {
        let opened = Self::opened(path);
        opened.map_err(|fault| TrajectoryError::new(path, fault))
    }

    fn opened(path: &Path) -> Result<Self, TrajectoryFault> {
        // It may be a pipe from the program that creates the path.
        let mut file = File::open(path).map_err(TrajectoryFault::Unreadable)?;
        let (form, text) = match is_parquet(&mut file)? {
            true => {
                let (rows, text) = parquet_reader::Rows::open(file)?;
                (Form::Parquet(Box::new(rows)), text)
            }
            false => {
                let later = later_remarks(&mut file)?;
                let (rows, text) = csv_reader::Rows::open(file)?;
                // Comments that are no settings are not followed by placements.
                (Form::Csv(Box::new(rows)), text + &later)
            }
        };
        Ok(Self {
            path: path.to_owned(),
            form,
            settings: Settings::from_toml(&text).map_err(TrajectoryFault::Settings)?,
        })
    }

    /// Returns the settings of the recording; `None` for a trajectory, or a recording of a version
    /// without settings.
    #[must_use]
    pub const fn settings(&self) -> Option<&Settings> {
        self.settings.as_ref()
    }

    /// Returns the next row; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] names the line and the column.
    pub fn next_row(&mut self) -> Result<Option<Row>, TrajectoryError> {
        let row = match &mut self.form {
            Form::Csv(rows) => rows.next(),
            Form::Parquet(rows) => rows.next(),
        };
        row.map_err(|fault| self.wrong(fault))
    }

    /// Returns the error for the latest row if its placement has no settings.
    #[must_use]
    pub fn of_unknown_view(&mut self, view: u32) -> TrajectoryError {
        let (at, column) = (self.place(), VIEW);
        let what = format!("the recording does not describe view {view}");
        self.wrong(TrajectoryFault::Field { at, column, what })
    }

    /// Returns the error for a latest row whose time does not fit the row before.
    pub(super) fn mistimed(&mut self, what: TimeFault) -> TrajectoryError {
        let at = self.place();
        self.wrong(TrajectoryFault::Time { at, what })
    }

    /// Converts a position, in the latest row or between it and the one before, to the grid of a
    /// scale.
    ///
    /// # Errors
    /// As [`Self::next_row`].
    pub fn to_grid(
        &mut self,
        hip_mm: [f64; 3],
        scale: &Scale,
    ) -> Result<GridPoint, TrajectoryError> {
        match scale.to_grid(hip_mm) {
            Some(hip) => Ok(hip),
            None => {
                let (column, what) = far(hip_mm, scale);
                let at = self.place();
                Err(self.wrong(TrajectoryFault::Field { at, column, what }))
            }
        }
    }

    /// Returns true if the last row of the recording was incomplete, and is left out: the command
    /// that wrote it was killed. Known only after the last row.
    #[must_use]
    pub fn was_cut(&self) -> bool {
        match &self.form {
            Form::Csv(rows) => rows.was_cut(),
            Form::Parquet(_) => false,
        }
    }

    /// Returns the position of the present row, for a message. No row can be read afterwards.
    fn place(&mut self) -> String {
        match &mut self.form {
            Form::Csv(rows) => rows.place(),
            Form::Parquet(rows) => rows.place(),
        }
    }

    fn wrong(&self, fault: TrajectoryFault) -> TrajectoryError {
        TrajectoryError::new(&self.path, fault)
    }
}

/// Returns the column of a position that is too far from the origin, and the message.
fn far(hip_mm: [f64; 3], scale: &Scale) -> (&'static str, String) {
    let cell_mm = scale.cell_mm();
    let far = |mm: &f64| (mm / cell_mm).abs() > f64::from(MAX_CELL);
    let axis = hip_mm.iter().position(far).unwrap_or(0);
    let mm = hip_mm.get(axis).copied().unwrap_or_default();
    let what = format!("{mm} mm is farther than {MAX_CELL} cells of {cell_mm} mm from the origin");
    (PLACE.get(axis).copied().unwrap_or_default(), what)
}

impl Iterator for Trajectory {
    type Item = Result<Row, TrajectoryError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_row().transpose()
    }
}

/// Returns the comments on placements and marks between the rows of a CSV file; empty if it cannot
/// be rewound.
fn later_remarks(file: &mut File) -> Result<String, TrajectoryFault> {
    if file.stream_position().is_err() {
        return Ok(String::new());
    }
    let later = comments::later(&mut *file);
    let later = later.and_then(|later| file.seek(SeekFrom::Start(0)).map(|_| later));
    later.map_err(TrajectoryFault::Unreadable)
}

/// Returns true if a file begins like Parquet; a file that cannot be rewound is CSV.
fn is_parquet(file: &mut File) -> Result<bool, TrajectoryFault> {
    if file.stream_position().is_err() {
        return Ok(false);
    }
    let mut begin = Vec::new();
    let read = file.by_ref().take(4).read_to_end(&mut begin);
    let read = read.and_then(|_| file.seek(SeekFrom::Start(0)));
    read.map_err(TrajectoryFault::Unreadable)?;
    Ok(begin == b"PAR1")
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
