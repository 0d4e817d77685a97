//! Licences, bans, sources and advisories of the dependencies, by cargo-deny.

use std::process::Stdio;

use anyhow::{Context, Result};

use crate::run::{cargo, output, run, say};

/// Installed where it is missing; about a minute and a half on two cores.
const INSTALL: [&str; 4] = ["install", "cargo-deny@^0.20", "--locked", "--quiet"];

/// Holds the dependencies to deny.toml. Advisories are held too where their
/// database can be reached.
pub(crate) fn check() -> Result<()> {
    if output(cargo().args(["deny", "--version"])).is_none() {
        say("cargo-deny is not here; installing it with `cargo install` (once, a minute or two)");
        run(cargo().args(INSTALL)).context("type: cargo install cargo-deny --locked")?;
    }
    run(cargo().args([
        "deny",
        "--log-level",
        "error",
        "check",
        "bans",
        "licenses",
        "sources",
    ]))?;
    let mut fetch = cargo();
    fetch
        .args(["deny", "fetch", "db"])
        .stderr(Stdio::null())
        .stdout(Stdio::null());
    if run(&mut fetch).is_err() {
        say("advisories skipped: their database cannot be reached from here");
        return Ok(());
    }
    run(cargo().args([
        "deny",
        "--log-level",
        "error",
        "check",
        "--disable-fetch",
        "advisories",
    ]))
}
