//! The boards the firmware is built for, and what of them is here: their USB
//! links, debug probes, their images and, with the feature `probe`, the way of
//! an image onto a chip.

mod checkout;
#[cfg(feature = "probe")]
mod flash;
#[cfg(feature = "probe")]
mod image;
mod probes;

pub use checkout::{BuildError, Checkout};
#[cfg(feature = "probe")]
pub use flash::{FlashError, Flashed, Progress, flash};
#[cfg(feature = "probe")]
pub use image::{Image, ImageError, Placed};
pub use probes::{Probe, probes};

/// A board that there is firmware for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Board {
    /// Its name, which is also its image's.
    pub name: &'static str,
    /// What probe-rs calls its chip; none for a board that is only emulated.
    pub chip: Option<&'static str>,
    /// What it is.
    pub what: &'static str,
}

/// Every board.
pub const BOARDS: [Board; 4] = [
    Board {
        name: "mps2-an386",
        chip: None,
        what: "Cortex-M4F at 25 MHz, emulated by QEMU",
    },
    Board {
        name: "nucleo-g474re",
        chip: Some("STM32G474RETx"),
        what: "Cortex-M4F at 170 MHz, three on-chip converters for amplifiers",
    },
    Board {
        name: "nucleo-h743zi2",
        chip: Some("STM32H743ZITx"),
        what: "Cortex-M7 at 480 MHz, three duty cycles for amplifiers",
    },
    Board {
        name: "nucleo-h743zi2-spi",
        chip: Some("STM32H743ZITx"),
        what: "the same with a quad ±10 V converter on SPI (AD5754R)",
    },
];

impl Board {
    /// The board called `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}
