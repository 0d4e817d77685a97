//! Path of the emulated board, for tests that need it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Returns QEMU and the image, or `None` after a visible message: the caller then returns.
///
/// `cargo xtask test` builds the image and sets the variables of both.
#[must_use]
pub fn emulated_board() -> Option<(PathBuf, PathBuf)> {
    let Some(image) = named("HAPTERRA_MPS2_ELF") else {
        eprintln!("skipped: no emulated board: HAPTERRA_MPS2_ELF is not set");
        return None;
    };
    Some((qemu()?, image))
}

/// Returns the path in an environment variable.
pub(crate) fn named(variable: &str) -> Option<PathBuf> {
    let value = std::env::var_os(variable).filter(|value| !value.is_empty());
    value.map(PathBuf::from)
}

/// Returns QEMU, or `None` after a visible message: the caller then returns.
#[must_use]
pub fn qemu() -> Option<PathBuf> {
    let qemu = named("HAPTERRA_QEMU").unwrap_or_else(|| "qemu-system-arm".into());
    if runs(&qemu) {
        return Some(qemu);
    }
    eprintln!(
        "skipped: no emulated board: {} does not run",
        qemu.display()
    );
    None
}

fn runs(qemu: &Path) -> bool {
    let mut command = Command::new(qemu);
    command
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
