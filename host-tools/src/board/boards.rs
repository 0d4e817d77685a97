//! The boards that have firmware.

use super::memories::Memories;

/// A board that has firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Board {
    /// The board's name and the name of its image.
    pub name: &'static str,
    /// Name of the chip in probe-rs; `None` for a board that is only emulated.
    pub chip: Option<&'static str>,
    /// The chip's memories.
    pub memories: Option<Memories>,
    /// Chip, role and connection, for lists of boards.
    pub what: &'static str,
}

/// Every board.
pub const BOARDS: [Board; 4] = [
    Board::emulated("mps2-an386", "Cortex-M4F at 25 MHz, emulated by QEMU"),
    Board::new(
        "nucleo-g474re",
        ("STM32G474RETx", Memories::G474),
        "Cortex-M4F at 168 MHz, three on-chip converters for amplifiers",
    ),
    Board::new(
        "nucleo-h743zi2",
        ("STM32H743ZITx", Memories::H743),
        "Cortex-M7 at 456 MHz, three duty cycles for amplifiers",
    ),
    Board::new(
        "nucleo-h743zi2-spi",
        ("STM32H743ZITx", Memories::H743),
        "the same with a quad ±10 V converter on SPI (AD5754R)",
    ),
];

impl Board {
    const fn emulated(name: &'static str, what: &'static str) -> Self {
        Self {
            name,
            chip: None,
            memories: None,
            what,
        }
    }

    const fn new(
        name: &'static str,
        (chip, memories): (&'static str, Memories),
        what: &'static str,
    ) -> Self {
        Self {
            name,
            chip: Some(chip),
            memories: Some(memories),
            what,
        }
    }

    /// Returns the board called `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}
