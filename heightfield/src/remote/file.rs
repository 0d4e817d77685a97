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
use super::shared_pages::{Held, SharedPages, Trouble, spawn};
use super::store::{Object, Opened};
use super::{LOST, OUTAGE, is_outage};
use crate::disk_cache::FileStamp;

/// Time before the next request after a failed one.
const BETWEEN_TRIES: Duration = Duration::from_secs(1);
/// Interval at which a page is requested again while too many are being fetched.
const LOOK: Duration = Duration::from_millis(20);

/// A file at a URL.
pub(crate) struct RemoteFile {
    name: String,
    number: u64,
    line: Arc<SharedPages>,
    background: &'static Runtime,
    object: Object,
    /// The whole file, if it is short or its server does not support ranges.
    all: Option<Vec<u8>>,
    /// Its pages on disk, if they can be stored.
    kept: Option<PagesOnDisk>,
}

impl RemoteFile {
    /// Returns a file that its server has confirmed.
    pub(super) fn new(
        name: &str,
        line: &Arc<SharedPages>,
        background: &'static Runtime,
        opened: Opened,
    ) -> Self {
        let number = line.number();
        let all = opened.is_all;
        if !all {
            line.held().pages.arrived(number, 0..1, &opened.first);
        }
        let kept = line.disk().zip(opened.object.stamp());
        let kept = kept.map(|(disk, stamp)| PagesOnDisk::new(disk, stamp, opened.object.len()));
        Self {
            kept: kept.filter(|_| !all),
            name: name.to_owned(),
            number,
            line: line.clone(),
            background,
            object: opened.object,
            all: all.then_some(opened.first),
        }
    }

    /// Returns the max memory of all files, bytes.
    pub(crate) const fn kept_bytes() -> usize {
        pages::MAX_BYTES
    }

    /// Returns the number of bytes.
    pub(crate) fn len(&self) -> u64 {
        match &self.all {
            Some(all) => all.len() as u64,
            None => self.object.len(),
        }
    }

    /// Returns the stamp of the file's state at opening; `None` if the server sends neither tag nor
    /// time.
    pub(crate) fn stamp(&self) -> Option<FileStamp> {
        self.object.stamp().map(FileStamp::of_text)
    }

    /// Prefetches bytes; does not wait.
    pub(crate) fn want(self: &Arc<Self>, ranges: impl Iterator<Item = Range<u64>>) {
        if self.all.is_some() {
            return;
        }
        for run in self.take_missing(ranges) {
            let (file, wanted) = (self.clone(), run.clone());
            let work = async move { file.brought(wanted).await };
            let file = self.clone();
            spawn(self.background, work, move |got| file.arrived(run, got));
        }
    }

    /// Returns the pages of a run, from disk if they are stored there.
    async fn brought(&self, run: Range<u64>) -> Result<Vec<u8>> {
        let Some(kept) = &self.kept else {
            return self.fetched(run).await;
        };
        let (disk, wanted) = (kept.clone(), run.clone());
        let found = self.background.spawn_blocking(move || disk.get(wanted));
        let found = found.await.unwrap_or_default();
        if found.is_empty() {
            return self.fetched(run).await;
        }
        let Some(gap) = missing(&found) else {
            return Ok(joined(&found, &(0..0), &[]));
        };
        let pages = run.start + gap.start..run.start + gap.end;
        let bytes = self.fetched(pages.clone()).await?;
        let run = joined(&found, &gap, &bytes);
        let disk = kept.clone();
        // Stored in the background, so that no reader waits.
        self.background
            .spawn_blocking(move || disk.put(pages, &bytes));
        Ok(run)
    }

    /// Fetches the pages of a run from the server.
    async fn fetched(&self, run: Range<u64>) -> Result<Vec<u8>> {
        let _turn = self.line.turn().await;
        self.object.get(pages::bytes(&run, self.len())).await
    }

    fn take_missing(&self, ranges: impl Iterator<Item = Range<u64>>) -> Vec<Range<u64>> {
        let mut held = self.line.held();
        let has_to_rest = match held.troubles.get(&self.number) {
            Some(Trouble::Outage(at, _)) => at.elapsed() < BETWEEN_TRIES,
            Some(Trouble::Lost(_)) => true,
            None => false,
        };
        if has_to_rest {
            return vec![];
        }
        let pages = ranges.map(|range| pages::of(&range, self.len()));
        let runs = pages.flat_map(|pages| held.pages.take_missing(self.number, pages));
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
        if let Some(all) = &self.all {
            return Ok(all[offset as usize..end as usize].to_vec());
        }
        let wanted = offset..end;
        self.want(once(wanted.clone()));
        let mut bytes = Vec::with_capacity(count);
        for number in pages::of(&wanted, self.len()) {
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
            let mut held = self.line.held();
            if let Some(page) = held.pages.get(key) {
                return Ok(page);
            }
            match held.troubles.get(&self.number) {
                Some(Trouble::Lost(why)) => return Err(Error::new(LOST, why.clone())),
                Some(Trouble::Outage(at, why))
                    if !held.pages.is_coming(key)
                        && (has_waited || at.elapsed() < BETWEEN_TRIES) =>
                {
                    return Err(Error::new(OUTAGE, why.clone()));
                }
                _ => {}
            }
            if !held.pages.is_coming(key) {
                drop(held);
                // Too many pages were being fetched, or it was dropped again.
                let first = number * pages::PAGE;
                self.want(once(first..first + 1));
                held = self.line.held();
            }
            has_waited |= held.pages.is_coming(key);
            if held.pages.get(key).is_none() {
                drop(self.line.arrived.wait_timeout(held, LOOK));
            }
        }
    }

    fn arrived(&self, run: Range<u64>, got: Result<Vec<u8>>) {
        let mut held = self.line.held();
        match got {
            Ok(bytes) => {
                held.pages.arrived(self.number, run, &bytes);
                if let Some(Trouble::Outage(..)) = held.troubles.get(&self.number) {
                    held.troubles.remove(&self.number);
                    if self.line.is_touched() {
                        tracing::warn!("{} can be read again", self.name);
                    }
                }
            }
            Err(why) => {
                held.pages.failed(self.number, run);
                self.note(&mut held, &why);
            }
        }
        drop(held);
        self.line.arrived.notify_all();
    }

    /// Stores a fault, and logs it unless the caller reports it, as the thread that opens the
    /// terrain does.
    fn note(&self, held: &mut Held, why: &Error) {
        let name = &self.name;
        let trouble = match is_outage(why) {
            true => Trouble::Outage(Instant::now(), why.to_string()),
            false => Trouble::Lost(why.to_string()),
        };
        let tells = self.line.is_touched();
        match (held.troubles.get(&self.number), &trouble) {
            // This state is final.
            (Some(Trouble::Lost(_)), _) => return,
            (None, Trouble::Outage(..)) if tells => tracing::warn!(
                "{name} cannot be read at present; what was read stays, the rest is asked for again and again: {why}"
            ),
            (_, Trouble::Lost(_)) if tells => {
                tracing::warn!("{name} is not read on; what was read stays: {why}");
            }
            _ => {}
        }
        held.troubles.insert(self.number, trouble);
    }
}

impl Drop for RemoteFile {
    fn drop(&mut self) {
        // Its pages are dropped when others need the memory.
        self.line.held().troubles.remove(&self.number);
    }
}

impl fmt::Debug for RemoteFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RemoteFile")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}
