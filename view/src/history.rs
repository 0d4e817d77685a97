//! What a page that comes now has to be told, and the queues of the pages that are there.
//!
//! What stands still (terrain, tiles, layout) is kept once, by key: a later entry takes
//! the place of an earlier one. What happens in time is kept up to so many bytes, the
//! oldest forgotten first. Nothing else grows, however long a session lasts.
//!
//! A page whose queue is full is cut off, so that neither this program nor another page
//! waits for it. It comes back by itself and is told the present state.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use anyhow::{Context as _, Result};
use re_build_info::CrateVersion;
use re_log_encoding::{Encoder, EncodingOptions};
use re_log_types::LogMsg;

use crate::drawing::Entry;

/// A piece of a page's stream: a whole little `.rrd`.
pub type Blob = Arc<Vec<u8>>;

/// Bytes that may wait for one page.
const QUEUE_BYTES: usize = 32 << 20;

/// Version and options of everything that is encoded here.
#[must_use]
pub fn encoding() -> (CrateVersion, EncodingOptions) {
    (CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED)
}

/// What pages are told, now and from now on.
pub struct History {
    /// Bytes of what happened in time that are kept of a live session.
    limit: usize,
    state: Mutex<State>,
    /// Pages that were cut off.
    cut: AtomicU64,
}

#[derive(Default)]
struct State {
    standing: BTreeMap<String, Blob>,
    happened: VecDeque<Blob>,
    happened_bytes: usize,
    is_bounded: bool,
    ended: Option<End>,
    pages: Vec<Arc<Page>>,
    /// Pages that have come so far.
    came: u64,
}

/// A page's queue.
pub struct Page {
    queue: Mutex<Queue>,
    woken: Condvar,
}

#[derive(Default)]
struct Queue {
    blobs: VecDeque<Blob>,
    bytes: usize,
    /// It was too slow, or is gone.
    is_cut: bool,
    ended: Option<End>,
}

/// How a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// `hapterra` said that there is no more.
    Told,
    /// `hapterra` is gone without saying so: it was killed, or crashed.
    Lost,
}

/// What a page is told next.
#[derive(Debug, PartialEq, Eq)]
pub enum Next {
    /// This.
    Blob(Blob),
    /// Nothing for now.
    Nothing,
    /// There is no more: the session has ended.
    Over(End),
    /// It was too slow, and has to come again.
    Cut,
}

/// Figures of a history.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// Bytes that stand.
    pub standing: usize,
    /// Bytes of what happened in time.
    pub happened: usize,
    /// Pages that are there.
    pub pages: usize,
    /// Pages that have come so far.
    pub came: u64,
    /// Pages that were cut off because they were too slow.
    pub cut: u64,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Whoever panicked held no half-made state: every change is one assignment or push.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl History {
    /// An empty history that keeps `limit` bytes of what happens in a live session.
    #[must_use]
    pub fn new(limit: usize) -> Arc<Self> {
        Arc::new(Self {
            limit,
            state: Mutex::default(),
            cut: AtomicU64::new(0),
        })
    }

    /// A scene begins: what was kept of the one before is forgotten. A recording is kept
    /// as a whole.
    pub fn begin(&self, is_live: bool) {
        let mut state = locked(&self.state);
        state.standing.clear();
        state.happened.clear();
        state.happened_bytes = 0;
        state.is_bounded = is_live;
        for page in &state.pages {
            page.cut();
        }
    }

    /// Keeps entries and tells them to the pages.
    ///
    /// # Errors
    /// An entry that cannot be encoded.
    pub fn put(&self, entries: Vec<Entry>) -> Result<()> {
        let (standing, happened): (Vec<_>, Vec<_>) =
            entries.into_iter().partition(|entry| entry.key.is_some());
        let mut new = Vec::new();
        for entry in standing {
            let blob = encoded([&entry.message])?;
            new.push((entry.key, blob));
        }
        if !happened.is_empty() {
            new.push((None, encoded(happened.iter().map(|entry| &entry.message))?));
        }
        let mut state = locked(&self.state);
        for (key, blob) in new {
            state.keep(key, &blob, self.limit);
            for page in &state.pages {
                page.offer(&blob);
            }
        }
        let before = state.pages.len();
        state.pages.retain(|page| !page.is_cut());
        let cut = (before - state.pages.len()) as u64;
        self.cut.fetch_add(cut, Ordering::Relaxed);
        Ok(())
    }

    /// Nothing comes any more.
    pub fn end(&self, how: End) {
        let mut state = locked(&self.state);
        state.ended = Some(how);
        for page in &state.pages {
            page.end(how);
        }
    }

    /// A page comes: its queue, which begins with all that is kept.
    #[must_use]
    pub fn come(&self) -> Arc<Page> {
        let mut state = locked(&self.state);
        let kept = state.standing.values().chain(&state.happened);
        let queue = Queue {
            blobs: kept.cloned().collect(),
            ended: state.ended,
            ..Queue::default()
        };
        let page = Arc::new(Page {
            queue: Mutex::new(queue),
            woken: Condvar::new(),
        });
        state.came += 1;
        state.pages.push(Arc::clone(&page));
        page
    }

    /// A page has gone.
    pub fn gone(&self, page: &Arc<Page>) {
        let mut state = locked(&self.state);
        state.pages.retain(|other| !Arc::ptr_eq(other, page));
    }

    /// What is kept, and for how many pages.
    #[must_use]
    pub fn kept(&self) -> Kept {
        let state = locked(&self.state);
        Kept {
            standing: state.standing.values().map(|blob| blob.len()).sum(),
            happened: state.happened_bytes,
            pages: state.pages.len(),
            came: state.came,
            cut: self.cut.load(Ordering::Relaxed),
        }
    }
}

