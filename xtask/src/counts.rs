//! `cargo xtask counts` and `cargo xtask cycles`: instructions of a tick on the emulated
//! Cortex-M4F, and what they take on the boards' chips.

use std::path::PathBuf;

use anyhow::Result;

use crate::image;
use crate::run::{cargo, run, timed};
use crate::setup::{qemu, toolchain};

/// Counts over all scenes, prints the counts beside their targets, and compares them
/// with the kept table, or writes that anew. About five minutes on two cores.
pub(crate) fn counts(write: bool) -> Result<()> {
    replay(&["--nocapture"], write)
}

/// Works out the cycles of a tick on the boards' chips, prints them, and compares them with the
/// kept table, or writes that anew. About twenty minutes on two cores.
pub(crate) fn cycles(write: bool) -> Result<()> {
    replay(&["--nocapture", "--ignored"], write)
}

/// Runs the program that replays scenes on the counting image.
fn replay(words: &[&str], write: bool) -> Result<()> {
    let qemu = qemu::ready()?;
    let image = image()?;
    let mut command = cargo();
    let program = ["--package", "hapterra-bench", "--test", "instructions_m4f"];
    command
        .arg("test")
        .args(program)
        .arg("--")
        .args(words)
        .env("HAPTERRA_QEMU", qemu)
        .env(image::COUNTS_VARIABLE, image)
        .env("HAPTERRA_COUNTS", if write { "write" } else { "all" });
    run(&mut command)
}

/// Builds the counting image.
pub(crate) fn image() -> Result<PathBuf> {
    let toolchain = toolchain::ready()?;
    timed("building the counting image", || {
        image::build_counts(toolchain)
    })
}
