//! The parts of a chip that the application uses, set up by `chip.rs`.

use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::gpio::Output;
use embassy_stm32::{Peri, PeripheralType};

use super::clock::TickTimer;

/// The parts of a chip with outputs `O`, encoders `E`, a USB driver `U` and a watchdog
/// `W`.
pub(crate) struct Parts<O, E, U, W: PeripheralType + 'static> {
    /// The amplifiers' enable pin, low.
    pub(crate) enable: Output<'static>,
    pub(crate) outputs: O,
    pub(crate) encoders: E,
    pub(crate) flash: Flash<'static, Blocking>,
    pub(crate) timer: Peri<'static, TickTimer>,
    pub(crate) usb: U,
    pub(crate) watchdog: Peri<'static, W>,
    pub(crate) led: Output<'static>,
    /// Changes its level in each tick that leaves the amplifiers on.
    pub(crate) heartbeat: Output<'static>,
}
