//! The emergency stop, an input: the converter has no input for a stop.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::peripherals::PE15;

pub(crate) type EmergencyStop = Input<'static>;

/// Moves the pin out of the chip's peripherals, as `take_outputs` does.
macro_rules! take_stop {
    ($p:ident) => {
        crate::stop::new($p.PE15)
    };
}
pub(crate) use take_stop;

pub(crate) fn new(pin: Peri<'static, PE15>) -> EmergencyStop {
    Input::new(pin, Pull::Up)
}
