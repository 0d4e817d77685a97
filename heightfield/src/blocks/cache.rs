//! Cache of the blocks that were used last.

use std::sync::Arc;

use lru::LruCache;

use super::Block;

/// Max size of the cache, bytes.
pub(super) const MAX_BYTES: usize = 64 << 20;
/// Memory of an entry without its samples, bytes, roughly.
const ENTRY_BYTES: usize = 128;

/// Identifies a block of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    /// 0 for the full image, or the number of an overview.
    pub(super) image: usize,
    /// Number of blocks to the west of it and above it.
    pub(super) at: [u32; 2],
}

/// Blocks by key; the least recently used is dropped first.
pub(super) struct Cache {
    /// `None` if the file has no samples there.
    blocks: LruCache<Key, Option<Arc<Block>>>,
    bytes: usize,
    max_bytes: usize,
}

impl Cache {
    /// Returns an empty cache with a max size, bytes.
    pub(super) fn new(max_bytes: usize) -> Self {
        Self {
            blocks: LruCache::unbounded(),
            bytes: 0,
            max_bytes,
        }
    }

    /// Returns a cached block.
    pub(super) fn get(&mut self, key: &Key) -> Option<Option<Arc<Block>>> {
        self.blocks.get(key).cloned()
    }

    /// Returns true if a block is cached.
    pub(super) fn has(&self, key: &Key) -> bool {
        self.blocks.contains(key)
    }

    /// Returns the size of all cached blocks, bytes.
    pub(super) const fn bytes(&self) -> usize {
        self.bytes
    }

    /// Stores a block, and drops others until there is room.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.bytes += bytes(block.as_deref());
        if let Some((_, replaced)) = self.blocks.push(key, block) {
            self.bytes -= bytes(replaced.as_deref());
        }
        while self.bytes > self.max_bytes && self.blocks.len() > 1 {
            let Some((_, evicted)) = self.blocks.pop_lru() else {
                return;
            };
            self.bytes -= bytes(evicted.as_deref());
        }
    }
}

fn bytes(block: Option<&Block>) -> usize {
    let samples = block.map_or(0, |block| {
        block.samples.bytes()
            + block
                .no_data_mask
                .as_ref()
                .map_or(0, |no_data_mask| no_data_mask.len() / 8)
    });
    ENTRY_BYTES + samples
}
