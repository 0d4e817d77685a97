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
use gather::{Batch, Batcher};
pub use page::{Batching, Next, Page};

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
    dropped: AtomicU64,
}

struct State {
    static_entries: BTreeMap<String, Blob>,
    /// Events, [`LONG_S`] at a time.
    events: VecDeque<Blob>,
    event_bytes: usize,
    /// Later events, [`SHORT_S`] at a time.
    recent: Batcher,
    /// The latest events, as received.
    latest: Batcher,
    is_bounded: bool,
    ended: Option<End>,
    pages: Vec<Arc<Page>>,
    /// Number of pages that have connected up to now.
    connected: u64,
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
pub struct HistoryStats {
    /// Bytes of static entries.
    pub static_entries: usize,
    /// Bytes of events.
    pub events: usize,
    /// Number of connected pages.
    pub pages: usize,
    /// Number of pages that have connected up to now.
    pub connected: u64,
    /// Pages that were cut off because they were too slow.
    pub dropped: u64,
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
                static_entries: BTreeMap::new(),
                events: VecDeque::new(),
                event_bytes: 0,
                recent: Batcher::new(LONG_S),
                latest: Batcher::new(SHORT_S),
                is_bounded: false,
                ended: None,
                pages: Vec::new(),
                connected: 0,
            }),
            dropped: AtomicU64::new(0),
        })
    }

    /// Begins a scene and drops the history of the previous one. A recording is kept completely.
    pub fn begin(&self, is_live: bool) {
        let mut state = locked(&self.state);
        state.static_entries.clear();
        state.events.clear();
        state.event_bytes = 0;
        state.recent = Batcher::new(LONG_S);
        state.latest = Batcher::new(SHORT_S);
        state.is_bounded = is_live;
        for page in &state.pages {
            page.disconnect();
        }
    }

    /// Stores entries and sends them to the pages.
    ///
    /// # Errors
    /// An entry that cannot be encoded.
    pub fn put(&self, entries: Vec<Entry>) -> Result<()> {
        let (static_entries, events): (Vec<_>, Vec<_>) =
            entries.into_iter().partition(|entry| entry.key.is_some());
        let events = events.into_iter().map(|entry| entry.message).collect();
        let mut state = locked(&self.state);
        for Entry { key, message } in static_entries {
            let blob = encoded([&message])?;
            for page in &state.pages {
                page.offer(key.as_deref(), &blob);
            }
            state.static_entries.extend(key.map(|key| (key, blob)));
        }
        if let Some(piece) = Batch::of(events)? {
            state.send(Batching::Fine, &piece.blob);
            let joined_batch = state.latest.add(&piece)?;
            state.add_joined(joined_batch, self.limit)?;
        }
        let previous = state.pages.len();
        state.pages.retain(|page| !page.is_dropped());
        let dropped = (previous - state.pages.len()) as u64;
        self.dropped.fetch_add(dropped, Ordering::Relaxed);
        Ok(())
    }

    /// Ends the session: no entries follow.
    ///
    /// # Errors
    /// An entry that cannot be encoded.
    pub fn end(&self, end: End) -> Result<()> {
        let mut state = locked(&self.state);
        let remaining = state.latest.flush()?;
        state.add_joined(remaining, self.limit)?;
        state.ended = Some(end);
        for page in &state.pages {
            page.end(end);
        }
        Ok(())
    }

    /// Adds a page and returns its queue, which begins with the whole history.
    #[must_use]
    pub fn add_page(&self, batching: Batching) -> Arc<Page> {
        let mut state = locked(&self.state);
        let static_entries = state.static_entries.iter();
        let static_entries =
            static_entries.map(|(key, blob)| (Some(key.clone()), Arc::clone(blob)));
        let latest = state.latest.batches().iter();
        let latest = latest.filter(|_| batching == Batching::Fine);
        let events = { state.events.iter() }
            .chain(state.recent.batches())
            .chain(latest);
        let events = events.map(|blob| (None, Arc::clone(blob)));
        let page = Page::new(batching, static_entries.chain(events), state.ended);
        state.connected += 1;
        state.pages.push(Arc::clone(&page));
        page
    }

    /// Removes a page that has disconnected.
    pub fn remove_page(&self, page: &Arc<Page>) {
        let mut state = locked(&self.state);
        state.pages.retain(|other| !Arc::ptr_eq(other, page));
    }

    /// Returns the size of the history, and the number of pages.
    #[must_use]
    pub fn stats(&self) -> HistoryStats {
        let state = locked(&self.state);
        HistoryStats {
            static_entries: state.static_entries.values().map(|blob| blob.len()).sum(),
            events: state.event_bytes,
            pages: state.pages.len(),
            connected: state.connected,
            dropped: self.dropped.load(Ordering::Relaxed),
        }
    }
}

