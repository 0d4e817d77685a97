//! The queue of one page.
//!
//! A static entry that waits is sent once: a later one replaces an earlier one.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use super::{Blob, End, locked};

/// Bytes that may wait for one page, beside those that it gets first.
pub(super) const QUEUE_BYTES: usize = 32 << 20;

/// Sizes of the pieces in which a page gets the entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// As it happens.
    Fine,
    /// A second at a time: for a page that is drawn by software, a few pictures a second,
    /// and takes no more than a few dozen entries with each.
    Gathered,
}

/// A page's queue.
pub struct Page {
    pieces: Pieces,
    queue: Mutex<Queue>,
    woken: Condvar,
}

struct Queue {
    /// By their keys; what happened has none.
    blobs: VecDeque<(Option<String>, Blob)>,
    bytes: usize,
    limit: usize,
    /// It was too slow, or is gone.
    is_cut: bool,
    ended: Option<End>,
}

/// Next message to a page.
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

impl Page {
    pub(super) fn new(
        pieces: Pieces,
        first: impl Iterator<Item = (Option<String>, Blob)>,
        ended: Option<End>,
    ) -> Arc<Self> {
        let blobs: VecDeque<_> = first.collect();
        let bytes = blobs.iter().map(|(_, blob)| blob.len()).sum();
        let queue = Queue {
            blobs,
            bytes,
            limit: bytes + QUEUE_BYTES,
            is_cut: false,
            ended,
        };
        Arc::new(Self {
            pieces,
            queue: Mutex::new(queue),
            woken: Condvar::new(),
        })
    }

    /// Sizes of the pieces in which it gets the entries.
    #[must_use]
    pub fn pieces(&self) -> Pieces {
        self.pieces
    }

    /// Returns true if nothing waits for it.
    #[must_use]
    pub fn is_told_all(&self) -> bool {
        locked(&self.queue).blobs.is_empty()
    }

    /// Returns the next message to the page, waiting for at most `wait`.
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
            Some((_, blob)) => {
                queue.bytes -= blob.len();
                Next::Blob(blob)
            }
            None => queue.ended.map_or(Next::Nothing, Next::Over),
        }
    }

    pub(super) fn offer(&self, key: Option<&str>, blob: &Blob) {
        let mut queue = locked(&self.queue);
        if let Some(key) = key {
            queue.forget(key);
        }
        queue.bytes += blob.len();
        let key = key.map(str::to_owned);
        queue.blobs.push_back((key, Arc::clone(blob)));
        if queue.bytes > queue.limit {
            queue.is_cut = true;
            queue.blobs.clear();
        }
        self.woken.notify_all();
    }

    pub(super) fn cut(&self) {
        locked(&self.queue).is_cut = true;
        self.woken.notify_all();
    }

    pub(super) fn is_cut(&self) -> bool {
        locked(&self.queue).is_cut
    }

    pub(super) fn end(&self, how: End) {
        locked(&self.queue).ended = Some(how);
        self.woken.notify_all();
    }
}

impl Queue {
    fn forget(&mut self, key: &str) {
        let waits = |(other, _): &(Option<String>, Blob)| other.as_deref() == Some(key);
        let earlier = self.blobs.iter().position(waits);
        if let Some((_, blob)) = earlier.and_then(|place| self.blobs.remove(place)) {
            self.bytes -= blob.len();
        }
    }
}
