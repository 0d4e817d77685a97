//! Work in the background for readers that must not wait: a queue of requests,
//! for one thread.

use std::collections::{HashSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::cache::Key;

/// Jobs that wait, at most: more than the blocks that a coarse tile touches (33 × 33). The
/// one that waits longest goes, and is requested again if it is still needed.
const MOST: usize = 2048;

/// Something to be done in the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Job {
    /// Look for a piece of a made image on disk.
    Seek(Key),
    /// Decode a block of the full image for its coarse samples.
    Pass([u32; 2]),
    /// Read a block, which is kept.
    Fetch(Key),
}

/// Jobs, each once.
#[derive(Default)]
pub(super) struct Queue {
    state: Mutex<State>,
    wake: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Job>,
    /// Those that wait, and the one that is being done.
    known: HashSet<Job>,
    is_over: bool,
}

impl Queue {
    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing that panics runs while this is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has something done before what was wanted already. Returns true if it is new.
    pub(super) fn want_first(&self, job: Job) -> bool {
        let mut state = self.state();
        let is_new = !state.is_over && state.waiting.len() < MOST && state.known.insert(job);
        if is_new {
            state.waiting.push_front(job);
            drop(state);
            self.wake.notify_all();
        }
        is_new
    }

    /// Has something done, after what was wanted before. Returns true if it is new.
    pub(super) fn want(&self, job: Job) -> bool {
        let mut state = self.state();
        if state.is_over || !state.known.insert(job) {
            return false;
        }
        if state.waiting.len() >= MOST
            && let Some(left_out) = state.waiting.pop_front()
        {
            state.known.remove(&left_out);
        }
        state.waiting.push_back(job);
        drop(state);
        self.wake.notify_all();
        true
    }

    /// The next job; `None` where none waits.
    pub(super) fn next(&self) -> Option<Job> {
        let mut state = self.state();
        match state.is_over {
            true => None,
            false => state.waiting.pop_front(),
        }
    }

    /// Blocks of the full image that are going to be decoded, some of them.
    pub(super) fn coming(&self, most: usize) -> Vec<[u32; 2]> {
        let state = self.state();
        let blocks = state.waiting.iter().filter_map(|job| match job {
            Job::Pass(at) => Some(*at),
            _ => None,
        });
        blocks.take(most).collect()
    }

    /// A job is done.
    pub(super) fn done(&self, job: &Job) {
        self.state().known.remove(job);
        self.wake.notify_all();
    }

    /// Returns true if no job waits or is being done.
    pub(super) fn is_idle(&self) -> bool {
        self.state().known.is_empty()
    }

    /// Waits for a job; `false` where none will come any more.
    pub(super) fn wait(&self) -> bool {
        let state = self.state();
        let is_idle = |state: &mut State| state.waiting.is_empty() && !state.is_over;
        let state = self.wake.wait_while(state, is_idle);
        !state.unwrap_or_else(PoisonError::into_inner).is_over
    }

    /// Ends it: no job is begun any more. Returns true if the present one is done within a time.
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
        for number in 0..=MOST as u32 {
            queue.want(Job::Pass([number, 0]));
        }
        assert_eq!(queue.next(), Some(Job::Pass([1, 0])));
        // What was left out may be wanted again.
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
