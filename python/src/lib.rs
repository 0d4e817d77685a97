//! The compiled part of the Python package `hapterra`: `hapterra._native`.
//!
//! Arrays are passed as bytes in the machine's byte order, because the stable interface of CPython
//! 3.9 has no buffers; `package/hapterra/*.py` converts them with numpy. Errors of the library are
//! `ValueError`s with its texts.

mod command;
mod contact;
mod notes;
mod open;
mod recording;
mod surface_params;
mod terrain;
mod ticks;
mod virtual_arm;

use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::{PyErr, PyResult, pymodule};

/// The module.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::command::main;
    #[pymodule_export]
    use super::contact::Contact;
    #[pymodule_export]
    use super::recording::recording;
    #[pymodule_export]
    use super::surface_params::Surface;
    #[pymodule_export]
    use super::terrain::Terrain;
    #[pymodule_export]
    use super::virtual_arm::VirtualArm;
}

/// Returns an error of the library as a Python exception.
fn refused(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Converts the bytes of an array to numbers.
fn numbers<T, const BYTES: usize>(
    bytes: &[u8],
    of_bytes: impl Fn([u8; BYTES]) -> T,
) -> PyResult<Vec<T>> {
    let (chunks, _) = bytes.as_chunks();
    let mut all = Vec::new();
    let reserved = all.try_reserve_exact(chunks.len());
    reserved.map_err(|error| PyMemoryError::new_err(error.to_string()))?;
    all.extend(chunks.iter().copied().map(of_bytes));
    Ok(all)
}
