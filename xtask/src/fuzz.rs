//! `cargo xtask fuzz TARGET MINUTES`: libFuzzer on the tick, packed tiles, the wire, terrain files,
//! and the other input files.

use anyhow::{Context, Result, bail};

use crate::nightly;
use crate::run::{on_path, output, root, run, target_dir, timed};

/// The programs in `fuzz/fuzz_targets`.
const TARGETS: [&str; 5] = ["terrain", "text", "tick", "tile", "wire"];

/// Maximum bytes of an input: some hundred ticks or messages, a file with its headers.
const MAX: u32 = 4096;
/// Seconds after which an input counts as hanging.
const TIMEOUT_S: u32 = 20;

/// Fuzzes `target` for `minutes` minutes, from the inputs of earlier runs in `fuzz/corpus`. An
/// input that fails ends the run and is stored in `fuzz/artifacts`.
pub(crate) fn fuzz(target: &str, minutes: &str) -> Result<()> {
    if !TARGETS.contains(&target) {
        bail!(
            "there is no target {target}; there are: {}",
            TARGETS.join(", ")
        );
    }
    let seconds = seconds(minutes)?;
    // For its sanitizers.
    nightly::ready(&["--version"], "")?;
    has_cargo_fuzz()?;
    if on_path("c++").is_none() {
        bail!("libFuzzer requires a C++ compiler; on Debian: apt-get install g++");
    }
    timed(&format!("fuzzing {target} for {minutes} minutes"), || {
        run(
            nightly::cargo(&["fuzz", "run", "--fuzz-dir", ".", target, "--"])
                .current_dir(root().join("fuzz"))
                .arg(format!("-max_total_time={seconds}"))
                .arg(format!("-max_len={MAX}"))
                .arg(format!("-timeout={TIMEOUT_S}"))
                .arg("-print_final_stats=1")
                .env("CARGO_TARGET_DIR", target_dir()),
        )
    })
}

fn seconds(minutes: &str) -> Result<u64> {
    let valid = minutes.parse().ok().filter(|m: &f64| *m > 0.0);
    let minutes = valid.with_context(|| format!("{minutes} is no number of minutes"))?;
    Ok((60.0 * minutes).ceil() as u64)
}

fn has_cargo_fuzz() -> Result<()> {
    if output(&mut nightly::cargo(&["fuzz", "--version"])).is_some() {
        return Ok(());
    }
    timed("installing: cargo install cargo-fuzz --locked", || {
        run(&mut nightly::cargo(&["install", "cargo-fuzz", "--locked"]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_match_those_of_the_fuzz_crate() {
        let mut found: Vec<_> = std::fs::read_dir(root().join("fuzz/fuzz_targets"))
            .expect("a folder")
            .map(|entry| entry.expect("readable").path())
            .map(|path| {
                path.file_stem()
                    .expect("a name")
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        found.sort();
        assert_eq!(found, TARGETS);
    }

    #[test]
    fn invalid_arguments_are_refused() {
        assert_eq!(seconds("0.5").unwrap(), 30);
        assert!(seconds("0").is_err() && seconds("soon").is_err());
        let message = fuzz("tock", "1").unwrap_err().to_string();
        assert!(
            message.contains("terrain, text, tick, tile, wire"),
            "{message}"
        );
    }
}
