//! `cargo xtask campaign`: the closed-loop campaign at full speed.

use std::ffi::OsString;

use anyhow::Result;

use crate::run::{cargo, root, run, timed};

/// Runs the campaign with the user's words; without a segment the report goes to
/// `docs/campaign.md`.
pub(crate) fn campaign(words: impl Iterator<Item = OsString>) -> Result<()> {
    let words: Vec<_> = words.collect();
    let whole = !words.iter().any(|word| word == "--segment");
    timed("the campaign", || {
        let mut command = cargo();
        command.args(["run", "--release", "--quiet", "--package", "hapterra-tests"]);
        command
            .args(["--bin", "hapterra-campaign", "--"])
            .args(&words);
        if whole {
            command.arg("--report").arg(root().join("docs/campaign.md"));
        }
        run(&mut command)
    })
}
