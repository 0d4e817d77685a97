//! Coarse images of a file without overviews: every 8th, 64th and 512th sample of its full image,
//! as far as they were read.
//!
//! Every decoded block contributes its coarse samples. Each step is eight times the previous one,
//! so a tile of any level lies in 25 pieces at most, and all three images together have a sixtieth
//! of the samples.

use std::time::{Duration, Instant};

use fixedbitset::FixedBitSet;
use lru::LruCache;

use super::cache::Key;
use super::{Block, BlockImage, Part};

/// Distance of each image's samples, in samples of the full image. They are powers of two, so that
/// levels use samples of these images directly.
pub(super) const STEPS: [u32; 3] = [8, 64, 512];
/// Side of a piece, samples.
const PIECE_SIDE: u32 = 64;
const PIECE_SAMPLES: usize = (PIECE_SIDE * PIECE_SIDE) as usize;
/// Max pieces in memory: 17 MB.
const MAX_PIECES: usize = 512;
/// Time between two saves of all new samples: pieces grow block by block.
const SAVE_INTERVAL: Duration = Duration::from_secs(5);
/// Max memory of the pieces, bytes.
pub(super) const MAX_BYTES: usize = MAX_PIECES * PIECE_SAMPLES * (size_of::<f64>() + 1);

/// A square of samples of a coarse image, row after row; those beyond its edges are unknown.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    /// Stored values; NaN for no-data.
    pub(super) values: Vec<f64>,
    /// Marks the known samples.
    pub(super) known: FixedBitSet,
}

impl Piece {
    /// Returns a piece of unknown samples.
    pub(super) fn unknown(samples: usize) -> Self {
        Self {
            values: vec![f64::NAN; samples],
            known: FixedBitSet::with_capacity(samples),
        }
    }

    /// Copies samples from another piece that are unknown in this one.
    pub(super) fn join(&mut self, other: &Self) {
        for index in other.known.difference(&self.known) {
            self.values[index] = other.values[index];
        }
        self.known.union_with(&other.known);
    }

    fn set(&mut self, index: usize, value: f64) {
        self.values[index] = value;
        self.known.insert(index);
    }
}

/// A piece in memory.
struct CachedPiece {
    piece: Piece,
    /// Samples that count as no-data for now, because their block cannot be read.
    unreadable: FixedBitSet,
    /// True if the disk was searched for it.
    is_searched: bool,
    /// True if it has samples that are not on disk.
    is_unsaved: bool,
}

impl CachedPiece {
    fn empty() -> Self {
        Self {
            piece: Piece::unknown(PIECE_SAMPLES),
            unreadable: FixedBitSet::with_capacity(PIECE_SAMPLES),
            is_searched: false,
            is_unsaved: false,
        }
    }
}

/// State of a coarse sample.
#[derive(Debug, PartialEq)]
pub(super) enum SampleState {
    /// Its stored value; NaN for no-data.
    Value(f64),
    /// Unknown; `is_searched` is true if the disk was searched for its piece.
    Unknown { is_searched: bool },
}

/// The coarse images that are computed from one full image.
pub(super) struct Coarse {
    /// Number of the first coarse image among the file's images.
    first: usize,
    images: Vec<BlockImage>,
    pieces: LruCache<Key, CachedPiece>,
    /// Evicted pieces with samples that are not on disk.
    outgoing: Vec<(Key, Piece)>,
    /// Time of the last save of all new samples.
    last_save: Instant,
}

impl Coarse {
    /// Returns no coarse images.
    pub(super) fn none() -> Self {
        Self {
            first: 0,
            images: vec![],
            pieces: LruCache::unbounded(),
            outgoing: vec![],
            last_save: Instant::now(),
        }
    }

    /// Returns the coarse images of a file's only image, which may begin in the south or the east:
    /// levels count their samples from the south-west.
    pub(super) fn of(full: &BlockImage, south_up: bool, east_first: bool) -> Self {
        let image = |every: u32| {
            let last = [full.columns, full.rows].map(|count| count.max(1) - 1);
            let remainder = |last: u32, turned: bool| if turned { last % every } else { 0 };
            BlockImage {
                columns: last[0] / every + 1,
                rows: last[1] / every + 1,
                block: [PIECE_SIDE; 2],
                every: Some(every),
                first: [
                    remainder(last[0], east_first),
                    remainder(last[1], !south_up),
                ],
            }
        };
        let has_cells = |image: &BlockImage| image.columns > 1 && image.rows > 1;
        Self {
            first: 1,
            images: STEPS.map(image).into_iter().filter(has_cells).collect(),
            ..Self::none()
        }
    }

