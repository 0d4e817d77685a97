//! Rows of a recording with all columns, for another display.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};
use hapterra_core::rate::TickRate;
use parquet::file::reader::SerializedFileReader;
use parquet::record::Field;
use parquet::record::reader::RowIter;

use super::bounded::Bounded;
use super::fault::{TrajectoryError, TrajectoryFault};
use super::{Trajectory, is_parquet};
use crate::replay::recording::{CONTACT, NUMBERS};
use crate::replay::{Record, Settings};
use heightfield::regular_file;

/// Columns of a recording by name: time and HIP, then those that a trajectory lacks.
const NAMES: [&str; NUMBERS.len() + 1] = {
    let mut names = [CONTACT; NUMBERS.len() + 1];
    names
        .split_at_mut(NUMBERS.len())
        .0
        .copy_from_slice(&NUMBERS);
    names
};

/// Values of [`NAMES`]; `None` for missing columns.
type Values = [Option<f64>; NAMES.len()];

/// Row of a recording.
#[derive(Clone, Copy, Debug)]
pub struct RecordingRow {
    /// The placement of the row: [`super::Row::view`].
    pub view: u32,
    /// Its record. A trajectory has only the HIP: no contact, and the proxy at the HIP.
    pub record: Record,
}

/// Rows of a recording or a trajectory, in the order of the file.
pub struct RecordingRows {
    path: PathBuf,
    /// The same rows as a replay reads them: it reports their faults, the placement, and an
    /// incomplete end.
    trajectory: Trajectory,
    form: Form,
    /// Rows so far of a file without times: one in each tick.
    untimed: u64,
}

enum Form {
    Csv {
        reader: Box<csv::Reader<Bounded<File>>>,
        /// Index of each of [`NAMES`] in the file.
        columns: [Option<usize>; NAMES.len()],
        record: StringRecord,
    },
    Parquet(Box<RowIter<'static>>),
}

impl RecordingRows {
    /// Opens a recording and checks it like [`Trajectory::open`].
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn open(path: &Path) -> Result<Self, TrajectoryError> {
        let trajectory = Trajectory::open(path)?;
        let form = form(path).map_err(|fault| TrajectoryError::new(path, fault))?;
        Ok(Self {
            path: path.to_owned(),
            trajectory,
            form,
            untimed: 0,
        })
    }

    /// Returns the settings of the recording, if it has them.
    #[must_use]
    pub const fn settings(&self) -> Option<&Settings> {
        self.trajectory.settings()
    }

    /// As [`Trajectory::was_cut`].
    #[must_use]
    pub fn was_cut(&self) -> bool {
        self.trajectory.was_cut()
    }

    fn next_row(&mut self) -> Result<Option<RecordingRow>, TrajectoryError> {
        let Some(row) = self.trajectory.next_row()? else {
            return Ok(None);
        };
        let described = self.trajectory.settings();
        let knows = |settings: &Settings| {
            settings.views.is_empty() || settings.views.iter().any(|view| view.number == row.view)
        };
        if row.view != 0 && !described.is_none_or(knows) {
            return Err(self.trajectory.of_unknown_view(row.view));
        }
        let values = self.form.values();
        let values = values.map_err(|fault| TrajectoryError::new(&self.path, fault))?;
        let mut record = values.as_ref().map(record);
        if let (None, Some(record)) = (row.t_s, &mut record) {
            record.t_s = self.untimed as f64 / f64::from(TickRate::DEFAULT.hz());
            self.untimed += 1;
        }
        Ok(record.map(|record| RecordingRow {
            view: row.view,
            record,
        }))
    }
}

impl Iterator for RecordingRows {
    type Item = Result<RecordingRow, TrajectoryError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_row().transpose()
    }
}

impl Form {
    fn values(&mut self) -> Result<Option<Values>, TrajectoryFault> {
        match self {
            Self::Csv {
                reader,
                columns,
                record,
            } => {
                if !reader.read_record(record).map_err(unreadable)? {
                    return Ok(None);
                }
                let value = |column: &Option<usize>| record.get((*column)?)?.parse().ok();
                Ok(Some(columns.each_ref().map(value)))
            }
            Self::Parquet(rows) => {
                let Some(row) = rows.next() else {
                    return Ok(None);
                };
                let row = row.map_err(unreadable)?;
                let mut values = Values::default();
                for (name, field) in row.get_column_iter() {
                    let place = NAMES.iter().position(|known| known == name);
                    if let Some(value) = place.and_then(|place| values.get_mut(place)) {
                        *value = match field {
                            Field::Double(number) => Some(*number),
                            Field::Float(number) => Some(f64::from(*number)),
                            Field::Int(number) => Some(f64::from(*number)),
                            Field::Bool(flag) => Some(f64::from(u8::from(*flag))),
                            _ => None,
                        };
                    }
                }
                Ok(Some(values))
            }
        }
    }
}

fn record(values: &Values) -> Record {
    let known = |value: &Option<f64>| value.filter(|value| value.is_finite());
    let [t, x, y, z, px, py, pz, fx, fy, fz, contact] = values.each_ref().map(known);
    let [x, y, z] = [x, y, z].map(Option::unwrap_or_default);
    let force_n = [fx, fy, fz].map(Option::unwrap_or_default);
    Record {
        t_s: t.unwrap_or_default(),
        hip_mm: [x, y, z],
        contact: contact.is_some_and(|flag| flag != 0.0),
        proxy_mm: [px.unwrap_or(x), py.unwrap_or(y), pz.unwrap_or(z)],
        force_n,
    }
}

fn form(path: &Path) -> Result<Form, TrajectoryFault> {
    let mut file = regular_file::open(path).map_err(TrajectoryFault::Unreadable)?;
    if is_parquet(&mut file)? {
        let reader = SerializedFileReader::new(file).map_err(unreadable)?;
        return Ok(Form::Parquet(Box::new(RowIter::from_file_into(Box::new(
            reader,
        )))));
    }
    let mut reader = ReaderBuilder::new()
        .flexible(true)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(Bounded::new(file));
    let header = reader.headers().map_err(unreadable)?.clone();
    let columns = NAMES.map(|name| header.iter().position(|column| column == name));
    Ok(Form::Csv {
        reader: Box::new(reader),
        columns,
        record: StringRecord::new(),
    })
}

fn unreadable(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> TrajectoryFault {
    TrajectoryFault::Unreadable(io::Error::other(error))
}
