//! Large strips and tiles that are packed: their rows come one after the other, in the memory of
//! a row and of what the compression looks back to.
//!
//! The decoder unpacks a strip or tile as a whole and then copies it, and some writers put all of
//! an image into one.

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

/// Byte order of unpacked rows: this machine's.
pub(super) const ENDIAN: Endian = match cfg!(target_endian = "big") {
    true => Endian::Big,
    false => Endian::Little,
};

/// Returns true if the strips or tiles of a layout can be unpacked row by row. A row is held in memory.
pub(super) fn suits(layout: &Layout) -> bool {
    codec::is_known(layout.directory.ifd().compression())
        && (1..=MAX_BLOCK_BYTES).contains(&layout.row_bytes())
}

/// Has strips or tiles unpacked into a file on disk when they are touched. Two strips, or rows of
/// tiles, are kept whatever their size, and as many of the alpha band where that lies apart: a row of
/// blocks may lie in two, and none is unpacked again for each of its blocks. More of them are kept
/// within the bound of the cache.
///
/// # Errors
/// The reason for which that is impossible.
pub(super) fn into_file(layout: &mut Layout, disk: &DiskCache) -> io::Result<()> {
    if !suits(layout) {
        let what = format!("what {} has packed comes as a whole", layout.compression.0);
        return Err(io::Error::other(what));
    }
    let bands = layout.bands_read().count() as u64;
    let all = layout.chunks_of_band().saturating_mul(bands).max(1);
    let least = all.min(2 * u64::from(layout.chunks_across()) * bands);
    let file = Unpacked::new(layout.chunk_size(), least..=all, disk)?;
    layout.unpacked = Some(Arc::new(file));
    Ok(())
}

/// Checks that of an image in one strip or tile, which is unpacked on disk, the first row is there.
pub(super) fn check_first(layout: &Layout) -> Result<(), RasterError> {
    let all = Part::whole(layout.columns, layout.rows);
    if layout.unpacked.is_some() && layout.chunks_of_band() == 1 {
        for chunk in layout.chunks_in(&all) {
            Rows::of(layout, &chunk)?.next()?;
        }
    }
    Ok(())
}

/// Hands over the rows of a strip or tile.
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
    /// Those that have arrived.
    count: u32,
    row: Vec<u8>,
}

impl<'f> Rows<'f> {
    /// Nothing is unpacked yet. The layout [suits].
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

    /// The bytes of the next row, its numbers in this machine's byte order.
    pub(super) fn next(&mut self) -> Result<&[u8], RasterError> {
        let layout = self.layout;
        let read = self.unpacked.read_exact(&mut self.row);
        read.map_err(|error| cannot(layout, &self.chunk, self.count, &error))?;
        self.count += 1;
        // Bits are in the same order in every file.
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

/// Returns true if all of a band is best read so: its strips are large.
pub(super) fn suits_whole(layout: &Layout, part: &Part) -> bool {
    let is_whole = *part == Part::whole(layout.columns, layout.rows);
    is_whole && layout.has_strips() && layout.chunk_size() > MAX_DECODED && suits(layout)
}

/// Reads all of a band, the first being 0, of a layout that [suits](suits_whole): the samples are
/// held once.
pub(super) fn read_whole(layout: &Layout, band: usize) -> Result<Samples, RasterError> {
    let all = Part::whole(layout.columns, layout.rows);
    let stored = layout.sample();
    let apart = layout.texel_bytes() as usize;
    let first = layout.bytes_before(band);
    let count = u64::from(layout.columns) * u64::from(layout.rows);
    let mut samples = stored.room(count)?;
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
            stored.append(&mut samples, &rows.next()?[first..], apart, ENDIAN);
        }
    }
    match samples.len() as u64 == count {
        true => Ok(samples),
        false => Err(RasterError::damaged("TIFF: its index has too few strips")),
    }
}
