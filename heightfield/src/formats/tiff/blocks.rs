//! A TIFF that stays on disk: full image, overviews and masks, read in blocks of whole strips or
//! tiles, or in parts of large uncompressed ones.

use std::hash::Hasher;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use tiff_reader::{TagValue, TiffFile};
use twox_hash::XxHash64;

use super::images::Directory;
use super::layout::{Layout, NumberKind};
use super::masks::Mask;
use super::samples::{heights, no_data_mask};
use super::uncompressed::rows;
use super::{budget, images, unpack};
use crate::blocks::{
    Block, BlockImage, BlockReader, MAX_BLOCK_BYTES, Part, SurveyParts, stored_parts,
};
use crate::decoder_panic::guarded;
use crate::disk_cache::{DiskCache, FileStamp};
use crate::input::FileBytes;
use crate::remote::RemoteFile;
use crate::samples::{NoDataMask, SampleValue, with_samples};
use crate::unreadable_parts::UnreadableParts;
use crate::{RasterError, SampleType};

/// Side of a usual block: smaller strips and tiles are read several at once.
const USUAL_BLOCK: u32 = 256;
/// Max columns of a part of an uncompressed row.
const MAX_ROW: u32 = 32_768;

/// Returns true if single blocks of an image can be read: its rows can, or a strip or tile is small
/// enough.
fn can_read_blocks(layout: &Layout) -> bool {
    layout.is_read_by_rows() || is_small(layout, chunks(layout))
}

/// Returns true if a block of some columns and rows is small enough to be decoded.
fn is_small(layout: &Layout, block: [u32; 2]) -> bool {
    let [columns, rows] = block.map(u64::from);
    let samples = columns.saturating_mul(rows);
    samples.saturating_mul(layout.texel_bytes().max(8)) <= MAX_BLOCK_BYTES
}

/// Returns the columns and rows of a block. For uncompressed samples it is a square, or for a
/// remote file a wide rectangle, because adjacent bytes arrive in one response; its size with all
/// bands is limited.
fn block(layout: &Layout, is_remote: bool) -> [u32; 2] {
    if !layout.is_read_by_rows() {
        return chunks(layout);
    }
    let usual = if is_remote { MAX_ROW } else { USUAL_BLOCK };
    let texels = (MAX_BLOCK_BYTES / layout.texel_bytes()).min(u32::MAX.into()) as u32;
    let columns = layout.chunk.0.min(usual).min(texels).max(1);
    let rows = USUAL_BLOCK * USUAL_BLOCK / columns;
    [columns, rows.min(texels / columns).max(1)]
}

/// Returns the fewest whole strips or tiles that make a usual block.
fn chunks(layout: &Layout) -> [u32; 2] {
    let (columns, rows) = layout.chunk;
    let several = |chunk: u32| chunk.saturating_mul(USUAL_BLOCK.div_ceil(chunk));
    // A strip is as wide as the image, so only a few wide ones are read at once.
    let usual = USUAL_BLOCK * USUAL_BLOCK / columns.clamp(1, USUAL_BLOCK * USUAL_BLOCK);
    let down = match columns > USUAL_BLOCK {
        true => rows.saturating_mul(usual.max(1).div_ceil(rows)),
        false => several(rows),
    };
    [several(columns), down]
}

/// Returns the byte ranges of a part in the file.
fn ranges(layout: &Layout, part: &Part) -> Vec<Range<u64>> {
    let mut ranges = vec![];
    let bands = layout.bands_read();
    let chunks = bands.flat_map(|band| layout.chunks_of(band, part));
    for chunk in chunks.filter(|chunk| chunk.bytes > 0) {
        match layout.is_plain {
            true => ranges.extend(rows(layout, &chunk, part).map(|range| {
                let at = |offset: u64| chunk.place.saturating_add(offset);
                at(range.start)..at(range.end)
            })),
            false => ranges.push(chunk.place..chunk.place.saturating_add(chunk.bytes)),
        }
    }
    ranges
}

