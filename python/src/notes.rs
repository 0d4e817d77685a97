//! Warnings of the library, which the command logs, as Python warnings.

use std::ffi::CString;
use std::io::{Result, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyUserWarning;
use pyo3::{PyErr, PyResult, Python};
use tracing_subscriber::filter::LevelFilter;

/// Max bytes of collected warnings.
const MAX_BYTES: usize = 1 << 14;

static LINES: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// Collects the library's warnings from now on.
pub(crate) fn listen() {
    let log = tracing_subscriber::fmt()
        .with_max_level(LevelFilter::WARN)
        .with_ansi(false)
        .without_time()
        .with_level(false)
        .with_target(false)
        .with_writer(|| Lines);
    // Fails if a logger is already installed.
    let _ = log.try_init();
}

/// Adds a line.
pub(crate) fn add(line: &str) {
    let _ = writeln!(Lines, "{line}");
}

/// Raises the collected warnings at the user's call of the package.
pub(crate) fn warn(py: Python<'_>) -> PyResult<()> {
    let bytes = std::mem::take(&mut *lines());
    let text = String::from_utf8_lossy(&bytes);
    for line in text.lines() {
        let line = CString::new(line.trim())?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &line, 2)?;
    }
    Ok(())
}

fn lines() -> MutexGuard<'static, Vec<u8>> {
    LINES.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Lines;

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let mut lines = lines();
        if lines.len() < MAX_BYTES {
            lines.extend(bytes);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
