//! Rows of a Parquet recording.

use std::fs::File;
use std::io;

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::{COLUMNS, Row, TrajectoryFault, VIEW, columns_of, row};
use crate::replay::settings::KEY;

/// Rows read at a time.
const BATCH_ROWS: usize = 4096;

/// Rows of a Parquet file, read in batches.
pub(super) struct Rows {
    reader: SerializedFileReader<File>,
    /// The next group of rows to read.
    next_group: usize,
    /// The columns to read.
    names: &'static [&'static str],
    /// Readers of the columns of the present group.
    columns: Vec<ColumnReaderImpl<DoubleType>>,
    /// Index of the column with the placement's number, if there is one; its reader, and its
    /// values.
    view_column: Option<usize>,
    view: Option<ColumnReaderImpl<Int64Type>>,
    views: Vec<i64>,
    /// The rows of the batch; those from `next` on are pending.
    read: Vec<Vec<f64>>,
    next: usize,
    /// Number of returned rows.
    reported: u64,
}

impl Rows {
    /// Opens a file and checks its columns. Also returns its settings as text.
    pub(super) fn open(file: File) -> Result<(Self, String), TrajectoryFault> {
        let reader = SerializedFileReader::new(file).map_err(unreadable)?;
        let about = reader.metadata().file_metadata();
        let entries = about.key_value_metadata().into_iter().flatten();
        let settings = entries.filter(|entry| entry.key == KEY);
        let text = settings.filter_map(|entry| entry.value.clone()).collect();
        let schema = about.schema_descr().columns();
        let names: Vec<_> = schema.iter().map(|column| column.name()).collect();
        let Some(read) = columns_of(&names) else {
            let first: Vec<_> = names.into_iter().take(COLUMNS.len()).collect();
            return Err(TrajectoryFault::Schema(first.join(", ")));
        };
        let view_column = names.iter().position(|name| *name == VIEW);
        let rows = Self {
            view_column,
            view: None,
            views: Vec::new(),
            reader,
            next_group: 0,
            names: read,
            columns: Vec::new(),
            read: vec![Vec::new(); read.len()],
            next: 0,
            reported: 0,
        };
        Ok((rows, text))
    }

    /// Returns the next row; `None` after the last.
    pub(super) fn next(&mut self) -> Result<Option<Row>, TrajectoryFault> {
        while self.next >= self.read.first().map_or(0, Vec::len) {
            if !self.read_more()? {
                return Ok(None);
            }
        }
        let mut numbers = [0.0; COLUMNS.len()];
        let numbers = numbers.get_mut(..self.read.len()).unwrap_or_default();
        let columns = self.names.iter().zip(&self.read);
        for (number, (column, values)) in numbers.iter_mut().zip(columns) {
            let value = values.get(self.next).copied().filter(|x| x.is_finite());
            *number = value.ok_or_else(|| TrajectoryFault::Field {
                at: format!("row {}", self.reported + 1),
                column,
                what: "no finite number".into(),
            })?;
        }
        let view = self.views.get(self.next).copied().unwrap_or(0);
        let view = u32::try_from(view).map_err(|_| TrajectoryFault::Field {
            at: format!("row {}", self.reported + 1),
            column: VIEW,
            what: format!("{view} is no number of a view"),
        })?;
        self.next += 1;
        self.reported += 1;
        Ok(Some(row(numbers, view)))
    }

    /// Returns the position of the present row, for a message.
    pub(super) fn place(&self) -> String {
        format!("row {}", self.reported)
    }

    /// Reads some rows of the present group, or of the next; returns false after the last.
    fn read_more(&mut self) -> Result<bool, TrajectoryFault> {
        self.next = 0;
        for values in &mut self.read {
            values.clear();
        }
        for (column, values) in self.columns.iter_mut().zip(&mut self.read) {
            let read = column.read_records(BATCH_ROWS, None, None, values);
            read.map_err(unreadable)?;
        }
        self.views.clear();
        if let Some(column) = &mut self.view {
            let read = column.read_records(BATCH_ROWS, None, None, &mut self.views);
            read.map_err(unreadable)?;
        }
        if self.read.first().is_some_and(|values| !values.is_empty()) {
            return Ok(true);
        }
        if self.next_group >= self.reader.num_row_groups() {
            return Ok(false);
        }
        let group = self
            .reader
            .get_row_group(self.next_group)
            .map_err(unreadable)?;
        self.next_group += 1;
        self.columns.clear();
        for (index, name) in self.names.iter().enumerate() {
            let column = group.get_column_reader(index).map_err(unreadable)?;
            let ColumnReader::DoubleColumnReader(column) = column else {
                return Err(TrajectoryFault::Schema(format!("{name}, another type")));
            };
            self.columns.push(column);
        }
        self.view = match self.view_column {
            None => None,
            Some(index) => match group.get_column_reader(index).map_err(unreadable)? {
                ColumnReader::Int64ColumnReader(column) => Some(column),
                _ => return Err(TrajectoryFault::Schema(format!("{VIEW}, another type"))),
            },
        };
        Ok(true)
    }
}

fn unreadable(error: ParquetError) -> TrajectoryFault {
    TrajectoryFault::Unreadable(io::Error::other(error))
}
