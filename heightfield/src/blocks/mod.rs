//! A raster that stays in its file: blocks of samples are read on access.
//!
//! A format that can read a part of an image without the rest returns a [`BlockReader`]. [`Blocks`]
//! reads blocks with it on access, caches the last ones (`cache`), and reads a few at opening
//! (`survey`). Coarser images of the same field, overviews, serve the coarse levels. For a file
//! without overviews they are computed during reading (`coarse`), and coarse samples are saved on
//! disk (`coarse_on_disk`). `block_state` tracks the blocks in memory and the pending ones.
//!
//! A block that cannot be read is no-data, with a warning: one damaged part must not make the rest
//! of a large file unusable. Remote data that has not arrived is pending ([`NotLoaded`]), and is
//! requested again. With [`Wait::Never`], so is everything that is not in memory: one thread makes
//! coarse samples, another reads fine ones (`background`), and only they wait for data.
//!
//! Several threads may share the blocks, for several devices on one terrain. Only one of them reads
//! at a time, beside the background threads, so the memory bound does not grow with their number,
//! and a block is not read twice. Reading a block in memory does not wait for one that is being
//! read.

mod background;
mod block_state;
mod cache;
mod coarse;
mod coarse_on_disk;
mod reader;
mod reading;
mod survey;

use std::fmt;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::samples::SampleType;
use super::{RasterError, ReadStatus, ReadTracker, Wait, bilinear};
use crate::disk_cache::DiskCache;
use crate::remote::without_key;
use background::{Job, Queue};
use block_state::BlockState;
use cache::Key;
use coarse::{Coarse, SampleState};
pub(super) use reader::{Block, BlockImage, BlockReader, Part, usual_block};
pub(super) use survey::{Survey, SurveyParts, stored_parts};

/// Max size of a block that can be read alone, bytes.
pub(super) const MAX_BLOCK_BYTES: u64 = 32 << 20;
/// Max wait for the running read when the file is closed.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);
/// An image serves a level that is coarser than it, or equal within this ratio: overviews of a
/// field of odd size are coarser than a power of two by up to a sample.
const COARSENESS_TOLERANCE: f64 = 1.01;

/// The blocks of a file; the last used are in memory.
pub(super) struct Blocks {
    shared: Arc<Shared>,
    /// Read for callers that do not wait; `None` if the system starts no thread.
    threads: OnceLock<Option<[JoinHandle<()>; 2]>>,
}

/// State shared by the reader and the background threads.
pub(super) struct Shared {
    reader: Box<dyn BlockReader>,
    /// The reader's images, and the coarse images computed from them.
    images: Vec<BlockImage>,
    /// Never locked while a block is read.
    state: Mutex<BlockState>,
    /// Locked by a thread that reads a block for a waiting reader.
    read_lock: Mutex<()>,
    coarse: Mutex<Coarse>,
    disk: DiskCache,
    /// Queue for coarse samples.
    coarse_queue: Queue,
    /// Queue for fine samples, which are urgent.
    fine_queue: Queue,
    /// Blocks that were read from the file.
    blocks_read: AtomicU64,
    /// The file's path, for warnings.
    path: OnceLock<PathBuf>,
}

/// A sample that is not in memory yet, or cannot be read at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotLoaded;

/// A stored sample; `None` for no-data that no value marks.
pub(super) type Stored = Result<Option<f64>, NotLoaded>;

impl Blocks {
    /// Returns the blocks of a reader, without reading any.
    pub(super) fn new(reader: Box<dyn BlockReader>) -> Self {
        let shared = Shared {
            images: reader.images().to_vec(),
            reader,
            state: Mutex::new(BlockState::new(cache::MAX_BYTES)),
            read_lock: Mutex::new(()),
            coarse: Mutex::new(Coarse::none()),
            disk: DiskCache::off(),
            coarse_queue: Queue::default(),
            fine_queue: Queue::default(),
            blocks_read: AtomicU64::new(0),
            path: OnceLock::new(),
        };
        Self {
            shared: Arc::new(shared),
            threads: OnceLock::new(),
        }
    }

