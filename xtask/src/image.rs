//! Building the boards' images.

use std::path::PathBuf;

use anyhow::Result;

use crate::board::{Board, EMULATED};
use crate::run::run;
use crate::setup::toolchain::{TARGET, Toolchain};

/// Builds the image of `board` and returns the path of its ELF.
///
/// All boards share a target directory: cargo separates builds of a crate with other features, so
/// they do not overwrite each other.
pub(crate) fn build(toolchain: Toolchain, board: &Board) -> Result<PathBuf> {
    build_binary(toolchain, board, board.name)
}

/// Builds the image that counts instructions on the emulated board.
pub(crate) fn build_counts(toolchain: Toolchain) -> Result<PathBuf> {
    build_binary(toolchain, EMULATED, COUNTS)
}

/// The binary that counts instructions, and the variable with its path for tests.
pub(crate) const COUNTS: &str = "mps2-an386-counts";
pub(crate) const COUNTS_VARIABLE: &str = "HAPTERRA_MPS2_COUNTS_ELF";

fn build_binary(toolchain: Toolchain, board: &Board, binary: &str) -> Result<PathBuf> {
    let mut command = toolchain.cargo("build");
    command.arg("--release").args(package_words(board, binary));
    run(&mut command)?;
    let folder = toolchain.target_dir().join(TARGET).join("release");
    Ok(folder.join(binary))
}

/// Returns the arguments that select a binary of the firmware, built for a board.
pub(crate) fn package_words(board: &Board, binary: &str) -> [String; 6] {
    [
        "--package".into(),
        "hapterra-firmware".into(),
        "--no-default-features".into(),
        "--features".into(),
        format!("board-{}", board.name),
        format!("--bin={binary}"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::BOARDS;

    #[test]
    fn feature_and_binary_follow_the_board() {
        let line = package_words(&BOARDS[1], BOARDS[1].name).join(" ");
        assert_eq!(
            line,
            "--package hapterra-firmware --no-default-features --features board-nucleo-g474re --bin=nucleo-g474re"
        );
        assert_eq!(
            package_words(EMULATED, COUNTS)[4..],
            ["board-mps2-an386", "--bin=mps2-an386-counts"]
        );
    }
}
