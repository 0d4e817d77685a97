//! One file of many: its samples on the terrain's grid.

use std::path::PathBuf;

use super::super::beside;
use super::super::blocks::Part;
use super::super::decoded::Decoded;
use super::super::samples::{SampleValue, with_samples};
use super::super::storage::Storage;
use crate::disk_cache::FileStamp;
use crate::remote::{is_url, outage};
use crate::{RasterError, ReadStatus, Wait};

/// A file and its part of the terrain.
#[derive(Clone, Debug)]
pub(super) struct Source {
    /// The file.
    pub(super) path: PathBuf,
    /// Its size when it was indexed, bytes.
    pub(super) bytes: u64,
    /// Its samples in the terrain: columns from the west, rows from the **south**.
    pub(super) covers: Part,
    /// True if its columns begin in the east, and if its rows begin in the north.
    pub(super) turned: [bool; 2],
}

impl Source {
    /// Returns the present stamps of the file and of those beside it; `None` for a URL, or if it is
    /// missing.
    pub(super) fn stamps(&self) -> Option<Vec<FileStamp>> {
        if self.path.to_str().is_some_and(is_url) {
            return None;
        }
        let files = beside::files_read_with(&self.path);
        files.iter().map(|file| FileStamp::at(file)).collect()
    }

    /// Converts a column and row of the terrain to the file's own order.
    pub(super) fn place(&self, [column, row]: [u32; 2]) -> [u32; 2] {
        let covers = &self.covers;
        let along = |index: u32, count: u32, is_turned: bool| match is_turned {
            true => count - 1 - index,
            false => index,
        };
        [
            along(column - covers.column, covers.columns, self.turned[0]),
            along(row - covers.row, covers.rows, self.turned[1]),
        ]
    }

    /// Returns the overlap of the file with `part`, in samples of every 2ᵏ-th of the terrain.
    pub(super) fn overlap(&self, k: u32, part: &Part) -> Option<Part> {
        let cut = |first: u32, count: u32, from: u32, max: u32| {
            let at = |full: u64| u32::try_from(full.div_ceil(1 << k)).unwrap_or(u32::MAX);
            let begin = at(first.into()).max(from);
            let end = at(u64::from(first) + u64::from(count)).min(from.saturating_add(max));
            (begin < end).then(|| (begin, end - begin))
        };
        let covers = &self.covers;
        let (column, columns) = cut(covers.column, covers.columns, part.column, part.columns)?;
        let (row, rows) = cut(covers.row, covers.rows, part.row, part.rows)?;
        Some(Part {
            column,
            row,
            columns,
            rows,
        })
    }
}

/// An open file.
pub(super) struct OpenFile {
    decoded: Decoded,
    /// [`Source::stamps`] before it was opened.
    stamps: Option<Vec<FileStamp>>,
}

impl OpenFile {
    pub(super) const fn new(decoded: Decoded, stamps: Option<Vec<FileStamp>>) -> Self {
        Self { decoded, stamps }
    }

    /// Returns [`Source::stamps`] from before it was opened.
    pub(super) fn stamps(&self) -> Option<&Vec<FileStamp>> {
        self.stamps.as_ref()
    }

    /// Returns its memory, bytes, and the number of its unreadable blocks.
    pub(super) fn cache_use(&self) -> (usize, u32) {
        match &self.decoded.storage {
            Storage::Memory { samples, mask } => {
                let mask = mask.as_ref().map_or(0, |mask| mask.len() / 8);
                (samples.bytes() + mask, 0)
            }
            Storage::Blocks(blocks) => blocks.cache_use(),
        }
    }

    /// Returns the height at a position of the file for a level; `None` for no-data.
    ///
    /// # Errors
    /// The reason why it is unknown.
    pub(super) fn height(
        &self,
        level: u8,
        [column, row]: [u32; 2],
    ) -> Result<Option<f64>, RasterError> {
        let (stored, status) = self.stored(level, column, row);
        match (&self.decoded.storage, status) {
            (Storage::Blocks(blocks), ReadStatus::Pending) => Err(blocks
                .take_outage()
                .unwrap_or_else(|| RasterError::Remote(outage()))),
            _ => {
                let height = self.decoded.height_in_file(stored);
                Ok(Some(height).filter(|height| !height.is_nan()))
            }
        }
    }

    fn stored(&self, level: u8, column: u32, row: u32) -> (Option<f64>, ReadStatus) {
        match &self.decoded.storage {
            Storage::Memory { samples, mask } => {
                let index = row as usize * self.decoded.columns as usize + column as usize;
                let is_no_data = mask.as_ref().is_some_and(|mask| mask.contains(index));
                let value = with_samples!(samples, values => {
                    values.get(index).map(|value| value.widen())
                });
                (value.filter(|_| !is_no_data), ReadStatus::Complete)
            }
            Storage::Blocks(blocks) => match blocks.overview_of(level) {
                0 => match blocks.stored(0, column, row, Wait::UntilRead) {
                    Ok(stored) => (stored, ReadStatus::Complete),
                    Err(_) => (None, ReadStatus::Pending),
                },
                image => {
                    let place = [f64::from(column), f64::from(row)];
                    let known_height = |stored: Option<f64>| {
                        let is_no_data = |value: &f64| self.decoded.no_data == Some(*value);
                        stored
                            .filter(|value| !is_no_data(value))
                            .unwrap_or(f64::NAN)
                    };
                    let (value, status) = blocks.between(image, place, |at| {
                        blocks.height(image, at, Wait::UntilRead, known_height)
                    });
                    (Some(value).filter(|value| !value.is_nan()), status)
                }
            },
        }
    }
}
