//! Where the emulated board is, for tests that need it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// QEMU and the image, or `None` with a visible line: the caller then returns.
///
/// `cargo xtask test` builds the image and names both.
#[must_use]
pub fn emulated_board() -> Option<(PathBuf, PathBuf)> {
    let variable = |name: &str| {
        let value = std::env::var_os(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from)
    };
    let Some(image) = variable("HAPTERRA_MPS2_ELF") else {
        eprintln!("skipped: no emulated board: HAPTERRA_MPS2_ELF is not set");
        return None;
    };
    let qemu = variable("HAPTERRA_QEMU").unwrap_or_else(|| "qemu-system-arm".into());
    if !runs(&qemu) {
        eprintln!(
            "skipped: no emulated board: {} does not run",
            qemu.display()
        );
        return None;
    }
    Some((qemu, image))
}

fn runs(qemu: &Path) -> bool {
    let mut command = Command::new(qemu);
    command
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
