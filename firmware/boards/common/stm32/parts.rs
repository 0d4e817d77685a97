//! The parts of a chip that the application uses, set up by `chip.rs`.

use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::gpio::Output;
use embassy_stm32::{Peri, PeripheralType};
use hapterra_firmware::amplifier::Off;

use super::clock::TickTimer;

/// The parts of a chip with outputs `O`, encoders `E`, a USB driver `U` and a watchdog
/// `W`.
pub(crate) struct Parts<O, E, U, W: PeripheralType + 'static> {
    /// Off, without a current command. A start does this first, because after a reset the power
    /// stages may stay on for the reaction time of their enable input.
    pub(crate) amplifiers: Off<O, Output<'static>>,
    pub(crate) encoders: E,
    /// `None` if the flash is not configured as the memory map expects.
    pub(crate) flash: Option<Flash<'static, Blocking>>,
    pub(crate) timer: Peri<'static, TickTimer>,
    pub(crate) usb: U,
    pub(crate) watchdog: Peri<'static, W>,
    pub(crate) led: Output<'static>,
    /// Toggles in each tick that leaves the amplifiers on.
    pub(crate) heartbeat: Output<'static>,
    /// High for a while after each mark.
    pub(crate) mark: Output<'static>,
}
