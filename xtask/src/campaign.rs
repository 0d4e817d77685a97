//! `cargo xtask campaign`: the closed-loop campaign, or the campaign of link faults, at full speed.

use std::ffi::OsString;
use std::process::Command;

use anyhow::Result;

use crate::run::{cargo, output, root, run, timed};

/// Runs the campaign with the user's arguments. Without a segment it writes the report to
/// `log/campaign.md`, or to `log/link-campaign.md` with `--link`.
pub(crate) fn campaign(words: impl Iterator<Item = OsString>) -> Result<()> {
    let words: Vec<_> = words.collect();
    let page = match words.iter().any(|word| word == "--link") {
        true => "log/link-campaign.md",
        false => "log/campaign.md",
    };
    let whole = !words.iter().any(|word| word == "--segment");
    timed("the campaign", || {
        let mut command = cargo();
        command.args(["run", "--release", "--quiet", "--package", "hapterra-tests"]);
        command
            .args(["--bin", "hapterra-campaign", "--"])
            .args(&words);
        if whole {
            command.arg("--report").arg(root().join(page));
            if let Some(commit) = commit() {
                command.arg("--commit").arg(commit);
            }
        }
        run(&mut command)
    })
}

/// Returns the commit of the source, if git has it, for the report.
fn commit() -> Option<String> {
    let git = |words: &[&str]| output(Command::new("git").args(words).current_dir(root()));
    let commit = git(&["rev-parse", "--short", "HEAD"])?;
    // The report itself may be changed and not committed yet.
    let tracked = [
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        ":!docs",
        ":!log",
    ];
    let changed = if git(&tracked)?.trim().is_empty() {
        ""
    } else {
        ", changed"
    };
    Some(format!("{}{changed}", commit.trim()))
}
