//! `hapterra flash`: an image onto a board, through its debug probe.

use std::path::PathBuf;

use clap::ValueHint;

use super::Failure;
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

    use indicatif::{ProgressBar, ProgressStyle};

    use super::super::Failure;
    use super::Args;
    use crate::board::{Checkout, FlashError, Image, ImageError, flash};

    pub(super) fn run(args: &Args) -> Result<(), Failure> {
        let path = image(args)?;
        let image = Image::read(args.board, &path).map_err(explain_image)?;
        println!("image          {}", path.display());
        for place in &image.placed {
            println!(
                "{:<14} {} of {} bytes at {:#010x}",
                if place.is_flash { "flash" } else { "RAM" },
                place.bytes,
                place.memory.end - place.memory.start,
                place.memory.start
            );
        }
        if args.check {
            return Ok(());
        }
        let bar = ProgressBar::new(0).with_style(style());
        let flashed = flash(&image, args.probe.as_deref(), &mut |progress| {
            bar.set_length(progress.of);
            bar.set_position(progress.done);
        });
        bar.finish_and_clear();
        let flashed = flashed.map_err(explain)?;
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
        let Some(checkout) = Checkout::around(&here) else {
            let board = args.board.name;
            return Err(Failure::new(format!(
                "no image of {board}: looked for the project's source around {}",
                here.display()
            ))
            .hint("name one with --image ELF, or run this inside a checkout"));
        };
        checkout
            .build(args.board)
            .map_err(|error| Failure::new(error).hint("what cargo said above tells why"))
    }

    fn style() -> ProgressStyle {
        // The template is constant; the default style is no worse a fallback.
        ProgressStyle::with_template("{bar:30} {bytes} of {total_bytes}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
    }

    fn explain_image(error: ImageError) -> Failure {
        let hint = match &error {
            ImageError::Emulated(_) => "`hapterra demo` runs it",
            ImageError::Unreadable { .. } => "check the path given with --image",
            ImageError::NoImage { .. } => {
                "name the ELF that `cargo xtask image BOARD` prints with --image"
            }
            ImageError::OutOfMemory { .. } => {
                "it was built for another board: name the right one with --board"
            }
            ImageError::OtherBoard { found: Some(_), .. } => {
                "name the board that it was built for with --board, or another image"
            }
            ImageError::OtherBoard { found: None, .. } => {
                "images built from this source name theirs, unless they were stripped: `cargo xtask image BOARD` builds one"
            }
            ImageError::UnknownChip(..) => "this should not happen: please report it",
        };
        Failure::new(error).hint(hint)
    }

    fn explain(error: FlashError) -> Failure {
        let hint = match &error {
            FlashError::NoProbe => {
                "plug the Nucleo's ST-LINK connector in with a data cable; `hapterra list` shows what is seen"
            }
            FlashError::NoSuchProbe { .. }
            | FlashError::ManyProbes(_)
            | FlashError::Selector(_) => "name one as --probe VID:PID:SERIAL",
            FlashError::Forbidden(_) => {
                "install probe-rs' udev rules (https://probe.rs/docs/getting-started/probe-setup/), then plug it in again"
            }
            FlashError::Probe { .. } => {
                "close other programs that use it (an IDE, probe-rs, OpenOCD), then plug it in again"
            }
            FlashError::Chip { .. } => {
                "check that the board has power, that it is the board named, and that the probe's jumpers are on"
            }
            FlashError::Write { .. } => {
                "try again; if it stays so, the chip's flash is protected or worn out"
            }
        };
        Failure::new(error).hint(hint)
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
