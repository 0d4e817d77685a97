//! Stamp of a file: distinguishes it from others, and from itself in another state.

use std::fs::Metadata;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// A file that was written so short a time ago may be written again without its times
/// telling: systems count them in steps.
const SETTLED: Duration = Duration::from_secs(2);

/// A file on disk in one state: its path, size, times and, where the system has them, its
/// numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileStamp {
    text: String,
    modified: Option<SystemTime>,
}

impl FileStamp {
    /// Of a file with such metadata.
    pub(crate) fn of(path: &Path, metadata: &Metadata) -> Self {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let modified = metadata.modified().ok();
        let numbers = numbers(metadata);
        let text = format!("{path:?} {} {modified:?} {numbers}", metadata.len());
        Self { text, modified }
    }

    /// Of what is at a path at present, where there is a file.
    pub(crate) fn at(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        Some(Self::of(path, &metadata))
    }

    /// Of a file that is known by some text in its state.
    #[cfg(feature = "remote")]
    pub(crate) const fn of_text(text: String) -> Self {
        Self {
            text,
            modified: Some(SystemTime::UNIX_EPOCH),
        }
    }

    /// In words, where the file was not written a moment ago.
    pub(crate) fn settled(&self) -> Option<&str> {
        let since = self.modified?.elapsed().ok()?;
        (since >= SETTLED).then_some(&*self.text)
    }
}

/// When the file's entry was changed, which no program sets, and where it is on which disk.
#[cfg(unix)]
fn numbers(metadata: &Metadata) -> String {
    use std::os::unix::fs::MetadataExt;
    let (seconds, nanoseconds) = (metadata.ctime(), metadata.ctime_nsec());
    let (device, number) = (metadata.dev(), metadata.ino());
    format!("{seconds}.{nanoseconds} {device} {number}")
}

/// When it was made.
#[cfg(not(unix))]
fn numbers(metadata: &Metadata) -> String {
    format!("{:?}", metadata.created().ok())
}
