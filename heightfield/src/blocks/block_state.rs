//! State of blocks, without reading: those in memory, pending ones, and errors.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::RasterError;
use super::cache::{Cache, Key};
use super::{Block, NotLoaded};

/// Time after which a pending block is tried again.
const RETRY_AFTER: Duration = Duration::from_millis(20);
/// Max pending blocks that are stored.
const MAX_PENDING: usize = 1024;

/// State of the blocks of a file.
pub(super) struct BlockState {
    pub(super) cache: Cache,
    /// Blocks that could not be read.
    pub(super) unreadable: u32,
    /// Pending blocks, and when they were last tried.
    pending: HashMap<Key, Instant>,
    /// Last error of the connection.
    pub(super) outage: Option<RasterError>,
    /// True if a block was missing in a read that waited, since the outage was last reported.
    pub(super) lacked_block: bool,
}

impl BlockState {
    /// Returns an empty state with a max size of the cache, bytes.
    pub(super) fn new(max_bytes: usize) -> Self {
        Self {
            cache: Cache::new(max_bytes),
            unreadable: 0,
            pending: HashMap::new(),
            outage: None,
            lacked_block: false,
        }
    }

    /// Sets the number of unreadable blocks that were reported before.
    pub(super) fn after(self, unreadable: u32) -> Self {
        Self { unreadable, ..self }
    }

    /// Returns the state of a block without reading: in memory, or pending and tried a moment ago.
    pub(super) fn get(&mut self, key: &Key) -> Option<Result<Option<Arc<Block>>, NotLoaded>> {
        if let Some(block) = self.cache.get(key) {
            return Some(Ok(block));
        }
        let tried = self.pending.get(key);
        tried.filter(|tried| tried.elapsed() < RETRY_AFTER)?;
        Some(Err(NotLoaded))
    }

    /// Stores a block that was read; `None` if the file has no samples there.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.pending.remove(&key);
        self.cache.put(key, block);
    }

    /// Marks a block as pending.
    pub(super) fn mark_pending(&mut self, key: Key) {
        if self.pending.len() >= MAX_PENDING {
            self.pending.clear();
        }
        self.pending.insert(key, Instant::now());
    }

    /// Counts an unreadable block, and returns the count.
    pub(super) fn count_unreadable(&mut self) -> u32 {
        self.unreadable = self.unreadable.saturating_add(1);
        self.unreadable
    }
}
