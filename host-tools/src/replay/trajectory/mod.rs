//! Trajectory files: `t_s,x_mm,y_mm,z_mm` or `x_mm,y_mm,z_mm` as CSV, or a recording in either
//! form.
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

/// The columns, in this order. A recording begins with them, too, and further
/// columns are passed over, so what was recorded can be replayed.
const COLUMNS: [&str; 4] = ["t_s", "x_mm", "y_mm", "z_mm"];

/// The same without the time.
const PLACE: &[&str] = COLUMNS.split_at(1).1;

/// Returns the columns that every row begins with, if a header begins as a trajectory's does.
fn columns_of<N: AsRef<str>>(header: &[N]) -> Option<&'static [&'static str]> {
    let begins = |columns: &[&str]| {
        let names = header.iter().map(AsRef::as_ref);
        names.take(columns.len()).eq(columns.iter().copied())
    };
    [&COLUMNS[..], PLACE].into_iter().find(|it| begins(it))
}

/// The column that tells in which view a row was rendered.
const VIEW: &str = "view";

/// A row of the values of the first columns, of which the time may be missing.
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

/// A trajectory that is read row by row.
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
    /// Opens a trajectory file, reads its settings, where it is a recording, and checks
    /// its header.
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn open(path: &Path) -> Result<Self, TrajectoryError> {
        let opened = Self::opened(path);
        opened.map_err(|fault| TrajectoryError::new(path, fault))
    }

    fn opened(path: &Path) -> Result<Self, TrajectoryFault> {
        // It may be a pipe whose other end makes the path.
        let mut file = File::open(path).map_err(TrajectoryFault::Unreadable)?;
        let (form, text) = match is_parquet(&mut file)? {
            true => {
                let (rows, text) = parquet_reader::Rows::open(file)?;
                (Form::Parquet(Box::new(rows)), text)
            }
            false => {
                let later = later_remarks(&mut file)?;
                let (rows, text) = csv_reader::Rows::open(file)?;
                // Remarks that are no settings are followed by no views.
                (Form::Csv(Box::new(rows)), text + &later)
            }
        };
        Ok(Self {
            path: path.to_owned(),
            form,
            settings: Settings::from_toml(&text).map_err(TrajectoryFault::Settings)?,
        })
    }

    /// With which settings it was recorded; none where it is no recording, or one of a
    /// version that did not say.
    #[must_use]
    pub const fn settings(&self) -> Option<&Settings> {
        self.settings.as_ref()
    }

    /// The next row; `None` after the last.
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

    /// The latest row cannot be put on a grid, because its view is not described.
    #[must_use]
    pub fn of_unknown_view(&mut self, view: u32) -> TrajectoryError {
        let (at, column) = (self.place(), VIEW);
        let what = format!("the recording does not describe view {view}");
        self.wrong(TrajectoryFault::Field { at, column, what })
    }

    /// The latest row cannot follow on the one before it.
    pub(super) fn mistimed(&mut self, what: TimeFault) -> TrajectoryError {
        let at = self.place();
        self.wrong(TrajectoryFault::Time { at, what })
    }

    /// Puts a place at the latest row, or between it and the one before, on the grid of a scale.
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

    /// Returns true if the last row of the recording was cut in its middle, and is left out: the
    /// command that wrote it was killed. Known after the last row.
    #[must_use]
    pub fn was_cut(&self) -> bool {
        match &self.form {
            Form::Csv(rows) => rows.was_cut(),
            Form::Parquet(_) => false,
        }
    }

    /// Returns the place of the present row, for a message: no row can be read afterwards.
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

/// Which column of a place is too far from the origin, and what to say of it.
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

/// Returns the comments on placements and marks between the rows of a CSV file; nothing if it
/// cannot be rewound.
fn later_remarks(file: &mut File) -> Result<String, TrajectoryFault> {
    if file.stream_position().is_err() {
        return Ok(String::new());
    }
    let later = comments::later(&mut *file);
    let later = later.and_then(|later| file.seek(SeekFrom::Start(0)).map(|_| later));
    later.map_err(TrajectoryFault::Unreadable)
}

/// Checks that a file begins as Parquet does; what cannot be wound back is CSV.
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
