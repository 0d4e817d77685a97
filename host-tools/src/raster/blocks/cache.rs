//! The blocks that were touched last.

use std::sync::Arc;

use lru::LruCache;

use super::Block;

/// Blocks are kept until they take more than this, bytes.
pub(super) const MOST_BYTES: usize = 64 << 20;
/// What a hole takes, and a block besides its samples, bytes: about.
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
}

impl Default for Cache {
    fn default() -> Self {
        Self {
            blocks: LruCache::unbounded(),
            bytes: 0,
        }
    }
}

impl Cache {
    /// A block that is kept.
    pub(super) fn get(&mut self, key: &Key) -> Option<Option<Arc<Block>>> {
        self.blocks.get(key).cloned()
    }

    /// Bytes that all kept blocks take.
    #[cfg(test)]
    pub(super) const fn bytes(&self) -> usize {
        self.bytes
    }

    /// Keeps a block, and lets others go until there is room.
    pub(super) fn put(&mut self, key: Key, block: Option<Arc<Block>>) {
        self.bytes += bytes(block.as_deref());
        if let Some((_, replaced)) = self.blocks.push(key, block) {
            self.bytes -= bytes(replaced.as_deref());
        }
        while self.bytes > MOST_BYTES && self.blocks.len() > 1 {
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
