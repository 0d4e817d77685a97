//! Files that GDAL reads through its caller, as those at a server.
//!
//! GDAL opens them by the names that a [`Mount`](crate::Mount) has for them, and finds what they name beside
//! themselves in the same way. A VRT or an MRF among them may name nothing else: each one is looked at
//! before GDAL reads it.

use std::io;

/// Names of all files that GDAL reads through its caller begin so.
pub(crate) const PREFIX: &str = "/vsiheightfield/";

/// Files by names, as `folder/hills.vrt`.
pub trait FileSystem: Send + Sync {
    /// The file of a name, which is relative to the root and has no `.` or `..` in it.
    ///
    /// # Errors
    /// [`io::ErrorKind::NotFound`] and [`io::ErrorKind::PermissionDenied`] say that there is none;
    /// GDAL's callers get all other errors from [`Dataset::take_fault`](crate::Dataset::take_fault).
    fn open(&self, name: &str) -> io::Result<Box<dyn ReadAt>>;

    /// The last parts of the names of files that lie beside one and belong to it.
    ///
    /// # Errors
    /// The reason for which it is not known.
    fn beside(&self, name: &str) -> io::Result<Vec<String>>;

    /// Beginnings of absolute names, as `https://host/`, by which a VRT may name these files. One
    /// that contains another comes before it.
    fn roots(&self) -> &[String];
}

/// A file that is open.
pub trait ReadAt: Send {
    /// Its bytes.
    fn bytes(&self) -> u64;

    /// Bytes at a place, all of them inside the file.
    ///
    /// # Errors
    /// The reason for which they cannot be read.
    fn read_at(&self, at: u64, count: usize) -> io::Result<Vec<u8>>;
}