    /// Returns the images, each coarser than the previous one.
    pub(super) fn images(&self) -> &[BlockImage] {
        &self.images
    }

    /// Returns the state of a sample of an image.
    pub(super) fn sample(&mut self, image: usize, [column, row]: [u32; 2]) -> SampleState {
        let (key, index) = locate(image, [column, row]);
        match self.pieces.get(&key) {
            Some(cached) if cached.piece.known.contains(index) => {
                SampleState::Value(cached.piece.values[index])
            }
            Some(cached) if cached.unreadable.contains(index) => SampleState::Value(f64::NAN),
            Some(cached) => SampleState::Unknown {
                is_searched: cached.is_searched,
            },
            None => SampleState::Unknown { is_searched: false },
        }
    }

    /// Stores the coarse samples of a block of the full image; `None` if the file has no samples
    /// there.
    pub(super) fn add_block(&mut self, part: &Part, block: Option<&Block>, is_incomplete: bool) {
        let last = [part.column + (part.columns - 1), part.row + (part.rows - 1)];
        for number in 0..self.images.len() {
            let image = self.images[number];
            let every = image.every.unwrap_or(1);
            // Columns and rows of the coarse image in the part.
            let along = |axis: usize, from: u32, to: u32| {
                let first = image.first[axis];
                let begin = from.saturating_sub(first).div_ceil(every);
                let end = to.checked_sub(first).map_or(0, |to| to / every + 1);
                begin..end
            };
            for row in along(1, part.row, last[1]) {
                for column in along(0, part.column, last[0]) {
                    let at = |axis: usize, index: u32| image.first[axis] + index * every;
                    let inner = (at(1, row) - part.row) as usize * part.columns as usize
                        + (at(0, column) - part.column) as usize;
                    let value = block.and_then(|block| block.stored(inner));
                    let (key, index) = locate(self.first + number, [column, row]);
                    let cached = self.cached(key);
                    if is_incomplete {
                        cached.unreadable.insert(index);
                    } else if !cached.piece.known.contains(index) {
                        cached.piece.set(index, value.unwrap_or(f64::NAN));
                        cached.is_unsaved = true;
                    }
                }
            }
        }
    }

    /// Stores the result of the disk search for a piece.
    pub(super) fn add_loaded(&mut self, key: Key, found: Option<&Piece>) {
        let cached = self.cached(key);
        cached.is_searched = true;
        if let Some(found) = found.filter(|found| found.values.len() == PIECE_SAMPLES) {
            cached.piece.join(found);
        }
    }

    /// Returns the pieces to save now: evicted ones, and periodically copies of all with new
    /// samples, so that little is lost if the program is killed.
    pub(super) fn take_due(&mut self) -> Vec<(Key, Piece)> {
        match self.last_save.elapsed() >= SAVE_INTERVAL {
            true => self.take_unsaved(),
            false => std::mem::take(&mut self.outgoing),
        }
    }

    /// Returns all pieces with samples that are not on disk.
    pub(super) fn take_unsaved(&mut self) -> Vec<(Key, Piece)> {
        self.last_save = Instant::now();
        let mut taken = std::mem::take(&mut self.outgoing);
        for (key, cached) in &mut self.pieces {
            if std::mem::take(&mut cached.is_unsaved) {
                taken.push((*key, cached.piece.clone()));
            }
        }
        taken
    }

    /// Returns the number of pieces in memory.
    #[cfg(test)]
    pub(super) fn pieces(&self) -> usize {
        self.pieces.len()
    }

    fn cached(&mut self, key: Key) -> &mut CachedPiece {
        if !self.pieces.contains(&key) && self.pieces.len() >= MAX_PIECES {
            let evicted = self.pieces.pop_lru();
            if let Some((key, cached)) = evicted.filter(|(_, cached)| cached.is_unsaved) {
                // If the disk is too slow, older pieces are dropped in favour of new ones.
                if self.outgoing.len() >= MAX_PIECES / 2 {
                    self.outgoing.clear();
                }
                self.outgoing.push((key, cached.piece));
            }
        }
        self.pieces.get_or_insert_mut(key, CachedPiece::empty)
    }
}

/// Returns the piece that contains a sample of an image, and the sample's index there.
pub(super) fn locate(image: usize, [column, row]: [u32; 2]) -> (Key, usize) {
    let key = Key {
        image,
        at: [column / PIECE_SIDE, row / PIECE_SIDE],
    };
    (
        key,
        (row % PIECE_SIDE * PIECE_SIDE + column % PIECE_SIDE) as usize,
    )
}
