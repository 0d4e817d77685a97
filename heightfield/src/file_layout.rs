//! The layout of a file's samples, for those who check it.

/// The layout of a file's samples, as far as its format tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileLayout {
    /// Bands, of which one holds the heights.
    pub bands: u32,
    /// Columns and rows of a strip, tile or block; `None` where rows follow each other.
    pub block: Option<[u32; 2]>,
    /// Columns and rows of its overviews, the finest first.
    pub overviews: Vec<[u32; 2]>,
    /// The meaning of a sample, where the file states it.
    pub samples_are: Option<SamplesAre>,
}

/// The meaning of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplesAre {
    /// The area of its cell.
    Areas,
    /// The point in the middle of its cell.
    Points,
}

impl Default for FileLayout {
    fn default() -> Self {
        Self {
            bands: 1,
            block: None,
            overviews: Vec::new(),
            samples_are: None,
        }
    }
}
