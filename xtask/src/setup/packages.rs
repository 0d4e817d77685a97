//! System packages for the commands: their names in the package managers, and their installation.

use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::run::{command_line, on_path, output, report, run_quietly};

/// Name of a package for each of the [`MANAGERS`]; empty where it has no package.
pub(crate) type Packages = [&'static str; MANAGERS.len()];

/// The package managers of Debian, Fedora, Arch and macOS: the command that installs, and the
/// options against questions and against optional packages.
const MANAGERS: [(&str, &str); 4] = [
    ("apt-get install", "-y --no-install-recommends"),
    ("dnf install", "-y"),
    ("pacman -S", "--noconfirm --needed"),
    ("brew install", ""),
];

pub(crate) const QEMU: Packages = [
    "qemu-system-arm",
    "qemu-system-arm",
    "qemu-system-arm",
    "qemu",
];
/// The programs' packages include the library, whose own package has a number in its name.
pub(crate) const GDAL: Packages = ["gdal-bin", "gdal-libs", "gdal", "gdal"];
/// For the page's own test.
pub(crate) const BROWSER: Packages = [
    "chromium-headless-shell",
    "chromium-headless",
    "chromium",
    "",
];
/// For the unit tests of the page.
pub(crate) const NODE: Packages = ["nodejs", "nodejs", "nodejs", "node"];
pub(crate) const CMAKE_AND_LIBCLANG: Packages = [
    "cmake libclang-dev",
    "cmake clang-devel",
    "cmake clang",
    "cmake llvm",
];
pub(crate) const RUST: Packages = ["rustc-web cargo-web rust-web-src lld", "", "", ""];
pub(crate) const CLIPPY: Packages = ["rust-web-clippy", "", "", ""];

/// Returns the result of `find`; if there is none, installs `packages` and tries again.
pub(crate) fn found_or_installed<T>(
    find: impl Fn() -> Result<T>,
    packages: &Packages,
) -> Result<T> {
    find().or_else(|missing| {
        report(format!("{missing:#}"));
        install(packages)?;
        find()
    })
}

/// Installs `packages` with the first package manager found.
///
/// The error contains the command to type, if there is one.
fn install(packages: &Packages) -> Result<()> {
    let mut managers = MANAGERS.iter().zip(packages);
    let here = managers.find(|((install, _), _)| on_path(program(install)).is_some());
    let Some(((install, unattended), names)) = here else {
        bail!("no supported package manager (apt-get, dnf, pacman, brew) is on the PATH");
    };
    let program = program(install);
    ensure!(!names.is_empty(), "{program} has no package for it");
    let line = format!("{install} {unattended} {names}");
    let attempt = || {
        let mut command = with_rights(&line)?;
        report(format!("installing: {}", command_line(&command)));
        run_quietly(command.env("DEBIAN_FRONTEND", "noninteractive"))
    };
    let done = attempt().or_else(|why| {
        if program != "apt-get" {
            return Err(why);
        }
        report("refreshing apt's package lists, then once more");
        // A failing package list of a third party must not prevent this installation.
        let _ = run_quietly(&mut with_rights("apt-get update")?);
        attempt()
    });
    done.with_context(|| format!("type: {}", typed(install, names)))
}

fn program(line: &str) -> &str {
    line.split(' ').next().unwrap_or(line)
}

/// Returns true for all managers except brew, because they install for the whole system.
fn needs_root(line: &str) -> bool {
    program(line) != "brew"
}

/// Returns the command for a user to type.
fn typed(install: &str, names: &str) -> String {
    let sudo = if needs_root(install) { "sudo " } else { "" };
    format!("{sudo}{install} {names}")
}

/// Returns the command of a line of plain words, with `sudo -n` before it if it needs root and the
/// user is not root.
fn with_rights(line: &str) -> Result<Command> {
    let is_root = output(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0");
    if is_root || !needs_root(line) {
        let mut command = Command::new(program(line));
        command.args(line.split_whitespace().skip(1));
        return Ok(command);
    }
    // -n: never ask for a password during a build.
    let mut command = Command::new("sudo");
    let may = output(Command::new("sudo").args(["-n", "true"])).is_some();
    ensure!(may, "not root here, and sudo would ask for a password");
    command.arg("-n").args(line.split_whitespace());
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn install_command_is_short_and_uses_sudo_where_needed() {
        let lines = MANAGERS.map(|(install, _)| typed(install, "qemu"));
        assert_eq!(
            lines,
            [
                "sudo apt-get install qemu",
                "sudo dnf install qemu",
                "sudo pacman -S qemu",
                "brew install qemu"
            ]
        );
    }

    #[test]
    fn command_line_is_split_into_words() {
        let command = with_rights("brew install  cmake llvm").unwrap();
        assert_eq!(command_line(&command), "brew install cmake llvm");
    }

    #[test]
    fn program_already_found_is_not_installed() {
        let found = found_or_installed(|| Ok(1), &["", "", "", ""]);
        assert_eq!(found.unwrap(), 1);
    }
}
