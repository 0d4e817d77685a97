//! Interface of a format that can read a part of an image without the rest.

use super::super::RasterError;
use super::super::samples::{NoDataMask, SampleType, SampleValue, Samples, with_samples};
use super::survey::SurveyParts;

/// Side of a usual block: smaller blocks of a file are read several at once.
const USUAL_BLOCK: u32 = 256;

/// A source of parts of a file's images.
pub(crate) trait BlockReader: Send + Sync {
    /// Returns the name of the format, for messages.
    fn format(&self) -> &'static str;

    /// Returns the full image, followed by overviews of the same field, each coarser than the
    /// previous one.
    fn images(&self) -> &[BlockImage];

    /// Returns the type of the samples in memory.
    fn sample_type(&self) -> SampleType;

    /// Returns true if the file stores samples there; otherwise they are no-data.
    fn is_stored(&self, image: usize, part: &Part) -> bool;

    /// Reads the samples of a part of an image, row after row.
    ///
    /// # Errors
    /// A fault of that part of the file.
    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError>;

    /// Sets the file's order; call it before anything is read. Coarse levels count their samples
    /// from the south-west.
    fn set_order(&mut self, south_up: bool, east_first: bool) {
        let _ = (south_up, east_first);
    }

    /// Announces parts that will be read one after another, so that remote parts are prefetched.
    fn prefetch(&self, image: usize, parts: &[Part]) {
        let _ = (image, parts);
    }

    /// Returns a hash of the file's index: the offset and size of each block.
    fn index(&self) -> u64;

    /// Returns the parts that are read at opening; `None` for the coarsest image.
    fn survey_parts(&self) -> Option<SurveyParts> {
        None
    }

    /// Returns the stamp of the samples of a part, which names them in the disk cache. It differs
    /// between files, and between states of a file. `None`, and no caching, if the state is unknown
    /// or the file was written a moment ago.
    fn stamp(&self, image: usize, part: &Part) -> Option<String> {
        let _ = (image, part);
        None
    }

    /// Returns the reader's own max memory, bytes, without the blocks that it returns.
    fn max_memory_bytes(&self) -> usize {
        0
    }
}

/// An image that is read in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockImage {
    /// Samples per row.
    pub(crate) columns: u32,
    /// Rows.
    pub(crate) rows: u32,
    /// Columns and rows of a block; those at the east and south end are smaller.
    pub(crate) block: [u32; 2],
    /// Step, if the image is every `every`-th sample of the full image. Otherwise its samples are
    /// the middles of its own cells, and its edges are those of the full image.
    pub(crate) every: Option<u32>,
    /// Column and row of its first sample in the full image, if `every` is set.
    pub(crate) first: [u32; 2],
}

/// A rectangle of an image, in the file's order of columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Its first column.
    pub(crate) column: u32,
    /// Its first row.
    pub(crate) row: u32,
    /// Samples per row.
    pub(crate) columns: u32,
    /// Rows.
    pub(crate) rows: u32,
}

/// Samples of a part of an image.
#[derive(Debug)]
pub(crate) struct Block {
    /// Row after row.
    pub(crate) samples: Samples,
    /// No-data that no value marks.
    pub(crate) no_data_mask: Option<NoDataMask>,
    /// True if some samples are no-data only because a part of the file could not be read.
    pub(crate) is_incomplete: bool,
}

impl Block {
    /// Returns a sample by its index in the block; `None` for no-data that no value marks.
    pub(crate) fn stored(&self, index: usize) -> Option<f64> {
        let is_no_data = (self.no_data_mask.as_ref()).is_some_and(|mask| mask.contains(index));
        (!is_no_data).then(|| with_samples!(&self.samples, values => values[index].widen()))
    }
}

impl Part {
    /// Returns a whole image.
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
        let cut = |first: u32, count: u32, from: u32, max: u32| {
            let begin = first.max(from);
            (begin, (first + count).min(from + max) - begin)
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
    /// Returns the number of blocks across and down.
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

/// Returns the columns and rows of a block: the fewest whole chunks that make a usual block.
pub(crate) fn usual_block([columns, rows]: [u32; 2]) -> [u32; 2] {
    let several = |chunk: u32| chunk.saturating_mul(USUAL_BLOCK.div_ceil(chunk));
    // Wide chunks need fewer rows, high ones fewer columns.
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
    fn block_has_the_fewest_chunks_of_a_usual_block() {
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
