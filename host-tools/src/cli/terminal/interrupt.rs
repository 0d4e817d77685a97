//! Ctrl-C: the first asks for a clean end, the second ends at once.

use std::process::exit;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit code of a program that was interrupted twice, as shells have it.
const INTERRUPTED: i32 = 130;

/// Listens from now on.
pub(in crate::cli) fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let listening = ctrlc::set_handler(|| {
            if REQUESTED.swap(true, Ordering::Relaxed) {
                exit(INTERRUPTED);
            }
        });
        if let Err(error) = listening {
            // Then it ends this program the hard way, as without a handler.
            tracing::debug!("cannot listen to Ctrl-C: {error}");
        }
    });
}

/// Whether an end was asked for.
#[must_use]
pub(in crate::cli) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
