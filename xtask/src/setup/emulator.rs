//! Tools that build the emulated core of the image tests: cmake for its C code, libclang for its
//! bindings.

use anyhow::{Context, Error, Result};

use super::packages::{CMAKE_AND_LIBCLANG, found_or_installed};
use crate::run::on_path;

/// Finds both, or installs them.
pub(crate) fn ready() -> Result<()> {
    found_or_installed(is_whole, &CMAKE_AND_LIBCLANG)
        .context("the emulated core of the image tests")
}

fn is_whole() -> Result<()> {
    on_path("cmake").context("no cmake on the PATH")?;
    // Searches as bindgen does.
    clang_sys::load().map_err(Error::msg)
}
