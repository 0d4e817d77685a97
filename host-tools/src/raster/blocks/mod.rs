//! A raster that stays in its file: blocks of samples are read when they are touched.
//!
//! A format that can read a part of an image without the rest hands over a
//! [`BlockReader`]. [`Blocks`] asks it for what is touched, keeps the blocks touched last
//! (`cache`), and looks at a few of them when the file is opened (`survey`). Coarser
//! images of the same field, overviews, serve the coarse levels of detail.
//!
//! A block that cannot be read is a hole, with a warning: what is wrong in one place of a
//! file that is larger than memory is no reason to feel nothing of it. What has not come yet
//! from elsewhere is not known: it is counted, and asked for again.
//!
//! Several threads may share the blocks, as those of several devices on one terrain do. One
//! block is read at a time, so the bound of the memory is that of one thread, and a block that
//! one thread has read is not read again for another. Whoever touches blocks in memory does not
//! wait for one that is being read.

mod cache;
mod kept;
mod survey;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::guard::guarded;
use super::samples::{HoleMask, SampleType, SampleValue, Samples, with_samples};
use super::{BadRaster, bilinear};
use crate::remote::without_key;
use cache::Key;
pub(super) use kept::not_yet;
use kept::{Kept, count_not_yet};
pub(super) use survey::{Looks, Survey};

/// Blocks of a larger size than this are not read one by one, bytes.
pub(super) const LARGEST_BLOCK_BYTES: u64 = 32 << 20;
/// An image serves a level that is coarser than it, or as coarse to this share: overviews
/// of a field whose size is odd are coarser than a power of two by up to a sample.
const AS_COARSE: f64 = 1.01;
/// After so many warnings of blocks that cannot be read one says that there are more.
const WARNINGS: u32 = 8;
/// Reads parts of a file's images.
pub(super) trait BlockReader: Send + Sync {
    /// Name of the format, in messages.
    fn format(&self) -> &'static str;

    /// The full image, and after it others of the same field, each coarser than the one
    /// before.
    fn images(&self) -> &[BlockImage];

    /// Type in which samples are held.
    fn sample_type(&self) -> SampleType;

    /// Whether the file stores samples there; where it does not, there is a hole.
    fn is_stored(&self, image: usize, part: &Part) -> bool;

    /// The samples of a part of an image, row after row.
    ///
    /// # Errors
    /// What is wrong with that part of the file.
    fn read(&self, image: usize, part: &Part) -> Result<Block, BadRaster>;

    /// Is told the file's order before anything is read: coarse levels count their samples
    /// from the south and west.
    fn set_order(&mut self, south_up: bool, east_first: bool) {
        let _ = (south_up, east_first);
    }

    /// Is told which parts are going to be read, one after the other: what is elsewhere is
    /// fetched meanwhile.
    fn want(&self, image: usize, parts: &[Part]) {
        let _ = (image, parts);
    }

    /// A hash of the file's index: where each block is stored and in how many bytes.
    fn index(&self) -> u64;

    /// What is looked at when the raster is opened; `None` for its coarsest image.
    fn looks(&self) -> Option<Looks> {
        None
    }

    /// Bytes that the reader itself keeps at most, besides the blocks that it hands over.
    fn kept_bytes(&self) -> usize {
        0
    }
}

/// An image that is read in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BlockImage {
    /// Samples a row.
    pub(super) columns: u32,
    /// Rows.
    pub(super) rows: u32,
    /// Columns and rows of a block; those at the east and south end are cut.
    pub(super) block: [u32; 2],
    /// It has every so many-th sample of the full image, the first one first. Else its
    /// samples are the middles of its own cells, and its edges those of the full image.
    pub(super) every: Option<u32>,
    /// Column and row of the full image where its first sample lies, where it has every so
    /// many-th.
    pub(super) first: [u32; 2],
}

/// A rectangle of an image, in the file's order of columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Its first column.
    pub(super) column: u32,
    /// Its first row.
    pub(super) row: u32,
    /// Samples a row.
    pub(super) columns: u32,
    /// Rows.
    pub(super) rows: u32,
}

/// Samples of a part of an image.
#[derive(Debug)]
pub(super) struct Block {
    /// Row after row.
    pub(super) samples: Samples,
    /// Holes that no value marks.
    pub(super) holes: Option<HoleMask>,
}

