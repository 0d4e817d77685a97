//! Reading of blocks from the file or from the disk cache, and the background threads' work.

use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

use super::super::decoder_panic::guarded;
use super::background::{Job, Queue};
use super::cache::Key;
use super::coarse::Piece;
use super::{Block, NotHere, Part, Shared, Wait, coarse_on_disk};
use crate::remote::without_key;

/// After this many warnings of unreadable blocks, one reports that there are more.
const WARNINGS: u32 = 8;
/// Remote blocks that are fetched while one is decoded in the background.
const AHEAD: usize = 16;

/// Max blocks of one prefetch.
const MAX_PREFETCHED: usize = 16;

/// Result of reading a part of an image.
pub(super) struct Read {
    /// `None` if the file has no samples there.
    pub(super) block: Option<Arc<Block>>,
    /// True if some samples are no-data only because something could not be read.
    is_lacking: bool,
}

impl Shared {
    /// Returns a block, read if it is not in memory; `None` if the file has no samples there.
    ///
    /// # Errors
    /// [`NotHere`] if it is not in memory and `wait` is [`Wait::Never`], or if it cannot be read at
    /// present.
    pub(super) fn block(
        &self,
        image: usize,
        at: [u32; 2],
        wait: Wait,
    ) -> Result<Option<Arc<Block>>, NotHere> {
        let key = Key { image, at };
        if let Some(known) = self.kept().known(&key) {
            return known;
        }
        let Some(of) = self.images.get(image) else {
            return Ok(None);
        };
        if wait == Wait::Never {
            let is_new = match coarse_on_disk::is_coarse(of) {
                true => self.queue.want(Job::Fetch(key)),
                false => self.fine.want_first(Job::Fetch(key)),
            };
            if is_new {
                // Blocks are decoded one after another, but fetched together.
                self.reader.want(image, &[of.part(at)]);
            }
            return Err(NotHere);
        }
        // Only decoders can panic while the lock is held, and their panics are caught.
        let turn = self.turn.lock();
        let _turn = turn.unwrap_or_else(PoisonError::into_inner);
        // The previous owner of the lock may have read it.
        if let Some(known) = self.kept().known(&key) {
            return known;
        }
        let fetched = self.fetch(key);
        match fetched {
            Ok(_) => self.keep_due(),
            Err(NotHere) => self.kept().wait_for(key),
        }
        fetched
    }

    /// Reads a block into the cache.
    fn fetch(&self, key: Key) -> Result<Option<Arc<Block>>, NotHere> {
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
            if let Some(kept_as) = before.filter(|_| !read.is_lacking)
                && name() == Some(kept_as)
            {
                let piece = coarse_on_disk::piece_of(read.block.as_deref(), samples);
                coarse_on_disk::keep(&self.disk, &kept_as, piece);
            }
            if key.image == 0 {
                self.leave(&part, &read);
            }
            read.block
        };
        self.kept().put(key, block.clone());
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
        let mut wanted = vec![];
        let kept = self.kept();
        for row in rows {
            for at in columns.clone().map(|column| [column, row]) {
                if !kept.cache.has(&Key { image, at }) {
                    wanted.push(at);
                }
            }
        }
        drop(kept);
        let parts: Vec<Part> = wanted.iter().map(|at| of.part(*at)).collect();
        self.reader.want(image, &parts);
        for at in wanted {
            self.fine.want_first(Job::Fetch(Key { image, at }));
        }
    }

    /// Stores the coarse samples of a block of the full image.
    fn leave(&self, part: &Part, read: &Read) {
        let mut coarse = self.coarse();
        coarse.leave(part, read.block.as_deref(), read.is_lacking);
    }

    /// Saves coarse samples on disk, periodically.
    fn keep_due(&self) {
        let due = self.coarse().take_due();
        self.keep(due);
    }

    /// Reads a part of an image; the block is `None` if the file has no samples there.
    ///
    /// # Errors
    /// [`NotHere`] after an error of the connection, which is stored.
    pub(super) fn read(&self, image: usize, part: &Part) -> Result<Read, NotHere> {
        if !self.reader.is_stored(image, part) {
            return Ok(Read {
                block: None,
                is_lacking: false,
            });
        }
        self.read.fetch_add(1, Ordering::Relaxed);
        let read = guarded(self.reader.format(), || self.reader.read(image, part));
        match read {
            Ok(block) => Ok(Read {
                is_lacking: block.is_lacking,
                block: Some(Arc::new(block)),
            }),
            Err(fault) if fault.is_of_the_line() => {
                self.kept().outage = Some(fault);
                Err(NotHere)
            }
            Err(fault) => {
                let unread = self.kept().count_unread();
                let name = (self.path.get()).map_or("the file".into(), |path| without_key(path));
                if unread <= WARNINGS {
                    tracing::warn!(
                        "columns {} to {}, rows {} to {} of {name} cannot be read and count as no data: {fault}",
                        part.column,
                        part.column + part.columns - 1,
                        part.row,
                        part.row + part.rows - 1
                    );
                } else if unread == WARNINGS + 1 {
                    tracing::warn!("more of {name} cannot be read and count as no data");
                }
                Ok(Read {
                    block: None,
                    is_lacking: true,
                })
            }
        }
    }

    /// Runs the jobs of a queue until it is closed.
    pub(super) fn work(&self, queue: &Queue) {
        loop {
            while let Some(job) = queue.next() {
                match job {
                    Job::Seek(key) => self.seek(key),
                    Job::Pass(at) => self.pass(at),
                    // A block that is still pending is requested again.
                    Job::Fetch(key) => {
                        if self.fetch(key).is_err() {
                            self.kept().wait_for(key);
                        }
                    }
                }
                queue.done(&job);
                self.keep_due();
            }
            if !queue.wait() {
                return;
            }
        }
    }

    /// Searches the disk for a piece of a computed image.
    pub(super) fn seek(&self, key: Key) {
        let name = coarse_on_disk::name(&*self.reader, &self.images[key.image], &key);
        let block = self.images[key.image].block;
        let samples = block[0] as usize * block[1] as usize;
        let found = name.and_then(|name| coarse_on_disk::load(&self.disk, &name, samples));
        self.coarse().sought(key, found.as_ref());
    }

    /// Decodes a block of the full image for its coarse samples, without caching it: a coarse tile
    /// needs more blocks than fit in memory.
    fn pass(&self, at: [u32; 2]) {
        let full = &self.images[0];
        let coming = self.queue.coming(AHEAD);
        let coming: Vec<Part> = coming.into_iter().map(|at| full.part(at)).collect();
        self.reader.want(0, &coming);
        let part = full.part(at);
        if let Ok(read) = self.read(0, &part) {
            self.leave(&part, &read);
        }
    }

    /// Saves pieces on disk, if the file is unchanged.
    pub(super) fn keep(&self, pieces: Vec<(Key, Piece)>) {
        for (key, piece) in pieces.into_iter().filter(|_| self.disk.is_on()) {
            if let Some(name) = coarse_on_disk::name(&*self.reader, &self.images[key.image], &key) {
                coarse_on_disk::keep(&self.disk, &name, piece);
            }
        }
    }
}
