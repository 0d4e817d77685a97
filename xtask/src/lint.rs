//! `cargo xtask lint`: formatting, clippy and documentation, warnings as errors.

use anyhow::{Context, Result};

use crate::board::BOARDS;
use crate::image::{counts_words, package_words};
use crate::run::{cargo, run, timed};
use crate::setup::{emulator, toolchain};

/// Runs them all; the first that complains ends it.
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
            // What is left out of a usual build is looked at, too.
            "--features=hapterra/probe",
            "--",
            "-D",
            "warnings",
        ];
        run(cargo().args(words))
    })?;
    let toolchain = toolchain::ready()?;
    toolchain.with_clippy()?;
    let counts = ("the counting image", counts_words());
    let boards = BOARDS.iter().map(|b| (b.name, package_words(b)));
    for (name, words) in boards.chain([counts]) {
        timed(&format!("clippy for {name}"), || {
            let mut command = toolchain.cargo("clippy");
            command
                .arg("--release")
                .args(&words)
                .args(["--", "-D", "warnings"]);
            run(&mut command)
        })?;
    }
    timed("documentation", || {
        let mut command = cargo();
        command
            .args(["doc", "--workspace", "--no-deps"])
            .env("RUSTDOCFLAGS", "-D warnings");
        run(&mut command)
    })
}
