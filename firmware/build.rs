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
    println!("cargo::rustc-link-search={}", out.display());
    for script in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={script}");
    }
}

fn is_enabled(board: &str) -> bool {
    let feature = board.to_uppercase().replace('-', "_");
    env::var_os(format!("CARGO_FEATURE_BOARD_{feature}")).is_some()
}
