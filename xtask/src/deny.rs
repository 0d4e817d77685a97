//! Licences, bans, sources and advisories of the dependencies, by cargo-deny.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::run::{cargo, on_path, root, run, say, target_dir};

/// Holds the dependencies to deny.toml. Advisories are held too where their
/// database can be reached.
pub(crate) fn check() -> Result<()> {
    let program = ready()?;
    let deny = |words: &[&str]| with(&program, words);
    run(&mut deny(&["check", "bans", "licenses", "sources"]))?;
    let mut fetch = deny(&["fetch", "db"]);
    if run(fetch.stderr(Stdio::null()).stdout(Stdio::null())).is_err() {
        say("advisories skipped: their database cannot be reached from here");
        return Ok(());
    }
    run(&mut deny(&["check", "--disable-fetch", "advisories"]))
}

/// Holds another workspace to the same, by its manifest; its advisories are not looked at.
pub(crate) fn check_workspace(manifest: &str) -> Result<()> {
    let words = [
        "--manifest-path",
        manifest,
        "--config",
        "deny.toml",
        "check",
    ];
    run(with(&ready()?, &words).args(["bans", "licenses", "sources"]))
}

fn with(program: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command
        .current_dir(root())
        .args(["--log-level", "error"])
        .args(words);
    command
}

/// The user's cargo-deny, else one of this workspace's own.
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
    say("cargo-deny is not here; building one under target/ (once, about a minute)");
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
    // It runs for a second: compiling it fast counts for more than its speed.
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
