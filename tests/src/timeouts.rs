//! The only place where tests read the wall clock or sleep.
//!
//! Tests check counts, conditions and the device's own time, which is the number of its ticks, so
//! no machine is too slow for them. Two uses of the wall clock remain:
//!
//! - A test that would wait forever fails after [`HANG`]. No machine that makes progress is so
//!   slow.
//! - If the product itself waits in real time ([`pass`]), the test may wait for it. On a slow
//!   machine such a test covers less, but does not fail.
//!
//! `tests/tests/project/wall_clock.rs` searches the sources of all tests for other uses.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Output};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// Time after which a test stops waiting for a result that normally arrives at once, and fails.
pub const HANG: Duration = Duration::from_secs(600);
/// Interval between two checks of a condition.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Waits until `poll` returns a value.
///
/// # Panics
/// After [`HANG`], with `what` in the message.
pub fn wait_for<T>(what: &str, mut poll: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = poll() {
            return found;
        }
        assert!(
            began.elapsed() < HANG,
            "waited {HANG:?} without success: {what}"
        );
        sleep(POLL_INTERVAL);
    }
}

/// Waits until `holds` returns true.
///
/// # Panics
/// After [`HANG`], with `what` in the message.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    wait_for(what, || holds().then_some(()));
}

/// Waits until a child process ends, and reads the rest of its output.
///
/// # Panics
/// After [`HANG`]; the child is killed first.
pub fn end_of(mut child: Child) -> Output {
    let began = Instant::now();
    while child.try_wait().expect("a child to wait for").is_none() {
        if began.elapsed() >= HANG {
            child.kill().expect("the child can be killed");
            child.wait().expect("the child has ended");
            panic!("the child still ran after {HANG:?}");
        }
        sleep(POLL_INTERVAL);
    }
    child.wait_with_output().expect("its output")
}

/// Returns the next value of a channel, or `None` when all its senders are dropped.
///
/// # Panics
/// After [`HANG`].
pub fn next<T>(from: &Receiver<T>) -> Option<T> {
    match from.recv_timeout(HANG) {
        Ok(value) => Some(value),
        Err(RecvTimeoutError::Disconnected) => None,
        Err(RecvTimeoutError::Timeout) => panic!("received nothing for {HANG:?}"),
    }
}

/// Lets real time pass for a product in another thread or process. The test must also pass if the
/// product did nothing in this time.
pub fn pass(time: Duration) {
    sleep(time);
}

/// Sets the time of a file's last change to `age` before now.
///
/// # Panics
/// If the file cannot be opened.
pub fn set_age(path: &Path, age: Duration) {
    set_modified(path, SystemTime::now() - age);
}

/// Sets the time of a file's last change to an hour ahead, so that the change counts as recent
/// however long the test takes.
///
/// # Panics
/// If the file cannot be opened.
pub fn set_just_changed(path: &Path) {
    set_modified(path, SystemTime::now() + Duration::from_secs(3_600));
}

/// Returns the time of a file's last change, seconds since 1970.
///
/// # Panics
/// If the file does not exist.
#[must_use]
pub fn changed_at_unix_s(path: &Path) -> f64 {
    let changed = path.metadata().and_then(|about| about.modified());
    let since = changed.map(|at| at.duration_since(SystemTime::UNIX_EPOCH));
    since.expect("a file").expect("after 1970").as_secs_f64()
}

fn set_modified(path: &Path, time: SystemTime) {
    let file = File::options().append(true).open(path);
    file.and_then(|file| file.set_modified(time))
        .expect("the file's time is set");
}
