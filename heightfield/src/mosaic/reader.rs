//! Reads samples of a terrain of many files, each from the files that have it.

use std::hash::Hasher;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use fixedbitset::FixedBitSet;
use twox_hash::XxHash64;

use super::super::blocks::{Block, BlockImage, BlockReader, Part, SurveyParts};
use super::super::{OpenOptions, RasterError, SampleType};
use super::pool::Pool;
use super::source::{OpenFile, Source};
use crate::remote::{RemoteFile, is_url};

/// Side of a block, samples; smaller in coarse images, where a block covers many files.
const BLOCK: u32 = 256;
const COARSE_BLOCK: u32 = 32;
/// Max samples and files of a terrain that is read whole at opening.
const FEW_SAMPLES: u64 = 1 << 20;
const FEW_FILES: usize = 64;
/// Otherwise parts spread over the terrain, their number at least (or one per file), and their side
/// in samples.
const MIN_SURVEY_PARTS: usize = 32;
const SURVEY_PART_SIDE: u32 = 64;

/// The files of a terrain; the last has priority.
pub(super) struct Mosaic {
    pub(super) sources: Vec<Source>,
    images: Vec<BlockImage>,
    sample: SampleType,
    pool: Mutex<Pool>,
    /// The user's options that affect the files' samples.
    options: String,
}

impl Mosaic {
    /// Returns a terrain of a size from files, without opening any. `sample` is [`SampleType::F32`]
    /// if it can store all their samples.
    pub(super) fn new(
        (columns, rows): (u32, u32),
        sources: Vec<Source>,
        sample: SampleType,
        options: &OpenOptions,
    ) -> Self {
        let image = |k: u32| {
            let [columns, rows] = [columns, rows].map(|count| ((count.max(1) - 1) >> k) + 1);
            let block = (BLOCK >> k).max(COARSE_BLOCK);
            BlockImage {
                columns,
                rows,
                block: [block; 2],
                every: Some(1 << k),
                first: [0; 2],
            }
        };
        let has_cells = |image: &BlockImage| image.columns > 1 && image.rows > 1;
        let coarser = (1..31).map(image).take_while(has_cells);
        Self {
            images: std::iter::once(image(0)).chain(coarser).collect(),
            sources,
            sample,
            pool: Mutex::new(Pool::new(options)),
            options: format!(
                "{:?}",
                (
                    options.no_data,
                    options.band,
                    &options.variable,
                    options.encoding,
                    options.png_channel
                )
            ),
        }
    }

    fn pool(&self) -> MutexGuard<'_, Pool> {
        // Only decoders can panic while the lock is held, and their panics are caught.
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a file; `None`, with one warning, if it cannot be read.
    ///
    /// # Errors
    /// If it is remote and cannot be read at present.
    pub(super) fn opened(
        &self,
        number: usize,
        source: &Source,
    ) -> Result<Option<Arc<OpenFile>>, RasterError> {
        self.pool().get(number, source)
    }

    /// Returns the number of open files.
    #[cfg(test)]
    pub(super) fn open_files(&self) -> usize {
        self.pool().len()
    }
}

/// Samples, filled from the last file to the first.
struct Filling<'p> {
    part: &'p Part,
    values: Vec<f64>,
    done: FixedBitSet,
    remaining: usize,
}

impl<'p> Filling<'p> {
    fn new(part: &'p Part) -> Self {
        let count = part.columns as usize * part.rows as usize;
        Self {
            part,
            values: vec![f64::NAN; count],
            done: FixedBitSet::with_capacity(count),
            remaining: count,
        }
    }

    /// Returns the unfilled positions in an overlap: column, row and index.
    fn unfilled_places(&self, overlap: &Part) -> Vec<[u32; 3]> {
        let part = self.part;
        let rows = overlap.row..overlap.row + overlap.rows;
        let places = rows.flat_map(|row| {
            let columns = overlap.column..overlap.column + overlap.columns;
            columns.map(move |column| {
                [
                    column,
                    row,
                    (row - part.row) * part.columns + column - part.column,
                ]
            })
        });
        places
            .filter(|[_, _, index]| !self.done.contains(*index as usize))
            .collect()
    }

    /// Fills positions from a file.
    ///
    /// # Errors
    /// The reason why a height is unknown.
    fn fill(
        &mut self,
        level: u8,
        source: &Source,
        opened: &OpenFile,
        places: &[[u32; 3]],
    ) -> Result<(), RasterError> {
        for &[column, row, index] in places {
            // Both fit: the position is inside the terrain.
            let place = source.place([column, row].map(|index| index << level));
            if let Some(height) = opened.height(level, place)? {
                self.values[index as usize] = height;
                self.done.insert(index as usize);
                self.remaining -= 1;
            }
        }
        Ok(())
    }
}

