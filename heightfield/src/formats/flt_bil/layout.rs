//! Layout of samples in a file without a header of its own.

use crate::raw_samples::RawSamples;
use crate::read::StoredType;
use crate::{Endian, RasterError};

/// Interleaving of several bands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interleave {
    /// By row: a row of each band in turn.
    Line,
    /// By sample: a sample of each band in turn.
    Pixel,
    /// Whole bands, one after another.
    Sequential,
}

/// Layout of the samples; all lengths in bytes.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) bands: u32,
    pub(super) stored: StoredType,
    pub(super) endian: Endian,
    pub(super) interleave: Interleave,
    /// Bytes before the first sample.
    pub(super) skip: u64,
    /// Step between rows of all bands (of one band for `Sequential`); `None` if there is no
    /// padding.
    pub(super) row_bytes: Option<u64>,
    /// Step between bands within a row, for `Line`.
    pub(super) band_row_bytes: Option<u64>,
    /// Gap between bands, for `Sequential`.
    pub(super) band_gap: u64,
}

/// Positions of a band's samples, bytes.
struct Steps {
    first: u64,
    row: u64,
    sample: u64,
}

impl Layout {
    /// Checks that the file contains the samples that the header `header` states.
    pub(super) fn check(&self, band: u32, bytes: u64, header: &str) -> Result<(), RasterError> {
        if band > self.bands {
            let available = match self.bands {
                1 => "the file has one band".to_owned(),
                bands => format!("the file has bands 1 to {bands}"),
            };
            let requested = format!("band {band}");
            return Err(RasterError::NoSuchPart {
                requested,
                available,
            });
        }
        let (columns, rows) = (self.columns, self.rows);
        let end = self.end(band).ok_or_else(|| {
            RasterError::AbsurdSize(format!(
                "{header} beside it states {columns} × {rows} samples"
            ))
        })?;
        if end > bytes {
            return Err(RasterError::Truncated(format!(
                "{header} beside it states {columns} × {rows} samples of {} bytes, which end at \
                 byte {end}; the file has {bytes}",
                self.stored.bytes()
            )));
        }
        self.check_size(bytes, header)
    }

    /// Checks that no whole row follows the stated samples: it would mean another sample type or
    /// size.
    fn check_size(&self, bytes: u64, header: &str) -> Result<(), RasterError> {
        let (columns, rows, bands) = (self.columns, self.rows, self.bands);
        let row = u64::from(columns).saturating_mul(self.stored.bytes());
        let end = self.end(bands).unwrap_or(u64::MAX);
        // Padding of rows or bands also follows the last one.
        let padding = self.row_bytes.unwrap_or(0).saturating_add(self.band_gap);
        if bytes > end && bytes - end >= row.max(padding) {
            return Err(RasterError::damaged(format!(
                "{header} beside it states {columns} × {rows} samples of {} bytes in {bands} \
                 bands, which end at byte {end}; the file has {bytes}: correct the type or size \
                 in the header",
                self.stored.bytes()
            )));
        }
        Ok(())
    }

    /// Returns the end of a band's last sample; `None` on overflow.
    fn end(&self, band: u32) -> Option<u64> {
        let steps = self.steps(band)?;
        let last_row = u64::from(self.rows)
            .checked_sub(1)?
            .checked_mul(steps.row)?;
        let row = self.row_end(&steps)?;
        // Rows must not overlap: a small file could then state any number of them.
        if steps.row < row && self.rows > 1 {
            return None;
        }
        steps.first.checked_add(last_row)?.checked_add(row)
    }

    /// Returns the bytes from the first sample of a row to the end of its last.
    fn row_end(&self, steps: &Steps) -> Option<u64> {
        let last = u64::from(self.columns)
            .checked_sub(1)?
            .checked_mul(steps.sample)?;
        last.checked_add(self.stored.bytes())
    }

    fn steps(&self, band: u32) -> Option<Steps> {
        let (size, band) = (self.stored.bytes(), u64::from(band) - 1);
        let bands = u64::from(self.bands);
        let packed = u64::from(self.columns).checked_mul(size)?;
        let steps = match self.interleave {
            Interleave::Line => {
                let of_band = self.band_row_bytes.unwrap_or(packed);
                Steps {
                    first: of_band.checked_mul(band)?,
                    row: self.row_bytes.or(of_band.checked_mul(bands))?,
                    sample: size,
                }
            }
            Interleave::Pixel => Steps {
                first: size * band,
                row: self.row_bytes.or(packed.checked_mul(bands))?,
                sample: size.checked_mul(bands)?,
            },
            Interleave::Sequential => {
                let row = self.row_bytes.unwrap_or(packed);
                let of_band = row
                    .checked_mul(self.rows.into())?
                    .checked_add(self.band_gap)?;
                Steps {
                    first: of_band.checked_mul(band)?,
                    row,
                    sample: size,
                }
            }
        };
        Some(Steps {
            first: steps.first.checked_add(self.skip)?,
            ..steps
        })
    }

    /// Returns the positions of a band's samples; the size has been checked.
    pub(super) fn plain(&self, band: u32) -> Result<RawSamples, RasterError> {
        let uncounted = || RasterError::AbsurdSize("its header's sizes".into());
        let steps = self.steps(band).ok_or_else(uncounted)?;
        Ok(RawSamples {
            columns: self.columns,
            rows: self.rows,
            stored: self.stored,
            endian: self.endian,
            first: steps.first,
            row: steps.row,
            sample: steps.sample,
        })
    }
}
