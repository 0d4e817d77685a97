//! The first band's samples, and which of them are holes that no value marks.

use half::f16;
use tiff_reader::{Ifd, TiffFile, TiffSample};

use super::fault::fault;
use super::images::mask_of;
use super::layout::{Layout, SampleFormat};
use crate::raster::samples::HoleMask;
use crate::raster::{BadRaster, Samples};

/// Reads the first band.
pub(super) fn read(file: &TiffFile, image: &Ifd, layout: &Layout) -> Result<Samples, BadRaster> {
    use SampleFormat::{Float, Signed, Unsigned};
    let band = Band::new(file, image, layout);
    Ok(match layout.stored {
        (Unsigned, 8) => band.read(|value: u8| value)?.into(),
        (Signed, 8) => band.read(|value: i8| value)?.into(),
        (Unsigned, 16) => band.read(|value: u16| value)?.into(),
        (Signed, 16) => band.read(|value: i16| value)?.into(),
        (Float, 16) => band.read(f16::to_f32)?.into(),
        (Unsigned, 32) => band.read(|value: u32| value)?.into(),
        (Signed, 32) => band.read(|value: i32| value)?.into(),
        (Float, 32) => band.read(|value: f32| value)?.into(),
        (Unsigned, _) => band.read(|value: u64| value as f64)?.into(),
        (Signed, _) => band.read(|value: i64| value as f64)?.into(),
        (Float, _) => band.read(|value: f64| value)?.into(),
    })
}

/// The first band of an image.
struct Band<'f> {
    file: &'f TiffFile,
    image: &'f Ifd,
    /// Columns and rows.
    size: (usize, usize),
    /// Rows of a strip or tile.
    rows_at_once: usize,
}

impl<'f> Band<'f> {
    /// `layout` is that of the full image, which has the same size.
    fn new(file: &'f TiffFile, image: &'f Ifd, layout: &Layout) -> Self {
        let height = image.tile_height().unwrap_or(image.rows_per_strip());
        Self {
            file,
            image,
            size: (layout.columns as usize, layout.rows as usize),
            rows_at_once: height.clamp(1, layout.rows) as usize,
        }
    }

    /// Reads all samples, each converted. They are held once: a row of chunks is
    /// decoded, copied to its place and let go.
    fn read<T: TiffSample, U>(&self, convert: impl Fn(T) -> U) -> Result<Vec<U>, BadRaster> {
        let (columns, rows) = self.size;
        let samples = columns * rows;
        let mut values = Vec::new();
        values.try_reserve_exact(samples).map_err(|_| {
            BadRaster::AbsurdSize(format!(
                "{samples} samples are more than this machine can hold"
            ))
        })?;
        for first in (0..rows).step_by(self.rows_at_once) {
            let count = self.rows_at_once.min(rows - first);
            let window = self
                .file
                .read_band_window_from_ifd::<T>(self.image, 0, first, 0, count, columns)
                .map_err(fault)?;
            let (window, _) = window.into_raw_vec_and_offset();
            values.extend(window.into_iter().map(&convert));
        }
        Ok(values)
    }
}

/// The samples in chunks that a sparse file leaves out, and those that the mask
/// beside the image calls no data.
pub(super) fn holes(
    file: &TiffFile,
    image: &Ifd,
    layout: &Layout,
) -> Result<Option<HoleMask>, BadRaster> {
    let (columns, rows) = (layout.columns as usize, layout.rows as usize);
    let mut holes = None;
    let mut set = |index| {
        let holes = holes.get_or_insert_with(|| HoleMask::with_capacity(columns * rows));
        holes.insert(index);
    };
    let (width, height) = (layout.chunk.0 as usize, layout.chunk.1 as usize);
    let across = layout.chunks_across() as usize;
    let stored = layout.first_band().unwrap_or_default();
    for (chunk, _) in stored.iter().enumerate().filter(|(_, bytes)| **bytes == 0) {
        let (west, north) = (chunk % across * width, chunk / across * height);
        for row in north..(north + height).min(rows) {
            (west..(west + width).min(columns)).for_each(|column| set(row * columns + column));
        }
    }
    if let Some(mask) = mask_of(file, image) {
        let has_data = Band::new(file, mask, layout).read(|value: u8| value != 0)?;
        let missing = has_data.iter().enumerate().filter(|(_, has)| !**has);
        missing.for_each(|(index, _)| set(index));
    }
    Ok(holes)
}
