//! The terminal in raw mode, which sends single keys. It is always restored: when the mode is
//! dropped, also in a panic, and before a program that is interrupted twice exits ([`restore`]).

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};

use crossterm::terminal::{disable_raw_mode, enable_raw_mode};

/// True if the terminal is in raw mode; lines must then end in CR LF.
static IS_RAW: AtomicBool = AtomicBool::new(false);

/// Keeps the terminal in raw mode until it is dropped.
pub(in crate::cli) struct RawMode(());

impl RawMode {
    /// Sets the terminal to raw mode; returns `None` if standard input is no terminal, or an error
    /// occurs.
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
        restore();
    }
}

/// Restores the terminal if it is in raw mode.
pub(in crate::cli) fn restore() {
    if IS_RAW.swap(false, Ordering::Relaxed) {
        let _ = disable_raw_mode();
    }
}

/// Returns true if the terminal is in raw mode.
pub(super) fn is_raw() -> bool {
    IS_RAW.load(Ordering::Relaxed)
}
