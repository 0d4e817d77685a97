//! Who reads a terrain file: this program, and GDAL where there is a libgdal. The same tests hold
//! for both.

use std::path::Path;

use heightfield::{Error, OpenOptions, Raster, gdal};

/// A reader of terrain files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A format that `hapterra` reads by itself.
    Own,
    /// GDAL, asked for a file that `hapterra` reads by itself.
    Gdal,
}

impl Reader {
    /// All that this machine has; reports it where there is no GDAL.
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
    /// As [`Raster::open`].
    pub fn open(self, path: &Path, options: &OpenOptions) -> Result<Raster, Error> {
        match self {
            Self::Own => Raster::open(path, options),
            Self::Gdal => Raster::open_by_gdal(path, options),
        }
    }

    /// Returns true if it reads a file: GDAL reads no NumPy, and `hapterra` leaves to GDAL what is
    /// rare.
    #[must_use]
    pub fn knows(self, file: &str) -> bool {
        let foreign: &[&str] = match self {
            Self::Own => &[".zip", ".gz", ".npz", ".dat", ".dt0", ".dem", ".nc", ".grd"],
            Self::Gdal => &[".npy", ".npz", ".raw", "in_alpha.png"],
        };
        !foreign.iter().any(|end| file.ends_with(end))
    }
}
