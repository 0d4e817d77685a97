//! The nightly compiler, for sanitizers and Miri.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::run::{command_line, output, report};

/// Returns the nightly compiler's cargo, independent of the toolchain that runs this program.
pub(crate) fn cargo(words: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command
        .arg("+nightly")
        .args(words)
        .env_remove("CARGO")
        .env_remove("RUSTUP_TOOLCHAIN");
    command
}

/// Ensures that this cargo accepts `words`, by rustup if needed, with these components (separated
/// by commas).
pub(crate) fn ready(words: &[&str], components: &str) -> Result<()> {
    let is_here = || output(&mut cargo(words)).is_some();
    if is_here() {
        return Ok(());
    }
    let mut install = Command::new("rustup");
    install.args(["toolchain", "install", "nightly", "--profile", "minimal"]);
    if !components.is_empty() {
        install.args(["--component", components]);
    }
    let line = command_line(&install);
    report(format!("installing: {line}"));
    let installed = output(&mut install).is_some() && is_here();
    ensure!(
        installed,
        "no nightly compiler for it; with rustup, type: {line}"
    );
    Ok(())
}
