//! The only place where tests read the wall clock or sleep.
//!
//! A test's claim is held by counts, conditions and the device's own time, which is the number
//! of its ticks, so no machine is too slow for it. Two uses of the wall clock are left:
//!
//! - A test that would wait for ever fails after [`HANG`], which no machine meets that makes
//!   any progress.
//! - Where the product itself waits in real time ([`pass`]), the test may let it. A slow machine
//!   then shows less; it fails nothing.
//!
//! `tests/tests/wall_clock.rs` searches the sources of all tests for other uses.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Output};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// Time for which a test waits for what comes at once, before it fails.
pub const HANG: Duration = Duration::from_secs(600);
/// Between two looks at a condition.
const LOOK: Duration = Duration::from_millis(5);

/// Waits until `look` finds something.
///
/// # Panics
/// After [`HANG`], with `what` was waited for.
pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < HANG, "in vain for {HANG:?}: {what}");
        sleep(LOOK);
    }
}

/// Waits until `holds` returns true.
///
/// # Panics
/// After [`HANG`], with `what` was waited for.
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
        sleep(LOOK);
    }
    child.wait_with_output().expect("its output")
}

/// The next value of a channel; none once its senders are gone.
///
/// # Panics
/// After [`HANG`].
pub fn next<T>(from: &Receiver<T>) -> Option<T> {
    match from.recv_timeout(HANG) {
        Ok(value) => Some(value),
        Err(RecvTimeoutError::Disconnected) => None,
        Err(RecvTimeoutError::Timeout) => panic!("nothing came for {HANG:?}"),
    }
}

/// Lets real time pass for a product that runs in another thread or process. What the test
/// claims has to hold, too, if the product did nothing in this time.
pub fn pass(time: Duration) {
    sleep(time);
}

/// Sets the time of a file's last change to `age` before now.
///
/// # Panics
/// When the file cannot be opened.
pub fn set_age(path: &Path, age: Duration) {
    set_modified(path, SystemTime::now() - age);
}

/// Sets the time of a file's last change to one that is an hour ahead: however long the test
/// takes, the file was changed a moment ago.
///
/// # Panics
/// When the file cannot be opened.
pub fn set_just_changed(path: &Path) {
    set_modified(path, SystemTime::now() + Duration::from_secs(3_600));
}

/// When a file was last changed, seconds since 1970.
///
/// # Panics
/// When there is no such file.
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
