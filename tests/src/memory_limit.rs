//! Runs of the program in bounded memory, and files that would need more.

use std::path::Path;
use std::process::{Command, Output};

use crate::hapterra_binary;

/// Address space of a child that reads 256 MB of terrain, KiB: the program itself needs about 100
/// MB of it.
pub const MAX_KIB: u32 = 400_000;

/// Runs `hapterra info` on a file with these options in [`MAX_KIB`] of address space.
///
/// # Panics
/// If it does not start.
pub fn info(path: &Path, options: &[&str]) -> Output {
    command(path, options).output().expect("it runs")
}

/// Same as [`info`], without GDAL: the project's own readers answer.
///
/// # Panics
/// Like [`info`].
pub fn info_without_gdal(path: &Path, options: &[&str]) -> Output {
    let mut command = command(path, options);
    // The name of no library.
    command.env("GDAL_LIBRARY", "none");
    command.output().expect("it runs")
}

fn command(path: &Path, options: &[&str]) -> Command {
    let mut command = match cfg!(unix) {
        true => {
            let mut shell = Command::new("sh");
            let limited = format!("ulimit -v {MAX_KIB}; exec \"$0\" info \"$@\"");
            shell.arg("-c").arg(limited).arg(hapterra_binary());
            shell
        }
        false => {
            let mut binary = Command::new(hapterra_binary());
            binary.arg("info");
            binary
        }
    };
    command.args(options).arg(path);
    command
}

/// Returns a Zstandard frame of one byte, repeated `blocks` times 128 KiB.
pub fn zstd_bomb(blocks: usize) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x58];
    for block in 0..blocks {
        let is_last = u32::from(block + 1 == blocks);
        let header = ((128 * 1024) << 3) | (1 << 1) | is_last;
        frame.extend(&header.to_le_bytes()[..3]);
        frame.push(7);
    }
    frame
}
