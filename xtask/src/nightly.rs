//! The nightly compiler, for what only it can do: sanitizers and Miri.

use std::process::Command;

use anyhow::{Result, ensure};

use crate::run::{output, say, shown};

/// The nightly compiler's cargo, whichever runs this program.
pub(crate) fn cargo(words: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command
        .arg("+nightly")
        .args(words)
        .env_remove("CARGO")
        .env_remove("RUSTUP_TOOLCHAIN");
    command
}

/// Sees to it that this cargo answers to `words`, by rustup if need be, with these
/// components (a list with commas).
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
    let line = shown(&install);
    say(format!("installing: {line}"));
    let installed = output(&mut install).is_some() && is_here();
    ensure!(
        installed,
        "no nightly compiler for it; with rustup, type: {line}"
    );
    Ok(())
}
