//! `cargo xtask campaign`: the closed-loop campaign at full speed.

use std::ffi::OsString;
use std::process::Command;

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
            if let Some(commit) = commit() {
                command.arg("--commit").arg(commit);
            }
        }
        run(&mut command)
    })
}

/// What the source is, if git knows: the report says so.
fn commit() -> Option<String> {
    let said = |words: &[&str]| {
        let output = Command::new("git").args(words).current_dir(root()).output();
        let output = output.ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = said(&["rev-parse", "--short", "HEAD"])?;
    // The report itself may be there, not committed yet.
    let changed = said(&[
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        ":!docs",
    ])?;
    Some(match changed.is_empty() {
        true => commit,
        false => format!("{commit}, changed"),
    })
}
