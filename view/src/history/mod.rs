//! History for new pages, and the queues of the present ones.
//!
//! Static entries (terrain, tiles, layout) are kept once, by key: a later entry replaces an earlier
//! one. Entries over time are gathered (`gather`) and kept up to a bound of bytes, the oldest
//! dropped first. All other memory is constant during a session.
//!
//! A page whose queue is full is cut off, so that neither this program nor another page waits for
//! it. It reconnects by itself and receives the current state.

mod gather;
mod page;

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context as _, Result};
use re_build_info::CrateVersion;
use re_log_encoding::{Encoder, EncodingOptions};
use re_log_types::LogMsg;

use crate::drawing::Entry;
use gather::{Gather, Piece};
pub use page::{Next, Page, Pieces};

/// A piece of a page's stream: a complete small `.rrd`.
pub type Blob = Arc<Vec<u8>>;

/// Span of a gathered piece for pages, s.
const SHORT_S: u32 = 1;
/// Span of a gathered piece for pages that connect later, s.
const LONG_S: u32 = 10;

/// Returns version and options of all encoding in this module.
#[must_use]
pub fn encoding() -> (CrateVersion, EncodingOptions) {
    (CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED)
}

/// Messages to the present pages and to later ones.
pub struct History {
    /// Maximum bytes of a live session's events.
    limit: usize,
    state: Mutex<State>,
    /// Number of pages that were cut off.
    cut: AtomicU64,
}

struct State {
    standing: BTreeMap<String, Blob>,
    /// Events, [`LONG_S`] at a time.
    happened: VecDeque<Blob>,
    happened_bytes: usize,
    /// Later events, [`SHORT_S`] at a time.
    recent: Gather,
    /// The latest events, as received.
    latest: Gather,
    is_bounded: bool,
    ended: Option<End>,
    pages: Vec<Arc<Page>>,
    /// Number of pages that have connected up to now.
    came: u64,
}

/// End of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// `hapterra` ended the stream.
    Reported,
    /// `hapterra` ended without ending the stream: it was killed, or crashed.
    Lost,
}

/// Figures of a history.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// Bytes of static entries.
    pub standing: usize,
    /// Bytes of events.
    pub happened: usize,
    /// Number of connected pages.
    pub pages: usize,
    /// Number of pages that have connected up to now.
    pub came: u64,
    /// Pages that were cut off because they were too slow.
    pub cut: u64,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked left a consistent state: every change is one assignment or push.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl History {
    /// Creates an empty history that keeps `limit` bytes of a live session's events.
    #[must_use]
    pub fn new(limit: usize) -> Arc<Self> {
        Arc::new(Self {
            limit,
            state: Mutex::new(State {
                standing: BTreeMap::new(),
                happened: VecDeque::new(),
                happened_bytes: 0,
                recent: Gather::new(LONG_S),
                latest: Gather::new(SHORT_S),
                is_bounded: false,
                ended: None,
                pages: Vec::new(),
                came: 0,
            }),
            cut: AtomicU64::new(0),
        })
    }

    /// Begins a scene and drops the history of the previous one. A recording is kept completely.
    pub fn begin(&self, is_live: bool) {
        let mut state = locked(&self.state);
        state.standing.clear();
        state.happened.clear();
        state.happened_bytes = 0;
        state.recent = Gather::new(LONG_S);
        state.latest = Gather::new(SHORT_S);
        state.is_bounded = is_live;
        for page in &state.pages {
            page.cut();
        }
    }

    /// Stores entries and sends them to the pages.
    ///
    /// # Errors
    /// An entry that cannot be encoded.
    pub fn put(&self, entries: Vec<Entry>) -> Result<()> {
        let (standing, happened): (Vec<_>, Vec<_>) =
            entries.into_iter().partition(|entry| entry.key.is_some());
        let happened = happened.into_iter().map(|entry| entry.message).collect();
        let mut state = locked(&self.state);
        for Entry { key, message } in standing {
            let blob = encoded([&message])?;
            for page in &state.pages {
                page.offer(key.as_deref(), &blob);
            }
            state.standing.extend(key.map(|key| (key, blob)));
        }
        if let Some(piece) = Piece::of(happened)? {
            state.tell(Pieces::Fine, &piece.blob);
            let together = state.latest.take(&piece)?;
            state.gather(together, self.limit)?;
        }
        let before = state.pages.len();
        state.pages.retain(|page| !page.is_cut());
        let cut = (before - state.pages.len()) as u64;
        self.cut.fetch_add(cut, Ordering::Relaxed);
        Ok(())
    }

    /// Ends the session: no entries follow.
    ///
    /// # Errors
    /// An entry that cannot be encoded.
    pub fn end(&self, how: End) -> Result<()> {
        let mut state = locked(&self.state);
        let rest = state.latest.rest()?;
        state.gather(rest, self.limit)?;
        state.ended = Some(how);
        for page in &state.pages {
            page.end(how);
        }
        Ok(())
    }

    /// Adds a page and returns its queue, which begins with the whole history.
    #[must_use]
    pub fn come(&self, pieces: Pieces) -> Arc<Page> {
        let mut state = locked(&self.state);
        let standing = state.standing.iter();
        let standing = standing.map(|(key, blob)| (Some(key.clone()), Arc::clone(blob)));
        let latest = state.latest.pieces().iter();
        let latest = latest.filter(|_| pieces == Pieces::Fine);
        let happened = { state.happened.iter() }
            .chain(state.recent.pieces())
            .chain(latest);
        let happened = happened.map(|blob| (None, Arc::clone(blob)));
        let page = Page::new(pieces, standing.chain(happened), state.ended);
        state.came += 1;
        state.pages.push(Arc::clone(&page));
        page
    }

    /// Removes a page that has disconnected.
    pub fn gone(&self, page: &Arc<Page>) {
        let mut state = locked(&self.state);
        state.pages.retain(|other| !Arc::ptr_eq(other, page));
    }

    /// Returns the size of the history, and the number of pages.
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
    /// Sends the gathered entries to the pages that receive such pieces.
    fn tell(&self, pieces: Pieces, blob: &Blob) {
        for page in self.pages.iter().filter(|page| page.pieces() == pieces) {
            page.offer(None, blob);
        }
    }

    /// Sends a joined piece, and joins it with more.
    fn gather(&mut self, together: Option<Piece>, limit: usize) -> Result<()> {
        if let Some(piece) = together {
            self.tell(Pieces::Gathered, &piece.blob);
            let together = self.recent.take(&piece)?;
            self.keep(together, limit);
        }
        Ok(())
    }

    /// Stores events, and drops the oldest.
    fn keep(&mut self, together: Option<Piece>, limit: usize) {
        let Some(Piece { blob, .. }) = together else {
            return;
        };
        self.happened_bytes += blob.len();
        self.happened.push_back(blob);
        while self.is_bounded && self.happened_bytes > limit {
            let Some(oldest) = self.happened.pop_front() else {
                break;
            };
            self.happened_bytes -= oldest.len();
        }
    }
}

