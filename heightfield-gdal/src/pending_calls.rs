//! GDAL calls that have not returned. GDAL's exit handlers would wait for them.

use std::ffi::c_int;
use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of GDAL calls that have not returned.
static CALLS: AtomicUsize = AtomicUsize::new(0);

/// A GDAL call, until it is dropped.
pub(crate) struct Call(());

impl Call {
    pub(crate) fn begin() -> Self {
        CALLS.fetch_add(1, Ordering::AcqRel);
        Self(())
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        CALLS.fetch_sub(1, Ordering::AcqRel);
    }
}

unsafe extern "C" {
    /// Ends the process without exit handlers.
    fn _exit(code: c_int) -> !;
}

/// Ends the process with an exit code if a GDAL call has not returned, because GDAL's exit handlers
/// would wait for it. Otherwise has no effect.
pub fn exit_if_stuck(code: u8) {
    if CALLS.load(Ordering::Acquire) > 0 {
        // The process ends, so errors cannot be reported.
        let _ = (std::io::stdout().flush(), std::io::stderr().flush());
        // SAFETY: it does not return, and nothing in this process is used after it.
        unsafe { _exit(code.into()) }
    }
}
