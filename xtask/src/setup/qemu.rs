//! QEMU with the emulated board.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::packages::{self, found_or_installed};
use crate::run::{on_path, output};

const PROGRAM: &str = "qemu-system-arm";
const MACHINE: &str = "mps2-an386";

/// Returns the path of a QEMU with the board: `HAPTERRA_QEMU` if set, else the one on the PATH,
/// else a newly installed one.
pub(crate) fn ready() -> Result<PathBuf> {
    if let Some(given) = std::env::var_os("HAPTERRA_QEMU") {
        return checked(given.into()).context("HAPTERRA_QEMU names it");
    }
    let found = found_or_installed(find, &packages::QEMU).context(
        "QEMU cannot be installed from here: get it from https://www.qemu.org/download/, \
         then put qemu-system-arm on the PATH or its path in HAPTERRA_QEMU",
    )?;
    checked(found)
}

fn find() -> Result<PathBuf> {
    // Windows' installer does not change the PATH.
    let installed = PathBuf::from(r"C:\Program Files\qemu\qemu-system-arm.exe");
    let found = on_path(PROGRAM).or_else(|| installed.is_file().then_some(installed));
    found.with_context(|| format!("{PROGRAM} is not on the PATH"))
}

fn checked(qemu: PathBuf) -> Result<PathBuf> {
    let machines = output(Command::new(&qemu).args(["-M", "help"]))
        .with_context(|| format!("{} does not run", qemu.display()))?;
    if !supports_board(&machines) {
        bail!(
            "{} does not support the machine {MACHINE}: install a newer QEMU",
            qemu.display()
        );
    }
    Ok(qemu)
}

fn supports_board(machines: &str) -> bool {
    machines
        .lines()
        .any(|line| line.split(' ').next() == Some(MACHINE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn board_is_found_in_the_list_of_machines() {
        let list = "Supported machines are:\nmps2-an385  ARM MPS2\nmps2-an386           ARM MPS2 with AN386\n";
        assert!(supports_board(list));
        assert!(!supports_board("mps2-an385   like mps2-an386\n"));
    }

    #[test]
    fn missing_emulator_is_named() {
        let message = checked("/no/such/qemu".into()).unwrap_err().to_string();
        assert!(message.contains("/no/such/qemu"), "{message}");
    }
}
