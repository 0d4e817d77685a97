//! A file at a URL, whose last used pages are in memory.

use std::fmt;
use std::io::{Error, ErrorKind, Result};
use std::iter::once;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;

use super::pages;
use super::pages_on_disk::{PagesOnDisk, joined, missing};
use super::shared_pages::{FileFault, PageState, SharedPages, spawn};
use super::store::{Object, Opened};
use super::{LOST, OUTAGE, is_outage};
use crate::disk_cache::FileStamp;

/// Time before the next request after a failed one.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// Interval at which a page is requested again while too many are being fetched.
const PAGE_RETRY_INTERVAL: Duration = Duration::from_millis(20);

/// A file at a URL.
pub(crate) struct RemoteFile {
    name: String,
    number: u64,
    shared_pages: Arc<SharedPages>,
    background: &'static Runtime,
    object: Object,
    /// The whole file, if it is short or its server does not support ranges.
    whole: Option<Vec<u8>>,
    /// Its pages on disk, if they can be stored.
    disk_pages: Option<PagesOnDisk>,
}

impl RemoteFile {
    /// Returns a file that its server has confirmed.
    pub(super) fn new(
        name: &str,
        shared_pages: &Arc<SharedPages>,
        background: &'static Runtime,
        opened: Opened,
    ) -> Self {
        let number = shared_pages.number();
        let whole = opened.is_whole;
        if !whole {
            shared_pages
                .state()
                .pages
                .insert(number, 0..1, &opened.first);
        }
        let disk_pages = shared_pages.disk().zip(opened.object.stamp());
        let disk_pages =
            disk_pages.map(|(disk, stamp)| PagesOnDisk::new(disk, stamp, opened.object.len()));
        Self {
            disk_pages: disk_pages.filter(|_| !whole),
            name: name.to_owned(),
            number,
            shared_pages: shared_pages.clone(),
            background,
            object: opened.object,
            whole: whole.then_some(opened.first),
        }
    }

    /// Returns the max memory of all files, bytes.
    pub(crate) const fn max_memory_bytes() -> usize {
        pages::MAX_BYTES
    }

    /// Returns the number of bytes.
    pub(crate) fn len(&self) -> u64 {
        match &self.whole {
            Some(whole) => whole.len() as u64,
            None => self.object.len(),
        }
    }

    /// Returns the stamp of the file's state at opening; `None` if the server sends neither tag nor
    /// time.
    pub(crate) fn stamp(&self) -> Option<FileStamp> {
        self.object.stamp().map(FileStamp::of_text)
    }

    /// Prefetches bytes; does not wait.
    pub(crate) fn prefetch(self: &Arc<Self>, ranges: impl Iterator<Item = Range<u64>>) {
        if self.whole.is_some() {
            return;
        }
        for run in self.take_missing(ranges) {
            let (file, needed) = (self.clone(), run.clone());
            let work = async move { file.load(needed).await };
            let file = self.clone();
            spawn(self.background, work, move |result| {
                file.on_received(run, result);
            });
        }
    }

    /// Returns the pages of a run, from disk if they are stored there.
    async fn load(&self, run: Range<u64>) -> Result<Vec<u8>> {
        let Some(disk_pages) = &self.disk_pages else {
            return self.fetch(run).await;
        };
        let (disk, needed) = (disk_pages.clone(), run.clone());
        let found = self.background.spawn_blocking(move || disk.get(needed));
        let found = found.await.unwrap_or_default();
        if found.is_empty() {
            return self.fetch(run).await;
        }
        let Some(gap) = missing(&found) else {
            return Ok(joined(&found, &(0..0), &[]));
        };
        let pages = run.start + gap.start..run.start + gap.end;
        let bytes = self.fetch(pages.clone()).await?;
        let run = joined(&found, &gap, &bytes);
        let disk = disk_pages.clone();
        // Stored in the background, so that no reader waits.
        self.background
            .spawn_blocking(move || disk.put(pages, &bytes));
        Ok(run)
    }

    /// Fetches the pages of a run from the server.
    async fn fetch(&self, run: Range<u64>) -> Result<Vec<u8>> {
        let _permit = self.shared_pages.request_permit().await;
        self.object.get(pages::bytes(&run, self.len())).await
    }

