//! The open files of a terrain: a limited number, those used last.

use std::collections::{HashMap, HashSet};
use std::io::{Error, ErrorKind};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use lru::LruCache;

use super::super::decoder_panic::guarded;
use super::super::storage::Storage;
use super::super::{Decoded, OpenOptions, RasterError};
use super::source::{OpenFile, Source};
use super::tile_file;
use crate::remote::{is_url, without_key};

/// Max open files: each may have a mask and overviews beside it.
const MAX_OPEN: usize = 32;
/// Max memory of open files, bytes; the last used may exceed it alone.
const MAX_BYTES: usize = 64 << 20;
/// Part of it for one file's blocks, bytes.
const BLOCK_CACHE_BYTES: usize = 16 << 20;
/// Max size of a file that cannot be read in blocks, bytes.
const MAX_WHOLE_BYTES: u64 = 64 << 20;

/// Max time to open a file; after that, it is no-data.
const OPEN_TIMEOUT: Duration = Duration::from_secs(20);

/// Open files by their number among the terrain's.
pub(super) struct Pool {
    options: OpenOptions,
    open: LruCache<usize, Arc<OpenFile>>,
    /// Files that could not be read: each caused one warning, and is not tried again.
    failed: HashSet<usize>,
    /// Number of unreadable blocks of files that were closed since.
    unreadable: HashMap<usize, u32>,
}

impl Pool {
    pub(super) fn new(options: &OpenOptions) -> Self {
        Self {
            options: options_for_tiles(options),
            open: LruCache::unbounded(),
            failed: HashSet::new(),
            unreadable: HashMap::new(),
        }
    }

    /// Returns the max memory of all open files, bytes, with a newly decoded one.
    pub(super) const fn max_bytes() -> usize {
        MAX_BYTES + MAX_WHOLE_BYTES as usize
    }

    /// Opens a file, or returns the open one; `None`, with one warning, if it cannot be read.
    ///
    /// # Errors
    /// If it is remote and cannot be read at present.
    pub(super) fn get(
        &mut self,
        number: usize,
        source: &Source,
    ) -> Result<Option<Arc<OpenFile>>, RasterError> {
        if let Some(opened) = self.open.get(&number) {
            return Ok(Some(opened.clone()));
        }
        if self.failed.contains(&number) {
            return Ok(None);
        }
        match self.opened(number, source) {
            Ok(opened) => {
                let opened = Arc::new(opened);
                self.open.push(number, opened.clone());
                Ok(Some(opened))
            }
            Err(fault) if fault.is_connection_error() => {
                Err(RasterError::in_tile(&source.path, fault))
            }
            Err(fault) => {
                self.failed.insert(number);
                // A file without heights is acceptable among others.
                if !matches!(fault, RasterError::AllNoData { .. }) {
                    let path = without_key(&source.path);
                    tracing::warn!("{path} cannot be read and counts as no data: {fault}");
                }
                Ok(None)
            }
        }
    }

    /// Returns a file if it is open.
    pub(super) fn peek(&self, number: usize) -> Option<&OpenFile> {
        self.open.peek(&number).map(|opened| &**opened)
    }

    fn opened(&mut self, number: usize, source: &Source) -> Result<OpenFile, RasterError> {
        let options = self.options.clone();
        let stamps = source.stamps();
        let (path, by) = (source.path.clone(), options.clone());
        let outline = with_timeout(source, OPEN_TIMEOUT, move || tile_file::outline(&path, &by))?;
        let whole = whole_bytes(&outline)?;
        self.make_room(usize::try_from(whole).unwrap_or(usize::MAX));
        let (path, by) = (source.path.clone(), options.clone());
        let decode = move || guarded("terrain", || tile_file::decode(&path, &by));
        let mut decoded = with_timeout(source, OPEN_TIMEOUT, decode)?;
        let found = (decoded.columns, decoded.rows);
        let (columns, rows) = (source.covers.columns, source.covers.rows);
        if found != (columns, rows) {
            return Err(RasterError::damaged(format!(
                "it had {columns} × {rows} samples and now has {} × {}",
                found.0, found.1
            )));
        }
        decoded.resolve_no_data(options.no_data);
        if let Storage::Blocks(blocks) = &decoded.storage {
            blocks.set_path(&source.path);
            let unreadable = self.unreadable.get(&number).copied().unwrap_or_default();
            blocks.reset_cache(BLOCK_CACHE_BYTES, unreadable);
        }
        Ok(OpenFile::new(decoded, stamps))
    }

