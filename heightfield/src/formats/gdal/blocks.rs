//! A band that GDAL reads, in blocks.

use std::hash::Hasher;
use std::sync::{Arc, Mutex, PoisonError};

use heightfield_gdal::{Band, Dataset, Mask, Sample, SampleType as Stored, Window};
use twox_hash::XxHash64;

use super::place::Place;
use super::{NAME, at_url, fault};
use crate::blocks::{
    Block, BlockImage, BlockReader, MAX_BLOCK_BYTES, Part, SurveyParts, usual_block,
};
use crate::encoding::codes;
use crate::raw_samples::{transposed, turned};
use crate::samples::{NoDataMask, SampleType, with_samples};
use crate::{RasterError, subsampled};

/// Parts per direction that are read at opening, if a file stays on disk.
const PARTS_PER_AXIS: u32 = 6;

/// Returns the type of the samples in memory.
pub(super) const fn memory_type(stored: Stored) -> SampleType {
    match stored {
        Stored::U8 => SampleType::U8,
        Stored::I8 => SampleType::I8,
        Stored::U16 => SampleType::U16,
        Stored::I16 => SampleType::I16,
        Stored::U32 => SampleType::U32,
        Stored::I32 => SampleType::I32,
        Stored::F16 | Stored::F32 => SampleType::F32,
        // Exact to 2^53.
        Stored::U64 | Stored::I64 | Stored::F64 => SampleType::F64,
    }
}

/// A file, and its name and options for reopening it.
pub(super) struct Source {
    pub(super) place: Arc<Place>,
    /// GDAL's name for it.
    pub(super) name: String,
    pub(super) options: Vec<String>,
}

/// A band in its file. One thread at a time reads it, and readers of blocks in memory do not wait
/// for that thread ([`Blocks`](crate::blocks::Blocks)).
pub(super) struct GdalBlocks {
    source: Source,
    /// Used by one thread at a time. `None` after a failed request to the server, because GDAL's
    /// cached state is then wrong.
    dataset: Mutex<Option<Dataset>>,
    /// Number of the band.
    number: u32,
    memory_type: SampleType,
    /// True if the first three bands are colours that encode the heights.
    has_codes: bool,
    images: Vec<BlockImage>,
    /// For each image but the full one, its number among the band's overviews.
    overviews: Vec<usize>,
    is_masked: bool,
    index: u64,
}

impl GdalBlocks {
    pub(super) fn new(
        source: Source,
        dataset: Dataset,
        number: u32,
        stored: SampleType,
        has_codes: bool,
    ) -> Result<Self, RasterError> {
        let memory_type = if has_codes { SampleType::I32 } else { stored };
        let band = dataset.band(number).map_err(fault)?;
        let is_masked = band.mask() == Mask::Band;
        let full = image(&band);
        let samples = band.block_size().map(u64::from).iter().product::<u64>();
        if samples.saturating_mul(memory_type.bytes()) > MAX_BLOCK_BYTES {
            let [columns, rows] = band.block_size();
            return Err(RasterError::Unsupported {
                format: NAME,
                feature: format!("a file that is read {columns} × {rows} samples at once"),
            });
        }
        // The overviews that GDAL would use for a coarse view of the band.
        let overviews = band.overviews();
        let mut coarser: Vec<_> = (0..overviews.len())
            .filter(|at| {
                let [own, of_full] = [&overviews[*at], &band].map(Band::size);
                own < of_full && (own[0] > 1 && own[1] > 1)
            })
            .filter(|at| !is_masked || overviews[*at].mask() == Mask::Band)
            .collect();
        coarser.sort_by_key(|at| std::cmp::Reverse(overviews[*at].size()));
        coarser.dedup_by_key(|at| overviews[*at].size());
        // A mean of encoded colours is not a height.
        coarser.retain(|_| !has_codes);
        let images: Vec<_> = (coarser.iter().map(|at| image(&overviews[*at]))).collect();
        let mut hasher = XxHash64::with_seed(0);
        for side in full
            .block
            .iter()
            .chain([&full.columns, &full.rows, &number])
        {
            hasher.write_u32(*side);
        }
        hasher.write(dataset.driver().as_bytes());
        Ok(Self {
            number,
            memory_type,
            has_codes,
            images: [full].into_iter().chain(images).collect(),
            overviews: coarser,
            is_masked,
            index: hasher.finish(),
            source,
            dataset: Mutex::new(Some(dataset)),
        })
    }

