//! The disk cache: results and downloads in a folder of bounded size, which may be deleted at any
//! time.
//!
//! A record is one file. Its name (`Name`) is a hash of the source file and its state, so records
//! of an older state are never found. `record` defines and checks a record's content; `size_limit`
//! deletes the least recently used records when their total size exceeds the bound.
//!
//! A record is written under another name and then renamed, so that programs that share the folder
//! see only complete records. Errors of the folder are logged, not returned: without the cache,
//! results are computed again. A folder in which other users may write is not used (`private`).
//!
//! `temporary_files` has files for one program's own use, which are not records.

mod name;
mod private;
mod record;
mod size_limit;
mod stamp;
mod temporary_files;
#[cfg(test)]
mod tests;

use std::fmt;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, SystemTime};

use etcetera::{BaseStrategy, choose_base_strategy};

pub(crate) use name::Name;
use size_limit::SizeLimit;
pub(crate) use stamp::FileStamp;
pub(crate) use temporary_files::TemporaryFile;

use crate::regular_file;

/// Version of the record format, and the name of its folder.
const VERSION: &str = "v1";
/// Max size of a record, bytes.
const MAX_RECORD: usize = 1 << 20;
/// Time after which a read marks a record as used again.
const MARK_USED_AFTER: Duration = Duration::from_secs(3600);

/// A folder of records; clones share it. The default stores nothing.
#[derive(Clone, Default)]
pub struct DiskCache(Option<Arc<Folder>>);

struct Folder {
    /// Folder of the records, inside the user's folder.
    path: PathBuf,
    max_bytes: u64,
    /// Size reserved for unnamed files, bytes.
    unnamed: AtomicU64,
    /// Size of its content; `None` after a failed write.
    size_limit: Mutex<Option<SizeLimit>>,
    /// Set after the warning that the folder is not used.
    warned: OnceLock<()>,
}

impl DiskCache {
    /// Default of the max size of all records, in units of 2²⁰ bytes.
    pub const MAX_MB: u32 = 1024;

    /// Returns a cache that stores nothing.
    #[must_use]
    pub const fn off() -> Self {
        Self(None)
    }

    /// Returns a cache of at most `max_bytes` in a folder, which is created if needed; other
    /// contents of the folder are not touched. With zero bytes, nothing is stored.
    #[must_use]
    pub fn at(folder: &Path, max_bytes: u64) -> Self {
        if max_bytes == 0 {
            return Self::off();
        }
        let path = folder.join(VERSION);
        let size_limit = Mutex::new(Some(SizeLimit::new(max_bytes)));
        Self(Some(Arc::new(Folder {
            path,
            max_bytes,
            unnamed: AtomicU64::new(0),
            size_limit,
            warned: OnceLock::new(),
        })))
    }

    /// Returns the folder for this user's caches, as `~/.cache/hapterra`; `None` if the system has
    /// none.
    #[must_use]
    pub fn usual_folder() -> Option<PathBuf> {
        let strategy = choose_base_strategy().ok()?;
        Some(strategy.cache_dir().join("hapterra"))
    }

    /// Returns true if it stores records.
    pub(crate) const fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Returns the content of a record; `None` if it is missing or incomplete.
    pub(crate) fn get(&self, name: &Name) -> Option<Vec<u8>> {
        let folder = self.0.as_ref()?;
        let path = folder.path.join(name.path());
        match folder.check().and_then(|()| read(&path, name)) {
            Ok(bytes) => Some(bytes),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => {
                tracing::debug!("{} is not used: {error}", path.display());
                None
            }
        }
    }

    /// Stores a record, and replaces one of the same name. Errors are logged.
    pub(crate) fn put(&self, name: &Name, bytes: &[u8]) {
        let Some(folder) = self.0.as_ref().filter(|_| bytes.len() <= MAX_RECORD) else {
            return;
        };
        // No code that panics runs while the lock is held.
        let mut size_limit = folder
            .size_limit
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let Some(open) = size_limit.as_mut() else {
            return;
        };
        if let Err(error) = folder.write(open, name, bytes) {
            let path = folder.path.display();
            tracing::debug!("nothing more is stored in {path}: {error}");
            *size_limit = None;
        }
    }
}

impl Folder {
    /// Checks that the folder is the user's own, and warns once if it is not.
    ///
    /// # Errors
    /// It does not exist yet, or must not be used.
    fn check(&self) -> io::Result<()> {
        let above = self.path.parent().map_or(Ok(()), private::check);
        let checked = above.and_then(|()| private::check(&self.path));
        if let Err(error) = &checked
            && error.kind() == io::ErrorKind::Other
            && self.warned.set(()).is_ok()
        {
            tracing::warn!("nothing is kept on disk: {error}");
        }
        checked
    }

    /// Creates the folder, and checks that it is the user's own.
    ///
    /// # Errors
    /// It cannot be created, or must not be used.
    fn create(&self) -> io::Result<()> {
        match self.check() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            checked => return checked,
        }
        private::create(&self.path)?;
        self.check()
    }

    fn write(&self, size_limit: &mut SizeLimit, name: &Name, bytes: &[u8]) -> io::Result<()> {
        self.create()?;
        size_limit.scan_once(&self.path);
        let path = self.path.join(name.path());
        let parent = path.parent().unwrap_or(&self.path);
        private::create(parent)?;
        let record = record::encode(name, bytes);
        let mut file = tempfile::Builder::new()
            .prefix(size_limit::INCOMPLETE_PREFIX)
            .tempfile_in(parent)?;
        file.write_all(&record)?;
        file.persist(&path)?;
        size_limit.add(&self.path, record.len() as u64);
        Ok(())
    }
}

fn read(path: &Path, name: &Name) -> io::Result<Vec<u8>> {
    let file = regular_file::open(path)?;
    let metadata = file.metadata()?;
    let max = (MAX_RECORD + record::HEADER_BYTES) as u64;
    if metadata.len() > max {
        return Err(io::Error::other("it is no record"));
    }
    let mut bytes = Vec::new();
    (&file).take(max).read_to_end(&mut bytes)?;
    let content = record::decode(name, bytes).ok_or_else(|| io::Error::other("it is damaged"))?;
    let used = metadata.modified().ok();
    let is_old = used.and_then(|used| used.elapsed().ok());
    if is_old.is_some_and(|since| since >= MARK_USED_AFTER) {
        // If the time cannot be written, the record counts as unused.
        let _ = file.set_modified(SystemTime::now());
    }
    Ok(content)
}

impl fmt::Debug for DiskCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.0.as_ref().map(|folder| &folder.path);
        f.debug_tuple("DiskCache").field(&path).finish()
    }
}
