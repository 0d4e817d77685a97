//! State that all remote files of a terrain share: the pages in memory, and the limit of concurrent
//! requests.

use std::collections::HashMap;
use std::io::{Error, Result};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Semaphore, SemaphorePermit};

use super::OUTAGE;
use super::pages::Pages;
use crate::disk_cache::DiskCache;

/// Requests under way at once.
const AT_ONCE: usize = 16;

/// Shared by the files of a terrain.
pub(super) struct SharedPages {
    is_touched: AtomicBool,
    requests: Semaphore,
    files: AtomicU64,
    held: Mutex<Held>,
    /// Place where pages are kept for another run.
    disk: OnceLock<DiskCache>,
    pub(super) arrived: Condvar,
}

/// Pages of all files in memory.
#[derive(Default)]
pub(super) struct Held {
    pub(super) pages: Pages,
    /// Errors of files, by their numbers.
    pub(super) troubles: HashMap<u64, Trouble>,
}

/// Fault of a file.
pub(super) enum Trouble {
    /// Its last request failed, then, and why; another may go well.
    Outage(Instant, String),
    /// Reason for which no request can go well any more.
    Lost(String),
}

impl Default for SharedPages {
    fn default() -> Self {
        Self {
            is_touched: AtomicBool::new(false),
            requests: Semaphore::new(AT_ONCE),
            files: AtomicU64::new(0),
            held: Mutex::default(),
            disk: OnceLock::new(),
            arrived: Condvar::new(),
        }
    }
}

impl SharedPages {
    /// A number for another file.
    pub(super) fn number(&self) -> u64 {
        self.files.fetch_add(1, Ordering::Relaxed)
    }

    /// Returns the pages in memory.
    pub(super) fn held(&self) -> MutexGuard<'_, Held> {
        // Nothing that panics runs while this is held.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has pages kept for another run; the first folder that is named counts.
    pub(super) fn set_disk_cache(&self, disk: &DiskCache) {
        let _ = self.disk.set(disk.clone());
    }

    /// Returns the disk cache of pages, if there is one.
    pub(super) fn disk(&self) -> Option<&DiskCache> {
        self.disk.get().filter(|disk| disk.is_on())
    }

    /// The terrain is open: from now on errors are reported.
    pub(super) fn touch(&self) {
        self.is_touched.store(true, Ordering::Relaxed);
    }

    /// Returns true if the terrain is open.
    pub(super) fn is_touched(&self) -> bool {
        self.is_touched.load(Ordering::Relaxed)
    }

    /// Waits until there are few enough requests under way.
    pub(super) async fn turn(&self) -> Option<SemaphorePermit<'_>> {
        self.requests.acquire().await.ok()
    }
}

/// Returns the runtime that fetches, for the whole program and its lifetime.
///
/// # Errors
/// If the system has no thread for it.
pub(super) fn background() -> Result<&'static Runtime> {
    static BACKGROUND: OnceLock<std::result::Result<Runtime, String>> = OnceLock::new();
    let made = BACKGROUND.get_or_init(|| {
        let mut builder = Builder::new_multi_thread();
        let builder = builder.worker_threads(1).enable_all();
        let made = builder.thread_name("fetching").build();
        made.map_err(|error| error.to_string())
    });
    made.as_ref().map_err(|why| Error::other(why.clone()))
}

/// Does something in the background, and `then` takes what came of it, in any case.
pub(super) fn spawn<T: Send + 'static>(
    background: &'static Runtime,
    work: impl Future<Output = Result<T>> + Send + 'static,
    then: impl FnOnce(Result<T>) + Send + 'static,
) {
    let work = background.spawn(work);
    background.spawn(async move {
        // A panic of the library's is an error like others.
        let done = work.await;
        then(done.unwrap_or_else(|error| Err(Error::new(OUTAGE, error.to_string()))));
    });
}