impl BlockReader for Mosaic {
    fn format(&self) -> &'static str {
        "terrain of many files"
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.sample
    }

    fn is_stored(&self, image: usize, part: &Part) -> bool {
        let mut sources = self.sources.iter();
        sources.any(|source| source.overlap(image as u32, part).is_some())
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        let mut filling = Filling::new(part);
        let mut is_incomplete = false;
        for (number, source) in self.sources.iter().enumerate().rev() {
            if filling.remaining == 0 {
                break;
            }
            let Some(overlap) = source.overlap(image as u32, part) else {
                continue;
            };
            let places = filling.unfilled_places(&overlap);
            if places.is_empty() {
                continue;
            }
            // The lock covers only the opening, so that other readers do not wait for the whole
            // read.
            let opened = self.opened(number, source)?;
            if let Some(opened) = &opened {
                filling.fill(image as u8, source, opened, &places)?;
            }
            is_incomplete |= opened.is_none_or(|opened| opened.cache_use().1 > 0);
            self.pool().make_room(0);
        }
        let values = filling.values;
        Ok(Block {
            samples: match self.sample {
                SampleType::F32 => values
                    .iter()
                    .map(|value| *value as f32)
                    .collect::<Vec<_>>()
                    .into(),
                _ => values.into(),
            },
            no_data_mask: None,
            is_incomplete,
        })
    }

    fn stamp(&self, image: usize, part: &Part) -> Option<String> {
        let mut text = self.options.clone();
        for (number, source) in self.sources.iter().enumerate() {
            if source.overlap(image as u32, part).is_none() {
                continue;
            }
            let stamps = source.stamps()?;
            // An open file keeps its content even if another file replaces its name.
            if let Some(opened) = self.pool().peek(number)
                && opened.stamps() != Some(&stamps)
            {
                return None;
            }
            text += &format!(" {number} {source:?}");
            for stamp in &stamps {
                text += stamp.stable_text()?;
            }
        }
        Some(text)
    }

    fn index(&self) -> u64 {
        let mut hasher = XxHash64::with_seed(0);
        for source in &self.sources {
            // Only the name, because the folder may be moved.
            let name = source.path.file_name().unwrap_or_default();
            hasher.write(name.as_encoded_bytes());
            hasher.write_u64(source.bytes);
            let covers = &source.covers;
            for number in [covers.column, covers.row, covers.columns, covers.rows] {
                hasher.write_u32(number);
            }
        }
        hasher.finish()
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        let full = &self.images[0];
        let samples = u64::from(full.columns) * u64::from(full.rows);
        let parts = match samples <= FEW_SAMPLES && self.sources.len() <= FEW_FILES {
            true => vec![Part::whole(full.columns, full.rows)],
            false => self.spread_parts(),
        };
        Some(SurveyParts { image: 0, parts })
    }

    fn max_memory_bytes(&self) -> usize {
        let names = self.sources.iter().map(|source| source.path.capacity());
        let is_remote = |source: &Source| source.path.to_str().is_some_and(is_url);
        let pages = match self.sources.iter().any(is_remote) {
            true => RemoteFile::max_memory_bytes(),
            false => 0,
        };
        pages + Pool::max_bytes() + names.sum::<usize>() + self.sources.len() * size_of::<Source>()
    }
}

impl Mosaic {
    /// Returns parts spread over the terrain, in the order of the files.
    fn spread_parts(&self) -> Vec<Part> {
        let each = MIN_SURVEY_PARTS.div_ceil(self.sources.len().max(1)).isqrt() as u32 + 1;
        let each = if self.sources.len() >= MIN_SURVEY_PARTS {
            1
        } else {
            each
        };
        let along = |first: u32, count: u32, number: u32| {
            let share = count / each;
            let size = SURVEY_PART_SIDE.min(share).max(1);
            (first + number * share + (share - size.min(share)) / 2, size)
        };
        let of_source = |source: &Source| {
            let covers = source.covers;
            let numbers = (0..each).flat_map(move |row| (0..each).map(move |column| (column, row)));
            numbers.map(move |(column, row)| {
                let (column, columns) = along(covers.column, covers.columns, column);
                let (row, rows) = along(covers.row, covers.rows, row);
                Part {
                    column,
                    row,
                    columns,
                    rows,
                }
            })
        };
        self.sources.iter().flat_map(of_source).collect()
    }
}
