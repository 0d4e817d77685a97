//! A small process that outlives the serving process.
//!
//! ```text
//! hapterra run ── guardian ──(the same program, again)── worker ── device
//!                    │  ◀── messages: devices that may be armed, growing files ─────┤
//!                    └────── presses of Ctrl-C; its end ends the worker ────────▶┘
//! ```
//!
//! The worker opens files, decodes them and serves. A stack overflow, lack of memory or a signal
//! that cannot be handled ends a process without a message, so the process that the user started
//! does none of this work. It waits. If the worker ends and has not reported all devices as
//! disarmed, the guardian connects to each of them and closes it until the board confirms. It
//! restores the terminal and names the recording. If the guardian is killed, the worker ends as
//! after Ctrl-C. Only if both are killed at once does the board have to disarm by itself, after
//! `--silence`.
//!
//! Both are in the terminal's foreground, so Ctrl-C in a terminal reaches both. A signal to the
//! worker only requests an end. The guardian counts the signals and sends each one through a pipe;
//! the second ends the worker at once. A worker whose serving thread does not react to the first
//! one within [`BLOCKED_AFTER`] is killed.
//!
//! On systems other than Unix there is no guardian.
//!
//! [`BLOCKED_AFTER`]: process::BLOCKED_AFTER

#[cfg(unix)]
mod close;
#[cfg(unix)]
mod process;
#[cfg(unix)]
mod worker;

use std::ffi::OsString;

/// Starts this program again as the worker, and returns its exit code when it ends; `None` in the
/// worker itself. `program` is the command that starts it.
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
