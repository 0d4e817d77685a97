//! Building the boards' images.

use std::path::PathBuf;

use anyhow::Result;

use crate::board::{Board, EMULATED};
use crate::run::run;
use crate::setup::toolchain::{TARGET, Toolchain};

/// Builds the image of `board` and gives the path of its ELF.
///
/// All boards share a target directory: cargo keeps the same crate with other
/// features apart, so they do not undo each other's work.
pub(crate) fn build(toolchain: Toolchain, board: &Board) -> Result<PathBuf> {
    build_binary(toolchain, package_words(board), board.name)
}

/// Builds the image that counts instructions on the emulated board.
pub(crate) fn build_counts(toolchain: Toolchain) -> Result<PathBuf> {
    build_binary(toolchain, counts_words(), COUNTS)
}

fn build_binary(toolchain: Toolchain, words: [String; 6], name: &str) -> Result<PathBuf> {
    let mut command = toolchain.cargo("build");
    command.arg("--release").args(words);
    run(&mut command)?;
    let folder = toolchain.target_dir().join(TARGET).join("release");
    Ok(folder.join(name))
}

/// Binary that counts instructions, and the variable that tells tests where it is.
const COUNTS: &str = "mps2-an386-counts";
pub(crate) const COUNTS_VARIABLE: &str = "HAPTERRA_MPS2_COUNTS_ELF";

/// The words that choose the counting binary.
pub(crate) fn counts_words() -> [String; 6] {
    let mut words = package_words(EMULATED);
    words[5] = format!("--bin={COUNTS}");
    words
}

/// The words that choose a board's binary.
pub(crate) fn package_words(board: &Board) -> [String; 6] {
    let words = [
        "--package",
        "hapterra-firmware",
        "--no-default-features",
        "--features",
    ];
    let [package, firmware, bare, features] = words.map(String::from);
    let feature = format!("board-{}", board.name);
    [
        package,
        firmware,
        bare,
        features,
        feature,
        format!("--bin={}", board.name),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::BOARDS;

    #[test]
    fn the_feature_and_the_binary_follow_the_board() {
        let line = package_words(&BOARDS[1]).join(" ");
        assert_eq!(
            line,
            "--package hapterra-firmware --no-default-features --features board-nucleo-g474re --bin=nucleo-g474re"
        );
        assert_eq!(
            counts_words()[4..],
            ["board-mps2-an386", "--bin=mps2-an386-counts"]
        );
    }
}