    fn reopen(&self) -> Result<Dataset, RasterError> {
        let Source {
            place,
            name,
            options,
        } = &self.source;
        let options: Vec<_> = options.iter().map(String::as_str).collect();
        place.reopen(name, &options)
    }

    fn read_from(
        &self,
        dataset: &Dataset,
        image: usize,
        part: &Part,
    ) -> Result<Block, RasterError> {
        let full = dataset.band(self.number).map_err(fault)?;
        let band = match image.checked_sub(1) {
            None => full,
            Some(coarser) => {
                let overviews = full.overviews();
                let overview = (self.overviews.get(coarser)).and_then(|at| overviews.get(*at));
                *overview
                    .ok_or_else(|| RasterError::damaged("GDAL: an overview has disappeared"))?
            }
        };
        let samples = match self.has_codes {
            true => {
                let colour = |number| read::<u8>(&dataset.band(number).map_err(fault)?, part);
                codes([colour(1)?, colour(2)?, colour(3)?])
            }
            false => {
                let mut samples = self.memory_type.none();
                with_samples!(&mut samples, values => *values = read(&band, part)?);
                samples
            }
        };
        let mask = self.is_masked.then(|| band.mask_band()).flatten();
        let no_data_mask = mask.map(|mask| no_data_mask(&mask, part)).transpose()?;
        Ok(Block {
            samples,
            no_data_mask: no_data_mask.filter(|no_data_mask| !no_data_mask.is_clear()),
            is_incomplete: false,
        })
    }
}

/// Describes an image, in blocks of a few of GDAL's blocks.
fn image(band: &Band<'_>) -> BlockImage {
    let [columns, rows] = band.size();
    let [across, down] = band.block_size();
    BlockImage {
        columns,
        rows,
        block: usual_block([across.min(columns.max(1)), down.min(rows.max(1))]),
        every: None,
        first: [0; 2],
    }
}

impl BlockReader for GdalBlocks {
    fn format(&self) -> &'static str {
        NAME
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.memory_type
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        true
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        // A panic has not changed the state.
        let mut open = self.dataset.lock().unwrap_or_else(PoisonError::into_inner);
        let dataset = match open.take() {
            Some(dataset) => dataset,
            None => self.reopen()?,
        };
        let block = self.read_from(&dataset, image, part);
        if let Some(error) = dataset.take_fault() {
            return Err(at_url::fault(error));
        }
        *open = Some(dataset);
        block
    }

    fn index(&self) -> u64 {
        self.index
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        // Overviews cover the whole image.
        match &self.images[..] {
            [full] => Some(subsampled::spread_parts(full, PARTS_PER_AXIS)),
            _ => None,
        }
    }
}

fn read<T: Sample>(band: &Band<'_>, part: &Part) -> Result<Vec<T>, RasterError> {
    let count = part.columns as usize * part.rows as usize;
    let mut samples = vec![T::default(); count];
    let window = Window {
        column: part.column,
        row: part.row,
        columns: part.columns,
        rows: part.rows,
    };
    band.read(window, &mut samples).map_err(fault)?;
    Ok(samples)
}

/// Returns the samples that a mask or an alpha band marks as no-data.
fn no_data_mask(mask: &Band<'_>, part: &Part) -> Result<NoDataMask, RasterError> {
    let valid = read::<u8>(mask, part)?;
    let mut no_data_mask = NoDataMask::with_capacity(valid.len());
    for (at, valid) in valid.iter().enumerate() {
        no_data_mask.set(at, *valid == 0);
    }
    Ok(no_data_mask)
}

/// A band stored with rows from north to south: its samples are transposed on reading. Such bands
/// have neither masks nor overviews.
pub(super) struct Transposed {
    blocks: GdalBlocks,
    images: [BlockImage; 1],
}

impl Transposed {
    pub(super) fn new(blocks: GdalBlocks) -> Self {
        let full = blocks.images[0];
        let [across, down] = full.block;
        let images = [BlockImage {
            columns: full.rows,
            rows: full.columns,
            block: [down, across],
            ..full
        }];
        Self { blocks, images }
    }
}

impl BlockReader for Transposed {
    fn format(&self) -> &'static str {
        NAME
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.blocks.memory_type
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        true
    }

    fn read(&self, _: usize, part: &Part) -> Result<Block, RasterError> {
        let block = self.blocks.read(0, &turned(part))?;
        Ok(Block {
            samples: transposed(&block.samples, part.columns, part.rows),
            ..block
        })
    }

    fn index(&self) -> u64 {
        self.blocks.index
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        Some(subsampled::spread_parts(&self.images[0], PARTS_PER_AXIS))
    }
}