/// A TIFF on disk.
pub(super) struct TiffBlocks {
    /// The main file and the overview file beside it, if remote.
    remote: Vec<Option<Arc<RemoteFile>>>,
    unread: UnreadableParts,
    /// The main file and the mask's, each with its state at opening; `None` if one has changed
    /// since.
    inputs: Option<Vec<(FileBytes, FileStamp)>>,
    /// Cached [`BlockReader::index`].
    index: OnceLock<u64>,
    /// The full image and its overviews.
    images: Vec<Image>,
    /// The same images, for [`Blocks`](crate::blocks::Blocks).
    blocks: Vec<BlockImage>,
}

/// A file, and its source if it is remote.
pub(super) type Opened = (Arc<TiffFile>, Option<Arc<RemoteFile>>);

/// Number of the main file; the overview file beside it is the next.
const MAIN: usize = 0;

/// Properties of a file that are read before its blocks.
#[derive(Clone, Copy)]
pub(super) struct FileContext<'k> {
    /// Its name for warnings.
    pub(super) name: &'k str,
    /// The kind of numbers to read from it.
    pub(super) kind: NumberKind,
    /// The mask's file beside it.
    pub(super) mask: Option<&'k Arc<TiffFile>>,
    /// Folder for decompressed large strips and tiles, or the reason why there is none.
    pub(super) disk: Result<&'k DiskCache, &'k str>,
}

/// An image with its masks.
pub(super) struct Image {
    /// Number of its file.
    file: usize,
    pub(super) layout: Layout,
    pub(super) masks: Vec<Mask>,
}

impl Image {
    /// Returns an image of the main file.
    pub(super) fn of(
        directory: &Directory,
        context: &FileContext<'_>,
    ) -> Result<Self, RasterError> {
        Ok(Self {
            file: MAIN,
            layout: Layout::read(directory, context.kind)?,
            masks: Mask::all(directory, context.mask),
        })
    }

    /// Returns true if parts of it can be read without decompressing it to disk.
    pub(super) fn has_parts(&self) -> bool {
        can_read_blocks(&self.layout)
    }

    /// Prepares reading the image in blocks.
    ///
    /// # Errors
    /// The reason why that is impossible.
    pub(super) fn prepare_blocks(&mut self, disk: Result<&DiskCache, &str>) -> Result<(), String> {
        let chunks = self.layout.chunks_name();
        if !can_read_blocks(&self.layout) {
            let unpacked = match disk {
                Ok(disk) => {
                    unpack::into_file(&mut self.layout, disk).map_err(|error| error.to_string())
                }
                Err(why) => Err(why.to_owned()),
            };
            unpacked.map_err(|why| {
                format!("its {chunks} are too large to be read in parts, and {why}")
            })?;
        }
        let mut masks = self.masks.iter_mut();
        let prepared = masks.try_for_each(|mask| mask.prepare_blocks(disk));
        prepared.map_err(|why| {
            self.layout.unpacked = None;
            format!("the strips or tiles of its mask are too large to be read in parts, and {why}")
        })
    }

    /// Returns the max disk space for its decompressed chunks, bytes.
    pub(super) fn unpacked_bytes(&self) -> u64 {
        let own = self.layout.unpacked.as_ref();
        let masks = self.masks.iter().map(Mask::unpacked_bytes);
        own.map_or(0, |unpacked| unpacked.max_bytes()) + masks.sum::<u64>()
    }
}

