//! Interface of a format that can read a part of an image without the rest.

use super::super::RasterError;
use super::super::samples::{HoleMask, SampleType, SampleValue, Samples, with_samples};
use super::survey::Looks;

/// Side of a usual block: where blocks of a file are smaller, several are read at once.
const USUAL_BLOCK: u32 = 256;

/// Reads parts of a file's images.
pub(crate) trait BlockReader: Send + Sync {
    /// Name of the format, in messages.
    fn format(&self) -> &'static str;

    /// The full image, and after it others of the same field, each coarser than the one
    /// before.
    fn images(&self) -> &[BlockImage];

    /// Type in which samples are held.
    fn sample_type(&self) -> SampleType;

    /// Returns true if the file stores samples there; where it does not, there is a hole.
    fn is_stored(&self, image: usize, part: &Part) -> bool;

    /// The samples of a part of an image, row after row.
    ///
    /// # Errors
    /// A fault of that part of the file.
    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError>;

    /// Sets the file's order before anything is read: coarse levels count their samples
    /// from the south and west.
    fn set_order(&mut self, south_up: bool, east_first: bool) {
        let _ = (south_up, east_first);
    }

    /// Announces the parts that are going to be read, one after the other: a remote part is
    /// fetched meanwhile.
    fn want(&self, image: usize, parts: &[Part]) {
        let _ = (image, parts);
    }

    /// A hash of the file's index: where each block is stored and in how many bytes.
    fn index(&self) -> u64;

    /// Returns the places that are read when the raster is opened; `None` for its coarsest image.
    fn looks(&self) -> Option<Looks> {
        None
    }

    /// Returns the stamp of the samples of a part, which names them in the disk cache: it differs
    /// for every other file, and for another state of the same file. `None` if that is unknown, or
    /// the file was written a moment ago; nothing is cached then.
    fn stamp(&self, image: usize, part: &Part) -> Option<String> {
        let _ = (image, part);
        None
    }

    /// Bytes that the reader itself keeps at most, besides the blocks that it hands over.
    fn kept_bytes(&self) -> usize {
        0
    }
}

/// An image that is read in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockImage {
    /// Samples a row.
    pub(crate) columns: u32,
    /// Rows.
    pub(crate) rows: u32,
    /// Columns and rows of a block; those at the east and south end are cut.
    pub(crate) block: [u32; 2],
    /// It has every so many-th sample of the full image, the first one first. Else its
    /// samples are the middles of its own cells, and its edges those of the full image.
    pub(crate) every: Option<u32>,
    /// Column and row of the full image where its first sample lies, where it has every so
    /// many-th.
    pub(crate) first: [u32; 2],
}

/// A rectangle of an image, in the file's order of columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Its first column.
    pub(crate) column: u32,
    /// Its first row.
    pub(crate) row: u32,
    /// Samples a row.
    pub(crate) columns: u32,
    /// Rows.
    pub(crate) rows: u32,
}

/// Samples of a part of an image.
#[derive(Debug)]
pub(crate) struct Block {
    /// Row after row.
    pub(crate) samples: Samples,
    /// Holes that no value marks.
    pub(crate) holes: Option<HoleMask>,
    /// True if some of its holes are there only because a part of the file could not be read.
    pub(crate) is_lacking: bool,
}

impl Block {
    /// A sample by its place in the block; `None` in a hole that no value marks.
    pub(crate) fn stored(&self, index: usize) -> Option<f64> {
        let hole = (self.holes.as_ref()).is_some_and(|mask| mask.contains(index));
        (!hole).then(|| with_samples!(&self.samples, values => values[index].widen()))
    }
}

impl Part {
    /// All of an image.
    pub(crate) const fn whole(columns: u32, rows: u32) -> Self {
        Self {
            column: 0,
            row: 0,
            columns,
            rows,
        }
    }

    /// Returns the intersection with another part, which must not be empty.
    pub(crate) fn within(&self, other: &Self) -> Self {
        let cut = |first: u32, count: u32, from: u32, most: u32| {
            let begin = first.max(from);
            (begin, (first + count).min(from + most) - begin)
        };
        let (column, columns) = cut(self.column, self.columns, other.column, other.columns);
        let (row, rows) = cut(self.row, self.rows, other.row, other.rows);
        Self {
            column,
            row,
            columns,
            rows,
        }
    }
}

impl BlockImage {
    /// Blocks from west to east and down.
    pub(crate) fn counts(&self) -> [u32; 2] {
        let [across, down] = self.block;
        [self.columns.div_ceil(across), self.rows.div_ceil(down)]
    }

    /// Returns the part that a block covers.
    pub(crate) fn part(&self, [across, down]: [u32; 2]) -> Part {
        let [column, row] = [across * self.block[0], down * self.block[1]];
        Part {
            column,
            row,
            columns: self.block[0].min(self.columns - column),
            rows: self.block[1].min(self.rows - row),
        }
    }
}

/// Columns and rows of a block: as few whole chunks as make a usual one.
pub(crate) fn usual_block([columns, rows]: [u32; 2]) -> [u32; 2] {
    let several = |chunk: u32| chunk.saturating_mul(USUAL_BLOCK.div_ceil(chunk));
    // Of wide chunks fewer rows make a usual block, and of high ones fewer columns.
    let filled = |chunk: u32, other: u32| {
        let usual = (USUAL_BLOCK * USUAL_BLOCK / other.clamp(1, USUAL_BLOCK * USUAL_BLOCK)).max(1);
        chunk.saturating_mul(usual.div_ceil(chunk))
    };
    match (columns > USUAL_BLOCK, rows > USUAL_BLOCK) {
        (true, true) => [columns, rows],
        (true, false) => [columns, filled(rows, columns)],
        (false, true) => [filled(columns, rows), rows],
        (false, false) => [several(columns), several(rows)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_as_few_chunks_as_make_a_usual_one() {
        assert_eq!(usual_block([256, 256]), [256, 256]);
        assert_eq!(usual_block([100, 300]), [300, 300]);
        assert_eq!(usual_block([1000, 1000]), [1000, 1000]);
        assert_eq!(usual_block([20_000, 1]), [20_000, 3]);
        assert_eq!(usual_block([1, 20_000]), [3, 20_000]);
        assert_eq!(usual_block([16, 12]), [256, 264]);
        assert_eq!(usual_block([32_768, 2]), [32_768, 2]);
        for columns in [1, 7, 255, 256, 257, 5000, 1 << 22] {
            for rows in [1, 7, 255, 256, 257, 5000, 1 << 22] {
                let samples = |[columns, rows]: [u32; 2]| u64::from(columns) * u64::from(rows);
                let block = samples(usual_block([columns, rows]));
                assert!(
                    block <= (1 << 18).max(4 * samples([columns, rows])),
                    "{columns} {rows}"
                );
            }
        }
    }
}