    /// Sets the file's order, and adds coarse images; call it before anything is read.
    pub(super) fn set_order(&mut self, south_up: bool, east_first: bool) {
        let Some(shared) = Arc::get_mut(&mut self.shared) else {
            return;
        };
        shared.reader.set_order(south_up, east_first);
        shared.images = shared.reader.images().to_vec();
        if let [full] = shared.images[..]
            && full.every.is_none()
        {
            let coarse = Coarse::of(&full, south_up, east_first);
            shared.images.extend(coarse.images());
            shared.coarse = Mutex::new(coarse);
        }
    }

    /// Sets the folder of coarse samples; call it before anything is read.
    pub(super) fn set_disk_cache(&mut self, disk: &DiskCache) {
        if let Some(shared) = Arc::get_mut(&mut self.shared) {
            shared.disk = disk.clone();
        }
    }

    /// Starts the threads for reads that do not wait. If that fails, such a read waits.
    fn effective_wait(&self, wait: Wait) -> Wait {
        let start = |name: &str, queue: fn(&Shared) -> &Queue| {
            let shared = self.shared.clone();
            let builder = thread::Builder::new().name(name.into());
            builder.spawn(move || shared.work(queue(&shared)))
        };
        let start_both = || {
            let coarse = start("coarse samples", |shared| &shared.coarse_queue);
            let fine = start("fine samples", |shared| &shared.fine_queue);
            match (coarse, fine) {
                (Ok(coarse), Ok(fine)) => Some([coarse, fine]),
                (Err(error), _) | (_, Err(error)) => {
                    tracing::warn!(
                        "no thread to read samples in the background, so reads wait: {error}"
                    );
                    None
                }
            }
        };
        match wait == Wait::Never && self.threads.get_or_init(start_both).is_some() {
            true => Wait::Never,
            false => Wait::UntilRead,
        }
    }

    /// Returns a stored sample at a column and row of an image, in the file's order.
    pub(super) fn stored(&self, image: usize, column: u32, row: u32, wait: Wait) -> Stored {
        self.shared
            .sample(image, [column, row], self.effective_wait(wait))
    }

    /// Returns the height at a column and row of an image, in the file's order; `height` converts a
    /// stored value.
    pub(super) fn height(
        &self,
        image: usize,
        [column, row]: [u32; 2],
        wait: Wait,
        height: impl Fn(Option<f64>) -> f64,
    ) -> (f64, ReadStatus) {
        match self.stored(image, column, row, wait) {
            Ok(stored) => (height(stored), ReadStatus::Complete),
            Err(NotLoaded) => (f64::NAN, ReadStatus::Pending),
        }
    }

    /// Prefetches blocks of the image that serves a level, in a range of columns and of rows of the
    /// full image.
    pub(super) fn prefetch_full(&self, level: u8, columns: [u32; 2], rows: [u32; 2]) {
        if self.effective_wait(Wait::Never) == Wait::Never {
            self.shared.prefetch_full(level, columns, rows);
        }
    }
}

impl Deref for Blocks {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.shared
    }
}

impl Drop for Blocks {
    fn drop(&mut self) {
        // A thread that waits for a server ends when the server answers.
        let are_drained = [&self.shared.coarse_queue, &self.shared.fine_queue]
            .map(|queue| queue.close(CLOSE_TIMEOUT));
        let threads = self.threads.take().flatten().into_iter().flatten();
        for (thread, is_drained) in threads.zip(are_drained) {
            if is_drained {
                let _ = thread.join();
            }
        }
        let new = self.coarse().take_unsaved();
        self.save(new);
        if let Some(path) = self.path.get() {
            let (read, name) = (self.blocks_read(), without_key(path));
            tracing::debug!("{read} blocks of {name} were read");
        }
    }
}

impl Shared {
    /// Sets the file's name for warnings.
    pub(super) fn set_path(&self, path: &Path) {
        // The first name is kept: a second one is for the same file.
        let _ = self.path.set(path.to_owned());
    }

