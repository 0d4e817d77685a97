//! The boards that there is firmware for.

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
    Board::new("mps2-an386", None, "Cortex-M4F at 25 MHz, emulated by QEMU"),
    Board::new(
        "nucleo-g474re",
        Some("STM32G474RETx"),
        "Cortex-M4F at 170 MHz, three on-chip converters for amplifiers",
    ),
    Board::new(
        "nucleo-h743zi2",
        Some("STM32H743ZITx"),
        "Cortex-M7 at 480 MHz, three duty cycles for amplifiers",
    ),
    Board::new(
        "nucleo-h743zi2-spi",
        Some("STM32H743ZITx"),
        "the same with a quad ±10 V converter on SPI (AD5754R)",
    ),
];

impl Board {
    const fn new(name: &'static str, chip: Option<&'static str>, what: &'static str) -> Self {
        Self { name, chip, what }
    }

    /// The board called `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}
