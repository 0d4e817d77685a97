//! `cargo xtask test`: everything that must hold, from set-up to verdict.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::board::{BOARDS, Board};
use crate::run::{cargo, run, timed};
use crate::setup::{emulator, qemu, toolchain};
use crate::{counts, deny, image, panics, size};

/// A board and the ELF of its image.
pub(crate) type Image = (&'static Board, PathBuf);

/// `quick` has no images of the real boards, and builds neither what runs them nor servers.
const QUICK: [&str; 4] = [
    "--exclude",
    "hapterra-image-tests",
    "--exclude",
    "hapterra-url-tests",
];
/// Otherwise the image tests need probe-rs anyway, and the command is tested with
/// it, too.
const WITH_PROBES: [&str; 2] = ["--features", "hapterra/probe"];

/// Builds the images, holds them to their budgets, runs every test of the
/// workspace on the host with QEMU beside it, and checks the dependencies.
/// `quick` leaves out the boards that are not emulated and the dependencies.
pub(crate) fn test(quick: bool) -> Result<()> {
    let qemu = qemu::ready()?;
    if !quick {
        emulator::ready()?;
    }
    let images = images(if quick { &BOARDS[..1] } else { &BOARDS })?;
    check_sizes(&images)?;
    check_panics(&images)?;
    let counts = counts::image()?;
    if !quick {
        timed(
            "checking licences, bans and sources of dependencies",
            deny::check,
        )?;
    }
    timed("running the workspace's tests", || {
        let mut command = cargo();
        command
            .args(["test", "--workspace"])
            .args(if quick { &QUICK[..] } else { &WITH_PROBES })
            .env("HAPTERRA_QEMU", qemu)
            .env(image::COUNTS_VARIABLE, &counts);
        for (board, path) in &images {
            command.env(board.elf_variable, path);
        }
        run(&mut command)
    })
}

/// Builds the images of `boards`.
pub(crate) fn images(boards: &'static [Board]) -> Result<Vec<Image>> {
    let toolchain = toolchain::ready()?;
    let build = |board: &'static Board| {
        timed(&format!("building the image of {}", board.name), || {
            Ok((board, image::build(toolchain, board)?))
        })
    };
    boards.iter().map(build).collect()
}

/// Prints the table of sizes; an error if an image is over its budget.
pub(crate) fn check_sizes(images: &[Image]) -> Result<()> {
    size::check(images.iter().map(by_path))
}

/// An error if an interrupt can panic in one of the images.
pub(crate) fn check_panics(images: &[Image]) -> Result<()> {
    images
        .iter()
        .map(by_path)
        .try_for_each(|(board, path)| panics::check(board, path))
}

fn by_path((board, path): &Image) -> (&Board, &Path) {
    (board, path)
}