    /// Sets the max size of the cache, and the number of unreadable blocks that were reported
    /// before.
    pub(super) fn reset_cache(&self, max_bytes: usize, unreadable: u32) {
        *self.state() = BlockState::new(max_bytes).after(unreadable);
    }

    /// Returns the memory of the cached blocks, bytes, and the number of unreadable blocks.
    pub(super) fn cache_use(&self) -> (usize, u32) {
        let state = self.state();
        (state.cache.bytes(), state.unreadable)
    }

    /// Returns the number of blocks that were read from the file.
    pub(super) fn blocks_read(&self) -> u64 {
        self.blocks_read.load(Ordering::Relaxed)
    }

    /// Returns the number of blocks of the full image.
    pub(super) fn block_count(&self) -> u64 {
        let counts = self.images.first().map_or([0; 2], BlockImage::counts);
        counts.map(u64::from).iter().product()
    }

    /// Returns true if a block of the file is being read in the background, or is queued.
    pub(super) fn is_reading(&self) -> bool {
        !self.fine_queue.is_idle()
    }

    /// Returns the last error of the connection, if a read that waited lacked a block since the last
    /// call. Other reads are repeated until the block arrives.
    pub(super) fn take_outage(&self) -> Option<RasterError> {
        let mut state = self.state();
        let lacked_block = std::mem::take(&mut state.lacked_block);
        state.outage.take_if(|_| lacked_block)
    }

