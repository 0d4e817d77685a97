//! Who reads a terrain file: this program, and GDAL in builds that have it. The same tests
//! hold for both.

use std::path::Path;

use hapterra::raster::{Error, OpenOptions, Raster};

/// A reader of terrain files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// What `hapterra` reads by itself.
    Own,
    /// GDAL, asked for a file that `hapterra` reads by itself.
    #[cfg(feature = "gdal")]
    Gdal,
}

impl Reader {
    /// All that this build has.
    pub const ALL: &[Self] = &[
        Self::Own,
        #[cfg(feature = "gdal")]
        Self::Gdal,
    ];

    /// Opens a file.
    ///
    /// # Errors
    /// As [`Raster::open`].
    pub fn open(self, path: &Path, options: &OpenOptions) -> Result<Raster, Error> {
        match self {
            Self::Own => Raster::open(path, options),
            #[cfg(feature = "gdal")]
            Self::Gdal => Raster::open_by_gdal(path, options),
        }
    }

    /// Whether a file is one of its own: GDAL does not look into archives, and knows no
    /// NumPy.
    #[must_use]
    pub fn knows(self, file: &str) -> bool {
        let foreign = [".zip", ".gz", ".npy", ".npz", ".raw", "in_alpha.png"];
        self == Self::Own || !foreign.iter().any(|end| file.ends_with(end))
    }
}
