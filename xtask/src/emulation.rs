//! The emulated board: its image and QEMU.

use std::path::PathBuf;

use anyhow::Result;

use crate::board::EMULATED;
use crate::image;
use crate::run::timed;
use crate::setup::{qemu, toolchain};

/// The emulated board, ready to start.
pub(crate) struct Emulation {
    pub(crate) image: PathBuf,
    pub(crate) qemu: PathBuf,
}

/// Builds the image, and installs QEMU if possible.
pub(crate) fn emulation() -> Result<Emulation> {
    let toolchain = toolchain::ready()?;
    let qemu = qemu::ready()?;
    let image = timed("building the emulated board's image", || {
        image::build(toolchain, EMULATED)
    })?;
    Ok(Emulation { image, qemu })
}
