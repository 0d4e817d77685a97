//! State of blocks, without reading: those in memory, pending ones, and errors.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::RasterError;
use super::cache::{Cache, Key};
use super::{Block, NotHere};

/// Time after which a pending block is tried again.
const AGAIN: Duration = Duration::from_millis(20);
/// Max pending blocks that are stored.
const MAX_AWAITED: usize = 1024;

/// State of the blocks of a file.
pub(super) struct BlockState {
    pub(super) cache: Cache,
    /// Blocks that could not be read.
    pub(super) unread: u32,
    /// Pending blocks, and when they were last tried.
    awaited: HashMap<Key, Instant>,
    /// Last error of the connection.
    pub(super) outage: Option<RasterError>,
}

impl BlockState {
    /// Returns an empty state with a max size of the cache, bytes.
    pub(super) fn new(max_bytes: usize) -> Self {
        Self {
            cache: Cache::new(max_bytes),
            unread: 0,
            awaited: HashMap::new(),
            outage: None,
        }
    }

    /// Sets the number of unreadable blocks that were reported before.
    pub(super) fn after(self, unread: u32) -> Self {
        Self { unread, ..self }
    }

    /// Returns the state of a block without reading: in memory, or pending and tried a moment ago.
    pub(super) fn known(&mut self, key: &Key) -> Option<Result<Option<Arc<Block>>, NotHere>> {
        if let Some(block) = self.cache.get(key) {
            return Some(Ok(block));
        }
        let looked = self.awaited.get(key);
        looked.filter(|looked| looked.elapsed() < AGAIN)?;
        Some(Err(NotHere))
    }

    /// Stores a block that was read; `None` if the file has no samples there.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.awaited.remove(&key);
        self.cache.put(key, block);
    }

    /// Marks a block as pending.
    pub(super) fn wait_for(&mut self, key: Key) {
        if self.awaited.len() >= MAX_AWAITED {
            self.awaited.clear();
        }
        self.awaited.insert(key, Instant::now());
    }

    /// Counts an unreadable block, and returns the count.
    pub(super) fn count_unread(&mut self) -> u32 {
        self.unread = self.unread.saturating_add(1);
        self.unread
    }
}
