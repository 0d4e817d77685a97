//! `cargo xtask campaign`: the closed-loop campaign, or the campaign of link faults, at full speed.

use std::ffi::OsString;
use std::fs;
use std::process::Command;

use anyhow::{Context, Result};

use crate::run::{cargo, output, root, run, timed};

/// Runs the campaign with the user's arguments. Without a segment it writes the report
/// `campaign.md`, or `link-campaign.md` with `--link`, into the folder of the month in `log/`.
pub(crate) fn campaign(words: impl Iterator<Item = OsString>) -> Result<()> {
    let words: Vec<_> = words.collect();
    let page = match words.iter().any(|word| word == "--link") {
        true => "link-campaign.md",
        false => "campaign.md",
    };
    let whole = !words.iter().any(|word| word == "--segment");
    timed("the campaign", || {
        let mut command = cargo();
        command.args(["run", "--release", "--quiet", "--package", "hapterra-tests"]);
        command
            .args(["--bin", "hapterra-campaign", "--"])
            .args(&words);
        if whole {
            let folder = root().join("log").join(month());
            fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
            command.arg("--report").arg(folder.join(page));
            if let Some(commit) = commit() {
                command.arg("--commit").arg(commit);
            }
        }
        run(&mut command)
    })
}

/// Returns what git prints, if it can.
fn git(words: &[&str]) -> Option<String> {
    output(Command::new("git").args(words).current_dir(root()))
}

/// Returns the month of the last commit, such as `2026-11`, or `undated` without git.
fn month() -> String {
    let month = git(&["log", "-1", "--format=%cd", "--date=format:%Y-%m"]);
    month.map_or_else(|| "undated".to_owned(), |month| month.trim().to_owned())
}

/// Returns the commit of the source, if git has it, for the report.
fn commit() -> Option<String> {
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