    fn take_missing(&self, ranges: impl Iterator<Item = Range<u64>>) -> Vec<Range<u64>> {
        let mut state = self.shared_pages.state();
        let is_blocked = match state.faults.get(&self.number) {
            Some(FileFault::Outage(at, _)) => at.elapsed() < RETRY_INTERVAL,
            Some(FileFault::Lost(_)) => true,
            None => false,
        };
        if is_blocked {
            return vec![];
        }
        let pages = ranges.map(|range| pages::of(&range, self.len()));
        let runs = pages.flat_map(|pages| state.pages.take_missing(self.number, pages));
        runs.collect()
    }

    /// Reads bytes inside the file.
    ///
    /// # Errors
    /// [`is_outage`]; or the file has changed.
    pub(crate) fn read_at(self: &Arc<Self>, offset: u64, count: usize) -> Result<Vec<u8>> {
        let end = offset.checked_add(count as u64);
        let Some(end) = end.filter(|end| *end <= self.len()) else {
            return Err(ErrorKind::UnexpectedEof.into());
        };
        if let Some(whole) = &self.whole {
            return Ok(whole[offset as usize..end as usize].to_vec());
        }
        let needed = offset..end;
        self.prefetch(once(needed.clone()));
        let mut bytes = Vec::with_capacity(count);
        for number in pages::of(&needed, self.len()) {
            let page = self.page(number)?;
            let first = number * pages::PAGE;
            let from = offset.saturating_sub(first) as usize;
            let to = (end - first).min(page.len() as u64) as usize;
            bytes.extend_from_slice(&page[from..to]);
        }
        Ok(bytes)
    }

    /// Returns a page, and waits for it.
    fn page(self: &Arc<Self>, number: u64) -> Result<Arc<[u8]>> {
        let key = (self.number, number);
        let mut has_waited = false;
        loop {
            let mut state = self.shared_pages.state();
            if let Some(page) = state.pages.get(key) {
                return Ok(page);
            }
            match state.faults.get(&self.number) {
                Some(FileFault::Lost(why)) => return Err(Error::new(LOST, why.clone())),
                Some(FileFault::Outage(at, why))
                    if !state.pages.is_fetching(key)
                        && (has_waited || at.elapsed() < RETRY_INTERVAL) =>
                {
                    return Err(Error::new(OUTAGE, why.clone()));
                }
                _ => {}
            }
            if !state.pages.is_fetching(key) {
                drop(state);
                // Too many pages were being fetched, or it was dropped again.
                let first = number * pages::PAGE;
                self.prefetch(once(first..first + 1));
                state = self.shared_pages.state();
            }
            has_waited |= state.pages.is_fetching(key);
            if state.pages.get(key).is_none() {
                drop(
                    self.shared_pages
                        .received
                        .wait_timeout(state, PAGE_RETRY_INTERVAL),
                );
            }
        }
    }

    fn on_received(&self, run: Range<u64>, result: Result<Vec<u8>>) {
        let mut state = self.shared_pages.state();
        match result {
            Ok(bytes) => {
                state.pages.insert(self.number, run, &bytes);
                if let Some(FileFault::Outage(..)) = state.faults.get(&self.number) {
                    state.faults.remove(&self.number);
                    if self.shared_pages.is_terrain_open() {
                        tracing::warn!("{} can be read again", self.name);
                    }
                }
            }
            Err(why) => {
                state.pages.failed(self.number, run);
                self.record_fault(&mut state, &why);
            }
        }
        drop(state);
        self.shared_pages.received.notify_all();
    }

    /// Stores a fault, and logs it unless the caller reports it, as the thread that opens the
    /// terrain does.
    fn record_fault(&self, state: &mut PageState, why: &Error) {
        let name = &self.name;
        let fault = match is_outage(why) {
            true => FileFault::Outage(Instant::now(), why.to_string()),
            false => FileFault::Lost(why.to_string()),
        };
        let is_logged = self.shared_pages.is_terrain_open();
        match (state.faults.get(&self.number), &fault) {
            // This state is final.
            (Some(FileFault::Lost(_)), _) => return,
            (None, FileFault::Outage(..)) if is_logged => tracing::warn!(
                "{name} cannot be read at present; samples already read stay, the rest is retried: {why}"
            ),
            (_, FileFault::Lost(_)) if is_logged => {
                tracing::warn!("{name} is not read further; samples already read stay: {why}");
            }
            _ => {}
        }
        state.faults.insert(self.number, fault);
    }
}

impl Drop for RemoteFile {
    fn drop(&mut self) {
        // Its pages are dropped when others need the memory.
        self.shared_pages.state().faults.remove(&self.number);
    }
}

impl fmt::Debug for RemoteFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RemoteFile")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}