impl TiffBlocks {
    /// Returns the full image of a file, [left in it](Image::prepare_blocks), and the overviews of
    /// the same kind in the file and in the one beside it.
    pub(super) fn new(
        (file, remote): Opened,
        full: Image,
        overviews: Option<Opened>,
        context: &FileContext<'_>,
        inputs: &[&FileBytes],
    ) -> Result<Self, RasterError> {
        let (also, also_remote) = overviews.unzip();
        let files: Vec<_> = [file].into_iter().chain(also).collect();
        let remote: Vec<_> = [remote].into_iter().chain(also_remote).collect();
        let mut found = vec![full];
        for (index, file) in files.iter().enumerate() {
            for directory in images::overviews(file) {
                // An unusable overview must not make the field unusable.
                let Ok(image) = Image::of(&directory, context) else {
                    continue;
                };
                let mut image = Image {
                    file: index,
                    ..image
                };
                let bytes = file.source().len();
                let suits = budget::check(&image.layout, bytes, true).is_ok()
                    && image.is_overview_of(&found[MAIN])
                    && image.prepare_blocks(context.disk).is_ok();
                if suits {
                    found.push(image);
                }
            }
        }
        found.sort_by_key(|image| std::cmp::Reverse(image.layout.columns));
        found.dedup_by_key(|image| image.layout.columns);
        let is_remote = remote.iter().any(Option::is_some);
        let blocks = found.iter().map(|image| BlockImage {
            columns: image.layout.columns,
            rows: image.layout.rows,
            block: block(&image.layout, is_remote),
            every: None,
            first: [0; 2],
        });
        Ok(Self {
            blocks: blocks.collect(),
            remote,
            unread: UnreadableParts::of(context.name),
            inputs: stamped(inputs)?,
            index: OnceLock::new(),
            images: found,
        })
    }

    /// Returns true if overviews are used for coarse levels.
    pub(super) fn has_overviews(&self) -> bool {
        self.images.len() > 1
    }

    /// Drops the overviews: coarse levels are then computed from the full image.
    pub(super) fn drop_overviews(&mut self) {
        self.images.truncate(1);
        self.blocks.truncate(1);
    }

    /// Reads a part of an image.
    fn block(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        let Image { layout, masks, .. } = &self.images[image];
        Ok(Block {
            samples: heights(layout, part)?,
            no_data_mask: no_data_mask(layout, masks, part)?,
            is_incomplete: false,
        })
    }

    /// Reads a part of an image chunk by chunk after an error: only unreadable strips and tiles
    /// become no-data, with a warning.
    fn by_chunks(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        let mut all = self.no_data_block(part);
        let stored = self.images[image].layout.chunks_in(part);
        for chunk in stored.filter(|chunk| chunk.bytes > 0) {
            let inside = chunk.covers.within(part);
            let read = || self.block(image, &inside);
            if let Some(block) = self.try_read(image, &chunk.covers, read)? {
                copy(&block, &inside, &mut all, part);
            }
        }
        Ok(all)
    }

    /// As `by_chunks`, for samples that are read by rows: only unreadable rows become no-data. The
    /// masks are decoded once.
    fn by_rows(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        let Image { layout, masks, .. } = &self.images[image];
        let mut all = self.no_data_block(part);
        let masked = || no_data_mask(layout, masks, part);
        let masked = match guarded(super::FORMAT.name, masked) {
            Ok(masked) => masked,
            Err(fault) if fault.is_connection_error() => return Err(fault),
            Err(fault) => {
                self.unread.warn(image, part, &fault);
                return Ok(all);
            }
        };
        for row in part.row..part.row + part.rows {
            let row = Part {
                row,
                rows: 1,
                ..*part
            };
            let read = || heights(layout, &row);
            if let Some(samples) = self.try_read(image, &row, read)? {
                let block = Block {
                    samples,
                    no_data_mask: None,
                    is_incomplete: false,
                };
                copy(&block, &row, &mut all, part);
            }
        }
        if let (Some(no_data_mask), Some(masked)) = (&mut all.no_data_mask, masked) {
            no_data_mask.union_with(&masked);
        }
        Ok(all)
    }

    /// Reads a piece; returns `None`, with one warning, if it cannot be read.
    fn try_read<T>(
        &self,
        image: usize,
        chunk: &Part,
        read: impl FnOnce() -> Result<T, RasterError>,
    ) -> Result<Option<T>, RasterError> {
        let first = [chunk.column, chunk.row];
        if self.unread.has(image, first) {
            return Ok(None);
        }
        match guarded(super::FORMAT.name, read) {
            Ok(read) => Ok(Some(read)),
            Err(fault) if fault.is_connection_error() => Err(fault),
            Err(fault) => {
                self.unread.warn(image, chunk, &fault);
                Ok(None)
            }
        }
    }

