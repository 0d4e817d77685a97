//! `cargo xtask counts` and `cargo xtask cycles`: instructions of a tick on the emulated
//! Cortex-M4F, and their cycles on the boards' chips.

use std::path::PathBuf;

use anyhow::Result;

use crate::image;
use crate::run::{cargo, run, timed};
use crate::setup::{emulator, qemu, toolchain};

/// Counts over all scenes, prints the counts beside their targets, and compares them with the
/// stored table, or rewrites it. About five minutes on two cores.
pub(crate) fn counts(write: bool) -> Result<()> {
    let scope = if write { "write" } else { "all" };
    replay("hapterra-lab", "instructions_m4f", &["--nocapture"], scope)
}

/// Computes the cycles of a tick on the boards' chips, prints them, and compares them with the
/// stored table, or rewrites it. Uses the random scenes that the tests count and those with the
/// costliest ticks; or all scenes, which takes half an hour on two cores.
pub(crate) fn cycles(scope: Option<&str>) -> Result<()> {
    emulator::ready()?;
    let words = ["--nocapture", "--ignored"];
    replay(
        "hapterra-image-tests",
        "cycles",
        &words,
        scope.unwrap_or_default(),
    )
}

/// Runs a program that replays scenes on the counting image.
fn replay(package: &str, program: &str, words: &[&str], scope: &str) -> Result<()> {
    let qemu = qemu::ready()?;
    let image = image()?;
    let mut command = cargo();
    command
        .args(["test", "--package", package, "--test", program, "--"])
        .args(words)
        .env("HAPTERRA_QEMU", qemu)
        .env(image::COUNTS_VARIABLE, image)
        .env("HAPTERRA_COUNTS", scope);
    run(&mut command)
}

/// Builds the counting image.
pub(crate) fn image() -> Result<PathBuf> {
    let toolchain = toolchain::ready()?;
    timed("building the counting image", || {
        image::build_counts(toolchain)
    })
}
