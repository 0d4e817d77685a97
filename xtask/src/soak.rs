//! `cargo xtask soak`: the randomised stress test on all cores, checked tick by tick.

use std::ffi::OsString;

use anyhow::{Result, bail};

use crate::run::{cargo, command_line, run, target_dir, timed};

/// Builds the stress test in its own profile, fast and without the product's slow linking, and
/// passes `words` to it.
pub(crate) fn soak(words: Vec<OsString>) -> Result<()> {
    if words.is_empty() {
        bail!("state the duration: cargo xtask soak MINUTES [--seed N], or --seed N --scene K");
    }
    timed("building the randomised stress test", || {
        let package = ["--package", "hapterra-tests", "--bin", "hapterra-soak"];
        run(cargo().args(["build", "--profile", "soak"]).args(package))
    })?;
    let name = format!("hapterra-soak{}", std::env::consts::EXE_SUFFIX);
    let mut command = std::process::Command::new(target_dir().join("soak").join(name));
    command.args(words);
    let status = command.status()?;
    if !status.success() {
        bail!(
            "`{}` found wrong answers ({status})",
            command_line(&command)
        );
    }
    Ok(())
}
