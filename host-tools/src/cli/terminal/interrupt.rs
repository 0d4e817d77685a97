//! Ctrl-C, and the signals that ask a program to end or tell that its terminal is
//! gone: the first asks for a clean end, the second ends at once.

use std::io;
use std::process::exit;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::Builder;
use std::time::Duration;

use super::raw_keys;
use super::voice::put;

static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether a board may be armed by this program.
static MAY_BE_ARMED: AtomicBool = AtomicBool::new(false);

/// What is said where a program ends that may leave an armed board.
const NOT_CONFIRMED: &str =
    "ended at once: the board did not confirm that it is disarmed: switch the amplifiers off\n";
/// In this time that is written, or nobody reads it.
const WRITTEN: Duration = Duration::from_millis(200);

/// Exit code of a program that was interrupted twice, as shells have it.
const INTERRUPTED: i32 = 130;

/// Listens from now on.
pub(in crate::cli) fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let listening = ctrlc::set_handler(press);
        if let Err(error) = listening {
            // Then it ends this program the hard way, as without a handler.
            tracing::debug!("cannot listen to Ctrl-C: {error}");
        }
    });
}

/// Ctrl-C, from wherever it is heard: the first asks for an end, the second ends at once.
pub(in crate::cli) fn press() {
    if REQUESTED.swap(true, Ordering::Relaxed) {
        raw_keys::put_back();
        if MAY_BE_ARMED.load(Ordering::Relaxed) {
            say_not_confirmed();
        }
        exit(INTERRUPTED);
    }
}

/// Writes to a terminal that somebody reads; one that nobody reads does not hold the end
/// up.
fn say_not_confirmed() {
    let (done, is_done) = channel();
    let write = move || {
        put(io::stderr(), NOT_CONFIRMED);
        let _ = done.send(());
    };
    if Builder::new().spawn(write).is_ok() {
        let _ = is_done.recv_timeout(WRITTEN);
    }
}

/// Says whether a board may be armed by this program from now on: who ends it at once
/// is then told to switch the amplifiers off.
pub(in crate::cli) fn board_may_be_armed(may: bool) {
    MAY_BE_ARMED.store(may, Ordering::Relaxed);
}

/// Whether an end was asked for.
#[must_use]
pub(in crate::cli) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
