//! Files in the folder that belong to one program, have no name, and go with it.

use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{DiskCache, Folder};

/// All of them take no more than one of so many parts of what is free.
const PARTS: u64 = 2;

/// A file without a name, which may grow to so many bytes.
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
    /// A file for so many bytes. It has no name, so that nothing is left of it however the
    /// program ends. The bound of the records does not count it.
    ///
    /// # Errors
    /// The cache is off, too little space is free, or the folder cannot be written.
    pub(crate) fn file_without_name(&self, bytes: u64) -> Result<TemporaryFile> {
        let Some(folder) = &self.0 else {
            return Err(Error::other("nothing may be kept on disk (--cache off)"));
        };
        folder.make()?;
        // Where the system does not tell, the writing decides.
        let free = fs4::available_space(&folder.path).unwrap_or(u64::MAX);
        let file = tempfile::tempfile_in(&folder.path)?;
        // What others have not filled yet is not free for long.
        let before = folder.unnamed.fetch_add(bytes, Ordering::Relaxed);
        let folder = folder.clone();
        let unnamed = TemporaryFile {
            file,
            bytes,
            folder,
        };
        if before.saturating_add(bytes) > free / PARTS {
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

    /// Bytes that all records take at most; none where nothing is kept.
    pub(crate) fn most_bytes(&self) -> u64 {
        self.0.as_ref().map_or(0, |folder| folder.most_bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn unnamed_file_leaves_nothing_and_takes_half_the_free_space() {
        let folder = tempfile::tempdir().expect("a folder");
        let disk = DiskCache::at(folder.path(), 1);
        let mut first = disk.file_without_name(1 << 20).expect("a file");
        first.file.write_all(&[1; 4096]).expect("written");
        let within = folder.path().join(super::super::FORM);
        let names = || std::fs::read_dir(&within).expect("listed").count();
        if cfg!(unix) {
            assert_eq!(names(), 0, "it has a name");
        }
        drop(first);
        assert_eq!(names(), 0);
        let third = fs4::available_space(&within).expect("told") / 3;
        let refused = |bytes: u64| disk.file_without_name(bytes).err().map(|e| e.to_string());
        assert!(refused(2 * third).is_some_and(|why| why.contains("--cache")));
        assert_eq!(refused(third), None, "nothing is left of what was refused");
        let _one = disk.file_without_name(third).expect("a third");
        assert!(refused(third).is_some(), "two thirds are more than half");
        let off = DiskCache::off().file_without_name(1).err();
        assert!(off.is_some_and(|error| error.to_string().contains("--cache off")));
    }
}
