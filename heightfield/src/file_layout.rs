//! The layout of a file's samples, for checks of the file.

/// The layout of a file's samples, as far as its format states it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileLayout {
    /// Number of bands, one of which is the heights.
    pub bands: u32,
    /// Columns and rows of a strip, tile or block; `None` if the file stores row after row.
    pub block: Option<[u32; 2]>,
    /// Columns and rows of the overviews, the finest first.
    pub overviews: Vec<[u32; 2]>,
    /// The meaning of a sample, if the file states it.
    pub raster_type: Option<RasterType>,
}

/// The meaning of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RasterType {
    /// The area of its cell.
    Area,
    /// The point in the middle of its cell.
    Point,
}

impl Default for FileLayout {
    fn default() -> Self {
        Self {
            bands: 1,
            block: None,
            overviews: Vec::new(),
            raster_type: None,
        }
    }
}
