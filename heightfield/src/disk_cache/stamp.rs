//! Stamp of a file: differs between files, and between states of a file.

use std::fs::Metadata;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// Age below which a file may be written again without a change of its times, because file systems
/// round them.
const SETTLE_TIME: Duration = Duration::from_secs(2);

/// A file on disk in one state: its path, size, times and, if the system has them, its numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileStamp {
    text: String,
    modified: Option<SystemTime>,
}

impl FileStamp {
    /// Returns the stamp of a file with some metadata.
    pub(crate) fn of(path: &Path, metadata: &Metadata) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let modified = metadata.modified().ok();
        let numbers = numbers(metadata);
        let text = format!("{path:?} {} {modified:?} {numbers}", metadata.len());
        Self { text, modified }
    }

    /// Returns the stamp of the file at a path, if there is one.
    pub(crate) fn at(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        Some(Self::of(path, &metadata))
    }

    /// Returns the stamp of a file whose state a text identifies.
    #[cfg(feature = "remote")]
    pub(crate) const fn of_text(text: String) -> Self {
        Self {
            text,
            modified: Some(SystemTime::UNIX_EPOCH),
        }
    }

    /// Returns the stamp as text, unless the file was written a moment ago.
    pub(crate) fn stable_text(&self) -> Option<&str> {
        let since = self.modified?.elapsed().ok()?;
        (since >= SETTLE_TIME).then_some(&*self.text)
    }
}

/// Returns the change time, which programs cannot set, and the device and inode.
#[cfg(unix)]
fn numbers(metadata: &Metadata) -> String {
    use std::os::unix::fs::MetadataExt;
    let (seconds, nanoseconds) = (metadata.ctime(), metadata.ctime_nsec());
    let (device, number) = (metadata.dev(), metadata.ino());
    format!("{seconds}.{nanoseconds} {device} {number}")
}

/// Returns the creation time.
#[cfg(not(unix))]
fn numbers(metadata: &Metadata) -> String {
    format!("{:?}", metadata.created().ok())
}
