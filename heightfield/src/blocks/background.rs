//! Background work for readers that must not wait: a queue of requests, for one thread.

use std::collections::{HashSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::cache::Key;

/// Max queued jobs: more than the blocks under a coarse tile (33 × 33). The oldest job is dropped,
/// and is requested again if it is still needed.
const MAX_JOBS: usize = 2048;

/// A job for a background thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Job {
    /// Search the disk for a piece of a computed image.
    LoadPiece(Key),
    /// Decode a block of the full image for its coarse samples.
    Coarsen([u32; 2]),
    /// Read a block into the cache.
    Fetch(Key),
}

/// A queue of jobs without duplicates.
#[derive(Default)]
pub(super) struct Queue {
    state: Mutex<State>,
    wake: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Job>,
    /// The queued jobs, and the running one.
    unfinished: HashSet<Job>,
    is_closed: bool,
}

impl Queue {
    fn state(&self) -> MutexGuard<'_, State> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a job at the front of the queue. Returns true if it is new.
    pub(super) fn push_front(&self, job: Job) -> bool {
        let mut state = self.state();
        let is_new =
            !state.is_closed && state.waiting.len() < MAX_JOBS && state.unfinished.insert(job);
        if is_new {
            state.waiting.push_front(job);
            drop(state);
            self.wake.notify_all();
        }
        is_new
    }

    /// Adds a job at the end of the queue. Returns true if it is new.
    pub(super) fn push_back(&self, job: Job) -> bool {
        let mut state = self.state();
        if state.is_closed || !state.unfinished.insert(job) {
            return false;
        }
        if state.waiting.len() >= MAX_JOBS
            && let Some(dropped) = state.waiting.pop_front()
        {
            state.unfinished.remove(&dropped);
        }
        state.waiting.push_back(job);
        drop(state);
        self.wake.notify_all();
        true
    }

    /// Returns the next job; `None` if the queue is empty or closed.
    pub(super) fn next(&self) -> Option<Job> {
        let mut state = self.state();
        match state.is_closed {
            true => None,
            false => state.waiting.pop_front(),
        }
    }

    /// Returns up to `max` blocks of the full image that will be decoded next.
    pub(super) fn next_blocks(&self, max: usize) -> Vec<[u32; 2]> {
        let state = self.state();
        let blocks = state.waiting.iter().filter_map(|job| match job {
            Job::Coarsen(at) => Some(*at),
            _ => None,
        });
        blocks.take(max).collect()
    }

    /// Marks a job as done.
    pub(super) fn finish(&self, job: &Job) {
        self.state().unfinished.remove(job);
        self.wake.notify_all();
    }

    /// Returns true if no job is queued or running.
    pub(super) fn is_idle(&self) -> bool {
        self.state().unfinished.is_empty()
    }

    /// Waits for a job; returns false if the queue is closed.
    pub(super) fn wait(&self) -> bool {
        let state = self.state();
        let is_idle = |state: &mut State| state.waiting.is_empty() && !state.is_closed;
        let state = self.wake.wait_while(state, is_idle);
        !state.unwrap_or_else(PoisonError::into_inner).is_closed
    }

    /// Closes the queue: no further job starts. Returns true if the running job ends within a time.
    pub(super) fn close(&self, within: Duration) -> bool {
        let mut state = self.state();
        state.is_closed = true;
        for dropped in std::mem::take(&mut state.waiting) {
            state.unfinished.remove(&dropped);
        }
        self.wake.notify_all();
        let is_busy = |state: &mut State| !state.unfinished.is_empty();
        let drained = self.wake.wait_timeout_while(state, within, is_busy);
        !drained
            .unwrap_or_else(PoisonError::into_inner)
            .1
            .timed_out()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queue_has_no_duplicates_and_drops_the_oldest_excess_job() {
        let queue = Queue::default();
        queue.push_back(Job::Coarsen([0, 0]));
        queue.push_back(Job::Coarsen([0, 0]));
        let first = queue.next().expect("one");
        assert_eq!(queue.next(), None);
        queue.push_back(first);
        assert_eq!(queue.next(), None, "it is being done");
        assert!(!queue.is_idle());
        queue.finish(&first);
        assert!(queue.is_idle());
        for number in 0..=MAX_JOBS as u32 {
            queue.push_back(Job::Coarsen([number, 0]));
        }
        assert_eq!(queue.next(), Some(Job::Coarsen([1, 0])));
        // A dropped job may be requested again.
        queue.push_back(Job::Coarsen([0, 0]));
        assert_eq!(queue.next_blocks(2), [[2, 0], [3, 0]]);
        assert!(queue.next().is_some());
        queue.push_front(Job::Coarsen([5000, 0]));
        assert_eq!(queue.next(), Some(Job::Coarsen([5000, 0])));
        let mut last = None;
        while let Some(job) = queue.next() {
            last = Some(job);
        }
        assert_eq!(last, Some(Job::Coarsen([0, 0])));
        assert!(!queue.close(Duration::ZERO), "some are being done");
        queue.push_back(Job::Coarsen([9, 9]));
        assert!(queue.next().is_none() && !queue.wait());
    }
}
