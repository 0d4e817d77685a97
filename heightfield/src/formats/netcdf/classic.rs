//! A variable of the classic format: its samples lie plainly in the file.

use netcdf_reader::classic::data::compute_record_stride;
use netcdf_reader::{NcFile, NcVariable};

use super::fault;
use crate::plain::Plain;
use crate::read::Stored;
use crate::samples::Endian;
use crate::{BadRaster, SampleType};

/// Where the samples of a variable lie, which have a type and so many columns and rows as the
/// file has them.
///
/// # Errors
/// [`BadRaster::Truncated`] where they are not inside of so many bytes.
pub(super) fn plain(
    file: &NcFile,
    heights: &NcVariable,
    sample: SampleType,
    (columns, rows): (u32, u32),
    file_bytes: u64,
) -> Result<Plain, BadRaster> {
    let packed = Plain::packed(
        (columns, rows),
        Stored::Held(sample),
        Endian::Big,
        heights.data_offset,
    );
    let is_by_records = heights.is_record_var && heights.dimensions.len() == 2;
    let plain = match is_by_records {
        true => {
            // Each row is a record, and those of other variables lie between.
            let variables = file.variables().map_err(|error| fault(&error))?;
            let row = compute_record_stride(variables).map_err(|error| fault(&error))?;
            Plain { row, ..packed }
        }
        false => packed,
    };
    let last_row = u64::from(rows.max(1) - 1).checked_mul(plain.row);
    let row_bytes = u64::from(columns).saturating_mul(sample.bytes());
    let end = last_row
        .and_then(|last| last.checked_add(row_bytes))
        .and_then(|bytes| bytes.checked_add(plain.first));
    match end {
        Some(end) if end <= file_bytes => Ok(plain),
        _ => Err(BadRaster::Truncated(format!(
            "{columns} × {rows} samples do not fit into its {file_bytes} bytes"
        ))),
    }
}