impl Block {
    /// A sample by its place in the block; `None` in a hole that no value marks.
    pub(super) fn stored(&self, index: usize) -> Option<f64> {
        let hole = (self.holes.as_ref()).is_some_and(|mask| mask.contains(index));
        (!hole).then(|| with_samples!(&self.samples, values => values[index].widen()))
    }
}

impl Part {
    /// All of an image.
    pub(super) const fn whole(columns: u32, rows: u32) -> Self {
        Self {
            column: 0,
            row: 0,
            columns,
            rows,
        }
    }

    /// What of it is within another part, of which it has something.
    pub(super) fn within(&self, other: &Self) -> Self {
        let cut = |first: u32, count: u32, from: u32, most: u32| {
            let begin = first.max(from);
            (begin, (first + count).min(from + most) - begin)
        };
        let (column, columns) = cut(self.column, self.columns, other.column, other.columns);
        let (row, rows) = cut(self.row, self.rows, other.row, other.rows);
        Self {
            column,
            row,
            columns,
            rows,
        }
    }
}

impl BlockImage {
    /// Blocks from west to east and down.
    fn counts(&self) -> [u32; 2] {
        let [across, down] = self.block;
        [self.columns.div_ceil(across), self.rows.div_ceil(down)]
    }

    /// What a block covers.
    fn part(&self, [across, down]: [u32; 2]) -> Part {
        let [column, row] = [across * self.block[0], down * self.block[1]];
        Part {
            column,
            row,
            columns: self.block[0].min(self.columns - column),
            rows: self.block[1].min(self.rows - row),
        }
    }
}

/// The blocks of a file, those touched last in memory.
pub(super) struct Blocks {
    reader: Box<dyn BlockReader>,
    /// Is not held while a block is read.
    kept: Mutex<Kept>,
    /// Is held by whoever reads a block.
    reading: Mutex<()>,
    /// The file, for warnings.
    path: OnceLock<PathBuf>,
}

/// What was asked for is elsewhere.
struct NotHere;

impl Blocks {
    /// Nothing is read yet.
    pub(super) fn new(reader: Box<dyn BlockReader>) -> Self {
        Self {
            reader,
            kept: Mutex::new(Kept::new(cache::MOST_BYTES)),
            reading: Mutex::new(()),
            path: OnceLock::new(),
        }
    }

    /// The file's order, before anything is read.
    pub(super) fn set_order(&mut self, south_up: bool, east_first: bool) {
        self.reader.set_order(south_up, east_first);
    }

    /// Names the file in warnings.
    pub(super) fn set_path(&self, path: &Path) {
        // A second name of the same file is no better.
        let _ = self.path.set(path.to_owned());
    }

    /// Keeps no more than so many bytes of blocks, and counts `unread` blocks as warned of.
    pub(super) fn set_share(&self, most_bytes: usize, unread: u32) {
        *self.kept() = Kept::new(most_bytes).after(unread);
    }

    /// Bytes that the blocks in memory take, and how many blocks could not be read.
    pub(super) fn share(&self) -> (usize, u32) {
        let kept = self.kept();
        (kept.cache.bytes(), kept.unread)
    }

