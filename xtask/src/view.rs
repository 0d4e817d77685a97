//! `cargo xtask view`: the viewer, which is a workspace of its own.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::board::EMULATED;
use crate::deny;
use crate::emulation::emulation;
use crate::run::{built, cargo, on_path, report, root, run, tested_programs, timed};
use crate::setup::packages::{self, found_or_installed};

/// Variable with the browser for the page's tests.
pub(crate) const BROWSER: &str = "HAPTERRA_BROWSER";
/// Names of browsers that can be controlled.
const BROWSERS: [&str; 5] = [
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// Returns cargo in the viewer's workspace. Its build results are beside `hapterra`.
fn viewers(words: &[&str]) -> Command {
    let mut command = cargo();
    command.current_dir(root().join("view")).args(words);
    command
}

/// Builds the viewer and returns its path. The first build takes many minutes.
pub(crate) fn build() -> Result<PathBuf> {
    timed(
        "building the viewer (some ten minutes the first time)",
        || run(&mut viewers(&["build", "--release", "--locked"])),
    )?;
    Ok(built("release", "hapterra-view"))
}

/// Lints the viewer, checks its dependencies against `deny.toml`, and runs its tests with
/// `hapterra` beside them; the page's in a browser if there is one or one can be installed. They
/// are separate from the other tests, so that only users of the viewer build it.
pub(crate) fn test() -> Result<()> {
    timed("linting the viewer", lint)?;
    timed("checking the viewer's dependencies", || {
        deny::check("view/Cargo.toml")
    })?
    .report();
    let mut tests = tests()?;
    match browser() {
        Ok(browser) => drop(tests.env(BROWSER, browser)),
        Err(why) => report(format!("SKIPPED: the page in a browser: {why:#}")),
    }
    match emulation() {
        Ok(board) => drop(
            tests
                .env(EMULATED.elf_variable, board.image)
                .env("HAPTERRA_QEMU", board.qemu),
        ),
        Err(why) => report(format!("SKIPPED: the page of the emulated board: {why:#}")),
    }
    timed("running the viewer's tests", || run(&mut tests))
}

/// Takes the documentation's pictures of the live view, of the demo's own terrain.
pub(crate) fn pictures() -> Result<()> {
    let mut tests = tests()?;
    tests
        .args(["--test", "pictures", "--", "--ignored"])
        .env(BROWSER, browser()?)
        .env("HAPTERRA_PICTURES", root().join("docs"));
    timed("taking pictures of the live view", || run(&mut tests))
}

/// Returns the viewer's tests, with `hapterra` and `hapterra-lab` beside them.
fn tests() -> Result<Command> {
    let mut tests = viewers(&["test", "--release", "--locked"]);
    let [hapterra, lab] = tested_programs()?;
    tests.env("HAPTERRA", hapterra).env("HAPTERRA_LAB", lab);
    Ok(tests)
}

/// Returns a browser that can be controlled; installs one if there is none.
pub(crate) fn browser() -> Result<PathBuf> {
    if let Some(given) = std::env::var_os(BROWSER) {
        return Ok(given.into());
    }
    let find = || {
        let found = BROWSERS.iter().find_map(|name| on_path(name));
        found.context("there is no Chromium on the PATH")
    };
    found_or_installed(find, &packages::BROWSER)
}

/// Checks formatting of the viewer and runs clippy. Clippy compiles only the viewer's own crate in
/// place of the compiler. The crates below it are compiled once, for this and for the tests; a
/// check of them for clippy would take three minutes.
fn lint() -> Result<()> {
    run(&mut viewers(&["fmt", "--check"])).context("type: cd view && cargo fmt")?;
    let mut clippy = viewers(&["test", "--release", "--locked", "--no-run"]);
    run(clippy.env("RUSTC_WORKSPACE_WRAPPER", "clippy-driver"))
}
