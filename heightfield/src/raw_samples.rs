//! Uncompressed samples at offsets that follow from column and row: raw files, `.hgt`, `.npy`, and
//! files with a header beside them.
//!
//! A small file is read at once. A large one is read in blocks on access; coarse levels have every
//! 2ᵏ-th sample.

use std::hash::Hasher;

use twox_hash::XxHash64;

use super::blocks::{Block, BlockImage, BlockReader, Part, SurveyParts};
use super::input::FileBytes;
use super::read::StoredType;
use super::samples::{Endian, SampleType, Samples, with_samples};
use super::storage::Storage;
use super::{OpenOptions, RasterError, subsampled};
use crate::disk_cache::FileStamp;

/// Side of a block, samples.
const BLOCK: u32 = 256;
/// Side of a block of coarse images, whose samples lie far apart.
const COARSE_BLOCK: u32 = 32;
/// Columns and rows of a block of a remote file: few long rows, because adjacent bytes arrive in
/// one response.
const WIDE_BLOCK: [u32; 2] = [32_768, 2];
/// Samples farther apart than this, bytes, are read one by one.
const MAX_STRIDE: u64 = 4096;
/// Max bytes of one read, if rows are contiguous.
const READ_BYTES: u64 = 1 << 20;
/// Max bytes of samples at a URL that are fetched at once.
const FEW_BYTES: u64 = 1 << 20;
/// Parts per direction that are read at opening, if a file is not read whole.
const PARTS_PER_AXIS: u32 = 6;

/// Offsets of samples in a file, bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct RawSamples {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) stored: StoredType,
    pub(super) endian: Endian,
    /// Offset of the first sample.
    pub(super) first: u64,
    /// Step from a sample to the one below it.
    pub(super) row: u64,
    /// Step from a sample to the next in its row.
    pub(super) sample: u64,
}

impl RawSamples {
    /// Returns the layout of contiguous rows.
    pub(super) fn packed(
        (columns, rows): (u32, u32),
        stored: StoredType,
        endian: Endian,
        first: u64,
    ) -> Self {
        Self {
            columns,
            rows,
            stored,
            endian,
            first,
            row: u64::from(columns).saturating_mul(stored.bytes()),
            sample: stored.bytes(),
        }
    }

    /// Returns the same bytes with rows and columns exchanged.
    pub(super) const fn turned(self) -> Self {
        Self {
            columns: self.rows,
            rows: self.columns,
            row: self.sample,
            sample: self.row,
            ..self
        }
    }

    /// Returns the samples, checked to be inside the file: in memory, or for a large file, in
    /// blocks.
    ///
    /// # Errors
    /// A file that cannot be read; more samples than fit in memory.
    pub(super) fn storage(
        self,
        input: &FileBytes,
        options: &OpenOptions,
    ) -> Result<Storage, RasterError> {
        let count = u64::from(self.columns) * u64::from(self.rows);
        let bytes = count.saturating_mul(self.stored.bytes());
        let max = match input.remote() {
            Some(_) => options.max_in_memory_bytes.min(FEW_BYTES),
            None => options.max_in_memory_bytes,
        };
        if bytes > max
            && let Some(own) = input.try_clone()?
        {
            return Ok(PlainBlocks::new(self, own).into());
        }
        if input.is_outline() {
            return Ok(self.stored.reserve(0)?.into());
        }
        let all = Part::whole(self.columns, self.rows);
        Ok(self.read(input, &all, Subsampling::ALL)?.into())
    }

    /// Reads a part of the image with the samples of `subsampling`.
    fn read(
        &self,
        input: &FileBytes,
        part: &Part,
        subsampling: Subsampling,
    ) -> Result<Samples, RasterError> {
        if self.sample > self.row {
            let part = turned(part);
            let samples = self.turned().read(input, &part, subsampling.turned())?;
            return Ok(transposed(&samples, part.rows, part.columns));
        }
        let mut samples = self
            .stored
            .reserve(u64::from(part.columns) * u64::from(part.rows))?;
        let stride = self.sample * u64::from(subsampling.every);
        let along = (u64::from(part.columns) - 1) * stride + self.stored.bytes();
        let is_packed = subsampling.every == 1 && along == self.row;
        let rows_at_once = match is_packed {
            true => (READ_BYTES / along).clamp(1, part.rows.into()) as u32,
            false => 1,
        };
        for row in (0..part.rows).step_by(rows_at_once as usize) {
            let rows = rows_at_once.min(part.rows - row);
            let at = self.place(part.column, part.row + row, subsampling);
            if stride > MAX_STRIDE {
                for column in 0..part.columns {
                    let at = at + u64::from(column) * stride;
                    let bytes = input.read_at(at, self.stored.bytes())?;
                    self.append(&mut samples, &bytes, stride);
                }
            } else {
                let bytes = input.read_at(at, (u64::from(rows) - 1) * self.row + along)?;
                self.append(&mut samples, &bytes, stride);
            }
        }
        Ok(samples)
    }

    fn append(&self, samples: &mut Samples, bytes: &[u8], stride: u64) {
        self.stored
            .append(samples, bytes, stride as usize, self.endian);
    }

