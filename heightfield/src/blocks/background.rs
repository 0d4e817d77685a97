//! Background work for readers that must not wait: a queue of requests, for one thread.

use std::collections::{HashSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::cache::Key;

/// Max queued jobs: more than the blocks under a coarse tile (33 × 33). The oldest job is dropped,
/// and is requested again if it is still needed.
const MAX: usize = 2048;

/// A job for a background thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Job {
    /// Search the disk for a piece of a computed image.
    Seek(Key),
    /// Decode a block of the full image for its coarse samples.
    Pass([u32; 2]),
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
    known: HashSet<Job>,
    is_over: bool,
}

impl Queue {
    fn state(&self) -> MutexGuard<'_, State> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a job at the front of the queue. Returns true if it is new.
    pub(super) fn want_first(&self, job: Job) -> bool {
        let mut state = self.state();
        let is_new = !state.is_over && state.waiting.len() < MAX && state.known.insert(job);
        if is_new {
            state.waiting.push_front(job);
            drop(state);
            self.wake.notify_all();
        }
        is_new
    }

    /// Adds a job at the end of the queue. Returns true if it is new.
    pub(super) fn want(&self, job: Job) -> bool {
        let mut state = self.state();
        if state.is_over || !state.known.insert(job) {
            return false;
        }
        if state.waiting.len() >= MAX
            && let Some(left_out) = state.waiting.pop_front()
        {
            state.known.remove(&left_out);
        }
        state.waiting.push_back(job);
        drop(state);
        self.wake.notify_all();
        true
    }

    /// Returns the next job; `None` if the queue is empty or closed.
    pub(super) fn next(&self) -> Option<Job> {
        let mut state = self.state();
        match state.is_over {
            true => None,
            false => state.waiting.pop_front(),
        }
    }

    /// Returns up to `most` blocks of the full image that will be decoded next.
    pub(super) fn coming(&self, most: usize) -> Vec<[u32; 2]> {
        let state = self.state();
        let blocks = state.waiting.iter().filter_map(|job| match job {
            Job::Pass(at) => Some(*at),
            _ => None,
        });
        blocks.take(most).collect()
    }

    /// Marks a job as done.
    pub(super) fn done(&self, job: &Job) {
        self.state().known.remove(job);
        self.wake.notify_all();
    }

    /// Returns true if no job is queued or running.
    pub(super) fn is_idle(&self) -> bool {
        self.state().known.is_empty()
    }

    /// Waits for a job; returns false if the queue is closed.
    pub(super) fn wait(&self) -> bool {
        let state = self.state();
        let is_idle = |state: &mut State| state.waiting.is_empty() && !state.is_over;
        let state = self.wake.wait_while(state, is_idle);
        !state.unwrap_or_else(PoisonError::into_inner).is_over
    }

    /// Closes the queue: no further job starts. Returns true if the running job ends within a time.
    pub(super) fn end(&self, within: Duration) -> bool {
        let mut state = self.state();
        state.is_over = true;
        for left_out in std::mem::take(&mut state.waiting) {
            state.known.remove(&left_out);
        }
        self.wake.notify_all();
        let is_busy = |state: &mut State| !state.known.is_empty();
        let ended = self.wake.wait_timeout_while(state, within, is_busy);
        !ended.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_is_done_once_and_the_oldest_of_too_many_is_left_out() {
        let queue = Queue::default();
        queue.want(Job::Pass([0, 0]));
        queue.want(Job::Pass([0, 0]));
        let first = queue.next().expect("one");
        assert_eq!(queue.next(), None);
        queue.want(first);
        assert_eq!(queue.next(), None, "it is being done");
        assert!(!queue.is_idle());
        queue.done(&first);
        assert!(queue.is_idle());
        for number in 0..=MAX as u32 {
            queue.want(Job::Pass([number, 0]));
        }
        assert_eq!(queue.next(), Some(Job::Pass([1, 0])));
        // A dropped job may be requested again.
        queue.want(Job::Pass([0, 0]));
        assert_eq!(queue.coming(2), [[2, 0], [3, 0]]);
        assert!(queue.next().is_some());
        queue.want_first(Job::Pass([5000, 0]));
        assert_eq!(queue.next(), Some(Job::Pass([5000, 0])));
        let mut last = None;
        while let Some(job) = queue.next() {
            last = Some(job);
        }
        assert_eq!(last, Some(Job::Pass([0, 0])));
        assert!(!queue.end(Duration::ZERO), "some are being done");
        queue.want(Job::Pass([9, 9]));
        assert!(queue.next().is_none() && !queue.wait());
    }
}
