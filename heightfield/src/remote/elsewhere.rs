//! The files at URLs that a terrain is made of.

use std::fmt;
use std::io::{Error, ErrorKind, Result};
use std::num::NonZeroUsize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lru::LruCache;
use tokio::runtime::Runtime;

use super::file::RemoteFile;
use super::line::{Line, background, spawn};
use super::store::Opened;
use super::url::in_text;
use super::{is_outage, store};
use crate::disk_cache::DiskCache;

/// Files that are known at once: open, missing or on their way.
const MAX_FILES: NonZeroUsize = NonZeroUsize::new(256).unwrap();
/// A server that did not answer is asked again after so long, where nobody waits.
const BETWEEN_TRIES: Duration = Duration::from_secs(1);

/// Files at URLs, open or being opened. Clones are of the same.
#[derive(Clone)]
pub struct RemoteFetcher {
    shared: Arc<Shared>,
    /// Whoever has this clone waits, whatever the others do.
    always_waits: bool,
}

struct Shared {
    line: Arc<Line>,
    files: Mutex<LruCache<String, Known>>,
    answered: Condvar,
}

/// What is known of a URL.
#[derive(Clone)]
enum Known {
    OnItsWay,
    Open(Arc<RemoteFile>),
    /// Why not, and since when.
    Failed(Instant, ErrorKind, String),
}

impl Default for RemoteFetcher {
    fn default() -> Self {
        Self {
            shared: Arc::new(Shared {
                line: Arc::default(),
                files: Mutex::new(LruCache::new(MAX_FILES)),
                answered: Condvar::new(),
            }),
            always_waits: false,
        }
    }
}

impl RemoteFetcher {
    /// The same files for a thread that may wait.
    pub(crate) fn waiting(&self) -> Self {
        Self {
            always_waits: true,
            ..self.clone()
        }
    }

    /// The file at a URL. A file that is open is not opened again, and one that is missing
    /// is not looked for again.
    ///
    /// # Errors
    /// [`ErrorKind::WouldBlock`] where it is on its way and nobody may wait;
    /// [`super::is_missing`], [`super::is_outage`], or what is wrong with the URL.
    pub(crate) fn open(&self, url: &str) -> Result<Arc<RemoteFile>> {
        let background = background()?;
        let mut has_asked = false;
        let mut files = self.files();
        loop {
            let waits = self.always_waits || self.shared.line.waits();
            match files.get(url).cloned() {
                Some(Known::Open(file)) => return Ok(file),
                Some(Known::OnItsWay) if !waits => return Err(ErrorKind::WouldBlock.into()),
                Some(Known::OnItsWay) => {
                    has_asked = true;
                    let waited = self.shared.answered.wait(files);
                    files = waited.unwrap_or_else(PoisonError::into_inner);
                }
                Some(Known::Failed(at, kind, why)) => {
                    let error = Error::new(kind, why);
                    if !is_outage(&error) || waits && has_asked {
                        return Err(error);
                    }
                    if !waits && at.elapsed() < BETWEEN_TRIES {
                        return Err(ErrorKind::WouldBlock.into());
                    }
                    self.ask(background, &mut files, url);
                }
                None => self.ask(background, &mut files, url),
            }
        }
    }

    /// Asks for files at URLs that nothing is known of, all at once: [`Self::open`] of each then
    /// waits for what is on its way already.
    pub(crate) fn look_for(&self, urls: &[String]) {
        // Where there is no background, opening says why.
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

    /// From now on nobody waits, or everybody does again.
    pub(crate) fn stop_waiting(&self, stop: bool) {
        self.shared.line.stop_waiting(stop);
    }

    /// Has pages of files kept for another run; the first folder that is named counts.
    pub(crate) fn set_disk_cache(&self, disk: &DiskCache) {
        self.shared.line.set_disk_cache(disk);
    }

    /// The terrain is open: from now on what goes wrong is told.
    pub(crate) fn touch(&self) {
        self.shared.line.touch();
    }

    fn files(&self) -> MutexGuard<'_, LruCache<String, Known>> {
        // Nothing that panics runs while this is held.
        self.shared
            .files
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn ask(&self, background: &'static Runtime, files: &mut LruCache<String, Known>, url: &str) {
        files.put(url.to_owned(), Known::OnItsWay);
        let (line, asked) = (self.shared.line.clone(), url.to_owned());
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
                let file = RemoteFile::new(&in_text(&url), &self.shared.line, background, opened);
                Known::Open(Arc::new(file))
            }
            Err(error) => Known::Failed(Instant::now(), error.kind(), error.to_string()),
        };
        self.files().put(url, known);
        self.shared.answered.notify_all();
    }
}

impl fmt::Debug for RemoteFetcher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RemoteFetcher")
    }
}
