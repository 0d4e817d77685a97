//! The blocks that were touched last.

use std::sync::Arc;

use lru::LruCache;

use super::Block;

/// Blocks of a terrain are kept until they take more than this, bytes.
pub(super) const MAX_BYTES: usize = 64 << 20;
/// Memory of a hole, and of a block besides its samples, bytes: about.
const ENTRY_BYTES: usize = 128;

/// Names a block of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    /// The full image, 0, or an overview.
    pub(super) image: usize,
    /// Blocks to the west of it and above it.
    pub(super) at: [u32; 2],
}

/// Blocks by their place, the one touched longest ago the first to go.
pub(super) struct Cache {
    /// `None` where there is no sample.
    blocks: LruCache<Key, Option<Arc<Block>>>,
    bytes: usize,
    most_bytes: usize,
}

impl Cache {
    /// Nothing yet, and blocks of so many bytes at most.
    pub(super) fn new(most_bytes: usize) -> Self {
        Self {
            blocks: LruCache::unbounded(),
            bytes: 0,
            most_bytes,
        }
    }

    /// A block that is kept.
    pub(super) fn get(&mut self, key: &Key) -> Option<Option<Arc<Block>>> {
        self.blocks.get(key).cloned()
    }

    /// Returns true if a block is kept.
    pub(super) fn has(&self, key: &Key) -> bool {
        self.blocks.contains(key)
    }

    /// Bytes that all kept blocks take.
    pub(super) const fn bytes(&self) -> usize {
        self.bytes
    }

    /// Keeps a block, and lets others go until there is room.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.bytes += bytes(block.as_deref());
        if let Some((_, replaced)) = self.blocks.push(key, block) {
            self.bytes -= bytes(replaced.as_deref());
        }
        while self.bytes > self.most_bytes && self.blocks.len() > 1 {
            let Some((_, gone)) = self.blocks.pop_lru() else {
                return;
            };
            self.bytes -= bytes(gone.as_deref());
        }
    }
}

fn bytes(block: Option<&Block>) -> usize {
    let held = block.map_or(0, |block| {
        block.samples.bytes() + block.holes.as_ref().map_or(0, |holes| holes.len() / 8)
    });
    ENTRY_BYTES + held
}
