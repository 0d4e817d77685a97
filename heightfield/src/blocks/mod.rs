//! A raster that stays in its file: blocks of samples are read when they are touched.
//!
//! A format that can read a part of an image without the rest hands over a
//! [`BlockReader`]. [`Blocks`] asks it for what is touched, keeps the blocks touched last
//! (`cache`), and looks at a few of them when the file is opened (`survey`). Coarser
//! images of the same field, overviews, serve the coarse levels of detail. Of a file that
//! has none they are made on the way (`coarse`), and what is coarse is kept on disk
//! (`coarse_on_disk`). `block_state` tracks the blocks in memory and those on their way.
//!
//! A block that cannot be read is a hole, with a warning: what is wrong in one place of a
//! file that is larger than memory is no reason to feel nothing of it. What has not come yet
//! from elsewhere is not known ([`NotHere`]), and asked for again. So is everything that is not in
//! memory, for a reader who must not wait ([`Wait::Never`]): one thread makes what is coarse, another
//! reads what is fine (`background`), and both wait for what they read.
//!
//! Several threads may share the blocks, as those of several devices on one terrain do. Of them one
//! reads at a time, besides the threads in the background, so the bound of the memory does not grow with
//! them, and a block that one thread has read is not read again for another. A read of blocks in
//! memory does not wait for one that is being read.

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
use coarse::{Coarse, Found};
pub(super) use reader::{Block, BlockImage, BlockReader, Part, usual_block};
pub(super) use survey::{Looks, Survey, stored_parts};

/// Blocks of a larger size than this are not read one by one, bytes.
pub(super) const MAX_BLOCK_BYTES: u64 = 32 << 20;
/// Time in which a block that is being read may end when the file is closed.
const END_WITHIN: Duration = Duration::from_secs(1);
/// An image serves a level that is coarser than it, or as coarse to this share: overviews
/// of a field whose size is odd are coarser than a power of two by up to a sample.
const AS_COARSE: f64 = 1.01;

/// The blocks of a file, those touched last in memory.
pub(super) struct Blocks {
    shared: Arc<Shared>,
    /// Read for those who do not wait; none if the system starts no thread.
    threads: OnceLock<Option<[JoinHandle<()>; 2]>>,
}

/// State that the reader and the threads in the background share.
pub(super) struct Shared {
    reader: Box<dyn BlockReader>,
    /// The reader's images, and coarse ones that are made of them.
    images: Vec<BlockImage>,
    /// Is not held while a block is read.
    kept: Mutex<BlockState>,
    /// Held by a thread that reads a block for a waiting reader.
    turn: Mutex<()>,
    coarse: Mutex<Coarse>,
    disk: DiskCache,
    /// Queue for coarse samples.
    queue: Queue,
    /// Queue for fine samples, which are needed at once.
    fine: Queue,
    /// Blocks that were read from the file.
    read: AtomicU64,
    /// The file, for warnings.
    path: OnceLock<PathBuf>,
}

/// A sample that is not in memory yet, or cannot be read at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotHere;

/// A stored sample; `None` in a hole that no value marks.
pub(super) type Stored = Result<Option<f64>, NotHere>;

impl Blocks {
    /// Nothing is read yet.
    pub(super) fn new(reader: Box<dyn BlockReader>) -> Self {
        let shared = Shared {
            images: reader.images().to_vec(),
            reader,
            kept: Mutex::new(BlockState::new(cache::MAX_BYTES)),
            turn: Mutex::new(()),
            coarse: Mutex::new(Coarse::none()),
            disk: DiskCache::off(),
            queue: Queue::default(),
            fine: Queue::default(),
            read: AtomicU64::new(0),
            path: OnceLock::new(),
        };
        Self {
            shared: Arc::new(shared),
            threads: OnceLock::new(),
        }
    }

    /// The file's order, before anything is read. From now on it has coarse images.
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

    /// Sets the folder of coarse samples, before anything is read.
    pub(super) fn set_disk_cache(&mut self, disk: &DiskCache) {
        if let Some(shared) = Arc::get_mut(&mut self.shared) {
            shared.disk = disk.clone();
        }
    }

