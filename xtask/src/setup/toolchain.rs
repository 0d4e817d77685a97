//! A toolchain that builds for the boards.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::distribution;
use crate::run::{cargo, on_path, output, report, run_quietly, target_dir};

/// The boards' target: Cortex-M4F and M7 with single-precision FPU.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// The target of browsers.
pub(crate) const WASM: &str = "wasm32-unknown-unknown";

const MANUAL_STEPS: &str = "\
type: rustup target add thumbv7em-none-eabihf
      (rustup itself is on https://rustup.rs)";

/// Source of the boards' core library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Toolchain {
    /// The toolchain that runs this program contains it.
    Own,
    /// The distribution's Rust builds it from source.
    Distribution,
}

impl Toolchain {
    /// Returns `cargo SUBCOMMAND` for the boards' target.
    pub(crate) fn cargo(self, subcommand: &str) -> Command {
        let mut command = match self {
            Self::Own => cargo(),
            Self::Distribution => distribution::cargo(),
        };
        command.arg(subcommand).args(["--target", TARGET]);
        if self == Self::Distribution {
            command.arg("-Zbuild-std=core");
        }
        // Flags for the host must not apply to an image.
        for variable in ["RUSTFLAGS", "CARGO_BUILD_RUSTFLAGS"] {
            command.env_remove(variable);
        }
        command.env("CARGO_ENCODED_RUSTFLAGS", short_paths());
        command.env("CARGO_TARGET_DIR", self.target_dir());
        command
    }

    /// Returns its build directory. Two compilers in one directory would overwrite each other's
    /// results.
    pub(crate) fn target_dir(self) -> PathBuf {
        match self {
            Self::Own => target_dir(),
            Self::Distribution => target_dir().join("distribution"),
        }
    }

    /// Ensures that `cargo clippy` is installed.
    pub(crate) fn with_clippy(self) -> Result<()> {
        match self {
            // Part of every default toolchain; cargo itself reports if it is missing.
            Self::Own => Ok(()),
            Self::Distribution => distribution::with_clippy(),
        }
    }
}

/// Returns flags that shorten file names in panics to those without the registry's path: an image
/// then has the same size on every machine, and is a kilobyte smaller.
fn short_paths() -> String {
    let cargo = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let cargo = cargo.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let registries = cargo.and_then(|home| home.join("registry/src").read_dir().ok());
    let folders = registries.into_iter().flatten().flatten();
    let mut flags = vec!["--remap-path-scope=macro".to_owned()];
    flags.extend(folders.map(|f| format!("--remap-path-prefix={}/=", f.path().display())));
    flags.join("\x1f")
}

/// Finds a toolchain for the boards, or installs one: rustup's target first, the distribution's
/// packages otherwise. `HAPTERRA_TOOLCHAIN=rustup` or `=distribution` allows only that one.
pub(crate) fn ready() -> Result<Toolchain> {
    match std::env::var("HAPTERRA_TOOLCHAIN").as_deref() {
        Err(_) | Ok("" | "auto") => either(),
        Ok("rustup") => own().context(MANUAL_STEPS),
        Ok("distribution") => from_distribution(),
        Ok(other) => bail!("HAPTERRA_TOOLCHAIN is {other}: set it to rustup, distribution or auto"),
    }
}

fn either() -> Result<Toolchain> {
    // An installed toolchain is preferred over one that needs the network.
    if !own_has_target(TARGET) && distribution::is_whole().is_ok() {
        return from_distribution();
    }
    own().or_else(|why| {
        report(format!("rustup cannot: {why:#}"));
        from_distribution().context(MANUAL_STEPS)
    })
}

fn own() -> Result<Toolchain> {
    add_target(TARGET)?;
    Ok(Toolchain::Own)
}

/// Ensures that the toolchain that runs this program compiles for browsers.
///
/// # Errors
/// The command to type.
pub(crate) fn with_wasm() -> Result<()> {
    add_target(WASM).with_context(|| {
        format!("type: rustup target add {WASM}\n      (rustup itself is on https://rustup.rs)")
    })
}

fn add_target(target: &str) -> Result<()> {
    if own_has_target(target) {
        return Ok(());
    }
    report(format!("the target {target} is not installed"));
    let rustup = on_path("rustup").context("there is no rustup on the PATH")?;
    report(format!("installing: rustup target add {target}"));
    run_quietly(Command::new(rustup).args(["target", "add", target]))?;
    if !own_has_target(target) {
        bail!("rustup added the target, but not to the toolchain in use");
    }
    Ok(())
}

fn from_distribution() -> Result<Toolchain> {
    distribution::ready()?;
    report("building for the boards with the distribution's Rust and its own core library");
    Ok(Toolchain::Distribution)
}

fn own_has_target(target: &str) -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut ask = Command::new(rustc);
    ask.args(["--print", "target-libdir", "--target", target]);
    output(&mut ask).is_some_and(|dir| has_core(Path::new(dir.trim())))
}

fn has_core(dir: &Path) -> bool {
    let Ok(entries) = dir.read_dir() else {
        return false;
    };
    let mut names = entries.flatten().map(|e| e.file_name());
    names.any(|name| name.to_string_lossy().starts_with("libcore-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directory_without_core_is_no_target() {
        assert!(!has_core(Path::new(env!("CARGO_MANIFEST_DIR"))));
        assert!(!has_core(Path::new("/no/such/directory")));
    }

    #[test]
    fn distribution_builds_core_in_its_own_directory() {
        let args = |t: Toolchain| crate::run::command_line(&t.cargo("build"));
        assert_eq!(
            args(Toolchain::Own),
            format!("cargo build --target {TARGET}")
        );
        assert!(args(Toolchain::Distribution).ends_with("-Zbuild-std=core"));
        assert_ne!(
            Toolchain::Own.target_dir(),
            Toolchain::Distribution.target_dir()
        );
    }
}
