//! Large compressed strips and tiles: their rows are decompressed one by one, in the memory of a
//! row and of the compression's history.
//!
//! The decoder decompresses a whole strip or tile and then copies it, and some writers use a single
//! one for an image.

mod codec;
mod stored;

use std::io::{self, ErrorKind, Read};
use std::sync::Arc;

use tiff_reader::filters::fix_endianness_and_predict;

use super::decoder_error::fault;
use super::index::Chunk;
use super::layout::{Layout, MAX_DECODED};
use super::unpacked_on_disk::{RowSink, Unpacked};
use crate::blocks::{MAX_BLOCK_BYTES, Part};
use crate::disk_cache::DiskCache;
use crate::samples::{Endian, SampleValue, with_samples};
use crate::{RasterError, Samples};
use stored::StoredBytes;

/// Byte order of decompressed rows: this machine's.
pub(super) const ENDIAN: Endian = match cfg!(target_endian = "big") {
    true => Endian::Big,
    false => Endian::Little,
};

/// Returns true if the strips or tiles of a layout can be decompressed row by row. One row must fit
/// in memory.
pub(super) fn suits(layout: &Layout) -> bool {
    codec::is_known(layout.directory.ifd().compression())
        && (1..=MAX_BLOCK_BYTES).contains(&layout.row_bytes())
}

/// Decompresses strips or tiles into a file on disk on access. The file has space for two strips or
/// rows of tiles of any size, and as many of a separate alpha band: a row of blocks may overlap
/// two, and they are then not decompressed again for each block. More are stored within the bound
/// of the cache.
///
/// # Errors
/// The reason why that is impossible.
pub(super) fn into_file(layout: &mut Layout, disk: &DiskCache) -> io::Result<()> {
    if !suits(layout) {
        let what = format!("{} unpacks its data only as a whole", layout.compression.0);
        return Err(io::Error::other(what));
    }
    let bands = layout.bands_read().count() as u64;
    let all = layout.chunks_of_band().saturating_mul(bands).max(1);
    let min = all.min(2 * u64::from(layout.chunks_across()) * bands);
    let file = Unpacked::new(layout.chunk_size(), min..=all, disk)?;
    layout.unpacked = Some(Arc::new(file));
    Ok(())
}

/// Checks the first row of an image with one strip or tile that is decompressed to disk.
pub(super) fn check_first(layout: &Layout) -> Result<(), RasterError> {
    let all = Part::whole(layout.columns, layout.rows);
    if layout.unpacked.is_some() && layout.chunks_of_band() == 1 {
        for chunk in layout.chunks_in(&all) {
            Rows::of(layout, &chunk)?.next()?;
        }
    }
    Ok(())
}

/// Calls a function with each row of a strip or tile.
pub(super) fn each_row(
    layout: &Layout,
    chunk: &Chunk,
    take: &mut RowSink<'_>,
) -> Result<(), RasterError> {
    let mut rows = Rows::of(layout, chunk)?;
    (0..chunk.covers.rows).try_for_each(|_| take(rows.next()?))
}

/// The rows of a strip or tile.
pub(super) struct Rows<'f> {
    layout: &'f Layout,
    chunk: Chunk,
    unpacked: Box<dyn Read + 'f>,
    /// Number of rows read so far.
    count: u32,
    row: Vec<u8>,
}

impl<'f> Rows<'f> {
    /// Opens a strip or tile without decompressing anything. The layout must be one that [suits].
    pub(super) fn of(layout: &'f Layout, chunk: &Chunk) -> Result<Self, RasterError> {
        let image = layout.directory.ifd();
        let source = layout.directory.file().source();
        let is_reversed = image.fill_order() == 2;
        let stored = StoredBytes::new(source, chunk.place, chunk.bytes, is_reversed);
        let unpacked = codec::unpacked(image.compression(), stored);
        Ok(Self {
            layout,
            chunk: *chunk,
            unpacked: unpacked.map_err(|error| cannot(layout, chunk, 0, &error))?,
            count: 0,
            row: vec![0; layout.row_bytes() as usize],
        })
    }

    /// Reads the next row, with its numbers in this machine's byte order.
    pub(super) fn next(&mut self) -> Result<&[u8], RasterError> {
        let layout = self.layout;
        let read = self.unpacked.read_exact(&mut self.row);
        read.map_err(|error| cannot(layout, &self.chunk, self.count, &error))?;
        self.count += 1;
        // The order of bits is the same in every file.
        if layout.stored.1 >= 8 {
            let order = layout.directory.file().byte_order();
            let predictor = layout.directory.ifd().predictor();
            let (bits, bands) = (layout.stored.1, layout.bands_together());
            fix_endianness_and_predict(&mut self.row, bits, bands, order, predictor)
                .map_err(fault)?;
        }
        Ok(&self.row)
    }
}

fn cannot(layout: &Layout, chunk: &Chunk, row: u32, error: &std::io::Error) -> RasterError {
    let why = match error.kind() {
        ErrorKind::UnexpectedEof => "it ends too early".into(),
        _ => error.to_string(),
    };
    RasterError::Damaged(format!(
        "TIFF: the {} data at byte {} cannot be unpacked from row {} on: {why}",
        layout.compression.0,
        chunk.place,
        chunk.covers.row + row
    ))
}

/// Returns true if a whole band is best read by rows: its strips are large.
pub(super) fn suits_whole_band(layout: &Layout, part: &Part) -> bool {
    let is_whole = *part == Part::whole(layout.columns, layout.rows);
    is_whole && layout.has_strips() && layout.chunk_size() > MAX_DECODED && suits(layout)
}

/// Reads a whole band, the first being 0, of a layout that [suits](suits_whole), without a second
/// copy of the samples.
pub(super) fn read_whole(layout: &Layout, band: usize) -> Result<Samples, RasterError> {
    let all = Part::whole(layout.columns, layout.rows);
    let stored = layout.sample();
    let stride = layout.texel_bytes() as usize;
    let first = layout.bytes_before(band);
    let count = u64::from(layout.columns) * u64::from(layout.rows);
    let mut samples = stored.reserve(count)?;
    for chunk in layout.chunks_of(band, &all) {
        let covers = chunk.covers;
        if chunk.bytes == 0 {
            let more = covers.columns as usize * covers.rows as usize;
            with_samples!(&mut samples, values => {
                values.resize(values.len() + more, SampleValue::nearest(0.0));
            });
            continue;
        }
        let mut rows = Rows::of(layout, &chunk)?;
        for _ in 0..covers.rows {
            stored.append(&mut samples, &rows.next()?[first..], stride, ENDIAN);
        }
    }
    match samples.len() as u64 == count {
        true => Ok(samples),
        false => Err(RasterError::damaged("TIFF: its index has too few strips")),
    }
}