    /// What the line said last, where something did not come.
    pub(super) fn take_outage(&self) -> Option<BadRaster> {
        self.kept().outage.take()
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        // Nothing that panics runs while this is held.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Type in which samples are held.
    pub(super) fn sample_type(&self) -> SampleType {
        self.reader.sample_type()
    }

    /// Bytes that blocks in memory take at most, and what their reader keeps.
    pub(super) fn most_bytes(&self) -> usize {
        cache::MOST_BYTES + LARGEST_BLOCK_BYTES as usize + self.reader.kept_bytes()
    }

    /// The image that serves a level of detail: the coarsest that is no coarser than it.
    pub(super) fn image_of(&self, level: u8) -> usize {
        let images = self.reader.images();
        let step = f64::from(level).exp2() * AS_COARSE;
        let serves = |image: &BlockImage| self.coarseness(image).iter().all(|times| *times <= step);
        images.iter().rposition(serves).unwrap_or(0)
    }

    /// The same among the full image and those with samples of their own: the samples of
    /// one that has every so many-th sample lie elsewhere than those of a field around it.
    pub(super) fn overview_of(&self, level: u8) -> usize {
        let image = self.image_of(level);
        let every = self
            .reader
            .images()
            .get(image)
            .and_then(|image| image.every);
        if every.is_some() { 0 } else { image }
    }

    /// A stored sample at a column and row of an image, in the file's order; `None` in a
    /// hole that no value marks.
    pub(super) fn stored(&self, image: usize, column: u32, row: u32) -> Option<f64> {
        let of = self.reader.images().get(image)?;
        let [across, down] = of.block;
        let block = self.block(image, [column / across, row / down])?;
        let columns = of.part([column / across, row / down]).columns as usize;
        let index = (row % down) as usize * columns + (column % across) as usize;
        block.stored(index)
    }

    /// A stored sample between the samples of an image, linear along rows and columns, at a
    /// place in columns and rows of the full one; every corner that counts must have
    /// a height. `height` makes one of a stored value.
    pub(super) fn between(
        &self,
        image: usize,
        [column, row]: [f64; 2],
        height: impl Fn(Option<f64>) -> f64,
    ) -> f64 {
        let Some(of) = self.reader.images().get(image) else {
            return f64::NAN;
        };
        // A sample is the middle of its cell, and the edges of the images are the same.
        let times = self.coarseness(of);
        let middle = if of.every.is_some() { 0.0 } else { 0.5 };
        let place = |at: f64, times: f64, count: u32| {
            ((at + middle) / times - middle).clamp(0.0, f64::from(count) - 1.0)
        };
        let place = [
            place(column - f64::from(of.first[0]), times[0], of.columns),
            place(row - f64::from(of.first[1]), times[1], of.rows),
        ];
        bilinear::at(place, |column, row| height(self.stored(image, column, row)))
    }

    /// Samples of the full image in one of another, along rows and columns.
    fn coarseness(&self, image: &BlockImage) -> [f64; 2] {
        if let Some(every) = image.every {
            return [f64::from(every); 2];
        }
        let full = self.reader.images().first().unwrap_or(image);
        [
            f64::from(full.columns) / f64::from(image.columns),
            f64::from(full.rows) / f64::from(image.rows),
        ]
    }

    /// A block, read if it is not in memory; `None` where there is no sample.
    fn block(&self, image: usize, at: [u32; 2]) -> Option<Arc<Block>> {
        let key = Key { image, at };
        if let Some(known) = self.kept().known(&key) {
            return known;
        }
        // Nothing that panics runs while this is held but decoders, whose panics are caught.
        let turn = self.reading.lock();
        let _turn = turn.unwrap_or_else(PoisonError::into_inner);
        // It may have been read by the one who had the turn before.
        if let Some(known) = self.kept().known(&key) {
            return known;
        }
        let part = self.reader.images().get(image)?.part(at);
        let read = self.read(image, &part);
        let mut kept = self.kept();
        let Ok(block) = read else {
            kept.wait_for(key);
            return None;
        };
        kept.put(key, block.clone());
        block
    }

    /// A part of an image; `None` where there is no sample.
    ///
    /// # Errors
    /// [`NotHere`], which is counted.
    fn read(&self, image: usize, part: &Part) -> Result<Option<Arc<Block>>, NotHere> {
        if !self.reader.is_stored(image, part) {
            return Ok(None);
        }
        let read = guarded(self.reader.format(), || self.reader.read(image, part));
        match read {
            Ok(block) => Ok(Some(Arc::new(block))),
            Err(fault) if fault.is_of_the_line() => {
                count_not_yet();
                self.kept().outage = Some(fault);
                Err(NotHere)
            }
            Err(fault) => {
                let unread = self.kept().count_unread();
                let name = (self.path.get()).map_or("the file".into(), |path| without_key(path));
                if unread <= WARNINGS {
                    tracing::warn!(
                        "columns {} to {}, rows {} to {} of {name} cannot be read and are a hole: {fault}",
                        part.column,
                        part.column + part.columns - 1,
                        part.row,
                        part.row + part.rows - 1
                    );
                } else if unread == WARNINGS + 1 {
                    tracing::warn!("more of {name} cannot be read and are holes");
                }
                Ok(None)
            }
        }
    }
}

impl fmt::Debug for Blocks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Blocks")
            .field("images", &self.reader.images())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