impl State {
    fn keep(&mut self, key: Option<String>, blob: &Blob, limit: usize) {
        let Some(key) = key else {
            self.happened_bytes += blob.len();
            self.happened.push_back(Arc::clone(blob));
            while self.is_bounded && self.happened_bytes > limit {
                let Some(oldest) = self.happened.pop_front() else {
                    break;
                };
                self.happened_bytes -= oldest.len();
            }
            return;
        };
        self.standing.insert(key, Arc::clone(blob));
    }
}

impl Page {
    /// What the page is told next, waiting for at most `wait`.
    #[must_use]
    pub fn next(&self, wait: std::time::Duration) -> Next {
        let queue = locked(&self.queue);
        let idle =
            |queue: &mut Queue| queue.blobs.is_empty() && queue.ended.is_none() && !queue.is_cut;
        let waited = self.woken.wait_timeout_while(queue, wait, idle);
        let (mut queue, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if queue.is_cut {
            return Next::Cut;
        }
        match queue.blobs.pop_front() {
            Some(blob) => {
                queue.bytes = queue.bytes.saturating_sub(blob.len());
                Next::Blob(blob)
            }
            None => queue.ended.map_or(Next::Nothing, Next::Over),
        }
    }

    fn offer(&self, blob: &Blob) {
        let mut queue = locked(&self.queue);
        queue.bytes += blob.len();
        match queue.bytes > QUEUE_BYTES {
            true => {
                queue.is_cut = true;
                queue.blobs.clear();
            }
            false => queue.blobs.push_back(Arc::clone(blob)),
        }
        self.woken.notify_all();
    }

    fn cut(&self) {
        locked(&self.queue).is_cut = true;
        self.woken.notify_all();
    }

    fn is_cut(&self) -> bool {
        locked(&self.queue).is_cut
    }

    fn end(&self, how: End) {
        locked(&self.queue).ended = Some(how);
        self.woken.notify_all();
    }
}

fn encoded<'m>(messages: impl IntoIterator<Item = &'m LogMsg>) -> Result<Blob> {
    let (version, options) = encoding();
    let mut encoder =
        Encoder::new_eager(version, options, Vec::new()).context("encoding for the page")?;
    // An index of the file's end, which nobody looks for in a piece of a stream.
    encoder.do_not_emit_footer();
    for message in messages {
        encoder.append(message).context("encoding for the page")?;
    }
    encoder.finish().context("encoding for the page")?;
    Ok(Arc::new(
        encoder.into_inner().context("encoding for the page")?,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::tests::entry;
    use std::time::Duration;

    const NOW: Duration = Duration::ZERO;

    fn told(page: &Page) -> usize {
        std::iter::from_fn(|| match page.next(NOW) {
            Next::Blob(_) => Some(()),
            _ => None,
        })
        .count()
    }

    #[test]
    fn what_stands_is_kept_once_and_what_happens_is_bounded() {
        let history = History::new(20_000);
        history.begin(true);
        let (mut standing, mut happened) = (0, 0);
        for round in 0..300 {
            let place = format!("place{}", round % 3);
            history
                .put(vec![entry(Some(&place)), entry(None)])
                .expect("encodes");
            let kept = history.kept();
            if round == 100 {
                (standing, happened) = (kept.standing, kept.happened);
            }
        }
        let kept = history.kept();
        assert!(
            kept.standing <= standing + 64,
            "{kept:?}, {standing} before"
        );
        assert!(kept.happened <= 20_000 && kept.happened + 2_000 > happened);
        // Three places, and what is left of the rest.
        let page = history.come();
        assert!(told(&page) < 100);
    }

    #[test]
    fn a_recording_is_kept_as_a_whole() {
        let history = History::new(100);
        history.begin(false);
        for _ in 0..50 {
            history.put(vec![entry(None)]).expect("encodes");
        }
        assert_eq!(told(&history.come()), 50);
    }

    #[test]
    fn a_page_that_does_not_read_is_cut_off_and_no_other() {
        let history = History::new(1 << 20);
        history.begin(true);
        let (slow, quick) = (history.come(), history.come());
        let big = |page: &Arc<Page>| {
            page.offer(&Arc::new(vec![0; QUEUE_BYTES / 2 + 1]));
        };
        big(&slow);
        assert_eq!(told(&slow) + told(&quick), 1);
        big(&slow);
        big(&slow);
        history.put(vec![entry(None)]).expect("encodes");
        assert_eq!(slow.next(NOW), Next::Cut);
        assert_eq!(told(&quick), 1);
        let kept = history.kept();
        assert_eq!((kept.pages, kept.came, kept.cut), (1, 2, 1));
    }

    #[test]
    fn pages_hear_the_end_and_a_new_scene_makes_them_come_again() {
        let history = History::new(1 << 20);
        history.begin(true);
        let page = history.come();
        assert_eq!(page.next(NOW), Next::Nothing);
        history.begin(true);
        assert_eq!(page.next(NOW), Next::Cut);
        let page = history.come();
        history.put(vec![entry(None)]).expect("encodes");
        for how in [End::Told, End::Lost] {
            history.end(how);
            let late = history.come();
            assert_eq!(told(&late), 1);
            assert_eq!(late.next(NOW), Next::Over(how));
        }
        assert_eq!(told(&page), 1);
        assert_eq!(page.next(NOW), Next::Over(End::Lost));
    }
}
