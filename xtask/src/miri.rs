//! `cargo xtask miri`: core's tests under Miri, if it is available.

use anyhow::Result;

use crate::nightly;
use crate::run::{report, root, run, target_dir, timed};

/// Parts of the names of tests that simulate an arm for seconds to hours, tick by tick. The other
/// tests use fewer cases under Miri (core's `cases`).
const LONG: [&str; 6] = [
    "guard::tests",
    "guard::thermal",
    "guard::stall",
    "guard::jog",
    "velocity::tests",
    "tick::tests",
];

/// Runs the tests; reports if Miri is not installed and cannot be installed.
pub(crate) fn miri() -> Result<()> {
    if let Err(why) = nightly::ready(&["miri", "--version"], "miri,rust-src") {
        report(format!("skipped: no Miri: {why:#}"));
        return Ok(());
    }
    timed("core's tests under Miri", || {
        run(
            nightly::cargo(&["miri", "test", "--package", "hapterra-core"])
                .current_dir(root())
                // On x86 its square root is inline assembly, which Miri does not support.
                .args(["--features", "libm/force-soft-floats", "--lib", "--"])
                .args(LONG.iter().flat_map(|name| ["--skip", name]))
                .env("CARGO_TARGET_DIR", target_dir().join("miri")),
        )
    })
}
