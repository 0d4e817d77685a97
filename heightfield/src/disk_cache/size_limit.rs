//! Size of the records in a folder, and their removal.

use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Unit of disk space, bytes.
const DISK_UNIT: u64 = 4096;
/// Beginning of the name of an incomplete record.
pub(super) const INCOMPLETE_PREFIX: &str = ".new-";
/// Age at which an incomplete record counts as abandoned: writing is always faster.
const ABANDONED_AFTER: Duration = Duration::from_secs(3600);

/// Tracks the size of a folder.
pub(super) struct SizeLimit {
    max_bytes: u64,
    /// Size of all records at the last scan plus the writes since; `None` before the first scan.
    used: Option<u64>,
    written: u64,
}

struct Record {
    path: PathBuf,
    used: SystemTime,
    bytes: u64,
}

impl SizeLimit {
    pub(super) const fn new(max_bytes: u64) -> Self {
        Self {
            max_bytes,
            used: None,
            written: 0,
        }
    }

    /// Scans the folder, if that has not been done.
    pub(super) fn scan_once(&mut self, folder: &Path) {
        if self.used.is_none() {
            self.evict(folder);
        }
    }

    /// Counts a written record, and frees space if needed. The folder is scanned for other
    /// programs' records after writes of an eighth of the bound.
    pub(super) fn add(&mut self, folder: &Path, bytes: u64) {
        let bytes = bytes.next_multiple_of(DISK_UNIT);
        self.written += bytes;
        let used = self.used.get_or_insert(0);
        *used += bytes;
        if *used > self.max_bytes || self.written > self.max_bytes / 8 {
            self.evict(folder);
        }
    }

    /// Deletes the least recently used records until they fit in seven eighths of the bound, if
    /// they exceed the bound.
    fn evict(&mut self, folder: &Path) {
        let mut records = records(folder);
        let mut used: u64 = records.iter().map(|record| record.bytes).sum();
        if used > self.max_bytes {
            records.sort_by_key(|record| record.used);
            for record in &records {
                if used <= self.max_bytes - self.max_bytes / 8 {
                    break;
                }
                // If this fails, another program has already deleted it.
                let _ = fs::remove_file(&record.path);
                used -= record.bytes;
            }
        }
        (self.used, self.written) = (Some(used), 0);
    }
}

/// Returns the records of a folder, and ignores its other files.
fn records(folder: &Path) -> Vec<Record> {
    let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten();
    let is_hex = |entry: &DirEntry, digits: usize| {
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        name.len() == digits && name.iter().all(u8::is_ascii_hexdigit)
    };
    let mut found = vec![];
    for inner in entries(folder).filter(|entry| is_hex(entry, 2)) {
        for entry in entries(&inner.path()) {
            let Ok(metadata) = entry.metadata() else {
                continue;
            };
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if is_hex(&entry, 30) && metadata.is_file() {
                found.push(Record {
                    path: entry.path(),
                    used,
                    bytes: metadata.len().next_multiple_of(DISK_UNIT),
                });
            } else if is_abandoned(&entry, used) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
    found
}

fn is_abandoned(entry: &DirEntry, written: SystemTime) -> bool {
    let name = entry.file_name();
    let begins = name
        .as_encoded_bytes()
        .starts_with(INCOMPLETE_PREFIX.as_bytes());
    begins && written.elapsed().is_ok_and(|since| since > ABANDONED_AFTER)
}
