//! The samples of a part of a band, and its no-data that no value marks: missing in a sparse file,
//! masked, transparent.

use half::f16;

use super::band::Band;
use super::layout::{Layout, SampleFormat};
use super::masks::Mask;
use super::{uncompressed, unpack};
use crate::blocks::Part;
use crate::encoding::codes;
use crate::samples::{NoDataMask, SampleValue, with_samples};
use crate::{RasterError, Samples};

/// Reads a part of the heights' band, or of encoded heights.
pub(super) fn heights(layout: &Layout, part: &Part) -> Result<Samples, RasterError> {
    if !layout.has_codes {
        return read(layout, layout.band, part);
    }
    let colour = |band| match read(layout, band, part)? {
        Samples::U8(values) => Ok(values),
        _ => Err(RasterError::damaged("TIFF: its bands are of several types")),
    };
    Ok(codes([colour(0)?, colour(1)?, colour(2)?]))
}

/// Reads a part of a band, the first being 0.
fn read(layout: &Layout, band: usize, part: &Part) -> Result<Samples, RasterError> {
    use SampleFormat::{Float, Signed, Unsigned};
    if layout.is_read_by_rows() {
        return uncompressed::read(layout, band, part);
    }
    if unpack::suits_whole_band(layout, part) {
        return unpack::read_whole(layout, band);
    }
    let band = Band::new(&layout.directory, band);
    Ok(match layout.stored {
        (Unsigned, 8) => band.read(part, |value: u8| value)?.into(),
        (Signed, 8) => band.read(part, |value: i8| value)?.into(),
        (Unsigned, 16) => band.read(part, |value: u16| value)?.into(),
        (Signed, 16) => band.read(part, |value: i16| value)?.into(),
        (Float, 16) => band.read(part, f16::to_f32)?.into(),
        (Unsigned, 32) => band.read(part, |value: u32| value)?.into(),
        (Signed, 32) => band.read(part, |value: i32| value)?.into(),
        (Float, 32) => band.read(part, |value: f32| value)?.into(),
        (Unsigned, _) => band.read(part, |value: u64| value as f64)?.into(),
        (Signed, _) => band.read(part, |value: i64| value as f64)?.into(),
        (Float, _) => band.read(part, |value: f64| value)?.into(),
    })
}

/// Returns the no-data of a part: chunks missing in a sparse file, masked samples, and samples with
/// zero alpha.
pub(super) fn no_data_mask(
    layout: &Layout,
    masks: &[Mask],
    part: &Part,
) -> Result<Option<NoDataMask>, RasterError> {
    let columns = part.columns as usize;
    let mut no_data_mask = None;
    let mut set = |index| {
        let size = columns * part.rows as usize;
        let no_data_mask = no_data_mask.get_or_insert_with(|| NoDataMask::with_capacity(size));
        no_data_mask.insert(index);
    };
    let (first, last) = (part.row, part.row + part.rows);
    for omitted in layout.chunks_in(part).filter(|chunk| chunk.bytes == 0) {
        let covers = omitted.covers;
        let rows = covers.row.max(first)..(covers.row + covers.rows).min(last);
        let west = covers.column.max(part.column) - part.column;
        let east = (covers.column + covers.columns).min(part.column + part.columns) - part.column;
        for row in rows {
            let start = (row - first) as usize * columns;
            (west..east).for_each(|column| set(start + column as usize));
        }
    }
    for mask in masks {
        mask.missing(part, &mut set)?;
    }
    if let Some(band) = layout.alpha {
        with_samples!(read(layout, band, part)?, alpha => {
            let clear = alpha.iter().enumerate().filter(|(_, alpha)| alpha.widen() == 0.0);
            clear.for_each(|(index, _)| set(index));
        });
    }
    Ok(no_data_mask)
}
