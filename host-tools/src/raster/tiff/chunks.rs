//! Strips and tiles, put side by side.

use std::io::{Read, Seek};

use tiff::TiffError;
use tiff::decoder::{Decoder, DecodingResult};

use super::fault;
use super::field::Field;
use super::layout::Layout;
use crate::raster::samples::HoleMask;
use crate::raster::{Fault, Samples};

/// Reads the first band, and which samples a sparse file leaves out.
///
/// The samples are held once: a chunk is decoded, copied to its place and let
/// go, and a single strip that is the whole image is taken as it is.
pub(super) fn read<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    layout: &Layout,
) -> Result<(Samples, Option<HoleMask>), Fault> {
    let stored = layout.first_band().unwrap_or_default();
    let mut mask = None;
    let mut field = if stored.len() == 1 && layout.interleaved() == 1 {
        Field::from_whole(read_chunk(decoder, layout, 0)?)
    } else {
        Field::new(layout)?
    };
    // A field that is there already has no chunks to wait for.
    let waiting = if field.is_whole { &[] } else { stored };
    for (index, &bytes) in (0..).zip(waiting) {
        let place = Place::of(layout, index);
        if bytes == 0 {
            let mask = mask.get_or_insert_with(|| HoleMask::new(field.samples.len()));
            place.sample_indices().for_each(|sample| mask.set(sample));
        } else {
            let chunk = read_chunk(decoder, layout, index)?;
            field.take(&chunk, &place).ok_or_else(|| {
                Fault::damaged(format!("TIFF: {} has other samples", named(layout, index)))
            })?;
        }
    }
    if layout.white_is_zero {
        field.undo_inversion();
    }
    Ok((field.samples, mask))
}

fn read_chunk<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    layout: &Layout,
    index: u32,
) -> Result<DecodingResult, Fault> {
    decoder.read_chunk(index).map_err(|error| {
        let chunk = named(layout, index);
        match error {
            TiffError::IoError(error) => Fault::from_io(error, &chunk),
            error => match fault(error) {
                Fault::Damaged(what) => Fault::Damaged(format!("{what}, in {chunk}")),
                other => other,
            },
        }
    })
}

/// A chunk in words.
fn named(layout: &Layout, index: u32) -> String {
    let across = layout.chunks_across();
    if layout.tiled {
        let (column, row) = (index % across, index / across);
        format!("the tile at column {column}, row {row} of tiles")
    } else {
        let strips = layout.first_band().map_or(0, <[u64]>::len);
        format!("strip {} of {strips}", index + 1)
    }
}

/// Where a chunk's samples go: a rectangle of the field, the file's order.
pub(super) struct Place {
    pub(super) first_column: usize,
    pub(super) first_row: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) field_columns: usize,
    /// Samples stored together, of which the first is wanted.
    pub(super) interleaved: usize,
}

impl Place {
    fn of(layout: &Layout, index: u32) -> Self {
        let across = layout.chunks_across();
        let first_column = (index % across) * layout.chunk.0;
        let first_row = (index / across) * layout.chunk.1;
        Self {
            first_column: first_column as usize,
            first_row: first_row as usize,
            columns: layout.chunk.0.min(layout.columns - first_column) as usize,
            rows: layout.chunk.1.min(layout.rows - first_row) as usize,
            field_columns: layout.columns as usize,
            interleaved: usize::from(layout.interleaved()),
        }
    }

    /// Where in the field each of the chunk's rows goes.
    pub(super) fn rows_in_field(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        (self.first_row..self.first_row + self.rows).map(|row| {
            let start = row * self.field_columns + self.first_column;
            start..start + self.columns
        })
    }

    fn sample_indices(&self) -> impl Iterator<Item = usize> {
        self.rows_in_field().flatten()
    }
}