fn encoded<'m>(messages: impl IntoIterator<Item = &'m LogMsg>) -> Result<Blob> {
    let (version, options) = encoding();
    let mut encoder =
        Encoder::new_eager(version, options, Vec::new()).context("encoding for the page")?;
    // An index for the file's end, which readers of a stream do not need.
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
    use super::page::QUEUE_BYTES;
    use super::*;
    use crate::drawing::tests::{at, entry};
    use std::time::Duration;

    const NOW: Duration = Duration::ZERO;

    fn reported(page: &Page) -> usize {
        std::iter::from_fn(|| match page.next(NOW) {
            Next::Blob(_) => Some(()),
            _ => None,
        })
        .count()
    }

    #[test]
    fn keyed_entries_are_kept_once_and_other_entries_are_bounded() {
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
        // Three entries, and the rest of the limit.
        let page = history.come(Pieces::Fine);
        assert!(reported(&page) < 100);
    }

    #[test]
    fn a_recording_is_kept_as_a_whole() {
        let history = History::new(100);
        history.begin(false);
        for _ in 0..50 {
            history.put(vec![entry(None)]).expect("encodes");
        }
        assert_eq!(reported(&history.come(Pieces::Fine)), 50);
    }

    #[test]
    fn a_page_that_does_not_read_is_cut_off_and_no_other() {
        let history = History::new(1 << 20);
        history.begin(true);
        let (slow, quick) = (history.come(Pieces::Fine), history.come(Pieces::Fine));
        let big = |page: &Arc<Page>| {
            page.offer(None, &Arc::new(vec![0; QUEUE_BYTES / 2 + 1]));
        };
        big(&slow);
        assert_eq!(reported(&slow) + reported(&quick), 1);
        big(&slow);
        big(&slow);
        history.put(vec![entry(None)]).expect("encodes");
        assert_eq!(slow.next(NOW), Next::Cut);
        assert_eq!(reported(&quick), 1);
        let kept = history.kept();
        assert_eq!((kept.pages, kept.came, kept.cut), (1, 2, 1));
    }

    #[test]
    fn queue_keeps_the_latest_blob_per_key_and_counts_bytes() {
        let history = History::new(1 << 20);
        history.begin(true);
        history.put(vec![entry(Some("first"))]).expect("encodes");
        let page = history.come(Pieces::Fine);
        let of = |fill: u8| Arc::new(vec![fill; QUEUE_BYTES / 3]);
        for (key, fill) in [("first ", 1), ("other ", 2), ("first ", 3), ("first ", 4)] {
            page.offer(Some(key), &of(fill));
        }
        let fills = std::iter::from_fn(|| match page.next(NOW) {
            Next::Blob(blob) => Some(blob[0]),
            _ => None,
        });
        assert_eq!(fills.collect::<Vec<_>>(), [2, 4]);
        // The queue is empty: three more fit, and a fourth does not.
        for fill in 0..3 {
            page.offer(None, &of(fill));
        }
        assert!(!page.is_cut());
        page.offer(None, &of(3));
        assert!(page.is_cut());
    }

    #[test]
    fn time_that_stands_still_gathers_no_more_than_so_many_entries() {
        let history = History::new(1 << 20);
        history.begin(true);
        let (gathered, fine) = (history.come(Pieces::Gathered), history.come(Pieces::Fine));
        for _ in 0..2500 {
            history.put(vec![at(1.0)]).expect("encodes");
        }
        assert_eq!((reported(&gathered), reported(&fine)), (2, 2500));
        history.end(End::Reported).expect("encodes");
        assert_eq!(reported(&gathered), 1);
    }

    #[test]
    fn pages_receive_the_end_and_are_cut_off_by_a_new_scene() {
        let history = History::new(1 << 20);
        history.begin(true);
        let page = history.come(Pieces::Fine);
        assert_eq!(page.next(NOW), Next::Nothing);
        history.begin(true);
        assert_eq!(page.next(NOW), Next::Cut);
        let page = history.come(Pieces::Fine);
        history.put(vec![entry(None)]).expect("encodes");
        for how in [End::Reported, End::Lost] {
            history.end(how).expect("encodes");
            let late = history.come(Pieces::Fine);
            assert_eq!(reported(&late), 1);
            assert_eq!(late.next(NOW), Next::Over(how));
        }
        assert_eq!(reported(&page), 1);
        assert_eq!(page.next(NOW), Next::Over(End::Lost));
    }
}
