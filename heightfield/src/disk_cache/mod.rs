//! The disk cache: results and downloads in a folder that has a bound and may
//! be deleted at any time.
//!
//! A record is one file. Its name is a hash of what it is about (`Name`): the file it was
//! made of and the state of that file, so what belongs to a file that was changed since is
//! never found. `record` says what is in it and checks it; `size_limit` deletes the records used
//! longest ago when all take more than the bound.
//!
//! A record appears when it is complete (it is renamed to its name), so that programs that
//! use the folder at once only ever see whole ones. Whatever is wrong with the folder is a
//! line in the log and no error: without it everything is worked out again. A folder in which
//! others may write is not used (`private`).
//!
//! `temporary_files` has files for one program's own use, which are no records.

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

/// Records of another form are in another folder.
const FORM: &str = "v1";
/// No record is larger than this, bytes.
const MAX_RECORD: usize = 1 << 20;
/// A record that is read is marked as used where that was done longer ago than this.
const USED_AGAIN: Duration = Duration::from_secs(3600);

/// A folder of records; clones are of the same. The default keeps nothing.
#[derive(Clone, Default)]
pub struct DiskCache(Option<Arc<Folder>>);

struct Folder {
    /// Of the records, in the folder that the user names.
    path: PathBuf,
    most_bytes: u64,
    /// Bytes that files without a name may take.
    unnamed: AtomicU64,
    /// Size of its content; `None` once it could not be written.
    room: Mutex<Option<SizeLimit>>,
    /// Set once a message has reported that it is not used.
    warned: OnceLock<()>,
}

impl DiskCache {
    /// Bytes that all records take at most unless the user states it, in units of 2²⁰.
    pub const MAX_MB: u32 = 1024;

    /// Keeps nothing.
    #[must_use]
    pub const fn off() -> Self {
        Self(None)
    }

    /// Keeps records of so many bytes at most in a folder, which need not exist; its other
    /// contents are left alone. No bytes: keeps nothing.
    #[must_use]
    pub fn at(folder: &Path, most_bytes: u64) -> Self {
        if most_bytes == 0 {
            return Self::off();
        }
        let path = folder.join(FORM);
        let room = Mutex::new(Some(SizeLimit::new(most_bytes)));
        Self(Some(Arc::new(Folder {
            path,
            most_bytes,
            unnamed: AtomicU64::new(0),
            room,
            warned: OnceLock::new(),
        })))
    }

    /// The folder where programs of this user keep what may be deleted, as
    /// `~/.cache/hapterra`; `None` where there is no such place.
    #[must_use]
    pub fn usual_folder() -> Option<PathBuf> {
        let strategy = choose_base_strategy().ok()?;
        Some(strategy.cache_dir().join("hapterra"))
    }

    /// Returns true if it keeps anything.
    pub(crate) const fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Returns the content of a record; `None` where there is none, or none that is complete.
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

    /// Keeps a record, in place of one of the same name, if it can.
    pub(crate) fn put(&self, name: &Name, bytes: &[u8]) {
        let Some(folder) = self.0.as_ref().filter(|_| bytes.len() <= MAX_RECORD) else {
            return;
        };
        // Nothing that panics runs while this is held.
        let mut room = folder.room.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(open) = room.as_mut() else {
            return;
        };
        if let Err(error) = folder.write(open, name, bytes) {
            let path = folder.path.display();
            tracing::debug!("nothing more is kept in {path}: {error}");
            *room = None;
        }
    }
}

impl Folder {
    /// Checks that it is the user's own, and warns once where it is not.
    ///
    /// # Errors
    /// There is none yet, or it is not used.
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

    /// Makes it, and checks that it is the user's own.
    ///
    /// # Errors
    /// It cannot be made, or is not used.
    fn make(&self) -> io::Result<()> {
        match self.check() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            checked => return checked,
        }
        private::make(&self.path)?;
        self.check()
    }

    fn write(&self, room: &mut SizeLimit, name: &Name, bytes: &[u8]) -> io::Result<()> {
        self.make()?;
        room.look(&self.path);
        let path = self.path.join(name.path());
        let parent = path.parent().unwrap_or(&self.path);
        private::make(parent)?;
        let record = record::made(name, bytes);
        let mut file = tempfile::Builder::new()
            .prefix(size_limit::UNFINISHED)
            .tempfile_in(parent)?;
        file.write_all(&record)?;
        file.persist(&path)?;
        room.add(&self.path, record.len() as u64);
        Ok(())
    }
}

fn read(path: &Path, name: &Name) -> io::Result<Vec<u8>> {
    let file = regular_file::open(path)?;
    let metadata = file.metadata()?;
    let most = (MAX_RECORD + record::HEAD) as u64;
    if metadata.len() > most {
        return Err(io::Error::other("it is no record"));
    }
    let mut bytes = Vec::new();
    (&file).take(most).read_to_end(&mut bytes)?;
    let held = record::held(name, bytes).ok_or_else(|| io::Error::other("it is damaged"))?;
    let used = metadata.modified().ok();
    let is_old = used.and_then(|used| used.elapsed().ok());
    if is_old.is_some_and(|since| since >= USED_AGAIN) {
        // Where that may not be written, it goes as if it had not been used.
        let _ = file.set_modified(SystemTime::now());
    }
    Ok(held)
}

impl fmt::Debug for DiskCache {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.0.as_ref().map(|folder| &folder.path);
        f.debug_tuple("DiskCache").field(&path).finish()
    }
}
