//! Trajectory files: `t_s,x_mm,y_mm,z_mm` as CSV, or a recording in either form.
//!
//! Lengths are millimetres of the arm's tip over the felt terrain: x east, y north, z up,
//! origin at the south-west sample at height zero.

mod bounded;
mod comments;
mod csv;
mod fault;
mod felt_rows;
mod parquet;

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use hapterra_core::grid::{GridPoint, MAX_CELL};

pub use fault::TrajectoryError;
pub use felt_rows::{FeltRow, FeltRows};

use super::settings::Settings;
use crate::terrain::Scale;
use fault::TrajectoryFault;

/// The columns, in this order. A recording begins with them, too, and further
/// columns are passed over, so what was recorded can be replayed.
const COLUMNS: [&str; 4] = ["t_s", "x_mm", "y_mm", "z_mm"];

/// The column that tells in which view a row was felt.
const VIEW: &str = "view";

/// One position of the HIP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Position of the HIP, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The same on the grid.
    pub hip: GridPoint,
}

/// What a row tells before its place is laid on a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    numbers: Numbers,
    /// The view that it was felt in; 0 for the view of the beginning, or where nothing is said.
    pub view: u32,
}

/// A trajectory that is read row by row.
pub struct Trajectory {
    path: PathBuf,
    form: Form,
    settings: Option<Settings>,
    latest_s: f64,
    told: bool,
}

enum Form {
    Csv(Box<csv::Rows<File>>),
    Parquet(Box<parquet::Rows>),
}

/// A row as it stands in the file: the values of [`COLUMNS`].
type Numbers = [f64; COLUMNS.len()];

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
        let mut file = File::open(path).map_err(TrajectoryFault::Unreadable)?;
        let (form, text) = match is_parquet(&mut file)? {
            true => {
                let (rows, text) = parquet::Rows::open(file)?;
                (Form::Parquet(Box::new(rows)), text)
            }
            false => {
                let views = views_of(&mut file)?;
                let (rows, text) = csv::Rows::open(file)?;
                // Remarks that are no settings are followed by no views.
                (Form::Csv(Box::new(rows)), text + &views)
            }
        };
        Ok(Self {
            path: path.to_owned(),
            form,
            settings: Settings::from_toml(&text).map_err(TrajectoryFault::Settings)?,
            latest_s: f64::NEG_INFINITY,
            told: false,
        })
    }

    /// With which settings it was recorded; none where it is no recording, or one of a
    /// version that did not say.
    #[must_use]
    pub const fn settings(&self) -> Option<&Settings> {
        self.settings.as_ref()
    }

    /// The next row, on the grid of a scale; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] names the line and the column.
    pub fn next_row(&mut self, scale: &Scale) -> Result<Option<Row>, TrajectoryError> {
        match self.next_told()? {
            Some(told) => self.lay(&told, scale).map(Some),
            None => Ok(None),
        }
    }

    /// The next row as it stands in the file; `None` after the last. [`Self::lay`] puts it on
    /// the grid of its view.
    ///
    /// # Errors
    /// As [`Self::next_row`].
    pub fn next_told(&mut self) -> Result<Option<Told>, TrajectoryError> {
        let told = match &mut self.form {
            Form::Csv(rows) => rows.next(),
            Form::Parquet(rows) => rows.next(),
        };
        told.map_err(|fault| self.wrong(fault))
    }

    /// A row that nobody can lay on a grid, because its view is not described.
    #[must_use]
    pub fn of_unknown_view(&mut self, told: &Told) -> TrajectoryError {
        let (at, column) = (self.place(), VIEW);
        let what = format!("the recording does not describe view {}", told.view);
        self.wrong(TrajectoryFault::Field { at, column, what })
    }

    /// The latest row on the grid of a scale.
    ///
    /// # Errors
    /// As [`Self::next_row`].
    pub fn lay(&mut self, told: &Told, scale: &Scale) -> Result<Row, TrajectoryError> {
        let [t_s, x, y, z] = told.numbers;
        let hip_mm = [x, y, z];
        let Some(hip) = scale.to_grid(hip_mm) else {
            let (column, what) = far(hip_mm, scale);
            let at = self.place();
            return Err(self.wrong(TrajectoryFault::Field { at, column, what }));
        };
        self.watch_time(t_s);
        Ok(Row { t_s, hip_mm, hip })
    }

    /// Whether the last row of the recording was cut in its middle, and is left out: the
    /// command that wrote it was killed. Known after the last row.
    #[must_use]
    pub fn was_cut(&self) -> bool {
        match &self.form {
            Form::Csv(rows) => rows.was_cut(),
            Form::Parquet(_) => false,
        }
    }

    /// Where the present row is, for a message: no row can be read afterwards.
    fn place(&mut self) -> String {
        match &mut self.form {
            Form::Csv(rows) => rows.place(),
            Form::Parquet(rows) => rows.place(),
        }
    }

    fn wrong(&self, fault: TrajectoryFault) -> TrajectoryError {
        TrajectoryError::new(&self.path, fault)
    }

    /// Time is passed on, not used; that it runs backwards is worth a word, once.
    fn watch_time(&mut self, t_s: f64) {
        if t_s < self.latest_s && !self.told {
            tracing::warn!(
                "{}: time runs backwards at {t_s} s; rows are felt in the order of the file",
                self.path.display()
            );
            self.told = true;
        }
        self.latest_s = t_s;
    }
}

/// Which column of a place is too far from the origin, and what to say of it.
fn far(hip_mm: [f64; 3], scale: &Scale) -> (&'static str, String) {
    let cell_mm = scale.cell_mm();
    let far = |mm: &f64| (mm / cell_mm).abs() > f64::from(MAX_CELL);
    let axis = hip_mm.iter().position(far).unwrap_or(0);
    let mm = hip_mm.get(axis).copied().unwrap_or_default();
    let what = format!("{mm} mm is farther than {MAX_CELL} cells of {cell_mm} mm from the origin");
    (COLUMNS[1 + axis], what)
}

/// What a CSV file tells of views between its rows; nothing where it cannot be wound back.
fn views_of(file: &mut File) -> Result<String, TrajectoryFault> {
    if file.stream_position().is_err() {
        return Ok(String::new());
    }
    let views = comments::views(&mut *file);
    let views = views.and_then(|views| file.seek(SeekFrom::Start(0)).map(|_| views));
    views.map_err(TrajectoryFault::Unreadable)
}

/// Whether a file begins as Parquet does; what cannot be wound back is CSV.
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
