//! The queue of one page.
//!
//! A static entry that waits is sent once: a later one replaces an earlier one.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use super::{Blob, End, locked};

/// Max waiting bytes of a page, besides its first entries.
pub(super) const QUEUE_BYTES: usize = 32 << 20;

/// Sizes of the pieces in which a page receives the entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Batching {
    /// Each entry as it occurs.
    Fine,
    /// A second at a time: for a page that is drawn by software at a few pictures a second, and
    /// that handles only a few dozen entries with each.
    Joined,
}

/// A page's queue.
pub struct Page {
    batching: Batching,
    queue: Mutex<Queue>,
    wake: Condvar,
}

struct Queue {
    /// Waiting entries with their keys; events have no key.
    blobs: VecDeque<(Option<String>, Blob)>,
    bytes: usize,
    limit: usize,
    /// True if it was too slow, or has disconnected.
    is_dropped: bool,
    ended: Option<End>,
}

/// Next message to a page.
#[derive(Debug, PartialEq, Eq)]
pub enum Next {
    /// A piece of the stream.
    Blob(Blob),
    /// None for now.
    Idle,
    /// None any more: the session has ended.
    Ended(End),
    /// The page was too slow, and must reconnect.
    Dropped,
}

impl Page {
    pub(super) fn new(
        batching: Batching,
        first: impl Iterator<Item = (Option<String>, Blob)>,
        ended: Option<End>,
    ) -> Arc<Self> {
        let blobs: VecDeque<_> = first.collect();
        let bytes = blobs.iter().map(|(_, blob)| blob.len()).sum();
        let queue = Queue {
            blobs,
            bytes,
            limit: bytes + QUEUE_BYTES,
            is_dropped: false,
            ended,
        };
        Arc::new(Self {
            batching,
            queue: Mutex::new(queue),
            wake: Condvar::new(),
        })
    }

    /// Returns the size of its pieces.
    #[must_use]
    pub fn batching(&self) -> Batching {
        self.batching
    }

    /// Returns true if its queue is empty.
    #[must_use]
    pub fn is_drained(&self) -> bool {
        locked(&self.queue).blobs.is_empty()
    }

    /// Returns the next message to the page, after a wait of at most `wait`.
    #[must_use]
    pub fn next(&self, wait: std::time::Duration) -> Next {
        let queue = locked(&self.queue);
        let idle = |queue: &mut Queue| {
            queue.blobs.is_empty() && queue.ended.is_none() && !queue.is_dropped
        };
        let waited = self.wake.wait_timeout_while(queue, wait, idle);
        let (mut queue, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if queue.is_dropped {
            return Next::Dropped;
        }
        match queue.blobs.pop_front() {
            Some((_, blob)) => {
                queue.bytes -= blob.len();
                Next::Blob(blob)
            }
            None => queue.ended.map_or(Next::Idle, Next::Ended),
        }
    }

    pub(super) fn offer(&self, key: Option<&str>, blob: &Blob) {
        let mut queue = locked(&self.queue);
        if let Some(key) = key {
            queue.remove(key);
        }
        queue.bytes += blob.len();
        let key = key.map(str::to_owned);
        queue.blobs.push_back((key, Arc::clone(blob)));
        if queue.bytes > queue.limit {
            queue.is_dropped = true;
            queue.blobs.clear();
        }
        self.wake.notify_all();
    }

    pub(super) fn disconnect(&self) {
        locked(&self.queue).is_dropped = true;
        self.wake.notify_all();
    }

    pub(super) fn is_dropped(&self) -> bool {
        locked(&self.queue).is_dropped
    }

    pub(super) fn end(&self, end: End) {
        locked(&self.queue).ended = Some(end);
        self.wake.notify_all();
    }
}

impl Queue {
    fn remove(&mut self, key: &str) {
        let waits = |(other, _): &(Option<String>, Blob)| other.as_deref() == Some(key);
        let earlier = self.blobs.iter().position(waits);
        if let Some((_, blob)) = earlier.and_then(|place| self.blobs.remove(place)) {
            self.bytes -= blob.len();
        }
    }
}
