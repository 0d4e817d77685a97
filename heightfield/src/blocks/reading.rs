//! Reading of blocks from the file or from the disk cache, and the background threads' work.

use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

use super::super::decoder_panic::guarded;
use super::background::{Job, Queue};
use super::cache::Key;
use super::coarse::Piece;
use super::{Block, NotLoaded, Part, Shared, Wait, coarse_on_disk};
use crate::remote::without_key;

/// After this many warnings of unreadable blocks, one reports that there are more.
const WARNINGS: u32 = 8;
/// Remote blocks that are fetched while one is decoded in the background.
const MAX_CONCURRENT_FETCHES: usize = 16;

/// Max blocks of one prefetch.
const MAX_PREFETCHED: usize = 16;

/// Result of reading a part of an image.
pub(super) struct Read {
    /// `None` if the file has no samples there.
    pub(super) block: Option<Arc<Block>>,
    /// True if some samples are no-data only because something could not be read.
    is_incomplete: bool,
}

impl Shared {
    /// Returns a block, read if it is not in memory; `None` if the file has no samples there.
    ///
    /// # Errors
    /// [`NotLoaded`] if it is not in memory and `wait` is [`Wait::Never`], or if it cannot be read
    /// at present.
    pub(super) fn block(
        &self,
        image: usize,
        at: [u32; 2],
        wait: Wait,
    ) -> Result<Option<Arc<Block>>, NotLoaded> {
        let key = Key { image, at };
        if let Some(stored) = self.state().get(&key) {
            return stored;
        }
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        if wait == Wait::Never {
            let is_new = match coarse_on_disk::is_coarse(of) {
                true => self.coarse_queue.push_back(Job::Fetch(key)),
                false => self.fine_queue.push_front(Job::Fetch(key)),
            };
            if is_new {
                // Blocks are decoded one after another, but fetched together.
                self.reader.prefetch(image, &[of.part(at)]);
            }
            return Err(NotLoaded);
        }
        // Only decoders can panic while the lock is held, and their panics are caught.
        let guard = self.read_lock.lock();
        let _guard = guard.unwrap_or_else(PoisonError::into_inner);
        // The previous owner of the lock may have read it.
        if let Some(stored) = self.state().get(&key) {
            return stored;
        }
        let fetched = self.fetch(key);
        match fetched {
            Ok(_) => self.save_due(),
            Err(NotLoaded) => self.state().mark_pending(key),
        }
        fetched
    }

    /// Reads a block into the cache.
    fn fetch(&self, key: Key) -> Result<Option<Arc<Block>>, NotLoaded> {
        let Some(image) = self.images.get(key.image) else {
            return Ok(None);
        };
        let part = image.part(key.at);
        let samples = part.columns as usize * part.rows as usize;
        let name = || match self.disk.is_on() && coarse_on_disk::is_coarse(image) {
            true => coarse_on_disk::name(&*self.reader, image, &key),
            false => None,
        };
        let before = name();
        let found =
            (before.as_ref()).and_then(|name| coarse_on_disk::load(&self.disk, name, samples));
        let block = if let Some(block) = found.and_then(coarse_on_disk::block_of) {
            Some(Arc::new(block))
        } else {
            let read = self.read(key.image, &part)?;
            // If the file changed during the read, either state may have been read.
            if let Some(saved_as) = before.filter(|_| !read.is_incomplete)
                && name() == Some(saved_as)
            {
                let piece = coarse_on_disk::piece_of(read.block.as_deref(), samples);
                coarse_on_disk::save(&self.disk, &saved_as, piece);
            }
            if key.image == 0 {
                self.add_coarse_samples(&part, &read);
            }
            read.block
        };
        self.state().put(key, block.clone());
        Ok(block)
    }

    /// Queues reads of a part's blocks that are not in memory. Does not wait, and ignores a part of
    /// more than [`MAX_PREFETCHED`] blocks.
    pub(super) fn prefetch(&self, image: usize, part: &Part) {
        let Some(of) = self.images.get(image) else {
            return;
        };
        if image >= self.reader.images().len() || part.columns == 0 || part.rows == 0 {
            return;
        }
        let [across, down] = of.block;
        let columns = part.column / across..(part.column + (part.columns - 1)) / across + 1;
        let rows = part.row / down..(part.row + (part.rows - 1)) / down + 1;
        // A part that is too large would be too late anyway.
        if columns.len() * rows.len() > MAX_PREFETCHED {
            return;
        }
        let mut missing = vec![];
        let state = self.state();
        for row in rows {
            for at in columns.clone().map(|column| [column, row]) {
                if !state.cache.has(&Key { image, at }) {
                    missing.push(at);
                }
            }
        }
        drop(state);
        let parts: Vec<Part> = missing.iter().map(|at| of.part(*at)).collect();
        self.reader.prefetch(image, &parts);
        for at in missing {
            self.fine_queue.push_front(Job::Fetch(Key { image, at }));
        }
    }

