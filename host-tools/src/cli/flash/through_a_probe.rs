//! Update through a debug probe.

use super::Args;
use crate::board::{Image, flash};
use crate::cli::failure::Failure;
use crate::cli::terminal::progress;
use heightfield::printable_text::printable;

pub(super) fn run(args: &Args, image: &Image) -> Result<(), Failure> {
    let bar = progress::bar(Some(0), "{bar:30} {bytes} of {total_bytes}");
    let flashed = flash(args.board, image, args.probe.as_deref(), &mut |progress| {
        bar.set_length(progress.of);
        bar.set_position(progress.done);
    });
    bar.finish_and_clear();
    let flashed = flashed?;
    println!("probe          {}", printable(&flashed.probe));
    println!(
        "written        {} bytes to {}, read back and equal; it was started",
        flashed.bytes, args.board.name
    );
    Ok(())
}
