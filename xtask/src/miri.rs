//! `cargo xtask miri`: core's tests under Miri, where it can run.

use std::process::Command;

use anyhow::Result;

use crate::run::{output, root, run, say, target_dir, timed};

/// Parts of the names of tests that sweep over so much that Miri would take
/// hours, or arm a device for thousands of ticks.
const LONG: [&str; 26] = [
    "within_two_millionths",
    "warm_started_it",
    "a_saddle_is_no_answer",
    "contact::tests::holds",
    "the_first_crossing_is_found",
    "steep_ways_in",
    "the_quick_ways_carry",
    "the_rough_look",
    "agrees_with_a_dense_search",
    "shifting_the_scene",
    "ends_where_the_general",
    "continuous_across_every_border",
    "guard::thermal",
    "at_any_rate",
    "that_works_hard",
    "for_ever",
    "over_the_workspace",
    "of_the_workspace",
    "singular",
    "trig::tests",
    "velocity::tests",
    "stillness::tests",
    "clear_means_clear",
    "guard::tests",
    "tick::tests",
    "a_small_window_feels",
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