    /// Returns a part with all samples no-data.
    fn no_data_block(&self, part: &Part) -> Block {
        let count = part.columns as usize * part.rows as usize;
        let mut samples = self.images[MAIN].layout.memory_type().none();
        with_samples!(&mut samples, values => values.resize(count, SampleValue::nearest(0.0)));
        let mut no_data_mask = NoDataMask::with_capacity(count);
        no_data_mask.insert_range(..);
        Block {
            samples,
            no_data_mask: Some(no_data_mask),
            is_incomplete: true,
        }
    }
}

/// Copies a piece into a part. Samples with data become data in the part.
fn copy(block: &Block, chunk: &Part, to: &mut Block, part: &Part) {
    let (columns, width) = (chunk.columns as usize, part.columns as usize);
    for index in 0..columns * chunk.rows as usize {
        let Some(value) = block.stored(index) else {
            continue;
        };
        let row = (chunk.row - part.row) as usize + index / columns;
        let at = row * width + (chunk.column - part.column) as usize + index % columns;
        with_samples!(&mut to.samples, values => values[at] = SampleValue::nearest(value));
        if let Some(no_data_mask) = &mut to.no_data_mask {
            no_data_mask.remove(at);
        }
    }
}

/// Returns opened files with their stamps, for later comparison.
fn stamped(inputs: &[&FileBytes]) -> Result<Option<Vec<(FileBytes, FileStamp)>>, RasterError> {
    let mut all = vec![];
    for input in inputs {
        // The decoder opened the path separately.
        let stamp = input.stamp().filter(|_| input.is_at_its_path());
        match (input.try_clone()?, stamp) {
            (Some(own), Some(stamp)) => all.push((own, stamp)),
            _ => return Ok(None),
        }
    }
    Ok(Some(all))
}

impl Image {
    /// Returns true if it covers the other image with fewer samples of the same type and layout.
    fn is_overview_of(&self, full: &Self) -> bool {
        let (own, theirs) = (&self.layout, &full.layout);
        let times = [
            f64::from(theirs.columns) / f64::from(own.columns),
            f64::from(theirs.rows) / f64::from(own.rows),
        ];
        // Half of an odd number of samples is rounded up or down.
        let one = 1.0 / f64::from(own.columns.min(own.rows).max(1));
        own.stored == theirs.stored
            && own.bands == theirs.bands
            && times[0] > 1.0
            && (times[0] / times[1] - 1.0).abs() <= 1.5 * one
            && own.of_band().is_some()
            && self.has_place_of(full, times)
    }

    fn tag(&self, number: u16) -> Option<&TagValue> {
        self.layout
            .directory
            .ifd()
            .tag(number)
            .map(|tag| &tag.value)
    }

    /// Returns true if its place is that of another image, or is not stated, as in most overviews.
    fn has_place_of(&self, full: &Self, times: [f64; 2]) -> bool {
        const PIXEL_SCALE: u16 = 33550;
        const TIE_POINTS: u16 = 33922;
        const TRANSFORM: u16 = 34264;
        const GEO_KEYS: u16 = 34735;
        // Max difference, in cells of the overview.
        const MAX_DIFFERENCE: f64 = 0.5;
        let keys = |image: &Self| Some(image.tag(GEO_KEYS)?.as_u16_slice()?.to_vec());
        if keys(self).is_some_and(|own| keys(full) != Some(own)) {
            return false;
        }
        let numbers = |image: &Self, number: u16| image.tag(number).and_then(TagValue::as_f64_vec);
        let (Some(cell), Some(tie)) = (numbers(self, PIXEL_SCALE), numbers(self, TIE_POINTS))
        else {
            // A transform replaces scale and tie points.
            return self.tag(TRANSFORM).is_none() || full.tag(TRANSFORM).is_some();
        };
        let (Some(full_cell), Some(full_tie)) =
            (numbers(full, PIXEL_SCALE), numbers(full, TIE_POINTS))
        else {
            return false;
        };
        if (&cell, &tie) == (&full_cell, &full_tie) {
            // The tags were copied from the full image and do not describe the overview.
            return true;
        }
        (0..2).all(|axis| {
            let at = |numbers: &[f64], index: usize| numbers.get(index).copied();
            let (Some(own), Some(of_full)) = (at(&cell, axis), at(&full_cell, axis)) else {
                return false;
            };
            let same_size = (own / of_full / times[axis] - 1.0).abs() <= 0.1;
            let corner = |tie: &[f64], cell: f64| {
                let along = if axis == 0 { cell } else { -cell };
                Some(at(tie, axis + 3)? - at(tie, axis)? * along)
            };
            let corners = corner(&tie, own).zip(corner(&full_tie, of_full));
            same_size && corners.is_some_and(|(a, b)| (a - b).abs() <= MAX_DIFFERENCE * own.abs())
        })
    }
}

