//! One file of many: which samples of the terrain it has, and how they follow from its own.

use std::path::PathBuf;

use super::super::beside;
use super::super::blocks::Part;
use super::super::decoded::Decoded;
use super::super::samples::{SampleType, with_samples};
use super::super::storage::Storage;
use crate::disk_cache::FileStamp;
use crate::remote::is_url;

/// A file and its part of the terrain.
#[derive(Clone, Debug)]
pub(super) struct Source {
    /// The file.
    pub(super) path: PathBuf,
    /// Its bytes when it was indexed.
    pub(super) bytes: u64,
    /// The band that holds the heights, the first being 1; `None` for what the user says.
    pub(super) band: Option<u32>,
    /// The samples of the terrain that it has: columns from the west, rows from the
    /// **south**.
    pub(super) covers: Part,
    /// Columns and rows of the file, in its own order, for those of the terrain.
    pub(super) axes: [Axis; 2],
    /// Columns and rows that the file had when it was indexed, where it was looked into.
    pub(super) size: Option<(u32, u32)>,
    /// What its samples are in the terrain.
    pub(super) values: Values,
}

/// From a column or row of the terrain to one of a file: the number below
/// `start + (index + ½) · step`, the file's sample in whose cell the middle of the
/// terrain's cell is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// At the outer edge of the terrain's first sample.
    pub(super) start: f64,
    /// From sample to sample of the terrain; negative where the file counts the other way.
    pub(super) step: f64,
}

impl Axis {
    /// The file's column or row; `None` where the file has none.
    pub(super) fn of(&self, index: u32, count: u32) -> Option<u32> {
        // Where edges of cells fall on each other, as GDAL.
        const ROUNDING: f64 = 1e-10;
        let at = (self.start + (f64::from(index) + 0.5) * self.step + ROUNDING).floor();
        let last = f64::from(count) - 1.0;
        // A cell that reaches into the file in part has the file's outermost sample.
        let reach = 1.0_f64.max(self.step.abs().ceil());
        (-reach..=last + reach)
            .contains(&at)
            .then(|| at.clamp(0.0, last) as u32)
    }
}

/// What the samples of a file are in the terrain.
#[derive(Clone, Copy, Debug)]
pub(super) enum Values {
    /// Heights, by the file's own scale; holes let through what lies below.
    Heights,
    /// Stored samples, as a VRT takes them.
    Stored {
        /// The value that lets through what lies below, as the VRT writes it.
        no_data: Option<f64>,
        /// Whether other holes cover what lies below.
        covers: bool,
        /// Value = stored × scale + offset.
        scale: f64,
        /// See `scale`.
        offset: f64,
        /// The type of the VRT's samples.
        sample: SampleType,
    },
}

impl Source {
    /// The present state of the file and of those beside it; none where it is at a URL, or
    /// gone.
    pub(super) fn stamps(&self) -> Option<Vec<FileStamp>> {
        if self.path.to_str().is_some_and(is_url) {
            return None;
        }
        let files = beside::files_read_with(&self.path);
        files.iter().map(|file| FileStamp::at(file)).collect()
    }

