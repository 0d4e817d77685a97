//! Opens the files at a terrain's URLs, each once.

use std::fmt;
use std::io::{Error, ErrorKind, Result};
use std::num::NonZeroUsize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lru::LruCache;
use tokio::runtime::Runtime;

use super::file::RemoteFile;
use super::shared_pages::{SharedPages, background, spawn};
use super::store::Opened;
use super::url::without_credentials;
use super::{is_outage, store};
use crate::disk_cache::DiskCache;

/// Max stored files: open, missing or being opened.
const MAX_FILES: NonZeroUsize = NonZeroUsize::new(256).unwrap();
/// Time between attempts to open a file on a server that did not respond.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);

/// Files at URLs, open or being opened. Clones share them.
#[derive(Clone)]
pub struct RemoteFetcher(Arc<Shared>);

struct Shared {
    shared_pages: Arc<SharedPages>,
    files: Mutex<LruCache<String, FileState>>,
    opened: Condvar,
}

/// State of a URL.
#[derive(Clone)]
enum FileState {
    Opening,
    Open(Arc<RemoteFile>),
    /// Time and reason of the failure.
    Failed(Instant, ErrorKind, String),
}

impl Default for RemoteFetcher {
    fn default() -> Self {
        Self(Arc::new(Shared {
            shared_pages: Arc::default(),
            files: Mutex::new(LruCache::new(MAX_FILES)),
            opened: Condvar::new(),
        }))
    }
}

impl RemoteFetcher {
    /// Opens the file at a URL, once; missing files are not requested again.
    ///
    /// # Errors
    /// [`super::is_missing`], [`super::is_outage`], or the fault of the URL.
    pub(crate) fn open(&self, url: &str) -> Result<Arc<RemoteFile>> {
        let background = background()?;
        let mut has_waited = false;
        let mut files = self.files();
        loop {
            match files.get(url).cloned() {
                Some(FileState::Open(file)) => return Ok(file),
                Some(FileState::Opening) => {
                    has_waited = true;
                    let waited = self.0.opened.wait(files);
                    files = waited.unwrap_or_else(PoisonError::into_inner);
                }
                Some(FileState::Failed(at, kind, why)) => {
                    let error = Error::new(kind, why);
                    if !is_outage(&error) || has_waited || at.elapsed() < RETRY_INTERVAL {
                        return Err(error);
                    }
                    self.start_opening(background, &mut files, url);
                }
                None => self.start_opening(background, &mut files, url),
            }
        }
    }

    /// Starts opening files at new URLs, all at once; [`Self::open`] then waits for those being
    /// opened.
    pub(crate) fn prefetch_files(&self, urls: &[String]) {
        // Without a runtime, `open` returns the error.
        let Ok(background) = background() else {
            return;
        };
        let mut files = self.files();
        for url in urls {
            if !files.contains(url) {
                self.start_opening(background, &mut files, url);
            }
        }
    }

    /// Sets the folder for pages that later runs use; only the first call has an effect.
    pub(crate) fn set_disk_cache(&self, disk: &DiskCache) {
        self.0.shared_pages.set_disk_cache(disk);
    }

    /// Marks the terrain as open: from now on errors are logged.
    pub(crate) fn set_terrain_open(&self) {
        self.0.shared_pages.set_terrain_open();
    }

    fn files(&self) -> MutexGuard<'_, LruCache<String, FileState>> {
        // No code that panics runs while the lock is held.
        self.0.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn start_opening(
        &self,
        background: &'static Runtime,
        files: &mut LruCache<String, FileState>,
        url: &str,
    ) {
        files.put(url.to_owned(), FileState::Opening);
        let (shared_pages, target) = (self.0.shared_pages.clone(), url.to_owned());
        let work = async move {
            let _permit = shared_pages.request_permit().await;
            store::open(&target).await
        };
        let (this, url) = (self.clone(), url.to_owned());
        spawn(background, work, move |opened| {
            this.on_opened(background, url, opened);
        });
    }

    fn on_opened(&self, background: &'static Runtime, url: String, opened: Result<Opened>) {
        let state = match opened {
            Ok(opened) => {
                let file = RemoteFile::new(
                    &without_credentials(&url),
                    &self.0.shared_pages,
                    background,
                    opened,
                );
                FileState::Open(Arc::new(file))
            }
            Err(error) => FileState::Failed(Instant::now(), error.kind(), error.to_string()),
        };
        self.files().put(url, state);
        self.0.opened.notify_all();
    }
}

impl fmt::Debug for RemoteFetcher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RemoteFetcher")
    }
}
