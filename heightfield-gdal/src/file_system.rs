//! Files that GDAL reads through this crate's user, such as files on a server.
//!
//! GDAL opens them by names from a [`Mount`](crate::Mount), and finds the files that they reference
//! in the same way. A VRT or an MRF among them may reference no other files: each is checked before
//! GDAL reads it.

use std::io;

/// Prefix of the names of all such files.
pub(crate) const PREFIX: &str = "/vsiheightfield/";

/// Files by name, as `folder/hills.vrt`.
pub trait FileSystem: Send + Sync {
    /// Opens a file. The name is relative to the root, without `.` or `..`.
    ///
    /// # Errors
    /// [`io::ErrorKind::NotFound`] and [`io::ErrorKind::PermissionDenied`] mean that it does not
    /// exist; all other errors are returned by [`Dataset::take_fault`](crate::Dataset::take_fault).
    fn open(&self, name: &str) -> io::Result<Box<dyn ReadAt>>;

    /// Returns the names, without folders, of files beside a file that belong to it.
    ///
    /// # Errors
    /// The reason why they are unknown.
    fn neighbours(&self, name: &str) -> io::Result<Vec<String>>;

    /// Returns prefixes of absolute names, as `https://host/`, by which a VRT may reference these
    /// files. A prefix that contains another comes before it.
    fn roots(&self) -> &[String];
}

/// An open file.
pub trait ReadAt: Send {
    /// Returns its size, bytes.
    fn bytes(&self) -> u64;

    /// Reads bytes at an offset, inside the file.
    ///
    /// # Errors
    /// The reason why they cannot be read.
    fn read_at(&self, at: u64, count: usize) -> io::Result<Vec<u8>>;
}
