//! State shared by all remote files of a terrain: the pages in memory, and the limit of concurrent
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

/// Max concurrent requests.
const AT_ONCE: usize = 16;

/// State shared by the files of a terrain.
pub(super) struct SharedPages {
    is_touched: AtomicBool,
    requests: Semaphore,
    files: AtomicU64,
    held: Mutex<Held>,
    /// Disk cache of pages for later runs.
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
    /// Time and reason of the last failed request; a retry may succeed.
    Outage(Instant, String),
    /// Reason why all further requests fail.
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
    /// Returns a new file number.
    pub(super) fn number(&self) -> u64 {
        self.files.fetch_add(1, Ordering::Relaxed)
    }

    /// Returns the pages in memory.
    pub(super) fn held(&self) -> MutexGuard<'_, Held> {
        // No code that panics runs while the lock is held.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the disk cache for later runs; only the first call has an effect.
    pub(super) fn set_disk_cache(&self, disk: &DiskCache) {
        let _ = self.disk.set(disk.clone());
    }

    /// Returns the disk cache of pages, if there is one.
    pub(super) fn disk(&self) -> Option<&DiskCache> {
        self.disk.get().filter(|disk| disk.is_on())
    }

    /// Marks the terrain as open: from now on errors are logged.
    pub(super) fn touch(&self) {
        self.is_touched.store(true, Ordering::Relaxed);
    }

    /// Returns true if the terrain is open.
    pub(super) fn is_touched(&self) -> bool {
        self.is_touched.load(Ordering::Relaxed)
    }

    /// Waits until there are fewer than `AT_ONCE` requests.
    pub(super) async fn turn(&self) -> Option<SemaphorePermit<'_>> {
        self.requests.acquire().await.ok()
    }
}

/// Returns the runtime for requests, which exists as long as the program.
///
/// # Errors
/// If the system cannot start its thread.
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

/// Runs `work` in the background, and calls `then` with its result, even after a panic.
pub(super) fn spawn<T: Send + 'static>(
    background: &'static Runtime,
    work: impl Future<Output = Result<T>> + Send + 'static,
    then: impl FnOnce(Result<T>) + Send + 'static,
) {
    let work = background.spawn(work);
    background.spawn(async move {
        // A panic in the library becomes an error.
        let done = work.await;
        then(done.unwrap_or_else(|error| Err(Error::new(OUTAGE, error.to_string()))));
    });
}
