//! Random scenes on all cores, until the time is up.
//!
//! A scene depends only on the seed and its number, so any violation can be repeated.

mod soak_counts;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

pub use soak_counts::{FailedScene, LinkStats, MaxWork, SceneOutcome};

use crate::scene::run::{Scene, Surface};
use crate::scene::tile_supply::Buffers;

/// Condition for the end.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// After this time.
    Time(Duration),
    /// After this many scenes.
    Scenes(u64),
}

/// Runs the scenes of a seed from number `first` on `threads` threads; calls `live` from time to
/// time with the counts.
///
/// # Panics
/// If a thread cannot be started.
pub fn soak(
    seed: u64,
    surface: Surface,
    first: u64,
    until: Until,
    threads: usize,
    mut live: impl FnMut(&LinkStats),
) -> LinkStats {
    let began = Instant::now();
    let next = AtomicU64::new(first);
    let stats = Mutex::new(LinkStats::default());
    let is_over = |number: u64| match until {
        Until::Time(time) => began.elapsed() >= time,
        Until::Scenes(scenes) => number >= first + scenes,
    };
    let work = || {
        let mut buffers = Buffers::default();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if is_over(number) {
                return;
            }
            let found = run(seed, number, surface, &mut buffers);
            stats.lock().expect("no panic inside").add(number, found);
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        while !workers.iter().all(thread::ScopedJoinHandle::is_finished) {
            thread::sleep(Duration::from_millis(50));
            live(&stats.lock().expect("no panic inside"));
        }
    });
    stats.into_inner().expect("no panic inside")
}

/// Runs one scene; a panic counts as a violation.
#[must_use]
pub fn run(seed: u64, number: u64, surface: Surface, buffers: &mut Buffers) -> SceneOutcome {
    let scene = Scene::random(seed, number).with_surface(surface);
    let ran = catch_unwind(AssertUnwindSafe(|| scene.run(buffers)));
    let kind = scene.terrain.kind;
    match ran {
        Ok(Ok(measured)) => SceneOutcome::Passed(kind, measured),
        Ok(Err(violation)) => SceneOutcome::Violated(
            kind,
            format!("{:?}", violation.invariant),
            violation.to_string(),
        ),
        Err(panic) => {
            // A tile may be partly filled.
            *buffers = Buffers::default();
            let message = panic.downcast_ref::<String>().cloned();
            let message = message.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
            SceneOutcome::Violated(kind, "Panic".to_owned(), message.unwrap_or_default())
        }
    }
}
