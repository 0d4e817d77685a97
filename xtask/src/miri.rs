//! `cargo xtask miri`: core's tests under Miri, where it can run.

use std::process::Command;

use anyhow::Result;

use crate::run::{output, root, run, say, target_dir, timed};

/// Parts of the names of tests that follow an arm for seconds to hours, tick by
/// tick. The surveys among the others do less under Miri (core's `cases`).
const LONG: [&str; 5] = [
    "guard::tests",
    "guard::thermal",
    "guard::stillness",
    "velocity::tests",
    "tick::tests",
];

/// Runs them; says visibly when Miri is not here and cannot be had.
pub(crate) fn miri() -> Result<()> {
    if !is_here() && !install() {
        say("skipped: no Miri: type `rustup toolchain install nightly --component miri,rust-src`");
        return Ok(());
    }
    timed("core's tests under Miri", || {
        let mut command = Command::new("cargo");
        command
            .current_dir(root())
            .args(["+nightly", "miri", "test", "--package", "hapterra-core"])
            // Its square root is inline assembly on x86, which Miri does not know.
            .args(["--features", "libm/force-soft-floats", "--lib", "--"])
            .args(LONG.iter().flat_map(|name| ["--skip", name]))
            // The tests leak their tiles on purpose: a window borrows them for ever.
            .env("MIRIFLAGS", "-Zmiri-ignore-leaks")
            .env("CARGO_TARGET_DIR", target_dir().join("miri"))
            .env_remove("CARGO")
            .env_remove("RUSTUP_TOOLCHAIN");
        run(&mut command)
    })
}

fn is_here() -> bool {
    let mut ask = Command::new("cargo");
    ask.args(["+nightly", "miri", "--version"])
        .env_remove("RUSTUP_TOOLCHAIN");
    output(&mut ask).is_some()
}

fn install() -> bool {
    say("installing: rustup component add --toolchain nightly miri rust-src");
    let words = [
        "component",
        "add",
        "--toolchain",
        "nightly",
        "miri",
        "rust-src",
    ];
    output(Command::new("rustup").args(words)).is_some() && is_here()
}
