//! The command line, in a process of its own.

use std::ffi::OsString;
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::exceptions::PyRuntimeError;
use pyo3::{PyResult, Python, pyfunction};

/// Runs the command `hapterra` with these arguments and returns its exit code. `program` is the
/// command that starts it again, with the same arguments.
#[pyfunction]
pub(crate) fn main(
    py: Python<'_>,
    arguments: Vec<OsString>,
    program: Vec<OsString>,
) -> PyResult<u8> {
    static HAS_RUN: AtomicBool = AtomicBool::new(false);
    if HAS_RUN.swap(true, Ordering::Relaxed) {
        return Err(PyRuntimeError::new_err(
            "the command has run in this process: run each in its own, by python -m hapterra",
        ));
    }
    Ok(py.detach(|| hapterra::cli::command_line(&program, arguments)))
}
