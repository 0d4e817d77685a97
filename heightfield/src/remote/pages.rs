//! The pages of all remote files: those in memory, and those being fetched.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use lru::LruCache;

/// Size of a page, bytes.
pub(super) const PAGE: u64 = 64 << 10;
/// Max pages per request.
const MAX_RUN: u64 = 16;
/// Max cached pages: 64 MB, besides those being fetched.
const MAX_CACHED: usize = 1024;
/// Max pages being fetched: 32 MB.
const MAX_FETCHING: usize = 512;

/// Max memory of all pages, bytes.
pub(super) const MAX_BYTES: usize = (MAX_CACHED + MAX_FETCHING) * PAGE as usize;

/// The number of a page's file, and its own.
type Key = (u64, u64);

/// Pages of numbered files.
pub(super) struct Pages {
    cached: LruCache<Key, Arc<[u8]>>,
    fetching: HashSet<Key>,
}

impl Default for Pages {
    fn default() -> Self {
        Self {
            cached: LruCache::unbounded(),
            fetching: HashSet::new(),
        }
    }
}

impl Pages {
    /// Returns a page in memory, and marks it as used.
    pub(super) fn get(&mut self, key: Key) -> Option<Arc<[u8]>> {
        self.cached.get(&key).cloned()
    }

    /// Returns true if a page is being fetched.
    pub(super) fn is_fetching(&self, key: Key) -> bool {
        self.fetching.contains(&key)
    }

    /// Returns the missing pages of a file in `requested`, as runs for one request each, and marks
    /// them as being fetched. Pages beyond `MAX_FETCHING` are omitted, and must be requested again.
    pub(super) fn take_missing(&mut self, file: u64, requested: Range<u64>) -> Vec<Range<u64>> {
        let mut runs: Vec<Range<u64>> = vec![];
        for page in requested {
            let key = (file, page);
            if self.cached.contains(&key) || self.fetching.contains(&key) {
                continue;
            }
            if self.fetching.len() >= MAX_FETCHING {
                break;
            }
            self.fetching.insert(key);
            match runs.last_mut() {
                Some(run) if run.end == page && page - run.start < MAX_RUN => run.end += 1,
                _ => runs.push(page..page + 1),
            }
        }
        runs
    }

    /// Stores a received run; its missing pages may be requested again.
    pub(super) fn insert(&mut self, file: u64, run: Range<u64>, bytes: &[u8]) {
        self.failed(file, run.clone());
        for (page, bytes) in run.zip(bytes.chunks(PAGE as usize)) {
            self.cached.put((file, page), bytes.into());
            if self.cached.len() > MAX_CACHED {
                self.cached.pop_lru();
            }
        }
    }

    /// Marks a run as no longer being fetched.
    pub(super) fn failed(&mut self, file: u64, run: Range<u64>) {
        for page in run {
            self.fetching.remove(&(file, page));
        }
    }
}

/// Returns the pages with a byte range of a file of `len` bytes.
pub(super) fn of(bytes: &Range<u64>, len: u64) -> Range<u64> {
    let end = bytes.end.min(len);
    bytes.start / PAGE..end.div_ceil(PAGE).max(bytes.start / PAGE)
}

/// Returns the byte range of some pages of a file of `len` bytes.
pub(super) fn bytes(pages: &Range<u64>, len: u64) -> Range<u64> {
    pages.start * PAGE..(pages.end * PAGE).min(len)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(run: Range<u64>) -> Vec<Range<u64>> {
        std::iter::once(run).collect()
    }

    #[test]
    fn missing_pages_are_requested_once_in_merged_runs() {
        let mut pages = Pages::default();
        assert_eq!(pages.take_missing(1, 3..5), one(3..5));
        assert_eq!(pages.take_missing(1, 0..22), [0..3, 5..21, 21..22]);
        assert!(pages.take_missing(1, 0..22).is_empty(), "all are requested");
        pages.failed(1, 5..21);
        assert_eq!(pages.take_missing(1, 4..7), one(5..7));
        pages.insert(1, 3..5, &vec![7; PAGE as usize + 1]);
        assert_eq!(
            pages.get((1, 3)).map(|page| page.len()),
            Some(PAGE as usize)
        );
        assert_eq!(pages.get((1, 4)).as_deref(), Some(&[7_u8][..]));
        assert!(pages.take_missing(1, 3..5).is_empty(), "both are here");
        assert_eq!(
            pages.take_missing(2, 3..5),
            one(3..5),
            "those of another file are not"
        );
    }

    #[test]
    fn cached_and_requested_pages_are_bounded() {
        let mut pages = Pages::default();
        let count = |runs: Vec<Range<u64>>| runs.iter().map(|run| run.end - run.start).sum::<u64>();
        assert_eq!(count(pages.take_missing(1, 0..10_000)), MAX_FETCHING as u64);
        assert_eq!(count(pages.take_missing(1, 0..10_000)), 0);
        for page in 0..2000 {
            pages.insert(1, page..page + 1, &[0]);
        }
        assert_eq!(pages.cached.len(), MAX_CACHED);
        assert!(pages.get((1, 1999)).is_some() && pages.get((1, 0)).is_none());
    }

    #[test]
    fn last_page_ends_with_the_file() {
        assert_eq!(of(&(PAGE - 1..PAGE + 1), 10 * PAGE), 0..2);
        assert_eq!(of(&(0..u64::MAX), PAGE + 5), 0..2);
        assert!(of(&(9 * PAGE..9 * PAGE + 1), PAGE).is_empty());
        assert_eq!(bytes(&(1..2), PAGE + 5), PAGE..PAGE + 5);
    }
}
