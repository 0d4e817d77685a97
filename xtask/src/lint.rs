//! `cargo xtask lint`: formatting, clippy and documentation, warnings as errors.

use std::process::Command;

use anyhow::{Context, Result};

use crate::board::{BOARDS, EMULATED};
use crate::image::{COUNTS, package_words};
use crate::run::{cargo, report, run, timed};
use crate::setup::{emulator, toolchain};

/// Runs all of them; the first failure ends it.
pub(crate) fn lint() -> Result<()> {
    timed("formatting", || {
        run(cargo().args(["fmt", "--all", "--check"])).context("type: cargo fmt")
    })?;
    emulator::ready()?;
    timed("clippy for the host", || {
        let words = [
            "clippy",
            "--workspace",
            "--all-targets",
            // Features that are off by default are also checked.
            "--features=hapterra/probe",
            "--",
            "-D",
            "warnings",
        ];
        run(cargo().args(words))
    })?;
    timed("clippy for the program as it is usually built", || {
        run(cargo().args(["clippy", "--package", "hapterra", "--", "-D", "warnings"]))
    })?;
    let toolchain = toolchain::ready()?;
    toolchain.with_clippy()?;
    let boards = BOARDS.iter().map(|board| (board, board.name));
    for (board, binary) in boards.chain([(EMULATED, COUNTS)]) {
        timed(&format!("clippy for {binary}"), || {
            let mut command = toolchain.cargo("clippy");
            command
                .arg("--release")
                .args(package_words(board, binary))
                .args(["--", "-D", "warnings"]);
            run(&mut command)
        })?;
    }
    match toolchain::with_wasm() {
        Ok(()) => timed("clippy for the browser's kernel", || run(&mut wasm()))?,
        Err(why) => report(format!("SKIPPED: clippy for the browser's kernel: {why:#}")),
    }
    timed("documentation", || {
        let mut command = cargo();
        command
            .args([
                "doc",
                "--workspace",
                "--no-deps",
                "--features=hapterra/probe",
            ])
            .env("RUSTDOCFLAGS", "-D warnings");
        run(&mut command)
    })
}

/// Returns the command of Clippy for the library for arrays and its C interface, compiled to
/// WebAssembly.
fn wasm() -> Command {
    let mut command = cargo();
    command
        .args(["clippy", "--lib", "--target", toolchain::WASM])
        .args(["--package", "hapterra-touch", "--package", "hapterra-c"])
        .args(["--", "-D", "warnings"]);
    command
}
