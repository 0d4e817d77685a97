//! Recordings, column by column.

use std::path::PathBuf;

use hapterra::replay::{ColumnValues, RecordedColumns, ReplayError};
use pyo3::types::PyBytes;
use pyo3::{Bound, PyResult, Python, pyfunction};

use crate::{open, refused};

/// Name, letter and bytes of numpy's type, numbers, and texts.
type Column<'py> = (String, &'static str, Bound<'py, PyBytes>, Vec<String>);

/// Returns the settings as JSON, the columns, and true if the last row was incomplete and is left
/// out.
#[pyfunction]
pub(crate) fn recording(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Option<String>, Vec<Column<'_>>, bool)> {
    let read = py.detach(|| RecordedColumns::read(&path));
    let read = read.map_err(|error| open::failed(ReplayError::from(error).into()))?;
    let settings = read.settings.as_ref().map(serde_json::to_string);
    let columns = read.columns.into_iter().map(|(name, values)| {
        let (kind, bytes, texts) = match values {
            ColumnValues::Counts(counts) => ("i8", bytes(&counts, i64::to_ne_bytes), vec![]),
            ColumnValues::Numbers(numbers) => ("f8", bytes(&numbers, f64::to_ne_bytes), vec![]),
            ColumnValues::Texts(texts) => ("U", vec![], texts),
        };
        (name, kind, PyBytes::new(py, &bytes), texts)
    });
    let settings = settings.transpose().map_err(refused)?;
    Ok((settings, columns.collect(), read.was_cut))
}

fn bytes<T: Copy>(values: &[T], of: impl Fn(T) -> [u8; 8]) -> Vec<u8> {
    values.iter().flat_map(|value| of(*value)).collect()
}