    /// The part of `part` of the samples with every 2ᵏ-th of the terrain that the file has.
    pub(super) fn overlap(&self, k: u32, part: &Part) -> Option<Part> {
        let cut = |first: u32, count: u32, from: u32, most: u32| {
            let at = |full: u64| u32::try_from(full.div_ceil(1 << k)).unwrap_or(u32::MAX);
            let begin = at(first.into()).max(from);
            let end = at(u64::from(first) + u64::from(count)).min(from.saturating_add(most));
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

/// A file that was opened.
pub(super) struct Opened {
    decoded: Decoded,
    /// [`Source::stamps`] before it was opened.
    stamps: Option<Vec<FileStamp>>,
    values: Values,
    /// [`Values::Stored::no_data`] as the file's samples can hold it.
    no_data: Option<f64>,
}

impl Opened {
    pub(super) fn new(decoded: Decoded, values: Values, stamps: Option<Vec<FileStamp>>) -> Self {
        let asked = match values {
            Values::Heights => None,
            Values::Stored { no_data, .. } => no_data,
        };
        let none = decoded.storage.sample_type().none();
        Self {
            no_data: asked.and_then(|value| none.comparable_no_data(value)),
            values,
            decoded,
            stamps,
        }
    }

    /// Samples a row and rows, in the file's order.
    pub(super) const fn size(&self) -> [u32; 2] {
        [self.decoded.columns, self.decoded.rows]
    }

    /// [`Source::stamps`] before it was opened.
    pub(super) fn stamps(&self) -> Option<&Vec<FileStamp>> {
        self.stamps.as_ref()
    }

    /// Bytes that it takes in memory now, and blocks of it that could not be read.
    pub(super) fn share(&self) -> (usize, u32) {
        match &self.decoded.storage {
            Storage::Held { samples, mask } => {
                let mask = mask.as_ref().map_or(0, |mask| mask.len() / 8);
                (samples.bytes() + mask, 0)
            }
            Storage::Blocks(blocks) => blocks.share(),
        }
    }

    /// The terrain's value at a place of the file for a level of detail: NaN in a hole that
    /// covers what lies below, `None` in one that does not.
    pub(super) fn value(&self, level: u8, column: u32, row: u32) -> Option<f64> {
        let (stored, is_own) = self.stored(level, column, row);
        match self.values {
            Values::Heights => {
                Some(self.decoded.height_in_file(stored)).filter(|height| !height.is_nan())
            }
            Values::Stored {
                covers,
                scale,
                offset,
                sample,
                ..
            } => match stored.filter(|value| !value.is_nan()) {
                Some(value) if self.no_data == Some(value) => None,
                Some(value) if self.decoded.no_data != Some(value) => {
                    let value = value * scale + offset;
                    // Between samples of an overview nothing was stored.
                    Some(if is_own {
                        as_stored(value, sample)
                    } else {
                        value
                    })
                }
                _ => covers.then_some(f64::NAN),
            },
        }
    }

    /// A stored value, and whether it is a sample of the full image.
    fn stored(&self, level: u8, column: u32, row: u32) -> (Option<f64>, bool) {
        match &self.decoded.storage {
            Storage::Held { samples, mask } => {
                let index = row as usize * self.decoded.columns as usize + column as usize;
                let hole = mask.as_ref().is_some_and(|mask| mask.contains(index));
                let value = with_samples!(samples, values => {
                    values.get(index).map(|value| super::super::samples::SampleValue::widen(*value))
                });
                (value.filter(|_| !hole), true)
            }
            Storage::Blocks(blocks) => match blocks.overview_of(level) {
                0 => (blocks.stored(0, column, row), true),
                image => {
                    let place = [f64::from(column), f64::from(row)];
                    let hole = |value: &f64| {
                        self.no_data == Some(*value) || self.decoded.no_data == Some(*value)
                    };
                    let known = |stored: Option<f64>| {
                        stored.filter(|value| !hole(value)).unwrap_or(f64::NAN)
                    };
                    let value = blocks.between(image, place, known);
                    (Some(value).filter(|value| !value.is_nan()), false)
                }
            },
        }
    }
}

/// A value as a sample of a type holds it: whole numbers are rounded, and cut where they end.
fn as_stored(value: f64, sample: SampleType) -> f64 {
    let whole = |low: f64, high: f64| value.round().clamp(low, high);
    match sample {
        SampleType::U8 => whole(0.0, u8::MAX.into()),
        SampleType::I8 => whole(i8::MIN.into(), i8::MAX.into()),
        SampleType::U16 => whole(0.0, u16::MAX.into()),
        SampleType::I16 => whole(i16::MIN.into(), i16::MAX.into()),
        SampleType::U32 => whole(0.0, u32::MAX.into()),
        SampleType::I32 => whole(i32::MIN.into(), i32::MAX.into()),
        SampleType::F32 => f64::from(value as f32),
        SampleType::F64 => value,
    }
}