    fn place(&self, column: u32, row: u32, subsampling: Subsampling) -> u64 {
        let [column, row] =
            [(column, subsampling.first[0]), (row, subsampling.first[1])].map(|(index, first)| {
                u64::from(index) * u64::from(subsampling.every) + u64::from(first)
            });
        self.first + row * self.row + column * self.sample
    }

    /// Returns the byte ranges of a part, in reading order.
    fn ranges(&self, part: &Part, subsampling: Subsampling) -> Vec<std::ops::Range<u64>> {
        if self.sample > self.row {
            return self.turned().ranges(&turned(part), subsampling.turned());
        }
        let is_sparse = self.sample * u64::from(subsampling.every) > MAX_STRIDE;
        let along = if is_sparse { part.columns } else { 1 };
        let to = part.columns / along;
        let size = self.stored.bytes();
        let rows = part.row..part.row + part.rows;
        let each = rows.flat_map(|row| (0..along).map(move |column| (part.column + column, row)));
        let range = |(column, row)| {
            let last = self.place(column + to - 1, row, subsampling);
            self.place(column, row, subsampling)..last + size
        };
        each.map(range).collect()
    }
}

/// The samples of an image: every `every`-th, from a first column and row.
#[derive(Clone, Copy, Debug)]
struct Subsampling {
    every: u32,
    first: [u32; 2],
}

impl Subsampling {
    /// All samples.
    const ALL: Self = Self {
        every: 1,
        first: [0; 2],
    };

    const fn turned(self) -> Self {
        let [column, row] = self.first;
        Self {
            first: [row, column],
            ..self
        }
    }
}

/// Returns the same part with rows and columns exchanged.
pub(super) const fn turned(part: &Part) -> Part {
    Part {
        column: part.row,
        row: part.column,
        columns: part.rows,
        rows: part.columns,
    }
}

/// Transposes samples from `columns` × `rows`.
pub(super) fn transposed(samples: &Samples, columns: u32, rows: u32) -> Samples {
    fn in_rows<T: Copy>(values: &[T], columns: usize, rows: usize) -> Vec<T> {
        let row = |row: usize| (0..columns).map(move |column| column * rows + row);
        let places = (0..rows).flat_map(row);
        places.map(|index| values[index]).collect()
    }
    let (columns, rows) = (columns as usize, rows as usize);
    with_samples!(samples, values => in_rows(values, columns, rows).into())
}

/// Plain samples that stay in their file.
pub(super) struct PlainBlocks {
    plain: RawSamples,
    input: FileBytes,
    /// The file's state when it was opened.
    stamp: Option<FileStamp>,
    is_remote: bool,
    images: Vec<BlockImage>,
}

impl PlainBlocks {
    /// Returns blocks of samples that are all inside the file.
    pub(super) fn new(plain: RawSamples, input: FileBytes) -> Self {
        let is_remote = input.remote().is_some();
        let block = |k: u32| match (k, is_remote) {
            (0, true) => WIDE_BLOCK,
            _ => [(BLOCK >> k).max(COARSE_BLOCK); 2],
        };
        Self {
            images: subsampled::images([plain.columns, plain.rows], block),
            plain,
            stamp: input.stamp(),
            input,
            is_remote,
        }
    }
}

impl PlainBlocks {
    fn subsampling(&self, image: usize) -> Subsampling {
        Subsampling {
            every: 1 << image,
            first: self.images[image].first,
        }
    }
}

impl BlockReader for PlainBlocks {
    fn format(&self) -> &'static str {
        "plain samples"
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.plain.stored.memory_type()
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        true
    }

    fn set_order(&mut self, south_up: bool, east_first: bool) {
        subsampled::set_order(&mut self.images, south_up, east_first);
    }

    fn prefetch(&self, image: usize, parts: &[Part]) {
        if let Some(remote) = self.input.remote() {
            let subsampling = self.subsampling(image);
            remote.prefetch(
                parts
                    .iter()
                    .flat_map(|part| self.plain.ranges(part, subsampling)),
            );
        }
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        self.prefetch(image, std::slice::from_ref(part));
        Ok(Block {
            samples: self
                .plain
                .read(&self.input, part, self.subsampling(image))?,
            no_data_mask: None,
            is_incomplete: false,
        })
    }

    fn index(&self) -> u64 {
        let plain = &self.plain;
        let mut hasher = XxHash64::with_seed(0);
        for number in [
            plain.columns.into(),
            plain.rows.into(),
            plain.stored.bytes(),
            plain.first,
            plain.row,
            plain.sample,
        ] {
            hasher.write_u64(number);
        }
        hasher.finish()
    }

    fn stamp(&self, _: usize, _: &Part) -> Option<String> {
        let stamp = self.stamp.as_ref()?;
        let is_same = self.input.stamp().as_ref() == Some(stamp);
        let stable = stamp.stable_text().filter(|_| is_same)?;
        Some(format!("{stable} {:?}", self.plain))
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        Some(subsampled::spread_parts(&self.images[0], PARTS_PER_AXIS))
    }

    fn max_memory_bytes(&self) -> usize {
        match self.is_remote {
            true => crate::remote::RemoteFile::max_memory_bytes(),
            false => 0,
        }
    }
}

#[cfg(test)]
#[path = "raw_samples_tests.rs"]
mod tests;
