//! Unnamed files in the folder, which are deleted when their program ends.

use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{DiskCache, Folder};

/// Their total size is at most 1/`FREE_SHARE` of the free space.
const FREE_SHARE: u64 = 2;

/// A file without a name, with a max size.
pub(crate) struct TemporaryFile {
    pub(crate) file: File,
    bytes: u64,
    folder: Arc<Folder>,
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        self.folder.unnamed.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl DiskCache {
    /// Creates a file for `bytes`. It has no name, so it disappears however the program ends. It
    /// does not count towards the bound of the records.
    ///
    /// # Errors
    /// The cache is off, too little space is free, or the folder cannot be written.
    pub(crate) fn create_unnamed(&self, bytes: u64) -> Result<TemporaryFile> {
        let Some(folder) = &self.0 else {
            return Err(Error::other("nothing may be kept on disk (--cache off)"));
        };
        folder.create()?;
        // If the free space is unknown, the writes decide.
        let free = fs4::available_space(&folder.path).unwrap_or(u64::MAX);
        let file = tempfile::tempfile_in(&folder.path)?;
        // Space that is reserved but not yet filled is not free.
        let reserved = folder.unnamed.fetch_add(bytes, Ordering::Relaxed);
        let folder = folder.clone();
        let unnamed = TemporaryFile {
            file,
            bytes,
            folder,
        };
        if reserved.saturating_add(bytes) > free / FREE_SHARE {
            let [needed, free] = [bytes.div_ceil(1_000_000), free / 1_000_000];
            return Err(Error::new(
                ErrorKind::StorageFull,
                format!(
                    "{needed} MB are too many for the {free} MB that are free on the disk of --cache"
                ),
            ));
        }
        Ok(unnamed)
    }

    /// Returns the max size of all records, bytes; zero if the cache is off.
    pub(crate) fn max_bytes(&self) -> u64 {
        self.0.as_ref().map_or(0, |folder| folder.max_bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn unnamed_file_disappears_and_uses_half_the_free_space() {
        let folder = tempfile::tempdir().expect("a folder");
        let disk = DiskCache::at(folder.path(), 1);
        let mut first = disk.create_unnamed(1 << 20).expect("a file");
        first.file.write_all(&[1; 4096]).expect("written");
        let within = folder.path().join(super::super::VERSION);
        let names = || std::fs::read_dir(&within).expect("listed").count();
        if cfg!(unix) {
            assert_eq!(names(), 0, "it has a name");
        }
        drop(first);
        assert_eq!(names(), 0);
        let third = fs4::available_space(&within).expect("reported") / 3;
        let refused = |bytes: u64| disk.create_unnamed(bytes).err().map(|e| e.to_string());
        assert!(refused(2 * third).is_some_and(|why| why.contains("--cache")));
        assert_eq!(refused(third), None, "nothing is left of a refused file");
        let _one = disk.create_unnamed(third).expect("a third");
        assert!(refused(third).is_some(), "two thirds are more than half");
        let off = DiskCache::off().create_unnamed(1).err();
        assert!(off.is_some_and(|error| error.to_string().contains("--cache off")));
    }
}
