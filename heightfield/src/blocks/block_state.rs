//! State of blocks without reading: those in memory, those that are not here yet, and errors.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::super::RasterError;
use super::cache::{Cache, Key};
use super::{Block, NotHere};

/// A block that was not here yet is looked for again after so long.
const AGAIN: Duration = Duration::from_millis(20);
/// Blocks that are known to be on their way, at most.
const MAX_AWAITED: usize = 1024;

/// State of the blocks of a file.
pub(super) struct BlockState {
    pub(super) cache: Cache,
    /// Blocks that could not be read.
    pub(super) unread: u32,
    /// Blocks that are not here yet, and when they were looked for.
    awaited: HashMap<Key, Instant>,
    /// Last error of the connection.
    pub(super) outage: Option<RasterError>,
}

impl BlockState {
    /// Nothing yet, and blocks of so many bytes at most.
    pub(super) fn new(most_bytes: usize) -> Self {
        Self {
            cache: Cache::new(most_bytes),
            unread: 0,
            awaited: HashMap::new(),
            outage: None,
        }
    }

    /// The same of a file of which so many blocks were warned of before.
    pub(super) fn after(self, unread: u32) -> Self {
        Self { unread, ..self }
    }

    /// Returns the state of a block: it is in memory, or it is not here yet, and was looked for a
    /// moment ago.
    pub(super) fn known(&mut self, key: &Key) -> Option<Result<Option<Arc<Block>>, NotHere>> {
        if let Some(block) = self.cache.get(key) {
            return Some(Ok(block));
        }
        let looked = self.awaited.get(key);
        looked.filter(|looked| looked.elapsed() < AGAIN)?;
        Some(Err(NotHere))
    }

    /// Keeps a block that was read; `None` where there is no sample.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.awaited.remove(&key);
        self.cache.put(key, block);
    }

    /// Remembers a block that is not here yet.
    pub(super) fn wait_for(&mut self, key: Key) {
        if self.awaited.len() >= MAX_AWAITED {
            self.awaited.clear();
        }
        self.awaited.insert(key, Instant::now());
    }

    /// Counts a block that could not be read, and says how many there are.
    pub(super) fn count_unread(&mut self) -> u32 {
        self.unread = self.unread.saturating_add(1);
        self.unread
    }
}
