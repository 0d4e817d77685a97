//! `cargo xtask docs`: checks the book against the code.

use std::process::Command;

use anyhow::Result;

use crate::run::{TEST_ARGUMENTS, cargo, on_path, report, root, run, timed};

/// Programs that test the pages.
const TESTS: [&str; 4] = ["--test", "reference_pages", "--test", "docs"];

/// Compares the generated pages with the code, or writes them; checks figures, links and tables of
/// all pages; builds the book if mdBook is installed. `cargo xtask test` runs the command lines.
///
/// # Errors
/// The differences.
pub(crate) fn docs(write: bool) -> Result<()> {
    let mut tests = cargo();
    tests
        .arg("test")
        .args(TEST_ARGUMENTS)
        .args(TESTS)
        .env("HAPTERRA_DOCS", if write { "write" } else { "check" });
    timed("checking the pages", || run(&mut tests))?;
    match on_path("mdbook") {
        Some(mdbook) => timed("building the book", || {
            run(Command::new(mdbook).arg("build").arg(root().join("docs")))
        }),
        None => {
            report("mdBook NOT FOUND: book not built; to build it: cargo install mdbook");
            Ok(())
        }
    }
}
