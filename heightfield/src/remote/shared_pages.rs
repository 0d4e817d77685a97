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
const MAX_CONCURRENT_REQUESTS: usize = 16;

/// State shared by the files of a terrain.
pub(super) struct SharedPages {
    is_terrain_open: AtomicBool,
    requests: Semaphore,
    files: AtomicU64,
    state: Mutex<PageState>,
    /// Disk cache of pages for later runs.
    disk: OnceLock<DiskCache>,
    pub(super) received: Condvar,
}

/// Pages of all files in memory.
#[derive(Default)]
pub(super) struct PageState {
    pub(super) pages: Pages,
    /// Errors of files, by their numbers.
    pub(super) faults: HashMap<u64, FileFault>,
}

/// Fault of a file.
pub(super) enum FileFault {
    /// Time and reason of the last failed request; a retry may succeed.
    Outage(Instant, String),
    /// Reason why all further requests fail.
    Lost(String),
}

impl Default for SharedPages {
    fn default() -> Self {
        Self {
            is_terrain_open: AtomicBool::new(false),
            requests: Semaphore::new(MAX_CONCURRENT_REQUESTS),
            files: AtomicU64::new(0),
            state: Mutex::default(),
            disk: OnceLock::new(),
            received: Condvar::new(),
        }
    }
}

impl SharedPages {
    /// Returns a new file number.
    pub(super) fn number(&self) -> u64 {
        self.files.fetch_add(1, Ordering::Relaxed)
    }

    /// Returns the pages in memory.
    pub(super) fn state(&self) -> MutexGuard<'_, PageState> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
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
    pub(super) fn set_terrain_open(&self) {
        self.is_terrain_open.store(true, Ordering::Relaxed);
    }

    /// Returns true if the terrain is open.
    pub(super) fn is_terrain_open(&self) -> bool {
        self.is_terrain_open.load(Ordering::Relaxed)
    }

    /// Waits until there are fewer than `MAX_CONCURRENT_REQUESTS` requests.
    pub(super) async fn request_permit(&self) -> Option<SemaphorePermit<'_>> {
        self.requests.acquire().await.ok()
    }
}

/// Returns the runtime for requests, which exists as long as the program.
///
/// # Errors
/// If the system cannot start its thread.
pub(super) fn background() -> Result<&'static Runtime> {
    static BACKGROUND: OnceLock<std::result::Result<Runtime, String>> = OnceLock::new();
    let runtime = BACKGROUND.get_or_init(|| {
        let mut builder = Builder::new_multi_thread();
        let builder = builder.worker_threads(1).enable_all();
        let runtime = builder.thread_name("fetching").build();
        runtime.map_err(|error| error.to_string())
    });
    runtime.as_ref().map_err(|why| Error::other(why.clone()))
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
