//! A band of an image, decoded by `tiff-reader`.

use tiff_reader::{Ifd, TiffFile, TiffSample};

use super::decoder_error::fault;
use super::images::Directory;
use crate::RasterError;
use crate::blocks::Part;

/// A band of an image.
pub(super) struct Band<'f> {
    file: &'f TiffFile,
    image: &'f Ifd,
    band: usize,
}

impl<'f> Band<'f> {
    /// Returns a band of an image, the first being 0.
    pub(super) fn new(directory: &'f Directory, band: usize) -> Self {
        Self {
            file: directory.file(),
            image: directory.ifd(),
            band,
        }
    }

    /// Reads the samples of a part, each converted. Only one row of chunks is in memory besides the
    /// result.
    pub(super) fn read<T: TiffSample, U>(
        &self,
        part: &Part,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<U>, RasterError> {
        let height = self
            .image
            .tile_height()
            .unwrap_or(self.image.rows_per_strip());
        let [column, row, columns, rows] =
            [part.column, part.row, part.columns, part.rows].map(|count| count as usize);
        let samples = columns * rows;
        let mut values = Vec::new();
        values.try_reserve_exact(samples).map_err(|_| {
            RasterError::AbsurdSize(format!("{samples} samples do not fit into memory"))
        })?;
        let rows_at_once = height.clamp(1, part.rows.max(1)) as usize;
        for first in (row..row + rows).step_by(rows_at_once) {
            let count = rows_at_once.min(row + rows - first);
            let window = self
                .file
                .read_band_window_from_ifd::<T>(
                    self.image, self.band, first, column, count, columns,
                )
                .map_err(fault)?;
            let (window, _) = window.into_raw_vec_and_offset();
            values.extend(window.into_iter().map(&convert));
        }
        Ok(values)
    }
}
