//! Copies the memory map of the chosen board to the linker's search path.
//!
//! The linker runs in the workspace root and reads the `memory.x` there before any `-L` copy. That
//! file only contains `INCLUDE board.x`, and this script adds the right `board.x` to the search
//! path.

#[path = "build/tick_rate.rs"]
mod tick_rate;

use std::path::PathBuf;
use std::{env, fs};

/// A board: its name, which is its feature without `board-`; its memory map; and the counts of its
/// tick timer in a second, if its tick rate can be chosen.
struct Board(&'static str, &'static str, Option<u32>);

const BOARDS: [Board; 4] = [
    Board("mps2-an386", "mps2-an386", None),
    Board("nucleo-g474re", "nucleo-g474re", Some(42_000_000)),
    Board("nucleo-h743zi2", "nucleo-h743zi2", Some(57_000_000)),
    Board("nucleo-h743zi2-spi", "nucleo-h743zi2", Some(57_000_000)),
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=HAPTERRA_TICK_HZ");
    println!("cargo::rerun-if-changed=memory");
    if env::var("CARGO_CFG_TARGET_ARCH").as_deref() != Ok("arm") {
        return;
    }
    let chosen: Vec<_> = BOARDS.iter().filter(|b| is_enabled(b.0)).collect();
    let [Board(board, memory, counts_a_second)] = chosen[..] else {
        let names: Vec<_> = chosen.iter().map(|b| b.0).collect();
        assert!(names.is_empty(), "choose one board, not {names:?}");
        return;
    };
    if let Some(counts_a_second) = counts_a_second {
        let requested = env::var("HAPTERRA_TICK_HZ").ok();
        match tick_rate::tick_hz(requested.as_deref(), board, *counts_a_second) {
            Ok(hz) => println!("cargo::rustc-env=HAPTERRA_TICK_HZ={hz}"),
            Err(why) => println!("cargo::error={why}"),
        }
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy(format!("memory/{memory}.x"), out.join("board.x")).expect("copy the memory map");
    if *board == "mps2-an386" {
        // cortex-m-rt needs the interrupt names of a device crate; this board's own vector table
        // names its handlers itself.
        fs::write(out.join("device.x"), "/* none */\n").expect("write device.x");
    }
    println!("cargo::rustc-link-search={}", out.display());
    // No page alignment, which would waste flash; cortex-m-rt's script; the place of defmt's
    // strings in the ELF. Not in `.cargo/config.toml`, where a user's RUSTFLAGS would replace them.
    for flag in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={flag}");
    }
    // A symbol with the board's name, in the ELF only: `hapterra flash` checks it. The linker reads
    // a dash as a minus.
    let mark = board.replace('-', "_");
    println!("cargo::rustc-link-arg-bins=--defsym=hapterra.board.{mark}=0");
}

fn is_enabled(board: &str) -> bool {
    let feature = board.to_uppercase().replace('-', "_");
    env::var_os(format!("CARGO_FEATURE_BOARD_{feature}")).is_some()
}