    /// Closes files until the others and `more` bytes are within bounds. The last one stays open
    /// even if it is too large.
    pub(super) fn make_room(&mut self, more: usize) {
        let bytes = |open: &LruCache<usize, Arc<OpenFile>>| {
            open.iter()
                .map(|(_, opened)| opened.cache_use().0)
                .sum::<usize>()
        };
        let min_open = usize::from(more == 0);
        while self.open.len() > min_open
            && (self.open.len() >= MAX_OPEN || bytes(&self.open).saturating_add(more) > MAX_BYTES)
        {
            let Some((number, closed)) = self.open.pop_lru() else {
                return;
            };
            let unreadable = closed.cache_use().1;
            if unreadable > 0 {
                self.unreadable.insert(number, unreadable);
            }
        }
    }

    /// Returns the number of open files.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.open.len()
    }
}

/// Returns the options for one file of many: it is read in blocks, if possible.
pub(super) fn options_for_tiles(options: &OpenOptions) -> OpenOptions {
    OpenOptions {
        max_in_memory_bytes: 0,
        ..options.clone()
    }
}

/// Opens a file in its own thread, which is abandoned after a time: a network disk may never
/// respond. Requests to servers have their own time-outs.
fn with_timeout<T: Send + 'static>(
    source: &Source,
    within: Duration,
    open: impl FnOnce() -> Result<T, RasterError> + Send + 'static,
) -> Result<T, RasterError> {
    if source.path.to_str().is_some_and(is_url) {
        return open();
    }
    let (send, opened) = sync_channel(1);
    let thread = Builder::new().name("opening".into());
    let spawned = thread.spawn(move || drop(send.send(open())));
    spawned.map_err(RasterError::Unreadable)?;
    opened.recv_timeout(within).unwrap_or_else(|_| {
        let why = format!("it was not open after {} s", within.as_secs());
        Err(RasterError::Unreadable(Error::new(
            ErrorKind::TimedOut,
            why,
        )))
    })
}

/// Returns the memory of a file that is stored whole, bytes; zero if it is read in blocks.
///
/// # Errors
/// [`RasterError::Unsupported`] if that is too large.
pub(super) fn whole_bytes(outline: &Decoded) -> Result<u64, RasterError> {
    let Storage::Memory { samples, .. } = &outline.storage else {
        return Ok(0);
    };
    let (columns, rows) = (outline.columns, outline.rows);
    let count = u64::from(columns) * u64::from(rows);
    match count.saturating_mul(samples.sample_type().bytes()) {
        bytes if bytes <= MAX_WHOLE_BYTES => Ok(bytes),
        _ => Err(RasterError::Unsupported {
            format: "a terrain of many files",
            feature: format!("a file of {columns} × {rows} samples that cannot be read in blocks"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::Part;

    /// Safety: 29.
    #[test]
    fn opening_is_abandoned_after_its_timeout() {
        let source = Source {
            path: "never.tif".into(),
            bytes: 1,
            covers: Part::whole(2, 2),
            turned: [false; 2],
        };
        let (sender, receiver) = sync_channel::<()>(0);
        let open = move || {
            let _ = receiver.recv();
            Ok(())
        };
        let fault = with_timeout(&source, Duration::ZERO, open).expect_err("never");
        assert!(fault.to_string().contains("not open after"), "{fault}");
        drop(sender);
    }
}