    fn state(&self) -> MutexGuard<'_, BlockState> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn coarse(&self) -> MutexGuard<'_, Coarse> {
        // See `state`.
        self.coarse.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the type of the samples in memory.
    pub(super) fn sample_type(&self) -> SampleType {
        self.reader.sample_type()
    }

    /// Returns the max memory, bytes: the cached blocks, the one in use, the one read in the
    /// background, and the reader's own memory.
    pub(super) fn max_bytes(&self) -> usize {
        let samples = |image: &BlockImage| image.block.map(u64::from).iter().product::<u64>();
        let largest = self.reader.images().iter().map(samples).max();
        let block = largest.unwrap_or(0) * self.sample_type().bytes();
        let pieces = match self.images.len() > self.reader.images().len() {
            true => coarse::MAX_BYTES,
            false => 0,
        };
        let blocks = 2 * block.min(MAX_BLOCK_BYTES) as usize;
        cache::MAX_BYTES + blocks + pieces + self.reader.max_memory_bytes()
    }

    /// Returns the image that serves a level: the coarsest that is no coarser than the level.
    pub(super) fn image_of(&self, level: u8) -> usize {
        let step = f64::from(level).exp2() * COARSENESS_TOLERANCE;
        let serves = |image: &BlockImage| self.coarseness(image).iter().all(|times| *times <= step);
        self.images.iter().rposition(serves).unwrap_or(0)
    }

    /// As `image_of`, for the full image and those whose samples are areas: a subsampled image has
    /// its samples at other positions.
    pub(super) fn overview_of(&self, level: u8) -> usize {
        let image = self.image_of(level);
        let every = self.images.get(image).and_then(|image| image.every);
        if every.is_some() { 0 } else { image }
    }

    /// Returns a stored sample at a column and row of an image, in the file's order.
    fn sample(&self, image: usize, [column, row]: [u32; 2], wait: Wait) -> Stored {
        if image >= self.reader.images().len() {
            return self.coarse_sample(image, [column, row], wait);
        }
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        let [across, down] = of.block;
        let block = self.block(image, [column / across, row / down], wait);
        if block.is_err() && wait == Wait::UntilRead {
            self.state().lacked_block = true;
        }
        let Some(block) = block? else {
            return Ok(None);
        };
        let columns = of.part([column / across, row / down]).columns as usize;
        let index = (row % down) as usize * columns + (column % across) as usize;
        Ok(block.stored(index))
    }

    /// Returns a stored sample of a computed image.
    fn coarse_sample(&self, image: usize, at: [u32; 2], wait: Wait) -> Stored {
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        let key = coarse::locate(image, at).0;
        let mut found = self.coarse().sample(image, at);
        if found == (SampleState::Unknown { is_searched: false }) && self.disk.is_on() {
            if wait == Wait::Never {
                self.coarse_queue.push_back(Job::LoadPiece(key));
                return Err(NotLoaded);
            }
            self.load_piece(key);
            found = self.coarse().sample(image, at);
        }
        if let SampleState::Value(value) = found {
            return Ok(Some(value));
        }
        let every = of.every.unwrap_or(1);
        let [column, row] = [0, 1].map(|axis| of.first[axis] + at[axis] * every);
        let full = &self.images[0];
        let block = [column / full.block[0], row / full.block[1]];
        let part = full.part(block);
        if !self.reader.is_stored(0, &part) {
            self.coarse().add_block(&part, None, false);
            return Ok(None);
        }
        let cached = self.state().cache.get(&Key {
            image: 0,
            at: block,
        });
        if wait == Wait::UntilRead || cached.is_some() {
            return self.sample(0, [column, row], wait);
        }
        self.coarse_queue.push_back(Job::Coarsen(block));
        Err(NotLoaded)
    }

    /// Returns the columns and rows of an image.
    pub(super) fn size(&self, image: usize) -> [u32; 2] {
        let of = self.images.get(image);
        of.map_or([0; 2], |of| [of.columns, of.rows])
    }

    /// Returns the bilinear height between the samples of an image at a position in columns and
    /// rows of the full image; every corner with a weight must have a height. `read` returns the
    /// height at a column and row of the image, in the file's order.
    pub(super) fn between(
        &self,
        image: usize,
        [column, row]: [f64; 2],
        read: impl Fn([u32; 2]) -> (f64, ReadStatus),
    ) -> (f64, ReadStatus) {
        let Some(of) = self.images.get(image) else {
            return (f64::NAN, ReadStatus::Complete);
        };
        // A sample is the middle of its cell, and all images have the same edges.
        let times = self.coarseness(of);
        let middle = if of.every.is_some() { 0.0 } else { 0.5 };
        let place = |at: f64, times: f64, count: u32| {
            ((at + middle) / times - middle).clamp(0.0, f64::from(count) - 1.0)
        };
        let place = [
            place(column - f64::from(of.first[0]), times[0], of.columns),
            place(row - f64::from(of.first[1]), times[1], of.rows),
        ];
        let reads = ReadTracker::default();
        let height = bilinear::at(place, |column, row| reads.record(read([column, row])));
        (height, reads.status())
    }

    /// As [`Blocks::prefetch_full`].
    fn prefetch_full(&self, level: u8, columns: [u32; 2], rows: [u32; 2]) {
        let image = self.image_of(level);
        let Some(of) = self.images.get(image) else {
            return;
        };
        let times = self.coarseness(of);
        // A height between two samples needs both.
        let along = |[first, last]: [u32; 2], axis: usize, count: u32| {
            let at = |full: u32| (f64::from(full) - f64::from(of.first[axis])) / times[axis];
            let begin = (at(first).floor() - 1.0).clamp(0.0, f64::from(count) - 1.0);
            let end = (at(last).ceil() + 1.0).clamp(begin, f64::from(count) - 1.0);
            (begin as u32, (end - begin) as u32 + 1)
        };
        let exact = |[first, last]: [u32; 2]| (first, last - first + 1);
        let (columns, rows) = match image {
            0 => (exact(columns), exact(rows)),
            _ => (along(columns, 0, of.columns), along(rows, 1, of.rows)),
        };
        let part = Part {
            column: columns.0,
            row: rows.0,
            columns: columns.1,
            rows: rows.1,
        };
        self.prefetch(image, &part);
    }

    /// Returns the samples of the full image per sample of another, along rows and columns.
    fn coarseness(&self, image: &BlockImage) -> [f64; 2] {
        if let Some(every) = image.every {
            return [f64::from(every); 2];
        }
        let full = self.images.first().unwrap_or(image);
        [
            f64::from(full.columns) / f64::from(image.columns),
            f64::from(full.rows) / f64::from(image.rows),
        ]
    }
}

impl fmt::Debug for Blocks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Blocks")
            .field("images", &self.images)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod coarse_tests;
#[cfg(test)]
mod tests;
