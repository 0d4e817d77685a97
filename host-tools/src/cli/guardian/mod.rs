//! A small process that outlives the one that serves.
//!
//! ```text
//! hapterra run ── guardian ──(the same program, again)── worker ── device
//!                    │  ◀── messages: devices that may be armed, growing files ─────┤
//!                    └────── presses of Ctrl-C; its end ends the worker ────────▶┘
//! ```
//!
//! The worker opens files, decodes them and serves. A stack that overflows, memory that
//! ends and a signal that no program can handle end a process without another word, so
//! the process that the user has started does none of that. It waits. If the worker ends
//! and has not reported all devices as disarmed, the guardian connects to each of them and
//! closes it until the board confirms. It puts the terminal back, and names the recording.
//! If the guardian is killed, the worker ends as after Ctrl-C. Only if both are killed at
//! once does the board have to disarm by itself, after `--silence`.
//!
//! Both are in the terminal's foreground, so Ctrl-C in a terminal reaches both. A signal
//! that reaches the worker only asks for an end. The guardian counts: it passes each one
//! on through a pipe, and the second ends the worker at once. A worker whose serving thread
//! does not react to the first one within [`DEAF`] is killed.
//!
//! On systems other than Unix there is no guardian.
//!
//! [`DEAF`]: process::DEAF

#[cfg(unix)]
mod close;
#[cfg(unix)]
mod process;
#[cfg(unix)]
mod worker;
mod worker_message;

use std::ffi::OsString;

pub(in crate::cli) use worker_message::WorkerMessage;

/// Starts this program again as the worker, by the words that do so and its arguments, and returns
/// its exit code once it has ended; none in the worker itself.
pub(in crate::cli) fn watch(program: &[OsString], arguments: &[OsString]) -> Option<u8> {
    #[cfg(unix)]
    return match worker::begin() {
        true => None,
        false => Some(process::watch(program, arguments)),
    };
    #[cfg(not(unix))]
    {
        let _ = (program, arguments);
        None
    }
}

/// Returns true in a worker, whose presses of Ctrl-C its guardian counts.
pub(in crate::cli) fn counts_presses() -> bool {
    #[cfg(unix)]
    return worker::is_worker();
    #[cfg(not(unix))]
    false
}

/// Returns true in a process that a guardian has started.
pub(in crate::cli) fn is_worker() -> bool {
    #[cfg(unix)]
    return worker::has_guardian();
    #[cfg(not(unix))]
    false
}

/// Reports to the guardian, if there is one.
pub(in crate::cli) fn report(message: &WorkerMessage) {
    #[cfg(unix)]
    worker::report(message);
    #[cfg(not(unix))]
    let _ = message;
}
