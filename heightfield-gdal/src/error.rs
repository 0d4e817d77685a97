//! Errors.

use std::path::PathBuf;

use crate::version::Version;

/// Reason for which a raster cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no libgdal on this machine, or not where it is looked for.
    #[error("no libgdal was found ({tried})")]
    NotFound {
        /// Last attempt, and the system's message.
        tried: String,
    },
    /// A library is there that this crate cannot use.
    #[error("{} is GDAL {version}: versions from {} are read", path.display(), Version::OLDEST)]
    Version {
        /// The library.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// A library is there that lacks a function of GDAL's.
    #[error("{} is no complete libgdal: it lacks {function}", path.display())]
    Incomplete {
        /// The library.
        path: PathBuf,
        /// The first function that it lacks.
        function: &'static str,
    },
    /// GDAL refuses, in its own words.
    #[error("GDAL: {0}")]
    Refused(String),
    /// A file that must not be opened, or that names one.
    #[error("{}: {why}", path.display())]
    NotOpened {
        /// The file.
        path: PathBuf,
        /// Returns its fault.
        why: String,
    },
    /// GDAL takes too long to open a file.
    #[error("GDAL has not opened {} after {seconds} s", path.display())]
    Slow {
        /// The file.
        path: PathBuf,
        /// Time for which it had.
        seconds: u64,
    },
    /// The driver does not know an open option.
    #[error("GDAL's driver {driver} has no open option {name} (it has: {known})")]
    OpenOption {
        /// The option.
        name: String,
        /// The driver.
        driver: String,
        /// Those that it has.
        known: String,
    },
    /// A text for GDAL has a zero byte in it.
    #[error("{0:?} contains a zero byte, which GDAL's interface cannot carry")]
    ZeroByte(String),
    /// A part of a raster that is not there.
    #[error("there is no {asked}: {there}")]
    NoSuchPart {
        /// The request.
        asked: String,
        /// The available ones.
        there: String,
    },
    /// A window or a buffer that does not fit.
    #[error("a window of {window:?} does not fit: {why}")]
    Window {
        /// First column and row, columns and rows.
        window: [u32; 4],
        /// The reason.
        why: String,
    },
}

impl Error {
    /// Returns the commands that install libgdal, one line a system.
    #[must_use]
    pub const fn how_to_install() -> &'static str {
        "install GDAL: apt install gdal-bin (Debian, Ubuntu), dnf install gdal-libs (Fedora), \
         brew install gdal (macOS), conda install gdal, or OSGeo4W on Windows; \
         or name the library in the environment variable GDAL_LIBRARY"
    }
}