    /// Starts the threads for reads that do not wait. Without threads such a read has to wait.
    fn possible(&self, wait: Wait) -> Wait {
        let start = |name: &str, queue: fn(&Shared) -> &Queue| {
            let shared = self.shared.clone();
            let builder = thread::Builder::new().name(name.into());
            builder.spawn(move || shared.work(queue(&shared)))
        };
        let start_both = || {
            let coarse = start("coarse samples", |shared| &shared.queue);
            let fine = start("fine samples", |shared| &shared.fine);
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

    /// A stored sample at a column and row of an image, in the file's order.
    pub(super) fn stored(&self, image: usize, column: u32, row: u32, wait: Wait) -> Stored {
        self.shared
            .sample(image, [column, row], self.possible(wait))
    }

    /// The height at a column and row of an image, in the file's order; `height` makes one of a stored
    /// value.
    pub(super) fn height(
        &self,
        image: usize,
        [column, row]: [u32; 2],
        wait: Wait,
        height: impl Fn(Option<f64>) -> f64,
    ) -> (f64, ReadStatus) {
        match self.stored(image, column, row, wait) {
            Ok(stored) => (height(stored), ReadStatus::Complete),
            Err(NotHere) => (f64::NAN, ReadStatus::Pending),
        }
    }

    /// Has blocks read in the background: those of the image that serves a level, between two
    /// columns and two rows of the full one.
    pub(super) fn prefetch_full(&self, level: u8, columns: [u32; 2], rows: [u32; 2]) {
        if self.possible(Wait::Never) == Wait::Never {
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
        let are_done = [&self.shared.queue, &self.shared.fine].map(|queue| queue.end(END_WITHIN));
        let threads = self.threads.take().flatten().into_iter().flatten();
        for (thread, is_done) in threads.zip(are_done) {
            if is_done {
                let _ = thread.join();
            }
        }
        let new = self.coarse().take_new();
        self.keep(new);
        if let Some(path) = self.path.get() {
            let (read, name) = (self.blocks_read(), without_key(path));
            tracing::debug!("{read} blocks of {name} were read");
        }
    }
}

impl Shared {
    /// Names the file in warnings.
    pub(super) fn set_path(&self, path: &Path) {
        // A second name of the same file is no better.
        let _ = self.path.set(path.to_owned());
    }

    /// Keeps no more than so many bytes of blocks, and counts `unread` blocks as warned of.
    pub(super) fn set_share(&self, most_bytes: usize, unread: u32) {
        *self.kept() = BlockState::new(most_bytes).after(unread);
    }

    /// Bytes that the blocks in memory take, and how many blocks could not be read.
    pub(super) fn share(&self) -> (usize, u32) {
        let kept = self.kept();
        (kept.cache.bytes(), kept.unread)
    }

    /// Number of blocks that were read from the file.
    pub(super) fn blocks_read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Blocks of the full image.
    pub(super) fn count(&self) -> u64 {
        let counts = self.images.first().map_or([0; 2], BlockImage::counts);
        counts.map(u64::from).iter().product()
    }

    /// Returns true if a block of the file is being read in the background, or is going to be.
    pub(super) fn is_reading(&self) -> bool {
        !self.fine.is_idle()
    }

    /// Returns the last error of the connection, if a block is missing.
    pub(super) fn take_outage(&self) -> Option<RasterError> {
        self.kept().outage.take()
    }

    fn kept(&self) -> MutexGuard<'_, BlockState> {
        // Nothing that panics runs while this is held.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn coarse(&self) -> MutexGuard<'_, Coarse> {
        // The same.
        self.coarse.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Type in which samples are held.
    pub(super) fn sample_type(&self) -> SampleType {
        self.reader.sample_type()
    }

    /// Bytes that samples in memory take at most, and what their reader keeps: beside the
    /// kept blocks there is one that is touched and one that is read in the background.
    pub(super) fn most_bytes(&self) -> usize {
        let samples = |image: &BlockImage| image.block.map(u64::from).iter().product::<u64>();
        let largest = self.reader.images().iter().map(samples).max();
        let block = largest.unwrap_or(0) * self.sample_type().bytes();
        let pieces = match self.images.len() > self.reader.images().len() {
            true => coarse::MAX_BYTES,
            false => 0,
        };
        let blocks = 2 * block.min(MAX_BLOCK_BYTES) as usize;
        cache::MAX_BYTES + blocks + pieces + self.reader.kept_bytes()
    }

    /// The image that serves a level of detail: the coarsest that is no coarser than it.
    pub(super) fn image_of(&self, level: u8) -> usize {
        let step = f64::from(level).exp2() * AS_COARSE;
        let serves = |image: &BlockImage| self.coarseness(image).iter().all(|times| *times <= step);
        self.images.iter().rposition(serves).unwrap_or(0)
    }

    /// The same among the full image and those with samples of their own: the samples of
    /// one that has every so many-th sample lie elsewhere than those of a field around it.
    pub(super) fn overview_of(&self, level: u8) -> usize {
        let image = self.image_of(level);
        let every = self.images.get(image).and_then(|image| image.every);
        if every.is_some() { 0 } else { image }
    }

    /// A stored sample at a column and row of an image, in the file's order.
    fn sample(&self, image: usize, [column, row]: [u32; 2], wait: Wait) -> Stored {
        if image >= self.reader.images().len() {
            return self.coarse_sample(image, [column, row], wait);
        }
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        let [across, down] = of.block;
        let Some(block) = self.block(image, [column / across, row / down], wait)? else {
            return Ok(None);
        };
        let columns = of.part([column / across, row / down]).columns as usize;
        let index = (row % down) as usize * columns + (column % across) as usize;
        Ok(block.stored(index))
    }

    /// A stored sample of an image that is made.
    fn coarse_sample(&self, image: usize, at: [u32; 2], wait: Wait) -> Stored {
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        let key = coarse::place(image, at).0;
        let mut found = self.coarse().sample(image, at);
        if found == (Found::Nothing { was_sought: false }) && self.disk.is_on() {
            if wait == Wait::Never {
                self.queue.want(Job::Seek(key));
                return Err(NotHere);
            }
            self.seek(key);
            found = self.coarse().sample(image, at);
        }
        if let Found::Value(value) = found {
            return Ok(Some(value));
        }
        let every = of.every.unwrap_or(1);
        let [column, row] = [0, 1].map(|axis| of.first[axis] + at[axis] * every);
        let full = &self.images[0];
        let block = [column / full.block[0], row / full.block[1]];
        let part = full.part(block);
        if !self.reader.is_stored(0, &part) {
            self.coarse().leave(&part, None, false);
            return Ok(None);
        }
        let is_here = self.kept().cache.get(&Key {
            image: 0,
            at: block,
        });
        if wait == Wait::UntilRead || is_here.is_some() {
            return self.sample(0, [column, row], wait);
        }
        self.queue.want(Job::Pass(block));
        Err(NotHere)
    }

    /// Columns and rows of an image.
    pub(super) fn size(&self, image: usize) -> [u32; 2] {
        let of = self.images.get(image);
        of.map_or([0; 2], |of| [of.columns, of.rows])
    }

    /// A height between the samples of an image, linear along rows and columns, at a place in columns
    /// and rows of the full one; every corner that counts must have a height. `read` returns the height
    /// at a column and row of the image, in the file's order.
    pub(super) fn between(
        &self,
        image: usize,
        [column, row]: [f64; 2],
        read: impl Fn([u32; 2]) -> (f64, ReadStatus),
    ) -> (f64, ReadStatus) {
        let Some(of) = self.images.get(image) else {
            return (f64::NAN, ReadStatus::Complete);
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
        let reads = ReadTracker::default();
        let height = bilinear::at(place, |column, row| reads.record(read([column, row])));
        (height, reads.status())
    }

    /// [`Blocks::prefetch_full`].
    fn prefetch_full(&self, level: u8, columns: [u32; 2], rows: [u32; 2]) {
        let image = self.image_of(level);
        let Some(of) = self.images.get(image) else {
            return;
        };
        let times = self.coarseness(of);
        // What lies between two samples follows from both.
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

    /// Samples of the full image in one of another, along rows and columns.
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
