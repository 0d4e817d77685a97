//! The terminal in raw mode, in which it hands over keys one by one. It is put back on every way out:
//! when the mode is dropped, also in a panic, and before a program that is interrupted twice exits
//! ([`put_back`]).

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};

use crossterm::terminal::{disable_raw_mode, enable_raw_mode};

/// True if the terminal is in raw mode: lines then end in CR LF.
static IS_RAW: AtomicBool = AtomicBool::new(false);

/// The terminal in raw mode, until this is dropped.
pub(in crate::cli) struct RawMode(());

impl RawMode {
    /// Puts the terminal into raw mode; none where standard input is no terminal, or it
    /// cannot be.
    pub(in crate::cli) fn enter() -> Option<Self> {
        if !io::stdin().is_terminal() || !io::stderr().is_terminal() {
            return None;
        }
        enable_raw_mode().ok()?;
        IS_RAW.store(true, Ordering::Relaxed);
        Some(Self(()))
    }
}

impl Drop for RawMode {
    fn drop(&mut self) {
        put_back();
    }
}

/// Puts the terminal back as it was, where it is in raw mode.
pub(in crate::cli) fn put_back() {
    if IS_RAW.swap(false, Ordering::Relaxed) {
        let _ = disable_raw_mode();
    }
}

/// Returns true if the terminal is in raw mode.
pub(super) fn is_raw() -> bool {
    IS_RAW.load(Ordering::Relaxed)
}
