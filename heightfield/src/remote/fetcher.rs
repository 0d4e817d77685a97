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
use super::url::in_text;
use super::{is_outage, store};
use crate::disk_cache::DiskCache;

/// Max stored files: open, missing or being opened.
const MAX_FILES: NonZeroUsize = NonZeroUsize::new(256).unwrap();
/// Time between attempts to open a file on a server that did not respond.
const BETWEEN_TRIES: Duration = Duration::from_secs(1);

/// Files at URLs, open or being opened. Clones share them.
#[derive(Clone)]
pub struct RemoteFetcher(Arc<Shared>);

struct Shared {
    line: Arc<SharedPages>,
    files: Mutex<LruCache<String, Known>>,
    answered: Condvar,
}

/// State of a URL.
#[derive(Clone)]
enum Known {
    OnItsWay,
    Open(Arc<RemoteFile>),
    /// Time and reason of the failure.
    Failed(Instant, ErrorKind, String),
}

impl Default for RemoteFetcher {
    fn default() -> Self {
        Self(Arc::new(Shared {
            line: Arc::default(),
            files: Mutex::new(LruCache::new(MAX_FILES)),
            answered: Condvar::new(),
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
        let mut has_asked = false;
        let mut files = self.files();
        loop {
            match files.get(url).cloned() {
                Some(Known::Open(file)) => return Ok(file),
                Some(Known::OnItsWay) => {
                    has_asked = true;
                    let waited = self.0.answered.wait(files);
                    files = waited.unwrap_or_else(PoisonError::into_inner);
                }
                Some(Known::Failed(at, kind, why)) => {
                    let error = Error::new(kind, why);
                    if !is_outage(&error) || has_asked || at.elapsed() < BETWEEN_TRIES {
                        return Err(error);
                    }
                    self.ask(background, &mut files, url);
                }
                None => self.ask(background, &mut files, url),
            }
        }
    }

    /// Starts opening files at new URLs, all at once; [`Self::open`] then waits for those being
    /// opened.
    pub(crate) fn look_for(&self, urls: &[String]) {
        // Without a runtime, `open` returns the error.
        let Ok(background) = background() else {
            return;
        };
        let mut files = self.files();
        for url in urls {
            if !files.contains(url) {
                self.ask(background, &mut files, url);
            }
        }
    }

    /// Sets the folder for pages that later runs use; only the first call has an effect.
    pub(crate) fn set_disk_cache(&self, disk: &DiskCache) {
        self.0.line.set_disk_cache(disk);
    }

    /// Marks the terrain as open: from now on errors are logged.
    pub(crate) fn touch(&self) {
        self.0.line.touch();
    }

    fn files(&self) -> MutexGuard<'_, LruCache<String, Known>> {
        // No code that panics runs while the lock is held.
        self.0.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ask(&self, background: &'static Runtime, files: &mut LruCache<String, Known>, url: &str) {
        files.put(url.to_owned(), Known::OnItsWay);
        let (line, asked) = (self.0.line.clone(), url.to_owned());
        let work = async move {
            let _turn = line.turn().await;
            store::open(&asked).await
        };
        let (this, url) = (self.clone(), url.to_owned());
        spawn(background, work, move |opened| {
            this.answered(background, url, opened);
        });
    }

    fn answered(&self, background: &'static Runtime, url: String, opened: Result<Opened>) {
        let known = match opened {
            Ok(opened) => {
                let file = RemoteFile::new(&in_text(&url), &self.0.line, background, opened);
                Known::Open(Arc::new(file))
            }
            Err(error) => Known::Failed(Instant::now(), error.kind(), error.to_string()),
        };
        self.files().put(url, known);
        self.0.answered.notify_all();
    }
}

impl fmt::Debug for RemoteFetcher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RemoteFetcher")
    }
}