impl BlockReader for TiffBlocks {
    fn format(&self) -> &'static str {
        super::FORMAT.name
    }

    fn images(&self) -> &[BlockImage] {
        &self.blocks
    }

    fn sample_type(&self) -> SampleType {
        self.images[MAIN].layout.memory_type()
    }

    fn is_stored(&self, image: usize, part: &Part) -> bool {
        let mut chunks = self.images[image].layout.chunks_in(part);
        chunks.any(|chunk| chunk.bytes > 0)
    }

    fn prefetch(&self, image: usize, parts: &[Part]) {
        let Image { file, layout, .. } = &self.images[image];
        if let Some(remote) = &self.remote[*file] {
            remote.prefetch(parts.iter().flat_map(|part| ranges(layout, part)));
        }
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        // The decoder requests the chunks one by one, so they are prefetched together.
        self.prefetch(image, std::slice::from_ref(part));
        match self.block(image, part) {
            Err(fault) if !fault.is_connection_error() => {
                match self.images[image].layout.is_read_by_rows() {
                    true => self.by_rows(image, part),
                    false => self.by_chunks(image, part),
                }
            }
            block => block,
        }
    }

    fn stamp(&self, image: usize, _: &Part) -> Option<String> {
        let mut text = format!("{:x} band {}", self.index(), self.images[image].layout.band);
        for (input, stamp) in self.inputs.as_ref()? {
            let is_same = input.stamp().as_ref() == Some(stamp);
            text += " ";
            text += stamp.stable_text().filter(|_| is_same)?;
        }
        Some(text)
    }

    fn max_memory_bytes(&self) -> usize {
        let pages = match self.remote.iter().any(Option::is_some) {
            true => RemoteFile::max_memory_bytes(),
            false => 0,
        };
        let lists = self.images.iter().map(|image| image.layout.index_bytes());
        pages + lists.sum::<usize>()
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        let image = self.images.len() - 1;
        let layout = &self.images[image].layout;
        // The same parts of a file are read whether it is local or remote, and in whole strips or
        // tiles if these are small, so that the hash matches that of earlier versions.
        let decoded = chunks(layout);
        let surveyed = BlockImage {
            block: match is_small(layout, decoded) {
                true => decoded,
                false => block(layout, true),
            },
            ..self.blocks[image]
        };
        let is_stored = |part: &Part| self.is_stored(image, part);
        layout.is_plain.then(|| SurveyParts {
            image,
            parts: stored_parts(&surveyed, is_stored),
        })
    }

    fn index(&self) -> u64 {
        *self.index.get_or_init(|| self.hash_of_index())
    }
}

impl TiffBlocks {
    fn hash_of_index(&self) -> u64 {
        let mut hasher = XxHash64::with_seed(0);
        for image in &self.images {
            hasher.write_u32(image.layout.columns);
            hasher.write_u32(image.layout.rows);
            let bytes = image.layout.of_band().into_iter().flatten();
            for number in image.layout.places().chain(bytes.map(|(_, bytes)| bytes)) {
                hasher.write_u64(number);
            }
        }
        hasher.finish()
    }
}
