//! All columns of a recording at once, for programs that work with whole recordings.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use csv::{ReaderBuilder, StringRecord};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::{COLUMNS, Settings, Trajectory, TrajectoryError, TrajectoryFault, is_parquet};
use crate::replay::states::update_name;
use heightfield::regular_file;

/// Units at the end of the names of columns with fractional numbers.
const UNITS: [&str; 3] = ["_s", "_mm", "_n"];
/// Name of the column of the proxy's states.
const STATE: &str = "state";

/// A recording in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedColumns {
    /// The settings; `None` if the recording has none.
    pub settings: Option<Settings>,
    /// Names and values of the columns, in order. All have the same number of values.
    pub columns: Vec<(String, ColumnValues)>,
    /// True if the last row of a CSV file was incomplete, and is left out.
    pub was_cut: bool,
}

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum ColumnValues {
    /// Whole numbers.
    Counts(Vec<i64>),
    /// Fractional numbers, in the unit at the end of the column's name.
    Numbers(Vec<f64>),
    /// Words.
    Texts(Vec<String>),
}

type Columns = Vec<(String, ColumnValues)>;

impl RecordedColumns {
    /// Reads a recording, CSV or Parquet, with today's names for states of the proxy. Columns of
    /// CSV without a unit are counts if all their values are, otherwise numbers, otherwise words.
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn read(path: &Path) -> Result<Self, TrajectoryError> {
        // This also checks the header.
        let settings = Trajectory::open(path)?.settings;
        let read = read(path).map_err(|fault| TrajectoryError::new(path, fault));
        let (mut columns, was_cut) = read?;
        if let Some(states) = columns.iter_mut().find_map(states) {
            states.iter_mut().for_each(update_name);
        }
        Ok(Self {
            settings,
            columns,
            was_cut,
        })
    }
}

/// Returns the values of the column of the proxy's states.
fn states((name, values): &mut (String, ColumnValues)) -> Option<&mut Vec<String>> {
    match values {
        ColumnValues::Texts(texts) if name == STATE => Some(texts),
        _ => None,
    }
}

fn read(path: &Path) -> Result<(Columns, bool), TrajectoryFault> {
    let mut file = regular_file::open(path).map_err(TrajectoryFault::Unreadable)?;
    match is_parquet(&mut file)? {
        true => Ok((of_parquet(file)?, false)),
        false => {
            let mut content = Vec::new();
            let read = file.read_to_end(&mut content);
            read.map_err(TrajectoryFault::Unreadable)?;
            of_csv(&content)
        }
    }
}

fn of_csv(content: &[u8]) -> Result<(Columns, bool), TrajectoryFault> {
    let unreadable = |error| TrajectoryFault::Unreadable(io::Error::other::<csv::Error>(error));
    let mut reader = ReaderBuilder::new()
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(content);
    let begun = |name: &str| match UNITS.iter().any(|unit| name.ends_with(unit)) {
        true => (name.to_owned(), ColumnValues::Numbers(Vec::new())),
        false => (name.to_owned(), ColumnValues::Counts(Vec::new())),
    };
    let header = reader.headers().map_err(unreadable)?;
    let mut columns: Columns = header.iter().map(begun).collect();
    let mut record = StringRecord::new();
    let mut row = 0_u64;
    while reader.read_record(&mut record).map_err(unreadable)? {
        row += 1;
        let (found, expected) = (record.len(), columns.len());
        if found < expected && expected > COLUMNS.len() && !content.ends_with(b"\n") {
            let is_last = !reader.read_record(&mut record).map_err(unreadable)?;
            if is_last {
                return Ok((columns, true));
            }
        }
        if found != expected {
            return Err(TrajectoryFault::Columns {
                at: format!("row {row}"),
                found,
                expected,
            });
        }
        for ((_, values), field) in columns.iter_mut().zip(&record) {
            values.push(field);
        }
    }
    Ok((columns, false))
}

fn of_parquet(file: File) -> Result<Columns, TrajectoryFault> {
    let reader = SerializedFileReader::new(file).map_err(unreadable)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let mut columns = Columns::new();
    for (index, column) in schema.columns().iter().enumerate() {
        let mut values = None::<ColumnValues>;
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(unreadable)?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let column = group.get_column_reader(index).map_err(unreadable)?;
            let more = of_column(column, rows)?;
            match &mut values {
                None => values = Some(more),
                Some(values) => values.append(more),
            }
        }
        let values = values.unwrap_or(ColumnValues::Numbers(Vec::new()));
        columns.push((column.name().to_owned(), values));
    }
    Ok(columns)
}

fn of_column(column: ColumnReader, rows: usize) -> Result<ColumnValues, TrajectoryFault> {
    Ok(match column {
        ColumnReader::DoubleColumnReader(column) => ColumnValues::Numbers(all(column, rows)?),
        ColumnReader::Int64ColumnReader(column) => ColumnValues::Counts(all(column, rows)?),
        ColumnReader::Int32ColumnReader(column) => {
            let values = all(column, rows)?.into_iter();
            ColumnValues::Counts(values.map(i64::from).collect())
        }
        ColumnReader::ByteArrayColumnReader(column) => {
            let values = all(column, rows)?.into_iter();
            let texts = values.map(|text| String::from_utf8_lossy(text.data()).into_owned());
            ColumnValues::Texts(texts.collect())
        }
        _ => return Err(TrajectoryFault::Schema("of another type".into())),
    })
}

fn all<T: DataType>(
    mut column: ColumnReaderImpl<T>,
    rows: usize,
) -> Result<Vec<T::T>, TrajectoryFault> {
    let mut values = Vec::new();
    let read = column.read_records(rows, None, None, &mut values);
    read.map_err(unreadable)?;
    Ok(values)
}

fn unreadable(error: ParquetError) -> TrajectoryFault {
    TrajectoryFault::Unreadable(io::Error::other(error))
}

impl ColumnValues {
    /// Adds a field of a CSV file.
    fn push(&mut self, field: &str) {
        match (&mut *self, field.parse(), field.parse()) {
            (Self::Texts(values), ..) => values.push(field.to_owned()),
            (Self::Counts(values), Ok(count), _) => values.push(count),
            (Self::Numbers(values), _, Ok(number)) => values.push(number),
            (Self::Counts(values), _, Ok(number)) => {
                let numbers = values.iter().map(|count| *count as f64);
                *self = Self::Numbers(numbers.chain([number]).collect());
            }
            (Self::Counts(values), ..) => *self = Self::words(values, field),
            (Self::Numbers(values), ..) => *self = Self::words(values, field),
        }
    }

    fn words<T: ToString>(values: &[T], field: &str) -> Self {
        let texts = values.iter().map(T::to_string);
        Self::Texts(texts.chain([field.to_owned()]).collect())
    }

    fn append(&mut self, more: Self) {
        match (self, more) {
            (Self::Counts(values), Self::Counts(more)) => values.extend(more),
            (Self::Numbers(values), Self::Numbers(more)) => values.extend(more),
            (Self::Texts(values), Self::Texts(more)) => values.extend(more),
            // By the schema, a column has the same type in all groups.
            _ => {}
        }
    }
}
