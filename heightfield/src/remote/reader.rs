//! Sequential reading of a remote file.

use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::iter::once;
use std::sync::Arc;

use super::RemoteFile;

/// Prefetched bytes: a sequential read waits once, not once per page.
const READ_AHEAD: u64 = 4 << 20;

/// Max bytes of a sequential read: the file size from a server may be wrong.
const MAX_SEQUENTIAL: u64 = 1 << 30;

/// A reader of a remote file from any offset.
pub(crate) struct RemoteReader {
    file: Arc<RemoteFile>,
    at: u64,
}

impl RemoteReader {
    /// Returns a reader at the first byte.
    pub(crate) const fn new(file: Arc<RemoteFile>) -> Self {
        Self { file, at: 0 }
    }
}

impl Read for RemoteReader {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let remaining = self.file.len().saturating_sub(self.at);
        let count = remaining.min(into.len() as u64) as usize;
        if count == 0 {
            return Ok(0);
        }
        if self.at >= MAX_SEQUENTIAL {
            let why = "it is larger than 1 GB, and its format is read as a whole";
            return Err(Error::new(ErrorKind::Unsupported, why));
        }
        // The caller may need only the first bytes.
        if self.at > 0 {
            self.file
                .prefetch(once(self.at..self.at.saturating_add(READ_AHEAD)));
        }
        let bytes = self.file.read_at(self.at, count)?;
        into[..count].copy_from_slice(&bytes);
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for RemoteReader {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let (from, by) = match to {
            SeekFrom::Start(at) => (at, 0),
            SeekFrom::Current(by) => (self.at, by),
            SeekFrom::End(by) => (self.file.len(), by),
        };
        let at = from.checked_add_signed(by);
        self.at = at.ok_or(std::io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}
