//! Recordings as Parquet: the columns of the CSV with types, and the settings in the file's
//! metadata under [`KEY`].
//!
//! Uncompressed: the files are small, and readers need no decoder. The file can be read only after
//! it is finished.

use std::io;
use std::sync::Arc;

use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::{BEFORE_CONTACT, CONTACT, Column, NUMBERS, Record, Value};
use crate::output::{Output, OutputError};
use crate::replay::marks::Mark;
use crate::replay::settings::{KEY, PlacementSettings, Settings};

/// Rows in one group, stored until they are written: one minute of a device.
const GROUP: usize = 60_000;

/// A Parquet recording being written.
pub(super) struct Parquet {
    path: std::path::PathBuf,
    writer: SerializedFileWriter<Output>,
    /// The rows of the group that is not written yet, by columns.
    columns: Vec<Values>,
    rows: usize,
    /// Settings and placements as TOML.
    settings: String,
}

/// The values of one column in a group.
enum Values {
    Numbers(Vec<f64>),
    /// Flags: 1 for contact.
    Flags(Vec<i32>),
    Counts(Vec<i64>),
    Texts(Vec<ByteArray>),
}

impl Parquet {
    /// Begins the file.
    pub(super) fn new(output: Output, more: &[Column]) -> Result<Self, OutputError> {
        let path = output.path().to_owned();
        let begun = begin(output, more);
        let writer = begun.map_err(|error| failed(&path, error))?;
        Ok(Self {
            path,
            writer,
            columns: empty(more),
            rows: 0,
            settings: String::new(),
        })
    }

    pub(super) fn describe(&mut self, settings: &Settings) {
        self.settings = settings.of_beginning().to_toml();
    }

    /// Starts another placement. The file's metadata is written at its end.
    pub(super) fn view(&mut self, view: &PlacementSettings) {
        self.settings += &view.to_toml();
    }

    /// Adds a mark to the file's metadata.
    pub(super) fn mark(&mut self, mark: &Mark) {
        self.settings += &mark.to_toml();
    }

    pub(super) fn write(&mut self, record: &Record, more: &[Value<'_>]) -> Result<(), OutputError> {
        if self.rows == GROUP {
            self.write_group()?;
        }
        self.rows += 1;
        let (mut numbers, mut more) = (record.numbers().into_iter(), more.iter());
        for column in &mut self.columns {
            match column {
                Values::Numbers(values) => values.extend(numbers.next()),
                Values::Flags(values) => values.push(record.contact.into()),
                Values::Counts(values) => values.push(match more.next() {
                    Some(Value::Count(count)) => (*count).into(),
                    _ => 0,
                }),
                Values::Texts(values) => values.push(match more.next() {
                    Some(Value::Text(text)) => (*text).into(),
                    _ => "".into(),
                }),
            }
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), OutputError> {
        self.write_group()?;
        if !self.settings.is_empty() {
            let entry = KeyValue::new(KEY.to_owned(), self.settings);
            self.writer.append_key_value_metadata(entry);
        }
        let output = self.writer.into_inner();
        output.map_err(|error| failed(&self.path, error))?.finish()
    }

    fn write_group(&mut self) -> Result<(), OutputError> {
        self.rows = 0;
        let written = self.writer.next_row_group().and_then(|mut group| {
            for column in &mut self.columns {
                column.write(&mut group)?;
            }
            group.close()
        });
        written.map(drop).map_err(|error| failed(&self.path, error))
    }
}

impl Values {
    /// Writes the values as the group's next column and clears them.
    fn write(
        &mut self,
        group: &mut SerializedRowGroupWriter<'_, Output>,
    ) -> Result<(), ParquetError> {
        match self {
            Self::Numbers(values) => write::<DoubleType>(values, group),
            Self::Flags(values) => write::<Int32Type>(values, group),
            Self::Counts(values) => write::<Int64Type>(values, group),
            Self::Texts(values) => write::<ByteArrayType>(values, group),
        }
    }
}

fn write<T: DataType>(
    values: &mut Vec<T::T>,
    group: &mut SerializedRowGroupWriter<'_, Output>,
) -> Result<(), ParquetError> {
    // The schema has as many columns as there are values, so this never fails.
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(values, None, None)?;
        column.close()?;
    }
    values.clear();
    Ok(())
}

/// Returns the columns in order, without values.
fn empty(more: &[Column]) -> Vec<Values> {
    let numbers = |_: &&str| Values::Numbers(Vec::new());
    let (before, after) = NUMBERS.split_at(BEFORE_CONTACT);
    let more = more.iter().map(|column| match column {
        Column::Text(_) => Values::Texts(Vec::new()),
        Column::Count(_) => Values::Counts(Vec::new()),
    });
    let columns = before.iter().map(numbers);
    let columns = columns.chain([Values::Flags(Vec::new())]);
    columns
        .chain(after.iter().map(numbers))
        .chain(more)
        .collect()
}

fn begin(output: Output, more: &[Column]) -> Result<SerializedFileWriter<Output>, ParquetError> {
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("hapterra {}", env!("CARGO_PKG_VERSION")))
        // Numbers rarely repeat; words do.
        .set_dictionary_enabled(false);
    for column in more {
        if let Column::Text(name) = column {
            let path = ColumnPath::from(*name);
            properties = properties.set_column_dictionary_enabled(path, true);
        }
    }
    let schema = Arc::new(schema(more)?);
    SerializedFileWriter::new(output, schema, Arc::new(properties.build()))
}

fn schema(more: &[Column]) -> Result<Type, ParquetError> {
    let (before, after) = NUMBERS.split_at(BEFORE_CONTACT);
    let mut fields = Vec::new();
    for name in before {
        fields.push(field(name, Physical::DOUBLE)?);
    }
    fields.push(field(CONTACT, Physical::INT32)?);
    for name in after {
        fields.push(field(name, Physical::DOUBLE)?);
    }
    for column in more {
        let physical = match column {
            Column::Text(_) => Physical::BYTE_ARRAY,
            Column::Count(_) => Physical::INT64,
        };
        fields.push(field(column.name(), physical)?);
    }
    Type::group_type_builder("recording")
        .with_fields(fields)
        .build()
}

fn field(name: &str, physical: Physical) -> Result<Arc<Type>, ParquetError> {
    let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
    let field = match physical {
        Physical::BYTE_ARRAY => field
            .with_logical_type(Some(LogicalType::String))
            .with_converted_type(ConvertedType::UTF8),
        _ => field,
    };
    field.build().map(Arc::new)
}

fn failed(path: &std::path::Path, error: ParquetError) -> OutputError {
    let source = match error {
        ParquetError::External(error) => match error.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(error) => io::Error::other(error),
        },
        other => io::Error::other(other),
    };
    OutputError {
        path: path.to_owned(),
        source,
    }
}
