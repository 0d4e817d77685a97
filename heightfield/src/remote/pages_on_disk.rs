//! Pages of a file that are stored on disk for later runs.

use std::ops::Range;

use super::pages;
use crate::disk_cache::{DiskCache, Name};

/// The pages of a file in one state.
#[derive(Clone)]
pub(super) struct PagesOnDisk {
    disk: DiskCache,
    /// The file, its size, and the tag and time from its server.
    stamp: String,
    len: u64,
}

impl PagesOnDisk {
    /// Returns the pages of a file of `len` bytes in the state `stamp`.
    pub(super) fn new(disk: &DiskCache, stamp: String, len: u64) -> Self {
        Self {
            disk: disk.clone(),
            stamp,
            len,
        }
    }

    fn name(&self, page: u64) -> Name {
        Name::of(&["page", &self.stamp, &page.to_string()])
    }

    /// Returns the pages of a run that are stored.
    pub(super) fn get(&self, run: Range<u64>) -> Vec<Option<Vec<u8>>> {
        let page = |page: u64| {
            let bytes = pages::bytes(&(page..page + 1), self.len);
            let stored = self.disk.get(&self.name(page))?;
            (stored.len() as u64 == bytes.end - bytes.start).then_some(stored)
        };
        run.map(page).collect()
    }

    /// Stores the pages of a received run.
    pub(super) fn put(&self, run: Range<u64>, bytes: &[u8]) {
        for (page, bytes) in run.zip(bytes.chunks(pages::PAGE as usize)) {
            self.disk.put(&self.name(page), bytes);
        }
    }
}

/// Returns the range from the first missing page to the last, as indices in the run.
pub(super) fn missing(stored: &[Option<Vec<u8>>]) -> Option<Range<u64>> {
    let first = stored.iter().position(Option::is_none)?;
    let last = stored.iter().rposition(Option::is_none)?;
    Some(first as u64..last as u64 + 1)
}

/// Joins the received bytes with the stored pages before and after them.
pub(super) fn joined(stored: &[Option<Vec<u8>>], gap: &Range<u64>, bytes: &[u8]) -> Vec<u8> {
    let pages = |pages: &[Option<Vec<u8>>]| pages.iter().flatten().flatten().copied().collect();
    let before: Vec<u8> = pages(&stored[..gap.start as usize]);
    let after: Vec<u8> = pages(&stored[gap.end as usize..]);
    [&before, bytes, &after].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_run_joins_cached_and_fetched_pages() {
        let folder = tempfile::tempdir().expect("a folder");
        let disk = DiskCache::at(folder.path(), 1 << 24);
        let page = pages::PAGE as usize;
        let file: Vec<u8> = (0..5 * page + 100).map(|i| (i / 7) as u8).collect();
        let stored = PagesOnDisk::new(&disk, "file".into(), file.len() as u64);
        assert_eq!(missing(&stored.get(0..6)), Some(0..6));
        stored.put(0..2, &file[..2 * page]);
        stored.put(5..6, &file[5 * page..]);
        let found = stored.get(0..6);
        let gap = missing(&found).expect("some are missing");
        assert_eq!(gap, 2..5);
        let fetched = &file[2 * page..5 * page];
        assert!(joined(&found, &gap, fetched) == file);
        stored.put(2..5, fetched);
        let all = stored.get(0..6);
        assert_eq!(missing(&all), None);
        assert!(joined(&all, &(6..6), &[]) == file);
        // Nothing is found for another state of the same file.
        let other = PagesOnDisk::new(&disk, "file now".into(), file.len() as u64);
        assert_eq!(missing(&other.get(0..6)), Some(0..6));
    }
}
