//! Errors of GDAL and of this crate.

use std::path::PathBuf;

use crate::version::Version;

/// Reason why a raster cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// libgdal is not installed, or not found.
    #[error("no libgdal was found ({tried})")]
    NotFound {
        /// Last attempt, and the system's message.
        tried: String,
    },
    /// The library found cannot be used by this crate.
    #[error("{} is GDAL {version}: versions from {} are read", path.display(), Version::OLDEST)]
    Version {
        /// The library.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// The library found lacks a function of GDAL.
    #[error("{} is no complete libgdal: it lacks {function}", path.display())]
    Incomplete {
        /// The library.
        path: PathBuf,
        /// The first missing function.
        function: &'static str,
    },
    /// GDAL's message for a rejected request.
    #[error("GDAL: {0}")]
    Refused(String),
    /// A file that must not be opened, or that references one.
    #[error("{}: {why}", path.display())]
    NotOpened {
        /// The file.
        path: PathBuf,
        /// The reason.
        why: String,
    },
    /// GDAL takes too long to open a file.
    #[error("GDAL has not opened {} after {seconds} s", path.display())]
    Slow {
        /// The file.
        path: PathBuf,
        /// Time limit, s.
        seconds: u64,
    },
    /// An open option that the driver does not support.
    #[error("GDAL's driver {driver} has no open option {name} (it has: {available})")]
    OpenOption {
        /// The option.
        name: String,
        /// The driver.
        driver: String,
        /// The options that it supports.
        available: String,
    },
    /// A text for GDAL that contains a zero byte.
    #[error("{0:?} contains a zero byte, which GDAL's interface cannot carry")]
    ZeroByte(String),
    /// A part that the raster does not have.
    #[error("there is no {requested}: {available}")]
    NoSuchPart {
        /// The request.
        requested: String,
        /// The available ones.
        available: String,
    },
    /// A window or a buffer of the wrong size.
    #[error("a window of {window:?} does not fit: {why}")]
    Window {
        /// First column and row, columns and rows.
        window: [u32; 4],
        /// The reason.
        why: String,
    },
}

impl Error {
    /// Returns the commands that install libgdal, one line per system.
    #[must_use]
    pub const fn how_to_install() -> &'static str {
        "install GDAL: apt install gdal-bin (Debian, Ubuntu), dnf install gdal-libs (Fedora), \
         brew install gdal (macOS), conda install gdal, or OSGeo4W on Windows; \
         or name the library in the environment variable GDAL_LIBRARY"
    }
}
