//! `cargo xtask flash BOARD`: builds an image and runs it on a real board.

use std::process::Command;

use anyhow::{Context, Result};

use crate::board::Board;
use crate::image;
use crate::run::{on_path, run, timed};
use crate::setup::toolchain;

/// Builds the image of `board`, flashes it and follows its log with probe-rs.
pub(crate) fn flash(board: &Board) -> Result<()> {
    let chip = board
        .chip
        .context("this board is emulated: `cargo xtask demo` runs it")?;
    let probe_rs = on_path("probe-rs")
        .context("no probe-rs on the PATH; type: cargo install probe-rs-tools --locked")?;
    let toolchain = toolchain::ready()?;
    let image = timed("building the image", || image::build(toolchain, board))?;
    run(Command::new(probe_rs)
        .args(["run", "--chip", chip])
        .arg(image))
}
