//! `cargo xtask miri`: core's tests under Miri, where it can run.

use anyhow::Result;

use crate::nightly;
use crate::run::{root, run, say, target_dir, timed};

/// Parts of the names of tests that follow an arm for seconds to hours, tick by
/// tick. The surveys among the others do less under Miri (core's `cases`).
const LONG: [&str; 6] = [
    "guard::tests",
    "guard::thermal",
    "guard::stall",
    "guard::jog",
    "velocity::tests",
    "tick::tests",
];

/// Runs them; says visibly when Miri is not here and cannot be had.
pub(crate) fn miri() -> Result<()> {
    if let Err(why) = nightly::ready(&["miri", "--version"], "miri,rust-src") {
        say(format!("skipped: no Miri: {why:#}"));
        return Ok(());
    }
    timed("core's tests under Miri", || {
        run(
            nightly::cargo(&["miri", "test", "--package", "hapterra-core"])
                .current_dir(root())
                // Its square root is inline assembly on x86, which Miri does not know.
                .args(["--features", "libm/force-soft-floats", "--lib", "--"])
                .args(LONG.iter().flat_map(|name| ["--skip", name]))
                .env("CARGO_TARGET_DIR", target_dir().join("miri")),
        )
    })
}
