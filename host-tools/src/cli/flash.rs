//! `hapterra flash`: writes an image to a board, through its debug probe or, with `--dfu`, through
//! the USB loader in its chip's ROM.

use std::path::PathBuf;

use clap::ValueHint;

use super::failure::{Failure, OrHint};
use crate::board::{BOARDS, Board, Checkout, Image};
use crate::link::DeviceAddress;

mod over_usb;
#[cfg(feature = "probe")]
mod through_a_probe;

/// Arguments of `hapterra flash`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The board: nucleo-g474re, nucleo-h743zi2 or nucleo-h743zi2-spi
    #[arg(long, value_name = "BOARD", value_parser = parse_board)]
    pub board: &'static Board,

    /// Its image [default: built from the checkout that this program was built from]
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    pub image: Option<PathBuf>,

    /// Without a debug probe: over USB, by the loader in the chip's ROM. The board has
    /// to be disarmed
    #[arg(long, conflicts_with = "probe")]
    pub dfu: bool,

    /// With --dfu: which board, where there are several: usb:SERIAL (`hapterra list`
    /// shows it)
    #[arg(long, default_value = "usb", requires = "dfu", value_parser = parse_usb)]
    pub device: DeviceAddress,

    /// The debug probe, where there are several (`hapterra list` names them)
    #[arg(long, value_name = "VID:PID[:SERIAL]")]
    pub probe: Option<String>,

    /// Only check that the image fits into the chip's memories; needs no board
    #[arg(long)]
    pub check: bool,
}

fn parse_usb(text: &str) -> Result<DeviceAddress, String> {
    match text.parse() {
        Ok(DeviceAddress::Usb(serial)) => Ok(DeviceAddress::Usb(serial)),
        _ => Err("a board to flash is usb or usb:SERIAL".into()),
    }
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
/// No image, an image for another chip or board, no connection to the board, or a chip that refuses
/// the image.
pub fn run(args: &Args) -> Result<(), Failure> {
    #[cfg(not(feature = "probe"))]
    if !args.dfu && !args.check {
        return Err(without_probes(args));
    }
    let path = image(args)?;
    let image = Image::read(args.board, &path)?;
    println!("image          {}", path.display());
    for place in &image.placed {
        let (start, bytes) = (place.memory.start, place.bytes);
        let all = place.memory.end - start;
        let kind = if place.is_flash { "flash" } else { "RAM" };
        println!("{kind:<14} {bytes} of {all} bytes at {start:#010x}");
    }
    match (args.check, args.dfu) {
        (true, _) => Ok(()),
        (_, true) => over_usb::run(args, &image),
        #[cfg(feature = "probe")]
        _ => through_a_probe::run(args, &image),
        #[cfg(not(feature = "probe"))]
        _ => Err(without_probes(args)),
    }
}

fn image(args: &Args) -> Result<PathBuf, Failure> {
    if let Some(path) = &args.image {
        return Ok(path.clone());
    }
    let checkout = Checkout::own()
        .ok_or_else(|| {
            let board = args.board.name;
            format!(
                "no image of {board}: the source that this program was built from no longer exists"
            )
        })
        .or_hint("name one with --image ELF, or rebuild this program in a checkout")?;
    println!("source         {}", checkout.root().display());
    let built = checkout.build(args.board);
    built.or_hint("see the messages of cargo above")
}

/// Returns the failure of a build without support for probes.
#[cfg(not(feature = "probe"))]
fn without_probes(args: &Args) -> Failure {
    Failure::new(format!(
        "cannot flash {} through a debug probe: this hapterra was built without them",
        args.board.name
    ))
    .hint(WITHOUT)
}

/// Hint for a build without this feature.
#[cfg(not(feature = "probe"))]
pub(super) const WITHOUT: &str = "add --dfu for an update over USB; or, in a checkout, type: cargo install --locked --path host-tools --features probe; or, with probe-rs' own command (cargo install probe-rs-tools --locked): cargo xtask flash BOARD";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emulated_and_unknown_boards_cannot_be_flashed() {
        assert!(parse_board("nucleo-g474re").is_ok());
        let refused = |name| parse_board(name).expect_err("refused");
        assert!(refused("mps2-an386").contains("emulated"));
        assert!(refused("uno").contains("nucleo-h743zi2"));
    }

    #[test]
    fn update_over_usb_accepts_only_usb_addresses() {
        let named = DeviceAddress::Usb(Some("0039001A".into()));
        assert_eq!(parse_usb("usb:0039001A"), Ok(named));
        assert!(parse_usb("native").is_err() && parse_usb("tcp:a:1").is_err());
    }
}
