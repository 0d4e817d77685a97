//! The masks of an image, which mark its no-data.

use std::sync::Arc;

use tiff_reader::TiffFile;

use super::band::Band;
use super::images::{self, Directory};
use super::index::Chunk;
use super::layout::{Layout, MAX_DECODED};
use super::uncompressed;
use super::unpack::{self, Rows};
use crate::RasterError;
use crate::blocks::{MAX_BLOCK_BYTES, Part};
use crate::disk_cache::DiskCache;

/// A mask. 0 is no-data.
pub(super) struct Mask {
    directory: Directory,
    /// Its layout, if it is usual for masks.
    layout: Option<Layout>,
}

impl Mask {
    /// Returns the masks of an image or overview, in its file and in one beside it.
    pub(super) fn all(image: &Directory, beside: Option<&Arc<TiffFile>>) -> Vec<Self> {
        let masks = images::masks(image, beside).into_iter();
        let masks = masks.map(|directory| Self {
            layout: Layout::of_mask(&directory).ok(),
            directory,
        });
        masks.collect()
    }

    /// Returns the number of samples of a strip or tile.
    fn chunk_samples(&self) -> u64 {
        let mask = self.directory.ifd();
        let columns = mask.tile_width().unwrap_or(mask.width());
        let strip = mask.rows_per_strip().min(mask.height());
        let rows = mask.tile_height().unwrap_or(strip);
        u64::from(columns) * u64::from(rows)
    }

    /// Prepares reading the mask in parts. It may be decompressed to `disk`.
    ///
    /// # Errors
    /// The reason why that is impossible.
    pub(super) fn prepare_blocks(&mut self, disk: Result<&DiskCache, &str>) -> Result<(), String> {
        let samples = self.chunk_samples();
        let is_large = samples > MAX_DECODED;
        let unpacked = match (&mut self.layout, disk) {
            (Some(layout), _) if layout.is_plain => return Ok(()),
            (Some(layout), Ok(disk)) if is_large => {
                unpack::into_file(layout, disk).map_err(|error| error.to_string())
            }
            (_, Err(why)) => Err(why.to_owned()),
            _ => Err("its samples are packed in an unusual way".into()),
        };
        match unpacked {
            // Small enough to be decoded with each block.
            Err(_) if samples <= MAX_BLOCK_BYTES => Ok(()),
            unpacked => unpacked,
        }
    }

    /// Returns the max disk space for its decompressed chunks, bytes.
    pub(super) fn unpacked_bytes(&self) -> u64 {
        let unpacked = self.layout.as_ref().and_then(|mask| mask.unpacked.as_ref());
        unpacked.map_or(0, |unpacked| unpacked.max_bytes())
    }

    /// Calls `set` with the index, in the part, of each no-data sample.
    pub(super) fn missing(
        &self,
        part: &Part,
        mut set: impl FnMut(usize),
    ) -> Result<(), RasterError> {
        match &self.layout {
            Some(mask) if mask.is_read_by_rows() => by_rows(mask, part, set),
            Some(mask) if unpack::suits_whole_band(mask, part) => whole(mask, part, set),
            _ => {
                let band = Band::new(&self.directory, 0);
                let has_data = band.read(part, |value: u8| value != 0)?;
                let missing = has_data.iter().enumerate().filter(|(_, has)| !**has);
                missing.for_each(|(index, _)| set(index));
                Ok(())
            }
        }
    }
}

fn by_rows(mask: &Layout, part: &Part, mut set: impl FnMut(usize)) -> Result<(), RasterError> {
    let mut found = 0;
    for row in part.row..part.row + part.rows {
        let row = Part {
            row,
            rows: 1,
            ..*part
        };
        for chunk in mask.chunks_in(&row) {
            found += u64::from(chunk.covers.within(&row).columns);
            for range in uncompressed::rows(mask, &chunk, &row) {
                let bytes = uncompressed::bytes(mask, &chunk, range)?;
                row_missing(mask, &chunk, &row, part, &bytes, &mut set);
            }
        }
    }
    check_all_found(found, part)
}

/// Reads a whole mask, strip by strip.
fn whole(mask: &Layout, part: &Part, mut set: impl FnMut(usize)) -> Result<(), RasterError> {
    let mut found = 0;
    for chunk in mask.chunks_in(part) {
        let covers = chunk.covers;
        found += u64::from(covers.columns) * u64::from(covers.rows);
        let zeros = vec![0; mask.row_bytes() as usize];
        let mut rows = match chunk.bytes {
            0 => None,
            _ => Some(Rows::of(mask, &chunk)?),
        };
        for row in covers.row..covers.row + covers.rows {
            let row = Part {
                row,
                rows: 1,
                ..*part
            };
            let bytes = match &mut rows {
                Some(rows) => rows.next()?,
                None => &zeros,
            };
            row_missing(mask, &chunk, &row, part, bytes, &mut set);
        }
    }
    check_all_found(found, part)
}

fn check_all_found(found: u64, part: &Part) -> Result<(), RasterError> {
    match found == u64::from(part.columns) * u64::from(part.rows) {
        true => Ok(()),
        false => Err(RasterError::damaged(
            "TIFF: its mask's index has too few strips or tiles",
        )),
    }
}

/// Visits the no-data samples of a row of a part, by the bytes of its strip or tile.
fn row_missing(
    mask: &Layout,
    chunk: &Chunk,
    row: &Part,
    part: &Part,
    bytes: &[u8],
    set: &mut impl FnMut(usize),
) {
    let bits = usize::from(mask.stored.1);
    let inside = chunk.covers.within(row);
    // The first byte may contain samples to the west.
    let skipped = (inside.column - chunk.covers.column) as usize * bits % 8;
    let to = (row.row - part.row) as usize * part.columns as usize;
    let to = to + (inside.column - part.column) as usize;
    for index in 0..inside.columns as usize {
        let at = skipped + index * bits;
        let value = (bytes[at / 8] << (at % 8)) >> (8 - bits);
        if value == 0 {
            set(to + index);
        }
    }
}

#[cfg(test)]
#[path = "masks_tests.rs"]
mod tests;
