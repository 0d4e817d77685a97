//! Puts the memory map of the chosen board where the linker finds it.
//!
//! The linker runs in the workspace root and reads the `memory.x` there before
//! any `-L` copy; that file only says `INCLUDE board.x`, and this script puts
//! the right `board.x` on the search path.

use std::path::PathBuf;
use std::{env, fs};

/// The boards, by the name of their feature without `board-`.
const BOARDS: [&str; 3] = ["mps2-an386", "nucleo-g474re", "nucleo-h743zi2"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory");
    if env::var("CARGO_CFG_TARGET_ARCH").as_deref() != Ok("arm") {
        return;
    }
    let chosen: Vec<&str> = BOARDS.into_iter().filter(|b| is_enabled(b)).collect();
    let [board] = chosen[..] else {
        assert!(chosen.is_empty(), "choose one board, not {chosen:?}");
        return;
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy(format!("memory/{board}.x"), out.join("board.x")).expect("copy the memory map");
    if board == "mps2-an386" {
        // cortex-m-rt wants the names of a device crate's interrupts; this
        // board's own vector table names its handlers itself.
        fs::write(out.join("device.x"), "/* none */\n").expect("write device.x");
    }
    println!("cargo::rustc-link-search={}", out.display());
    // Page alignment would waste flash; cortex-m-rt's script; where defmt's
    // strings go in the ELF. Here and not in `.cargo/config.toml`, where a
    // RUSTFLAGS of the user's would replace them.
    for flag in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={flag}");
    }
}

fn is_enabled(board: &str) -> bool {
    let feature = board.to_uppercase().replace('-', "_");
    env::var_os(format!("CARGO_FEATURE_BOARD_{feature}")).is_some()
}
