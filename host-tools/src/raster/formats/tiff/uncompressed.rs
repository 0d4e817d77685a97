//! Large strips and tiles without compression: the rows that are wanted are read, and no more.
//!
//! The decoder reads a strip or tile as a whole, and some writers put all of an image into one.

use std::ops::Range;

use tiff_reader::{ByteOrder, TiffFile};

use super::fault::fault;
use super::layout::{Chunk, Layout};
use crate::raster::blocks::Part;
use crate::raster::samples::{Endian, with_samples};
use crate::raster::{BadRaster, Samples};

/// Reads a part of a band, the first being 0, of a layout that [is plain](Layout::is_plain).
pub(super) fn read(layout: &Layout, band: usize, part: &Part) -> Result<Samples, BadRaster> {
    let file = layout.directory.file();
    let stored = layout.sample();
    let endian = match file.byte_order() {
        ByteOrder::LittleEndian => Endian::Little,
        ByteOrder::BigEndian => Endian::Big,
    };
    let apart = layout.texel_bytes() as usize;
    let first = layout.bytes_before(band);
    let count = u64::from(part.columns) * u64::from(part.rows);
    let mut samples = stored.room(count)?;
    for row in part.row..part.row + part.rows {
        let row = Part {
            row,
            rows: 1,
            ..*part
        };
        for chunk in layout.chunks_of(band, &row) {
            for range in rows(layout, &chunk, &row) {
                let bytes = bytes(file, &chunk, range)?;
                stored.append(&mut samples, &bytes[first..], apart, endian);
            }
        }
    }
    let has_all = with_samples!(&samples, values => values.len() as u64 == count);
    match has_all {
        true => Ok(samples),
        false => Err(BadRaster::damaged(
            "TIFF: its index has too few strips or tiles",
        )),
    }
}

/// Where the rows of a strip or tile that are in a part lie in the file, as far as they are in it.
pub(super) fn rows(
    layout: &Layout,
    chunk: &Chunk,
    part: &Part,
) -> impl Iterator<Item = Range<u64>> + use<> {
    let (place, covers, texel) = (chunk.place, chunk.covers, layout.texel_bytes());
    let (width, inside) = (u64::from(layout.chunk.0), covers.within(part));
    (inside.row..inside.row + inside.rows).map(move |row| {
        let before = u64::from(row - covers.row) * width + u64::from(inside.column - covers.column);
        // What is beyond all numbers is beyond the file.
        let from = place.saturating_add(before.saturating_mul(texel));
        from..from.saturating_add(u64::from(inside.columns).saturating_mul(texel))
    })
}

/// The bytes of a row; zeros where a sparse file leaves its strip or tile out.
fn bytes(file: &TiffFile, chunk: &Chunk, range: Range<u64>) -> Result<Vec<u8>, BadRaster> {
    let too_long = || BadRaster::AbsurdSize("TIFF: a row of more bytes than memory holds".into());
    let count = usize::try_from(range.end - range.start).map_err(|_| too_long())?;
    if chunk.bytes == 0 {
        return Ok(vec![0; count]);
    }
    if range.end > chunk.place.saturating_add(chunk.bytes) {
        return Err(BadRaster::damaged(
            "TIFF: a strip or tile of fewer bytes than its samples take",
        ));
    }
    let source = file.source();
    source.read_exact_at(range.start, count).map_err(fault)
}

#[cfg(test)]
#[path = "uncompressed_tests.rs"]
mod tests;
