//! `hapterra flash`: an image onto a board, through its debug probe.

use std::path::PathBuf;

use clap::ValueHint;

use super::failure::Failure;
use crate::board::{BOARDS, Board};

/// Arguments of `hapterra flash`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The board: nucleo-g474re, nucleo-h743zi2 or nucleo-h743zi2-spi
    #[arg(long, value_name = "BOARD", value_parser = parse_board)]
    pub board: &'static Board,

    /// Its image [default: built from the checkout that this is run in]
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    pub image: Option<PathBuf>,

    /// The debug probe, where there are several (`hapterra list` names them)
    #[arg(long, value_name = "VID:PID[:SERIAL]")]
    pub probe: Option<String>,

    /// Only hold the image against the chip's memories; needs no probe
    #[arg(long)]
    pub check: bool,
}

fn parse_board(text: &str) -> Result<&'static Board, String> {
    let flashable = BOARDS.iter().filter(|board| board.chip.is_some());
    let names: Vec<_> = flashable.map(|board| board.name).collect();
    match Board::named(text) {
        Some(board) if board.chip.is_some() => Ok(board),
        Some(_) => Err(format!(
            "{text} is emulated, `hapterra demo` runs it; boards to flash are {}",
            names.join(", ")
        )),
        None => Err(format!("boards to flash are {}", names.join(", "))),
    }
}

/// Writes the image.
///
/// # Errors
/// No image, one for another chip, no probe, or a chip that does not answer.
#[cfg(feature = "probe")]
pub fn run(args: &Args) -> Result<(), Failure> {
    through_a_probe::run(args)
}

/// This command was built without the part that talks to probes.
///
/// # Errors
/// Always, with how to get it.
#[cfg(not(feature = "probe"))]
pub fn run(args: &Args) -> Result<(), Failure> {
    Err(Failure::new(format!(
        "cannot flash {}: this hapterra was built without debug probes",
        args.board.name
    ))
    .hint(WITHOUT))
}

/// How to get what was left out.
#[cfg(not(feature = "probe"))]
pub(super) const WITHOUT: &str = "in a checkout type: cargo install --path host-tools --features probe; or, with probe-rs' own command (cargo install probe-rs-tools --locked): cargo xtask flash BOARD";

#[cfg(feature = "probe")]
mod through_a_probe {
    use std::path::PathBuf;

    use super::super::failure::{Failure, OrHint};
    use super::super::terminal::progress;
    use super::Args;
    use crate::board::{Checkout, Image, flash};

    pub(super) fn run(args: &Args) -> Result<(), Failure> {
        let path = image(args)?;
        let image = Image::read(args.board, &path)?;
        println!("image          {}", path.display());
        for place in &image.placed {
            let (start, bytes) = (place.memory.start, place.bytes);
            let all = place.memory.end - start;
            let kind = if place.is_flash { "flash" } else { "RAM" };
            println!("{kind:<14} {bytes} of {all} bytes at {start:#010x}");
        }
        if args.check {
            return Ok(());
        }
        let bar = progress::bar(Some(0), "{bar:30} {bytes} of {total_bytes}");
        let flashed = flash(&image, args.probe.as_deref(), &mut |progress| {
            bar.set_length(progress.of);
            bar.set_position(progress.done);
        });
        bar.finish_and_clear();
        let flashed = flashed?;
        println!("probe          {}", flashed.probe);
        println!(
            "written        {} bytes to {}, read back and equal; it was started",
            flashed.bytes, args.board.name
        );
        Ok(())
    }

    fn image(args: &Args) -> Result<PathBuf, Failure> {
        if let Some(path) = &args.image {
            return Ok(path.clone());
        }
        let here = std::env::current_dir().map_err(Failure::new)?;
        let checkout = Checkout::around(&here)
            .ok_or_else(|| {
                let (board, here) = (args.board.name, here.display());
                format!("no image of {board}: looked for the project's source around {here}")
            })
            .or_hint("name one with --image ELF, or run this inside a checkout")?;
        let built = checkout.build(args.board);
        built.or_hint("what cargo said above tells why")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_boards_that_can_be_flashed_are_taken() {
        assert!(parse_board("nucleo-g474re").is_ok());
        let refused = |name| parse_board(name).expect_err("refused");
        assert!(refused("mps2-an386").contains("emulated"));
        assert!(refused("uno").contains("nucleo-h743zi2"));
    }
}
