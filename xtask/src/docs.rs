//! `cargo xtask docs`: the book beside what it is of.

use std::process::Command;

use anyhow::Result;

use crate::run::{cargo, on_path, root, run, say, timed};

/// Programs that test the pages.
const TESTS: [&str; 6] = [
    "--test",
    "reference",
    "--test",
    "docs",
    "--test",
    "command_lines",
];

/// Compares the generated pages with the code, or writes them; checks figures, links, tables and
/// command lines of all pages; builds the book where mdBook is installed.
///
/// # Errors
/// What differs.
pub(crate) fn docs(write: bool) -> Result<()> {
    let mut tests = cargo();
    // Of the whole workspace, with the features of `cargo xtask test`, so that nothing is built twice.
    tests
        .args(["test", "--workspace", "--features", "hapterra/probe"])
        .args(TESTS)
        .env("HAPTERRA_DOCS", if write { "write" } else { "check" });
    timed("checking the pages", || run(&mut tests))?;
    match on_path("mdbook") {
        Some(mdbook) => timed("building the book", || {
            run(Command::new(mdbook).arg("build").arg(root().join("docs")))
        }),
        None => {
            say("mdBook NOT FOUND: book not built; to build it: cargo install mdbook");
            Ok(())
        }
    }
}
