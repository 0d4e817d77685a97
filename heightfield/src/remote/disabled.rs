//! Substitute for remote files in a build without them.

use std::io::{Error, ErrorKind, Result};
use std::ops::Range;
use std::sync::Arc;

use crate::disk_cache::{DiskCache, FileStamp};

/// A fetcher without files.
#[derive(Clone, Debug, Default)]
pub struct RemoteFetcher(());

/// Never exists.
#[derive(Debug)]
pub(crate) enum RemoteFile {}

impl RemoteFetcher {
    /// Always returns an error.
    pub(crate) fn open(&self, _: &str) -> Result<Arc<RemoteFile>> {
        Err(Error::new(
            ErrorKind::Unsupported,
            "this program was built without URLs",
        ))
    }

    /// Does nothing.
    pub(crate) fn prefetch_files(&self, _: &[String]) {}

    /// Does nothing.
    pub(crate) fn set_disk_cache(&self, _: &DiskCache) {}

    /// Does nothing.
    pub(crate) fn set_terrain_open(&self) {}
}

impl RemoteFile {
    pub(crate) const fn max_memory_bytes() -> usize {
        0
    }

    pub(crate) fn len(&self) -> u64 {
        match *self {}
    }

    pub(crate) fn stamp(&self) -> Option<FileStamp> {
        match *self {}
    }

    pub(crate) fn prefetch(&self, _: impl Iterator<Item = Range<u64>>) {
        match *self {}
    }

    pub(crate) fn read_at(&self, _: u64, _: usize) -> Result<Vec<u8>> {
        match *self {}
    }
}
