//! The samples of a band, and which of the first band's are holes that no value marks:
//! left out of a sparse file, masked, transparent.

use half::f16;
use tiff_reader::{Ifd, TiffFile, TiffSample};

use super::fault::fault;
use super::images::{mask_of, of_same_size};
use super::layout::{Layout, SampleFormat};
use crate::raster::samples::{HoleMask, SampleValue, with_samples};
use crate::raster::{BadRaster, Samples};

/// Reads a band, the first being 0.
pub(super) fn read(
    file: &TiffFile,
    image: &Ifd,
    layout: &Layout,
    band: usize,
) -> Result<Samples, BadRaster> {
    use SampleFormat::{Float, Signed, Unsigned};
    let band = Band {
        band,
        ..Band::first(file, image, layout)
    };
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

/// A band of an image.
struct Band<'f> {
    file: &'f TiffFile,
    image: &'f Ifd,
    band: usize,
    /// Columns and rows.
    size: (usize, usize),
    /// Rows of a strip or tile.
    rows_at_once: usize,
}

impl<'f> Band<'f> {
    /// `layout` is that of the full image, which has the same size.
    fn first(file: &'f TiffFile, image: &'f Ifd, layout: &Layout) -> Self {
        let height = image.tile_height().unwrap_or(image.rows_per_strip());
        Self {
            file,
            image,
            band: 0,
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
                .read_band_window_from_ifd::<T>(self.image, self.band, first, 0, count, columns)
                .map_err(fault)?;
            let (window, _) = window.into_raw_vec_and_offset();
            values.extend(window.into_iter().map(&convert));
        }
        Ok(values)
    }
}

/// The samples in chunks that a sparse file leaves out, those that a mask in the file
/// or `beside` it calls no data, and those whose alpha is zero.
pub(super) fn holes(
    file: &TiffFile,
    image: &Ifd,
    layout: &Layout,
    beside: Option<&TiffFile>,
) -> Result<Option<HoleMask>, BadRaster> {
    let (columns, rows) = (layout.columns as usize, layout.rows as usize);
    let mut holes = None;
    let mut set = |index| {
        let holes = holes.get_or_insert_with(|| HoleMask::with_capacity(columns * rows));
        holes.insert(index);
    };
    let (width, height) = (layout.chunk.0 as usize, layout.chunk.1 as usize);
    let across = layout.chunks_across() as usize;
    let stored = layout.of_band().unwrap_or_default();
    for (chunk, _) in stored.iter().enumerate().filter(|(_, bytes)| **bytes == 0) {
        let (west, north) = (chunk % across * width, chunk / across * height);
        for row in north..(north + height).min(rows) {
            (west..(west + width).min(columns)).for_each(|column| set(row * columns + column));
        }
    }
    let inside = mask_of(file, image).map(|mask| (file, mask));
    let outside = beside.and_then(|beside| Some((beside, of_same_size(beside, image)?)));
    for (file, mask) in inside.into_iter().chain(outside) {
        let has_data = Band::first(file, mask, layout).read(|value: u8| value != 0)?;
        let missing = has_data.iter().enumerate().filter(|(_, has)| !**has);
        missing.for_each(|(index, _)| set(index));
    }
    if let Some(band) = layout.alpha {
        with_samples!(read(file, image, layout, band)?, alpha => {
            let clear = alpha.iter().enumerate().filter(|(_, alpha)| alpha.widen() == 0.0);
            clear.for_each(|(index, _)| set(index));
        });
    }
    Ok(holes)
}
