//! Readers of terrain files: this program, and GDAL if a libgdal is installed. The same tests run
//! with both.

use std::path::Path;

use heightfield::{Error, OpenOptions, Raster, gdal};

/// A reader of terrain files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A reader of `hapterra` itself.
    Own,
    /// GDAL, for a file that `hapterra` also reads itself.
    Gdal,
}

impl Reader {
    /// Returns all readers on this machine; prints a message without GDAL.
    pub fn all() -> Vec<Self> {
        match gdal() {
            Ok(_) => vec![Self::Own, Self::Gdal],
            Err(why) => {
                eprintln!("skipped: GDAL as a second reader: {why}");
                vec![Self::Own]
            }
        }
    }

    /// Opens a file.
    ///
    /// # Errors
    /// Like [`Raster::open`].
    pub fn open(self, path: &Path, options: &OpenOptions) -> Result<Raster, Error> {
        match self {
            Self::Own => Raster::open(path, options),
            Self::Gdal => Raster::open_by_gdal(path, options),
        }
    }

    /// Returns true if it reads a file: GDAL reads no NumPy, and `hapterra` leaves rare formats to
    /// GDAL.
    #[must_use]
    pub fn supports(self, file: &str) -> bool {
        let foreign: &[&str] = match self {
            Self::Own => &[".zip", ".gz", ".npz", ".dat", ".dt0", ".dem", ".nc", ".grd"],
            Self::Gdal => &[".npy", ".npz", ".raw", "in_alpha.png"],
        };
        !foreign.iter().any(|end| file.ends_with(end))
    }
}