impl State {
    /// Sends the gathered entries to the pages that receive such pieces.
    fn send(&self, batching: Batching, blob: &Blob) {
        for page in self.pages.iter().filter(|page| page.batching() == batching) {
            page.offer(None, blob);
        }
    }

    /// Sends a joined piece, and joins it with more.
    fn add_joined(&mut self, joined_batch: Option<Batch>, limit: usize) -> Result<()> {
        if let Some(piece) = joined_batch {
            self.send(Batching::Joined, &piece.blob);
            let joined_batch = self.recent.add(&piece)?;
            self.store(joined_batch, limit);
        }
        Ok(())
    }

    /// Stores events, and drops the oldest.
    fn store(&mut self, joined_batch: Option<Batch>, limit: usize) {
        let Some(Batch { blob, .. }) = joined_batch else {
            return;
        };
        self.event_bytes += blob.len();
        self.events.push_back(blob);
        while self.is_bounded && self.event_bytes > limit {
            let Some(oldest) = self.events.pop_front() else {
                break;
            };
            self.event_bytes -= oldest.len();
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
        let (mut static_entries, mut events) = (0, 0);
        for round in 0..300 {
            let place = format!("place{}", round % 3);
            history
                .put(vec![entry(Some(&place)), entry(None)])
                .expect("encodes");
            let stats = history.stats();
            if round == 100 {
                (static_entries, events) = (stats.static_entries, stats.events);
            }
        }
        let stats = history.stats();
        assert!(
            stats.static_entries <= static_entries + 64,
            "{stats:?}, {static_entries} before"
        );
        assert!(stats.events <= 20_000 && stats.events + 2_000 > events);
        // Three entries, and the rest of the limit.
        let page = history.add_page(Batching::Fine);
        assert!(reported(&page) < 100);
    }

    #[test]
    fn recording_is_kept_completely() {
        let history = History::new(100);
        history.begin(false);
        for _ in 0..50 {
            history.put(vec![entry(None)]).expect("encodes");
        }
        assert_eq!(reported(&history.add_page(Batching::Fine)), 50);
    }

    #[test]
    fn only_a_page_that_does_not_read_is_dropped() {
        let history = History::new(1 << 20);
        history.begin(true);
        let (slow, quick) = (
            history.add_page(Batching::Fine),
            history.add_page(Batching::Fine),
        );
        let big = |page: &Arc<Page>| {
            page.offer(None, &Arc::new(vec![0; QUEUE_BYTES / 2 + 1]));
        };
        big(&slow);
        assert_eq!(reported(&slow) + reported(&quick), 1);
        big(&slow);
        big(&slow);
        history.put(vec![entry(None)]).expect("encodes");
        assert_eq!(slow.next(NOW), Next::Dropped);
        assert_eq!(reported(&quick), 1);
        let stats = history.stats();
        assert_eq!((stats.pages, stats.connected, stats.dropped), (1, 2, 1));
    }

    #[test]
    fn queue_keeps_the_latest_blob_per_key_and_counts_bytes() {
        let history = History::new(1 << 20);
        history.begin(true);
        history.put(vec![entry(Some("first"))]).expect("encodes");
        let page = history.add_page(Batching::Fine);
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
        assert!(!page.is_dropped());
        page.offer(None, &of(3));
        assert!(page.is_dropped());
    }

    #[test]
    fn joined_entries_are_bounded_if_time_stands_still() {
        let history = History::new(1 << 20);
        history.begin(true);
        let (gathered, fine) = (
            history.add_page(Batching::Joined),
            history.add_page(Batching::Fine),
        );
        for _ in 0..2500 {
            history.put(vec![at(1.0)]).expect("encodes");
        }
        assert_eq!((reported(&gathered), reported(&fine)), (2, 2500));
        history.end(End::Reported).expect("encodes");
        assert_eq!(reported(&gathered), 1);
    }

    #[test]
    fn pages_receive_the_end_and_are_dropped_at_a_new_scene() {
        let history = History::new(1 << 20);
        history.begin(true);
        let page = history.add_page(Batching::Fine);
        assert_eq!(page.next(NOW), Next::Idle);
        history.begin(true);
        assert_eq!(page.next(NOW), Next::Dropped);
        let page = history.add_page(Batching::Fine);
        history.put(vec![entry(None)]).expect("encodes");
        for end in [End::Reported, End::Lost] {
            history.end(end).expect("encodes");
            let late = history.add_page(Batching::Fine);
            assert_eq!(reported(&late), 1);
            assert_eq!(late.next(NOW), Next::Ended(end));
        }
        assert_eq!(reported(&page), 1);
        assert_eq!(page.next(NOW), Next::Ended(End::Lost));
    }
}
