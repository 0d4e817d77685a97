//! Commands as voltages of the chip's own converters.

use embassy_stm32::dac::{Ch1, Dac, DacChannel};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{DAC1, DAC2, PA4, PA5, PA6};
use embassy_stm32::{Peri, pac};
use hapterra_firmware::amplifier::{CurrentOutputs, offset_code};

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-g474re";

/// Three converters, buffered, each behind an offset stage: the middle of the range is no
/// current.
pub(crate) struct Outputs {
    /// Keeps the channels as they were set up.
    _channels: [DacChannel<'static, Blocking>; 3],
}

pub(crate) fn new(
    dac1: Peri<'static, DAC1>,
    first: Peri<'static, PA4>,
    second: Peri<'static, PA5>,
    dac2: Peri<'static, DAC2>,
    third: Peri<'static, PA6>,
) -> Outputs {
    let (first, second) = Dac::new_blocking(dac1, first, second).split();
    let third = DacChannel::new_blocking::<_, Ch1>(dac2, third);
    Outputs {
        _channels: [first, second, third],
    }
}

impl CurrentOutputs for Outputs {
    /// Writes the registers: embassy's own way asserts the channel's number at each
    /// write, and nothing in a tick may panic.
    fn set(&mut self, fractions: [f32; 3]) {
        let [first, second, third] = fractions.map(offset_code);
        pac::DAC1.dhr12r(0).write(|w| w.set_dhr(first));
        pac::DAC1.dhr12r(1).write(|w| w.set_dhr(second));
        pac::DAC2.dhr12r(0).write(|w| w.set_dhr(third));
    }
}

/// Whether the outputs have failed: a converter on the chip cannot tell.
pub(crate) const fn failed() -> bool {
    false
}

/// Whether the outputs are not as they were set: a converter on the chip cannot tell.
pub(crate) const fn not_as_set() -> bool {
    false
}
