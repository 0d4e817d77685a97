//! Licences, bans, sources and advisories of the dependencies, by cargo-deny.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::run::{cargo, on_path, report, root, run, run_quietly, target_dir};

/// The workspaces, each with a lock file.
const WORKSPACES: [&str; 4] = [
    "Cargo.toml",
    "fuzz/Cargo.toml",
    "python/Cargo.toml",
    "view/Cargo.toml",
];

/// Result of the check against the database of advisories.
#[must_use]
pub(crate) enum Advisories {
    /// There is no advisory.
    Checked,
    /// Reason why it was not made.
    NotChecked(String),
}

impl Advisories {
    /// Reports dependencies that were not checked.
    pub(crate) fn report(self) {
        if let Some(line) = self.not_checked() {
            report(line);
        }
    }

    /// Returns the line of a summary if they were not checked.
    pub(crate) fn not_checked(self) -> Option<String> {
        match self {
            Self::Checked => None,
            Self::NotChecked(why) => Some(format!("advisories NOT CHECKED: {why}")),
        }
    }
}

/// Checks the dependencies of all workspaces against deny.toml.
pub(crate) fn check_all() -> Result<()> {
    let mut advisories = Advisories::Checked;
    for workspace in WORKSPACES {
        advisories = check(workspace)?;
    }
    advisories.report();
    Ok(())
}

/// Checks the dependencies of a workspace, stated by its manifest, against deny.toml.
pub(crate) fn check(manifest: &str) -> Result<Advisories> {
    let program = ready()?;
    report(format!("the dependencies of {manifest}"));
    let deny = |words: &[&str]| {
        let of = ["--manifest-path", manifest, "--config", "deny.toml"];
        with(&program, &[&of, words].concat())
    };
    run(&mut deny(&["check", "bans", "licenses", "sources"]))?;
    // This updates the database; an earlier one can also be used.
    match run_quietly(&mut deny(&["fetch", "db"])) {
        Err(why) if !has_database() => Ok(Advisories::NotChecked(format!(
            "their database cannot be fetched: {}",
            last_line(&format!("{why:#}"))
        ))),
        _ => {
            run(&mut deny(&["--offline", "check", "advisories"]))?;
            Ok(Advisories::Checked)
        }
    }
}

/// Returns true if this machine has cargo-deny's database of advisories.
fn has_database() -> bool {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let databases = home.and_then(|home| home.join("advisory-dbs").read_dir().ok());
    // A failed fetch leaves an empty folder, or a lock.
    let mut entries = databases.into_iter().flatten().flatten();
    entries.any(|entry| entry.path().join("crates").is_dir())
}

/// Returns the reason of a program's failure: its last line.
fn last_line(text: &str) -> &str {
    let mut lines = text.lines().rev().map(str::trim);
    lines.find(|line| !line.is_empty()).unwrap_or_default()
}

fn with(program: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command
        .current_dir(root())
        .args(["--log-level", "error"])
        .args(words);
    command
}

/// Returns the user's cargo-deny, else this workspace's own.
fn ready() -> Result<PathBuf> {
    if let Some(found) = on_path("cargo-deny") {
        return Ok(found);
    }
    let tools = target_dir().join("tools");
    let program = format!("cargo-deny{}", std::env::consts::EXE_SUFFIX);
    let own = tools.join("bin").join(program);
    if own.is_file() {
        return Ok(own);
    }
    report("cargo-deny is not here; building one under target/ (once, about a minute)");
    let mut install = cargo();
    install
        .args([
            "install",
            "cargo-deny@^0.20",
            "--locked",
            "--quiet",
            "--root",
        ])
        .arg(&tools);
    // It runs for only a second, so the time to compile it matters more than its speed.
    for (setting, value) in [
        ("OPT_LEVEL", "0"),
        ("LTO", "off"),
        ("CODEGEN_UNITS", "16"),
        ("DEBUG", "0"),
    ] {
        install.env(format!("CARGO_PROFILE_RELEASE_{setting}"), value);
    }
    run(&mut install).context("type: cargo install cargo-deny --locked")?;
    Ok(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_lock_files_of_the_project_are_checked() {
        let lock = |manifest: &&str| root().join(manifest).with_extension("lock").is_file();
        assert!(WORKSPACES.iter().all(lock));
        let folders = root().read_dir().expect("a folder").flatten();
        let locked = folders.filter(|entry| entry.path().join("Cargo.lock").is_file());
        assert_eq!(locked.count() + 1, WORKSPACES.len());
    }

    #[test]
    fn missing_database_is_named_with_the_reason() {
        let why = last_line("`cargo-deny fetch db` failed\n  no route\n\n  to host\n");
        let line = Advisories::NotChecked(why.to_owned()).not_checked();
        assert_eq!(line.as_deref(), Some("advisories NOT CHECKED: to host"));
        assert_eq!(Advisories::Checked.not_checked(), None);
    }
}
