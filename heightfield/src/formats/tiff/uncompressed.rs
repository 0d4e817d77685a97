//! Large strips and tiles without compression, or decompressed into a file: only the needed rows
//! are read.
//!
//! The decoder reads whole strips and tiles, and some writers use a single one for an image.

use std::ops::Range;

use tiff_reader::ByteOrder;

use super::decoder_error::fault;
use super::index::Chunk;
use super::layout::Layout;
use super::unpack;
use crate::blocks::Part;
use crate::samples::{Endian, with_samples};
use crate::{RasterError, Samples};

/// Reads a part of a band, the first being 0, from a layout with [readable
/// rows](Layout::is_read_by_rows).
pub(super) fn read(layout: &Layout, band: usize, part: &Part) -> Result<Samples, RasterError> {
    let stored = layout.sample();
    let endian = match layout.directory.file().byte_order() {
        _ if layout.unpacked.is_some() => unpack::ENDIAN,
        ByteOrder::LittleEndian => Endian::Little,
        ByteOrder::BigEndian => Endian::Big,
    };
    let stride = layout.texel_bytes() as usize;
    let first = layout.bytes_before(band);
    let count = u64::from(part.columns) * u64::from(part.rows);
    let mut samples = stored.reserve(count)?;
    for row in part.row..part.row + part.rows {
        let row = Part {
            row,
            rows: 1,
            ..*part
        };
        for chunk in layout.chunks_of(band, &row) {
            for range in rows(layout, &chunk, &row) {
                let bytes = bytes(layout, &chunk, range)?;
                stored.append(&mut samples, &bytes[first..], stride, endian);
            }
        }
    }
    let has_all = with_samples!(&samples, values => values.len() as u64 == count);
    match has_all {
        true => Ok(samples),
        false => Err(RasterError::damaged(
            "TIFF: its index has too few strips or tiles",
        )),
    }
}

/// Returns the byte ranges of a part's rows in a strip or tile.
pub(super) fn rows(
    layout: &Layout,
    chunk: &Chunk,
    part: &Part,
) -> impl Iterator<Item = Range<u64>> + use<> {
    let (covers, inside) = (chunk.covers, chunk.covers.within(part));
    let columns = layout.row_range(inside.column - covers.column, inside.columns);
    let row_bytes = layout.row_bytes();
    (inside.row..inside.row + inside.rows).map(move |row| {
        // A saturated offset is beyond the end of the file.
        let before = u64::from(row - covers.row).saturating_mul(row_bytes);
        before.saturating_add(columns.start)..before.saturating_add(columns.end)
    })
}

/// Reads the bytes of a row; zeros if its strip or tile is missing in a sparse file.
pub(super) fn bytes(
    layout: &Layout,
    chunk: &Chunk,
    range: Range<u64>,
) -> Result<Vec<u8>, RasterError> {
    let too_long =
        || RasterError::AbsurdSize("TIFF: a row of more bytes than fit in memory".into());
    let count = usize::try_from(range.end - range.start).map_err(|_| too_long())?;
    if chunk.bytes == 0 {
        return Ok(vec![0; count]);
    }
    if let Some(unpacked) = &layout.unpacked {
        return unpacked.read(chunk, range, |rows| unpack::each_row(layout, chunk, rows));
    }
    if range.end > chunk.bytes {
        return Err(RasterError::damaged(
            "TIFF: a strip or tile of fewer bytes than its samples",
        ));
    }
    let source = layout.directory.file().source();
    let place = chunk.place.saturating_add(range.start);
    source.read_exact_at(place, count).map_err(fault)
}

#[cfg(test)]
#[path = "uncompressed_tests.rs"]
mod tests;