    /// Stores the coarse samples of a block of the full image.
    fn add_coarse_samples(&self, part: &Part, read: &Read) {
        let mut coarse = self.coarse();
        coarse.add_block(part, read.block.as_deref(), read.is_incomplete);
    }

    /// Saves coarse samples on disk, periodically.
    fn save_due(&self) {
        let due = self.coarse().take_due();
        self.save(due);
    }

    /// Reads a part of an image; the block is `None` if the file has no samples there.
    ///
    /// # Errors
    /// [`NotLoaded`] after an error of the connection, which is stored.
    pub(super) fn read(&self, image: usize, part: &Part) -> Result<Read, NotLoaded> {
        if !self.reader.is_stored(image, part) {
            return Ok(Read {
                block: None,
                is_incomplete: false,
            });
        }
        self.blocks_read.fetch_add(1, Ordering::Relaxed);
        let read = guarded(self.reader.format(), || self.reader.read(image, part));
        match read {
            Ok(block) => Ok(Read {
                is_incomplete: block.is_incomplete,
                block: Some(Arc::new(block)),
            }),
            Err(fault) if fault.is_connection_error() => {
                self.state().outage = Some(fault);
                Err(NotLoaded)
            }
            Err(fault) => {
                let unreadable = self.state().count_unreadable();
                let name = (self.path.get()).map_or("the file".into(), |path| without_key(path));
                if unreadable <= WARNINGS {
                    tracing::warn!(
                        "columns {} to {}, rows {} to {} of {name} cannot be read and count as no data: {fault}",
                        part.column,
                        part.column + part.columns - 1,
                        part.row,
                        part.row + part.rows - 1
                    );
                } else if unreadable == WARNINGS + 1 {
                    tracing::warn!("more of {name} cannot be read and count as no data");
                }
                Ok(Read {
                    block: None,
                    is_incomplete: true,
                })
            }
        }
    }

    /// Runs the jobs of a queue until it is closed.
    pub(super) fn work(&self, queue: &Queue) {
        loop {
            while let Some(job) = queue.next() {
                match job {
                    Job::LoadPiece(key) => self.load_piece(key),
                    Job::Coarsen(at) => self.coarsen(at),
                    // A block that is still pending is requested again.
                    Job::Fetch(key) => {
                        if self.fetch(key).is_err() {
                            self.state().mark_pending(key);
                        }
                    }
                }
                queue.finish(&job);
                self.save_due();
            }
            if !queue.wait() {
                return;
            }
        }
    }

    /// Searches the disk for a piece of a computed image.
    pub(super) fn load_piece(&self, key: Key) {
        let name = coarse_on_disk::name(&*self.reader, &self.images[key.image], &key);
        let block = self.images[key.image].block;
        let samples = block[0] as usize * block[1] as usize;
        let found = name.and_then(|name| coarse_on_disk::load(&self.disk, &name, samples));
        self.coarse().add_loaded(key, found.as_ref());
    }

    /// Decodes a block of the full image for its coarse samples, without caching it: a coarse tile
    /// needs more blocks than fit in memory.
    fn coarsen(&self, at: [u32; 2]) {
        let full = &self.images[0];
        let upcoming = self.coarse_queue.next_blocks(MAX_CONCURRENT_FETCHES);
        let upcoming: Vec<Part> = upcoming.into_iter().map(|at| full.part(at)).collect();
        self.reader.prefetch(0, &upcoming);
        let part = full.part(at);
        if let Ok(read) = self.read(0, &part) {
            self.add_coarse_samples(&part, &read);
        }
    }

    /// Saves pieces on disk, if the file is unchanged.
    pub(super) fn save(&self, pieces: Vec<(Key, Piece)>) {
        for (key, piece) in pieces.into_iter().filter(|_| self.disk.is_on()) {
            if let Some(name) = coarse_on_disk::name(&*self.reader, &self.images[key.image], &key) {
                coarse_on_disk::save(&self.disk, &name, piece);
            }
        }
    }
}
