//! The distribution's Rust, if rustup cannot add the boards' target.
//!
//! Debian contains a recent Rust for its browsers. It has no library for the boards, but the
//! sources to build one with `-Zbuild-std`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::packages::{self, found_or_installed};
use crate::run::{on_path, output, root};

/// The workspace's `rust-version`, in the format of a compiler.
const NEEDED: &str = concat!("rustc ", env!("CARGO_PKG_RUST_VERSION"));

const RUSTC: &str = "/usr/bin/rustc";
const CARGO: &str = "/usr/bin/cargo";
const CLIPPY: &str = "/usr/bin/clippy-driver";

/// Returns its cargo, configured to build its own core library.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(CARGO);
    command
        .current_dir(root())
        .env("RUSTC", RUSTC)
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld")
        .env_remove("CARGO_BUILD_TARGET")
        // Set by the toolchain that runs this program; it would mix the two.
        .env_remove("LD_LIBRARY_PATH")
        .env_remove("RUSTUP_TOOLCHAIN");
    // This toolchain's cargo-clippy must be found before rustup's.
    let path = std::env::var_os("PATH").unwrap_or_default();
    let first = std::iter::once(PathBuf::from("/usr/bin"));
    if let Ok(path) = std::env::join_paths(first.chain(std::env::split_paths(&path))) {
        command.env("PATH", path);
    }
    command
}

/// Ensures that it is installed, complete and recent enough.
pub(crate) fn ready() -> Result<()> {
    found_or_installed(is_whole, &packages::RUST).context("the distribution's Rust")
}

/// Ensures that its clippy is installed.
pub(crate) fn with_clippy() -> Result<()> {
    let is_here = || {
        ensure!(Path::new(CLIPPY).is_file(), "no {CLIPPY}");
        Ok(())
    };
    found_or_installed(is_here, &packages::CLIPPY)
}

/// Fails if it is incomplete, with the missing part.
pub(crate) fn is_whole() -> Result<()> {
    let version = output(Command::new(RUSTC).arg("--version"));
    let version = version.with_context(|| format!("no {RUSTC}"))?;
    let is_recent = minor(&version) >= minor(NEEDED);
    ensure!(is_recent, "{} is too old", version.trim());
    let sysroot = output(Command::new(RUSTC).args(["--print", "sysroot"])).unwrap_or_default();
    let sources = Path::new(sysroot.trim()).join("lib/rustlib/src/rust/library/core");
    ensure!(
        sources.is_dir(),
        "no library sources at {}",
        sources.display()
    );
    ensure!(Path::new(CARGO).is_file(), "no {CARGO}");
    on_path("ld.lld").context("no ld.lld on the PATH")?;
    Ok(())
}

/// Returns the 96 in `rustc 1.96.0 (…)`.
fn minor(version: &str) -> Option<u32> {
    version.split(' ').nth(1)?.split('.').nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_as_numbers() {
        assert_eq!(minor("rustc 1.96.0 (ac68faa20 2026-05-25)"), Some(96));
        assert!(minor("rustc 1.100.0") > minor("rustc 1.95"));
        assert!(minor("nonsense") < minor("rustc 1.63.0"));
    }

    #[test]
    fn required_version_is_parsed() {
        assert!(minor(NEEDED).is_some(), "{NEEDED}");
    }
}
